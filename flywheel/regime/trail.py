"""The record of a motion in time: stretches of smooth laws, each a step with its dense output (`Trail`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from bondgraph.motion import runge_kutta
from bondgraph.motion.stepping import Step
from bondgraph.numerics import root
from flywheel.machine.dynamics import Dynamics
from flywheel.machine.machine import Anchor
from flywheel.numerics.cells import Array, Index


class Start(NamedTuple):
    """The state at t = 0: position (rad; on a stroke from its beginning), speed (rad/s), and a motor's own states."""

    phi: float
    omega: float
    states: tuple[float, ...] = ()


class Stretch(NamedTuple):
    """A step, what is to be added to its position, and where the branches of its laws are decided."""

    step: Step
    offset: float
    anchor: Anchor


NODES, _WEIGHTS = (0.5 * part for part in np.polynomial.legendre.leggauss(10))
NODES = 0.5 + NODES
"""Shares of a step at which a speed is looked for, and works are summed."""
_TOGETHER = 20_000  # times that are looked at in one go


class Later:
    """A step's dense output, a time (s) later."""

    def __init__(self, dense: Callable[[Any], Array], time: float) -> None:
        self.dense, self.time = dense, time

    def __call__(self, t: Any) -> Array:
        """The states at times t."""
        return self.dense(t - self.time)


def source(step: Step) -> Callable[[Any], Array]:
    """The dense output that a step was taken from, its own or that of an earlier cycle."""
    return step.dense.dense if isinstance(step.dense, Later) else step.dense


def later(step: Step, time: float) -> Step:
    """The same step, a time (s) later."""
    return Step(Later(step.dense, time), step.start + time, step.end + time)


class Along(NamedTuple):
    """States at some times of a motion, with what its laws need to know there: positions are those within the cycle."""

    phi: Array
    anchor: Anchor
    omega: Array
    time: Array
    states: Array


