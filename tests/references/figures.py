"""The figures of a scene at 30 digits: balance, areas, flywheel, and the motion with it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

from . import cells
from .machine import Machine, Sample, bracketed, listed
from .quantities import quantity

Function = Callable[[Any], Any]


class Cell(NamedTuple):
    """A stretch of the crank's turn with M*, I* and dI*/dphi at its nodes and ends, and W as a Legendre series."""

    start: Any
    end: Any
    angles: list[Any]  # start, nodes, end
    moment: list[Any]
    inertia: list[Any]
    slope: list[Any]
    work: list[Any]
    series: list[Any]
    sample: Callable[[Any], tuple[Any, Any, Any]]  # phi -> I*, dI*/dphi, M*

    def moment_at(self, phi: Any) -> Any:
        """M* at an angle of the cell."""
        return self.sample(phi)[2]

    def accumulated(self, phi: Any) -> Any:
        """W at an angle of the cell."""
        return cells.valued(self.series, 2 * (phi - self.start) / (self.end - self.start) - 1)


class Raw(NamedTuple):
    """A cell before the balance is known: samples at start, nodes, end."""

    start: Any
    end: Any
    samples: list[Sample]
    sample: Callable[[Any], Sample]

    def integral(self, pick: Callable[[Sample], Any]) -> Any:
        """The integral over the cell of what `pick` takes from each sample."""
        return cells.integral(self.start, self.end, [pick(s) for s in self.samples[1:-1]])


def sampled(machine: Machine) -> list[Raw]:
    """The machine on cells fine enough for every one of its functions."""
    todo = cells.split(machine.breaks, 2 * mp.pi / cells.WIDEST)[::-1]
    pieces: dict[Any, Callable[[Any], Sample]] = {}
    done: list[Raw] = []
    scales: list[Any] = []
    while todo:
        middle, start, end = todo.pop()
        sample = pieces.setdefault(middle, machine.piece(middle))
        samples = [sample(phi) for phi in (start, *cells.nodes_of(start, end), end)]
        columns = [[pick(s) for s in samples] for pick in PICKS]
        sizes = [max(map(abs, column)) for column in columns]
        scales = [max(pair) for pair in zip(scales, sizes, strict=True)] if scales else sizes
        floor = [scales[0], scales[0], max(scales[2:]), max(scales[2:])]
        if all(cells.tail(c[1:-1]) <= cells.TAIL * s for c, s in zip(columns, floor, strict=True)):
            done.append(Raw(start, end, samples, sample))
        else:
            half = (start + end) / 2
            todo += [(middle, half, end), (middle, start, half)]
    return done


def constant(sample: Sample) -> Any:
    """M* without the unknown."""
    return mp.fsum(t.constant for t in sample.terms)


def share(sample: Sample) -> Any:
    """dM*/d(unknown)."""
    return mp.fsum(t.share for t in sample.terms)


PICKS = (lambda s: s.inertia, lambda s: s.slope, constant, share)


