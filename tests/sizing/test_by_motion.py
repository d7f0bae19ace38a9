"""Flywheels by the motion, where torques depend on speed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import flywheel
from flywheel import Machine, SceneError
from flywheel.numerics.cells import ROUNDING
from flywheel.regime import wittenbauer
from flywheel.sizing.confirmation import by_collocation, on_thirds
from flywheel.sizing.results import Regime
from flywheel.tables.sizing import text
from tests import regimes, scenes
from tests.limits import sample
from tests.references.test_references import FOLDER, REFERENCES, error

# Sizing and analysis along the machine's own motion: against 18-digit references, and by name where there is none.


NONE = ("geared-free", "unstable", "two-speeds-slow")  # nothing to look for, or no motion that a machine keeps
RUNS = {name: case for name, case in regimes.CASES.items() if name not in NONE}
ANALYSES = [(name, j, 1e-9) for name, case in RUNS.items() for j in case.inertias]
ANALYSES += [(name, case.inertias[0], rtol) for name, case in RUNS.items() for rtol in (1e-5, 1e-12)]
SIZINGS = [(name, e, 1e-9) for name, case in RUNS.items() for e in case.irregularities]
SIZINGS += [(name, case.irregularities[0], rtol) for name, case in RUNS.items() for rtol in (1e-5, 1e-12)]
HEAVY = [("section-c", 500), ("kloss-press", 0.1), ("engine", 0.3), ("dc-inductance", 0.1), ("geared-loss", 0.05)]


def sized(scene, rtol=1e-9, simulate=False):
    return flywheel.size(flywheel.load(scene), rtol, simulate=simulate)


def figures(name, kind, key):
    result = regimes.figures(name)[kind][repr(key)]
    return {k: float(v) for k, v in result.items() if v is not None and not isinstance(v, list)}


def off(found, true):
    return abs(found / true - 1)


def check_motion(result, true, allowed):
    """Speeds, their angles, multiplier, balance and power, each to what the estimates allow."""
    run = result.run
    close = {"rel": allowed + 16 * ROUNDING}
    level = close["rel"] * max(true["irregularity"], 1e-6) + 4 * result.cyclic.level_error + 16 * ROUNDING
    for outcome, key in ((result.speed, "speed"), (run.speed_max, "speed_max"), (run.speed_min, "speed_min")):
        assert off(outcome, true[key]) <= level
    assert off(run.irregularity, true["irregularity"]) <= close["rel"]
    for outcome, key in ((result.angle_speed_max, "angle_speed_max"), (result.angle_speed_min, "angle_speed_min")):
        assert abs(np.sin((outcome - true[key]) / 2)) <= result.error.extremes + 1e-12
    if "multiplier" in true:
        assert result.cyclic.multiplier == pytest.approx(true["multiplier"], rel=max(100 * allowed, 1e-11))
    if "balance" in true:
        assert result.balance.value == pytest.approx(true["balance"], rel=max(allowed, 1e-13))
    if true.get("power"):
        assert result.power == pytest.approx(true["power"], rel=max(allowed, 1e-13))


@pytest.mark.parametrize(("name", "inertia", "rtol"), sample(ANALYSES, 6))
def test_analyses_are_true_within_what_they_claim(name, inertia, rtol):
    true, result = figures(name, "analysis", inertia), sized(regimes.scene(name, inertia=inertia), rtol)
    estimate = result.error.simulation
    assert estimate <= max(rtol, 2e-12)
    check_motion(result, true, estimate)
    outcome = result.simulation
    assert off(outcome.irregularity, true["irregularity"]) <= estimate
    assert off(outcome.period, true["period"]) <= result.error.period
    assert off(outcome.speed_time_mean, true["speed_time_mean"]) <= result.error.period + 4 * ROUNDING
    assert result.reached == (estimate <= rtol)


@pytest.mark.parametrize(("name", "eps", "rtol"), sample(SIZINGS, 6))
def test_sizings_are_true_within_what_they_claim(name, eps, rtol):
    true, result = figures(name, "sizing", eps), sized(regimes.scene(name, irregularity=eps), rtol)
    estimate = result.error.exact
    assert estimate <= max(rtol, 2e-12)
    assert off(result.flywheel.exact, true["inertia"]) <= estimate
    assert result.flywheel.needed
    check_motion(result, true, max(estimate, result.run.error))
    assert result.simulation is None
    constant = regimes.figures(name).get("constant")
    if constant:
        swing = float(constant["accumulated_max"]) - float(constant["accumulated_min"])
        assert off(result.energy_fluctuation, swing) <= max(10 * result.error.approximate, 1e-12)
        total = swing / (eps * float(constant["speed"]) ** 2) / result.scene.flywheel_ratio**2
        assert off(result.flywheel.approximate_total, total) <= max(10 * result.error.approximate, 1e-11)


@pytest.mark.parametrize(("name", "inertia"), sample(HEAVY, 5))
def test_the_simulation_confirms_the_motion(name, inertia):
    true, result = figures(name, "analysis", inertia), sized(regimes.scene(name, inertia=inertia), simulate=True)
    outcome = result.simulation
    assert (outcome.route, result.reached) == ("time", True)
    assert off(outcome.irregularity, true["irregularity"]) <= result.error.simulation
    assert off(outcome.period, true["period"]) <= result.error.simulation
    assert abs(outcome.closure) <= 1e-9


def test_section_c_to_twelve_digits():
    """The source's machine (sources.md C) without flywheel."""
    result = sized(regimes.scene("section-c", inertia=0), rtol=1e-12)
    assert result.run.irregularity == pytest.approx(0.483227, abs=5e-7)
    assert result.speed == pytest.approx(4.12273, abs=5e-6)
    assert result.simulation.period == pytest.approx(1.538536393184, abs=1e-12)
    assert result.as_dict()["speed_asked"] is None


