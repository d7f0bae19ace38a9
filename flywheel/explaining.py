"""Why a sizing was worked out as it was, what it did without, and what more accuracy would cost.

Every statement is read off what was done: the sizing's own records, the machine's bond graph and breakpoints, and the
modules that the run has imported.
"""

from __future__ import annotations

import sys
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flywheel import loaded
from flywheel.accuracy import CONFIRM, FAST
from flywheel.cost import Cost
from flywheel.machine import Machine
from flywheel.results import Sizing
from flywheel.scene import Scene

if TYPE_CHECKING:
    from flywheel.scene import Mechanism

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
        from flywheel.writing.explained import text  # the writing is apart from what is written

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
    from flywheel.sizing import size

    return explained(size(machine, rtol, simulate=simulate, accuracy=accuracy), before)


def explained(sizing: Sizing, before: Container[str] = ()) -> Explanation:
    """The explanation of a sizing that was just made; `before` are the modules that were loaded ahead of it."""
    imports = loaded.states(before)
    from flywheel.prediction import predicted  # it imports what other levels would

    return Explanation(
        sizing=sizing,
        formulation=_formulation(sizing),
        because=tuple(_because(sizing)),
        motion=_motion(sizing),
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
    if sizing.accuracy == FAST and machine.sets_its_speed:
        what = "torques" if machine.depends_on_speed else "losses in meshes"
        return f"areas by quadrature on {cells}, {what} at a constant {sizing.speed:.6g} rad/s: no motion is solved for"
    if sizing.accuracy == FAST:
        return f"areas by quadrature on {cells}, and bounds of the exact figure from the extremes of I*"
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


def _motion(sizing: Sizing) -> str:
    """How the motion over the cycle was found."""
    route = None if sizing.simulation is None else sizing.simulation.route
    if sizing.machine is not None and route in ("time", "collocation"):
        return _confirmation(sizing, sizing.machine)
    if route == "quadrature":
        found = "that of the collocation" if sizing.cyclic is not None else "from the energy, in closed form,"
        return f"{found} on the cells of the figures; time by quadrature; nothing is stepped"
    if route == "areas":
        return "not found: the irregularity is the one by the areas"
    if sizing.machine is None or sizing.accuracy == FAST:
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
    from flywheel.implicit import stiffness  # which was loaded to step

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
    if _circuit(machine) and sizing.accuracy == FAST:
        yield "the motor's current as a state of its own: it is taken as steady, at that constant speed"
    route = None if sizing.simulation is None else sizing.simulation.route
    if route != "time":
        yield "time stepping"
    if machine.friction is None and imports["flywheel.joints"] != loaded.NOW:
        yield "forces in the joints: nothing here depends on them (flywheel reactions gives them)"
    if imports["sympy"] != loaded.NOW:
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
    from flywheel.loads import moving_switches

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
