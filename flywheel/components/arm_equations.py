"""The arm's equations in symbols."""

from __future__ import annotations

from typing import NamedTuple

import sympy as sp  # type: ignore[import-untyped]

from flywheel.components.robot_arm import TwoLinkArm


class LagrangeEquations(NamedTuple):
    """The equations in symbols: `left` = `right`, one a coordinate; `mass` is the matrix of the accelerations in `left`.

    `parameters` are l1, m1, I1, c1, m2, I2, c2, g; `torques` T1, T2; `values(arm)` gives the parameters their numbers.
    """

    t: sp.Symbol
    q: tuple[sp.Expr, sp.Expr]
    parameters: tuple[sp.Symbol, ...]
    torques: tuple[sp.Symbol, ...]
    kinetic: sp.Expr
    potential: sp.Expr
    left: tuple[sp.Expr, ...]
    right: tuple[sp.Expr, ...]
    mass: sp.Matrix

    def values(self, arm: TwoLinkArm) -> dict[sp.Symbol, float]:
        """Numbers (SI) for the parameters."""
        (l1, m1, i1, c1), (_, m2, i2, c2) = arm.first, arm.second
        return dict(zip(self.parameters, (l1, m1, i1, c1, m2, i2, c2, arm.gravity), strict=True))


def lagrange_equations() -> LagrangeEquations:
    """Lagrange's equations of the arm in symbols: T and V from the centres' positions, then by differentiation alone.

    d/dt(dL/dq_i') - dL/dq_i = Q_i, L = T - V.

    >>> found = lagrange_equations()
    >>> found.mass[0, 1]
    c2*l1*m2*cos(q1(t) - q2(t))

    """
    t = sp.Symbol("t", real=True)
    q = sp.Function("q1", real=True)(t), sp.Function("q2", real=True)(t)
    l1, m1, i1, c1, m2, i2, c2, g = parameters = sp.symbols("l1 m1 I1 c1 m2 I2 c2 g", positive=True)
    t1, t2 = torques = sp.symbols("T1 T2", real=True)
    along = [sp.Matrix([-sp.sin(angle), sp.cos(angle)]) for angle in q]
    centres = c1 * along[0], l1 * along[0] + c2 * along[1]
    bodies = tuple(zip((m1, m2), (i1, i2), centres, q, strict=True))
    kinetic = sp.trigsimp(
        sp.expand(sum(m * p.diff(t).dot(p.diff(t)) + i * angle.diff(t) ** 2 for m, i, p, angle in bodies) / 2)
    )
    potential = sp.expand(sum(m * g * p[1] for m, _, p, _ in bodies))
    lagrangian = kinetic - potential
    left = [sp.trigsimp(sp.expand(lagrangian.diff(a.diff(t)).diff(t) - lagrangian.diff(a))) for a in q]
    mass = sp.Matrix(2, 2, lambda i, j: sp.factor(left[i].expand().coeff(q[j].diff(t, 2))))
    return LagrangeEquations(t, q, parameters, torques, kinetic, potential, tuple(left), (t1 - t2, t2), mass)
