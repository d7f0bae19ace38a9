"""Proven motions: those of closed forms, extrapolations and integrations by hand lie inside, and the rest is refused."""

from __future__ import annotations

import math
import tomllib
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp  # type: ignore[import-untyped]
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import flywheel
from bondgraph.recording import NAMESPACE, Recorder
from flywheel.language import use
from flywheel.numerics.expressions import walk
from flywheel.tables import sizing as listing
from flywheel.tables import summary
from tests.extras import extra
from tests.limits import sample
from tests.motions.test_starting import PLATE
from tests.sizing.test_proof import PRESS, WIDEST

balls, proof = extra("flywheel.numerics.balls"), extra("flywheel.sizing.proof")
enclosures = extra("flywheel.sizing.enclosures")


QUADRATIC = {
    "inertia": [{"on": "crank", "value": 2}],
    "load": [{"on": "crank", "torque": "-20*sin(phi)"}, {"on": "crank", "torque": "-0.5*omega**2"}],
}


def quadratic(total: Any, drive: Any) -> tuple[Any, Any]:
    """Extreme speeds with T = u - s sin(phi) - b omega²: E = u/k - s (k sin(phi) - cos(phi))/(k² + 1), k = 2 b/J."""
    k = 1 / mp.mpf(total)
    return tuple(mp.sqrt(2 * k * (drive / k + side * 20 / mp.sqrt(k * k + 1))) for side in (1, -1))


def sized(scene: dict[str, Any]) -> Any:
    result = flywheel.size(flywheel.load({**QUADRATIC, **scene}), accuracy="proof")
    assert result.proof is not None
    return result.proof


def holds(ends: tuple[float, float], true: Any) -> bool:
    return ends[0] <= true <= ends[1] and ends[1] - ends[0] <= WIDEST * abs(true)


def test_a_motion_with_torques_of_speed_has_the_speeds_of_its_closed_form() -> None:
    result = sized({"drive": {"torque": 50}, "flywheel": {"inertia": 3}}).figures
    with mp.workdps(40):
        fast, slow = quadratic(5, 50)
        assert holds(result["simulation.speed_max"], fast)
        assert holds(result["simulation.speed_min"], slow)
        assert holds(result["speed"], (fast + slow) / 2)
        assert holds(result["simulation.irregularity"], 2 * (fast - slow) / (fast + slow))


def test_a_flywheel_with_torques_of_speed_is_that_of_the_closed_form() -> None:
    proof = sized({"drive": {"torque": 50}, "flywheel": {"irregularity": "2 %"}})

    def off(total: Any) -> Any:
        fast, slow = quadratic(total, 50)
        return 2 * (fast - slow) / (fast + slow) - mp.mpf("0.02")

    with mp.workdps(40):
        assert holds(proof.figures["flywheel.exact"], mp.findroot(off, proof.figures["flywheel.exact"][0] + 2) - 2)
    assert "not proven: that no lighter flywheel" in proof.statement


@pytest.mark.parametrize("sign", [1, -1])
def test_a_balance_beside_torques_of_speed_is_that_of_the_closed_form(sign: int) -> None:
    law = {"load": [*QUADRATIC["load"], {"on": "crank", "torque": f"{sign}*u"}], "parameters": {"u": "balance"}}
    result = sized({**law, "regime": {"speed": 10}, "flywheel": {"irregularity": "2 %"}}).figures

    def off(total: Any, drive: Any) -> Any:
        fast, slow = quadratic(total, drive)
        return 2 * (fast - slow) / (fast + slow) - mp.mpf("0.02"), (fast + slow) / 2 - 10

    with mp.workdps(40):
        near = result["flywheel.exact"][0] + 2, sign * result["balance.value"][0]
        total, drive = mp.findroot(off, near)
        assert holds(result["flywheel.exact"], total - 2)
        assert holds(result["balance.value"], sign * drive)


@pytest.mark.parametrize("wheel", [{"irregularity": "2 %"}, {"irregularity": 0.9}, {"inertia": 3}])
@pytest.mark.parametrize("language", ["en", "es"])
def test_a_proven_motion_is_told_in_every_form(wheel: dict[str, Any], language: str, tmp_path: Path) -> None:
    scene = flywheel.load({**QUADRATIC, "drive": {"torque": 50}, "flywheel": wheel})
    result = flywheel.size(scene, accuracy="proof")
    with use(language):
        output = summary.text(result)
    assert ("Proven for" if language == "en" else "Demostrado para") in " ".join(output.split())
    assert result.proof is not None
    assert set(result.as_dict()["proof"]["figures"]) == set(result.proof.figures)
    assert all(name in listing.text(result) for name in result.proof.figures)


