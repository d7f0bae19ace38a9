"""Output of the program: diagrams, motions, pictures, power, reactions, mechanisms alone."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import flywheel
from flywheel.cli import main
from flywheel.mechanisms import KINDS
from tests.cli.test_cli import YOKE, run
from tests.limits import sample

# A scene holds what its command needs and no more: every command on mechanisms alone.


BODY = 'mass = "1 kg", inertia = "0.01 kg m^2", com = "30 mm"'
ALONE = {
    "scotch-yoke": 'crank.length = "0.1 m"\nyoke.mass = "3 kg"',
    "slider-crank": f'crank.length = "80 mm"\nrod = {{length = "300 mm", {BODY}}}\nslider.mass = "2 kg"',
    "four-bar": f"ground.length = 0.3\ncrank.length = 0.08\ncoupler.length = 0.25\nrocker = {{length = 0.18, {BODY}}}",
    "crank-shaper": f"crank.length = 0.1\nframe.length = 0.25\nrocker = {{length = 0.6, {BODY}}}\nram.mass = 5",
    "toggle-clamp": (
        "frame.height = 0.14\nbell_crank = {drive_length = 0.168, clamp_length = 0.22, angle = 0.3, mass = 16}\n"
        'coupler.length = 0.095\nrod.length = 0.26\nplaten.mass = 298\n[stroke]\nfrom = "-60 mm"\nto = "150 mm"'
    ),
    "law": "outputs.ram = {x = '0.1*sin(phi)', mass = 3}",
    "linkage": (
        "driver = 'A'\nbodies.frame.points = {A = [0, 0], C = [0.3, 0]}\n"
        "bodies.crank = {points = {A = [0, 0], B = [0.08, 0]}, mass = 1, com = [0.04, 0]}\n"
        "bodies.rod = {points = {B = [0, 0], D = [0.25, 0]}, guess = '40 deg'}\n"
        "bodies.rocker.points = {C = [0, 0], D = [0.18, 0]}\n"
        "assembly = [{point = 'rod.D', side = 'left', from = 'crank.B', to = 'frame.C'}]\n"
        "joints = [{name = 'A', type = 'pin', between = ['frame.A', 'crank.A']},"
        "{name = 'B', type = 'pin', between = ['crank.B', 'rod.B']},"
        "{name = 'C', type = 'pin', between = ['frame.C', 'rocker.C']},"
        "{name = 'D', type = 'pin', between = ['rod.D', 'rocker.D']}]"
    ),
}
"""A scene of every type with nothing but itself, and a stroke where its driver slides."""
LINKED = "slider-crank"


def text(kind: str, more: str = "") -> str:
    return f'[mechanism]\ntype = "{kind}"\n{ALONE[kind]}\n{more}'


def test_there_is_one_of_every_type():
    assert set(ALONE) == set(KINDS)


@pytest.mark.parametrize("kind", sample(list(ALONE), 3))
def test_every_type_is_reduced_and_graphed_and_not_sized(kind, scene):
    path = scene(text(kind))
    reduced = run("reduce", path, "--points", 2)
    assert reduced.exit_code == 0, reduced.stderr
    assert len(reduced.stdout.splitlines()) == 3
    graph = run("graph", path)
    assert graph.exit_code == 0, graph.stderr
    assert "MTF" in graph.stdout
    refused = run("size", path)
    assert (refused.exit_code, refused.stdout) == (1, "")
    lines = refused.stderr.splitlines()
    if kind == "toggle-clamp":
        assert "found a one-way stroke" in lines[0]
    else:
        assert lines[0].endswith("flywheel: found nothing, expected a table with irregularity or inertia")
        assert "regime.speed: found nothing, expected a speed such as" in lines[1]


@pytest.mark.parametrize("kind", ["slider-crank", "toggle-clamp"])
def test_forces_ask_for_a_speed_or_none(kind, scene):
    path = scene(text(kind))
    refused = run("reactions", path)
    (line,) = refused.stderr.splitlines()
    assert refused.exit_code == 1
    assert "speed" in line.split(": found nothing")[0]
    assert "--speed" in line
    assert "--quasi-static" in line
    speed = "0.1 m/s" if kind == "toggle-clamp" else "60 rpm"
    for option in (["--speed", speed], ["--quasi-static"]):
        assert run("reactions", path, "--points", 2, *option).exit_code == 0


def test_a_law_is_told_to_have_no_joints_before_anything_is_asked_for(scene):
    refused = run("reactions", scene(text("law")))
    assert "mechanism.type (line 2): found a mechanism of type law" in refused.stderr
    assert "--speed" not in refused.stderr


def test_a_speed_without_a_flywheel_is_constant():
    loaded = flywheel.load(text(LINKED, "[regime]\nspeed = 10"))
    forces = flywheel.joint_forces(loaded, [0.3, 2.0])
    assert forces.motion.omega.tolist() == [10.0, 10.0]
    assert forces.motion.alpha.tolist() == [0.0, 0.0]
    assert forces.messages == ("no flywheel is given: the speed is taken as a constant 10 rad/s",)


def test_loads_that_depend_on_speed_are_reduced_at_the_speed_given(scene):
    path = scene(text(LINKED, "[[damper]]\non = 'slider'\ncoefficient = 100"))
    refused = run("reduce", path, "--at", "90 deg")
    assert refused.exit_code == 1
    assert "--speed" in refused.stderr
    output = run("reduce", path, "--at", "90 deg", "--speed", "10 rad/s", "--json")
    state = json.loads(output.stdout)
    gain = state["gains"]["slider-crank.slider"][0]
    assert state["moment"][0] == pytest.approx(-100 * 10.0 * gain**2, rel=1e-12)
    assert (state["speed"], state["errors"]["speed"]) == (10.0, 0.0)
    assert "those at a constant 10 rad/s" in output.stderr


@pytest.mark.parametrize(
    "more",
    [
        "[[load]]\non = 'slider'\nforce = '-100 N'\nwhile = 'v > 0'",
        "[shafts.motor]\nratio = 2\nefficiency = 0.9\n[drive]\non = 'motor'\ntorque = 5",
        "[drive]\ntorque = '5*sin(t)'",
    ],
)
def test_reducing_asks_for_no_balance(more, scene):
    assert run("reduce", scene(text(LINKED, more)), "--points", 4).exit_code == 0


def test_a_stroke_without_speed_is_reduced_but_for_what_depends_on_it(scene):
    path = scene(text("toggle-clamp"))
    output = run("reduce", path, "--points", 3)
    heads = next(csv.reader(io.StringIO(output.stdout)))
    assert "F* [N]" in heads
    assert "F_drive [N]" not in heads
    assert "no speed is given" in output.stderr
    data = json.loads(run("reduce", path, "--points", 3, "--json").stdout)
    assert data["driving_force"] is data["velocities"] is data["accelerations"] is data["stroke"]["speed"] is None
    timed = json.loads(run("reduce", path, "--points", 3, "--json", "--speed", "0.3 m/s").stdout)
    v = np.array(timed["velocities"]["toggle-clamp.platen"])
    np.testing.assert_allclose(v, 0.3 * np.array(data["gains"]["toggle-clamp.platen"]), rtol=1e-14)


def test_what_has_no_inertia_is_graphed_with_a_speed_given(scene):
    path = scene('[mechanism]\ntype = "scotch-yoke"\ncrank.length = 1\n[[load]]\non = "yoke"\nforce = "-3 N"')
    output = run("graph", path)
    assert output.exit_code == 0
    assert "a source of flow moves the driver" in output.stdout
    assert "Sf:speed" in output.stdout


def test_a_mechanism_alone_is_animated_evenly():
    from flywheel.pictures.animation import timing
    from flywheel.pictures.sketch import views

    loaded = flywheel.load(text(LINKED))
    result = timing(loaded, views(loaded)[0])
    assert "no speed is given" in result.title
    assert not result.timed
    assert np.ptp(np.diff(result.evenly(40)[1])) < 1e-12
    gain = flywheel.reduce(loaded, result.q[[100, 700]]).gains["slider-crank.slider"]
    np.testing.assert_allclose(result.curve[[100, 700]], gain, rtol=1e-12)


# The bond graph of a scene, printed and drawn by the command.


MACHINES = Path(__file__).parents[2] / "examples" / "machines"
AREAS = """
areas.values = [1, -1]
regime.speed = 10
flywheel.irregularity = 0.1
"""


def run_graph(*arguments):
    return CliRunner().invoke(main, ["graph", *map(str, arguments)])


@pytest.mark.parametrize("scene", sample(sorted(MACHINES.glob("*.toml")), 5), ids=lambda path: path.stem)
def test_every_machine_has_a_table_or_says_why_not(scene):
    result = run_graph(scene)
    if "[areas]" in scene.read_text():
        assert result.exit_code == 1
        assert re.search(r": areas \(line \d+\): found areas without a mechanism", result.output)
        return
    assert result.exit_code == 0, result.output
    assert "f_out = T f_in, e_in = T e_out" in result.output
    assert result.output.count("e_1 = ") == 1


@pytest.mark.parametrize(("form", "sign"), [("text", "bond  from"), ("markdown", "| bond | from"), ("latex", "tabular")])
def test_the_table_comes_in_three_forms(form, sign):
    assert sign in run_graph(MACHINES / "press.toml", "--format", form).output


@pytest.mark.slow
@pytest.mark.parametrize("suffix", sample(["png", "svg", "pdf"], 3))
def test_the_picture_is_written(tmp_path, suffix):
    path = tmp_path / f"press.{suffix}"
    assert run_graph(MACHINES / "pump.toml", "--plot", path).exit_code == 0
    assert path.stat().st_size > 5_000


def test_simplifying_lists_what_it_did_and_leaves_fewer_bonds():
    whole, simpler = run_graph(MACHINES / "press.toml").output, run_graph(MACHINES / "press.toml", "--simplify").output
    assert "two bonds" in simpler
    assert "from 31 bonds to 30" in simpler
    assert "\n31 " in whole
    assert "\n31 " not in simpler


def test_the_map_has_every_element_under_the_part_that_it_stands_for():
    lines = run_graph(MACHINES / "press.toml", "--map").output.splitlines()
    whole = run_graph(MACHINES / "press.toml").output
    rows, part = [], ""
    for line in lines[1 + next(k for k, line in enumerate(lines) if line.startswith("part of the machine")) :]:
        first, *cells = re.split(r" {2,}", line)
        part = first or part
        rows.append((part, cells[0], cells[1], cells[2]))
    elements = {element for _, element, _, _ in rows}
    drawn = set(re.findall(r"\b(?:1|0|M?TF|I|C|R|M?Se|M?Sf):[^\s=,]+", whole))
    assert {name.rstrip(":;.") for name in drawn} <= elements
    assert ("press.rod", "I:press.rod.J_rod") in {row[:2] for row in rows}
    ties = {row[0] for row in rows if row[1] == "MTF:crank->press.rod"}
    assert ties == {"joint press.crank_pin", "joint press.slider_pin"}
    assert "velocity of the centre of mass along x" in {row[3] for row in rows}


def test_the_map_of_any_linkage_names_its_joints():
    output = run_graph(MACHINES.parent / "linkages" / "six_bar.toml", "--map", "--format", "markdown").output
    text = (MACHINES.parent / "linkages" / "six_bar.toml").read_text()
    joints = re.findall(r'\[\[mechanism.joints\]\][^[]*?name = "(\w+)"', text)
    assert len(joints) > 5
    assert all(f"joint linkage.{name} " in output for name in joints)
    assert output.splitlines()[0].startswith("| part of the machine | element | bonds | meaning |")


def test_the_map_speaks_spanish_and_wants_to_be_asked_for(tmp_path):
    file = tmp_path / "press.svg"
    output = run_graph(MACHINES / "press.toml", "--map", "--language", "es", "--plot", file).output
    assert "momento de inercia" in output
    assert "par press.crank_pin" in output
    assert file.stat().st_size > 5_000
    assert (
        "--language es la lengua del mapa y de la figura: añada --map o --plot"
        in run_graph(MACHINES / "press.toml", "--language", "es").output
    )
    assert "--format latex is for the table" in run_graph(MACHINES / "press.toml", "--map", "--format", "latex").output


def test_wrong_files_and_formats_are_named(tmp_path):
    wrong = run_graph(MACHINES / "press.toml", "--plot", tmp_path / "press.jpg")
    assert wrong.exit_code == 2
    assert ".png, .svg or .pdf" in wrong.output
    nowhere = run_graph(MACHINES / "press.toml", "--plot", tmp_path / "no" / "press.png")
    assert nowhere.exit_code == 1
    assert "cannot be written" in nowhere.output
    scene = tmp_path / "areas.toml"
    scene.write_text(AREAS)
    result = run_graph(scene)
    assert result.exit_code == 1
    assert re.search(r": areas \(line \d+\): found areas without a mechanism", result.output)


def test_a_compliant_shaft_is_drawn_as_spring_and_resistor(tmp_path):
    scene = tmp_path / "twist.toml"
    text = (MACHINES / "press_pinion.toml").read_text()
    name = text.split("[shafts.")[1].split("]")[0]
    scene.write_text(text.replace(f"[shafts.{name}]", f"[shafts.{name}]\nstiffness = 900\ndamping = 2"))
    result = run_graph(scene)
    assert result.exit_code == 0, result.output
    assert f"C:{name}.compliance" in result.output
    assert f"R:{name}.damping" in result.output


def test_a_machine_without_any_inertia_is_refused_by_bond(tmp_path):
    scene = tmp_path / "weightless.toml"
    text = 'mechanism = {type = "scotch-yoke", crank.length = 0.5}\ndrive.torque = "balance"\nregime.speed = 6\n'
    scene.write_text(text + 'flywheel.inertia = 0\n[[load]]\non = "yoke"\nforce = 5\nfrom = 0\nto = 3\n')
    result = run_graph(scene)
    assert result.exit_code == 1
    assert "graph: found MSe:drive.torque" in result.output
    assert "both set the effort of MTF:crank->scotch-yoke.yoke" in result.output
    assert "give the machine inertia or a flywheel" in result.output


DRIVEN = """
[mechanism]
type = "scotch-yoke"
crank = { length = 0.3, inertia = 0.5 }
yoke.mass = 20

