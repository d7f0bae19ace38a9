"""The examples run, and show what the pages beside them say."""

from __future__ import annotations

import inspect
import math
import re
import runpy
import shlex
import shutil
import sys
from contextlib import redirect_stdout
from functools import cache
from importlib import import_module
from io import StringIO
from math import pi
from operator import attrgetter
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from click.testing import CliRunner
from mpmath import mp
from numpy.typing import NDArray

import flywheel
from flywheel import Scene
from flywheel.cli import main
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.positions import solve
from tests.limits import sample

# Every example runs: exam scripts agree with their true figures, scenes size, the engine's table can be made again.


EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMS, MACHINES = EXAMPLES / "exams", EXAMPLES / "machines"
SCRIPTS = sorted(path for path in EXAMS.glob("*.py") if path.name != "steps.py")
SCENES = sorted(EXAMPLES.glob("*/*.toml"))
ONE_WAY = [path for path in SCENES if "\n[stroke]" in path.read_text(encoding="utf-8")]
ALONE = [path for path in SCENES if not {"[stroke]", "[flywheel]"} & set(path.read_text(encoding="utf-8").split())]
STROKES = [path for path in SCENES if "\n[single_stroke]" in path.read_text(encoding="utf-8")]
SIZED = [path for path in SCENES if path not in (*ONE_WAY, *ALONE, *STROKES)]


def name(path: Path) -> str:
    return path.stem


@pytest.fixture
def steps(monkeypatch):
    """Their shared helper, importable as it is for a script run from its own folder."""
    monkeypatch.syspath_prepend(str(EXAMS))
    monkeypatch.delitem(sys.modules, "steps", raising=False)
    import steps

    yield steps
    sys.modules.pop("steps", None)


def test_there_are_examples():
    assert len(SCRIPTS) == 10
    assert len(SCENES) >= 20


@pytest.mark.parametrize("script", sample(SCRIPTS, 5), ids=name)
def test_exam_agrees_with_its_true_figures_and_says_where_the_print_errs(script, steps, monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script), run_name="__main__")
    printed = capsys.readouterr().out
    assert "verdict" in printed
    assert "DISAGREES" not in printed
    wrong_in_print = {"march_2010", "may_2013", "may_2014", "p107_2", "p115_2"}
    assert ("print errs" in printed) == (script.stem in wrong_in_print)


@pytest.mark.parametrize("scene", ONE_WAY, ids=name)
def test_scene_of_one_way_is_reduced_from_end_to_end(scene):
    loaded = flywheel.load(scene)
    ends = [loaded.stroke.start, loaded.stroke.end]
    assert (flywheel.reduce(loaded, ends).inertia > 0).all()
    with pytest.raises(flywheel.SceneError, match="one-way stroke"):
        flywheel.size(loaded)


@pytest.mark.parametrize("scene", ALONE, ids=name)
def test_scene_of_a_mechanism_alone_moves_and_has_no_flywheel_to_size(scene):
    loaded = flywheel.load(scene)
    assert flywheel.motion(loaded, points=5).curves
    with pytest.raises(flywheel.SceneError, match="flywheel"):
        flywheel.size(loaded)


@pytest.mark.parametrize("scene", sample(SIZED, 4), ids=name)
def test_scene_documents_itself_and_sizes_to_its_irregularity(scene):
    loaded, text = flywheel.load(scene), scene.read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert loaded.title or scene.parent.name not in ("machines", "regimes")
    sizing = flywheel.size(loaded, simulate=False)
    assert sizing.energy_fluctuation > 0
    if loaded.irregularity is None:
        assert sizing.simulation.irregularity > 0
        assert sizing.flywheel.exact is None
    else:
        assert sizing.reached
        assert sizing.flywheel.needed
        assert sizing.flywheel.exact > 0
    if sizing.balance is not None:
        assert abs(sizing.balance.value) > 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("scene", STROKES, ids=name)
def test_a_stroke_documents_itself_and_keeps_up(scene):
    loaded, text = flywheel.load(scene), scene.read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert loaded.title
    result = flywheel.single_stroke(loaded)
    assert result.keeps_up
    assert all(share < 1.0 for share in result.shares.values())


