"""Extreme figures against closed forms and references."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from math import degrees, pi, tau
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp  # type: ignore[import-untyped]
from numpy.typing import NDArray

import flywheel
from flywheel import Sizing
from tests.extremes.cases import light, turning
from tests.extremes.machines import KNOWN, MACHINES, SI, Measure, Scene, crank_shaper, four_bar, running
from tests.extremes.measured import ROUNDING, Row, measured, names, refusal, row
from tests.limits import sample

# Jumps, kinks and window ends that all but coincide, tables with repeated angles; against 30 digits, or refused.


CASES = names("coincidence", "table")
NEAR = names("rod", "offset", "change point", "shaper")
SWEEPS, WINDOWS = names("sweep"), names("window", "windows")
FAULTY = {
    "three equal angles": ([0, 1, 1, 1, tau], "load[0].table: found three equal angles from row 2, expected two at most"),
    "a jump at the first row": ([0, 0, 1, tau], "load[0].table: found a jump at the first row"),
    "a jump at the last row": ([0, 1, tau, tau], "load[0].table: found a jump at the last row"),
    "an angle that goes back": ([0, 2, 1, tau], "load[0].table: found an angle in row 3 that is less"),
    "less than a turn": ([0, 1, 2, 6.28], "load[0].table: found angles from 0 deg to "),
}


def table(angle: list[float], way: str = "linear") -> dict[str, object]:
    """A torque by a table."""
    value = [100.0 * (-1) ** i for i in range(len(angle))]
    return {"table": {"angle": angle, "value": value, "interpolation": way}}


def results() -> list[Row]:
    """One row for each kind, and the words of every refusal."""
    near, read = ([item for name in names(group) for item in measured(name)] for group in ("coincidence", "table"))
    said = [Row("table", key, None, None, refusal(turning([table(angle)]))) for key, (angle, _) in FAULTY.items()]
    return [
        row("kink, jump, window end beside another breakpoint or the seam", "0, 1e-15..1e-9 rad apart", near),
        row("tables with repeated angles", "inside, at the seam, 1e-9 rad apart; linear, step, pchip", read),
        *said,
    ]


@pytest.mark.parametrize("name", [*sample(CASES, 5), *sample(NEAR, 3), *sample(SWEEPS, 6), *sample(WINDOWS, 5)])
def test_every_figure_is_known_to_its_estimate_and_to_rtol(name: str) -> None:
    assert [item for item in measured(name) if not item.honest] == []
    assert [item for item in measured(name) if not item.kept] == []


@pytest.mark.parametrize("way", ["linear", "step", "pchip"])
@pytest.mark.parametrize("name", FAULTY)
def test_a_table_out_of_order_is_refused_with_its_row(name: str, way: str) -> None:
    angle, said = FAULTY[name]
    assert refusal(turning([table(angle, way)])).startswith(said)


@pytest.mark.parametrize("torque", ["100*sin(phi)*(1 - cos(phi))", "100*abs(sin(phi)) - 200/pi", "100*sign(sin(2*phi))"])
def test_zeros_of_the_moment_on_breakpoints_make_no_areas_of_their_own(torque: str) -> None:
    result = flywheel.size(flywheel.load(turning([{"torque": torque}])), simulate=False)
    expected = {"100*sin(phi)*(1 - cos(phi))": 2, "100*abs(sin(phi)) - 200/pi": 5, "100*sign(sin(2*phi))": 4}[torque]
    assert len(result.areas) == expected
    assert all(abs(area.work) > 1.0 for area in result.areas)


# Mechanisms that all but lock, against 30 digits; those that do are refused, with the length and the angle.


GROUPS = {
    "slider-crank": ("rod", "r/l 0.99..0.999999, offset 0"),
    "slider-crank with offset": ("offset", "l above r + |e| by 1e-3..1e-6"),
    "four-bar": ("change point", "1e-3..1e-6 from a change point, open, crossed, folded, drag link"),
    "crank-shaper": ("shaper", "frame/crank within 1e-3..1e-6 of 1"),
}
LOCKED: dict[str, tuple[Scene, str, str]] = {
    "r = l": (light(0.1, 0.0), "mechanism.rod.length", "the crank locks at 90 and 270 deg"),
    "r = l but for rounding": (light(0.1 * (1 + 1e-13), 0.0), "mechanism.rod.length", "the crank locks at 90 and 270 deg"),
    "r above l": (light(0.05, 0.0), "mechanism.rod.length", "the crank locks at 30, 150, 210 and 330 deg"),
    "r + e = l": (light(0.3, 0.2), "mechanism.rod.length", "the crank locks at 270 deg"),
    "r - e = l": (light(0.3, -0.2), "mechanism.rod.length", "the crank locks at 90 deg"),
    "c + L = d + r": (four_bar(bars=(0.4, 0.1, 0.3, 0.2)), "mechanism.coupler.length", "the crank locks at 180 deg"),
    "L - c = d - r": (four_bar(bars=(0.4, 0.1, 0.2, 0.5)), "mechanism.coupler.length", "the crank locks at 0 deg"),
    "a double rocker": (four_bar(bars=(0.4, 0.3, 0.2, 0.3)), "mechanism.rocker.length", "the crank locks at "),
    "bars too short": (four_bar(bars=(1.0, 0.1, 0.3, 0.3)), "mechanism.coupler.length", "it closes at no crank angle"),
    "d = r, shaper": (crank_shaper(crank=0.3, frame=0.3), "mechanism.frame.length", "the crank locks at 180 deg"),
    "parallelogram": (four_bar(bars=(0.4, 0.1, 0.4, 0.1)), "mechanism.rocker.length", "the crank locks at "),
}


def geometry() -> list[Row]:
    """One row per mechanism, and the words of every refusal."""
    near = [row(key, said, (i for n in names(group) for i in measured(n))) for key, (group, said) in GROUPS.items()]
    return near + [Row("locked", key, None, None, refusal(scene)) for key, (scene, *_) in LOCKED.items()]


@pytest.mark.slow
def test_only_the_shaper_loses_digits() -> None:
    assert [i for n in NEAR if "shaper" not in n for i in measured(n) if i.rtol == 1e-9 and i.estimate > 1e-9] == []
    assert max(result.error or 0.0 for result in geometry()) < 1e-9


@pytest.mark.parametrize("name", LOCKED)
def test_what_locks_is_refused_with_the_length_and_the_angle(name: str) -> None:
    scene, path, where = LOCKED[name]
    said = refusal(scene)
    assert said.startswith(f"{path}: found ")
    assert where in said


# Irregularities from 1e-14 to 1.99 and speeds from 1e-6 to 1e6 rad/s, for every mechanism, against 30 digits.


BEYOND = (0.0, -1e-14, 2.0, 2.5)


def irregularities() -> list[Row]:
    """One row per mechanism."""
    span = "eps 1e-14..1.99, speed 1e-6..1e6 rad/s"
    refused = [Row("irregularity", f"{eps:g}", None, None, refusal(even(eps))) for eps in BEYOND]
    return [*(row(name.replace("sweep ", ""), span, measured(name)) for name in SWEEPS), *refused]


def even(eps: float) -> Scene:
    """A scotch yoke for an irregularity."""
    return running(MACHINES["scotch-yoke"](), 6.0, eps)


@pytest.mark.slow
def test_nothing_in_the_range_is_worse_than_rtol() -> None:
    assert max(result.error or 0.0 for result in irregularities()) < 1e-9
    exact = [item for name in SWEEPS for item in measured(name) if item.figure == "exact" and item.rtol <= 1e-9]
    assert max(item.estimate for item in exact) < 5e-8


@pytest.mark.parametrize("eps", BEYOND)
def test_an_irregularity_beyond_the_range_is_refused(eps: float) -> None:
    assert refusal(even(eps)).startswith("flywheel.irregularity: found ")


@pytest.mark.parametrize("speed", [0.0, -1.0])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    assert refusal(running(MACHINES["scotch-yoke"](), speed)).startswith("regime.speed: found ")


@pytest.mark.parametrize(
    ("name", "eps", "speed"),
    sample([("scotch-yoke", 1e-9, 6.0), ("rotor", 1.99, 10.0), ("slider-crank", 0.05, 1e6), ("scotch-yoke", 0.05, 1e-6)], 4),
)
def test_the_time_stepping_agrees_within_what_it_states(name: str, eps: float, speed: float) -> None:
    result = flywheel.size(flywheel.load(running(MACHINES[name](), speed, eps)))
    assert result.simulation is not None
    assert result.error.simulation is not None
    gap = abs(result.simulation.irregularity / eps - 1)
    assert gap <= result.error.simulation + result.error.exact


# What must hold at any irregularity and speed: limits, order, and proven bounds.


powers = st.floats(-13.0, 0.29)  # irregularities from 1e-13 to 1.95
paces = st.floats(-6.0, 6.0)  # speeds from 1e-6 to 1e6 rad/s
FEW = settings(max_examples=8, deadline=None, derandomize=True)
QUICK = st.sampled_from(["rotor", "scotch-yoke", "slider-crank", "four-bar", "crank-shaper"])


def sized(name: str, speed: float, eps: float) -> Sizing:
    return flywheel.size(flywheel.load(running(MACHINES[name](), speed, eps)), simulate=False)


def small(name: str, eps: float) -> float:
    """Difference of the exact figure from that with the inertia torque, as a share: it is of the order of eps."""
    result = sized(name, 30.0, eps)
    return abs(result.flywheel.exact + middle(result) - result.flywheel.inertia_torque) / result.flywheel.inertia_torque


def middle(result: Sizing) -> float:
    """The mean of the extremes of I*, by which the two figures differ at most."""
    inertia = result.reduced_inertia
    assert inertia is not None
    return (inertia.min + inertia.max) / 2


def limits() -> list[Row]:
    """The limit of small irregularities, and the rotor by areas."""
    worst = max(small(name, 1e-9) for name in KNOWN)
    even = max((even_rotor(10.0**k) for k in (-14, -9, -3, 0)), key=lambda pair: pair[0])
    return [
        Row("eps to 0", "eps = 1e-9, 30 rad/s", worst, None, "from the figure with the inertia torque; of order eps"),
        Row("I* that does not vary", "eps 1e-14..1", *even, "exact against approximate, which must be the same"),
    ]


def even_rotor(eps: float) -> tuple[float, float]:
    """The difference of the exact and the approximate flywheel of a rotor, and what is stated."""
    result = sized("rotor", 10.0, eps)
    gap = abs(result.flywheel.exact - result.flywheel.approximate) / result.flywheel.approximate_total
    return gap, (result.error.exact or 0.0) + (result.error.approximate or 0.0)


@FEW
@given(QUICK, powers, paces)
def test_the_exact_figure_is_within_its_proven_bounds(name: str, power: float, pace: float) -> None:
    result = sized(name, 10.0**pace, 10.0**power)
    wheel, slack = result.flywheel, 2 * result.error.exact
    scale = max(wheel.exact, wheel.approximate_total)
    for low, high in (wheel.proven_bounds, wheel.proven_bounds_torque):
        assert max(low, 0.0) - slack * scale <= wheel.exact <= max(high, 0.0) + slack * scale


@FEW
@given(QUICK, st.lists(powers, min_size=2, max_size=4, unique=True), paces)
def test_a_smaller_irregularity_never_asks_for_less(name: str, several: list[float], pace: float) -> None:
    result = [sized(name, 10.0**pace, 10.0**power) for power in sorted(several)]
    for tight, loose in pairwise(result):
        doubt = loose.error.exact * max(loose.flywheel.exact, loose.flywheel.approximate_total)
        assert tight.flywheel.exact >= loose.flywheel.exact - doubt


@pytest.mark.parametrize("name", sample(KNOWN, 2))
def test_as_the_irregularity_vanishes_the_inertia_torque_has_it_right(name: str) -> None:
    assert small(name, 1e-3) < 1e-1
    assert small(name, 1e-9) <= 1.1e-6 * small(name, 1e-3) + 1e-12


# Lobes that are equal, or all but: the value is right whichever is taken, and the angle is one of theirs.


COUNTS = (1, 2, 3, 7, 40, 200)
TILTS = (0.0, 1e-15, -1e-15, 1e-13, -1e-13, 1e-11, -1e-11)


def wave(count: int, tilt: float = 0.0) -> Scene:
    """A shaft with as many equal lobes in a turn, one of them raised by a tilt."""
    return turning([{"torque": f"100*sin({count}*phi) + {100 * tilt!r}*sin(phi)"}])


def square(count: int) -> Scene:
    """The same with jumps, where all extremes stand on breakpoints."""
    return turning([{"torque": f"100*sign(sin({count}*phi))"}])


def twins() -> Scene:
    """Two slider-cranks half a turn apart: every lobe comes twice."""
    cranks = [
        {
            "type": "slider-crank",
            "name": name,
            "phase": f"{phase} deg",
            "crank": {"length": 0.1},
            "rod": {"length": 0.3, "mass": 2.0, "com": 0.1},
            "slider": {"mass": 5.0},
        }
        for name, phase in (("one", 0), ("two", 180))
    ]
    loads = [{"on": f"{name}.slider", "force": -900.0, "while": "v > 0"} for name in ("one", "two")]
    return running({"mechanism": cranks, "load": loads}, 10.0)


def off(count: int, tilt: float) -> tuple[float, float]:
    """Error and estimate of a wave's flywheel: 2 T/(n eps w²) and what a tilt adds, but for its square."""
    result = flywheel.size(flywheel.load(wave(count, tilt)), simulate=False)
    true = 40 / count * (1 + 0.5 * count * tilted(count, tilt))
    return abs(result.flywheel.exact - true) / true, result.error.exact


