"""The steady motion of a machine whose torques depend on speed, on cells fine enough, with its error.

Cells are halved until the estimates allow it, and cut where laws switch at a speed or a mesh changes the side that drives:
the motion itself tells where that is, so that cutting and solving go in turns. Along the motion found, the moment is a
function of angle: what is known of machines with such moments then holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import piecewise, regime, steady
from flywheel.chain import Chain, merged
from flywheel.constant_speed import cycle_of
from flywheel.moments import Moments
from flywheel.periodic import Asked, NoRegimeError, Periodic, State, first_guess, periodic, sensitivity, with_inertia
from flywheel.piecewise import ORDER, ROUNDING
from flywheel.regime import Cycle
from flywheel.steady import Run

Array = NDArray[np.float64]

_ROUNDS = 120
_MOST_MOVES = 8  # of the switches, before the cells are halved although they have not settled
_MOST_FAILURES = 3  # of the iteration on changed cells, before the best motion so far has to do
_SAME = 1e-12  # of the cycle: switches that move less than this stand still
_ROUGH, _MOST_ROUGH = 1e-3, 16  # error of a motion that is hardly resolved yet; rounds granted to it
_MANY = 1000  # cells from which on a rough motion is given no more rounds
_UNEVEN = 0.5  # irregularity of a motion whose speed varies as sharply as its loads, or more
_EVEN = 1e-9  # irregularity of a motion in which only rounding varies
_HARDLY = 0.1  # of J + I*: a sized flywheel in greater doubt is none
_STIFF, _UNLIKE = 3e3, 8.0  # times over that a change fades in a cycle; how far a slope may be off a difference
_HOPELESS = 0.5  # relative error past which a motion says nothing
_TINY = 1e-6  # irregularity up to which a sized motion is not solved for again
_WIDER = 1.5  # from one given flywheel to the next, to find a light and a heavy one
_MOST_TRIALS = 80
_NEAR = 0.5  # of the irregularity asked for: from here on the flywheel for it is looked for directly
_EVER_HEAVIER = (1.0, 30.0, 1e3, 3e4)  # flywheels from which lighter ones are found, where the one before fails
_COARSE = 1e-4  # error of motions that are only passed on the way
_MOST_LIGHTER = 60
_LAYER = 8.0  # exponent: how much of what a jump makes has faded in the first cell behind it
_MOST_HALVINGS = 8  # of a step to a lighter flywheel
_BOLDER = 3.0  # than the step before, on the way to a light flywheel
_STALLING, _LITTLE = 1.9, 3e-3  # irregularity from which on a step is not halved below that share of the inertia
_NEARER = 0.3  # of what an irregularity lacks of 2: from one motion to the next
_HEAVIER = 2.0  # from one flywheel to the next on the way to a light one


class LostError(NoRegimeError):
    """A motion was found whose figures rounding leaves nothing of; the message says which."""


class UntoldError(NoRegimeError):
    """A flywheel was found that rounding leaves open: its irregularity hardly depends on it."""


class OwnMotion(NamedTuple):
    """A steady motion: as solved, its moment along the cycle (`cycle`), and as a `Run` at its own mean of extremes."""

    solved: Periodic
    cycle: Cycle
    run: Run
    level_error: float  # of the speed's mean, relative
    inertia_doubt: float = 0.0  # kg m² that a sized flywheel may be off

    @property
    def speed(self) -> float:
        """Mean of the greatest and least speed (rad/s)."""
        return self.solved.speed

    @property
    def inertia(self) -> float:
        """The flywheel's, on the crank (kg m²)."""
        return self.solved.state.inertia

    @property
    def inertia_error(self) -> float:
        """Error of a sized inertia, relative to the larger of itself and its scale, the swing of work over eps w²."""
        swing = float(np.ptp(self.cycle.start[0])) / max(self.solved.irregularity * self.speed**2, 1e-300)
        return self.inertia_doubt / max(self.inertia, swing, 1e-300)