def test_pinion_press_needs_the_same_swing_as_the_press_with_its_gear_inertia():
    on_crank = flywheel.size(flywheel.load(MACHINES / "press.toml"), simulate=False)
    on_pinion = flywheel.size(flywheel.load(MACHINES / "press_pinion.toml"), simulate=False)
    gears = 38.0 + 36 * 0.12
    assert 36 * on_pinion.flywheel.exact + gears == pytest.approx(on_crank.flywheel.exact, rel=1e-8)


def test_three_cylinders_carry_three_times_the_load():
    single = flywheel.size(flywheel.load(MACHINES / "engine.toml"), simulate=False)
    triple = flywheel.size(flywheel.load(MACHINES / "three_cylinder.toml"), simulate=False)
    assert -triple.balance.value == pytest.approx(3 * single.balance.value, rel=1e-9)
    assert triple.energy_fluctuation < single.energy_fluctuation


def test_given_press_flywheel_lies_where_sizing_puts_it():
    given = flywheel.size(flywheel.load(MACHINES / "press_given.toml"), simulate=False)
    text = (MACHINES / "press_given.toml").read_text(encoding="utf-8")
    request = text.replace('inertia = "12 kg m^2"', f"irregularity = {given.simulation.irregularity!r}")
    assert request != text
    (sized,) = [flywheel.size(flywheel.load(request), simulate=False)]
    assert sized.flywheel.exact == pytest.approx(12.0, rel=1e-8)


def test_engine_cycle_is_made_again_byte_for_byte():
    made = runpy.run_path(str(MACHINES / "make_engine_cycle.py"), run_name="engine_cycle")
    assert made["cycle_csv"]().encode("ascii") == (MACHINES / "engine_cycle.csv").read_bytes()


def test_engine_cycle_script_writes_beside_itself(tmp_path):
    script = tmp_path / "make_engine_cycle.py"
    script.write_bytes((MACHINES / script.name).read_bytes())
    runpy.run_path(str(script), run_name="__main__")
    assert (tmp_path / "engine_cycle.csv").read_bytes() == (MACHINES / "engine_cycle.csv").read_bytes()


def test_a_wrong_step_fails(steps, capsys):
    with pytest.raises(SystemExit, match="1 of 2 steps disagree"):
        steps.report("title", [steps.Step("right", 1.0, "1.00"), steps.Step("wrong", 1.0, "1.02")])
    assert "DISAGREES with the print" in capsys.readouterr().out


def test_an_erratum_needs_an_error_and_a_true_figure_its_digits(steps):
    assert steps.verdict(steps.Step("I", 348.9894, "348.989", erratum="no")).startswith("NO ERRATUM")
    assert steps.verdict(steps.Step("I", 1.0, "2", true=1.0, erratum="yes")) == "print errs"
    assert steps.verdict(steps.Step("I", 1.0 + 1e-8, "1", true=1.0)).startswith("DISAGREES with the true")


# Every script on bond graphs runs: its `main` prints, and draws a picture into the file that it is given.


mpl.use("Agg")

FOLDER = Path(__file__).parents[2] / "examples" / "bond_graphs"
GRAPH_SCRIPTS = sorted(path for path in FOLDER.glob("*.py") if path.name != "planar.py")
DRAWS_LEAST = 10_000  # bytes of a picture with something in it


def test_there_are_scripts():
    assert FOLDER / "compare_methods.py" in GRAPH_SCRIPTS


@pytest.mark.parametrize("script", sample(sorted(GRAPH_SCRIPTS, key=lambda path: path.stem != "rosenberg"), 9), ids=name)
def test_main_prints_and_draws(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(FOLDER))
    monkeypatch.setattr("sys.argv", [script.name])
    main = runpy.run_path(str(script), run_name="example")["main"]
    picture = tmp_path / "picture.png"
    takes_a_file = "path" in inspect.signature(main).parameters
    main(path=str(picture)) if takes_a_file else main()
    printed = capsys.readouterr().out
    assert printed.strip()
    if script.stem == "compare_methods":  # tells the methods apart
        assert (printed.count("Pearson r"), printed.count("crank side")) == (6, 4)
        assert "small lambda, m l²/3" in printed
        assert printed.count("alpha left at 0") == 1  # at a constant speed there is none to leave
        assert len(list(tmp_path.glob("picture_*.png"))) == 5
        beside = [line.split() for line in printed.splitlines() if ": flywheel.motion" in line]
        assert len(beside) == 2 * 3 + 2 * 6
        assert max(float(words[-3]) for words in beside) < 1e-9  # greatest residual
    if script.stem == "rosenberg":
        assert "23 bonds  by the rules; I*(0.5 rad) = 0.1416 kg m²" in printed
        assert "19 bonds  rod's centre held on the line, as there; I*(0.5 rad) = 0.2052 kg m²" in printed
    if takes_a_file:
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert picture.stat().st_size > DRAWS_LEAST


