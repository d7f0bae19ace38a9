"""Steady periodic motion of a machine whose torques depend on speed: on cells fine enough for the required error.

Cells are halved until the estimates are within the tolerance, and cut where laws switch at a speed or a mesh changes its
driving side: the motion itself gives these angles, so cutting and solving alternate (`_RegimeSearch.refinement`). Along the
motion, the moment is a function of angle, as in machines without torques that depend on speed.

Source: U. M. Ascher, R. M. M. Mattheij, R. D. Russell, Numerical Solution of Boundary Value Problems, SIAM 1995.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from flywheel.machine.equation import Moments, moments_on
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.budget import BudgetError, portion
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.regime import turning_moment
from flywheel.regime.cycle_equations import (
    CLOSE,
    Demand,
    LostError,
    NoRegimeError,
    Periodic,
    State,
    UnresolvedError,
    about,
    balanced_guess,
    carried,
    even_guess,
    even_motion,
    exponents,
    first_guess,
    periodic,
    sampled,
    speeds,
    unevenness,
    with_inertia,
)
from flywheel.regime.turning_moment import Cycle, CycleErrors, Run, cycle_of, spread_of_closing, work_error

UNSTABLE = 1e-12
"""1 less the multiplier of a cycle: below its negative a change grows from cycle to cycle beyond rounding."""

STIFF = 3e3
"""Exponent of the decay of a change of speed in a cycle, above which torques are stiff."""

_DAMPED = 70.0  # exponent of that decay above which the motion is far from that under torques at a constant speed
_STEADIED, _WELL_WITHIN = 8.0, 0.7  # that exponent, and a share of an irregularity: where torques alone probably keep it

MOST_WORK = 450_000
"""Nodes of Newton steps that the search for one motion may take, about a second: fifty times what a textbook's takes."""

_ROUNDS = 120
_MOST_MOVES = 8  # of the switches, before the cells are halved although the switches have not settled
_FEW_MOVES = 3  # of the switches, after which those that come and go are compared by their work with the error allowed
_MOST_FAILURES = 3  # of the iteration on changed cells, before the best motion so far is taken
_SWITCH_MOVE = 1e-12  # of the cycle: switches that move less have settled
_FAR = 1e-3  # rad: switches that move farther will move again, so that their motion only leads to another
_COARSE_ERROR = 1e-3  # error of a motion that is hardly resolved yet
_ROUNDING_IRREGULARITY = 1e-9  # irregularity of a motion in which only rounding varies
_HARDLY = 0.1  # of J + I*: greatest error of a sized flywheel
_UNLIKE = 8.0  # greatest ratio of a slope to a difference
_MOST_ERROR = 0.5  # relative error above which a motion is meaningless
_SMALL_IRREGULARITY = 1e-6  # irregularity up to which a sized motion is not solved for again
_DIRECT_SHARE = 0.5  # of the required irregularity: above it the flywheel is sought directly
_INTERMEDIATE_ERROR = 1e-4  # error of intermediate motions
_FARTHEST = 2.0  # of the distance of two motions: greatest distance of one that begins on their secant
_LAYER = 8.0  # exponent of the decay of a jump's effect in the first cell behind it
_PER_CELL, _MOST_SWINGING = 3.0, 64  # radians of a swing in a cell, initially; greatest number of such cells
_HEAVIER, _BOLDER = 2.0, 3.0  # from one flywheel to the next on the way to a light one; than the step before
_EVER_HEAVIER = (1.0, 30.0, 1e3, 3e4)  # flywheels from which lighter ones are found, where the one before fails
_MOST_LIGHTER, _LITTLE = 60, 3e-3  # flywheels on that way; share of the inertia below which a step is not halved
_SHARE_OF_WORK = 0.4  # of the rest of a search's budget: share of one method before the next is tried
_WEIGHTLESS = 1e-13  # of the greatest inertia: rounding where the inertia is zero
_VANISHING = 1e-4  # of the greatest inertia: a flywheel that represents none
_LEAST_SHARE = 1e-3  # of what makes a motion uneven: a step that is not halved
_NEARER = 0.3  # of the distance of an irregularity from 2: step from one motion to the next


class OwnMotion(NamedTuple):
    """A steady motion: as solved, its moment along the cycle (`cycle`), and as a `Run` at its own mean of extremes."""

    solved: Periodic
    cycle: Cycle
    run: Run
    level_error: float  # of the speed's mean, relative
    inertia_bound: float = 0.0  # kg m² that a sized flywheel may be off
    cuts_error: float = 0.0  # rad by which laws may switch, or meshes reverse, elsewhere than cells are cut
    vanishing: bool = False  # its flywheel stands for none: it is the limit of ever lighter ones
    base: Array | None = None  # edges of its cells (rad) but for those at which it switches laws itself
    cuts: Array | None = None  # angles (rad) at which it does

    @property
    def speed(self) -> float:
        """Mean of the greatest and least speed (rad/s)."""
        return float(self.solved.speed)

    @property
    def inertia(self) -> float:
        """The flywheel's, on the crank (kg m²)."""
        return 0.0 if self.vanishing else self.solved.state.inertia

    @property
    def inertia_error(self) -> float:
        """Error of a sized inertia, relative to the larger of itself and the fluctuation of work over eps w²."""
        scale = float(np.ptp(self.cycle.start[0])) / max(self.solved.irregularity * self.speed**2, 1e-300)
        return float(self.inertia_bound / max(self.inertia, scale, 1e-300))

    @property
    def hardly_sized(self) -> bool:
        """Tests whether the irregularity determines the sized flywheel only weakly."""
        return self.inertia_bound > _HARDLY * (self.inertia + float(self.solved.moments.inertia.max()))


