"""Motion of linkages with friction, by Newton's law or by Lagrange's multipliers, with standstills and breakaway.

Friction is that at the actual speed, with the reactions of the same instant.
The laws are those of `flywheel.mechanisms.linkages.statics`: passive actions f = -mu s(R) against the slip, with s(R) the
size of the reaction each follows. Reactions and accelerations are linear in them: R = R0 + G f, a = a0 + A f, of which one
linear system gives all columns. While every slip and every normal force keeps its sign, f follows smoothly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.motion import standstill
from bondgraph.numerics import threshold
from flywheel.mechanisms.linkages.bodies import (
    CREEPING,
    LEAST_MARGIN,
    RANK,
    AcceptedSteps,
    Closure,
    Interpolant,
    LinkageModel,
    LinkageMotion,
    LinkageState,
    ScaledValues,
    UnreachableError,
    acceleration_sizes,
    column_accelerations,
    components,
    integrate,
    projection,
    system,
)
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.statics import Pair, contact, continued_sizes, coulomb, friction_sizes
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import PIN

Array = NDArray[np.float64]

_STILL = 1e-12  # share of the largest rate of its kind below which a joint rests: rounding
_LIFTED = 1e-11  # share of the largest normal by which one has to have turned
_LOOKS = np.arange(1, 7) / 6  # places in a step where signs are looked at
_AHEAD = 1e-6  # of the driver's unit: distance at which a joint that reverses is evaluated
_INSTANT = 2.0**-44  # of the interval examined at once: resolution of an instant
_NEAR_ZERO = 6.0  # of its change in a sixth of a step: how near to zero a pin's resultant turns for the step to end there
_SHORT = 50  # pieces in turn without a way
_MOST_PIECES = 20_000
_AGAINST = "friction that locks the mechanism"


class FrictionMode(NamedTuple):
    """Sense of motion of a linkage with friction: forwards (1), backwards (-1), or at rest (0).

    factors: of the passive actions' sizes, with the sign against each joint's motion; bearing: sign of each normal force,
    1 for a pin.
    """

    sense: float
    factors: Array
    bearing: Array


class UnitResponses(NamedTuple):
    """Reactions and accelerations at an instant: without passive actions, and by a unit of each of p.

    free (p, 2), response (p, 2, p): of the forces whose resultant is the size of each passive action; own, by: of the
    accelerations, the latter with a last axis more; push: power of a unit of each at the speeds; power: of the loads.
    """

    free: Array
    response: Array
    own: Any
    by: Array
    push: Array
    power: float


class Resistances:
    """Passive actions of a linkage with friction, by the laws of `flywheel.mechanisms.linkages.statics`.

    names: joint or coupling; factors: size of the action by that of the reaction it follows; forms (p, 2, reactions); slips:
    the slip it opposes, -1 for the share due to a tooth's inclined flank; single: follows one normal force.
    """

    def __init__(self, model: LinkageModel) -> None:
        self.model, linkage = model, model.linkage
        index = {pair: k for k, pair in enumerate(components(linkage))}
        names, factors, slips = list[str](), list[float](), list[int]()
        forms: list[tuple[Mapping[str, float], ...]] = []  # one, or both components of a pin's resultant
        for k, joint in enumerate(model.rough):
            for factor, form in coulomb(joint):
                names.append(joint.name)
                factors.append(factor)
                forms.append(form)
                slips.append(k)
        for k, coupling in enumerate(linkage.couplings, len(model.rough)):
            if coupling.friction or coupling.pressure_angle:
                names.append(coupling.name)
                factors.append(coupling.friction or -float(np.tan(abs(coupling.pressure_angle))))
                forms.append(({"effort": 1.0},))
                slips.append(k if coupling.friction else -1)
        self.names, self.factors, self.slips = names, np.array(factors), np.array(slips)
        self.single = np.array([len(form) == 1 for form in forms], bool)
        self.forms = np.zeros((len(names), 2, model.closures))
        for p, (name, form) in enumerate(zip(names, forms, strict=True)):
            for k, parts in enumerate(form):
                for part, weight in parts.items():
                    self.forms[p, k, index[name, part]] = weight
        self.near = np.zeros((1, len(names)))  # sizes of the instant before
        sliding = [
            linkage.joint(name).kind != PIN
            for name in (*(j.name for j in model.rough), *(c.first for c in linkage.couplings))
        ]
        self.reach = np.where(sliding, model.length, 1.0)  # size of each slip for bodies of unit speed

    def determined(self) -> None:
        """Refuses friction that follows a reaction which redundant constraints leave open."""
        model = self.model
        left, sizes, _ = np.linalg.svd(model.state(model.start).jacobian)
        null = left[:, int((sizes > RANK * sizes.max()).sum()) :]
        faults = dict.fromkeys(
            Fault(
                f"{model.linkage.path}.{name}.friction",
                "friction that follows a force which redundant constraints leave open",
                "a force that the equations determine",
                "take the friction away, or the constraint that is one too many",
            )
            for name, forms in zip(self.names, self.forms, strict=True)
            if np.any(np.abs(forms.any(axis=0) @ np.abs(null)) > RANK)
        )
        if faults:
            raise SceneError(faults)

    def wrenches(self, state: LinkageState, reactions: Array) -> tuple[Array, Array]:
        """Wrenches of unit reactions, those of couplings replaced by their contact forces, and of unit passive actions.

        For many states; shapes (n, 3 bodies, reactions) and (n, 3 bodies, p).
        """
        linkage = self.model.linkage
        columns = [state.slips[:, k] for k in self.slips if 0 <= k < len(self.model.rough)]
        if linkage.couplings:
            origins = np.zeros((len(state.x), len(linkage.names), 3))
            origins[:, 1:] = state.x.reshape(len(state.x), -1, 3)
            places = origins.transpose(1, 2, 0)
            coms = np.array([complex(*linkage.link(name).com) for name in linkage.names])
            centres = places[:, 0] + 1j * places[:, 1]
            centres[0] = coms[0]
            bodies = centres - coms[:, None] * np.exp(1j * places[:, 2])
            value = np.stack((bodies.real, bodies.imag, places[:, 2]), axis=1)
            poses = Poses(linkage, state.q, value, np.zeros_like(value), np.zeros_like(value))
            middle, reactions = np.stack((centres.real, centres.imag), axis=1), reactions.copy()
            for k, coupling in enumerate(linkage.couplings):
                touch = contact(poses, coupling)
                ends = (touch.first, touch.second)
                still = np.zeros(len(state.x))
                sides = [
                    Pair(*ends, way, touch.at, couple).on_bodies(middle)[1:].reshape(-1, len(state.x)).T
                    for way, couple in ((touch.push, still if touch.couple is None else touch.couple), (touch.aside, still))
                ]
                reactions[:, :, self.model.kept + k] = sides[0]
                if coupling.friction or coupling.pressure_angle:
                    columns.append(sides[1])
        return reactions, np.stack(columns, axis=-1)

    def mode(self, sense: float, slips: Array) -> FrictionMode:
        """A motion with the slips' signs in its sense; the normals' signs are still open."""
        signs = np.where(self.slips >= 0, sense * slips[self.slips], 1.0)
        return FrictionMode(sense, -self.factors * signs, np.ones(len(self.names)))

    def settled(self, mode: FrictionMode, instant: UnitResponses, q: float) -> tuple[FrictionMode, Array]:
        """The mode with the signs of the normals at an instant, and the passive actions' sizes."""
        pull = instant.response * mode.factors
        friction = friction_sizes(instant.free[None], pull[None])
        if not friction.converged[0]:
            raise self.locked(q, pull)
        parts = instant.free + pull @ friction.sizes[0]
        bearing = np.where(self.single & (parts[:, 0] < 0.0), -1.0, 1.0)
        return mode._replace(bearing=bearing), bearing * friction.sizes[0]

    def sizes(self, mode: FrictionMode, instant: UnitResponses, q: float) -> Array:
        """Sizes of the passive actions, signs of the normals being kept."""
        pull = (instant.response * mode.factors)[None]
        sizes, matrix = continued_sizes(instant.free[None], pull, ~self.single, mode.bearing[None], start=self.near)
        if not (np.isfinite(sizes).all() and np.linalg.det(matrix[0]) > 0.0):
            return self.settled(mode, instant, q)[1]  # by stages, if there is an answer
        self.near = sizes
        return np.asarray(sizes[0])

    def locked(self, q: float, pull: Array) -> UnreachableError:
        """The error of a position where friction locks the reactions; it names the joint with the greatest feedback."""
        worst = self.names[int(np.abs(pull).sum(axis=(1, 2)).argmax())]
        defect = f"{_AGAINST} at {self.model.where(q)}"
        return UnreachableError(
            Fault(f"{self.model.linkage.path}.{worst}.friction", defect, "forces in balance", "lower it, or end before")
        )


