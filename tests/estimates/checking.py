"""A scene sized by the package against its reference: the true error of every figure beside the estimate that it carries."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import flywheel
from flywheel import Sizing
from flywheel.regime.turning_moment import speed_over_cycle
from tests.estimates.scenes import Scene, scene_of
from tests.oracle import figures, panels, regimes
from tests.oracle.figures import Cycle
from tests.oracle.machine import Machine
from tests.oracle.numbers import Real, real

HALF_ULP = 2.0**-53  # a figure is a double
PROVEN = "outside "  # how the names of rows about proofs begin
FLOOR = HALF_ULP  # of true errors, where ratios are formed


class Row(NamedTuple):
    """One figure: relative true error (of an angle in rad), its estimate; whether it is relative, and rtol asked of it."""

    name: str
    true: float
    estimate: float
    relative: bool = True
    by_rtol: bool = True

    @property
    def kept(self) -> bool:
        """True if the estimate is no less than the true error."""
        return self.true <= self.estimate + (HALF_ULP if self.relative else 4 * HALF_ULP)


class Outcome(NamedTuple):
    """Outcome of a scene: its rows; faults in a sentence each; the package's refusal; whether speeds matter.

    `lost` where the reference finds no motion: nothing holds it but rounding, even of 64 bits. `proven` where figures were.
    """

    seed: int
    rows: tuple[Row, ...]
    faults: tuple[str, ...]
    refused: str | None
    moving: bool
    lost: bool = False
    proven: bool = False

    @property
    def counts(self) -> bool:
        """True if its figures could be compared."""
        return self.refused is None and not self.lost


def outcome(seed: int, accuracy: str = "normal") -> Outcome:
    """A scene of a seed, sized and compared; at accuracy proof also with its proven intervals."""
    scene = scene_of(seed)
    with np.errstate(all="ignore"):
        machine = Machine(scene if accuracy == "normal" else in_decimals(scene))
        try:
            sizing = flywheel.size(flywheel.load(scene), accuracy=accuracy)
        except flywheel.SceneError as error:
            return Outcome(seed, (), tuple(refusal(machine, scene)), str(error), machine.moving)
        try:
            rows = tuple(moving(machine, sizing) if machine.moving else still(machine, sizing))
        except (regimes.NoMotionError, np.linalg.LinAlgError):
            return Outcome(seed, (), (), None, True, lost=True)
    proven = sizing.proof is not None and bool(sizing.proof.figures)
    faults = [f"{r.name}: true error {r.true:.3g}, estimate {r.estimate:.3g}" for r in rows if not r.kept]
    missed = [r for r in rows if r.relative and r.by_rtol and not r.true <= sizing.rtol + HALF_ULP]
    if sizing.reached and missed:
        faults += [f"{r.name}: true error {r.true:.3g} at rtol {sizing.rtol:g}, said to be reached" for r in missed]
    return Outcome(seed, rows, tuple(faults), None, machine.moving, proven=proven)


def in_decimals(written: Any) -> Any:
    """A scene whose numbers are the decimals that are written, not the floats beside them."""
    if isinstance(written, dict):
        return {key: value if key == "motor" else in_decimals(value) for key, value in written.items()}
    if isinstance(written, list):
        return [in_decimals(value) for value in written]
    return repr(written) if isinstance(written, float) else written


def refusal(machine: Machine, scene: Scene) -> list[str]:
    """Faults of a refusal: a machine whose torques do not depend on speed may have a motion after all."""
    if machine.moving:
        return []
    true = figures.references(machine)
    return ["refused, but it has a motion"] if true["motion"] else []


def error(found: Any, true: Any, scale: Any = 0) -> float:
    """The error of a figure, relative to it or to its scale, whichever is larger."""
    if found is None or true is None:
        return 0.0 if found is true else float("inf")
    size = max(abs(Real(true)), abs(Real(scale)))
    return float(abs(Real(found) - Real(true)) / size) if float(size) else float(abs(found))  # as 1e-1959 is no double


def works(sizing: Sizing, true: dict[str, Any]) -> list[Row]:
    """W's extremes and the areas, against the estimate for works."""
    estimate, scale = sizing.error.work or 0.0, true["exchanged"]
    keys = ("accumulated_max", "accumulated_min", "energy_fluctuation")
    rows = [Row(key, error(getattr(sizing, key), true[key], scale), estimate) for key in keys]
    mine = [(a.end, a.work, a.accumulated) for a in sizing.areas]
    theirs = [(a["to"], a["work"], a["accumulated"]) for a in true["areas"]]
    slack = (estimate + 1e-16) * float(scale)
    mine, theirs = thinned(mine, slack, len(theirs)), thinned(theirs, slack, len(mine))
    if len(mine) != len(theirs):
        return [*rows, Row(f"areas: {len(mine)} for {len(theirs)}", np.inf, estimate)]
    angle = 0.0
    for k, (a, b) in enumerate(zip(mine, theirs, strict=True)):
        rows += [Row(f"area {k} work", error(a[1], b[1], scale), estimate)]
        rows += [Row(f"area {k} accumulated", error(a[2], b[2], scale), estimate)]
        angle = max(angle, abs(float(a[0] - b[0])))
    return [*rows, Row("angles of areas", angle, sizing.error.angles or 0.0, False)]