def own_motion(
    machine: Machine,
    reference: float,
    demand: Demand,
    guess: float,
    unknown: float,
    rtol: float,
    *,
    directly: bool = False,
    near: OwnMotion | None = None,
    beyond: OwnMotion | None = None,
) -> OwnMotion:
    """The steady motion with a given flywheel, or with the one for an irregularity, at an error within rtol.

    Args:
        machine: the machine.
        reference: speed (rad/s) near that of the motion; the required one if there is one.
        demand: requirements of the motion.
        guess: initial inertia of a flywheel to be sized, kg m² on the crank.
        unknown: a first guess of the scene's unknown.
        rtol: relative error allowed in the irregularity, and in the inertia where it is sized.
        directly: true to try only methods without intermediate motions.
        near: a motion from which alone it is searched for.
        beyond: another motion, with which that one gives a secant to begin with.

    Raises:
        NoRegimeError: if there is no such motion, or none that can be resolved.

    A sized flywheel is checked by its motion: with half as much again where torques damp a change of speed so fast that its
    sensitivity may be rounding, and with itself where laws switch along the motion.

    """
    search = _RegimeSearch(machine, reference, demand, rtol)
    if near is None and demand.inertia is None and (even := search.with_flywheel(0.0).even(0.0, unknown)) is not None:
        return even
    if demand.inertia == 0.0 and search.weightless():
        return search.vanishing(unknown)
    inertia = guess if demand.inertia is None else demand.inertia
    motion = search.motion(inertia, unknown, directly=directly) if near is None else search.from_another(near, beyond)
    motion = _checked(motion)
    if demand.inertia is not None or motion.inertia <= 0.0:
        return motion
    solved, inertia = motion.solved, motion.inertia
    fading = solved.rate.by_speed / ((inertia + solved.moments.inertia) * solved.omega)
    if solved.sensitivity and float(np.abs(cells.integral(fading, solved.moments.mesh.half)).sum()) > STIFF:
        heavier = search.with_flywheel(1.5 * inertia).motion(1.5 * inertia, solved.state.unknown)
        expected = inertia / max(solved.sensitivity.by_square, 1e-300)  # 0.5 J of it; the slope of eps is twice that of s
        if not _UNLIKE * expected > abs(heavier.run.irregularity - solved.irregularity) > expected / _UNLIKE:
            raise _open_flywheel(motion)
    # at least irregularities even a motion depends on its switches no more than on rounding
    if motion.run.irregularity > _SMALL_IRREGULARITY and search.switches():
        again = _checked(search.with_flywheel(inertia).from_another(motion)) if motion.run.error <= _COARSE_ERROR else None
        off = np.inf if again is None else abs(again.run.irregularity / (demand.irregularity or 1.0) - 1.0)
        if again is None or not off <= 10 * (again.run.error + motion.run.error) + _SWITCH_MOVE:
            raise NoRegimeError("the motion with the flywheel found for it has another irregularity")
    return motion


class Damping(NamedTuple):
    """How torques that fall with the speed act on a motion with a flywheel, at a constant speed.

    `exponent` is that of the decay of a change of speed in a cycle; `balanced` the irregularity, to first order, of the
    speeds at which the torques balance at every angle, infinite where they do not fall with the speed.
    """

    exponent: float
    balanced: float

    @property
    def strong(self) -> bool:
        """Tests whether a change of speed decays so fast that the motion is far from that at a constant speed."""
        return _DAMPED < self.exponent <= STIFF

    def keeps(self, irregularity: float) -> bool:
        """Tests whether an irregularity is probably kept without the flywheel."""
        return self.exponent > _STEADIED and self.balanced <= _WELL_WITHIN * irregularity


def damping(machine: Machine, reference: float, inertia: float, unknown: float) -> Damping:
    """The damping of motions with a flywheel (kg m² on the crank) near a reference speed (rad/s)."""
    return _RegimeSearch(machine, reference, Demand(inertia, None, None), 1.0).damping(inertia, unknown)


def own_motion_near(
    machine: Machine,
    other: OwnMotion,
    inertia: float,
    speed: float | None,
    rtol: float,
    *,
    beyond: OwnMotion | None = None,
    intermediate: bool = False,
) -> OwnMotion:
    """The steady motion with a given flywheel (kg m² on the crank), from one with a similar flywheel.

    Args:
        machine: the machine.
        other: the motion to begin with.
        inertia: of the flywheel.
        speed: mean of extremes (rad/s) that a balance holds; None if the machine sets its own.
        rtol: relative error allowed in the irregularity.
        beyond: another motion, with which that one gives a secant to begin with.
        intermediate: true if others are found from it.

    Raises:
        NoRegimeError: if there is no such motion, or it is too far away.

    """
    search = _RegimeSearch(machine, other.solved.reference, Demand(inertia, None, speed), rtol, intermediate)
    if inertia == 0.0 and search.weightless():
        return search.vanishing(other.solved.state.unknown, other)
    even = search.even(inertia, other.solved.state.unknown) if other.run.irregularity <= _ROUNDING_IRREGULARITY else None
    return even or _checked(search.from_another(other, beyond))


def own_motion_again(machine: Machine, solved: Periodic, demand: Demand, rtol: float) -> OwnMotion:
    """A steady motion that only leads to others, from one that was solved on cells which may end where its laws switch.

    Raises:
        NoRegimeError: if its error is not within rtol, and finer cells do not mend it.

    """
    base, edges = machine.mesh, solved.moments.mesh.edges
    search = _RegimeSearch(machine, solved.reference, demand, rtol, intermediate=True)
    return _checked(search.refinement(solved, base, edges[~np.isin(edges, base)]))