def found(machine: Chain, reference: float, asked: Asked, guess: float, unknown: float, rtol: float) -> OwnMotion:
    """The steady motion with a given flywheel, or with the one that an irregularity asks for, at an error within rtol.

    Args:
        machine: the machine.
        reference: speed (rad/s) near that of the motion; the one asked for where there is one.
        asked: what is asked of the motion.
        guess: of the flywheel's inertia, kg m² on the crank, where it is sized.
        unknown: a first guess of the scene's unknown.
        rtol: relative error allowed in the irregularity, and in the inertia where it is sized.

    Raises:
        NoRegimeError: where there is no such motion.

    """
    if asked.inertia is not None:
        return _sane(_found(machine, reference, asked, asked.inertia, unknown, rtol))
    try:
        motion = _sane(_found(machine, reference, asked, guess, unknown, rtol))
    except NoRegimeError:
        if not _switches_at_all(machine):
            raise
        return _by_search(machine, reference, asked, guess, unknown, rtol)
    _check_told(machine, reference, asked, motion, rtol)
    if motion.inertia <= 0.0 or not _switches_at_all(machine) or _confirmed(machine, reference, asked, motion, rtol):
        return motion
    return _by_search(machine, reference, asked, motion.inertia, unknown, rtol)


def _found(machine: Chain, reference: float, asked: Asked, inertia: float, unknown: float, rtol: float) -> OwnMotion:
    """The motion found directly, or where that fails, from heavier flywheels down."""
    try:
        return _Search(machine, reference, asked, rtol).from_nothing(inertia, unknown)
    except NoRegimeError:
        return _by_continuation(machine, reference, asked, inertia, unknown, rtol)


def _sane(motion: OwnMotion) -> OwnMotion:
    """The motion, unless its figures cannot be: refused then, however they came about."""
    run = motion.run
    # what may as well have an irregularity of 2 may as well stop
    possible = run.speed_min > 0.0 and run.irregularity * (1.0 + run.error) < 2.0
    if possible and _untold(motion):
        raise _open_flywheel(motion)
    if possible and not run.error <= _HOPELESS and run.irregularity > _EVEN:
        work = f"work of {motion.cycle.exchanged:.3g} J in a cycle"
        raise LostError(f"an irregularity of about {run.irregularity:.2g}, lost in the rounding of {work}")
    if not possible:
        raise NoRegimeError("rounding leaves open whether the motion stops within the cycle")
    return _rounded(motion)


def _rounded(motion: OwnMotion) -> OwnMotion:
    """The motion with what the last digits of the speed make of a stiff torque, in the cells of its extremes, in its errors.

    F is off by |dF/domega| omega u there, and the energy by the integral of that from where the cell begins.
    """
    solved, run = motion.solved, motion.run
    if not run.irregularity > 0.0:
        return motion
    stiff = piecewise.integral(np.abs(solved.rate.by_speed) * solved.omega, solved.moments.mesh.half)
    work = 4 * ROUNDING * float(stiff[solved.extremes.cell].max())
    least = float(solved.state.inertia + solved.moments.inertia.min())
    off = 4.0 * work / (solved.speed**2 * least * run.irregularity)
    slope = 0.0 if solved.sensitivity is None else solved.sensitivity.by_square
    doubt = motion.inertia_doubt + 0.5 * slope * run.irregularity * off
    return motion._replace(run=run._replace(error=run.error + off), inertia_doubt=doubt)


def _check_told(machine: Chain, reference: float, asked: Asked, motion: OwnMotion, rtol: float) -> None:
    """Refuse a flywheel under torques that fade a change of speed so fast that rounding may have made its sensitivity.

    Half as much again must change the irregularity about as that says.
    """
    solved, inertia = motion.solved, motion.inertia
    fading = solved.rate.by_speed / ((inertia + solved.moments.inertia) * solved.omega)
    stiff = float(np.abs(piecewise.integral(fading, solved.moments.mesh.half)).sum()) > _STIFF
    if not stiff or inertia <= 0.0 or solved.sensitivity is None:
        return
    given = Asked(1.5 * inertia, None, asked.speed)
    heavier = _found(machine, reference, given, given.inertia or 0.0, solved.state.unknown, rtol)
    expected = inertia / max(solved.sensitivity.by_square, 1e-300)  # 0.5 J of it, and the slope of eps is twice that of s
    if not _UNLIKE * expected > abs(heavier.run.irregularity - solved.irregularity) > expected / _UNLIKE:
        raise _open_flywheel(motion)


