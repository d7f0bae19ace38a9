"""Sweeps over designs, in batches."""

from __future__ import annotations

import csv
import math
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from itertools import product
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import flywheel
from flywheel import SceneError
from flywheel.designs import figures as designs
from flywheel.designs import sweep as sweep_of_designs
from flywheel.designs.figures import ALONE, MISSING, REFINED, REFUSED, TRACED
from flywheel.designs.sweep import read_columns, sampled
from flywheel.designs.sweep_results import FigureArrays, csv_lines, front
from tests.extras import extra
from tests.limits import sample
from tests.scenes import press, rotor, yoke

# Sweeps: every design is what `size` makes of it, whoever sizes it; nothing finished is lost, nobody's file is replaced.


EPS, SPEED = "flywheel.irregularity", "regime.speed"


@pytest.fixture(scope="module")
def rotors():
    """A scene and 2,400 designs of it, five of which are refused."""
    scene = flywheel.load(rotor())
    return scene, {EPS: np.linspace(-0.0004, 0.2396, 2401)[:-1], SPEED: np.linspace(10.0, 30.0, 2400)}


@pytest.fixture(scope="module")
def whole(rotors):
    return flywheel.sweep(*rotors)


def same(one, other):
    """Tests whether two sweeps have the same figures within rounding, the same refusals, and errors within rtol."""
    figures = all(
        np.allclose(np.float64(one[name]), np.float64(other[name]), rtol=1e-11, atol=1e-11, equal_nan=True)
        for name in one.names_and_paths
    )
    refused = one.reasons == other.reasons and one.names == other.names and np.array_equal(one.reached, other.reached)
    return figures and refused


def test_designs_whose_loads_are_the_same_break_at_the_same_angles_and_others_at_their_own():
    """Whatever varies, a design that is sized alone among others is, to its last digit, what `size` makes of it."""
    raw = {
        "parameters": {"start": 50.0, "slope": 2.5, "end": 2.0, "height": 30.0},
        "load": [{"on": "crank", "torque": "-height*(phi < end)"}],
        "drive": {"torque": "start - slope*omega"},
        "flywheel": {"irregularity": 0.05},
    }
    scene = flywheel.load(raw)
    columns = {
        "parameters.start": np.array([50.0, 60.0, 50.0, 60.0]),
        "parameters.end": np.array([2.0, 2.0, 2.5, 2.0]),
        "parameters.height": np.array([30.0, 30.0, 30.0, 20.0]),
    }
    result = flywheel.sweep(scene, columns)
    assert result.ways.tolist() == [ALONE] * 4
    for k in range(4):
        there = {name.partition(".")[2]: float(column[k]) for name, column in columns.items()}
        alone = flywheel.size(flywheel.load({**raw, "parameters": {**raw["parameters"], **there}}), accuracy="normal")
        assert result["exact"][k] == alone.flywheel.exact
        assert result["energy_fluctuation"][k] == alone.energy_fluctuation
    assert result.messages == ("4 of 4 designs were sized one by one",)


MOTOR = {"type": "induction", "power": "3 kW", "speed": "1440 rpm", "poles": 4, "frequency": "50 Hz", "breakdown_ratio": 2.8}

LOSSY = {"wheel": {"ratio": 4, "efficiency": 0.95}, "motor": {"on": "wheel", "ratio": 3, "efficiency": 0.97}}


LIMITS = {"irregularity": 0.1, "motor_torque": 1.6, "motor_heat": 0.8, "motor_rms": 0.9, "current_pulsation": 1.2}


def motor_driven(**changes):
    """A press on a motor's belt, with oil in its guides."""
    drive = {"on": "motor", "motor": MOTOR}
    shafts, damper = {"motor": {"on": "crank", "ratio": 12}}, [{"on": "press.slider", "coefficient": 120}]
    return flywheel.load(press(shafts=shafts, damper=damper, drive=drive, regime={}) | changes)


