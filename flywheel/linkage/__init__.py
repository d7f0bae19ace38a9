"""Any plane linkage: its bodies, joints and drivers, and its positions."""

from flywheel.linkage import instant_centres as instant_centres
from flywheel.mechanisms.linkages import *  # noqa: F403  # what is listed there
from flywheel.mechanisms.linkages import __all__ as __all__
