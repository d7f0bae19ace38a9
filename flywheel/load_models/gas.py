"""Forces of gases: indicator diagrams, compressors."""

from flywheel.components.load_models import (
    ATMOSPHERE,
    Compression,
    Indicator,
    Space,
    compressor_work,
    cylinder_pressure,
    gas_force,
    indicated_pressure,
    indicated_work,
    piston_area,
    volumetric_efficiency,
)

__all__ = [
    "ATMOSPHERE", "Compression", "Indicator", "Space", "compressor_work", "cylinder_pressure", "gas_force",
    "indicated_pressure", "indicated_work", "piston_area", "volumetric_efficiency",
]  # fmt: skip
