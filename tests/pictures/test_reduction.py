"""The picture of a reduced machine: its parts, its coefficients, where loads switch."""

import numpy as np
import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.pictures.reduction import draw
from tests.scenes import press

SCENE = press(load=[{"on": "slider", "force": "-800 N", "from": "330 deg", "to": "350 deg"}])


@pytest.fixture(scope="module")
def panels():
    return draw(flywheel.load(SCENE), of=["rod", "slider"]).axes


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
    found = run(main, ["reduce", str(scene), "--plot", str(tmp_path / "a.png"), "--of", "rad"])
    assert found.exit_code == 1
    assert 'did you mean "rod"?' in found.stderr
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
    moment = lines(draw(flywheel.load(scene)).axes[1])["M*"]
    assert np.nanmax(moment.get_ydata()) == pytest.approx(100.0, rel=0.02)