class Cycle:
    """One cycle of a machine, its balance solved."""

    def __init__(self, machine: Machine) -> None:
        raw = sampled(machine)
        self.length = machine.cycle
        slope = mp.fsum(r.integral(share) for r in raw)
        residual = mp.fsum(r.integral(constant) for r in raw)
        self.balanced = slope != 0
        self.unknown = b = -residual / slope if self.balanced else mp.zero
        self.closure = mp.zero if self.balanced else residual
        self.drive_work = mp.fsum(
            r.integral(lambda s: mp.fsum(t.constant + b * t.share for t in s.terms if t.drive)) for r in raw
        )
        self.exchange = mp.fsum(r.integral(lambda s: mp.fsum(abs(t.constant + b * t.share) for t in s.terms)) for r in raw)
        self.mean_inertia = mp.fsum(r.integral(lambda s: s.inertia) for r in raw) / self.length
        self.cells: list[Cell] = []
        total = mp.zero
        for r in raw:
            self.cells.append(balanced(r, b, total))
            total = self.cells[-1].work[-1]

    # --- along the cycle ----------------------------------------------------------------------------------------

    def candidates(self, slope: Callable[[Any, Any, Any, Any], Any]) -> list[tuple[Any, Cell]]:
        """Angles where a function of phi may be extreme, given its derivative as f(I*, I*', M*, W): roots, cell ends."""
        found: list[tuple[Any, Cell]] = []
        for cell in self.cells:
            values = list(map(slope, cell.inertia, cell.slope, cell.moment, cell.work))

            def derivative(phi: Any, cell: Cell = cell) -> Any:
                return slope(*cell.sample(phi), cell.accumulated(phi))

            found += [(cell.start, cell), (cell.end, cell)]
            for i in range(len(values) - 1):
                if values[i] * values[i + 1] < 0:
                    ends = cell.angles[i], cell.angles[i + 1], values[i], values[i + 1]
                    found.append((bracketed(derivative, *ends), cell))
        return found

    def values(self, z: Any) -> list[tuple[Any, Any]]:
        """(W - z I*, angle) at every angle where it may be extreme."""
        angles = self.candidates(lambda inertia, slope, moment, work: moment - z * slope)
        return [(cell.accumulated(phi) - z * cell.sample(phi)[0], phi) for phi, cell in angles]

    def crossings(self) -> list[Any]:
        """The angles where M* changes its sign; after a stretch of zero moment, at the end of the stretch."""
        tiny = mp.mpf("1e-30") * max(abs(m) for cell in self.cells for m in cell.moment)
        found, sign = [], 0
        last, height = mp.zero, mp.zero  # the last angle, and M* there
        for cell in self.cells:
            for phi, moment in zip(cell.angles, cell.moment, strict=True):
                new = int(mp.sign(moment)) if abs(moment) > tiny else 0
                if new and sign and new != sign:
                    smooth = phi > last and abs(height) > tiny
                    at = bracketed(cell.moment_at, last, phi, height, moment) if smooth else last
                    found.append(at)
                sign = new or sign
                last, height = phi, moment
        return found

    def work(self, phi: Any) -> Any:
        """W at any angle of the cycle."""
        return next((cell for cell in self.cells if phi <= cell.end), self.cells[-1]).accumulated(phi)

    def areas(self) -> list[dict[str, Any]]:
        """The areas between the crossings of the turning-moment diagram."""
        edges = [mp.zero, *self.crossings(), self.length]
        sums = [self.work(edge) for edge in edges]
        return [
            {"from": edges[i], "to": edges[i + 1], "work": sums[i + 1] - sums[i], "accumulated": sums[i + 1]}
            for i in range(len(edges) - 1)
        ]

    def inertia_extremes(self) -> tuple[Any, Any]:
        """Least and greatest I*."""
        angles = self.candidates(lambda inertia, slope, moment, work: slope)
        values = [cell.sample(phi)[0] for phi, cell in angles]
        return min(values), max(values)


def balanced(raw: Raw, unknown: Any, before: Any) -> Cell:
    """The cell with M* and W, once the unknown and the work done before it are known."""
    moment = [constant(s) + unknown * share(s) for s in raw.samples]
    half = (raw.end - raw.start) / 2
    series = [half * c for c in cells.antiderivative(cells.fitted(moment[1:-1]))]
    series[0] += before
    angles = [raw.start, *cells.nodes_of(raw.start, raw.end), raw.end]
    work = [cells.valued(series, x) for x in (-mp.one, *cells.rule()[0], mp.one)]

    def sample(phi: Any) -> tuple[Any, Any, Any]:
        s = raw.sample(phi)
        return s.inertia, s.slope, constant(s) + unknown * share(s)

    columns = [s.inertia for s in raw.samples], [s.slope for s in raw.samples]
    return Cell(raw.start, raw.end, angles, moment, *columns, work, series, sample)


# --- the flywheel -----------------------------------------------------------------------------------------------


class Motion(NamedTuple):
    """The steady motion with a flywheel: its irregularity and its speed, angle by angle."""

    irregularity: Any
    energy: Any  # kinetic energy at phi = 0 less W(0)
    flywheel: Any  # at the crank


def wittenbauer(cycle: Cycle, speed: Any, eps: Any) -> Any:
    """The inertia at the crank that holds the irregularity at the mean of extremes; negative where none is needed."""
    top = max(v for v, _ in cycle.values((1 + eps / 2) ** 2 * speed**2 / 2))
    bottom = min(v for v, _ in cycle.values((1 - eps / 2) ** 2 * speed**2 / 2))
    return (top - bottom) / (eps * speed**2)


