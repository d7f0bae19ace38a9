"""Random scenes against a route of its own in 64-bit mantissas: no figure may be further off than the estimate with it.

`python -m tests.estimates --count 1000 --seed 1` runs them (some four minutes); `--only SEED` shows one, figure by figure.

The route is that of `tests/oracle`.

Seed 1: 1000 scenes, 273 with torques that depend on speed; 22 074 figures, none further off than its estimate (and half a
unit of a double's last place). Estimate over true error: 23 in the median, 41 for exact flywheels, 37 for irregularities.
"""
