"""Load windows from 20 deg down to 0.001 deg: alone, across the seam, several, touching; against 30 digits."""

from __future__ import annotations

from math import pi, tau

import pytest
from mpmath import mp  # type: ignore[import-untyped]

import flywheel
from tests.limits import sample

from .cases import turning
from .machines import Scene
from .measured import Row, measured, names, refusal, row

WINDOWS = names("window", "windows")
WIDTHS = [20.0, 1.0, 0.1, 0.01, 0.001, 1e-5]


def shaft(width: float, start: float = 90.0) -> Scene:
    """A shaft on which 100 N m act in one window (deg)."""
    return turning([{"torque": -100.0, "from": f"{start!r} deg", "to": f"{start + width!r} deg"}])


def closed(width: float, start: float = 90.0) -> tuple[float, float]:
    """Error and estimate of the shaft's flywheel: T b (1 - b/2 pi)/(eps w²) for a window of b rad."""
    found = flywheel.size(flywheel.load(shaft(width, start)), simulate=False)
    with mp.workdps(30):
        wide = (mp.mpf(repr(start + width)) - mp.mpf(repr(start))) * mp.pi / 180
        true = 100 * wide * (1 - wide / (2 * mp.pi)) / (mp.mpf(0.05) * 100)
        return float(abs(found.flywheel.exact - true) / true), found.error.exact


def results() -> list[Row]:
    """One row for each kind."""
    one, more = ([item for name in names(group) for item in measured(name)] for group in ("window", "windows"))
    worst = max((closed(width) for width in WIDTHS[:-1]), key=lambda pair: pair[0])
    return [
        row("a window of a slider-crank", "20..0.001 deg", one),
        row("several windows, windows that touch", "20..0.001 deg", more),
        Row("a window of a shaft alone", "20..0.001 deg", *worst, "closed form: nothing else sways the speed"),
        Row("a window", "1e-10 deg", None, None, refusal(shaft(1e-10))),
    ]


@pytest.mark.parametrize("name", sample(WINDOWS, 5))
def test_every_figure_is_known_to_its_estimate_and_to_rtol(name: str) -> None:
    assert [item for item in measured(name) if not item.honest] == []
    assert [item for item in measured(name) if not item.kept] == []


@pytest.mark.parametrize("start", [0.0, 90.0, 330.0])
@pytest.mark.parametrize("width", WIDTHS)
def test_a_shaft_alone_by_the_closed_form(width: float, start: float) -> None:
    error, estimate = closed(width, start)
    assert error <= estimate + 4e-16
    if width >= 0.001:
        assert estimate <= 1e-9


def test_no_window_is_too_narrow_for_the_time_stepping() -> None:
    found = flywheel.size(flywheel.load(shaft(0.001)))
    assert found.simulation is not None
    assert found.error.simulation is not None
    assert abs(found.simulation.irregularity / 0.05 - 1) <= found.error.simulation


FIGURES = ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel")


def test_two_windows_that_touch_are_one() -> None:
    one = turning([{"torque": -100.0, "from": "90 deg", "to": "120 deg"}])
    two = turning([{"torque": -100.0, "from": f"{a} deg", "to": f"{b} deg"} for a, b in ((90, 100.1), (100.1, 120))])
    found = [flywheel.size(flywheel.load(scene), simulate=False) for scene in (one, two)]
    for name in FIGURES:
        assert getattr(found[1].flywheel, name) == pytest.approx(getattr(found[0].flywheel, name), rel=1e-14)
    assert len(found[0].areas) == len(found[1].areas) == 3


def test_a_window_of_no_width_is_refused() -> None:
    for width in (0.0, 1e-10):
        assert refusal(shaft(width)).startswith("load[0].to: found ")
        assert "where the load begins" in refusal(shaft(width))


@pytest.mark.parametrize("gap", [1e-11, 1e-9, 1e-6])
def test_what_is_left_of_a_turn_beside_a_window_counts(gap: float) -> None:
    """Two loads that all but fill the turn: the swing is that of either, less its gap."""
    scene = turning([{"torque": -100.0, "from": gap, "to": pi}, {"torque": 100.0, "from": pi, "to": tau - gap}])
    found = flywheel.size(flywheel.load(scene), simulate=False)
    assert found.flywheel.exact == pytest.approx(100 * (pi - gap) / 5, rel=found.error.exact)