def thinned(areas: list[Any], slack: float, count: int) -> list[Any]:
    """The areas without those that are nothing but rounding, as long as there are more than `count` of them."""
    areas = list(areas)
    while len(areas) > count and (small := [k for k, a in enumerate(areas) if float(abs(a[1])) <= slack]):
        k = min(small, key=lambda k: abs(areas[k][1]))
        before, after = areas[:k], areas[k + 1 :]
        if before and after:  # what lay on both sides of it has one sign
            joined = (after[0][0], before[-1][1] + areas[k][1] + after[0][1], after[0][2])
            areas = [*before[:-1], joined, *after[1:]]
        elif before:
            areas = [*before[:-1], (areas[k][0], before[-1][1] + areas[k][1], areas[k][2])]
        else:
            areas = [(after[0][0], areas[k][1] + after[0][1], after[0][2]), *after[1:]]
    return areas


def extremes(sizing: Sizing, true: dict[str, Any]) -> list[Row]:
    """The angles of the greatest and the least speed, to within the reference's own rounding."""
    rows, rounding = [], rounding_of_swing(sizing)
    for key in ("angle_speed_max", "angle_speed_min"):
        result, places = getattr(sizing, key), true.get(key)
        if result is not None and places is not None:
            gaps = np.abs(places.angles - result)
            gap = np.minimum(gaps, sizing.scene.cycle - gaps).min()
            rows.append(Row(key, max(float(gap) - rounding, 0.0), sizing.error.extremes or 0.0, False))
    return rows


def common(sizing: Sizing, true: dict[str, Any]) -> list[Row]:
    """Works, angles, balance, flywheels, simulation."""
    even = sizing.run is None or sizing.run.irregularity == 0.0  # then every angle is one of extreme speed
    rows = works(sizing, true) + ([] if even else extremes(sizing, true))
    if sizing.balance is not None:
        result, wanted = sizing.balance.value, true["balance"]
        if result:  # none at all is told by its work alone
            rows.append(Row("balance", error(result, wanted, result), sizing.balance.error, by_rtol=False))
        if true.get("effect"):
            done = error(result, wanted, true["exchanged"] / true["effect"])
            rows.append(Row("work of the balance", done, sizing.error.work or 0.0))
    scale = scale_of(sizing, true)
    keys = {"exact": "exact", "approximate": "approximate", "approximate_total": "approximate"}
    keys |= {name: name for name in ("inertia_torque", "inertia_torque_flywheel")}
    for name, estimate in keys.items():
        value = getattr(sizing.error, estimate)
        if name in true["flywheel"] and value is not None:
            rows.append(Row(name, error(getattr(sizing.flywheel, name), true["flywheel"][name], scale), value))
    if sizing.simulation is not None and sizing.error.simulation is not None:
        for name, value in true.get("simulation", {}).items():
            result = getattr(sizing.simulation, name)
            speeds, rest = sizing.error.extreme_speeds, sizing.error.period
            own = {"irregularity": sizing.error.simulation, "speed_max": speeds, "speed_min": speeds}.get(name, rest)
            rows.append(Row(name, error(result, value, result == 0.0), own or 0.0))  # an even motion has 0
    return [*rows, *outside(sizing, true)]


