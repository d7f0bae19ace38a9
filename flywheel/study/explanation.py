"""What a sizing would cost at the other levels of accuracy, foretold from what it is known to consist of.

Evaluations are counted by structure: nodes on cells for what works on arrays, and for time stepping the degrees of the
series that the motion's acceleration has on its cells, which tell how many steps of order 8 it takes. Seconds follow from
how long one evaluation of this machine takes, and a small system of equations, here and now: they are rough.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Container, Iterator, Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.machine import Machine
from flywheel.numerics import budget
from flywheel.numerics import cells as piecewise
from flywheel.numerics.budget import FREE, Cost
from flywheel.numerics.cells import ORDER
from flywheel.regime import steady_motion
from flywheel.regime.results import Sizing
from flywheel.regime.steady_motion import NoMotionError, Run
from flywheel.regime.turning_moment import Cycle
from flywheel.scene.accuracy import AUDIT, CONFIRM, NORMAL
from flywheel.scene.scene import Scene
from flywheel.sizing.confirmation import on_thirds

if TYPE_CHECKING:
    from flywheel.machine.dynamics import Dynamics
    from flywheel.scene.scene import Mechanism


Array = NDArray[np.float64]

_PER_DEGREE = 18.5  # evaluations of a time stepping for each degree of the series of what it follows
_UP_TO = 6  # degree on a cell that a step of order 8 takes no notice of
_OF_STEP = 17  # evaluations of a step with its dense output, of which a stretch takes one at the least
_TO_BEGIN = 100.0  # evaluations in which a time stepping finds how long its steps can be
_IMPLICIT = 24.0  # evaluations of implicit steps for each degree
_BATCH = 3 * 16  # of them that are found at once: at all stages, for a state and each of its two variables moved
_VISIBLE = 1e-13  # of the greatest coefficient: below it a degree does not count
_EASY = 1e-10  # rtol down to which collocation hardly ever halves the cells that it begins with
_TIGHT, _TIGHTEST = 3e-5, 3e-14  # tolerance of a step: of rtol, and the least
_PER_CELL = 5  # nodes' worth of evaluations that a motion with torques that depend on speed takes in each cell, by ORDER
_NEWTON, _OF_CELL = 560.0, 7.5  # time of one motion by collocation, and of each of its cells, in systems of equations
_WIDE = 3.0  # how much longer one takes whose irregularity is near 2
_AROUND = 2.6  # time of a step beside each evaluation, in systems of equations
_AROUND_BATCH = 2.1  # time of implicit steps over that of their evaluations


def predicted(sizing: Sizing) -> dict[str, Cost]:
    """Evaluations and seconds of a sizing at every level of accuracy, by name; its own as measured.

    A diagram of areas costs nothing at any level. Evaluations hold within a factor of three where rtol is 1e-10 or more;
    below it cells and steps come near rounding, and may need ten times as many. Seconds are rough: within a factor of three
    on a machine with nothing else to do.
    """
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        return dict.fromkeys((NORMAL, CONFIRM, AUDIT), FREE)
    figures, own = _stage(sizing, "figures"), sizing.accuracy
    simulations: dict[str, Callable[[], Cost]] = {
        CONFIRM: lambda: _collocation(sizing, machine),
        AUDIT: lambda: _stepping(sizing, machine, cycle),
    }
    found = {NORMAL: figures}
    found |= {level: _sum(figures, foretell()) for level, foretell in simulations.items() if level != own}
    return {level: sizing.cost if level == own else found[level] for level in (NORMAL, CONFIRM, AUDIT)}


def _stage(sizing: Sizing, name: str) -> Cost:
    return sizing.cost.stages.get(name, FREE)


def _sum(one: Cost, two: Cost) -> Cost:
    return Cost(one.evaluations + two.evaluations, one.seconds + two.seconds)


def _motion(sizing: Sizing) -> Cost:
    """What the exact motion took where torques depend on speed."""
    return _stage(sizing, "figures").stages.get("motion", FREE)


def _collocation(sizing: Sizing, machine: Machine) -> Cost:
    """One motion with the exact or given flywheel, and one with the approximate one, on cells of their own."""
    own, motions = on_thirds(machine), _motions(sizing)
    cells = own.mesh.size - 1
    harder = 1.0 + 0.4 * max(float(np.log10(_EASY / sizing.rtol)), 0.0)
    evaluations = int(motions * ORDER * cells * harder)
    if machine.sets_its_speed:
        known = _motion(sizing).evaluations
        evaluations = int((1.0 if motions == 1 else 1.3) * known * cells / (machine.mesh.size - 1))
    each = _newton(sizing, machine, piecewise.cells(own.mesh).phi, evaluations / motions)
    return Cost(evaluations, motions * each)


def _newton(sizing: Sizing, machine: Machine, phi: Array, evaluations: float) -> float:
    """Seconds that one motion by collocation takes on cells of positions (cells, nodes), with so many evaluations."""
    eps = sizing.scene.irregularity or (0.0 if sizing.run is None else sizing.run.irregularity)
    systems = _NEWTON * (1.0 + _WIDE * (0.5 * eps) ** 4) + _OF_CELL * len(phi)
    return systems * _system() + evaluations / phi.size * _walk(machine, phi)


def _system() -> float:
    """Seconds that a system of as many equations as a cell has nodes takes; the shortest of some."""
    matrix, right = np.eye(ORDER), np.ones(ORDER)
    return min(_timed(lambda: np.linalg.solve(matrix, right)) for _ in range(8))


def _motions(sizing: Sizing) -> int:
    return 1 if sizing.scene.inertia is not None else 2


def _walk(machine: Machine, phi: Array) -> float:
    """Seconds that one walk of the graph takes at positions (cells, nodes); the shorter of two."""
    anchor = phi[:, ORDER // 2][:, None]
    return min(_timed(lambda: machine.reduction(phi, anchor)) for _ in range(2))


def _timed(work: Callable[[], object]) -> float:
    begin = perf_counter()
    work()
    return perf_counter() - begin


# -- time stepping ---------------------------------------------------------------------------------------------------


def _stepping(sizing: Sizing, machine: Machine, cycle: Cycle) -> Cost:
    """Steps of order 8 through every smooth stretch, for both flywheels; for linkages implicit ones."""
    from flywheel.regime.stepping import stiffness  # what time stepping would use

    degrees = [_degrees(run.cycle or cycle, run, run.speed or sizing.speed) for run in _runs(sizing, cycle)]
    if stiffness(machine) == 0.0:
        evaluations = int(_IMPLICIT * sum(float(degree.sum()) for degree in degrees))
        return Cost(evaluations, evaluations / _BATCH * _AROUND_BATCH * _batch(machine, sizing))
    looser = (max(_TIGHT * sizing.rtol, _TIGHTEST) / _TIGHTEST) ** (-1 / 8)
    followed = sum(float((degree - _UP_TO).clip(0).sum()) for degree in degrees)
    least = _OF_STEP * (machine.restarts.size - 1) + _TO_BEGIN
    total = _PER_DEGREE * looser * followed + least * len(degrees)
    instants = total * len(machine.stages)
    evaluations = int(instants * len(machine.stages))
    return Cost(evaluations, instants * (_instant(machine, sizing) + _AROUND * _system()))


def _runs(sizing: Sizing, cycle: Cycle) -> Iterator[Run]:
    """The motions that are stepped, as far as they are known without finding them."""
    exact = sizing.run or _by_areas(sizing, cycle)
    if exact is None:
        return
    yield exact
    figure = sizing.flywheel.approximate
    if figure is None:
        return
    try:
        inertia = figure * sizing.scene.flywheel_ratio**2
        yield exact if sizing.cyclic is not None else steady_motion.run(cycle, sizing.speed, inertia)
    except NoMotionError:
        return


def _by_areas(sizing: Sizing, cycle: Cycle) -> Run | None:
    """The motion with the given flywheel or that of the areas, from the areas' own cycle."""
    figure = sizing.flywheel.approximate_total if sizing.scene.inertia is None else sizing.scene.inertia
    try:
        return steady_motion.run(cycle, sizing.speed, (figure or 0.0) * sizing.scene.flywheel_ratio**2)
    except NoMotionError:
        return None


