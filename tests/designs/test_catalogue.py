"""Motors of a table: reading with every fault, and the choice with the flywheel that each motor needs."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.designs.catalogue import starting_torque, with_motor
from flywheel.reading.catalogue import parse_catalogue, read_catalogue

TABLE = Path(__file__).parents[2] / "examples" / "drive_lines" / "motors.csv"
HEAD = "name,power (kW),speed (rpm),poles,frequency (Hz),breakdown_ratio,inertia (kg m^2),price (EUR)"
ROWS = """
small,0.37,1400,4,50,2.2,0.0014,140
fair,1.5,1415,4,50,2.8,0.003,230
dear,1.5,1440,4,50,3.0,0.004,300
slow,1.5,940,6,50,2.6,0.005,290
large,2.2,1430,4,50,3,0.008,340
"""
HOT = "hot,0.75,1405,4,50,2.6,0.002,180"
WARM = "warm,1.1,1415,4,50,2.8,0.003,230"
PUNCH = {
    "title": "Punch",
    "shafts": {"motor": {"ratio": 6.0}},
    "inertia": [{"on": "crank", "value": 2.0}],
    "load": [{"on": "crank", "torque": "-250 N m", "from": "40 deg", "to": "100 deg"}],
    "drive": {"on": "motor", "torque": "balance"},
    "regime": {"speed": "220 rpm"},
    "flywheel": {"irregularity": "8 %"},
}


@pytest.fixture(scope="module")
def choice():
    return flywheel.suitable_motors(flywheel.load(PUNCH), parse_catalogue(HEAD + ROWS))


def named(found, name):
    return next(one for one in (*found.suitable, *found.refused) if one.motor.name == name)


def test_those_that_do_come_cheapest_first_and_the_others_have_their_reason(choice):
    assert [one.motor.name for one in choice.suitable] == ["fair", "slow", "dear", "large"]
    assert [one.motor.name for one in choice.refused] == ["small"]
    assert named(choice, "small").reason.startswith("stalls: ")


def test_each_flywheel_is_that_of_its_own_sizing(choice):
    assert {one.binding for one in choice.suitable} == {"irregularity"}
    for one in choice.suitable:
        rated = one.motor.motor.rated.speed
        assert one.ratio == pytest.approx(rated / (220 * np.pi / 30), rel=1e-12)
        own = PUNCH | {"shafts": {"motor": {"ratio": one.ratio}}, "drive": {"on": "motor", "motor": dict(one.motor.table)}}
        alone = flywheel.size(flywheel.load(own), simulate=False)
        assert one.flywheel == pytest.approx(alone.flywheel.exact, rel=1e-9)
        assert one.heat_share == pytest.approx(alone.energy.rotor_heat_share, rel=1e-9)
        assert one.rms_torque_share == pytest.approx(alone.energy.rms_torque / one.motor.motor.rated.torque, rel=1e-9)
        assert max(one.heat_share, one.rms_torque_share) <= 1.0


@pytest.mark.slow
def test_heat_may_ask_for_more_flywheel_than_the_irregularity():
    loose = PUNCH | {"flywheel": {"irregularity": "25 %"}}
    one = flywheel.suitable_motors(flywheel.load(loose), parse_catalogue(f"{HEAD}\n{WARM}")).suitable[0]
    assert one.binding in ("motor_heat", "motor_rms")
    assert max(one.heat_share, one.rms_torque_share) == pytest.approx(1.0, rel=1e-7)
    assert one.irregularity < 0.25
    hot = flywheel.suitable_motors(flywheel.load(PUNCH), parse_catalogue(f"{HEAD}\n{HOT}")).refused[0]
    assert hot.reason.startswith("too much heat: at best ")
    assert "of its rating, at a constant speed" in hot.reason


def test_the_ratio_may_be_the_scenes(choice):
    scene = flywheel.load(PUNCH)
    fixed = flywheel.suitable_motors(scene, parse_catalogue(HEAD + ROWS[ROWS.index("\nlarge") :]), ratio="fixed")
    assert {one.ratio for one in fixed.suitable} == {6.0}
    assert (choice.ratio, fixed.ratio) == ("adjusted", "fixed")
    assert "at its rated point the crank turns at 220 rpm" in choice.notes[0]
    assert "the scene's for every motor" in fixed.notes[0]
    direct = flywheel.load({**PUNCH, "drive": {"torque": "balance"}})
    row = parse_catalogue(HEAD + ROWS).motors[1]
    assert with_motor(direct, row).shafts["motor"] == 6.0
    with pytest.raises(flywheel.SceneError, match="a shaft of the motor's own"):
        flywheel.suitable_motors(direct, parse_catalogue(HEAD + ROWS), ratio="adjusted")


def test_a_motor_that_cannot_start_the_machine():
    held = {**PUNCH, "load": [{"on": "crank", "torque": "-60 N m"}]}
    row = "weak,2.2,1430,4,50,3,0.3,0.008,340\nstrong,2.2,1430,4,50,3,2.2,0.008,350"
    head = HEAD.replace("breakdown_ratio,", "breakdown_ratio,starting_torque,")
    found = flywheel.suitable_motors(flywheel.load(held), parse_catalogue(f"{head}\n{row}"))
    assert [one.motor.name for one in found.suitable] == ["strong"]
    weak, rated = found.refused[0], 2200 / (1430 * np.pi / 30)
    assert starting_torque(weak.motor.motor) == pytest.approx(0.3 * rated, rel=1e-12)
    asked = 60 / (1430 / 220)
    assert weak.reason == (
        f"cannot start the machine: starting torque {0.3 * rated:.4g} N m, "
        f"the load at rest at 0 deg is {asked:.4g} N m on its shaft"
    )


@pytest.mark.slow
def test_given_flywheels_and_limits_of_the_scene():
    given = flywheel.load({**PUNCH, "flywheel": {"inertia": 3.0}})
    found = flywheel.suitable_motors(given, parse_catalogue(HEAD + ROWS + HOT))
    assert {one.flywheel for one in found.suitable} == {3.0}
    assert "of its rating" in named(found, "hot").reason
    motor = {"on": "motor", "motor": dict(parse_catalogue(HEAD + ROWS).motors[1].table)}
    limited = {**PUNCH, "drive": motor, "flywheel": {"limits": {"irregularity": 0.08, "motor_torque": 1.1}}}
    table = parse_catalogue(HEAD + "\n" + ROWS.splitlines()[5])
    one = flywheel.suitable_motors(flywheel.load(limited), table).suitable[0]
    assert (one.binding, one.suits) == ("motor_torque", True)


def test_scenes_that_no_motor_can_be_chosen_for():
    free = {key: value for key, value in PUNCH.items() if key not in ("drive", "flywheel")}
    with pytest.raises(flywheel.SceneError) as caught:
        flywheel.suitable_motors(flywheel.load(free | {"load": PUNCH["load"]}), parse_catalogue(HEAD + ROWS))
    assert [fault.path for fault in caught.value.faults] == ["drive", "flywheel"]


def test_an_interruption_keeps_what_is_finished(monkeypatch):
    from flywheel.designs import catalogue

    own = catalogue._choice

    def interrupted(scene, row, *rest):
        if row.name == "fair":
            raise KeyboardInterrupt
        return own(scene, row, *rest)

    monkeypatch.setattr(catalogue, "_choice", interrupted)
    found = flywheel.suitable_motors(flywheel.load(PUNCH), parse_catalogue(HEAD + ROWS))
    assert (len(found.refused), found.missing) == (1, 4)


# -- the table ---------------------------------------------------------------------------------------------------------

GOOD = "A,1.5,1420,4,50,2.8,0.004,210"


@pytest.mark.parametrize(
    ("row", "told"),
    [
        ("B,,1420,4,50,2.8,0.004,210", "line 3, power: found an empty cell"),
        (",1.5,1420,4,50,2.8,0.004,210", "line 3, name: found an empty cell"),
        ("B,1.5,1420,6,50,2.8,0.004,210", "line 3, speed: found 1420 rpm, a slip of -0.42"),
        ("B,1.5,fast,4,50,2.8,0.004,210", 'line 3, speed: found "fast", expected a number in rpm'),
        ("B,1.5 kW,1420,4,50,2.8,0.004,210", 'line 3, power: found "1.5 kW", expected a number in kW'),
        ("B,1,5,1420,4,50,2.8,0.004,210", "line 3: found 9 cells, expected 8"),
        ("B,1.5,1420,4,50,2.8", "line 3: found 6 cells, expected 8"),
        ('B,"1,5",1420,4,50,2.8,0.004,210', "write 1.5, not 1,5"),
        ("B,1.5,1420,3,50,2.8,0.004,210", "line 3, poles: "),
        ("B,1.5,1420,4,50,0.8,0.004,210", "line 3, breakdown_ratio: "),
        ("B,1.5,1420,4,50,2.8,-1,210", "line 3, inertia: "),
        ("B,1.5,1420,4,50,2.8,0.004,cheap", "line 3, price: "),
        ("B,1.5,1420,4,50,2.8,0.004,1.250.5", "line 3, price: "),
        ("B,1.5,1420,4,50,2.8,0.004,210 USD", "line 3, price: found 210 USD in EUR and USD"),
        ("A,1.5,1420,4,50,2.8,0.004,210", 'line 3, name: found "A", expected a name of its own; line 2 has it'),
    ],
)
def test_faults_of_rows_have_their_line_and_column(row, told):
    with pytest.raises(flywheel.SceneError) as caught:
        parse_catalogue(f"{HEAD}\n{GOOD}\n{row}", "m.csv")
    assert len(caught.value.faults) == 1
    assert f"m.csv {told}" in str(caught.value) or told in str(caught.value)
    left = parse_catalogue(f"{HEAD}\n{GOOD}\n{row}", "m.csv", skip_faulty=True)
    assert ([motor.name for motor in left.motors], len(left.faults)) == (["A"], 1)


@pytest.mark.parametrize(
    ("head", "told"),
    [
        (HEAD.replace("breakdown_ratio", "brekdown_ratio"), 'did you mean "breakdown_ratio"?'),
        (HEAD.replace("speed (rpm),", ""), "no column speed"),
        (HEAD.replace("poles,", ""), "no column poles, expected poles and frequency, or synchronous_speed"),
        (HEAD.replace("(kW)", "(A)"), "a unit of power"),
        (HEAD + ",price (EUR)", "a second column price"),
        (HEAD.replace("name,", ""), "no column name"),
    ],
)
def test_faults_of_the_header(head, told):
    with pytest.raises(flywheel.SceneError) as caught:
        parse_catalogue(f"{head}\n{GOOD}", "m.csv", skip_faulty=True)
    assert told in str(caught.value)


def test_units_currencies_and_fields_in_other_forms():
    text = "Name;Power;Speed [rpm];Synchronous speed (rpm);Breakdown ratio;Price;frame\nA;1.5 kW;1420;1500;2.8;210 EUR;90L"
    found = parse_catalogue(text)
    motor = found.motors[0]
    assert (motor.motor.poles, motor.motor.frequency, motor.price, motor.currency) == (4, 50.0, 210.0, "EUR")
    assert found.unused == ("frame",)
    assert parse_catalogue(text.replace("1500", "1800").replace("1420", "1720")).motors[0].motor.frequency == 60.0
    with pytest.raises(flywheel.SceneError, match="1400 rpm, expected the speed of a field at 50 Hz or 60 Hz"):
        parse_catalogue(text.replace("1500", "1400"))
    with pytest.raises(flywheel.SceneError, match=r"1\.5 without a unit"):
        parse_catalogue(text.replace("1.5 kW", "1.5"))
    with pytest.raises(flywheel.SceneError, match='"EUR" and "USD", expected one currency'):
        parse_catalogue(text + "\nB;1.5 kW;1420;1500;2.8;210 USD;90L")


def test_the_table_of_the_examples_is_good():
    found = read_catalogue(TABLE)
    powers = sorted({motor.motor.power for motor in found.motors})
    assert (len(found.motors), powers[0], powers[-1], found.unused) == (38, 550.0, 90000.0, ())
    assert {motor.motor.poles for motor in found.motors} == {4, 6}
    with pytest.raises(flywheel.SceneError, match=r'did you mean "motors\.csv"'):
        read_catalogue(TABLE.with_name("motor.csv"))


# -- the command -------------------------------------------------------------------------------------------------------


def test_the_command_prints_a_table_json_and_csv(tmp_path):
    scene, table = tmp_path / "punch.toml", tmp_path / "m.csv"
    scene.write_text(
        "shafts.motor.ratio = 6\nregime.speed = '220 rpm'\nflywheel.irregularity = '8 %'\n"
        "drive = {on = 'motor', torque = 'balance'}\ninertia = [{on = 'crank', value = 2}]\n"
        "load = [{on = 'crank', torque = '-250 N m', from = '40 deg', to = '100 deg'}]\n"
    )
    table.write_text(HEAD + "\n" + "\n".join(ROWS.split()[::2]) + "\n")

    def run(*options):
        return CliRunner().invoke(main, ["motor", str(scene), "--catalogue", str(table), *options])

    text = run()
    assert text.exit_code == 0
    assert text.stdout.startswith("Motors that do: 2 of 3\n")
    assert max(map(len, text.stdout.splitlines())) <= 80
    found = json.loads(run("--json").stdout)
    assert [motor["name"] for motor in found["motors"]] == ["dear", "large", "small"]
    assert [motor["suits"] for motor in found["motors"]] == [True, True, False]
    lines = run("--csv").stdout.splitlines()
    assert lines[0].startswith("name,line,price,currency,power [W]")
    assert len(lines) == 4
    table.write_text(HEAD + "\n" + ROWS.split()[0] + "\n")
    alone = run()
    assert (alone.exit_code, alone.stderr.splitlines()[-1]) == (1, "no motor of the table does")
    table.write_text(HEAD + "\nA,x,1,2,3\nB,y,1420,4,50,2.8,0.004,210\n")
    faulty = run()
    assert (faulty.exit_code, faulty.stdout) == (1, "")
    assert len(faulty.stderr.splitlines()) == 2
    assert "--catalogue" in CliRunner().invoke(main, ["motor", str(scene)]).stderr
