"""What accuracy costs on a scene, as plain data: a row for each method, and the cheapest that keeps the accuracy asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from flywheel.tradeoffs.reference import Reference


class Row(NamedTuple):
    """One method on one scene.

    `error` is the true relative error of its `value`, None without an answer; `meets` whether that is within rtol, None
    where the reference's own doubt does not let one tell. `seconds` is the median of `repeats`, `fastest` and `slowest`
    their extremes.
    `evaluations`: positions of the crank at which the machine was evaluated. `promised` is the error that it promises
    by itself, None where it does not know its own. `outcome` is done, no answer, out of time or not run.
    """

    name: str
    family: str
    label: str
    outcome: str
    value: float | None
    error: float | None
    meets: bool | None
    seconds: float | None
    fastest: float | None
    slowest: float | None
    repeats: int
    evaluations: int | None
    promised: float | None
    leaves_out: str
    reason: str


@dataclass(frozen=True)
class Tradeoff:
    """Every method on one scene, against a verified reference (kg m² on the flywheel's shaft, or an irregularity).

    Errors are relative to the figure, or to `scale` where that is larger. `cheapest` names the fastest row that keeps rtol,
    `level` those that took as long within the noise, `cheapest_promised` the fastest of those that know their own error and
    promise rtol. `messages` are what the sizing itself has to say.
    `cannot` lists methods that the scene is nothing for, with the reason.
    """

    title: str | None
    figure: str
    unit: str
    rtol: float
    reference: Reference
    scale: float
    rows: tuple[Row, ...]
    cheapest: str | None
    level: tuple[str, ...]
    cheapest_promised: str | None
    cannot: dict[str, str]
    budget: float
    seconds: float
    interrupted: bool
    messages: tuple[str, ...] = ()

    def row(self, name: str) -> Row:
        """The row of that name."""
        return next(row for row in self.rows if row.name == name)

    @property
    def complete(self) -> bool:
        """Whether every method was run to its end."""
        return not self.interrupted and all(row.outcome in ("done", "no answer") for row in self.rows)

    @property
    def sentence(self) -> str:
        """What follows for the user, in plain words."""
        if self.cheapest is None and any(row.value is not None and row.meets is None for row in self.rows):
            doubt = f"the reference itself is in doubt by {self.reference.doubt:.1e}"
            return f"Which method keeps the relative error of {self.rtol:g} cannot be told on this scene: {doubt}."
        if self.cheapest is None:
            return f"No method that was run keeps the relative error of {self.rtol:g} on this scene."
        best = self.row(self.cheapest)
        told = f"Cheapest that keeps a relative error of {self.rtol:g} on this scene: {self._priced(best)}"
        if self.level:
            told += f"; level with it within the noise: {'; '.join(self.level)}"
        told += "."
        if best.promised is not None and best.promised <= self.rtol:
            return told
        if self.cheapest_promised is None:
            return told + " It does not know its own error; none that does was run to its end."
        sure = self._priced(self.row(self.cheapest_promised))
        return told + f" It does not know that it does: the cheapest that promises it is {sure}."

    def _priced(self, row: Row) -> str:
        known = row.error is not None and row.error > self.reference.doubt
        error = f"{row.error:.1e}" if known else f"below {self.reference.doubt:.1e}"
        return f"{row.name} ({duration(row.seconds or 0.0)}, error {error})"

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        own = (
            "title",
            "figure",
            "unit",
            "rtol",
            "scale",
            "cheapest",
            "cheapest_promised",
            "budget",
            "seconds",
            "interrupted",
        )
        return {
            **{name: getattr(self, name) for name in own},
            "level": list(self.level),
            "messages": list(self.messages),
            "complete": self.complete,
            "sentence": self.sentence,
            "reference": {name: value for name, value in self.reference._asdict().items() if name != "messages"},
            "rows": [row._asdict() for row in self.rows],
            "cannot": dict(self.cannot),
        }


def duration(seconds: float) -> str:
    """A time with a unit that suits it.

    >>> duration(0.00042), duration(3.14159)
    ('0.42 ms', '3.1 s')
    """
    return (
        f"{seconds:.2g} s" if seconds >= 1.0 else f"{1e3 * seconds:.3g} ms" if seconds >= 0.1 else f"{1e3 * seconds:.2g} ms"
    )