class RoughByDriver:
    """Newton's law with friction over the driver's coordinate: y = q, qdot, work of the loads, work of each resistance."""

    def __init__(self, model: LinkageModel, resistances: Resistances) -> None:
        self.model, self.rub = model, resistances
        self.interpolant = Interpolant(model, self._columns)
        self.count, self.loads = len(resistances.names), 1 + len(model.varying)

    def _columns(self, model: LinkageModel, state: LinkageState) -> ScaledValues:
        """Slips and passive actions' power by unit speed, M* by loads, then acceleration and sized forces by each column."""
        columns, n = model.load_columns(state), model.masses.size
        reactions, pushes = self.rub.wrenches(state, model.reaction_wrenches(state))
        right, solution, alpha = column_accelerations(model, columns, state, reactions, pushes)
        forces = np.einsum("pkm,nmc->npkc", self.rub.forms, solution[:, n:]).reshape(len(state.x), -1)
        slips, power = np.einsum("nsi,ni->ns", state.slips, state.v), np.einsum("nip,ni->np", pushes, state.v)
        moment, motion = np.einsum("nic,ni->nc", columns, state.v), np.linalg.norm(state.v / model.scale, axis=1)
        lengths = np.array([model.length if part == "moment" else 1.0 for _, part in components(model.linkage)])
        sizes = (
            motion.max() * self.rub.reach,
            [motion.max()],
            np.einsum("ni,nip->np", np.abs(state.v), np.abs(pushes)).max(axis=0),
            np.einsum("ni,nic->nc", np.abs(state.v), np.abs(columns)).max(axis=0),
            acceleration_sizes(model, right, solution),
            np.outer(
                np.abs(self.rub.forms) @ lengths, (np.abs(solution[:, n:]) / lengths[:, None]).max(axis=(0, 1))
            ).ravel(),
        )
        values = np.concatenate((slips, motion[:, None], power, moment, alpha, forces), axis=1)
        return values, np.concatenate(sizes)

    def instant(self, t: float, y: Array) -> UnitResponses:
        """Actions at a time and state."""
        q, qdot, p, loads = float(y[0]), float(y[1]), self.count, self.loads
        columns = self.interpolant.at(q)[self.rub.reach.size + 1 :]
        amounts = np.array([*self.model.load_amounts(t, q, qdot), qdot * qdot])
        power, moment, alpha = columns[:p], columns[p : p + loads], columns[p + loads : 2 * p + 2 * loads + 1]
        forces = columns[2 * p + 2 * loads + 1 :].reshape(p, 2, -1)
        return UnitResponses(
            free=forces[:, :, : loads + 1] @ amounts,
            response=forces[:, :, loads + 1 :],
            own=float(alpha[: loads + 1] @ amounts),
            by=alpha[loads + 1 :],
            push=power * qdot,
            power=float(moment @ amounts[:-1]) * qdot,
        )

    def rates(self, y: Array, instant: UnitResponses, amounts: Array) -> Array:
        """Derivative of y."""
        return np.concatenate(([y[1], self.acceleration(y, instant, amounts), instant.power], instant.push * amounts))

    def acceleration(self, y: Array, instant: UnitResponses, amounts: Array) -> float:
        """Component of the driver."""
        return float(instant.own + instant.by @ amounts)

    def slips(self, y: Array, ahead: float = 0.0) -> Array:
        """Rates of the slips as shares of the bodies' own, for a driver that goes forwards; a little ahead if requested."""
        columns = self.interpolant.at(float(y[0]) + ahead * self.model.unit)
        return np.asarray(columns[: self.rub.reach.size] / (self.rub.reach * columns[self.rub.reach.size]))

    def speed(self, y: Array) -> float:
        """Component of the driver."""
        return float(y[1])

    def place(self, y: Array) -> float:
        """The driver's coordinate."""
        return float(y[0])

    def rested(self, y: Array) -> Array:
        """The state at rest."""
        return np.array((y[0], 0.0, *y[2:]))

    def states(self, y: Array) -> LinkageState:
        """All bodies at many states y, shape (n, 3 + p)."""
        return self.interpolant.states(y[:, 0], y[:, 1])

    def wrenches(self, state: LinkageState) -> Array:
        """The wrenches of unit reactions."""
        return self.model.reaction_wrenches(state)


