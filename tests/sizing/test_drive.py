"""The drive along a cycle: duty, engines, drive"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import newton

import flywheel
from flywheel import SceneError
from flywheel.components.energy import mean_effective_pressure, mechanical_efficiency
from flywheel.duty import Stretch, mean, root_mean_square
from flywheel.sizing.duty import over
from flywheel.tables import sizing as report
from tests.oracle.drive_lines import DriveLine, Regime

# Duties: the flywheel of the hardest phase, torque and heat over all phases, against integrals by hand and handbooks.


PULSE = {"on": "crank", "torque": "-250 N m", "from": "40 deg", "to": "100 deg"}
MOTOR = {
    "type": "induction",
    "power": "1.1 kW",
    "speed": "1415 rpm",
    "poles": 4,
    "frequency": "50 Hz",
    "breakdown_ratio": 2.4,
    "inertia": 0.003,
}
PUNCH = {
    "shafts": {"motor": {"ratio": 6.5}},
    "inertia": [{"on": "crank", "value": 2.0}],
    "load": [PULSE],
    "drive": {"on": "motor", "motor": MOTOR},
    "flywheel": {"irregularity": "8 %"},
}
PHASES = [
    {"name": "punching", "duration": "60 s"},
    {"name": "thin sheet", "cycles": 40, "changes": {"load": {"0": {"torque": "-140 N m"}}}},
    {"name": "idling", "duration": "30 s", "loads": "10 %"},
    {"name": "pause", "duration": "45 s", "rest": True, "standstill_cooling": 0.25},
]


def scene(*phases, **changes):
    return flywheel.load(PUNCH | changes | {"duty": list(phases)})


@pytest.fixture(scope="module")
def punch():
    return flywheel.size(scene(*PHASES), simulate=False)


def integrals(pulse, inertia):
    """Period, torque squared, heat and work over the steady cycle at the motor: by DOP853 on the crank's angle."""
    motor = flywheel.motors.Induction(
        power=1100.0, speed=1415 * np.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.4, inertia=0.003
    )
    whole = 2.0 + 0.003 * 6.5**2 + inertia

    def rates(phi, state, load):
        omega = state[0]
        torque = float(motor.torque(6.5 * omega))
        heat = torque * (motor.synchronous_speed - 6.5 * omega)
        return [(6.5 * torque - load) / (whole * omega), 1 / omega, torque**2 / omega, heat / omega, 6.5 * torque]

    edges = np.radians([0.0, 40.0, 100.0, 360.0])

    def cycle(omega):
        state = np.array([omega, 0.0, 0.0, 0.0, 0.0])
        for low, high, load in zip(edges[:-1], edges[1:], (0.0, pulse, 0.0), strict=True):
            state = solve_ivp(rates, (low, high), state, "DOP853", rtol=1e-11, atol=1e-11, args=(load,)).y[:, -1]
        return state

    return cycle(newton(lambda omega: cycle(omega)[0] - omega, 24.0, tol=1e-11))[1:]


def regimes(inertia):
    """The duty by the regimes of its phases alone, without the changes of speed between them."""
    phases = scene(*PHASES).duty
    runs = {one.name: flywheel.size(one.scene.with_flywheel(inertia), simulate=False) for one in phases if one.scene}
    return over(phases, runs, inertia, follow=False)


def test_every_phase_and_the_whole_duty_against_integrals_by_hand(punch):
    inertia = punch.flywheel.exact
    result, rows = regimes(inertia), []
    for row, pulse in zip(result.phases[:3], (250.0, 140.0, 25.0), strict=True):
        period, square, heat, work = integrals(pulse, inertia)
        duration = 40 * period if row.name == "thin sheet" else row.duration
        assert row.duration == pytest.approx(duration, rel=1e-9)
        assert row.rms_torque == pytest.approx(np.sqrt(square / period), rel=1e-9)
        assert row.heat == pytest.approx(heat / period, rel=1e-8)
        rows.append((duration, square / period, heat / period, work / period))
    time, square, heat, power = np.array(rows).T
    cooled = time.sum() + 0.25 * 45.0
    assert result.rms_torque == pytest.approx(np.sqrt(time @ square / cooled), rel=1e-9)
    assert result.heat == pytest.approx(time @ heat / cooled, rel=1e-8)
    assert result.mean_power == pytest.approx(time @ power / (time.sum() + 45.0), rel=1e-9)
    assert result.cyclic_duration_factor == pytest.approx((time.sum()) / (time.sum() + 45.0), rel=1e-12)
    rated = 1100.0 / (1415 * np.pi / 30)
    assert result.rms_torque_share == pytest.approx(result.rms_torque / rated, rel=1e-12)


def test_the_flywheel_is_that_of_the_hardest_phase(punch):
    alone = [flywheel.size(phase.scene, simulate=False).flywheel.exact for phase in scene(*PHASES).duty[:2]]
    assert punch.flywheel.exact == max(alone) > 1.1 * min(alone)
    assert punch.duty.governing == "punching"
    assert punch.duty.phases[0].irregularity == pytest.approx(0.08, rel=1e-9)
    assert all(row.irregularity < 0.08 for row in punch.duty.phases[1:3])


