"""Equations of motion in SymPy; uses `motion`, and `causal` for the momenta to keep."""