def _degrees(cycle: Cycle, run: Run, speed: float) -> NDArray[np.intp]:
    """The degree on each cell of the series of what is stepped: the slope of speed, and time, over angle."""
    mesh = cycle.mesh
    omega = steady_motion.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    moment, slope, inertia = cycle.series @ piecewise.basis(piecewise.NODES, ORDER).T
    bend = (moment - 0.5 * omega**2 * slope) / ((run.inertia + inertia) * omega)
    found = np.zeros((2, len(omega)), dtype=np.intp)
    for row, values in enumerate((bend, 1.0 / omega)):
        size = np.abs(piecewise.fit(values))
        visible = size > _VISIBLE * max(float(size.max()), 1e-300)
        found[row] = np.where(visible, np.arange(ORDER), 0).max(axis=1)
    return np.asarray(found.max(axis=0))


def _instant(machine: Machine, sizing: Sizing) -> float:
    """Seconds that the machine takes at one position, speed and time."""
    dynamics, (low, high) = _dynamics(machine, sizing), machine.breakpoints[:2].tolist()
    middle = 0.5 * (low + high)
    return min(_timed(lambda: dynamics.at(middle, middle, sizing.speed)) for _ in range(4))


def _batch(machine: Machine, sizing: Sizing) -> float:
    """Seconds that the machine takes at all the instants of an implicit step."""
    from flywheel.machine.dynamics import Anchor

    dynamics, (low, high) = _dynamics(machine, sizing), machine.breakpoints[:2].tolist()
    phi = np.linspace(low, high, _BATCH + 2)[1:-1]
    anchor, omega, time = Anchor(0.5 * (low + high), None, None), np.full(_BATCH, sizing.speed), np.zeros(_BATCH)
    return min(_timed(lambda: dynamics.along(phi, anchor, omega, time, 0.0, (low, high))) for _ in range(2))


