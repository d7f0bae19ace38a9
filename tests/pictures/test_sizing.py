"""Diagrams of a sizing: turning moment, work, power, reduction, transients."""

from __future__ import annotations

import re
from ast import literal_eval
from functools import cache
from html import escape
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch

import flywheel
from flywheel import SceneError, Sizing, language, transient
from flywheel.cli import main
from flywheel.machine.equation import NoMotionError
from flywheel.page import data as page_data
from flywheel.pictures import form, forms
from flywheel.pictures import sizing as plots
from flywheel.pictures.animation import Timing, timing
from flywheel.pictures.diagrams import DIAGRAMS, DiagramKind
from flywheel.pictures.figures import BLUE, PURPLE
from flywheel.pictures.forms import Diagram, DiagramCurve, DiagramData, DiagramRow, ExtremeMark, along_motion, part_of
from flywheel.pictures.kinematics import draw_reduction, draw_transient, plot_transient
from flywheel.pictures.power_flow import draw as draw_flow
from flywheel.pictures.power_flow import panel as power_panel
from flywheel.pictures.power_flow import plot as plot_flow
from flywheel.pictures.sketch import views
from flywheel.regime import turning_moment
from flywheel.tables import sizing as pages
from flywheel.tables.power import entries, input_power
from flywheel.tables.sizing import candidates
from tests import regimes
from tests.limits import sample
from tests.oracle.test_oracle import PRESS
from tests.pictures.test_sketch import CLAMP
from tests.regimes import GEARED, KLOSS, PUMP, SECTION_C, figures
from tests.scenes import press, rotor, shaper, yoke

# The pictures: what is drawn is there and right; how it looks was judged by eye.


AREAS = {"areas": {"values": [52, -124, 72], "scale": 10}, "regime": {"speed": 60}, "flywheel": {"irregularity": 0.02}}
KINDS: dict[str, dict[str, Any]] = {
    "slow yoke": yoke(),
    "fast yoke": yoke(regime={"speed": 100}),
    "press": press(),
    "long cycle": shaper(),
    "rotor": rotor(),
    "heavy rotor": rotor(inertia=[{"on": "crank", "value": 900}]),
    "analysis": yoke(flywheel={"inertia": 300}),
    "small irregularity": press(flywheel={"irregularity": 1e-9}),
    "areas": AREAS,
    "areas analysed": AREAS | {"flywheel": {"inertia": 50}},
    "zero areas": AREAS | {"areas": {"values": [0, 0], "scale": 1}},
    "nothing": {"regime": {"speed": 10}, "flywheel": {"irregularity": 0.01}},
    "section C": SECTION_C | {"flywheel": {"irregularity": 0.05}},
    "section C without a wheel": SECTION_C | {"flywheel": {"inertia": 0}},
    "press on an induction motor": KLOSS | {"flywheel": {"on": "motor", "irregularity": 0.04}},
    "pump with dampers": PUMP | {"flywheel": {"irregularity": 0.05}},
    "losses in a mesh": GEARED | {"flywheel": {"irregularity": 0.05}},
    "many areas": rotor(load=[{"on": "crank", "torque": "-100*sin(17*phi)"}]),
}


def sized(scene: dict[str, Any]) -> Sizing:
    return _sized(repr(scene))


@cache
def _sized(scene: str) -> Sizing:
    return flywheel.size(flywheel.load(literal_eval(scene)), simulate=False)


def drawn(scene: dict[str, Any]) -> Figure:
    return _drawn(repr(scene))


@cache
def _drawn(scene: str) -> Figure:
    return plots.draw(_sized(scene))


def texts(panel: Axes) -> list[str]:
    return [text.get_text() for text in panel.texts]


def words(line: Line2D) -> str:
    """Name of a line before its figures."""
    return str(line.get_label()).partition(" kg")[0].rpartition(" ")[0]


def labels(panel: Axes) -> list[str]:
    return [str(label) for label in panel.get_legend_handles_labels()[1]]


@pytest.mark.parametrize("kind", sample(KINDS, 8))
def test_five_panels_each_drawn_or_explained(kind: str) -> None:
    panels = drawn(KINDS[kind]).axes
    assert len(panels) == 5
    for panel in panels:
        assert panel.get_title()
        if panel.axison:
            assert panel.get_xlabel()
            assert panel.get_ylabel()
            assert panel.has_data()
        else:
            assert len(max(texts(panel), key=len)) > 30


