"""Laws: derivatives of what is written, turns and pieces kept apart, and everything refused that cannot move a mass."""

from __future__ import annotations

from math import pi, tau
from typing import Any

import numpy as np
import pytest
from mpmath import mp
from scipy.interpolate import CubicSpline

from flywheel.mechanisms.families import Family, build
from flywheel.numerics.expressions import Expression, parse
from flywheel.numerics.faults import SceneError
from flywheel.numerics.intervals import NAMESPACE, Interval
from flywheel.scene.scene import Mechanism, Output, Table
from tests.mechanisms.chains import walked


def law(text: str | Table, rotating: bool = False, inertia: float = 2.0, period: float = tau, **parameters: float) -> Family:
    followed: Expression | Table = parse(text, frozenset(parameters)) if isinstance(text, str) else text
    outputs = (Output("arm", rotating, followed, inertia),)
    return build(Mechanism("law", "m", outputs=outputs, period=period), parameters)


def displacement(family: Family, psi: Any, anchor: Any = None) -> Any:
    return family.ports["arm"].position(family.position(psi, np, anchor))


SMOOTH = [
    ("0.1*cos(phi)", lambda p: 0.1 * mp.cos(p), {}),
    ("R*(1 - cos(phi)) + R**2/L*cos(2*phi)", lambda p: 1 - mp.cos(p) + mp.cos(2 * p) / 4, {"R": 1.0, "L": 4.0}),
    ("exp(sin(phi)**3)", lambda p: mp.exp(mp.sin(p) ** 3), {}),
    ("atan2(sin(phi), 2 + cos(phi))", lambda p: mp.atan2(mp.sin(p), 2 + mp.cos(p)), {}),
    ("sqrt(4 - sin(phi)**2) + cos(phi)", lambda p: mp.sqrt(4 - mp.sin(p) ** 2) + mp.cos(p), {}),
    ("max(0, sin(phi))**3", lambda p: max(mp.mpf(0), mp.sin(p)) ** 3, {}),
]


@pytest.mark.parametrize(("text", "truth", "parameters"), SMOOTH, ids=[text for text, _, _ in SMOOTH])
def test_gain_and_slope_are_derivatives(text: str, truth: Any, parameters: dict[str, float]) -> None:
    family = law(text, **parameters)
    psi = np.linspace(-7.0, 14.0, 43)
    gain, slope = walked(family, psi)["arm"]
    with mp.workdps(40):
        for i, angle in enumerate(psi):
            value, first, second = mp.taylor(truth, mp.mpf(angle), 2)
            assert displacement(family, psi)[i] == pytest.approx(float(value), abs=1e-13)
            assert gain[i] == pytest.approx(float(first), abs=1e-13)
            assert slope[i] == pytest.approx(float(2 * second), abs=1e-12)


def test_masses_sit_straight_on_the_crank() -> None:
    family = law("cos(phi)")
    assert [(m.velocity, m.value, m.body) for m in family.masses] == [("arm", 2.0, "arm")]
    assert family.weights == ()
    assert law("cos(phi)", inertia=0.0).masses == ()
    assert [term.source for term in family.velocities[0].terms] == ["crank"]


def test_a_theta_gains_the_same_each_period() -> None:
    family = law("2*phi + 0.1*sin(phi)", rotating=True)
    assert not family.ports["arm"].returns
    psi = np.linspace(-20.0, 20.0, 81)
    assert displacement(family, psi) == pytest.approx(2 * psi + 0.1 * np.sin(psi), abs=1e-12)
    assert walked(family, psi)["arm"][0] == pytest.approx(2 + 0.1 * np.cos(psi), abs=1e-13)


def test_an_oscillating_theta_returns() -> None:
    assert law("0.3*sin(phi)", rotating=True).ports["arm"].returns


def test_a_piece_is_followed_to_its_ends_by_its_own_formula() -> None:
    family = law("abs(sin(phi))", inertia=0.0)
    assert family.ports["arm"].kinks == (0.0, pi)
    ends = np.array([[0.0, pi], [pi, tau], [tau, 3 * pi]])
    anchor = ends.mean(axis=1, keepdims=True)
    jet = family.position(ends, np, anchor).jet("arm")
    assert jet.first == pytest.approx(np.array([[1.0, -1.0]] * 3), abs=1e-14)


def test_the_period_may_be_two_turns() -> None:
    family = law("0.01*max(0, sin(phi/2))**4", period=2 * tau)
    assert displacement(family, np.array([pi, 3 * pi, 5 * pi])) == pytest.approx([0.01, 0.0, 0.01])
    assert max(family.breakpoints) < 2 * tau


def test_a_narrow_bump_ends_cells_around_itself() -> None:
    breaks = np.array(law("exp(-((phi - 2)/1e-4)**2)").breakpoints)
    assert np.sum(np.abs(breaks - 2) < 3e-4) >= 4