def _dynamics(machine: Machine, sizing: Sizing) -> Dynamics:
    from flywheel.machine.dynamics import Dynamics  # what time stepping would use

    inertia = sizing.run.inertia if sizing.run is not None else 1.0
    return Dynamics(machine, inertia, 0.0 if sizing.cycle is None else sizing.cycle.balance or 0.0)


# -- explaining --------------------------------------------------------------------------------------------------------

# Why a sizing was worked out as it was, what it did without, and what more accuracy would cost.
#
# Every statement is read off what was done: the sizing's own records, the machine's bond graph and breakpoints, and the
# modules that the run has imported.


_DEGREES = 57.29577951308232


@dataclass(frozen=True)
class Explanation:
    """How a sizing came about.

    `formulation` is what was solved, and `because` which entries of the scene made it so; `motion` says how the motion
    over the cycle was found. `not_modelled` is what the scene does not need, `forced` what it has that takes more.
    `imports` tells of every library and part whether this run has loaded it. `costs` are those of every level of accuracy,
    its own as measured and the others foretold.
    """

    sizing: Sizing
    formulation: str
    because: tuple[str, ...]
    motion: str
    not_modelled: tuple[str, ...]
    forced: tuple[str, ...]
    imports: Mapping[str, str]
    costs: Mapping[str, Cost]

    def times(self, level: str) -> float | None:
        """Time of a level over that of this run; None where this run took none."""
        own = self.costs[self.sizing.accuracy].seconds
        return self.costs[level].seconds / own if own > 0.0 else None

    def as_dict(self) -> dict[str, Any]:
        """What `--explain --json` prints under "explanation"."""
        own = self.sizing.accuracy
        return {
            "accuracy": own,
            "formulation": self.formulation,
            "because": list(self.because),
            "motion": self.motion,
            "not_modelled": list(self.not_modelled),
            "forced": list(self.forced),
            "left_out": list(self.sizing.left_out),
            "imports": dict(self.imports),
            "costs": {
                level: {
                    "evaluations": cost.evaluations,
                    "seconds": cost.seconds,
                    "times": self.times(level),
                    "measured": level == own,
                }
                for level, cost in self.costs.items()
            },
        }

    def text(self) -> str:
        """The same in plain text, at most 100 columns wide."""
        from flywheel.report.explanation import text  # the writing is apart from what is written

        return text(self)


