"""Designs sized in a CPU second: one by one, many at once with numpy, in machine code, on two cores, by workers.

    python tests/benchmarks/bench_sweep.py [--quick]

Random designs of a slider-crank press: crank, rod, window, irregularity and speed vary; the same press on a motor, with and
without losses in belt and gear, and with limits. All figures with their errors at rtol 1e-10. One by one is `flywheel.load`
and `flywheel.size(..., simulate=False)` of each. Ratios are of CPU time, those of threads and workers of time;
each from the best of interleaved repeats. The first call in machine code is told apart: it compiles, unless the code of an
earlier run is still on disk.

The least ratios asked for, 100 and 600, are to one by one as at commit 847fd80. One by one is faster since, by 1.08 (median
of interleaved runs of both commits) to 1.13 times (their minima): of today's the least ratios are smaller by 1.1.
"""

from __future__ import annotations

import copy
import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import flywheel
from flywheel.designs import figures as designs
from tests.scenes import PUNCH
from tests.scenes import SWEPT_PRESS as PRESS

RANGES = {
    "mechanism.crank.length": (0.1, 0.2),
    "mechanism.rod.length": (0.45, 0.9),
    "load.0.from": (5.0, 5.4),
    "load.0.to": (5.9, 6.25),
    "flywheel.irregularity": (0.01, 0.1),
    "regime.speed": (6.0, 16.0),
}
PATHS, RTOL = tuple(RANGES), 1e-10
MOTOR = {
    "type": "induction",
    "power": "11 kW",
    "speed": "1440 rpm",
    "poles": 4,
    "frequency": "50 Hz",
    "breakdown_ratio": 2.8,
}
DRIVEN = PRESS | {"regime": {}, "drive": {"on": "motor", "motor": MOTOR}, "flywheel": {"irregularity": 0.1}}
MOTOR_DRIVEN = {  # a press on a motor: its shafts, and its limits in place of an irregularity that varies
    "motor, no losses": {"shafts": {"motor": {"on": "crank", "ratio": 12}}},
    "motor, belt and gear": {
        "shafts": {
            "wheel": {"on": "crank", "ratio": 4, "efficiency": 0.97},
            "motor": {"on": "wheel", "ratio": 3, "efficiency": 0.96},
        },
    },
    "motor, limits": {
        "shafts": {"motor": {"on": "crank", "ratio": 12}},
        "drive": {"on": "motor", "motor": MOTOR | {"power": "30 kW"}},
        "flywheel": {"limits": {"irregularity": 0.1, "motor_torque": 1.6, "motor_heat": 1.0}},
    },
}
MODELLED = {  # loads whose geometry varies with the mechanism's: their model, and its numbers that vary
    "punch": (PUNCH, ("diameter", "thickness")),
    "press": ({"type": "press", "energy": 2000, "thickness": 0.005}, ("energy", "thickness")),
    "compressor": (
        {"type": "compressor", "bore": 0.2, "clearance": 0.08, "suction": 1e5, "discharge": 4e5, "exponent": 1.3},
        ("bore", "clearance", "discharge"),
    ),
}
SINCE = 1.1  # times as many designs one by one as at 847fd80
NUMPY, NUMBA = 100.0 / SINCE, 600.0 / SINCE  # times one by one, at least


def columns(count: int, seed: int = 1) -> np.ndarray:
    """Random designs within the ranges, (paths, designs)."""
    low, high = np.array(list(RANGES.values())).T[:, :, None]
    return low + (high - low) * np.random.default_rng(seed).random((len(RANGES), count))


def alone(column: np.ndarray) -> float:
    """One design as people do it today: its tables, its scene, its sizing."""
    tables = copy.deepcopy(PRESS)
    crank, rod, start, end, irregularity, speed = column.tolist()
    tables["mechanism"]["crank"]["length"], tables["mechanism"]["rod"]["length"] = crank, rod
    tables["load"][0]["from"], tables["load"][0]["to"] = start, end
    tables["flywheel"]["irregularity"], tables["regime"]["speed"] = irregularity, speed
    return flywheel.size(flywheel.load(tables), RTOL, simulate=False).flywheel.exact or 0.0


def best(
    calls: dict[str, Callable[[], object]], repeats: int, clock: Callable[[], float] = time.process_time
) -> dict[str, float]:
    """The least time of each call, s; they take turns, so that other load on the machine falls on all."""
    result = dict.fromkeys(calls, np.inf)
    for _ in range(repeats):
        for name, call in calls.items():
            start = clock()
            call()
            result[name] = min(result[name], clock() - start)
    return result


