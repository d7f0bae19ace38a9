"""Motion in time, and forces in joints: simulation, transients, joint forces, kinetic energy.

Uses `sizing` and the folders below it.
"""
