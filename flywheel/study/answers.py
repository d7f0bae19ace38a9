"""The question of a scene, the reference of its answer by two routes, and the methods that answer it like a script.

**The reference.** Torques that depend on speed: the periodic motion by collocation, verified by stepping it in time. Loads
of position alone: the closed form on Chebyshev cells, verified by Gauss' rule on halved panels in the longest floats that
numpy has, which is then the reference. It shares only the bond graph with the sizing, which it walks in extended
precision: no Chebyshev cells, no series, no search for roots on polynomials. If the computer has no floats longer than
doubles, or a mechanism computes its positions by iteration in doubles, only the route is independent, and the error bound is
wider.

**The methods.** On a grid of angles: the trapezoidal rule, the greatest and the least sample. In time: Euler, RK4, and
SciPy's RK45, DOP853 and LSODA, each with and without a restart at the breakpoints of the machine's loads and ratios; without
one, steps run across jumps and windows, as in a simple script. Without reduction: by the whole bond graph, or by Lagrange's
multipliers on bodies in absolute coordinates. The unknowns at the start of the cycle (its speed, a motor's current, the
balance, the flywheel) follow from Powell's hybrid method on the residuals at its end, with any function that runs the cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, optimize

from bondgraph.motion.stepping import FIXED, Step, hermite, runge_kutta_step
from bondgraph.numerics import root, roots_between, summits
from flywheel.machine.dynamics import Instant, MachineDynamics, StartState, dynamics_of
from flywheel.machine.equation import NoMotionError
from flywheel.machine.machine import Anchor, Machine, circuit_of
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages import multibody
from flywheel.motions.simulation import graph_motion, states_of_graph
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import constant_speed
from flywheel.sizing.confirmation import extreme
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size
from flywheel.sizing.speed_dependent import with_flywheel

Long = NDArray[np.longdouble]
Panel = NDArray[np.intp]
Force = Callable[[Long, Long, Long, Long, Panel], Long]

_ORDER = 24  # of Gauss' rule on a panel
_SAME_VALUE = 1e-15  # relative change by a halving that counts as zero; two in succession, as one may be chance
_FIRST, _MOST_HALVINGS, _MOST_PANELS = 2, 9, 20_000
_SAMPLES = 12  # in a panel, between which extremes are searched for
_LONG = np.finfo(np.longdouble).eps
_LEVELS = 80
_NO_FLUCTUATION = 1e-13  # of the work exchanged: a smaller fluctuation counts as zero


class Question(NamedTuple):
    """The figure that all methods compute: a flywheel (kg m², on its own shaft), or with a given one the irregularity.

    `scale` is the reference of relative errors if the figure itself is smaller: energy_fluctuation/(eps w²) for a flywheel.
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
            at_hand = max(cycle.exchanged / max(unit, 1e-300), sizing.reduced_inertia.max / scene.flywheel_ratio**2)
            scale = scale if scale > _NO_FLUCTUATION * at_hand else at_hand  # of a fluctuation that is rounding
        return cls(machine, True, scale)

    @property
    def figure(self) -> str:
        """The figure's name."""
        return "exact flywheel" if self.sized else "irregularity"

    @property
    def unit(self) -> str:
        """The unit of the figure."""
        return "kg m²" if self.sized else ""

    @property
    def crank(self) -> float:
        """Factor from an inertia on the flywheel's shaft to one on the crank."""
        return self.machine.scene.flywheel_ratio**2

    @property
    def flywheel(self) -> float:
        """The given flywheel on the crank (kg m²), 0 if one is to be sized."""
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


class _PanelCurve:
    """A cycle on panels: the unknown's value, W (J) at the edges, and the effect of rounding of the scene's angles on W."""

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


def flywheel_inertia(machine: Machine) -> tuple[float, float]:
    """The exact flywheel of a sizing (kg m² on the crank, before its floor at 0), and a bound of its error.

    I = [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²), z± = (1 ± eps/2)².

    Source: F. Wittenbauer, Graphische Dynamik (1923).
    """
    eps, speed = np.longdouble(machine.scene.irregularity or 0.0), np.longdouble(machine.scene.speed or 0.0)
    half = speed**2 / 2

    def figure(curve: _PanelCurve) -> Any:
        high = curve.greatest(half * (1 + eps / 2) ** 2, 1)
        low = curve.greatest(half * (1 - eps / 2) ** 2, -1)
        return (high - low) / (eps * speed**2)

    return _settled(machine, figure, lambda curve: 2 * curve.rounding / float(eps * speed**2))


