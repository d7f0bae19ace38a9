"""Scenes changed at random: texts, structures, expressions, tables."""

import copy
import datetime
import math
import os
import random
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from flywheel.reference import text, topics

# A tree of tables as TOML again, with raw pieces that no parser could have given.


class Raw(str):
    """A piece of TOML to be written as it is."""

    __slots__ = ()


def written(tree: Mapping[str, Any]) -> str:
    """The text of a tree: plain keys first, then tables, then arrays of tables."""
    plain, tables, arrays = [], [], []
    for key, value in tree.items():
        if isinstance(value, dict):
            tables.append(f"[{_key(key)}]\n{_lines(value)}")
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            arrays += [f"[[{_key(key)}]]\n{_lines(item)}" for item in value]
        else:
            plain.append(f"{_key(key)} = {_value(value)}\n")
    return "".join(plain + tables + arrays)


def _lines(table: Mapping[str, Any]) -> str:
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items())


def _key(key: str) -> str:
    return key if isinstance(key, Raw) or re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _text(text: str) -> str:
    return '"' + "".join(_escaped(character) for character in text) + '"'


def _escaped(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    code = ord(character)
    return f"\\u{code:04x}" if code < 32 or code == 127 else character


def _value(value: Any) -> str:
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    return _float(value) if isinstance(value, float) else str(value)


def _float(value: float) -> str:
    return repr(value) if math.isfinite(value) else "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"


# Mutations of the tree of tables: keys, types, quantities and numbers, and what no scene should hold.


Keys = tuple[Any, ...]

NUMBERS = (
    *(0, -0.0, 1, -1, 2, 3, 0.5, 1e-320, 5e-324, 1e-300, 1e-160, 1e-30, 1e-12, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e12),
    *(1e16, 1e30, 1e49, 1e50, 1e51, 1e160, 1e300, 1.7e308, -1e308, -1e-320, 3.141592653589793, 6.283185307179586),
    *(12.566370614359172, 0.1 + 2**-55, 1 + 2**-52, 1 - 2**-53, 1.99, 1.9999999, 2**31, 2**53 + 1, 2**63 - 1, 10**18),
)
_FRAGMENTS = (
    *("nan", "-nan", "inf", "+inf", "-inf", "0xFF", "0xffffffffffffffffffff", "0o17", "0b1", "1_000", "1e400", "-1e400"),
    *("1e-400", "-0", "+0.0", "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "9999-12-31T23:59:60", "true", "false"),
    *("9" * 400, "9" * 4400, "1" + "0" * 5000, "0." + "0" * 5000 + "1", "1e9999999999", '"' + "a" * 10**5 + '"', '""'),
    *("[]", "{}", "[[]]", "[{}]", "[" * 40 + "]" * 40, "[" * 1000 + "]" * 1000, "{a = " * 300 + "1" + "}" * 300),
    *("[" + "1, " * 10**5 + "]", "[" + "{}, " * 5000 + "]", "'''\n\n'''", '"\\u0000"', '"\\U0001F600"', '"\\n\\r"'),
    *("[1, 'a', true, nan, {}]", '["balance"]', "{type = 'slider-crank'}", "{file = 'x.csv'}", "[nan, inf]"),
    *("[1e308, -1e308]",),
)
_TEXTS = (
    *("balance", "", " ", "0", "x", "phi", "crank", "slider", "slider-crank", "four-bar", "law", "linkage", "rod", "omega"),
    *("open", "crossed", "pchip", "step", "linear", "../x", "a\nb", "a\0b", "\u202eabc", "a" * 5000, "é", "drive", "motor"),
    *("{0.__class__}", "%s%n", "$(touch canary)", "`id`", "__import__('os')", "nan", "inf", "true", "-", "1e400"),
    *("1 m" * 50,),
)
_UNITS = (
    *("m", "mm", "kg", "deg", "rad", "rpm", "N", "kN", "N m", "%", "s", "Hz", "J", "kg m^2", "m/s", "rev", "ohm", "V", "µm"),
    *("m^", "m^^2", "m^99", "m^-0", "m**2", "m²³", "m⁻¹⁻", "m/", "/m", "m//s", "m/s/s/s", "kkg", "mrpm", "µ", "°", "º", "Ω"),
    *("m·m", "m * * m", "(m)", "m^2.5", "m " * 49, "k" * 99, "m^999999999999999999999", "1/min", "min^-1", "\u2126", "N·m·"),
    *("kg^9 kg^9 kg^9", "Gm^9 Gm^9 Gm^9", "nm^9/Gm^9/Gm^9", "deg^9", "％", "ｍ", "м", "metre", "KG", "Nm rad", "J/rad"),
)
_DIGITS = (
    *("٣", "३", "３", "𝟛", "²", "1²", "1_0", "1,5", "1.5.5", "..5", "1e5e5", "0x10", "1e", "--1", "+-1", "− 1", "−1", "½"),
    *("Ⅷ",),
)
_KEYS = (
    *("on", "force", "torque", "table", "from", "to", "every", "while", "length", "mass", "type", "name", "inertia", "com"),
    *("x", "theta", "outputs", "file", "angle", "value", "ratio", "areas", "motor", "model", "wheel", "stroke", "gravity"),
    *("", " ", "a.b", "é", "__class__", "a\nb", "x" * 1000, "constructor", "\u202e", "phase", "offset", "friction", "speed"),
)


def places(tree: Any, path: Keys = ()) -> Iterator[Keys]:
    """The paths of everything in a tree of tables and lists, but for the tree itself."""
    if path:
        yield path
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        yield from places(value, (*path, key))


def at(tree: Any, path: Keys) -> Any:
    """Value at a path."""
    for key in path:
        tree = tree[key]
    return tree


def put(tree: Any, path: Keys, value: Any) -> None:
    """Put a value at a path."""
    at(tree, path[:-1])[path[-1]] = value


def _chosen(rng: random.Random, tree: Any, kind: type | tuple[type, ...] = object) -> Keys | None:
    result = [path for path in places(tree) if isinstance(at(tree, path), kind) and not isinstance(at(tree, path), bool)]
    return rng.choice(result) if result else None


def structure(rng: random.Random, tree: dict[str, Any]) -> None:
    """One thing dropped, copied elsewhere, swapped, renamed, nested, added, or of another type."""
    path, other = _chosen(rng, tree), _chosen(rng, tree)
    if path is None or other is None:
        return
    value = copy.deepcopy(at(tree, path))
    way = rng.choice(("drop", "drop", "copy", "copy", "swap", "rename", "nest", "add", "add", "other", "other", "double"))
    if way == "drop":
        del at(tree, path[:-1])[path[-1]]
    elif way == "copy":
        put(tree, other, value)
    elif way == "swap" and path[: len(other)] != other and other[: len(path)] != path:
        put(tree, path, copy.deepcopy(at(tree, other)))
        put(tree, other, value)
    elif way == "nest":
        put(tree, path, rng.choice(([value], {"a": value}, [value] * 20, {str(path[-1]): value})))
    elif way == "other":
        put(tree, path, rng.choice((Raw(rng.choice(_FRAGMENTS)), rng.choice(_TEXTS))))
    else:
        _around(rng, tree, path, value, way)


def _around(rng: random.Random, tree: dict[str, Any], path: Keys, value: Any, way: str) -> None:
    """A change of the table or list that holds a value."""
    holder = at(tree, path[:-1])
    if isinstance(holder, list):
        holder.extend(copy.deepcopy(value) for _ in range(rng.choice((1, 1, 3, 30))))
    elif way == "rename":
        del holder[path[-1]]
        holder[rng.choice(_KEYS)] = value
    elif way == "double":
        holder[Raw(f"{path[-1]} ")] = value
    else:
        holder[rng.choice(_KEYS)] = rng.choice((value, Raw(rng.choice(_FRAGMENTS)), rng.choice(_TEXTS)))


def nesting(rng: random.Random, tree: dict[str, Any]) -> None:
    """Tables a thousand deep, a hundred thousand items, huge texts."""
    deep: Any = {"type": "law"}
    for _ in range(rng.choice((50, 150, 200))):
        deep = [deep] if rng.random() < 0.3 else {rng.choice(("a", "on", "outputs", "mechanism")): deep}
    huge = (
        *(Raw("[" * 1000 + "]" * 1000), Raw("{a=" * 1000 + "1" + "}" * 1000), Raw("[" + "1," * 10**5 + "]"), "a" * 10**5),
        *({f"k{i}": i for i in range(2000)}, [{"on": "crank", "torque": i} for i in range(1200)], deep),
    )
    path = _chosen(rng, tree)
    if path is None or rng.random() < 0.3:
        tree[rng.choice(("mechanism", "load", "areas", "parameters", "shafts", "x"))] = rng.choice(huge)
    else:
        put(tree, path, rng.choice(huge))


def quantities(rng: random.Random, tree: dict[str, Any]) -> None:
    """A number with a mangled unit, or a mangled number with a unit."""
    path = _chosen(rng, tree, (str, int, float))
    if path is None:
        return
    value = at(tree, path)
    number = str(value).split(" ")[0] if rng.random() < 0.5 else repr(rng.choice(NUMBERS))
    unit = rng.choice(_UNITS)
    ways = (
        *(f"{number} {unit}", f"{number}{unit}", f"{rng.choice(_DIGITS)} {unit}", f"{unit} {number}"),
        *(f"{number} {unit} {unit}",),
    )
    text = rng.choice(
        (*ways, f"{number}" + " " * 200 + unit, str(value).upper(), str(value) * 30, f"\u00a0{number}\u202f{unit}")
    )
    put(tree, path, text)


def numbers(rng: random.Random, tree: dict[str, Any]) -> None:
    """Numbers that are zero, negative, extreme, equal to others, or a hair away from what they were."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        path = _chosen(rng, tree, (int, float, str))
        if path is None:
            return
        value = at(tree, path)
        if isinstance(value, str):
            number, _, unit = value.partition(" ")
            if number.replace(".", "").replace("-", "").isdigit():
                put(tree, path, f"{_other_number(rng, tree, float(number))!r} {unit}")
        else:
            put(tree, path, _other_number(rng, tree, float(value)))


def _other_number(rng: random.Random, tree: dict[str, Any], value: float) -> float:
    other = _chosen(rng, tree, (int, float))
    factors = (
        *(0.0, -1.0, 10.0, 0.1, 1e3, 1e-3, 1e8, 1e-8, 1e20, 1e-20, 1 + 1e-15, 1 - 1e-15, 1 + 1e-9, 1 - 1e-9, 2, 0.5, 1.1),
    )
    same = value if other is None else float(at(tree, other))
    return rng.choice((rng.choice(NUMBERS), value * rng.choice(factors), value * rng.choice(factors), same))


# Mutations of CSV files, and of the names by which a scene asks for them.


_NAMES = (
    *("../indicator.csv", "/etc/passwd", "/dev/zero", "/dev/stdin", "/dev/tty", "/proc/self/environ", "folder", "fifo"),
    *("link.csv", "missing.csv", "", ".", "..", "./", "~/x.csv", "x\0.csv", "a" * 5000, "a/" * 2000 + "b", "\ud7ff.csv"),
    *("http://x/y.csv", "C:\\x.csv", "file:///etc/passwd", "folder/../indicator.csv", "././indicator.csv", "scene.toml"),
    *("*.csv", "fifo.csv", "-", "loop.csv", "outside/hosts", "nul", "con.csv", "\n.csv", " indicator.csv", "$HOME/x.csv"),
    *("|touch canary",),
)
_CELLS = (
    *("", "nan", "inf", "-inf", "1e400", "1e-400", "x", "1,5", "0x10", "١", "−1", "1 2", '"1"', '"', "'", "1e5", "-0"),
    *("9" * 500, "#1", "=cmd()", "1;2", "\0", "1_0", "1e", "+1", ".5", "5.", "1e308", "1e-320", "None", "[1]", " 1 "),
    *("1\u00a0",),
)
_WHOLE = (
    *(b"", b"\n", b"\0", b"\xff\xfe", b"angle,value\n", b"0,1\n", b"0\n1\n2\n", b'"', b'"\n' * 1000, b"#\n#\n", b",\n,\n"),
    *(b"0,1\n0,1\n", b"0,0\n360,0\n", b"1," * 10**5, b"0,1\n" * 10**5, b"0,1\r360,2\r", b"0;1\n360;2\n", b"0\t1\n360\t2\n"),
    *(b"0 1\n360 2\n", b"a,b\n0,1\n180,-1\n360,1\n", b"0,1e308\n180,-1e308\n360,1e308\n", b"0,0\n1e-300,1\n360,0\n"),
    *(b'"a,b",c\n0,1\n360,2\n', b"\n".join(b"%d,%d" % (i, i % 7) for i in range(361))),
    *(b"\n".join(b"%.6f,%d" % (i * 0.01, (i % 2) * 2 - 1) for i in range(36001)),),
    *(b"\n".join(b"%.7f,%d" % (i * 0.001, i % 3) for i in range(360001)), b"0," + b"1" * 10**6 + b"\n360,1\n"),
)


def names(rng: random.Random, tree: dict[str, Any]) -> None:
    """A name of a file, a column or a way of interpolation that cannot be."""
    tables = [path[:-1] for path in places(tree) if path[-1] == "file"]
    if not tables:
        loads = tree.setdefault("load", [])
        if not isinstance(loads, list):
            return
        loads.append({"on": "crank", "table": {"file": "indicator.csv", "angle_unit": "deg"}})
        tables = [("load", len(loads) - 1, "table")]
    table = rng.choice(tables)
    key, values = rng.choice(
        (
            ("file", _NAMES),
            ("file", _NAMES),
            ("column", (0, 1, 2, 3, -1, 10**9, 1.5, True, "", "x", "pressure", [1], {"a": 1})),
            ("interpolation", ("step", "pchip", "linear", "spline", "", 3)),
            ("angle_unit", ("deg", "rad", "rev", "m", "", "N", 1, "deg^2", "%")),
            ("value_unit", ("N", "kN", "bar", "m", "", "GN^9", 3, "kgf")),
        )
    )
    if isinstance(at(tree, table), dict):
        put(tree, (*table, key), rng.choice(values))


def content(rng: random.Random, raw: bytes) -> bytes:
    """A table's content with cells, rows or columns spoilt, or another altogether."""
    if rng.random() < 0.35:
        return rng.choice(_WHOLE)
    rows = [row.split(",") for row in raw.decode("utf-8", "replace").split("\n")]
    for _ in range(rng.choice((1, 1, 2, 5))):
        row = rng.choice(rows)
        way = rng.randrange(6)
        if way == 0:
            row[rng.randrange(len(row))] = rng.choice(_CELLS)
        elif way == 1:
            rows.insert(rng.randrange(len(rows)), list(row))
        elif way == 2 and len(rows) > 1:
            rows.remove(row)
        elif way == 3:
            row.append(rng.choice(_CELLS))
        elif way == 4:
            other = rng.choice(rows)
            row[:], other[:] = list(other), list(row)
        else:
            row.pop()
            row.append(rng.choice(("0", "1e3", "-1e3", "1e9", "1e-9", "360", "720")))
    return "\n".join(",".join(row) for row in rows).encode()


def lay_traps(folder: Path) -> None:
    """Creates traps beside a scene: a folder, a pipe without a writer, links to outside and in circles."""
    (folder / "folder").mkdir()
    os.mkfifo(folder / "fifo")
    os.mkfifo(folder / "fifo.csv")
    (folder / "link.csv").symlink_to("/etc/hostname")
    (folder / "loop.csv").symlink_to("loop.csv")
    (folder / "outside").symlink_to("/etc")


# Mutations of a scene as bytes and as lines, blind to what they mean.


_PIECES = (
    *(b"\0", b"\r", b"\n", b'"', b"'", b"\\", b"[", b"]", b"{", b"}", b"=", b".", b",", b"#", b" ", b"\t", b"9", b"-"),
    *(b"e",),
)
_BAD = (
    *(b"\xff", b"\xc0\x80", b"\xed\xa0\x80", b"\xf8\x88\x80\x80\x80", b"\x80", b"\xe2\x82", b"\xef\xbb\xbf"),
    *(b"\xe2\x80\xa8",),
)
_UNICODE = ("\u202e", "\u200b", "\u00a0", "é", "рhi", "²", "٣", "𝟛", "\U0001f600", "ﬁ", "\u0085", "\u2028")

Mutation = Callable[[random.Random, bytes], bytes]


def _flip(rng: random.Random, content: bytes) -> bytes:
    some = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8))):
        some[rng.randrange(len(some))] ^= 1 << rng.randrange(8)
    return bytes(some)


