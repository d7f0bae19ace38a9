"""Every family of mechanisms in every place that shows one: starter, form, report, pictures, motion, reference."""

import tomllib

import numpy as np
import pytest

import flywheel
from flywheel import language, pictures, reference
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.families import has_joints
from flywheel.page.data import answer
from flywheel.page.form import form_of
from flywheel.reading.toml_text import outline
from flywheel.report.positions import sheet
from flywheel.starters import kinds, starter

COMMON = ("linkage", "law")
"""Families whose tables are bodies or outputs: their formulas come from these, not from symbols of fixed lengths."""


@pytest.fixture(params=KINDS)
def kind(request):
    return KINDS[request.param]


def mechanism(kind):
    scene = flywheel.load(starter(kind.name))
    return scene, next(item for item in scene.mechanisms if item.type == kind.name)


def test_it_begins_with_a_starter_whose_tables_are_its_own(kind):
    assert kind.name in kinds()
    table = tomllib.loads(starter(kind.name))["mechanism"]
    assert table["type"] == kind.name
    assert {part.name for part in kind.parts if any(key.required for key in part.geometry)} <= table.keys()


def test_the_form_has_its_tables(kind):
    groups = {group.path for group in form_of(outline(starter(kind.name)))}
    assert {f"mechanism.{part.name}" for part in kind.parts} <= groups


def test_the_reference_describes_it(kind):
    page = reference.text(kind.name)
    assert all(port.name in page for port in kind.ports)
    assert all(part.name in page for part in kind.parts)


def test_the_report_derives_every_port_and_agrees_with_the_library(kind):
    scene, its = mechanism(kind)
    machine = flywheel.Machine(scene)
    phi = scene.origin + 0.3 * scene.cycle
    made = sheet(machine, its, phi)
    gains = flywheel.reduce(machine, [phi], balance=0.0, speed=1.0).gains
    names = made.gains.keys() & {name.partition(".")[2] for name in gains if name.startswith(f"{its.name}.")}
    assert names
    for name in names:
        assert made.values[made.gains[name]].value == pytest.approx(gains[f"{its.name}.{name}"][0], rel=1e-9, abs=1e-12)
    ports = {port.name for port in kind.ports}
    assert ports <= made.coordinates.keys()
    if kind.name not in COMMON:
        lengths = {f"{part.name}.{key.name}" for part in kind.parts for key in part.geometry}
        assert kind.symbols.keys() == lengths
        assert set(kind.heights) <= lengths
        assert kind.derivation is not None


def test_the_form_translates_the_titles_of_its_bodies_and_pictures_keep_their_names(kind):
    for noun in kind.all_nouns:
        with language.use("es"):
            assert language.text(noun.replace("_", " ")) not in ("", noun)
            assert pictures.noun(f"press.{noun}") == f"{noun} (press)"


def test_it_is_drawn_if_it_has_joints_and_moves(kind):
    scene, its = mechanism(kind)
    if has_joints(its):
        assert flywheel.draw(scene).axes
    moved = flywheel.motion(scene, at=[scene.origin + 0.3 * scene.cycle])
    names = (
        [name for name in moved.curves if name.rpartition(".")[2] in kind.default_curves]
        if kind.default_curves
        else [*moved.curves]
    )
    assert names
    assert np.isfinite(moved[names[0]].position).all()


def test_the_page_shows_its_motion(kind):
    output = answer(mechanism(kind)[0], {"panels": ["motion"]}, rest=False)["motion"]
    of = output["of"].rpartition(".")[2]
    assert not kind.default_curves or of in kind.default_curves
