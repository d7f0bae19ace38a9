"""Scenes that several tests share, as the mappings that `flywheel.load` takes."""

from __future__ import annotations

from typing import Any


def yoke(**changes: Any) -> dict[str, Any]:
    """Scotch yoke of p.103: 1000 N against it over half a turn."""
    scene = {
        "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}},
        "load": [{"on": "yoke", "force": 1000, "from": 0, "to": "180 deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": "60 rpm"},
        "flywheel": {"irregularity": 0.04},
    }
    return scene | changes


def press(**changes: Any) -> dict[str, Any]:
    """Slider-crank press with weights and a narrow stroke."""
    scene = {
        "mechanism": {
            "type": "slider-crank",
            "name": "press",
            "crank": {"length": 0.1, "mass": 5, "inertia": 0.1, "com": 0.02},
            "rod": {"length": 0.5, "mass": 10, "inertia": 0.3, "com": 0.2},
            "slider": {"mass": 50},
        },
        "gravity": {},
        "load": [{"on": "press.slider", "force": "-20 kN", "from": "300 deg", "to": "345 deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": "120 rpm"},
        "flywheel": {"irregularity": 0.05},
    }
    return scene | changes


def shaper(**changes: Any) -> dict[str, Any]:
    """Crank-shaper that cuts while its ram moves one way, on a geared shaft."""
    scene = {
        "shafts": {"bull": {"ratio": 0.5}},
        "mechanism": {
            "type": "crank-shaper",
            "shaft": "bull",
            "crank": {"length": 0.12, "inertia": 0.4},
            "frame": {"length": 0.3},
            "rocker": {"length": 0.6, "mass": 20, "inertia": 0.7, "com": 0.3},
            "ram": {"mass": 60},
        },
        "load": [{"on": "ram", "force": "-2 kN", "while": "v > 0"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": "90 rpm", "cycle": "720 deg"},
        "flywheel": {"irregularity": 0.1},
    }
    return scene | changes


def rotor(**changes: Any) -> dict[str, Any]:
    """A rotor alone: 100 N m against it over half a turn."""
    scene = {
        "load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": "300 rpm"},
        "flywheel": {"irregularity": 0.01},
    }
    return scene | changes


ALL = {"yoke": yoke, "press": press, "shaper": shaper, "rotor": rotor}
