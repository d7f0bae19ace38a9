"""Designs sized many at once: each is that of `size` one by one, in the structures that they share."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.designs import figures as designs
from flywheel.designs.motions import DesignMoments
from flywheel.machine.machine import Machine
from flywheel.reading.paths import numbers, with_numbers
from flywheel.regime.branch import Branch, Existence
from tests.extras import extra
from tests.scenes import PUNCH, yoke
from tests.scenes import SWEPT_PRESS as PRESS

# Figures of many designs at once are those of `size` one by one, within the errors of both, by every engine.


RANGES: dict[str, tuple[dict[str, Any], dict[str, tuple[float, float]]]] = {
    "press": (
        PRESS,
        {
            "mechanism.crank.length": (0.1, 0.2),
            "mechanism.rod.length": (0.45, 0.9),
            "load.0.from": (5.0, 5.4),
            "load.0.to": (5.9, 6.25),
            "flywheel.irregularity": (0.01, 0.2),
            "regime.speed": (6.0, 16.0),
        },
    ),
    "flywheel given": (
        {**PRESS, "flywheel": {"inertia": 500}},
        {"flywheel.inertia": (5.0, 900.0), "mechanism.slider.mass": (20.0, 90.0), "load.0.to": (5.9, 6.25)},
    ),
    "none needed": (
        {**PRESS, "load": [{"on": "slider", "force": "-8 kN", "from": "300 deg", "to": "355 deg"}]},
        {"flywheel.irregularity": (0.5, 1.5), "mechanism.crank.inertia": (0.4, 40.0)},
    ),
    "yoke": (
        yoke(),
        {"mechanism.crank.length": (0.2, 0.8), "load.0.force": (300.0, 3000.0), "mechanism.yoke.mass": (5.0, 30.0)},
    ),
    "a table": (
        {
            **PRESS,
            "load": [
                {
                    "on": "crank",
                    "table": {"angle": [0, 100, 200, 360], "value": [0, -900, 100, 0], "angle_unit": "deg"},
                }
            ],
        },
        {"mechanism.crank.length": (0.1, 0.2), "mechanism.rod.mass": (9.0, 30.0), "flywheel.irregularity": (0.01, 0.2)},
    ),
    "angles of many turns": (
        {**PRESS, "load": [{"on": "crank", "torque": "-900*sin(phi + 2e5)**2"}]},
        {"mechanism.crank.length": (0.1, 0.2), "flywheel.irregularity": (0.01, 0.2)},
    ),
}
ENGINES = ["numpy", pytest.param("numba", marks=pytest.mark.slow)]
ANGLES = ("angle_speed_max", "angle_speed_min")


def scale(name: str, found: dict[str, np.ndarray], exchanged: np.ndarray) -> np.ndarray:
    """Scale to which an error of a figure is relative."""
    if name in ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel"):
        return np.maximum(found[name], found["approximate_total"])
    if name in ("accumulated_max", "accumulated_min", "energy_fluctuation"):
        return exchanged
    if name.startswith("reduced_inertia"):
        return found["reduced_inertia_greatest"]
    return np.ones_like(exchanged) if name in ANGLES else np.abs(found[name])


def compared(scene: flywheel.Scene, paths: tuple[str, ...], columns: np.ndarray, engine: str) -> designs.Batch:
    """The designs by an engine, every figure within the errors of it and of `size`; the batch."""
    result = designs.sized(scene, paths, columns, 1e-10, engine)
    alone = designs.sized(scene, paths, columns, 1e-10, "size")
    exchanged = np.maximum(np.abs(alone.values["accumulated_max"]), np.abs(alone.values["accumulated_min"]))
    for name, value in alone.values.items():
        assert (np.isnan(value) == np.isnan(result.values[name])).all(), name
        known = ~np.isnan(value)
        apart = np.abs(result.values[name] - value)[known]
        allowed = (result.errors[name] + alone.errors[name]) * scale(name, alone.values, exchanged)
        assert (apart <= allowed[known]).all(), (name, apart.max())
    return result


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", RANGES)
def test_designs_at_once_are_those_one_by_one(name: str, engine: str) -> None:
    if engine == "numba":
        extra("numba")
    tables, ranges = RANGES[name]
    low, high = np.array(list(ranges.values())).T[:, :, None]
    columns = low + (high - low) * np.random.default_rng(5).random((len(ranges), 12))
    result = compared(flywheel.load(tables), tuple(ranges), columns, engine)
    assert (result.ways <= designs.REFINED).sum() >= 9
    for key in ("exact", "approximate", "irregularity"):
        assert not (result.errors[key][result.ways <= designs.REFINED] > 1e-10).any()


@pytest.mark.parametrize("engine", ENGINES)
def test_rounded_directions_of_weights_are_in_the_errors_of_designs_at_once(engine: str) -> None:
    """Of a weight at 91° to its path they are nearly all of it, and as great as in a sizing alone."""
    if engine == "numba":
        extra("numba")
    bodies = {"crank": {"length": 0.4, "inertia": 1}, "yoke": {"mass": 60, "direction": "-123 deg"}}
    tables = yoke(mechanism={"type": "scotch-yoke", **bodies}, gravity={"direction": "146 deg"}, load=[])
    scene, paths, columns = flywheel.load(tables), ("mechanism.yoke.mass",), np.array([[40.0, 50.0, 60.0]])
    together = designs.sized(scene, paths, columns, 1e-10, engine)
    alone = designs.sized(scene, paths, columns, 1e-10, "size")
    for name in ("energy_fluctuation", "exact"):
        np.testing.assert_allclose(together.errors[name], alone.errors[name], rtol=0.2)


# Designs sized many at once by what they share: families, windows, switches and narrow laws that move with their numbers.
#
# Each is held against `size` of that design alone; how many were found together is held too, as a loss would show
# nowhere.


FOUR_BAR = {
    "type": "four-bar",
    "ground": {"length": 0.4},
    "crank": {"length": 0.1, "mass": 2, "com": 0.05},
    "coupler": {"length": 0.35, "mass": 3, "inertia": 0.05, "com": 0.1, "com_angle": "20 deg"},
    "rocker": {"length": 0.25, "mass": 4, "inertia": 0.1},
}
SHAPER = {
    "type": "crank-shaper",
    "crank": {"length": 0.1, "mass": 1},
    "frame": {"length": 0.25},
    "rocker": {"length": 0.5, "mass": 10, "inertia": 0.3, "com": 0.25},
    "ram": {"mass": 30},
}
STRUCTURES_YOKE = {"type": "scotch-yoke", "crank": {"length": 0.3}, "yoke": {"mass": 20, "direction": "30 deg"}}
SLIDER = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.4, "mass": 5}, "slider": {"offset": 0.02}}
SCENES: dict[str, dict[str, Any]] = {
    "a punch": {
        "mechanism": SLIDER,
        "parameters": {"T": "20 N m"},
        "load": [{"on": "slider", "model": PUNCH}, {"on": "crank", "torque": "-T*sin(phi)**2"}],
    },
    "a press over an angle": {
        "mechanism": SHAPER,
        "load": [{"on": "ram", "model": {"type": "press", "energy": 2000, "angle": "20 deg"}}],
    },
    "a double-acting compressor": {
        "mechanism": SLIDER,
        "load": [
            {
                "on": "slider",
                "model": {
                    "type": "compressor",
                    "bore": 0.2,
                    "rod": 0.04,
                    "clearance": 0.08,
                    "suction": "1 bar",
                    "discharge": "4 bar",
                    "exponent": 1.3,
                    "double_acting": True,
                },
            }
        ],
    },
    "windows that wrap": {
        "mechanism": FOUR_BAR,
        "gravity": {},
        "load": [
            {"on": "rocker", "torque": -300, "from": "300 deg", "to": "40 deg"},
            {"on": "coupler", "torque": "-5*sign(v)"},
        ],
    },
    "dead centres": {
        "mechanism": SHAPER,
        "load": [{"on": "ram", "force": -2000, "while": "v < 0"}, {"on": "crank", "torque": "-30*sin(2*phi)"}],
    },
    "switches": {
        "mechanism": STRUCTURES_YOKE,
        "parameters": {"F": "800 N", "level": 0.4},
        "load": [{"on": "yoke", "force": "-F*max(sin(phi) - level, 0)"}, {"on": "yoke", "force": "F*x if x > 0.1 else 0"}],
    },
    "a narrow peak": {
        "mechanism": SLIDER,
        "parameters": {"width": 0.05, "peak": "2 kN"},
        "load": [{"on": "slider", "force": "-peak*exp(-((phi - 2)/width)**2)"}],
    },
    "shafts, a table and a spring": {
        "mechanism": [{**SLIDER, "name": "a"}, {**STRUCTURES_YOKE, "name": "b", "shaft": "fast", "phase": "40 deg"}],
        "shafts": {"fast": {"ratio": 2}},
        "spring": [{"on": "a.slider", "stiffness": 4000, "rest": 0.4}],
        "load": [
            {"on": "fast", "torque": -20, "from": "20 deg", "to": "100 deg"},
            {"on": "crank", "table": {"angle": [0, 100, 200, 360], "value": [0, -50, 10, 0], "angle_unit": "deg"}},
        ],
    },
}
RUN = {"drive": {"torque": "balance"}, "regime": {"speed": "90 rpm"}, "flywheel": {"irregularity": 0.02}}


DEAR = ("a double-acting compressor", "windows that wrap", "dead centres", "a narrow peak", "switches")


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n in DEAR else ()) for n in SCENES])
def test_designs_at_once_are_those_sized_alone(name: str):
    scene, rng = flywheel.load({**SCENES[name], **RUN}), np.random.default_rng(7)
    known = {path: number for path, number in numbers(scene).items() if "table" not in path and "ratio" not in path}
    columns = {path: number.value * rng.uniform(0.98, 1.02, 20) for path, number in known.items()}
    result = flywheel.sweep(scene, columns, rtol=1e-9)
    assert np.isin(result.ways, (0, 1)).sum() >= 16
    alone = flywheel.size(result.design(19), 1e-9, accuracy="normal")
    error = (result.error.exact[19] + alone.error.exact) * max(alone.flywheel.exact, alone.flywheel.approximate_total)
    assert abs(result.exact[19] - alone.flywheel.exact) <= error
    assert result.balance[19] == pytest.approx(alone.balance.value, rel=1e-9)
    assert result.power[19] == pytest.approx(alone.power, rel=1e-9)


SLOW_TURNING = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.2, "inertia": 1.0},
        "rod": {"length": 0.6, "mass": 6, "inertia": 3, "com": 0.3},
        "slider": {"mass": 6},
    },
    "gravity": {},
    "drive": {"torque": "30 - 4*omega"},
}
AT_SPEEDS: dict[str, dict[str, Any]] = {
    "a slope of the drive": {"drive": {"torque": "10 - 2.387*omega if omega > 3 else 12 - 3.05367*omega"}},
    "a resistance at a place": {"load": [{"on": "slider", "force": "-20*max(0, v - 0.5)"}]},
    "a jump at a place": {"load": [{"on": "slider", "force": "-15 if v > 0.3 else 0"}]},
    "at a speed that is set": {
        "load": [{"on": "slider", "force": "-20*max(0, v - 0.5)"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 4},
    },
}


@pytest.mark.parametrize("name", AT_SPEEDS)
def test_laws_that_switch_at_speeds_divide_the_cells_of_every_design(name: str) -> None:
    scene = flywheel.load({**SLOW_TURNING, **AT_SPEEDS[name], "flywheel": {"irregularity": 0.1}})
    paths, rng = ("mechanism.crank.length", "flywheel.irregularity"), np.random.default_rng(3)
    columns = np.stack([rng.uniform(0.15, 0.22, 12), rng.uniform(0.05, 0.4, 12)])
    assert (compared(scene, paths, columns, "numpy").ways <= designs.REFINED).all()


PLATE = {"power": "15 kW", "speed": 150.0, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.8}
SUPPLIED = {**PLATE, "voltage": 400.0, "current": 29.0, "power_factor": 0.84}
SERVO = {"speed": 157.0, "corner_speed": 150.0, "maximum_speed": 200.0, "set_speed": 150.0, "torque": 90.0}
PLATES: dict[str, dict[str, Any]] = {
    "induction": PLATE,
    "its start": {**SUPPLIED, "starting_torque": 2.2, "starting_current": 6.5, "inertia": 0.1},
    "an inverter": {**SUPPLIED, "inverter": {"frequency": 55.0}},
    "direct current": {"type": "dc", "voltage": 400.0, "speed": 150.0, "power": 15e3, "current": 42.0, "inertia": 0.1},
    "a servo": {"type": "servo", **SERVO, "peak_torque": 290.0, "efficiency": 0.9},
}
ONE_MOTOR = ("motor_torque", "motor_rms", "motor_heat", "current_pulsation")
"""Limits of a motor."""
BY_CURRENT = [(name, "motor_heat") for name in ("direct current", "a servo")]
"""Motors whose heat is that of their current along one motion alone: designs with a limit of it are sized alone."""


@pytest.mark.parametrize(
    ("name", "limit"),
    [
        pytest.param(name, limit, marks=() if (name, limit) == ("its start", "motor_rms") else pytest.mark.slow)
        for name in PLATES
        for limit in ONE_MOTOR
        if (name, limit) not in BY_CURRENT
    ],
)
def test_the_plate_of_a_motor_with_limits_varies(name: str, limit: str) -> None:
    """Torque, current and heat are those of each design's own motor: limits are drawn that its flywheel decides."""
    share = {"motor_torque": 1.5, "motor_rms": 1.05, "motor_heat": 1.1, "current_pulsation": 1.2}[limit]
    motor = {"type": "induction", **PLATES[name]}
    driven = {"shafts": {"motor": {"ratio": 12}}, "drive": {"on": "motor", "motor": motor}, "regime": {}}
    load = [{"on": "slider", "force": "-40 kN", "from": "300 deg", "to": "355 deg"}]
    scene = flywheel.load({**PRESS, **driven, "load": load, "flywheel": {"limits": {limit: share, "irregularity": 1.0}}})
    whole = ("poles", "frequency")
    values = {path: each.value for path, each in numbers(scene).items() if path.startswith("drive.motor.")}
    paths = tuple(path for path in values if path.rpartition(".")[2] not in whole)
    columns = np.array([values[path] for path in paths])[:, None]
    columns = columns * np.random.default_rng(3).uniform(0.995, 1.005, (len(paths), 4))
    assert (compared(scene, paths, columns, "numpy").ways <= designs.REFINED).all()


