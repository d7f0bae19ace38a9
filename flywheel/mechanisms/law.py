"""Law: outputs whose positions are given as expressions of phi or as tables.

A curve is a position with its two derivatives, by an expression or by a periodic spline.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.families import Family, Kind, Mass, Port, Ratio, Term, Velocity
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, is_recorded, jet_namespace, present, presents
from flywheel.numerics.switching import SwitchingError, breakpoints, resolved
from flywheel.scene.scene import ArrayRecord, Key, Mechanism, Output, Table, read_only

Array = NDArray[np.float64]

_KEPT_LAWS = 64  # whose pieces are kept


class FormulaCurve(NamedTuple):
    """A position by an expression of phi and the scene's parameters (SI), smooth between its breakpoints.

    Breakpoints are angles (rad) in [0, period) where another formula begins or a cell must end; switches are those at which
    another formula begins, and 0.
    """

    expression: Expression
    parameters: Mapping[str, float]
    breakpoints: tuple[float, ...] = ()
    switches: tuple[float, ...] = ()

    def jet(self, phi: Any, anchor: Any, ns: Any) -> Jet:
        """Position with its two derivatives at phi; every switch is decided at the anchor.

        >>> import numpy as np
        >>> from flywheel.numerics.expressions import parse
        >>> FormulaCurve(parse("abs(phi**2 - 1)"), {}).jet(2.0, 2.0, np)
        Jet(3.0, 4.0, 2.0)
        """
        values = {**self.parameters, "phi": Jet(phi, 1.0, 0.0)}
        # the jets over a namespace, made once: the namespace is kept beside them, so that its id stays its own
        if id(ns) not in _JETS:
            _JETS[id(ns)] = ns, jet_namespace(ns)
        position = self.expression.evaluate(values, _JETS[id(ns)][1], {**self.parameters, "phi": anchor})
        return position if isinstance(position, Jet) else Jet(position, 0.0, 0.0)


_JETS: dict[int, tuple[Any, Any]] = {}


@dataclass(frozen=True, eq=False)
class SplineCurve(ArrayRecord):
    """A position by cubics: from knots[i] to the next one, the sum of coefficients[k, i] (phi - knots[i])^(3 - k)."""

    knots: Array
    coefficients: Array

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """The knots but the last, where the third derivative jumps."""
        return tuple(self.knots[:-1].tolist())

    @property
    def switches(self) -> tuple[float, ...]:
        """The same."""
        return self.breakpoints

    def jet(self, phi: Any, anchor: Any, ns: Any) -> Jet:
        """Position with its two derivatives at phi, by the cubic on which the anchor lies."""
        span = np.searchsorted(self.knots[1:-1], anchor, side="right")
        c3, c2, c1, c0 = self.coefficients[:, span]
        step = phi - self.knots[span]
        value = ((c3 * step + c2) * step + c1) * step + c0
        return Jet(value, (3 * c3 * step + 2 * c2) * step + c1, 6 * c3 * step + 2 * c2)


PositionCurve = FormulaCurve | SplineCurve
"""A position against an angle in [0, period), smooth between its breakpoints."""


def spline_curve(table: Table, period: float) -> SplineCurve:
    """The periodic cubic spline (C²) through a table that spans the period, from any angle.

    If its last value differs from the first, the uniform part of the motion is subtracted before the interpolation,
    and added again after it.
    """
    from scipy.interpolate import CubicSpline  # only scenes with such a table need it

    start = table.angle[0]
    drift = (table.value[-1] - table.value[0]) / period
    swaying = table.value - drift * (table.angle - start)
    swaying[-1] = swaying[0]
    spline = CubicSpline(table.angle, swaying, bc_type="periodic")
    knots, coefficients = np.asarray(spline.x), np.asarray(spline.c)
    edges, piece, turns = spans(knots, period)
    return SplineCurve(
        edges, about_edges(coefficients[:, piece], edges[:-1] - turns * period - knots[piece], edges[:-1] - start, drift)
    )


def spans(knots: Array, period: float) -> tuple[Array, NDArray[np.int64], Array]:
    """The cubics of a periodic spline from 0 to the period: their edges, which they are, how many turns before their knots.

    That across 0 is cut in two.

    >>> spans(np.array([1.0, 2.0, 3.0, 5.0]), 4.0)
    (array([0., 1., 2., 3., 4.]), array([2, 0, 1, 2]), array([-1.,  0.,  0.,  0.]))
    """
    inner = np.unique(knots[:-1] % period)
    inner = inner[(inner > _SAME_KNOT * period) & (inner < (1 - _SAME_KNOT) * period)]
    edges = np.concatenate(([0.0], inner, [period]))
    middles = 0.5 * (edges[1:] + edges[:-1])
    turns = np.floor((middles - knots[0]) / period)
    return edges, np.searchsorted(knots, middles - turns * period, side="right") - 1, turns


def about_edges(coefficients: NDArray[Any], step: Any, away: Any, drift: Any) -> NDArray[Any]:
    """The coefficients of cubics (4, pieces) a step beyond their knots, with a uniform motion by their distances away."""
    c3, c2, c1, c0 = coefficients
    c0 = c0 + (c1 + (c2 + c3 * step) * step) * step + drift * away
    c1 = c1 + (2 * c2 + 3 * c3 * step) * step + drift
    return np.stack((c3, c2 + 3 * c3 * step, c1, c0))


_SAME_KNOT = 1e-12  # of the period: knots closer than this are one
_JUMP_ROUNDING = 1e-9  # a jump below this share of a law's range is rounding
_VALUE_ROUNDING = 1e-14
_OWN = frozenset({"x", "v", "omega", "t"})  # what a position may not depend on
_NODES = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 17))


class LawPosition:
    """Positions of every output, each computed when first read.

    psi is reduced to [0, period) by the turn that the anchor is in, so that a piece is followed to its end by its own
    formula, also where the period or a switch ends it. The anchor holds floats; psi may hold any numbers.
    """

    def __init__(self, curves: Mapping[str, PositionCurve], period: float, psi: Any, ns: Any, anchor: Any = None) -> None:
        middle = presents(psi if anchor is None else anchor)
        self.psi, self.ns = psi, ns
        self.turns = np.floor(middle / period)
        self._curves, self._period, self._middle = curves, period, middle
        self._jets: dict[str, Jet] = {}

    def jet(self, name: str) -> Jet:
        """Position of an output within its period, with its two derivatives by psi."""
        if name not in self._jets:
            lag = self.turns * self._period
            self._jets[name] = self._curves[name].jet(self.psi - lag, self._middle - lag, self.ns)
        return self._jets[name]


def family(mechanism: Mechanism, parameters: Mapping[str, float]) -> Family:
    """Outputs of a law, each directly from the crank: ratio dx/dpsi, slope d²x/dpsi².

    Raises SceneError for a position that is not finite, that jumps, or that does not return; and for one whose slope
    jumps while it carries mass, since the reduced inertia would jump with it.
    """
    faults: list[Fault] = []
    curves: dict[str, PositionCurve] = {}
    ports: dict[str, Port] = {}

    def velocity(output: Output) -> Velocity:
        name = output.name
        ratio = Ratio(lambda position: position.jet(name).first, lambda position: position.jet(name).second)
        return Velocity(name, output.rotating, (Term("crank", ratio),))

    for output in mechanism.outputs:
        path = f"{mechanism.path}.outputs.{output.name}"
        try:
            curve = _curve(output, mechanism.period, parameters, path)
            curves[output.name], ports[output.name] = curve, _port(output, _plain(curve), mechanism.period, path)
        except SceneError as error:
            faults += error.faults
    if faults:
        raise SceneError(faults)
    ends, switches = (
        tuple(sorted({angle for curve in curves.values() for angle in getattr(curve, kind)}))
        for kind in ("breakpoints", "switches")
    )
    return Family(
        velocities=tuple(velocity(output) for output in mechanism.outputs),
        masses=tuple(Mass(o.name, o.inertia, o.name) for o in mechanism.outputs if o.inertia != 0),
        weights=(),
        ports=ports,
        position=partial(LawPosition, curves, mechanism.period),
        breakpoints=ends,
        switches=switches,
    )


def followed(output: Output, period: float, parameters: Mapping[str, float], path: str) -> PositionCurve:
    """The curve of one output that carries inertia and comes back after the period (rad).

    Raises SceneError for a position that is not finite, that jumps or whose slope jumps, or that does not come back.
    """
    curve = _curve(output, period, parameters, path)
    if not _port(output, curve, period, path).returns:
        defect = "a position that gains a constant each period"
        raise SceneError([Fault(_key(output, path), defect, "a position that comes back after the period")])
    return curve


def _curve(output: Output, period: float, parameters: Mapping[str, float], path: str) -> PositionCurve:
    """An output's curve; it ends a piece where its law switches, and where cells must end for the law to be followed."""
    if output.name == "crank":
        raise SceneError([Fault(path, "'crank'", "another name", "that is the mechanism's own shaft")])
    if not isinstance(output.law, Expression):
        return spline_curve(output.law, period)
    law = output.law
    if foreign := sorted(law.names - {"phi", *parameters} | law.names & _OWN):
        raise SceneError([Fault(_key(output, path), f"an expression of {', '.join(foreign)}", "phi and parameters")])
    varying: list[Any] = [value for name, value in parameters.items() if name in law.names and is_recorded(value)]
    if varying:
        plain = _curve(output, period, {name: present(value) for name, value in parameters.items()}, path)
        if not varying[0].recorder.exact or len(plain.switches) > 1:
            raise TypeError("parameters of a law whose pieces depend on them")
        return FormulaCurve(law, read_only(parameters), plain.breakpoints, plain.switches)

    try:
        pieces = _pieces(law, period, tuple((name, value) for name, value in parameters.items() if name in law.names))
    except SwitchingError as error:
        raise SceneError([Fault(_key(output, path), str(error), "a smooth position")]) from None
    return FormulaCurve(law, read_only(parameters), *pieces)