@pytest.mark.parametrize(
    ("changes", "path", "values"),
    sample(
        [
            ({"flywheel": {"irregularity": 0.1}}, EPS, np.linspace(0.02, 0.25, 12)),
            ({"flywheel": {"inertia": 150}}, "flywheel.inertia", np.linspace(60.0, 400.0, 12)),
            ({"drive": {"torque": "balance"}, "regime": {"speed": 12}}, SPEED, np.linspace(6.0, 20.0, 12)),
            ({"drive": {"torque": "700 - 50*omega"}, "flywheel": {"irregularity": 1.2}}, EPS, np.linspace(0.9, 1.4, 12)),
            ({"shafts": LOSSY, "flywheel": {"on": "wheel", "irregularity": 0.1}}, EPS, np.linspace(0.05, 0.25, 12)),
        ],
        2,
    ),
    ids=["motor", "given flywheel", "balance", "no flywheel needed", "meshes with losses"],
)
def test_motions_found_at_once_are_those_that_size_finds(changes, path, values):
    """Torques that depend on speed: every figure of the motion within both estimates, those without a flywheel as well."""
    scene = motor_driven(**changes)
    columns = {path: values, "mechanism.crank.length": np.linspace(0.08, 0.12, 12)[::-1], "load.0.from": np.full(12, 5.2)}
    result = flywheel.sweep(scene, columns)
    assert set(result.ways.tolist()) <= {TRACED, REFINED}
    assert result.check.ratio <= 1.0
    for k in (0, 11):
        sizing = flywheel.size(result.design(k), 1e-12, accuracy="normal")
        assert math.isclose(result.speed[k], sizing.speed, rel_tol=result.error.speed[k] + 1e-12)
        assert math.isclose(result.power[k], sizing.power, rel_tol=result.error.power[k] + 1e-12)
        assert math.isclose(
            result.angle_speed_min[k], sizing.angle_speed_min, abs_tol=result.error.angle_speed_min[k] + 1e-12
        )
        if sizing.flywheel.needed is not None:
            assert result.needed[k] == sizing.flywheel.needed
            assert math.isclose(result.exact[k], sizing.flywheel.exact, rel_tol=result.error.exact[k] + 1e-12)
        else:
            irregularity = sizing.simulation.irregularity
            assert math.isclose(result.irregularity[k], irregularity, rel_tol=result.error.irregularity[k] + 1e-12)


