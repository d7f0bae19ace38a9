"""What errors are measured against: the figure by two routes that share nothing but I*, M* and the laws.

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

from flywheel.machine.machine import Machine
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime.turning_moment import NoMotionError
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size
from flywheel.sizing.speed_dependent import with_flywheel
from flywheel.study.question import Question, answer, question

Long = NDArray[np.longdouble]

_ORDER = 24  # of Gauss' rule on a panel
_SAME = 1e-15  # relative change by a halving that is none; two of them in turn, as one may be chance
_FIRST, _MOST_HALVINGS, _MOST_PANELS = 2, 9, 20_000
_SAMPLES = 12  # in a panel, between which extremes are looked for
_SECANTS = 60
_LONG = np.finfo(np.longdouble).eps
_LEVELS = 80


class Extended(NamedTuple):
    """A figure, and how far it is off at most: what the last halving changed, and what rounding leaves."""

    value: float
    doubt: float


class _Curve(NamedTuple):
    """A cycle on panels: the unknown's value, W (J) at the edges, and what rounding of the scene's own angles does to W."""

    machine: Machine
    edges: Long
    anchor: Long
    balance: Any
    work: Long
    rounding: float


def flywheel_inertia(machine: Machine) -> Extended:
    """The exact flywheel of a sizing (kg m² on the crank, before its floor at 0).

    I = [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²), z± = (1 ± eps/2)².

    Source: F. Wittenbauer, Graphische Dynamik (1923).
    """
    eps, speed = np.longdouble(machine.scene.irregularity or 0.0), np.longdouble(machine.scene.speed or 0.0)
    half = speed**2 / 2

    def figure(curve: _Curve) -> Any:
        high = _greatest(curve, half * (1 + eps / 2) ** 2, 1)
        low = _greatest(curve, half * (1 - eps / 2) ** 2, -1)
        return (high - low) / (eps * speed**2)

    return _settled(machine, figure, lambda curve: 2 * curve.rounding / float(eps * speed**2))


def irregularity(machine: Machine, inertia: float) -> Extended:
    """The irregularity of a machine with a given flywheel (kg m² on the crank), at its mean of extremes w.

    At the level e of energy, omega² = w² + (2 e + 2 W - w² (I* - I*(0)))/(J + I*): e is where the mean of extremes is w.
    """
    speed = np.longdouble(machine.scene.speed or 0.0)

    def figure(curve: _Curve) -> Any:
        return _irregularity(curve, np.longdouble(inertia), speed)

    def rounding(curve: _Curve) -> float:
        least = inertia + float(_at(curve, np.arange(curve.edges.size - 1), curve.edges[:-1])[2].min())
        return 4 * curve.rounding / (float(speed) ** 2 * max(least, 1e-300))

    return _settled(machine, figure, rounding)


def _settled(machine: Machine, figure: Callable[[_Curve], Any], rounding: Callable[[_Curve], float]) -> Extended:
    """A figure on panels that are halved until it no longer changes."""
    edges = _panels(machine, _FIRST)
    curve = _curve(machine, edges)
    before, changed, last = figure(curve), np.inf, np.inf
    for _ in range(_MOST_HALVINGS):
        edges = _halved(edges)
        if edges.size > _MOST_PANELS:
            break
        curve = _curve(machine, edges)
        now = figure(curve)
        last, changed, before = changed, abs(float(now - before)), now
        if max(changed, last) <= _SAME * abs(float(now)) or changed >= last:
            break
    if last <= _SAME * abs(float(before)):
        changed = max(changed, last)
    return Extended(float(before), changed + ROUNDING * abs(float(before)) + rounding(curve))


def _panels(machine: Machine, each: int) -> Long:
    """Edges of panels: every place where anything breaks or bends sharply, and `each` panels between two of them."""
    known = np.asarray(machine.mesh, dtype=np.longdouble)
    parts = [np.linspace(a, b, each + 1, dtype=np.longdouble)[:-1] for a, b in pairwise(known)]
    return np.append(np.concatenate(parts), known[-1])


def _halved(edges: Long) -> Long:
    found = np.empty(2 * edges.size - 1, dtype=np.longdouble)
    found[::2], found[1::2] = edges, (edges[1:] + edges[:-1]) / 2
    return found


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


def _curve(machine: Machine, edges: Long) -> _Curve:
    half = (edges[1:] - edges[:-1]) / 2
    middle = (edges[1:] + edges[:-1]) / 2
    anchor = np.asarray(machine.anchors(middle.astype(float)), dtype=np.longdouble)
    reduced = machine.reduction(middle[:, None] + half[:, None] * _NODES, anchor[:, None])
    shape = (half.size, _ORDER)
    moment = np.broadcast_to(np.asarray(reduced.moment, dtype=np.longdouble), shape)
    share = np.broadcast_to(np.asarray(reduced.per_unknown, dtype=np.longdouble), shape)
    works, shares = ((part @ _WEIGHTS) * half for part in (moment, share))
    balance = -works.sum() / shares.sum() if machine.scene.unknown is not None else np.longdouble(0)
    works = works + balance * shares
    work = np.concatenate(([np.longdouble(0)], works.cumsum()))
    travel = np.abs(np.diff((moment + balance * share).ravel())).sum()
    rounding = float(ROUNDING * edges[-1] * travel)
    if _LONG >= ROUNDING or any(mechanism.linkage is not None for mechanism in machine.scene.mechanisms):
        rounding += 4 * ROUNDING * float((np.abs(moment + balance * share) @ _WEIGHTS * half).sum())  # walked in doubles
    return _Curve(machine, edges, anchor, balance, work, rounding)


def _at(curve: _Curve, panel: NDArray[np.intp], phi: Any) -> tuple[Long, Long, Long]:
    """M*, dI*/dphi and I* at angles in panels."""
    anchor = curve.anchor[panel]
    anchor = anchor if phi.ndim == 1 else anchor[:, None]
    reduced = curve.machine.reduction(phi, anchor)
    rows = [reduced.moment + curve.balance * reduced.per_unknown, reduced.slope, reduced.inertia]
    moment, slope, inertia = (np.broadcast_to(np.asarray(row, dtype=np.longdouble), phi.shape) for row in rows)
    return moment, slope, inertia


def _work(curve: _Curve, panel: NDArray[np.intp], phi: Long) -> Long:
    """W at single angles in panels, by Gauss' rule from the panel's left end."""
    start = curve.edges[panel]
    half = (phi - start) / 2
    nodes = start[:, None] + half[:, None] * (1 + _NODES)
    return np.asarray(curve.work[panel] + half * (_at(curve, panel, nodes)[0] @ _WEIGHTS))


def _candidates(curve: _Curve, force: Any) -> tuple[NDArray[np.intp], Long]:
    """Panels and angles of all edges, and of all places where force(M*, I*', I*, phi, panel) changes its sign."""
    count = curve.edges.size - 1
    width = np.diff(curve.edges)
    shares = np.linspace(0, 1, _SAMPLES + 1, dtype=np.longdouble)
    panels = np.arange(count)
    phi = curve.edges[:-1, None] + width[:, None] * shares
    values = force(*_at(curve, panels, phi), phi, panels)
    cell, place = np.nonzero(values[:, :-1] * values[:, 1:] < 0)
    roots = _roots(curve, force, cell, phi[cell, place], phi[cell, place + 1])
    ends = np.concatenate((panels, panels))
    return np.concatenate((ends, cell)), np.concatenate((curve.edges[:-1], curve.edges[1:], roots))


def _roots(curve: _Curve, force: Any, panel: NDArray[np.intp], low: Long, high: Long) -> Long:
    """Roots between pairs of angles, by regula falsi in its Illinois form, all at once."""
    if not panel.size:
        return low

    def value(phi: Long) -> Long:
        return np.asarray(force(*_at(curve, panel, phi), phi, panel))

    low, high = low.copy(), high.copy()
    at_low, at_high = value(low), value(high)
    side = np.zeros(panel.size, dtype=int)
    middle = low
    for _ in range(_SECANTS):
        before = middle
        step = np.where(at_high != at_low, at_high - at_low, 1)
        middle = np.where(at_high != at_low, (low * at_high - high * at_low) / step, (low + high) / 2)
        found = value(middle)
        left = found * at_high > 0  # the root lies between low and middle
        at_low = np.where(left & (side == 1), at_low / 2, at_low)
        at_high = np.where(~left & (side == -1), at_high / 2, at_high)
        side = np.where(left, 1, -1)
        low, at_low = np.where(left, low, middle), np.where(left, at_low, found)
        high, at_high = np.where(left, middle, high), np.where(left, found, at_high)
        if ((found == 0) | (np.abs(middle - before) <= 4 * _LONG * np.abs(high))).all():
            break
    return np.asarray(middle)


def _greatest(curve: _Curve, factor: Any, sign: int) -> Any:
    """The greatest (sign 1) or least (-1) of W - factor I*."""

    def force(moment: Long, slope: Long, inertia: Long, phi: Long, panel: Any) -> Long:
        return np.asarray(moment - factor * slope)

    panel, phi = _candidates(curve, force)
    values = _work(curve, panel, phi) - factor * _at(curve, panel, phi)[2]
    return sign * (sign * values).max()


def _irregularity(curve: _Curve, inertia: Any, speed: Any) -> Any:
    """The irregularity at the level of energy whose mean of extremes is the speed asked for."""
    start = _at(curve, np.arange(1), curve.edges[:1])[2][0]
    works = _works(curve)
    square = speed**2

    def extremes(level: Any) -> tuple[Any, Any]:
        """Greatest and least s in omega² = w² (1 + s), and I* there."""

        def force(moment: Long, slope: Long, total: Long, phi: Long, panel: Any) -> Long:
            work = works(phi, panel)
            s = (2 * level + 2 * work - square * (total - start)) / (square * (inertia + total))
            return np.asarray(moment - square * (1 + s) / 2 * slope)

        panel, phi = _candidates(curve, force)
        total = _at(curve, panel, phi)[2]
        work = _work(curve, panel, phi)
        s = (2 * level + 2 * work - square * (total - start)) / (square * (inertia + total))
        ends = [int(s.argmax()), int(s.argmin())]
        return s[ends], total[ends]

    lowest = -square * (inertia + start) / 2 - _greatest(curve, np.longdouble(0), -1)  # where the machine comes to a stop
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


def _works(curve: _Curve) -> Any:
    """W on the samples of panels, and at single angles."""

    def works(phi: Long, panel: NDArray[np.intp]) -> Long:
        if phi.ndim == 1:
            return _work(curve, panel, phi)
        flat = _work(curve, np.repeat(panel, phi.shape[1]), phi.ravel())
        return flat.reshape(phi.shape)

    return works


# -- the reference, verified ------------------------------------------------------------------------------------------

_TIGHTEST = 1e-14
_IN_TIME = 1e-12
_SHARE = 0.01  # of a flywheel, by which it is changed to see what that does
_EVEN = 1e-13  # an irregularity that is none
_LEAST = 16 * ROUNDING  # doubt of two routes that happen to agree


class Reference(NamedTuple):
    """A figure (kg m² or 1), how far it may be off (relative), and how it was found and verified."""

    value: float
    doubt: float
    route: str
    verified: str
    messages: tuple[str, ...] = ()


_ALONE = "the closed form on Chebyshev cells", "by its own estimate alone: the other route has no finite value"


def verified(machine: Machine) -> tuple[Question, Reference]:
    """The question of a machine's scene and its true answer.

    Raises:
        SceneError: if the machine cannot run as its scene says.

    """
    tight = size(machine, _TIGHTEST, accuracy="normal")
    asked = question(machine, tight)
    if not asked.sized and answer(tight) <= _EVEN:
        found = "a motion that nothing but rounding varies"
        raise SceneError([Fault("flywheel.inertia", found, "an irregularity to compare methods by", "use flywheel size")])
    reference = _in_time(asked, tight) if machine.sets_its_speed else _extended(asked, tight)
    told = tuple(message for message in tight.messages if not message.startswith("rtol"))
    return asked, reference._replace(messages=told)


def _promised(asked: Question, tight: Sizing) -> float:
    """The error that the sizing at the tightest tolerance states of itself."""
    return max((tight.error.exact if asked.sized else tight.error.simulation) or 0.0, _LEAST)


def _extended(asked: Question, tight: Sizing) -> Reference:
    scene, found = asked.machine.scene, answer(tight)
    if asked.sized:
        value, doubt = (part / asked.crank for part in flywheel_inertia(asked.machine))
        if value + doubt < 0.0:  # the machine's own inertia suffices for certain
            doubt = 0.0
        value = max(value, 0.0)
    else:
        value, doubt = irregularity(asked.machine, (scene.inertia or 0.0) * asked.crank)
    promised = _promised(asked, tight)
    if not np.isfinite([value, doubt]).all():
        return Reference(found, promised, *_ALONE)
    apart = asked.error(found, value)
    own = max(asked.error(value + doubt, value), ROUNDING)
    route = "Gauss' rule on halved panels, in extended precision"
    told = f"the closed form on Chebyshev cells is {apart:.1e} apart, within its estimate of {promised:.1e}"
    if apart > promised + own:  # one of the two is wrong: what is not known is not claimed
        own, told = apart, f"the closed form on Chebyshev cells is {apart:.1e} apart: more than both estimates allow"
    return Reference(value, own, route, told)


def _in_time(asked: Question, tight: Sizing) -> Reference:
    value, promised = answer(tight), _promised(asked, tight)
    stepped = size(asked.machine, _IN_TIME, accuracy="audit")
    route = "periodic collocation at the tightest tolerance"
    if stepped.simulation is None or stepped.run is None or stepped.simulation.route != "time":
        return Reference(value, promised, route, "by its own estimate alone: the motion cannot be stepped in time")
    expected = stepped.run.irregularity
    apart = abs(stepped.simulation.irregularity / expected - 1.0) if expected else 0.0
    told = f"stepped in time, one cycle has an irregularity {apart:.1e} apart"
    damping = 1.0 if stepped.cyclic is None else min(abs(stepped.cyclic.damping), 1.0)
    slope = _slope(stepped, value * asked.crank) if asked.sized and value else 1.0
    # one cycle begun where collocation says cannot see that its level is off: where little holds it, that weighs more
    shift = (apart + abs(stepped.simulation.closure or 0.0) + _LEAST) / max(damping * slope, 1e-300)
    return Reference(value, max(min(shift, promised), asked.error(answer(stepped), value), _LEAST), route, told)


def _slope(sizing: Sizing, inertia: float) -> float:
    """By how much the irregularity changes with the flywheel (kg m² on the crank), both relative."""
    machine, constant = sizing.machine, sizing.constant or sizing.cycle
    assert machine is not None
    assert constant is not None
    lighter, heavier = ((1.0 - _SHARE) * inertia, (1.0 + _SHARE) * inertia)
    try:
        ends = [
            with_flywheel(machine, constant, sizing.speed, part, sizing.rtol).run.irregularity for part in (lighter, heavier)
        ]
    except NoMotionError:
        return 0.0
    return abs(ends[1] / ends[0] - 1.0) / (2.0 * _SHARE) if ends[0] else 0.0