@pytest.mark.parametrize(("order", "cells"), [(3, 12), (5, 12), (5, 24), (9, 6)])
def test_a_periodic_solution_lies_within_its_reach_of_coarse_polynomials(order: int, cells: int) -> None:
    """E' = sin(phi) - E/16 has E = (sin(phi)/16 - cos(phi))/(1 + 1/256)."""
    arb = extra("flint").arb

    def law(place: Any) -> Any:
        phi = balls.variable(place)
        return lambda energy: (phi.sin() - energy / 16, 0 * energy - arb(1) / 16)

    with balls.precision(96, order):
        edges = [arb(k) * 2 * arb.pi() / cells for k in range(cells + 1)]
        middles = [((low + high) / 2).mid() for low, high in pairwise(edges)]
        places = [
            balls.BallPlace(low, high, middle, law(middle), law(middle), law(low.union(high)))
            for (low, high), middle in zip(pairwise(edges), middles, strict=True)
        ]
        orbit = balls.periodic(places, order, 1e-12, [balls.line(0, 0)] * cells)
        off = arb(0)
        for place, energy in zip(places, orbit.polynomials, strict=True):
            for share in (-0.9, -0.4, 0.0, 0.7):
                step = share * (place.high - place.middle)
                phi = place.middle + step
                off = off.max(abs(energy(step) - (phi.sin() / 16 - phi.cos()) / arb(1 + 1 / 256)))
        assert orbit.start.contains(arb(-1) / arb(1 + 1 / 256))
    assert 1e-3 * float(orbit.reach) < float(off) < float(orbit.reach)


def test_a_machine_even_enough_without_a_flywheel_is_proven_to_need_none() -> None:
    result = sized({"drive": {"torque": 50}, "flywheel": {"irregularity": 0.9}}).figures
    assert result["flywheel.exact"][0] <= 0.0 <= result["flywheel.exact"][1] < 1e-300
    assert result["simulation.irregularity"][1] < 0.9


def test_a_motion_that_does_not_come_back_to_itself_is_not_proven() -> None:
    rising = {"load": [{"on": "crank", "torque": "-20*sin(phi)"}, {"on": "crank", "torque": "0.5*omega**2"}]}
    scene = flywheel.load({**QUADRATIC, **rising, "drive": {"torque": -50}, "flywheel": {"inertia": 3}})
    result = proof.proven(scene, lambda _: proof.NearMotion(3.0, 0.0, 10.0, 0.1))
    assert (result.figures, result.reason) == ({}, "a steady motion that is stable")


def over_a_kink(drive: Any) -> tuple[Any, Any]:
    """Extreme speeds with E' = u - 20 sin(phi) - k max(E, E0), k = 0.2, E0 = 250 J.

    Above E0, E - u/k + 20 (k sin(phi) - cos(phi))/(k² + 1) decays by exp(-k phi).
    """
    k, kink = mp.mpf("0.2"), mp.mpf(250)

    def forced(phi: Any) -> Any:
        return drive / k - 20 * (k * mp.sin(phi) - mp.cos(phi)) / (k * k + 1)

    def above(phi: Any, rising: Any) -> Any:
        return forced(phi) + (kink - forced(rising)) * mp.exp(-k * (phi - rising))

    def below(phi: Any, falling: Any) -> Any:
        return kink + (drive - k * kink) * (phi - falling) + 20 * (mp.cos(phi) - mp.cos(falling))

    def off(rising: Any, falling: Any) -> Any:
        return above(falling, rising) - kink, below(rising + 2 * mp.pi, falling) - kink

    rising, falling = mp.findroot(off, (4.76, 7.63))
    highest = mp.findroot(lambda phi: drive - 20 * mp.sin(phi) - k * above(phi, rising), 6.16)
    lowest = 3 * mp.pi - mp.asin((drive - k * kink) / 20)
    return tuple(mp.sqrt(2 * energy / 5) for energy in (above(highest, rising), below(lowest, falling)))


