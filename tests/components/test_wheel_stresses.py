"""Formulas of stress and mass against independent routes: equilibrium by differences, Castigliano's energy, quadrature."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from mpmath import mp
from numpy.testing import assert_allclose

from flywheel.components.wheel_stresses import (
    Arms,
    annulus_inertia,
    annulus_mass,
    arm_bending,
    disc_stresses,
    greatest_disc_stress,
    hoop_stress,
    material,
    rim_on_arms,
    ring_factors,
)
from flywheel.components.wheels import Body, Hub, parts, stress
from flywheel.numerics.faults import SceneError

RHO, OMEGA, NU = 7800.0, 120.0, 0.29


@pytest.mark.parametrize("inner", [0.0, 0.12])
def test_disc_is_in_equilibrium_and_compatible(inner):
    """d(x sigma_r)/dx - sigma_t + rho w² x² = 0; the strains come from one displacement."""
    x, h = np.linspace(0.15, 0.38, 40), 1e-5

    def slope(function):
        return (function(x + h) - function(x - h)) / (2 * h)

    def both(at):
        return disc_stresses(at, 0.4, inner, RHO, OMEGA, NU)

    radial, hoop = both(x)
    pull = RHO * (OMEGA * x) ** 2
    assert_allclose(slope(lambda at: at * both(at)[0]) - hoop + pull, 0.0, atol=1e-6 * pull.max())
    circumference = slope(lambda at: at * (both(at)[1] - NU * both(at)[0]))  # E u = x (sigma_t - nu sigma_r)
    assert_allclose(circumference, radial - NU * hoop, rtol=1e-6, atol=1e-6 * hoop.max())


@pytest.mark.parametrize("inner", [0.0, 1e-4, 0.12, 0.39])
def test_disc_is_free_at_its_edges_and_stressed_most_inside(inner):
    x = np.linspace(inner, 0.4, 500)
    radial, hoop = disc_stresses(x, 0.4, inner, RHO, OMEGA, NU)
    greatest = greatest_disc_stress(0.4, inner, RHO, OMEGA, NU)
    assert_allclose([hoop.max(), hoop[0]], greatest, rtol=1e-13)
    assert radial.max() <= greatest * (1 + 1e-15)
    assert_allclose([radial[-1], radial[0] if inner else 0.0], 0.0, atol=1e-9 * greatest)


def test_a_thin_annulus_is_a_ring():
    ring, thin = hoop_stress(OMEGA * 0.4, RHO), greatest_disc_stress(0.4 + 1e-7, 0.4 - 1e-7, RHO, OMEGA, NU)
    assert_allclose(thin, ring, rtol=1e-6)


def test_mass_and_inertia_of_an_annulus_by_quadrature():
    radii, weights = np.polynomial.legendre.leggauss(6)
    x, w = 0.25 + 0.15 * radii, 0.15 * weights
    shells = 2 * pi * RHO * 0.07 * x * w
    assert_allclose(annulus_mass(0.4, 0.1, 0.07, RHO), shells.sum(), rtol=1e-13)
    assert_allclose(annulus_inertia(0.4, 0.1, 0.07, RHO), shells @ x**2, rtol=1e-13)


def pull_by_energy(count, radius, thickness, area_ratio):
    """X of least elastic energy over rho A v², by quadrature in 30 digits: ring in bending and tension, arms in tension.

    Unknown are X and the moment M0 between the arms; rho A v² = 1, E = 1, rim of unit section area.
    """
    with mp.workdps(30):
        a, r, t = mp.pi / count, mp.mpf(radius), mp.mpf(thickness)
        second, arm = t**2 / 12, 1 / mp.mpf(area_ratio)

        def slopes(pull, moment):
            """Derivatives of the energy of a sector and its arm by X and M0."""

            def bending(phi):
                return moment - pull / (2 * mp.sin(a)) * r * (1 - mp.cos(phi))

            def tension(phi):
                return 1 - pull * mp.cos(phi) / (2 * mp.sin(a))

            by_moment = 2 * mp.quad(lambda phi: bending(phi) / second * r, [0, a])
            by_pull = 2 * mp.quad(
                lambda phi: (
                    (-bending(phi) * r * (1 - mp.cos(phi)) / second - tension(phi) * mp.cos(phi)) / (2 * mp.sin(a)) * r
                ),
                [0, a],
            )
            own = mp.quad(lambda x: (pull + arm / r**2 * (r**2 - x**2) / 2) / arm, [0, r])
            return by_pull + own, by_moment

        def system(column):
            base = slopes(mp.mpf(0), mp.mpf(0))
            return [value - start for value, start in zip(slopes(*column), base, strict=True)], base

        (a11, a21), base = system((mp.mpf(1), mp.mpf(0)))
        (a12, a22), _ = system((mp.mpf(0), mp.mpf(1)))
        pull, moment = mp.lu_solve(mp.matrix([[a11, a12], [a21, a22]]), mp.matrix([-base[0], -base[1]]))
        return float(pull), float(moment)


@pytest.mark.parametrize(("count", "thickness", "ratio"), [(3, 0.2, 2.0), (6, 0.15, 4.0), (8, 0.05, 1.5), (25, 0.1, 4.0)])
def test_rim_on_arms_has_the_least_energy(count, thickness, ratio):
    radius, rho, v = 1.2, 7100.0, 30.0
    pull, moment = pull_by_energy(count, radius, thickness, ratio)
    found = rim_on_arms(rho, v, count, radius, thickness, ratio)
    hoop, sine, cosine = rho * v**2, np.sin(pi / count), np.cos(pi / count)
    assert_allclose(found.arm, hoop * pull * ratio, rtol=1e-10)
    at_arm = moment - pull * radius / (2 * sine) * (1 - cosine)
    bending = 6 * np.abs([at_arm, moment]) / thickness  # M t/2 over the second moment t²/12 of a unit area
    tension = 1 - pull / (2 * sine) * np.array([cosine, 1.0])
    assert_allclose([found.rim_at_arm, found.rim_between], hoop * (tension + bending), rtol=1e-10)
    assert found.greatest == max(found)


@pytest.mark.parametrize("count", [3, 12, 20, 21, 40, 100])
def test_ring_factors(count):
    with mp.workdps(40):
        a = mp.pi / count
        f1 = (mp.sin(2 * a) / 4 + a / 2) / (2 * mp.sin(a) ** 2)
        assert_allclose(ring_factors(count), [float(f1), float(f1 - 1 / (2 * a))], rtol=1e-10)


@pytest.mark.parametrize("count", [2, 101, 6.5, float("nan")])
def test_number_of_arms_is_checked(count):
    with pytest.raises(SceneError, match="arms: found"):
        ring_factors(count)


def test_arms_in_bending():
    arms = Arms(6, 0.1, 0.04)
    angle = np.linspace(0, 2 * pi, 400, endpoint=False)
    second = 0.05**3 * 0.02 * np.mean(np.cos(angle) ** 2) * 2 * pi / 4  # of an ellipse, in the plane of rotation
    assert_allclose(arms.modulus, second / 0.05, rtol=1e-12)
    assert_allclose(arms.area, pi * 0.05 * 0.02, rtol=1e-15)
    moment = 900.0 * (0.8 - 0.1) / (0.8 * 6)
    found = arm_bending(900.0, 6, 0.8, 0.1, arms.modulus)
    assert_allclose(found, moment / arms.modulus, rtol=1e-13)


def test_parts_of_a_wheel_with_arms_by_grains():
    """Arms cut into small boxes; hub and rim as annuli."""
    body = Body("arms", 0.8, 0.65, 0.15, 0.3, arms=Arms(5, 0.1, 0.04), hub=Hub(0.08, 0.2, 0.25))
    along, across = np.linspace(0.1, 0.65, 4001), np.linspace(-0.05, 0.05, 4001)
    x, y = (along[1:] + along[:-1]) / 2, (across[1:] + across[:-1]) / 2
    depth = 2 * 0.02 * np.sqrt(1 - (y / 0.05) ** 2)
    area = depth.sum() * np.diff(across)[0]
    inertia = RHO * ((x**2).sum() * np.diff(along)[0] * area + 0.55 * (depth * y**2).sum() * np.diff(across)[0])
    rim, arms, hub = parts(body, RHO)
    assert_allclose([arms.mass, arms.inertia], [5 * RHO * area * 0.55, 5 * inertia], rtol=1e-5)
    assert_allclose([rim.mass, rim.inertia], [annulus_mass(0.8, 0.65, 0.3, RHO), annulus_inertia(0.8, 0.65, 0.3, RHO)])
    assert_allclose([hub.mass, hub.inertia], [annulus_mass(0.1, 0.04, 0.25, RHO), annulus_inertia(0.1, 0.04, 0.25, RHO)])


def test_stress_of_arms_adds_pull_own_weight_and_torque():
    body = Body("arms", 0.8, 0.65, 0.15, 0.3, arms=Arms(5, 0.1, 0.04), hub=Hub(0.08, 0.2, 0.25))
    steel = material(density=RHO)
    still, bent = stress(body, steel, 1e-9, 500.0), stress(body, steel, OMEGA, 500.0)
    free = stress(body, steel, OMEGA)
    assert_allclose(still["arms at the hub"], arm_bending(500.0, 5, 0.725, 0.1, body.arms.modulus), rtol=1e-9)
    assert_allclose(bent["arms at the hub"] - free["arms at the hub"], still["arms at the hub"], rtol=1e-9)
    x = np.linspace(0.1, 0.65, 2001)
    own = RHO * OMEGA**2 * np.trapezoid(x, x)
    assert_allclose(free["arms at the hub"] - free["arms at the rim"], own, rtol=1e-9)
    assert free["rim at the arms"] == bent["rim at the arms"]
