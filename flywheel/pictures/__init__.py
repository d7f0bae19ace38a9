"""Pictures: of a sizing, of mechanisms still and moving, of the forces in joints; only these modules import matplotlib."""