def tilted(count: int, tilt: float) -> float:
    """Increase of the swing of -cos(n phi) by -tilt cos phi: the best of the equal tops less the best of the bottoms."""
    tops = -tilt * np.cos((2 * np.arange(count) + 1) * pi / count)
    bottoms = -tilt * np.cos(2 * np.arange(count) * pi / count)
    return float(tops.max() - bottoms.min())


def lobes() -> list[Row]:
    """One row for smooth lobes, one for lobes with corners."""
    smooth = max((off(count, tilt) for count in COUNTS for tilt in TILTS), key=lambda pair: pair[0])
    corners = []
    for count in (1, 2, 10):
        result = flywheel.size(flywheel.load(square(count)), simulate=False)
        corners.append((abs(result.flywheel.exact * count / (20 * pi) - 1), result.error.exact))
    return [
        Row("equal lobes, one raised by 0..1e-11", "1..200 in a turn", *smooth, "closed form"),
        Row("equal lobes between jumps", "1, 2, 10 in a turn", *max(corners), "closed form"),
    ]


@pytest.mark.parametrize("tilt", sample(TILTS, 5))
@pytest.mark.parametrize("count", [1, 3, 200])
def test_the_value_is_right_whichever_lobe_is_taken(count: int, tilt: float) -> None:
    error, estimate = off(count, tilt)
    assert error <= estimate + ROUNDING
    assert estimate <= 0.5e-9  # half of what is asked by default
    assert len(flywheel.size(flywheel.load(wave(count, tilt)), simulate=False).areas) == 2 * count


