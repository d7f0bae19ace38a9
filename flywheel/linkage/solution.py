"""Positions of a linkage over its driver."""

from flywheel.mechanisms.linkages.equations import Poses, Track
from flywheel.mechanisms.linkages.positions import Solution, Tangent, follow, placed, solve, solve_over, tangent

__all__ = ["Poses", "Solution", "Tangent", "Track", "follow", "placed", "solve", "solve_over", "tangent"]
