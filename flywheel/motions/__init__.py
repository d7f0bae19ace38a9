"""What follows in time or in the joints: simulation, transients, joint forces, kinetic energy.

Uses `sizing` and what is below it.
"""