def outside(sizing: Sizing, true: dict[str, Any]) -> list[Row]:
    """Distance of true values from the intervals in which they are proven to lie, to within the reference's own rounding.

    That of a fluctuation is that of all the work: of seed 29000045, which exchanges 29,000 times as much, 4e-15.
    """
    rows, own = [], {"speed": rounding_of_level(sizing), "simulation.irregularity": rounding_of_swing(sizing)}
    if (level := true.get("speed")) and (run := true.get("simulation")):  # two extremes whose mean is not the speed
        off = float(abs((run["speed_max"] + run["speed_min"]) / 2 - level))
        own |= {f"simulation.{key}": off / float(run[key]) for key in ("speed_max", "speed_min") if run[key]}
    if swing := true.get("energy_fluctuation"):
        share = 4 * float(regimes.EPS * true["exchanged"] / swing)
        own |= {"energy_fluctuation": share, "flywheel.approximate_total": share}
    for key, ends in ({} if sizing.proof is None else sizing.proof.figures).items():
        value: Any = true
        for name in ("balance" if key == "balance.value" else key).split("."):
            value = value.get(name) if isinstance(value, dict) else None
        if value is not None:
            low, high = map(Real, ends)
            scale = true["exchanged"] if key.startswith("accumulated") else value
            if key == "balance.value" and true.get("effect"):
                scale = true["exchanged"] / true["effect"]
            off = error(max(low - value, value - high, Real(0)), Real(0), scale)
            rows.append(Row(f"{PROVEN}{key}", off, own.get(key, 0.0), by_rtol=False))
    return rows


def rounding_of_swing(sizing: Sizing) -> float:
    """The reference's own rounding of a speed, over what varies of it: of seed 30000036 with 2e-7, 5e-13; all of nothing."""
    varies = 0.0 if sizing.run is None else sizing.run.irregularity
    return float(regimes.EPS / varies) if varies else float(sizing.run is not None)


def scale_of(sizing: Sizing, true: dict[str, Any]) -> Any:
    """Scale of errors of flywheels: that of the areas, or, where nothing varies, that by all the work."""
    if sizing.scene.irregularity is None:
        return 0
    unit = sizing.scene.irregularity * (sizing.constant_speed or sizing.speed) ** 2
    swing, all_work = true["energy_fluctuation"], true["exchanged"]
    own = sizing.reduced_inertia.max if sizing.reduced_inertia else 0.0
    if swing >= 1e-13 * all_work > 0 and swing / unit >= 1e-16 * own:  # else what the machine stores hides all of it
        return swing / unit / sizing.scene.flywheel_ratio**2
    return max(all_work / unit, own) / sizing.scene.flywheel_ratio**2


def still(machine: Machine, sizing: Sizing) -> list[Row]:
    """Every figure of a scene whose torques depend on position alone."""
    slack = max(sizing.error.exact or 0.0, sizing.error.simulation or 0.0, 1e-15)
    return common(sizing, figures.references(machine, 4 * slack))


