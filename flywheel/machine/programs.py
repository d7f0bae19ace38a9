"""The reduction of a machine as recorded straight-line programs, of positions and speeds, or of a scene's numbers as well.

A walk over the graph with recorded numbers (`bondgraph.recording`) gives a program that computes the same sums thirty
times as fast, for one position or arrays of them.

`Programs` are those of one machine, one for each smooth piece. Loads that do not act in a piece cost nothing there. Branches
are decided at the piece's anchor, as by the walk itself; where speed or time decide them, a program holds for all anchors
that keep its guards. Laws that cannot be recorded are left to the walk, and `why` is the reason. The program of the motion
is compared with the walk as soon as it is recorded, at positions all over its piece, and refused where it differs.

`RecordedMachine` is a machine whose numbers are recorded too. Where a plain machine proves by bounds at which angles a law
switches or a place reverses, the recorded one starts from those angles of its plain twin, the machine at the values that
its numbers have now, and follows each by a fixed number of Newton's steps. A guard tests that the last step is negligible;
others test the order of all angles, and every decision there.

`Structure` serves designs of one scene: its pieces, and the walk in each as a program of the numbers that vary, recorded
all the way from reading. Every comparison that reading, mechanisms and breakpoints make with them is a guard. Designs that
keep all guards have the same pieces with the same programs; the first that does not is recorded again. A structure is
accepted if at two more designs it agrees with the plain machine: no breakpoint of the latter lies inside a cell, and all
values at the nodes are the same. Where a design cannot be recorded, the reason is given in words, and it is sized alone.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Here
from bondgraph.numerics import count
from bondgraph.recording import NAMESPACE, Conditions, Program, Recorded, Recorder
from bondgraph.reduction import Reduced, Station
from flywheel.components.motors.motor import motor_program
from flywheel.machine.loads import POSITION, LoadLaw, at_speeds, decided_here, moving_switches
from flywheel.machine.machine import DRIVE, WIDEST, Anchor, Angles, Machine, MeshStage, circuit_of
from flywheel.numerics import expressions
from flywheel.numerics.cells import NODES
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.intervals import NAMESPACE as INTERVALS
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, is_recorded, jet_namespace, present
from flywheel.numerics.switching import FollowedZero, SwitchingError, decided_by_position, followed, narrow, solved
from flywheel.reading.paths import with_numbers
from flywheel.scene.scene import Load, Scene, Table

Array = NDArray[Any]
Function = Callable[[Any], tuple[Any, Any]]
"""A value and its slope at a crank angle."""

_WALKS = 5  # over a cycle: as many take as long as a recording
_FEWEST_INSTANTS = 8  # instants of a place for which a recording does not pay
_MOST_PROGRAMS = 64  # programs kept for one piece: each is another way for branches that speed or time decides
_SHARES = np.array([0.02, 0.14, 0.31, 0.47, 0.66, 0.85, 0.99])  # of a piece: where a program is compared with the walk
_PROGRAM_ERROR = 1e-10  # of the sum of what makes up a value: by how much they may differ
_RECORDING_ERRORS = (TypeError, ValueError, ArithmeticError)  # what cannot be recorded, or a law that is not defined
_SEVERAL, _MANY_PIECES = 3, 24  # edges of pieces: one recording then serves all; those of a machine with a table
_ZERO_DISTANCE = 1e-6  # of the cycle: how far off a step of Newton's method may see the zero that an angle is
_JETS = jet_namespace(NAMESPACE)


# -- of one machine ----------------------------------------------------------------------------------------------------


class Programs:
    """Programs of a machine, recorded at their first use.

    `why` is the part that could not be recorded; empty if there is none so far.

    >>> import flywheel
    >>> rotor = {"inertia": [{"on": "crank", "value": 2}], "regime": {"speed": 10}, "flywheel": {"inertia": 1}}
    >>> machine = flywheel.Machine(flywheel.load({**rotor, "load": [{"on": "crank", "torque": "3*phi"}]}))
    >>> programs_of(machine).motion(Anchor(1.0, None, None)).function("math")(0.5, 10.0, 0.0, 0.0)
    (2.0, 0.0, 1.5)
    """

    def __init__(self, machine: Machine) -> None:
        self.machine, self.why = machine, ""
        self._walks = 0
        self._pieces: dict[tuple[float, int | None], list[tuple[Program, Conditions | None]] | None] = {}
        self._whole: dict[bool, Callable[[Anchor], tuple[Program, None]] | None] = {}
        self._instants: dict[tuple[float, int | None], int] = {}
        # with the program, so that ids stay
        self._functions: dict[tuple[int, str], tuple[Program, Callable[..., tuple[Any, ...]]]] = {}

    @cached_property
    def over_cycle(self) -> Callable[[Array, Array], Reduced] | None:
        """The recorded `machine.reduce` at angles and anchors of any pieces: only the anchors distinguish pieces.

        None if pieces differ by more than a choice of values.
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
            SceneError: if the program differs from the walk, which is a defect of this package.

        """
        key = self._place(anchor)
        pieces = self._pieces.setdefault(key, [])
        if pieces is None:
            return None
        for program, conditions in pieces:
            if conditions is None or conditions.kept(anchor.omega, anchor.time):
                return program
        if (decided := anchor.omega is not None) not in self._whole:
            self._whole[decided] = self._over_pieces(decided=decided)
        recorded = (self._whole[decided] or self._of_piece)(anchor)
        self._pieces[key] = recorded and [*pieces[1 - _MOST_PROGRAMS :], recorded]
        return recorded and recorded[0]

    def function(self, program: Program, kind: str) -> Callable[..., tuple[Any, ...]]:
        """A program of `motion` as a function (see `Program.function`), made once."""
        key = id(program), kind
        if key not in self._functions:
            self._functions[key] = program, program.function(kind)
        return self._functions[key][1]

    def pays(self, anchor: Anchor) -> bool:
        """Tests whether an anchor has a program or a share in one, or so many calls, each counted, that one pays."""
        place = self._place(anchor)
        if place in self._pieces or self._whole.get(anchor.omega is not None):
            return True
        self._instants[place] = self._instants.get(place, 0) + 1
        return self._instants[place] > _FEWEST_INSTANTS

    @cached_property
    def _of_pieces(self) -> bool:
        """Tests whether its piece, speed and time decide every branch at an anchor, wherever in the piece it lies."""
        laws = [effort.load.law for effort in self.machine.efforts]
        parts = [part for law in laws if isinstance(law, Expression) for part in moving_switches(law)]
        senses = [part for part in parts if part.names == {"v"} and part.tree.op in ("name", "neg")]  # one sign each
        return not any(part.names & POSITION for part in parts if part not in senses)

    def _place(self, anchor: Anchor) -> tuple[float, int | None]:
        """The key of programs: the piece of an anchor between switches, or its very angle; the sign of its speed, if any."""
        sense = None if anchor.omega is None else int(anchor.omega > 0.0) - int(anchor.omega < 0.0)
        return float(bisect_left(self._edges, anchor.phi)) if self._of_pieces else float(anchor.phi), sense

    @cached_property
    def _edges(self) -> list[float]:
        """The angles at which pieces meet: of plain numbers the piece of one is found sooner."""
        return list(self.machine.switches.tolist())

    def _of_piece(self, anchor: Anchor) -> tuple[Program, Conditions | None] | None:
        """The program of a smooth piece, and the guards of the speed and time at its anchor (None: it holds for any)."""
        recorder = Recorder()
        arguments = [recorder.input(name) for name in ("phi", "omega", "time", "unknown")]
        deciding = [] if anchor.omega is None else [recorder.input(f"at anchor {k}", at) for k, at in enumerate(anchor[1:3])]
        try:
            outputs = self._terms(anchor.phi, *arguments, deciding=deciding)
            conditions = recorder.conditions(deciding) if recorder.guards else None
            program = recorder.program(outputs, arguments)
        except _RECORDING_ERRORS as error:
            self.why = self.why or str(error)
            return None
        edges = self.machine.switches
        k = int(np.clip(np.searchsorted(edges, anchor.phi) - 1, 0, edges.size - 2))
        omega, time = (self.machine.typical_speed, 0.0) if anchor.omega is None else (float(anchor.omega), anchor.time)
        phi, then = edges[k] + _SHARES * (edges[k + 1] - edges[k]), [] if anchor.omega is None else [omega, time]
        self._compare(self.function(program, "numpy"), anchor.phi, phi, omega, time, then)
        return program, conditions

    def _over_pieces(self, *, decided: bool) -> Callable[[Anchor], tuple[Program, None]] | None:
        """The same from one recording, by what an anchor decides in it, if `decided` by the sign of its speed, too.

        None where few pieces do not make that pay.
        """
        edges = self.machine.switches
        if edges.size < _SEVERAL or not self._of_pieces or self.machine.switches_at_speeds:
            return None
        recorder = Recorder()
        anchor, *deciding = [recorder.input(name) for name in ("anchor", "deciding")[: 1 + decided]]
        places = [recorder.input(name) for name in ("phi", "omega", "time", "unknown")]
        try:
            program = recorder.program(self._terms(anchor, *places, deciding=deciding), [anchor, *deciding, *places])
        except _RECORDING_ERRORS:
            return None
        if recorder.guards:
            return None
        middle, speed, law = 0.5 * (edges[:-1] + edges[1:]), self.machine.typical_speed, program.function("math")
        there = [speed] * len(deciding)
        try:
            for angle in middle[:: 1 + middle.size // _MANY_PIECES].tolist():
                law(angle, *there, angle, speed, 0.0, 1.0)
        except (ValueError, ArithmeticError):  # a law that is not defined where it does not act
            return None
        anchors, phi = middle[:, None], edges[:-1, None] + _SHARES * np.diff(edges)[:, None]
        self._compare(partial(program.function("numpy"), anchors, *there), anchors, phi, speed, 0.0, there)
        early, late = program.split(4)
        at_anchor, kinds = early.function("math"), dict[tuple[bool | float | None, ...], Program]()
        # loads that do not act in a piece cost nothing there; which is little beside a linkage, or a choice for each row
        linked = any(mechanism.linkage for mechanism in self.machine.scene.mechanisms)
        chooses = edges.size < _MANY_PIECES and not linked

        def of_piece(anchor: Anchor) -> tuple[Program, None]:
            values = at_anchor(*anchor[: 1 + decided])
            kind = tuple([v if v == 0.0 or type(v) is bool else None for v in values]) if chooses else ()
            if kind not in kinds:
                known = {n: value for n, value in enumerate(kind) if value is not None}
                kinds[kind] = chosen(late, known).bound(values)
            program = kinds[kind]
            return program._replace(places=(*values, *program.places[len(values) :])), None

        return of_piece

    def _terms(
        self, anchor: Any, phi: Any, omega: Any, time: Any, unknown: Any, *, deciding: Sequence[Any] = ()
    ) -> list[Any]:
        """The terms of `motion` at recorded numbers, one stage after another."""
        terms: list[Any] = []
        whole = self.machine.reduction.at(phi, anchor, NAMESPACE)
        for stage in self.machine.stages:
            station = whole.of(stage.reduction)
            moment = sum(self._shares(station, omega, time, unknown, deciding))
            terms += [station.reduced.inertia, station.reduced.slope, moment]
        return terms

    def _shares(self, station: Station, omega: Any, time: Any, unknown: Any, deciding: Sequence[Any]) -> Iterator[Any]:
        """The terms of M* of a stage, without the flywheel and a motor's circuit."""
        reduced, circuit = station.reduced, circuit_of(self.machine.scene)
        yield reduced.moment
        yield unknown * reduced.per_unknown
        yield -(reduced.resistance * omega)
        for element, effort, factor in station.contributions(omega, time, *deciding):
            if circuit is None or not element.name.startswith(DRIVE):
                yield effort + unknown * factor

    def _compare(self, values: Any, anchor: Any, phi: Array, omega: Any, time: Any, deciding: Sequence[Any]) -> None:
        """Refuses the values of a program that differ from the walk at positions phi, where both are defined.

        Beside a dead centre both may be rounding alone: no more than the moments of the whole cycle have then counts.
        """
        edges = self.machine.breakpoints
        middle = 0.5 * (edges[:-1] + edges[1:])
        with np.errstate(all="ignore"):
            outputs = values(phi, omega, time, 1.0)
            for k, stage in enumerate(self.machine.stages):
                reduced, moment, size = self._walked(stage, phi, anchor, omega, time, deciding)
                scales = (reduced.inertia, reduced.inertia), (reduced.slope, reduced.steepness), (moment, size)
                for value, (walk, scale) in zip(outputs[3 * k : 3 * k + 3], scales, strict=True):
                    apart = np.abs(value - walk) > _PROGRAM_ERROR * scale
                    if np.any(apart) and walk is moment:
                        sizes = self._walked(stage, middle, middle, omega, time, deciding)[2]
                        whole = np.max(sizes, where=np.isfinite(sizes), initial=0.0)
                        apart = np.abs(value - walk) > _PROGRAM_ERROR * np.maximum(scale, whole)
                    if np.any(apart):
                        at = phi[np.broadcast_to(apart, phi.shape)][0]
                        text = f"a recording that is not the machine at {at:.6g} rad"
                        raise SceneError([Fault("simulation", text, "the walk of its bond graph", "report this")])

    def _walked(
        self, stage: MeshStage, phi: Array, anchor: Any, omega: Any, time: Any, deciding: Sequence[Any]
    ) -> tuple[Reduced, Any, Any]:
        """A stage by the walk, its moment with the unknown 1, and the sum of what makes that up."""
        station = stage.reduction.at(phi, anchor)
        shares = [*self._shares(station, omega, time, 1.0, deciding)]
        return station.reduced, sum(shares), station.reduced.exchanged + sum(np.abs(share) for share in shares)


