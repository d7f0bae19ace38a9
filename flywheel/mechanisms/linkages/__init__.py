"""Any plane linkage: positions, mobility, joint reactions and multibody dynamics; uses `scene` and `numerics`.

Users import it as `flywheel.linkage`; it contains the description of a linkage and its positions.

>>> from flywheel.linkage import Joint, Link, Linkage, Point, solve
>>> o, a = Point("O"), Point("A", 0.1)
>>> crank = Linkage(Link("frame", (o,)), (Link("crank", (o, a)),), (Joint("O", "pin", "frame", "crank", o, o),), "O")
>>> [round(float(x), 9) for x in solve(crank, 0.0, 6.28).poses(1.0).point("crank", a).value[:, 0]]
[0.054030231, 0.084147098]
"""

from flywheel.mechanisms.linkages.assembly import gruebler, kutzbach
from flywheel.mechanisms.linkages.equations import Poses, Track
from flywheel.mechanisms.linkages.positions import Solution, Tangent, follow, placed, solve, solve_over, tangent
from flywheel.scene.linkage import Coupling, Driver, Joint, Lift, Link, Linkage, Point, Side

__all__ = [
    "Coupling", "Driver", "Joint", "Lift", "Link", "Linkage", "Point", "Poses", "Side", "Solution", "Tangent", "Track",
    "follow", "gruebler", "kutzbach", "placed", "solve", "solve_over", "tangent",
]  # fmt: skip