def irregularity(machine: Machine, inertia: float) -> tuple[float, float]:
    """The irregularity of a machine with a flywheel (kg m² on the crank), at its mean of extremes w, and its greatest error.

    At the level e of energy, omega² = w² + (2 e + 2 W - w² (I* - I*(0)))/(J + I*): e is where the mean of extremes is w.
    """
    speed = np.longdouble(machine.scene.speed or 0.0)

    def rounding(curve: _PanelCurve) -> float:
        least = inertia + float(curve.at(np.arange(curve.edges.size - 1), curve.edges[:-1])[2].min())
        return 4 * curve.rounding / (float(speed) ** 2 * max(least, 1e-300))

    return _settled(machine, lambda curve: _irregularity_of_curve(curve, np.longdouble(inertia), speed), rounding)


def _irregularity_of_curve(curve: _PanelCurve, inertia: Any, speed: Any) -> Any:
    """The irregularity at the level of energy whose mean of extremes is the required speed."""
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

    lowest = -square * (inertia + start) / 2 - curve.greatest(np.longdouble(0), -1)  # where the machine stops
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


def _settled(
    machine: Machine, figure: Callable[[_PanelCurve], Any], rounding: Callable[[_PanelCurve], float]
) -> tuple[float, float]:
    """A figure on panels between all jumps and corners, halved until it no longer changes; and its error.

    The error is the change by the last halving plus the rounding error.
    """
    mesh = np.asarray(machine.mesh, dtype=np.longdouble)
    parts = [np.linspace(a, b, _FIRST + 1, dtype=np.longdouble)[:-1] for a, b in pairwise(mesh)]
    edges = np.append(np.concatenate(parts), mesh[-1])
    curve = _PanelCurve(machine, edges)
    before, changed, last = figure(curve), np.inf, np.inf
    for _ in range(_MOST_HALVINGS):
        if 2 * edges.size - 1 > _MOST_PANELS:
            break
        edges = np.insert(edges, np.arange(1, edges.size), (edges[1:] + edges[:-1]) / 2)
        curve = _PanelCurve(machine, edges)
        now = figure(curve)
        last, changed, before = changed, abs(float(now - before)), now
        if max(changed, last) <= _SAME_VALUE * abs(float(now)) or changed >= last:
            break
    if last <= _SAME_VALUE * abs(float(before)):
        changed = max(changed, last)
    return float(before), changed + ROUNDING * abs(float(before)) + rounding(curve)


# -- the reference, verified ------------------------------------------------------------------------------------------

_TIGHTEST = 1e-14
_IN_TIME = 1e-12
_SHARE = 0.01  # of a flywheel: change for a slope
_EVEN = 1e-13  # a smaller irregularity counts as zero
_LEAST = 16 * ROUNDING  # error bound of two routes that happen to agree


class Reference(NamedTuple):
    """A figure (kg m² or 1), its relative error bound, and the methods of computation and verification."""

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
        defect = "a motion that varies by rounding alone"
        raise SceneError([Fault("flywheel.inertia", defect, "an irregularity to compare methods by", "use flywheel size")])
    promised = max((tight.error.exact if question.sized else tight.error.simulation) or 0.0, _LEAST)
    reference = (_in_time if machine.sets_its_speed else _extended)(question, answer(tight), promised)
    return question, reference._replace(messages=tuple(m for m in tight.messages if not m.startswith("rtol")))


def _extended(question: Question, closed: float, promised: float) -> Reference:
    """Integrates by Gauss' rule, verified by the closed form, whose error is known."""
    if question.sized:
        value, doubt = (part / question.crank for part in flywheel_inertia(question.machine))
        if value + doubt < 0.0:  # the machine's own inertia suffices for certain
            doubt = 0.0
        value = max(value, 0.0)
    else:
        value, doubt = irregularity(question.machine, question.flywheel)
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
    """The change of the irregularity with the flywheel (kg m² on the crank), both relative."""
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


