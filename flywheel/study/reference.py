"""The question that all methods answer, and what their errors are measured against: its figure by two routes.

The routes share nothing but I*, M* and the laws.

Torques that depend on speed: the periodic motion by collocation, verified by stepping it in time. Loads of position alone:
the closed form on Chebyshev cells, verified by Gauss' rule on halved panels in the longest floats that numpy has, which is
then the reference. That shares nothing with the sizing but the bond graph, which it walks in extended precision: no
Chebyshev cells, no series, no search for roots on polynomials. Where the machine has no floats longer than doubles, or a
mechanism finds its positions by iteration in doubles, what is gained is the other route alone, and the error bound is wider.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.numerics import roots_between
from flywheel.machine.equation import NoMotionError
from flywheel.machine.machine import Machine
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size
from flywheel.sizing.speed_dependent import with_flywheel

Long = NDArray[np.longdouble]
Panel = NDArray[np.intp]
Force = Callable[[Long, Long, Long, Long, Panel], Long]

_ORDER = 24  # of Gauss' rule on a panel
_SAME_VALUE = 1e-15  # relative change by a halving that counts as zero; two in succession, as one may be chance
_FIRST, _MOST_HALVINGS, _MOST_PANELS = 2, 9, 20_000
_SAMPLES = 12  # in a panel, between which extremes are looked for
_LONG = np.finfo(np.longdouble).eps
_LEVELS = 80
_NO_FLUCTUATION = 1e-13  # of the work exchanged: a smaller fluctuation counts as zero


class Question(NamedTuple):
    """The figure that all methods are to find: a flywheel (kg m², on its own shaft), or with a given one the irregularity.

    `scale` is what errors are relative to where the figure itself is smaller: energy_fluctuation/(eps w²) for a flywheel.
    """

    machine: Machine
    sized: bool
    scale: float

    @classmethod
    def of(cls, sizing: Sizing) -> Question:
        """The question of the scene of a sizing."""
        machine, scene = sizing.machine, sizing.scene
        assert machine is not None
        if scene.irregularity is None:
            return cls(machine, False, 0.0)
        scale, cycle = sizing.flywheel.approximate_total or 0.0, sizing.constant or sizing.cycle
        if cycle is not None and sizing.reduced_inertia is not None:
            unit = scene.irregularity * sizing.speed**2 * scene.flywheel_ratio**2
            at_hand = max(cycle.exchanged / max(unit, 1e-300), sizing.reduced_inertia.greatest / scene.flywheel_ratio**2)
            scale = scale if scale > _NO_FLUCTUATION * at_hand else at_hand  # of a fluctuation that is rounding
        return cls(machine, True, scale)

    @property
    def figure(self) -> str:
        """The figure's name."""
        return "exact flywheel" if self.sized else "irregularity"

    @property
    def unit(self) -> str:
        """Its unit."""
        return "kg m²" if self.sized else ""

    @property
    def crank(self) -> float:
        """Factor from an inertia on the flywheel's shaft to one on the crank."""
        return self.machine.scene.flywheel_ratio**2

    @property
    def given(self) -> float:
        """The given flywheel on the crank (kg m²), 0 where one is to be found."""
        return (self.machine.scene.inertia or 0.0) * self.crank

    def error(self, value: float, true: float) -> float:
        """The relative error of an answer."""
        return abs(value - true) / max(abs(true), self.scale, 1e-300)


def answer(sizing: Sizing) -> float:
    """Figure under comparison, of a sizing its exact flywheel, of an analysis its irregularity."""
    if sizing.scene.irregularity is not None:
        assert sizing.flywheel.exact is not None
        return sizing.flywheel.exact
    if sizing.simulation is not None:
        return sizing.simulation.irregularity
    return 0.0 if sizing.run is None else sizing.run.irregularity


# -- in extended precision ---------------------------------------------------------------------------------------------


def _gauss() -> tuple[Long, Long]:
    """Nodes and weights of Gauss' rule on [-1, 1], polished by Newton's method on Legendre's recurrence."""
    nodes: Long = np.polynomial.legendre.leggauss(_ORDER)[0].astype(np.longdouble)
    for _ in range(3):
        before, value = np.ones_like(nodes), nodes.copy()
        for k in range(2, _ORDER + 1):
            before, value = value, np.asarray(((2 * k - 1) * nodes * value - (k - 1) * before) / k, dtype=np.longdouble)
        slope = _ORDER * (nodes * value - before) / (nodes**2 - 1)
        nodes = np.asarray(nodes - value / slope, dtype=np.longdouble)
    return nodes, np.asarray(2 / ((1 - nodes**2) * slope**2), dtype=np.longdouble)