@pytest.mark.parametrize(
    ("name", "eps"), sample([(n, e) for n in ("dc-inductance", "kloss-press", "geared-loss") for e in (1.2, 1e-10)], 3)
)
def test_any_irregularity(name, eps):
    """The flywheel found leaves the irregularity that was asked for, as an analysis finds it."""
    result = sized(regimes.scene(name, irregularity=eps))
    again = sized(regimes.scene(name, inertia=result.flywheel.exact))
    assert result.reached
    assert again.run.irregularity == pytest.approx(eps, rel=2e-9)
    assert again.speed == pytest.approx(result.speed, rel=2e-9)


@pytest.mark.parametrize(
    ("name", "path", "words"),
    sample(
        [
            ("runaway", "drive", "no steady speed: at every speed a cycle has net work left over"),
            ("stalled", "drive", "a drive that cannot carry the mean load"),
            ("starved", "drive", "a drive that cannot carry the mean load"),
            ("light", "flywheel.inertia", "a motor that stalls at crank angle"),
        ],
        2,
    ),
)
def test_machines_without_a_regime_are_named(name, path, words):
    with pytest.raises(SceneError) as caught:
        sized(regimes.BAD[name].scene)
    (fault,) = caught.value.faults
    assert fault.path == path
    assert words in str(fault)


def test_an_unstable_regime_is_named_and_reported_at_a_balance():
    with pytest.raises(SceneError, match=r"drive: found an unstable regime: near 18\.75"):
        sized(regimes.scene("unstable", inertia=3))
    scene = regimes.scene("unstable", inertia=3) | {"regime": {"speed": 18.75}, "parameters": {"T": "balance"}}
    scene["drive"] = {"torque": "T + 3*omega"}
    result = sized(scene)
    assert result.balance.value == pytest.approx(10, abs=0.2)  # near what has its mean of extremes there
    assert result.cyclic.multiplier > 1
    assert any("unstable" in message and "governor" in message for message in result.messages)


def test_a_law_of_time_has_no_cycle():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "-5*t"}, {"on": "crank", "torque": "-omega"}])
    with pytest.raises(SceneError, match=r"load\[0\]\.torque: found a law that depends on time"):
        sized(scene)


def test_losses_want_something_that_makes_up_for_them():
    scene = regimes.scene("geared-loss", inertia=0.05) | {"drive": {"on": "motor", "torque": 12}}
    with pytest.raises(SceneError, match=r"shafts: found losses in meshes.*balance"):
        sized(scene)


def test_the_speed_asked_for_is_told_from_the_speed_taken():
    result = sized(regimes.scene("shaper", inertia=0.2))
    true = float(regimes.figures("shaper")["analysis"]["0.2"]["speed"])
    assert result.as_dict()["speed_asked"] == pytest.approx(70 * np.pi / 30)
    assert result.speed == pytest.approx(true, rel=1e-12)
    assert any(f"runs at {result.speed:.10g} rad/s (mean of extremes), -26.68 % from" in m for m in result.messages)


@pytest.mark.slow
def test_a_light_flywheel_is_not_followed_to_infinity():
    """A torque that vanishes beside the energy closes nothing: an induction motor that stalls must not run at 1e12 rad/s."""
    motor = {"type": "induction", "power": "1.1 kW", "speed": "1415 rpm", "poles": 4, "frequency": "50 Hz"}
    scene = {
        "load": [{"on": "crank", "torque": -100, "from": 0, "to": "60 deg"}],
        "drive": {"motor": {**motor, "breakdown_ratio": 2.4}},
        "flywheel": {"inertia": 0.001},
    }
    with pytest.raises(flywheel.SceneError, match="stalls at crank angle"):
        flywheel.size(flywheel.load(scene), simulate=False)