def own_motion_along(machine: Machine, demand: Demand, phi: Array, omega: Array, own: Array, rtol: float) -> OwnMotion:
    """The steady motion with a given flywheel, from one that has nearly settled.

    Args:
        machine: the machine.
        demand: requirements of the motion.
        phi: ascending crank angles (rad) over a cycle.
        omega: crank speeds (rad/s) there.
        own: a motor's own states there, (states, angles).
        rtol: relative error allowed in the irregularity.

    Raises:
        NoRegimeError: if there is no such motion, or it is too far away.

    """
    reference, inertia = 0.5 * float(omega.max() + omega.min()), demand.inertia or 0.0
    search = _RegimeSearch(machine, reference, demand, rtol)
    start = partial(sampled, reference=reference, inertia=inertia, phi=phi, omega=omega, own=own)
    return _checked(search.from_start(start, search.narrow(inertia, 0.0), inertia, 0.0))


def _checked(motion: OwnMotion) -> OwnMotion:
    """The motion, whose errors include the effect of the speed's last digits on a stiff torque; refused if too large.

    F has an error of |dF/domega| omega u where the speed is extreme, and the energy the integral of that from the cell's
    beginning. No choice of cells reduces that: it is added to the errors after the search for cells.
    """
    run = motion.run
    # what may as well have an irregularity of 2 may as well stop
    if not (run.speed_min > 0.0 and run.irregularity * (1.0 + run.error) < 2.0):
        raise NoRegimeError("rounding leaves open whether the motion stops within the cycle")
    if motion.hardly_sized:
        raise _open_flywheel(motion)
    if not run.error <= _MOST_ERROR and run.irregularity > _ROUNDING_IRREGULARITY:
        work = f"work of {motion.cycle.exchanged:.3g} J in a cycle"
        raise LostError(f"an irregularity of about {run.irregularity:.2g}, lost in the rounding of {work}")
    if not run.irregularity > 0.0:
        return motion
    off, bound = errors_by_stiffness(motion.solved)
    level = 0.5 * run.irregularity * float(off) if motion.level_error > 0.0 else 0.0
    return motion._replace(
        run=run._replace(error=run.error + float(off)),
        level_error=motion.level_error + level,
        inertia_bound=motion.inertia_bound + float(bound),
    )


def _open_flywheel(motion: OwnMotion) -> UnresolvedError:
    """The error of a flywheel that its irregularity does not determine."""
    what = f"the effect of about {motion.inertia:.2g} kg m² on the crank is lost in rounding"
    return UnresolvedError(f"an irregularity almost independent of the flywheel: {what}")


