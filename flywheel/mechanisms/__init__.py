"""From a mechanism's record to positions and influence coefficients, a file for each family.

Uses `scene` and what is below it.
"""
