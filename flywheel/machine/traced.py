"""The walk over a machine's graph as recorded straight-line programs, one for each smooth piece and what is asked there.

The reduction walks its graph once with recorded numbers (`bondgraph.recording`); what it leaves behind gives the same sums
thirty times as fast, for one position or arrays of them. Loads that do not act in a piece cost nothing there. Branches are
decided at the piece's anchor, as by the walk itself; where speed or time decide them, a program holds for all anchors that
keep its guards. What cannot be recorded is left to the walk, and `why` says what that was.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from bondgraph.elements import Here
from bondgraph.recording import NAMESPACE, Conditions, Program, Recorder
from bondgraph.records import NamedTuple
from bondgraph.reduction import Reduced, count
from flywheel.machine.dynamics import DRIVE, Array, circuit_of
from flywheel.machine.machine import Anchor, Machine

_MOST = 64  # programs kept for one piece: each is another way for branches that speed or time decides


class Piece(NamedTuple):
    """A program of a smooth piece, and the guards of the speed and time at its anchor (None: it holds for any)."""

    program: Program
    conditions: Conditions | None


class TracedMachine:
    """Programs of a machine, recorded when they are first asked for.

    `why` says what could not be recorded, empty where everything could so far.

    >>> import flywheel
    >>> rotor = {"inertia": [{"on": "crank", "value": 2}], "regime": {"speed": 10}, "flywheel": {"inertia": 1}}
    >>> machine = flywheel.Machine(flywheel.load({**rotor, "load": [{"on": "crank", "torque": "3*phi"}]}))
    >>> machine.traced.reduced(1.0).function("math")(0.5)[:3]
    (2.0, 0.0, 1.5)
    >>> machine.traced.motion(Anchor(1.0, None, None)).function("math")(0.5, 10.0, 0.0, 0.0)
    (2.0, 0.0, 1.5)
    """

    def __init__(self, machine: Machine) -> None:
        self.machine, self.why = machine, ""
        self.compared = set[tuple[Any, ...]]()  # places and branches where a program was found to be the walk
        self._reduced: dict[float, Program | None] = {}
        self._circuit = circuit_of(machine.scene) is not None
        self._pieces: dict[tuple[float, bool], list[Piece] | None] = {}

    def reduced(self, anchor: float) -> Program | None:
        """What `machine.reduce` gives in the piece of an anchor (rad): from phi (rad) to the seven parts of `Reduced`."""
        if anchor not in self._reduced:
            self._reduced[anchor] = self._recorded_reduction(anchor)
        return self._reduced[anchor]

    def positions(self, anchor: float) -> Program | None:
        """Where everything stands in the piece of an anchor (rad), by phi: rad or m, in the order of `machine.places`."""
        recorder, scene = Recorder(), self.machine.scene
        phi, outputs = recorder.input("phi"), list[Any]()
        try:
            for name, place in self.machine.places.items():
                motion = self.machine.motion_of(name)
                rate = scene.shafts.get(motion.of, 1.0)
                position = motion.position(rate * phi, NAMESPACE, rate * anchor)
                outputs.append(place.displacement(Here(rate * phi, position, NAMESPACE)))
            return recorder.program(outputs)
        except Exception as error:
            self.why = self.why or str(error)
            return None

    @cached_property
    def over_cycle(self) -> Callable[[Array, Array], Reduced] | None:
        """What `machine.reduce` gives at angles and anchors of any pieces: what changes between pieces does so by anchors.

        None where more than a choice of values does.
        """
        if any(mechanism.linkage is not None for mechanism in self.machine.scene.mechanisms):
            return None  # of these every piece follows a branch of its own
        recorder = Recorder()
        places = [recorder.input(name) for name in ("phi", "anchor")]
        try:
            values = recorder.program(self.machine.reduction(places[0], places[1], NAMESPACE), places).function("numpy")
        except Exception:  # whatever a law does with a number still to come
            return None

        def reduced(phi: Array, anchor: Array) -> Reduced:
            count(phi)
            return Reduced(*values(phi, anchor))

        return reduced

    def motion(self, anchor: Anchor) -> Program | None:
        """What moves the machine in the piece of an anchor, as the equation of motion takes it.

        From phi (rad), the crank's omega (rad/s), time (s) and the value of the scene's unknown to I* (kg m²), dI*/dphi
        (kg m²/rad) and M* (N m) of one stage after another, the flywheel and a motor's circuit left out. Branches that speed
        or time decides are those at the anchor; without a speed there, those at every instant itself. In plain floats
        (`function("math")`) it raises ValueError or ArithmeticError where a law is not defined.
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
        self._pieces[key] = None if recorded is None else [*pieces[1 - _MOST :], recorded]
        return None if recorded is None else recorded.program

    def _recorded_reduction(self, anchor: float) -> Program | None:
        recorder = Recorder()
        phi = recorder.input("phi")
        try:
            return recorder.program(self.machine.reduction(phi, anchor, NAMESPACE))
        except Exception as error:  # whatever a law does with a number still to come
            self.why = self.why or str(error)
            return None

    def _recorded_motion(self, anchor: Anchor) -> Piece | None:
        recorder = Recorder()
        arguments = phi, omega, time, unknown = [recorder.input(name) for name in ("phi", "omega", "time", "unknown")]
        deciding = [] if anchor.omega is None else [recorder.input(f"at anchor {k}", at) for k, at in enumerate(anchor[1:3])]
        outputs: list[Any] = []
        try:
            for stage in self.machine.stages:
                station = stage.reduction.at(phi, anchor.phi, NAMESPACE)
                reduced = station.reduced
                moment = reduced.moment + unknown * reduced.per_unknown - reduced.resistance * omega
                for element, effort, factor in station.contributions(omega, time, *deciding):
                    if not (self._circuit and element.name.startswith(DRIVE)):
                        moment = moment + (effort + unknown * factor)
                outputs += [reduced.inertia, reduced.slope, moment]
            conditions = recorder.conditions(deciding) if recorder.guards else None
            return Piece(recorder.program(outputs, arguments), conditions)
        except Exception as error:
            self.why = self.why or str(error)
            return None
