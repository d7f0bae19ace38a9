"""The list of keys is consistent in itself."""

import math

import pytest

from flywheel.mechanisms import KINDS
from flywheel.numerics.units import DIMENSIONS
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
    Range,
)

OTHER_KINDS = {
    *("text", "name", "choice", "law", "position", "table", "numbers", "index", "unit", "tables", "list", "flag", "model"),
}
LISTS = [TOP, MECHANISM.keys, OUTPUT.keys, TABLE.keys]
LISTS += [section.keys for section in (*SECTIONS.values(), *LINKAGE_SECTIONS)]
LISTS += [part.keys for kind in KINDS.values() for part in kind.parts] + [kind.keys for kind in KINDS.values()]
KEYS = [key for keys in LISTS for key in keys]


@pytest.mark.parametrize("keys", LISTS)
def test_no_key_is_listed_twice(keys):
    assert len({key.name for key in keys}) == len(keys)


@pytest.mark.parametrize("key", KEYS, ids=lambda key: key.name)
def test_every_key_is_of_a_known_kind_with_a_fitting_default(key):
    assert all(part in DIMENSIONS for part in key.kind.split(" | ")) or key.kind in OTHER_KINDS
    assert key.about
    assert not (key.required and key.default is not None)
    if isinstance(key.default, float):
        assert key.default in key.range
    if key.kind == "choice":
        assert key.default is None or key.default in key.choices


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
