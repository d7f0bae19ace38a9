"""Results as tables, extremes and resultants."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from flywheel.mechanisms.linkages.reactions import reactions
from flywheel.mechanisms.linkages.wrenches import Force
from tests.linkages import forced

Q = np.linspace(0.1, 6.2, 40)


@pytest.fixture(scope="module")
def found():
    loads = [Force("slider", "o", -400.0)]
    return reactions(forced.slider_crank(0.1, 0.02, 0.08), Q, 15.0, gravity=(0.0, -9.81), loads=loads)


def test_a_resultant_is_the_whole_force_friction_included(found):
    parts = found.components["guide"]
    np.testing.assert_allclose(found.resultant("guide"), np.hypot(parts["normal"], parts["friction"]), rtol=1e-12)
    pin = found.components["crank_pin"]
    np.testing.assert_allclose(found.forces["crank_pin"], np.stack((pin["x"], pin["y"])), rtol=1e-12)


def test_the_shoes_two_normals_are_the_force_and_the_moment(found):
    parts = found.components["guide"]
    np.testing.assert_allclose(parts["front"] + parts["rear"], parts["normal"], rtol=1e-12)
    np.testing.assert_allclose((parts["front"] - parts["rear"]) * 0.04, parts["moment"], rtol=1e-11)
    rubbing = 0.1 * (np.abs(parts["front"]) + np.abs(parts["rear"]))
    np.testing.assert_allclose(np.abs(parts["friction"]), rubbing, rtol=1e-11)


def test_extremes_are_the_largest_of_each_joint(found):
    extremes = {extreme.joint: extreme for extreme in found.extremes()}
    assert list(extremes) == ["pivot", "crank_pin", "slider_pin", "guide", "guide.front", "guide.rear"]
    for end in ("front", "rear"):
        assert extremes[f"guide.{end}"].force == np.abs(found.components["guide"][end]).max()
    size = found.resultant("slider_pin")
    assert extremes["slider_pin"].force == size.max()
    assert extremes["slider_pin"].at == Q[size.argmax()]


def test_csv_reads_back_to_the_last_digit(found):
    rows = list(csv.DictReader(io.StringIO(found.csv())))
    assert len(rows) == len(Q)
    assert list(rows[0])[:2] == ["pivot (rad)", "pivot.drive (N m)"]
    for name, values in (("pivot.drive (N m)", found.action), ("guide.moment (N m)", found.components["guide"]["moment"])):
        assert [float(row[name]) for row in rows] == values.tolist()


def test_the_table_has_a_block_for_every_joint(found):
    blocks = found.table().split("\n\n")
    assert [block.splitlines()[0] for block in blocks] == [
        "driving action", "pivot", "crank_pin", "slider_pin", "guide", "largest forces of these positions",
    ]  # fmt: skip
    assert "normal (N)" in blocks[4]
    assert len(blocks[4].splitlines()) == len(Q) + 2


def test_the_largest_forces_may_come_from_more_positions(found):
    few = reactions(forced.slider_crank(guides=2), Q[:2], 15.0)
    many = reactions(forced.slider_crank(guides=2), Q, 15.0)
    block = few.table(many).split("\n\n")[-2].splitlines()
    worst = next(extreme for extreme in many.extremes() if extreme.joint == "pivot")
    assert worst.force > few.resultant("pivot").max()
    assert block[:2] == ["largest forces", f"  pivot: {worst.force:.6g} N at {worst.at:.6g} rad"]


def test_rounding_is_cleared_and_nothing_else(found):
    force, moment = found.scales()
    assert force >= max(extreme.force for extreme in found.extremes())
    parts = dict(found.components["guide"])
    parts["normal"] = np.where(np.arange(len(Q)) == 1, 0.9e-12 * force, parts["normal"])
    parts["moment"] = np.where(np.arange(len(Q)) == 2, -0.9e-12 * moment, parts["moment"])
    clear = found._replace(components=dict(found.components) | {"guide": parts}).cleared()
    assert clear.components["guide"]["normal"][1] == 0.0
    assert clear.components["guide"]["moment"][2] == 0.0
    np.testing.assert_array_equal(clear.components["guide"]["normal"][2:], found.components["guide"]["normal"][2:])
    np.testing.assert_array_equal(clear.action, found.action)


def test_what_is_left_open_is_said_and_never_given_a_number():
    open_ = reactions(forced.slider_crank(guides=2), Q, 15.0)
    text = open_.table()
    assert "left open by redundant constraints: guide.normal, guide.moment, other_guide.normal" in text
    guide = next(block for block in text.split("\n\n") if block.startswith("guide\n"))
    assert all(line.split()[1:] == ["none"] * 3 for line in guide.splitlines()[2:])
    assert ",,," in open_.csv()
    assert [extreme.joint for extreme in open_.extremes()] == ["pivot", "crank_pin", "slider_pin"]
