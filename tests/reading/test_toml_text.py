"""Text of scenes: its grammar, and any text at all."""

import copy
import math
import random
import tomllib

import numpy as np
import pytest

from flywheel import SceneError
from flywheel.reading import toml_text
from flywheel.reading.scenes import build_scene, parse_scene, read_scene
from tests.fuzzing import mutants
from tests.fuzzing.mutants import corpus
from tests.limits import at_most, sample

# Where keys stand in a text, and what a text that is no TOML was meant to be.


PRESS = """title = "Press"

[mechanism]
type = "slider-crank"
crank.length = "80 mm"
rod.length = "480 mm"
rod.mass = "12 kg"

[[load]]
on = "slider"
force = "-40 kN"
from = "340 deg"
to = "20 deg"

[drive]
torque = "balance"

[regime]
speed = "60 rpm"

[flywheel]
irregularity = 0.04
"""

# -- lines of random texts ---------------------------------------------------------------------------------------------


PLAIN = ("1", "-0.5e3", "true", "nan", "0x1F", "1979-05-27 07:32:00", "07:32:00", '"a # [b]"', "'c = \\'", '"\\" \\\\"')
LONG = ('"""a\n[b]\nc = 1 # "" \\"" """', "'''x\n\n# y = '' \n'''", '"""q"""""', "'''\n'''")


