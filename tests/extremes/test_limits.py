"""What must hold at any irregularity and speed: limits, order, and proven bounds."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flywheel
from flywheel.sizing.results import Sizing
from tests.limits import sample

from .machines import KNOWN, MACHINES, running
from .measured import Row

powers = st.floats(-13.0, 0.29)  # irregularities from 1e-13 to 1.95
paces = st.floats(-6.0, 6.0)  # speeds from 1e-6 to 1e6 rad/s
FEW = settings(max_examples=8, deadline=None, derandomize=True)
QUICK = st.sampled_from(["rotor", "scotch-yoke", "slider-crank", "four-bar", "crank-shaper"])


def sized(name: str, speed: float, eps: float) -> Sizing:
    return flywheel.size(flywheel.load(running(MACHINES[name](), speed, eps)), simulate=False)


def small(name: str, eps: float) -> float:
    """How far the exact figure is from that with the inertia torque, as a share: it is of the order of eps."""
    found = sized(name, 30.0, eps)
    return abs(found.flywheel.exact + middle(found) - found.flywheel.inertia_torque) / found.flywheel.inertia_torque


def middle(found: Sizing) -> float:
    """The mean of the extremes of I*, by which the two figures differ at most."""
    inertia = found.reduced_inertia
    assert inertia is not None
    return (inertia.least + inertia.greatest) / 2


def results() -> list[Row]:
    """The limit of small irregularities, and the rotor by areas."""
    worst = max(small(name, 1e-9) for name in KNOWN)
    even = max((even_rotor(10.0**k) for k in (-14, -9, -3, 0)), key=lambda pair: pair[0])
    return [
        Row("eps to 0", "eps = 1e-9, 30 rad/s", worst, None, "from the figure with the inertia torque; of order eps"),
        Row("I* that does not vary", "eps 1e-14..1", *even, "exact against approximate, which must be the same"),
    ]


def even_rotor(eps: float) -> tuple[float, float]:
    """The difference of the exact and the approximate flywheel of a rotor, and what is stated."""
    found = sized("rotor", 10.0, eps)
    gap = abs(found.flywheel.exact - found.flywheel.approximate) / found.flywheel.approximate_total
    return gap, (found.error.exact or 0.0) + (found.error.approximate or 0.0)


@FEW
@given(powers, paces)
def test_where_inertia_is_constant_exact_and_approximate_agree(power: float, pace: float) -> None:
    found = sized("rotor", 10.0**pace, 10.0**power)
    scale = max(found.flywheel.approximate_total, 0.3)
    assert abs(found.flywheel.exact - found.flywheel.approximate) <= 1e-13 * scale


@FEW
@given(QUICK, powers, paces)
def test_the_exact_figure_is_within_its_proven_bounds(name: str, power: float, pace: float) -> None:
    found = sized(name, 10.0**pace, 10.0**power)
    wheel, slack = found.flywheel, 2 * found.error.exact
    scale = max(wheel.exact, wheel.approximate_total)
    for low, high in (wheel.bracket, wheel.torque_bracket):
        assert max(low, 0.0) - slack * scale <= wheel.exact <= max(high, 0.0) + slack * scale


@FEW
@given(QUICK, st.lists(powers, min_size=2, max_size=4, unique=True), paces)
def test_a_smaller_irregularity_never_asks_for_less(name: str, several: list[float], pace: float) -> None:
    found = [sized(name, 10.0**pace, 10.0**power) for power in sorted(several)]
    for tight, loose in pairwise(found):
        doubt = loose.error.exact * max(loose.flywheel.exact, loose.flywheel.approximate_total)
        assert tight.flywheel.exact >= loose.flywheel.exact - doubt


@pytest.mark.parametrize("name", sample(KNOWN, 2))
def test_as_the_irregularity_vanishes_the_inertia_torque_has_it_right(name: str) -> None:
    assert small(name, 1e-3) < 1e-1
    assert small(name, 1e-9) <= 1.1e-6 * small(name, 1e-3) + 1e-12
