"""The example scenes of regimes, drive lines and designs."""

from __future__ import annotations

import runpy
from itertools import pairwise
from math import asin, cos, pi, sin, sqrt, tau
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel
from flywheel import Sizing, Transient, transient
from flywheel.components.load_models import Compression, compressor_work
from flywheel.motions.motion import sampled
from tests.oracle.drive_lines import DriveLine, Regime

# The regime examples run, and their figures hold by short calculations of their own.


FOLDER = Path(__file__).parents[2] / "examples" / "regimes"


def load(name: str) -> flywheel.Scene:
    return flywheel.load(FOLDER / f"{name}.toml")


def printed(name: str, capsys: pytest.CaptureFixture[str], picture: Path | None = None) -> str:
    main = runpy.run_path(str(FOLDER / f"{name}.py"), run_name="example")["main"]
    main(*([] if picture is None else [str(picture)]))
    return capsys.readouterr().out


def numbers(line: str) -> list[float]:
    result = []
    for word in line.split():
        try:
            result.append(float(word))
        except ValueError:
            continue
    return result


class Slider(NamedTuple):
    """A slider-crank by hand: x, x', x'' of the slider and of a point on the rod, and the rod's angle' and angle''."""

    x: float
    x1: float
    x2: float
    gx1: float
    gx2: float
    gy1: float
    gy2: float
    turn: float
    turn1: float


def slider(phi: float, r: float, length: float, com: float) -> Slider:
    s, c = sin(phi), cos(phi)
    beta = asin(-r * s / length)
    turn = -r * c / (length * cos(beta))
    turn1 = (r * s + length * sin(beta) * turn**2) / (length * cos(beta))
    x1, x2 = -r * s - length * sin(beta) * turn, -r * c - length * (cos(beta) * turn**2 + sin(beta) * turn1)
    gx1, gx2 = -r * s - com * sin(beta) * turn, -r * c - com * (cos(beta) * turn**2 + sin(beta) * turn1)
    gy1, gy2 = r * c + com * cos(beta) * turn, -r * s + com * (cos(beta) * turn1 - sin(beta) * turn**2)
    return Slider(r * c + length * cos(beta), x1, x2, gx1, gx2, gy1, gy2, turn, turn1)