def test_nothing_that_varies_and_nothing_that_weighs():
    scene = {"load": [{"on": "crank", "torque": -5}], "drive": {"torque": "20 - omega"}, "flywheel": {"irregularity": 0.1}}
    result = flywheel.size(flywheel.load(scene), simulate=False)
    assert result.flywheel.exact == 0.0
    assert result.flywheel.needed is False
    assert result.speed == pytest.approx(15.0)


@pytest.mark.parametrize("wheel", [{"inertia": 2.0}, {"irregularity": 0.1}])
def test_an_even_motion_is_no_uncertain_one(wheel):
    """A constant load through a mesh with losses: nothing varies, and an error relative to nothing says nothing."""
    scene = {
        "shafts": {"motor": {"ratio": 5, "efficiency": 0.9}},
        "inertia": [{"on": "motor", "value": 0.1}],
        "load": [{"on": "crank", "torque": -50}],
        "drive": {"on": "motor", "torque": "30 - 0.2*omega"},
        "flywheel": wheel,
    }
    result = flywheel.size(flywheel.load(scene), simulate=False)
    assert result.speed == pytest.approx((30 - 50 / 5 / 0.9) / 0.2 / 5, rel=1e-12)
    assert result.run is None or result.run.irregularity <= 1e-12


GOVERNOR_CASES = [(300, 0.26, 0.0577193), (350, 0.42, 0.0505731), (350, 0.5, 0.0451076)]


@pytest.mark.parametrize(("load", "eps", "inertia"), sample(GOVERNOR_CASES, 3))
def test_a_flywheel_whose_own_motion_does_not_settle_is_searched_between_given_ones(load, eps, inertia):
    """An engine with a steep governor: inertias by exact integration of J omega d omega/(T - L), piece by piece."""
    motor = {"type": "engine", "speed": "1500 rpm", "torque": 100, "droop": "8 %", "braking_torque": 20}
    scene = {"load": [{"on": "crank", "torque": -load, "from": 0, "to": "90 deg"}], "drive": {"motor": motor}}
    result = flywheel.size(flywheel.load({**scene, "flywheel": {"irregularity": eps}}), simulate=False)
    assert result.flywheel.exact == pytest.approx(inertia, rel=1e-5)
    given = flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": result.flywheel.exact}}), simulate=False)
    assert given.simulation is not None
    assert given.simulation.irregularity == pytest.approx(eps, rel=1e-10)


def test_a_motion_that_may_as_well_stop_is_refused():
    """The limit of stalling is J = 1.06303670: below it there is no motion, whatever the iteration makes of it."""
    scene = {"load": [{"on": "crank", "torque": -120, "from": 0, "to": "60 deg"}], "drive": {"torque": "40-2*omega"}}
    with pytest.raises(flywheel.SceneError, match="stalls at crank angle"):
        flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": 1.063026}}), simulate=False)


def varied(w, c, inertia):
    """omega = w (1 + c sin phi) with a flywheel J, under w - omega and the load that this takes; asked for 2 c."""
    rise = f"{inertia}*({w}*(1 + {c}*sin(phi)))*({w}*{c}*cos(phi))"
    load = [{"on": "crank", "torque": f"{rise} + {w}*{c}*sin(phi)"}]
    return {"load": load, "drive": {"torque": f"{w} - omega"}, "flywheel": {"irregularity": 2 * c}}


@pytest.mark.parametrize(
    ("w", "c", "inertia"),
    sample(
        [
            (1e-3, 0.99, 100.0),
            (1e-6, 0.01, 300.0),
            (1.0, 0.1, 1e-4),
            (10.0, 0.9, 0.1),
        ],
        7,
    ),
)
def test_a_flywheel_that_its_irregularity_hardly_tells_is_as_doubtful_as_that_or_refused(w, c, inertia):
    """Torques that hold the speed leave d eps/dJ tiny: J is known here whatever it is."""
    try:
        result = sized(varied(w, c, inertia))
    except SceneError as error:
        refusal = str(error)
    else:
        refusal = ""
    if refusal:
        assert w * inertia < 1e-3
        reasons = ("an irregularity almost independent of the flywheel", "Newton's method has not converged")
        assert any(reason in refusal for reason in reasons)
        return
    swing = np.ptp(result.cycle.start[0]) / (2 * c * result.speed**2)
    assert abs(result.flywheel.exact - inertia) <= result.error.exact * max(inertia, swing)
    assert abs(result.flywheel.exact / inertia - 1) <= 1e-4 or w * inertia < 1e-3


