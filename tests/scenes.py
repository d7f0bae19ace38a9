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


SWEPT_PRESS: dict[str, Any] = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.15, "mass": 30, "inertia": 0.4, "com": 0.02, "com_angle": "180 deg"},
        "rod": {"length": 0.6, "mass": 18, "inertia": 0.7, "com": 0.2},
        "slider": {"mass": 60},
    },
    "gravity": {},
    "load": [{"on": "slider", "force": "-80 kN", "from": "300 deg", "to": "355 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "120 rpm"},
    "flywheel": {"irregularity": 0.05},
}
PUNCH = {
    "type": "punch",
    "diameter": 0.06,
    "thickness": 0.008,
    "shear_strength": 3.6e8,
    "shape": "triangular",
    "overtravel": 0.004,
}


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


def crank_press(mu: float, radius: float = 0.015, **changes: Any) -> dict[str, Any]:
    """A slider-crank as a linkage that pushes one way; every joint rubs."""
    pins = [
        {"name": "O", "between": ["frame.origin", "crank.origin"]},
        {"name": "A", "between": ["crank.A", "rod.origin"]},
        {"name": "B", "between": ["rod.B", "ram.origin"]},
    ]
    rough = {"friction": mu} if mu else {}
    joints = [pin | {"type": "pin"} | rough | ({"radius": radius} if mu else {}) for pin in pins]
    joints.append({"name": "ram", "type": "slide", "between": ["frame.origin", "ram.origin"], **rough})
    bodies = {
        "crank": {"points": {"A": [0.1, 0]}, "mass": 3, "inertia": 0.02},
        "rod": {"points": {"B": [0.4, 0]}, "mass": 2, "inertia": 0.03, "com": [0.15, 0], "guess": 0.0},
        "ram": {"mass": 6},
    }
    scene = {
        "mechanism": {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints},
        "load": [{"on": "ram", "force": "-800 N", "while": "v > 0"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 20.0},
        "flywheel": {"irregularity": 0.03},
    }
    return scene | changes


def straight_drive() -> dict[str, Any]:
    """A hypocycloid on a line: the piston's guide bears nothing, its normal force is rounding."""
    bodies = {
        "frame": {"points": {"O": [0, 0]}},
        "carrier": {"points": {"C": [0.05, 0]}, "mass": 3, "inertia": 0.01},
        "planet": {"points": {"tip": [0.05, 0]}, "mass": 1, "inertia": 0.001},
        "rod": {"points": {"end": [0.2, 0]}, "mass": 1, "inertia": 0.004, "com": [0.1, 0], "guess": 0},
        "piston": {"mass": 2},
    }
    pins = {"sun": "frame.O carrier.origin", "planet_pin": "carrier.C planet.origin"}
    pins |= {"tip": "planet.tip rod.origin", "wrist": "rod.end piston.origin"}
    joints: list[dict[str, Any]] = [{"name": n, "type": "pin", "between": ends.split()} for n, ends in pins.items()]
    joints.append({"name": "bore", "type": "slide", "between": ["frame.O", "piston.origin"], "guess": 0.3, "friction": 0.1})
    gear = {"type": "gear", "between": ["sun", "planet_pin"], "teeth": [60, 30], "internal": True, "pressure_angle": 0.35}
    linkage = {"type": "linkage", "driver": "sun", "bodies": bodies, "joints": joints, "couplings": [gear]}
    return crank_press(0.0, mechanism=linkage, load=[{"on": "bore", "force": "-2 kN", "while": "v > 0"}])


# texts of scenes, with a type of motor, or a place and a model of a load, to be filled in

DRIVEN = """
[[inertia]]
on = "crank"
value = 3
[[load]]
on = "crank"
torque = "-0.0004*omega**2*(1 + sin(phi))"
[drive]
motor = {type = "%s", torque = "40 N m"}
[flywheel]
inertia = 2
[regime]
"""
LOADED = """
[mechanism]
type = "slider-crank"
crank.length = "60 mm"
rod.length = "240 mm"
slider.mass = "2.5 kg"
[[load]]
on = "%s"
model = {%s}
[[load]]
on = "slider"
force = "-100 N"
while = "v > 0"
[drive]
torque = "balance"
[regime]
speed = "100 rpm"
[flywheel]
irregularity = 0.1
"""

ALL = {"yoke": yoke, "press": press, "shaper": shaper, "rotor": rotor}