def motion(cycle: Cycle, speed: Any, flywheel: Any, guess: Any) -> Motion | None:
    """The motion whose extremes have the given mean, with a flywheel at the crank; None where there is none.

    f(eps) = max(W - z+ w²/2 I) - min(W - z- w²/2 I) with I = I* + flywheel falls as eps grows, and is zero where the
    energy level of the greatest speed is that of the least.
    """

    def level(eps: Any) -> tuple[Any, Any]:
        up, down = (1 + eps / 2) ** 2 * speed**2 / 2, (1 - eps / 2) ** 2 * speed**2 / 2
        high = max(v for v, _ in cycle.values(up)) - up * flywheel
        return high - min(v for v, _ in cycle.values(down)) + down * flywheel, -high

    lower, upper = mp.zero, mp.mpf(2)
    if level(upper)[0] >= 0:
        return None
    f_lower, f_upper = level(lower)[0], level(upper)[0]
    if f_lower <= mp.mpf("1e-30") * abs(f_upper):
        return Motion(mp.zero, level(lower)[1], flywheel)
    for eps in (guess * mp.mpf("0.9"), guess * mp.mpf("1.1")):
        if lower < eps < upper:
            f = level(eps)[0]
            lower, f_lower, upper, f_upper = (eps, f, upper, f_upper) if f > 0 else (lower, f_lower, eps, f)
    eps = bracketed(lambda e: level(e)[0], lower, upper, f_lower, f_upper)
    return Motion(eps, level(eps)[1], flywheel)


def speeds(cycle: Cycle, run: Motion) -> list[tuple[Any, Any]]:
    """(speed, angle) at every angle where the speed may be extreme, from the energy alone."""

    def slope(inertia: Any, slope: Any, moment: Any, work: Any) -> Any:
        return moment * (inertia + run.flywheel) - (run.energy + work) * slope

    angles = cycle.candidates(slope)
    return [
        (mp.sqrt(2 * (run.energy + cell.accumulated(phi)) / (cell.sample(phi)[0] + run.flywheel)), phi)
        for phi, cell in angles
    ]


def period(cycle: Cycle, run: Motion) -> Any:
    """The time of a cycle: the integral of dphi / omega."""
    total = mp.zero
    for cell in cycle.cells:
        inertia = cells.fitted(cell.inertia[1:-1])

        def slowness(x: Any, cell: Cell = cell, inertia: list[Any] = inertia) -> Any:
            energy = run.energy + cells.valued(cell.series, x)
            return mp.sqrt((cells.valued(inertia, x) + run.flywheel) / (2 * energy))

        total += (cell.end - cell.start) / 2 * cells.refined(slowness, -mp.one, mp.one)
    return total


def ties(values: Iterable[tuple[Any, Any]], best: Any, length: Any) -> list[Any]:
    """The distinct angles whose value is the best one."""
    close = sorted(phi % length for value, phi in values if abs(value - best) <= mp.mpf("1e-24") * abs(best))
    kept: list[Any] = []
    for phi in close:
        if length - phi < mp.mpf("1e-12"):
            phi = mp.zero
        if all(abs(phi - other) > mp.mpf("1e-12") for other in kept):
            kept.append(phi)
    return kept


# --- what the contract asks -------------------------------------------------------------------------------------


def simulated(cycle: Cycle, speed: Any, flywheel: Any, guess: Any) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """The simulation figures and the angles of extreme speed, with a check of the energy level by the speeds themselves."""
    run = motion(cycle, speed, flywheel, guess)
    if run is None:
        return None
    found = speeds(cycle, run)
    top, bottom = max(w for w, _ in found), min(w for w, _ in found)
    assert abs((top + bottom) / 2 - speed) < mp.mpf("1e-24") * speed
    assert abs((top - bottom) / speed - run.irregularity) < mp.mpf("1e-24")
    time = period(cycle, run)
    figures = {"irregularity": run.irregularity, "speed_max": top, "speed_min": bottom}
    figures |= {"speed_time_mean": cycle.length / time, "period": time}
    angles = {"angle_speed_max": ties(found, top, cycle.length), "angle_speed_min": ties(found, bottom, cycle.length)}
    return figures, angles


