"""The levels of accuracy of a sizing: exact figures, confirmed by collocation or in time, or with proven intervals."""

from __future__ import annotations

from flywheel.numerics.faults import Fault

NORMAL, CONFIRM, AUDIT, PROOF = ("normal", "confirm", "audit", "proof")
"""The exact figures; these and periodic collocation; these and time stepping; these and proven intervals of them."""
LEVELS = ("fast", NORMAL, CONFIRM, AUDIT, PROOF)
"""The names that are accepted: "fast" is another name of "normal", as exact figures take no longer than bounds of them."""
RTOL = (1e-14, 0.1)
"""The least and the greatest relative error that may be asked of figures."""
DEFAULT_RTOL = 1e-9
"""The relative error asked of figures where a scene names none."""


def rtol_faults(rtol: float) -> list[Fault]:
    """Faults of a relative error asked for; none if it is valid.

    >>> print(*rtol_faults(1.0), *rtol_faults(1e-9))
    rtol: found 1.0, expected a number from 1e-14 to 0.1
    """
    low, high = RTOL
    return [] if low <= rtol <= high else [Fault("rtol", f"{rtol}", f"a number from {low:g} to {high:g}")]


def level(accuracy: str | None = None, simulate: bool | None = None) -> str:
    """The level asked for by its name, or by whether to simulate: True means `audit`, False `normal`, nothing `audit`.

    "fast" is "normal".

    Raises:
        ValueError: for another name, or where the two contradict each other.

    >>> level(), level(simulate=False), level("confirm"), level("fast")
    ('audit', 'normal', 'confirm', 'normal')

    """
    meant = None if simulate is None else AUDIT if simulate else NORMAL
    if accuracy is None:
        return meant or AUDIT
    if accuracy not in LEVELS:
        raise ValueError(f"accuracy: found {accuracy!r}, expected one of {', '.join(LEVELS)}")
    found = NORMAL if accuracy == "fast" else accuracy
    if meant is not None and meant != found:
        raise ValueError(f"simulate={simulate} means accuracy {meant!r}, and contradicts {accuracy!r}: give one of the two")
    return found


def left_out(route: str | None, *, moves: bool) -> tuple[str, ...]:
    """Parts of a sizing that were left out, by the route of its confirmation; none if nothing `moves` to be confirmed.

    >>> left_out("time", moves=True), len(left_out(None, moves=True))
    ((), 1)
    """
    if route == "collocation":
        return ("the time simulation, which confirms the figures on a route of its own",)
    return ("a confirmation of the figures by a second route",) if route != "time" and moves else ()
