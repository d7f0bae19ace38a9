"""Pictures: of a sizing, of mechanisms still and moving, of the forces in joints.

Only these modules import matplotlib.
"""