@pytest.mark.parametrize("lacking", np.logspace(-1, -5, 9).tolist())
def test_a_speed_that_nearly_comes_to_rest_has_its_least_where_it_is(lacking):
    """omega = 1 + c sin phi without inertia: 1 - c is small beside what rounds the series, whose least it is."""
    c = 1.0 - lacking
    load = [{"on": "crank", "torque": f"{c}*sin(phi)"}]
    result = sized({"load": load, "drive": {"torque": "1 - omega"}, "flywheel": {"inertia": 0}})
    assert result.simulation.irregularity == pytest.approx(2.0 * c, abs=1e-11)
    assert result.simulation.speed_min == pytest.approx(lacking, abs=1e-13)


DAMPED = {
    "shaft": (
        {"load": [{"on": "crank", "torque": "-5*sin(phi)"}], "drive": {"torque": "20 - omega"}},
        np.sqrt(20**2 - 5**2),
        15,
        25,
    ),
    "window": (
        {"load": [{"on": "crank", "torque": -10, "from": 0, "to": "90 deg"}], "drive": {"torque": "20 - omega"}},
        *(2 * np.pi / (np.pi / 2 / 10 + 3 * np.pi / 2 / 20), 10, 20),
    ),
    "port": (
        {
            "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}},
            "damper": [{"on": "yoke", "coefficient": 20}, {"on": "crank", "coefficient": 3}],
            "drive": {"torque": 20},
        },
        *(20 / 5.5, 2.5, 20 / 3),  # 1/omega = (3 + 5 sin²)/20
    ),
    "motor": (
        {
            "load": [{"on": "crank", "torque": "-5*(1 + sin(phi))"}],
            "drive": {"motor": {"type": "dc", "voltage": 24, "resistance": 0.5, "constant": 0.5}},
        },
        *(np.sqrt(38**2 - 10**2), 28, 48),  # 48 - 2 M
    ),
    "balance": (
        {
            "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}},
            "damper": [{"on": "yoke", "coefficient": 20}, {"on": "crank", "coefficient": 3}],
            "drive": {"torque": "balance"},
            "regime": {"speed": 5.5},
        },
        *(24 / 5.5, 3, 8),
    ),
}
"""Machines without inertia, with their mean speed over time, their least and greatest: where the torques balance."""


@pytest.mark.parametrize("simulate", sample([False, True], 4))
@pytest.mark.parametrize("name", DAMPED)
def test_a_machine_without_inertia_that_its_own_dampers_hold_needs_no_flywheel(name, simulate):
    scene, mean, least, greatest = DAMPED[name]
    eps = 2 * (greatest - least) / (greatest + least)
    result = sized(scene | {"flywheel": {"irregularity": 1.5}}, simulate=simulate)
    assert (result.flywheel.exact, result.flywheel.needed) == (0.0, False)
    assert result.speed == pytest.approx(0.5 * (least + greatest), rel=1e-11)
    assert any("no inertia, so that its speed follows its torques at once" in message for message in result.messages)
    assert (result.simulation is None) is not simulate
    given = sized(scene | {"flywheel": {"inertia": 0}}, simulate=simulate)
    for outcome in (given.simulation, *([result.simulation] if simulate else [])):
        assert outcome.irregularity == pytest.approx(eps, rel=given.error.simulation)
        assert [outcome.speed_min, outcome.speed_max] == pytest.approx([least, greatest], rel=1e-11)
        assert outcome.speed_time_mean == pytest.approx(mean, rel=1e-11)
    assert sized(scene | {"flywheel": {"irregularity": 0.5 * eps}}).flywheel.needed


def test_a_machine_without_inertia_that_needs_no_flywheel_is_not_told_that_nothing_acts_on_it():
    motor = {"type": "dc", "voltage": 220, "power": 1500, "speed": "1000 rpm", "efficiency": 0.82}
    load = {"on": "crank", "torque": -3.0, "from": 0, "to": "120 deg"}
    result = sized({"drive": {"motor": motor}, "load": [load], "flywheel": {"irregularity": 0.02}})
    assert result.flywheel.needed is False
    assert result.energy_fluctuation == pytest.approx(3.0 * 4 * np.pi / 9, rel=1e-12)
    assert "its torques alone hold its speed as evenly as asked" in " ".join(text(result).split())