_NODES, _WEIGHTS = _gauss()


class _Curve:
    """A cycle on panels: the unknown's value, W (J) at the edges, and what rounding of the scene's own angles does to W."""

    def __init__(self, machine: Machine, edges: Long) -> None:
        self.machine, self.edges = machine, edges
        half, middle = (edges[1:] - edges[:-1]) / 2, (edges[1:] + edges[:-1]) / 2
        self.anchor = np.asarray(machine.anchors(middle.astype(float)), dtype=np.longdouble)
        reduced = machine.reduction(middle[:, None] + half[:, None] * _NODES, self.anchor[:, None])
        moment, share = (
            np.broadcast_to(np.asarray(part, dtype=np.longdouble), (half.size, _ORDER))
            for part in (reduced.moment, reduced.per_unknown)
        )
        works, shares = ((part @ _WEIGHTS) * half for part in (moment, share))
        self.balance = -works.sum() / shares.sum() if machine.scene.unknown is not None else np.longdouble(0)
        self.work = np.concatenate(([np.longdouble(0)], (works + self.balance * shares).cumsum()))
        moment = moment + self.balance * share
        self.rounding = float(ROUNDING * edges[-1] * np.abs(np.diff(moment.ravel())).sum())
        if _LONG >= ROUNDING or any(mechanism.linkage is not None for mechanism in machine.scene.mechanisms):
            self.rounding += 4 * ROUNDING * float((np.abs(moment) @ _WEIGHTS * half).sum())  # walked in doubles

    def at(self, panel: Panel, phi: Any) -> tuple[Long, Long, Long]:
        """M*, dI*/dphi and I* at angles in panels."""
        anchor = self.anchor[panel]
        reduced = self.machine.reduction(phi, anchor if phi.ndim == 1 else anchor[:, None])
        rows = [reduced.moment + self.balance * reduced.per_unknown, reduced.slope, reduced.inertia]
        moment, slope, inertia = (np.broadcast_to(np.asarray(row, dtype=np.longdouble), phi.shape) for row in rows)
        return moment, slope, inertia

    def work_at(self, panel: Panel, phi: Long) -> Long:
        """W at angles in panels, by Gauss' rule from the panel's left end."""
        owner = np.broadcast_to(panel.reshape(panel.shape + (1,) * (phi.ndim - 1)), phi.shape).ravel()
        start = self.edges[owner]
        half = (phi.ravel() - start) / 2
        nodes = start[:, None] + half[:, None] * (1 + _NODES)
        return np.asarray(self.work[owner] + half * (self.at(owner, nodes)[0] @ _WEIGHTS)).reshape(phi.shape)

    def candidates(self, force: Force) -> tuple[Panel, Long]:
        """Panels and angles of all edges, and of all places where force(M*, I*', I*, phi, panel) changes its sign."""
        panels = np.arange(self.edges.size - 1)
        shares = np.linspace(0, 1, _SAMPLES + 1, dtype=np.longdouble)
        phi = self.edges[:-1, None] + np.diff(self.edges)[:, None] * shares
        values = force(*self.at(panels, phi), phi, panels)
        panel, place = np.nonzero(values[:, :-1] * values[:, 1:] < 0)
        low, high = phi[panel, place], phi[panel, place + 1]
        places = roots_between(lambda phi: np.asarray(force(*self.at(panel, phi), phi, panel)), low, high)
        return np.concatenate((panels, panels, panel)), np.concatenate((self.edges[:-1], self.edges[1:], places))

    def greatest(self, factor: Any, sign: int) -> Any:
        """The greatest (sign 1) or least (-1) of W - factor I*."""
        panel, phi = self.candidates(lambda moment, slope, inertia, phi, panel: np.asarray(moment - factor * slope))
        values = self.work_at(panel, phi) - factor * self.at(panel, phi)[2]
        return sign * (sign * values).max()


class Extended(NamedTuple):
    """A figure, and how far it is off at most: what the last halving changed, and what rounding leaves."""

    value: float
    doubt: float