def moving(machine: Machine, sizing: Sizing) -> list[Row]:
    """Every figure of a scene whose torques depend on speed, found anew from the package's own as a guess."""
    scene = machine.scene
    wheel, ratio = scene["flywheel"], machine.shafts[scene["flywheel"].get("on", "crank")]
    speed = real(scene["regime"]["speed"]) if "speed" in scene["regime"] else None
    eps = real(wheel["irregularity"]) if "irregularity" in wheel else None
    guess = Real(sizing.balance.value) if sizing.balance else Real(0)
    pace = speed
    if pace is None:
        pace = regimes.constant_speed(machine, Real(sizing.constant_speed or sizing.speed))
    cycle = regimes.constant_cycle(machine, pace, guess)
    true = figures.works(cycle) | {"exchanged": cycle.exchanged, "flywheel": {}}
    if sizing.run is None:  # nothing varies, and nothing stores energy
        return common(sizing, true | {"balance": cycle.unknown})
    given = real(wheel["inertia"]) * ratio**2 if eps is None else None
    if eps is not None:
        true["flywheel"] = {k: v / ratio**2 for k, v in figures.inertias(cycle, pace, eps).items() if k != "exact"}
        if not sizing.flywheel.needed:
            given = Real(0)
    start = Real(sizing.flywheel.exact or 0) * ratio**2 if given is None else given
    held = regimes.Held(given, None if given is not None else eps, speed if machine.balanced else None)
    motion = regimes.found(machine, held, regimes.Guess(Real(sizing.speed), start, guess, pace_of(sizing)))
    if given is None:
        true["flywheel"]["exact"] = motion.state.inertia / ratio**2
    elif eps is not None:
        true["flywheel"]["exact"] = Real(0)
    return [*common(sizing, true | figures_of(motion, cycle, eps is None, sizing)), *level(motion, sizing)]


def pace_of(sizing: Sizing) -> Callable[[Any], Any]:
    """The speed at angles that the package found."""
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None:
        return lambda phi: np.full(phi.shape, sizing.speed)
    return lambda phi: speed_over_cycle(cycle, sizing.speed, run, phi)


def figures_of(motion: regimes.Solved, cycle: Cycle, analysed: bool, sizing: Sizing) -> dict[str, Any]:
    """The figures of a motion."""
    high, low = motion.excess
    speed = motion.w * (1 + (high + low) / 2)
    time = panels.integrals(1 / (motion.w * np.sqrt(1 + motion.state.nodes)), motion.mesh.half).sum()
    result: dict[str, Any] = {"balance": motion.state.unknown}
    if analysed:
        result["simulation"] = {
            "irregularity": (high - low) / (1 + (high + low) / 2),
            "speed_max": motion.w * (1 + high),
            "speed_min": motion.w * (1 + low),
            "speed_time_mean": motion.mesh.edges[-1] / time,
            "period": time,
        }
    angles = motion.places.angles(motion.mesh)
    slack = 4 * max(sizing.error.exact or 0.0, sizing.error.simulation or 0.0, 1e-15) * float(np.ptp(motion.s))
    result["angle_speed_max"] = figures.near(motion.s, motion.s.max(), angles, slack)
    result["angle_speed_min"] = figures.near(motion.s, motion.s.min(), angles, slack)
    return result | {"speed": speed}


def rounding_of_level(sizing: Sizing) -> float:
    """Three roundings of the reference's energies, as they move the speed that a machine without a balance takes.

    Of seed 41000065, which loses 2e-11 of a change of its energy in a cycle, a sum over the cycle gives the speed to 1e-9;
    the reference, which closes energies of 64 bits, is off by 8e-9. Of seed 28000050, which loses 4e-8, it is off by 7e-16:
    the interval proven with 192 bits lies inside that with 112.
    """
    return 0.0 if sizing.cyclic is None or sizing.balance is not None else 3 * float(regimes.EPS) / sizing.cyclic.damping


def level(motion: regimes.Solved, sizing: Sizing) -> list[Row]:
    """The speed that a machine without a balance takes."""
    if sizing.cyclic is None or sizing.balance is not None:
        return []
    high, low = motion.excess
    return [
        Row(
            "speed",
            error(sizing.speed, motion.w * (1 + (high + low) / 2)),
            sizing.cyclic.level_error + rounding_of_level(sizing),
        )
    ]