Array = NDArray[np.float64]

# -- a plain grid ------------------------------------------------------------------------------------------------------


class GridSamples(NamedTuple):
    """A cycle on evenly spaced angles: W (J) and I* (kg m²) there, the crank's speed w (rad/s), and the unknown's value.

    `unit` is the unknown's change (SI) that changes the cycle's net work by one joule; 0 without an unknown.
    """

    phi: Array
    work: Array
    inertia: Array
    speed: float
    balance: float
    unit: float


def sampled(machine: Machine, count: int) -> GridSamples:
    """The cycle at `count` angles and its end; torques that depend on speed are taken at a constant one."""
    phi = np.linspace(0.0, machine.scene.cycle, count + 1)
    reduced = machine.reduce(phi)
    moment, share, inertia = (part + 0.0 * phi for part in (reduced.moment, reduced.per_unknown, reduced.inertia))
    speed, balance, unit = machine.scene.speed or 0.0, 0.0, 0.0
    if machine.sets_its_speed:
        own, balance = constant_speed.operating_point(machine)
        speed = own or 0.0
        dynamics = dynamics_of(machine, 0.0, balance)
        dynamics.circuit = None  # at a constant speed a motor's current is steady
        anchor = Anchor(machine.anchors(phi), speed + 0.0 * phi, 0.0 * phi)
        moment = dynamics.at_many(phi, anchor, anchor.omega, anchor.time).moment
    elif net := float(np.trapezoid(share, phi)):
        balance, unit = -float(np.trapezoid(moment, phi)) / net, 1.0 / net
        moment = moment + balance * share
    steps = 0.5 * (moment[1:] + moment[:-1]) * np.diff(phi)
    return GridSamples(phi, np.concatenate(([0.0], np.cumsum(steps))), inertia, speed, balance, unit)


def by_grid(question: Question, count: int) -> float:
    """The answer from a plain grid."""
    samples = sampled(question.machine, count)
    if question.sized:
        return max(_flywheel(samples, question.machine.scene.irregularity or 0.0), 0.0) / question.crank
    omega = _speeds(samples, question.flywheel)
    return _irregularity(omega.max(), omega.min())


def _flywheel(samples: GridSamples, eps: float) -> float:
    """Wittenbauer's flywheel (kg m² on the crank) of samples: [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²)."""
    square = samples.speed**2
    energy = 0.5 * square * samples.inertia
    high = (samples.work - (1 + eps / 2) ** 2 * energy).max()
    low = (samples.work - (1 - eps / 2) ** 2 * energy).min()
    return float((high - low) / (eps * square))


def _speeds(samples: GridSamples, inertia: float) -> Array:
    """Speeds (rad/s) at the samples with a flywheel (kg m² on the crank), at the level where their mean of extremes is w."""
    total = inertia + samples.inertia

    def at(level: float) -> Array:
        return np.asarray(np.sqrt(np.maximum(2 * (level + samples.work) / total, 0.0)))

    def excess(level: float) -> float:
        omega = at(level)
        return float(0.5 * (omega.max() + omega.min()) / samples.speed - 1)

    top = float(0.5 * total.max() * samples.speed**2 + np.abs(samples.work).max())
    return at(root(excess, -float(samples.work.min()), 4 * top))


def _irregularity(greatest: float, least: float) -> float:
    """2 (w_max - w_min)/(w_max + w_min)."""
    return float(2 * (greatest - least) / (greatest + least))


# -- cycles that are run until they close ------------------------------------------------------------------------------

_GUESS = 360  # angles of the grid that the search starts from
_MOST_RUNS = 60
_DIFFERENCE = 1e-3  # of an unknown's scale, by which it is first varied: above the noise of rough steps
_OFF = 0.01  # of an irregularity: tolerance at the end of a search
_STOPS = 1e3  # residual of a machine that stops within its cycle


class NoAnswerError(ValueError):
    """A method without an answer; the message gives the reason."""