def _open_flywheel(motion: OwnMotion) -> UntoldError:
    """Of a flywheel that its irregularity leaves open."""
    what = f"what about {motion.inertia:.2g} kg m² on the crank change of it is lost in rounding"
    return UntoldError(f"an irregularity that hardly tells the flywheel: {what}")


def _untold(motion: OwnMotion) -> bool:
    """Whether the irregularity leaves the flywheel open that was sized for it."""
    return motion.inertia_doubt > _HARDLY * (motion.inertia + float(motion.solved.moments.inertia.max()))


def _switches_at_all(machine: Chain) -> bool:
    """Whether a law switches at a speed, or a mesh has losses, so that cells are cut by the motion itself."""
    moments = Moments(machine, piecewise.cells(machine.mesh), local=True)
    return moments.lossy or bool(moments.switches(np.full(moments.mesh.phi.shape, machine.pace)))


def _confirmed(machine: Chain, reference: float, asked: Asked, motion: OwnMotion, rtol: float) -> bool:
    """Whether the motion with the flywheel that was found, solved for itself, has the irregularity asked for."""
    given = Asked(motion.inertia, None, asked.speed)
    if motion.run.irregularity <= _TINY:
        return True  # so even a motion depends on its switches no more than on rounding
    if motion.run.error > _ROUGH:
        return False
    try:
        again = _sane(_Search(machine, reference, given, rtol).from_another(motion))
    except NoRegimeError:
        return False
    off = abs(again.run.irregularity / (asked.irregularity or 1.0) - 1.0)
    return off <= 10 * (again.run.error + motion.run.error) + _SAME


def _by_search(machine: Chain, reference: float, asked: Asked, guess: float, unknown: float, rtol: float) -> OwnMotion:
    """The flywheel for an irregularity between two given ones, one too light and one too heavy, closer and closer.

    For machines whose switches keep the iteration for the flywheel itself from settling.
    """
    wanted = asked.irregularity or 0.0

    def tried(inertia: float) -> OwnMotion | None:
        try:
            return _sane(_found(machine, reference, Asked(inertia, None, asked.speed), inertia, unknown, rtol))
        except NoRegimeError:
            return None

    def excess(motion: OwnMotion | None) -> float:
        return np.inf if motion is None else motion.run.irregularity / wanted - 1.0

    if not excess(tried(0.0)) > 0.0:
        raise NoRegimeError("even without a flywheel the speed varies less than asked")
    too_light, last = excess(tried(guess)) > 0.0, guess
    for _ in range(_MOST_LIGHTER):
        before, last = last, last * _WIDER if too_light else last / _WIDER
        if (excess(tried(last)) > 0.0) != too_light:
            return _between(tried, excess, min(before, last), max(before, last), asked.speed)
    raise NoRegimeError("the search between light and heavy flywheels settles on none with that irregularity")


def _between(
    tried: Callable[[float], OwnMotion | None],
    excess: Callable[[OwnMotion | None], float],
    light: float,
    heavy: float,
    speed: float | None,
) -> OwnMotion:
    """The motion with the flywheel between a light and a heavy one at which nothing is in excess, by false position."""
    best, side = tried(heavy), 0
    at_low, at_high = excess(tried(light)), excess(best)
    for _ in range(_MOST_TRIALS):
        share = at_low / (at_low - at_high) if np.isfinite(at_low) and at_low > at_high else 0.5
        inertia = light + (heavy - light) * min(max(share, 0.01), 0.99)
        best = tried(inertia)
        value = excess(best)
        if abs(value) <= _SAME or heavy - light <= 1e-15 * heavy:
            break
        if value > 0.0:
            light, at_low, at_high = inertia, value, at_high * (0.5 if side > 0 else 1.0)
            side = 1
        else:
            heavy, at_high, at_low = inertia, value, at_low * (0.5 if side < 0 else 1.0)
            side = -1
    if best is None or not abs(excess(best)) <= _ROUGH:
        raise NoRegimeError("the search between light and heavy flywheels settles on none with that irregularity")
    answer, off = sensitivity(best.solved, speed), best.run.error + abs(excess(best))
    return best._replace(
        run=best.run._replace(error=off), inertia_doubt=answer.by_square * 0.5 * best.run.irregularity * off
    )