class Trail(NamedTuple):
    """A motion as it was stepped. States are rows: position, speed, the moment's work (J), and a motor's own.

    `goal` names what it ended with, if that was not time; `stuck` says where it stands still for good; `cycles` is how often
    it came to the end of a cycle, `repeated` how many of these were taken as the one before; `drift` is the share by which
    the kinetic energy at phi = 0, which returns there, was off after the cycle that they were taken from. `left` is the
    share of the typical speed that a motion that swings ever less about a place still had where it counted as at rest.
    """

    dynamics: Dynamics
    start: Start
    stretches: tuple[Stretch, ...]
    goal: str | None = None
    stuck: str | None = None
    cycles: int = 0
    repeated: int = 0
    drift: float = 0.0
    left: float = 0.0

    @property
    def t(self) -> Array:
        """Times of the steps, s."""
        return np.array([0.0, *(stretch.step.end for stretch in self.stretches)])

    def owners(self, times: Array) -> Index:
        """The stretch that each time belongs to."""
        return np.clip(np.searchsorted(self.t[1:], times), 0, len(self.stretches) - 1)

    def states(self, times: Array, owners: Index | None = None) -> Array:
        """The states at times, by dense output: (states, times)."""
        which = self.owners(times) if owners is None else owners
        found = np.empty((3 + len(self.start.states), times.size))
        steps = [stretch.step.dense for stretch in self.stretches]
        explicit = np.array([isinstance(step, runge_kutta.Step) for step in steps])[which]
        order = np.argsort(which, kind="stable")
        if explicit.any():
            found[:, explicit] = runge_kutta.at(steps, which[explicit], times[explicit])
            order = order[~explicit[order]]
        firsts = np.flatnonzero(np.diff(which[order], prepend=-1))
        for mine in np.split(order, firsts[1:]) if order.size else ():
            found[:, mine] = steps[which[mine[0]]](times[mine])
        found[0] += np.array([stretch.offset for stretch in self.stretches])[which]
        return found

    def anchors(self, owners: Index) -> tuple[Array, Anchor]:
        """The offsets of positions in stretches of the motion, and the anchors that decide the branches of laws there."""
        used, where = np.unique(owners, return_inverse=True)
        stretches = [self.stretches[k] for k in used]
        offset = np.array([stretch.offset for stretch in stretches])[where]
        anchors = np.array([stretch.anchor[:3] for stretch in stretches])[where]
        senses = np.array(
            [stretch.anchor.direction for stretch in stretches], dtype=float
        )  # not a number where none is known
        direction = None if np.isnan(senses).all() else senses[where]
        factors: tuple[Any, ...] | None = None
        if stretches[0].anchor.factors is not None:
            factors = tuple(np.array([stretch.anchor.factors for stretch in stretches])[where].T)
        sides = None
        if stretches[0].anchor.sides is not None:
            sides = np.array([stretch.anchor.sides for stretch in stretches])[where]
        return offset, Anchor(anchors[:, 0], anchors[:, 1], anchors[:, 2], factors, sides, direction)

    def along(self, times: Array, owners: Index) -> Iterator[tuple[slice, Array, Along]]:
        """Times in portions: which, their states, and what laws need there; `owners` are the stretches they belong to."""
        for k in range(0, times.size, _TOGETHER):
            portion = slice(k, k + _TOGETHER)
            states = self.states(times[portion], owners[portion])
            offset, anchor = self.anchors(owners[portion])
            yield portion, states, Along(states[0] - offset, anchor, states[1], times[portion], states[3:])

    def within(self, inside: Array) -> tuple[Array, Index]:
        """Times in every stretch, at its ends and at shares (0 to 1) of it, and the stretches that they belong to."""
        shares = np.concatenate(([0.0], inside, [1.0]))
        start, end = self.t[:-1, None], self.t[1:, None]
        times = start + (end - start) * shares
        times[:, -1] = self.t[1:]
        return times.ravel(), np.repeat(np.arange(len(self.stretches)), shares.size)

    def gauss(self, end: float = np.inf) -> tuple[Array, Index, Array]:
        """Nodes (s) of Gauss' rule in every stretch up to a time, the stretches they belong to, and what each weighs (s)."""
        first, last = self.t[:-1], np.minimum(self.t[1:], end)
        used = np.flatnonzero(last > first)
        width = (last - first)[used, None]
        return (first[used, None] + width * NODES).ravel(), np.repeat(used, NODES.size), (width * _WEIGHTS).ravel()

    def time_to(self, speed: float) -> float | None:
        """The first time (s) at which a speed (rad/s) is reached; None if it never is."""
        times, owners = self.within(NODES)
        speeds = self.states(times, owners)[1]
        above = np.flatnonzero(speeds >= speed)
        if not above.size:
            return None
        if above[0] == 0:
            return 0.0
        low, high = float(times[above[0] - 1]), float(times[above[0]])

        def faster(t: float) -> float:
            return float(self.states(np.array([t]), owners[above[:1]])[1, 0]) - speed

        return low if low == high or faster(low) >= 0.0 else root(faster, low, high)  # equal on both sides of a switch

    def __repr__(self) -> str:
        """Names the number of steps and how they end, instead of all of them."""
        return f"Trail({len(self.stretches)} steps to t = {self.t[-1]:.6g} s, goal={self.goal!r}, cycles={self.cycles})"

    def ends(self) -> Array:
        """The states at the ends of all steps, the start included: (states, steps + 1)."""
        first, last = self.stretches[0], dict[int, Sequence[float]]()
        rows = [first.step.first]
        for step, _, _ in self.stretches:
            taken, key = source(step), id(source(step))
            if not isinstance(taken, runge_kutta.Step):  # of which several steps may be parts
                rows.append(step.last)
                continue
            if key not in last:
                last[key] = step.last
            rows.append(last[key])
        ends = np.array(rows).T
        ends[0] += [first.offset, *(offset for _, offset, _ in self.stretches)]
        return ends