class Trial(NamedTuple):
    """A cycle to be run: flywheel (kg m² on the crank), the unknown's value (SI), speed (rad/s) and states of a motor.

    `period` is its approximate duration (s).
    """

    inertia: float
    balance: float
    speed: float
    states: tuple[float, ...]
    period: float


class Revolution(NamedTuple):
    """Result of a run of one cycle: speed and a motor's own states at its end, greatest and least speed on the way."""

    speed: float
    states: tuple[float, ...]
    greatest: float
    least: float


Revolve = Callable[[Trial], Revolution]


def by_shooting(question: Question, revolve: Revolve, tolerance: float) -> float:
    """The answer from cycles run by `revolve`, to a tolerance of its search (relative).

    The search starts from a plain grid. Every unknown is scaled by its significant change, about the irregularity's share,
    and so are the residuals: irregularity, mean of extremes, closure of speed and of current.

    Raises:
        NoAnswerError: if the search finds no motion.

    """
    machine, scene = question.machine, question.machine.scene
    circuit, balanced = circuit_of(scene), scene.unknown is not None
    samples = sampled(machine, _GUESS)
    own = float(samples.inertia.mean())
    inertia = max(_flywheel(samples, scene.irregularity or 0.0), 1e-3 * own) if question.sized else question.flywheel
    omega = _speeds(samples, inertia)
    eps = (scene.irregularity or 0.0) if question.sized else max(_irregularity(omega.max(), omega.min()), 1e-12)
    own_states: tuple[float, ...] = ()
    if circuit is not None and scene.drive is not None:
        own_states = tuple(float(one) for one in circuit.steady(scene.shafts[scene.drive.on] * samples.speed))
    period = float(np.trapezoid(1.0 / np.maximum(omega, 1e-3 * samples.speed), samples.phi))
    guess = Trial(inertia, samples.balance, float(omega[0]), own_states, period)
    scales = {"speed": eps * samples.speed}
    if question.sized:
        scales["inertia"] = inertia + own
    if balanced:
        by_work = samples.unit * eps * (inertia + own) * samples.speed**2
        scales["balance"] = by_work or eps * (abs(samples.balance) or 1.0)
    sizes = [max(abs(state), 1.0) * eps for state in own_states]

    def trial(x: Array) -> Trial:
        count = len(scales)
        shares = zip(scales.items(), (x[:count] - 1.0).tolist(), strict=True)
        moved = {name: getattr(guess, name) + share * scale for (name, scale), share in shares}
        rows = zip(own_states, sizes, (x[count:] - 1.0).tolist(), strict=True)
        return guess._replace(**moved, states=tuple(state + share * size for state, size, share in rows))

    def lacking(x: Array) -> list[float]:
        start = trial(x)
        end = revolve(start) if start.speed > 0.0 else None
        if end is None or not np.isfinite((end.speed, *end.states, end.greatest, end.least)).all() or end.least <= 0.0:
            return [_STOPS] * (len(scales) + len(sizes))
        mean = 0.5 * (end.greatest + end.least)
        lacks = [(end.greatest - end.least) / (mean * eps) - 1.0] if question.sized else []
        if balanced or not machine.sets_its_speed:
            lacks.append((mean / (scene.speed or 1.0) - 1.0) / eps)
        if balanced or machine.sets_its_speed:
            lacks.append((end.speed - start.speed) / (mean * eps))
        return lacks + [(a - b) / size for a, b, size in zip(end.states, start.states, sizes, strict=True)]

    options: Any = {"xtol": max(tolerance, 1e-14), "eps": _DIFFERENCE**2, "maxfev": _MOST_RUNS}
    solution: Any = optimize.root(lacking, np.ones(len(scales) + len(sizes)), method="hybr", options=options)
    if not np.isfinite(solution.fun).all() or np.abs(solution.fun).max() > _OFF:
        raise NoAnswerError("its cycles reach no steady motion")
    last = trial(solution.x)
    if question.sized:
        return max(last.inertia, 0.0) / question.crank
    end = revolve(last)
    return _irregularity(end.greatest, end.least)


def stretches_of(machine: Machine, restart: bool) -> list[tuple[float, float]]:
    """Ranges of angles (rad) stepped without a restart: the whole cycle, or those between breakpoints."""
    return list(pairwise(machine.restarts.tolist())) if restart else [(0.0, machine.scene.cycle)]


