"""Starters load, size (on a one-way stroke, and a mechanism alone: reduce), say what they are, never overwrite a file."""

import numpy as np
import pytest

import flywheel
from flywheel import load
from flywheel.mechanisms import KINDS
from flywheel.starters import kinds, starter, write_starter

ONE_WAY = ["toggle-clamp"]
ALONE = ["mechanism"]
BY_CLUTCH = ["single-stroke"]


def test_there_is_one_for_every_type():
    assert set(KINDS) | {"rotor", "areas"} < set(kinds())


def test_all_but_the_one_way_ones_have_a_cycle():
    assert [kind for kind in kinds() if load(starter(kind)).stroke is not None] == ONE_WAY


DUTIES = [kind for kind in kinds() if kind.startswith("duty-")]
CYCLIC = [kind for kind in kinds() if kind not in ONE_WAY + ALONE + BY_CLUTCH + DUTIES[1:]]


@pytest.mark.parametrize("kind", [*CYCLIC, *(pytest.param(kind, marks=pytest.mark.slow) for kind in DUTIES[1:])])
def test_starters_can_be_sized_as_they_are(kind):
    scene = load(starter(kind))
    result = flywheel.size(scene, simulate=False)
    assert result.flywheel.needed
    if kind.startswith("duty-"):
        assert result.duty.type == kind[-2:].upper()
        assert result.temperature.within
    assert result.flywheel.exact > 0
    assert result.reached
    assert scene.title


@pytest.mark.slow
@pytest.mark.parametrize("kind", BY_CLUTCH)
def test_starters_with_a_clutch_go_through_their_stroke(kind):
    result = flywheel.single_stroke(load(starter(kind)), 1e-4)
    assert result.keeps_up
    assert result.verdicts == ()


def test_a_mechanism_alone_has_no_idle_tables():
    scene = load(starter("mechanism"))
    assert (scene.speed, scene.irregularity, scene.inertia, scene.drive, scene.loads) == (None, None, None, None, ())
    assert flywheel.reduce(scene, [0.0, 1.0]).inertia.min() > 0.0


@pytest.mark.parametrize("kind", ONE_WAY)
def test_starters_on_a_stroke_can_be_driven_from_end_to_end(kind):
    scene = load(starter(kind))
    assert scene.stroke is not None
    assert scene.title
    x = np.linspace(scene.stroke.start, scene.stroke.end, 4001)
    passage = flywheel.along(scene, x)
    assert (passage.state.inertia > 0).all()
    assert all(np.any(part) for part in passage.state.moment_parts.values())
    # The driver's work is what the bodies gain in kinetic energy and the loads take.
    mass, speed = passage.state.inertia, scene.stroke.speed
    taken = -np.trapezoid(passage.state.moment, x)
    assert np.trapezoid(passage.driving, x) == pytest.approx(0.5 * (mass[-1] - mass[0]) * speed**2 + taken, rel=1e-6)


@pytest.mark.parametrize("kind", kinds())
def test_starters_are_commented_and_fit_a_screen(kind):
    lines = starter(kind).splitlines()
    assert lines[0].startswith("# ")
    assert "flywheel reference" in lines[1]
    assert all(len(line) <= 120 for line in lines)


def test_a_starter_is_written_once(tmp_path):
    path = tmp_path / "press.toml"
    write_starter("press", path)
    assert path.read_text(encoding="utf-8") == starter("press")
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        write_starter("press", str(path))
    assert path.read_text() == "mine"


def test_unknown_kinds(tmp_path):
    with pytest.raises(KeyError):
        starter("../press")
    with pytest.raises(KeyError):
        write_starter("steam", tmp_path / "steam.toml")
    assert not list(tmp_path.iterdir())