@pytest.mark.slow
def test_figures_of_a_duty_allow_for_what_is_open_of_its_least_flywheel():
    wheel = {"limits": {"irregularity": 0.08, "motor_heat": 0.423}}
    loose, sharp = (flywheel.size(scene(*PHASES, flywheel=wheel), rtol, simulate=False).duty for rtol in (1e-4, 1e-12))
    assert abs(loose.heat / sharp.heat - 1.0) > 1e-10
    for name in ("rms_torque", "rms_torque_share", "heat", "heat_share"):
        assert abs(getattr(loose, name) / getattr(sharp, name) - 1.0) <= loose.errors[name], name


def test_the_heat_of_a_motor_without_a_rated_point_has_an_error_over_a_duty():
    """It is that of its copper: 2e-5 off at a loose accuracy, with nothing stated before it had its own."""
    motor = {"type": "dc", "voltage": "200 V", "resistance": "6 ohm", "constant": "1.3 V s", "inductance": "0.05 H"}
    plain = scene(*PHASES, drive={"on": "motor", "motor": motor})
    loose, sharp = (flywheel.size(plain, rtol, accuracy="normal") for rtol in (1e-2, 1e-12))
    stated = loose.as_dict()["error"]["duty"]["heat"]
    assert 1e-10 < abs(loose.duty.heat / sharp.duty.heat - 1.0) <= stated < 1e-2


def test_a_start_that_no_flywheel_makes_possible_is_refused_with_its_reason():
    """At the flywheel by which the search begins: there is no start with any."""
    phases = ({"name": "running", "duration": "60 s"}, {"name": "started", "cycles": 40, "starts": 1})
    load = [PULSE, {"on": "crank", "model": {"type": "losses", "constant": 40.0}}]
    wheel = {"limits": {"irregularity": 0.08, "motor_heat": 1.4}}
    with pytest.raises(flywheel.SceneError, match=r"duty\[1\].starts: found a start that does not reach"):
        flywheel.size(scene(*phases, load=load, flywheel=wheel), accuracy="normal")


@pytest.mark.slow
def test_limits_of_heat_and_rms_torque_are_kept_over_the_whole_duty(punch):
    def limited(**limits):
        return flywheel.size(scene(*PHASES, flywheel={"limits": {"irregularity": 0.08} | limits}), simulate=False)

    loose, tight = limited(motor_heat=0.62), limited(motor_rms=0.7, motor_torque=1.5)
    assert loose.flywheel.exact == pytest.approx(punch.flywheel.exact, rel=1e-12)
    assert (loose.binding, tight.binding) == ("irregularity", "motor_rms")
    assert loose.limits["motor_heat"].alone < loose.flywheel.exact < tight.flywheel.exact
    assert regimes(tight.flywheel.exact).rms_torque_share == pytest.approx(0.7, rel=1e-9)
    assert regimes(0.999 * tight.flywheel.exact).rms_torque_share > 0.7
    assert any("changes of speed between phases are left out" in line for line in tight.messages)
    assert tight.limits["motor_torque"].reached == pytest.approx(1.48151, rel=1e-5)
    with pytest.raises(
        flywheel.SceneError, match=r"30 %, which no flywheel achieves over the duty: at best, .* it is 41\.8"
    ):
        limited(motor_heat=0.3)
    with pytest.raises(flywheel.SceneError, match="expected an irregularity with them"):
        flywheel.size(scene(*PHASES, flywheel={"limits": {"motor_heat": 0.9}}), simulate=False)


def test_no_limit_decides_where_the_machine_needs_no_flywheel():
    limits, heavy = {"irregularity": 0.08, "motor_rms": 2.0}, [{"on": "crank", "value": 300.0}]
    result = flywheel.size(scene(*PHASES[:1], inertia=heavy, flywheel={"limits": limits}), simulate=False)
    assert (result.flywheel.exact, result.flywheel.needed, result.binding) == (0.0, False, None)
    assert not any("motor_rms" in message for message in result.messages)


def test_a_given_flywheel_and_a_balance_as_drive():
    drive = {"drive": {"torque": "balance"}, "regime": {"speed": "60 rpm"}, "flywheel": {"inertia": 500.0}}
    duty = flywheel.size(scene(*PHASES[::2], PHASES[3], **drive), simulate=False).duty
    torques = np.array([250.0, 25.0]) / 6  # over 60 of 360 degrees
    assert [row.rms_torque for row in duty.phases[:2]] == pytest.approx(torques, rel=1e-12)
    assert duty.rms_torque == pytest.approx(np.sqrt(torques**2 @ [60.0, 30.0] / (90.0 + 0.25 * 45.0)), rel=1e-12)
    assert (duty.heat, duty.rms_torque_share, duty.governing) == (None, None, "punching")
    assert duty.phases[0].irregularity > duty.phases[1].irregularity


@pytest.mark.slow
def test_what_passes_between_phases_is_as_small_as_settling_is_short():
    phases = [{"name": "a", "cycles": 12}, {"name": "b", "cycles": 12, "loads": "10 %"}]
    result = flywheel.size(scene(*phases), simulate=False)
    motor = flywheel.motors.Induction(
        power=1100.0, speed=1415 * np.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.4, inertia=0.003
    )
    whole = 2.0 + 0.003 * 6.5**2 + result.flywheel.exact

    def rates(phi, state, load):
        torque = float(motor.torque(6.5 * state[0]))
        heat = torque * (motor.synchronous_speed - 6.5 * state[0])
        return [(6.5 * torque - load) / (whole * state[0]), 1 / state[0], heat / state[0]]

    edges, state = np.radians([0.0, 40.0, 100.0, 360.0]), np.array([24.0, 0.0, 0.0])
    for _ in range(2):  # the second time round it repeats
        state[1:] = 0.0
        for pulse in [250.0] * 12 + [25.0] * 12:
            for low, high, load in zip(edges[:-1], edges[1:], (0.0, pulse, 0.0), strict=True):
                state = solve_ivp(rates, (low, high), state, "DOP853", rtol=1e-8, atol=1e-8, args=(load,)).y[:, -1]
    share = max(row.settling / row.duration for row in result.duty.phases)
    assert 0.05 < share < 0.2
    assert 0.0 < result.duty.heat / (state[2] / state[1]) - 1.0 < 0.25 * share
    assert sum("between phases the machine runs otherwise" in output for output in result.messages) == 2


