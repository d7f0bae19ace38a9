"""The method of a sizing and its reasons: its formulation, the variables of its torques, its cost."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from flywheel.machine.loads import moving_switches
from flywheel.machine.machine import Machine
from flywheel.machine.programs import programs_of
from flywheel.mechanisms import KINDS
from flywheel.numerics.units import columns, figure
from flywheel.scene.scene import CONFIRM, Mechanism, Scene, Transmission
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size
from flywheel.tables.rows import DEGREES, paragraphs, sentences, wrapped

_ELSEWHERE = "flywheel tradeoff measures what other methods and tolerances cost on this scene."


@dataclass(frozen=True)
class Explanation:
    """Explanation of a sizing's method.

    `formulation` is the problem solved, `because` the entries of the scene that require it; `motion` is the method for the
    motion over the cycle. `not_modelled` lists effects that the scene does not need, `forced` features that need more work.
    The sizing itself has the omissions of its level and the cost.
    """

    sizing: Sizing
    formulation: str
    because: tuple[str, ...]
    motion: str
    not_modelled: tuple[str, ...]
    forced: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Data that `--explain --json` prints under "explanation"."""
        return {
            "accuracy": self.sizing.accuracy,
            "formulation": self.formulation,
            "because": list(self.because),
            "motion": self.motion,
            "not_modelled": list(self.not_modelled),
            "forced": list(self.forced),
            "left_out": list(self.sizing.left_out),
            "cost": self.sizing.cost.as_dict(),
        }

    def text(self) -> str:
        """The same in plain text, at most 100 columns wide."""
        cost = self.sizing.cost
        parts = {"the whole": cost, **cost.stages}
        rows = [(name, str(part.evaluations), figure(part.seconds, 0.0, 2)) for name, part in parts.items()]
        costs = columns(rows, ("", "evaluations", "s"))
        blocks = {
            f"Method of solution ({self.sizing.accuracy})": _items(
                (f"figures: {self.formulation}", f"motion: {self.motion}")
            ),
            "What the torques depend on": _items(self.because),
            "Not modelled, as this scene or this level does not need it": _items(self.not_modelled),
            "Additional work beyond that of a smooth machine": _items(self.forced),
            "Cost, without the loading of libraries": [*costs, *sentences([_ELSEWHERE])],
        }
        return paragraphs((title, *lines) for title, lines in blocks.items() if lines)


