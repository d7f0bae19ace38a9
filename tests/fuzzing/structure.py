"""Mutations of the tree of tables: keys, types, quantities and numbers, and what no scene should hold."""

import copy
import random
from collections.abc import Iterator
from typing import Any

from tests.fuzzing.toml_writer import Raw

Path = tuple[Any, ...]

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


def places(tree: Any, path: Path = ()) -> Iterator[Path]:
    """The paths of everything in a tree of tables and lists, but for the tree itself."""
    if path:
        yield path
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        yield from places(value, (*path, key))


def at(tree: Any, path: Path) -> Any:
    """What stands at a path."""
    for key in path:
        tree = tree[key]
    return tree


def put(tree: Any, path: Path, value: Any) -> None:
    """Put a value at a path."""
    at(tree, path[:-1])[path[-1]] = value


def _chosen(rng: random.Random, tree: Any, kind: type | tuple[type, ...] = object) -> Path | None:
    found = [path for path in places(tree) if isinstance(at(tree, path), kind) and not isinstance(at(tree, path), bool)]
    return rng.choice(found) if found else None


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


def _around(rng: random.Random, tree: dict[str, Any], path: Path, value: Any, way: str) -> None:
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