class Writer:
    """A random TOML text, and the line of everything in it by its path, noted as it is written."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.text = ""
        self.lines: dict[tuple, int] = {}
        self.count = 0

    @property
    def line(self) -> int:
        return self.text.count("\n") + 1

    def gap(self) -> str:
        return self.rng.choice(["", "", " ", "\t", "  "])

    def comment(self) -> str:
        return self.rng.choice(["", "", " # a = [1", '\t# "x', " # [[load]] '''", "# = }"])

    def key(self) -> tuple[str, str]:
        """A key that occurs but once, and how it is spelt."""
        self.count += 1
        name = f"{self.rng.choice(['k', 'a-b', 'K_', '7'])}{self.count}"
        if self.rng.random() < 0.6:
            return name, name
        odd = self.rng.choice([f"{name}.x", f"{name} # y", f"[{name}]", f"{name} = é"])
        return odd, f"'{odd}'" if self.rng.random() < 0.5 else '"' + odd.replace("é", "\\u00e9") + '"'

    def note(self, path: tuple) -> None:
        self.lines.setdefault(path, self.line)

    def pair(self, prefix: tuple, depth: int, inline: bool) -> None:
        path, spelt = prefix, []
        for _ in range(self.rng.choice([1, 1, 1, 2, 3])):
            name, text = self.key()
            path = (*path, name)
            spelt.append(text)
            self.note(path)
        self.text += f"{self.gap()}.{self.gap()}".join(spelt) + f"{self.gap()}={self.gap()}"
        self.value(path, depth, inline)

    def value(self, path: tuple, depth: int, inline: bool) -> None:
        kind = self.rng.randrange(6 if depth else 4)
        if kind < 3:
            self.text += self.rng.choice(PLAIN)
        elif kind == 3:
            self.text += self.rng.choice(LONG)
        elif kind == 4:
            self.items(path, depth)
        else:
            self.table(path, depth)

    def items(self, path: tuple, depth: int) -> None:
        self.text += "["
        number = self.rng.randrange(4)
        for k in range(number):
            self.text += self.rng.choice(["", "\n", " ", "\n# [c\n  "])
            self.note((*path, k))
            self.value((*path, k), depth - 1, True)
            self.text += self.rng.choice(["", "\n", " # d ]\n"]) + ("," if k < number - 1 or self.rng.random() < 0.3 else "")
        self.text += self.rng.choice(["", "\n", " # e ]\n"]) + "]"

    def table(self, path: tuple, depth: int) -> None:
        self.text += "{" + self.gap()
        for k in range(number := self.rng.randrange(3)):
            self.pair(path, depth - 1, True)
            self.text += self.gap() + ("," + self.gap() if k < number - 1 else "")
        self.text += self.gap() + "}"

    def heading(self, path: tuple, spelt: str, array: bool) -> None:
        for k in range(1, len(path)):
            self.note(path[:k])
        self.lines[path] = self.line
        gap = self.gap()
        self.text += f"[[{gap}{spelt}{gap}]]" if array else f"[{gap}{spelt}{gap}]"
        self.text += f"{self.comment()}\n"

    def statements(self, prefix: tuple) -> None:
        for _ in range(self.rng.randrange(4)):
            self.text += self.rng.choice(["", "\n", "  ", "# f = [\n"])
            self.pair(prefix, 3, False)
            self.text += f"{self.comment()}\n"

    def written(self) -> str:
        self.statements(())
        for _ in range(self.rng.randrange(5)):
            name, text = self.key()
            if self.rng.random() < 0.5:
                self.heading((name,), text, False)
                self.statements((name,))
                continue
            self.note((name,))
            for k in range(self.rng.randrange(1, 4)):
                self.heading((name, k), text, True)
                self.statements((name, k))
                if self.rng.random() < 0.4:
                    inner, spelt = self.key()
                    self.heading((name, k, inner), f"{text}.{spelt}", False)
                    self.statements((name, k, inner))
        return self.text


@pytest.mark.parametrize("seed", range(60))
def test_the_lines_of_random_texts(seed):
    writer = Writer(seed)
    text = writer.written()
    result = toml_text.index(text, tomllib.loads(text))
    assert result is not None
    assert {result.paths[output]: line for output, line in result.lines.items()} == writer.lines


def test_no_lines_where_the_text_is_not_that_of_the_mapping():
    assert toml_text.index("a = 1", {"b": 1}) is None
    assert toml_text.index("a = [1]", {"a": [1, 2]}) is None


# -- faults of a scene carry their lines -------------------------------------------------------------------------------


def lines_of(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        parse_scene(text)
    return [str(fault).partition(": ")[0] for fault in caught.value.faults]


def test_faults_of_a_scene_carry_their_lines():
    second = '[[load]]\non = "slidr"\nforce = 3\n'
    text = PRESS.replace('"480 mm"', '"480 kg"').replace("[drive]", f"{second}[drive]").replace("0.04", "-1")
    assert lines_of(text) == [
        "mechanism.rod.length (line 6)",
        "load[1].on (the 2nd [[load]], line 16)",
        "flywheel.irregularity (line 25)",
    ]


def test_what_is_missing_is_told_with_the_line_of_its_table():
    assert lines_of(PRESS.replace('on = "slider"\n', "")) == ["load[0].on (the 1st [[load]], line 9)"]


def test_tables_within_tables_are_counted_each_in_its_own():
    text = PRESS.replace("[mechanism]", '[[mechanism]]\ntype = "scotch-yoke"\ncrank.length = 1\n[[mechanism]]')
    text = text.replace('type = "slider-crank"', 'type = "linkage"\ndriver = "O"\n[[mechanism.joints]]\nname = 3')
    assert "mechanism[1].joints[0].name (the 1st [[mechanism.joints]] of the 2nd [[mechanism]], line 10)" in lines_of(text)


def test_a_mapping_has_no_lines():
    with pytest.raises(SceneError, match=r"^regime\.speed: found"):
        build_scene({"regime": {"speed": -1}, "flywheel": {"inertia": 1}})


# -- texts that are no TOML --------------------------------------------------------------------------------------------

MENDED = [
    ('"480 mm"', "480 mm"),
    ('"480 mm"', "480 mm # Pleuel"),
    ('"480 mm"', "“480 mm”"),
    ('"480 mm"', "„480 mm“"),
    ('"480 mm"', "«480 mm»"),
    ('"480 mm"', '"480 mm”'),
    ('"480 mm"', '"480 mm'),
    ('"480 mm"', '480 mm"'),
    ('"480 mm"', '"480" mm'),
    ('"480 mm"', '"480 mm";'),
    ('"480 mm"', '"480 mm",'),
    ('"480 mm"', '= "480 mm"'),
    ('rod.length = "480 mm"', 'rod.length: "480 mm"'),
    ('rod.length = "480 mm"', "rod.length: 480 mm"),
    ('rod.length = "480 mm"', 'rod.length := "480 mm"'),
    ('rod.length = "480 mm"', 'rod.length "480 mm"'),
    ('rod.length = "480 mm"', 'rod length = "480 mm"'),
    ('rod.length = "480 mm"', '“rod.length” = "480 mm"'),
    ("0.04", "0,04"),
    ("0.04", ".04"),
    ("0.04", "1/25"),
    ("0.04", "0.04;"),
    ("[[load]]", "[[load]"),
    ("[[load]]", "[load]]"),
    ("[[load]]", "[[load"),
    ("[[load]]", "load:"),
    ("[regime]", "[regime"),
    ("[regime]", "regime]"),
    ("[regime]", "[[regime]"),
    ("[regime]", "(regime)"),
    ("[regime]", "regime"),
    ('"slider-crank"', "slider-crank"),
    ('"balance"', "balance"),
]


@pytest.mark.parametrize(("good", "bad"), MENDED)
def test_what_the_advice_says_mends_the_text(good, bad):
    (fault,) = syntax_faults(PRESS.replace(good, bad, 1))
    lines = PRESS.replace(good, bad, 1).splitlines()
    assert fault.line == next(k for k, (a, b) in enumerate(zip(lines, PRESS.splitlines(), strict=True), 1) if a != b)
    assert fault.advice.startswith("write ")
    lines[fault.line - 1] = fault.advice.removeprefix("write ")
    assert tomllib.loads("\n".join(lines)) == tomllib.loads(PRESS)


def syntax_faults(text: str):
    with pytest.raises(tomllib.TOMLDecodeError):
        tomllib.loads(text)
    with pytest.raises(SceneError) as caught:
        parse_scene(text)
    return caught.value.faults


@pytest.mark.parametrize(
    ("good", "bad", "place", "hint"),
    [
        ('"480 mm"', "", "line 6, column 14", "write a value after rod.length ="),
        ('"480 mm"', "0,48 m", "line 6, column 14", 'write rod.length = "0.48 m"'),
        ('"480 mm"', "1 200 mm", "line 6, column 14", 'write rod.length = "1200 mm"'),
        ('"480 mm"', '"480 mm" // longitud', "line 6, column 23", "write # before the comment"),
        ('"480 mm"', "4 %", "line 6, column 14", 'write rod.length = "4 %"'),
        ('"Press"', "'Paul's press'", "line 1, column 9", 'write title = "Paul\'s press"'),
        ('"Press"', '"The "big" press"', "line 1, column 9", "write title = 'The \"big\" press'"),
        ('"Press"', '"Press\nof 2014"', "line 1, column 9", "write all of it on one line"),
        ('"Press"', '"""Press', "line 1, column 9", 'write """ where the text ends'),
        ('title = "Press"', "// Press", "line 1, column 1", "write # at the beginning"),
        ('title = "Press"', "```toml", "line 1, column 1", "leave the lines"),
        ('"Press"', "True", "line 1, column 9", "write title = true"),
        ("rod.length = ", "rod.length\u00a0= ", "line 6, column 1", "retype this line"),
        ("rod.length", "Länge", "line 6, column 1", "flywheel reference"),
        ('"-40 kN"', '"-40 kN" while = "v > 0"', "line 11, column 18", "begin a new line with while"),
        ("[regime]\n", "[regime] ", "line 18, column 1", "what follows on the next line"),
        ('speed = "60 rpm"', 'speed = "60 rpm"\nspeed = "70 rpm"', "line 20, column 1", "in line 19 already"),
        ("[flywheel]", "[regime]", "line 21, column 1", "below [regime] in line 18"),
        ("[drive]", "[load]", "line 15, column 1", "write [[load]], as in line 9"),
        ("[drive]", "[mechanism.rod]", "line 15, column 1", "such as in line 6"),
        ("rod.mass", "rod", "line 7, column 1", "in line 6 already"),
        ('"-40 kN"', '"C:\\Users\\t.csv"', "line 11, column 9", "write 'C:\\Users\\t.csv' or \"C:/Users/t.csv\""),
        ('"-40 kN"', '"C:\\data\\"', "line 11, column 9", "write 'C:\\data\\'"),
        ("force", "table = {file: 3}\nforce", "line 11, column 10", "write table = {file = 3}"),
        ("force", "table = {file = 3\nforce", "line 11, column 9", "} at its end"),
        ("force", "table = {angle = [0, 1\n value = [1, 2]}\nforce", "line 11, column 18", "put ]"),
        ("force", "table.angle = [0, 90\nforce", "line 11, column 15", "put ]"),
        ("force", "table.angle = [0 90]\nforce", "line 11, column 18", "put a comma"),
        ("force", "table.angle = [0 deg, 90 deg]\nforce", "line 11, column 16", 'write "0 deg"'),
        ("force", "table.angle = [“a”]\nforce", "line 11, column 16", 'write "a"'),
    ],
)
def test_what_was_meant(good, bad, place, hint):
    (fault,) = syntax_faults(PRESS.replace(good, bad, 1))
    assert (fault.path, fault.place) == ("scene", place)
    assert hint in fault.advice


@pytest.mark.parametrize(
    ("heading", "advice"),
    [
        ("mechanism.joints", "write [[mechanism.joints]] for each; the first is in line 1"),
        ("mechanism.couplings", "write [[mechanism.couplings]] for each; the first is in line 1"),
        ("load", "write [[load]] for each; the first is in line 1"),
        ("mechanism.rod", "put its keys below [mechanism.rod] in line 1"),
    ],
)
def test_a_table_that_is_written_several_times_is_one_fault(heading, advice):
    text = "".join(f"[{heading}]\nname = {name}\nbetween = [1, {{a = 2}}]\n" for name in range(4))
    (fault,) = syntax_faults(text)
    assert (fault.place, fault.defect, fault.advice) == ("line 4, column 1", f"[{heading}] a second time", advice)
    after, behind = syntax_faults(f"{text}[drive]\non = 1\non = 2\n")
    assert (after, behind.defect) == (fault, "on a second time")


def test_a_table_that_goes_on_as_an_array_is_one_fault():
    text = "[mechanism.joints]\nname = 1\n" + "[[mechanism.joints]]\nname = 2\n" * 3
    (fault,) = syntax_faults(text)
    assert (fault.place, fault.defect) == ("line 3, column 1", "[[mechanism.joints]]")
    assert fault.advice == "line 1 has it as one table; write [[mechanism.joints]] there as well"


@pytest.mark.parametrize(
    "written",
    [
        '{\n  length = "480 mm",\n  mass = "12 kg"\n}',
        "{length = 480 mm,\n  mass = 12 kg,  # of steel\n}",
        "{length = 480 mm, mass = 12 kg}  # of steel",
        '{mass = "12 kg", length: 480 mm}',
        "{length = “480 mm”; mass = “12 kg”}",
        '[length = "480 mm", mass = "12 kg"]',
        "[\n  length = 480 mm\n  mass = 12 kg\n]",
        '(length = "480 mm", mass = "12 kg")',
    ],
)
def test_a_table_between_braces_is_written_out(written):
    text = PRESS.replace('rod.length = "480 mm"\nrod.mass = "12 kg"', f"rod = {written}")
    (fault,) = syntax_faults(text)
    assert fault.line == 6
    mended = text.replace(f"rod = {written}", fault.advice.removeprefix("write "))
    assert tomllib.loads(mended) == tomllib.loads(PRESS)


def test_every_line_that_is_no_toml_is_told_at_once():
    text = PRESS.replace('"480 mm"', "480 mm").replace('"60 rpm"', "60 rpm").replace("[drive]", "[drive")
    assert [fault.line for fault in syntax_faults(text)] == [6, 15, 19]


@pytest.mark.parametrize(
    ("good", "bad", "path", "hint"),
    [
        ("0.04", '0.04\nspeed = "60 rpm"', "flywheel.speed", "speed is a key of [regime]"),
        ("0.04", '0.04\ntitle = "x"', "flywheel.title", "above every heading"),
        ("0.04", "0.04\ncrank.length = 1", "flywheel.crank", "crank is a key of [mechanism]"),
        ("0.04", '0.04\ntorque = "balance"', "flywheel.torque", "[drive]"),
        ("[flywheel]\n", "", "regime.irregularity", "irregularity is a key of [flywheel]"),
        ("rod.mass", "mass", "mechanism.mass", "crank.mass, rod.mass, slider.mass"),
        ("rod.mass", "rod_mass", "mechanism.rod_mass", "did you mean rod.mass?"),
        ('title = "Press"', "speed = 6", "speed", "speed is a key of [regime]"),
        ('force = "-40 kN"', 'table.file = "C:\\new\\table.csv"', "load[0].table.file", 'write "table.csv"'),
        ('force = "-40 kN"', "table.file = 'data\\gas.csv'", "load[0].table.file", '"data/gas.csv"'),
    ],
)
def test_keys_that_stand_where_they_do_not_belong(good, bad, path, hint, tmp_path):
    file = tmp_path / "press.toml"
    file.write_text(PRESS.replace(good, bad, 1))
    with pytest.raises(SceneError) as caught:
        read_scene(file)
    assert hint in next(fault.advice for fault in caught.value.faults if fault.path == path)


@pytest.mark.parametrize(
    "change", [lambda t: "\ufeff" + t, lambda t: t.replace("\n", "\r\n"), lambda t: t.replace("\n", "\r")]
)
def test_line_ends_and_marks_of_every_editor(change, tmp_path):
    assert parse_scene(change(PRESS)) == parse_scene(PRESS)
    file = tmp_path / "press.toml"
    file.write_bytes(change(PRESS).encode())
    assert read_scene(file).speed == parse_scene(PRESS).speed


# Whatever a scene holds, it is read or refused with faults, and quickly: never a traceback, never a hang.


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
    kind = rng.choice((mutants.structure, mutants.numbers, mutants.quantities, None))
    if kind is not None:
        kind(rng, tree)
    elif paths := list(mutants.places(tree)):
        mutants.put(tree, rng.choice(paths), copy.deepcopy(rng.choice(VALUES)))


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
