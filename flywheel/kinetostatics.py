"""Forces in the joints of a linkage: Newton and Euler, virtual power, friction."""

from flywheel.mechanisms.linkages.reactions import *  # noqa: F403  # what is listed there
from flywheel.mechanisms.linkages.reactions import __all__ as __all__