class RoughInAllCoordinates:
    """Lagrange's multipliers with friction: y = all coordinates, all velocities, works as above.

    Forwards is along the tangent of the motion, which turns with the bodies, not with the driver.
    """

    def __init__(self, model: LinkageModel, resistances: Resistances, x: Array, g: Array) -> None:
        self.model, self.rub, self.n = model, resistances, x.size
        self.last, self.tangent = model.state(x, g), g / model.scale**2
        self.drifts = [0.0]

    def instant(self, t: float, y: Array) -> UnitResponses:
        """Actions at a time and state."""
        n, model = self.n, self.model
        state = model.state(y[:n], y[n : 2 * n])
        forces = model.forces(t, state)
        parts: list[Any] = [
            [part[None] for part in one] if isinstance(one, list) else np.asarray(one)[None] for one in state
        ]
        reactions, pushes = self.rub.wrenches(LinkageState(*parts), state.jacobian.T[None])
        matrix, first = system(model, forces, state, reactions[0])
        right = np.zeros((first.size, 1 + pushes.shape[2]))
        right[:, 0], right[:n, 1:] = first, pushes[0]
        solution = model.solved(matrix, right)
        sized = self.rub.forms @ solution[n:]
        return UnitResponses(
            sized[..., 0], sized[..., 1:], solution[:n, 0], solution[:n, 1:], state.v @ pushes[0], float(state.v @ forces)
        )

    def rates(self, y: Array, instant: UnitResponses, amounts: Array) -> Array:
        """Derivative of y."""
        n = self.n
        return np.concatenate((y[n : 2 * n], instant.own + instant.by @ amounts, [instant.power], instant.push * amounts))

    def acceleration(self, y: Array, instant: UnitResponses, amounts: Array) -> float:
        """Component along the tangent."""
        return float(self.tangent @ (instant.own + instant.by @ amounts))

    def slips(self, y: Array, ahead: float = 0.0) -> Array:
        """Rates of the slips as shares of the bodies' own, forwards; a little ahead if requested."""
        n, model = self.n, self.model
        state = model.state(y[:n])
        g = model.influence(state, self.tangent)
        if ahead:
            state = model.state(y[:n] + g * (ahead / float(np.linalg.norm(g / model.scale))))
            g = model.influence(state, self.tangent)
        return np.asarray(state.slips @ g / (self.rub.reach * np.linalg.norm(g / model.scale)))

    def speed(self, y: Array) -> float:
        """Component along the tangent."""
        return float(self.tangent @ y[self.n : 2 * self.n])

    def place(self, y: Array) -> float:
        """The driver's coordinate."""
        return float(self.model.state(y[: self.n]).q)

    def rested(self, y: Array) -> Array:
        """The state at rest."""
        return np.concatenate((y[: self.n], np.zeros(self.n), y[2 * self.n :]))

    def correct(self, y: Array) -> Array:
        """Returns a state to the closures, within its assembly; the tangent turns with it."""
        model, n = self.model, self.n
        state, drift = projection(model, y[:n], y[n : 2 * n])
        self.drifts.append(drift)
        if model.sense(state, self.tangent) != model.sense(self.last, self.tangent):
            raise model.branched(float(self.last.q))
        if model.margin(state, self.tangent) < LEAST_MARGIN:
            raise model.branched(float(self.last.q))
        self.last, self.tangent = state, model.influence(state, self.tangent) / model.scale**2
        return np.concatenate((state.x, state.v, y[2 * n :]))

    def states(self, y: Array) -> LinkageState:
        """All bodies at many states y, shape (times, 2 n + 1 + p)."""
        return self.model.state(y[:, : self.n], y[:, self.n : 2 * self.n])

    def wrenches(self, state: LinkageState) -> Array:
        """The wrenches of unit reactions."""
        return np.swapaxes(state.jacobian, -1, -2)


