"""Sizing and analysis along the machine's own motion: against 18-digit references, and by name where there is none."""

import numpy as np
import pytest

import flywheel
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import SceneError
from flywheel.tables.sizing import text
from tests import regimes, scenes
from tests.limits import sample

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
    found = regimes.figures(name)[kind][repr(key)]
    return {k: float(v) for k, v in found.items() if v is not None and not isinstance(v, list)}


def off(found, true):
    return abs(found / true - 1)


def check_motion(result, true, allowed):
    """Speeds, their angles, multiplier, balance and power, each to what the estimates allow."""
    run = result.run
    close = {"rel": allowed + 16 * ROUNDING}
    level = close["rel"] * max(true["irregularity"], 1e-6) + 4 * result.cyclic.level_error + 16 * ROUNDING
    for found, key in ((result.speed, "speed"), (run.speed_max, "speed_max"), (run.speed_min, "speed_min")):
        assert off(found, true[key]) <= level
    assert off(run.irregularity, true["irregularity"]) <= close["rel"]
    for found, key in ((result.angle_speed_max, "angle_speed_max"), (result.angle_speed_min, "angle_speed_min")):
        assert abs(np.sin((found - true[key]) / 2)) <= result.error.extremes + 1e-12
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
    found = result.simulation
    assert off(found.irregularity, true["irregularity"]) <= estimate
    assert off(found.period, true["period"]) <= result.error.period
    assert off(found.speed_time_mean, true["speed_time_mean"]) <= result.error.period + 4 * ROUNDING
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
    found = result.simulation
    assert (found.route, result.reached) == ("time", True)
    assert off(found.irregularity, true["irregularity"]) <= result.error.simulation
    assert off(found.period, true["period"]) <= result.error.simulation
    assert abs(found.closure) <= 1e-9


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
    found = sized(regimes.scene(name, irregularity=eps))
    again = sized(regimes.scene(name, inertia=found.flywheel.exact))
    assert found.reached
    assert again.run.irregularity == pytest.approx(eps, rel=2e-9)
    assert again.speed == pytest.approx(found.speed, rel=2e-9)


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
    assert any(f"takes {result.speed:.10g} rad/s (mean of extremes), -26.68 % off" in m for m in result.messages)


@pytest.mark.slow
def test_a_light_flywheel_is_not_followed_to_infinity():
    """Where torque vanishes beside the energy, nothing closes: an induction motor that stalls must not run at 1e12 rad/s."""
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
    found = flywheel.size(flywheel.load(scene), simulate=False)
    assert found.flywheel.exact == 0.0
    assert found.flywheel.needed is False
    assert found.speed == pytest.approx(15.0)


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
    found = flywheel.size(flywheel.load(scene), simulate=False)
    assert found.speed == pytest.approx((30 - 50 / 5 / 0.9) / 0.2 / 5, rel=1e-12)
    assert found.run is None or found.run.irregularity <= 1e-12


GOVERNOR_CASES = [(300, 0.26, 0.0577193), (350, 0.42, 0.0505731), (350, 0.5, 0.0451076)]


@pytest.mark.parametrize(("load", "eps", "inertia"), sample(GOVERNOR_CASES, 3))
def test_a_flywheel_whose_own_motion_does_not_settle_is_searched_between_given_ones(load, eps, inertia):
    """An engine with a steep governor: inertias by exact integration of J omega d omega/(T - L), piece by piece."""
    motor = {"type": "engine", "speed": "1500 rpm", "torque": 100, "droop": "8 %", "braking_torque": 20}
    scene = {"load": [{"on": "crank", "torque": -load, "from": 0, "to": "90 deg"}], "drive": {"motor": motor}}
    found = flywheel.size(flywheel.load({**scene, "flywheel": {"irregularity": eps}}), simulate=False)
    assert found.flywheel.exact == pytest.approx(inertia, rel=1e-5)
    given = flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": found.flywheel.exact}}), simulate=False)
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
        reasons = ("an irregularity that hardly tells the flywheel", "Newton's method has not settled")
        assert any(reason in refusal for reason in reasons)
        return
    swing = np.ptp(result.cycle.start[0]) / (2 * c * result.speed**2)
    assert abs(result.flywheel.exact - inertia) <= result.error.exact * max(inertia, swing)
    assert abs(result.flywheel.exact / inertia - 1) <= 1e-4 or w * inertia < 1e-3


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
    for found in (given.simulation, *([result.simulation] if simulate else [])):
        assert found.irregularity == pytest.approx(eps, rel=given.error.simulation)
        assert [found.speed_min, found.speed_max] == pytest.approx([least, greatest], rel=1e-11)
        assert found.speed_time_mean == pytest.approx(mean, rel=1e-11)
    assert sized(scene | {"flywheel": {"irregularity": 0.5 * eps}}).flywheel.needed