class _RegimeSearch(NamedTuple):
    """A machine, a speed near that of its motion, its requirements, and the error allowed.

    `intermediate` is true for a motion from which others are found; it is solved no more closely than that requires.
    """

    machine: Machine
    reference: float
    demand: Demand
    rtol: float
    intermediate: bool = False

    def with_flywheel(self, inertia: float) -> _RegimeSearch:
        """The search for the motion with a given flywheel."""
        return self._replace(demand=Demand(inertia, None, self.demand.speed))

    def moments(self, base: Array, cuts: Array, *, local: bool = False) -> Moments:
        """The machine on cells between edges, cut where the motion switches."""
        edges = cells.merged([*base.tolist(), *cuts.tolist()], float(base[-1]))
        return moments_on(self.machine, edges, local=local)

    def switches(self) -> bool:
        """Tests whether a law switches at a speed, or a mesh has losses, so that cells are cut by the motion itself."""
        moments = self.moments(self.machine.mesh, np.zeros(0), local=True)
        return moments.lossy or bool(moments.switches(np.full(moments.mesh.phi.shape, self.machine.typical_speed)))

    def weightless(self) -> bool:
        """Tests whether the machine without a flywheel lacks inertia at some angle: all masses rest at a dead centre."""
        least, greatest = cells.extents(cells.fit(self.moments(self.machine.mesh, np.zeros(0), local=True).inertia))
        return float(least.min()) <= _WEIGHTLESS * float(greatest.max())

    def vanishing(self, unknown: float, other: OwnMotion | None = None) -> OwnMotion:
        """The limit of decreasing flywheels, by a very light one; its error includes the change by one half heavier.

        Without inertia no torque determines the speed of the crank: there the limit is the speed at which they balance.
        """
        moments = self.moments(self.machine.mesh, np.zeros(0), local=True)
        light = _VANISHING * float(moments.inertia.max())
        if light <= 0.0:
            raise NoRegimeError("nothing stores energy")
        search = self.with_flywheel(light)
        motion = _checked(search.motion(light, unknown) if other is None else search.from_another(other))
        beside = _checked(self.with_flywheel(1.5 * light).from_another(motion))
        off = 2.0 * abs(beside.run.irregularity - motion.run.irregularity) / max(motion.run.irregularity, 1e-300)
        level = 2.0 * abs(beside.speed / motion.speed - 1.0)
        run = motion.run._replace(error=motion.run.error + off)
        return motion._replace(run=run, level_error=motion.level_error + level, vanishing=True)

    def motion(self, inertia: float, unknown: float, *, directly: bool = False) -> OwnMotion:
        """The stable motion, by the first method that gives one; else an unstable one.

        The methods: directly, from an even motion that becomes uneven, from the speeds at which stiff torques balance, and
        from heavier flywheels down, which comes first where torques damp the motion.
        """
        if self.demand.inertia is not None and (even := self.even(inertia, unknown)) is not None:
            return even
        unstable: OwnMotion | None = None
        failure: NoRegimeError | BudgetError | None = None
        ways = [self.from_nothing, self.from_balance, self.from_even, self.by_continuation]
        fading = self.damping(inertia, unknown).exponent
        if fading > STIFF:
            ways[:2] = ways[1::-1]
        elif fading > _DAMPED:
            ways = [self.by_continuation, self.from_nothing, self.from_balance]
            ways = ways if self.demand.inertia is None else [self.from_balance, *ways[:2], self.from_even]
        for way in ways[:2] if directly else ways:
            try:
                with portion(_SHARE_OF_WORK if way != ways[-1] else 1.0):
                    motion = way(inertia, unknown)
            except (NoRegimeError, BudgetError) as error:
                failure = error if failure is None or way == self.by_continuation else failure
                continue
            if self.machine.scene.unknown is not None or motion.solved.damping >= -UNSTABLE:
                return motion
            unstable = motion if unstable is None else unstable
        if unstable is not None:
            return unstable
        assert failure is not None
        raise failure

    def damping(self, inertia: float, unknown: float) -> Damping:
        """The damping at the reference speed."""
        moments = self.moments(self.machine.mesh, np.zeros(0), local=True)
        omega = np.full(moments.mesh.phi.shape, self.reference)
        rate = moments.rate(omega, unknown, inertia, self.own_states(moments))
        slope, total = np.maximum(-rate.by_speed, 0.0), np.maximum((inertia + moments.inertia) * self.reference, 1e-300)
        exponent = float(cells.integral(slope / total, moments.mesh.half).sum())
        return Damping(exponent, float(np.ptp(rate.moment / np.maximum(slope, 1e-300))) / self.reference)

    def even(self, inertia: float, unknown: float) -> OwnMotion | None:
        """The motion at a constant speed, in closed form, if nothing varies it; else None."""
        moments = self.moments(self.machine.mesh, np.zeros(0), local=True)
        solved = even_motion(moments, self.reference, self.demand, inertia, unknown)
        return None if solved is None else _described(solved, self.demand)

    def from_nothing(self, inertia: float, unknown: float) -> OwnMotion:
        """The motion from that under torques at a constant speed; with states of a motor, from a constant speed."""
        own = self.own_states(self.moments(self.machine.mesh, np.zeros(0)))
        start = partial(
            even_guess if own else first_guess, reference=self.reference, inertia=inertia, unknown=unknown, own=own
        )
        return self.from_start(start, self.machine.mesh, inertia, unknown)

    def from_balance(self, inertia: float, unknown: float) -> OwnMotion:
        """The motion from the speeds at which the torques balance at each angle."""

        def start(moments: Moments) -> State:
            guess = None if moments.circuit is not None else balanced_guess(moments, self.reference, inertia, unknown)
            if guess is None:
                raise NoRegimeError("at some angle its torques balance at no speed")
            return guess

        return self.from_start(start, self.machine.mesh, inertia, unknown)

    def from_even(self, inertia: float, unknown: float) -> OwnMotion:
        """The motion from the one at constant speed, as the varying moment is increased from a small part to the whole."""
        if self.demand.inertia is None:
            raise NoRegimeError("the irregularity of a constant speed is 0")

        def start(moments: Moments) -> State:
            state = even_guess(moments, self.reference, inertia, unknown, self.own_states(moments))
            uneven = unevenness(moments, self.reference, state)
            share, step = 0.0, 0.5
            while share < 1.0:
                try:
                    after = min(share + step, 1.0)
                    solved = periodic(moments, self.reference, self.demand, state, (1.0 - after) * uneven)
                    if self.machine.scene.unknown is None and solved.damping < -UNSTABLE:
                        raise NoRegimeError("the motion that grows from an even one is unstable")
                    state, share, step = about(solved, self.reference), after, 2.0 * step
                except NoRegimeError:
                    step *= 0.5
                    if step < _LEAST_SHARE:
                        raise
            return state

        return self.from_start(start, self.narrow(inertia, unknown), inertia, unknown)

    def own_states(self, moments: Moments) -> list[float]:
        """A motor's own states in equilibrium at the reference speed."""
        return [float(value) for value in moments.steady_states(self.reference)]

    def from_start(self, start: Callable[[Moments], State], base: Array, inertia: float, unknown: float) -> OwnMotion:
        """The motion from a first guess with a flywheel, on cells between edges that narrow where the speed settles steeply.

        Where meshes lose or laws switch, branches are first decided at every node, and cells cut where they then switch; if
        that fails, in the middle of every cell.
        """
        own = self.moments(self.machine.mesh, np.zeros(0))
        if own.lossy or own.switches(np.full(own.mesh.phi.shape, self.reference)):
            with suppress(NoRegimeError):
                rough = self.periodic(own.locally, self.reference, start(own.locally), intermediate=True)
                switches, _ = _switching(rough)
                moments = self.moments(self.machine.mesh, switches)
                again = self.periodic(moments, rough.reference, carried(rough, moments), intermediate=True)
                return self.refinement(again, self.machine.mesh, switches)
        if (moments := self.moments(base, cuts := np.zeros(0))).circuit is None:
            rate = moments.rate(np.full(moments.mesh.phi.shape, self.reference), unknown, inertia)
            base = _layered(base, moments.mesh, rate.by_speed / ((inertia + moments.inertia) * self.reference))
            moments = self.moments(base, cuts)
        solved = self.periodic(moments, self.reference, start(moments), intermediate=moments.lossy)
        return self.refinement(solved, base, cuts)

    def periodic(self, moments: Moments, reference: float, start: State, *, intermediate: bool) -> Periodic:
        """The motion on given cells; an intermediate one only as closely as the next requires."""
        within = CLOSE if intermediate or self.intermediate else 0.0
        return periodic(moments, reference, self.demand, start, within=within, rough=intermediate and not self.intermediate)

    def to_others(self) -> _RegimeSearch:
        """The search for an intermediate motion."""
        return self._replace(rtol=_INTERMEDIATE_ERROR, intermediate=True)

    def from_another(self, other: OwnMotion, beyond: OwnMotion | None = None) -> OwnMotion:
        """The motion from that with another flywheel, first along the secant to a third."""
        share = None if beyond is None else self.share(other, beyond)
        if beyond is not None and share is not None:
            with suppress(NoRegimeError):
                return self.from_secant(other, beyond, share)
        return self.from_secant(other, other, 0.0)

    def share(self, other: OwnMotion, beyond: OwnMotion) -> float | None:
        """The place of the motion from one (0) to another (1), by the inertia or the irregularity; None if far off."""
        wanted, *ends = self.demand.irregularity, other.run.irregularity, beyond.run.irregularity
        if self.demand.inertia is not None:
            own = float(other.solved.moments.inertia.max())
            wanted, *ends = (each + own for each in (self.demand.inertia, other.inertia, beyond.inertia))
        if min(wanted, *ends) <= 0.0 or ends[0] == ends[1]:
            return None
        share = float(np.log(wanted / ends[0]) / np.log(ends[1] / ends[0]))
        return share if abs(share) <= _FARTHEST else None

    def from_secant(self, other: OwnMotion, beyond: OwnMotion, share: float) -> OwnMotion:
        """The motion from a share of the way from one with another flywheel to a third."""
        cuts, ahead = (_switching(each.solved)[0] if each.cuts is None else each.cuts for each in (other, beyond))
        base, last = self.machine.mesh if other.base is None else other.base, other.solved
        if share and ahead.size == cuts.size:
            moved = cuts + share * (ahead - cuts)
            cuts = moved if (base.searchsorted(moved) == base.searchsorted(cuts)).all() else cuts
        if last.moments.circuit is None:
            fading = last.rate.by_speed / ((last.state.inertia + last.moments.inertia) * last.omega)
            base = _layered(base, last.moments.mesh, fading)
        start, reference = carried(last, moments := self.moments(base, cuts)), last.reference
        if share:
            state = about(beyond.solved, reference)
            own, further = float(moments.inertia.max()), carried(beyond.solved._replace(state=state), moments)
            inertia = (start.inertia + own) * ((further.inertia + own) / (start.inertia + own)) ** share - own
            start = State(
                start.nodes + share * (further.nodes - start.nodes),
                start.edges + share * (further.edges - start.edges),
                max(inertia, 0.0) if self.demand.inertia is None else self.demand.inertia,
                start.unknown + share * (further.unknown - start.unknown),
            )
        elif self.demand.inertia is not None:
            start = with_inertia(start, moments, reference, self.demand.inertia)
        intermediate = cuts.size > 0 and other.inertia != self.demand.inertia
        return self.refinement(self.periodic(moments, reference, start, intermediate=intermediate), base, cuts)

    def narrow(self, inertia: float, unknown: float) -> Array:
        """Edges of cells as narrow as the swings of a motor's own states need; the machine's own without such states."""
        base = self.machine.mesh
        moments = self.moments(base, np.zeros(0))
        if moments.circuit is None or not inertia + float(moments.inertia.min()) > 0.0:
            return base
        swing = float(np.abs(exponents(moments, self.reference, [inertia], unknown).imag).max())
        width = max(_PER_CELL / max(swing, 1e-300), base[-1] / _MOST_SWINGING)
        pieces = [np.linspace(a, b, int(np.ceil((b - a) / width)), endpoint=False) for a, b in pairwise(base.tolist())]
        return np.array([*np.concatenate(pieces), base[-1]])

    def refinement(self, solved: Periodic, base: Array, cuts: Array) -> OwnMotion:
        """The motion at an error within rtol, or the best possible, from one on cells between edges and cuts.

        Cells are cut again until the switches no longer move, and then halved; moves of switches may be due to
        the cells, so that they are halved then too. If the iteration fails, all are halved.
        """
        best: OwnMotion | None = None
        least, allowed, close, furthest = np.inf, 0.5 * self.rtol, _SWITCH_MOVE * float(base[-1]), np.inf
        stalls = moves = failures = 0
        for _ in range(_ROUNDS):
            angles, slack = _switching(solved)
            moved = np.abs(angles - cuts) if angles.size == cuts.size else np.array([np.inf])
            nearer, furthest = float(moved.max(initial=0.0)) <= 0.5 * furthest, float(moved.max(initial=0.0))
            within = close if nearer and not self.intermediate else np.maximum(slack, close)
            settled = np.isfinite(furthest) and bool((moved <= within).all()) and (self.intermediate or not solved.left)
            moves = 0 if settled else moves % _MOST_MOVES + 1
            before, cuts = cuts, angles
            # those that come and go, or come no nearer, may have to be taken as they are
            restless = moves >= _FEW_MOVES and not (nearer and np.isfinite(furthest))
            motion = _described(solved, self.demand) if settled or restless or moves == _MOST_MOVES else None
            if motion is not None:
                motion = motion._replace(cuts_error=max(close, 2 * furthest) if np.isfinite(furthest) else close)
            if motion is not None and settled:
                motion = _with_work_error(motion, _work_of_jumps(solved, before, 2 * moved)) if furthest else motion
            elif motion is not None:  # their work on the wrong branch is an error
                wrong = self.work_of_cuts(solved, base, np.concatenate((before, angles)))
                counted = _with_work_error(motion, wrong)
                settled = self.error(counted) <= allowed  # else finer cells, which may mend that
                motion = counted if settled else motion
            error = np.inf if motion is None else self.error(motion)
            if motion is not None and (settled or moves == _MOST_MOVES or error > allowed):
                moves, finer, edges = 0, None, motion.cycle.mesh.edges
                if settled:
                    stalls = 0 if best is None or error <= 0.9 * least else stalls + 1
                    if best is None or error < least:
                        best, least = motion._replace(base=base, cuts=angles), error
                    if error <= allowed or stalls > 1:
                        break
                if error > allowed:
                    coarse = turning_moment.coarse(motion.cycle, motion.run.speed_max)
                    finer = cells.halved(edges, coarse(allowed / error))
                if finer is None and settled:
                    break
                base = base if finer is None else _without(finer, edges, base)
            try:
                moments = self.moments(base, cuts)
                start = carried(solved, moments)
                solved = self.periodic(moments, solved.reference, start, intermediate=not settled and furthest > _FAR)
            except BudgetError:
                if best is None or least > _COARSE_ERROR:
                    raise
                return best  # what it lacks of the required error is in its own
            except NoRegimeError:
                failures += 1
                base, cuts = cells.bisected(base, np.ones(base.size - 1, dtype=bool)), np.zeros(0)
                if failures > _MOST_FAILURES:
                    break
        if failures and (best is None or least > _COARSE_ERROR):
            raise NoRegimeError("on finer cells the iteration does not converge")
        if best is None:
            raise NoRegimeError("the angles at which its laws switch do not settle")
        return best

    def error(self, motion: OwnMotion) -> float:
        """The largest of the relative errors of a motion that cells must bring within rtol."""
        sized = motion.inertia_error if self.demand.inertia is None else 0.0
        return float(max(motion.run.error, sized, work_error(motion.cycle)))

    def work_of_cuts(self, solved: Periodic, base: Array, cuts: Array) -> float:
        """Bound of the error of work (J) of a motion whose laws switch at other angles than those of its cells.

        Between the two its moment is that of the wrong branch: the integral of the difference at the motion's speed.
        """
        moments = self.moments(base, cuts)
        state, reference = carried(solved, moments), solved.reference
        omega = speeds(state, moments, reference)
        if omega is None:
            return np.inf
        true = moments.locally.rate(omega, state.unknown, state.inertia, state.of_circuit).moment
        cell, t = cells.located(solved.moments.mesh, moments.mesh.phi.ravel())
        taken = cells.value(cells.fit(solved.rate.moment)[cell], t).reshape(omega.shape)
        return float(cells.integral(np.abs(true - taken), moments.mesh.half).sum())

    def lighter_motion(self, inertia: float, unknown: float, other: OwnMotion | None = None) -> OwnMotion:
        """An intermediate motion with a flywheel heavier than the required one; kept for the next search."""
        kept = self.machine.kept.setdefault("lighter_motions", {})
        key = self.reference, self.demand.speed, unknown, inertia
        if key not in kept:
            search = self.with_flywheel(inertia).to_others()
            kept[key] = search.from_nothing(inertia, unknown) if other is None else search.from_another(other)
        motion: OwnMotion = kept[key]
        return motion

    def by_continuation(self, inertia: float, unknown: float) -> OwnMotion:
        """The motion by a series of flywheels from one heavy enough for a nearly constant speed to the required one.

        Each step is as large as possible. A sized flywheel lies between: it is searched for from motions with at least half
        the required irregularity; an irregularity near 2 by steps towards it, each on the cells of the previous one.
        """
        eps, target = self.demand.irregularity, self.demand.inertia or 0.0
        moments = self.moments(self.machine.mesh, np.zeros(0))
        work = cells.antiderivative(cells.fit(moments.constant(self.reference, unknown).moment), moments.mesh.half)
        fluctuation, own = float(np.ptp(cells.accumulated(work))), float(np.abs(moments.inertia).max())
        heavy = max(20.0 * max(fluctuation / self.reference**2, own, 1e-300), 4.0 * inertia)
        for heavier in _EVER_HEAVIER:  # enough to keep the speed where a steep torque neither ends nor saturates
            try:
                last = self.lighter_motion(heavier * heavy, unknown)
                break
            except NoRegimeError:
                if heavier == _EVER_HEAVIER[-1] or not self.switches():
                    raise
        stops = NoRegimeError("the motions tried with lighter and lighter flywheels stop within the cycle")
        before, before_last = last.inertia, None
        for _ in range(_MOST_LIGHTER):
            if eps is None and last.inertia <= target:
                return self.from_another(last)
            if eps is not None and last.run.irregularity >= _DIRECT_SHARE * eps:
                near = last
                try:
                    while 2.0 - eps < _NEARER * (2.0 - near.run.irregularity):
                        nearer = Demand(None, 2.0 - _NEARER * (2.0 - near.run.irregularity), self.demand.speed)
                        near = self._replace(demand=nearer).to_others().from_another(near)
                    return self.from_another(near, before_last)
                except NoRegimeError:
                    if last.run.irregularity >= eps:
                        raise
            if eps is not None and last.inertia <= 0.0:
                raise NoRegimeError("even without a flywheel the speed varies less than required")
            weight, scale = last.inertia - target, last.inertia + float(last.solved.moments.inertia.max())
            step = min(weight / _HEAVIER if weight > 0.1 * scale else weight, _BOLDER * before)
            while True:
                try:
                    lighter = self.lighter_motion(last.inertia - step, unknown, last)
                    break
                except NoRegimeError:
                    step *= 0.5
                if step < _LITTLE * scale:
                    raise stops
            before, before_last, last = last.inertia - lighter.inertia, last, lighter
        raise stops