def test_meshes_that_lose_half_run_far_below_the_speed_without_losses():
    """A soft drive: the constant speed lies outside of the bracket that the net work without losses has."""
    meshes = {"wheel": {"ratio": 4, "efficiency": 0.7}, "motor": {"on": "wheel", "ratio": 3, "efficiency": 0.7}}
    scene = motor_driven(shafts=meshes, drive={"on": "motor", "torque": "100 - 0.4*omega"}, flywheel={"irregularity": 0.1})
    designs = flywheel.sweep(scene, {EPS: [0.05, 0.1], "load.0.from": [5.2, 5.0]})
    assert designs.ways.tolist() == [TRACED] * 2
    for k in range(2):
        sizing = flywheel.size(designs.design(k), 1e-12, accuracy="normal")
        assert math.isclose(designs.speed[k], sizing.speed, rel_tol=designs.error.speed[k] + 1e-12)
        assert math.isclose(designs.exact[k], sizing.flywheel.exact, rel_tol=designs.error.exact[k] + 1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("shafts", [{"motor": {"on": "crank", "ratio": 12}}, LOSSY], ids=["no losses", "meshes with losses"])
def test_flywheels_for_limits_found_at_once_are_those_that_size_finds(shafts):
    """Whichever limit decides; one that no flywheel reaches is refused with its best."""
    columns = {
        "flywheel.limits.motor_heat": np.array([0.6, 1.0, 0.95, 1.0]),
        "flywheel.limits.motor_torque": np.array([1.6, 1.3, 1.8, 1.8]),
        "flywheel.limits.irregularity": np.array([0.2, 0.2, 0.2, 0.05]),
        "mechanism.crank.length": np.array([0.12, 0.09, 0.1, 0.08]),
    }
    result = flywheel.sweep(motor_driven(shafts=shafts, flywheel={"limits": LIMITS}), columns)
    assert (result.ways == REFUSED).tolist() == [True, False, False, False]
    assert set(result.ways[1:].tolist()) <= {TRACED, REFINED}
    assert "which no flywheel achieves" in result.reasons[0]
    assert result.check.ratio <= 1.0
    assert sorted(result.check.designs) == [1, 2, 3]
    for k, binding in ((1, "motor_torque"), (3, "irregularity")):
        sizing = flywheel.size(result.design(k), 1e-12, accuracy="normal")
        assert sizing.binding == binding
        assert math.isclose(result.exact[k], sizing.flywheel.exact, rel_tol=result.error.exact[k] + 1e-12)
        assert math.isclose(result.power[k], sizing.power, rel_tol=result.error.power[k] + 1e-12)


def test_designs_whose_motor_stalls_are_refused_with_their_reason_among_those_that_run():
    columns = {
        "load.0.force": -np.array([5e3, 2e4, 1e6, 2e4, 4e4]),
        "flywheel.inertia": np.array([90.0, 90.0, 90.0, 1e-3, 90.0]),
    }
    result = flywheel.sweep(motor_driven(flywheel={"inertia": 100}), columns)
    assert (result.ways == REFUSED).tolist() == [False, False, True, True, False]
    assert set(result.ways[[0, 1, 4]].tolist()) <= {TRACED, REFINED}
    assert "a drive that cannot carry the mean load" in result.reasons[2]
    assert "stalls at crank angle" in result.reasons[3]


def test_every_design_is_the_one_that_size_gives():
    scene = flywheel.load(press())
    columns = {
        "mechanism.crank.length": np.linspace(0.08, 0.12, 5),
        "load[0].from": np.radians([290.0, 295.0, 300.0, 305.0, 310.0]),
        EPS: np.array([0.02, 0.03, 5.0, 0.05, 0.06]),
    }
    result = flywheel.sweep(scene, columns)
    assert result.ways.tolist() == [0, 0, REFUSED, 0, 0]
    assert result.reasons == {2: 'flywheel.irregularity: found 5.0, expected a value above 0 and below 2; write "5 %"'}
    assert list(result.columns) == ["mechanism.crank.length", "load.0.from", EPS]
    for k in (0, 1, 3, 4):
        sizing = flywheel.size(result.design(k), 1e-10, simulate=False)
        assert result.design(k).loads[0].start == columns["load[0].from"][k]
        assert math.isclose(result.exact[k], sizing.flywheel.exact, rel_tol=2e-11)
        assert math.isclose(result.balance[k], sizing.balance.value, rel_tol=2e-11)
        assert 0.0 < result.error.exact[k] <= 1e-10
    assert np.isnan(result.exact[2])
    assert np.isnan(result.error.exact[2])
    assert result.reached.tolist() == [True, True, False, True, True]
    assert result.units["balance"] == "N m"
    assert np.isnan(result.needed[2])  # of a design that is refused nothing is known
    assert result.needed[[0, 1, 3, 4]].tolist() == [1.0, 1.0, 1.0, 1.0]


def test_a_grid_takes_all_combinations_in_their_order():
    lengths, irregularities = [0.4, 0.5, 0.6], [0.02, 0.04]
    result = flywheel.sweep(
        flywheel.load(yoke()), {"mechanism.crank.length": lengths, EPS: irregularities}, grid=True, engine="size"
    )
    assert result.shape == (3, 2)
    assert list(zip(result["mechanism.crank.length"], result[EPS], strict=True)) == list(product(lengths, irregularities))
    assert (result.ways == ALONE).all()
    assert result.messages == ()


@pytest.mark.parametrize(
    ("columns", "options", "message"),
    [
        ({"flywheel.iregularity": [0.01]}, {}, 'the path of one; did you mean "flywheel.irregularity"?'),
        ({"load.3.from": [0.1]}, {}, 'the path of one; did you mean "load.0.from"?'),
        ({"load.0": [0.1]}, {}, "load.0: found a table, expected a number"),
        ({"drive.torque": [1.0]}, {}, 'drive.torque: found "balance", expected a number'),
        ({"flywheel.inertia": [1.0]}, {}, "found irregularity and inertia, expected exactly one of"),
        ({EPS: [0.1, 0.2, 0.3], SPEED: [1.0, 2.0]}, {}, "regime.speed: found 2 numbers, expected 3, as many as the others"),
        ({EPS: []}, {}, "flywheel.irregularity: found no numbers, expected a row of numbers in SI"),
        ({EPS: ["a"]}, {}, "flywheel.irregularity: found no numbers"),
        ({"load[0].to": [1.0], "load.0.to": [1.0]}, {}, "load.0.to: found two columns, expected one"),
        ({}, {}, "columns: found nothing, expected a mapping from paths to numbers"),
        ({EPS: np.ones(5000), SPEED: np.ones(5000)}, {"grid": True}, "columns: found 25000000 designs, expected at most"),
        ({EPS: [0.1]}, {"engine": "nunpy"}, 'engine: found "nunpy", expected one of numpy, numba, size; did you mean'),
        ({EPS: [0.1]}, {"executor": "dask"}, 'executor: found "dask", expected an executor of concurrent.futures'),
        ({EPS: [0.1]}, {"rtol": 2.0}, "rtol: found 2.0, expected a number from 1e-14 to 0.1"),
        ({EPS: [0.1]}, {"chunk": 10}, "chunk: found 10, expected 1000 designs or more"),
    ],
)
def test_what_is_wrong_with_a_sweep_is_one_line(columns, options, message):
    with pytest.raises(SceneError) as raised:
        flywheel.sweep(flywheel.load(rotor()), columns, **options)
    assert message in str(raised.value)
    assert len(raised.value.faults) == 1


def test_a_number_alone_holds_for_all_designs_and_a_default_may_vary():
    scene = flywheel.load(yoke())
    result = flywheel.sweep(
        scene, {EPS: [0.02, 0.04], "mechanism.phase": 0.3, "mechanism.block.mass": [0.0, 2.0]}, engine="size"
    )
    assert result["mechanism.phase"].tolist() == [0.3, 0.3]
    assert result.reduced_inertia_least[1] > result.reduced_inertia_least[0]


# -- selection -----------------------------------------------------------------------------------------------------------


def test_least_design_and_front(whole):
    known = ~np.isnan(whole.exact)
    assert whole.argmin("exact") == np.nanargmin(whole.exact)
    assert whole.argmin(-whole[SPEED], where=whole.exact > 1.0) == np.flatnonzero(whole.exact > 1.0)[-1]
    assert whole.pareto("exact").tolist() == [whole.argmin("exact")]
    ahead = set(whole.pareto("exact", EPS).tolist())
    assert ahead == set(np.flatnonzero(known).tolist())  # whatever takes less irregularity takes more flywheel
    assert whole.pareto("exact", greatest=["speed"]).tolist() == [2399]
    with pytest.raises(SceneError, match='did you mean "exact"'):
        whole.argmin("exakt")
    with pytest.raises(SceneError, match="no design with exact"):
        whole.argmin("exact", where=~known)


@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_the_front_is_that_of_all_comparisons(dimensions):
    points = np.random.default_rng(3).integers(0, 9, (200, dimensions)).astype(float)
    beaten = [
        (((other <= point).all(axis=1)) & (other < point).any(axis=1)).any()
        for point, other in ((p, points) for p in points)
    ]
    result = front(points)
    assert sorted(result.tolist()) == np.flatnonzero(~np.array(beaten)).tolist()
    assert (np.diff(points[result, 0]) >= 0.0).all()


# -- executors -----------------------------------------------------------------------------------------------------------


class Loses(Executor):
    """An executor that does the first of its chunks, fails the second and then is broken."""

    def __init__(self, error):
        self.error, self.count = error, 0

    def submit(self, function, *arguments):
        self.count += 1
        if self.count == 3:
            raise self.error
        future = Future()
        if self.count == 1:
            future.set_result(function(*arguments))
        else:
            future.set_exception(self.error)
        return future


@pytest.mark.slow
def test_threads_size_the_same(rotors, whole):
    with ThreadPoolExecutor(2) as threads:
        assert same(flywheel.sweep(*rotors, executor=threads), whole)


def test_chunks_that_an_executor_loses_are_sized_again(rotors, whole):
    result = flywheel.sweep(*rotors, executor=Loses(BrokenExecutor("it died")))
    assert same(result, whole)
    assert result.messages[0] == "the executor lost 2 of 3 chunks (BrokenExecutor: it died); they were sized again"


class Counts(Executor):
    """An executor that does its chunks at once, and counts their designs."""

    def __init__(self):
        self.counts = []

    def submit(self, function, *arguments):
        self.counts.append(arguments[2].shape[1])
        future = Future()
        future.set_result(function(*arguments))
        return future


@pytest.mark.parametrize(("engine", "counts"), [("size", [10, 10, 6]), ("numpy", [22])])
def test_slow_designs_go_in_chunks_of_about_a_second(rotors, whole, monkeypatch, engine, counts):
    """By a clock on which each takes 0.1 s; where the four that are tried go many at once, the others go together."""
    ticks = iter(range(1000))
    monkeypatch.setattr(sweep_of_designs, "process_time", lambda: 0.1 * next(ticks))
    scene, columns = rotors
    executor = Counts()
    result = flywheel.sweep(
        scene, {path: column[6:32] for path, column in columns.items()}, engine=engine, executor=executor
    )
    assert executor.counts == counts
    assert np.allclose(result.exact, whole.exact[6:32], rtol=1e-9)


def test_figures_and_errors_do_not_depend_on_the_time_that_a_design_takes(monkeypatch):
    """Narrow peaks need the more cells the narrower they are, so that designs share those of the narrowest."""
    slider = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.4, "mass": 5}, "slider": {"mass": 9}}
    peak = {"on": "slider", "force": "-2000*exp(-((phi - 2)/width)**2)"}
    run = {"drive": {"torque": "balance"}, "regime": {"speed": "90 rpm"}, "flywheel": {"irregularity": 0.02}}
    scene = flywheel.load({"mechanism": slider, "parameters": {"width": 0.2}, "load": [peak], **run})
    columns = {"parameters.width": np.random.default_rng(7).uniform(0.05, 0.4, 40)}

    def swept(seconds: float):
        monkeypatch.setattr(sweep_of_designs, "_seconds", lambda plan: seconds)
        monkeypatch.setattr(designs, "_recent", [])
        return flywheel.sweep(scene, columns, rtol=1e-9)

    fast, *slow = map(swept, (1e-3, 0.09, 0.3))
    for other in slow:
        for name in ("exact", "power", "angle_speed_min"):
            np.testing.assert_array_equal(other.values[name], fast.values[name])
            np.testing.assert_array_equal(other.error[name], fast.error[name])


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="children are looked up in /proc")
def test_workers_end_with_the_process_that_began_them():
    """Killed while its workers size, it leaves none of them behind."""
    scene = Path(__file__).parents[2] / "examples" / "regimes" / "compressor.toml"  # its motor's states are followed alone
    call = [
        sys.executable,
        "-m",
        "flywheel",
        "sweep",
        str(scene),
        "--jobs",
        "2",
        "--vary",
        "flywheel.irregularity=0.03:0.05:999",
    ]
    process = subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    until = time.monotonic() + 60.0
    while len(workers := [pid for pid in children.read_text().split() if _works(pid)]) < 2 and time.monotonic() < until:
        time.sleep(0.1)
    process.kill()
    process.wait()
    assert len(workers) == 2
    while any(map(_works, workers)) and time.monotonic() < until:
        time.sleep(0.1)
    assert not any(map(_works, workers))


