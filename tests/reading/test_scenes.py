"""Scenes read: what is understood, what is refused and where."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel import Scene, SceneError, load
from flywheel.reading.fields import Faults, read_quantity
from flywheel.reading.mechanisms import driver_slides
from flywheel.reading.scenes import build_scene, parse_scene, read_scene
from flywheel.scene.scene import LEVELS, Areas, level
from tests import regimes, scenes
from tests.reading.test_schema import KEYS

# Scenes as a whole: what a good one becomes, and every fault of a bad one at once, each in its place.


ROTOR = """
[regime]
speed = "300 rpm"
[flywheel]
irregularity = 0.02
"""


def faults(text: str, **kwargs) -> dict[str, str]:
    """Every fault of a scene by its path."""
    with pytest.raises(SceneError) as caught:
        parse_scene(text, **kwargs)
    return {fault.path: str(fault) for fault in caught.value.faults}


def test_a_rotor_takes_every_default():
    scene = parse_scene(ROTOR)
    assert scene == Scene(speed=10 * math.pi, irregularity=0.02)
    assert (scene.cycle, scene.rtol, scene.closure) == (2 * math.pi, 1e-9, 1e-9)


def test_everything_that_stands_alone_is_read():
    scene = parse_scene("""
        title = "Drill"
        source = "p. 12"
        [shafts]
        motor.ratio = 5
        [gravity]
        g = "9.81 m/s^2"
        direction = "0 deg"
        [drive]
        on = "motor"
        torque = "balance"
        [regime]
        on = "motor"
        speed = "1500 rpm"
        cycle = "720 deg"
        [flywheel]
        on = "motor"
        inertia = "3 kg m^2"
        [accuracy]
        rtol = 1e-6
        closure = "1 %"
    """)
    assert (scene.title, scene.source) == ("Drill", "p. 12")
    assert scene.shafts == {"crank": 1.0, "motor": 5.0}
    assert scene.gravity == (9.81, 0.0)
    assert scene.speed == pytest.approx(10 * math.pi, rel=1e-15)
    assert scene.cycle == 4 * math.pi
    assert (scene.flywheel_on, scene.inertia, scene.irregularity, scene.flywheel_ratio) == ("motor", 3.0, None, 5.0)
    assert (scene.rtol, scene.closure) == (1e-6, 0.01)
    assert scene.drive is not None
    assert (scene.drive.on, scene.drive.law, scene.drive.every) == ("motor", None, 4 * math.pi)
    assert scene.unknown == "drive"


@pytest.mark.parametrize(
    ("direction", "expected"),
    [("", (0.0, -9.80665)), ("direction = '180 deg'", (-9.80665, 0.0)), ("direction = '450 deg'", (0.0, 9.80665))],
)
def test_gravity_is_exact_along_the_axes(direction, expected):
    assert parse_scene(f"[gravity]\n{direction}{ROTOR}").gravity == expected


def test_gravity_at_an_angle():
    gx, gy = parse_scene(f"gravity = {{g = 10, direction = '-60 deg'}}{ROTOR}").gravity
    assert (gx, gy) == pytest.approx((5.0, -5 * math.sqrt(3)), rel=1e-15)


def test_a_bare_cycle_of_ten_digits_is_put_onto_whole_turns():
    assert parse_scene("regime = {speed = 1, cycle = 12.5663706144}\nflywheel.inertia = 1").cycle == 4 * math.pi


BARE_ANGLES = """
mechanism = {{type = "{type}", phase = {phase}, {geometry}}}
gravity.direction = {direction}
regime = {{speed = 1, cycle = {cycle}}}
flywheel.inertia = 1
[[load]]
on = "crank"
torque = 1
from = {start}
to = 1
every = {every}
"""
WITHIN = {"type": "scotch-yoke", "geometry": "crank.length = 1", "cycle": '"360 deg"', "every": '"360 deg"'}
WITHIN |= {"phase": 3, "direction": -1, "start": 0}


@pytest.mark.parametrize(
    ("given", "path", "advice"),
    [
        ({"phase": 80}, "mechanism.phase", 'write "80 deg"'),
        ({"phase": -6.3}, "mechanism.phase", 'write "-6.3 deg"'),
        ({"phase": '"80"'}, "mechanism.phase", 'write "80 deg"'),
        ({"direction": -90}, "gravity.direction", 'write "-90 deg"'),
        ({"start": 340.5}, "load[0].from", 'write "340.5 deg"'),
        ({"every": 180}, "load[0].every", 'write "180 deg"'),
        ({"every": 6.2832}, "load[0].every", 'write "360 deg"'),
        ({"phase": 13, "cycle": '"720 deg"', "every": '"720 deg"'}, "mechanism.phase", 'write "13 deg"'),
        ({"geometry": "crank.length = 1, yoke.direction = 180"}, "mechanism.yoke.direction", 'write "180 deg"'),
        ({"geometry": "crank.length = 1, crank.com_angle = 45"}, "mechanism.crank.com_angle", 'write "45 deg"'),
        ({"cycle": 720}, "mechanism.shaft", 'write regime.cycle = "720 deg"'),
    ],
)
def test_an_angle_without_a_unit_beyond_a_turn_is_refused(given, path, advice):
    assert advice in faults(BARE_ANGLES.format(**WITHIN | given))[path]


@pytest.mark.parametrize(
    "given", [{}, {"phase": '"80 rad"'}, {"phase": math.tau}, {"cycle": 4 * math.pi, "phase": 12.5, "every": 4 * math.pi}]
)
def test_an_angle_within_a_turn_or_the_cycle_needs_no_unit(given):
    parse_scene(BARE_ANGLES.format(**WITHIN | given))


def test_every_angle_of_the_format_is_refused_alike():
    for key in KEYS:
        if "angle" in key.kind.split(" | "):
            result = Faults()
            read_quantity(80, "angle", key, "place", result)
            assert [fault.path for fault in result] == ([] if key.many_turns else ["place"]), key


def test_a_table_in_degrees_without_its_unit_is_told():
    text = f"{ROTOR}[[load]]\non = 'crank'\ntable = {{angle = [0, 90, 360], value = [0, 1, 0]}}"
    assert 'write angle_unit = "deg"' in faults(text)["load[0].table"]


def test_numpy_numbers_and_arrays_are_as_good_as_plain_ones():
    scene = build_scene(
        {
            "regime": {"speed": np.float64(10.0)},
            "flywheel": {"inertia": np.float32(0.5)},
            "load": [{"on": "crank", "table": {"angle": np.linspace(0, 2 * np.pi, 5), "value": np.array([0, 1, 2, 1, 0])}}],
        }
    )
    assert (scene.speed, scene.inertia) == (10.0, 0.5)
    assert scene.loads[0].law.value.tolist() == [0.0, 1.0, 2.0, 1.0, 0.0]


def test_every_fault_is_reported_at_once_with_its_path():
    result = faults("""
        titel = "x"
        [shafts.motor]
        ratio = -5
        [mechanism]
        type = "slider-crank"
        shaft = "moter"
        crank.lenght = 0.1
        rod.length = "0,4 m"
        slider.mass = -3
        [[load]]
        on = "slidr"
        force = "1000 sin(phi)"
        [[load]]
        on = "crank"
        torque = "-5 kN"
        from = "10 deg"
        [drive]
        on = "mtor"
        torque = true
        [regime]
        speed = "5 Hz"
        [flywheel]
        irregularity = 2
        inertia = 3
        [accuracy]
        rtol = 0
    """)
    assert set(result) == {
        "titel",
        "shafts.motor.ratio",
        "mechanism.shaft",
        "mechanism.crank.lenght",
        "mechanism.rod.length",
        "mechanism.slider.mass",
        "load[0].on",
        "load[0].force",
        "load[1].torque",
        "load[1].to",
        "drive.on",
        "drive.torque",
        "regime.speed",
        "flywheel",
        "flywheel.irregularity",
        "accuracy.rtol",
    }
    assert 'did you mean "title"' in result["titel"]
    assert 'did you mean "length"' in result["mechanism.crank.lenght"]
    assert 'did you mean "motor"' in result["mechanism.shaft"]
    assert "write 0.4, not 0,4" in result["mechanism.rod.length"]
    assert "a product is written *: 1000*sin" in result["load[0].force"]
    assert "rev/s or rad/s" in result["regime.speed"]


@pytest.mark.parametrize("text", ["", "# nothing but a comment\n"])
def test_an_empty_scene_is_a_fault(text):
    assert list(faults(text)) == ["scene"]


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("regime = 3", "regime"),
        ("regime = [1]", "regime"),
        ("[[regime]]\nspeed = 1", "regime"),
        ("flywheel = 'big'", "flywheel"),
        ("shafts = 3", "shafts"),
        ("shafts.a = 3", "shafts.a"),
        ("shafts.'a b'.ratio = 3", 'shafts."a b"'),
        ("shafts.crank.ratio = 2", "shafts.crank.ratio"),
        ("shafts.a = {}", "shafts.a.ratio"),
        ("shafts.a = {ratio = 2, stiffness = 0}", "shafts.a.stiffness"),
        ("shafts.a = {ratio = 2, stiffness = '3 N/m'}", "shafts.a.stiffness"),
        ("shafts.a = {ratio = 2, damping = 3}", "shafts.a.damping"),
        ("shafts.a = {ratio = 2, stiffness = 3, damping = -1}", "shafts.a.damping"),
        ("shafts.crank = {ratio = 1, stiffness = 3}", "shafts.crank"),
        ("shafts.a = {ratio = 2, efficiency = 0}", "shafts.a.efficiency"),
        ("shafts.a = {ratio = 2, efficiency = 1.01}", "shafts.a.efficiency"),
        ("shafts.a = {ratio = 2, efficiency = '98 N'}", "shafts.a.efficiency"),
        ("shafts.a = {ratio = 2, efficiency = 0.9, stiffness = 3}", "shafts.a.efficiency"),
        ("shafts.crank = {ratio = 1, efficiency = 0.9}", "shafts.crank.efficiency"),
        ("parameters = []", "parameters"),
        ("parameters.phi = 3", "parameters.phi"),
        ("parameters.sin = 3", "parameters.sin"),
        ("parameters.lambda = 3", "parameters.lambda"),
        ("parameters.'2a' = 3", "parameters.2a"),
        ("parameters.F = 'balanced'", "parameters.F"),
        ("parameters.F = 'balance'", "parameters.F"),
        ("mechanism = 3", "mechanism"),
        ("mechanism = [3]", "mechanism[0]"),
        ("[mechanism]", "mechanism.type"),
        ("mechanism.type = 'slidercrank'", "mechanism.type"),
        ("mechanism = {type = 'slidercrank', name = 3}", "mechanism.name"),
        ("mechanism = {type = 'slidercrank', shaft = 'moter'}", "mechanism.shaft"),
        ("mechanism = {phase = '3 m'}", "mechanism.phase"),
        ("mechanism.type = 'linkage'", "mechanism.driver"),
        ("load = 3", "load"),
        ("load = [3]", "load[0]"),
        ("[load]\non = 'crank'\ntorque = 3", "load"),
        ("[damper]\non = 'crank'\ncoefficient = 3", "damper"),
        ("gravity = true", "gravity"),
        ("gravity.g = -3", "gravity.g"),
        ("title = 3", "title"),
        ("drive = {}", "drive.torque"),
        ("drive = {torque = 'omegas'}", "drive.torque"),
        ("accuracy.rtol = 0.5", "accuracy.rtol"),
        ("accuracy.closure = -1", "accuracy.closure"),
        ("areas = {values = 3}", "areas.values"),
        ("areas = {values = [1]}", "areas.values"),
        ("areas = {values = [1, 'a', -1]}", "areas.values[1]"),
        ("areas = {values = [1, nan]}", "areas.values[1]"),
        ("areas = {values = [100, -94]}", "areas.values"),
        ("areas = {scale = 1}", "areas.values"),
        ("areas = {values = [1, -1], scale = 0}", "areas.scale"),
    ],
)
def test_each_part_refuses_what_does_not_fit(text, path):
    rest = "" if text.startswith(("regime", "[[regime", "flywheel")) else ROTOR
    assert path in faults(text + "\n" + rest)


@pytest.mark.parametrize(
    "text",
    [
        "drive.torque = '30 - omega'",
        "damper = [{on = 'crank', coefficient = 3}]",
        "load = [{on = 'crank', torque = '-omega*abs(omega)'}]",
        "drive.motor = {type = 'line', starting_torque = 30, slope = 2}",
    ],
)
def test_torques_that_depend_on_speed_make_do_without_one(text):
    scene = parse_scene(f"{text}\nflywheel.inertia = 3")
    assert (scene.speed, scene.cycle) == (None, 2 * math.pi)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("drive.torque = 30", "torques that depend on speed, which fix it"),
        ("load = [{on = 'crank', torque = '3*t'}]", "torques that depend on speed, which fix it"),
        ("load = [{on = 'crank', torque = '-omega'}]\ndrive.torque = 'balance'", 'with a "balance"'),
        ("areas.values = [1, -1]", "a speed such as"),
    ],
)
def test_nothing_else_does_to_size_a_flywheel(text, hint):
    scene = parse_scene(f"{text}\nflywheel.inertia = 3")
    assert (scene.speed, scene.inertia) == (None, 3.0)
    with pytest.raises(SceneError) as caught:
        flywheel.size(scene)
    (fault,) = caught.value.faults
    assert fault.path == "regime.speed"
    assert hint in str(fault)


def test_what_a_sizing_lacks_is_told_at_once():
    with pytest.raises(SceneError) as caught:
        flywheel.size(parse_scene("inertia = [{on = 'crank', value = 1}]"))
    assert [str(fault) for fault in caught.value.faults] == [
        "flywheel: found nothing, expected a table with irregularity or inertia",
        'regime.speed: found nothing, expected a speed such as "210 rpm" or a bare number in rad/s; '
        "or torques that depend on speed, which fix it",
    ]


def test_efficiencies_are_of_meshes_that_lose_something():
    scene = parse_scene("shafts.a = {ratio = 2, efficiency = '94 %'}\nshafts.b = {ratio = 3, efficiency = 1}\n" + ROTOR)
    assert (scene.efficiencies, scene.compliances) == ({"a": 0.94}, {})


@pytest.mark.parametrize("text", ["flywheel = {}", "flywheel = {on = 'crank'}"])
def test_a_flywheel_has_one_figure(text):
    assert "flywheel" in faults(text + "\n[regime]\nspeed = 1")


@pytest.mark.parametrize("text", ["", "title = 'x'", "regime.speed = 1", "gravity.g = 9.8", "accuracy.rtol = 1e-6"])
def test_a_scene_has_a_machine(text):
    result = "no machine" if text else "nothing"
    assert faults(text)["scene"].startswith(f"scene: found {result}, expected a machine; one of mechanism, shafts, ")


@pytest.mark.parametrize("irregularity", [0, 2, -0.1, "250 %"])
def test_irregularity_lies_between_0_and_2(irregularity):
    with pytest.raises(SceneError, match=r"flywheel\.irregularity"):
        build_scene({"regime": {"speed": 1}, "flywheel": {"irregularity": irregularity}})


def test_areas_stand_alone():
    scene = parse_scene(f"[areas]\nvalues = [10, -4.8, -5]\nscale = '2 kJ'{ROTOR}")
    assert scene.areas == Areas((10.0, -4.8, -5.0), 2000.0)
    extra = "mechanism.type = 'law'\ndrive.torque = 1\nload = []\nspring = []\ninertia = []\ngravity = {}\n"
    result = faults(extra + f"[areas]\nvalues = [1, -1]{ROTOR}")
    assert {"mechanism", "drive", "load", "spring", "inertia", "gravity"} <= set(result)


def test_at_most_one_balance():
    result = faults(
        "parameters = {F = 'balance', G = 'balance'}\ndrive.torque = 'balance'\n"
        f"[[load]]\non = 'crank'\ntorque = 'F + G'{ROTOR}"
    )
    assert set(result) == {"parameters.F", "parameters.G"}


def test_a_balance_parameter_must_be_used_and_have_its_own_name():
    assert "nothing uses" in faults(f"parameters.F = 'balance'{ROTOR}")["parameters.F"]
    named = f"parameters.drive = 'balance'\n[[load]]\non = 'crank'\ntorque = 'drive'{ROTOR}"
    assert "parameters.drive" in faults(named)


def test_parameters_are_si_and_the_balance_is_not_among_them():
    scene = parse_scene(
        f"parameters = {{F = 'balance', k = '2 kN', n = 3}}\n[[load]]\non = 'crank'\ntorque = 'F*k - n'{ROTOR}"
    )
    assert scene.parameters == {"k": 2000.0, "n": 3.0}
    assert scene.unknown == "F"
    assert scene.loads[0].law.names == {"F", "k", "n"}


def test_only_the_drive_and_parameters_can_be_the_balance():
    assert "only the drive" in faults(f"[[load]]\non = 'crank'\ntorque = 'balance'{ROTOR}")["load[0].torque"]


# -- files and texts ---------------------------------------------------------------------------------------------------


def test_a_file_is_read_and_remembered(tmp_path):
    file = tmp_path / "rotor.toml"
    file.write_text(ROTOR, encoding="utf-8-sig")
    assert read_scene(file).file == file
    assert read_scene(str(file)).speed == 10 * math.pi


def test_load_takes_a_path_a_text_or_a_mapping(tmp_path):
    file = tmp_path / "rotor.toml"
    file.write_text(ROTOR)
    assert load(file).speed == load(str(file)).speed == load(ROTOR).speed == load(tomllib.loads(ROTOR)).speed


def one_fault(call, argument) -> str:
    with pytest.raises(SceneError) as caught:
        call(argument)
    assert len(caught.value.faults) == 1
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_files_that_cannot_be_read_give_one_line(tmp_path):
    assert "no such file" in one_fault(read_scene, tmp_path / "missing.toml")
    (tmp_path / "press.toml").write_text(ROTOR)
    for read in (read_scene, flywheel.load, flywheel.load_linkage):
        assert 'no such file, expected a scene in a TOML file; did you mean "press.toml"?' in one_fault(
            read, tmp_path / "pres.toml"
        )
    assert "a folder" in one_fault(read_scene, tmp_path)
    assert "a device" in one_fault(read_scene, "/dev/null")
    assert one_fault(read_scene, "a\0b.toml")
    assert one_fault(read_scene, "a\nb")
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * (2**20 + 1))
    assert "1 MiB" in one_fault(read_scene, large)
    foreign = tmp_path / "foreign.toml"
    foreign.write_bytes("\n\ntitle = 'Presión'".encode("latin-1"))
    assert "line 3" in one_fault(read_scene, foreign)
    foreign.write_bytes(ROTOR.encode("utf-16"))
    assert "UTF-8" in one_fault(read_scene, foreign)
    for encoding in ("utf-16", "utf-16-le", "utf-16-be"):
        foreign.write_bytes('title = "Press"'.encode(encoding))
        assert "found a text in UTF-16, expected text in UTF-8; save" in one_fault(read_scene, foreign)
    foreign.write_bytes(b"\x7fELF\x02\0\0\0")
    assert "found a file that is not text" in one_fault(read_scene, foreign)


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("a = 1\nb = 2 3", "line 2, column 5"),
        ("a = [", "line 1, column 5"),
        ("a = 1\na = 2", "line 1 already"),
        ("a = '\0'", "line 1"),
        ("a = " + "9" * 5000, "number"),
        ("a = " + "[" * 100_000, "nested"),
        ("a = " + "{a = " * 100_000, "nested"),
        ("a." * 100_000 + "a = 1", "parts"),
        ("[" + "a . " * 100_000 + "a]", "parts"),
        ("x = {" + '"a".' * 50_000 + "a = 1}", "parts"),
        ("#" * (2**20 + 1), "characters"),
    ],
)
def test_texts_that_are_no_toml_give_one_line(text, hint):
    assert hint in one_fault(parse_scene, text)


def test_dots_in_texts_comments_and_numbers_are_no_keys():
    text = "title = '''\n" + "a." * 99 + "'''\nsource = \"" + "b." * 99 + '" # ' + "c." * 99 + ROTOR
    assert parse_scene(text).source == "b." * 99


@pytest.mark.parametrize("mapping", [None, 3, [], {1: 2}, "text", {"a" * 3: {}}])
def test_mappings_that_are_no_scene(mapping):
    with pytest.raises(SceneError):
        build_scene(mapping)


def test_floods_of_tables_are_refused():
    many = [{"on": "crank", "torque": 1.0}] * 1001
    with pytest.raises(SceneError, match="at most 1000"):
        build_scene({"load": many, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    with pytest.raises(SceneError, match="at most 100"):
        build_scene({"mechanism": [{}] * 101, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    with pytest.raises(SceneError, match="at most 1000"):
        build_scene({"parameters": {f"p{i}": 1 for i in range(1001)}})


def test_csv_files_are_looked_for_beside_the_scene(tmp_path):
    (tmp_path / "moment.csv").write_text("0,1\n360,2\n")
    text = f"[[load]]\non = 'crank'\ntable = {{file = 'moment.csv', angle_unit = 'deg'}}{ROTOR}"
    (tmp_path / "scene.toml").write_text(text)
    assert read_scene(tmp_path / "scene.toml").loads[0].law.value.tolist() == [1.0, 2.0]
    assert parse_scene(text, folder=tmp_path).loads[0].law.angle.tolist() == [0.0, 2 * math.pi]
    assert "load[0].table.file" in faults(text)
    assert isinstance(read_scene(tmp_path / "scene.toml").file, Path)


@pytest.mark.parametrize(
    ("written", "advice"), [("15", '; write "15 %"'), ("'15'", '; write "15 %"'), ("'250 %'", ""), ("-5", "")]
)
def test_a_percentage_without_its_sign(written, advice):
    result = faults(f"regime.speed = 3\nflywheel.irregularity = {written}")["flywheel.irregularity"]
    assert result.endswith(f"expected a value above 0 and below 2{advice}")


def test_ratios_and_dampers_say_what_they_expect():
    scene = "shafts.a.ratio = {}\ndamper = [{{on = 'crank'}}]\nregime.speed = 3\nflywheel.inertia = 1"
    result = faults(scene.format(-35))
    assert result["shafts.a.ratio"].endswith("expected a value above 0")
    assert '"5 N s/m"' in result["damper[0].coefficient"]
    assert '"0.2 N m s/rad"' in result["damper[0].coefficient"]
    assert faults(scene.format("'x'"))["shafts.a.ratio"].endswith('expected a number such as "5"')


AREAS = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}, "flywheel": {"irregularity": 0.02}}


def scene(**changes):
    return flywheel.load(scenes.yoke(**changes))


def test_the_levels_and_what_simulate_means():
    assert LEVELS == ("fast", "normal", "confirm", "audit", "proof")
    assert level() == level(simulate=True) == level("audit", True) == "audit"
    assert level(simulate=False) == level("normal", False) == "normal"
    assert [level(name) for name in LEVELS] == ["normal", *LEVELS[1:]]


@pytest.mark.parametrize(("name", "simulate"), [("audit", False), ("confirm", False), ("fast", True), ("normal", True)])
def test_contradictions_are_refused(name, simulate):
    with pytest.raises(ValueError, match="contradicts"):
        flywheel.size(scene(), accuracy=name, simulate=simulate)


@pytest.mark.parametrize("name", ["Fast", "", "exact"])
def test_another_name_is_refused_with_those_that_are(name):
    with pytest.raises(ValueError, match="expected one of fast, normal, confirm, audit, proof"):
        flywheel.size(scene(), accuracy=name)


def test_the_default_is_an_audit():
    sizing = flywheel.size(scene())
    assert (sizing.accuracy, sizing.simulation.route, sizing.left_out) == ("audit", "time", ())


def test_what_each_level_leaves_out():
    result = {level: flywheel.size(scene(), accuracy=level).as_dict() for level in LEVELS}
    assert [result[level]["accuracy"] for level in LEVELS] == ["normal", "normal", "confirm", "audit", "proof"]
    assert [len(result[level]["left_out"]) for level in LEVELS] == [1, 1, 1, 0, 1]
    assert "confirmation" in result["normal"]["left_out"][0]
    assert "time simulation" in result["confirm"]["left_out"][0]


def test_the_exact_figures_are_the_same_from_normal_on():
    result = [flywheel.size(scene(), accuracy=level).flywheel for level in LEVELS]
    assert result[0] == result[1] == result[2] == result[3]
    assert flywheel.size(scene(), simulate=False).flywheel == result[0]


def test_a_diagram_of_areas_is_worked_out_whole_at_every_level():
    for inputs in ({}, {"flywheel": {"inertia": 50}}):
        result = [flywheel.size(flywheel.load(AREAS | inputs), accuracy=level) for level in LEVELS]
        assert [sizing.left_out for sizing in result] == [()] * len(LEVELS)
        assert all(sizing.flywheel == result[0].flywheel for sizing in result)
        assert all(sizing.simulation == result[0].simulation for sizing in result)


def test_what_could_not_be_confirmed_counts_as_left_out(monkeypatch):
    monkeypatch.setattr("flywheel.sizing.confirmation._MOST_EVALUATIONS", 100)
    monkeypatch.setattr("flywheel.sizing.confirmation._MOST_WORK", 10)
    for request in ("confirm", "audit"):
        sizing = flywheel.size(scene(), accuracy=request)
        assert sizing.simulation.route == "quadrature"
        assert "confirmation" in sizing.left_out[0]
        assert any("not confirmed" in message for message in sizing.messages)


@pytest.mark.parametrize("level", LEVELS)
def test_every_level_raises_what_is_wrong_with_the_machine(level):
    with pytest.raises(flywheel.SceneError, match="net work"):
        flywheel.size(scene(drive={"torque": "1 N m"}), accuracy=level)
    with pytest.raises(flywheel.SceneError, match="cannot carry the mean load"):
        flywheel.size(flywheel.load(regimes.BAD["starved"].scene | {"regime": {}}), accuracy=level)


# `[stroke]` in a scene: what it becomes, and every fault in it and beside it.


CLAMP = {
    "type": "toggle-clamp",
    "frame": {"height": 0.14},
    "bell_crank": {"drive_length": 0.16763, "clamp_length": 0.22, "angle": 0.30199},
    "coupler": {"length": 0.095},
    "rod": {"length": 0.26},
    "platen": {"mass": 298},
}
STROKE = {"from": "-60 mm", "to": "190 mm", "speed": "0.3 m/s"}
SLIDE = {"name": "joint", "type": "slide", "between": ["frame.O", "body.P"]}
PIN = {"name": "joint", "type": "pin", "between": ["frame.O", "body.P"]}


def stroke_scene(**changes):
    return {"mechanism": CLAMP, "stroke": STROKE} | changes


def linkage(joint):
    """A body on a joint of the frame, both points away from the origins."""
    bodies = {"frame": {"points": {"O": [0.1, 0]}}, "body": {"mass": 2.0, "inertia": 0.1, "points": {"P": [0.2, 0]}}}
    return {"type": "linkage", "driver": "joint", "bodies": bodies, "joints": [joint]}


def stroke_faults(raw):
    with pytest.raises(flywheel.SceneError) as error:
        load(raw)
    return [str(fault) for fault in error.value.faults]


# -- what it becomes -------------------------------------------------------------------------------------------------


ODD = np.array([1.0, 2.0])  # in a scene from Python; its comparisons are not true or false


@pytest.mark.parametrize(
    ("change", "path", "expected"),
    [
        ({"joints": [SLIDE | {"type": ODD}]}, "mechanism.joints[0].type", 'one of "pin", "slide"'),
        ({"joints": [SLIDE | {"name": ODD}]}, "mechanism.joints[0].name", "a text"),
        ({"driver": ODD}, "mechanism.driver", "a text"),
        ({"type": ODD}, "mechanism.type", "one of scotch-yoke"),
    ],
)
def test_an_array_instead_of_a_text_is_a_fault(change, path, expected):
    (fault,) = stroke_faults({"mechanism": linkage(SLIDE) | change, "stroke": STROKE})
    assert fault.startswith(f"{path}: found a value of type ndarray, expected {expected}")


def test_a_stroke_stands_for_regime_and_flywheel():
    result = load(stroke_scene())
    assert result.stroke == (-0.06, 0.19, 0.3, 0.0, True)
    assert (result.reduction_element, result.shafts, result.flywheel_on) == ("slide", {"slide": 1.0}, "slide")
    assert (result.speed, result.irregularity, result.inertia, result.unknown) == (0.3, None, None, None)
    assert_allclose(result.cycle, 0.25)
    (mechanism,) = result.mechanisms
    assert (mechanism.shaft, mechanism.phase, mechanism.stroke) == ("slide", -0.06, (-0.06, 0.19))


def test_a_driver_that_turns_has_angles():
    stroke = {"from": "-30 deg", "to": "60 deg", "speed": "10 rpm", "acceleration": "2 rad/s^2"}
    result = load({"mechanism": [linkage(PIN)], "stroke": stroke})
    assert_allclose(result.stroke[:4], (-np.pi / 6, np.pi / 3, np.pi / 3, 2))
    assert (result.reduction_element, result.mechanisms[0].shaft) == ("crank", "crank")


def test_the_drive_pushes_a_slide_and_turns_a_crank():
    pushed = load(stroke_scene(drive={"force": "2 kN"}))
    turned = load({"mechanism": linkage(PIN), "drive": {"torque": 3}, "stroke": {"from": 0, "to": 1, "speed": 1}})
    assert (pushed.drive.on, pushed.drive.law, pushed.drive.once) == ("slide", 2000.0, True)
    assert (turned.drive.on, turned.drive.law) == ("crank", 3.0)


def test_a_window_of_the_whole_stroke_is_always():
    loads = [{"on": "platen", "force": 1, "from": "-60 mm", "to": "190 mm"}]
    (whole,) = load(stroke_scene(load=loads)).loads
    (part,) = load(stroke_scene(load=[loads[0] | {"to": "100 mm"}])).loads
    assert (whole.start, whole.end) == (None, None)
    assert (part.start, part.end) == (-0.06, 0.1)


@pytest.mark.parametrize(
    ("mechanism", "slides"),
    [
        (CLAMP, True),
        ([CLAMP], True),
        ([CLAMP, CLAMP], None),
        (linkage(SLIDE), True),
        (linkage(PIN), False),
        (linkage(SLIDE) | {"driver": "other"}, None),
        (linkage(SLIDE | {"type": "fixed"}), None),
        ({"type": "four-bar"}, False),
        (None, None),
        ([3], None),
    ],
)
def test_whether_the_driver_slides(mechanism, slides):
    assert driver_slides({"mechanism": mechanism}) is slides


# -- faults ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "start"),
    [
        (
            {"from": None},
            'stroke.from: found nothing, expected a length such as "250 mm" or a bare number in m, or an angle such as',
        ),
        ({"to": "30 deg"}, 'stroke.to: found "30 deg", expected a length'),
        ({"to": "-60 mm"}, "stroke.to: found -0.06 m, expected more than from, which is -0.06 m; a return stroke"),
        ({"to": "-90 mm"}, "stroke.to: found -0.09 m, expected more than from"),
        ({"speed": "3 rpm"}, 'stroke.speed: found "3 rpm", expected a velocity'),
        ({"speed": -1j}, "stroke.speed: found a value of type complex"),
        ({"acceleration": "3 m/s"}, 'stroke.acceleration: found "3 m/s", expected an acceleration'),
        (
            {"accelration": 1},
            'stroke.accelration: found key "accelration", expected a known key; did you mean "acceleration"',
        ),
        ({"to": float("nan")}, "stroke.to: found nan"),
    ],
)
def test_a_stroke_that_cannot_be_read(changes, start):
    stroke = {key: value for key, value in (STROKE | changes).items() if value is not None}
    (line,) = stroke_faults(stroke_scene(stroke=stroke))
    assert line.startswith(start)


@pytest.mark.parametrize(
    ("changes", "start"),
    [
        (
            {"regime": {"speed": 1}},
            "regime: found regime together with [stroke], expected none; a one-way stroke has no cycle",
        ),
        ({"flywheel": {"inertia": 1}}, "flywheel: found flywheel together with [stroke]"),
        ({"stroke": 3}, "stroke: found 3, expected a table"),
        (
            {"mechanism": [CLAMP | {"name": "a"}, CLAMP | {"name": "b"}]},
            "mechanism: found 2 mechanisms, expected one mechanism",
        ),
        ({"mechanism": CLAMP | {"phase": "10 deg"}}, "mechanism.phase: found phase together with [stroke]"),
        ({"shafts": {"motor": {"ratio": 2}}}, "shafts.motor: found a shaft together with a driver that slides"),
        ({"drive": {"torque": 3}}, 'drive.torque: found a torque on "slide", which slides, expected a force'),
        ({"drive": {}}, "drive.force: found nothing, expected a quantity or an expression in N"),
        ({"drive": {"force": "balance"}}, 'drive.force: found "balance", expected a value; a one-way stroke has no cycle'),
        ({"drive": {"on": "crank", "force": 1}}, 'drive.on: found "crank", expected a shaft'),
        ({"load": [{"on": "slide", "torque": 1}]}, 'load[0].torque: found a torque on "slide", which translates'),
        ({"load": [{"on": "slide", "force": 1, "every": 0.1}]}, "load[0].every: found every together with [stroke]"),
        (
            {"load": [{"on": "slide", "force": 1, "from": "0 deg", "to": 0.1}]},
            'load[0].from: found "0 deg", expected a length',
        ),
        (
            {"load": [{"on": "slide", "force": 1, "from": 0, "to": 0.2}]},
            "load[0].to: found 0.2 m, expected a place from -0.06",
        ),
        ({"load": [{"on": "slide", "force": 1, "from": 0.1, "to": 0}]}, "load[0].to: found 0 m, expected a position beyond"),
        ({"load": [{"on": "slide", "force": 1, "from": 0}]}, "load[0].to: found nothing"),
        (
            {"load": [{"on": "slide", "table": {"angle": [0, 0.1], "value": [1, 2]}}]},
            "load[0].table: found values from 0 to 0.1, expected values from -0.06 to 0.19",
        ),
        (
            {"load": [{"on": "slide", "table": {"angle": [0, 1], "angle_unit": "deg", "value": [1, 2]}}]},
            'load[0].table.angle_unit: found "deg"',
        ),
    ],
)
def test_what_cannot_stand_beside_a_stroke(changes, start):
    (line,) = stroke_faults(stroke_scene(**changes))
    assert line.startswith(start)


def test_a_law_has_no_stroke():
    law = {"type": "law", "outputs": {"ram": {"x": "sin(phi)"}}}
    (line,) = stroke_faults({"mechanism": law, "stroke": {"from": 0, "to": 1, "speed": 1}})
    assert line.startswith(
        'mechanism.type: found "law" together with [stroke], expected "scotch-yoke" or "slider-crank" or '
    )


BODY = {"mass": 1.3, "inertia": 0.02, "com": 0.05, "com_angle": 0.3}
BARS = {
    "type": "four-bar",
    "ground": {"length": 0.2},
    "coupler": {"length": 0.1, **BODY},
    "rocker": {"length": 0.12, **BODY},
}
SLIDER = {"type": "slider-crank", "rod": {"length": 0.2, **BODY}, "slider": {"mass": 2.0, "offset": 0.05}}
SHAPER = {"type": "crank-shaper", "frame": {"length": 0.2}, "rocker": {"length": 0.5, **BODY}, "ram": {"mass": 3}}


@pytest.mark.parametrize(
    ("mechanism", "start", "end"),
    [
        (SLIDER | {"crank": {"length": 0.3, **BODY}}, -25, 30),
        (SLIDER | {"crank": {"length": 0.3, **BODY}}, 360 + 180, 360 + 200),
        (BARS | {"crank": {"length": 0.15, **BODY}}, -70, 70),
        (BARS | {"crank": {"length": 0.15, **BODY}, "assembly": "crossed"}, 300, 420),
        (SHAPER | {"crank": {"length": 0.2, **BODY}}, 190, 530),
        (SHAPER | {"crank": {"length": 0.1, **BODY}}, -100, 500),
    ],
)
def test_named_mechanisms_move_between_the_angles_where_they_lock(mechanism, start, end):
    """Virtual power of the closed form against d'Alembert on the positions that Newton finds: T = ½ dI*/dphi omega² - M*."""
    scene = load({"mechanism": mechanism, "stroke": {"from": f"{start} deg", "to": f"{end} deg"}, "gravity": {}})
    q = np.radians(np.linspace(start + 0.01, end - 0.01, 9))
    reduced = flywheel.reduce(scene, q)
    (result,) = flywheel.joint_forces(scene, q, speed=3.0).mechanisms.values()
    expected = 4.5 * reduced.slope - reduced.moment
    np.testing.assert_allclose(result.action, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("mechanism", "start", "end", "message"),
    [
        (BARS, 20, 100, "20 to 100 deg, where the crank locks at 76.4084 deg, expected a stroke within -76.4084 to 76.4084"),
        (BARS, 100, 200, "100 to 200 deg, where the bars do not meet, expected a stroke within -76.4084 to 76.4084 deg"),
        (
            SHAPER | {"crank": {"length": 0.2}},
            0,
            200,
            "where the crank locks at 180 deg, expected a stroke within -180 to 180",
        ),
    ],
)
def test_a_stroke_beyond_a_lock_is_told_how_far_it_may_go(mechanism, start, end, message):
    crank = {"crank": {"length": 0.15}}
    (line,) = stroke_faults({"mechanism": crank | mechanism, "stroke": {"from": f"{start} deg", "to": f"{end} deg"}})
    assert line.startswith("stroke: found ")
    assert message in line