# The comparison of routes runs and every route agrees with the equation written by hand.


DYNAMICS = Path(__file__).parents[2] / "examples" / "dynamics"


@pytest.mark.slow
def test_three_routes_agree(capsys):
    runpy.run_path(str(DYNAMICS / "three_routes.py"), run_name="__main__")
    printed = capsys.readouterr().out
    assert "20.27035683" in printed
    rows = [line.split() for line in printed.splitlines() if line.endswith("agrees")]
    assert [row[0] for row in rows] == ["reduced", "newton", "multipliers", "energy"]
    assert "DISAGREES" not in printed
    assert max(float(row[2]) for row in rows) < 1e-15


# The example linkages move as closed forms say, and need the flywheels that energy says.


LINKAGES = Path(__file__).parents[2] / "examples" / "linkages"
TURN = 2 * math.pi
PHI = np.radians(np.arange(0.0, 361.0, 2.5))


@cache
def scene(name: str) -> Scene:
    return flywheel.load(LINKAGES / f"{name}.toml")


def poses(name: str, q: NDArray[np.float64] = PHI) -> Poses:
    linkage = scene(name).mechanisms[0].linkage
    assert linkage is not None
    return solve(linkage, 0.0, TURN).poses(q)


def test_the_offset_slider_crank_is_that_of_the_named_type():
    text = (LINKAGES / "offset_slider_crank.toml").read_text(encoding="utf-8")
    named = """
[mechanism]
type = "slider-crank"
crank = { length = "60 mm", mass = "8 kg", inertia = "0.02 kg m^2", com = "6 mm" }
rod = { length = "240 mm", mass = "3.2 kg", inertia = "0.024 kg m^2", com = "80 mm" }
slider = { mass = "2.1 kg", offset = "15 mm" }
"""
    rest = text[text.index("[[load]]") :].replace('"cylinder"', '"slider"')
    expected = flywheel.size(flywheel.load(named + rest), simulate=False)
    sizing = flywheel.size(scene("offset_slider_crank"), simulate=False)
    assert sizing.flywheel.exact == pytest.approx(expected.flywheel.exact, rel=1e-11)
    assert sizing.balance is not None
    assert expected.balance is not None
    assert sizing.balance.value == pytest.approx(expected.balance.value, rel=1e-11)
    assert sizing.reduced_inertia == pytest.approx(expected.reduced_inertia, rel=1e-11)


def test_whitworths_lever_and_ram():
    result = poses("whitworth")
    lever = np.unwrap(np.arctan2(0.12 * np.sin(PHI) + 0.05, 0.12 * np.cos(PHI)))
    ram = -0.09 * np.cos(lever) + np.sqrt(0.42**2 - (0.09 * np.sin(lever)) ** 2)
    assert result.angle("lever").value == pytest.approx(lever, abs=1e-12)
    assert result.point("ram", (0.0, 0.0)).value[0] == pytest.approx(ram, abs=1e-12)


def test_whitworths_return_is_quick():
    level = math.asin(0.05 / 0.12)  # the lever lies along the ram's line at -level and pi + level of the crank
    forward = np.linspace(-level, math.pi + level, 181)[1:-1] % TURN
    assert (poses("whitworth", np.sort(forward)).point("ram", (0.0, 0.0)).rate[0] > 0).all()
    assert math.degrees(math.pi + 2 * level) == pytest.approx(229, abs=0.5)