def _instant(
    dynamics: MachineDynamics, stretch: tuple[float, float], restart: bool, phi: float, omega: float, states: Any = ()
) -> Instant:
    """The machine at an angle of a stretch, with the branches of its middle; without restarts with those at the angle."""
    if restart:
        return dynamics.at(phi, 0.5 * sum(stretch), omega, states=states, ends=stretch)
    phi = phi % dynamics.machine.scene.cycle
    return dynamics.at(phi, float(dynamics.machine.anchors(phi)), omega, states=states)


_BETWEEN, _CLOSER = 8, 7  # samples between two times, and rounds of looking closer


def _summit(speed: Callable[[Array], Array], times: Array, sign: float) -> float:
    """The greatest (sign 1) or least (-1) of a speed over time, between given times and ever closer about the best ones."""
    fine = np.append((times[:-1, None] + np.diff(times)[:, None] * np.arange(_BETWEEN) / _BETWEEN).ravel(), times[-1])
    tops = np.array(standing_out(sign * speed(fine)))
    low, high = fine[np.maximum(tops - 1, 0)], fine[np.minimum(tops + 1, fine.size - 1)]
    summit = summits(lambda grid, _: sign * speed(grid.ravel()).reshape(grid.shape), low, high, 2 * _BETWEEN + 1, _CLOSER)
    return sign * float(summit.value.max())


def standing_out(values: Array) -> list[int]:
    """The samples that exceed their neighbours, if a peak beside them may be the greatest of all.

    >>> standing_out(np.array([0.0, 1.0, 0.5, 0.98, 0.5, 0.2, 0.3, 0.1]))
    [1, 3]
    """
    steps = np.abs(np.diff(values))
    reach = np.maximum(np.append(steps, 0.0), np.append(0.0, steps))  # what a peak between samples may add, at most
    beside = np.pad(values, 1, constant_values=-np.inf)
    out = (values >= beside[:-2]) & (values >= beside[2:]) & (values + reach >= values.max())
    return [int(k) for k in np.flatnonzero(out)]


# -- a cycle by steps --------------------------------------------------------------------------------------------------

Rates = Callable[[float, Array], Array]
StretchSteps = Callable[[Rates, float, Array, tuple[float, float], float], Iterator[Step]]

ADAPTIVE = ("RK45", "DOP853", "LSODA")
_MOST_STEPS = 200_000  # in a stretch: a machine that stops within it never gets to its end
_MANY = 100  # steps, past which extremes are searched for beside the best ones only


def fixed(machine: Machine, name: str, count: int, restart: bool) -> Revolve:
    """Runs cycles by a rule of fixed step, about `count` steps a cycle."""
    tableau = FIXED[name.lower()]

    def stretch_steps(rates: Rates, t: float, state: Array, stretch: tuple[float, float], period: float) -> Iterator[Step]:
        low, high = stretch
        share = (high - low) / machine.scene.cycle
        steps = max(round(count * share), 1)
        h = period * share / steps if not restart else (high - state[0]) / state[1] / steps
        for _ in range(_MOST_STEPS):
            step = partial(runge_kutta_step, tableau, rates, t, state, rate=rates(t, state))
            after = step(h)
            if after[0] >= high:
                h = root(lambda length: float(step(length)[0]) - high, 0.0, h)  # noqa: B023 - called at once
                after = step(h)
                after[0] = high
            yield Step(_between(rates, t, state, h, after), t, t + h)
            t, state = t + h, after
            if state[0] >= high:
                return
            if not state[1] > 0.0:
                break
        raise NoAnswerError("the machine stops within its cycle")

    return _stepped(machine, restart, stretch_steps)


def _between(rates: Rates, t: float, state: Array, h: float, after: Array) -> Callable[[Any], Array]:
    """Hermite's cubic over a step; its rates are computed at its first evaluation, because few steps need it."""
    cubic: list[Callable[[Any], Array]] = []

    def dense(times: Any) -> Array:
        if np.ndim(times) == 0 and times == t + h:
            return after
        if not cubic:
            cubic.append(hermite(t, t + h, state, after, rates(t, state), rates(t + h, after)))
        return cubic[0](times)

    return dense