KINK = {
    "inertia": [{"on": "crank", "value": 2}],
    "drive": {"torque": 51},
    "flywheel": {"inertia": 3},
}


@pytest.mark.parametrize(
    "torque",
    ["-0.5*max(omega**2, 100)", "-0.25*(omega**2 + 100 + abs(omega**2 - 100))", "0.5*min(-omega*abs(omega), -100)"],
)
@pytest.mark.parametrize("known", [True, False])
def test_a_motion_over_a_speed_at_which_a_torque_switches_is_that_of_its_closed_form(torque: str, known: bool) -> None:
    """Also from a motion near that says nothing of the angles at which it passes this speed."""
    scene = flywheel.load({**KINK, "load": [{"on": "crank", "torque": f"-20*sin(phi) + {torque}"}]})
    result = flywheel.size(scene, accuracy="proof").proof if known else proof.proven(scene, lambda _: NEAR)
    assert result is not None
    with mp.workdps(40):
        for key, speed in zip(("speed_max", "speed_min"), over_a_kink(51), strict=True):
            assert holds(result.figures[f"simulation.{key}"], speed), key


@pytest.mark.parametrize(
    "chosen",
    [
        lambda a, b: NAMESPACE.where(a > b, a, b),
        lambda a, b: b + NAMESPACE.sign(a - b) * (a - b),
        NAMESPACE.maximum,
        NAMESPACE.minimum,
        lambda a, b: (a + b + abs(a - b)) / 2,
    ],
)
def test_an_open_branch_has_the_hull_of_both_sides(chosen: Any) -> None:
    arb, recorder = extra("flint").arb, Recorder()
    program = recorder.program([chosen(recorder.input("a"), recorder.input("b"))])
    for a, b in ((arb(1, 2), arb(2)), (arb(2), arb(1, 2))):
        (value,), (difference,) = enclosures.Branches(program)(enclosures.possible_sign, a, b)
        assert value.contains(a)
        assert value.contains(b)
        assert difference.contains(0)


def test_a_motion_that_does_not_vary_is_proven_to_be_even() -> None:
    result = sized(
        {"load": [{"on": "crank", "torque": "-0.5*omega**2"}], "drive": {"torque": 50}, "flywheel": {"inertia": 3}}
    )
    low, high = result.figures["simulation.irregularity"]
    assert low <= 0.0 <= high < 1e-16


@pytest.mark.slow
@pytest.mark.parametrize("wheel", ["crank", "motor"])
def test_the_motion_with_losses_in_a_mesh_by_hand_lies_inside(wheel: str) -> None:
    """Two rotors, one of which drives the other in turn, whose equation is integrated by itself."""
    scene = {
        "shafts": {"motor": {"ratio": 3, "efficiency": 0.8}},
        "inertia": [{"on": "crank", "value": 4}, {"on": "motor", "value": 0.2}],
        "load": [{"on": "crank", "torque": "-20 - 45*cos(phi)"}],
        "drive": {"on": "motor", "torque": "30 - 1.5*omega"},
        "flywheel": {"on": wheel, "inertia": 1.5},
    }
    sizing = flywheel.size(flywheel.load(scene), accuracy="proof")
    assert sizing.proof is not None
    assert not sizing.proof.reason, sizing.proof.reason
    inner, outer = (4.0 + 1.5 * (wheel == "crank"), 9 * (0.2 + 1.5 * (wheel == "motor")))

    def rate(phi: float, omega: NDArray[np.float64]) -> NDArray[np.float64]:
        load, drive = -20.0 - 45.0 * np.cos(phi), 3 * (30.0 - 1.5 * 3 * omega[0])
        outwards = (load + drive / 0.8) / (inner + outer / 0.8)  # from the crank to the motor
        inwards = (load + drive * 0.8) / (inner + outer * 0.8)
        return np.array([outwards if outer * outwards > drive else inwards]) / omega

    start, turn = np.array([sizing.speed]), 2 * np.pi
    for _ in range(40):
        end = solve_ivp(rate, (0.0, turn), start, method="DOP853", rtol=1e-12, atol=1e-12, max_step=0.02, dense_output=True)
        start = end.y[:, -1]
    speeds = end.sol(np.linspace(0.0, turn, 200_001))[0]
    for key, value in (("simulation.speed_max", speeds.max()), ("simulation.speed_min", speeds.min())):
        low, high = sizing.proof.figures[key]
        assert high - low <= WIDEST * high
        assert low * (1 - 1e-9) <= value <= high * (1 + 1e-9), key