def test_limits_that_are_kept_without_a_flywheel_and_motors_that_stall() -> None:
    """The rotor of a large motor is enough; a small one behind a mesh with losses cannot carry the mean load."""
    driven = {"shafts": {"motor": {"ratio": 12, "efficiency": 0.95}}, "regime": {}, "drive": {"on": "motor"}}
    driven["drive"]["motor"] = {"type": "induction", **PLATE, "inertia": 0.5}
    load = [{"on": "slider", "force": "-40 kN", "from": "300 deg", "to": "355 deg"}]
    limits = {"flywheel": {"limits": {"motor_torque": 1.5, "irregularity": 1.5}}}
    scene = flywheel.load({**PRESS, **driven, "load": load, **limits})
    paths = ("drive.motor.power", "drive.motor.inertia")
    kept = compared(scene, paths, np.array([[40e3, 45e3, 60e3], [1.2, 1.5, 2.0]]), "numpy")
    assert (kept.ways <= designs.REFINED).all()
    assert (kept.values["exact"] == 0.0).all()
    assert (kept.values["needed"] == 0.0).all()
    stalled = compared(scene, paths, np.array([[1e3, 1.2e3], [0.01, 0.02]]), "numpy")
    assert (stalled.ways == designs.REFUSED).all()
    assert all("mean load" in reason for reason in stalled.reasons.values())