def _layered(base: Array, mesh: cells.Cells, fading: Array) -> Array:
    """Edges with others that concentrate at an end of each cell of a mesh where the speed settles steeply, by dF/dE there.

    The effect of a jump of torque on a strongly damped machine is over within 1/|dF/dE| rad after it; if changes grow
    with phi, before it.
    """
    edges, layers = mesh.edges, list[float]()
    for k, row in enumerate(fading):
        low, high = edges[k : k + 2].tolist()
        steepest = float(row[np.abs(row).argmax()])
        width = _LAYER / max(abs(steepest), 1e-300)
        while width < 0.5 * (high - low) and np.isfinite(steepest):
            layers.append(low + width if steepest < 0.0 else high - width)
            width *= 2.0
    return _without(cells.merged([*edges, *layers], float(edges[-1])), edges, base) if layers else base


def _without(finer: Array, edges: Array, base: Array) -> Array:
    """Finer edges without the cuts of the previous cells."""
    return np.asarray(finer[~np.isin(finer, edges) | np.isin(finer, base)])


def _switching(solved: Periodic) -> tuple[Array, Array]:
    """Angles where the motion makes a law switch, or a mesh change the side that drives, beside the machine's own edges.

    And the error of each (rad) that changes a cycle's work by rounding: 0 if a law
    switches; where a mesh reverses, it passes tau' x after x rad, which changes the loss by up to (1/efficiency -
    efficiency) tau' x²/2 J. Two reversals of a mesh with less between them do not count.
    """
    moments, mesh, edges = solved.moments, solved.moments.mesh, solved.moments.machine.mesh
    deciding = [(values, 0.0) for values in moments.switches(solved.omega)]
    spreads = [1.0 / eta - eta for stage in moments.machine.stages if (eta := stage.efficiency) < 1.0]
    deciding += zip(solved.rate.transmitted, spreads, strict=True)
    rounding = ROUNDING * float(cells.integral(solved.rate.exchanged, mesh.half).sum())
    every: list[tuple[float, float]] = []
    for values, spread in deciding:
        series = cells.fit(values)[None]
        noise = np.full(series.shape[:2], 1e-13 * float(np.abs(values).max(initial=0.0)))
        crossings = cells.crossings(series, noise)
        slopes = spread * np.abs(crossings.slope) / mesh.half[crossings.cell, 0]
        slack = np.sqrt(2.0 * rounding / np.maximum(slopes, 1e-300)) if spread else np.zeros_like(slopes)
        angles: list[tuple[float, float]] = []
        for angle, width in zip(crossings.angles(mesh).tolist(), slack.tolist(), strict=True):
            if np.abs(edges - angle).min() <= 1e-9 * mesh.edges[-1]:
                continue
            if angles and angle - angles[-1][0] < min(width, angles[-1][1]):
                angles.pop()
            else:
                angles.append((angle, width))
        every += angles
    return tuple(np.array(sorted(every)).reshape(-1, 2).T)  # type: ignore[return-value]