def flywheel_inertia(machine: Machine) -> Extended:
    """The exact flywheel of a sizing (kg m² on the crank, before its floor at 0).

    I = [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²), z± = (1 ± eps/2)².

    Source: F. Wittenbauer, Graphische Dynamik (1923).
    """
    eps, speed = np.longdouble(machine.scene.irregularity or 0.0), np.longdouble(machine.scene.speed or 0.0)
    half = speed**2 / 2

    def figure(curve: _Curve) -> Any:
        high = curve.greatest(half * (1 + eps / 2) ** 2, 1)
        low = curve.greatest(half * (1 - eps / 2) ** 2, -1)
        return (high - low) / (eps * speed**2)

    return _settled(machine, figure, lambda curve: 2 * curve.rounding / float(eps * speed**2))


def irregularity(machine: Machine, inertia: float) -> Extended:
    """The irregularity of a machine with a given flywheel (kg m² on the crank), at its mean of extremes w.

    At the level e of energy, omega² = w² + (2 e + 2 W - w² (I* - I*(0)))/(J + I*): e is where the mean of extremes is w.
    """
    speed = np.longdouble(machine.scene.speed or 0.0)

    def rounding(curve: _Curve) -> float:
        least = inertia + float(curve.at(np.arange(curve.edges.size - 1), curve.edges[:-1])[2].min())
        return 4 * curve.rounding / (float(speed) ** 2 * max(least, 1e-300))

    return _settled(machine, lambda curve: _irregularity(curve, np.longdouble(inertia), speed), rounding)


def _irregularity(curve: _Curve, inertia: Any, speed: Any) -> Any:
    """The irregularity at the level of energy whose mean of extremes is the speed wanted."""
    start = curve.at(np.arange(1), curve.edges[:1])[2][0]
    square = speed**2

    def extremes(level: Any) -> tuple[Any, Any]:
        """Greatest and least s in omega² = w² (1 + s), and I* there."""

        def share(total: Long, phi: Long, panel: Panel) -> Any:
            work = curve.work_at(panel, phi)
            return (2 * level + 2 * work - square * (total - start)) / (square * (inertia + total))

        def force(moment: Long, slope: Long, total: Long, phi: Long, panel: Panel) -> Long:
            return np.asarray(moment - square * (1 + share(total, phi, panel)) / 2 * slope)

        panel, phi = curve.candidates(force)
        total = curve.at(panel, phi)[2]
        s = share(total, phi, panel)
        ends = [int(s.argmax()), int(s.argmin())]
        return s[ends], total[ends]

    lowest = -square * (inertia + start) / 2 - curve.greatest(np.longdouble(0), -1)  # where the machine comes to a stop
    level = np.longdouble(0) if lowest < 0 else 2 * lowest + np.longdouble(1e-300)
    for _ in range(_LEVELS):
        s, total = extremes(level)
        ratio = np.sqrt(np.maximum(1 + s, np.longdouble(1e-30)))
        slope = (1 / (square * (inertia + total) * ratio)).mean()
        step = (1 - ratio.mean()) / slope
        level = level + step if level + step > lowest else (level + lowest) / 2
        if abs(step) <= 64 * _LONG * (abs(level) + square * (inertia + total.min()) * abs(s[0] - s[1])):
            break
    else:
        return np.longdouble("nan")  # a level that is not found is no reference
    s, _ = extremes(level)
    ratio = np.sqrt(np.maximum(1 + s, np.longdouble(0)))
    return 2 * (s[0] - s[1]) / ratio.sum() ** 2


def _settled(machine: Machine, figure: Callable[[_Curve], Any], rounding: Callable[[_Curve], float]) -> Extended:
    """A figure on panels, which end wherever anything breaks or bends, halved until it no longer changes."""
    known = np.asarray(machine.mesh, dtype=np.longdouble)
    parts = [np.linspace(a, b, _FIRST + 1, dtype=np.longdouble)[:-1] for a, b in pairwise(known)]
    edges = np.append(np.concatenate(parts), known[-1])
    curve = _Curve(machine, edges)
    before, changed, last = figure(curve), np.inf, np.inf
    for _ in range(_MOST_HALVINGS):
        if 2 * edges.size - 1 > _MOST_PANELS:
            break
        edges = np.insert(edges, np.arange(1, edges.size), (edges[1:] + edges[:-1]) / 2)
        curve = _Curve(machine, edges)
        now = figure(curve)
        last, changed, before = changed, abs(float(now - before)), now
        if max(changed, last) <= _SAME_VALUE * abs(float(now)) or changed >= last:
            break
    if last <= _SAME_VALUE * abs(float(before)):
        changed = max(changed, last)
    return Extended(float(before), changed + ROUNDING * abs(float(before)) + rounding(curve))


