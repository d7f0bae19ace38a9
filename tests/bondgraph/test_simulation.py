"""Motions of whole graphs, written by hand, against references found by other routes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph import Builder, C, GraphError, I, R, Se, Sf, simulate

# -- the three published moving references ----------------------------------------------------------------------------


def slider_crank(crank=1.0, rod=(2.0, 0.06), slider=3.0, r=0.2, length=0.6):
    """Crank about its pivot, rod with mass and inertia at mid-length, slider: three branches of MTFs from the crank."""

    def root(theta):
        return np.sqrt(length**2 - (r * np.sin(theta)) ** 2)

    def swing(theta):  # rod's angular velocity per crank's
        return -r * np.cos(theta) / root(theta)

    def along(theta):
        return -r * np.sin(theta) - r**2 * np.sin(theta) * np.cos(theta) / root(theta)

    def middle_x(theta):
        return -r * np.sin(theta) - 0.5 * r**2 * np.sin(theta) * np.cos(theta) / root(theta)

    b = Builder().one("crank", "rotation", displacement="theta").one("rod", "rotation").one("slider", "translation")
    b.one("x", "translation").one("y", "translation")
    b.on("crank", I("J", crank)).on("rod", I("J_rod", rod[1])).on("slider", I("m", slider))
    b.on("x", I("m_x", rod[0])).on("y", I("m_y", rod[0]))
    b.transform("crank", "rod", swing).transform("crank", "slider", along)
    return b.transform("crank", "x", middle_x).transform("crank", "y", lambda theta: 0.5 * r * np.cos(theta))


def test_slider_crank_without_loads_after_one_second():
    run = simulate(slider_crank().build(), 1.0, initial={"crank": 10.0}, rtol=1e-11)
    assert_allclose(run.displacement("theta", 1.0), 9.605127434380, rtol=1e-11)
    assert_allclose(run.flow("crank", 1.0), 9.986857706929, rtol=1e-11)
    assert run.reached
    assert run.audit.power < 1e-14
    assert run.audit.energy < 1e-11


def test_exudyn_slider_crank_driven_for_a_time():
    rod = (0.2, 0.2 * 0.3**2 / 12)
    b = slider_crank(0.2 * 0.1**2 / 3, rod, 0.4, 0.1, 0.3).on("crank", Se("M", 0.1))
    run = simulate(b.build(), 0.93754409, rtol=1e-10)
    # the published run itself has tolerance 1e-6: 12.626642 rad, 42.986635 rad/s; the reduced model gives these
    assert_allclose(run.displacement("theta", 0.93754409), 12.626621, rtol=1e-7)
    assert_allclose(run.flow("crank", 0.93754409), 42.986903, rtol=1e-7)


def test_sundials_crank_with_a_spring_and_damper_between_two_moving_points():
    a = 0.5

    def rod(q):  # sin p = -a sin q
        return np.arcsin(-a * np.sin(q))

    def swing(q):
        return -a * np.cos(q) / np.cos(rod(q))

    def slider(q):  # x = cos p + a cos q
        return -a * np.sin(q) - np.sin(rod(q)) * swing(q)

    def point(q):  # d/dq (x + cos p)
        return slider(q) - np.sin(rod(q)) * swing(q)

    def gap(q):  # from the crank's middle to the rod's
        return 0.5 * a * np.cos(q) + 0.5 * np.cos(rod(q)), 0.5 * a * np.sin(q) - a * np.sin(q) - 0.5 * np.sin(rod(q))

    def stretching(q):
        x, y = gap(q)
        x_rate = -0.5 * a * np.sin(q) - 0.5 * np.sin(rod(q)) * swing(q)
        y_rate = -0.5 * a * np.cos(q) - 0.5 * np.cos(rod(q)) * swing(q)
        return (x * x_rate + y * y_rate) / np.hypot(x, y)

    b = Builder().one("crank", "rotation", displacement="q", initial=np.pi / 2).one("rod", "rotation")
    b.one("slider", "translation").one("point", "translation").one("stretch", "translation")
    b.on("crank", I("J1", 1.0)).on("rod", I("J2", 2.0)).on("slider", I("m2", 1.0)).on("point", Se("F", 1.0))
    b.on("stretch", C("spring", stiffness=1.0), R("damper", 1.0))
    b.transform("crank", "rod", swing).transform("crank", "slider", slider)
    b.transform("crank", "point", point).transform("crank", "stretch", stretching)
    start = np.hypot(*gap(np.pi / 2)) - 1.0
    run = simulate(b.build(), 10.0, initial={"spring": start}, rtol=1e-9)
    assert_allclose(run.displacement("q", [2.5, 5.0, 10.0]), [0.0722361, -1.4300, 1.2757], atol=5e-5)
    assert run.audit.energy < 1e-9
