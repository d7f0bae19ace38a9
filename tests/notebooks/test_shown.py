"""Display in notebooks: a short line and a page of HTML of everything, without an error whatever the object holds."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

import bondgraph
import flywheel
from flywheel.numerics import notebook

TITLE = 'A <b>yoke</b> & its "flywheel"'
YOKE = {
    "title": TITLE,
    "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}},
    "load": [{"on": "yoke", "force": 1000.0, "from": 0, "to": "180 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "60 rpm"},
    "flywheel": {"irregularity": 0.04},
}


@pytest.fixture(scope="module")
def scene():
    return flywheel.load(YOKE)


@pytest.fixture(scope="module")
def shown(scene):
    machine = flywheel.Machine(scene)
    sizing = flywheel.size(machine, simulate=False)
    return {
        "Scene": scene,
        "Machine": machine,
        "Sizing": sizing,
        "Sizings": flywheel.Sizings([sizing, flywheel.size(scene.with_({"flywheel.irregularity": 0.02}), simulate=False)]),
        "MachineState": flywheel.reduce(machine, np.linspace(0.0, 6.0, 40)),
        "Motion": flywheel.simulate(machine, phi=0.0, omega=6.0, until=0.2, inertia=345.0),
        "Kinematics": flywheel.motion(scene, points=7),
        "JointForces": flywheel.joint_forces(machine, [0.0, 1.0, 2.0]),
        "Transient": flywheel.run_down(scene, 0.1, start=5.0, inertia=300.0),
    }


KINDS = ("Scene", "Machine", "Sizing", "Sizings", "MachineState", "Motion", "Kinematics", "JointForces", "Transient")


@pytest.mark.parametrize("kind", KINDS)
def test_a_line_and_a_page_of_everything(shown, kind):
    line = repr(shown[kind])
    assert line.startswith(f"{kind}(")
    assert "\n" not in line
    assert len(line) < 200
    page = shown[kind]._repr_html_()
    inside = re.sub(r"<style.*?</style>", "", page)
    tree = ET.fromstring(inside.replace("&nbsp;", " "))  # every element is closed, every title escaped
    assert tree.findall(".//table") or tree.findall(".//svg")
    assert "<b>" not in page
    assert len(page) < 40_000


def test_a_sizing_shows_its_answers_and_its_turning_moment(shown):
    page = shown["Sizing"]._repr_html_()
    assert "353.52" in page
    assert "NOT confirmed" in page
    assert page.count("<polyline") == 2


def test_figures_are_the_contract_with_errors_and_make_a_table(shown):
    figures = shown["Sizing"].figures
    assert figures["flywheel.exact"] == shown["Sizing"].flywheel.exact
    assert 0 < figures["error.exact"] < 1e-9
    assert all(value is None or isinstance(value, (int, float, str)) for value in figures.values())
    sweep = shown["Sizings"]
    assert sweep.columns[:2] == ["irregularity", "flywheel.exact"]
    assert [row["irregularity"] for row in sweep.figures] == [0.04, 0.02]


def test_what_cannot_be_shown_is_no_error(scene, shown, monkeypatch):
    monkeypatch.setattr("flywheel.notebooks.table", lambda *_: 1 / 0)
    assert scene._repr_html_() is None
    assert notebook.html(object()) is None


@pytest.mark.slow
def test_a_bond_graph_is_a_line_and_a_picture_with_its_text_as_text():
    graph = bondgraph.Builder().one("shaft").on("shaft", bondgraph.I("J", 2.0), bondgraph.Se("M", 3.0)).build()
    assert repr(graph) == "BondGraph(3 elements, 2 bonds)"
    picture = graph._repr_svg_()
    assert "<svg" in picture
    assert ">shaft</text>" in re.sub(r"<text[^>]*>", "<text>", picture)


def test_a_reduced_graph_is_a_line(scene):
    assert repr(flywheel.Machine(scene).reduce(np.linspace(0.0, 6.0, 90))) == "Reduced(90 positions, I* 0 to 4.99977)"


def test_a_graph_that_takes_long_to_lay_out_is_not_drawn_unasked():
    builder = bondgraph.Builder().one("shaft")
    for k in range(50):
        builder = builder.on("shaft", bondgraph.I(f"J{k}", 2.0))
    assert builder.build()._repr_svg_() is None


@pytest.mark.slow
def test_the_picture_of_a_sizing_is_written_or_given(shown, tmp_path):
    path = tmp_path / "yoke.svg"
    assert shown["Sizing"].plot(path) is None
    assert path.stat().st_size > 10_000


@pytest.mark.slow
def test_the_report_of_a_sizing_is_written_or_shown_in_a_frame(shown, tmp_path):
    path = tmp_path / "yoke.html"
    assert shown["Sizing"].report(path) is None
    text = path.read_text(encoding="utf-8")
    assert "<html" in text
    page = shown["Sizing"].report(language="es")
    assert 'lang="es"' in page
    assert page._repr_html_().startswith("<iframe")
    assert len(repr(page)) < 60


def test_a_scene_says_what_it_was_read_from(scene, tmp_path):
    assert scene.given_as == "a dict"
    assert scene.with_({"title": "Other"}).given_as == "changes of a dict"
    path = tmp_path / "rotor.toml"
    path.write_text("regime.speed = 10\nflywheel.inertia = 2 # see other.toml")
    assert flywheel.load(path).given_as == f"the file {path}"
    assert flywheel.load(str(path)).given_as == f"the file {path}"
    assert flywheel.load(path.read_text()).given_as == "a TOML text"


@pytest.mark.parametrize(
    ("source", "says", "taken"),
    [
        ("rotr.toml", 'did you mean "rotor.toml"?', "the file"),
        ("elsewhere", "a TOML text has several lines, or an equals sign", "the file"),
        ("", "found an empty text", "the file"),
        ("a = 1", 'found key or table "a"', "a TOML text"),
        (3, "found 3, expected a dict, the path of a TOML file, or a TOML text", "a value of type int"),
        ({"a": 1}, 'found key or table "a"', "a dict"),
    ],
)
def test_a_source_that_is_no_scene_is_told_what_it_was_taken_for(source, says, taken, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("rotor.toml").write_text("regime.speed = 10\n")
    with pytest.raises(flywheel.SceneError) as caught:
        flywheel.load(source)
    assert says in str(caught.value)
    assert caught.value.__notes__[0].startswith(f"taken for {taken}")


class Quantity:
    """A number with a unit as pint has them."""

    def __init__(self, magnitude, units):
        self.magnitude, self.units = magnitude, units

    def to_base_units(self):
        return self


def test_quantities_of_another_library_are_taken_wherever_a_scene_takes_one():
    changed = flywheel.load(YOKE).with_(
        {
            "mechanism.crank.length": Quantity(0.25, "meter"),
            "mechanism.yoke.mass": Quantity(np.float64(7.0), "kilogram"),
            "load.0.force": Quantity(30.0, "kilogram * meter / second ** 2"),
            "load.0.to": Quantity(3.0, "radian"),
            "regime.speed": Quantity(12.0, "radian / second"),
            "flywheel.irregularity": Quantity(0.1, "dimensionless"),
        }
    )
    (mechanism,), (load,) = changed.mechanisms, changed.loads
    assert mechanism.geometry["crank.length"] == 0.25
    assert mechanism.bodies["yoke"].mass == 7.0
    assert (load.law, load.end, changed.speed, changed.irregularity) == (30.0, 3.0, 12.0, 0.1)


@pytest.mark.parametrize(
    ("path", "quantity", "says"),
    [
        ("mechanism.crank.length", Quantity(3.0, "kilogram"), "that is a unit of mass"),
        ("regime.speed", Quantity(2.0, "1 / second"), "name the angle"),
        ("mechanism.yoke.mass", Quantity(2.0, "kelvin"), '"kelvin" is no unit'),
        ("flywheel.irregularity", Quantity(2.0, "meter"), "that is a unit of length"),
        ("mechanism.crank.length", Quantity([1.0, 2.0], "meter"), "found a list"),
        ("mechanism.crank.length", Quantity(float("nan"), "meter"), 'found "nan m"'),
    ],
)
def test_a_wrong_dimension_is_a_fault_in_one_line(path, quantity, says):
    with pytest.raises(flywheel.SceneError) as caught:
        flywheel.load(YOKE).with_({path: quantity})
    assert str(caught.value).startswith(f"{path}: ")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_quantities_of_pint_are_taken():
    pint = pytest.importorskip("pint")
    unit = pint.UnitRegistry()
    scene = flywheel.load(
        YOKE
        | {"regime": {"speed": unit.Quantity(60, "rpm")}, "inertia": [{"on": "crank", "value": 3 * unit.kg * unit.m**2}]}
    )
    assert scene.speed == pytest.approx(2 * np.pi, rel=1e-15)
    assert scene.inertias[0].value == 3.0