def engines(scene: flywheel.Scene, count: int, repeats: int) -> bool:
    """Designs a CPU second by every engine, beside one by one; whether the ratios are what they should be."""
    few, many = columns(max(count // 400, 20), 2), columns(count)
    names = ["numpy", *(["numba"] if has_numba() else [])]
    for name in names:
        start = time.process_time()
        designs.sized(scene, PATHS, many[:, :64], RTOL, name)
        print(f"{name}: first call {time.process_time() - start:.2f} s")
    calls: dict[str, Callable[[], object]] = {"one by one": lambda: [alone(column) for column in few.T]}
    for name in names:
        calls[name] = lambda name=name: designs.sized(scene, PATHS, many, RTOL, name)
    took = best(calls, repeats)
    rates = {name: (few if name == "one by one" else many).shape[1] / seconds for name, seconds in took.items()}
    print(f"\n{'designs a CPU second':24}{'':>10}{'times one by one':>20}")
    for name, rate in rates.items():
        print(f"{name:24}{rate:10.0f}{rate / rates['one by one']:20.0f}")
    result = {name: designs.sized(scene, PATHS, many, RTOL, name) for name in names}
    expected = np.array([alone(column) for column in many.T[:20]])
    for name in names:
        exact, error = result[name].values["exact"], result[name].errors["exact"]
        ways = np.bincount(result[name].ways, minlength=3)
        apart = np.abs(exact[:20] / expected - 1.0).max()
        print(f"{name}: {ways[0]} at once, {ways[1]} refined, {ways[2]} alone; errors stated up to {error.max():.1e}; "
              f"from one by one {apart:.1e}")  # fmt: skip
    limits = {"numpy": NUMPY, "numba": NUMBA}
    low = [name for name in names if rates[name] < limits[name] * rates["one by one"]]
    for name in low:
        print(f"{name}: fewer than {limits[name]:.0f} times one by one")
    return not low


def motor_driven(count: int, repeats: int) -> None:
    """Designs a CPU second of a press on a motor, whose motion has to be solved for, beside one by one."""
    every = tuple(path for path in PATHS if path != "regime.speed")
    designs_of = columns(count)[: len(every)]
    designs_of[-1] *= 2.0  # irregularities of 2 to 20 %
    print(f"\n{'designs a CPU second':24}{'at once':>10}{'one by one':>12}{'times':>8}{'alone':>8}")
    for name, changes in MOTOR_DRIVEN.items():
        scene = flywheel.load(DRIVEN | changes)
        paths = every[:-1] if scene.limits else every
        many = designs_of[: len(paths), :: 5 if scene.limits else 1]
        few = many[:, :: max(many.shape[1] // (5 if scene.limits else 20), 1)]
        calls: dict[str, Callable[[], object]] = {
            "many": lambda scene=scene, paths=paths, many=many: designs.sized(scene, paths, many, RTOL, "numpy"),
            "few": lambda scene=scene, paths=paths, few=few: designs.sized(scene, paths, few, RTOL, "size"),
        }
        took = best(calls, repeats)
        rate, alone_rate = many.shape[1] / took["many"], few.shape[1] / took["few"]
        left = int((designs.sized(scene, paths, many, RTOL, "numpy").ways == designs.ALONE).sum())
        print(f"{name:24}{rate:10.0f}{alone_rate:12.1f}{rate / alone_rate:8.0f}{left:8}")


def modelled(count: int, repeats: int) -> None:
    """Designs a CPU second with loads whose geometry varies, beside one by one."""
    print(f"\n{'designs a CPU second':24}{'at once':>10}{'one by one':>12}{'times':>8}{'alone':>8}")
    for name, (model, own) in MODELLED.items():
        scene = flywheel.load(PRESS | {"load": [{"on": "slider", "model": model}]})
        paths = (*PATHS[:2], *(f"load.0.model.{each}" for each in own))
        base = np.array([0.15, 0.6, *(model[each] for each in own)])
        many = base[:, None] * (1.0 + 0.1 * np.random.default_rng(1).random((base.size, count)))
        few = many[:, :: max(count // 20, 1)]
        calls: dict[str, Callable[[], object]] = {
            "many": lambda scene=scene, paths=paths, many=many: designs.sized(scene, paths, many, RTOL, "numpy"),
            "few": lambda scene=scene, paths=paths, few=few: designs.sized(scene, paths, few, RTOL, "size"),
        }
        took = best(calls, repeats)
        rate, alone_rate = count / took["many"], few.shape[1] / took["few"]
        left = int((designs.sized(scene, paths, many, RTOL, "numpy").ways == designs.ALONE).sum())
        print(f"{name:24}{rate:10.0f}{alone_rate:12.1f}{rate / alone_rate:8.0f}{left:8}")


def has_numba() -> bool:
    """Tests whether the extra is installed."""
    try:
        import numba  # noqa: F401
    except ImportError:
        return False
    return True


def chunks(scene: flywheel.Scene, count: int, repeats: int) -> None:
    """Throughput over the size of a chunk, and over threads and workers."""
    many = columns(count)
    print(f"\n{'designs in a chunk':24}{'numpy':>10}{'numba':>10}{'':4}designs a second")
    for size in (100, 1_000, 10_000):
        if size > count:
            break
        parts = [many[:, k : k + size] for k in range(0, min(count, 40 * size), size)]
        calls = {
            name: lambda name=name, parts=parts: [designs.sized(scene, PATHS, part, RTOL, name) for part in parts]
            for name in ("numpy", *(["numba"] if has_numba() else []))
        }
        took = best(calls, repeats)
        total = sum(part.shape[1] for part in parts)
        print(f"{size:<24}" + "".join(f"{total / seconds:10.0f}" for seconds in took.values()))
    if has_numba():
        calls = {}
        for threads in (1, 2):
            calls[f"{threads} threads"] = lambda threads=threads: designs.at_once(
                designs.structures_of(scene, PATHS).sorted(many)[0][0], many, RTOL, "numba", threads
            )
        took = best(calls, 2 * repeats, time.perf_counter)
        one, two = took.values()
        print(f"\nnumba: {count / one:.0f} designs/s on one thread, {count / two:.0f} on two: {one / two:.2f} times")
    for workers in (1, 2):
        with ProcessPoolExecutor(workers) as pool:
            list(pool.map(worker, [many[:, :100]] * 2 * workers))
            parts = np.array_split(many, max(2 * workers, count // 5_000), axis=1)
            took = best(
                {"workers": lambda pool=pool, parts=parts: list(pool.map(worker, parts))}, repeats, time.perf_counter
            )
        print(f"numpy: {count / took['workers']:.0f} designs/s by {workers} worker processes")


def worker(part: np.ndarray) -> float:
    """Work of a worker process on a chunk."""
    return float(np.nansum(designs.sized(flywheel.load(PRESS), PATHS, part, RTOL, "numpy").values["exact"]))


def memory(count: int, *, to_file: bool = False) -> bool:
    """The peak memory of a sweep of many designs, in a process of its own; whether it is below 1 GB."""
    code = f"""
import numpy, resource, sys, tempfile
sys.path.insert(0, {os.path.dirname(os.path.abspath(__file__))!r})
import bench_sweep as b
import flywheel
engine = "numba" if b.has_numba() else "numpy"
with tempfile.TemporaryDirectory() as folder:
    file = folder + "/press.npz" if {to_file} else None
    # all combinations of two numbers take no memory, as random ones would
    columns = {{path: numpy.linspace(*b.RANGES[path], n) for path, n in zip(b.PATHS[3:5], (1000, {count} // 1000))}}
    found = flywheel.sweep(flywheel.load(b.PRESS), columns, rtol=b.RTOL, grid=True, engine=engine, file=file)
peak = resource.getrusage(resource.RUSAGE_SELF)
took = peak.ru_utime + peak.ru_stime
print(f"{{found.exact.size}} designs: {{peak.ru_maxrss / 1e6:.2f}} GB at most, {{took:.1f}} CPU seconds with {{engine}}"
      + (", to NPZ" if {to_file} else ""))
sys.exit(peak.ru_maxrss > 1_000_000)
"""
    print(flush=True)
    return subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def main(quick: bool) -> int:
    """All tables; 1 where a ratio or the memory is not what it should be."""
    scene = flywheel.load(PRESS)
    count = 4_000 if quick else 40_000
    good = engines(scene, count, 3 if quick else 9)
    motor_driven(count // 20, 2 if quick else 5)
    chunks(scene, count, 2 if quick else 4)
    modelled(count // 20, 2 if quick else 5)
    good &= memory(100_000 if quick else 1_000_000)
    good &= memory(100_000 if quick else 10_000_000, to_file=True)
    return 0 if good or quick else 1


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv))
