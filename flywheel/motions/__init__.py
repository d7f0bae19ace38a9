"""Motion in time, and forces in joints: simulation, transients, joint forces, kinetic energy.

Uses `sizing` and what is below it.
"""