def adaptive(machine: Machine, name: str, rtol: float, restart: bool) -> Revolve:
    """Runs cycles by one of SciPy's integrators at a tolerance of its steps."""
    kind: Any = getattr(integrate, name)

    def stretch_steps(rates: Rates, t: float, state: Array, stretch: tuple[float, float], period: float) -> Iterator[Step]:
        scale: Any = rtol * np.maximum(np.abs(state), [1.0, 0.0, 1.0][: state.size])
        solver = kind(rates, t, state, t + 100 * period, rtol=rtol, atol=scale)
        for _ in range(_MOST_STEPS):
            if solver.status != "running":
                break
            solver.step()
            dense, before = solver.dense_output(), float(solver.t_old)
            if solver.y[0] >= stretch[1]:
                end = root(lambda t: float(dense(t)[0]) - stretch[1], before, float(solver.t))  # noqa: B023
                yield Step(dense, before, end)
                return
            yield Step(dense, before, float(solver.t))
            if not solver.y[1] > 0.0:
                break
        raise NoAnswerError("the machine stops within its cycle")

    return _stepped(machine, restart, stretch_steps)


def _stepped(machine: Machine, restart: bool, stretch_steps: StretchSteps) -> Revolve:
    """Runs cycles stretch by stretch: the state is phi, omega, and a motor's own states."""

    def rates(dynamics: MachineDynamics, stretch: tuple[float, float], t: float, state: Array) -> Array:
        phi, omega, *own = state.tolist()
        now = _instant(dynamics, stretch, restart, phi, omega, own)
        return np.array([omega, float(now.acceleration), *map(float, now.rates)])

    def revolve(trial: Trial) -> Revolution:
        dynamics = dynamics_of(machine, trial.inertia, trial.balance)
        state = np.array([0.0, trial.speed, *trial.states])
        t, steps = 0.0, list[Step]()
        for stretch in stretches_of(machine, restart):
            steps += stretch_steps(partial(rates, dynamics, stretch), t, state, stretch, trial.period)
            t = steps[-1].end
            state = np.array(steps[-1].dense(t))
            state[0] = stretch[1]
        greatest, least = (extreme(_near(steps, sign), sign)[1] for sign in (1.0, -1.0))
        return Revolution(float(state[1]), tuple(state[2:].tolist()), greatest, least)

    return revolve


def _near(steps: list[Step], sign: float) -> list[Step]:
    """The steps beside ends that are the fastest (sign 1) or the slowest (-1)."""
    if len(steps) < _MANY:
        return steps
    ends = np.array([steps[0].dense(steps[0].start)[1], *(step.dense(step.end)[1] for step in steps)])
    chosen = {j for k in standing_out(sign * ends) for j in (k - 1, k) if 0 <= j < len(steps)}
    return [steps[j] for j in sorted(chosen)]


# -- a cycle without reduction -----------------------------------------------------------------------------------------

_LONGER = (1.02, 1.3, 3.0, 10.0)  # than the period expected: how long the whole graph is simulated, until the cycle is over
_SLACK = (1.1, 1.5, 3.0, 10.0)  # the same of bodies with multipliers
_ANGLES = 13  # at which the inertia beside the bodies' own is compared
_EVEN_STEP = 1e-9
_STUCK = "the machine stops within its cycle"


def by_bond_graph(machine: Machine, rtol: float) -> Revolve:
    """Runs cycles by `bondgraph.simulate` on the machine's own graph, where every element has its own law."""
    scene = machine.scene

    def revolve(trial: Trial) -> Revolution:
        start = StartState(0.0, trial.speed, trial.states)
        for longer in _LONGER:
            inertia = trial.inertia / scene.flywheel_ratio**2
            run = graph_motion(machine, start, longer * trial.period, inertia, trial.balance, rtol)

            def missing(t: float, run: Any = run) -> float:
                return float(run.displacement("phi", np.array([t]))[0]) - scene.cycle

            if missing(float(run.t[-1])) >= 0.0:
                break
        else:
            raise NoAnswerError(_STUCK)
        end, greatest, least = _end_and_extremes(missing, lambda times: np.asarray(run.flow("crank", times)), run.t)
        own = tuple(float(row[0]) for row in states_of_graph(scene, run, np.array([end])).values())
        return Revolution(float(run.flow("crank", np.array([end]))[0]), own, greatest, least)

    return revolve