@pytest.mark.parametrize("count", [2, 7, 200])
def test_the_angle_is_that_of_one_of_the_lobes(count: int) -> None:
    result = flywheel.size(flywheel.load(wave(count)), simulate=False)
    assert result.error.extremes is not None
    for angle, shift in ((result.angle_speed_max, 0.5), (result.angle_speed_min, 0.0)):
        assert angle is not None
        turns = angle * count / tau - shift
        assert abs(turns - round(turns)) * tau / count <= result.error.extremes + 1e-15


@pytest.mark.parametrize("tilt", [1e-8, -1e-8])
def test_a_lobe_that_is_truly_higher_is_the_one(tilt: float) -> None:
    """W = -50 cos 2 phi - 100 tilt cos(phi + 1) has tops at 90 and 270 deg, bottoms at 0 and 180 deg."""
    torque = f"100*sin(2*phi) + {100 * tilt!r}*sin(phi + 1)"
    result = flywheel.size(flywheel.load(turning([{"torque": torque}])), simulate=False)
    top = max((0.5 * pi, 1.5 * pi), key=lambda phi: -tilt * np.cos(phi + 1))
    bottom = min((0.0, pi), key=lambda phi: -tilt * np.cos(phi + 1))
    assert result.angle_speed_max == pytest.approx(top, abs=1e-7)
    assert result.angle_speed_min is not None
    assert (result.angle_speed_min - bottom + pi) % tau == pytest.approx(pi, abs=1e-7)