@pytest.mark.slow
def test_a_switch_that_appears_and_a_peak_that_narrows_are_not_missed():
    """The middle design is recorded, and held against the first and the last: loads that act nowhere, or wide peaks."""
    for name, path, values in (
        ("switches", "parameters.level", [1.3, 0.6, -0.2, 1.2, 0.9, 0.5, 1.1]),
        ("a narrow peak", "parameters.width", [0.4, 0.003, 0.01, 0.5, 0.05, 0.02, 0.45]),
    ):
        scene = flywheel.load({**SCENES[name], **RUN})
        result, alone = (flywheel.sweep(scene, {path: values}, rtol=1e-9, engine=engine) for engine in ("numpy", "size"))
        error = (result.error.exact + alone.error.exact) * np.maximum(alone.exact, alone.approximate_total)
        assert (np.abs(result.exact - alone.exact) <= error).all()


def test_designs_that_are_refused_stand_beside_those_that_are_not():
    scene = flywheel.load({"mechanism": SLIDER, "load": [{"on": "slider", "force": "-900*sign(v)"}], **RUN})
    result = flywheel.sweep(scene, {"mechanism.rod.length": np.linspace(0.05, 0.4, 20)}, rtol=1e-9)
    short = result.columns["mechanism.rod.length"] <= 0.12
    assert (np.isnan(result.exact) == short).all()
    assert set(result.reasons) == set(np.flatnonzero(short).tolist())
    assert "rod.length" in result.reasons[0]
    assert np.isin(result.ways[~short], (0, 1)).mean() > 0.5


