"""Direct dynamics of plane linkages by routes that share nothing with the reduced equation but the description.

All bodies keep their absolute coordinates x_G, y_G, theta; joints are equations between them.

>>> from flywheel.multibody import ROUTES
>>> ROUTES
('reduced', 'newton', 'multipliers', 'energy')
"""

from flywheel.multibody.model import Law, Wrench, components
from flywheel.multibody.relations import COMPONENTS
from flywheel.multibody.routes import ENERGY, MULTIPLIERS, NEWTON, REDUCED
from flywheel.multibody.running import ROUTES, Run, simulate

__all__ = [
    "COMPONENTS",
    "ENERGY",
    "MULTIPLIERS",
    "NEWTON",
    "REDUCED",
    "ROUTES",
    "Law",
    "Run",
    "Wrench",
    "components",
    "simulate",
]