@pytest.mark.parametrize("count", [1, 2, 10])
def test_lobes_between_jumps(count: int) -> None:
    result = flywheel.size(flywheel.load(square(count)), simulate=False)
    assert result.flywheel.exact == pytest.approx(20 * pi / count, rel=result.error.exact)
    assert len(result.areas) == 2 * count


def test_two_cranks_half_a_turn_apart_say_everything_twice() -> None:
    result = flywheel.size(flywheel.load(twins()), simulate=False)
    assert result.angle_speed_max is not None
    works = sorted(area.work for area in result.areas[1:-1])  # the seam cuts an area in two
    assert works[::2][: len(works) // 2] == pytest.approx(works[1::2], rel=1e-12)
    whole = flywheel.size(flywheel.load({**twins(), "regime": {"speed": 10.0, "cycle": "720 deg"}}), simulate=False)
    assert whole.flywheel.exact == pytest.approx(result.flywheel.exact, rel=result.error.exact + whole.error.exact)
    assert whole.energy_fluctuation == pytest.approx(result.energy_fluctuation, rel=1e-12)


# A spring on x = a sin(n phi): M* changes its sign a hundred times and more, at angles known in closed form.


A, N, MASS, STIFF, SPEED = 0.01, 50, 0.5, 1e4, 10.0
RESTS = (0.0, 0.003, -0.007, 0.0099)  # inside the stroke: where the spring is at rest M* changes its sign as well
EPS = (1e-14, 1e-9, 0.05, 1.0, 1.9)
PULSES = ({"from": "100 deg", "to": "101 deg", "torque": -5}, {"from": "200 deg", "to": "200.001 deg", "torque": -500})
FEW_STEPS = 2_000_000  # of a grid on which signs are counted

Array = NDArray[np.float64]


class Found(NamedTuple):
    """The worst true errors of a sizing, by its scale, of its areas' angles (rad), and what it states of them."""

    what: str
    exact: float
    estimate: float
    angles: float
    angles_estimate: float


def scene(rest: float = 0.0, eps: float = 0.05, n: int = N, **more: Any) -> Scene:
    """A slide that swings n times in a turn, against a spring."""
    slide = {"x": f"{A}*sin({n}*phi)", "mass": MASS}
    return {
        "mechanism": {"type": "law", "outputs": {"slide": slide}},
        "spring": [{"on": "slide", "stiffness": STIFF, "rest": rest}],
        "regime": {"speed": SPEED},
        "flywheel": {"irregularity": eps},
    } | more


def sized_areas(request: Scene) -> Sizing:
    """Sized, without time stepping."""
    return flywheel.size(flywheel.load(request), simulate=False)


def crossings(rest: float, n: int = N) -> Array:
    """Angles at which M* = -k (x - rest) x' changes its sign inside a turn: at x' = 0, and at x = rest."""
    turns = np.arange(n) * 2 * np.pi
    at_rest = np.arcsin(rest / A)
    angles = [(turns + part) / n for part in (np.pi / 2, 3 * np.pi / 2, at_rest % (2 * np.pi), np.pi - at_rest)]
    result = np.sort(np.concatenate(angles))
    return result[(result > 1e-12) & (result < 2 * np.pi - 1e-12)]


def exact(rest: float, eps: float) -> float:
    """Wittenbauer's figure: extremes over s = sin(n phi) of -k/2 (x² - 2 rest x) - z± w² m (a n)² (1 - s²)/2."""

    def value(s: float, z: float) -> float:
        kinetic = z * SPEED**2 * MASS * (A * N) ** 2 * (1 - s * s) / 2
        return -0.5 * STIFF * ((A * s) ** 2 - 2 * rest * A * s) - kinetic

    def extremes(z: float) -> Iterator[float]:
        bend = -STIFF * A * A + z * SPEED**2 * MASS * (A * N) ** 2
        within = -STIFF * rest * A / bend  # of value's slope
        yield from (value(s, z) for s in (-1.0, 1.0, within) if abs(s) <= 1.0)

    return (max(extremes((1 + eps / 2) ** 2)) - min(extremes((1 - eps / 2) ** 2))) / (eps * SPEED**2)


@cache
def swept(every: int = 1) -> list[Found]:
    """Every rest and irregularity, or every so many of them."""
    outcome = []
    for rest in RESTS[::every]:
        for eps in EPS[::every]:
            result, true = sized_areas(scene(rest, eps)), exact(rest, eps)
            angles = np.array([area.end for area in result.areas[:-1]])
            assert angles.size == crossings(rest).size
            assert result.flywheel.exact is not None
            assert result.flywheel.approximate_total is not None
            assert result.error.exact is not None
            assert result.error.angles is not None
            off = float(np.abs(angles - crossings(rest)).max())
            scale = max(true, result.flywheel.approximate_total)
            what = f"rest {rest:g} m, eps {eps:g}"
            error = abs(result.flywheel.exact - true) / scale
            outcome.append(Found(what, error, result.error.exact, off, result.error.angles))
    return outcome


def areas() -> list[Row]:
    """The worst flywheel and the worst angle."""
    wheel, angle = max(swept(), key=lambda result: result.exact), max(swept(), key=lambda result: result.angles)
    span = "199 and 200 areas, eps 1e-14..1.9"
    return [
        Row("M* changes sign, flywheel", span, wheel.exact, wheel.estimate, f"closed form; worst: {wheel.what}"),
        Row("M* changes sign, angles (rad)", span, angle.angles, angle.angles_estimate, f"worst: {angle.what}"),
    ]


def test_no_area_is_missed_and_every_figure_is_known_to_its_estimate() -> None:
    for result in swept(2):
        assert result.exact <= result.estimate + ROUNDING, result
        assert result.angles <= result.angles_estimate + 8 * ROUNDING, result
        assert result.estimate < 1e-8, result


@pytest.mark.parametrize("n", [1, 100])
def test_the_areas_are_four_in_every_swing(n: int) -> None:
    result = sized_areas(scene(0.003, n=n))
    assert len(result.areas) == 4 * n + 1
    off = abs(result.energy_fluctuation / (0.5 * STIFF * (A + 0.003) ** 2) - 1)
    assert result.cycle is not None
    assert result.error.work is not None
    assert off <= result.error.work * result.cycle.exchanged / result.energy_fluctuation < 1e-8


def test_windows_on_top_add_their_own_areas() -> None:
    loads = [{"on": "crank"} | pulse for pulse in PULSES]
    result = sized_areas(scene(load=loads, drive={"torque": "balance"}))
    assert result.balance is not None
    true = (5 + 500 * 0.001) / 360
    assert result.balance.value == pytest.approx(true, rel=1e-9)
    windows = np.radians([100.0, 101.0, 200.0, 200.001])
    grid = np.sort(np.concatenate((np.linspace(0, 2 * np.pi, FEW_STEPS), windows - 1e-13, windows + 1e-13)))[1:-1]
    moment = -STIFF * A * A * N * np.sin(N * grid) * np.cos(N * grid) + true
    moment -= 5.0 * ((grid >= windows[0]) & (grid < windows[1])) + 500.0 * ((grid >= windows[2]) & (grid < windows[3]))
    assert len(result.areas) == 1 + np.count_nonzero(np.diff(np.sign(moment)))


# The origin of phi shifted: a phase and all windows turned with it leave the figures as they are and turn the areas.


TURNED = ("scotch-yoke", "slider-crank", "four-bar", "crank-shaper", "law", "linkage")
SHIFTS = (1e-15, 1e-12, 1e-9, 0.3, pi / 2, pi, tau, tau - 1e-12, -1.0)
FIGURES = ("exact", "approximate", "approximate_total", "inertia_torque")


def turned(name: str, shift: float, turns: int = 0) -> Scene:
    """A machine whose mechanism stands at a phase, with a load of the shaft that is turned back by as much."""
    scene, phase = MACHINES[name](), shift + turns * tau
    with mp.workdps(30):  # 900 turns as a float are off by 1e-13 rad
        back = float(phase - 2 * turns * mp.pi)
    window = {key: (angle - back) % tau for key, angle in (("from", 0.5), ("to", 1.5))}
    load: dict[str, Any] = {"on": "crank", "torque": -40.0, **window}
    mechanism = {**scene["mechanism"], "phase": f"{phase!r} rad"}
    return {**scene, "mechanism": mechanism, "load": [*scene["load"], load]}


@cache
def sized_origin(name: str, shift: float = 0.0, turns: int = 0) -> Sizing:
    return flywheel.size(flywheel.load(turned(name, shift, turns)), simulate=False)


def apart(name: str, shift: float, turns: int = 0) -> tuple[float, float]:
    """The largest difference of the figures from those that are not turned, and what both errors allow."""
    one, other = sized_origin(name), sized_origin(name, shift, turns)
    scale = max(one.flywheel.exact or 0.0, one.flywheel.approximate_total or 0.0)
    gaps = [abs(getattr(other.flywheel, key) - getattr(one.flywheel, key)) / scale for key in FIGURES]
    gaps.append(abs(other.energy_fluctuation / one.energy_fluctuation - 1))
    return max(gaps), (one.error.exact or 0.0) + (other.error.exact or 0.0)


def origins() -> list[Row]:
    """One row for shifts, one for many turns of phase."""
    shifted = max((apart(name, shift) for name in TURNED if name != "law" for shift in SHIFTS), key=lambda pair: pair[0])
    wound = max((apart(name, 0.3, 900) for name in ("slider-crank", "crank-shaper")), key=lambda pair: pair[0])
    return [
        Row("origin of phi", "phase -1..2 pi rad, 1e-15 among them", *shifted, "difference; both estimates added"),
        Row("origin of phi", "phase of 900 turns", *wound, "difference; both estimates added"),
    ]


@pytest.mark.parametrize("name", sample(TURNED, 2))
def test_the_figures_do_not_know_the_origin(name: str) -> None:
    for shift in SHIFTS[::2] if name != "law" else SHIFTS[3:5]:
        gap, allowed = apart(name, shift)
        assert gap <= allowed
        assert gap < 1e-9


@pytest.mark.parametrize("name", ["slider-crank", "crank-shaper"])
def test_nor_do_they_know_hundreds_of_turns(name: str) -> None:
    gap, allowed = apart(name, 0.3, 900)
    assert gap <= allowed


def test_a_cylinder_of_four_strokes_counts_its_phase_over_two_turns() -> None:
    engine = flywheel.load(Path(__file__).parents[2] / "examples" / "machines" / "three_cylinder.toml")
    wound = engine.with_({f"mechanism.{k}.phase": f"{240 * k - 100 * 720} deg" for k in range(3)})
    one, other = (flywheel.size(each, accuracy="normal") for each in (engine, wound))
    assert other.flywheel.exact == pytest.approx(one.flywheel.exact, rel=1e-12)
    assert other.error.exact < 1e-11


@pytest.mark.parametrize("shift", [0.3, 2.0, 5.0])
def test_the_areas_turn_with_it(shift: float) -> None:
    """Each crossing moves by the shift; the area that the seam cuts is told in two parts."""
    one, other = sized_origin("slider-crank"), sized_origin("slider-crank", shift)
    crossings = sorted((area.end - shift) % tau for area in one.areas[:-1])
    inner = [area.end for area in other.areas[:-1]]
    assert inner == pytest.approx(crossings, abs=1e-12)
    assert (other.angle_speed_max + shift - one.angle_speed_max + pi) % tau == pytest.approx(pi, abs=1e-9)
    assert (other.angle_speed_min + shift - one.angle_speed_min + pi) % tau == pytest.approx(pi, abs=1e-9)


def test_a_phase_may_be_written_in_degrees() -> None:
    scene = turned("slider-crank", 0.3)
    scene["mechanism"]["phase"] = f"{degrees(0.3)!r} deg"
    result = flywheel.size(flywheel.load(scene), simulate=False)
    assert result.flywheel.exact == pytest.approx(sized_origin("slider-crank", 0.3).flywheel.exact, rel=1e-13)


# Units from 1e-12 to 1e12 of length, mass and time: the answers scale with them.
#
# Where the units are powers of two, every number is only moved along the exponents, so that the answers must not differ
# in a
# single bit: no hidden size, no tolerance in metres or joules is left anywhere.


TWOS = [Measure(2.0**i, 2.0**j, 2.0**k) for i, j, k in ((40, 0, 0), (-40, 0, 0), (0, 40, 0), (0, -40, 0), (0, 0, 40))]
TWOS += [Measure(2.0**i, 2.0**j, 2.0**k) for i, j, k in ((0, 0, -40), (40, 40, 40), (-39, 40, -13), (40, -40, 40))]
TENS = [Measure(1e12, 1.0, 1.0), Measure(1e-12, 1.0, 1.0), Measure(1.0, 1e12, 1e-12), Measure(1.0, 1e-12, 1e12)]
FAST = [name for name in MACHINES if name not in ("cam", "law")]
TOGGLE = {"frame.height": 0.14, "bell_crank.drive_length": 0.168, "bell_crank.clamp_length": 0.22, "coupler.length": 0.095}
TOGGLE |= {"rod.length": 0.26, "coupler.com": 0.05, "rod.com": 0.13}


@cache
def figures(name: str, unit: Measure = SI) -> dict[str, Any]:
    """The answers for a machine that is written in other units, brought back to SI."""
    result = flywheel.size(flywheel.load(MACHINES[name](unit)), simulate=False)
    wheel, inertia = result.flywheel, result.reduced_inertia
    assert inertia is not None
    assert result.balance is not None
    kilograms, joules = unit.inertia(1.0), unit.joule(1.0)
    return {
        "exact": wheel.exact / kilograms,
        "approximate": wheel.approximate / kilograms,
        "approximate_total": wheel.approximate_total / kilograms,
        "inertia_torque": wheel.inertia_torque / kilograms,
        "least": inertia.min / kilograms,
        "greatest": inertia.max / kilograms,
        "balance": result.balance.value / joules,
        "exchanged": result.cycle.exchanged / joules,
        "fluctuation": result.energy_fluctuation / joules,
        "areas": [area.work / joules for area in result.areas],
        "angles": [area.end for area in result.areas] + [result.angle_speed_max, result.angle_speed_min],
        "error": result.error.exact,
    }


def units_apart(name: str, unit: Measure) -> float:
    """The largest difference of figures from those in SI, relative to the scale of their errors; a balance by its work."""
    one, other = figures(name), figures(name, unit)
    scales = dict.fromkeys(("exact", "approximate", "approximate_total", "inertia_torque"), one["exact"])
    scales |= {"balance": one["exchanged"] / tau, "fluctuation": one["fluctuation"]}
    return max(abs(other[key] - one[key]) / scale for key, scale in scales.items())


def in_units() -> list[Row]:
    """One row for powers of two, one for powers of ten."""
    two = max(units_apart(name, unit) for name in FAST for unit in TWOS)
    ten = max(((units_apart(name, unit), name) for name in FAST for unit in TENS), key=lambda pair: pair[0])
    return [
        Row("units of length, mass, time", "2^±40, together too", two, 0.0, "bit for bit the same, areas and angles too"),
        Row("units of length, mass, time", "1e±12", ten[0], figures(ten[1])["error"], "rounding of the input"),
    ]


@pytest.mark.parametrize("name", [*FAST, "law", pytest.param("cam", marks=pytest.mark.slow)])
def test_units_that_are_powers_of_two_do_not_change_a_bit(name: str) -> None:
    for unit in TWOS[1::3] if name in FAST else TWOS[-1:]:
        assert figures(name, unit) == figures(name), unit


@pytest.mark.parametrize("name", FAST)
def test_units_that_are_powers_of_ten_change_rounding_alone(name: str) -> None:
    for unit in TENS:
        assert units_apart(name, unit) <= 2 * figures(name)["error"] + 4e-16
        assert units_apart(name, unit) < 1e-13


def clamp(unit: Measure) -> dict[str, Any]:
    """A toggle clamp along its stroke."""
    mechanism: dict[str, Any] = {
        "type": "toggle-clamp",
        "block": {"mass": unit.kg(43.0)},
        "platen": {"mass": unit.kg(396.0)},
    }
    for key, value in TOGGLE.items():
        body, name = key.split(".")
        mechanism.setdefault(body, {})[name] = unit.m(value)
    mechanism["bell_crank"] |= {"angle": 0.302, "mass": unit.kg(16.0), "inertia": unit.inertia(0.12), "com": unit.m(0.11)}
    mechanism["coupler"] |= {"mass": unit.kg(1.3), "inertia": unit.inertia(0.002)}
    mechanism["rod"] |= {"mass": unit.kg(16.7), "inertia": unit.inertia(0.17)}
    stroke = {"from": unit.m(-0.06), "to": unit.m(0.19), "speed": unit.m(0.33) / unit.time}
    load = {"on": "platen", "force": unit.newton(-500.0)}
    return {"mechanism": mechanism, "load": [load], "gravity": unit.gravity(), "stroke": stroke}


def reduced(unit: Measure) -> list[list[float]]:
    """Mass and force of the clamp reduced to its block at a few places, in SI."""
    machine = flywheel.Machine(flywheel.load(clamp(unit)))
    places = [unit.m(x) for x in (-0.06, 0.0, 0.1, 0.15, 0.18999)]
    result = [machine.reduction(x) for x in places]
    return [[float(r.inertia) / unit.kg(1.0), float(r.moment) / unit.newton(1.0)] for r in result]


def test_a_toggle_clamp_scales_too() -> None:
    for unit in TWOS:
        assert reduced(unit) == reduced(SI)


# Load windows from 20 deg down to 0.001 deg: alone, across the seam, several, touching; against 30 digits.


WIDTHS = [20.0, 1.0, 0.1, 0.01, 0.001, 1e-5]


def shaft(width: float, start: float = 90.0) -> Scene:
    """A shaft on which 100 N m act in one window (deg)."""
    return turning([{"torque": -100.0, "from": f"{start!r} deg", "to": f"{start + width!r} deg"}])


def closed(width: float, start: float = 90.0) -> tuple[float, float]:
    """Error and estimate of the shaft's flywheel: T b (1 - b/2 pi)/(eps w²) for a window of b rad."""
    result = flywheel.size(flywheel.load(shaft(width, start)), simulate=False)
    with mp.workdps(30):
        wide = (mp.mpf(repr(start + width)) - mp.mpf(repr(start))) * mp.pi / 180
        true = 100 * wide * (1 - wide / (2 * mp.pi)) / (mp.mpf(0.05) * 100)
        return float(abs(result.flywheel.exact - true) / true), result.error.exact


def windows() -> list[Row]:
    """One row for each kind."""
    one, more = ([item for name in names(group) for item in measured(name)] for group in ("window", "windows"))
    worst = max((closed(width) for width in WIDTHS[:-1]), key=lambda pair: pair[0])
    return [
        row("a window of a slider-crank", "20..0.001 deg", one),
        row("several windows, windows that touch", "20..0.001 deg", more),
        Row("a window of a shaft alone", "20..0.001 deg", *worst, "closed form: nothing else sways the speed"),
        Row("a window", "1e-10 deg", None, None, refusal(shaft(1e-10))),
    ]


@pytest.mark.parametrize("start", [0.0, 90.0, 330.0])
@pytest.mark.parametrize("width", WIDTHS)
def test_a_shaft_alone_by_the_closed_form(width: float, start: float) -> None:
    error, estimate = closed(width, start)
    assert error <= estimate + 4e-16
    if width >= 0.001:
        assert estimate <= 1e-9


def test_no_window_is_too_narrow_for_the_time_stepping() -> None:
    result = flywheel.size(flywheel.load(shaft(0.001)))
    assert result.simulation is not None
    assert result.error.simulation is not None
    assert abs(result.simulation.irregularity / 0.05 - 1) <= result.error.simulation


WINDOWS_FIGURES = ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel")


def test_two_windows_that_touch_are_one() -> None:
    one = turning([{"torque": -100.0, "from": "90 deg", "to": "120 deg"}])
    two = turning([{"torque": -100.0, "from": f"{a} deg", "to": f"{b} deg"} for a, b in ((90, 100.1), (100.1, 120))])
    result = [flywheel.size(flywheel.load(scene), simulate=False) for scene in (one, two)]
    for name in WINDOWS_FIGURES:
        assert getattr(result[1].flywheel, name) == pytest.approx(getattr(result[0].flywheel, name), rel=1e-14)
    assert len(result[0].areas) == len(result[1].areas) == 3


def test_a_window_of_no_width_is_refused() -> None:
    for width in (0.0, 1e-10):
        assert refusal(shaft(width)).startswith("load[0].to: found ")
        assert "where the load begins" in refusal(shaft(width))


@pytest.mark.parametrize("gap", [1e-11, 1e-9, 1e-6])
def test_what_is_left_of_a_turn_beside_a_window_counts(gap: float) -> None:
    """Two loads that all but fill the turn: the swing is that of either, less its gap."""
    scene = turning([{"torque": -100.0, "from": gap, "to": pi}, {"torque": 100.0, "from": pi, "to": tau - gap}])
    result = flywheel.size(flywheel.load(scene), simulate=False)
    assert result.flywheel.exact == pytest.approx(100 * (pi - gap) / 5, rel=result.error.exact)


RESULTS = {  # tables of the page of results, by their titles
    "Jumps, kinks and window ends that all but coincide, tables with repeated angles; to 30 digits, or refused": results,
    "Mechanisms that all but lock, against 30 digits; those that do are refused, with the length and the angle": geometry,
    "Irregularities from 1e-14 to 1.99 and speeds from 1e-6 to 1e6 rad/s, for every mechanism, to 30 digits": irregularities,
    "What must hold at any irregularity and speed: limits, order, and proven bounds": limits,
    "Lobes that are equal, or all but: the value is right whichever is taken, and the angle is one of theirs": lobes,
    "A spring on x = a sin(n phi): M* changes its sign a hundred times and more, at angles known in closed form": areas,
    "The origin of phi shifted: a phase and all windows turned with it leave the figures and turn the areas": origins,
    "Units from 1e-12 to 1e12 of length, mass and time: the answers scale with them": in_units,
    "Load windows from 20 deg down to 0.001 deg: alone, across the seam, several, touching; against 30 digits": windows,
}
