"""Figures never show a digit beyond their error, and columns keep their points in line."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.numerics.units import aligned, columns, figure, short


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_digit_stands_beyond_the_error(sign: float) -> None:
    rng = np.random.default_rng(3)
    for value, relative in zip(sign * 10.0 ** rng.uniform(-12, 12, 100), 10.0 ** rng.uniform(-14, -1, 100), strict=True):
        check_digits(float(value), float(relative))


def check_digits(value: float, relative: float) -> None:
    error = relative * abs(value)
    shown = figure(value, error)
    digits = shown.lstrip("-").partition("e")[0].replace(".", "").lstrip("0")
    assert len(digits) <= 10
    assert abs(float(shown) - value) <= 5.5 * max(error, 1e-10 * abs(value))
    exponent = float(shown.partition("e")[2] or 0)
    decimals = len(shown.partition("e")[0].partition(".")[2])
    if decimals:
        assert 10.0 ** (exponent - decimals) >= 0.9 * error


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.0, 0.0, "0"),
        (1e-17, 1e-16, "0"),
        (float("nan"), 0.0, "none"),
        (float("inf"), 0.0, "none"),
        (2.0, 1e-3, "2"),
        (12345.678, 0.5, "12346"),
        (12345.678, 2000.0, "1e+04"),
    ],
)
def test_figure(value: float, error: float, text: str) -> None:
    assert figure(value, error) == text


def test_short_keeps_two_digits() -> None:
    assert short(1.2345e-13) == "1.2e-13"


def test_points_stand_under_one_another() -> None:
    cells = aligned(["1.5", "-200", "3e-07", "no steady motion", "0.25 %"])
    assert len(set(map(len, cells))) == 1
    assert [cell.index(mark) for cell, mark in zip(cells, (".", "00 ", "e", "n", "."), strict=True)] == [4, 2, 4, 0, 4]


def test_columns_put_headers_over_the_right_column() -> None:
    lines = columns([("a", "1.5", "J"), ("long", "22", "")], ("", "work", "unit"))
    assert lines == ["        work  unit", "  a      1.5     J", "  long  22"]


def test_no_rows_no_lines() -> None:
    assert columns([]) == []
