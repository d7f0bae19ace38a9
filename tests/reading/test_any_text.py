"""Whatever a scene holds, it is read or refused with faults, and quickly: never a traceback, never a hang."""

import copy
import math
import random
import tomllib

import numpy as np
import pytest

from flywheel.numerics.faults import SceneError
from flywheel.reading.scenes import build_scene, parse_scene
from tests.limits import at_most

WORK = 2000  # pieces of `pace`, for any one scene

SEEDS = (
    """
title = "press"
parameters = {F = "balance", k = 2}
[shafts]
motor.ratio = 5
[mechanism]
type = "slider-crank"
name = "press"
crank = {length = 0.1, mass = 3, com = 0.01}
rod = {length = "0.4 m", mass = 1}
slider.mass = 5
[[load]]
on = "slider"
force = "-F*k*(x > 0.3)"
from = "90 deg"
to = "180 deg"
[[load]]
on = "crank"
table = {angle = [0, 90, 90, 360], value = [1, 2, 3, 4], angle_unit = "deg"}
[[spring]]
on = "slider"
stiffness = "2 kN/m"
[[inertia]]
on = "motor"
value = 0.1
[drive]
on = "motor"
torque = "3 N m"
[gravity]
[regime]
speed = "210 rpm"
[flywheel]
irregularity = "4 %"
""",
    """
[[mechanism]]
name = "cam"
type = "law"
[mechanism.outputs.ram]
x = {angle = [0, 90, 200, 270, 360], value = [0, 1, 4, 2, 0], angle_unit = "deg"}
mass = 3
[mechanism.outputs.arm]
theta = "phi + 0.1*sin(2*phi)"
[[mechanism]]
name = "four"
type = "four-bar"
ground.length = 0.4
crank.length = 0.1
coupler.length = 0.35
rocker = {length = 0.3, inertia = 1}
[[mechanism]]
name = "shaper"
type = "crank-shaper"
phase = "90 deg"
crank.length = 0.1
frame.length = 0.3
rocker.length = 0.6
ram.mass = 3
[[load]]
on = "cam.ram"
force = 3
[[load]]
on = "shaper.ram"
force = -100
while = "v > 0"
every = "180 deg"
[drive]
torque = "balance"
[regime]
speed = 3
cycle = "720 deg"
[flywheel]
inertia = 3
[accuracy]
rtol = 1e-6
""",
    "areas = {values = [1, -2, 1], scale = '3 J'}\nregime.speed = 3\nflywheel.irregularity = 0.1",
)
VALUES = (
    *(None, True, False, 0, -1, 1, 1e300, -1e300, 1e-300, math.nan, math.inf, 10**400, 2 * math.pi, np.ones((2, 2))),
    *("", "balance", "5 kN", "1,5 m", "5 Hz", "phi", "x", "v", "omega", "sin(phi", "9**9**9", "v > 0", "crank", "rod"),
    *("slider", "pchip", "360 deg", "0 deg", "7 rad", "law", "linkage", "../x.csv", "/dev/zero", "a" * 5000, "\0"),
    *([], [1], [[1]], {}, {"a": 1}, [{}], [{"on": "crank"}], (), b"x", object()),
)
KEYS = ("on", "force", "torque", "table", "from", "to", "every", "while", "length", "mass", "type", "name", "shaft")
MORE_KEYS = (
    "rod",
    "crank",
    "x",
    "theta",
    "outputs",
    "angle",
    "value",
    "ratio",
    "file",
    "areas",
    "",
    " ",
    "a.b",
    "é",
    7,
)


def places(tree, path=()):
    """The paths of everything in a tree of tables and lists."""
    yield path
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        yield from places(value, (*path, key))


def at(tree, path):
    for key in path:
        tree = tree[key]
    return tree


def mutate(tree, rng):
    """Change, drop, copy or add one thing."""
    paths = list(places(tree))
    path = rng.choice(paths)
    kind = rng.choice(("change", "drop", "copy", "add", "scale"))
    spot = at(tree, path)
    if kind == "add" and isinstance(spot, dict):
        spot[rng.choice(KEYS + MORE_KEYS)] = copy.deepcopy(rng.choice(VALUES))
    elif path and kind == "change":
        at(tree, path[:-1])[path[-1]] = copy.deepcopy(rng.choice(VALUES))
    elif path and kind == "drop":
        del at(tree, path[:-1])[path[-1]]
    elif path and kind == "copy":
        at(tree, path[:-1])[path[-1]] = copy.deepcopy(at(tree, rng.choice(paths)))
    elif path and kind == "scale" and isinstance(spot, float):
        at(tree, path[:-1])[path[-1]] = spot * rng.choice((0, -1, 10, 0.1, 1e10, 1 + 1e-10, 2, 0.5))


