"""Print a worked problem's steps beside the printed answers, and fail where they disagree.

A printed answer counts as met when ours, rounded or cut, gives its digits: hand work does both. Where the print is
wrong the step says why (`erratum`), and then the print must really differ. Every `true` figure was computed apart from
this library, at 30 digits. A name with a formula repeats a printed formula; its true figure is that formula's value,
and `printed` is empty where the source prints no number.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from decimal import ROUND_DOWN, Decimal
from itertools import accumulate
from typing import NamedTuple, Protocol, TypeVar

Figure = TypeVar("Figure")

AGREEMENT = 1e-9  # asked of ours against the true figure, relative to it or to the step's scale


class Span(Protocol):
    """One area of a sizing: the work between two crossings of the reduced moment, and the running sum."""

    @property
    def work(self) -> float:
        """Work of the area, J."""
        ...

    @property
    def accumulated(self) -> float:
        """Sum of the works up to and with this area, J."""
        ...


class Step(NamedTuple):
    """One figure of a solution: ours, as printed (text, so that its digits are known), and as recomputed apart."""

    name: str
    ours: float | None
    printed: str | None = None
    unit: str = ""
    true: float | None = None
    erratum: str = ""
    scale: float = 0.0


def known(figure: Figure | None) -> Figure:
    """Return a figure that this scene is sure to have; stop if it is missing.

    >>> known(1.5)
    1.5
    """
    if figure is None:
        raise SystemExit("a figure that the steps need is missing")
    return figure


def meets_print(step: Step) -> bool:
    """Tests whether ours agrees with the printed digits: rounded to them, or (behind a decimal point) cut to them.

    >>> meets_print(Step("M", 27.0095, "27")), meets_print(Step("S", -60.76, "-60"))
    (True, False)
    >>> meets_print(Step("E", 678.2297, "678.22")), meets_print(Step("I", 7.727687, "7.72767"))
    (True, False)
    >>> meets_print(Step("C", 71.61972, "71.6198"))
    False
    """
    if step.printed is None:
        return True
    ours, printed = Decimal(float(known(step.ours))), Decimal(step.printed)
    digit = Decimal(1).scaleb(int(printed.as_tuple().exponent))
    rounded = abs(ours - printed) <= digit / 2
    cut = digit < 1 and ours.quantize(digit, ROUND_DOWN) == printed
    return rounded or cut


def meets_truth(step: Step) -> bool:
    """Tests whether ours lies within `AGREEMENT` of the figure recomputed apart."""
    if step.true is None:
        return True
    return abs(known(step.ours) - step.true) <= AGREEMENT * max(abs(step.true), step.scale)


def verdict(step: Step) -> str:
    """Say `ok`, `print errs` or what is wrong with a step.

    >>> verdict(Step("I", 348.98939678, "348.989"))
    'ok'
    >>> verdict(Step("I", 348.98939678, "349.5"))
    'DISAGREES with the print'
    """
    if not meets_truth(step):
        return f"DISAGREES with the true {step.true:.12g}"
    if step.erratum:
        return "NO ERRATUM: the print is right" if meets_print(step) else "print errs"
    return "ok" if meets_print(step) else "DISAGREES with the print"


def area_steps(
    areas: Sequence[Span],
    true: Sequence[float],
    printed: Sequence[str | None] = (),
    sums: Sequence[str | None] = (),
    erratum: str = "",
) -> list[Step]:
    """Steps A1.. (works, J) and S1.. (sums, J) beside true works and prints; `erratum` on those that differ."""
    if len(areas) != len(true):
        raise SystemExit(f"{len(areas)} areas, {len(true)} expected")
    works = _area_row("area A", [area.work for area in areas], true, printed)
    accumulated = _area_row("accumulated S", [area.accumulated for area in areas], [*accumulate(true)], sums)
    steps = [step._replace(scale=max(map(abs, true))) for step in works + accumulated]
    return [step if meets_print(step) else step._replace(erratum=erratum) for step in steps]


def _area_row(name: str, ours: Sequence[float], true: Sequence[float], printed: Sequence[str | None]) -> list[Step]:
    texts = printed or [None] * len(ours)
    rows = enumerate(zip(ours, texts, true, strict=True), 1)
    return [Step(f"{name}{i}", value, text, "J", figure) for i, (value, text, figure) in rows]


def report(title: str, steps: Iterable[Step], remarks: Iterable[str] = ()) -> None:
    """Print the table of steps, the errata and remarks; leave with a non-zero exit code if any step disagrees."""
    steps = list(steps)
    errata = list(dict.fromkeys(step.erratum for step in steps if step.erratum))
    print(title)
    print(f"  {'step':46} {'ours':>16} {'printed':>12}  {'unit':7} verdict")
    for step in steps:
        mark = f" [{errata.index(step.erratum) + 1}]" if step.erratum else ""
        row = f"{step.name:46} {known(step.ours):16.10g} {step.printed or '-':>12}  {step.unit:7}"
        print(f"  {row} {verdict(step)}{mark}")
    for number, erratum in enumerate(errata, 1):
        print(f"  [{number}] erratum: {erratum}; ours is the true figure")
    for remark in remarks:
        print(f"  note: {remark}")
    wrong = sum(verdict(step) not in ("ok", "print errs") for step in steps)
    if wrong:
        raise SystemExit(f"{wrong} of {len(steps)} steps disagree")