@pytest.mark.slow
def test_a_search_whose_work_is_spent_gives_the_motion_that_it_came_to_with_its_error():
    """The yoke weighs nothing at its dead centres, and the dampers hold the speed there at once."""
    scene = DAMPED["port"][0] | {"flywheel": {"irregularity": 1.5}}
    scene["mechanism"] = scene["mechanism"] | {"yoke": {"mass": 1e-3}}
    result = sized(scene)
    assert (result.flywheel.exact, result.flywheel.needed) == (0.0, False)
    assert "rtol 1e-09 not reached" in result.messages[0]
    assert 1e-9 < result.error.exact < 1e-6


def governed(torque, wheel, load="-50 - 10*sin(phi)"):
    inertia, load = [{"on": "crank", "value": 0.1}], [{"on": "crank", "torque": load}]
    return {"inertia": inertia, "load": load, "drive": {"torque": torque}, "flywheel": wheel}


@pytest.mark.parametrize("steep", sample([2e3, 2e5], 4))
@pytest.mark.parametrize("inertia", sample([0.0, 1.0], 2))
def test_a_steep_band_within_which_the_speed_stays_is_the_line_that_it_cuts(steep, inertia):
    line, band = f"{steep}*(19 - omega)", f"min(200, max(0, {steep}*(19 - omega)))"
    result, true = (sized(governed(torque, {"inertia": inertia})) for torque in (band, line))
    allowed = result.error.simulation + true.error.simulation
    assert allowed < 1e-3
    assert result.simulation.irregularity == pytest.approx(true.simulation.irregularity, rel=allowed)
    hair = allowed * true.simulation.irregularity  # of the mean speed: what the told errors leave a speed
    assert result.simulation.speed_min == pytest.approx(true.simulation.speed_min, rel=hair)


@pytest.mark.parametrize("gain", [2e3, 2e4, 2e5])
def test_a_stiff_drive_has_the_last_digits_of_the_speed_in_its_error(gain):
    """J omega omega' = gain (19 - omega) - 50 - 10 sin phi: without J it varies by 20/gain, with J a little less."""
    result = sized(governed(f"{gain}*(19 - omega)", {"inertia": 0.0}))
    mean = 19 - 50 / gain
    true = 20 / gain / mean / np.hypot(1.0, 0.1 * mean / gain)
    assert abs(result.simulation.irregularity / true - 1.0) <= result.error.simulation + (0.1 * 10 / gain / gain) ** 2
    assert result.error.simulation < 1e-3


@pytest.mark.parametrize(
    ("torque", "load", "message"),
    [
        (
            "200 if omega < 19 else 20",
            "-50 - 10*sin(phi)",
            "it comes to a motion that sticks at crank angle 0 deg, 19 rad/s",
        ),
        ("200 - 8*omega", "-50 - 20*sin(phi) - 5*sqrt(omega - 18)", "(sqrt(omega - 18): the square root of -"),
    ],
)
def test_why_there_is_no_motion_is_told_as_it_is_found_in_time(torque, load, message):
    with pytest.raises(SceneError) as caught:
        sized(governed(torque, {"irregularity": 0.3}, load))
    assert message in str(caught.value)


def test_a_law_that_ends_at_a_speed_is_looked_at_up_to_there():
    """200 - 8 w - 50 - 5 sqrt(w - 18) = 0 at w = 18.369...: all between 18 rad/s and the next speed looked at."""
    result = sized(governed("200 - 8*omega", {"inertia": 10.0}, "-50 - 2*sin(phi) - 5*sqrt(omega - 18)"))
    root = np.roots([8.0, 5.0, -6.0]).max()
    assert result.speed == pytest.approx(18 + root**2, rel=1e-5)


# Sizing along the machine's own motion: what other units, other words and other origins leave as it is; laws that bend.


@pytest.mark.parametrize("make", [scenes.yoke, scenes.shaper])
@pytest.mark.parametrize("given_", [{"irregularity": 0.05}, {"inertia": 70}])
def test_slopes_of_zero_give_what_positions_alone_do(make, given_):
    """A damper that takes nothing sends the machine through the collocation: every figure stays."""
    scene = make(flywheel=given_)
    plain = sized(scene)
    moving = sized(scene | {"damper": [{"on": "crank", "coefficient": 0}]})
    assert plain.cyclic is None
    assert moving.cyclic.damping == 0.0
    for part in ("flywheel", "reduced_inertia"):
        pairs = zip(getattr(plain, part), getattr(moving, part), strict=True)
        assert all(a == pytest.approx(b, rel=1e-9) for a, b in pairs if isinstance(a, float) and isinstance(b, float))
    names = ("speed", "power", "accumulated_max", "accumulated_min", "angle_speed_max", "angle_speed_min")
    for name in names:
        assert getattr(moving, name) == pytest.approx(getattr(plain, name), rel=1e-11, abs=1e-9)
    assert moving.balance.value == pytest.approx(plain.balance.value, rel=1e-12)
    assert moving.run.irregularity == pytest.approx(plain.run.irregularity, rel=1e-11)
    assert [round(a.start, 9) for a in moving.areas] == [round(a.start, 9) for a in plain.areas]


