"""Reciprocating compressors: the cycle's pressures, its work by quadrature, and the expression of its force."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import quad

from flywheel.components.gas_forces import (
    Compression,
    Space,
    compressor_law,
    compressor_work,
    cylinder_pressure,
    gas_force,
    volumetric_efficiency,
)

CYCLES = [
    Compression(1e5, 7e5, 0.05, 1.3, 1.3),
    Compression(1e5, 7e5, 0.05, 1.35, 1.2),
    Compression(1e5, 3e5, 0.0, 1.4, 1.4),
    Compression(0.9e5, 5e5, 0.08, 1.0, 1.0),
    Compression(2e5, 2.1e5, 0.3, 1.25, 1.3),
]


@pytest.mark.parametrize("cycle", CYCLES)
def test_the_work_is_the_area_of_the_cycle(cycle):
    edges = [0.0, cycle.suction_begins, cycle.delivery_begins, 1.0]
    total = 0.0
    for a, b in zip(sorted(edges), sorted(edges)[1:], strict=False):
        for outward, sign in ((True, -1), (False, 1)):
            pressure = quad(lambda s: float(cylinder_pressure(s, outward, cycle)), a, b, epsabs=0, epsrel=1e-12)[0]  # noqa: B023
            total += sign * pressure
    assert compressor_work(cycle, 2e-3) == pytest.approx(2e-3 * total, rel=1e-11)


def test_work_and_efficiency_at_30_digits():
    """The textbook's own form, with one exponent: n/(n-1) p (V1 - V4) (r^((n-1)/n) - 1)."""
    with mp.workdps(30):
        c, r, n = mpf("0.05"), mpf(7), mpf("1.3")
        efficiency = 1 + c - c * r ** (1 / n)
        work = n / (n - 1) * 10**5 * mpf("1e-3") * efficiency * (r ** ((n - 1) / n) - 1)
    cycle = CYCLES[0]
    assert volumetric_efficiency(cycle) == pytest.approx(float(efficiency), rel=1e-14)
    assert compressor_work(cycle, 1e-3) == pytest.approx(float(work), rel=1e-14)


@pytest.mark.parametrize("cycle", CYCLES)
def test_pressures_meet_where_valves_open(cycle):
    close = 1e-9
    opens, draws = cycle.delivery_begins, cycle.suction_begins
    assert cylinder_pressure([opens - close, opens], [False, False], cycle) == pytest.approx(
        [cycle.discharge] * 2, rel=1e-12
    )
    assert cylinder_pressure(opens + close, False, cycle) == pytest.approx(cycle.discharge, rel=1e-6)
    assert cylinder_pressure(draws + close, True, cycle) == pytest.approx(cycle.suction, rel=1e-12)
    assert cylinder_pressure(1.0, False, cycle) == pytest.approx(cycle.suction, rel=1e-12)
    if cycle.clearance:
        assert cylinder_pressure(0.0, True, cycle) == pytest.approx(cycle.discharge, rel=1e-12)


def test_an_exponent_of_1_is_the_limit():
    near = CYCLES[3]._replace(exponent=1.0 + 1e-9, expansion=1.0 + 1e-9)
    assert compressor_work(CYCLES[3], 1.0) == pytest.approx(compressor_work(near, 1.0), rel=1e-8)


@pytest.mark.parametrize("cycle", CYCLES)
@pytest.mark.parametrize("near_far", [(0.5, 0.3), (0.3, 0.5), (-0.4, -0.2)])
def test_the_expression_is_the_formula(cycle, near_far):
    near, far = near_far
    spaces = Space(0.02, near, far), Space(0.017, far, near)
    share = np.linspace(0.001, 0.999, 101)
    x = near + (far - near) * share
    for outward in (True, False):
        velocity = np.full(x.shape, (far - near) * (1 if outward else -1))
        wanted = gas_force(cylinder_pressure(share, outward, cycle), spaces[0])
        assert compressor_law(cycle, spaces[:1]).evaluate({"x": x, "v": velocity}, np) == pytest.approx(wanted, rel=1e-11)
        wanted = wanted + gas_force(cylinder_pressure(1 - share, not outward, cycle), spaces[1])
        law = compressor_law(cycle, spaces)
        assert law.evaluate({"x": x, "v": velocity}, np) == pytest.approx(wanted, rel=1e-10, abs=1e-6)
        assert not law.uses_speed