def programs_of(machine: Machine) -> Programs:
    """The programs of a machine: they are kept with it."""
    if "programs" not in machine.kept:
        machine.kept["programs"] = Programs(machine)
    programs: Programs = machine.kept["programs"]
    return programs


def chosen(program: Program, known: Mapping[int, bool | float]) -> Program:
    """A program for inputs, by their numbers, that are known to be true, false or 0: what has no effect is left out.

    >>> program = Program(("a", "b", "c"), (), (("multiply", 1, 2), ("where", 0, 3, 1)), (4,))
    >>> chosen(program, {0: True}).operations, chosen(program, {0: False}).operations, chosen(program, {0: True, 2: 0.0})
    ((('multiply', 1, 2),), (), Program(inputs=('a', 'b', 'c'), places=(), operations=(), outputs=(2,)))
    """
    same, operations = dict[int, int](), list[tuple[Any, ...]]()
    zeros = {n for n, value in known.items() if type(value) is not bool}
    for n, (name, *numbers) in enumerate(program.operations, len(program.inputs) + len(program.places)):
        operands = [same.get(number, number) for number in numbers]
        nothing = [number for number in operands if number in zeros]
        if name == "where" and operands[0] in known:
            same[n] = operands[1 if known[operands[0]] else 2]
        elif name in ("multiply", "negative") and nothing:
            same[n] = nothing[0]
        elif name == "add" and nothing:
            same[n] = operands[0] if operands[1] in zeros else operands[1]
        elif name == "subtract" and operands[1] in zeros:
            same[n] = operands[0]
        operations.append((name, *operands))
    outputs = tuple(same.get(n, n) for n in program.outputs)
    return program._replace(operations=tuple(operations), outputs=outputs).only(len(outputs))