def test_types_and_duration_factor():
    drive = {"drive": {"torque": "balance"}, "regime": {"speed": "60 rpm"}, "flywheel": {"inertia": 500.0}}

    def output(*phases):
        result = flywheel.size(scene(*phases, **drive), simulate=False).duty
        return result.type, round(result.cyclic_duration_factor, 9)

    load, rest, idle = {"duration": 60}, {"duration": 90, "rest": True}, {"duration": 40, "loads": 0}
    assert [output(load), output(load, rest), output(load, idle)] == [("S1", 1.0), ("S3", 0.4), ("S6", 0.6)]
    assert output(load, idle, rest) == (None, round(60 / 190, 9))


@pytest.mark.slow
def test_electric_braking_counts_as_starts_and_names_the_type():
    """S5 and S7 of IEC 60034-1; S2 is S3 with windings that have cooled down."""
    warm = PUNCH["drive"]["motor"] | {"thermal": {"time_constant": "20 min", "class": "F"}}
    drive, load = {"drive": {"on": "motor", "motor": warm}}, {"duration": 60, "loads": "10 %"}
    rest = {"duration": 300, "rest": True}

    def sized(*phases):
        return flywheel.size(scene(*phases, **drive), simulate=False)

    plain, braked = sized(load | {"starts": 1}, rest), sized(load | {"starts": 1, "braking": "direct-current"}, rest)
    four, back = sized(load | {"starts": 4}, rest), sized(load | {"starts": 1, "braking": "reversal"})
    assert [each.duty.type for each in (plain, braked, four, back)] == ["S4", "S5", "S4", "S7"]
    assert sized(load | {"starts": 1}).duty.type is None  # without rest and without a brake it cannot start again
    assert braked.duty.phases[0].starts == 2
    assert back.duty.phases[0].heat == pytest.approx(four.duty.phases[0].heat, rel=1e-12)
    (once,), (twice,) = (each.temperature.starts.values() for each in (plain, braked))
    assert 0.4 < twice / once < 0.6
    assert [sized({"duration": 60}, rest | {"duration": time}).duty.type for time in (300, 7200)] == ["S3", "S2"]
    with pytest.raises(SceneError, match=r"braking: found .* in a phase without starts"):
        sized(load | {"braking": "reversal"}, rest)


@pytest.mark.slow
def test_starts_bring_their_own_heat_and_torque():
    idle, rest = {"duration": 60, "loads": "10 %"}, {"duration": 30, "rest": True}
    plain = flywheel.size(scene(idle, rest), simulate=False)
    result = flywheel.size(scene(idle | {"starts": 2}, rest), simulate=False)
    low = PUNCH | {"load": [PULSE | {"factor": 0.1}], "flywheel": {"inertia": result.flywheel.exact}}
    run = flywheel.run_up(flywheel.load(low))
    row, steady = result.duty.phases[0], plain.duty.phases[0]
    assert (result.duty.type, row.starts) == ("S4", 2)
    assert row.start_heat == pytest.approx(run.energy.rotor_heat, rel=1e-9)
    share = 1 - 2 * run.time / 60
    assert row.heat == pytest.approx(steady.heat * share + 2 * run.energy.rotor_heat / 60, rel=1e-9)
    t, owners = np.linspace(0, run.time, 200_001), None
    torque = flywheel.transients.sampled(run.motion.trail, t, owners).drive
    square = np.trapezoid(torque**2, t)
    assert row.rms_torque**2 == pytest.approx(steady.rms_torque**2 * share + 2 * square / 60, rel=1e-7)
    assert result.duty.heat > plain.duty.heat
    with pytest.raises(flywheel.SceneError, match=r"duty\[0\]\.starts: found 20 starts"):
        flywheel.size(scene(idle | {"duration": 1, "starts": 20}))


@pytest.mark.parametrize(
    ("phases", "path"),
    [
        ([], "duty:"),
        ([{"name": "a"}], "duty[0]:"),
        ([{"duration": 3, "cycles": 4}], "duty[0]:"),
        ([{"duration": -3}], "duty[0].duration:"),
        ([{"duration": 3, "rest": True}], "duty:"),
        ([{"duration": 3}, {"cycles": 3, "rest": True}], "duty[1].cycles:"),
        ([{"duration": 3}, {"duration": 3, "rest": True, "loads": 0.5, "starts": 1}], "duty[1].loads:"),
        ([{"duration": 3, "standstill_cooling": 0.5}], "duty[0].standstill_cooling:"),
        ([{"duration": 3, "starts": 1.5}], "duty[0].starts:"),
        ([{"duration": 3, "loads": 60}], 'duty[0].loads: found 60, expected a value at least 0 and at most 2; write "60 %"'),
        ([{"duration": 3, "name": "a"}, {"duration": 3, "name": "a"}], "duty[1].name:"),
        ([{"duration": 3, "changes": {"load.0.tork": 3}}], 'duty[0].changes.load[0].tork: found key "tork"'),
        ([{"duration": 3, "changes": {"load": {"4": {"torque": 3}}}}], "duty[0].changes.load.4:"),
        ([{"duration": 3, "changes": {"flywheel.irregularity": 0.01}}], "duty[0].changes.flywheel.irregularity:"),
        ([{"duration": 3, "change": 5}], "duty[0].change:"),
    ],
)
def test_faults_of_a_duty_stand_at_their_key(phases, path):
    with pytest.raises(flywheel.SceneError) as caught:
        scene(*phases)
    assert path in str(caught.value)