def explain(
    machine: Machine | Scene, rtol: float | None = None, *, simulate: bool | None = None, accuracy: str | None = None
) -> Explanation:
    """Size a machine as `flywheel.size` does, and tell how that was done and why so.

    Args:
        machine: a `Machine`, or a `Scene`.
        rtol: relative accuracy asked of every figure; the scene's own if None.
        simulate: whether to confirm by time stepping.
        accuracy: the level of accuracy; "audit" if None.

    Raises:
        SceneError: as `flywheel.size` does.
        ValueError: for a level that does not exist, or contradicts `simulate`.

    >>> import flywheel
    >>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": "300 rpm"},
    ...                        "flywheel": {"irregularity": 0.01}})
    >>> explain(scene, accuracy="normal").because
    ('on position alone: load[0].torque, drive.torque (balance)',)

    """
    before = frozenset(sys.modules)
    from flywheel.sizing.sizing import size

    return explained(size(machine, rtol, simulate=simulate, accuracy=accuracy), before)


def explained(sizing: Sizing, before: Container[str] = ()) -> Explanation:
    """The explanation of a sizing that was just made; `before` are the modules that were loaded ahead of it."""
    imports = budget.states(before)

    return Explanation(
        sizing=sizing,
        formulation=_formulation(sizing),
        because=tuple(_because(sizing)),
        motion=_motion_reason(sizing),
        not_modelled=tuple(_not_modelled(sizing, imports)),
        forced=tuple(_forced(sizing)),
        imports=imports,
        costs=predicted(sizing),
    )


# -- the formulation -------------------------------------------------------------------------------------------------


def _formulation(sizing: Sizing) -> str:
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        return "sums of the areas of a diagram: no machine, no position, no cell"
    cells = f"{_counted(cycle.mesh.edges.size - 1, 'cell')} of {cycle.mesh.phi.shape[1]} nodes"
    if sizing.cyclic is not None:
        steps = f"{_counted(sizing.cyclic.steps, 'Newton step')} on the last ones"
        return f"periodic collocation of the kinetic energy, E'(phi) = M*(phi, omega), on {cells}, {steps}"
    if machine.sets_its_speed:
        return f"quadrature on {cells} at a constant speed: nothing varies, and no motion was left to solve for"
    closed = "Wittenbauer's closed form" if sizing.scene.inertia is None else "the speed from the energy, its level found"
    return f"quadrature of M* and dI*/dphi on {cells}, and {closed}: nothing is stepped"


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _because(sizing: Sizing) -> Iterator[str]:
    """What the torques depend on, each by its path in the scene."""
    machine, scene = sizing.machine, sizing.scene
    if machine is None:
        yield "the scene gives the areas themselves: areas.values"
        return
    named = [(f"{effort.path}{' (balance)' if effort.depends_on_unknown else ''}", effort) for effort in machine.efforts]
    moving = [name for name, effort in named if effort.uses_speed]
    still = [name for name, effort in named if not effort.uses_speed]
    still += [spring.path for spring in scene.springs] + (["gravity"] if _weights(machine) else [])
    if moving or scene.dampers:
        yield f"on speed: {', '.join([*moving, *(damper.path for damper in scene.dampers)])}"
    if still:
        yield f"on position alone: {', '.join(still)}"
    lossy = [f"shafts.{stage.shaft}.efficiency" for stage in machine.stages if stage.efficiency < 1.0]
    if lossy:
        yield f"on what is accelerated, losses turning round with the mesh: {', '.join(lossy)}"
    if _circuit(machine):
        yield "on a current of its own: drive.motor.inductance"
    if not (moving or still or scene.dampers or lossy):
        yield "nothing acts: only the inertia of the machine varies"