@pytest.mark.slow
def test_a_flywheel_behind_two_meshes_with_losses_has_the_irregularity_that_was_required() -> None:
    path = Path(__file__).parents[2] / "examples" / "drive_lines" / "press.toml"
    sizing = flywheel.size(flywheel.load(path), accuracy="proof")
    assert sizing.proof is not None
    assert sizing.flywheel.exact is not None
    low, high = sizing.proof.figures["flywheel.exact"]
    assert high - low <= WIDEST * high
    assert low * (1 - sizing.error.exact) <= sizing.flywheel.exact <= high * (1 + sizing.error.exact)
    tables = tomllib.loads(path.read_text())
    wheel = {**tables["flywheel"], "inertia": 0.5 * (low + high)}
    del wheel["irregularity"]
    with_it = flywheel.size(flywheel.load({**tables, "flywheel": wheel}), accuracy="proof").proof
    assert with_it is not None
    least, most = with_it.figures["simulation.irregularity"]
    assert least * (1 - WIDEST) <= sizing.scene.irregularity <= most * (1 + WIDEST)


NEAR = enclosures.NearMotion(3.0, 0.0, 10.33341290682974, 0.08)


@pytest.mark.parametrize(
    ("torque", "reason"),
    [
        ("-15 if omega > 10 else -14", "a torque that may jump at a speed, at 1."),
        ("-15 if omega > 9 else -14", ""),
        ("-15 + (omega > 10)", "a torque that may jump at a speed, at 1."),
        ("-15 if max(omega - 10, 0) else -14", "a torque that may jump at a speed, at 1."),
    ],
)
def test_a_torque_that_jumps_at_a_speed_is_proven_on_one_side_of_it_alone(torque: str, reason: str) -> None:
    scene = {**KINK, "load": [{"on": "crank", "torque": f"-20*sin(phi) - 0.36*omega**2 + {torque}"}]}
    result = proof.proven(flywheel.load(scene), lambda _: NEAR)
    assert result.reason.startswith(reason)
    assert bool(result.figures) is not bool(reason)


def test_a_damper_of_the_square_of_a_velocity_that_reverses_is_proven() -> None:
    scene = {**PRESS, "load": [{"on": "slider", "force": "-40*v*abs(v)"}], "drive": {"torque": "90 - 2*omega"}, "regime": {}}
    result = flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": 40}}), accuracy="proof")
    assert result.proof is not None
    low, high = result.proof.figures["speed"]
    assert high - low <= WIDEST * high
    assert low * (1 - 1e-9) <= result.speed <= high * (1 + 1e-9)


@pytest.mark.parametrize(
    "force",
    sample(
        [
            "-3000*max(0, v/1.6 - 0.5)",
            "-300*max(0, v*abs(sin(phi)) - 0.4)",
            "-60*abs(abs(v) - 0.5)",
            "-100*max(v, 0.7)",
            "-100*max(0, min(v, 0.9) - 0.2)",
            "-400*max(0, -2*v)",
            "-40*abs(v*x - 0.01)",
            "-300*max(omega - 5*phi, 0)",
            "-90*(v > 0) + 20*(v < 0)",
        ],
        3,
    ),
)
def test_a_branch_that_a_velocity_decides_is_taken_where_the_velocity_is(force: str) -> None:
    """One anchor serves a whole piece, within which a velocity passes its limit."""
    mechanism = {**PRESS["mechanism"], "crank": {"length": 0.1}, "slider": {"mass": 3}}
    scene = {"mechanism": mechanism, "load": [{"on": "slider", "force": force}], "drive": {"torque": "900 - 20*omega"}}
    result = flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": 3}}), 1e-12, accuracy="proof")
    assert result.proof is not None
    for name, mine in (("speed", result.speed), ("simulation.irregularity", result.run.irregularity)):
        low, high = result.proof.figures[name]
        assert high - low <= WIDEST * high
        assert low * (1 - 1e-11) <= mine <= high * (1 + 1e-11)