def test_all_phases_that_cannot_run_are_told_at_once():
    heavy = {"load.0.torque": "-2500 N m"}
    with pytest.raises(flywheel.SceneError) as caught:
        flywheel.size(scene({"duration": 5}, {"duration": 5, "changes": heavy}, {"duration": 5, "changes": heavy}))
    assert [fault.path for fault in caught.value.faults] == ["duty[1] (phase 2): drive", "duty[2] (phase 3): drive"]


def test_the_drag_of_a_shaft_goes_on_where_the_machine_idles():
    dragged = {"motor": {"ratio": 6.5, "drag": "0.2 N m"}}
    result = scene({"duration": 60}, {"duration": 40, "loads": 0}, shafts=dragged)
    assert [load.path for load in result.duty[1].scene.loads] == ["load[0]", "shafts.motor.drag"]


def test_json_and_pages(punch):
    result = punch.as_dict()
    assert result["duty"]["phases"][1]["name"] == "thin sheet"
    assert set(result["error"]["duty"]) >= {"period", "rms_torque", "heat", "mean_power"}
    assert all(0.0 <= error < 1e-7 for error in result["error"]["duty"].values())
    from flywheel.tables import sizing, summary

    assert "phase that determines the flywheel" in " ".join(summary.text(punch).split())
    assert "thin sheet" in sizing.text(punch)


def test_the_report_has_a_section_of_the_duty(punch):
    from flywheel.report import contents, drive

    section = drive.duty(contents.context(punch))
    assert [row[0] for row in section.parts[0].rows] == ["punching", "thin sheet", "idling", "pause"]
    assert [part.result.symbol for part in section.parts[1:4]] == ["t_c", "T_rms", "Q"]


def test_laws_times_a_factor():
    law = {"on": "crank", "torque": "-60*(1 + sin(phi))", "factor": 0.5}
    rows = {"on": "crank", "table": {"angle": [0, 3, 6.283185307179586], "value": [-5, -40, -5]}, "factor": "50 %"}
    for load in (law, rows, PULSE | {"factor": 0.5}):
        whole = {**PUNCH, "load": [{k: v for k, v in load.items() if k != "factor"}]}
        half, full = (flywheel.Machine(flywheel.load(PUNCH | given)) for given in ({"load": [load]}, whole))
        moments = [machine.reduction.moments(1.3, 1.3, 0.0) for machine in (half, full)]
        given = [next(value for name, value in each.items() if "load" in name) for each in moments]
        assert given[0] == pytest.approx(0.5 * given[1], rel=1e-15)


@pytest.mark.parametrize(
    ("stretches", "printed"),
    [
        # Theraja, Electrical Technology, vol. III, chapter 44: 100 hp for 10 min, 0 for 5, 50 for 8, 0 for 4: 66.67 hp
        ([(10.0, 100.0), (5.0, 0.0), (8.0, 50.0), (4.0, 0.0)], 66.67),
        # an examination of Indian engineering services: 200 kW for 10 min, half of it for 20 min: 100 sqrt(2) kW
        ([(10.0, 200.0), (20.0, 100.0)], 100 * np.sqrt(2)),
    ],
)
def test_root_mean_square_as_printed(stretches, printed):
    assert root_mean_square([Stretch(*each) for each in stretches]) == pytest.approx(printed, rel=1e-4)


def test_a_printed_duty_as_a_scene():
    phases = [{"duration": f"{time} min", "loads": load} for time, load in ((10, 1.0), (5, 0.0), (8, 0.5), (4, 0.0))]
    drive = {"drive": {"torque": "balance"}, "regime": {"speed": "60 rpm"}, "flywheel": {"inertia": 500.0}}
    load = [{"on": "crank", "torque": "-200 N m", "factor": 0.5}]  # its own share, and that of the phase
    assert flywheel.size(scene(*phases, load=load, **drive), simulate=False).duty.rms_torque == pytest.approx(
        66.67, rel=1e-4
    )


def test_means_refuse_what_makes_no_sense():
    for wrong in ([], [Stretch(-1.0, 3.0)], [Stretch(1.0, np.nan)], [Stretch(1.0, 3.0, 0.0)]):
        with pytest.raises(flywheel.SceneError):
            mean(wrong)


# Engines: indicated and brake work against integrals by hand, and the unit of every balance.


BORE, CRANK, ROD = 0.084, 0.045, 0.145
AREA = pi * BORE**2 / 4
SLIDER = {"type": "slider-crank", "crank": {"length": CRANK}, "rod": {"length": ROD}, "slider": {"mass": 0.5}}
DIAGRAM = {"type": "indicator", "bore": BORE, "position": [0, 0.5, 1], "out": [40e5, 12e5, 4e5], "back": [9e5, 2e5, 1e5]}
LOOP = (31e5 / 2 + 10e5 + 3e5 / 2) / 2  # mean of out less back over the stroke, by trapezia


