"""Work and rate of presses: energy of a stroke, engagement, single strokes."""

from flywheel.components.press_work import (
    BandBrake,
    Engagement,
    PressCycle,
    SingleStroke,
    band_brake,
    busy_time,
    cutting_energy,
    engage,
    inertia_for_single_stroke,
    press_at,
    press_cycle,
    press_of,
    safety_distance,
    shearing_force,
    single_stroke,
    stroke_energy,
)

__all__ = [
    "BandBrake", "Engagement", "PressCycle", "SingleStroke", "band_brake", "busy_time", "cutting_energy", "engage",
    "inertia_for_single_stroke", "press_at", "press_cycle", "press_of", "safety_distance", "shearing_force",
    "single_stroke", "stroke_energy",
]  # fmt: skip