DRAGS = {
    "damper": {"damper": [{"on": "yoke", "coefficient": 150}]},
    "v": {"load": [{"on": "yoke", "force": "-150*v"}]},
    "two": {"load": [{"on": "yoke", "force": "-50*v"}], "damper": [{"on": "yoke", "coefficient": 100}]},
    "omega": {"load": [{"on": "yoke", "force": "150*0.3*sin(phi)*omega"}]},
    "crank": {"load": [{"on": "crank", "torque": "-150*(0.3*sin(phi))**2*omega"}]},
    "shaft": {
        "shafts": {"fast": {"ratio": 4}},
        "load": [{"on": "fast", "torque": "-150*(0.3*sin(phi))**2*omega/16"}],
    },
}


@pytest.mark.parametrize("kind", ["v", "omega", "shaft"])
def test_one_drag_written_in_several_ways(kind):
    base = {key: regimes.YOKE[key] for key in ("mechanism", "drive")} | {"flywheel": {"irregularity": 0.05}}
    true, result = sized(base | DRAGS["damper"]), sized(base | DRAGS[kind])
    assert result.flywheel.exact == pytest.approx(true.flywheel.exact, rel=1e-12)
    assert result.flywheel.approximate == pytest.approx(true.flywheel.approximate, rel=1e-12)
    assert (result.speed, result.power) == pytest.approx((true.speed, true.power), rel=1e-12)
    assert result.cyclic.multiplier == pytest.approx(true.cyclic.multiplier, rel=1e-10)


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(st.floats(0.05, 20), st.floats(0.1, 10))
def test_units_of_mass_and_time_may_be_others(mass, time):
    """Masses times m and times over s: torques grow by m s², slopes by m s, inertia by m, speeds by s."""

    def press(m, s):
        return {
            "mechanism": {
                "type": "slider-crank",
                "crank": {"length": 0.1, "inertia": 0.2 * m},
                "rod": {"length": 0.5, "mass": 10 * m, "inertia": 0.3 * m, "com": 0.2},
                "slider": {"mass": 50 * m},
            },
            "gravity": {"g": 9.81 * s**2},
            "load": [
                {"on": "slider", "force": -2e3 * m * s**2, "from": "300 deg", "to": "345 deg"},
                {"on": "slider", "force": f"-{40 * m!r}*v*abs(v)"},
            ],
            "damper": [{"on": "slider", "coefficient": 100 * m * s}],
            "drive": {"torque": f"{60 * m * s**2!r} - {4 * m * s!r}*omega"},
            "flywheel": {"irregularity": 0.05},
        }

    one, other = sized(press(1, 1)), sized(press(mass, time))
    assert other.flywheel.exact == pytest.approx(mass * one.flywheel.exact, rel=1e-9)
    assert other.speed == pytest.approx(time * one.speed, rel=1e-9)
    assert other.power == pytest.approx(mass * time**3 * one.power, rel=1e-9)
    assert other.cyclic.multiplier == pytest.approx(one.cyclic.multiplier, rel=1e-8)


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(st.floats(1, 359))
def test_the_crank_may_count_its_angle_from_anywhere(degrees):
    scene = regimes.scene("four-bar", irregularity=0.02)
    turned = scene | {"mechanism": scene["mechanism"] | {"phase": f"{degrees} deg"}}
    one, other = sized(scene), sized(turned)
    assert other.flywheel.exact == pytest.approx(one.flywheel.exact, rel=1e-9)
    assert other.speed == pytest.approx(one.speed, rel=1e-10)
    gap = other.angle_speed_max + np.radians(degrees) - one.angle_speed_max
    assert abs(np.sin(gap / 2)) < 1e-6


# -- laws that bend where the motion says, against fine steps in the angle -----------------------------------------------


BENT = {
    "governed": ("min(120, max(0, 60*(9 - omega)))", "-30 - 150*(phi > 1)*(phi < 2)"),
    "two slopes": ("90 - 6*omega if omega < 9 else 36 - 18*(omega - 9)", "-60*(1 + sin(phi))*0.5"),
    "relief": ("100 - 6*omega", "-min(80, 2*omega*abs(omega))*(sin(phi) > 0)"),
    "threshold": ("100 - 6*omega", "-8*max(0, abs(v) - 7)*sign(v) - 20*(cos(phi) > 0)"),
    "nested": ("80 - 4*omega", "-(5*omega if omega > 8.5 else 42.5) - 40*(sin(phi) > 0.5)"),
}