Rough = RoughByDriver | RoughInAllCoordinates


class RoughMotion:
    """Motion with friction as pieces in which every joint and normal force keeps its sign, and standstills between them.

    A piece ends, to rounding, where a joint reverses against its neighbour, a normal force changes sides, or the machine
    stops; integration restarts there. At rest all joints stick together: the machine starts forwards where friction
    against it leaves an acceleration above 0, backwards where one below 0, and waits otherwise until loads that change with
    time break it away (see `bondgraph.motion.standstill`). It can never start in both directions, because friction takes
    power.
    """

    def __init__(self, motion: Rough, rub: Resistances, y: Array, until: float, rtol: float, atol: Array) -> None:
        self.motion, self.rub = motion, rub
        self.parts: list[tuple[AcceptedSteps, FrictionMode]] = []
        self.messages: list[str] = []
        self.lock = ""  # what locks the machine at the standstill looked at last
        self.released = 0.0  # the direction in which it leaves the standstill that ends now
        t, short = 0.0, 0
        while t < until:
            mode, signs = self.start(t, y)
            if mode.sense:
                steps, stops = self.moved(t, y, mode, signs, until, rtol, atol)
            else:
                steps, stops = self.waited(t, y, until), True
                if steps.s[-1] >= until:
                    path, place = rub.model.linkage.path, rub.model.where(motion.place(y))
                    reason = self.lock or f"{path}: friction that holds it at {place}"
                    self.messages.append(f"{reason}: it stands still from {t:.6g} s on")
            short = short + 1 if steps.s[-1] - t < CREEPING * until else 0
            t, y = float(steps.s[-1]), steps.states[-1]
            if stops:
                y = motion.rested(y)
                steps.states[-1] = y
            self.parts.append((steps, mode))
            if short > _SHORT or len(self.parts) > _MOST_PIECES:
                defect = f"friction that changes sides without end at {rub.model.where(motion.place(y))}"
                fault = Fault(f"{rub.model.linkage.path}.{rub.names[0]}.friction", defect, "one motion", "lower it")
                raise UnreachableError(fault)

    def signs(self, y: Array, sense: float) -> Array:
        """Signs of the slips in a sense of the motion; those of joints that reverse here as they are just after."""
        slips = self.motion.slips(y)
        if np.any(np.abs(slips) < _AHEAD):
            slips = np.where(np.abs(slips) < _AHEAD, self.motion.slips(y, sense * _AHEAD), slips)
        return np.where(np.abs(slips) > _STILL, np.sign(slips), 0.0)

    def leaving(self, y: Array) -> Callable[[float], tuple[float, float]]:
        """The accelerations with which motions forwards and backwards would begin at y, by time; 0 if friction locks."""
        place, modes = self.motion.place(y), [self.rub.mode(sense, self.signs(y, sense)) for sense in (1.0, -1.0)]

        def sets_out(mode: FrictionMode, instant: UnitResponses) -> float:
            try:
                mode, sizes = self.rub.settled(mode, instant, place)
            except UnreachableError as error:
                self.lock = f"{error.fault.path}: {error.fault.defect}"
                return 0.0
            return self.motion.acceleration(y, instant, mode.factors * sizes)

        def at(t: float) -> tuple[float, float]:
            instant = self.motion.instant(t, y)
            free = self.motion.acceleration(y, instant, np.zeros(len(self.rub.names)))
            self.lock = ""
            if not np.isfinite(free):
                when = f"at {t:.6g} s" if t else "at the start"
                raise SceneError([Fault("simulate", f"loads that are not finite {when}", "finite ones")])
            return sets_out(modes[0], instant), sets_out(modes[1], instant)

        return at

    def start(self, t: float, y: Array) -> tuple[FrictionMode, Array]:
        """The mode that begins at an instant, its sense 0 at a standstill, and the signs of the slips."""
        sense, place = float(np.sign(self.motion.speed(y))), self.motion.place(y)
        if not sense:
            sense, self.released = self.released or standstill.direction(*self.leaving(y)(t)), 0.0
            if not sense:
                return FrictionMode(0.0, np.full(len(self.rub.names), np.nan), np.ones(len(self.rub.names))), np.zeros(0)
        signs = self.signs(y, sense)
        return self.rub.settled(self.rub.mode(sense, signs), self.motion.instant(t, y), place)[0], signs

    def waited(self, t: float, y: Array, until: float) -> AcceptedSteps:
        """A standstill, until loads break it."""
        leaves, end = self.leaving(y), until
        if self.rub.model.varying:
            end, self.released = standstill.release(lambda times: np.array([*map(leaves, times)]).T, t, until)
        return AcceptedSteps(lambda t, y: np.zeros_like(y), np.array([t, end]), np.array([y, y]), 2)

    def moved(
        self, t: float, y: Array, mode: FrictionMode, signs: Array, until: float, rtol: float, atol: Array
    ) -> tuple[AcceptedSteps, bool]:
        """A piece; true if the machine stops at its end."""
        motion, rub, stopped = self.motion, self.rub, False

        def rates(t: float, y: Array) -> Array:
            instant = motion.instant(t, y)
            return motion.rates(y, instant, mode.factors * rub.sizes(mode, instant, motion.place(y)))

        def parts(t: float, y: Array) -> Array:
            """The forces that the passive actions follow, (p, 2)."""
            instant = motion.instant(t, y)
            sizes = rub.sizes(mode, instant, motion.place(y))
            return np.asarray(instant.free + instant.response @ (mode.factors * sizes))

        def changed(t: float, y: Array, forces: Array) -> bool:
            nonlocal stopped
            stopped = motion.speed(y) * mode.sense < 0.0
            if stopped:
                return True
            slips = motion.slips(y)
            slips = np.where(np.abs(slips) > _STILL, np.sign(slips), 0.0)
            if np.any(slips * signs < 0.0) or np.any((signs == 0.0) & (slips != 0.0)):
                return True
            against = mode.bearing * forces[:, 0] < -_LIFTED * np.abs(forces).max()
            return bool(np.any(rub.single & against))

        def event(low: float, high: float, dense: Callable[[float], Array]) -> float | None:
            def has_changed(t: float) -> bool:
                y = dense(t)
                return changed(t, y, parts(t, y))

            before, first, nudge = low, parts(low, dense(low)), 1e-6 * (high - low)
            for look in (low + _LOOKS * (high - low)).tolist():
                y = dense(look)
                last = parts(look, y)
                if changed(look, y, last):
                    end = threshold(has_changed, before, look, _INSTANT * (look - before))
                    has_changed(end)  # whether it stops there
                    return end
                way = last - first  # a resultant that passes close by zero is as good as one that turns there
                turns = ((first * way).sum(axis=1) < 0.0) & ((last * way).sum(axis=1) > 0.0)
                passing = np.abs(first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]) < _NEAR_ZERO * (way**2).sum(axis=1)
                for p in np.flatnonzero(turns & passing & ~rub.single).tolist():

                    def leaves(t: float, p: int = p) -> bool:
                        here = parts(t, dense(t))[p]
                        return float(here @ (parts(t + nudge, dense(t + nudge))[p] - here)) > 0.0

                    end = threshold(leaves, before, look, _INSTANT * (look - before))
                    if end - low > 1e-3 * (high - low):
                        return end
                before, first = look, last
            return None

        correct = getattr(motion, "correct", None)
        steps = integrate(rates, y, until, rtol, atol, correct, None, event, t)
        return steps, stopped

    def at(self, t: float) -> Array:
        """State at any time."""
        begins = [steps.s[0] for steps, _ in self.parts]
        return self.parts[max(int(np.searchsorted(begins, t, side="right")) - 1, 0)][0].at(t)


