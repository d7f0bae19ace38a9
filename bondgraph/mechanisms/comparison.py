"""Methods for a slider-crank set side by side: bond graph, triangle and Lagrange.

What is compared, and with what:

- kinematics (`compare_kinematics`): the crank's motion is imposed by a source of flow, so the slider's position, velocity
  and acceleration follow from the graph by integration, and from the triangle in closed form;
- dynamics (`compare_free_motion`): no loads, the crank starts at theta = 0; the graph against Lagrange's equation, once
  exact and once with the coefficients of small lambda = r/l;
- kinetostatics (`compare_torques`): the torque that imposes a motion, by the effort of the source's bond and by Lagrange.

An imposed motion and a free one are two motions, not two methods: setting the one against the other, as is sometimes
done, measures nothing but how far apart they are.

How the step fares that divides by the transformer's modulus is in `bondgraph.mechanisms.dead_centre`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Sf
from bondgraph.faults import GraphError, refuse, size_faults
from bondgraph.mechanisms.slider_crank import (
    HARMONIC,
    Imposed,
    Inertia,
    SliderCrank,
    exact_inertia,
    small_ratio_inertia,
    triangle,
)
from bondgraph.motion.simulation import simulate

Array = NDArray[np.float64]

_TIGHT = 1e-11  # relative error of the runs that others are measured by


# -- statistics ---------------------------------------------------------------------------------------------------------


class Agreement(NamedTuple):
    """How a curve agrees with its reference.

    pearson: r, the covariance over both standard deviations; blind to scale and offset. coefficient:
    sqrt|1 - SS_res/SS_tot|, at times called Pearson's though it is not r: it does see scale and offset, but the modulus
    lets it come back towards and past 1 when the fit is bad (a curve against its own mirror image has r = -1 and sqrt 3).
    mean, greatest: of the residual's absolute value.
    """

    pearson: float
    coefficient: float
    mean: float
    greatest: float


def agreement(curve: Any, reference: Any) -> Agreement:
    """Agreement of a curve with a reference at the same times.

    Raises:
        GraphError: if a curve has a value that is no number, or does not vary, so that no correlation exists.

    >>> t = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    >>> [round(x, 6) for x in agreement(np.sin(t) + 0.5, np.sin(t))]
    [1.0, 0.707107, 0.5, 0.5]

    """
    a, b = np.asarray(curve, dtype=float), np.asarray(reference, dtype=float)
    if a.shape != b.shape or a.ndim != 1:
        raise GraphError(f"agreement: found curves of shape {a.shape} and {b.shape}, expected the same times")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise GraphError("agreement: a curve has values that are no numbers")
    if a.size < 2 or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        raise GraphError("agreement: a curve does not vary, so nothing correlates with it; compare residuals instead")
    residual, spread, other = np.abs(a - b), b - b.mean(), a - a.mean()
    pearson = float(other @ spread / math.sqrt((other @ other) * (spread @ spread)))
    coefficient = math.sqrt(abs(1.0 - float(residual @ residual) / float(spread @ spread)))
    return Agreement(pearson, coefficient, float(residual.mean()), float(residual.max()))


@dataclass(frozen=True, eq=False)
class Quantity:
    """One quantity by several methods at the same times, one of them the reference."""

    name: str
    unit: str
    reference: str
    curves: Mapping[str, Array]

    def residual(self, method: str) -> Array:
        """Curve minus reference."""
        return np.asarray(self._curve(method) - self.curves[self.reference])

    def agreement(self, method: str) -> Agreement:
        """How a method's curve agrees with the reference."""
        return agreement(self._curve(method), self.curves[self.reference])

    def _curve(self, method: str) -> Array:
        if method not in self.curves:
            raise GraphError(f"{self.name}: no method {method!r}: there are {', '.join(self.curves)}")
        return self.curves[method]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Methods side by side: `comparison[quantity]` holds the curves, `table()` the statistics."""

    title: str
    t: Array
    quantities: tuple[Quantity, ...]

    def __getitem__(self, name: str) -> Quantity:
        found = next((q for q in self.quantities if q.name == name), None)
        if found is None:
            raise GraphError(f"no quantity {name!r}: there are {', '.join(q.name for q in self.quantities)}")
        return found

    def table(self) -> str:
        """The statistics of every quantity and method, as text."""
        lines = [f"{self.title}; reference: {self.quantities[0].reference}"]
        lines.append(f"{'':44s}{'mean |res|':>11s}{'greatest':>11s}{'Pearson r':>15s}{'sqrt|1-SSr/SSt|':>17s}")
        for quantity in self.quantities:
            for method in quantity.curves:
                if method != quantity.reference:
                    found = quantity.agreement(method)
                    label = f"{quantity.name}, {quantity.unit}: {method}"
                    numbers = f"{found.mean:11.2e}{found.greatest:11.2e}{found.pearson:15.10f}{found.coefficient:17.10f}"
                    lines.append(f"{label:44s}{numbers}")
        return "\n".join(lines)


# -- the comparisons ----------------------------------------------------------------------------------------------------


def compare_kinematics(
    machine: SliderCrank | None = None, imposed: Imposed = HARMONIC, *, until: float = 10.0, step: float = 0.01
) -> Comparison:
    """The slider of an imposed motion: the graph integrated by four methods, against the triangle.

    The graph's crank has a source of flow; the position is the integral of the slider's flow, the acceleration the effort of
    its inertia over its mass. With theta = sin t and steps of 0.01 s the greatest error of the velocity is 1.5e-2 m/s by
    Euler, 4.3e-6 by rk2, 1.8e-12 by rk4. With theta = 5 t every method has the velocity right, as the angle is linear in t,
    while the position still shows its order: 2.8e-2, 4.7e-4, 1.2e-8 m.

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each.
        imposed: motion of the crank.
        until: time to simulate, s.
        step: of the fixed-step methods, s.

    Raises:
        GraphError: if `until` or `step` is not above 0.

    >>> found = compare_kinematics(until=1.0, step=0.1)["velocity"]
    >>> [found.agreement(method).greatest < 1e-3 for method in ("euler", "rk2", "DOP853")]
    [False, True, True]

    """
    machine = machine or SliderCrank()
    source = Sf("drive", imposed.omega)
    graph = machine.builder(float(imposed.theta(0.0))).on("crank", source).build()
    runs = {name: simulate(graph, until, method=name, step=step) for name in ("euler", "rk2", "rk4")}
    runs["DOP853"] = simulate(graph, until, rtol=_TIGHT)
    t, bond = runs["euler"].t, graph.bond_of("m").number
    exact = triangle(machine, imposed.theta(t), imposed.omega(t), imposed.alpha(t))

    def quantity(name: str, unit: str, reference: Array, by_run: Callable[[Any], Array]) -> Quantity:
        return Quantity(name, unit, "triangle", {"triangle": reference} | {m: by_run(run) for m, run in runs.items()})

    quantities = (
        quantity("position", "m", exact.position, lambda run: run.displacement("x", t)),
        quantity("velocity", "m/s", exact.velocity, lambda run: run.flow("slider", t)),
        quantity("acceleration", "m/s²", exact.acceleration, lambda run: run.effort(bond, t) / machine.slider),
    )
    return Comparison(f"slider, {imposed.name} imposed on the crank", t, quantities)


def lagrange_methods(machine: SliderCrank) -> dict[str, Callable[[Any], Inertia]]:
    """Inertia of the machine by every version of Lagrange's equation, by name; the first is exact."""
    return {
        "exact Lagrange": lambda theta: exact_inertia(machine, theta),
        "small lambda": lambda theta: small_ratio_inertia(machine, theta),
        "small lambda, m l²/3": lambda theta: small_ratio_inertia(machine, theta, about="end"),
    }


