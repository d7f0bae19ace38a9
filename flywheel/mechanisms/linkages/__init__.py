"""Any plane linkage: positions, mobility, joint reactions and multibody dynamics; uses `scene` and `numerics`."""