# -- with recorded numbers ---------------------------------------------------------------------------------------------


class UnrecordedError(ValueError):
    """Reason why a machine cannot be followed with recorded numbers, in words."""


class RecordedMachine(Machine):
    """A machine from a scene with recorded numbers, beside its plain `twin` from the scene with their values."""

    def __init__(self, scene: Scene, twin: Machine, recorder: Recorder) -> None:
        self.twin, self._recorder = twin, recorder
        super().__init__(scene)

    def _mark(self, name: str, solved: Callable[[], Angles], *, of_loads: bool = True) -> Angles:
        return solved()

    @cached_property
    def landmarks(self) -> Array:
        """The breakpoints, and edges around narrow features, at the same share of their smooth piece as in the twin."""
        own, plain = self.breakpoints, self.twin.breakpoints
        if own.size != plain.size:
            raise UnrecordedError("angles at which loads break meet within rounding")
        inner = self.twin.landmarks[~np.isin(self.twin.landmarks, plain)]
        piece = np.searchsorted(plain, inner) - 1
        share = (inner - plain[piece]) / (plain[piece + 1] - plain[piece])
        between = own[piece] + share * (own[piece + 1] - own[piece])
        return np.concatenate((own, between))[np.argsort(np.concatenate((plain, inner)))]

    def decided(self, effort: LoadLaw, part: Expression, phi: Any, anchor: Any) -> Jet:
        """Value and slope of a function that decides a branch of a load's law; its own branches are those at the anchor."""
        names = self._names(effort)
        values = part.evaluate(names(phi, anchor, NAMESPACE), _JETS, names(anchor, anchor, np))
        return values if isinstance(values, Jet) else Jet(values, 0.0)

    def named(self, effort: LoadLaw, phi: Any, anchor: Any) -> dict[str, Any]:
        """Values of the names in a load's expression at a crank angle."""
        law = effort.load.law
        if not isinstance(law, Expression):
            return {}
        symbols = self._names(effort)(phi, anchor, NAMESPACE)
        used = {name: value for name, value in symbols.items() if name in law.names}
        return {name: value.value if isinstance(value, Jet) else value for name, value in used.items()}

    def _switch_angles(self, edges: Array) -> Iterator[tuple[str, float]]:
        efforts = {effort.path: effort for effort in self.efforts}

        def decider(path: str, part: Expression, anchor: float, phi: Any) -> tuple[Any, Any]:
            value = self.decided(efforts[path], part, phi, anchor)
            return value.value, value.first

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
        """The zero that one of some functions has at an angle now; of floats that very angle."""
        near, values = _ZERO_DISTANCE * self.scene.cycle, [function(angle) for function in functions]
        for function, (value, slope) in zip(functions, values, strict=True):
            now, steep = abs(present(value)), abs(present(slope))
            if steep == 0.0 or not now <= near * steep:
                continue
            if self._recorder.exact:
                return solved(self._recorder, function, angle)
            if not isinstance(value, Recorded):
                return angle
            with suppress(SwitchingError):
                return followed(function, angle, self.scene.cycle)
        if not any(isinstance(value, Recorded) for value, _ in values):
            return angle
        raise UnrecordedError("an angle at which a law only touches its switch, or a place only stands still")