def engine_scene(**changes: Any) -> dict[str, Any]:
    loads = [{"on": "slider", "model": DIAGRAM}, {"on": "crank", "torque": "-T"}]
    machine = {"mechanism": SLIDER, "load": loads, "parameters": {"T": "balance"}, "regime": {"speed": 150}}
    return {**machine, "flywheel": {"irregularity": 0.02}, **changes}


def sized(**changes: Any) -> flywheel.Sizing:
    return flywheel.size(flywheel.load(engine_scene(**changes)), simulate=False)


def speed_of_slider(phi: float) -> float:
    s, c = np.sin(phi), np.cos(phi)
    return float(-CRANK * s - CRANK**2 * s * c / np.sqrt(ROD**2 - (CRANK * s) ** 2))


def test_a_diagram_s_work_its_mean_pressure_and_what_the_load_takes() -> None:
    result = sized()
    engine, work = result.engine, LOOP * AREA * 2 * CRANK
    assert engine is not None
    assert engine.indicated_work == pytest.approx(work, rel=1e-12)
    assert engine.indicated_power == pytest.approx(work * 150 / (2 * pi), rel=1e-12)
    assert engine.swept_volume == pytest.approx(AREA * 2 * CRANK, rel=1e-12)
    assert engine.mean_effective_pressure == pytest.approx(LOOP, rel=1e-12)
    assert engine.brake_work == pytest.approx(work, rel=1e-12)
    assert engine.mechanical_efficiency == pytest.approx(1.0, rel=1e-12)
    text = report.text(result)
    assert "N m" in text.split("T (balance)")[1].splitlines()[0]
    assert f"{LOOP / 1e5:g}" in text.split("mean effective pressure")[1].splitlines()[0]
    assert "none" not in text.split("Speed of the crank")[0]


def test_what_a_damper_takes_the_load_does_not_get() -> None:
    engine = sized(damper=[{"on": "slider", "coefficient": 3.0}]).engine
    assert engine is not None
    assert engine.mechanical_efficiency is not None
    assert engine.mechanical_efficiency < 1.0
    assert engine.indicated_work == pytest.approx(LOOP * AREA * 2 * CRANK, rel=1e-9)


def test_losses_at_constant_speed_by_hand() -> None:
    """Friction on the piston and in the bearings, of constant size: 2 F stroke and T 2 pi a cycle."""
    loads = [*engine_scene()["load"], {"on": "slider", "force": "-40*sign(v)"}]
    loads += [{"on": "crank", "model": {"type": "losses", "constant": "1.5 N m"}}]
    engine = sized(load=loads).engine
    assert engine is not None
    lost = 40 * 4 * CRANK + 1.5 * 2 * pi
    assert engine.brake_work == pytest.approx(engine.indicated_work - lost, rel=1e-9)
    assert engine.mechanical_efficiency == pytest.approx(1 - lost / engine.indicated_work, rel=1e-9)


FORCE = {"on": "slider", "force": "-9e3*(1 + cos(phi))*(1 if phi < pi else 0.25)", "every": 2 * pi}


@pytest.mark.parametrize("bore", [None, BORE])
def test_a_force_is_that_of_gas_where_it_drives(bore: float | None) -> None:
    gas = FORCE | ({} if bore is None else {"bore": bore})
    engine = sized(load=[gas, {"on": "crank", "torque": "-T"}], regime={"speed": 150, "cycle": 4 * pi}).engine
    force = (lambda phi: -9e3 * (1 + np.cos(phi)), lambda phi: -9e3 * (1 + np.cos(phi)) / 4)
    halves = ((0.0, pi), (pi, 2 * pi))
    work = sum(quad(lambda p, f=f: f(p) * speed_of_slider(p), a, b, epsabs=0, epsrel=1e-12)[0]
               for f, (a, b) in zip(force, halves, strict=True))  # fmt: skip
    assert engine is not None
    assert engine.indicated_work == pytest.approx(2 * work, rel=1e-9)
    if bore is None:
        assert (engine.swept_volume, engine.mean_effective_pressure) == (None, None)
    else:
        assert engine.swept_volume == pytest.approx(2 * AREA * 2 * CRANK, rel=1e-12)  # twice in these two turns
        assert engine.mean_effective_pressure == pytest.approx(work / (AREA * 2 * CRANK), rel=1e-9)


def test_an_engine_that_is_helped_has_no_brake_work() -> None:
    """Losses take more than the gas gives, and the drive the rest: nothing is left for a brake."""
    gas, losses = engine_scene()["load"][0], {"on": "crank", "model": {"type": "losses", "constant": "200 N m"}}
    engine = sized(load=[gas, losses], drive={"torque": "balance"}, parameters={}).engine
    assert engine is not None
    assert engine.indicated_work == pytest.approx(LOOP * AREA * 2 * CRANK, rel=1e-9)
    assert (engine.brake_work, engine.brake_power, engine.mechanical_efficiency) == (None, None, None)