class _Search:
    """Cells and switches that change in turns with the motion that is found on them."""

    def __init__(self, machine: Chain, reference: float, asked: Asked, rtol: float) -> None:
        self.machine, self.reference, self.asked, self.rtol = machine, reference, asked, rtol
        self._begin()

    def _begin(self) -> None:
        """Nothing cut, nothing found yet."""
        self.base, self.cuts = self.machine.mesh, np.zeros(0)
        self.best: tuple[float, OwnMotion] | None = None
        self.stalls = self.moves = self.failures = self.rough = 0

    def from_nothing(self, inertia: float, unknown: float) -> OwnMotion:
        """The motion found from what torques at a constant speed would give."""
        moments = self._layered(self.reference, inertia, unknown)
        current = 0.0 if moments.circuit is None else float(moments.steady_current(np.array(self.reference)))
        start = first_guess(moments, self.reference, inertia, unknown, current)
        try:
            return self._refined(periodic(moments, self.reference, self.asked, start))
        except NoRegimeError:
            if not moments.switches(np.full(moments.mesh.phi.shape, self.reference)) and not moments.lossy:
                raise
        self._begin()
        moments = self._moments(local=True)
        start = first_guess(moments, self.reference, inertia, unknown, current)
        rough = periodic(moments, self.reference, self.asked, start)
        self.cuts = _switching(rough)
        moments = self._moments()
        return self._refined(periodic(moments, self.reference, self.asked, carried(rough, moments)))

    def from_another(self, other: OwnMotion) -> OwnMotion:
        """The motion found from that with another flywheel."""
        self.cuts = _switching(other.solved)
        if other.run.irregularity > _UNEVEN:  # what resolved it is needed again; else its switches have moved on
            self.base = other.solved.moments.mesh.edges
        moments = self._layered(other.speed, other.inertia, other.solved.state.unknown)
        start = carried(other.solved, moments)
        if self.asked.inertia is not None:
            start = with_inertia(start, moments, other.solved.reference, self.asked.inertia)
        return self._refined(periodic(moments, self.reference, self.asked, start))

    def _refined(self, solved: Periodic) -> OwnMotion:
        """The motion at an error within rtol, or the best that can be had."""
        for _ in range(_ROUNDS):
            if self._settled(solved) and self._enough(self._described(solved)):
                break
            if self.moves == 0 and not self._split(self._described(solved)):
                break
            if self.moves == _MOST_MOVES:
                self._split(self._described(solved))
            before, solved = solved, self._again(solved)
            if self.failures > _MOST_FAILURES:
                break
        else:
            self._enough(_doubtful(self._described(solved), before))
        if self.failures and (self.best is None or self.best[0] > _ROUGH):
            raise NoRegimeError("on finer cells the iteration settles on no motion")
        if self.best is None:
            self._enough(self._described(solved))
        assert self.best is not None
        return self.best[1]

    def _described(self, solved: Periodic) -> OwnMotion:
        return _described(solved, self.asked)

    def _moments(self, *, local: bool = False) -> Moments:
        edges = merged([*self.base.tolist(), *self.cuts.tolist()], float(self.base[-1]))
        return Moments(self.machine, piecewise.cells(edges), local=local)

    def _layered(self, speed: float, inertia: float, unknown: float) -> Moments:
        """The machine on cells that are narrow where a motion at about that speed settles steeply."""
        moments = self._moments()
        finer = layered(moments, speed, inertia, unknown)
        if finer.size == moments.mesh.edges.size:
            return moments
        self.base = finer[~np.isin(finer, moments.mesh.edges) | np.isin(finer, self.base)]
        return self._moments()

    def _settled(self, solved: Periodic) -> bool:
        """Whether the motion switches where the cells are cut; they are cut anew where it does."""
        moved, cuts = _switching(solved), self.cuts
        settled = moved.size == cuts.size and bool((np.abs(moved - cuts) <= _SAME * self.base[-1]).all())
        self.cuts, self.moves = moved, 0 if settled else self.moves % _MOST_MOVES + 1
        return settled

    def _enough(self, motion: OwnMotion) -> bool:
        """Whether a motion is as good as asked, or no better than before; the best one is kept."""
        doubt = _doubt(motion, self.asked)
        gained = self.best is None or doubt <= 0.9 * self.best[0]
        self.rough += doubt > _ROUGH
        few = motion.cycle.mesh.edges.size < _MANY
        # cells may first have to become as narrow as what they follow
        patient = doubt > _ROUGH and self.rough < _MOST_ROUGH and few
        self.stalls = 0 if gained or patient else self.stalls + 1
        if self.best is None or doubt < self.best[0]:
            self.best = doubt, motion
        rounding = _untold(motion) and motion.run.error <= 0.5 * self.rtol  # which finer cells do not mend
        return doubt <= 0.5 * self.rtol or self.stalls > 1 or rounding

    def _split(self, motion: OwnMotion) -> bool:
        """Halve the cells that need it; False where that cannot help.

        What does not settle may be no more than what the cells leave open, so that they are halved then too.
        """
        doubt = _doubt(motion, self.asked)
        finer = None
        if doubt > 0.5 * self.rtol:
            finer = regime.split(motion.cycle, motion.run.speed_max, self.rtol / doubt)
        if finer is None:
            return False
        self.base = finer[~np.isin(finer, motion.cycle.mesh.edges) | np.isin(finer, self.base)]
        return True

    def _again(self, solved: Periodic) -> Periodic:
        """The motion on the cells as they are now, from the one before; on halved ones where the iteration fails."""
        try:
            moments = self._moments()
            return periodic(moments, self.reference, self.asked, carried(solved, moments))
        except NoRegimeError:
            self.failures += 1
            self.base, self.cuts = piecewise.bisected(self.base, np.ones(self.base.size - 1, dtype=bool)), np.zeros(0)
            return solved