def deciders(effort: LoadLaw) -> list[Expression]:
    """The parts of a load's law at whose zeros a branch of it changes, if position decides it."""
    law = effort.load.law
    return decided_by_position(law) if isinstance(law, Expression) else []


Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

_WIDTH_ROUNDING = 1e-12  # of a cell's width: what rounding may add
_SAMPLE, _MOST_DOUBLED = 100, 4  # designs by which cells are made narrow enough for the rest, and how often
_BLOCK_DESIGNS = 2_000  # designs whose cells are looked at together
_FASTEST, _TYPICAL = 7, 8  # rows of a structure's numbers
_MOST_GUARDS = 5_000  # guards: those of tables with hundreds of rows, whose place varies, would take seconds


class DesignValues(NamedTuple):
    """Requirements of every design: w (rad/s), eps, the flywheel's ratio to the crank, and the cycle (rad).

    `unknown` is true if there is a balance; `drive` is the drive's ratio to the crank (None without one), `torque` its
    torque (N m), None if that is the balance. `inertia` (kg m², at its own shaft) is that of a flywheel that is given:
    its irregularity is then unknown. `loose` is the relative error of the squares of the extreme speeds, `by_directions`
    (sqrt(kg) m/s²) what rounded directions of weights leave; see `Machine.by_directions`.
    """

    speed: Array
    irregularity: Array
    ratio: Array | float
    span: float
    unknown: bool
    drive: Array | float | None = None
    torque: Array | float | None = None
    inertia: Array | None = None
    loose: Array | float = 0.0
    by_directions: Array | float = 0.0

    def of(self, which: Index) -> DesignValues:
        """The values of some designs."""
        fields: dict[str, Any] = self._asdict()
        return self._replace(**{name: value[which] for name, value in fields.items() if np.ndim(value)})


RATE = ("drive", "drive_by_speed", "moving", "resistance")
"""Of a machine at crank speeds: the drive's share of M* with its slope by the speed, what of M* depends on speed without
resistances, and the resistance R*; then of each of its stages the values of `STAGE`."""
STAGE = ("moment", "by_speed", "by_unknown", "exchanged", "inertia", "slope")
"""Of a stage: M* with its slopes and the sum of |contributions|, I* and dI*/dphi."""


class Narrow(NamedTuple):
    """The law of a load, by its path, that may be narrow somewhere; its names as a program of (phi, *columns)."""

    path: str
    law: Expression
    names: tuple[str, ...]
    program: Program

    def at(self, phi: Any, columns: Array, namespace: Any = "numpy") -> dict[str, Any]:
        """Values of its names."""
        return dict(zip(self.names, self.program.function(namespace)(phi, *columns), strict=True))


