"""Comparisons made by hand, for tests of what is told and drawn."""

from __future__ import annotations

from typing import Any

from flywheel.study.reference import Reference
from flywheel.study.tradeoff import Row, Tradeoff

REFERENCE = Reference(2.0, 1e-14, "Gauss' rule", "the closed form is 1e-15 apart, within its estimate")


def row(family: str, setting: str = "", error: float | None = 1e-3, seconds: float = 1e-3, **changes: Any) -> Row:
    """A method that was run to its end, unless its error is None."""
    name = f"{family}, {setting}" if setting else family
    own = Row(name, family, name[-16:], "done", 2.0, error, False, seconds, seconds, seconds, 7, 100, None, "", "")
    if error is None:
        own = own._replace(outcome="not run", value=None, meets=None, seconds=None, repeats=0, evaluations=None)
    else:
        own = own._replace(meets=error + REFERENCE.doubt <= 1e-6, value=2 * (1 + error))
    return own._replace(**changes)


def compared(*rows: Row, **changes: Any) -> Tradeoff:
    """A comparison of these, of which none is the cheapest yet."""
    own: dict[str, Any] = {
        "title": "Rotor",
        "figure": "exact flywheel",
        "unit": "kg m²",
        "rtol": 1e-6,
        "reference": REFERENCE,
        "scale": 2.5,
        "rows": rows,
        "cheapest": None,
        "level": (),
        "cheapest_promised": None,
        "cannot": {},
        "budget": 60.0,
        "seconds": 1.0,
        "interrupted": False,
    }
    return Tradeoff(**{**own, **changes})


def whole() -> Tradeoff:
    """One with something of everything."""
    rows = (
        row("accumulated areas", "", 0.02, 6e-4, leaves_out="that I* varies over the cycle"),
        *(row("plain grid", f"{count} angles", 3 / count, 1e-7 * count, leaves_out="angles between") for count in (36, 360)),
        *(row("exact, closed form", f"rtol {rtol}", 3e-16, 6.4e-4, promised=float(rtol)) for rtol in ("0.001", "1e-06")),
        row("time stepping, RK4", "36 steps, restarted", 4e-7, 0.4),
        row("time stepping, RK4", "36 steps", 3e-3, 0.35, leaves_out="jumps within steps"),
        row("time stepping, Euler", "360 steps, restarted", 1.2e-2, 0.6),
        row("time stepping, Euler", "360 steps", None, leaves_out="jumps within steps", reason="the budget was spent"),
        row("Lagrange's multipliers", "rtol 1e-06, restarted", None, outcome="no answer", reason="the machine stops"),
    )
    cheapest = "exact, closed form, rtol 1e-06"
    level = ("exact, closed form, rtol 0.001",)
    cannot = {"whole bond graph": "it takes no springs"}
    return compared(*rows, cheapest=cheapest, level=level, cheapest_promised=cheapest, cannot=cannot)
