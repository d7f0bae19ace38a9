import pytest

import flywheel
from flywheel.motions.transients import transient
from flywheel.pictures.transients import draw, plot

MOTOR = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.25}
SCENE = {"title": "Fan", "inertia": [{"on": "crank", "value": 0.1}], "drive": {"motor": MOTOR}, "flywheel": {"inertia": 0}}


@pytest.fixture(scope="module")
def found():
    return transient(flywheel.load(SCENE), end="4 s")


@pytest.fixture(scope="module")
def axes(found):
    return draw(found).axes


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
    assert legend[0].startswith("regime, mean over time: 192")
    assert legend[1].startswith("95 % of it after 1.91")


@pytest.mark.slow
def test_files_are_the_same_every_time(found, tmp_path):
    for name in ("a.svg", "b.svg"):
        plot(found, tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_another_kind_of_file_is_refused(found, tmp_path):
    with pytest.raises(ValueError, match=r"\.txt"):
        plot(found, tmp_path / "c.txt")
