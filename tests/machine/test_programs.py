"""Recorded programs of machines against the walk that they come from, and against thirty digits."""

import os
import pickle
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import flywheel
from bondgraph.recording import source
from flywheel.machine.dynamics import MachineDynamics
from flywheel.machine.loads import FrictionCurve
from flywheel.machine.machine import DRIVE, Anchor, circuit_of
from flywheel.machine.programs import programs_of
from flywheel.numerics.cells import cells

HERE = Path(__file__).parent
SCENES = sorted(
    path
    for folder in (HERE.parent / "references" / "scenes", HERE.parents[1] / "examples")
    for path in folder.rglob("*.toml")
)
PRESS = HERE.parent / "references" / "scenes" / "press.toml"


def machine_of(path):
    return flywheel.Machine(flywheel.load(path))


def pieces(machine, most=3):
    """Anchor and positions of smooth pieces."""
    edges = machine.breakpoints
    chosen = np.unique(np.linspace(0, edges.size - 2, most).round().astype(int))
    return [(float(0.5 * (edges[k] + edges[k + 1])), np.linspace(edges[k], edges[k + 1], 7)[1:-1]) for k in chosen]


def differences(result, expected, scales):
    """Largest differences relative to scales."""
    shape = np.broadcast_shapes(*(np.shape(value) for value in expected))
    rows = zip(result, expected, scales, strict=True)
    sizes = [(np.abs(a - np.asarray(b) + np.zeros(shape)).max(), np.abs(scale).max()) for a, b, scale in rows]
    return np.max([size / scale if size else 0.0 for size, scale in sizes])  # nan where one is


def reduced(machine, anchor):
    """I*, dI*/dphi and M* in the piece of an anchor, by phi, omega, t and the unknown."""
    return programs_of(machine).motion(Anchor(anchor, None, None))


def motion_differences(machine, anchor, phi):
    """Against the walk at speeds about the machine's own, and at times."""
    omega, time = machine.typical_speed * np.linspace(0.97, 1.02, phi.size), np.linspace(0.0, 0.1, phi.size)
    circuit, expected, scales = circuit_of(machine.scene), [], []
    for stage in machine.stages:
        station = stage.reduction.at(phi, anchor.phi)
        reduced = station.reduced
        shares = [reduced.moment, 2.0 * reduced.per_unknown, -reduced.resistance * omega]
        for element, effort, factor in station.contributions(omega, time, anchor.omega, anchor.time):
            shares += [] if circuit and element.name.startswith(DRIVE) else [effort + 2.0 * factor]
        expected += [reduced.inertia, reduced.slope, sum(shares)]
        scales += [reduced.inertia, reduced.steepness, sum(map(np.abs, shares)) + reduced.exchanged]
    return differences(programs_of(machine).motion(anchor).function()(phi, omega, time, 2.0), expected, scales)


def cycle_differences(machine, anchor, phi):
    """Of all that is reduced over a cycle, by the program for any of its pieces, if there is one."""
    over_cycle, expected = programs_of(machine).over_cycle, machine.reduction(phi, anchor)
    scales = expected._replace(moment=expected.exchanged, slope=expected.steepness)
    return 0.0 if over_cycle is None else differences(over_cycle(phi, np.full(phi.shape, anchor)), expected, scales)


LAWS = [path for path in SCENES if 'type = "law"' in path.read_text()]


@pytest.mark.parametrize("path", LAWS, ids=lambda path: path.stem)
def test_a_law_is_over_its_cycle_what_it_is_in_its_pieces(path):
    machine = machine_of(path)
    assert all(cycle_differences(machine, anchor, phi) <= 1e-13 for anchor, phi in pieces(machine))


@pytest.mark.slow
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_scene_gives_what_the_walk_gives(path):
    try:
        machine = machine_of(path)
        chosen = pieces(machine)
    except flywheel.SceneError:
        pytest.skip("not a scene of one machine with rigid shafts")
    limit = 1e-12 if any(mechanism.linkage for mechanism in machine.scene.mechanisms) else 1e-13  # rounding of positions
    for anchor, phi in chosen:
        for speed in (None, machine.typical_speed):
            assert motion_differences(machine, Anchor(anchor, speed, 0.0 if speed else None), phi) <= limit
        assert cycle_differences(machine, anchor, phi) <= limit
    assert not programs_of(machine).why


