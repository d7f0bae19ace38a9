"""Gas on a piston: force by area, and indicator diagrams as expressions of the piston's way."""

from __future__ import annotations

import numpy as np
import pytest

from flywheel.components.gas_forces import (
    Indicator,
    Space,
    gas_force,
    indicated_pressure,
    indicated_work,
    indicator_law,
    piston_area,
)

LOOP = Indicator(
    np.array([0.0, 0.1, 0.1, 0.4, 0.9, 1.0]),
    np.array([6e5, 6e5, 5e5, 2e5, 1.2e5, 1e5]),
    np.array([6e5, 3e5, 2.5e5, 1.5e5, 0.9e5, 1e5]),
)
SPACES = [Space(0.02, 0.5, 0.3), Space(0.02, 0.3, 0.5), Space(0.013, -0.1, -0.35)]


def test_areas_of_a_double_acting_cylinder_and_the_atmosphere_on_its_rod():
    bore, rod, atmosphere = 0.3, 0.05, 1e5
    cover, crank = piston_area(bore), piston_area(bore, rod)
    assert cover - crank == pytest.approx(np.pi * rod**2 / 4, rel=1e-13)
    total = gas_force(4e5, Space(cover, 1.0, 0.0), atmosphere) + gas_force(2e5, Space(crank, 0.0, 1.0), atmosphere)
    assert total == pytest.approx(-4e5 * cover + 2e5 * crank + atmosphere * (cover - crank), rel=1e-13)


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("outward", [True, False])
def test_the_expression_is_the_formula(space, outward):
    share = np.array([0.0, 0.03, 0.0999, 0.1001, 0.25, 0.4, 0.77, 0.95, 1.0])
    x = space.near + (space.far - space.near) * share
    velocity = np.full(x.shape, (1.0 if space.far > space.near else -1.0) * (1 if outward else -1))
    law = indicator_law(LOOP, space, 1e5)
    wanted = gas_force(indicated_pressure(share, np.full(x.shape, outward), LOOP), space, 1e5)
    assert law.evaluate({"x": x, "v": velocity}, np) == pytest.approx(wanted, rel=1e-12, abs=1e-6)
    assert not law.uses_speed
    assert law.switches_on_velocity


@pytest.mark.parametrize("space", SPACES)
def test_the_work_of_a_loop_is_that_of_its_force(space):
    shares = [(a, b) for a, b in zip(LOOP.share, LOOP.share[1:], strict=False) if b > a]
    law = indicator_law(LOOP, space, 1e5)
    total = 0.0
    for a, b in shares:
        x = space.near + (space.far - space.near) * 0.5 * (a + b)
        way = (space.far - space.near) * (b - a)
        out, back = (float(law.evaluate({"x": x, "v": sense * way}, np)) for sense in (1, -1))
        total += way * (out - back)  # straight lines: the middle's force is the mean
    assert indicated_work(LOOP, space.area, space.stroke) == pytest.approx(total, rel=1e-12)
