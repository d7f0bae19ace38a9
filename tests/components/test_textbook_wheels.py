"""Wheels of published problems: the figures recomputed from their inputs, and the printed ones within their rounding."""

from __future__ import annotations

from math import pi

from numpy.testing import assert_allclose

from flywheel.components.press_work import inertia_between
from flywheel.components.wheel_stresses import greatest_disc_stress, material, rim_on_arms, ring_constant
from flywheel.components.wheels import WheelAsked, choose

RPM = pi / 30


def inertia_for(energy, speed, irregularity):
    return energy / (speed**2 * irregularity)


def test_rim_of_a_steam_engine():
    """Khurmi, example 16.15: printed 3787 kg, 0.084 m²."""
    omega = 80 * RPM
    needed = inertia_for(150e3 * 60 / 80 * 0.1, omega, 0.04)
    asked = WheelAsked("rim", material(density=7200.0), method="thin", mean_radius=1.0, rim_share=0.95)
    wheel = choose(needed, omega, asked)
    assert_allclose(wheel.mass, 3806.965371717721, rtol=1e-13)
    assert_allclose(wheel.body.section, 0.08415241070674308, rtol=1e-13)
    assert_allclose([wheel.mass, wheel.body.section], [3787, 0.084], rtol=0.006)
    assert_allclose(wheel.inertia, needed, rtol=1e-13)


def test_rim_of_a_diesel_engine():
    """Khurmi, example 16.17: printed 2316 kg m², 21.6 and 86.3 mm."""
    needed = inertia_between(10181.937500000002, 102 * RPM, 98 * RPM)
    assert_allclose(needed, 2321.2034083626872, rtol=1e-13)
    iron = material(density=8150.0, allowable=7.5e6)
    wheel = choose(needed, 100 * RPM, WheelAsked("rim", iron, method="thin", width_to_thickness=4.0))
    sizes = [wheel.body.thickness, wheel.body.width, 2 * wheel.body.mean]
    assert_allclose(sizes, [0.02159101462368494, 0.08636405849473977, 5.793662666762245], rtol=1e-13)
    assert_allclose(sizes[:2], [0.0216, 0.0863], rtol=0.015)
    assert_allclose([wheel.safety, wheel.utilisation], 1.0, rtol=1e-13)


def test_rim_of_a_gas_engine():
    """Khurmi, example 16.18: printed 3 m, 170 and 680 mm; exactly, an annulus needs less."""
    needed, omega = inertia_for(46446.42857142858, 150 * RPM, 0.01), 150 * RPM
    iron = material(density=7200.0, allowable=4e6)
    asked = WheelAsked("rim", iron, method="thin", width_to_thickness=4.0, rim_share=0.9375)
    body = choose(needed, omega, asked).body
    assert_allclose(
        [2 * body.mean, body.thickness, body.width], [3.001054387190354, 0.16989865471884073, 0.6795946188753629]
    )
    assert_allclose([2 * body.mean, body.thickness, body.width], [3, 0.170, 0.680], rtol=0.01)
    assert_allclose(choose(needed, omega, asked).mass, 7837.8348214285725, rtol=1e-13)
    exact = choose(needed, omega, asked._replace(method="exact", mean_radius=body.mean))
    assert exact.body.thickness < body.thickness
    assert_allclose(exact.mass, 7837.8348214285725 / (1 + (exact.body.thickness / body.mean / 2) ** 2), rtol=1e-12)


def test_closed_forms_of_a_thin_rim_agree_with_the_search():
    """rho v² = sigma, m R² = I, m = 2 pi R rho t b."""
    radius = (4e6 / 7200.0) ** 0.5 / 15.0
    thickness = (900.0 / radius**2 / (2 * pi * radius * 7200.0) / 2.5) ** 0.5
    asked = WheelAsked("rim", material(density=7200.0, allowable=4e6), method="thin", width_to_thickness=2.5)
    body = choose(900.0, 15.0, asked).body
    assert_allclose([body.mean, body.thickness, body.width], [radius, thickness, 2.5 * thickness], rtol=1e-13)