def _works(pid):
    """Tests whether a process is a worker that has begun."""
    try:
        return b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def test_an_interrupted_sweep_keeps_what_is_finished_and_goes_on(rotors, whole, tmp_path, monkeypatch):
    file = tmp_path / "rotor.npz"
    result = flywheel.sweep(*rotors, executor=Loses(KeyboardInterrupt()), file=file)
    assert result.missing == 1400
    assert result.messages[0] == f"interrupted: 1400 of 2400 designs are missing; the same sweep goes on from {file}"
    assert np.array_equal(result.exact[:1000], whole.exact[:1000], equal_nan=True)
    assert np.isnan(result.exact[1000:]).all()
    assert (result.ways[1000:] == MISSING).all()
    counted = []
    sized = designs.sized
    monkeypatch.setattr(designs, "sized", lambda *given: counted.append(given[2].shape[1]) or sized(*given))
    assert same(flywheel.sweep(*rotors, file=file), whole)
    assert sum(counted) == 1400
    assert same(flywheel.sweep(*rotors, file=file), whole)
    assert sum(counted) == 1400


def test_designs_sized_one_by_one_are_kept_one_by_one(rotors, whole, monkeypatch):
    scene, columns = rotors
    size, calls = designs.size, []

    def third_is_interrupted(*given, **options):
        calls.append(given)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return size(*given, **options)

    monkeypatch.setattr(designs, "size", third_is_interrupted)
    result = flywheel.sweep(scene, {path: column[:9] for path, column in columns.items()}, engine="size")
    assert result.missing == 9 - 5 - 2  # five are refused before any is sized
    assert np.allclose(result.exact[:7], whole.exact[:7], rtol=1e-11, equal_nan=True)
    assert result.messages == ("interrupted: 2 of 9 designs are missing",)