def test_the_geared_cranks_carry_the_ram_along_a_line():
    ram = poses("geared_five_bar").point("right_rod", (0.45, 0.0)).value
    depth = 0.07 * np.sin(PHI) - np.sqrt(0.45**2 - (0.16 - 0.07 * np.cos(PHI)) ** 2)
    assert ram[0] == pytest.approx(np.zeros_like(PHI), abs=1e-12)
    assert ram[1] == pytest.approx(depth, abs=1e-12)


@pytest.mark.slow
def test_the_cam_swings_the_bell_crank_by_a_cycloid():
    result = poses("cam_press")
    rise, dwell, fall = (math.radians(angle) for angle in (120.0, 30.0, 90.0))

    def cycloid(u: NDArray[np.float64]) -> NDArray[np.float64]:
        inside = np.clip(u, 0.0, 1.0)
        return inside - np.sin(TURN * inside) / TURN

    swing = math.radians(16.0)
    angle = swing * (0.5 - cycloid(PHI / rise) + cycloid((PHI - rise - dwell) / fall))
    assert result.angle("bell_crank").value == pytest.approx(angle, abs=1e-12)
    sideways = 0.22 + 0.2 * np.cos(angle) - 0.42
    ram = 0.2 * np.sin(angle) - np.sqrt(0.26**2 - sideways**2)
    assert result.point("ram", (0.0, 0.0)).value[1] == pytest.approx(ram, abs=1e-12)


def test_the_crusher_keeps_its_lengths_and_does_the_work_of_its_stroke():
    result = poses("six_bar")
    ends = [
        ("pitman", (-0.1, -1.05), (-0.56, 0.3), 0.48, 0.1),
        ("jaw", (0.0, 0.0), (0.62, 1.35), 0.0, 0.0),
    ]
    for body, at, fixed, along, across in ends:
        gap = result.point(body, at).value - np.array(fixed)[:, None]
        assert np.hypot(*gap) == pytest.approx(np.full(PHI.size, math.hypot(along, across)), abs=1e-12)
    gap = result.point("jaw", (-0.02, -1.05)).value - result.point("pitman", (0.06, -1.05)).value
    assert np.hypot(*gap) == pytest.approx(np.full(PHI.size, math.hypot(0.52, 0.1)), abs=1e-12)
    face = poses("six_bar", np.linspace(0.0, TURN, 5001)).point("jaw", (0.12, -0.7)).value[0]
    sized = flywheel.size(scene("six_bar"), simulate=False)
    assert sized.balance is not None
    assert sized.balance.value * TURN == pytest.approx(450e3 * np.ptp(face), rel=1e-6)


def toggled(phi: NDArray[np.float64]) -> tuple[NDArray[np.complex128], ...]:
    """Crank pin, knee and ram of the toggle press, by two circles: knee from pin and head, ram from the knee."""
    pin = complex(-0.9, -0.35) + 0.11 * np.exp(1j * phi)
    along = (0.79**2 - 0.35**2 + abs(pin) ** 2) / (2 * abs(pin))
    knee = pin - pin / abs(pin) * (along - 1j * np.sqrt(0.79**2 - along**2))
    return pin, knee, 1j * (knee.imag - np.sqrt(0.4**2 - knee.real**2))


def test_the_toggle_stretches_at_the_bottom_of_the_stroke():
    result, (_, knee, ram) = poses("toggle_press"), toggled(PHI)
    assert result.point("rod", (0.79, 0.0)).value == pytest.approx(np.array([knee.real, knee.imag]), abs=1e-12)
    assert result.point("ram", (0.0, 0.0)).value == pytest.approx(np.array([ram.real, ram.imag]), abs=1e-12)
    assert ram.imag[0] == ram.imag.min() == pytest.approx(-0.75, abs=1e-12)
    assert np.ptp(ram.imag) == pytest.approx(0.151, abs=2e-4)
    falling = PHI.size // 2
    pressing = PHI[falling:][ram.imag[falling:] < -0.748]
    assert TURN - pressing[0] == pytest.approx(math.radians(38), abs=math.radians(2.5))


def test_the_motor_of_the_toggle_press_does_the_work_of_coining():
    sized = flywheel.size(scene("toggle_press"), simulate=False)
    assert sized.balance is not None
    work = 600e6 * 0.002**2 / 2  # of a force that rises by 600 MN/m over 2 mm
    assert sized.balance.value == pytest.approx(work / TURN / 9, rel=1e-9)
    assert sized.power == pytest.approx(work * 40 / 60, rel=1e-9)