def compare_free_motion(
    machine: SliderCrank | None = None, *, omega: float = 1.0, until: float = 10.0, points: int = 501
) -> Comparison:
    """The motion without loads from theta = 0: the graph and two approximate Lagrange equations, against the exact one.

    All are integrated by DOP853. The slider's velocity takes its exact gain in every version, so that it shows what the
    coefficients do to the crank. With the default machine over 10 s (6.9 rad) the graph agrees to 2e-11 rad; the
    small-lambda crank is up to 0.15 rad off, with m l²/3 for the rod 0.96 rad, and r of its omega falls to 0.907 and 0.381.

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each.
        omega: angular velocity at the start, rad/s.
        until: time to simulate, s.
        points: number of times at which the methods are compared.

    Raises:
        GraphError: if `until` is not above 0, or fewer than 2 points are asked for.

    """
    machine = machine or SliderCrank()
    t = _times(until, points)
    moved = {name: _free(inertia, omega, t) for name, inertia in lagrange_methods(machine).items()}
    run = simulate(machine.builder().build(), until, initial={"crank": omega}, rtol=_TIGHT)
    states = {"bond graph": (run.displacement("theta", t), run.flow("crank", t))} | moved
    slider = {name: machine.along(1.0, theta)[1] * rate for name, (theta, rate) in moved.items()}
    reference = "exact Lagrange"
    quantities = (
        Quantity("theta", "rad", reference, {name: theta for name, (theta, _) in states.items()}),
        Quantity("omega", "rad/s", reference, {name: rate for name, (_, rate) in states.items()}),
        Quantity("velocity", "m/s", reference, {"bond graph": run.flow("slider", t)} | slider),
    )
    return Comparison(f"free motion from {omega:g} rad/s", t, quantities)