def _described(solved: Periodic, demand: Demand) -> OwnMotion:
    """A solved motion as a cycle with its moment along it, and as a run with its error."""
    moments, state, extremes, mesh = solved.moments, solved.state, solved.extremes, solved.moments.mesh
    unknown = state.unknown if moments.machine.scene.unknown is not None else None
    cycle = cycle_of(moments, solved.rate, unknown)
    start, eps = state.inertia + cycle.inertia_at_start, float(solved.irregularity)
    errors = motion_errors(solved, demand, cycle.errors, start)
    inside = mesh.middle[extremes.cell, 0] + mesh.half[extremes.cell, 0] * extremes.t
    angles = np.where(np.abs(extremes.t) < 1.0, inside, mesh.edges[extremes.cell + (extremes.t > 0.0)])
    run = Run(
        inertia=state.inertia,
        irregularity=eps,
        speed_max=solved.reference * (1.0 + float(extremes.excess[0])),
        speed_min=solved.reference * (1.0 + float(extremes.excess[1])),
        angle_speed_max=float(angles[0]),
        angle_speed_min=float(angles[1]),
        offset=float(state.edges[0, 0]) + 0.5 * start * (solved.reference**2 - solved.speed**2),
        error=float(errors.irregularity),
        speed=float(solved.speed),
        drive=moments.drive(solved.omega, state.unknown, state.of_circuit),
        states=tuple(state.edges[0, 1:].tolist()),
        along=state.of_circuit if state.of_circuit.size else None,
        states_error=tuple(errors.states),
        level=float(errors.level),
    )
    cycle = cycle._replace(balance_error=cycle.balance_error * float(errors.balance))
    return OwnMotion(solved, cycle, run._replace(cycle=cycle), float(errors.speed), float(errors.flywheel))


