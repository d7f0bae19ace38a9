"""Whatever a scene holds, it is read or refused with faults, and quickly: never a traceback, never a hang."""

import copy
import math
import random
import tomllib

import numpy as np
import pytest

from flywheel.numerics.faults import SceneError
from flywheel.reading.scenes import build_scene, parse_scene
from tests.fuzzing import structure
from tests.fuzzing.corpus import corpus
from tests.limits import at_most, sample

WORK = 500  # pieces of work, for any one scene
CHOSEN = (
    *("examples/machines/press_pinion.toml", "tests/references/scenes/law-dwell.toml", "flywheel/starters/four-bar.toml"),
    *("examples/machines/diagram.toml", "tests/references/scenes/several.toml", "flywheel/starters/crank-shaper.toml"),
)

SEEDS = {base.name: base.text for base in corpus() if base.name in CHOSEN}
VALUES = (
    *(None, True, False, 0, -1, 1, 1e300, -1e300, 1e-300, math.nan, math.inf, 10**400, 2 * math.pi, np.ones((2, 2))),
    *("", "balance", "5 kN", "1,5 m", "5 Hz", "phi", "x", "v", "omega", "sin(phi", "9**9**9", "v > 0", "crank", "rod"),
    *("slider", "pchip", "360 deg", "0 deg", "7 rad", "law", "linkage", "../x.csv", "/dev/zero", "a" * 5000, "\0"),
    *([], [1], [[1]], {}, {"a": 1}, [{}], [{"on": "crank"}], (), b"x", object()),
)


def mutate(tree, rng):
    """Change one thing: what stands where, a number, or a value that only Python can give."""
    kind = rng.choice((structure.structure, structure.numbers, structure.quantities, None))
    if kind is not None:
        kind(rng, tree)
    elif paths := list(structure.places(tree)):
        structure.put(tree, rng.choice(paths), copy.deepcopy(rng.choice(VALUES)))


def check(call, argument, context):
    """Read a scene: with no more work than that, and with one-line faults if at all."""
    try:
        with at_most(WORK):
            call(argument)
    except SceneError as error:
        lines = [str(fault) for fault in error.faults]
        assert lines, context
        assert all(line and "\n" not in line and len(line) < 1000 for line in lines), context


@pytest.mark.parametrize("name", SEEDS)
def test_seeds_are_good(name):
    assert parse_scene(SEEDS[name]).speed > 0


@pytest.mark.parametrize("name", SEEDS)
def test_mutated_tables(name):
    rng = random.Random(name)
    good = tomllib.loads(SEEDS[name])
    for number in range(12):
        tree = copy.deepcopy(good)
        for _ in range(rng.choice((1, 1, 2, 4))):
            mutate(tree, rng)
        check(build_scene, tree, (name, number))


@pytest.mark.parametrize("name", SEEDS)
def test_mutated_texts(name):
    rng = random.Random(name)
    for number in range(20):
        text = list(SEEDS[name])
        for _ in range(rng.choice((1, 2, 5))):
            spot = rng.randrange(len(text))
            text[spot : spot + rng.choice((0, 1, 3))] = rng.choice("\"'[]{}=.,0 1e-\n#\\éx")
        check(parse_scene, "".join(text), (name, number))


SIZE = 2**16
REST = "\n[regime]\nspeed = 1\n[flywheel]\nirregularity = 0.1\n"
LAW = "[mechanism]\ntype = 'law'\noutputs.a = {{mass = 1, x = '{}'}}" + REST


@pytest.mark.parametrize(
    "text",
    sample(
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
            "[parameters]\n" + "".join(f's{i}="1 kxN"\n' for i in range(300)),
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
            LAW.format("sin(exp(" * 9 + "phi" + "))" * 9),
            LAW.format("abs(sin(3000*phi))**3"),
            LAW.format("((phi - 3)**64)**64"),
        ],
        2,
    ),
    ids=lambda text: text[:20].strip(),
)
def test_hostile_texts(text):
    check(parse_scene, text, text[:40])