WRITTEN_OUT = "press press-offset-up four-bar-open shaper yoke-inclined springs"
ORACLE = """
import sys, tomllib, numpy as np
from pathlib import Path
import flywheel
from flywheel.machine.machine import Anchor
from flywheel.machine.programs import programs_of
from tests.oracle.machine import Machine
from tests.oracle.numbers import Real, reals
folder = Path(sys.argv[1])
for name in sys.argv[2:]:
    path = folder / f"{name}.toml"
    oracle = Machine(tomllib.loads(path.read_text(), parse_float=Real), folder)
    machine = flywheel.Machine(flywheel.load(path))
    edges = machine.breakpoints
    for low, high in zip(edges[:-1], edges[1:]):
        anchor, phi = float(0.5 * (low + high)), np.linspace(low, high, 9)[1:-1]
        exact = oracle.sample(reals(phi[None]), reals(np.array([[anchor]])))
        inertia, slope = sum(exact.inertia.values()), sum(exact.slope.values())
        moments = [term.constant for term in exact.terms] or [0.0 * phi]
        found = programs_of(machine).motion(Anchor(anchor, None, None)).function()(phi, 0.0, 0.0, 0.0)
        steepness = machine.reduction(phi, anchor).steepness
        for value, true, scale in (
            (found[0], inertia, inertia), (found[1], slope, steepness), (found[2], sum(moments), np.abs(moments).max())
        ):
            error = np.abs(reals(value + 0.0 * phi) - true).max()
            limit = 1e-13 * max(np.abs(scale + 0.0 * phi).max(), 1e-30)
            assert error <= limit, (name, anchor, float(error), float(limit))
"""


@pytest.mark.slow
def test_thirty_digits_of_machines_written_out_apart():
    command = [sys.executable, "-c", ORACLE, str(PRESS.parent), *WRITTEN_OUT.split()]
    inputs = {**os.environ, "ORACLE_DIGITS": "35"}
    result = subprocess.run(command, cwd=HERE.parents[1], env=inputs, capture_output=True, text=True, check=False)
    assert not result.stderr


def test_a_program_in_thirty_digits_is_the_walk_in_thirty_digits():
    from mpmath import mp

    names = ("sin", "cos", "sqrt", "atan2")
    namespace = SimpleNamespace(**{name: getattr(mp, name) for name in names})
    machine = machine_of(PRESS)
    anchor = pieces(machine)[0][0]
    with mp.workdps(35):
        phi = mp.mpf("0.3")
        walk = machine.reduction(phi, anchor, namespace)
        result = reduced(machine, anchor).function(namespace)(phi, 0.0, 0.0, 0.0)
        assert max(abs(a - b) for a, b in zip(result, walk[:3], strict=True)) < 1e-25
        rounded = reduced(machine, anchor).function("math")(0.3, 0.0, 0.0, 0.0)
        assert max(abs(a - b) / (abs(b) + 1) for a, b in zip(rounded, walk[:3], strict=True)) < 1e-14


def test_a_press_gives_what_its_walk_gives():
    machine = machine_of(PRESS)
    for anchor, phi in pieces(machine):
        assert motion_differences(machine, Anchor(anchor, None, None), phi) <= 1e-13
        program = reduced(machine, anchor)
        by_math = [program.function("math")(float(x), 0.0, 0.0, 0.0) for x in phi]
        assert np.abs(np.array(by_math) - np.array([machine.reduction(float(x), anchor)[:3] for x in phi])).max() < 1e-10
        assert not programs_of(machine).why


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", [PRESS, HERE.parents[1] / "examples" / "linkages" / "offset_slider_crank.toml"], ids=["press", "linkage"]
)
def test_machine_code_gives_the_same(path):
    pytest.importorskip("numba")
    machine = machine_of(path)
    anchor, phi = pieces(machine)[0]
    program = reduced(machine, anchor)
    at = (phi, 0.0 * phi, 0.0 * phi, 0.0 * phi)
    rows = zip(program.function("numba")(*at), program.function()(*at), strict=True)
    assert all(np.abs(a - b).max() <= 1e-14 * np.abs(b).max() for a, b in rows)


def test_cells_of_all_pieces_are_recorded_at_once_when_that_pays():
    for path in (PRESS, PRESS.with_name("table-linear.toml")):  # the other has a load that acts one way alone
        machine = machine_of(path)
        mesh = cells(machine.mesh)
        walks = [programs_of(machine).cells(mesh.phi, mesh.anchor) for _ in range(8)]
        assert programs_of(machine).over_cycle is not None
        for walk in walks[1:]:
            for value, expected in zip(walk, walks[0], strict=True):
                np.testing.assert_allclose(value, expected, rtol=0, atol=1e-14 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["six_bar", "whitworth", "cam_press"])
def test_pieces_of_a_linkage_are_recorded_at_once(name):
    machine = machine_of(HERE.parents[1] / "examples" / "linkages" / f"{name}.toml")
    for anchor, phi in pieces(machine, most=12):
        assert motion_differences(machine, Anchor(anchor, None, None), phi) <= 1e-12


def test_loads_that_do_not_act_cost_nothing():
    machine = machine_of(PRESS)
    sizes = {len(reduced(machine, anchor).operations) for anchor, _ in pieces(machine)}
    assert len(sizes) > 1


BRANCHING = {
    "inertia": [{"on": "crank", "value": 2}],
    "regime": {"speed": 10},
    "flywheel": {"irregularity": "4 %"},
    "drive": {"torque": "balance"},
    "load": [
        {"on": "crank", "torque": "-3 if omega > 9 else 2*sin(phi)"},
        {"on": "crank", "torque": "-0.1*abs(t - 1)*omega"},
    ],
}