@pytest.mark.slow
def test_section_c_agrees_with_figures_found_apart(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    text = printed("section_c", capsys, tmp_path / "c.png")
    assert (tmp_path / "c_seconds.png").stat().st_size > 10_000
    assert "DISAGREES" not in text
    assert text.count(" ok ") == 6 + 4 + 4
    for figure in ("0.4832273725", "4.12272990", "1.53853639318", "20.27035683", "5.71404870", "6.03220864521"):
        assert figure in text
    assert text.count("printed") == 3
    assert "2 pi - asin(1/3)" in text


def test_section_c_fails_where_a_figure_differs(capsys: pytest.CaptureFixture[str]) -> None:
    table = runpy.run_path(str(FOLDER / "section_c.py"))["Table"]()
    table.row("right", [1.0, 2.0], [1.0, 2.0])
    table.row("wrong", [1.0, 2.0], [1.0, 2.0 + 1e-7])
    assert table.wrong == 1
    assert "DISAGREES" in capsys.readouterr().out


@pytest.fixture(scope="module")
def press() -> Sizing:
    return flywheel.size(load("punch_press"), simulate=False)


def press_slope(phi: float, square: float, wheel: float, punching: bool) -> tuple[float, float]:
    """d(omega²)/dphi of the press, and the motor's torque: written out, with the loss in the mesh after its direction."""
    at, omega = slider(phi, 0.04, 0.26, 0.08), sqrt(square)
    inertia = 0.9 + 22 * (at.gx1**2 + at.gy1**2) + 0.18 * at.turn**2 + 85 * at.x1**2
    bend = 22 * (at.gx1 * at.gx2 + at.gy1 * at.gy2) + 0.18 * at.turn * at.turn1 + 85 * at.x1 * at.x2  # half of dI*/dphi
    moment = 9.80665 * (22 * at.gx1 + 85 * at.x1) - 400 * abs(at.x1)
    if punching:
        sheet = 0.3 - 0.003 - 0.012
        moment -= pi * 0.03 * 0.012 * 360e6 * (1 - (at.x - sheet) / 0.012) * at.x1
    slip = 1 - 24 * omega / (50 * pi)
    rated, worst = 0.04, 0.04 * (2.6 + sqrt(2.6**2 - 1))
    torque = 2 * 2.6 * 4000 / (50 * pi * (1 - rated)) * slip * worst / (slip**2 + worst**2)
    behind = 576 * (wheel + 0.0125)
    for factor in (1 / 0.92, 0.92):
        alpha = (24 * torque - factor * (bend * square - moment)) / (behind + factor * inertia)
        carried = inertia * alpha + bend * square - moment
        if (carried > 0) == (factor > 1):
            break
    return 2 * alpha, torque


@pytest.mark.slow
def test_punch_press_comes_round_with_the_irregularity_asked_for(press: Sizing) -> None:
    wheel, energy = press.flywheel.exact, press.energy
    way = lambda phi: slider(phi, 0.04, 0.26, 0.08).x  # noqa: E731
    met, left = (brentq(lambda phi, x=x: way(phi) - x, pi, tau) for x in (0.285, 0.297))
    assert way(tau) == pytest.approx(0.3)
    square = press.speed**2
    for lap in range(8):  # it settles within a few: what is left of a change after a cycle is 0.02
        begun, time, count = square, 0.0, 2 if lap < 7 else 600
        speeds, powers = [], []
        for low, high in pairwise((0.0, pi, met, left, tau)):

            def rates(phi: float, y: Any, punching: bool = low == met) -> list[float]:
                return [press_slope(phi, y[0], wheel, punching)[0], 1 / sqrt(y[0])]

            run = solve_ivp(rates, (low, high), [square, time], "DOP853", rtol=1e-10, atol=1e-10, dense_output=True)
            square, time = run.y[:, -1].tolist()
            result = np.sqrt(run.sol(np.linspace(low, high, count))[0])
            speeds.append(result)
            powers.append([24 * w * press_slope(0.0, w * w, wheel, False)[1] for w in result.tolist()])
    high, low = np.concatenate(speeds).max(), np.concatenate(speeds).min()
    assert square == pytest.approx(begun, rel=1e-9)
    assert 2 * (high - low) / (high + low) == pytest.approx(0.1, rel=1e-4)
    assert 0.5 * (high + low) == pytest.approx(press.speed, rel=1e-6)
    assert time == pytest.approx(energy.period, rel=1e-8)
    assert np.concatenate(powers).max() == pytest.approx(energy.peak_power, rel=1e-4)


@pytest.mark.slow
def test_punch_press_beside_other_drives(press: Sizing, capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed("punch_press", capsys).splitlines()
    names = ("4 % slip", "constant torque", "12 % slip")
    own, constant, soft = (next(line for line in lines if name in line) for name in names)
    wheels = [numbers(line)[-5] for line in (own, constant, soft)]
    peaks = [numbers(line)[-2] for line in (own, constant, soft)]
    assert wheels[0] == pytest.approx(press.flywheel.exact, abs=1e-6)
    assert wheels == sorted(wheels)
    assert peaks[1] < peaks[2] < peaks[0] < 8
    by_hand = numbers(next(line for line in lines if "by hand" in line))[0]
    assert by_hand == pytest.approx(press.flywheel.exact, rel=0.05)
    assert "stalls" in lines[-1]
    follows = next(line for line in lines if "follow the punch" in line)
    assert 80 < numbers(follows)[0] < 100


@pytest.fixture(scope="module")
def run_up() -> Transient:
    return transient(load("compressor"), end=0.6, rtol=1e-6)


def test_compressor_takes_the_work_of_two_gas_spaces() -> None:
    sizing = flywheel.size(load("compressor"), simulate=False)
    cycle = Compression(1e5, 6e5, 0.06, 1.3, 1.3)
    bore, rod = pi / 4 * 0.1**2, pi / 4 * 0.022**2
    work = compressor_work(cycle, 0.08 * bore) + compressor_work(cycle, 0.08 * (bore - rod))
    losses = sizing.drive_work - work
    assert losses == pytest.approx(tau * 0.15 * tau / sizing.energy.period, rel=1e-3)  # as if its speed were even
    assert sizing.energy.mean_power * sizing.energy.period == pytest.approx(sizing.drive_work, rel=1e-9)


def compressor_rates(wheel: float) -> Any:
    """d(phi, omega, i)/dt of the compressor on its motor, written out."""
    area, rod = pi / 4 * 0.1**2, pi / 4 * 0.022**2

    def pressure(share: float, outward: bool) -> float:
        if outward:
            return max(6e5 * (0.06 / (0.06 + share)) ** 1.3, 1e5)
        return min(1e5 * (1.06 / (0.06 + share)) ** 1.3, 6e5)

    def rates(t: float, state: Any) -> list[float]:
        phi, omega, current = state
        at = slider(phi, 0.04, 0.18, 0.055)
        share = min(max((0.22 - at.x) / 0.08, 0.0), 1.0)
        outward = at.x1 < 0
        force = -(pressure(share, outward) - 101325) * area + (pressure(1 - share, not outward) - 101325) * (area - rod)
        inertia = 0.012 + 1.8 * (at.gx1**2 + at.gy1**2) + 0.009 * at.turn**2 + 3.2 * at.x1**2 + 20.25 * 0.03 + wheel
        bend = 1.8 * (at.gx1 * at.gx2 + at.gy1 * at.gy2) + 0.009 * at.turn * at.turn1 + 3.2 * at.x1 * at.x2
        moment = 4.5 * 1.3 * current + force * at.x1 - 0.15 * omega
        return [omega, (moment - bend * omega**2) / inertia, (220 - 2 * current - 1.3 * 4.5 * omega) / 0.025]

    return rates


@pytest.mark.slow
def test_compressor_starts_as_its_equations_say(run_up: Transient) -> None:
    rates = compressor_rates(run_up.inertia)
    times = np.linspace(0.0, 0.6, 3001)
    own = solve_ivp(rates, (0.0, 0.6), [0.0, 0.0, 0.0], "DOP853", times, rtol=1e-8, atol=1e-8, max_step=5e-3).y
    phi, omega = run_up.motion.at(times[::100])
    assert phi == pytest.approx(own[0, ::100], abs=1e-4)
    assert omega == pytest.approx(own[1, ::100], abs=1e-3)
    fast = times[np.argmax(own[1] >= 0.95 * run_up.regime_speed)]
    assert run_up.time_to_regime == pytest.approx(fast, abs=3e-4)
    assert run_up.peaks.current.value == pytest.approx(own[2].max(), rel=1e-4)
    assert run_up.peaks.current.time == pytest.approx(times[own[2].argmax()], abs=3e-4)


@pytest.mark.slow
def test_compressor_current_as_its_scene_says(run_up: Transient) -> None:
    text = (FOLDER / "compressor.toml").read_text(encoding="utf-8")
    at_work = run_up.motion.current[run_up.motion.t > 0.4].mean()
    assert round(run_up.peaks.current.value) == 87
    assert "rises to 87 A, twelve times" in text
    assert run_up.peaks.current.value / at_work == pytest.approx(12, abs=0.7)


@pytest.mark.slow
def test_compressor_energy_closes(run_up: Transient) -> None:
    energy, times = run_up.energy, np.linspace(0.0, run_up.time, 4001)
    current = sampled(run_up.motion.trail, times).current
    assert energy.residual < run_up.rtol
    assert energy.drive + sum(energy.works.values()) == pytest.approx(energy.kinetic_gained, rel=run_up.rtol)
    assert energy.copper == pytest.approx(2 * np.trapezoid(current**2, times), rel=1e-3)


class Clamp(NamedTuple):
    """The clamp by hand at a block's place: m* (kg), the platen's place (m), all that pushes but the cylinder (N)."""

    mass: float
    platen: float
    force: float


STEP = 1e-30
MASSES = {"bell crank": 16.1475, "coupler": 1.3051, "rod": 16.7364}


def clamp_at(place: float) -> Clamp:
    """Pins by circles that meet; velocities over the block's as imaginary parts, of a step in x that loses no digits."""
    x, y = -(place + 1j * STEP), 0.14
    square = x * x + y * y
    along = (square + 0.16763**2 - 0.095**2) / (2 * square)
    across = np.sqrt(0.16763**2 / square - along**2)
    pin = along * x - across * y, along * y + across * x
    c, s = (0.22 / 0.16763) * cos(0.30199 + pi), (0.22 / 0.16763) * sin(0.30199 + pi)
    end = pin[0] * c - pin[1] * s, pin[1] * c + pin[0] * s
    platen = end[0] + np.sqrt(0.26**2 - end[1] ** 2)
    centres = {
        "bell crank": (0.5 * end[0], 0.5 * end[1]),
        "coupler": (0.5 * (pin[0] + x), 0.5 * (pin[1] + y)),
        "rod": (0.5 * (end[0] + platen), 0.5 * end[1]),
    }

    def squared(*q: complex) -> float:
        return float(sum((z.imag / STEP) ** 2 for z in q))

    mass = 43.3018 + 395.94 * squared(platen) + sum(MASSES[name] * squared(*q) for name, q in centres.items())
    mass += 0.1195 * squared(*end) / 0.22**2 + 0.0022 * squared(pin[0] - x, pin[1]) / 0.095**2
    mass += 0.1699 * squared(platen - end[0], end[1]) / 0.26**2
    weight = -9.80665 * sum(MASSES[name] * q[1].imag / STEP for name, q in centres.items())
    push = -800e6 * max(0.0, platen.real - 0.47975) - 300
    return Clamp(mass, float(platen.real), float(weight + push * platen.imag / STEP))


def clamp_stroke(throttle: float) -> tuple[Any, Any, Any]:
    """Places, speeds and times by the energy u = m* v²: du/dx = 2 (F + p A) - 2 k u/m*, over s with x = s² - 60 mm."""

    def rates(s: float, state: Any) -> list[float]:
        at = clamp_at(s * s - 0.06)
        force = at.force + 30e5 * 1256.64e-6
        v = sqrt(max(state[0], 0.0) / at.mass)
        return [4 * s * (force - throttle * v * v), 2 * s / v]

    marks, first = np.linspace(1e-5, 0.5, 401), clamp_at(-0.06)  # from a little beyond: u = 2 (F + p A) s²
    push = first.force + 30e5 * 1256.64e-6
    start = [2 * push * marks[0] ** 2, marks[0] * sqrt(2 * first.mass / push)]
    result = solve_ivp(rates, (marks[0], 0.5), start, "DOP853", marks, rtol=1e-9, atol=1e-12).y
    x = marks**2 - 0.06
    return x, np.sqrt(result[0] / [clamp_at(place).mass for place in x]), result[1]


@pytest.mark.slow
def test_hydraulic_clamp_moves_as_its_energy_says(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    lines = printed("hydraulic_clamp", capsys, tmp_path / "clamp.png").splitlines()
    assert (tmp_path / "clamp_stroke.png").stat().st_size > 10_000
    x, v, t = clamp_stroke(18.6e3)
    share, time, limit, greatest, last, pump, heat = numbers(lines[1])
    assert (share, time, last) == pytest.approx((1.0, t[-1], v[-1]), abs=2e-5)
    assert limit == pytest.approx(sqrt(30e5 * 1256.64e-6 / 18.6e3), abs=1e-5)
    assert greatest == pytest.approx(v.max(), abs=1e-4)
    assert pump == pytest.approx(30e5 * 1256.64e-6 * 0.25, abs=0.01)
    assert heat == pytest.approx(np.trapezoid(18.6e3 * v**2, x), abs=0.05)
    times = [numbers(line)[1] for line in lines[1:4]]
    assert times == sorted(times, reverse=True)
    assert times[2] == pytest.approx(clamp_stroke(18.6e3 / 4)[2][-1], abs=2e-5)


def test_hydraulic_clamp_holds_its_mould_at_the_lock() -> None:
    scene = load("hydraulic_clamp")
    places = np.linspace(-0.06, 0.19, 26)
    state = flywheel.reduce(scene, places, speed=0.0)
    by_hand = [clamp_at(float(x)) for x in places]
    assert state.inertia == pytest.approx([at.mass for at in by_hand], rel=1e-9)
    assert state.moment - 30e5 * 1256.64e-6 == pytest.approx([at.force for at in by_hand], abs=1e-5)
    assert 800e6 * (by_hand[-1].platen - 0.47975) == pytest.approx(200e3, rel=1e-5)
    assert abs(by_hand[-1].force) < 100  # of 200 kN


@pytest.mark.slow
def test_hydraulic_clamp_has_energy_for_its_work() -> None:
    wide = runpy.run_path(str(FOLDER / "hydraulic_clamp.py"))["clamp"](18.6e3 / 4)  # fewer steps
    run = transient(wide, end=5.0, rtol=1e-6)
    assert run.reason == "stroke"
    assert run.energy.residual < run.rtol
    bars = run.energy.works["load[0] on toggle-clamp.platen"]
    assert bars == pytest.approx(-0.5 * 800e6 * (clamp_at(0.19).platen - 0.47975) ** 2, rel=1e-6)
    guides = run.energy.works["load[1] on toggle-clamp.platen"]
    assert guides == pytest.approx(-300 * (clamp_at(0.19).platen - clamp_at(-0.06).platen), rel=1e-8)


# The examples of best designs run, and their optima are those of other ways.


DESIGNS = Path(__file__).parents[2] / "examples" / "designs"


def example(name):
    return runpy.run_path(str(DESIGNS / f"{name}.py"), run_name="example")


@pytest.mark.slow
def test_two_cranks_by_sweep_by_optimisation_and_by_hand():
    result = example("two_cranks")
    scene = result["flywheel"].load(DESIGNS / "two_cranks.toml")
    angle, value = result["by_hand"]()
    assert result["by_sweep"](scene, 49) == (pytest.approx(angle, rel=1e-12), pytest.approx(value, rel=1e-11))
    optimum = result["by_optimisation"](scene)
    assert optimum.numbers["mechanism.1.phase"] == pytest.approx(pi, abs=1e-8)
    assert optimum.value == pytest.approx(value, rel=1e-11)
    assert optimum.confirmed


@pytest.mark.slow
def test_a_balance_that_flattens_the_inertia():
    result = example("flat_inertia")
    least = result["best"]("flywheel.exact", 8, 1)
    assert least.confirmed
    assert least.value == pytest.approx(0.3407048527, rel=1e-8)
    assert least.numbers == {
        result["MASS"]: pytest.approx(3.59033, rel=1e-4),
        result["ROD"]: pytest.approx(0.44736, rel=1e-4),
    }


@pytest.mark.slow
def test_the_lightest_motor_and_wheel_are_lighter_than_those_beside_them_that_are_fast_enough():
    result = example("lightest_drive")
    power, irregularity = result["BEST"]
    rows = [result["row"](power * a, irregularity) for a in (1.0, 1.1)] + [result["row"](power, 0.9 * irregularity)]
    both = [float(row[4]) for row in rows]
    assert both[0] == pytest.approx(71.627, abs=0.01)
    assert min(both) == both[0]
    assert float(rows[0][5]) == pytest.approx(30 * result["SLOWEST"] / pi, rel=1e-4)


# The press of the examples against its series equations, its sheet written out as an expression of the crank's angle.


DRIVE_LINES = Path(__file__).parents[2] / "examples" / "drive_lines"


def by_hand(scene: dict[str, Any], inertia: float) -> Regime:
    """The press with the force of its punch against the angle, and the friction of its guides."""
    r, rod, thickness, beyond = 0.05, 0.4, 0.008, 0.004
    bottom = r + rod

    def left(phi: float) -> float:
        return bottom - r * cos(phi) - sqrt(rod**2 - (r * sin(phi)) ** 2)

    first, last = (float(brentq(lambda a, way=way: left(a) - way, pi, 2 * pi)) for way in (beyond + thickness, beyond))
    way = f"{r}*cos(phi) + sqrt({rod**2} - ({r}*sin(phi))**2) - {bottom - beyond - thickness!r}"
    force = f"-{pi * 0.06 * thickness * 360e6!r}*(1 - ({way})/{thickness})"
    load = [{"on": "slider", "force": force, "from": first, "to": last}, {"on": "slider", "force": "-900*sign(v)"}]
    return DriveLine(scene | {"load": load, "flywheel": {"on": "wheel"}}).analysed(inertia)


@pytest.mark.slow
def test_press_in_series_and_with_all_shafts_on_the_crank(capsys: pytest.CaptureFixture[str]) -> None:
    example = runpy.run_path(str(DRIVE_LINES / "press.py"), run_name="example")
    scene = example["press"]()
    means = []
    for table in (scene, example["star"](scene)):
        sizing = example["sized"](table)
        true = by_hand(table, sizing.flywheel.exact)
        assert true.irregularity == pytest.approx(0.15, rel=1e-9)
        result = [getattr(sizing.energy, key) for key in ("mean_power", "peak_power", "rms_torque", "rotor_heat")]
        assert result == pytest.approx([true.mean_power, true.peak_power, true.rms_torque, true.rotor_heat], rel=1e-9)
        means.append((true.mean_power, true.rms_torque))
    example["main"]()
    power, torque = (other / one - 1 for one, other in zip(*means, strict=True))
    more = f"{power:+.1%} mean power, {torque:+.1%}"
    assert more in capsys.readouterr().out
    assert more == "+4.6% mean power, +3.0%"
