"""A machine written out apart from the toolkit, over a number type: long doubles, or mpmath's with any number of digits.

Positions in closed form (linkages dyad by dyad), jets for velocities, moments by virtual work, Legendre series on panels
halved until they end; motions with torques that depend on speed by collocation. `tests/estimates` holds random scenes
against it in long doubles; the digits of `tests/references` and `tests/extremes` are its own with 45 and 60 of them
(ORACLE_DIGITS), and in long doubles it agrees with these to 4e-18 (2e-17 close to change points). Nothing here imports
`flywheel` or `bondgraph`.
"""