class MotionErrors(NamedTuple):
    """Errors of a steady motion, numbers, or arrays of many motions.

    `irregularity` and `speed`, the mean of extremes, relative; `level` as that of a `Run`; `flywheel` that was sized, kg m²;
    `balance` the factor by which speeds add to the balance's own; `states` of a motor.
    """

    irregularity: Any
    speed: Any
    level: Any
    flywheel: Any
    balance: Any
    states: Sequence[float] = ()


def motion_errors(solved: Periodic, demand: Demand, errors: CycleErrors, start: Any) -> MotionErrors:
    """The errors of a steady motion by those of the cycle along it.

    With a given flywheel an error of the level changes the irregularity, more so near a stop of the machine; a sized
    flywheel has the required irregularity, and hardly changes with the level. Energies at two places differ by twice their
    error at most; by 1/(1 - G) of that of the work, G the integral of |dF/dE|, where a balance keeps the mean of extremes.

    Args:
        solved: the motion.
        demand: its requirements.
        errors: of the cycle.
        start: J + I* at phi = 0, kg m².

    """
    moments, state, eps, square = solved.moments, solved.state, solved.irregularity, solved.speed**2
    left = np.abs(cells.integral(solved.rate.moment, moments.mesh.half).sum(axis=-1))  # net work that the iteration leaves
    kept = kept_work(solved, errors, left)
    # energies are closed round the cycle, to their digits
    closing = kept + 2 * ROUNDING * np.abs(state.edges[..., 0]).max(axis=-1)
    balanced = moments.machine.scene.unknown is not None
    free = moments.machine.sets_its_speed and not balanced
    energy, of_states = square * np.maximum(start, 1e-300), []
    level = closing / (np.maximum(np.abs(solved.damping), 1e-300) * energy) if free else 0.0
    missed = np.abs(eps - (eps if demand.irregularity is None else demand.irregularity))  # of what the flywheel is sized for
    missed_share = missed / np.where(eps > 0.0, eps, np.inf)
    if solved.reach is not None and solved.closing is not None:  # nothing decays by itself, and errors swing along
        carried_on = solved.reach @ np.concatenate(([closing], solved.closing[1:]))
        kept, of_states = carried_on[0], (carried_on[1:] + missed_share * np.ptp(state.edges[:, 1:], axis=0)).tolist()
        level = kept / energy
    apart = 2 * kept
    if balanced and moments.circuit is None:  # e is 0 somewhere, as the mean of extremes is given: |e| <= work + G |e|
        total = np.asarray(state.inertia)[..., None, None] + moments.inertia
        fading = cells.integral(np.abs(solved.rate.by_speed / (total * solved.omega)), moments.mesh.half).sum(axis=-1)
        spread, _ = spread_of_closing(solved.rate, moments.mesh, balanced=True)
        apart = kept / (1.0 - np.minimum(spread * fading, 0.5))
    off = (apart + 0.5 * (1 + eps / 2) ** 2 * square * errors.variation) / square / solved.lightest
    off += eps * (errors.start / solved.lightest + 4 * ROUNDING + 2 * solved.left)
    relative = off / np.where(eps > 0.0, eps, np.inf) + missed_share
    varying, speed, balance = 0.5 * eps * relative, 0.0, 1.0  # what speeds may be off the level
    if free:
        high, low = np.moveaxis(1.0 + solved.extremes.excess, -1, 0) * (solved.reference / solved.speed)
        of_level = level / np.maximum(high * low, ROUNDING)
        relative, speed = relative + 4.0 * (level if demand.inertia is None else of_level), of_level + varying
    if balanced:
        pulled = cells.integral(np.abs(solved.rate.by_speed) * solved.omega, moments.mesh.half).sum(axis=-1)
        balance = 1.0 + varying * pulled / np.maximum(errors.net, 1e-300)
    bound, answer = 0.0, solved.sensitivity
    if answer is not None:
        bound = answer.by_square * (varying + missed) + answer.by_work * closing
    return MotionErrors(relative, speed, level, bound, balance, of_states)