[shafts.motor]
ratio = 5
efficiency = 0.9

[[inertia]]
on = "motor"
value = 0.1

[[load]]
on = "yoke"
force = "-200 - 30*v*abs(v) - 10*(t > 2)"

[[load]]
on = "yoke"
force = "-0.1*omega"

[[damper]]
on = "yoke"
coefficient = 20

[drive]
on = "motor"
DRIVE

[flywheel]
inertia = 3
"""


def driven(tmp_path, drive):
    scene = tmp_path / "driven.toml"
    scene.write_text(DRIVEN.replace("DRIVE", drive))
    return scene


def test_efforts_show_the_flows_and_the_time_that_they_depend_on(tmp_path):
    rows = run_graph(driven(tmp_path, 'torque = "160 - 12*omega"')).output
    number = {row.split()[1]: row.split()[0] for row in rows.splitlines()[2:] if row[:1].isdigit()}
    own, drive = number["MSe:load[0].force"], number["MSe:drive.torque"]
    assert f"Se[load[0].force](phi, f_{own}, t)" in rows
    assert f"drive.torque(phi, f_{drive})" in rows
    assert "Se[load[1].force](phi, f_1)" in rows  # omega of a port is the driving shaft's: bond 1 leaves the crank
    assert "R:damper[0]" in rows


def test_losses_in_meshes_are_said_to_be_left_out(tmp_path):
    scene = driven(tmp_path, "torque = 5")
    assert run_graph(scene).output.startswith(
        "shafts.motor: losses in its mesh (efficiency 0.9) are no element of the graph\n\n"
    )
    assert "shafts.motor: losses" in run_graph(scene, "--simplify").output
    assert "losses" not in run_graph(MACHINES / "press.toml").output


@pytest.mark.parametrize("inductance", [pytest.param("", marks=pytest.mark.slow), "inductance = 0.02, "])
@pytest.mark.slow
def test_a_dc_motor_is_drawn_as_its_own_graph(tmp_path, inductance):
    motor = (
        f'motor = {{type = "dc", voltage = 110, resistance = 0.8, constant = 0.6, {inductance}friction = 1, inertia = 0.02}}'
    )
    result = run_graph(driven(tmp_path, motor), *(("--plot", tmp_path / "motor.svg") if inductance else ()))
    assert result.exit_code == 0, result.output
    for name in ("Se:drive.motor.voltage", "GY:drive.motor.constant", "R:drive.motor.resistance", "1:drive.motor.rotor"):
        assert name in result.output
    assert ("I:drive.motor.inductance" in result.output) is bool(inductance)
    assert "MSe:drive.motor" not in result.output
    assert sum("  I:drive.motor.inertia  " in line for line in result.output.splitlines()) == 1


# The command `motion`: options, what is told, files, faults.


PRESS = """
[mechanism]
type = "slider-crank"
crank.length = "1 m"
rod = {length = "2 m", mass = 1, com = "1 m"}
"""


@pytest.fixture
def motion_scene(tmp_path):
    path = tmp_path / "press.toml"
    path.write_text(PRESS, encoding="utf-8")
    return path


def run_motion(*arguments):
    return CliRunner().invoke(main, ["motion", *map(str, arguments)])


def test_a_mechanism_alone_is_moved_per_unit_of_its_driver(motion_scene):
    result = run_motion(motion_scene, "--of", "slider")
    assert (result.exit_code, result.stderr) == (0, "")
    assert "guide: displacement of slider" in result.stdout
    assert "  90              1.73205         -1                       0.57735" in result.stdout
    assert "velocity passes zero at 0 deg, 180 deg" in result.stdout
    assert "rod.com" not in run_motion(motion_scene).stdout
    every = run_motion(motion_scene, "--full").stdout
    assert "rod.com: place" in every
    assert "at rest: pivot (0, 0) m" in every
    assert max(map(len, every.splitlines())) <= 110


@pytest.mark.parametrize("name", sample(("linkages/six_bar", "machines/injection_clamp", "machines/pump"), 2))
def test_a_motion_without_names_fits_a_screen_with_the_extremes_of_its_ports(name):
    lines = run_motion(Path(__file__).parents[2] / "examples" / f"{name}.toml").stdout.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 110
    assert "--full" in lines[-1]


def test_angles_are_given_in_degrees_beside_rad(motion_scene):
    text = run_motion(motion_scene, "--of", "rod").stdout
    assert "position [rad]  position [deg]" in text
    assert "-0.523599 rad (-30 deg) at 90 deg" in text


def test_one_position_is_a_line_for_each_figure(motion_scene):
    result = run_motion(motion_scene, "--of", "slider,rod", "--speed", "5 rad/s", "--at", "90 deg")
    assert [line.split() for line in result.stdout.splitlines()[4:]] == [
        ["guide", "1.73205", "m", "-5", "m/s", "14.4338", "m/s^2"],
        ["rod", "-0.523599", "rad", "(-30", "deg)", "0", "rad/s", "14.4338", "rad/s^2"],
    ]


def test_every_figure_of_json_has_its_error(motion_scene):
    data = json.loads(run_motion(motion_scene, "--law", "sin(t)", "--until", "2 s", "--points", 3, "--json").stdout)
    assert (data["condition"], data["over"], data["t"]) == ("imposed: sin(t)", "time", [0.0, 1.0, 2.0])

    def alike(figures, errors, path):
        if isinstance(errors, dict):
            assert isinstance(figures, dict), path
            for key, part in figures.items():
                if key not in ("kind", "units", "quantity", "component", "which"):
                    alike(part, errors[key], f"{path}.{key}")
        elif isinstance(errors, list):
            assert len(figures) == len(errors), path
            for one, error in zip(figures, errors, strict=True):
                alike(one, error, path)
        else:
            assert (figures is None) == (errors is None), path
            assert errors is None or errors >= 0.0, path

    for name in ("t", "q", "rate", "acceleration", "breakpoints", "curves"):
        alike(data[name], data["errors"][name], name)
    assert data["curves"]["guide"]["velocity"][1] == pytest.approx(-0.5475182, abs=1e-7)


def test_csv_has_a_row_for_every_position(motion_scene, tmp_path):
    table = tmp_path / "motion.csv"
    assert run_motion(motion_scene, "--speed", "60 rpm", "--over", "time", "--csv", "-o", table).exit_code == 0
    head, *rows = table.read_text().splitlines()
    assert len(rows) == 361
    assert head.split(",")[:4] == ["t [s]", "phi [rad]", "omega [rad/s]", "alpha [rad/s^2]"]
    column = head.split(",").index("rod.com acceleration total [m/s^2]")
    assert float(rows[0].split(",")[column]) == pytest.approx(1.25 * (2 * np.pi) ** 2)


def test_a_transient_begins_where_it_is_told(motion_scene):
    driven = PRESS + '[drive]\ntorque = "10 N m"\n'
    motion_scene.write_text(driven, encoding="utf-8")
    result = run_motion(
        motion_scene, "--from", "rest", "--at", "90 deg", "--until", "0.05 s", "--of", "crank", "--at", "0 s"
    )
    assert (result.exit_code, result.stderr) == (0, "")
    assert "motion from 90 deg, 0 rpm" in result.stdout
    assert "t = 0 s, phi = 90 deg" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--of", "sldier"], 1, 'did you mean "slider"?'),
        (["--over", "time"], 1, "time without a motion in time"),
        (["--law", "sin(t)"], 1, "a law without an end"),
        (["--law", "sin(t)", "--until", "2 turns"], 2, "is not a duration"),
        (["--law", "sin(t)", "--regime"], 2, "exclude each other"),
        (["--law", "sin(t)", "--until", "2 s", "--at", "30 deg"], 2, "is not a time with its unit"),
        (["--at", "30 deg", "--points", "5"], 2, "exclude each other"),
        (["--flywheel", "2 kg m^2"], 2, "--regime or --from"),
        (["--from", "rest", "--at", "1 deg", "--at", "2 deg"], 2, "give --at once"),
        (["--regime"], 1, "flywheel"),
        (["--speed", "5 kg"], 2, "is not a speed"),
        (["--csv", "--json"], 2, "exclude each other"),
    ],
)
def test_what_cannot_be_is_one_line(motion_scene, arguments, code, message):
    result = run_motion(motion_scene, *arguments)
    assert result.exit_code == code
    assert message in result.stderr
    assert "Traceback" not in result.output


# `flywheel draw` and `flywheel animate`: files, exit codes, and lines instead of tracebacks.


CLAMP = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.toml"
PICTURES_AREAS = Path(__file__).parents[2] / "examples" / "machines" / "diagram.toml"


@pytest.fixture
def yoke_scene(tmp_path: Path) -> Path:
    path = tmp_path / "yoke.toml"
    path.write_text(YOKE)
    return path


@pytest.mark.parametrize("name", ["a.SVG"])
def test_draw_writes_and_overwrites(yoke_scene: Path, tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text('<?xml version="1.0"?>\n<svg xmlns="http://www.w3.org/2000/svg"/>\n')
    result = run("draw", yoke_scene, "--at", "30 deg", "--at", "1 rad", "--path", "crank_pin", "-o", path)
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
    assert path.stat().st_size > 4000


@pytest.mark.slow
def test_a_stroke_is_drawn_at_positions(tmp_path: Path) -> None:
    path = tmp_path / "clamp.svg"
    assert run("draw", CLAMP, "--at", "190 mm", "-o", path).exit_code == 0
    assert path.exists()


@pytest.mark.slow
def test_animate_writes(yoke_scene: Path, tmp_path: Path) -> None:
    path = tmp_path / "yoke.gif"
    result = run("animate", yoke_scene, "-o", path, "--frames", "2", "--fps", "5")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
    assert path.read_bytes()[:6] == b"GIF89a"


@pytest.mark.parametrize(("command", "name"), sample([("draw", "a.png"), ("animate", "a.gif")], 2))
def test_pictures_take_plot_as_all_commands_do(command: str, name: str, yoke_scene: Path, tmp_path: Path) -> None:
    frames = ["--frames", "2"] if command == "animate" else []
    for option in ("-o", "--output", "--plot"):
        path = tmp_path / option / name
        path.parent.mkdir()
        result = run(command, yoke_scene, option, path, *frames)
        assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
        assert path.exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize(
    ("arguments", "printed"),
    [
        (["size", "SCENE", "--no-simulate", "--plot", "full.png"], "Flywheel on the crank"),
        (["sweep", "SCENE", "--vary", "regime.speed=50rpm:60rpm:3", "--csv", "full.csv"], "regime.speed"),
        (["sweep", "SCENE", "--vary", "regime.speed=50rpm:60rpm:3", "--plot", "full.png"], "regime.speed"),
        (["reduce", "SCENE", "--points", "4", "--plot", "full.png"], "phi"),
        (["motion", "SCENE", "--plot", "full.png"], "acceleration"),
        (["simulate", "SCENE", "--until", "0.1 s", "--csv", "full.csv"], "energy"),
    ],
)
def test_a_full_disk_is_named_with_its_file_and_the_table_is_printed(
    arguments: list[str], printed: str, yoke_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("full.png", "full.csv"):
        Path(name).symlink_to("/dev/full")
    result = run(*(str(yoke_scene) if word == "SCENE" else word for word in arguments))
    assert result.exit_code == 1
    assert f"{arguments[-1]}: cannot be written (No space left on device)" in result.stderr.splitlines()
    assert printed in result.stdout


@pytest.mark.parametrize(("command", "name"), sample([("draw", "yoke.png"), ("animate", "yoke.gif")], 2))
@pytest.mark.slow
def test_a_file_of_the_scenes_name_is_written_once(
    command: str, name: str, yoke_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    first = run(command, yoke_scene, *(["--frames", "2"] if command == "animate" else []))
    assert (first.exit_code, first.stderr) == (0, f"wrote {name}\n")
    before = (here / name).read_bytes()
    second = run(command, yoke_scene)
    assert (second.exit_code, second.stderr) == (
        1,
        f"{name}: exists already and is left as it is; name a file with --plot\n",
    )
    assert (here / name).read_bytes() == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["draw", "-o", "a.gif"],
        ["draw", "-o", "a.png", "--at", "30"],
        ["draw", "-o", "a.png", "--at", "190 mm"],
        ["animate", "-o", "a.png"],
        ["animate", "-o", "a.gif", "--frames", "1"],
        ["animate", "-o", "a.gif", "--fps", "51"],
    ],
)
def test_usage_errors(yoke_scene: Path, arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    command, *options = arguments
    assert run(command, yoke_scene, *options).exit_code == 2
    assert list(tmp_path.iterdir()) == [yoke_scene]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["draw", PICTURES_AREAS, "-o", "a.png"], "mechanism: found a diagram of areas, expected a mechanism to draw"),
        (["animate", PICTURES_AREAS, "-o", "a.gif"], "mechanism: found a diagram of areas, expected a mechanism to draw"),
        (["draw", CLAMP, "-o", "a.png", "--at", "300 mm"], "at: found 300 mm, expected a position from"),
        (["draw", CLAMP, "-o", "a.png", "--path", "rodpin"], "did you mean 'rod_pin'?"),
        (["draw", CLAMP, "-o", "missing/a.png"], "missing/a.png: cannot be written (No such file or directory)"),
        (["animate", CLAMP, "--frames", "2", "-o", "missing/a.gif"], "missing/a.gif: cannot be written"),
        (["draw", "nowhere.toml", "-o", "a.png"], "nowhere.toml: found no such file"),
    ],
)
def test_faults_are_one_line(arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 1
    assert said in result.stderr
    assert result.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("command", "name"), [("draw", "yoke.png"), ("animate", "yoke.gif")])
def test_the_scene_itself_is_never_overwritten(command: str, name: str, tmp_path: Path) -> None:
    scene = tmp_path / name
    scene.write_text(YOKE)
    result = run(command, scene, "-o", scene)
    assert result.exit_code == 2
    assert "names the scene itself" in result.stderr
    assert scene.read_text() == YOKE


# The command `power`: its table sums to the input, in both languages; its JSON; what it refuses.


PUNCH = str(Path(__file__).parents[2] / "examples" / "regimes" / "punch_press.toml")


def run_power(*arguments):
    return CliRunner().invoke(main, ["power", *arguments])


def test_losses_and_loads_sum_to_the_input():
    result = run_power(PUNCH)
    assert result.exit_code == 0
    rows = {line[:24].strip(): line[24:].split()[0] for line in result.stdout.splitlines() if line[24:].split()}
    assert float(rows["comes in"]) == pytest.approx(float(rows["lost and arrived"]), abs=0.02)
    assert float(rows["rotor of the motor"]) + float(rows["mesh motor–crank"]) == pytest.approx(float(rows["is lost"]), 1e-4)
    assert "motor  1426.61       crank" in result.stdout


def test_at_an_angle_in_spanish_with_a_picture(tmp_path):
    picture = tmp_path / "flow.svg"
    result = run_power(PUNCH, "--at", "300 deg", "--language", "es", "--plot", str(picture), "--style", "print")
    assert result.exit_code == 0
    assert "a 300°" in result.stdout
    assert "llega" in result.stdout
    drawn = picture.read_text(encoding="utf-8")
    assert "Flujo de potencia con la manivela a 300°" in drawn


@pytest.mark.slow
def test_a_sizing_in_spanish_has_its_figures_in_spanish(tmp_path):
    picture = tmp_path / "size.svg"
    compressor = Path(PUNCH).parents[1] / "drive_lines" / "compressor.toml"
    command = ["size", str(compressor), "--language", "es", "--accuracy", "fast", "--plot", str(picture)]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0
    assert "velocidad de la manivela  " in result.stdout
    texts = re.findall(r"<text[^>]*>([^<]+)</text>", picture.read_text(encoding="utf-8"))
    assert "ángulo de la manivela φ, grados" in texts
    assert [text for text in texts if re.fullmatch(r"−?\d+\.\d+", text)] == []


def test_json_is_that_of_the_sizing():
    result = run_power(PUNCH, "--json", "--at", "300 deg")
    data = json.loads(result.stdout)
    assert data["at"] == pytest.approx(5.2359877559829888)
    assert data["input"] == pytest.approx(data["output"] + data["losses"], rel=1e-12)
    powers = {stream["kind"]: stream["power"] for stream in data["streams"] if stream["kind"] in ("input", "rotor", "drive")}
    assert powers["input"] == pytest.approx(powers["rotor"] + powers["drive"], rel=1e-12)
    assert 0.0 < data["error"] < 1e-8


def test_what_it_refuses(tmp_path):
    areas = tmp_path / "areas.toml"
    areas.write_text("areas = {values = [5, -5], scale = 1}\nregime.speed = 9\nflywheel.inertia = 1\n", encoding="utf-8")
    result = run_power(str(areas))
    assert result.exit_code == 1
    assert "found a diagram of areas, expected a machine; areas do not show where the power goes" in result.stderr
    assert run_power(PUNCH, "--at", "300").exit_code == 2
    assert run_power(PUNCH, "--at", "3 kg").exit_code == 2
    assert run_power(PUNCH, "--json", "--language", "es").exit_code == 2
    assert run_power(PUNCH, "--plot", "flow.txt").exit_code == 2


# The command `reactions`: curves over the driver or the time, motions in time, and what does not go together.


REACTIONS_PRESS = """
[mechanism]
type = "slider-crank"
crank = {length = 0.1, mass = 2}
rod = {length = 0.3, mass = 3, inertia = 0.03, com = 0.12}
slider.mass = 5
[[load]]
on = "slider"
force = "-100 - 40*sin(20*t)"
[drive]
torque = 60
[flywheel]
inertia = 0.5
"""


@pytest.fixture
def reactions_scene(tmp_path: Path) -> Path:
    path = tmp_path / "press.toml"
    path.write_text(REACTIONS_PRESS, encoding="utf-8")
    return path


def run_reactions(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["reactions", *map(str, arguments)])


def test_a_cam_that_lifts_off_is_told_in_every_form() -> None:
    scene = Path(__file__).parents[2] / "examples" / "linkages" / "cam_press.toml"
    at = ("--at", "150 deg", "--at", "165 deg", "--at", "200 deg")
    line = "shaft-pivot would have to pull at 1 of 3 positions, from 165 deg: it lifts off"
    data = run_reactions(scene, "--json", *at)
    assert json.loads(data.stdout)["messages"] == [line]
    assert data.stderr == run_reactions(scene, "--csv", *at).stderr == f"{line}\n"
    assert run_reactions(scene, *at).stdout.count(line) == 1
    assert run_reactions(scene, "--of", "shaft", *at).stdout.count(line) == 1


def test_curves_of_some_joints_are_listed_over_the_time(reactions_scene: Path) -> None:
    result = run_reactions(
        reactions_scene, "--speed", "10 rad/s", "--over", "time", "--of", "guide", "--of", "pivot", "--points", 3
    )
    assert (result.exit_code, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert lines[0] == "Machine: forces in the joints, at 10 rad/s"
    assert lines[2:4] == ["guide", "  t (s)     phi (deg)  normal (N)  moment (N m)  resultant (N)"]
    assert "least and greatest" in lines
    assert not any(line == "crank_pin" for line in lines)
    back = run_reactions(reactions_scene, "--speed", "-30 rpm", "--over", "time", "--csv", "--points", 5).stdout
    times = [float(row["t [s]"]) for row in csv.DictReader(io.StringIO(back))]
    assert times == pytest.approx([0.4, 0.8, 1.2, 1.6, 2.0])


@pytest.mark.slow
def test_a_motion_in_time_is_taken_as_simulate_takes_it(reactions_scene: Path, tmp_path: Path) -> None:
    picture = tmp_path / "forces.png"
    result = run_reactions(
        reactions_scene,
        "--from",
        "rest",
        "--at",
        "30 deg",
        "--until",
        "0.05 s",
        "--csv",
        "--points",
        4,
        "--of",
        "pivot",
        "--plot",
        picture,
    )
    assert result.exit_code == 0
    head, *rows = csv.reader(result.stdout.splitlines())
    assert head[:4] == ["t [s]", "phi [rad]", "omega [rad/s]", "alpha [rad/s^2]"]
    assert [float(row[0]) for row in rows] == pytest.approx([0.0, 0.05 / 3, 0.1 / 3, 0.05])
    action = head.index("slider-crank.pivot.drive [N m]")
    for row in rows:  # the crank gets what the flywheel leaves of the torque
        assert float(row[action]) == pytest.approx(60.0 - 0.5 * float(row[3]), rel=1e-9)
    assert picture.read_bytes()[1:4] == b"PNG"


def test_json_has_the_components_asked_for_with_their_errors(reactions_scene: Path) -> None:
    result = run_reactions(reactions_scene, "--until", "0.02 s", "--component", "x,driving", "--json", "--points", 2)
    data = json.loads(result.stdout)
    mechanism, errors = data["mechanisms"]["slider-crank"], data["errors"]["mechanisms"]["slider-crank"]
    assert list(mechanism["driving"]) == ["pivot"]
    assert {part for parts in mechanism["joints"].values() for part in parts} == {"x", "units"}
    assert {part for parts in errors["joints"].values() for part in parts} == {"x"}
    assert data["t"] == [0.0, pytest.approx(0.02)]
    assert data["condition"].startswith("followed from 0 rad/s: ended at")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--speed", "1 rad/s", "--from", "rest"], "exclude each other"),
        (["--from", "rest", "--at", "1 deg", "--at", "2 deg"], "starts at one place"),
        (["--flywheel", "2 kg m^2"], "belongs to a motion in time"),
        (["--hodograph", "--together"], "--hodograph and --together exclude each other"),
        (["--component", "z"], "'z' is not a component"),
    ],
)
def test_what_does_not_go_together_is_told(reactions_scene: Path, options: list[str], said: str) -> None:
    result = run_reactions(reactions_scene, *options)
    assert result.exit_code == 2
    assert said in " ".join(result.stderr.split())


def test_a_joint_that_there_is_not_is_a_fault_with_the_nearest(reactions_scene: Path) -> None:
    result = run_reactions(reactions_scene, "--speed", "1 rad/s", "--of", "gude")
    assert result.exit_code == 1
    assert "joints: found 'gude'" in result.stderr
    assert "did you mean 'guide'?" in result.stderr
