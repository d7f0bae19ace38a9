"""The figures of a scene whose torques depend on position alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from tests.oracle import panels
from tests.oracle.machine import Machine, Sample
from tests.oracle.numbers import DIGITS, EPS, KIND, PI, ZERO, Real, bracketed, finer, finite, plain, real
from tests.oracle.panels import LOOK, Grown, Panels, Places

WIDEST = PI / (8 if DIGITS else 32)
MOST_PANELS = 30_000
DEEPEST = 30
NOISE = finer(14)  # of a function's integral: where halving a panel does not help below this, it is rounding
ZERO_MOMENT = finer(17)  # of its greatest value: below it a moment is none
ENOUGH = 64 * EPS  # of a function's greatest value on a panel: its last coefficients


class Cycle(NamedTuple):
    """A balanced cycle: M*, I*, dI*/dphi at the nodes, W and I* - I*(0) as running integrals, and the balance."""

    mesh: Panels
    moment: Any
    inertia: Any
    slope: Any
    work: Grown
    variation: Grown
    at_start: Any  # I*(0)
    unknown: Any
    exchanged: Any
    drive_work: Any
    effect: Any = ZERO  # net work per unit of the unknown

    def angles(self, places: Places) -> Any:
        """The angles of places."""
        return places.angles(self.mesh)

    def h(self, factor: Any) -> tuple[Any, Any]:
        """W - factor (I* - I*(0)) wherever it may be extreme, and the angles there."""
        result = panels.candidates(self.moment - factor * self.slope)
        return self.work.at(*result) - factor * self.variation.at(*result), self.angles(result)


class Extreme(NamedTuple):
    """A value, with all angles at which it may stand."""

    value: Any
    angles: Any


def summed(parts: dict[str, Any]) -> Any:
    """A quantity of all shafts together."""
    return np.sum(list(parts.values()), axis=0)


def resolved(machine: Machine, pace: Any = None, breaks: Any = None) -> tuple[Panels, Sample]:
    """The machine at a constant speed (if it minds) on panels fine enough for each of its functions."""
    edges, before = panels.spread(machine.breaks if breaks is None else breaks, WIDEST), None
    for _ in range(DEEPEST):
        mesh = panels.panels(edges)
        sample = machine.sampled(machine.frame(mesh.phi, mesh.middle), pace, pace)
        left = remainders(sample, mesh)
        noise = 0 if before is None else (left > before / 4) & (left < NOISE)  # halving helped no more
        coarse = ((left > EPS) & ~np.asarray(noise, dtype=bool)).any(axis=0) & (mesh.half[:, 0] > 1e-13)
        if not coarse.any() or edges.size > MOST_PANELS:
            break
        edges, before = panels.bisected(edges, coarse), np.repeat(left, 1 + coarse, axis=1)
    return mesh, sample


def remainders(sample: Sample, mesh: Panels) -> Any:
    """The last coefficients of every function on every panel, as shares of what all of its kind amount to; 0 if resolved."""
    terms = sample.terms
    kinds = [list(sample.inertia.values()), list(sample.slope.values())]
    kinds += [[t.constant for t in terms], [t.share for t in terms]]
    weight = np.abs(np.array(kinds[0])).max()
    result = []
    for k, kind in enumerate(kinds):
        rows = np.array(kind)
        whole = panels.integrals(np.abs(rows), mesh.half).sum() + (weight if k == 1 else 0) if kind else Real(1)
        for row in rows:
            tail = panels.tails(row)
            fine = tail <= ENOUGH * np.abs(row).max(axis=-1)
            result.append(np.where(fine, 0, tail * mesh.half[:, 0] / np.maximum(whole, Real("1e-300"))))
    return np.array(result)


def cycle_of(machine: Machine) -> Cycle:
    """One cycle, its balance solved."""
    mesh, sample = resolved(machine)
    constant = np.sum([t.constant for t in sample.terms], axis=0) + 0 * mesh.phi
    share = np.sum([t.share for t in sample.terms], axis=0) + 0 * mesh.phi
    net, slope = panels.integrals(constant, mesh.half).sum(), panels.integrals(share, mesh.half).sum()
    unknown = -net / slope if machine.balanced else Real(0)
    drive = sum(
        (panels.integrals(t.constant + unknown * t.share, mesh.half).sum() for t in sample.terms if t.drive), Real(0)
    )
    exchanged = sum(
        (panels.integrals(np.abs(t.constant + unknown * t.share), mesh.half).sum() for t in sample.terms), Real(0)
    )
    return assembled(mesh, constant + unknown * share, sample, unknown, exchanged, drive)._replace(effect=abs(slope))


def assembled(mesh: Panels, moment: Any, sample: Sample, unknown: Any, exchanged: Any, drive: Any) -> Cycle:
    """The cycle from its values at the nodes."""
    inertia, slope = summed(sample.inertia), summed(sample.slope)
    variation = panels.grown(slope, mesh.half)
    at_start = panels.valued(panels.fit(inertia[:1]), np.array([Real(-1)]))[0]
    work = panels.grown(moment, mesh.half)
    return Cycle(mesh, moment, inertia, slope, work, variation, at_start, unknown, exchanged, drive)


def works(cycle: Cycle) -> dict[str, Any]:
    """Areas between the sign changes of M*, and the extremes of W."""
    angles, sums = crossings(cycle)
    edges = [Real(0), *angles, cycle.mesh.edges[-1]]
    values, _ = cycle.h(Real(0))
    totals = [Real(0), *sums, cycle.work.edges[-1]]
    areas = [
        {"to": edges[i + 1], "work": totals[i + 1] - totals[i], "accumulated": totals[i + 1]} for i in range(len(edges) - 1)
    ]
    top, bottom = values.max(), values.min()
    return {"areas": areas, "accumulated_max": top, "accumulated_min": bottom, "energy_fluctuation": top - bottom}


def crossings(cycle: Cycle) -> tuple[list[Any], list[Any]]:
    """Angles where M* changes its sign, and W there; after a stretch of zeros, where the stretch ends."""
    series = panels.fit(cycle.moment)
    looked = panels.looked(series)
    signs = np.sign(np.where(np.abs(looked) > ZERO_MOMENT * np.abs(looked).max(), looked, 0)).ravel()
    known = np.flatnonzero(signs)
    change = np.flatnonzero(signs[known[1:]] * signs[known[:-1]] < 0)
    panel, after = np.divmod(known[change + 1], LOOK.size)
    before, start = known[change], known[change + 1] - after  # a sign that changed before its panel began
    first = np.where(before >= start, before - start, 0)
    inside = (before >= start) & (looked[panel, first] * looked[panel, after] < 0)
    rows = series[panel[inside]]
    ends = (
        LOOK[first[inside]],
        LOOK[after[inside]],
        looked[panel[inside], first[inside]],
        looked[panel[inside], after[inside]],
    )
    t = -np.ones(panel.size, dtype=KIND)
    if inside.any():
        t[inside] = bracketed(lambda x: panels.valued(rows, x), *ends)
    places = Places(panel, t)
    return list(cycle.angles(places)), list(cycle.work.at(*places))


class Run(NamedTuple):
    """A motion: its mean of extremes, s in omega² = speed² (1 + s) at places, and its level of energy less that of speed."""

    speed: Any
    places: Places
    s: Any
    level: Any

    @property
    def excess(self) -> tuple[Any, Any]:
        """Greatest and least of omega/speed - 1."""
        top, bottom = self.s.max(), self.s.min()
        return top / (1 + plain.sqrt(1 + top)), bottom / (1 + plain.sqrt(1 + bottom))

    @property
    def irregularity(self) -> Any:
        """(greatest - least)/mean."""
        high, low = self.excess
        return (high - low) / (1 + (high + low) / 2)


def run_of(cycle: Cycle, speed: Any, flywheel: Any) -> Run | None:
    """The motion with a flywheel (at the crank) and a mean of extremes; None where the machine would stop."""
    total = flywheel + cycle.at_start + cycle.variation.nodes()
    if not finite(total) or total.min() <= 0 or flywheel + cycle.at_start + cycle.variation.looked().min() <= 0:
        return None
    work, variation = cycle.work.nodes(), cycle.variation.nodes()
    moment, slope = panels.fit(cycle.moment), panels.fit(cycle.slope)

    def run(level: Any, *, exact: bool = False) -> Run:
        def excess(panel: Any, t: Any) -> Any:
            w, v = cycle.work.at(panel, t), cycle.variation.at(panel, t)
            return (2 * level + 2 * w - speed**2 * v) / (speed**2 * (flywheel + cycle.at_start + v))

        def torque(panel: Any, t: Any) -> Any:
            pull = speed**2 / 2 * (1 + excess(panel, t))
            return panels.valued(moment[panel], t) - pull * panels.valued(slope[panel], t)

        s = (2 * level + 2 * work - speed**2 * variation) / (speed**2 * total)
        values = cycle.moment - speed**2 / 2 * (1 + s) * cycle.slope
        places = panels.candidates(values, torque if exact else None)
        return Run(speed, places, excess(*places), level)

    looked = cycle.work.looked()
    lowest = -(speed**2) / 2 * (flywheel + cycle.at_start) - looked.min()
    low, high = lowest, None
    level = np.maximum(Real(0), lowest + abs(lowest) * Real("1e-6"))
    for _ in range(200):
        result = run(level)
        if result.s.min() <= -1:
            low, level = level, (level + (high if high is not None else 2 * level + abs(lowest) + 1)) / 2
            continue
        gap = sum(result.excess)
        if gap > 0:
            high = level
        else:
            low = level
        ends = [int(result.s.argmax()), int(result.s.argmin())]
        heavy = flywheel + cycle.at_start + cycle.variation.at(result.places.panel[ends], result.places.t[ends])
        steep = (1 / (speed**2 * heavy * plain.sqrt(1 + result.s[ends]))).sum()
        target = level - gap / steep
        if not (low < target and (high is None or target < high)):
            target = (low + high) / 2 if high is not None else 2 * level - low + abs(level)
        small = abs(target - level) <= 4 * EPS * (abs(level) + speed**2 / 4 * total.min() * np.ptp(result.s))
        level = target
        if small:
            break
        if high is not None and high - lowest <= finer(15) * abs(lowest):
            return None
    result = run(level, exact=True)
    return result if result.s.min() > -1 and abs(sum(result.excess)) < 1e-12 else None


def period_of(cycle: Cycle, run: Run, flywheel: Any) -> Any:
    """The time of a cycle, on panels halved until the speed is resolved."""
    edges, before = cycle.mesh.edges, None
    for _ in range(DEEPEST):
        mesh = panels.panels(edges)
        panel = np.clip(np.searchsorted(cycle.mesh.edges, mesh.phi, side="right") - 1, 0, cycle.mesh.half.size - 1)
        t = (mesh.phi - cycle.mesh.middle[panel, 0]) / cycle.mesh.half[panel, 0]
        work, variation = cycle.work.at(panel, t), cycle.variation.at(panel, t)
        energy = 2 * run.level + 2 * work + run.speed**2 * (flywheel + cycle.at_start)
        pace = plain.sqrt((flywheel + cycle.at_start + variation) / energy)
        left = panels.tails(pace) * mesh.half[:, 0] / panels.integrals(pace, mesh.half).sum()
        coarse = (left > EPS) & (mesh.half[:, 0] > 1e-13)
        if before is not None:
            coarse &= ~((left > before / 4) & (left < NOISE))
        if not coarse.any() or edges.size > MOST_PANELS:
            break
        edges, before = panels.bisected(edges, coarse), np.repeat(left, 1 + coarse)
    return panels.integrals(pace, mesh.half).sum()


def near(values: Any, best: Any, angles: Any, slack: float) -> Extreme:
    """An extreme with the angles of all that cannot be told from it."""
    return Extreme(best, angles[np.abs(values - best) <= slack])


def motion_figures(cycle: Cycle, run: Run, flywheel: Any) -> Iterator[tuple[str, Any]]:
    """The figures of the simulation, and the angles of the extremes."""
    high, low = run.excess
    time = period_of(cycle, run, flywheel)
    yield "irregularity", run.irregularity
    yield "speed_max", run.speed * (1 + high)
    yield "speed_min", run.speed * (1 + low)
    yield "speed_time_mean", cycle.mesh.edges[-1] / time
    yield "period", time


def inertias(cycle: Cycle, speed: Any, eps: Any) -> dict[str, Any]:
    """The flywheels of an irregularity at the crank, before any floor but that of the approximate ones."""
    unit = eps * speed**2
    up, down = (1 + eps / 2) ** 2 * speed**2 / 2, (1 - eps / 2) ** 2 * speed**2 / 2
    (high, _), (low, _), (torque, _), (work, _) = (cycle.h(f) for f in (up, down, speed**2 / 2, Real(0)))
    least, _ = extremes_of_inertia(cycle)
    total = (work.max() - work.min()) / unit
    return {
        "exact": (high.max() - low.min()) / unit - cycle.at_start,
        "approximate_total": total,
        "approximate": np.maximum(total - least, Real(0)),
        "inertia_torque": np.maximum((torque.max() - torque.min()) / unit, Real(0)),
        "inertia_torque_flywheel": np.maximum((torque.max() - torque.min()) / unit - least, Real(0)),
    }


def extremes_of_inertia(cycle: Cycle) -> tuple[Any, Any]:
    """Least and greatest I*, not by its slope: what a peak adds up to would hide the least."""
    result = panels.candidates(cycle.slope)
    values = panels.valued(panels.fit(cycle.inertia)[result.panel], result.t)
    return values.min(), values.max()


def references(machine: Machine, slack: float = 1e-12) -> dict[str, Any]:
    """All figures of a scene, those of flywheels at their own shaft; `motion` is False where the machine would stop."""
    scene, cycle = machine.scene, cycle_of(machine)
    wheel, regime = scene["flywheel"], scene["regime"]
    speed = real(regime["speed"]) / machine.shafts[regime.get("on", "crank")]
    ratio = machine.shafts[wheel.get("on", "crank")]
    least, most = extremes_of_inertia(cycle)
    mean = panels.integrals(cycle.inertia, cycle.mesh.half).sum() / cycle.mesh.edges[-1]
    result = works(cycle) | {"reduced_inertia": {"min": least, "max": most, "mean": mean}, "cycle": cycle, "speed": speed}
    result |= {"balance": cycle.unknown if machine.balanced else None, "exchanged": cycle.exchanged}
    result |= {"effect": cycle.effect, "flywheel": {}}
    result["power"] = cycle.drive_work * speed / cycle.mesh.edges[-1] if "drive" in scene else None
    flywheel = Real(0)
    if "irregularity" in wheel:
        sized = inertias(cycle, speed, real(wheel["irregularity"]))
        flywheel = np.maximum(sized["exact"], Real(0))
        result["flywheel"] = {k: np.maximum(v, Real(0)) / ratio**2 for k, v in sized.items()}
        result["needed"] = sized["exact"] > 0
    else:
        flywheel = real(wheel["inertia"]) * ratio**2
    run = run_of(cycle, speed, flywheel)
    result["motion"] = run is not None
    if run is not None:
        if "inertia" in wheel:
            result["simulation"] = dict(motion_figures(cycle, run, flywheel))
        angles = cycle.angles(run.places)
        result["angle_speed_max"] = near(run.s, run.s.max(), angles, slack * float(np.ptp(run.s)))
        result["angle_speed_min"] = near(run.s, run.s.min(), angles, slack * float(np.ptp(run.s)))
    return result
