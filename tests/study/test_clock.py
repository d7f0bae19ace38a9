"""A time that is over ends what works, and only what is inside."""

import time

import pytest

from flywheel.numerics.budget import count
from flywheel.study.tradeoff import OutOfTimeError, limited


def test_evaluations_are_counted_while_there_is_time():
    with limited(time.perf_counter() + 60.0) as tally:
        count(3)
        count(4)
    assert tally.evaluations == 7


def test_the_first_evaluation_past_the_end_raises():
    with pytest.raises(OutOfTimeError), limited(time.perf_counter() - 1.0):
        count(1)


def test_outside_there_is_no_limit():
    with limited(time.perf_counter() - 1.0):
        pass
    count(1)


def test_what_is_inside_keeps_the_limit_around_it():
    now = time.perf_counter()
    with pytest.raises(OutOfTimeError), limited(now - 1.0), limited(now + 60.0):
        count(1)