def _by_continuation(
    machine: Chain, reference: float, asked: Asked, inertia: float, unknown: float, rtol: float
) -> OwnMotion:
    """Given flywheels from one heavy enough to hold the speed nearly constant down to the one wanted.

    A sized flywheel lies on the way: it is looked for from motions that vary half as much as asked and more.
    """
    moments = Moments(machine, piecewise.cells(machine.mesh))
    work = piecewise.antiderivative(piecewise.fit(moments.constant(reference, unknown).moment), moments.mesh.half)
    swing = float(np.ptp(piecewise.accumulated(work)))
    own = float(np.abs(moments.inertia).max())
    heavy = max(20.0 * max(swing / reference**2, own, 1e-300), 4.0 * inertia)
    last = _heavy(machine, reference, asked.speed, heavy, unknown)
    step = last.inertia
    for _ in range(_MOST_LIGHTER):
        there = _there(machine, reference, asked, last, rtol)
        if there is not None:
            return there
        before, last = last, _lighter(machine, reference, asked.speed, last, asked.inertia or 0.0, _BOLDER * step)
        step = before.inertia - last.inertia
    raise NoRegimeError("the motions tried with lighter and lighter flywheels stop within the cycle")


def _heavy(machine: Chain, reference: float, speed: float | None, inertia: float, unknown: float) -> OwnMotion:
    """The motion with a flywheel heavy enough to keep the speed where a steep torque neither ends nor saturates."""
    for heavier in _EVER_HEAVIER:
        try:
            asked = Asked(heavier * inertia, None, speed)
            return _Search(machine, reference, asked, _COARSE).from_nothing(heavier * inertia, unknown)
        except NoRegimeError:
            if heavier == _EVER_HEAVIER[-1] or not _switches_at_all(machine):
                raise
    raise AssertionError


