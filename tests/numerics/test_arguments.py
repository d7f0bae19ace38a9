"""Arguments of a library's user: what counts as numbers, and how the rest is told."""

from fractions import Fraction

import mpmath as mp
import numpy as np
import pytest

from flywheel.numerics.arguments import ANY, NOT_NEGATIVE, POSITIVE, array, fits, known, number_faults, vector
from flywheel.numerics.faults import SceneError


@pytest.mark.parametrize("value", [0, 1, 0.0, 2.5, np.float64(1.0), np.float32(1.0), np.int64(3)])
def test_finite_numbers_fit(value):
    assert fits(value)
    assert fits(value, NOT_NEGATIVE)
    assert fits(value, POSITIVE) == (value > 0)
    assert fits(-value - 1)
    assert not fits(-value - 1, NOT_NEGATIVE)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 10**400, True, "1", None, [1.0], 1j, np.array(1.0)])
def test_all_else_does_not(value):
    assert [len(number_faults("x", value, expected)) for expected in (ANY, NOT_NEGATIVE, POSITIVE)] == [1, 1, 1]


def test_a_unit_belongs_to_numbers_alone():
    assert [fault.found for fault in number_faults("mass", -2.0, POSITIVE, "kg")] == ["-2.0 kg"]
    assert [fault.found for fault in number_faults("mass", "two", POSITIVE, "kg")] == ['"two"']


@pytest.mark.parametrize("value", [[1, 2], (1.0, 2.0), np.array([1, 2]), [mp.mpf(1), Fraction(2)]])
def test_arrays_of_numbers(value):
    found = array("q", value)
    assert found.dtype == float
    assert found.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("20", 'found "20"'),
        (["1", "2"], "found a value of type list"),
        ([[1.0], [1.0, 2.0]], "found a value of type list"),
        ({1: 2}, "found a table"),
        (True, "found true"),
        (1j, "found a value of type complex"),
        (np.inf, "found inf"),
        (None, "found nothing"),
        ([None, 1.0], "found a value that is not finite"),
    ],
)
def test_what_is_no_array_of_numbers(value, text):
    with pytest.raises(SceneError, match=f"^q: {text}, expected finite numbers$"):
        array("q", value)


@pytest.mark.parametrize("value", [9.81, [1.0, 2.0, 3.0], "down", (0.0, np.nan)])
def test_a_vector_has_two_components(value):
    with pytest.raises(SceneError, match=r"^gravity: found "):
        vector("gravity", value, "m/s²")
    assert vector("gravity", (0, -9.81), "m/s²") == (0.0, -9.81)


@pytest.mark.parametrize("name", ["b", ["a"], None, 1])
def test_names_that_are_not_known(name):
    with pytest.raises(SceneError, match=r"^joint: found .*, expected one of a$"):
        known("joint", name, {"a": 1})
    assert known("joint", "a", {"a": 1}) == 1
