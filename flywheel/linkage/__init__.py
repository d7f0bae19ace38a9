"""Plane linkages of any make: what they consist of, how they move, the forces in their joints, their dynamics."""