@lru_cache(maxsize=_KEPT_LAWS)
def _pieces(law: Expression, period: float, parameters: tuple[tuple[str, float], ...]) -> tuple[tuple[float, ...], ...]:
    """Angles at which cells begin for a law to be followed, and those at which it switches; both begin with 0."""

    def enclosed(lo: Array, hi: Array, anchor: Array) -> Mapping[str, Any]:
        return {**dict(parameters), "phi": Jet(Interval(lo, hi), 1.0)}

    def valued(phi: Array, anchor: Array) -> Mapping[str, Any]:
        return {**dict(parameters), "phi": phi}

    edges = np.array([0.0, *breakpoints(law, 0.0, period, enclosed, valued), period])
    splits = resolved(law, edges[:-1], edges[1:], enclosed, valued)
    cells = np.unique(np.concatenate((edges, splits)))
    return tuple(cells.tolist())[:-1], tuple(edges.tolist())[:-1]


def _plain(curve: PositionCurve) -> PositionCurve:
    """A curve with the present values of its parameters."""
    if not isinstance(curve, FormulaCurve):
        return curve
    return curve._replace(parameters={name: present(value) for name, value in curve.parameters.items()})


def _key(output: Output, path: str) -> str:
    return f"{path}.{'theta' if output.rotating else 'x'}"


