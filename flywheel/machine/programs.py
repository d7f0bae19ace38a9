"""The reduction of a machine as recorded straight-line programs, of positions and speeds, or of a scene's numbers as well.

A walk over the graph with recorded numbers (`bondgraph.recording`) leaves a program behind that gives the same sums thirty
times as fast, for one position or arrays of them.

`Programs` are those of one machine, one for each smooth piece. Loads that do not act in a piece cost nothing there. Branches
are decided at the piece's anchor, as by the walk itself; where speed or time decide them, a program holds for all anchors
that keep its guards. What cannot be recorded is left to the walk, and `why` says what that was. What moves the machine is
compared with the walk as soon as it is recorded, at positions all over its piece, and refused where it differs.

`RecordedMachine` is a machine whose numbers are recorded too. Where a plain machine proves by bounds at which angles a law
switches or a place turns back, the recorded one starts from those angles of its plain twin, the machine at the values that
its numbers have now, and follows each by a fixed number of Newton's steps. That the last step is next to nothing is a guard;
so are the order of all angles, and every decision there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.numerics import count
from bondgraph.recording import NAMESPACE, Conditions, Program, Recorded, Recorder
from bondgraph.reduction import Reduced, Station
from flywheel.machine.loads import Effort
from flywheel.machine.machine import DRIVE, Anchor, Machine, circuit_of
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.functions import present
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.scene.scene import Scene

Array = NDArray[Any]
Function = Callable[[Any], tuple[Any, Any]]
"""A value and its slope at a crank angle."""

_WALKS = 5  # over a cycle: as many take as long as a recording
_MOST_PROGRAMS = 64  # programs kept for one piece: each is another way for branches that speed or time decides
_SHARES = np.array([0.02, 0.14, 0.31, 0.47, 0.66, 0.85, 0.99])  # of a piece: where a program is compared with the walk
_PROGRAM_ERROR = 1e-10  # of the sum of what makes up a value: by how much they may differ
_RECORDING_ERRORS = (TypeError, ValueError, ArithmeticError)  # what cannot be recorded, or a law that is not defined
_NEWTON_STEPS = 8  # of Newton's method, from the twin's angle
_LAST_STEP = 1e-12  # of the cycle: the last step, at most
_ZERO_DISTANCE = 1e-6  # of the cycle: how far off a step of Newton's method may see the zero that an angle is
_JETS = jet_namespace(NAMESPACE)


# -- of one machine ----------------------------------------------------------------------------------------------------


class Piece(NamedTuple):
    """A program of a smooth piece, and the guards of the speed and time at its anchor (None: it holds for any)."""

    program: Program
    conditions: Conditions | None


class Programs:
    """Programs of a machine, recorded when they are first asked for.

    `why` says what could not be recorded, empty where everything could so far.

    >>> import flywheel
    >>> rotor = {"inertia": [{"on": "crank", "value": 2}], "regime": {"speed": 10}, "flywheel": {"inertia": 1}}
    >>> machine = flywheel.Machine(flywheel.load({**rotor, "load": [{"on": "crank", "torque": "3*phi"}]}))
    >>> programs_of(machine).motion(Anchor(1.0, None, None)).function("math")(0.5, 10.0, 0.0, 0.0)
    (2.0, 0.0, 1.5)
    """

    def __init__(self, machine: Machine) -> None:
        self.machine, self.why = machine, ""
        self._walks = 0
        self._circuit = circuit_of(machine.scene) is not None
        self._pieces: dict[tuple[float, bool], list[Piece] | None] = {}

    @cached_property
    def over_cycle(self) -> Callable[[Array, Array], Reduced] | None:
        """The recorded `machine.reduce` at angles and anchors of any pieces: only the anchors distinguish pieces.

        None where more than a choice of values does.
        """
        if any(mechanism.linkage is not None for mechanism in self.machine.scene.mechanisms):
            return None  # of these every piece follows a branch of its own
        recorder = Recorder()
        places = [recorder.input(name) for name in ("phi", "anchor")]
        try:
            values = recorder.program(self.machine.reduction(places[0], places[1], NAMESPACE), places).function("numpy")
        except _RECORDING_ERRORS:
            return None

        def reduced(phi: Array, anchor: Array) -> Reduced:
            count(phi)
            return Reduced(*values(phi, anchor))

        return reduced

    def cells(self, phi: Array, anchor: Array) -> Reduced:
        """The result of `machine.reduce` for cells of any pieces, from a recording once enough calls make it pay."""
        self._walks += 1
        recorded = self.over_cycle if self._walks > _WALKS else None
        return self.machine.reduction(phi, anchor) if recorded is None else recorded(phi, anchor)

    def motion(self, anchor: Anchor) -> Program | None:
        """The terms of the equation of motion in the piece of an anchor, as a program.

        From phi (rad), the crank's omega (rad/s), time (s) and the value of the scene's unknown to I* (kg m²), dI*/dphi
        (kg m²/rad) and M* (N m) of one stage after another, the flywheel and a motor's circuit left out. Branches that speed
        or time decides are those at the anchor; without a speed there, those at every instant itself. In plain floats
        (`function("math")`) it raises ValueError or ArithmeticError where a law is not defined.

        Raises:
            SceneError: where the program is not the walk, which is an error of ours.

        """
        key = float(anchor.phi), anchor.omega is None
        pieces = self._pieces.setdefault(key, [])
        if pieces is None:
            return None
        at = (anchor.omega, anchor.time)
        for piece in pieces:
            if piece.conditions is None or piece.conditions.kept(*at):
                return piece.program
        recorded = self._recorded_motion(anchor)
        if recorded is not None:
            self._compare(recorded.program, anchor)
        self._pieces[key] = None if recorded is None else [*pieces[1 - _MOST_PROGRAMS :], recorded]
        return None if recorded is None else recorded.program

    def _recorded_motion(self, anchor: Anchor) -> Piece | None:
        recorder = Recorder()
        arguments = phi, omega, time, unknown = [recorder.input(name) for name in ("phi", "omega", "time", "unknown")]
        deciding = [] if anchor.omega is None else [recorder.input(f"at anchor {k}", at) for k, at in enumerate(anchor[1:3])]
        outputs: list[Any] = []
        try:
            for stage in self.machine.stages:
                station = stage.reduction.at(phi, anchor.phi, NAMESPACE)
                moment = sum(self._shares(station, omega, time, unknown, deciding))
                outputs += [station.reduced.inertia, station.reduced.slope, moment]
            conditions = recorder.conditions(deciding) if recorder.guards else None
            return Piece(recorder.program(outputs, arguments), conditions)
        except _RECORDING_ERRORS as error:
            self.why = self.why or str(error)
            return None

    def _shares(self, station: Station, omega: Any, time: Any, unknown: Any, deciding: Sequence[Any]) -> Iterator[Any]:
        """The terms of M* of a stage, without the flywheel and a motor's circuit."""
        reduced = station.reduced
        yield reduced.moment
        yield unknown * reduced.per_unknown
        yield -(reduced.resistance * omega)
        for element, effort, factor in station.contributions(omega, time, *deciding):
            if not (self._circuit and element.name.startswith(DRIVE)):
                yield effort + unknown * factor

    def _compare(self, program: Program, anchor: Anchor) -> None:
        """Refuses a program that is not the walk all over the piece of its anchor, where both are defined."""
        edges = self.machine.breakpoints
        k = int(np.clip(np.searchsorted(edges, anchor.phi) - 1, 0, edges.size - 2))
        phi = edges[k] + _SHARES * (edges[k + 1] - edges[k])
        omega, time = (self.machine.typical_speed, 0.0) if anchor.omega is None else (float(anchor.omega), anchor.time)
        deciding = [] if anchor.omega is None else [omega, time]
        with np.errstate(all="ignore"):
            found = program.function("numpy")(phi, omega, time, 1.0)
            for k, stage in enumerate(self.machine.stages):
                station = stage.reduction.at(phi, anchor.phi)
                reduced, shares = station.reduced, [*self._shares(station, omega, time, 1.0, deciding)]
                size = reduced.exchanged + sum(np.abs(share) for share in shares)
                scales = (reduced.inertia, reduced.inertia), (reduced.slope, reduced.steepness), (sum(shares), size)
                for value, (walk, scale) in zip(found[3 * k : 3 * k + 3], scales, strict=True):
                    apart = np.abs(value - walk) > _PROGRAM_ERROR * scale
                    if np.any(apart):
                        at = phi[np.broadcast_to(apart, phi.shape)][0]
                        text = f"a recording that is not the machine at {at:.6g} rad"
                        raise SceneError([Fault("simulation", text, "the walk of its bond graph", "report this")])