def _motion_reason(sizing: Sizing) -> str:
    """How the motion over the cycle was found."""
    route = None if sizing.simulation is None else sizing.simulation.route
    if sizing.machine is not None and route in ("time", "collocation"):
        return _confirmation(sizing, sizing.machine)
    if route == "quadrature":
        found = "that of the collocation" if sizing.cyclic is not None else "from the energy, in closed form,"
        return f"{found} on the cells of the figures; time by quadrature; nothing is stepped"
    if route == "areas":
        return "not found: the irregularity is the one by the areas"
    if sizing.machine is None:
        return "not found"
    return "the one of the figures; not found a second time" if sizing.run is not None else "none: nothing stores energy"


def _confirmation(sizing: Sizing, machine: Machine) -> str:
    """How the motion was found a second time, for each of the flywheels, and what that took."""
    assert sizing.simulation is not None
    evaluations = _counted(sizing.cost.stages["simulation"].evaluations, "evaluation")
    cycles = "one cycle"
    if sizing.flywheel.approximate is not None:
        lost = sizing.simulation.irregularity_approximate is None
        second = " (none was found with the approximate one)" if lost else " and one with the approximate one"
        cycles = f"one cycle with the exact flywheel{second}"
    if sizing.simulation.route == "collocation":
        return f"found again by periodic collocation on other cells, {cycles}, with {evaluations}, and compared"
    return f"stepped {_steps(machine)} through {cycles}, with {evaluations}, and compared with the figures"


def _steps(machine: Machine) -> str:
    """What kind of steps in time a machine is followed by."""
    from flywheel.regime.stepping import stiffness  # which was loaded to step

    first = stiffness(machine)
    if first == 0.0:
        return "in time, implicitly, as a linkage is solved at many positions at once,"
    return "in time" if first == float("inf") else "in time, implicitly where it is stiff,"


# -- what was left out, and what takes more --------------------------------------------------------------------------


def _elements(machine: Machine, *kinds: str) -> list[Any]:
    return [element for element in machine.graph.elements.values() if element.kind in kinds]


def _weights(machine: Machine) -> bool:
    return any((element.part or "").startswith("weight of") for element in _elements(machine, "Se"))


def _circuit(machine: Machine) -> bool:
    motor = machine.scene.motor
    return getattr(motor, "inductance", 0.0) > 0.0


def _not_modelled(sizing: Sizing, imports: Mapping[str, str]) -> Iterator[str]:
    """What the scene does not need, and so nothing was done about it."""
    machine = sizing.machine
    if machine is None:
        yield "the machine: areas tell nothing of its inertia, its speeds over time or its drive"
        return
    massless = [*_massless(machine)]
    if massless:
        yield f"bodies without mass or inertia: {', '.join(massless)}"
    if machine.omitted:
        yield f"velocities that nothing hangs on: {', '.join(machine.omitted)}"
    yield from _constant_inertia(sizing)
    yield from _absent(machine)
    collocated = sizing.accuracy == CONFIRM and sizing.run is not None
    if not (machine.sets_its_speed or collocated):
        yield "torques at other speeds, and so Newton's method for the motion: none depends on speed"
    route = None if sizing.simulation is None else sizing.simulation.route
    if route != "time":
        yield "time stepping"
    if machine.friction is None and imports["flywheel.motion.joint_forces"] != budget.NOW:
        yield "forces in the joints: nothing here depends on them (flywheel reactions gives them)"
    if imports["sympy"] != budget.NOW:
        yield "symbolic mathematics"


def _constant_inertia(sizing: Sizing) -> Iterator[str]:
    cycle, inertia = sizing.constant or sizing.cycle, sizing.reduced_inertia
    if cycle is None or inertia is None or inertia.greatest - inertia.least > 4 * cycle.errors.variation:
        return
    if inertia.greatest <= cycle.errors.inertia:
        yield "any inertia of the machine's own: it has none"
    else:
        yield f"a varying inertia: I* is {inertia.mean:.6g} kg m² at every angle"
    if sizing.cyclic is None and not (sizing.machine is not None and sizing.machine.sets_its_speed):
        yield "a difference between the exact flywheel and the one by the areas: with a constant I* there is none"


