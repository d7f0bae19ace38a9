"""The steady cycle: turning moment, exact flywheel and accumulated areas, periodic motion, time stepping.

Uses `machine` and the folders below it.
"""
