"""Linkages with several drivers: Lagrange's equations, driving actions, reactions, motion."""

from flywheel.mechanisms.linkages.lagrange import *  # noqa: F403  # what is listed there
from flywheel.mechanisms.linkages.lagrange import __all__ as __all__