def with_friction(model: LinkageModel, q: float, qdot: float, until: float, rtol: float, newton: bool) -> LinkageMotion:
    """Motion with friction in joints, at the actual speed and with the reactions of the same instant."""
    rub = Resistances(model)
    rub.determined()
    motion: Rough
    x, g = Closure(model).at(q)
    begun = model.state(x, g * qdot)
    energy = 0.5 * float(model.masses @ begun.v**2) + float(np.abs(model.forces(0.0, begun)) @ model.scale)
    works = [rtol * energy or np.inf] * (1 + len(rub.names))
    if newton:
        motion = RoughByDriver(model, rub)
        y, atol = np.zeros(3 + len(rub.names)), np.array((rtol * model.unit, rtol * model.unit, *works))
        y[:2] = q, qdot
    else:
        motion = RoughInAllCoordinates(model, rub, x, g)
        y = np.concatenate((x, g * qdot, np.zeros(len(works))))
        atol = np.concatenate((rtol * model.scale, rtol * model.scale, works))
    pieces = RoughMotion(motion, rub, y, until, 0.1 * rtol, 0.1 * atol)  # many restarts add up, and resultants turn sharply
    rows = np.concatenate([steps.states for steps, _ in pieces.parts])
    t = np.concatenate([steps.s for steps, _ in pieces.parts])
    modes = [mode for steps, mode in pieces.parts for _ in steps.s]
    states, p = motion.states(rows), len(rub.names)
    reactions, pushes = rub.wrenches(states, motion.wrenches(states))
    n = model.masses.size
    matrix, first = system(model, model.forces(t, states), states, reactions)
    right = np.zeros((*first.shape, 1 + p))
    right[..., 0], right[:, :n, 1:] = first, pushes
    response = model.solved(matrix, right)[:, n:]
    amounts = np.full((t.size, p), np.nan)
    for k, mode in enumerate(modes):
        if mode.sense:
            sized = rub.forms @ response[k]
            instant = UnitResponses(sized[..., 0], sized[..., 1:], 0.0, np.zeros(p), np.zeros(p), 0.0)
            amounts[k] = mode.factors * rub.sizes(mode, instant, float(states.q[k]))

    def by_joint(columns: Array) -> dict[str, Array]:
        which = [
            (name, rub.slips >= 0, np.array([other == name for other in rub.names])) for name in dict.fromkeys(rub.names)
        ]
        return {name: columns[:, rubs & own].sum(axis=1) for name, rubs, own in which if np.any(rubs & own)}

    def at(t: float) -> tuple[float, float]:
        state = motion.states(pieces.at(t)[None])
        return float(state.q[0]), float(state.qdot[0])

    return LinkageMotion(
        t,
        states,
        rows[:, -1 - p],
        sum(steps.evaluations for steps, _ in pieces.parts),
        max(getattr(motion, "drifts", [0.0])),
        at,
        response[..., 0] + np.einsum("nmp,np->nm", response[..., 1:], amounts),
        by_joint(amounts),
        by_joint(rows[:, -p:]),
        tuple((float(steps.s[0]), float(steps.s[-1])) for steps, mode in pieces.parts if not mode.sense),
        tuple(pieces.messages),
    )