@pytest.mark.parametrize(
    ("text", "rotating", "found"),
    [
        ("phi", False, r"outputs.arm.x: found 0 m at 0 deg and 6.28318531 m at 360 deg"),
        ("sign(sin(phi))", False, r"arm.x: found a jump of -2 m at 180 deg"),
        ("phi + (phi > 3)", True, r"arm.theta: found a jump of 1 rad at 171.887 deg"),
        ("abs(sin(phi))", False, r"found a slope that jumps from -1 to 1 at 0 deg, expected a smooth .* carries mass"),
        ("phi**2", True, r"found a slope that jumps from 12.5664 to 0 at 0 deg"),
        ("max(0, sin(phi))", False, r"a slope that jumps from -1 to 0 at 180 deg|from 0 to 1 at 0 deg"),
        ("1/(phi - 3)", False, r"not finite near phi = 3"),
        ("sqrt(sin(phi))", False, r"found a position that is not finite"),
        ("(phi - pi)**2*phi**0.5", True, r"found a slope that is not finite at 0 deg"),
        ("cos(phi) + x", False, r"found an expression of x, expected phi and parameters"),
        ("omega*t*v", False, r"found an expression of omega, t, v"),
    ],
)
def test_what_cannot_move_a_mass_is_refused(text: str, rotating: bool, found: str) -> None:
    with pytest.raises(SceneError, match=found):
        law(text, rotating)


def test_a_corner_without_mass_is_allowed_and_known() -> None:
    family = law("max(0, sin(phi))", inertia=0.0)
    assert family.ports["arm"].kinks == pytest.approx([0.0, pi])
    assert law("max(0, sin(phi))**2").ports["arm"].kinks == ()


def test_rounding_is_no_jump() -> None:
    law("1000 + 1e-6*sin(phi)")
    law("sin(12*phi + 0.3) + 1e-3*cos(7*phi)")


def test_the_faults_of_all_outputs_come_at_once() -> None:
    texts = {"a": "phi", "b": "cos(phi)", "crank": "sin(phi)", "c": "balance"}
    outputs = tuple(Output(k, False, parse(text, frozenset({"balance"})), 1.0) for k, text in texts.items())
    with pytest.raises(SceneError) as refused:
        build(Mechanism("law", "m", outputs=outputs, path="mechanism[1]"), {})
    paths = [fault.path for fault in refused.value.faults]
    assert paths == [f"mechanism[1].outputs.{end}" for end in ("a.x", "crank", "c.x")]


def table(start: float, gain: float, rows: int = 13) -> Table:
    angle = start + np.linspace(0.0, tau, rows) ** 1.5 / tau**0.5
    value = 0.2 * np.sin(2 * angle + 1) + gain * (angle - start) / tau
    value[-1] = value[0] + gain
    angle[-1] = start + tau
    return Table(angle, value, "spline")


@pytest.mark.parametrize("start", [0.0, -1.0, 0.7, tau])
@pytest.mark.parametrize("gain", [0.0, tau])
def test_a_table_is_the_periodic_spline_from_wherever_it_starts(start: float, gain: float) -> None:
    given = table(start, gain)
    flat = given.value - gain * (given.angle - start) / tau
    flat[-1] = flat[0]
    spline = CubicSpline(given.angle, flat, bc_type="periodic")
    family = law(given, rotating=gain != 0)
    psi = np.linspace(-9.0, 16.0, 401)
    first, second = walked(family, psi)["arm"]
    assert displacement(family, psi) == pytest.approx(spline(psi) + gain * (psi - start) / tau, abs=1e-12)
    assert first == pytest.approx(spline(psi, 1) + gain / tau, abs=1e-12)
    assert second == pytest.approx(spline(psi, 2), abs=1e-11)
    assert family.breakpoints == pytest.approx(np.unique(np.round([0.0, *(given.angle[:-1] % tau)], 12)))
    assert family.ports["arm"].returns is (gain == 0)


def test_a_table_that_does_not_come_back_is_refused() -> None:
    with pytest.raises(SceneError, match=r"found 0.168294197 m at 0 deg and 1.1682942 m"):
        law(table(0.0, 1.0))


@pytest.mark.parametrize("text", ["exp(sin(phi)) + abs(phi - 3)*0", "0.1*cos(phi)**3", table(0.4, 0.0)], ids=str)
def test_bounds_hold_over_whole_pieces(text: str | Table) -> None:
    family = law(text, inertia=0.0)
    edges = np.array([*family.breakpoints, tau]) + tau
    lo, hi = edges[:-1], edges[1:]
    anchor = 0.5 * (lo + hi)
    bounds = family.ports["arm"].position(family.position(Interval(lo, hi), NAMESPACE, anchor))
    inside = lo + np.linspace(0.0, 1.0, 33)[:, None] * (hi - lo)
    values = displacement(family, inside, anchor)
    assert np.all((bounds.lo <= values) & (values <= bounds.hi))
    assert np.all(bounds.width < 10.0)