def test_three_cylinders_and_a_drive_that_brakes() -> None:
    """Forces alone, in the scene's own words: the drive takes what they give."""
    engine = flywheel.size(flywheel.load("examples/machines/three_cylinder.toml"), simulate=False).engine
    single = flywheel.size(flywheel.load("examples/machines/engine.toml"), simulate=False).engine
    assert engine is not None
    assert single is not None
    assert engine.indicated_work == pytest.approx(3 * single.indicated_work, rel=1e-12)
    assert engine.swept_volume == pytest.approx(3 * AREA * 2 * CRANK, rel=1e-12)
    assert engine.mean_effective_pressure == pytest.approx(single.mean_effective_pressure, rel=1e-12)
    assert engine.brake_work == pytest.approx(engine.indicated_work, rel=1e-12)


def test_machines_that_gas_does_not_drive_are_no_engines() -> None:
    loads = [{"on": "slider", "force": "-500*sign(v)"}]
    assert sized(load=loads, drive={"torque": "balance"}, parameters={}).engine is None
    backwards = DIAGRAM | {"out": DIAGRAM["back"], "back": DIAGRAM["out"]}
    assert sized(load=[{"on": "slider", "model": backwards}, {"on": "crank", "torque": "T"}]).engine is None


@pytest.mark.parametrize(
    ("load", "fault"),
    [
        ({"on": "crank", "torque": "-T", "bore": 0.1}, "load[0].bore"),
        ({"on": "slider", "model": DIAGRAM, "bore": 0.1}, "load[0].bore"),
        ({"on": "slider", "force": "-T", "bore": 0}, "load[0].bore"),
        ({"on": "slider", "force": "-T", "bore": "84 kg"}, "load[0].bore"),
    ],
)
def test_bores_that_are_none(load: dict[str, Any], fault: str) -> None:
    with pytest.raises(SceneError) as caught:
        flywheel.load(engine_scene(load=[load, {"on": "crank", "torque": "-T"}]))
    assert [result.path for result in caught.value.faults] == [fault]


def test_formulas_refuse_what_cannot_be() -> None:
    with pytest.raises(SceneError, match="swept_volume"):
        mean_effective_pressure(1.0, 0.0)
    with pytest.raises(SceneError, match="indicated"):
        mechanical_efficiency(1.0, 0.0)


# --- units of balances ------------------------------------------------------------------------------------------------

UNITS = {
    "-T": "N m",
    "-T*omega": "N m s/rad",
    "-T*omega**2/2": "N m s^2/rad^2",
    "-3 - T if phi < pi else -T": "N m",
    "-T*x": "N m/rad",
    "-T/k": "N^2 m^2",
    "-T*(1 + omega)": None,
}


@pytest.mark.parametrize("law", UNITS)
def test_a_balance_has_the_unit_of_what_it_stands_in(law: str) -> None:
    parameters = {"T": "balance", "k": "2 N m", "j": 3}
    result = sized(load=[engine_scene()["load"][0], {"on": "crank", "torque": law}], parameters=parameters)
    assert result.balance_unit == UNITS[law] == result.as_dict()["balance_unit"]
    line = report.text(result).split("T (balance)")[1].splitlines()[0]
    assert line.endswith(UNITS[law] or "in the units of its expression")


def test_a_balance_in_two_places_of_two_units_has_none() -> None:
    loads = [engine_scene()["load"][0], {"on": "slider", "force": "-T*sign(v)"}, {"on": "crank", "torque": "-T"}]
    assert sized(load=loads).balance_unit is None
    assert (
        flywheel.size(flywheel.load(engine_scene(load=loads[:2], drive={"torque": "2 N m"})), simulate=False).balance_unit
        == "N"
    )


# Shafts in series against the series equations: flywheel, speeds, powers, and what every mesh loses.


RTOLS = (1e-3, 1e-6, 1e-9, 1e-11)
FLOOR = 2e-11  # what the oracle itself may be off by
LINE: dict[str, Any] = {
    "shafts": {
        "wheel": {"ratio": 6.0, "efficiency": 0.97, "drag": 4.0},
        "motor": {"on": "wheel", "ratio": 4.7, "efficiency": 0.96, "slip": "2 %"},
    },
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.05, "mass": 90, "inertia": 2.4},
        "rod": {"length": 0.4, "mass": 45, "inertia": 1.1, "com": 0.13},
        "slider": {"mass": 160},
    },
    "load": [{"on": "slider", "force": "-250 kN", "from": "320 deg", "to": "350 deg"}],
    "inertia": [{"on": "wheel", "value": 0.25}],
    "drive": {
        "on": "motor",
        "motor": MOTOR | {"power": 6000.0, "speed": "1380 rpm", "breakdown_ratio": 2.8, "inertia": 0.016},
    },
    "flywheel": {"on": "wheel", "inertia": 14.0},
}


def reshafted(**changed: dict[str, Any]) -> dict[str, Any]:
    """The press with keys of its shafts changed."""
    return LINE | {"shafts": {name: row | changed.get(name, {}) for name, row in LINE["shafts"].items()}}


def on_motor(table: dict[str, Any], **changed: Any) -> dict[str, Any]:
    return table | {"drive": {"on": "motor", "motor": table["drive"]["motor"] | changed}}


def twelve(on: list[str]) -> dict[str, Any]:
    """Twelve shafts, each on the shaft named; the motor on the last, the flywheel in the middle."""
    shafts: dict[str, Any] = {f"s{k}": {"on": near, "ratio": 1.3, "drag": 0.2} for k, near in enumerate(on)}
    for k, row in enumerate(shafts.values()):
        row |= {"efficiency": 0.98 - 0.005 * k, "slip": "0.4 %" if k % 3 == 0 else 0}
    inertia = [{"on": name, "value": 0.05 / (k + 1)} for k, name in enumerate(shafts)]
    sent = {"on": "s11", "torque": "400 - 3*omega"}
    return LINE | {"shafts": shafts, "inertia": inertia, "drive": sent, "flywheel": {"on": "s5", "inertia": 60.0}}