@pytest.mark.slow
def test_the_flywheel_of_the_toggle_press_from_positions_alone():
    """Wittenbauer's I = [max(W - z+ w² I*/2) - min(W - z- w² I*/2)]/(eps w²), energies by differences of positions."""
    phi = np.linspace(0.0, TURN, 40001)
    pin, knee, ram = toggled(phi)
    centres = {140: 2 / 11 * pin, 75: pin + 38 / 79 * (knee - pin), 60: knee / 2, 66: (knee + ram) / 2, 320: ram}
    lines = {4.5: (knee - pin) / 0.79, 0.7: knee / 0.35, 1.0: (ram - knee) / 0.4}
    moving = [m * abs(np.gradient(z, phi, edge_order=2)) ** 2 for m, z in (centres | lines).items()]
    inertia = 2.4 + np.sum(moving, axis=0)
    assert flywheel.reduce(scene("toggle_press"), phi[::100]).inertia == pytest.approx(inertia[::100], rel=1e-6)

    height = sum(m * z.imag for m, z in centres.items())
    depth = np.maximum(-0.748 - ram.imag, 0.0)
    coining = 300e6 * np.where(phi > math.pi, depth**2, 0.0)  # done while the ram goes down, before phi = 360 deg
    work = coining[-1] / TURN * phi - coining - 9.80665 * (height - height[0])
    square, eps = (40 / 60 * TURN) ** 2, 0.15
    above, below = (work - (1 + sign * eps / 2) ** 2 * square * inertia / 2 for sign in (1, -1))
    expected = (above.max() - below.min()) / (eps * square) / 9**2
    sized = flywheel.size(scene("toggle_press"), simulate=False)
    assert sized.flywheel.exact == pytest.approx(expected, rel=1e-6)


# The examples of methods run, and what they print is true: root finding counted, the two-link arm.


mpl.use("Agg")


@pytest.fixture(scope="module")
def roots():
    return runpy.run_path(str(EXAMPLES / "root_finding" / "positions.py"), run_name="example")


@pytest.mark.parametrize("a4", [-60.0, 40.0, 190.0, 222.0])
def test_three_methods_find_the_root_of_30_digits(roots, a4):
    f, _, beta = roots["loop"](a4)
    with mp.workdps(30):
        d = mp.hypot(a4, 140)
        angle = mp.acos((d**2 + mp.mpf(167.63) ** 2 - 95**2) / (2 * d * mp.mpf(167.63)))
        true = mp.atan2(140, -a4) + angle
    assert roots["exact"](a4) == pytest.approx(float(true), abs=1e-13)
    bisected, regula, newton = roots["compare"](a4)
    assert bisected.root == pytest.approx(float(true), abs=1e-8)
    assert newton.root == pytest.approx(float(true), abs=1e-13)
    assert regula.root == pytest.approx(float(true), abs=1e-6 if a4 > 200 else 1e-8)
    assert bisected.count == 29  # pi/2^29 is the first step below 1e-8
    assert newton.count < regula.count <= (bisected.count if a4 < 200 else 300)
    assert f(beta) < 0 < f(beta + pi)


def test_the_clamps_printed_angle_at_full_stretch(roots):
    """theta2 = 2.83967 and theta3 = 1.89156 go with the printed theta6 = 0 and s = 480 mm."""
    root = roots["compare"](190.0)[2].root
    assert root == pytest.approx(2.83967, abs=5e-6)
    assert roots["third"](190.0, root) == pytest.approx(1.89156, abs=5e-6)


def test_newton_squares_its_error(roots):
    f, slope, beta = roots["loop"](190.0)
    root = roots["exact"](190.0)
    ratios = [ratio for _, ratio in roots["squares"](roots["newton"](f, slope, beta + 2.0).path, root)]
    bend = 2 * 167.63 * (-190.0 * mp.cos(root) + 140 * mp.sin(root))
    assert len(ratios) >= 4
    assert ratios[-1] == pytest.approx(float(abs(bend / (2 * slope(root)))), rel=1e-3)


