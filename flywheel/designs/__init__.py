"""Many designs of a scene: sweeps, derivatives, tolerances, the best one; uses `sizing` and what is below it."""