def test_disc_of_a_given_width():
    """Jindal, example 19-5: printed 0.364 m, 0.29 MPa."""
    omega = 250 * RPM
    needed = inertia_for(441.7864669110647, omega, 0.1)
    wheel = choose(needed, omega, WheelAsked("disc", material(density=7800.0, poisson=0.3), width=0.03))
    assert_allclose(wheel.body.outer, 0.3639023457535473, rtol=1e-13)
    assert_allclose(wheel.stresses["centre"], 0.29202868919655167e6, rtol=1e-13)
    assert_allclose([wheel.body.outer, wheel.greatest_stress / 1e6], [0.364, 0.29], rtol=0.02)
    assert_allclose((2 * needed / (pi * 7800.0 * 0.03)) ** 0.25, wheel.body.outer, rtol=1e-13)
    assert wheel.safety is None


def test_disc_of_a_given_diameter():
    """Uicker, problem 18.2: printed 0.136 kg m², 6.8 kg, and 6.85 mm, which its manual has from a wrong radius: 6.94 mm."""
    omega = 481.7  # as the recomputed figures have it: 4600 rpm rounded, which makes 4.5e-5 of the inertia
    assert_allclose(4600 * RPM, omega, rtol=3e-5)
    wheel = choose(inertia_for(394.38, omega, 0.0125), omega, WheelAsked("disc", material(density=7800.0), outer_radius=0.2))
    found = [wheel.inertia, wheel.mass, wheel.body.width]
    assert_allclose(found, [0.1359726548020429, 6.798632740102145, 6.9361282490618805e-3], rtol=1e-13)
    assert_allclose(found, [0.136, 6.8, 6.85e-3], rtol=0.02)


def test_disc_of_a_given_rim_speed():
    """The course's exam of May 2013: 271.179 kg, 0.2387 m, 0.21035 m."""
    asked = WheelAsked("disc", material(density=7200.0), at="mean", rim_speed=1.5)
    wheel = choose(7.72768650875, 2 * pi, asked)
    assert_allclose([wheel.mass, wheel.body.outer, wheel.body.width], [271.179, 0.2387, 0.21035], rtol=2e-4)
    assert_allclose(wheel.rim_speed, 1.5, rtol=1e-13)


def test_rim_on_six_arms_as_the_book_has_it():
    """Jindal, example 19-1: printed 12.76, 38.9, 31.74 MPa, with a constant that leaves R² = 1.44 m² out."""
    numbers = 7100.0, 1.2 * 500 * RPM, 6, 1.2, 0.15, 4.0
    printed = 12 * 0.00169 / 0.15**2 + 0.957 + 4.0
    book = rim_on_arms(*numbers, constant=printed)
    assert_allclose(book, [12.7588854618919e6, 38.879127209354095e6, 31.740523024877653e6], rtol=1e-12)
    assert_allclose(book, [12.76e6, 38.9e6, 31.74e6], rtol=0.002)
    true = rim_on_arms(*numbers)
    assert_allclose(true.arm / book.arm, printed / ring_constant(6, 1.2, 0.15, 4.0), rtol=1e-13)
    assert 0.93 < true.arm / book.arm < 0.94


def test_printed_factors_are_rounded():
    """Handbooks' 12 f2 and f1 for 4, 6 and 8 arms; the last 12 f2 should be 0.00832."""
    for count, f1, twelve_f2, within in ((4, 0.643, 0.07296, 1e-3), (6, 0.957, 0.02028, 5e-3), (8, 1.274, 0.00912, 0.1)):
        for share in (0.5, 4.0):
            printed = twelve_f2 * (1.7 / 0.2) ** 2 + f1 + share
            assert_allclose(printed, ring_constant(count, 1.7, 0.2, share), rtol=within)


def test_disc_with_a_pinhole_bears_half():
    solid = greatest_disc_stress(0.3, 0.0, 7800.0, 100.0, 0.3)
    assert_allclose(greatest_disc_stress(0.3, 1e-9, 7800.0, 100.0, 0.3), 2 * solid, rtol=1e-12)
