"""Instant centres of scenes: through shafts and strokes, with errors; velocities by them; as text, columns and data."""

import json

import mpmath as mp
import numpy as np
import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.numerics.faults import SceneError
from flywheel.tables.rows import encoded
from flywheel.tables.velocities import data, table, text

PRESS = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}, "slider": {"offset": 0.02}}
GEARED = {"shafts": {"pinion": {"ratio": 2}}, "mechanism": PRESS | {"shaft": "pinion", "phase": 0.4}}


@pytest.fixture(scope="module")
def scene():
    return flywheel.load(GEARED)


def exact(phi):
    """Centre of the rod (m) and velocity of the slider by the crank's angle, at 30 digits."""
    with mp.workdps(30):
        psi, r, e = mp.mpf(2.0 * phi + 0.4), mp.mpf("0.1"), mp.mpf("0.02")
        reach = mp.sqrt(mp.mpf("0.09") - (r * mp.sin(psi) - e) ** 2)
        x = r * mp.cos(psi) + reach
        rate = -r * mp.sin(psi) - (r * mp.sin(psi) - e) * r * mp.cos(psi) / reach
        return x, x * mp.tan(psi), 2 * rate


def test_they_are_found_behind_a_gear_with_errors_that_hold(scene):
    """Also close to where the rod's centre is at infinity."""
    q = np.append(np.linspace(0.05, 6.2, 7), (np.pi / 2 - 0.4) / 2 + np.array([1e-3, 1e-6, 1e-9]))
    found = flywheel.instant_centres(scene, q, speed=3.0).mechanisms["slider-crank"]
    rod = found.centres["frame", "rod"]
    slider = next(point for point in found.velocities if point.name == "slider.guide")
    for k, phi in enumerate(q.tolist()):
        x, y, rate = exact(phi)
        off = float(mp.hypot(x - mp.mpf(float(rod.place[0, k])), y - mp.mpf(float(rod.place[1, k]))))
        assert off <= rod.error[k] < 1e-12 * (1 + float(y) ** 2 / 0.01)
        assert abs(slider.by_centre[0, k] - float(3 * rate)) <= slider.error[k] < 1e-12
    for point in found.velocities:
        assert (np.abs(point.by_centre - point.by_coefficients) <= point.error).all()


def test_the_text_lists_centres_and_velocities(scene):
    page = text(flywheel.instant_centres(scene, [0.5]))
    assert page.startswith("slider-crank: instant centres at phi = 28.6478897565 deg\n")
    assert "frame - slider  at infinity  along 90" in page
    assert "m/rad" in page
    assert "rod.slider_pin" in page


def test_columns_and_data_hold_the_same(scene):
    found = flywheel.instant_centres(scene, [0.5, 1.0])
    columns = dict(table(found))
    told = json.loads(encoded(data(found)))["slider-crank"]
    rod = next(centre for centre in told["centres"] if centre["bodies"] == ["frame", "rod"])
    assert rod["x"] == columns["P(frame rod) x [m]"].tolist()
    assert rod["direction"] == [None, None]
    slider = next(centre for centre in told["centres"] if centre["bodies"] == ["frame", "slider"])
    assert (slider["kind"], slider["x"], slider["permanent"]) == (["at infinity"] * 2, [None, None], True)
    assert slider["direction"] == pytest.approx([np.pi / 2] * 2)
    pins = [point for point in told["velocities"] if point["point"] == "rod.slider_pin"]
    assert pins[0]["by_centre"]["x"] == columns["rod.slider_pin velocity by centre x [m]"].tolist()


def test_what_has_no_bodies_has_no_centres(scene):
    law = {"mechanism": {"type": "law", "outputs": {"ram": {"x": "0.1*cos(phi)"}}}}
    with pytest.raises(SceneError, match="mechanism: found law, expected a mechanism with bodies"):
        flywheel.instant_centres(flywheel.load(law), [0.0])
    with pytest.raises(SceneError, match="one, or 1 as there are positions"):
        flywheel.instant_centres(scene, [0.0], speed=[1.0, 2.0])
    with pytest.raises(SceneError, match="finite"):
        flywheel.instant_centres(scene, [float("nan")])


@pytest.mark.slow
def test_the_command_lists_and_draws_them(tmp_path):
    scene = tmp_path / "press.toml"
    scene.write_text('mechanism = {type = "slider-crank", crank = {length = 0.1}, rod = {length = 0.3}}\n')
    run = CliRunner().invoke
    command = ["motion", str(scene), "--instant-centres", "--of", "rod", "--at", "30 deg", "--speed", "60 rpm"]
    page = run(main, [*command, "--plot", str(tmp_path / "a.png")])
    assert page.exit_code == 0, page.output
    assert "slider-crank: instant centres at phi = 30 deg" in page.stdout
    assert "velocities by them, and by influence coefficients, m/s" in page.stdout
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    told = json.loads(run(main, [*command, "--json"]).stdout)["instant_centres"]["slider-crank"]
    slider = next(point for point in told["velocities"] if point["point"] == "slider.guide")
    reach = np.sqrt(0.09 - 0.0025)
    assert slider["by_centre"]["x"] == pytest.approx([-2 * np.pi * 0.05 * (1 + 0.1 * np.cos(np.pi / 6) / reach)])
    assert run(main, [*command, "--csv"]).stdout.splitlines()[0].count("P(frame rod)") == 5
    few = run(main, ["motion", str(scene), "--instant-centres", "--of", "rod"]).stdout
    assert [line.rpartition("phi = ")[2] for line in few.splitlines() if "instant centres at" in line] == [
        *("0 deg", "90 deg", "180 deg", "270 deg"),
    ]
