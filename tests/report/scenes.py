"""Sections of the regime of a few scenes, without their figures, which take long to draw."""

from functools import cache
from pathlib import Path

import flywheel
from flywheel.report import drive, regime, solutions, train, wheel
from flywheel.report.document import Document, Section
from flywheel.sizing.results import Sizing

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"


def extremes(known: regime.Known) -> Section:
    return Section("I*", tuple(regime.inertia_extremes(known)))


SECTIONS = (
    *(regime.asked, drive.motor, regime.balance, drive.engine, extremes, regime.areas, regime.approximate),
    *(regime.inertia_torque, regime.exact, drive.limits, wheel.every_shaft, regime.speeds, drive.power, train.train),
    *(regime.holding, wheel.wheel, regime.check),
)


@cache
def sized(path: str, level: str = "normal") -> Sizing:
    return flywheel.size(flywheel.load(EXAMPLES / path), accuracy=level)


def steps_of(sizing: Sizing) -> Document:
    known = regime.Known(sizing)
    made = [section(known) for section in SECTIONS]
    parts = [part for part in made if part is not None]
    return Document("T", "", (*parts, regime.accuracy(known, []), regime.references(known, [])))


def printed(name: str) -> Section:
    found = solutions.solution(EXAMPLES / "exams/printed.json", EXAMPLES / f"exams/{name}.toml")
    return solutions.section(sized(f"exams/{name}.toml"), found)
