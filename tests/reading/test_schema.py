"""The list of keys is consistent in itself."""

import math

import pytest

from flywheel.mechanisms import KINDS
from flywheel.numerics.units import DIMENSIONS, parse_quantity
from flywheel.reading.load_models import LOAD_MODELS
from flywheel.reading.motors import CURVE, MOTORS
from flywheel.reading.schema import (
    COUPLING,
    COUPLING_KEYS,
    JOINT,
    JOINT_KEYS,
    LINKAGE_SECTIONS,
    MECHANISM,
    OUTPUT,
    SECTIONS,
    TABLE,
    TOP,
    WHEEL_KEYS,
    Range,
)

OTHER_KINDS = {
    *(
        "text",
        "name",
        "choice",
        "law",
        "position",
        "table",
        "numbers",
        "index",
        "unit",
        "tables",
        "list",
        "flag",
        "model",
        "changes",
    ),
}
LISTS = [TOP, MECHANISM.keys, OUTPUT.keys, TABLE.keys, CURVE.keys]
LISTS += [section.keys for section in (*SECTIONS.values(), *LINKAGE_SECTIONS, *LOAD_MODELS.values(), *MOTORS.values())]
LISTS += [part.keys for kind in KINDS.values() for part in kind.parts] + [kind.keys for kind in KINDS.values()]
LISTS += [(*SECTIONS["flywheel"].keys, *WHEEL_KEYS)]
KEYS = [key for keys in LISTS for key in keys]


def test_no_key_is_listed_twice():
    for keys in LISTS:
        assert len({key.name for key in keys}) == len(keys), keys


def test_every_key_is_of_a_known_kind_with_a_fitting_default():
    for key in KEYS:
        assert all(part in DIMENSIONS for part in key.kind.split(" | ")) or key.kind in OTHER_KINDS, key
        assert key.about, key
        assert not (key.required and key.default is not None), key
        assert not isinstance(key.default, float) or key.default in key.range, key
        assert key.kind != "choice" or key.default is None or key.default in key.choices, key


def test_the_example_of_a_key_is_a_value_it_takes():
    given = [key for key in KEYS if key.example]
    assert all(parse_quantity(key.example, key.kind) in key.range for key in given)
    assert {"ratio", "poles", "breakdown_ratio", "efficiency"} <= {key.name for key in given}
    for key in KEYS:
        if key.kind == "number" and not key.example:  # then that of all numbers must suit it
            assert parse_quantity(DIMENSIONS["number"].example, "number") in key.range, key


@pytest.mark.parametrize(
    ("bounds", "inside", "outside", "words"),
    [
        (Range(), [0, -1e300], [math.nan], "any"),
        (Range(0.0), [0, 1], [-1e-300, math.nan], "at least 0"),
        (Range(0.0, low_open=True), [1e-40], [0, 1e-60, math.nan], "above 0"),
        (Range(0.0, 2.0, True, True), [1.99], [0, 2, math.inf], "above 0 and below 2"),
        (Range(1e-14, 0.1), [1e-14, 0.1], [0, 0.2, "0.05"], "at least 1e-14 and at most 0.1"),
    ],
)
def test_ranges(bounds, inside, outside, words):
    assert all(value in bounds for value in inside)
    assert not any(value in bounds for value in outside)
    assert str(bounds) == words


@pytest.mark.parametrize(("section", "owned"), [(JOINT, JOINT_KEYS), (COUPLING, COUPLING_KEYS)])
def test_every_key_of_joints_and_couplings_belongs_to_some_type(section, owned):
    common = {"name", "type", "between"}
    assert {key.name for key in section.keys} == common.union(*owned.values())
    assert next(key for key in section.keys if key.name == "type").choices == tuple(owned)