def _cut(rng: random.Random, content: bytes) -> bytes:
    a, b = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    return content[: a + (b - a) // 4] + content[b:] if rng.random() < 0.5 else content[:a]


def _insert(rng: random.Random, content: bytes) -> bytes:
    pieces = (*_PIECES, *_BAD, *(text.encode() for text in _UNICODE))
    for _ in range(rng.choice((1, 1, 3))):
        spot = rng.randrange(len(content) + 1)
        content = content[:spot] + rng.choice(pieces) * rng.choice((1, 1, 1, 2, 100)) + content[spot:]
    return content


def _encoded(rng: random.Random, content: bytes) -> bytes:
    text = content.decode("utf-8", "replace")
    ways: tuple[Callable[[], bytes], ...] = (
        *(lambda: text.encode("utf-16"), lambda: text.encode("utf-16-be"), lambda: text.encode("utf-32")),
        *(lambda: b"\xef\xbb\xbf" * rng.choice((1, 2)) + content, lambda: content.replace(b"\n", b"\r")),
        *(lambda: content.replace(b"\n", b"\r\n"),),
        *(lambda: content.replace(b"\n", rng.choice((b"\n\r", b"\x0b", b"\x0c", b"\0"))),),
        *(lambda: text.encode("latin-1", "replace"), lambda: content + b"\0" * 1000, lambda: content + b"\x1a"),
    )
    return rng.choice(ways)()


def _doubled(rng: random.Random, content: bytes) -> bytes:
    return rng.choice((content + content, content * 50, content + content[: len(content) // 2], b""))


def _mixed_lines(rng: random.Random, content: bytes) -> bytes:
    """A line dropped, doubled, moved, swapped with another, or its key renamed."""
    lines = content.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    way = rng.randrange(5)
    if way == 0:
        del lines[i]
    elif way == 1:
        lines.insert(j, lines[i])
    elif way == 2:
        lines.insert(j, lines.pop(i))
    elif way == 3:
        lines[i], lines[j] = lines[j], lines[i]
    else:
        lines[i] = rng.choice((b"x", b"a.b.", b"1", b"-", b'"a b"', b"[", b"[[")) + lines[i]
    return b"\n".join(lines)


def _joined(rng: random.Random, content: bytes) -> bytes:
    """Hundreds of copies of one line, or that line made very long."""
    lines = content.split(b"\n")
    i = rng.randrange(len(lines))
    lines[i] = rng.choice((b"\n".join([lines[i]] * 300), lines[i] * 300, lines[i] + b"#" * 10**5))
    return b"\n".join(lines)


BYTES: tuple[Mutation, ...] = (_flip, _flip, _cut, _insert, _insert, _encoded, _doubled, _mixed_lines, _mixed_lines, _joined)
"""Each takes a random generator and a file's content, and gives another content."""


# Expressions of a random grammar, hostile texts, and where in a scene they are put.


_SYMBOLS = ("phi", "phi", "phi", "x", "v", "omega", "t", "pi")
_CONSTANTS = ("0", "1", "2", "3", "0.5", "1e-9", "1e3", "1e9", "1e-300", "1e300", "7", "100", "1e-3", "-1", "0.1")
_CALLS = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "abs", "sign")
_SHAPES = (
    *("{0} + {1}", "{0} - {1}", "{0}*{1}", "{0}/{1}", "({0})**{2}", "-({0})", "({0} < {1})", "({0} >= {1})", "({0} == {1})"),
    *("({0} if {1} > {3} else {3})", "min({0}, {1})", "max({0}, {1}, {3})", "atan2({0}, {1})", "({0})*({1})", "({0})/({1})"),
    *(
        "({0} < {1} < {3})",
        "(not {0})",
        "({0} > {1} and {1} > {3})",
        "({0} > {1} or {1} > {3})",
        "({0})**({1})",
        "{0} - ({1}) + {3}",
    ),
)
_EXPONENTS = ("2", "3", "0.5", "-1", "-2", "8", "64", "-64", "1.5", "1e-9", "0", "63.5", "0.1")

HOSTILE = (
    *("__import__('os').system('touch canary')", "().__class__", "phi.__class__", "phi.real", "(lambda: 1)()"),
    *("[phi for x in y]", "(y := phi)", "f'{phi}'", "import os", "exec('1')", "eval('1')", "open('canary','w')"),
    *("print(phi)", "phi[0]", "{phi}", "globals()", "phi if x", "yield phi", "await phi", "*phi", "**phi", "phi;phi"),
    *("phi = 1", "sin", "sin()", "sin(phi, x)", "sin(*phi)", "sin(x=phi)", "min(phi)", "atan2(phi)", "rhi", "рhi", "ｐｈｉ"),
    *("phі", "sіn(phi)", "phi²", "√phi", "π", "φ", "phi**phi**phi", "9**9**9**9", "phi**64**64", "((phi**64)**64)**64"),
    *("2**-1e308", "1e308*1e308", "1e400", "0/0", "1/0", "-" * 500 + "phi", "not " * 100 + "phi"),
    *("(" * 59 + "phi" + ")" * 59, "(" * 5000 + "phi", "sin(" * 58 + "phi" + ")" * 58, "+".join(["phi"] * 10000)),
    *("+".join(["phi"] * 200), "<".join(["phi"] * 200), "phi<" * 400 + "1", "*".join(["phi"] * 249), "sin(1e6*phi)"),
    *("sin(1e4*phi)", "sin(1e3*phi)", "cos(300*phi)", "sin(1e300*phi)", "abs(sin(1000*phi))", "tan(50*phi)"),
    *("sign(sin(500*phi))", "(sin(2000*phi) > 0)", "max(sin(300*phi), cos(301*phi))", "sqrt(abs(sin(100*phi)))"),
    *("sin(exp(phi*3))", "1/sin(phi)", "1/(phi - 1)", "1/(1 + 1e12*(phi - 1)**2)", "1/(1e-300 + (phi-1)**2)", "tan(phi)"),
    *("tan(phi/4)", "log(phi)", "sqrt(-1)", "sqrt(sin(phi))", "sqrt(phi - 3)", "log(sin(phi))", "asin(2*sin(phi))"),
    *("acos(phi)", "(phi - 3)**0.5", "(phi - 3)**-1", "abs(phi - 3)**-0.5", "exp(exp(exp(phi)))", "exp(1000*phi)"),
    *("exp(-1e9*(phi - 2)**2)", "exp(-1/phi**2)", "sin(1/phi)", "sin(1/(phi - 1))", "phi*sin(1/(phi - 1))"),
    *("abs(abs(abs(sin(7*phi)) - 0.5) - 0.25)", "min(phi, 1e-300)", "atan(1e12*(phi - 2))", "atan2(sin(phi), cos(phi))"),
    *("atan2(0, 0)", "atan2(0*phi, 0*phi)", "sign(phi)*0", "(phi == phi)", "sin(omega*1e9)", "v**3", "1/v", "1/omega"),
    *("exp(v)", "sign(v)", "sin(t*1e9)", "t", "omega**64", "x**64", "1e300*x", "1/x", "sqrt(v)", "log(omega)"),
    *("sign(omega - 10)", "(omega > 10)*100", "1e6*(omega - 1)**3", "-1e12*v", "v if v > 0 else 1e9*v", "0", "0*phi"),
    *("-0.0", "1e-320", "1e308", "-1e308*phi", "1e160*sin(phi)", "1e-160*sin(phi)", "sin(phi)+1e-17", " phi ", "\tphi"),
    *("phi" * 700, "a" * 1999, "phi\n", "phi\0", "", " ", "nan", "inf", "None", "True", "1j", "1_000", "0x10", "'a'"),
    *("...", "1e"),
)


def formula(rng: random.Random, depth: int = 4) -> str:
    """A text of the grammar; one in three hundred characters or so is well-behaved."""
    if depth == 0 or rng.random() < 0.15:
        return rng.choice(_SYMBOLS if rng.random() < 0.6 else _CONSTANTS)
    if rng.random() < 0.35:
        return f"{rng.choice(_CALLS)}({formula(rng, depth - 1)})"
    inner = [formula(rng, depth - 1) for _ in range(3)]
    return rng.choice(_SHAPES).format(inner[0], inner[1], rng.choice(_EXPONENTS), inner[2])


def tame(rng: random.Random) -> str:
    """A formula of phi that is mostly finite: what a designer might write."""
    k, a, b = rng.choice((1, 2, 3, 7, 24)), rng.choice((0.1, 1, 100, 1e4)), rng.uniform(0, 6)
    shapes = (
        *(f"{a}*sin({k}*phi)", f"{a}*cos({k}*phi - {b:.3f})**{k}", f"{a}*max(sin({k}*phi), 0)", f"{a}*(phi > {b:.3f})"),
        *(f"{a}*exp(-(({k}*phi - {b:.3f})/{1 / a})**2)", f"{a}/(1.01 + sin({k}*phi))", f"{a}*abs(sin({k}*phi))**0.5"),
        *(f"-{a}*x", f"-{a}*v", f"-{a}*sign(v)", f"{a}*(v > 0)*x", f"-{a}*v*abs(v)", f"{a} - {b}*omega"),
        *(f"-{a}*tan(phi/{4 * k})",),
    )
    return " + ".join(rng.choice(shapes) for _ in range(rng.choice((1, 1, 2, 4))))


def mangled(rng: random.Random, text: str) -> str:
    """A text with a few characters changed."""
    some = list(text)
    for _ in range(rng.choice((1, 2, 4))):
        spot = rng.randrange(len(some) + 1)
        some[spot : spot + rng.choice((0, 1, 2))] = rng.choice("()*/+-<>=,. 0e^xvphi_[]'\"é²\\")
    return "".join(some)


def any_expression(rng: random.Random) -> str:
    """A hostile text, a random formula, one with faults, or a tame one."""
    ways: tuple[Callable[[], str], ...] = (
        *(lambda: rng.choice(HOSTILE), lambda: formula(rng, rng.choice((1, 2, 3, 4, 6))), lambda: tame(rng)),
        *(lambda: mangled(rng, tame(rng)), lambda: f"{rng.choice(HOSTILE)} + {formula(rng, 2)}"),
        *(lambda: f"1e3*({formula(rng, 3)})",),
    )
    return rng.choice(ways)()


def expressions(rng: random.Random, tree: dict[str, Any]) -> None:
    """An expression put where a scene has a force, torque, position, or into a load that is added."""
    keys = ("force", "torque", "while", "x", "theta")
    result = [path for path in places(tree) if path[-1] in keys and isinstance(at(tree, path), (str, int, float))]
    result = [path for path in result if at(tree, path) != "balance"]
    text = any_expression(rng)
    if result and rng.random() < 0.75:
        put(tree, rng.choice(result), text)
    else:
        loads = tree.setdefault("load", [])
        load = {"on": "crank", "torque": text}
        if rng.random() < 0.3:
            load |= {"from": "30 deg", "to": "200 deg"}
        if isinstance(loads, list):
            loads.append(load)
    if rng.random() < 0.5 and "motor" not in str(tree.get("drive")):
        tree["drive"] = {"torque": "balance"}


# Good scenes to begin with: examples, references, starters, and what the reference texts show.


ROOT = Path(__file__).parents[2]
_FOLDERS = ("examples", "tests/references/scenes", "flywheel/starters")


class Base(NamedTuple):
    """A scene's text with the files beside it that it names."""

    name: str
    text: str
    files: dict[str, bytes]


@cache
def corpus() -> tuple[Base, ...]:
    """Every scene of the project, in an order that does not change."""
    scenes = [scene for folder in _FOLDERS for scene in sorted((ROOT / folder).rglob("*.toml"))]
    return (*map(_from_file, scenes), *_from_texts())


@cache
def with_tables() -> tuple[Base, ...]:
    """Those that read a CSV file."""
    return tuple(base for base in corpus() if base.files)


def _from_file(scene: Path) -> Base:
    content = scene.read_text(encoding="utf-8")
    named = [file for file in sorted(scene.parent.glob("*.csv")) if file.name in content]
    return Base(str(scene.relative_to(ROOT)), content, {file.name: file.read_bytes() for file in named})


def _from_texts() -> list[Base]:
    blocks = [(topic, block) for topic in topics() for block in re.findall(r"```toml\n(.*?)```", text(topic), re.DOTALL)]
    return [Base(f"reference {topic}", block, {}) for topic, block in blocks]


# One mutant for every whole number.


class Mutant(NamedTuple):
    """A scene that somebody spoilt: its bytes, the files beside it, and where it came from."""

    seed: int
    kind: str
    base: str
    content: bytes
    files: dict[str, bytes]


_TREES: dict[str, Callable[[random.Random, dict[str, Any]], None]] = {
    "structure": structure,
    "nesting": nesting,
    "quantities": quantities,
    "numbers": numbers,
    "expressions": expressions,
    "names of files": names,
}
KINDS = (*_TREES, "bytes", "tables", "pairs")
_WEIGHTS = (16, 3, 9, 20, 20, 5, 12, 5, 10)


def mutant(seed: int) -> Mutant:
    """The mutant of a seed: the same one as long as the scenes it is made from are."""
    rng = random.Random(seed)
    kind = rng.choices(KINDS, _WEIGHTS)[0]
    of_files = kind == "tables" or (kind == "names of files" and rng.random() < 0.7)
    base = rng.choice(with_tables() if of_files else corpus())
    steps = [kind] if kind != "pairs" else rng.choices((*_TREES, "bytes"), k=2)
    result = Mutant(seed, kind, base.name, base.text.encode(), dict(base.files))
    for step in sorted(steps, key=lambda step: step == "bytes"):
        result = _mutated(rng, result, step)
    return result


def _mutated(rng: random.Random, found: Mutant, step: str) -> Mutant:
    """One more change."""
    if step == "bytes":
        return found._replace(content=rng.choice(BYTES)(rng, found.content))
    if step == "tables":
        name = rng.choice(sorted(found.files))
        change = content if rng.random() < 0.7 else rng.choice(BYTES)
        return found._replace(files=found.files | {name: change(rng, found.files[name])})
    try:
        tree = tomllib.loads(found.content.decode())
    except (ValueError, RecursionError):  # the first of a pair has left nothing to be changed
        return found
    _TREES[step](rng, tree)
    return found._replace(content=written(tree).encode("utf-8", "surrogatepass"))