def errors_by_stiffness(solved: Periodic) -> tuple[Any, Any]:
    """Errors by rounding of speeds under stiff torques: of the irregularity, relative, and of a sized flywheel (kg m²)."""
    stiff = cells.integral(np.abs(solved.rate.by_speed) * solved.omega, solved.moments.mesh.half)
    work, eps = 4 * ROUNDING * np.take_along_axis(stiff, solved.extremes.cell, -1).max(axis=-1), solved.irregularity
    off = 4.0 * work / (solved.speed**2 * solved.lightest * eps)
    return off, 0.0 if solved.sensitivity is None else 0.5 * solved.sensitivity.by_square * eps * off


def _work_of_jumps(solved: Periodic, cuts: Array, moved: Array) -> float:
    """The work (J) by which jumps of the moment at cuts change it where these move by angles (rad)."""
    ends, edges = cells.ends(cells.fit(solved.rate.moment)), solved.moments.mesh.edges
    place = np.abs(edges[:-1, None] - cuts).argmin(axis=0)  # an edge that differs by rounding may stand for a cut
    return float(np.abs(ends[place, 0] - ends[place - 1, 1]) @ moved)


def _with_work_error(motion: OwnMotion, work: float) -> OwnMotion:
    """A motion whose moment has an error of work (J), with that in its errors."""
    solved, run, cycle = motion.solved, motion.run, motion.cycle
    least = float(solved.lightest)
    pulled = cells.integral(np.abs(solved.rate.by_speed) * solved.omega, solved.moments.mesh.half).sum()
    of_balance = 1.0 + work * (1.0 + 2.0 * pulled / (solved.speed**2 * least)) / max(cycle.errors.net, 1e-300)
    errors = cycle.errors._replace(work=cycle.errors.work + 2.0 * work, net=cycle.errors.net + work)
    cycle = cycle._replace(errors=errors, balance_error=cycle.balance_error * of_balance)
    level = work / (max(abs(solved.damping), 1e-300) * solved.speed**2 * least) if motion.level_error > 0.0 else 0.0
    off = 4.0 * work / (solved.speed**2 * least) / max(run.irregularity, 1e-300)
    bound = 0.0 if solved.sensitivity is None else solved.sensitivity.by_work * work
    return motion._replace(
        cycle=cycle,
        run=run._replace(error=run.error + off + 4.0 * level, level=run.level + level, cycle=cycle),
        level_error=motion.level_error + level,
        inertia_bound=motion.inertia_bound + bound,
    )


def kept_work(solved: Periodic, errors: CycleErrors, left: Any) -> Any:
    """Largest error (J) of the kinetic energy by errors of the cycle's work, which decay where torques fall with the speed.

    As dE' = (dF/dE) dE + r is one-signed, errors r of one sign in all cells are the worst that can be.

    Args:
        solved: the motion, or many of them.
        errors: those of the cycle.
        left: net work that the iteration leaves, J.

    """
    moments, half, work = solved.moments, solved.moments.mesh.half, errors.work + left
    balanced = moments.machine.scene.unknown is not None  # then the balance's own error does not decay
    if balanced or moments.circuit is not None:
        return work
    total = np.asarray(solved.state.inertia)[..., None, None] + moments.inertia
    growth = cells.integral(solved.rate.by_speed / (total * solved.omega), half)
    exchanged = cells.integral(solved.rate.exchanged, half)
    share = exchanged / np.maximum(exchanged.sum(axis=-1, keepdims=True), 1e-300)
    inside, made = errors.inside[0], errors.by_cell[0] - errors.inside[0]
    made = made + np.asarray(work - errors.left[0] - made.sum(axis=-1))[..., None] * share
    fades = np.minimum(growth, -1e-9)
    fading = np.where(growth > fades, 1.0, np.expm1(fades) / fades)  # of what is spread evenly over its cell
    made, inside = made * fading, inside * fading
    grown = np.exp(np.minimum(growth, 1.0))
    kept: Any = 0.0 * work
    most = kept
    for k in [*range(half.shape[-2])] * 2:
        kept = np.minimum(kept * grown[..., k] + made[..., k], work)
        most = np.maximum(most, kept)
    return np.minimum(most + inside.max(axis=-1), work)