def test_methods_refuse_what_they_cannot_do(roots):
    with pytest.raises(ValueError, match="no bracket"):
        roots["bisection"](lambda x: x * x + 1, 0.0, 1.0)
    with pytest.raises(ArithmeticError, match="level"):
        roots["newton"](lambda x: x * x + 1, lambda x: 2 * x, 0.0)
    with pytest.raises(ArithmeticError, match="no root within 1000 steps"):
        roots["newton"](lambda x: x * x + 1, lambda x: 2 * x, 0.7)
    assert roots["bisection"](lambda x: x, -1.0, 1.0).root == 0.0


def test_the_printed_table(roots, capsys):
    roots["main"]()
    printed = capsys.readouterr().out
    assert printed.count("    29 ") >= 7
    assert "Newton: each error 0.5000 of the last" in printed
    assert printed.count("the other one") == 2
    assert "1.761422 rad, the other assembly's 0.570387 rad" in printed


@pytest.mark.slow
def test_two_motors_bring_the_circle_about(tmp_path, capsys):
    example = runpy.run_path(str(EXAMPLES / "robot" / "five_bar.py"), run_name="example")
    picture = tmp_path / "five_bar.png"
    example["main"](picture)
    printed = capsys.readouterr().out

    def figure(after: str) -> float:
        return float(printed.partition(after)[2].split()[0].rstrip(",;"))

    assert figure("virtual powers and Newton-Euler differ by ") < 1e-13
    assert figure("followed by simulation to ") < 1e-8
    assert figure("work of the motors against energy: ") < 1e-8
    assert figure("kept to ") < 1e-9
    assert "torques: left 4.8010 N m, right 4.8010 N m" in printed  # alike by symmetry
    assert picture.stat().st_size > 10_000


@pytest.mark.slow
def test_the_arm_keeps_its_energy_and_its_plan(tmp_path, capsys):
    example = runpy.run_path(str(EXAMPLES / "robot" / "two_link.py"), run_name="example")
    picture = tmp_path / "arm.png"
    example["main"](picture)
    printed = capsys.readouterr().out
    assert "c2*l1*m2*sin(q1(t) - q2(t))*Derivative(q2(t), t)**2" in printed
    kept = float(printed.partition("energy kept to ")[2].split()[0])
    followed = float(printed.partition("simulation to ")[2].split()[0])
    assert kept < 1e-9
    assert followed < 1e-8
    work, gained = (float(printed.partition(key)[2].split()[0]) for key in ("work of the torques ", "energy gained "))
    assert work == pytest.approx(gained, abs=2e-6)
    assert picture.stat().st_size > 10_000


# What the README, the reference and the index of the examples show runs as it stands, and what they link to is there.


ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "CONTRIBUTING.md", "examples/README.md", "tests/benchmarks/README.md", "tests/extremes/README.md")
README_SCRIPTS = (
    "README.md",
    "flywheel/reference/library.md",
    "flywheel/reference/joints.md",
    pytest.param("flywheel/reference/bond-graphs.md", marks=pytest.mark.slow),
)
LINKS = [
    (page, path) for page in PAGES for path in set(re.findall(r"\]\(([^)#:]+)\)", (ROOT / page).read_text(encoding="utf-8")))
]


@pytest.mark.parametrize("page", README_SCRIPTS)
def test_the_python_of_a_page_runs_as_it_stands(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, page, "exec"), {})
    assert capsys.readouterr().out


def test_the_readme_is_short_and_shows_the_summary_that_size_prints(monkeypatch: pytest.MonkeyPatch) -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    monkeypatch.chdir(ROOT)
    summary = CliRunner().invoke(main, ["size", "examples/machines/press.toml"])
    assert summary.exit_code == 0
    assert f"```\n{summary.stdout}```\n" in readme
    assert len(readme.splitlines()) <= 200