def _absent(machine: Machine) -> Iterator[str]:
    """Kinds of elements that the bond graph has none of."""
    scene, springs, resistors = machine.scene, _elements(machine, "C"), _elements(machine, "R")
    lacking = [
        *([] if _weights(machine) else ["weights"]),
        *([] if springs else ["springs"]),
        *([] if resistors else ["dampers"]),
        *([] if any(stage.efficiency < 1.0 for stage in machine.stages) else ["losses in meshes"]),
        *([] if machine.friction is not None else ["friction in joints"]),
    ]
    if lacking:
        yield f"elements that the machine has none of: {', '.join(lacking)}"
    if scene.motor is not None and not _circuit(machine):
        yield "what delays the motor's torque, such as its current: it follows the speed at once"


def _massless(machine: Machine) -> Iterator[str]:
    """Bodies of mechanisms that no inertia of the bond graph belongs to."""
    heavy = {element.part for element in _elements(machine, "I") if element.law}
    for mechanism in machine.scene.mechanisms:
        for body in _bodies(mechanism):
            if f"{mechanism.name}.{body}" not in heavy:
                yield f"{mechanism.name}.{body}"


def _bodies(mechanism: Mechanism) -> list[str]:
    """The names of what may have mass in a mechanism."""
    if mechanism.linkage is not None:
        return [link.name for link in mechanism.linkage.links]
    if mechanism.outputs:
        return [output.name for output in mechanism.outputs]
    from flywheel.reading.schema import KINDS

    return [part.name for part in KINDS[mechanism.type].parts if part.body]


def _forced(sizing: Sizing) -> Iterator[str]:
    """What the scene has that takes more than a smooth machine would."""
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        return
    broken = machine.breakpoints.size - 2
    if broken:
        sources = ", ".join(f"{name} {count}" for name, count in machine.broken_by.items())
        yield f"{_counted(broken, 'breakpoint')} inside the cycle, from {sources}"
    narrow = machine.landmarks.size - machine.breakpoints.size
    if narrow:
        yield f"{_counted(narrow, 'more edge')} closing in on narrow features of expressions"
    yield from _halved(machine, sizing)
    solved = [mechanism.name for mechanism in machine.scene.mechanisms if mechanism.linkage is not None]
    if solved:
        yield f"positions by Newton-Raphson: {', '.join(solved)}"
    if machine.friction is not None:
        yield "friction in joints, whose moment was found by kinetostatics beforehand"
    switching = _switching(machine)
    if switching:
        yield f"laws that switch at a speed, where the motion itself cuts the cells: {', '.join(switching)}"
    if sizing.accuracy == CONFIRM and sizing.run is not None:
        yield "cells of their own for the confirmation"


def _switching(machine: Machine) -> list[str]:
    if not machine.depends_on_speed:
        return []
    from flywheel.machine.loads import moving_switches

    return [effort.path for effort in machine.efforts if effort.uses_speed and moving_switches(effort.load.law)]  # type: ignore[arg-type]


def _halved(machine: Machine, sizing: Sizing) -> Iterator[str]:
    """Cells beyond those that the machine begins with, and where they are narrowest."""
    assert sizing.cycle is not None
    edges, first = sizing.cycle.mesh.edges, machine.mesh.size - 1
    more = edges.size - 1 - first
    rest = f"{more} more where {'they' if first != 1 else 'it'} did not resolve it" if more > 0 else "which sufficed"
    yield f"{_counted(first, 'cell')} at first, {rest}"
    if more > 0:
        widths = edges[1:] - edges[:-1]
        k = int(widths.argmin())
        low, high = ((edge + machine.scene.origin) * _DEGREES for edge in edges[k : k + 2])
        yield f"the narrowest cell goes from {low:.6g} to {high:.6g} deg"