# -- the reference, verified ------------------------------------------------------------------------------------------

_TIGHTEST = 1e-14
_IN_TIME = 1e-12
_SHARE = 0.01  # of a flywheel: change for a slope
_EVEN = 1e-13  # a smaller irregularity counts as zero
_LEAST = 16 * ROUNDING  # error bound of two routes that happen to agree


class Reference(NamedTuple):
    """A figure (kg m² or 1), how far it may be off (relative), and how it was found and verified."""

    value: float
    doubt: float
    route: str
    verified: str
    messages: tuple[str, ...] = ()


def verified(machine: Machine) -> tuple[Question, Reference]:
    """The question of a machine's scene and its true answer.

    Raises:
        SceneError: if the machine cannot run as its scene says.

    """
    tight = size(machine, _TIGHTEST, accuracy="normal")
    question = Question.of(tight)
    if not question.sized and answer(tight) <= _EVEN:
        found = "a motion that varies by rounding alone"
        raise SceneError([Fault("flywheel.inertia", found, "an irregularity to compare methods by", "use flywheel size")])
    promised = max((tight.error.exact if question.sized else tight.error.simulation) or 0.0, _LEAST)
    reference = (_in_time if machine.sets_its_speed else _extended)(question, answer(tight), promised)
    return question, reference._replace(messages=tuple(m for m in tight.messages if not m.startswith("rtol")))


def _extended(question: Question, closed: float, promised: float) -> Reference:
    """By Gauss' rule, verified by the closed form, of which the error that it promises is known."""
    if question.sized:
        value, doubt = (part / question.crank for part in flywheel_inertia(question.machine))
        if value + doubt < 0.0:  # the machine's own inertia suffices for certain
            doubt = 0.0
        value = max(value, 0.0)
    else:
        value, doubt = irregularity(question.machine, question.given)
    if not np.isfinite([value, doubt]).all():
        alone = "by its own estimate alone: the other route has no finite value"
        return Reference(closed, promised, "the closed form on Chebyshev cells", alone)
    apart = question.error(closed, value)
    own = max(question.error(value + doubt, value), ROUNDING)
    route = "Gauss' rule on halved panels, in extended precision"
    second = f"the closed form on Chebyshev cells is {apart:.1e} apart"
    if apart > promised + own:  # one of the two is wrong: what is not known is not claimed
        return Reference(value, apart, route, f"{second}: more than both estimates allow")
    return Reference(value, own, route, f"{second}, within its estimate of {promised:.1e}")


def _in_time(question: Question, value: float, promised: float) -> Reference:
    """The periodic motion by collocation, verified by stepping it in time."""
    stepped = size(question.machine, _IN_TIME, accuracy="audit")
    route = "periodic collocation at the tightest tolerance"
    if stepped.simulation is None or stepped.run is None or stepped.simulation.route != "time":
        return Reference(value, promised, route, "by its own estimate alone: the motion cannot be stepped in time")
    expected = stepped.run.irregularity
    apart = abs(stepped.simulation.irregularity / expected - 1.0) if expected else 0.0
    damping = 1.0 if stepped.cyclic is None else min(abs(stepped.cyclic.damping), 1.0)
    slope = _slope(stepped, value * question.crank) if question.sized and value else 1.0
    # one cycle begun where collocation says cannot see that its level is off: where little holds it, that weighs more
    shift = (apart + abs(stepped.simulation.closure or 0.0) + _LEAST) / max(damping * slope, 1e-300)
    doubt = max(min(shift, promised), question.error(answer(stepped), value), _LEAST)
    return Reference(value, doubt, route, f"stepped in time, one cycle has an irregularity {apart:.1e} apart")


def _slope(sizing: Sizing, inertia: float) -> float:
    """By how much the irregularity changes with the flywheel (kg m² on the crank), both relative."""
    machine, constant = sizing.machine, sizing.constant or sizing.cycle
    assert machine is not None
    assert constant is not None
    try:
        lighter, heavier = (
            with_flywheel(machine, constant, sizing.speed, share * inertia, sizing.rtol).run.irregularity
            for share in (1.0 - _SHARE, 1.0 + _SHARE)
        )
    except NoMotionError:
        return 0.0
    return abs(heavier / lighter - 1.0) / (2.0 * _SHARE) if lighter else 0.0