@pytest.mark.parametrize("force", sample(("-300*v*(v > 0.8)", "-80 if v < 0.5 else -60"), 2))
def test_a_torque_that_jumps_at_a_velocity_is_refused_as_such(force: str) -> None:
    scene = {**PRESS, "load": [{"on": "slider", "force": force}], "drive": {"torque": "900 - 20*omega"}, "regime": {}}
    result = flywheel.size(flywheel.load({**scene, "flywheel": {"inertia": 40}}), accuracy="proof")
    assert result.proof is not None
    assert (result.proof.figures, result.proof.reason[:33]) == ({}, "a torque that may jump at a speed")
    with use("es"):
        assert "SIN demostrar: un par que puede saltar a una velocidad, en " in " ".join(summary.text(result).split())


def test_the_angle_of_a_velocity_is_refused_as_such() -> None:
    load = [{"on": "slider", "force": "-30*atan2(v - 0.5, 1.2 + x)"}]
    scene = {**PRESS, "load": load, "drive": {"torque": "900 - 20*omega"}, "regime": {}, "flywheel": {"inertia": 40}}
    result = flywheel.size(flywheel.load(scene), accuracy="proof").proof
    assert result is not None
    assert (result.figures, result.reason) == ({}, "the angle of a velocity, by atan2")


MAINS = {"voltage": "400 V", "current": "15 A", "power_factor": 0.83}
SERVO = {
    "type": "servo",
    "speed": 170,
    "torque": 60,
    "set_speed": 160,
    "droop": 0.05,
    "peak_torque": 200,
    "corner_speed": 130,
}
HYDRAULIC = {"type": "hydraulic", "displacement": "164 cm^3", "flow": "6 l/s", "pressure": "70 bar", "override": 0.1}
ROWS = {"speed": [0, 500, 1000, 1400, 1570], "speed_unit": "rpm", "torque": [100, 110, 130, 90, 0]}
MOTORS: dict[str, dict[str, Any]] = {
    "line": {"type": "line", "power": "7 kW", "speed": "1450 rpm", "no_load_speed": "1500 rpm"},
    "dc": {"type": "dc", "power": "7.5 kW", "speed": "1450 rpm", "voltage": "400 V", "efficiency": 0.9},
    "induction": PLATE,
    "induction by its starting torque": {**PLATE, **MAINS, "starting_torque": 2.2, "starting_current": 6.5},
    "inverter": {**PLATE, "inverter": {"frequency": "40 Hz"}},
    "inverter with a limit": {**PLATE, "inverter": {"frequency": "40 Hz", "torque_limit": 1.5, "ramp": 10}},
    "inverter at the rated frequency": {**PLATE, "inverter": {"frequency": "50 Hz", "torque_limit": 1.5}},
    "weakened field": {**PLATE, "inverter": {"frequency": "60 Hz", "torque_limit": 1.5}},
    "servo": {**SERVO, "maximum_speed": 230, "standstill_torque": 90, "efficiency": 0.9},
    "engine": {"type": "engine", "speed": 150, "torque": 60, "droop": 0.05, "braking_torque": 20},
    "engine by rows": {"type": "engine", "speed": 150, "droop": 0.05, "full_load": {**ROWS, "interpolation": "pchip"}},
    "hydraulic": {**HYDRAULIC, "volumetric_efficiency": 0.9, "mechanical_efficiency": 0.93},
    "rows": {"type": "table", **ROWS},
    "rows of a smooth curve": {"type": "table", **ROWS, "interpolation": "pchip"},
}


def driven(motor: dict[str, Any], torque: str = "-40 - 55*sin(phi)") -> Any:
    scene = {"inertia": [{"on": "crank", "value": 0.4}], "load": [{"on": "crank", "torque": torque}]}
    return flywheel.load({**scene, "drive": {"motor": motor}, "flywheel": {"inertia": 0.2}})


@pytest.mark.parametrize(("name", "torque"), sample([*product(MOTORS, ("-40 - 55*sin(phi)", "-50 - 1200*sin(phi)"))], 6))
def test_the_motion_with_every_motor_without_states_is_proven(name: str, torque: str) -> None:
    """With the greater torque it passes corners of motors' curves."""
    result = flywheel.size(driven(MOTORS[name], torque), 1e-12, accuracy="proof")
    assert result.proof is not None
    for key, mine in (("speed", result.speed), ("simulation.irregularity", result.run.irregularity)):
        low, high = result.proof.figures[key]
        assert high - low <= WIDEST * high
        assert low * (1 - 1e-11) <= mine <= high * (1 + 1e-11)