def _port(output: Output, curve: PositionCurve, period: float, path: str) -> Port:
    """The output's port, after its curve is checked: finite, without jumps, returning and, with mass, without corners."""
    path, unit = _key(output, path), "rad" if output.rotating else "m"
    edges = np.unique([0.0, *curve.breakpoints, period])
    phi = edges[:-1, None] + np.diff(edges)[:, None] * _NODES  # each row by its piece's formula, its ends included
    phi[:, -1] = edges[1:]
    jet = curve.jet(phi, phi[:, 8:9], np)
    value, first, second = (np.broadcast_to(part, phi.shape) for part in (jet.value, jet.first, jet.second))
    named = {"position": value, "slope": first} | ({"second derivative": second} if output.inertia != 0 else {})
    for what, values in named.items():  # with mass the slope's slope turns the reduced inertia
        wrong = ~np.isfinite(values)
        if np.any(wrong):
            defect = f"a {what} that is not finite at {_degrees(phi[wrong][0])}"
            raise SceneError([Fault(path, defect, "a smooth position")])
    rounding = _VALUE_ROUNDING * np.max(np.abs(value))
    close = _JUMP_ROUNDING * np.ptp(value) + rounding
    jumps, gain = value[1:, 0] - value[:-1, -1], float(value[-1, -1] - value[0, 0])
    gain = gain if abs(gain) > close else 0.0
    if np.any(np.abs(jumps) > close):
        worst = int(np.argmax(np.abs(jumps)))
        defect = f"a jump of {jumps[worst]:.6g} {unit} at {_degrees(phi[worst, -1])}"
        raise SceneError([Fault(path, defect, "a position that does not jump")])
    if gain and not output.rotating:
        defect = f"{value[0, 0]:.9g} m at 0 deg and {value[-1, -1]:.9g} m at {_degrees(period)}"
        raise SceneError([Fault(path, defect, "a position that comes back after the period")])
    corners = np.array([first[0, 0] - first[-1, -1], *(first[1:, 0] - first[:-1, -1])])
    kinks = phi[np.abs(corners) > _JUMP_ROUNDING * np.max(np.abs(first)) + rounding, 0]
    if output.inertia != 0 and kinks.size:
        worst = int(np.argmax(np.abs(corners)))
        before, after = first[worst - 1, -1], first[worst, 0]
        defect = f"a slope that jumps from {before:.6g} to {after:.6g} at {_degrees(phi[worst, 0])}"
        advice = "the reduced inertia would jump with it; round the corner"
        raise SceneError([Fault(path, defect, "a smooth position, as it carries mass", advice)])
    name = output.name

    def displacement(position: Any) -> Any:
        x = position.jet(name).value
        return x if gain == 0.0 else x + gain * position.turns

    return Port(name, displacement, gain == 0.0, tuple(kinks.tolist()))


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.6g} deg"


KIND = Kind(
    "law",
    "outputs whose position is given as a function of the crank's angle",
    family,
    keys=(Key("outputs", "tables", "one table per output, each of them a port", required=True),),
    nouns=("follower", "lever"),
    smooth=lambda _: False,
)