BALANCED = {"drive": {"on": "motor", "torque": "balance"}, "regime": {"speed": "50 rpm"}}
EXTREMES: dict[str, dict[str, Any]] = {
    "efficiency of 2 %": reshafted(motor={"efficiency": 0.02}) | BALANCED,
    "flywheel behind 20 %": reshafted(wheel={"efficiency": 0.2}) | BALANCED | {"flywheel": {"on": "wheel", "inertia": 90.0}},
    "ratio of 1000": on_motor(
        reshafted(wheel={"ratio": 1000.0, "drag": 0.02}, motor={"ratio": 4.7 * 6 / 1000}), breakdown_ratio=3.0
    )
    | {"flywheel": {"on": "wheel", "inertia": 14.0 * 36 / 1e6}, "inertia": []},
    "ratio of 1/1000": reshafted(wheel={"ratio": 0.001, "drag": 20.0}, motor={"ratio": 4.7 * 6 * 1000})
    | {"flywheel": {"on": "wheel", "inertia": 14.0 * 36e6}},
    "flywheel behind three meshes": LINE
    | {
        "shafts": LINE["shafts"]
        | {
            "a": {"on": "wheel", "ratio": 2.0, "efficiency": 0.9},
            "b": {"on": "a", "ratio": 0.7, "efficiency": 0.85, "slip": "3 %"},
            "c": {"on": "b", "ratio": 1.5, "efficiency": 0.95},
        },
        "flywheel": {"on": "c", "inertia": 3.0},
    },
    "the motor's own inertia": on_motor(LINE, inertia=2.0) | {"flywheel": {"on": "wheel", "inertia": 0.1}},
    "a motor five times as large": on_motor(LINE, power=30e3, speed="980 rpm", poles=6, breakdown_ratio=2.6, inertia=0.48)
    | {"flywheel": {"on": "wheel", "inertia": 3.0}},
    "a load that drives the motor": LINE
    | {"load": [*LINE["load"], {"on": "crank", "torque": 1500.0}], "flywheel": {"on": "wheel", "inertia": 14.0}},
    "twelve in series": twelve(["crank", *(f"s{k}" for k in range(11))]),
    "a bush of twelve": twelve(["crank", "crank", "s0", "s0", "s1", "s1", "s2", "s2", "s3", "s4", "s4", "s9"]),
}


def pairs(sizing: Any, true: Regime) -> Iterator[tuple[str, float, float, float, float]]:
    """Figures of an analysis or a sizing with the true ones, the errors said of them, and what errors are relative to."""
    result = sizing.as_dict()
    error, motion, energy = result["error"], result["simulation"], result["energy"]
    yield "speed", result["speed"], true.speed, error["speed"], true.speed
    for key in ("irregularity", "speed_max", "speed_min", "period"):
        yield key, motion[key], getattr(true, key), error["simulation"], getattr(true, key)
    if result["balance"] is not None:
        yield "balance", result["balance"]["value"], true.unknown, error["balance"], true.unknown
    flow = sizing.power_flow
    scale = flow.scale
    drive = true.rms_torque / true.mean_power * scale if true.mean_power else 1.0
    for key, size in (("mean_power", scale), ("peak_power", scale), ("rms_torque", drive)):
        yield key, energy[key], getattr(true, key), error["energy"], max(abs(getattr(true, key)), size)
    if energy.get("rotor_heat") is not None and energy.get("rotor_heat_share") is not None:
        yield "rotor_heat", energy["rotor_heat"], true.rotor_heat, error["rotor_heat"], true.rotor_heat
    of = {(stream.kind, stream.name): stream.mean for stream in flow.streams}
    for name, passed in true.flows.items():
        lost = of.get(("mesh", f"shafts.{name}"), 0.0) + of.get(("slip", f"shafts.{name}"), 0.0)
        yield f"lost {name}", lost, passed.lost, flow.error, scale
        yield f"slip {name}", of.get(("slip", f"shafts.{name}"), 0.0), passed.slip, flow.error, scale
    for row in flow.shafts:
        if row.on is not None:
            rms = true.flows[row.shaft].rms_torque
            yield f"rms torque {row.shaft}", row.torque_rms, rms, flow.error, max(rms, scale / row.speed)
    yield "in less out less losses", flow.left, 0.0, flow.error, scale


def off(table: dict[str, Any], true: Regime, rtol: float) -> list[tuple[Any, ...]]:
    """Figures, with the true ones, whose errors are above the estimates, or above rtol where that is reported as reached."""
    sizing = flywheel.size(flywheel.load(table | {"accuracy": {"rtol": rtol}}), simulate=False)
    result = []
    for figure, value, exact, said, size in pairs(sizing, true):
        error = abs(value - exact) / max(abs(size), 1e-300)
        if error > said + FLOOR or (sizing.reached and error > rtol + FLOOR):
            result.append((figure, value, exact, said, error))
    return result