def bent(drive, load, inertia):
    scene = {"load": [{"on": "crank", "torque": load}], "drive": {"torque": drive}, "flywheel": {"inertia": inertia}}
    names = {"sin": np.sin, "cos": np.cos, "min": min, "max": max, "abs": abs, "sign": np.sign}
    law = compile(f"({drive}) + ({load})", "law", "eval")

    def rate(phi, state):
        return [eval(law, names | {"phi": phi, "omega": state[0], "v": state[0]}) / inertia / state[0]]

    return scene, rate


@pytest.mark.parametrize("name", BENT)
def test_laws_that_bend_at_a_speed(name):
    scene, rate = bent(*BENT[name], 3.0)
    result = sized(scene)
    start = np.sqrt(result.speed**2 + 2 * result.run.offset / 3.0)
    edges = result.cycle.mesh.edges.tolist()
    state = [start]
    for low, high in pairwise(edges):
        inset = 1e-13 * (high - low)
        outcome = solve_ivp(
            lambda phi, state, ends=(low + inset, high - inset): rate(min(max(phi, ends[0]), ends[1]), state),
            (low, high),
            state,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
            dense_output=True,
        )
        speeds = outcome.sol(np.linspace(low, high, 9))[0]
        assert speeds.max() <= result.run.speed_max * (1 + 1e-9)
        assert speeds.min() >= result.run.speed_min * (1 - 1e-9)
        state = [outcome.y[0, -1]]
    assert state[0] == pytest.approx(start, rel=1e-9)
    assert result.reached


def past(threshold):
    """A yoke with drag past a velocity alone: where that is depends on the motion."""
    return {
        "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.3, "inertia": 0.5}, "yoke": {"mass": 20}},
        "load": [{"on": "yoke", "force": f"-400*max(0, abs(v) - {threshold})*sign(v)"}],
        "drive": {"torque": "160 - 12*omega"},
        "flywheel": {"inertia": 10},
    }


def test_a_switch_at_a_velocity_lies_where_the_motion_reaches_it():
    result = sized(past(1.2))
    cuts = result.cycle.mesh.edges
    start = np.sqrt(result.speed**2 + 2 * result.run.offset / (10 + result.cycle.inertia_at_start))

    def rate(phi, state):
        gain, bend = -0.3 * np.sin(phi), -0.3 * np.cos(phi)
        velocity = gain * state[0]
        force = -400 * max(0.0, abs(velocity) - 1.2) * np.sign(velocity)
        inertia = 10.5 + 20 * gain**2
        moment = 160 - 12 * state[0] + force * gain - 20 * gain * bend * state[0] ** 2
        return [moment / inertia / state[0]]

    reached = lambda phi, state: abs(0.3 * np.sin(phi) * state[0]) - 1.2  # noqa: E731
    outcome = solve_ivp(
        rate, (0, 2 * np.pi), [start], method="DOP853", rtol=1e-10, atol=1e-11, events=reached, max_step=0.05
    )
    assert outcome.y[0, -1] == pytest.approx(start, rel=1e-8)
    assert outcome.t_events[0].size == 4
    for angle in outcome.t_events[0]:
        assert np.abs(cuts - angle).min() < 1e-8


def test_a_strong_governor_is_followed_through_its_corners():
    """Cells that do not end at the corners yet cannot agree on a branch each: every node decides for itself at first."""
    scene, _ = bent("min(120, max(0, 60*(9 - omega)))", "-30 - 150*(phi > 1)*(phi < 2)", 3.0)
    assert sized(scene).run.irregularity == pytest.approx(0.557283304543, rel=1e-9)
    scene["flywheel"] = {"irregularity": 0.557283304543137}
    assert sized(scene).flywheel.exact == pytest.approx(3.0, rel=1e-8)


# The level `confirm`: the motion by collocation on separate cells, against 30-digit references, with an honest error.


MACHINES = [name for name, true in REFERENCES.items() if true.get("simulation") and "balance" in true]
FIGURES = ("irregularity", "irregularity_approximate", "speed_max", "speed_min", "speed_time_mean", "period")


def confirm(scene, **options):
    return flywheel.size(flywheel.load(scene), accuracy="confirm", **options)