def programs_of(machine: Machine) -> Programs:
    """The programs of a machine: they are kept with it."""
    if "programs" not in machine.kept:
        machine.kept["programs"] = Programs(machine)
    found: Programs = machine.kept["programs"]
    return found


# -- with recorded numbers ---------------------------------------------------------------------------------------------


class UnrecordedError(ValueError):
    """Reason why a machine cannot be followed with recorded numbers, in words."""


class RecordedMachine(Machine):
    """A machine from a scene with recorded numbers, beside its plain `twin` from the scene with their values.

    `zeros` are the angles (rad) that were followed, each with the function whose zero it is.
    """

    def __init__(self, scene: Scene, twin: Machine) -> None:
        self.twin = twin
        self.zeros: list[tuple[Any, Function]] = []
        super().__init__(scene)

    @cached_property
    def landmarks(self) -> Array:
        """The breakpoints, and what closes in on narrow features, at the same share of its smooth piece as in the twin."""
        own, plain = self.breakpoints, self.twin.breakpoints
        if own.size != plain.size:
            raise UnrecordedError("angles at which loads break meet within rounding")
        inner = self.twin.landmarks[~np.isin(self.twin.landmarks, plain)]
        piece = np.searchsorted(plain, inner) - 1
        share = (inner - plain[piece]) / (plain[piece + 1] - plain[piece])
        between = own[piece] + share * (own[piece + 1] - own[piece])
        return np.concatenate((own, between))[np.argsort(np.concatenate((plain, inner)))]

    def decided(self, effort: Effort, part: Expression, phi: Any, anchor: Any) -> Jet:
        """The value, and its slope, of what decides a branch of a load's law; its own branches are decided at the anchor."""
        names = self._names(effort)
        found = part.evaluate(names(phi, anchor, NAMESPACE), _JETS, names(anchor, anchor, np))
        return found if isinstance(found, Jet) else Jet(found, 0.0)

    def named(self, effort: Effort, phi: Any, anchor: Any) -> dict[str, Any]:
        """Values of the names in a load's expression at a crank angle."""
        law = effort.load.law
        if not isinstance(law, Expression):
            return {}
        found = self._names(effort)(phi, anchor, NAMESPACE)
        return {name: value.value if isinstance(value, Jet) else value for name, value in found.items() if name in law.names}

    def _switch_angles(self, known: Array) -> Iterator[tuple[str, float]]:
        efforts = {effort.path: effort for effort in self.efforts}

        def decider(path: str, part: Expression, anchor: float, phi: Any) -> tuple[Any, Any]:
            found = self.decided(efforts[path], part, phi, anchor)
            return found.value, found.first

        for path, angle in self.twin._switch_angles(self.twin._unswitched):
            parts = deciders(efforts[path])
            yield path, self._followed(angle, [partial(decider, path, part, angle) for part in parts])

    def _dead_centres(self, place: str, smooth: Array) -> Array:
        variable = self.kinematics.variable[self.places[place].junction]

        def flow(anchor: float, phi: Any) -> tuple[Any, Any]:
            flows = self.kinematics.flows(phi, anchor, NAMESPACE)
            return flows.gain[variable], flows.slope[variable]

        angles = self.twin._senses(place).dead_centres.tolist()
        return np.array([self._followed(angle, [partial(flow, angle)]) for angle in angles])

    def _followed(self, angle: float, functions: list[Function]) -> Any:
        """The zero that one of some functions has at an angle now, by Newton's method from there."""
        near, found = _ZERO_DISTANCE * self.scene.cycle, [function(angle) for function in functions]
        if not any(isinstance(value, Recorded) for value, _ in found):
            crossed = (abs(value) < near * abs(slope) for value, slope in found)
            self.zeros += [(angle, function) for function, zero in zip(functions, crossed, strict=True) if zero]
            return angle
        for function, (value, slope) in zip(functions, found, strict=True):
            now, steep = abs(present(value)), abs(present(slope))
            if steep == 0.0 or not now <= near * steep:
                continue
            if not isinstance(value, Recorded):
                self.zeros.append((angle, function))
                return angle
            phi: Any = angle
            step: Any = 0.0
            for _ in range(_NEWTON_STEPS):
                value, slope = function(phi)
                step = value / slope
                phi = phi - step
            settled = _LAST_STEP * self.scene.cycle
            if -settled <= step <= settled:
                self.zeros.append((phi, function))
                return phi
        raise UnrecordedError("an angle at which a law only touches its switch, or a place only stands still")


def deciders(effort: Effort) -> list[Expression]:
    """The parts of a load's law at whose zeros a branch of it changes, as far as position decides it."""
    law = effort.load.law
    if not isinstance(law, Expression):
        return []
    return [part for part in (*law.switches(), *law.branch_points()) if not (part.uses_speed or part.uses_time)]