def _there(machine: Chain, reference: float, asked: Asked, last: OwnMotion, rtol: float) -> OwnMotion | None:
    """The motion asked for, once that with a heavier flywheel is near enough to find it from; None while it is not."""
    search = _Search(machine, reference, asked, rtol)
    if asked.irregularity is None:
        return search.from_another(last) if last.inertia <= (asked.inertia or 0.0) else None
    if last.run.irregularity >= _NEAR * asked.irregularity:
        try:
            return search.from_another(_slower(machine, reference, asked, last))
        except NoRegimeError:
            if last.run.irregularity >= asked.irregularity:
                raise
    elif last.inertia <= 0.0:
        raise NoRegimeError("even without a flywheel the speed varies less than asked")
    return None


def _slower(machine: Chain, reference: float, asked: Asked, last: OwnMotion) -> OwnMotion:
    """The motion that is nearer to standing still somewhere, by steps each on the cells of the one before."""
    left = 2.0 - (asked.irregularity or 0.0)
    while left < _NEARER * (2.0 - last.run.irregularity):
        wanted = Asked(None, 2.0 - _NEARER * (2.0 - last.run.irregularity), asked.speed)
        last = _Search(machine, reference, wanted, _COARSE).from_another(last)
    return last


def _lighter(
    machine: Chain, reference: float, speed: float | None, last: OwnMotion, target: float, most: float
) -> OwnMotion:
    """The motion with a lighter flywheel, by as large a step towards the target as can be taken, at most `most`."""
    weight = last.inertia - target
    scale = last.inertia + float(last.solved.moments.inertia.max())
    step = min(weight / _HEAVIER if weight > 0.1 * scale else weight, most)
    for _ in range(_MOST_HALVINGS):
        try:
            return _Search(machine, reference, Asked(last.inertia - step, None, speed), _COARSE).from_another(last)
        except NoRegimeError:
            step *= 0.5
        if last.run.irregularity > _STALLING and step < _LITTLE * scale:
            break
    raise NoRegimeError("the motions tried with lighter and lighter flywheels stop within the cycle")


def layered(moments: Moments, speed: float, inertia: float, unknown: float) -> Array:
    """Edges of cells, and cuts, ever closer, towards that end of each at which the speed settles steeply.

    What a jump of torque does to a strongly damped machine is over within 1/|dF/dE| rad after it; where changes grow with
    phi, before it.
    """
    edges = moments.mesh.edges
    if moments.circuit is not None:
        return edges
    rate = moments.rate(np.full(moments.mesh.phi.shape, speed), unknown, inertia)
    pull = rate.by_speed / ((inertia + moments.inertia) * speed)
    cuts = edges.tolist()
    for k, row in enumerate(pull):
        low, high = moments.mesh.edges[k : k + 2].tolist()
        steepest = float(row[np.abs(row).argmax()])
        width = _LAYER / max(abs(steepest), 1e-300)
        while width < 0.5 * (high - low) and np.isfinite(steepest):
            cuts.append(low + width if steepest < 0.0 else high - width)
            width *= 2.0
    return merged(cuts, float(edges[-1])) if len(cuts) > edges.size else edges


def carried(solved: Periodic, moments: Moments) -> State:
    """The states of a motion on another mesh."""
    old, new = solved.moments.mesh, moments.mesh
    series = piecewise.fit(solved.state.nodes)

    def at(phi: Array) -> Array:
        cell, t = piecewise.located(old, phi)
        return np.asarray((series[cell] * piecewise.basis(t, ORDER)[:, None, :]).sum(axis=-1))

    nodes = at(new.phi.ravel()).reshape(*new.phi.shape, -1)
    return solved.state._replace(nodes=np.moveaxis(nodes, -1, 1), edges=at(new.edges))