class StretchWalk(NamedTuple):
    """Common program of a stretch between landmarks: from (phi, *columns) to parts of `Reduced`, with its decisions.

    `decided` are the functions that decide branches of laws and vary with the columns; their signs are `signs` in the whole
    stretch. `laws` are those that act there and may be narrow. Where torques depend on speed, `rate` is the program from
    (phi, *columns, omega, unknown) to those of `RATE`, `switches` that to the values by whose signs laws switch at speeds.
    """

    program: Program
    decided: Program | None
    signs: tuple[float, ...]
    laws: tuple[Narrow, ...]
    rate: Program | None = None
    switches: Program | None = None


@dataclass(frozen=True)
class Structure:
    """Smooth pieces that designs share; its programs are functions of (phi, *columns), columns being the numbers that vary.

    conditions: common properties of the designs. landmarks: edges between which one walk holds and nothing is narrow.
    walks: one for each stretch between them, with as many cells as `counts` says. numbers: speed (rad/s), irregularity, the
    flywheel's and the drive's ratio to the crank, the drive's torque (N m), and the greatest speed of a mechanism over the
    crank's; NaN if there is none; then the typical speed and the characteristic speeds of a motor. twin: the machine
    that it was recorded from. limits: those of its scene, in their order. motor: one with limits (see `motor_program`),
    from (phi, *columns, omega, unknown). efficiencies: those of its stages, where they may vary.
    """

    paths: tuple[str, ...]
    twin: Machine
    cycle: float
    unknown: bool
    conditions: Conditions
    landmarks: Program
    walks: tuple[StretchWalk, ...]
    numbers: Program
    counts: tuple[int, ...] = ()
    limits: Program | None = None
    motor: Program | None = None
    efficiencies: Program | None = None

    def limits_of(self, columns: Array) -> dict[str, Array]:
        """The limits of every design, by their names."""
        names = self.twin.scene.limits
        return {} if self.limits is None else dict(zip(names, _at(self.limits, columns), strict=True))

    def speeds(self, columns: Array) -> Array:
        """The typical speed of every design, then the characteristic speeds of its motor, rad/s."""
        return _at(self.numbers, columns)[_TYPICAL:]

    def edges(self, columns: Array) -> Array:
        """Edges of the cells (cells + 1, designs), rad."""
        marks = _at(self.landmarks, columns)
        stretch = np.repeat(np.arange(len(self.counts)), self.counts)
        share = np.concatenate([np.arange(count) / count for count in self.counts])[:, None]
        first = marks[stretch]
        return np.concatenate((first + share * (marks[stretch + 1] - first), marks[-1:]))

    @cached_property
    def programs(self) -> list[tuple[slice, Program]]:
        """Consecutive cells with the program that they share."""
        return self._shared([walk.program for walk in self.walks])

    @cached_property
    def rates(self) -> list[tuple[slice, Program, Program]]:
        """The same with the programs of laws that depend on speed, each in two: what position gives, and all the rest.

        None if nothing depends on speed.
        """
        programs = [walk.rate for walk in self.walks if walk.rate is not None]
        return [(piece, *program.split(2)) for piece, program in self._shared(programs)] if programs else []

    @cached_property
    def switches(self) -> list[tuple[slice, Program]]:
        """The same with the values by whose signs laws switch at speeds; none where none does."""
        programs = [walk.switches for walk in self.walks if walk.switches is not None]
        return self._shared(programs) if programs else []

    def with_places(self, other: Callable[[Any], Any]) -> Structure:
        """The same with other constants in all programs, as a function gives them, and in what these solve for."""
        zeros = dict[FollowedZero, FollowedZero]()

        def changed(place: Any) -> Any:
            if not isinstance(place, FollowedZero):
                return other(place)
            if place not in zeros:
                zeros[place] = FollowedZero(of(place.program), place.near)
            return zeros[place]

        def of(program: Program) -> Program:
            return program._replace(places=tuple(map(changed, program.places)))

        walks = {id(walk): walk._replace(program=of(walk.program), rate=walk.rate and of(walk.rate)) for walk in self.walks}
        return replace(
            self,
            conditions=self.conditions._replace(program=of(self.conditions.program)),
            landmarks=of(self.landmarks),
            walks=tuple(walks[id(walk)] for walk in self.walks),
            numbers=of(self.numbers),
            efficiencies=self.efficiencies and of(self.efficiencies),
        )

    def _shared(self, programs: Sequence[Program]) -> list[tuple[slice, Program]]:
        stretches: list[tuple[slice, Program]] = []
        end = 0
        for program, number in zip(programs, self.counts, strict=True):
            same = bool(stretches) and stretches[-1][1] == program
            start = stretches.pop()[0].start if same else end
            end += number
            stretches.append((slice(start, end), program))
        return stretches

    def givens(self, columns: Array) -> DesignValues:
        """Speed, irregularity and drive of every design."""
        speed, irregularity, ratio, drive, torque, inertia, by_directions, *_ = _at(self.numbers, columns)
        driven, numbers, analysed = (bool(np.isfinite(row).all()) for row in (drive, torque, inertia))
        return DesignValues(
            speed=speed,
            irregularity=irregularity,
            ratio=ratio,
            span=self.cycle,
            unknown=self.unknown,
            drive=drive if driven else None,
            torque=torque if numbers else None,
            inertia=inertia if analysed else None,
            by_directions=by_directions,
        )

    def kept(self, columns: Array) -> Mask:
        """Mask of the designs with this structure: guards kept, cells narrow enough, no branch that changes in one."""
        with np.errstate(all="ignore"):
            good = kept_mask(self.conditions, columns)
            good[good] = (self._counts(columns[:, good]) <= np.array(self.counts)[:, None]).all(axis=0)
            for first in range(0, columns.shape[1], _BLOCK_DESIGNS):
                block = good[first : first + _BLOCK_DESIGNS]
                block[block] = self._followed(columns[:, first : first + _BLOCK_DESIGNS][:, block])
        return good

    def widened(self, columns: Array) -> Structure:
        """The same with as many cells in each stretch as those designs need that keep its guards."""
        with np.errstate(all="ignore"):
            kept = columns[:, kept_mask(self.conditions, columns)]
            wider = replace(self, counts=tuple(self._counts(kept).max(axis=1, initial=1).tolist()))
            some = kept[:, :: max(1, kept.shape[1] // _SAMPLE)]
            for _ in range(_MOST_DOUBLED if any(walk.laws for walk in self.walks) else 0):
                narrow_enough = wider._narrow(some).all(axis=1)
                if narrow_enough.all():
                    break
                counts = np.array(wider.counts)
                wide = ~np.logical_and.reduceat(narrow_enough, np.cumsum(counts) - counts)
                wider = replace(wider, counts=tuple((counts * (1 + wide)).tolist()))
        return wider

    def _counts(self, columns: Array) -> Array:
        """Least number of cells in each stretch of each design."""
        widths = np.diff(_at(self.landmarks, columns), axis=0)
        fastest = _at(self.numbers, columns)[_FASTEST]
        counts = np.ceil(widths * fastest / WIDEST * (1.0 - _WIDTH_ROUNDING)).clip(1.0)
        return np.where(np.isfinite(counts), counts, 1e6).astype(int)

    def _followed(self, columns: Array) -> Mask:
        """Mask of the designs in which no branch changes within a cell and no law is too narrow."""
        good = np.ones(columns.shape[1], bool)
        for walk, low, high in self._stretches(columns) if any(walk.decided for walk in self.walks) else ():
            phi = 0.5 * (low + high) + 0.5 * (high - low) * NODES[:, None, None]
            for value, sign in zip(walk.decided.function()(phi, *columns) if walk.decided else (), walk.signs, strict=True):
                good &= np.broadcast_to(value * sign > 0.0, phi.shape).all(axis=(0, 1))
        if any(walk.laws for walk in self.walks):
            good &= self._narrow(columns).all(axis=0)
        return good

    def _stretches(self, columns: Array) -> Iterator[tuple[StretchWalk, Array, Array]]:
        """Every walk with the left and the right edges of its cells; stretches of one piece stand together."""
        edges, end = self.edges(columns), 0
        for _, group in groupby(zip(self.walks, self.counts, strict=True), lambda each: id(each[0])):
            walks, counts = zip(*group, strict=True)
            start, end = end, end + sum(counts)
            yield walks[0], edges[start:end], edges[start + 1 : end + 1]

    def _narrow(self, columns: Array) -> Mask:
        """Mask of the cells (cells, designs) that are narrow enough for all laws that act there."""
        stretches, peaks = list(self._stretches(columns)), dict[str, Array]()
        centres = [[each.at(0.5 * (low + high), columns) for each in walk.laws] for walk, low, high in stretches]
        for (walk, low, _), nominal in zip(stretches, centres, strict=True):
            for each, centre in zip(walk.laws, nominal, strict=True):
                size = np.abs(np.broadcast_to(each.law.evaluate(centre, np, centre), low.shape))
                size = np.where(np.isfinite(size), size, 0.0).max(axis=0)
                peaks[each.path] = np.maximum(size, peaks.get(each.path, 0.0))
        masks = []
        for (walk, low, high), nominal in zip(stretches, centres, strict=True):
            good, share = np.ones(low.shape, bool), (high - low) / self.cycle
            for each, centre in zip(walk.laws, nominal, strict=True):
                inside = each.at(Interval(low, high), columns, INTERVALS)
                good &= narrow(each.law, inside, centre, share, peaks[each.path])
            masks.append(good)
        return np.concatenate(masks)


def _at(program: Program, columns: Array) -> Array:
    """Values of a program at columns, one row for each output."""
    return np.stack([np.broadcast_to(value, columns.shape[1:]) for value in program.function()(0.0, *columns)])


def kept_mask(conditions: Conditions, columns: Array) -> Mask:
    """Mask of the designs that keep all guards, a block at a time: hundreds of differences for each take much room."""
    blocks = [columns[:, first : first + _BLOCK_DESIGNS] for first in range(0, columns.shape[1], _BLOCK_DESIGNS)]
    masks = [np.broadcast_to(conditions.kept(0.0, *block), block.shape[1:]) for block in blocks]
    return np.concatenate([*masks, np.zeros(0, bool)])


# -- recording -------------------------------------------------------------------------------------------------------------


class UnrecordableError(UnrecordedError):
    """Numbers that cannot be recorded, such as a count of teeth, or the lengths of a linkage."""


def recorded(
    scene: Scene, paths: Sequence[str], values: Sequence[float], fixed: Sequence[str] = (), *, exact: bool = False
) -> Structure:
    """The structure of a scene whose numbers at some paths have values (SI), with no cells cut yet.

    fixed: paths whose numbers designs of the structure have in common. exact: True keeps what is solved for as calls, for
    numbers of any kind, and admits what has no effect on the motion with one flywheel: limits, and a wheel to be chosen.

    Raises:
        SceneError: if the scene with these values is at fault.
        UnrecordableError: if the numbers at these paths cannot be recorded.
        UnrecordedError: if the machine cannot be followed with any recorded numbers.

    """
    base = with_numbers(scene, dict(zip(paths, values, strict=True)))
    # What a program of position alone does not tell is refused.
    drive, limited = base.drive, not exact and any(name != "irregularity" for name in base.limits)
    for excluded, what in (
        (base.areas is not None, "a diagram of areas has no machine"),
        (base.stroke is not None, "a stroke is no cycle"),
        (circuit_of(base) is not None, "the motor has states of its own"),
        (limited and base.unknown is not None, "the motor has limits at a speed that is set"),
        (
            limited and "motor_heat" in base.limits and base.motor is not None and base.motor.whole_heat is not None,
            "the motor has a limit of its heat, which its current makes",
        ),
        (not base.has_speed or not base.has_flywheel, "no speed or no flywheel is given"),
        (base.wheel is not None and not exact, "a wheel is to be chosen for each"),
        (bool(base.duty), "a duty has several phases"),
        (base.rubs, "friction in joints follows from the motion"),
        (
            not exact
            and drive is not None
            and not (base.depends_on_speed or any(efficiency < 1.0 for efficiency in base.efficiencies.values()))
            and not isinstance(drive.law, float | int | None),
            "the drive's torque is no plain number",
        ),
    ):
        if excluded:
            raise UnrecordedError(what)
    twin, recorder = Machine(base), Recorder(exact=exact)
    phi = recorder.input("phi")
    numbers = {path: recorder.input(path, value) for path, value in zip(paths, values, strict=True)}
    try:
        with np.errstate(all="ignore"):
            for path in fixed:
                recorder.compared("equal", numbers[path], numbers[path].value)
            own = base.with_({path: numbers[path] for path in paths if path not in fixed})
            machine = RecordedMachine(_on_record(own, recorder) if exact else own, twin, recorder)
            return _structure(machine, recorder, phi, tuple(paths))
    except UnrecordedError:
        raise
    except Exception as error:  # whatever reading or a mechanism does with a number that stands for many
        raise UnrecordableError(f"{', '.join(paths)} cannot vary in a program ({error})") from error


def _on_record(scene: Scene, recorder: Recorder) -> Scene:
    """A scene with the numbers in its loads' expressions on record, so that nothing is calculated with them beforehand.

    What decides a branch by a velocity is taken at the place itself: a walk has one anchor for a whole piece.
    """

    def lifted(node: expressions.Node) -> expressions.Node:
        if node.op == "number" and not is_recorded(node.number) and node.number != int(node.number):
            number: Any = recorder.node(node.number)
            return node._replace(number=number)
        return node._replace(args=tuple(map(lifted, node.args)))

    def changed(load: Load) -> Load:
        law = load.law
        return (
            load._replace(law=Expression(law.text, lifted(decided_here(law.tree)))) if isinstance(law, Expression) else load
        )

    drive = None if scene.drive is None else changed(scene.drive)
    return replace(scene, loads=tuple(map(changed, scene.loads)), drive=drive)


def _structure(machine: RecordedMachine, recorder: Recorder, phi: Recorded, paths: tuple[str, ...]) -> Structure:
    scene, twin = machine.scene, machine.twin
    if machine.depends_on_time:
        raise UnrecordedError("loads depend on time")
    efficiencies = [stage.efficiency for stage in machine.stages]
    if not recorder.exact and any(isinstance(each, Recorded) for each in efficiencies):
        raise UnrecordableError("an efficiency decides which stages there are")
    if isinstance(scene.cycle, Recorded):
        raise UnrecordableError("the cycle itself varies")
    pieces, landmarks, plain_marks = machine.breakpoints, machine.landmarks, twin.landmarks
    if len(recorder.guards) > _MOST_GUARDS:
        raise UnrecordedError("tables are too long, and move with what varies")
    walks: dict[int, StretchWalk] = {}
    anchors: dict[int, Any] = {}
    stretches = []
    for low, high in pairwise(plain_marks.tolist()):
        k = int(np.searchsorted(twin.breakpoints, 0.5 * (low + high))) - 1
        if k not in walks:
            anchors[k] = _anchor(recorder, pieces[k], pieces[k + 1])
            walks[k] = _walk(machine, recorder, phi, anchors[k])
        stretches.append(walks[k])
    drive, nothing = scene.drive, float("nan")
    torque = nothing if drive is None or isinstance(drive.law, Expression | Table | None) else drive.law
    numbers: list[Any] = [scene.speed, scene.irregularity, scene.flywheel_ratio, drive and scene.shafts[drive.on], torque]
    numbers += [scene.inertia, machine.by_directions, machine.fastest, machine.typical_speed, *machine.motor_speeds]
    structure = Structure(
        paths=paths,
        twin=twin,
        cycle=scene.cycle,
        unknown=scene.unknown is not None,
        conditions=recorder.conditions(),
        landmarks=recorder.program(landmarks),
        walks=tuple(stretches),
        numbers=recorder.program([nothing if number is None else number for number in numbers]),
        counts=(1,) * len(stretches),
        limits=recorder.program(list(scene.limits.values())) if scene.limits else None,
        efficiencies=recorder.program(efficiencies) if recorder.exact else None,
    )
    if not machine.sets_its_speed:
        return structure
    own, at = tuple(recorder.inputs), (recorder.input("omega"), recorder.input("unknown"))
    moving = dict[int, StretchWalk]()
    for k, walk in walks.items():
        switches = _switches(machine, recorder, phi, at[0], anchors[k]) if twin.switches_at_speeds else None
        moving[id(walk)] = walk._replace(rate=_rate(machine, recorder, phi, *at, anchors[k]), switches=switches)
    limits = [] if recorder.exact else [name for name in scene.limits if name != "irregularity"]
    motor = motor_program(scene.motor, limits, recorder, at[0]) if limits and scene.motor is not None else None
    walks_of_all = tuple(moving[id(walk)] for walk in stretches)
    return replace(structure, walks=walks_of_all, motor=motor, conditions=recorder.conditions(own))


def _anchor(recorder: Recorder, low: Any, high: Any) -> Any:
    """The middle of a piece; for numbers without rounding one of few digits, on record, so that its functions are, too."""
    middle = 0.5 * (low + high)
    short = float(f"{present(middle):.9g}")
    return recorder.node(short) if recorder.exact and low < short and short < high else middle


def _rate(
    machine: RecordedMachine, recorder: Recorder, phi: Recorded, omega: Recorded, unknown: Recorded, anchor: Any
) -> Program:
    """The program of `RATE` and `STAGE` in the piece of an anchor."""
    nothing, balance = Reduced(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), unknown if machine.scene.unknown is not None else 0.0
    drive, moving, resistance, rows = (0.0, 0.0), 0.0, 0.0, list[Any]()
    whole = machine.reduction.at(phi, anchor, NAMESPACE)
    for stage in machine.stages:
        station = whole.of(stage.reduction)
        contributions = station.contributions(Jet(omega, 1.0), 0.0, omega, local=not recorder.exact)
        own = [(effort, factor) for _, effort, factor in contributions]
        rows += [*at_speeds(station.reduced, own, omega, balance), station.reduced.inertia, station.reduced.slope]
        moving, resistance = moving + at_speeds(nothing, own, omega, balance)[0], resistance + station.reduced.resistance
        if stage.drives:
            driving = [(effort, factor) for element, effort, factor in contributions if element.name.startswith(DRIVE)]
            still, beside = (station.moments(number).get("drive", 0.0) for number in (0.0, 1.0))
            of_position = nothing._replace(moment=still, per_unknown=beside - still)
            drive = at_speeds(of_position, driving, omega, balance)[:2]
    return recorder.program([*drive, moving, resistance, *rows])


def _switches(machine: RecordedMachine, recorder: Recorder, phi: Recorded, omega: Recorded, anchor: Any) -> Program:
    """The program of the values by whose signs laws switch at speeds in the piece of an anchor."""
    values: list[Any] = []
    for stage, efforts in zip(machine.stages, machine.switching, strict=True):
        places = stage.reduction.at(phi, anchor, NAMESPACE).places(omega, 0.0, omega, local=True) if efforts else ()
        for element, here, there in places:
            if element.name in efforts:
                values += efforts[element.name].speed_switches(here, there)
    return recorder.program(values)


def _walk(machine: RecordedMachine, recorder: Recorder, phi: Recorded, anchor: Any) -> StretchWalk:
    """The walk in the piece of an anchor, and the functions that decide branches there, if they vary between designs."""
    reduced = machine.reduction(phi, anchor, NAMESPACE)
    rows = reduced.inertia, reduced.slope, reduced.moment, reduced.per_unknown, reduced.exchanged, reduced.steepness
    decided, signs, laws = [], [], []
    for effort in machine.efforts:
        law = effort.load.law
        active = effort.active(Here(effort.place.rate * anchor, None, np))
        if isinstance(law, Expression) and active and POSITION & law.names and _may_be_narrow(law):
            names, at = machine.named(effort, phi, anchor), present(anchor)
            plain = Expression(law.text, _lifted(law.tree, names))
            laws.append(Narrow(effort.path, plain, tuple(names), recorder.program(names.values())))
            laws[-1].at(Interval(at, at), np.array([each.value for each in recorder.inputs[1:]]), INTERVALS)  # it is bounded
        for part in deciders(effort):
            value = machine.decided(effort, part, phi, anchor).value
            if _varies(recorder, value):
                decided.append(value)
                signs.append(float(np.sign(present(machine.decided(effort, part, anchor, anchor).value))))
    return StretchWalk(recorder.program(rows), recorder.program(decided) if decided else None, tuple(signs), tuple(laws))


def _lifted(node: expressions.Node, numbers: dict[str, Any]) -> expressions.Node:
    """The tree of a law with names for its recorded numbers, which `numbers` takes: it then holds for intervals, too."""
    if node.op == "number" and isinstance(node.number, Recorded):
        name = f"#{len(numbers)}"
        numbers[name] = node.number
        return expressions.Node("name", name=name)
    return node._replace(args=tuple(_lifted(arg, numbers) for arg in node.args))


def _may_be_narrow(law: Expression) -> bool:
    """Tests whether an expression is more than polynomials of low degree."""
    tame = ("number", "name", "pi", "sum", "product", "neg", "if", "abs", "sign", "min", "max", *expressions.BOOLEAN)
    return any(node.op not in tame or (node.op == "product" and "/" in node.signs) for node in expressions.walk(law.tree))


def _varies(recorder: Recorder, value: Any) -> bool:
    """Tests whether a value depends on more than phi, the first input."""
    if not isinstance(value, Recorded):
        return False
    program = recorder.program([value])
    varying = set(range(1, len(program.inputs)))
    return any(varying.intersection(operands) for _, *operands in program.operations)