COMMANDS = [
    line
    for block in re.findall(r"```sh\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    for line in block.splitlines()
    if line.startswith("flywheel ") and not line.startswith("flywheel open")
]


@pytest.mark.parametrize("command", sample(sorted(COMMANDS, key=len), 4))
def test_a_command_of_the_readme_runs_as_typed(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A table of motors with its first few and its last few alone, of which each takes seconds."""
    monkeypatch.chdir(tmp_path)
    examples = Path(shutil.copytree(ROOT / "examples", tmp_path / "examples"))
    motors = examples / "drive_lines/motors.csv"
    rows = motors.read_text("utf-8").splitlines(keepends=True)
    motors.write_text("".join((*rows[:6], *rows[14:18], *rows[-2:])), "utf-8")
    result = CliRunner().invoke(main, shlex.split(command)[1:])
    assert result.exit_code == 0, result.output


@pytest.mark.parametrize(("page", "path"), sorted(LINKS))
def test_every_link_leads_somewhere(page: str, path: str) -> None:
    assert ((ROOT / page).parent / path).exists()


NAMED = re.findall(r"`([a-z_/]+\.py)`, `([\w.]+)`", (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("module", "name"), NAMED)
def test_what_the_guide_names_is_where_it_says(module: str, name: str) -> None:
    package = "" if module.startswith("bondgraph/") else "flywheel."
    result = import_module(package + module.removesuffix(".py").replace("/", "."))
    owner, _, last = name.rpartition(".")
    place = attrgetter(owner)(result) if owner else result
    assert hasattr(place, last) or last in place.__annotations__


def test_every_example_is_in_the_index_with_a_picture() -> None:
    index = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\]\(([^)#:]+)\)", index))
    result = {
        path.relative_to(ROOT / "examples").as_posix()
        for kind in ("*/*.py", "*/*.toml")
        for path in (ROOT / "examples").glob(kind)
    }
    assert result - linked == set()
    for line in index.splitlines():
        if line.startswith("| [") and ".toml)" in line:
            assert "![" in line


# The iterated dimensioning agrees with itself: sections, masses and reactions of its last round belong together.


SCRIPT = Path(__file__).parents[2] / "examples" / "joint_forces" / "dimensioning.py"


@pytest.fixture(scope="module")
def run():
    """Its names, and what it prints, run as it stands."""
    with redirect_stdout(StringIO()) as printed:
        return runpy.run_path(str(SCRIPT), run_name="__main__"), printed.getvalue


@pytest.fixture(scope="module")
def example(run):
    return run[0]


@pytest.fixture(scope="module")
def rounds(example):
    return example["rounds"]


@pytest.mark.slow
def test_every_bar_is_used_to_its_limit(example, rounds):
    sides = rounds[-1].sides
    result = example["analysed"](sides)
    for name, side in sides.items():
        normal, moment = example["strained"](result, name, example["DENSITY"] * side**2)
        use = (
            example["stress"](normal, moment, side) / example["ALLOWABLE"],
            example["thrust"](normal, side, example["LENGTHS"][name]),
        )
        assert max(use) == pytest.approx(1.0, abs=3e-6), name


@pytest.mark.slow
def test_it_ends_at_the_same_bars_from_thick_ones(example, rounds):
    other = example["dimensioned"](dict.fromkeys(example["LENGTHS"], 0.02))
    for name, mass in rounds[-1].masses.items():
        assert other[-1].masses[name] == pytest.approx(mass, rel=1e-5)
    assert len(rounds) >= 5
    assert rounds[-1].masses["crank"] > 1.05 * rounds[0].masses["crank"]


def test_bending_at_the_bars_first_pins_is_the_torque_there(example, rounds):
    """Bending summed from the far end equals the driving torque, zero in the coupler, and the load."""
    sides = rounds[-1].sides
    result = example["analysed"](sides)
    torques = {"crank": -result.action, "coupler": 0.0 * result.action, "rocker": -example["against"](result.poses)}
    joints = {"crank": ("pivot", 1.0), "coupler": ("crank_pin", 1.0), "rocker": ("rocker_pivot", 1.0)}
    for name, side in sides.items():
        normal, moment = example["strained"](result, name, example["DENSITY"] * side**2)
        np.testing.assert_allclose(moment[0], torques[name], rtol=0, atol=1e-9 * 120)
        joint, sign = joints[name]
        axis = np.exp(1j * result.poses.angle(name).value)
        held = -sign * ((result.forces[joint][0] + 1j * result.forces[joint][1]) / axis).real
        np.testing.assert_allclose(normal[0], held, rtol=0, atol=1e-9 * np.abs(held).max())


def test_it_prints_its_rounds(run):
    printed = run[1]()
    assert "coupler (mm, kg)" in printed
    assert printed.count(" % of the thrust allowed") == 3


CLAMP = Path(__file__).parents[2] / "examples" / "joint_forces" / "injection_clamp.py"
STROKE = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.py"


@pytest.fixture(scope="module")
def clamp():
    return runpy.run_path(str(CLAMP), run_name="example")


@pytest.fixture(scope="module")
def stroke():
    return runpy.run_path(str(STROKE), run_name="example")


def test_the_clamps_reactions_are_those_of_13_equations_by_hand(clamp):
    a4 = np.array([-60.0, -36.0, 14.0, 82.0, 130.0, 190.0])
    ours, by_hand = clamp["by_library"](a4), clamp["by_newton"](clamp["Clamp"](), a4)
    for joint, force in by_hand.items():
        np.testing.assert_allclose(ours[joint], force, rtol=0, atol=1e-10 * np.abs(force).max(), err_msg=joint)


def test_the_sources_differences_are_averaged_again(clamp):
    means = [clamp["told"](joint)[1].mean() for joint in clamp["JOINTS"]]
    assert means == pytest.approx([5.86, 8.36, 11.69, 17.66, 3.12], abs=0.005)
    assert [clamp["told"](joint)[0].size for joint in clamp["JOINTS"]] == [27, 27, 25, 27, 27]
    assert max(clamp["told"](joint)[1].max() for joint in clamp["JOINTS"]) == pytest.approx(66.997, abs=1e-3)


@pytest.mark.slow
def test_the_clamps_table_and_figures_without_the_other_program(clamp, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "exudyn", None)
    clamp["main"](str(tmp_path / "clamp.png"))
    printed = capsys.readouterr().out
    assert "a3       17.65   17.66   62.51 (102)" in printed
    assert printed.count("\n     -53 ") == 3  # rows of that position; beside rounding it may stand as well
    assert "Exudyn is not installed: its column is left out" in printed
    assert {path.stem for path in tmp_path.glob("*.png")} == {f"clamp_{n}" for n in ("together", "singly", "differences")}


@pytest.mark.slow
def test_the_clamps_reactions_by_another_program(clamp):
    pytest.importorskip("exudyn")
    a4 = np.arange(-50.0, 191.0, 20.0)
    by_hand = clamp["by_newton"](clamp["Clamp"](), a4)
    stepped = clamp["by_exudyn"](clamp["Clamp"](), a4)
    for joint, force in by_hand.items():
        np.testing.assert_allclose(stepped[joint], force, rtol=0, atol=2e-6 * np.abs(force).max(), err_msg=joint)


def test_the_clamps_motion_is_that_of_its_loops_by_hand(clamp, stroke):
    a4 = np.array([-60.0, 40.0, 190.0])
    links, centres = stroke["course"](a4)
    for k, x in enumerate(a4):
        at = clamp["place"](clamp["Clamp"](), 1e-3 * x)
        names = ("theta3", "theta2", "theta6")
        assert [links[name].velocity[k] for name in names] == pytest.approx(at.rates, abs=1e-10)
        assert [links[name].acceleration[k] for name in names] == pytest.approx(at.alphas, abs=1e-9)
        for curve, centre in zip(centres.values(), at.centres, strict=True):
            assert 1e-3 * curve.acceleration[:, k] == pytest.approx([centre.real, centre.imag], abs=1e-10)
        assert links["s"].position[k] == pytest.approx(1e3 * at.platen.real, abs=1e-9)


def test_the_clamps_read_out_has_two_misprints(stroke, capsys):
    stroke["main"]()
    printed = capsys.readouterr().out
    wrong = [line.split() for line in printed.splitlines() if "MISPRINT" in line]
    assert [(line[0], line[-1]) for line in wrong] == [("theta2", "-0.0037"), ("theta5", "-0.0193")]
    assert printed.count("  cut off") == 4
    assert "-344.800 and -943.597, the other sign" in printed


@pytest.mark.slow
def test_the_clamps_motion_is_drawn(stroke, tmp_path):
    stroke["plot"](tmp_path / "clamp.png")
    assert len(list(tmp_path.glob("clamp_*.png"))) == 4