def _times(until: float, points: int) -> Array:
    few = [] if points > 1 else [f"points: found {points}, expected 2 or more"]
    refuse(size_faults([("until", until)]) + few)
    return np.linspace(0.0, until, points)


def _free(inertia: Callable[[Any], Inertia], omega: float, t: Array) -> tuple[Array, Array]:
    from scipy.integrate import solve_ivp

    def rates(_: float, state: Array) -> list[Any]:
        return [state[1], inertia(state[0]).alpha(state[1])]

    found = solve_ivp(rates, (0.0, t[-1]), [0.0, omega], method="DOP853", rtol=1e-12, atol=1e-12, t_eval=t)
    return found.y[0], found.y[1]


def compare_torques(
    machine: SliderCrank | None = None, imposed: Imposed = HARMONIC, *, until: float = 10.0, points: int = 501
) -> Comparison:
    """The torque that imposes a motion: the effort of the source's bond, and Lagrange's J alpha + ½ J' omega².

    The graph finds its angle by integration; with the default machine it agrees with the exact equation to 5e-12 N m, while
    the small-lambda coefficients are up to 0.72 N m off for theta = sin t (of 2.6) and 22 N m for theta = 5 t (of 33). For
    constant omega the two small-lambda torques differ by a factor alone, so that Pearson's r cannot tell them apart.

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each.
        imposed: motion of the crank.
        until: time to simulate, s.
        points: number of times at which the methods are compared.

    Raises:
        GraphError: if `until` is not above 0, or fewer than 2 points are asked for.

    """
    machine = machine or SliderCrank()
    t = _times(until, points)
    graph = machine.builder(float(imposed.theta(0.0))).on("crank", Sf("drive", imposed.omega)).build()
    torque = simulate(graph, until, rtol=_TIGHT).effort(graph.bond_of("drive").number, t)
    curves = {"bond graph": torque}
    for name, inertia in lagrange_methods(machine).items():
        curves[name] = inertia(imposed.theta(t)).torque(imposed.omega(t), imposed.alpha(t))
    quantity = Quantity("torque", "N m", "exact Lagrange", curves)
    return Comparison(f"torque on the crank, {imposed.name}", t, (quantity,))
