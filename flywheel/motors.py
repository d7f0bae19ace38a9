"""Motors: torque against speed, current and heat of each kind, and their starts."""

from flywheel.components.motors import *  # noqa: F403  # what is listed there
from flywheel.components.motors import __all__ as __all__
