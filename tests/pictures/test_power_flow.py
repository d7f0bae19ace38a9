"""The Sankey diagram: widths to scale, nothing left out, names apart, power that goes backwards drawn backwards."""

import re

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import PathPatch

import flywheel
from flywheel import language
from flywheel.pictures import form
from flywheel.pictures.figures import BLUE, PURPLE
from flywheel.pictures.power_flow import draw, panel, plot
from flywheel.tables.power_flow import entries, given
from tests import regimes
from tests.oracle.test_drive_lines import PRESS

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
        made = draw(long, at)
        found = entries(long, at)
        assert overlaps(made) == []
        told = "".join(text.get_text() for text in made.axes[0].texts)
        flat = re.sub(r"\s", "", told)
        wanted = [entry for entry in found if entry.stream.kind not in ("shaft", "drive") and entry.power]
        assert len(wanted) > 12
        assert all(re.sub(r"\s", "", entry.label) in flat for entry in wanted)
    assert made.get_figwidth() < 22.0
    assert made.texts[0].get_text().split("\n")[0].endswith("…")


def test_widths_are_to_scale(long):
    made = draw(long)
    trunk = max(bands(made, BLUE), key=lambda patch: np.ptp(patch.get_path().vertices[:, 0]))
    x, y = trunk.get_path().vertices.T
    left, right = np.ptp(y[x == x.min()]), np.ptp(y[x == x.max()])
    tool = max(stream.mean for stream in long.streams if stream.kind == "load")
    assert right / left == pytest.approx(tool / long.input, rel=1e-9)
    assert given(long, entries(long)) == pytest.approx(long.input, rel=1e-12)


def test_power_that_goes_backwards_is_drawn_backwards():
    case = regimes.CASES["dc-inductance"]
    scene = regimes.scene("dc-inductance", inertia=case.inertias[-1])
    flow = flywheel.size(flywheel.load(scene), simulate=False).power_flow
    motor = next(k for k, stream in enumerate(flow.streams) if stream.kind == "input")
    assert flow.at(2.0)[motor] < 0.0
    back = max(bands(draw(flow, 2.0), PURPLE), key=lambda patch: np.ptp(patch.get_path().vertices[:, 0]))
    assert np.ptp(back.get_path().vertices[:, 0]) > 2.0
    assert not bands(draw(flow), PURPLE)


def test_the_panel_of_a_page_keeps_its_texts(long, tmp_path):
    with language.use("es"):
        drawn = panel(long, at=1.0, form="print", name="flow")
    assert drawn.count("<text") > 30
    assert ">volante<" in drawn
    assert 'aria-labelledby="flow-title flow-desc"' in drawn
    assert not re.search(r"#[0-9a-f]*(?:0072b2|d55e00)", drawn)
    with form("print"):
        plot(long, tmp_path / "flow.svg")
    assert "mesh" in (tmp_path / "flow.svg").read_text(encoding="utf-8")
    with pytest.raises(ValueError, match=r"\.png, \.svg or \.pdf"):
        long.plot(tmp_path / "flow.txt")
    assert long.plot().axes


def test_nothing_flows_where_nothing_acts():
    idle = {"inertia": [{"on": "crank", "value": 1}], "regime": {"speed": 5}, "flywheel": {"inertia": 1}}
    flow = flywheel.size(flywheel.load(idle), simulate=False).power_flow
    assert [text.get_text() for text in draw(flow).axes[0].texts] == ["No power flows."]


@pytest.mark.parametrize("angle", [115.0, 130.0])
def test_the_trunk_carries_what_its_streams_bring_and_take(angle):
    """The crank has neither loss nor store of its own: what it carries is what its load takes."""
    flow = flywheel.size(flywheel.load(SERIES), simulate=False).power_flow
    load = next(k for k, stream in enumerate(flow.streams) if stream.kind == "load")
    picture = draw(flow, np.radians(angle))
    labels = [text.get_text().split("\n") for text in picture.axes[0].texts]
    value, unit = next(label[1] for label in labels if label[0] == "crank").split()
    assert unit == "kW"
    assert 1000 * float(value) == pytest.approx(flow.at(np.radians(angle))[load], rel=6e-3)