def sizing(cycle: Cycle, speed: Any, eps: Any, ratio: Any) -> dict[str, Any]:
    """The flywheel's figures and the motion with it, for an asked irregularity."""
    least, _ = cycle.inertia_extremes()
    scale = eps * speed**2
    works = [v for v, _ in cycle.values(mp.zero)]
    swing = max(works) - min(works)
    at_speed = [v for v, _ in cycle.values(speed**2 / 2)]
    exact = wittenbauer(cycle, speed, eps)
    total = swing / scale
    approximate = max(total - least, mp.zero)
    torque = max((max(at_speed) - min(at_speed)) / scale, mp.zero)
    wheel = {"inertia": None, "exact": max(exact, mp.zero), "approximate": approximate, "approximate_total": total}
    wheel = {k: v if v is None else v / ratio**2 for k, v in (wheel | {"inertia_torque": torque}).items()}
    result = simulated(cycle, speed, max(exact, mp.zero), eps)
    assert result is not None
    figures, angles = result
    rough = motion(cycle, speed, approximate, eps)
    figures["irregularity_approximate"] = rough.irregularity if rough else None
    return {"flywheel": wheel | {"needed": exact > 0}, "simulation": figures, **angles}


def references(machine: Machine) -> dict[str, Any]:
    """All the figures of a scene with a machine."""
    scene, cycle = machine.scene, Cycle(machine)
    regime, wheel = scene["regime"], scene["flywheel"]
    speed = quantity(regime["speed"]) / machine.shafts[regime.get("on", "crank")]
    ratio = machine.shafts[wheel.get("on", "crank")]
    works = [v for v, _ in cycle.values(mp.zero)] + [mp.zero]
    least, most = cycle.inertia_extremes()
    drive = "drive" in scene
    swing = max(works) - min(works)
    figures = {
        "cycle": cycle.length, "speed": speed, "closure": cycle.closure, "work_exchanged": cycle.exchange,
        "balance": cycle.unknown if cycle.balanced else None,
        "power": cycle.drive_work * speed / cycle.length if drive else None,
        "areas": cycle.areas(), "accumulated_max": max(works), "accumulated_min": min(works),
        "energy_fluctuation": swing, "coefficient_of_energy": swing / cycle.drive_work if cycle.drive_work else None,
        "reduced_inertia": {"min": least, "max": most, "mean": cycle.mean_inertia},
    }  # fmt: skip
    if "irregularity" in wheel:
        return figures | sizing(cycle, speed, quantity(wheel["irregularity"]), ratio)
    given = quantity(wheel["inertia"])
    empty = dict.fromkeys(("exact", "approximate", "approximate_total", "inertia_torque", "needed"))
    guess = swing / (speed**2 * (given * ratio**2 + cycle.mean_inertia))
    result = simulated(cycle, speed, given * ratio**2, guess)
    assert result is not None
    motion_figures, angles = result
    motion_figures["irregularity_approximate"] = None
    return figures | {"flywheel": {"inertia": given, **empty}, "simulation": motion_figures, **angles}


def summed(scene: dict[str, Any]) -> dict[str, Any]:
    """The figures of a scene that gives areas in place of a machine."""
    scale = quantity(scene["areas"]["scale"])
    works = [quantity(value) * scale for value in listed(scene["areas"]["values"])]
    sums = [mp.fsum(works[: i + 1]) for i in range(len(works))]
    swing = max(*sums, mp.zero) - min(*sums, mp.zero)
    shafts = {"crank": mp.one} | {n: quantity(s["ratio"]) for n, s in scene.get("shafts", {}).items()}
    regime, wheel = scene["regime"], scene["flywheel"]
    speed = quantity(regime["speed"]) / shafts[regime.get("on", "crank")]
    ratio = shafts[wheel.get("on", "crank")]
    figures = {
        "speed": speed, "closure": sums[-1] / swing, "work_exchanged": mp.fsum(map(abs, works)),
        "areas": [{"work": w, "accumulated": a} for w, a in zip(works, sums, strict=True)],
        "accumulated_max": max(*sums, mp.zero), "accumulated_min": min(*sums, mp.zero), "energy_fluctuation": swing,
    }  # fmt: skip
    if "irregularity" in wheel:
        size = swing / (quantity(wheel["irregularity"]) * speed**2) / ratio**2
        names = ("exact", "approximate", "approximate_total")
        return figures | {"flywheel": {"inertia": None} | dict.fromkeys(names, size), "simulation": None}
    eps = swing / (quantity(wheel["inertia"]) * ratio**2 * speed**2)
    run = {"irregularity": eps, "speed_max": speed * (1 + eps / 2), "speed_min": speed * (1 - eps / 2)}
    return figures | {"flywheel": {"inertia": quantity(wheel["inertia"])}, "simulation": run}