@pytest.mark.slow
def test_masses_and_windows_of_a_linkage_vary_together():
    """Its positions are those of one linkage; lengths, with which these change, are sized a length at a time."""
    crank = {"points": {"pin": [0.1, 0]}, "mass": 4, "inertia": 0.02}
    rod = {"points": {"end": [0.4, 0]}, "mass": 5, "com": [0.15, 0], "inertia": 0.1, "guess": 0}
    joints = [
        {"name": "main", "type": "pin", "between": ["frame.origin", "crank.origin"]},
        {"name": "pin", "type": "pin", "between": ["crank.pin", "rod.origin"]},
        {"name": "end", "type": "pin", "between": ["rod.end", "ram.origin"]},
        {"name": "guide", "type": "slide", "between": ["frame.origin", "ram.origin"], "guess": 0.5},
    ]
    bodies = {"crank": crank, "rod": rod, "ram": {"mass": 20}}
    mechanism = {"type": "linkage", "bodies": bodies, "joints": joints, "driver": "main"}
    load = {"on": "guide", "force": -3000, "from": "200 deg", "to": "300 deg"}
    scene, rng = flywheel.load({"mechanism": mechanism, "load": [load], **RUN}), np.random.default_rng(2)
    ranges = {
        "mechanism.bodies.ram.mass": (10, 30),
        "load.0.from": (3.3, 3.6),
        "load.0.to": (5.0, 5.5),
        "regime.speed": (5, 9),
    }
    result = flywheel.sweep(scene, {path: rng.uniform(*ends, 20) for path, ends in ranges.items()}, rtol=1e-9)
    assert (result.ways < 2).all()
    alone = flywheel.size(result.design(11), 1e-9, accuracy="normal")
    assert result.exact[11] == pytest.approx(alone.flywheel.exact, rel=1e-9)
    grid = {"mechanism.bodies.crank.points.pin.0": [0.09, 0.11], "load.0.force": np.linspace(-4000, -2000, 15)}
    result = flywheel.sweep(scene, grid, rtol=1e-9, grid=True)
    assert (result.ways < 2).all()
    alone = flywheel.size(result.design(20), 1e-9, accuracy="normal")
    assert result.exact[20] == pytest.approx(alone.flywheel.exact, rel=1e-9)