def test_branches_by_speed_and_time_are_those_at_the_anchor_or_at_every_instant():
    machine = flywheel.Machine(flywheel.load(BRANCHING))
    phi, speeds = np.linspace(0.1, 0.4, 5), (12.0, 8.0, 13.0)
    programs = [programs_of(machine).motion(Anchor(1.0, speed, 0.5)) for speed in speeds]
    assert programs[0] is programs[2] is not programs[1]  # it holds for all anchors that keep its guards
    for speed in speeds:
        for time in (0.5, 1.5):
            assert motion_differences(machine, Anchor(1.0, speed, time), phi) <= 1e-13
    local = programs_of(machine).motion(Anchor(1.0, None, None)).function("math")
    expected = [-3.0 - 0.1 * 0.25 * 9.5, 2 * np.sin(0.3) - 0.1 * 0.5 * 8.5]
    assert [local(0.3, 9.5, 0.75, 0.0)[2], local(0.3, 8.5, 1.5, 0.0)[2]] == pytest.approx(expected, rel=1e-14)


LOSSY = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.1, "inertia": 0.2},
        "rod": {"length": 0.4},
        "slider": {"mass": 5},
    },
    "shafts": {"motor": {"ratio": 3, "efficiency": 0.9}},
    "inertia": [{"on": "motor", "value": 0.05}],
    "damper": [{"on": "slider", "coefficient": 40}, {"on": "motor", "coefficient": 0.1}],
    "load": [{"on": "slider", "force": "-300*v", "while": "v < 0"}],
    "drive": {
        "on": "motor",
        "motor": {"type": "dc", "voltage": 48, "resistance": 0.3, "constant": 0.4, "inductance": 2e-3},
    },
    "flywheel": {"inertia": 0.1, "on": "motor"},
}


def test_instants_of_a_machine_with_losses_and_a_circuit_are_those_of_the_walk():
    dynamics = MachineDynamics(flywheel.Machine(flywheel.load(LOSSY)), 0.9)
    middle = float(dynamics.machine.anchors(4.0))
    walked = [dynamics.at(phi, middle, 20.0, states=(30.0,)) for phi in (3.9, 4.2)]
    for _ in range(9):
        recorded = [dynamics.at(phi, middle, 20.0, states=(30.0,)) for phi in (3.9, 4.2)]
    for one, other in zip(walked, recorded, strict=True):
        for name in ("acceleration", "moment", "inertia", "loss", "rates"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-13)
    assert motion_differences(dynamics.machine, Anchor(middle, None, None), np.linspace(3.9, 4.2, 5)) <= 1e-13
    assert programs_of(dynamics.machine).motion(Anchor(middle, None, None)) is not None


def test_code_has_no_digits_of_a_scene_and_is_shared_between_designs():
    scene = flywheel.load(PRESS)
    machine, other = flywheel.Machine(scene), machine_of(PRESS.with_name("press-heavy.toml"))
    anchor = float(pieces(machine)[0][0])
    program = reduced(machine, anchor)
    assert pickle.loads(pickle.dumps(program)) == program
    assert set(re.findall(r"[a-z]\w*", source(program, "math"))) <= {
        *("def", "recorded", "return", "sin", "cos", "sqrt", "abs", "atan2"),
        *(f"{kind}{k}" for kind in "xv" for k in range(len(program.operations))),
    }
    longer = reduced(other, anchor)
    assert program.places != longer.places
    assert program.function("math").__code__ is longer.function("math").__code__


def test_what_cannot_be_recorded_is_left_to_the_walk():
    mesh = cells(np.linspace(0.0, 2 * np.pi, 5))
    machine = flywheel.Machine(flywheel.load(PRESS), FrictionCurve(mesh, np.sin(mesh.phi), np.array([1.0])))
    assert reduced(machine, 0.5) is None
    assert programs_of(machine).motion(Anchor(0.5, None, None)) is None
    assert "record" in programs_of(machine).why


def test_a_sign_beside_a_speed_is_that_of_the_anchor_in_every_piece():
    """At rest, where the sign of the speed itself is 0; one recording serves all pieces and both senses."""
    windows = [{"on": "crank", "torque": 5, "from": f"{60 * k} deg", "to": f"{60 * k + 20} deg"} for k in range(5)]
    load = [{"on": "crank", "torque": "-20*(sign(v) + v/10)"}, *windows]
    scene = {"inertia": [{"on": "crank", "value": 1}], "load": load, "regime": {"speed": 10}, "flywheel": {"inertia": 1}}
    programs = programs_of(flywheel.Machine(flywheel.load(scene)))
    for speed, friction in ((3.0, -20.0), (-3.0, 20.0), (3.0, -20.0)):
        for place, window in ((0.1, 5.0), (0.5, 0.0), (1.2, 5.0)):
            *_, moment = programs.motion(Anchor(place, speed, 0.0)).function("math")(place, 0.0, 0.0, 0.0)
            assert moment == window + friction