def explain(
    machine: Machine | Scene, rtol: float | None = None, *, simulate: bool | None = None, accuracy: str | None = None
) -> Explanation:
    """Sizes a machine as `flywheel.size` does, and explains the method of solution.

    Args:
        machine: a `Machine`, or a `Scene`.
        rtol: required relative accuracy of every figure; the scene's own if None.
        simulate: true to confirm by time stepping.
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
    return explanation(size(machine, rtol, simulate=simulate, accuracy=accuracy))


def explanation(sizing: Sizing) -> Explanation:
    """The explanation of an existing sizing."""
    return Explanation(
        sizing=sizing,
        formulation=_formulation(sizing),
        because=tuple(_because(sizing)),
        motion=_motion(sizing),
        not_modelled=tuple(_not_modelled(sizing)),
        forced=tuple(_forced(sizing)),
    )


def _items(rows: Iterable[str]) -> list[str]:
    return [line for row in rows for line in wrapped(row, "    ", "  - ")]


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _formulation(sizing: Sizing) -> str:
    """Problem solved for the figures."""
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        return "sums of the areas of a diagram: no machine, no position, no cell"
    cells = f"{_counted(cycle.mesh.edges.size - 1, 'cell')} of {cycle.mesh.phi.shape[1]} nodes"
    if sizing.cyclic is not None:
        steps = f"{_counted(sizing.cyclic.steps, 'Newton step')} on the last ones"
        return f"periodic collocation of the kinetic energy, E'(phi) = M*(phi, omega), on {cells}, {steps}"
    if machine.sets_its_speed:
        return f"quadrature on {cells} at a constant speed: nothing varies, so there is no motion to solve for"
    closed = (
        "Wittenbauer's closed form" if sizing.scene.inertia is None else "the speed from the energy, whose level is found"
    )
    return f"quadrature of M* and dI*/dphi on {cells}, and {closed}, without time stepping"


def _because(sizing: Sizing) -> Iterator[str]:
    """Dependence of the torques, each by its path in the scene."""
    machine, scene = sizing.machine, sizing.scene
    if machine is None:
        yield "the scene gives the areas themselves: areas.values"
        return
    named = [(f"{effort.path}{' (balance)' if effort.depends_on_unknown else ''}", effort) for effort in machine.efforts]
    moving = [*(name for name, effort in named if effort.uses_speed), *(damper.path for damper in scene.dampers)]
    still = [name for name, effort in named if not effort.uses_speed]
    still += [spring.path for spring in scene.springs] + (["gravity"] if _weights(machine) else [])
    meshes = [(stage.shaft, scene.transmissions.get(stage.shaft, Transmission())) for stage in machine.stages]
    lossy = [f"shafts.{name}.efficiency" for name, mesh in meshes if mesh.efficiency < 1.0]
    lossy += [f"shafts.{name}.slip" for name, mesh in meshes if mesh.slip > 0.0]
    if moving:
        yield f"on speed: {', '.join(moving)}"
    if still:
        yield f"on position alone: {', '.join(still)}"
    if lossy:
        yield f"on acceleration, as mesh losses change direction: {', '.join(lossy)}"
    if _circuit(machine):
        yield "on a current of its own: drive.motor.inductance"
    if not (moving or still or lossy):
        yield "nothing acts: only the inertia of the machine varies"


def _motion(sizing: Sizing) -> str:
    """Method for the motion over the cycle, the second method for each of the flywheels, and its cost."""
    machine, confirmed = sizing.machine, sizing.simulation
    if machine is None:
        return "not found"
    if confirmed is None:
        return "the one of the figures; not found a second time" if sizing.run is not None else "none: nothing stores energy"
    if confirmed.route not in ("time", "collocation"):
        source = "that of the collocation" if sizing.cyclic is not None else "from the energy, in closed form,"
        return f"{source} on the cells of the figures; time by quadrature; no time stepping"
    evaluations = _counted(sizing.cost.stages["simulation"].evaluations, "evaluation")
    cycles = "one cycle"
    if sizing.flywheel.approximate is not None:
        lost = confirmed.irregularity_approximate is None
        second = " (none was found with the approximate one)" if lost else " and one with the approximate one"
        cycles = f"one cycle with the exact flywheel{second}"
    if confirmed.route == "collocation":
        return f"found again by periodic collocation on other cells, {cycles}, with {evaluations}, and compared"
    from flywheel.regime.free_motion import stiffness

    implicitly = {0.0: ", implicitly, as a linkage is solved at many positions at once,", float("inf"): ""}
    plain = not (machine.has_joint_friction or programs_of(machine).why)
    steps = f"in time{implicitly.get(stiffness(machine, plain=plain), ', implicitly where it is stiff,')}"
    return f"stepped {steps} through {cycles}, with {evaluations}, and compared with the figures"


def _elements(machine: Machine, *kinds: str) -> list[Any]:
    return [element for element in machine.graph.elements.values() if element.kind in kinds]


def _weights(machine: Machine) -> bool:
    return any((element.part or "").startswith("weight of") for element in _elements(machine, "Se"))


def _circuit(machine: Machine) -> bool:
    return getattr(machine.scene.motor, "inductance", 0.0) > 0.0


def _not_modelled(sizing: Sizing) -> Iterator[str]:
    """Effects that were not modelled because the scene does not need them."""
    machine = sizing.machine
    if machine is None:
        yield "the machine: areas do not give its inertia, its speeds over time or its drive"
        return
    heavy = {element.part for element in _elements(machine, "I") if element.law}
    bodies = [f"{mechanism.name}.{body}" for mechanism in machine.scene.mechanisms for body in _bodies(mechanism)]
    massless = [body for body in bodies if body not in heavy]
    if massless:
        yield f"bodies without mass or inertia: {', '.join(massless)}"
    if machine.omitted:
        yield f"velocities on which nothing depends: {', '.join(machine.omitted)}"
    cycle, inertia = sizing.constant or sizing.cycle, sizing.reduced_inertia
    if cycle is not None and inertia is not None and inertia.max - inertia.min <= 4 * cycle.errors.variation:
        if inertia.max <= cycle.errors.inertia:
            yield "inertia of the machine itself: it has none"
        else:
            yield f"a varying inertia: I* is {inertia.mean:.6g} kg m² at every angle"
        if sizing.cyclic is None and not machine.sets_its_speed:
            yield "a difference between the exact flywheel and the one by the areas: it vanishes with a constant I*"
    lacking = [
        *([] if _weights(machine) else ["weights"]),
        *([] if _elements(machine, "C") else ["springs"]),
        *([] if _elements(machine, "R") else ["dampers"]),
        *([] if any(stage.efficiency < 1.0 for stage in machine.stages) else ["losses in meshes"]),
        *([] if machine.friction is not None else ["friction in joints"]),
    ]
    if lacking:
        yield f"elements absent from the machine: {', '.join(lacking)}"
    if machine.scene.motor is not None and not _circuit(machine):
        yield "what delays the motor's torque, such as its current: it follows the speed at once"
    collocated = sizing.accuracy == CONFIRM and sizing.run is not None
    if not (machine.sets_its_speed or collocated):
        yield "torques at other speeds, and so Newton's method for the motion: none depends on speed"
    if sizing.simulation is None or sizing.simulation.route != "time":
        yield "time stepping"
    if machine.friction is None:
        yield "forces in the joints: nothing here depends on them (flywheel reactions gives them)"


def _bodies(mechanism: Mechanism) -> list[str]:
    """The names of the bodies of a mechanism that may have mass."""
    if mechanism.linkage is not None:
        return [link.name for link in mechanism.linkage.links]
    if mechanism.outputs:
        return [output.name for output in mechanism.outputs]
    return [part.name for part in KINDS[mechanism.type].parts if part.body]


def _forced(sizing: Sizing) -> Iterator[str]:
    """Features of the scene that need more work than a smooth machine."""
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        return
    broken = machine.breakpoints.size - 2
    if broken:
        sources = ", ".join(f"{name} {count}" for name, count in machine.broken_by.items())
        yield f"{_counted(broken, 'breakpoint')} inside the cycle, from {sources}"
    narrow = machine.landmarks.size - machine.breakpoints.size
    if narrow:
        yield f"{_counted(narrow, 'more edge')} around narrow features of expressions"
    edges, first = cycle.mesh.edges, machine.mesh.size - 1
    more = edges.size - 1 - first
    rest = f"{more} more where {'they' if first != 1 else 'it'} did not resolve it" if more > 0 else "which sufficed"
    yield f"{_counted(first, 'cell')} at first, {rest}"
    if more > 0:
        k = int((edges[1:] - edges[:-1]).argmin())
        low, high = ((edge + machine.scene.origin) * DEGREES for edge in edges[k : k + 2])
        yield f"the narrowest cell goes from {low:.6g} to {high:.6g} deg"
    solved = [mechanism.name for mechanism in machine.scene.mechanisms if mechanism.linkage is not None]
    if solved:
        yield f"positions by Newton-Raphson: {', '.join(solved)}"
    if machine.friction is not None:
        rounds = "beforehand"
        if sizing.friction is not None:
            rounds = f"in {_counted(sizing.friction.rounds, 'round')} with the motion that it follows"
        yield f"friction in joints, whose moment was found by kinetostatics {rounds}"
    switching = [
        effort.path
        for effort in machine.efforts
        if effort.uses_speed and moving_switches(effort.load.law)  # type: ignore[arg-type]
    ]
    if switching:
        yield f"laws that switch at a speed, where the motion itself divides the cells: {', '.join(switching)}"
    if sizing.accuracy == CONFIRM and sizing.run is not None:
        yield "separate cells for the confirmation"