def _switching(solved: Periodic) -> Array:
    """Angles where the motion makes a law switch, or a mesh change the side that drives, from the mesh's cells."""
    return np.array(sorted(_switches(solved)))


def _switches(solved: Periodic) -> Iterator[float]:
    moments, state = solved.moments, solved.state
    mesh, current = moments.mesh, (state.nodes[:, 1] if moments.circuit is not None else None)
    watched = moments.switches(solved.omega)
    if moments.lossy:
        watched += moments.transmitted(solved.omega, state.unknown, state.inertia, current)
    known = moments.machine.mesh
    for values in watched:
        series = piecewise.fit(values)[None]
        noise = np.full(series.shape[:2], 1e-13 * float(np.abs(values).max(initial=0.0)))
        crossing = piecewise.crossings(series, noise)
        for angle in crossing.angles(mesh).tolist():
            if np.abs(known - angle).min() > 1e-9 * mesh.edges[-1]:
                yield angle


def _described(solved: Periodic, asked: Asked) -> OwnMotion:
    """A solved motion as a cycle with its moment along it, and as a run with its error.

    With a given flywheel what the level is off weighs on the irregularity, the more the nearer the machine comes to a stop;
    a flywheel sought has the irregularity asked for, and hardly changes with the level there.
    """
    moments, state = solved.moments, solved.state
    unknown = state.unknown if moments.machine.scene.unknown is not None else None
    cycle = cycle_of(moments, solved.rate, unknown)
    start = state.inertia + cycle.inertia_at_start
    offset = float(state.edges[0, 0]) + 0.5 * start * (solved.reference**2 - solved.speed**2)
    kept = _kept_work(solved, cycle)
    # energies are closed round the cycle, to their digits
    closing = kept + 2 * ROUNDING * float(np.abs(state.edges[:, 0]).max())
    level = closing / (max(abs(solved.damping), 1e-300) * solved.speed**2 * max(start, 1e-300))
    free = unknown is None and moments.machine.sets_its_speed
    run = _run(solved, cycle, offset, kept)
    varying = 0.5 * run.irregularity * run.error  # what speeds may be off the level
    if free:
        run = run._replace(level=level)
        run = run._replace(error=run.error + 4.0 * (level if asked.inertia is None else run.level_error))
    if unknown is not None and cycle.balance_error:
        pulled = piecewise.integral(np.abs(solved.rate.by_speed) * solved.omega, moments.mesh.half).sum()
        of_speeds = 1.0 + varying * float(pulled) / cycle.errors.work
        run = run._replace(cycle=cycle._replace(balance_error=cycle.balance_error * of_speeds))
    answer = solved.sensitivity
    missed = abs(run.irregularity - (asked.irregularity or run.irregularity))
    doubt = 0.0 if answer is None else answer.by_square * (varying + missed) + answer.by_work * closing
    return OwnMotion(solved, run.cycle or cycle, run, run.level_error + varying if free else 0.0, doubt)


def _kept_work(solved: Periodic, cycle: Cycle) -> float:
    """What the energy keeps (J) of the errors of the cycle's work: where torques fall with the speed, they fade on the way.

    dE' = (dF/dE) dE + r is one-signed, so that errors r of one sign in all cells are the worst that can be.
    """
    moments, errors = solved.moments, cycle.errors
    held = moments.machine.scene.unknown is not None  # then the balance's own error does not fade
    if held or moments.circuit is not None or not errors.work > 0.0:
        return errors.work
    half = moments.mesh.half
    growth = piecewise.integral(solved.rate.by_speed / ((solved.state.inertia + moments.inertia) * solved.omega), half)
    rounding = errors.work - float(errors.by_cell[0].sum())
    made = errors.by_cell[0] + rounding * piecewise.integral(solved.rate.exchanged, half) / max(cycle.exchanged, 1e-300)
    fades = np.minimum(growth, -1e-9)
    made = made * np.where(growth > fades, 1.0, np.expm1(fades) / fades)  # spread evenly over its cell
    kept = most = 0.0
    for left, added in [*zip(np.exp(np.minimum(growth, 1.0)).tolist(), made.tolist(), strict=True)] * 2:
        kept = min(kept * left + added, errors.work)
        most = max(most, kept)
    return most