@pytest.mark.slow
def test_numbers_that_a_program_cannot_hold_are_the_same_in_it():
    """The lengths in a law's text: designs with equal ones are sized together, and where all differ the reason is told."""
    output = {"ram": {"x": "r*cos(phi)", "mass": 20}}
    load = {"on": "ram", "force": -900, "from": 0, "to": "180 deg"}
    given = {"mechanism": {"type": "law", "outputs": output}, "parameters": {"r": "0.2 m"}, "load": [load], **RUN}
    columns = {"parameters.r": [0.2, 0.3], "regime.speed": np.linspace(8, 12, 12)}
    result = flywheel.sweep(flywheel.load(given), columns, rtol=1e-9, grid=True)
    assert (result.ways < 2).all()
    alone = flywheel.size(result.design(17), 1e-9, accuracy="normal")
    assert result.exact[17] == pytest.approx(alone.flywheel.exact, rel=1e-9)
    result = flywheel.sweep(flywheel.load(given), {"parameters.r": np.linspace(0.1, 0.2, 6)}, rtol=1e-9)
    assert set(result.ways) == {0, 2}
    assert all("parameters.r" in reason for reason in result.reasons.values())


def test_flywheels_with_which_machines_certainly_stop_have_no_motion():
    """The bound of many machines at once, against each one followed in time."""
    motor = {"type": "induction", "power": "15 kW", "speed": 150, "poles": 4, "frequency": 50, "breakdown_ratio": 2.8}
    driven = {"shafts": {"motor": {"ratio": 12}}, "drive": {"on": "motor", "motor": motor}, "regime": {}}
    scene = flywheel.load({**PRESS, **driven, "flywheel": {"limits": {"motor_torque": 1.6}}})
    paths, columns = ("load.0.from",), np.array([[5.35, 5.4, 5.42, 5.45]])
    ((structure, which),) = designs.structures_of(scene, paths).sorted(columns)
    moments = DesignMoments(structure, columns[:, which], structure.edges(columns), np.arange(1 + sum(structure.counts)))
    stopped = moments.stopped_flywheels(np.full(4, 12.7), structure.speeds(columns)[1:])
    assert (stopped > 5.0).all()
    for start, inertia in zip(columns[0].tolist(), stopped.tolist(), strict=True):
        branch = Branch(Machine(with_numbers(scene, {"load.0.from": start})), 12.7)
        assert branch.at(inertia, 1e-4).existence is Existence.NONE
        assert branch.at(4.0 * inertia + 20.0, 1e-4).existence is Existence.MOTION