@pytest.mark.parametrize("name", sample(MACHINES, 7))
def test_the_motion_is_that_of_the_references_within_its_estimate(name):
    true, sizing = REFERENCES[name]["simulation"], confirm(FOLDER / "scenes" / f"{name}.toml")
    result, allowed = sizing.simulation, sizing.error.simulation
    assert result.route == "collocation"
    assert 0.0 < allowed <= sizing.rtol
    for key in FIGURES:
        if key in true and true[key] is not None:
            assert error(getattr(result, key), true[key]) <= allowed + 4e-16, key
    assert abs(result.closure) < 1e-12


@pytest.mark.parametrize("rtol", [1e-3, 1e-12])
@pytest.mark.parametrize("name", sample(["press", "drag-link", "rotor-wide-eps"], 2))
def test_the_estimate_bounds_the_true_error_at_other_accuracies(name, rtol):
    true, sizing = REFERENCES[name]["simulation"], confirm(FOLDER / "scenes" / f"{name}.toml", rtol=rtol)
    assert error(sizing.simulation.irregularity, true["irregularity"]) <= sizing.error.simulation + 4e-16
    assert sizing.error.simulation <= max(rtol, 5e-11)


@pytest.mark.parametrize("name", sample(["section-c", "pump", "kloss-press", "geared-loss", "dc-inductance", "governor"], 6))
def test_torques_that_depend_on_speed_are_solved_for_again(name):
    case = regimes.CASES[name]
    eps = case.irregularities[0]
    sizing = confirm(regimes.scene(name, irregularity=eps))
    assert sizing.simulation.route == "collocation"
    assert abs(sizing.simulation.irregularity / eps - 1) <= sizing.error.simulation <= 1e-9
    given = case.inertias[-1]
    true = regimes.figures(name)["analysis"][str(given)]
    result = confirm(regimes.scene(name, inertia=given))
    assert error(result.simulation.irregularity, true["irregularity"]) <= result.error.simulation <= 1e-9
    assert error(result.simulation.period, true["period"]) <= result.error.simulation
    audit = flywheel.size(result.scene).simulation
    assert result.simulation.period == pytest.approx(audit.period, rel=1e-9)


def halved_cells(edges):
    """All cells, to nine decimals, that halving up to five times may lead to."""
    result = set()
    for _ in range(6):
        result |= set(pairwise(np.round(edges, 9).tolist()))
        edges = np.sort(np.concatenate((edges, 0.5 * (edges[1:] + edges[:-1]))))
    return result


def test_no_cell_is_one_of_the_figures_however_often_either_are_halved():
    for make in scenes.ALL.values():
        machine = Machine(flywheel.load(make()))
        own = on_thirds(machine).mesh
        assert not halved_cells(machine.mesh) & halved_cells(own)
        assert (np.diff(own) > 0.0).all()
        assert np.isin(machine.landmarks, own).all()


def test_a_flywheel_that_the_closed_form_got_wrong_is_found_out():
    machine = Machine(flywheel.load(scenes.press()))
    figures, run = wittenbauer.resolved_figures(machine, 1e-9)
    wrong = run._replace(inertia=1.01 * run.inertia)
    result = by_collocation(Regime(machine, 1e-9, figures, run, wrong, figures.cycle, figures.speed), None)
    assert 0.005 < result.error < 0.02
    assert result.motion.irregularity < 0.0499


def test_what_takes_too_long_is_told_by_quadrature(monkeypatch):
    monkeypatch.setattr("flywheel.sizing.confirmation._MOST_WORK", 100)
    sizing = confirm(scenes.press())
    assert sizing.simulation.route == "quadrature"
    assert any("takes too long" in message for message in sizing.messages)
    assert "confirmation" in sizing.left_out[0]


def test_what_a_cycle_leaves_over_shows_in_the_closure():
    """Work that closes only as far as `accuracy.closure` allows: the speed drifts by as much over the cycle."""
    open_ = scenes.rotor(drive={"torque": "49.99 N m"}, accuracy={"closure": 0.01}, flywheel={"inertia": 20})
    sizing = confirm(open_)
    cycle, result = sizing.cycle, sizing.simulation
    start = float(sizing.speed**2 * 20 / 2)
    assert result.route == "collocation"
    assert cycle.net == pytest.approx(-0.01 * 2 * np.pi, rel=1e-9)
    assert result.closure == pytest.approx(cycle.net / (2 * start), rel=0.02)
    assert result.irregularity == pytest.approx(flywheel.size(sizing.scene).simulation.irregularity, rel=1e-9)


def test_a_machine_without_inertia_has_nothing_to_solve_for():
    still = {"drive": {"torque": "balance"}, "regime": {"speed": 1}, "flywheel": {"irregularity": 0.1}}
    sizing = confirm(still)
    assert sizing.simulation is None
    assert any("no inertia" in message for message in sizing.messages)
