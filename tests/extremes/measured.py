"""Answers of the toolkit to a case beside its 30-digit reference: every flywheel figure with its error estimate."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import flywheel
from tests.extremes.cases import Case, cases
from tests.extremes.machines import Scene

ROUNDING = 4e-16  # a figure is a double
RTOLS = (1e-5, 1e-9, 1e-12)
REFERENCES: dict[str, Any] = json.loads((Path(__file__).parent / "references.json").read_text())


class Row(NamedTuple):
    """One extreme.

    extreme: what is extreme, in a few words. range: what was tried. error: the worst true error, relative to the larger of
    the figure and its scale; None where the answer is a refusal. estimate: the error the program itself stated there;
    None where it states none. remark: what the reference is, or the words of the refusal.
    """

    extreme: str
    range: str
    error: float | None
    estimate: float | None
    remark: str = ""


class Found(NamedTuple):
    """A figure's true error and estimate, relative."""

    what: str
    error: float
    estimate: float

    @property
    def honest(self) -> bool:
        """True if the true error is within the estimate."""
        return self.error <= self.estimate + ROUNDING


def worst(extreme: str, range_: str, result: Iterable[Found]) -> Row:
    """The worst true error of figures that are known in closed form, with the estimate there."""
    one = max(result, key=lambda item: item.error)
    return Row(extreme, range_, one.error, one.estimate, f"closed form; worst: {one.what}")


class Measured(NamedTuple):
    """One figure: true error and estimate, both relative to the larger of the figure and its scale, at an rtol."""

    name: str
    figure: str
    rtol: float
    error: float
    estimate: float

    @property
    def honest(self) -> bool:
        """True if the true error is within the estimate."""
        return self.error <= self.estimate + ROUNDING

    @property
    def kept(self) -> bool:
        """True if the figure is within rtol, or reported not to be."""
        return self.error <= max(self.rtol, ROUNDING) or self.estimate > self.rtol


@cache
def every() -> dict[str, Case]:
    """All cases, by name."""
    return cases()


def names(*groups: str) -> list[str]:
    """The names of the cases in groups."""
    return [name for name, case in every().items() if case.group in groups]


def refusal(scene: Scene) -> str:
    """The words with which a scene is refused, path first; nothing where it is not."""
    try:
        flywheel.size(flywheel.load(scene), simulate=False)
    except flywheel.SceneError as error:
        return str(error)
    return ""


@cache
def measured(name: str) -> tuple[Measured, ...]:
    """Every figure of a case at every rtol."""
    rtols = RTOLS if name != "sweep law" else RTOLS[1:2]  # its expressions take their time
    return tuple(item for rtol in rtols for item in _at(name, rtol))


def _at(name: str, rtol: float) -> Iterator[Measured]:
    case, true = every()[name], REFERENCES[name]
    for reference in true["flywheels"]:
        regime = {**case.scene["regime"], "speed": reference["speed"]}
        scene = {**case.scene, "regime": regime, "flywheel": {"irregularity": reference["irregularity"]}}
        result = flywheel.size(flywheel.load(scene), rtol=rtol, simulate=False)
        label = f"{name} at {reference['speed']:g} rad/s, {reference['irregularity']:g}"
        assert case.slivers or len(result.areas) == true["areas"], label
        yield from _figures(label, rtol, result, reference, float(true["least"]))
        share = abs(result.balance.value - float(true["balance"])) / (float(true["exchanged"]) / result.scene.cycle)
        yield Measured(label, "balance", rtol, share, result.error.work)  # as a share of the mean moment exchanged


def _figures(label: str, rtol: float, result: Any, reference: dict[str, Any], least: float) -> Iterator[Measured]:
    total, exact, torque = (float(reference[key]) for key in ("approximate_total", "exact", "inertia_torque"))
    wheel, error = result.flywheel, result.error
    for figure, true, estimate in (
        ("exact", exact, error.exact),
        ("approximate", total - least, error.approximate),
        ("approximate_total", total, error.approximate),
        ("inertia_torque", torque, error.inertia_torque),
    ):
        gap = abs(getattr(wheel, figure) - max(true, 0.0))
        yield Measured(label, figure, rtol, gap / max(true, total), estimate)


def row(extreme: str, range_: str, result: Iterable[Measured], remark: str = "") -> Row:
    """The worst true error of the exact figure at an rtol of 1e-9, with the estimate there."""
    one = max((item for item in result if item.figure == "exact" and item.rtol == 1e-9), key=lambda item: item.error)
    return Row(extreme, range_, one.error, one.estimate, remark or f"worst: {one.name}")