@pytest.mark.parametrize("name", MOTORS)
def test_the_torque_of_no_motor_jumps_at_a_speed(name: str) -> None:
    """So a motion is proven over its kinks, while loads that may jump are refused."""
    motor = driven(MOTORS[name]).motor
    assert motor is not None
    nodes = [*walk(motor.law().tree)]
    ends = {arg.number for node in nodes if node.op == "compare" for arg in node.args if arg.op == "number"}
    for speed in sorted(ends | {*np.linspace(0.0, 300.0, 3001).tolist()}):
        below, above = motor.torque([speed - 1e-9, speed + 1e-9])
        assert abs(above - below) < 1e-6 * max(abs(above), motor.rated.torque if motor.rated else 1.0), speed


@pytest.mark.parametrize("interpolation", ["linear", "pchip"])
def test_rows_of_a_motor_are_proven_as_they_are_written(interpolation: str) -> None:
    """The same curve in other units has an interval in common; a torque one digit higher in the 14th place has none."""
    rows = {"type": "table", "speed": [0.1, 50.3, 104.7, 146.6, 164.4], "torque": [101.3, 110.7, 130.1, 90.3, 0.7]}
    others = {"speed": [0.0001, 0.0503, 0.1047, 0.1466, 0.1644], "torque": [10130, 11070, 13010, 9030, 70]}
    units = {"speed_unit": "krad/s", "torque_unit": "N cm"}
    higher = {"torque": [101.3, 110.7, 130.1, 90.30000000001, 0.7]}
    of, other, moved = (
        flywheel.size(driven({**rows, **change, "interpolation": interpolation}), accuracy="proof").proof
        for change in ({}, others | units, higher)
    )
    (low, high), same, beyond = of.figures["speed"], other.figures["speed"], moved.figures["speed"]
    assert max(low, same[0]) <= min(high, same[1])
    assert beyond[0] > high


def extrapolated(function: Any, start: Any, value: Any, width: Any) -> Any:
    """One step of the modified midpoint rule, extrapolated to order 20."""
    table: list[list[Any]] = []
    for j in range(1, 11):
        step, before = width / (2 * j), value
        here = value + step * function(start, value)
        for m in range(1, 2 * j):
            before, here = here, before + 2 * step * function(start + m * step, here)
        row = [(before + here + step * function(start + width, here)) / 2]
        for n in range(1, j):
            row.append(row[-1] + (row[-1] - table[-1][n - 1]) / ((mp.mpf(j) / (j - n)) ** 2 - 1))
        table.append(row)
    return table[-1][-1]


@pytest.mark.slow
def test_a_proven_motion_is_that_of_an_extrapolation_in_34_digits() -> None:
    """An in-line slider-crank by hand: I* = 60 x'², and E' = 900 - 110 w - 300 (1 + cos phi)."""
    scene = {
        "mechanism": {"type": "slider-crank", "crank": {"length": 0.08}, "rod": {"length": 0.3}, "slider": {"mass": 60}},
        "load": [{"on": "crank", "torque": "-300*(1 + cos(phi))"}],
        "drive": {"torque": "900 - 110*omega"},
        "flywheel": {"inertia": 5},
    }
    result = flywheel.size(flywheel.load(scene), accuracy="proof").proof
    assert result is not None
    with mp.workdps(34):
        r, rod = mp.mpf("0.08"), mp.mpf("0.3")
        steps, width = 48, 2 * mp.pi / 48

        def speed(phi: Any, energy: Any) -> Any:
            root = mp.sqrt(rod**2 - (r * mp.sin(phi)) ** 2)
            inertia = 60 * (r * mp.sin(phi) + r**2 * mp.sin(phi) * mp.cos(phi) / root) ** 2
            return mp.sqrt(2 * energy / (inertia + 5))

        def moment(phi: Any, energy: Any) -> Any:
            return 900 - 110 * speed(phi, energy) - 300 * (1 + mp.cos(phi))

        def cycle(energy: Any) -> list[Any]:
            energies = [energy]
            for k in range(steps):
                energies.append(extrapolated(moment, k * width, energies[-1], width))
            return energies

        energies = [mp.mpf(70)]
        for _ in range(4):  # a cycle leaves 1e-10 of a difference
            energies = cycle(energies[-1])

        def later(phi: Any) -> Any:
            k = int(phi / width)
            return speed(phi, extrapolated(moment, k * width, energies[k], phi - k * width))

        for key, sign in (("speed_max", 1), ("speed_min", -1)):
            near = max(range(1, steps), key=lambda k: sign * speed(k * width, energies[k])) * width
            for step in (width, width / 2**8, width / 2**16, width / 2**24):  # the summit of a parabola, again and again
                before, here, after = (later(near + side * step) for side in (-1, 0, 1))
                near += step * (before - after) / (2 * (before - 2 * here + after))
            low, high = result.figures[f"simulation.{key}"]
            assert low <= later(near) <= high, key
            assert high - low < WIDEST * high, key


