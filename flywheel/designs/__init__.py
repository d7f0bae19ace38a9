"""Many designs of a scene: sweeps, derivatives, tolerances, the best one; uses `sizing` and the folders below it."""
