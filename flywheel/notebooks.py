"""Display of results and their pictures in notebooks."""

from flywheel.pictures.notebooks import Curve, curves, html, picture, power_picture, save_picture, table
from flywheel.tables.designs import sweep_text

__all__ = ["Curve", "curves", "html", "picture", "power_picture", "save_picture", "sweep_text", "table"]