def test_a_chunk_that_fails_leaves_the_others_in_the_file(rotors, whole, tmp_path, monkeypatch):
    sized = designs.sized

    def second_fails(*given):
        if given[2][0, 0] > 0.0:
            raise ZeroDivisionError
        return sized(*given)

    monkeypatch.setattr(designs, "sized", second_fails)
    with pytest.raises(ZeroDivisionError):
        flywheel.sweep(*rotors, file=tmp_path / "a.npz")
    counted = []
    monkeypatch.setattr(designs, "sized", lambda *given: counted.append(given[2].shape[1]) or sized(*given))
    assert same(flywheel.sweep(*rotors, file=tmp_path / "a.npz"), whole)
    assert 1400 <= sum(counted) < 2400
    assert [each.name for each in tmp_path.iterdir()] == ["a.npz"]


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_an_interrupted_table_goes_on_from_what_is_beside_it(rotors, whole, tmp_path, monkeypatch, ending):
    if ending == "parquet":
        extra("pyarrow")
    file = tmp_path / f"rotor.{ending}"
    result = flywheel.sweep(*rotors, executor=Loses(KeyboardInterrupt()), file=file)
    assert result.missing == 1400
    counted = []
    sized = designs.sized
    monkeypatch.setattr(designs, "sized", lambda *given: counted.append(given[2].shape[1]) or sized(*given))
    assert same(flywheel.sweep(*rotors, file=file), whole)
    assert sum(counted) == 1400
    assert [each.name for each in tmp_path.iterdir()] == [file.name]
    if ending == "csv":
        whole.to_csv(tmp_path / "whole.csv")
        assert file.read_text() == (tmp_path / "whole.csv").read_text()


@pytest.mark.parametrize("ending", ["npz", "csv", "parquet"])
def test_a_sweep_that_is_interrupted_before_its_first_design_goes_on(rotors, tmp_path, monkeypatch, ending):
    if ending == "parquet":
        extra("pyarrow")
    scene, columns = rotors
    file, one = tmp_path / f"rotor.{ending}", {EPS: columns[EPS][:40]}

    def interrupted(*given):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(designs, "sized", interrupted)
        assert flywheel.sweep(scene, one, file=file).missing == 40
    result = flywheel.sweep(scene, one, file=file)
    assert result.missing == 0
    assert not [output for output in result.messages if "cannot be written" in output]
    assert [each.name for each in tmp_path.iterdir()] == [file.name]


