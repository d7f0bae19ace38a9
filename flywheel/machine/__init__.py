"""From a scene to the bond graph of its machine, its loads, breakpoints and equation of motion.

Uses `mechanisms` and the folders below it.
"""