TRUE = {  # of the press for an irregularity of 15 %, by `DriveLine(LINE).sized(0.15)`
    "inertia": 17.291497418502406,
    "speed": 5.061360492761736,
    "speed_max": 5.440962529718867,
    "speed_min": 4.681758455804605,
    "period": 1.1978381530536135,
    "mean_power": 2910.043934195682,
    "peak_power": 9289.006905825343,
    "rms_torque": 28.37716062386729,
    "rotor_heat": 249.7916585699949,
}
LOST = {"shafts.wheel": 78.7341244312112, "shafts.motor": 172.2746009043845}  # W in the meshes
SLIP = 58.20087868391371  # W of that in the belt's slip
LARGE = (3.6390128483461517, 3.5615576045248125)  # rad/s, of that press with a motor five times as large, by `DriveLine`
RMS = {"wheel": 305.37618199008307, "motor": 28.40230158002637}  # N m through the meshes, on the shaft's side


def press(**wheel: Any) -> dict[str, Any]:
    return LINE | {"flywheel": {"on": "wheel", **wheel}}


def test_press_of_motor_belt_flywheel_shaft_gear_and_crank() -> None:
    sizing = flywheel.size(flywheel.load(press(irregularity=0.15)), simulate=False)
    result = sizing.as_dict()
    assert sizing.reached
    figures = {"inertia": result["flywheel"]["exact"], "speed": result["speed"], **result["energy"]}
    assert {key: figures[key] for key in TRUE if key in figures} == pytest.approx(
        {key: value for key, value in TRUE.items() if key in figures}, rel=1e-9
    )
    assert (sizing.run.speed_max, sizing.run.speed_min) == pytest.approx((TRUE["speed_max"], TRUE["speed_min"]), rel=1e-9)
    flow = flywheel.power_flow(sizing)
    lost: dict[str, float] = {}
    for stream in flow.streams:
        if stream.kind in ("mesh", "slip"):
            lost[stream.name] = lost.get(stream.name, 0.0) + stream.mean
    assert lost == pytest.approx(LOST, rel=1e-9)
    assert [stream.mean for stream in flow.streams if stream.kind == "slip"] == pytest.approx([SLIP], rel=1e-9)
    assert {row.shaft: row.torque_rms for row in flow.shafts if row.on} == pytest.approx(RMS, rel=1e-9)
    assert abs(flow.left) <= 1e-9 * flow.input


@pytest.mark.slow
def test_digits_of_the_press() -> None:
    result = DriveLine(press(irregularity=0.15)).sized(0.15)
    assert {key: float(getattr(result, key)) for key in TRUE} == pytest.approx(TRUE, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", EXTREMES)
def test_extreme_drive_lines(name: str) -> None:
    table = EXTREMES[name]
    true = DriveLine(table).analysed(table["flywheel"]["inertia"])
    for rtol in RTOLS:
        assert off(table, true, rtol) == []


def test_drag_that_eats_the_motors_torque() -> None:
    shafts = LINE["shafts"]
    table = press(irregularity=0.15) | {"shafts": shafts | {"wheel": shafts["wheel"] | {"drag": 700.0}}}
    with pytest.raises(flywheel.SceneError, match="a drive that cannot carry the mean load"):
        flywheel.size(flywheel.load(table), simulate=False)


LIGHT = {"fly": {"ratio": 4.0, "efficiency": 0.96}, "motor": {"on": "fly", "ratio": 3.0, "efficiency": 0.95}}


def test_motor_that_passes_its_synchronous_speed_behind_two_meshes() -> None:
    table = {
        "shafts": LIGHT,
        "mechanism": {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.45}, "slider": {"mass": 40}},
        "load": [{"on": "slider", "force": "-50*sign(v)"}],
        "inertia": [{"on": "crank", "value": 2.0}],
        "drive": {"on": "motor", "motor": LINE["drive"]["motor"] | {"power": 15e3, "speed": "1440 rpm"}},
        "flywheel": {"on": "fly", "inertia": 0.2},
    }
    line, end = DriveLine(table), 0.15
    result = flywheel.transient(flywheel.load(table), start=13.0, at=0.0, end=end)

    def rates(_: float, state: Any) -> tuple[float, float]:
        phi = state[0] % (2 * pi)
        return state[1], line.solved(*line.shafts_at(phi, 0.5 * state[1] ** 2, 0.0, 0.2, line.active(phi)))[0]

    # steps that mind no reversal: each costs them some digits, as the torque is continuous but its slope is not
    true = solve_ivp(rates, (0.0, end), (0.0, 13.0), method="DOP853", rtol=1e-9, atol=1e-11, max_step=0.005).y[:, -1]
    assert result.motion.trail.stuck is None
    assert result.motion.trail.ends()[:2, -1] == pytest.approx(true, rel=1e-7)


@pytest.mark.slow
def test_lightly_loaded_motor_of_a_press() -> None:
    table = EXTREMES["a motor five times as large"]
    run = flywheel.size(flywheel.load(table), simulate=False).run
    assert (run.speed_max, run.speed_min) == pytest.approx(LARGE, rel=1e-11)
    punch = {"type": "punch", "diameter": 0.06, "thickness": 0.008, "shear_strength": 360e6, "shape": "triangular"}
    hardly = {
        "on": "slider",
        "model": punch | {"overtravel": 0.004},
    }  # it ends steeply, and a mesh reverses there
    friction = {"on": "slider", "model": {"type": "constant", "force": 900.0}}
    press = table | {"load": [hardly, friction], "gravity": {"direction": "0 deg"}}
    assert flywheel.size(flywheel.load(press), simulate=False).reached
