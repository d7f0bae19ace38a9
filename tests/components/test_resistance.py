"""What resists motion: values, the compiled expression, the point that a fan's characteristic passes through."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.components.load_models import (
    Resistance,
    belt_torque,
    quadratic_coefficient,
    resistance,
    resistance_law,
    tension_ratio,
)

SPEEDS = np.array([-30.0, -1.5, -1e-6, 1e-6, 0.3, 2.0, 80.0])


@pytest.mark.parametrize("variable", ["omega", "v"])
@pytest.mark.parametrize(
    "law",
    [
        Resistance(4.0),
        Resistance(0.0, 0.7),
        Resistance(0.0, 0.0, 0.03),
        Resistance(4.0, 0.7, 0.03),
        Resistance(1e-9, 0, 1e9),
    ],
)
def test_the_expression_is_the_formula(law, variable):
    found = resistance_law(law, variable).evaluate({"omega": SPEEDS, "v": SPEEDS}, np)
    assert found == pytest.approx(resistance(SPEEDS, law), rel=1e-15)
    assert np.all(resistance(SPEEDS, law) * SPEEDS < 0)


def test_nothing_resists_where_every_share_is_0():
    assert float(resistance_law(Resistance(), "v").evaluate({}, np)) == 0.0


def test_only_shares_that_depend_on_speed_make_a_law_depend_on_it():
    assert not resistance_law(Resistance(3.0), "omega").uses_speed
    assert resistance_law(Resistance(3.0, 0.1), "omega").uses_speed
    assert resistance_law(Resistance(0.0, 0.0, 0.1), "v").uses_speed


def test_a_fan_takes_what_it_was_given_at_its_speed_and_follows_the_affinity_laws():
    c = quadratic_coefficient(50.0, 10.0)
    assert resistance(10.0, Resistance(quadratic=c)) == pytest.approx(-50.0)
    assert resistance(20.0, Resistance(quadratic=c)) * 20.0 == pytest.approx(8 * -500.0)
    with_head = Resistance(20.0, 0.0, quadratic_coefficient(50.0, 10.0, 20.0))
    assert resistance([10.0, 1e-9], with_head) == pytest.approx([-50.0, -20.0])


def test_belts_by_integrating_the_tension_along_the_wrap():
    friction, wrap, steps = 0.25, 2.8, 200_000
    tension = np.prod(np.full(steps, 1 + friction * wrap / steps))
    assert tension_ratio(friction, wrap) == pytest.approx(tension, rel=1e-5)
    half = np.radians(17.0)
    assert tension_ratio(friction, wrap, 2 * half) == pytest.approx(tension_ratio(friction / np.sin(half), wrap), rel=1e-14)
    assert belt_torque(1200.0, 400.0, 0.3) == pytest.approx(240.0)
    assert tension_ratio(1e3, 1e3) == np.inf