def _run(solved: Periodic, cycle: Cycle, offset: float, kept: float) -> Run:
    """The same figures as for moments that depend on angle alone; `kept` is the error of the energy (J)."""
    mesh, extremes = solved.moments.mesh, solved.extremes
    inside = mesh.middle[extremes.cell, 0] + mesh.half[extremes.cell, 0] * extremes.t
    edge = mesh.edges[extremes.cell + (extremes.t > 0.0)]
    angles = np.where(np.abs(extremes.t) < 1.0, inside, edge)
    speed, eps = solved.speed, solved.irregularity
    currents = solved.state.nodes[:, 1] if solved.moments.circuit is not None else None
    least = float(solved.state.inertia + solved.moments.inertia.min())
    swing = 2 * (2 * kept + speed**2 * cycle.errors.variation) / speed**2 / least
    swing += 2 * eps * (cycle.errors.inertia / least + 4 * ROUNDING)
    return Run(
        inertia=solved.state.inertia,
        irregularity=eps,
        speed_max=solved.reference * (1.0 + float(extremes.excess[0])),
        speed_min=solved.reference * (1.0 + float(extremes.excess[1])),
        angle_speed_max=float(angles[0]),
        angle_speed_min=float(angles[1]),
        offset=offset,
        error=swing / eps if eps > 0.0 else 0.0,
        cycle=cycle,
        speed=speed,
        drive=solved.moments.drive(solved.omega, solved.state.unknown, currents),
        current=None if currents is None else float(solved.state.edges[0, 1]),
    )


def doubt_of_cuts(motion: OwnMotion) -> float:
    """Error (rad) of the angles of extreme speed that stand where cells are cut by the motion itself."""
    moments, run = motion.solved.moments, motion.run
    found, known = np.array([run.angle_speed_max, run.angle_speed_min]), moments.machine.mesh
    cut = np.isin(found, moments.mesh.edges) & (np.abs(found[:, None] - known).min(axis=1) > 1e-9 * known[-1])
    return _SAME * float(known[-1]) if cut.any() else 0.0


def _doubtful(motion: OwnMotion, before: Periodic) -> OwnMotion:
    """A motion whose switches have not come to rest, with ten times what their last move changed added to its error."""
    solved = motion.solved
    moved = abs(solved.irregularity - before.irregularity) / max(solved.irregularity, 1e-300)
    moved += abs(solved.speed - before.speed) / solved.speed
    total = solved.state.inertia + float(solved.moments.inertia.max())
    heavier = abs(solved.state.inertia - before.state.inertia)
    moved += heavier / max(total, 1e-300)
    return motion._replace(
        run=motion.run._replace(error=motion.run.error + 10 * moved), inertia_doubt=motion.inertia_doubt + 10 * heavier
    )


def _doubt(motion: OwnMotion, asked: Asked) -> float:
    """The largest relative error among the figures asked for."""
    sized = motion.inertia_error if asked.inertia is None else 0.0
    return max(motion.run.error, sized, motion.cycle.errors.work / max(motion.cycle.exchanged, 1e-300))


def along(motion: OwnMotion, edges: Array) -> Cycle:
    """The cycle of a motion on other cells, between which its own edges must be."""
    solved = motion.solved
    moments = Moments(solved.moments.machine, piecewise.cells(edges))
    state = carried(solved, moments)
    speed = steady.speed_over_cycle(motion.cycle, motion.speed, motion.run, moments.mesh.phi.ravel()).reshape(
        moments.mesh.phi.shape
    )
    current = state.nodes[:, 1] if moments.circuit is not None else None
    rate = moments.rate(speed, state.unknown, state.inertia, current)
    return cycle_of(moments, rate, motion.cycle.balance)
