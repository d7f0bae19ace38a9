"""Formulas of machine parts that need no scene: motors, loads, gears, presses, wheels, masses.

Uses `numerics` alone.
"""