@pytest.mark.slow
def test_a_sweep_whose_process_is_killed_goes_on_with_nothing_lost_or_sized_twice(rotors, whole, tmp_path, monkeypatch):
    """Killed in the middle, after some chunks, one of whose reasons was cut short."""
    scene, columns = rotors
    file = tmp_path / "rotor.npz"
    code = f"""
import os, signal, numpy as np, flywheel
from flywheel.designs import figures
from tests.scenes import rotor
sized, done = figures.sized, []
def some(*given):
    if len(done) == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    done.append(1)
    return sized(*given)
figures.sized = some
columns = {{"flywheel.irregularity": np.linspace(-0.0004, 0.2396, 2401)[:-1], "regime.speed": np.linspace(10.0, 30.0, 2400)}}
flywheel.sweep(flywheel.load(rotor()), columns, file={str(file)!r})
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == -signal.SIGKILL
    with (tmp_path / "rotor.npz.part" / "reasons.jsonl").open("a", encoding="utf-8") as reasons:
        reasons.write('[2300, "flywhe')
    counted = []
    sized = designs.sized
    monkeypatch.setattr(designs, "sized", lambda *given: counted.append(given[2].shape[1]) or sized(*given))
    assert same(flywheel.sweep(scene, columns, file=file), whole)
    assert sum(counted) == 400
    assert same(flywheel.sweep(scene, columns, file=file), whole)
    assert sum(counted) == 400


# -- what is sized -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["latin", "sobol", "random"])
def test_samples_fill_their_ranges(method):
    """Of a Latin hypercube every part of a range has one; of a Sobol sequence, as many points as a power of two, too."""
    result = sampled({EPS: (0.01, 0.05), SPEED: (-3.0, 5.0)}, 64, method, seed=3)
    again = sampled({EPS: (0.01, 0.05), SPEED: (-3.0, 5.0)}, 64, method, seed=3)
    for path, (low, high) in {EPS: (0.01, 0.05), SPEED: (-3.0, 5.0)}.items():
        assert np.array_equal(result[path], again[path])
        parts = np.floor((result[path] - low) / (high - low) * 64.0 * (1.0 - 1e-12))
        assert parts.min() >= 0.0
        assert parts.max() <= 63.0
        assert (len(set(parts.tolist())) == 64) == (method != "random")
    assert not np.array_equal(result[SPEED], sampled({EPS: (0.01, 0.05), SPEED: (-3.0, 5.0)}, 64, method, seed=4)[SPEED])


def test_designs_of_a_table_are_in_the_units_of_their_columns(rotors, tmp_path):
    scene = rotors[0]
    table = tmp_path / "designs.csv"
    table.write_text(f"{SPEED} [rpm],{EPS},way\n300,1 %,x\n30 rad/s,0.02,y\n600,0.5,z\n", encoding="utf-8")
    result = read_columns(scene, table)
    assert list(result) == [SPEED, EPS]
    assert result[SPEED] == pytest.approx([10 * np.pi, 30.0, 20 * np.pi], rel=1e-15)
    assert result[EPS].tolist() == [0.01, 0.02, 0.5]
    for text, output in {
        f"{SPEED}\n3\n4 kg\n": 'designs.csv, line 3, regime.speed: found "4 kg", expected a speed',
        f"{SPEED}\n3\n4,5\n": "designs.csv, line 3: found 2 cells, expected 1, as many as columns",
        f"{SPEED}\n": "designs.csv, line 1: found no designs, expected a header",
        "": "designs.csv, line 1: found no designs, expected a header",
    }.items():
        table.write_text(text, encoding="utf-8")
        with pytest.raises(SceneError) as raised:
            read_columns(scene, table)
        assert str(raised.value).startswith(output)


def test_a_table_of_a_sweep_gives_its_designs_again(rotors, whole, tmp_path):
    extra("pyarrow")
    whole.to_csv(tmp_path / "a.csv")
    whole.to_parquet(tmp_path / "a.parquet")
    for name in ("a.csv", "a.parquet"):
        result = read_columns(rotors[0], tmp_path / name)
        assert list(result) == [EPS, SPEED]
        assert np.array_equal(result[EPS], whole.columns[EPS])
        assert np.array_equal(result[SPEED], whole.columns[SPEED])


# -- files ---------------------------------------------------------------------------------------------------------------


def test_a_file_of_another_sweep_is_refused(rotors, whole, tmp_path):
    scene, columns = rotors
    file = tmp_path / "a.npz"
    whole.to_npz(file)
    before = file.read_bytes()
    other = flywheel.load(rotor(drive={"torque": "balance", "on": "crank"}, title="Another title"))
    assert same(flywheel.sweep(other, columns, file=file), whole)
    before = file.read_bytes()
    changed = {**columns, EPS: columns[EPS] + 1e-9}
    cases = {
        "a sweep of another rtol 1e-10, expected one of this rtol 1e-08": lambda: flywheel.sweep(
            scene, columns, 1e-8, file=file
        ),
        "a sweep of another scene": lambda: flywheel.sweep(
            flywheel.load(rotor(inertia=[{"on": "crank", "value": 2}])), columns, file=file
        ),
        "a sweep of other numbers": lambda: flywheel.sweep(scene, changed, file=file),
        "a sweep of another set of numbers": lambda: flywheel.sweep(scene, {EPS: columns[EPS]}, file=file),
        "a sweep of another size 2400, expected one of this size 2": lambda: flywheel.sweep(
            scene, {path: column[:2] for path, column in columns.items()}, file=file
        ),
    }
    for output, call in cases.items():
        with pytest.raises(SceneError) as raised:
            call()
        assert output in str(raised.value)
        assert len(raised.value.faults) == 1
    assert file.read_bytes() == before


def test_a_file_of_another_version_is_refused(rotors, whole, tmp_path, monkeypatch):
    whole.to_npz(tmp_path / "a.npz")
    monkeypatch.setattr(designs, "version", lambda name: "99.0")
    with pytest.raises(
        SceneError, match=r"another version of flywheel [\w.]+, expected one of this version of flywheel 99.0"
    ):
        flywheel.sweep(*rotors, file=tmp_path / "a.npz")


def test_files_of_others_are_never_replaced(rotors, whole, tmp_path):
    file = tmp_path / "mine.npz"
    np.savez(file, mine=np.arange(3))
    with pytest.raises(SceneError, match="a file that is no sweep"):
        flywheel.sweep(*rotors, file=file)
    text = tmp_path / "mine.csv"
    text.write_text("a,b\n1,2\n")
    for call in (lambda: whole.to_npz(file), lambda: whole.to_csv(text), lambda: whole.to_npz(text)):
        with pytest.raises(OSError, match="give another name"):
            call()
    assert text.read_text() == "a,b\n1,2\n"
    with np.load(file) as kept:
        assert kept.files == ["mine"]


def test_csv_holds_every_design_to_the_last_digit(whole, tmp_path):
    whole.to_csv(tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2400
    assert rows[0]["exact [kg m^2]"] == ""
    assert rows[0]["way"] == "refused"
    assert rows[0]["reason"].startswith("flywheel.irregularity: found -0.0004")
    assert [float(row["exact [kg m^2]"]) for row in rows[1500:]] == whole.exact[1500:].tolist()
    assert [float(row["error.exact"]) for row in rows[1500:]] == whole.error.exact[1500:].tolist()
    assert {row["needed"] for row in rows} == {"", "1"}  # refused: not known


# -- the check -----------------------------------------------------------------------------------------------------------


def test_figures_that_are_not_those_of_size_are_told(rotors, monkeypatch):
    sized = designs.sized

    def off(*given):
        batch = sized(*given)
        batch.values["exact"][:] *= 1.0 + 1e-9
        return batch

    monkeypatch.setattr(designs, "sized", off)
    result = flywheel.sweep(rotors[0], {EPS: np.linspace(0.01, 0.02, 20)})
    assert result.check.figure == "exact"
    assert set(result.check.failed) == set(result.check.designs)
    assert any(
        "differ from those of size by more than the estimated errors: exact of design" in output
        for output in result.messages
    )


@pytest.mark.slow
def test_a_fluctuation_that_is_rounding_is_compared_with_the_work_exchanged(monkeypatch):
    scene = flywheel.load(
        {
            "mechanism": {"type": "slider-crank", "crank": {"length": 0.17}, "rod": {"length": 1.0}, "slider": {"mass": 54}},
            "load": [{"on": "crank", "torque": "-12.68 N m"}],
            "drive": {"torque": "65.94 - 2.089*omega"},
            "flywheel": {"irregularity": 0.05},
        }
    )
    sized = designs.sized

    def rounded(*given):
        batch = sized(*given)
        batch.values["approximate_total"][:] = 1e-17  # at a constant speed no torque varies
        return batch

    monkeypatch.setattr(designs, "sized", rounded)
    result = flywheel.sweep(scene, {"mechanism.crank.length": np.linspace(0.15, 0.2, 6)})
    assert result.check is not None
    assert not result.check.failed


def test_arrays_of_a_sweep_cannot_be_written(whole):
    with pytest.raises(ValueError, match="read-only"):
        whole.exact[0] = 1.0
    assert isinstance(whole.error, FigureArrays)
    with pytest.raises(AttributeError, match="its figures are exact, approximate"):
        _ = whole.exakt


def test_a_library_that_is_missing_is_one_line(rotors, whole, tmp_path, monkeypatch):
    from flywheel.designs import sweep as module

    monkeypatch.setattr(module, "find_spec", lambda name: None)
    with pytest.raises(
        SceneError, match=r'engine: found no numba, expected numba, which it needs; pip install "flywheel-design'
    ):
        flywheel.sweep(*rotors, engine="numba")
    for name in ("pandas", "xarray", "pyarrow"):
        monkeypatch.setitem(sys.modules, name, None)
    for call in (whole.to_pandas, whole.to_xarray, lambda: whole.to_parquet(tmp_path / "a.parquet")):
        with pytest.raises(SceneError, match=r"found no [a-z]+, expected [a-z]+, which it needs; pip install [a-z]+"):
            call()


# -- dearer --------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_worker_killed_in_mid_sweep_loses_nothing(rotors, whole):
    class Killing(ProcessPoolExecutor):
        def submit(self, *given):
            future = super().submit(*given)
            future.add_done_callback(self.kill)
            return future

        def kill(self, future):
            for pid in list(self._processes or {})[:1]:
                os.kill(pid, signal.SIGKILL)

    with Killing(2, mp_context=get_context("spawn")) as pool:
        result = flywheel.sweep(*rotors, executor=pool)
    assert same(result, whole)
    assert "BrokenProcessPool" in result.messages[0]
    assert same(flywheel.sweep(*rotors, executor=2), whole)


@pytest.mark.slow
def test_a_client_of_dask_loses_no_chunk_with_a_worker(rotors, whole):
    distributed = extra("distributed")
    killed = []
    with (
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster,
        distributed.Client(cluster) as client,
    ):

        def kill():
            end = time.monotonic() + 60.0
            while not killed and time.monotonic() < end:
                busy = [address for address, tasks in client.processing().items() if tasks]
                for worker in cluster.workers.values():
                    if worker.worker_address in busy and not killed:
                        os.kill(worker.pid, signal.SIGKILL)
                        killed.append(worker.pid)

        killer = threading.Thread(target=kill)
        killer.start()
        result = flywheel.sweep(*rotors, executor=client)
        killer.join()
        assert same(flywheel.sweep(*rotors, executor=client.get_executor()), whole)
    assert killed
    assert same(result, whole)


@pytest.mark.slow
def test_tables_of_other_libraries_hold_the_same(whole, tmp_path):
    extra("pyarrow")
    extra("pandas")
    frame = whole.to_pandas()
    assert frame["exact"].equals(extra("pandas").Series(whole.exact, name="exact"))
    whole.to_parquet(tmp_path / "a.parquet")
    whole.to_parquet(tmp_path / "a.parquet")
    read = extra("pyarrow.parquet").read_table(tmp_path / "a.parquet")
    assert read.column_names == list(frame.columns)
    assert np.array_equal(read["error.exact"].to_numpy(), whole.error.exact, equal_nan=True)
    header = next(iter(csv_lines(whole, rows=0))).strip().split(",")
    fields = [(field.name, (field.metadata or {}).get(b"unit", b"").decode()) for field in read.schema]
    assert [f"{name} [{unit}]" if unit else name for name, unit in fields] == header
    assert frame.attrs["units"] == {name: unit for name, unit in fields if unit}
    assert extra("pandas").read_parquet(tmp_path / "a.parquet").attrs == frame.attrs
    extra("pyarrow.parquet").write_table(read.select(["exact"]).replace_schema_metadata({}), tmp_path / "mine.parquet")
    with pytest.raises(OSError, match="is not this sweep's"):
        whole.to_parquet(tmp_path / "mine.parquet")
    extra("xarray")
    scene = flywheel.load(rotor())
    grid = flywheel.sweep(scene, {EPS: [0.01, 0.02, 0.03], SPEED: [10.0, 20.0]}, grid=True).to_xarray()
    assert grid.exact.dims == (EPS, SPEED)
    assert grid[EPS].values.tolist() == [0.01, 0.02, 0.03]
    alone = flywheel.sweep(scene, {EPS: [0.02], SPEED: [20.0]})
    assert math.isclose(grid.exact.sel({EPS: 0.02, SPEED: 20.0}), alone.exact[0], rel_tol=1e-11)
    assert grid.exact.attrs["units"] == "kg m^2"
    assert whole.to_xarray().exact.dims == ("design",)


def test_a_cycle_that_varies_is_sized_one_by_one():
    """A load over pi in a cycle c: power in proportion to 1/c."""
    raw = {
        "load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 30},
        "flywheel": {"irregularity": 0.01},
    }
    result = flywheel.sweep(flywheel.load(raw), {"regime.cycle": [math.tau, 2 * math.tau]})
    assert result.power == pytest.approx([1500.0, 750.0])
