"""A figure is one line: whatever a sizing says is in every place that shows figures, rendered from that line."""

import math
import re
from pathlib import Path

import pytest

import flywheel
from flywheel import language
from flywheel.designs.figures import FIGURES, figures_of
from flywheel.page import data
from flywheel.reference import text as reference_text
from flywheel.sizing import findings
from flywheel.sizing.findings import FINDINGS, OUTPUTS, Finding, reference
from flywheel.tables import sizing as full
from flywheel.tables import summary
from tests.scenes import yoke

EXAMPLES = Path(__file__).parents[2] / "examples"
AREAS = {
    "areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": 10}, "flywheel": {"irregularity": 0.02},
}  # fmt: skip
SYNCHRONOUS = {
    "shafts": {"motor": {"ratio": 12}},
    "load": [{"on": "crank", "torque": "-300 - 200*sin(phi)"}],
    "inertia": [{"on": "crank", "value": 3.0}],
    "drive": {
        "on": "motor",
        "motor": {"type": "synchronous", "power": "10 kW", "poles": 4, "frequency": "50 Hz", "pull_out_ratio": 2.0}
        | {"damping": "4 N m s", "inertia": "0.1 kg m^2"},
    },
    "flywheel": {"inertia": 20.0},
}
ENGINE = {
    "mechanism": {"type": "slider-crank", "crank": {"length": 0.045}, "rod": {"length": 0.145}, "slider": {"mass": 0.5}},
    "load": [{"on": "slider", "force": "-100*sin(phi)", "bore": 0.084}, {"on": "crank", "torque": "-T"}],
    "parameters": {"T": "balance"},
    "regime": {"speed": 150},
    "flywheel": {"irregularity": 0.02},
}
INVERTER = {
    "load": [{"on": "crank", "torque": "-20 - 10*sin(phi)"}],
    "drive": {
        "motor": {"type": "induction", "power": "7.5 kW", "speed": "1450 rpm", "poles": 4, "frequency": "50 Hz"}
        | {"breakdown_ratio": 2.5, "inverter": {"frequency": "40 Hz"}},
    },
    "flywheel": {"inertia": 1.0},
}
SERVO = {
    **INVERTER,
    "drive": {
        "motor": {"type": "servo", "speed": "3000 rpm", "torque": "8 N m", "peak_torque": "30 N m", "efficiency": 0.9}
        | {"corner_speed": "2500 rpm", "maximum_speed": "5000 rpm", "set_speed": "1500 rpm", "inertia": "8 kg cm^2"},
    },
}
BLOCKS = {
    "simulation": yoke(),
    "energy": yoke(),
    "engine": ENGINE,
    "synchronism": SYNCHRONOUS,
    "inverter": INVERTER,
    "servo": SERVO,
}


@pytest.fixture(scope="module")
def sizing():
    return flywheel.size(flywheel.load(yoke()), simulate=False)


def test_json_has_every_figure_and_no_other(sizing):
    result = sizing.as_dict()
    assert list(result) == [one.key for one in FINDINGS if "." not in one.key]
    for block in ("flywheel", "reduced_inertia", "energy"):
        assert list(result[block]) == [one.key.partition(".")[2] for one in FINDINGS if one.key.startswith(f"{block}.")]
    for one in FINDINGS:
        block, _dot, name = one.key.rpartition(".")
        figures = result[block] if block else result
        assert isinstance(value := figures and figures[name], dict) or value == one.of(sizing), one.key


@pytest.mark.parametrize("block", BLOCKS)
def test_a_block_is_its_lines_or_null(block):
    """Whatever the record of a block has is a line of it: none is worded by the record itself."""
    request, other = (flywheel.size(flywheel.load(scene)).as_dict()[block] for scene in (BLOCKS[block], AREAS))
    assert list(request) == [one.key.partition(".")[2] for one in FINDINGS if one.key.startswith(f"{block}.")]
    assert other is None


def test_the_reference_tells_of_every_figure():
    page = reference_text("results")
    for block in ("", "flywheel", *BLOCKS):
        assert "\n".join(reference(block)) in page, f"the table of reference/results.md is to be:\n{reference(block)}"


def test_columns_of_sweeps_are_those_of_the_figures(sizing):
    columns = {one.column.name or one.key: one for one in FINDINGS if one.column is not None}
    assert set(columns) <= set(FIGURES)
    result = figures_of(sizing)
    for name, one in columns.items():
        value = (one.column.value or one.of)(sizing)
        assert value is None or result[name][0] == value, name
        assert FIGURES[name].about == one.column.about
        assert not FIGURES[name].error or FIGURES[name].error in sizing.errors, name


@pytest.mark.usefixtures("blank")
def test_words_and_symbols_are_those_of_every_output(sizing):
    texts = {"full": full.text(sizing), "summary": summary.text(sizing), "report": flywheel.report.html(sizing)}
    for one in FINDINGS:
        for output in one.outputs:
            assert one.name in texts[output], (one.key, output)
            assert one.key in sizing.figures
    words = [one.name for one in FINDINGS if one.words is not None]
    with language.use("es"):
        assert not set(words) & {one.name for one in FINDINGS if one.words is not None}


@pytest.mark.usefixtures("blank")
def test_a_new_figure_is_one_line(sizing, monkeypatch):
    """In JSON, the table of figures, the reference, the full listing, the summary, the live page and the report."""
    new = Finding(
        "kinetic_energy", "J", "of the flywheel", lambda s: 0.5 * s.inertia * s.speed**2, lambda: "energy of the flywheel",
        symbol="E_f", outputs=OUTPUTS,
    )  # fmt: skip
    monkeypatch.setattr(findings, "FINDINGS", (*FINDINGS, new))
    value = 0.5 * sizing.inertia * sizing.speed**2
    assert sizing.as_dict()["kinetic_energy"] == sizing.figures["kinetic_energy"] == value
    assert reference()[-1] == "| `kinetic_energy` | J | of the flywheel |"
    digits = re.escape(f"{value:.5g}"[:5])
    assert re.search(rf"energy of the flywheel +{digits}\d* +J", full.text(sizing))
    assert re.search(rf"energy of the flywheel +{digits}\d* J", summary.text(sizing))
    rows = [row for block in data.answer(sizing, {"panels": []})["numbers"] for row in block["rows"]]
    assert "energy of the flywheel" in [row["label"] for row in rows]
    assert "energy of the flywheel" in flywheel.report.html(sizing)


def test_every_power_names_its_speed():
    """`power` of JSON and sweeps is at the mean of the extremes, that of the summary is work over time."""
    sizing = flywheel.size(flywheel.load(EXAMPLES / "machines/press.toml"), simulate=False)
    swept = figures_of(sizing)["power"][0]
    assert swept == sizing.as_dict()["power"] == pytest.approx(sizing.drive_work * sizing.speed / sizing.scene.cycle)
    assert FIGURES["power"].about == "power of the drive at the mean of the extreme speeds"
    over_time = sizing.scene.cycle / sizing.energy.period
    assert sizing.energy.mean_power == pytest.approx(swept * over_time / sizing.speed, rel=1e-12)
    assert f"at {over_time * 30 / math.pi:.3f} rpm over time" in summary.text(sizing)
