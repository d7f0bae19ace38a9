"""Duties: the flywheel of the hardest phase, torque and heat over all phases, against integrals by hand and handbooks."""

import numpy as np
import pytest
from flywheel.duty import Stretch, mean, root_mean_square
from scipy.integrate import solve_ivp
from scipy.optimize import newton

import flywheel

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


def test_every_phase_and_the_whole_duty_against_integrals_by_hand(punch):
    found, inertia = punch.duty, punch.flywheel.exact
    rows = []
    for row, pulse in zip(found.phases[:3], (250.0, 140.0, 25.0), strict=True):
        period, square, heat, work = integrals(pulse, inertia)
        duration = 40 * period if row.name == "thin sheet" else row.duration
        assert row.duration == pytest.approx(duration, rel=1e-9)
        assert row.rms_torque == pytest.approx(np.sqrt(square / period), rel=1e-9)
        assert row.heat == pytest.approx(heat / period, rel=1e-8)
        rows.append((duration, square / period, heat / period, work / period))
    time, square, heat, power = np.array(rows).T
    cooled = time.sum() + 0.25 * 45.0
    assert found.rms_torque == pytest.approx(np.sqrt(time @ square / cooled), rel=1e-9)
    assert found.heat == pytest.approx(time @ heat / cooled, rel=1e-8)
    assert found.mean_power == pytest.approx(time @ power / (time.sum() + 45.0), rel=1e-9)
    assert found.cyclic_duration_factor == pytest.approx((time.sum()) / (time.sum() + 45.0), rel=1e-12)
    rated = 1100.0 / (1415 * np.pi / 30)
    assert found.rms_torque_share == pytest.approx(found.rms_torque / rated, rel=1e-12)


def test_the_flywheel_is_that_of_the_hardest_phase(punch):
    alone = [flywheel.size(phase.scene, simulate=False).flywheel.exact for phase in scene(*PHASES).duty[:2]]
    assert punch.flywheel.exact == max(alone) > 1.1 * min(alone)
    assert punch.duty.governing == "punching"
    assert punch.duty.phases[0].irregularity == pytest.approx(0.08, rel=1e-9)
    assert all(row.irregularity < 0.08 for row in punch.duty.phases[1:3])


@pytest.mark.slow
def test_limits_of_heat_and_rms_torque_are_kept_over_the_whole_duty(punch):
    def limited(**limits):
        return flywheel.size(scene(*PHASES, flywheel={"limits": {"irregularity": 0.08} | limits}), simulate=False)

    loose, tight = limited(motor_heat=0.62), limited(motor_rms=0.7, motor_torque=1.5)
    assert loose.flywheel.exact == pytest.approx(punch.flywheel.exact, rel=1e-12)
    assert (loose.binding, tight.binding) == ("irregularity", "motor_rms")
    assert loose.limits["motor_heat"].alone < loose.flywheel.exact < tight.flywheel.exact
    given = scene(*PHASES, flywheel={"inertia": tight.flywheel.exact})
    assert flywheel.size(given, simulate=False).duty.rms_torque_share == pytest.approx(0.7, rel=1e-9)
    lighter = scene(*PHASES, flywheel={"inertia": 0.999 * tight.flywheel.exact})
    assert flywheel.size(lighter, simulate=False).duty.rms_torque_share > 0.7
    assert tight.limits["motor_torque"].reached == pytest.approx(1.48151, rel=1e-5)
    with pytest.raises(flywheel.SceneError, match=r"30 %, which no flywheel reaches over the duty: at best, .* it is 41\.8"):
        limited(motor_heat=0.3)
    with pytest.raises(flywheel.SceneError, match="expected an irregularity beside them"):
        flywheel.size(scene(*PHASES, flywheel={"limits": {"motor_heat": 0.9}}), simulate=False)


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
    found = flywheel.size(scene(*phases), simulate=False)
    motor = flywheel.motors.Induction(
        power=1100.0, speed=1415 * np.pi / 30, poles=4, frequency=50.0, breakdown_ratio=2.4, inertia=0.003
    )
    whole = 2.0 + 0.003 * 6.5**2 + found.flywheel.exact

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
    share = max(row.settling / row.duration for row in found.duty.phases)
    assert 0.05 < share < 0.2
    assert 0.0 < found.duty.heat / (state[2] / state[1]) - 1.0 < 0.25 * share
    assert sum("between phases the machine runs otherwise" in told for told in found.messages) == 2


def test_types_and_duration_factor():
    drive = {"drive": {"torque": "balance"}, "regime": {"speed": "60 rpm"}, "flywheel": {"inertia": 500.0}}

    def told(*phases):
        found = flywheel.size(scene(*phases, **drive), simulate=False).duty
        return found.type, round(found.cyclic_duration_factor, 9)

    load, rest, idle = {"duration": 60}, {"duration": 90, "rest": True}, {"duration": 40, "loads": 0}
    assert [told(load), told(load, rest), told(load, idle)] == [("S1", 1.0), ("S3", 0.4), ("S6", 0.6)]
    assert told(load, idle, rest) == (None, round(60 / 190, 9))


@pytest.mark.slow
def test_starts_bring_their_own_heat_and_torque():
    idle, rest = {"duration": 60, "loads": "10 %"}, {"duration": 30, "rest": True}
    plain = flywheel.size(scene(idle, rest), simulate=False)
    found = flywheel.size(scene(idle | {"starts": 2}, rest), simulate=False)
    low = PUNCH | {"load": [PULSE | {"factor": 0.1}], "flywheel": {"inertia": found.flywheel.exact}}
    run = flywheel.run_up(flywheel.load(low))
    row, steady = found.duty.phases[0], plain.duty.phases[0]
    assert (found.duty.type, row.starts) == ("S4", 2)
    assert row.start_heat == pytest.approx(run.energy.rotor_heat, rel=1e-9)
    share = 1 - 2 * run.time / 60
    assert row.heat == pytest.approx(steady.heat * share + 2 * run.energy.rotor_heat / 60, rel=1e-9)
    t, owners = np.linspace(0, run.time, 200_001), None
    torque = flywheel.transients.sampled(run.motion.trail, t, owners).drive
    square = np.trapezoid(torque**2, t)
    assert row.rms_torque**2 == pytest.approx(steady.rms_torque**2 * share + 2 * square / 60, rel=1e-7)
    assert found.duty.heat > plain.duty.heat
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
    found = scene({"duration": 60}, {"duration": 40, "loads": 0}, shafts=dragged)
    assert [load.path for load in found.duty[1].scene.loads] == ["load[0]", "shafts.motor.drag"]


def test_json_and_pages(punch):
    found = punch.as_dict()
    assert found["duty"]["phases"][1]["name"] == "thin sheet"
    assert set(found["error"]["duty"]) >= {"period", "rms_torque", "heat", "mean_power"}
    assert all(0.0 <= error < 1e-7 for error in found["error"]["duty"].values())
    from flywheel.tables import answers, sizing

    assert "hardest for the\n" in answers.text(punch)
    assert "thin sheet" in sizing.text(punch)


def test_the_report_has_a_section_of_the_duty(punch):
    from flywheel.report import drive, regime

    section = drive.duty(regime.Known(punch))
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