def test_a_machine_without_inertia_that_needs_no_flywheel_is_not_told_that_nothing_acts_on_it():
    motor = {"type": "dc", "voltage": 220, "power": 1500, "speed": "1000 rpm", "efficiency": 0.82}
    load = {"on": "crank", "torque": -3.0, "from": 0, "to": "120 deg"}
    result = sized({"drive": {"motor": motor}, "load": [load], "flywheel": {"irregularity": 0.02}})
    assert result.flywheel.needed is False
    assert result.energy_fluctuation == pytest.approx(3.0 * 4 * np.pi / 9, rel=1e-12)
    assert "its torques alone hold its speed as evenly as asked" in " ".join(text(result).split())


@pytest.mark.slow
def test_a_search_that_is_given_up_says_what_makes_it_long():
    """The yoke weighs nothing at its dead centres, and the dampers hold the speed there at once."""
    scene = DAMPED["port"][0] | {"flywheel": {"irregularity": 1.5}}
    scene["mechanism"] = scene["mechanism"] | {"yoke": {"mass": 1e-3}}
    with pytest.raises(SceneError, match="bearable time: next to nothing weighs near crank angle") as caught:
        sized(scene)
    assert "vary too fast" not in str(caught.value)


def governed(torque, wheel, load="-50 - 10*sin(phi)"):
    inertia, load = [{"on": "crank", "value": 0.1}], [{"on": "crank", "torque": load}]
    return {"inertia": inertia, "load": load, "drive": {"torque": torque}, "flywheel": wheel}


@pytest.mark.parametrize("steep", sample([2e3, 2e5], 4))
@pytest.mark.parametrize("inertia", sample([0.0, 1.0], 2))
def test_a_steep_band_within_which_the_speed_stays_is_the_line_that_it_cuts(steep, inertia):
    line, band = f"{steep}*(19 - omega)", f"min(200, max(0, {steep}*(19 - omega)))"
    found, true = (sized(governed(torque, {"inertia": inertia})) for torque in (band, line))
    allowed = found.error.simulation + true.error.simulation
    assert allowed < 1e-3
    assert found.simulation.irregularity == pytest.approx(true.simulation.irregularity, rel=allowed)
    hair = allowed * true.simulation.irregularity  # of the mean speed: what the told errors leave a speed
    assert found.simulation.speed_min == pytest.approx(true.simulation.speed_min, rel=hair)


@pytest.mark.parametrize("gain", [2e3, 2e4, 2e5])
def test_a_stiff_drive_has_the_last_digits_of_the_speed_in_its_error(gain):
    """J omega omega' = gain (19 - omega) - 50 - 10 sin phi: without J it varies by 20/gain, with J a little less."""
    found = sized(governed(f"{gain}*(19 - omega)", {"inertia": 0.0}))
    mean = 19 - 50 / gain
    true = 20 / gain / mean / np.hypot(1.0, 0.1 * mean / gain)
    assert abs(found.simulation.irregularity / true - 1.0) <= found.error.simulation + (0.1 * 10 / gain / gain) ** 2
    assert found.error.simulation < 1e-3


@pytest.mark.parametrize(
    ("torque", "load", "told"),
    [
        (
            "200 if omega < 19 else 20",
            "-50 - 10*sin(phi)",
            "it comes to a motion that sticks at crank angle 0 deg, 19 rad/s",
        ),
        ("200 - 8*omega", "-50 - 20*sin(phi) - 5*sqrt(omega - 18)", "(sqrt(omega - 18): the square root of -"),
    ],
)
def test_why_there_is_no_motion_is_told_as_it_is_found_in_time(torque, load, told):
    with pytest.raises(SceneError) as caught:
        sized(governed(torque, {"irregularity": 0.3}, load))
    assert told in str(caught.value)


def test_a_law_that_ends_at_a_speed_is_looked_at_up_to_there():
    """200 - 8 w - 50 - 5 sqrt(w - 18) = 0 at w = 18.369...: all between 18 rad/s and the next speed looked at."""
    found = sized(governed("200 - 8*omega", {"inertia": 10.0}, "-50 - 2*sin(phi) - 5*sqrt(omega - 18)"))
    root = np.roots([8.0, 5.0, -6.0]).max()
    assert found.speed == pytest.approx(18 + root**2, rel=1e-5)
