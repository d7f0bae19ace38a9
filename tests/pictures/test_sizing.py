"""The pictures: what is drawn is there and right; how it looks was judged by eye."""

from __future__ import annotations

import re
from ast import literal_eval
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import flywheel
from flywheel import language
from flywheel.pictures import samples as samples_of
from flywheel.pictures import sizing as plots
from flywheel.regime import turning_moment
from flywheel.sizing.results import Sizing
from flywheel.tables import sizing as pages
from flywheel.tables.flywheels import candidates
from tests.limits import sample
from tests.regimes import GEARED, KLOSS, PUMP, SECTION_C
from tests.scenes import press, rotor, shaper, yoke

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
    """What a line's name is before its figures."""
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


def test_shaded_areas_add_up() -> None:
    sizing = sized(press())
    assert sizing.machine is not None
    assert sizing.cycle is not None
    samples = samples_of.sampled(sizing.machine, sizing.cycle)
    for area in sizing.areas:
        inside = (samples.phi >= area.start) & (samples.phi <= area.end)
        positive = np.maximum(np.sign(area.work) * samples.moment[inside], 0.0)
        work = np.sign(area.work) * np.trapezoid(positive, samples.phi[inside])
        assert work == pytest.approx(area.work, rel=1e-3)


def test_a_jump_is_a_vertical_line() -> None:
    sizing = sized(press())
    assert sizing.machine is not None
    assert sizing.cycle is not None
    samples = samples_of.sampled(sizing.machine, sizing.cycle)
    at = samples.phi == sizing.cycle.mesh.edges[np.abs(sizing.cycle.mesh.edges - np.radians(300)).argmin()]
    values = samples.moment[at]
    assert values.size == 2
    assert abs(values[1] - values[0]) > 1000.0


def test_bodies_stack_to_the_total() -> None:
    sizing = sized(press())
    assert sizing.machine is not None
    assert sizing.cycle is not None
    samples = samples_of.sampled(sizing.machine, sizing.cycle)
    parts = samples_of.bodies(sizing.machine, samples)
    assert set(parts) == {"press.crank", "press.rod", "press.slider"}
    np.testing.assert_allclose(sum(parts.values()), samples.inertia, rtol=1e-9)
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
    samples = samples_of.sampled(sizing.machine, sizing.cycle)
    loop = samples_of.loop(sizing.cycle, samples, sizing.speed, sizing.run)
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
    told = " ".join(labels(panel))
    assert "I = MN/(2 ε) = 353.52 kg m²" in told
    assert "I* = −353.52 kg m²" in told
    assert "tan ψmax = 1.0404" in told
    assert (panel.get_ylabel(), panel.child_axes[0].get_ylabel()) == ("work W, J", "F = 2 W/ω², kg m²")


def test_a_constant_reduced_inertia_has_no_loop_but_a_sentence() -> None:
    """A rotor: the flywheel is the fluctuation of energy over eps w², less I*."""
    sizing = sized(rotor())
    panel = drawn(rotor()).axes[3]
    assert not panel.axison
    (told,) = texts(panel)
    assert "I* is constant" in told
    assert f"− I* = {sizing.flywheel.exact:.5g} kg m²" in told


@pytest.mark.slow
def test_speed_stays_in_the_band_with_the_exact_flywheel_alone() -> None:
    sizing = sized(yoke(regime={"speed": 100}))
    panel = plots.draw(sizing).axes[4]
    lines = {words(line): np.asarray(line.get_ydata(), dtype=float) for line in panel.lines}
    low, high = (sizing.speed * (1 + side * 0.02) * 30 / np.pi for side in (-1, 1))
    assert lines["exact"].min() == pytest.approx(low, rel=1e-4)
    assert lines["exact"].max() == pytest.approx(high, rel=1e-4)
    assert lines["by the areas"].max() > 1.2 * high
    assert "band asked, ±2 %" in labels(panel)


def test_small_fluctuations_are_drawn_about_the_mean() -> None:
    panel = drawn(KINDS["small irregularity"]).axes[4]
    assert "− 120 rpm" in panel.get_ylabel()
    assert np.abs(panel.lines[-3].get_ydata()).max() < 1e-6


def test_no_steady_motion_is_said_in_the_legend(monkeypatch: pytest.MonkeyPatch) -> None:
    sizing = sized(yoke())

    def stops(*_: object) -> None:
        raise turning_moment.NoMotionError

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
    samples = samples_of.sampled(sizing.machine, sizing.cycle)
    centre, room = samples_of.roomiest(samples, 0.0, np.pi, -1.0, 0.3)
    assert centre == pytest.approx(np.pi / 2, abs=0.05)
    assert room == pytest.approx(50.0)
    assert samples_of.roomiest(samples, 0.0, 0.1, -1.0, 0.3)[1] == 0.0


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
    told = ["".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {
        "Turning moment and its areas",
        "crank angle φ, deg",
        "reduced moment M*, N m",
        "driving",
        "A1",
        "A2",
        "A3",
    } <= set(told)
    assert root.get("aria-labelledby") == "first-title first-desc"
    assert root.findtext("{http://www.w3.org/2000/svg}title") == "Turning moment and its areas"
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    assert len(ids) == len(set(ids))
    assert all(str(name).startswith("first-") for name in ids)
    assert set(re.findall(r'(?:href="#|url\(#)([^")]+)', drawn)) <= set(ids)
    assert drawn == plots.panel(sized(yoke()), "moment", name="first")
    assert len(drawn) < 60_000


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