def by_multipliers(machine: Machine, rtol: float, restart: bool) -> Revolve:
    """Runs cycles by `flywheel.multibody` on the machine's mechanism as a linkage.

    Joints are equations with multipliers; positions are corrected after every step. Loads become the torque at the crank
    that does the same work, and parts that turn in a constant ratio inertia of the crank.
    """
    scene, mechanism = machine.scene, machine.scene.mechanisms[0]
    linkage, added = linkage_of(mechanism), _added_inertia(machine) or 0.0
    driven = linkage.joint(linkage.driver).second

    def revolve(trial: Trial) -> Revolution:
        more = trial.inertia + added
        links = (link._replace(inertia=link.inertia + more) if link.name == driven else link for link in linkage.links)
        heavier = replace(linkage, links=tuple(links))
        dynamics = dynamics_of(machine, trial.inertia, trial.balance)
        omega, extremes = trial.speed, list[float]()
        for low, high in stretches_of(machine, restart):

            def torque(t: float, q: float, qdot: float, stretch: tuple[float, float] = (low, high)) -> float:
                return float(_instant(dynamics, stretch, restart, q - mechanism.phase, qdot).moment)

            expected = (high - low) / scene.cycle * trial.period
            start, last = low + mechanism.phase, high + mechanism.phase
            for longer in _SLACK:
                run = multibody.simulate(
                    heavier, multibody.MULTIPLIERS, start, omega, longer * expected, drive=torque, rtol=rtol
                )
                if run.q[-1] - mechanism.phase >= high:
                    break
            else:
                raise NoAnswerError(_STUCK)

            def missing(t: float, run: Any = run, last: float = last) -> float:
                return float(run.at(t)[0][0]) - last

            def speed(times: Array, run: Any = run) -> Array:
                return np.asarray(run.at(times)[1])

            end, *outcome = _end_and_extremes(missing, speed, run.t)
            omega = float(run.at(end)[1][0])
            extremes += outcome
        return Revolution(omega, (), max(extremes), min(extremes))

    return revolve


def _end_and_extremes(
    missing: Callable[[float], float], omega: Callable[[Array], Array], times: Array
) -> tuple[float, float, float]:
    """Time (s) at which a motion is over; the greatest and the least speed until then."""
    end = root(missing, 0.0, float(times[-1]))
    until = np.append(times[times < end], end)
    return end, _summit(omega, until, 1.0), _summit(omega, until, -1.0)


def obstacle(machine: Machine) -> str | None:
    """Reason why a machine cannot be run by multipliers; None if it can."""
    scene = machine.scene
    if len(scene.mechanisms) != 1:
        return "it takes machines with one mechanism"
    mechanism = scene.mechanisms[0]
    if not has_joints(mechanism):
        return f"a {mechanism.type} has no bodies to join"
    if scene.shafts[mechanism.shaft] != 1.0:
        return "it takes mechanisms that turn with the crank"
    if circuit_of(scene) is not None or any(value < 1.0 for value in scene.efficiencies.values()):
        return "it takes no motor's current and no losses in meshes"
    if machine.friction is not None:
        return "it takes joints without friction"
    if _added_inertia(machine) is None:
        return "it takes no inertia on ports in addition to the bodies' own"
    return None


def _added_inertia(machine: Machine) -> float | None:
    """Inertia on the crank (kg m²) beside the mechanism's bodies; None if it varies."""
    scene = machine.scene
    bare = Machine(replace(scene, inertias=(), loads=(), springs=(), dampers=(), drive=None, motor=None))
    phi = np.linspace(0.1, scene.cycle - 0.1, _ANGLES)
    total, own = (np.asarray(part.reduce(phi).inertia + 0.0 * phi) for part in (machine, bare))
    added = total - own
    return float(added.mean()) if np.ptp(added) <= _EVEN_STEP * (np.abs(total).max() + 1e-300) else None
