"""Machines with torques that depend on speed, as the mappings that `flywheel.load` takes, and what is true of them.

`figures(name)` reads `tests/references/regimes.json`: 18 digits by shooting at 30 digits (extrapolated midpoint
rule), which the collocation of `tests/oracle` confirms (`python -m tests.references.make_regimes --check`). Nothing of the
toolkit takes part in it.

An analysis or sizing holds (SI, speeds of the crank): inertia (of the flywheel, at its own shaft), irregularity, speed
(mean of extremes), speed_max, speed_min, their angles, speed_time_mean, period, multiplier, balance (null without one),
speed_at_zero (at phi = 0), drive_work and power (null without a drive). `constant` holds what a constant crank speed
makes of the torques: that speed, the balance there, the extremes of the accumulated work, and `frozen`: the exact
flywheel (at the crank, below 0 where none is needed) for those torques, by irregularity.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

REFERENCES = Path(__file__).parent / "references" / "regimes.json"
Scene = dict[str, Any]


class Case(NamedTuple):
    """A machine without its flywheel; wheels to analyse, irregularities to size for; the steady state near which to look."""

    scene: Scene
    inertias: tuple[float, ...]
    irregularities: tuple[float, ...]
    speed: float  # a guess of the crank's, where the scene gives none
    unknown: float | None = None  # a guess of the balance
    on: str = "crank"


class Start(NamedTuple):
    """A run-up: the case, its flywheel, the angle (half turns) at which it stands at first, the times looked at."""

    name: str
    inertia: float
    half_turns: float
    times: tuple[float, ...]
    unknown: float = 0.0  # the value of the balance


SECTION_C: Scene = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": "0.2 m", "mass": 12, "inertia": 1},
        "rod": {"length": "0.6 m", "mass": 6, "inertia": 3, "com": "0.3 m"},
        "slider": {"mass": 6},
    },
    "gravity": {"g": "9.81 m/s^2"},
    "drive": {"torque": "10 - 2.387*omega"},
}
KLOSS: Scene = {
    "title": "press on an induction motor of 3 kW, 1440 rpm, 4 poles, 50 Hz, breakdown ratio 2.5",
    "parameters": {"Tb": "49.7 N m", "sb": 0.1916, "ws": "1500 rpm"},
    "shafts": {"motor": {"ratio": 12}},
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.1, "mass": 5, "inertia": 0.1, "com": 0.02},
        "rod": {"length": 0.5, "mass": 10, "inertia": 0.3, "com": 0.2},
        "slider": {"mass": 50},
    },
    "gravity": {},
    "inertia": [{"on": "motor", "value": "0.02 kg m^2"}],
    "load": [{"on": "slider", "force": "-20 kN", "from": "300 deg", "to": "345 deg"}],
    "drive": {"on": "motor", "torque": "2*Tb*sb*(1 - omega/ws)/((1 - omega/ws)*(1 - omega/ws) + sb*sb)"},
}
PUMP: Scene = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.08, "inertia": 0.05},
        "rod": {"length": 0.3, "mass": 4, "inertia": 0.04, "com": 0.1},
        "slider": {"mass": 12, "offset": 0.02},
    },
    "load": [{"on": "slider", "force": "-3 kN", "while": "v > 0"}, {"on": "crank", "torque": "12 - 1.5*omega"}],
    "damper": [{"on": "slider", "coefficient": "400 N s/m"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "120 rpm"},
}
YOKE: Scene = {
    "mechanism": {
        "type": "scotch-yoke",
        "crank": {"length": 0.3, "inertia": 0.5},
        "yoke": {"mass": 20},
        "block": {"mass": 2},
    },
    "damper": [{"on": "yoke", "coefficient": "150 N s/m"}],
    "load": [{"on": "yoke", "force": "-200 - 30*v*abs(v)", "while": "v < 0"}],
    "drive": {"torque": "160 - 12*omega"},
}
FOUR_BAR: Scene = {
    "shafts": {"fan": {"ratio": 3}},
    "mechanism": {
        "type": "four-bar",
        "ground": {"length": 0.4},
        "crank": {"length": 0.1, "inertia": 0.2},
        "coupler": {"length": 0.35, "mass": 3, "inertia": 0.03, "com": 0.17},
        "rocker": {"length": 0.3, "mass": 4, "inertia": 0.05, "com": 0.15},
    },
    "gravity": {},
    "load": [
        {"on": "fan", "torque": "-0.004*omega*abs(omega)"},
        {"on": "rocker", "torque": "-90 - 4*v", "from": "200 deg", "to": "290 deg"},
    ],
    "drive": {"torque": "95 - 4.5*omega"},
}
ENGINE: Scene = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.05, "inertia": 0.02},
        "rod": {"length": 0.18, "mass": 0.8, "inertia": 0.004, "com": 0.05},
        "slider": {"mass": 0.7},
    },
    "load": [
        {
            "on": "slider",
            "table": {
                "angle": [0, 20, 60, 120, 180, 540, 600, 660, 700, 720],
                "value": [-2000, -9000, -4000, -1600, -300, 0, -150, -600, -1500, -2000],
                "angle_unit": "deg",
            },
        },
        {"on": "crank", "torque": "-0.0016*omega*abs(omega)"},
    ],
    "regime": {"cycle": "720 deg"},
}
TWO: Scene = {
    "shafts": {"second": {"ratio": 2}},
    "mechanism": [
        {"type": "scotch-yoke", "name": "cutter", "crank": {"length": 0.2, "inertia": 0.3}, "yoke": {"mass": 15}},
        {
            "type": "slider-crank",
            "name": "feeder",
            "shaft": "second",
            "phase": "40 deg",
            "crank": {"length": 0.06},
            "rod": {"length": 0.2, "mass": 1, "com": 0.08, "inertia": 0.005},
            "slider": {"mass": 6},
        },
    ],
    "gravity": {"direction": "-90 deg"},
    "load": [
        {"on": "cutter.yoke", "force": "-1.2 kN", "from": "20 deg", "to": "140 deg"},
        {"on": "feeder.slider", "force": "-40*v - 25*v*abs(v)"},
        {"on": "second", "torque": "-0.02*omega*abs(omega)"},
    ],
    "damper": [{"on": "feeder.slider", "coefficient": 60}, {"on": "second", "coefficient": "0.1 N m s"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "14 rad/s"},
}
LAW: Scene = {
    "mechanism": {
        "type": "law",
        "outputs": {
            "ram": {"x": "0.05*cos(phi) + 0.012*cos(2*phi)", "mass": 30},
            "swing": {"theta": "0.4*sin(phi) + 0.05*sin(3*phi)", "inertia": 1.5},
        },
    },
    "inertia": [{"on": "crank", "value": 0.4}],
    "load": [
        {"on": "crank", "torque": "-0.05*omega*abs(omega)"},
        {"on": "swing", "torque": "-0.2*omega*abs(omega) - 20*sign(v)"},
        {"on": "ram", "force": "-500", "while": "v > 0"},
    ],
    "drive": {"torque": "70 - 2*omega"},
}
CONSTANT_DRIVE: Scene = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.15, "inertia": 0.3},
        "rod": {"length": 0.4, "mass": 5, "inertia": 0.1, "com": 0.15},
        "slider": {"mass": 10},
    },
    "damper": [{"on": "slider", "coefficient": "300 N s/m"}, {"on": "crank", "coefficient": "0.5 N m s"}],
    "drive": {"torque": "40 N m"},
}
BRAKE: Scene = {
    **{key: ENGINE[key] for key in ("mechanism",)},
    "parameters": {"c": "balance"},
    "load": [ENGINE["load"][0], {"on": "crank", "torque": "-c*omega"}],
    "regime": {"cycle": "720 deg", "speed": "1200 rpm"},
}
GOVERNOR: Scene = {
    "shafts": {"engine": {"ratio": 8}},
    "load": [{"on": "crank", "torque": "-900 N m", "from": "60 deg", "to": "140 deg"}],
    "inertia": [{"on": "engine", "value": 0.05}],
    "drive": {"on": "engine", "torque": "min(40, max(0, 4*(110 - omega)))"},
}
SHAPER: Scene = {
    "shafts": {"motor": {"ratio": 10}},
    "mechanism": {
        "type": "crank-shaper",
        "crank": {"length": 0.12, "inertia": 0.4},
        "frame": {"length": 0.3},
        "rocker": {"length": 0.6, "mass": 20, "inertia": 0.7, "com": 0.3},
        "ram": {"mass": 60},
    },
    "load": [{"on": "ram", "force": "-1500 - 300*v", "while": "v > 0"}],
    "drive": {"on": "motor", "torque": "60 - 0.9*omega"},
    "regime": {"speed": "70 rpm"},
}
GEARED: Scene = {
    "title": "a lossy mesh between crank and motor: the tooth force changes its sense inside the cycle",
    "shafts": {"motor": {"ratio": 8, "efficiency": 0.9}},
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.1, "inertia": 0.4},
        "rod": {"length": 0.45, "mass": 8, "inertia": 0.2, "com": 0.15},
        "slider": {"mass": 40},
    },
    "inertia": [{"on": "motor", "value": 0.01}],
    "load": [{"on": "slider", "force": "-8 kN", "from": "290 deg", "to": "350 deg"}],
    "drive": {"on": "motor", "torque": "balance"},
    "regime": {"speed": "130 rpm"},
}
GEARED_LINE: Scene = {
    **{key: value for key, value in GEARED.items() if key != "regime"},
    "drive": {"on": "motor", "torque": "45 - 0.35*omega"},
}
GEARED_FREE: Scene = {
    **{key: GEARED[key] for key in ("shafts", "mechanism", "inertia", "drive")},
    "regime": {"speed": "130 rpm"},
}
DC: Scene = {
    "title": "press on a direct-current motor with inductance",
    "shafts": {"motor": {"ratio": 10}},
    "mechanism": KLOSS["mechanism"],
    "inertia": [{"on": "motor", "value": 0.03}],
    "load": [{"on": "slider", "force": "-20 kN", "from": "300 deg", "to": "345 deg"}],
    "drive": {
        "on": "motor",
        "motor": {"type": "dc", "voltage": 220, "resistance": 0.8, "constant": 1.5, "inductance": 0.05},
    },
}
UNSTABLE: Scene = {
    "title": "the drive's torque grows faster with speed than the load: a steady motion that no machine keeps",
    "load": [
        {"on": "crank", "torque": "-40 - 1*omega"},
        {"on": "crank", "torque": "-30 N m", "from": "30 deg", "to": "120 deg"},
    ],
    "inertia": [{"on": "crank", "value": 1}],
    "drive": {"torque": "10 + 3*omega"},
}
TWO_SPEEDS: Scene = {
    "title": "an induction motor against a load that knows no speed: one steady motion on either branch",
    "parameters": KLOSS["parameters"],
    "shafts": KLOSS["shafts"],
    "inertia": [{"on": "motor", "value": "0.05 kg m^2"}],
    "load": [
        {"on": "crank", "torque": "-300 N m"},
        {"on": "crank", "torque": "-400 N m", "from": "90 deg", "to": "180 deg"},
    ],
    "drive": KLOSS["drive"],
}
PEAKS: Scene = {
    "title": "the load's peak is five times what the motor has at standstill: only a flywheel carries it",
    "load": [{"on": "crank", "torque": "-100 N m", "from": "90 deg", "to": "135 deg"}],
    "drive": {"torque": "20 - 1*omega"},
}
CASES: Mapping[str, Case] = {
    "section-c": Case(SECTION_C, (0, 0.5, 2, 5, 20, 500), (0.3, 0.1, 0.02, 1e-3, 1e-6), 4.1),
    "section-c-geared": Case({**SECTION_C, "shafts": {"fast": {"ratio": 3}}}, (2,), (0.1,), 4.15, on="fast"),
    "kloss-press": Case(KLOSS, (0.1,), (0.1, 0.02), 12.7, on="motor"),
    "pump": Case(PUMP, (5,), (0.05,), 12.566370614359172, 50),
    "yoke": Case(YOKE, (3,), (0.05,), 8),
    "four-bar": Case(FOUR_BAR, (1,), (0.02,), 15),
    "engine": Case(ENGINE, (0.3,), (0.02,), 120),
    "two-mechanisms": Case(TWO, (4,), (0.03,), 14, 60),
    "law": Case(LAW, (0, 2), (0.02,), 17),
    "constant-drive": Case(CONSTANT_DRIVE, (1,), (0.05,), 9),
    "brake": Case(BRAKE, (0.3,), (0.02,), 125.66370614359172, 0.1),
    "governor": Case(GOVERNOR, (0.5,), (0.05,), 13, on="engine"),
    "shaper": Case(SHAPER, (0.2,), (0.05,), 6.4, on="motor"),
    "geared-loss": Case(GEARED, (0.05,), (0.05,), 13.6, 15, on="motor"),
    "geared-loss-line": Case(GEARED_LINE, (0.05,), (0.05,), 12.5, on="motor"),
    "geared-free": Case(GEARED_FREE, (), (), 0, on="motor"),
    "unstable": Case(UNSTABLE, (3,), (), 18.75),
    "two-speeds-fast": Case(TWO_SPEEDS, (0.5,), (0.01,), 12.4, on="motor"),
    "two-speeds-slow": Case(TWO_SPEEDS, (0.5,), (), 7.3, on="motor"),
    "peaks": Case(PEAKS, (5,), (0.1,), 7.5),
    "dc-inductance": Case(DC, (0.1,), (0.05,), 13.5, on="motor"),
}


class Bad(NamedTuple):
    """A machine without a steady motion: its scene with a flywheel, why there is none, and figures of a run that stops.

    A run starts at phi = 0 with `speed` and stands still at `angle` (rad) after `time` (s).
    """

    scene: Scene
    why: str
    speed: float | None = None
    angle: float | None = None
    time: float | None = None


RUNAWAY: Scene = {
    "load": [{"on": "crank", "torque": "-20*omega/(omega + 1)"}],
    "drive": {"torque": "40 N m"},
    "flywheel": {"inertia": 2},
}
STALLED: Scene = {
    **{key: TWO_SPEEDS[key] for key in ("parameters", "shafts", "inertia", "drive")},
    "load": [{"on": "crank", "torque": "-700 N m"}],
    "flywheel": {"on": "motor", "inertia": 0.5},
}
STARVED: Scene = {
    "load": [{"on": "crank", "torque": "-25 N m"}],
    "drive": {"torque": "20 - 1*omega"},
    "flywheel": {"inertia": 5},
}
LIGHT: Scene = {**PEAKS, "flywheel": {"inertia": 0.2}}
BAD: Mapping[str, Bad] = {
    # at any speed the drive does more than 2 pi 20 J a turn too much
    "runaway": Bad({"regime": {}, **RUNAWAY}, "the drive exceeds the load at every speed"),
    # 12 Tb = 596.4 N m < 700; angle and time: integral of I omega, I over (700 - 12 T(12 omega)), by mpmath's quadrature
    "stalled": Bad(
        {"regime": {}, **STALLED},
        "the motor's breakdown torque is below the load",
        13,
        32.4104721643131988,
        4.13142554966261269,
    ),
    # omega = 15 exp(-t/5) - 5 from 10 rad/s: time 5 log 3, angle 50 - 25 log 3
    "starved": Bad(
        {"regime": {}, **STARVED}, "the drive cannot carry the mean load", 10, 22.5346927832972577, 5.49306144334054846
    ),
    # no motion is faster than 20 rad/s for long, and 1/2 0.2 20² = 40 J < (100 - 20) pi/4 J; from rest it stalls in the
    # window at pi/2 + J (w - 80 log(1 + w/80)), where w = 12.92263742547161 solves J (-w - 20 log(1 - w/20)) = pi/2
    "light": Bad(
        {"regime": {}, **LIGHT},
        "the flywheel is too light for the load's peak",
        0,
        1.75947330540306728,
        0.237714321925537887,
    ),
}
STARTS: Mapping[str, Start] = {
    "start-section-c": Start("section-c", 0, 0.5, (0.5, 1.0, 2.0, 5.0)),
    "start-section-c-flywheel": Start("section-c", 5, 0.5, (0.5, 1.0, 2.0, 5.0)),
    "start-section-c-dead-centre": Start("section-c", 0, 0.0, (0.5, 1.0, 2.0, 5.0)),
    "start-geared-loss": Start("geared-free", 0.05, 0.25, (0.2, 0.5, 1.0, 1.5), 10.0),
}


def scene(name: str, **flywheel: Any) -> Scene:
    """The scene of a case with its flywheel: `inertia` or `irregularity`."""
    case = CASES[name]
    return {"regime": {}, **case.scene, "flywheel": {"on": case.on, **flywheel}}


@cache
def figures(name: str) -> dict[str, Any]:
    """The figures of a case (`analysis` by inertia, `sizing` by irregularity, `constant`) or of a start, as texts."""
    result: dict[str, Any] = json.loads(REFERENCES.read_text())[name]
    return result