LOSSY = {
    "shafts": {"motor": {"ratio": 12.5, "efficiency": 0.8}},
    "mechanism": {"type": "slider-crank", "crank": {"length": 0.08}, "rod": {"length": 0.3}, "slider": {"mass": 2}},
    "load": [{"on": "crank", "torque": "-30*(1 + cos(phi))"}],
    "drive": {"on": "crank", "torque": "90 - 2*omega"},
    "flywheel": {"on": "crank", "inertia": 5},
}


def test_an_idle_mesh_leaves_the_proof_of_a_motion_as_it_is() -> None:
    """Nothing is behind the mesh: which side drives in it is undecided everywhere, and without effect."""
    idle, without = (
        flywheel.size(flywheel.load(scene), accuracy="proof").proof for scene in (LOSSY, LOSSY | {"shafts": {}})
    )
    assert idle is not None
    assert without is not None
    assert without.figures
    assert idle.figures.keys() == without.figures.keys()
    for key, (low, high) in idle.figures.items():
        least, most = without.figures[key]
        assert max(low, least) <= min(high, most), key


def test_an_even_motion_leaves_open_which_side_of_an_idle_mesh_drives() -> None:
    scene = {
        "shafts": {"s0": {"ratio": 3.1, "efficiency": 0.8}},
        "inertia": [{"on": "crank", "value": 0.9}, {"on": "s0", "value": 0.02}],
        "load": [{"on": "crank", "torque": "-0.006*(1 + 0.1*omega)"}],
        "drive": {"torque": "0.026 - 0.016*omega"},
        "flywheel": {"inertia": 0.1},
    }
    result = flywheel.size(flywheel.load(scene), accuracy="proof").proof
    assert result is not None
    assert holds(result.figures["speed"], mp.mpf(200) / 166)
    assert result.figures["simulation.irregularity"][1] < 1e-15


def test_a_motion_is_proven_about_the_reversals_of_its_meshes_whatever_the_sizing_leaves_open() -> None:
    """At a tolerance of 1e-4 the sizing knows such an angle to 1e-5 rad only."""
    swinging = LOSSY | {
        "inertia": [{"on": "motor", "value": 0.05}],
        "load": [{"on": "crank", "torque": "-30 - 150*cos(phi)"}],
    }
    loose, sharp = (
        flywheel.size(flywheel.load(swinging | {"accuracy": {"rtol": rtol}}), accuracy="proof").proof
        for rtol in (1e-4, 1e-12)
    )
    assert loose is not None
    assert sharp is not None
    assert loose.figures.keys() == sharp.figures.keys() >= {"speed", "simulation.irregularity"}
    for key, (low, high) in loose.figures.items():
        assert max(low, sharp.figures[key][0]) <= min(high, sharp.figures[key][1]), key


@pytest.mark.parametrize(
    ("efficiency", "reason"), sample([(1.0, "the motion at "), (0.8, "that a motion through so many cells")], 2)
)
def test_a_motion_that_cells_however_narrow_do_not_follow_is_refused(
    monkeypatch: pytest.MonkeyPatch, efficiency: float, reason: str
) -> None:
    monkeypatch.setattr(balls, "missed", lambda *_: balls.exact(math.inf))
    monkeypatch.setattr(enclosures, "_MOST_CELLS", 90)
    scene = LOSSY | {"shafts": {"motor": {"ratio": 12.5, "efficiency": efficiency}}}
    result = flywheel.size(flywheel.load(scene), accuracy="proof").proof
    assert result is not None
    assert not result.figures
    assert result.reason.startswith(reason)
