"""The dial between speed and accuracy: four levels of a sizing, from bounds in a moment to a confirmation in time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flywheel.numerics.faults import Fault

if TYPE_CHECKING:
    from flywheel.regime.results import Sizing


FAST, NORMAL, CONFIRM, AUDIT = LEVELS = ("fast", "normal", "confirm", "audit")
"""What each adds: areas and a proven bracket; the exact figures; periodic collocation; time stepping in place of that."""
RTOL = (1e-14, 0.1)
"""The least and the greatest relative error that may be asked of figures."""


def rtol_faults(rtol: float) -> list[Fault]:
    """What is wrong with a relative error asked for; nothing where it may be.

    >>> print(*rtol_faults(1.0), *rtol_faults(1e-9))
    rtol: found 1.0, expected a number from 1e-14 to 0.1
    """
    low, high = RTOL
    return [] if low <= rtol <= high else [Fault("rtol", f"{rtol}", f"a number from {low:g} to {high:g}")]


def level(accuracy: str | None = None, simulate: bool | None = None) -> str:
    """The level asked for by its name, or by whether to simulate: True means `audit`, False `normal`, nothing `audit`.

    Raises:
        ValueError: for another name, or where the two contradict each other.

    >>> level(), level(simulate=False), level("confirm")
    ('audit', 'normal', 'confirm')

    """
    meant = None if simulate is None else AUDIT if simulate else NORMAL
    if accuracy is None:
        return meant or AUDIT
    if accuracy not in LEVELS:
        raise ValueError(f"accuracy: found {accuracy!r}, expected one of {', '.join(LEVELS)}")
    if meant is not None and meant != accuracy:
        raise ValueError(f"simulate={simulate} means accuracy {meant!r}, and contradicts {accuracy!r}: give one of the two")
    return accuracy


def left_out(sizing: Sizing) -> tuple[str, ...]:
    """What a sizing did not do, as it turned out; nothing for a diagram of areas, which is worked out whole at any level."""
    if sizing.scene.areas is not None:
        return ()
    found = []
    if sizing.accuracy == FAST:
        found.append("the exact flywheel" if sizing.scene.inertia is None else "the exact irregularity")
        found.append("the motion over the cycle: speeds, period, power over time")
        if sizing.scene.wheel is not None:
            found.append("the wheel to be built")
    route = sizing.simulation and sizing.simulation.route
    if route not in ("time", "collocation") and (sizing.run is not None or sizing.accuracy == FAST):
        found.append("a confirmation of the figures by a second route")
    elif route == "collocation":
        found.append("the time simulation, which confirms the figures on a route of its own")
    return tuple(found)