def test_a_crank_that_cannot_turn_is_told_of_strokes():
    (line,) = stroke_faults({"mechanism": BARS | {"crank": {"length": 0.15}}})
    assert line.startswith("mechanism.rocker.length: found 0.12 m")
    assert line.endswith("locks at 76.4084 and 283.592 deg; a [stroke] may lie within -76.4084 to 76.4084 deg")


@pytest.mark.parametrize("mechanism", [CLAMP, linkage(SLIDE)])
def test_a_driver_that_slides_needs_a_stroke(mechanism):
    (line,) = stroke_faults({"mechanism": mechanism, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    assert line.startswith("stroke: found nothing, expected a table with from and to, between which")


TURNING = {"mechanism": linkage(PIN), "stroke": {"from": 0, "to": 1, "speed": 1}}
TWISTING = {"shafts": {"motor": {"ratio": 2, "stiffness": 100}}}
BALANCE = {"parameters": {"F": "balance"}, "load": [{"on": "slide", "force": "F"}]}


@pytest.mark.parametrize(
    ("raw", "start"),
    [
        (stroke_scene(**BALANCE), 'parameters.F: found "balance", expected a value'),
        (TURNING | TWISTING, "shafts.motor: found a compliant shaft together with [stroke]"),
        (scenes.rotor(drive={"force": 3}), 'drive.force: found a force on "crank", which turns, expected a torque'),
        (
            TURNING | {"stroke": {"from": 0, "to": "2000 rev", "speed": 1}},
            "stroke.to: found 2000 turns, expected at most 1000",
        ),
        ({"stroke": STROKE}, "mechanism: found nothing, expected one mechanism"),
        ({"areas": {"values": [1, -1]}, "stroke": STROKE}, "areas: found areas together with [stroke]"),
    ],
)
def test_what_does_not_go_with_a_stroke(raw, start):
    lines = stroke_faults(raw)
    assert any(line.startswith(start) for line in lines)
    assert len(lines) == 1 or "mechanism" not in raw


def test_every_fault_is_reported_at_once():
    lines = stroke_faults(stroke_scene(stroke={"from": 0}, regime={}, load=[{"on": "plate", "force": 1}], gravity={"h": 1}))
    paths = {line.partition(":")[0] for line in lines}
    assert paths == {"stroke.to", "regime", "load[0].on", "gravity.h"}


@pytest.mark.parametrize(
    ("key", "value", "lost"),
    [
        ("slip", 0.99, "99 % of the speed"),
        ("efficiency", 0.05, "95 % of the power"),
        ("slip", 0.02, ""),
        ("efficiency", 0.5, ""),
    ],
)
def test_a_mesh_that_loses_nearly_all_gets_a_remark(key: str, value: float, lost: str) -> None:
    remarks = parse_scene(f"{ROTOR}\n[shafts.motor]\nratio = 5\n{key} = {value}\n").remarks
    assert [remark.path for remark in remarks] == ([f"shafts.motor.{key}"] if lost else [])
    assert all(remark.defect == f"{lost} is lost" for remark in remarks)
