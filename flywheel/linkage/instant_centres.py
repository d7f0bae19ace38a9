"""Instant centres of the bodies of a linkage."""

from flywheel.motions.velocities import ANYWHERE, FINITE, INFINITE, InstantCentre, centres_of, velocity

__all__ = ["ANYWHERE", "FINITE", "INFINITE", "InstantCentre", "centres_of", "velocity"]