@pytest.mark.parametrize("kind", sample(["nothing", "slow yoke", "areas"], 3))
def test_png_is_1600_by_1600(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "plot.png"
    plots.plot(sized(KINDS[kind]), path)
    header = path.read_bytes()[:24]
    assert header[:8] == b"\x89PNG\r\n\x1a\n"
    assert (int.from_bytes(header[16:20]), int.from_bytes(header[20:24])) == (1600, 1600)


@pytest.mark.slow
@pytest.mark.parametrize("ending", sample(["svg", "pdf", "PNG"], 3))
def test_the_same_picture_is_the_same_file(ending: str, tmp_path: Path) -> None:
    sizing = sized(yoke())
    first, second = tmp_path / f"a.{ending}", tmp_path / f"b.{ending}"
    plots.plot(sizing, first)
    plots.plot(sizing, second)
    assert first.read_bytes() == second.read_bytes()
    assert first.stat().st_size > 10_000


def test_the_balance_is_told() -> None:
    assert "balance: drive = 159.15 N m" in labels(drawn(yoke()).axes[0])


def test_what_is_off_the_scale_is_named_with_its_extent() -> None:
    scene = rotor(load=[{"on": "crank", "torque": "-1000 + 5*sin(phi)"}])
    assert "resisting: −1005 to −995 N m, off the scale" in labels(drawn(scene).axes[0])


@pytest.mark.slow
def test_a_net_moment_that_is_all_rounding_is_drawn_as_zero() -> None:
    """Three loads cancel but for their last digits: M* and W are straight lines at zero beside what drives and resists."""
    loads = [{"on": "crank", "torque": f"{value}*(1 + 0.3*sin(phi))"} for value in (-100.1, 33.3, 66.8)]
    figure = drawn(rotor(load=loads))
    moment = {str(line.get_label()): np.asarray(line.get_ydata()) for line in figure.axes[0].get_lines()}
    assert not moment["M*, net"].any()
    assert moment["driving"].max() == pytest.approx(130.13, rel=1e-4)
    assert moment["resisting"].min() == pytest.approx(-130.13, rel=1e-4)
    panel = next(panel for panel in figure.axes if "W, sum of the areas" in labels(panel))
    work = next(line for line in panel.get_lines() if line.get_label() == "W, sum of the areas")
    assert not np.asarray(work.get_ydata()).any()
    assert not any("greatest" in text for text in labels(panel))


def test_shaded_areas_add_up() -> None:
    sizing = sized(press())
    assert sizing.machine is not None
    assert sizing.cycle is not None
    samples = part_of(sizing.scene, sizing.machine, sizing).samples
    for area in sizing.areas:
        inside = (samples.phi >= area.start) & (samples.phi <= area.end)
        positive = np.maximum(np.sign(area.work) * samples.moment[inside], 0.0)
        work = np.sign(area.work) * np.trapezoid(positive, samples.phi[inside])
        assert work == pytest.approx(area.work, rel=1e-3)


def test_a_jump_is_a_vertical_line() -> None:
    sizing = sized(press())
    assert sizing.machine is not None
    assert sizing.cycle is not None
    samples = part_of(sizing.scene, sizing.machine, sizing).samples
    at = samples.phi == sizing.cycle.mesh.edges[np.abs(sizing.cycle.mesh.edges - np.radians(300)).argmin()]
    values = samples.moment[at]
    assert values.size == 2
    assert abs(values[1] - values[0]) > 1000.0


def test_bodies_stack_to_the_total() -> None:
    sizing = sized(press())
    assert sizing.machine is not None
    assert sizing.cycle is not None
    inertia = page_data.answer(sizing, {"panels": ["inertia"]})["inertia"]
    parts = {body["name"]: np.array(body["values"]) for body in inertia["bodies"]}
    assert set(parts) == {"press.crank", "press.rod", "press.slider"}
    np.testing.assert_allclose(sum(parts.values()), inertia["total"], rtol=1e-9)
    named = ["crank (press)", "rod (press)", "slider (press)", "I*, from 0.15 to 0.72319 kg m²"]
    assert labels(drawn(press()).axes[2]) == named


OF_MOTION = [
    "section C",
    "section C without a wheel",
    "press on an induction motor",
    "pump with dampers",
    "losses in a mesh",
]


@pytest.mark.parametrize(
    "kind", sample(["slow yoke", "fast yoke", "press", "long cycle", "analysis", "rotor", "heavy rotor", *OF_MOTION], 4)
)
def test_tangents_touch_the_loop_and_meet_at_the_flywheel(kind: str) -> None:
    sizing = sized(KINDS[kind])
    assert sizing.machine is not None
    assert sizing.cycle is not None
    assert sizing.run is not None
    samples = along_motion(part_of(sizing.scene, sizing.machine, sizing))
    loop = forms.loop(sizing.cycle, samples, sizing.speed, sizing.run)
    scale = np.ptp(loop.energy) + loop.inertia.max()
    above = loop.intercept_fast + loop.slope_fast * loop.inertia - loop.energy
    below = loop.energy - loop.intercept_slow - loop.slope_slow * loop.inertia
    assert above.min() >= -1e-9 * scale
    assert below.min() >= -1e-9 * scale
    for contact, slope, intercept in (
        (loop.contact_fast, loop.slope_fast, loop.intercept_fast),
        (loop.contact_slow, loop.slope_slow, loop.intercept_slow),
    ):
        assert contact[1] == pytest.approx(slope * contact[0] + intercept, abs=1e-9 * scale)
    segment = loop.intercept_fast - loop.intercept_slow
    assert segment == pytest.approx(2 * sizing.run.irregularity * sizing.run.inertia, rel=1e-8, abs=1e-9 * scale)
    x, y = loop.far_point
    assert y == pytest.approx(loop.slope_slow * x + loop.intercept_slow, rel=1e-8, abs=1e-8 * scale)


@pytest.mark.slow
def test_the_loop_panel_names_its_points_and_tangents() -> None:
    """The yoke of p. 103: I = 353.52 kg m², so MN = 2 eps I, far from I* = 5 kg m²."""
    assert {"M", "N", "ψmax", "ψmin", "90°"} <= set(re.findall(">([^<]+)</text>", plots.panel(sized(yoke()), "wittenbauer")))
    panel = drawn(yoke()).axes[3]
    output = " ".join(labels(panel))
    assert "I = MN/(2 ε) = 353.52 kg m²" in output
    assert "I* = −353.52 kg m²" in output
    assert "tan ψmax = 1.0404" in output
    assert (panel.get_ylabel(), panel.child_axes[0].get_ylabel()) == ("work W, J", "F = 2 W/ω², kg m²")


def test_a_constant_reduced_inertia_has_no_loop_but_a_sentence() -> None:
    """A rotor: the flywheel is the fluctuation of energy over eps w², less I*."""
    sizing = sized(rotor())
    panel = drawn(rotor()).axes[3]
    assert not panel.axison
    (output,) = texts(panel)
    assert "I* is constant" in output
    assert f"− I* = {sizing.flywheel.exact:.5g} kg m²" in output


@pytest.mark.slow
def test_speed_stays_in_the_band_with_the_exact_flywheel_alone() -> None:
    sizing = sized(yoke(regime={"speed": 100}))
    panel = plots.draw(sizing).axes[4]
    lines = {words(line): np.asarray(line.get_ydata(), dtype=float) for line in panel.lines}
    low, high = (sizing.speed * (1 + side * 0.02) * 30 / np.pi for side in (-1, 1))
    assert lines["exact"].min() == pytest.approx(low, rel=1e-4)
    assert lines["exact"].max() == pytest.approx(high, rel=1e-4)
    assert lines["by the areas"].max() > 1.2 * high
    assert "required band, ±2 %" in labels(panel)


def test_small_fluctuations_are_drawn_about_the_mean() -> None:
    panel = drawn(KINDS["small irregularity"]).axes[4]
    assert "− 120 rpm" in panel.get_ylabel()
    assert np.abs(panel.lines[-3].get_ydata()).max() < 1e-6


def test_no_steady_motion_is_said_in_the_legend(monkeypatch: pytest.MonkeyPatch) -> None:
    sizing = sized(yoke())

    def stops(*_: object) -> None:
        raise NoMotionError

    monkeypatch.setattr(turning_moment, "run", stops)
    assert sum("no steady motion" in label for label in labels(plots.draw(sizing).axes[4])) == 2


def test_areas_scene_draws_bars_sums_and_speeds() -> None:
    figure = drawn(AREAS)
    heights = sorted(bar.get_height() for bar in figure.axes[0].patches)
    assert heights == pytest.approx([-1240, 520, 720])
    np.testing.assert_allclose(figure.axes[1].lines[0].get_ydata(), [0, 520, -720, 0])
    assert [label[:12] for label in labels(figure.axes[1])] == ["greatest: S1", "least: S2 = "]
    assert texts(figure.axes[0]) == ["+520 J", "−1240 J", "+720 J"]
    assert "ΔW = 1240 J" in texts(figure.axes[1])
    speeds = np.asarray(figure.axes[4].lines[-1].get_ydata(), dtype=float) * np.pi / 30
    assert speeds.max() == pytest.approx(60.6)
    assert speeds.min() == pytest.approx(59.4)


@pytest.mark.parametrize("kind", sample(OF_MOTION, 4))
def test_torques_that_depend_on_speed_are_drawn_at_constant_speed_and_along_the_motion(kind: str) -> None:
    panel = drawn(KINDS[kind]).axes[0]
    assert "at a constant" in panel.get_title()
    lines = {str(line.get_label()): np.asarray(line.get_xydata(), dtype=float) for line in panel.lines}
    for label in ("M*, net", "M* along the motion"):
        phi, moment = lines[label].T
        work = np.trapezoid(moment, np.radians(phi))  # both close: at that speed, and along the motion
        assert abs(work) < 1e-3 * np.trapezoid(np.abs(moment), np.radians(phi))
    along = np.interp(lines["M*, net"][:, 0], *lines["M* along the motion"].T)
    assert np.abs(along - lines["M*, net"][:, 1]).max() > 1e-3 * np.ptp(along)
    assert "at a constant" not in drawn(yoke()).axes[0].get_title()


def test_speeds_of_candidates_are_those_of_their_own_motions() -> None:
    sizing = sized(SECTION_C | {"flywheel": {"irregularity": 0.4}})
    panel = plots.draw(sizing).axes[4]
    lines = {words(line): np.asarray(line.get_ydata(), dtype=float) for line in panel.lines}
    for candidate, key in zip(candidates(sizing)[:2], ("exact", "by the areas"), strict=True):
        given = sized(SECTION_C | {"flywheel": {"inertia": candidate.inertia}})
        assert given.run is not None
        assert lines[key].max() == pytest.approx(given.run.speed_max * 30 / np.pi, rel=1e-5)
        assert lines[key].min() == pytest.approx(given.run.speed_min * 30 / np.pi, rel=1e-5)


def test_a_number_of_an_area_stands_where_there_is_room() -> None:
    sizing = sized(rotor(load=[{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}]))
    assert sizing.machine is not None
    assert sizing.cycle is not None
    samples = part_of(sizing.scene, sizing.machine, sizing).samples
    centre, room = forms.roomiest(samples, 0.0, np.pi, -1.0, 0.3)
    assert centre == pytest.approx(np.pi / 2, abs=0.05)
    assert room == pytest.approx(50.0)
    assert forms.roomiest(samples, 0.0, 0.1, -1.0, 0.3)[1] == 0.0


def test_what_drives_and_what_resists_are_drawn_beside_their_sum() -> None:
    """The yoke of p. 103: a drive of 500/pi N m against 1000 sin phi /2 over half a turn; a weight does no work."""
    panel = drawn(yoke(gravity={"direction": 0})).axes[0]
    found = {str(line.get_label()).partition(",")[0]: np.asarray(line.get_xydata(), dtype=float) for line in panel.lines}
    drives, resists, both = found["driving"], found["resisting"], found["M*"]
    assert drives[:, 1] == pytest.approx(500 / np.pi, rel=1e-9)
    phi = np.radians(resists[:, 0])
    load = np.where(phi <= np.pi, -500 * np.sin(phi), 0.0) - 0.5 * 20 * 9.80665 * np.sin(phi)
    np.testing.assert_allclose(resists[:, 1], load, atol=1e-6)
    np.testing.assert_allclose(drives[:, 1] + resists[:, 1], both[:, 1], atol=1e-9)


# -- single panels -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_panel_stands_in_a_page_with_its_texts_as_texts() -> None:
    """Title and description are there for screen readers, ids are its own, and no letter is a path."""
    drawn = plots.panel(sized(yoke()), "moment", name="first")
    root = ElementTree.fromstring(drawn)
    output = ["".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {
        "Turning moment and its areas",
        "crank angle φ, deg",
        "reduced moment M*, N m",
        "driving",
        "A1",
        "A2",
        "A3",
    } <= set(output)
    assert root.get("aria-labelledby") == "first-title first-desc"
    assert root.findtext("{http://www.w3.org/2000/svg}title") == "Turning moment and its areas"
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    assert len(ids) == len(set(ids))
    assert all(str(name).startswith("first-") for name in ids)
    assert set(re.findall(r'(?:href="#|url\(#)([^")]+)', drawn)) <= set(ids)
    assert drawn == plots.panel(sized(yoke()), "moment", name="first")
    assert len(drawn) < 60_000


def test_the_words_of_a_panel_name_each_area_also_where_only_areas_are_given() -> None:
    about = plots.description(sized(AREAS), "moment")
    assert about.endswith(": A1 = +520 J, A2 = −1240 J, A3 = +720 J.")
    many = plots.description(sized(AREAS | {"areas": {"values": [5, -5] * 20, "scale": 1}}), "moment")
    assert "A1 = +5 J, A2 = −5 J" in many
    assert many.endswith("J ....")


@pytest.mark.slow
def test_works_in_the_picture_are_those_of_the_table() -> None:
    sizing = sized(yoke())
    table = {line.split()[0]: line.split() for line in pages.text(sizing).splitlines() if re.match(r"  A\d", line)}
    drawn = re.findall(r">([+−][\d.]+) J<", plots.panel(sizing, "moment"))
    written = [f"{float(table[f'A{k}'][3]):+.5g}".replace("-", "−") for k in (1, 2, 3)]
    assert sorted(drawn) == sorted(written)


@pytest.mark.slow
def test_a_panel_for_print_has_no_colour_and_one_in_spanish_its_decimal_comma() -> None:
    with language.use("es"):
        drawn = plots.panel(sized(yoke()), "work", form="print")
    colours = set(re.findall(r"#([0-9a-f]{6})", drawn))
    assert all(colour[:2] == colour[2:4] == colour[4:] for colour in colours)
    assert "trabajo acumulado W, J" in drawn
    assert re.search(r"ΔW = \d+,\d+ J", drawn)


def test_a_drive_that_brakes_is_drawn_below_zero() -> None:
    """A rotor that is pushed throughout: its drive holds it back, and resists."""
    scene = rotor(drive={"torque": "balance"}, load=[{"on": "crank", "torque": "100*(1 + sin(phi))"}])
    panel = drawn(scene).axes[0]
    lines = {str(line.get_label()): np.asarray(line.get_xydata(), dtype=float).T for line in panel.lines}
    np.testing.assert_allclose(lines["resisting"][1], -100.0, rtol=1e-12)
    np.testing.assert_allclose(lines["driving"][1], 100 * (1 + np.sin(np.radians(lines["driving"][0]))), atol=1e-9)
    assert "the drive brakes" in labels(panel)


# The Sankey diagram: widths to scale, nothing left out, names apart, power that goes backwards drawn backwards.


LONG = {
    "title": "A press whose train is long and whose title is longer: motor, belt, flywheel shaft, two more shafts, crank",
    "shafts": {
        "motor": {"on": "flywheel-shaft", "ratio": 2.5, "efficiency": 0.96, "slip": "2 %", "drag": 0.5},
        "flywheel-shaft": {"on": "first-intermediate", "ratio": 2, "efficiency": 0.985, "drag": 1.5},
        "first-intermediate": {"on": "second-intermediate", "ratio": 2, "efficiency": 0.975},
        "second-intermediate": {"ratio": 2.2, "efficiency": 0.97},
        "fan": {"on": "flywheel-shaft", "ratio": 1.5, "slip": "1 %", "efficiency": 0.9999},
        "feed": {"ratio": 0.5, "efficiency": 0.8},
    },
    "mechanism": PRESS["mechanism"],
    "inertia": [{"on": "motor", "value": 0.02}],
    "load": [
        {"on": "slider", "force": "-40 kN", "from": "290 deg", "to": "350 deg"},
        {"on": "fan", "torque": "-0.0002*omega*abs(omega)"},
        {"on": "feed", "torque": "-20 N m"},
        {"on": "crank", "model": {"type": "losses", "proportional": "0.15 N m s"}},
    ],
    "damper": [{"on": "slider", "coefficient": "40 N s/m"}],
    "drive": {"on": "motor", "torque": "60 - 0.3*omega"},
    "flywheel": {"on": "flywheel-shaft", "inertia": 2.0},
}

SERIES = {
    "shafts": {
        "flywheel": {"ratio": 6, "efficiency": 0.97},
        "motor": {"on": "flywheel", "ratio": 4, "efficiency": 0.96},
    },
    "inertia": [{"on": "flywheel", "value": 0.4}, {"on": "motor", "value": 0.02}],
    "load": [{"on": "crank", "torque": "-900 N m", "from": "100 deg", "to": "160 deg"}],
    "drive": {"on": "motor", "torque": "balance"},
    "regime": {"speed": 8},
    "flywheel": {"on": "flywheel", "irregularity": 0.1},
}


@pytest.fixture(scope="module")
def long():
    return flywheel.size(flywheel.load(LONG), simulate=False).power_flow


def bands(made, colour):
    return [p for p in made.axes[0].patches if isinstance(p, PathPatch) and to_hex(p.get_facecolor()).upper() == colour]


def overlaps(made):
    """Pairs of names of which one lies upon another by more than a pixel."""
    made.draw_without_rendering()
    texts = [text for text in made.axes[0].texts if text.get_text()]
    boxes = np.array([text.get_window_extent().extents for text in texts])
    low, high = boxes[:, None, :2], boxes[:, None, 2:]
    depth = np.minimum(high, boxes[None, :, 2:]) - np.maximum(low, boxes[None, :, :2])
    upon = np.triu((depth > 1.0).all(axis=-1), 1)
    return [(texts[i].get_text(), texts[j].get_text()) for i, j in np.argwhere(upon)]


@pytest.mark.parametrize(("at", "tongue"), [(5.5, "es"), pytest.param(None, "en", marks=pytest.mark.slow)])
def test_many_losses_and_long_names_find_room(long, at, tongue):
    with language.use(tongue):
        made = draw_flow(long, at)
        found = entries(long, at)
        assert overlaps(made) == []
        output = "".join(text.get_text() for text in made.axes[0].texts)
        flat = re.sub(r"\s", "", output)
        wanted = [entry for entry in found if entry.stream.kind not in ("shaft", "drive") and entry.power]
        assert len(wanted) > 12
        assert all(re.sub(r"\s", "", entry.label) in flat for entry in wanted)
    assert made.get_figwidth() < 22.0
    assert made.texts[0].get_text().split("\n")[0].endswith("…")


def test_widths_are_to_scale(long):
    made = draw_flow(long)
    trunk = max(bands(made, BLUE), key=lambda patch: np.ptp(patch.get_path().vertices[:, 0]))
    x, y = trunk.get_path().vertices.T
    left, right = np.ptp(y[x == x.min()]), np.ptp(y[x == x.max()])
    tool = max(stream.mean for stream in long.streams if stream.kind == "load")
    assert right / left == pytest.approx(tool / long.input, rel=1e-9)
    assert input_power(long, entries(long)) == pytest.approx(long.input, rel=1e-12)


def test_power_that_goes_backwards_is_drawn_backwards():
    case = regimes.CASES["dc-inductance"]
    scene = regimes.scene("dc-inductance", inertia=case.inertias[-1])
    flow = flywheel.size(flywheel.load(scene), simulate=False).power_flow
    motor = next(k for k, stream in enumerate(flow.streams) if stream.kind == "input")
    assert flow.at(2.0)[motor] < 0.0
    back = max(bands(draw_flow(flow, 2.0), PURPLE), key=lambda patch: np.ptp(patch.get_path().vertices[:, 0]))
    assert np.ptp(back.get_path().vertices[:, 0]) > 2.0
    assert not bands(draw_flow(flow), PURPLE)


def test_the_panel_of_a_page_keeps_its_texts(long, tmp_path):
    with language.use("es"):
        drawn = power_panel(long, at=1.0, form="print", name="flow")
    assert drawn.count("<text") > 30
    assert ">volante<" in drawn
    assert 'aria-labelledby="flow-title flow-desc"' in drawn
    assert not re.search(r"#[0-9a-f]*(?:0072b2|d55e00)", drawn)
    with form("print"):
        plot_flow(long, tmp_path / "flow.svg")
    assert "mesh" in (tmp_path / "flow.svg").read_text(encoding="utf-8")
    with pytest.raises(ValueError, match=r"\.png, \.svg or \.pdf"):
        long.plot(tmp_path / "flow.txt")
    assert long.plot().axes


def test_nothing_flows_where_nothing_acts():
    idle = {"inertia": [{"on": "crank", "value": 1}], "regime": {"speed": 5}, "flywheel": {"inertia": 1}}
    flow = flywheel.size(flywheel.load(idle), simulate=False).power_flow
    assert [text.get_text() for text in draw_flow(flow).axes[0].texts] == ["No power flows."]


@pytest.mark.parametrize("angle", [115.0, 130.0])
def test_the_trunk_carries_what_its_streams_bring_and_take(angle):
    """The crank has neither loss nor store of its own: what it carries is what its load takes."""
    flow = flywheel.size(flywheel.load(SERIES), simulate=False).power_flow
    load = next(k for k, stream in enumerate(flow.streams) if stream.kind == "load")
    picture = draw_flow(flow, np.radians(angle))
    labels = [text.get_text().split("\n") for text in picture.axes[0].texts]
    value, unit = next(label[1] for label in labels if label[0] == "crank").split()
    assert unit == "kW"
    assert 1000 * float(value) == pytest.approx(flow.at(np.radians(angle))[load], rel=6e-3)


# The picture of a reduced machine: its parts, its coefficients, where loads switch.


SCENE = press(load=[{"on": "slider", "force": "-800 N", "from": "330 deg", "to": "350 deg"}])


@pytest.fixture(scope="module")
def panels():
    return draw_reduction(flywheel.load(SCENE), of=["rod", "slider"]).axes


def lines(panel):
    return {line.get_label().partition(",")[0]: line for line in panel.lines if not line.get_label().startswith("_")}


def test_parts_add_up_to_the_whole(panels):
    for panel, whole in zip(panels[:2], ("I*", "M*"), strict=True):
        found = lines(panel)
        parts = [line.get_ydata() for name, line in found.items() if name not in (whole, "a load or a law switches")]
        total = found[whole]
        x = np.linspace(1.0, 329.0, 50)
        own = [line for name, line in found.items() if name not in (whole, "a load or a law switches")]
        added = sum(np.interp(x, line.get_xdata(), line.get_ydata()) for line in own)
        assert len(parts) > 1
        np.testing.assert_allclose(added, np.interp(x, total.get_xdata(), total.get_ydata()), rtol=1e-9)


def test_jumps_are_gaps_at_the_ends_of_the_load(panels):
    moment = lines(panels[1])["M*"]
    gaps = np.flatnonzero(np.isnan(moment.get_ydata()))
    assert moment.get_xdata()[gaps - 1] == pytest.approx([330.0, 350.0], abs=1e-5)
    dotted = sorted({line.get_xdata()[0] for line in panels[0].lines if line.get_linestyle() == ":"})
    assert dotted == pytest.approx([330.0, 350.0])


def test_coefficients_are_those_of_the_names(panels):
    assert [panel.get_ylabel() for panel in panels[1:]] == ["M*, N m", "θ' = dθ/dφ, 1", "s' = ds/dφ, mm/rad"]
    assert next(iter(lines(panels[2]))) == "rod"


@pytest.mark.slow
def test_the_command_draws_and_refuses(tmp_path):
    scene = tmp_path / "arm.toml"
    scene.write_text('mechanism = {type = "slider-crank", crank = {length = 0.1}, rod = {length = 0.3}}\n')
    run = CliRunner().invoke
    output = run(main, ["reduce", str(scene), "--plot", str(tmp_path / "a.png"), "--of", "rad"])
    assert output.exit_code == 1
    assert 'did you mean "rod"?' in output.stderr
    assert run(main, ["reduce", str(scene), "--of", "rod"]).exit_code == 2
    drawn = run(main, ["reduce", str(scene), "--at", "0 deg", "--plot", str(tmp_path / "a.png"), "--of", "rod"])
    assert drawn.exit_code == 0, drawn.output
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_narrow_load_is_not_missed():
    """A peak of 100 N m a thousandth of a radian wide, that lies between evenly spread positions."""
    scene = {
        "inertia": [{"on": "crank", "value": 1}],
        "load": [{"on": "crank", "torque": "100*exp(-((phi - 2.0137)/0.001)**2)"}],
    }
    moment = lines(draw_reduction(flywheel.load(scene)).axes[1])["M*"]
    assert np.nanmax(moment.get_ydata()) == pytest.approx(100.0, rel=0.02)


# How a machine goes through its motion: times from its speed, evenly spread, for cycles and strokes.


def of(scene: dict[str, Any]) -> Timing:
    loaded = flywheel.load(scene)
    return timing(loaded, views(loaded)[0])


def test_the_cycle_takes_its_period() -> None:
    sizing = flywheel.size(flywheel.load(yoke()), simulate=False)
    assert sizing.machine is not None
    assert sizing.cycle is not None
    assert sizing.run is not None
    period, _ = turning_moment.period(sizing.cycle, sizing.speed, sizing.run, 1e-9)
    assert of(yoke()).time[-1] == pytest.approx(period, rel=1e-6)


def test_a_machine_that_sets_its_own_speed_takes_its_own_time() -> None:
    known = figures("section-c")["analysis"]["5"]
    found = of(SECTION_C | {"flywheel": {"inertia": 5}})
    assert found.time[-1] == pytest.approx(float(known["period"]), rel=1e-6)
    assert found.curve.max() == pytest.approx(float(known["speed_max"]) * 30 / np.pi, rel=1e-5)


def test_the_curve_is_the_speed_with_the_flywheel() -> None:
    found = of(yoke())
    assert found.curve.max() == pytest.approx(60 * 1.02, rel=1e-4)
    assert found.curve.min() == pytest.approx(60 * 0.98, rel=1e-4)
    assert found.label == "crank speed, rpm"
    assert "353.52 kg m²" in found.title


def test_frames_are_even_in_time_and_close_the_cycle() -> None:
    found = of(press(flywheel={"inertia": 20}))
    time, q, curve = found.evenly(50)
    assert np.ptp(np.diff(time)) < 1e-12
    assert time[0] == q[0] == 0.0
    assert q[-1] < 2 * np.pi
    speed = np.diff(q) / np.diff(time)
    assert np.ptp(speed) > 0.05 * speed.mean()
    between = np.pi / 30 * 0.5 * (curve[1:] + curve[:-1])
    np.testing.assert_allclose(speed, between, rtol=2e-2)
    assert "a flywheel of 20 kg m²" in found.title


def test_small_swings_are_drawn_about_the_mean() -> None:
    found = of(yoke(flywheel={"irregularity": 1e-6}))
    assert found.label == "crank speed − 60 rpm, rpm"
    assert np.abs(found.curve).max() < 1e-4


def test_a_stroke_shows_the_driven_slide_s_velocity() -> None:
    found = of(CLAMP)
    assert not found.closed
    assert found.label == "velocity of platen, m/s"
    assert found.time[-1] == pytest.approx(0.25 / 0.3289474)
    assert found.curve[-1] == pytest.approx(2.179e-5, rel=1e-3)  # the dead centre's printed 0.02179 mm/s
    _, q, _ = found.evenly(11)
    np.testing.assert_allclose(q, np.linspace(-0.06, 0.19, 11), atol=1e-12)


def test_a_stroke_backwards_begins_at_its_end() -> None:
    found = of(CLAMP | {"stroke": CLAMP["stroke"] | {"speed": -0.5}})
    assert (found.q[0], found.q[-1]) == (0.19, -0.06)
    assert found.time[0] == 0.0
    assert found.time[-1] == pytest.approx(0.5)


def test_a_stroke_that_stands_still_is_refused() -> None:
    with pytest.raises(SceneError, match=r"stroke\.speed: found 0"):
        of(CLAMP | {"stroke": CLAMP["stroke"] | {"speed": 0.0}})


MOTOR = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.25}
FAN = {"title": "Fan", "inertia": [{"on": "crank", "value": 0.1}], "drive": {"motor": MOTOR}, "flywheel": {"inertia": 0}}


@pytest.fixture(scope="module")
def found():
    return transient(flywheel.load(FAN), end="4 s")


@pytest.fixture(scope="module")
def axes(found):
    return draw_transient(found).axes


@pytest.mark.slow
def test_every_panel_has_its_unit_and_its_curve(axes):
    labels = [axis.get_ylabel() for axis in axes]
    assert labels == ["crank speed, rad/s", "torque, N m", "kinetic energy, J", "current, A"]
    assert axes[3].get_xlabel() == "time, s"
    line = axes[3].lines[0]
    assert line.get_ydata()[0] == pytest.approx(120.0)
    assert line.get_xdata()[-1] == pytest.approx(4.0)


def test_the_regime_and_when_it_is_nearly_reached_are_marked(axes):
    legend = [text.get_text() for text in axes[0].get_legend().get_texts()]
    assert legend[0].startswith("regime, mean over time: 18")
    assert legend[0].endswith(" rpm")
    assert legend[1].startswith("95 % of it after 1.91")


def test_another_kind_of_file_is_refused(found, tmp_path):
    with pytest.raises(ValueError, match=r"\.txt"):
        plot_transient(found, tmp_path / "c.txt")


# -- diagrams as data ------------------------------------------------------------------------------------------------------

STATIC = Path(flywheel.__file__).parent / "page" / "static" / "figures"


def curves_of(panel: dict[str, Any]) -> list[tuple[dict[str, Any], list[float]]]:
    """The curves of a diagram as the page gets it, each with the values that its script looks up."""
    found = []
    for row in panel["diagram"]["rows"]:
        for curve in row["curves"]:
            values: Any = panel
            for key in curve["of"].split("."):
                values = values[int(key)] if isinstance(values, list) else values[key]
            found.append((curve, values))
    return found


SERVO = {
    "load": [{"on": "crank", "torque": "-4 - 6*sin(phi)"}],
    "drive": {
        "motor": {"type": "servo", "speed": "3000 rpm", "torque": "8 N m", "peak_torque": "30 N m", "efficiency": 0.9}
        | {"corner_speed": "2500 rpm", "maximum_speed": "5000 rpm", "set_speed": "1500 rpm", "inertia": "8 kg cm^2"},
    },
    "flywheel": {"inertia": 0.01},
}


@pytest.mark.parametrize("scene", sample(["areas", "press", "servo"], 3))
def test_every_diagram_goes_to_the_page_and_to_the_picture(scene: str) -> None:
    sizing = sized({"press": press(), "areas": AREAS, "servo": SERVO}[scene])
    answer = page_data.answer(sizing)
    script = (STATIC / "index.js").read_text("utf-8")
    suiting = [(key, kind) for key, kind in DIAGRAMS.items() if kind.suits(sizing.scene)]
    assert {*answer["figures"], *answer["why"]} == {"mechanism", *dict(suiting)}
    assert ("servo" in answer["figures"]) == (scene == "servo")
    for key, kind in suiting:
        assert answer["titles"][key] == kind.title()
        if key not in answer["figures"]:
            assert len(answer["why"][key]) > 30
            continue
        drawing = answer[key]["diagram"]
        assert drawing["form"] == "rows" or f"{drawing['form']}:" in script or f"{drawing['form']}In" in script
        for curve, values in curves_of(answer[key]):
            numbered = answer[key].get("diagram_of_areas", False)
            axis = answer["servo"]["speeds"] if key == "servo" and curve["of"] != "torque" else answer["phi"]
            assert numbered or len(values) == len(axis), (key, curve)
        for row in drawing["rows"] if kind.column is not None else ():
            svg = plots.panel(sizing, row["key"])
            texts = set(re.findall(">([^<]+)</text>", svg))
            drawn_names = [curve["name"] for curve in row["curves"] if curve["name"]] + list(row["notes"])
            missing = [name for name in (row["title"], *drawn_names) if escape(name, quote=False) not in texts]
            assert missing == [], key


def test_a_new_diagram_is_one_maker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Kinetic energy: its panel comes to the page and to the picture with its curve, mark and note."""

    def energy(part: DiagramData, forces: object) -> Diagram:
        values = 0.5 * part.sizing.speed**2 * (part.samples.inertia + part.sizing.flywheel.exact)
        mark = ExtremeMark("greatest", float(part.axis.values[values.argmax()]), float(values.max()), "the most", "blue")
        curve = DiagramCurve("energy", "at the mean speed", "green")
        row = DiagramRow(
            "energy", "Kinetic energy", "energy T", "J", "its course", (curve,), marks=(mark,), notes=("a note",)
        )
        return Diagram({"energy": values}, "Kinetic energy", "its course", (row,))

    kind = DiagramKind(lambda: "Energy", energy, 0, ("energy",))
    monkeypatch.setitem(DIAGRAMS, "energy", kind)
    answer = page_data.answer(sized(press()), {"panels": ["energy"]})
    assert answer["titles"]["energy"] == "Energy"
    ((curve, values),) = curves_of(answer["energy"])
    assert (curve["name"], len(values)) == ("at the mean speed", len(answer["phi"]))
    panel = plots.draw(sized(press())).axes[5]
    assert panel.get_title() == "Kinetic energy"
    assert labels(panel) == ["at the mean speed", "a note"]


def test_what_is_off_the_scale_or_constant_is_decided_once() -> None:
    constant = page_data.answer(sized(rotor()), {"panels": ["wittenbauer"]})["why"]["wittenbauer"]
    assert constant in texts(drawn(rotor()).axes[3])
    scene = rotor(load=[{"on": "crank", "torque": "-1000 + 5*sin(phi)"}])
    panel = page_data.answer(sized(scene), {"panels": ["moment"]})["moment"]
    named = [curve["name"] for curve, values in curves_of(panel) if not curve["drawn"]]
    assert named
    assert set(named) <= set(labels(drawn(scene).axes[0]))


@pytest.mark.slow
def test_a_loop_whose_work_is_rounding_is_a_line_in_the_whole_triangle(tmp_path):
    """A constant load and its balance: W is next to nothing, and the tangents are far steeper than the loop is high."""
    belt = {"type": "belt", "tight": "600 N", "slack": "200 N", "radius": "200 mm"}
    crank = {"type": "slider-crank", "crank": {"length": 0.06}, "rod": {"length": 0.24}, "slider": {"mass": 2.5}}
    scene = flywheel.load(
        {"mechanism": crank, "load": [{"on": "crank", "model": belt}], "drive": {"torque": "balance"}}
        | {"regime": {"speed": "100 rpm"}, "flywheel": {"irregularity": 0.1}}
    )
    sizing = flywheel.size(scene, simulate=False)
    sizing.plot(tmp_path / "belt.png")
    assert (tmp_path / "belt.png").stat().st_size > 10_000


def test_a_headline_is_short_and_printable() -> None:
    sized = flywheel.size(flywheel.load(yoke(title="x" * 300 + "\x1b")), accuracy="normal")
    title, result = plots.headline(sized).splitlines()
    assert (len(title), title.strip("x")) == (plots.WIDTH, "…")
    assert result == "flywheel 353.521 kg m² on the crank for irregularity 0.04, crank at 60 rpm"