def check(call, argument, context):
    """Read a scene: with no more work than that, and with one-line faults if at all."""
    try:
        with at_most(WORK):
            call(argument)
    except SceneError as error:
        lines = [str(fault) for fault in error.faults]
        assert lines, context
        assert all(line and "\n" not in line and len(line) < 1000 for line in lines), context


@pytest.mark.parametrize("seed", range(len(SEEDS)))
def test_seeds_are_good(seed):
    assert parse_scene(SEEDS[seed]).speed > 0


@pytest.mark.parametrize("seed", range(len(SEEDS)))
def test_mutated_tables(seed):
    rng = random.Random(seed)
    good = tomllib.loads(SEEDS[seed])
    for number in range(200):
        tree = copy.deepcopy(good)
        for _ in range(rng.choice((1, 1, 2, 4))):
            mutate(tree, rng)
        check(build_scene, tree, (seed, number))


@pytest.mark.parametrize("seed", range(len(SEEDS)))
def test_mutated_texts(seed):
    rng = random.Random(seed)
    for number in range(200):
        text = list(SEEDS[seed])
        for _ in range(rng.choice((1, 2, 5))):
            spot = rng.randrange(len(text))
            text[spot : spot + rng.choice((0, 1, 3))] = rng.choice("\"'[]{}=.,0 1e-\n#\\éx")
        check(parse_scene, "".join(text), (seed, number))


SIZE = 2**20 - 60_000
REST = "\n[regime]\nspeed = 1\n[flywheel]\nirregularity = 0.1\n"
LAW = "[mechanism]\ntype = 'law'\noutputs.a = {{mass = 1, x = '{}'}}" + REST


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * SIZE,
        "a = " + "{a = " * (SIZE // 5),
        "a." * (SIZE // 2) + "a = 1",
        "[" + "a." * (SIZE // 2) + "a]",
        "".join("a." * 200 + f"k{i} = 1\n" for i in range(SIZE // 410)),
        '"' + '\\"' * (SIZE // 2),
        "'''" + "''" * (SIZE // 2),
        '"""' * (SIZE // 3),
        "".join(f"k{i}=1\n" for i in range(SIZE // 9)),
        "".join(f"[k{i}]\n" for i in range(SIZE // 9)),
        "[parameters]\n" + "".join(f's{i}="1 kxN"\n' for i in range(1000)),
        "[parameters]\n" + "".join(f's{i}="1 kxN"\n' for i in range(SIZE // 18)),
        "[[load]]\n" * 1000,
        "[[load]]\n" * (SIZE // 9),
        "[[load]]\non = 'crank'\ntorque = '" + "sin(phi)*" * 120 + f"1'{REST}",
        "[[mechanism]]\ntype = 'slider-crank'\ncrank.length = 1\nrod.length = 3\n" * (SIZE // 70) + REST,
        "[mechanism]\ntype = 'law'\n" + "".join(f"outputs.o{i}.x='sin(phi)'\n" for i in range(SIZE // 40)),
        "[areas]\nvalues = [" + "1,-1," * (SIZE // 6) + f"]{REST}",
        "[areas]\nvalues = [" + "'a'," * (SIZE // 5) + f"]{REST}",
        "[regime]\nspeed = '" + "9" * SIZE + " rpm'",
        "[regime]\nspeed = '9 " + "m " * 40 + "'",
        "a = " + "9" * 100_000,
        "title = '" + "a" * SIZE + "'",
        "[mechanism]\ntype = '" + "slider-crank" * 5000 + "'",
        LAW.format("sin(100000*phi)"),
        LAW.format("exp(-((phi - 2)/1e-7)**2)"),
        LAW.format("sin(exp(" * 25 + "phi" + "))" * 25),
        LAW.format("abs(sin(3000*phi))**3"),
        LAW.format("((phi - 3)**64)**64"),
    ],
    ids=lambda text: text[:20].strip(),
)
def test_hostile_texts(text):
    check(parse_scene, text, text[:40])
