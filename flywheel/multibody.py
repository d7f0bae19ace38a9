"""Linkages by dependent coordinates: Newton's laws, multipliers, energy."""

from flywheel.mechanisms.linkages.multibody import *  # noqa: F403  # what is listed there
from flywheel.mechanisms.linkages.multibody import __all__ as __all__
