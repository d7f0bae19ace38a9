"""What is written at each element of a drawn graph, and a careful guess at the room that it takes.

Names are shortened only where the picture stays unambiguous: a name that repeats the neighbours' names says nothing new,
a first part that whole groups of names share is left out while the rest stays unique, and long names wrap at their dots.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import NamedTuple

from bondgraph.elements import JUNCTIONS, TWO_PORTS
from bondgraph.graph import BondGraph
from bondgraph.laws import Function

LABEL_SIZE, JUNCTION_SIZE, NAME_SIZE, NUMBER_SIZE = 11.5, 14.0, 8.5, 8.0  # points
LINE_SPACING = 1.25
_WRAP = 12  # characters
_LETTERS = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau phi chi psi omega "
    "Gamma Delta Theta Lambda Xi Pi Sigma Phi Psi Omega"
)
_GREEK = dict(zip(_LETTERS.split(), "αβγδεζηθικλμνξπρστφχψωΓΔΘΛΞΠΣΦΨΩ", strict=True))
_BREAK = re.compile(r"(?<=\.)(?!\d|[^(]*\))|(?=->)|(?=\()")
_TOKEN = re.compile(r"(?<![A-Za-z0-9_])([A-Za-z]+)_?([A-Za-z0-9]*)(?![A-Za-z0-9_])")


class Label(NamedTuple):
    """The words at one element: its symbol (MTF, I, 1...) and the lines of its name, none where it says nothing new."""

    symbol: str
    lines: tuple[str, ...]
    junction: bool


def labels(graph: BondGraph) -> dict[str, Label]:
    """The label of every element, by its name.

    >>> from bondgraph import Builder, I, Se
    >>> b = Builder().one("a").one("b").on("a", Se("M", 1.0)).on("b", I("J", 1.0)).transform("a", "b", 3.0)
    >>> [(label.symbol, label.lines) for label in labels(b.build()).values()]
    [('1', ('a',)), ('1', ('b',)), ('Se', ('M',)), ('I', ('J',)), ('TF', ('3',))]
    """
    short = short_names(graph)
    return {name: _label(graph, name, short) for name in graph.elements}


def short_names(graph: BondGraph) -> dict[str, str]:
    """Each name that is drawn, as it is drawn: without its first part where the rest tells it from all others."""
    names = [*(name for name in graph.elements if not _implied(graph, name)), *graph.displacements]
    rest = {name: name.partition(".")[2] for name in names}
    shared = Counter(name.partition(".")[0] for name in rest)
    taken = Counter([*rest, *rest.values()])
    clear = dict.fromkeys(shared, True)
    for name, short in rest.items():
        clear[name.partition(".")[0]] &= taken[short] == 1 or not short
    return {n: s if s and clear[n.partition(".")[0]] and shared[n.partition(".")[0]] > 1 else n for n, s in rest.items()}


def _label(graph: BondGraph, name: str, short: dict[str, str]) -> Label:
    element = graph.elements[name]
    symbol = graph.symbol(name)
    junction = element.kind in JUNCTIONS
    text = short.get(name, "")
    if element.kind in TWO_PORTS and not text and isinstance(element.law, float | int):
        text = f"{element.law:.4g}"
    if isinstance(element.law, Function) and not text.endswith(")"):
        varies = ", ".join(short.get(of, of) for of in graph.depends_on(name))
        text += f"({varies})" if varies else ""
    return Label(symbol, _wrapped(text), junction)


def _implied(graph: BondGraph, name: str) -> bool:
    """Whether a name only puts together the names of its neighbours, as `Builder` does where it is told none."""
    near = [bond.other(name) for bond in graph.at(name)]
    made = {f"{a}{sign}{b}" for a in near for b in near for sign in ("->", "-")}
    return name in made | {f"{a}.sum" for a in near} | {f"{a}.rate" for a in near}


def _wrapped(text: str) -> tuple[str, ...]:
    pieces = _BREAK.split(text) if len(text) > _WRAP else [text]
    lines = [""]
    for piece in pieces:
        if lines[-1] and len(lines[-1] + piece) > _WRAP:
            lines.append("")
        lines[-1] += piece
    return tuple(line for line in lines if line)


def plain(text: str) -> str:
    """A name with its Greek letters, for measuring.

    >>> plain("T(theta)")
    'T(θ)'
    """
    return _TOKEN.sub(lambda m: _GREEK.get(m[1], m[1]) + m[2] if _is_symbol(m) else m[0], text)


def mathtext(text: str) -> str:
    r"""A name as mathtext: single and Greek letters are symbols, with what follows as a subscript; words stay words.

    >>> print(mathtext("T(theta)"), mathtext("m2"), mathtext("rod.com.x"))
    $T$($\theta$) $m_{2}$ rod.com.$x$
    """
    return _TOKEN.sub(_symbol if "$" not in text else lambda m: m[0], text.replace("$", r"\$"))


def _is_symbol(match: re.Match[str]) -> bool:
    letters, index = match[1], match[2]
    joined = match[0] == letters + index
    return (len(letters) == 1 or letters in _GREEK) and (index == "" or index.isdigit() or not joined)


def _symbol(match: re.Match[str]) -> str:
    if not _is_symbol(match):
        return match[0]
    base = f"\\{match[1]}" if match[1] in _GREEK else match[1]
    return f"${base}_{{{match[2]}}}$" if match[2] else f"${base}$"


def width(text: str, size: float) -> float:
    """How wide a text is at a font size, in points: never less than the truth for the serif font that is drawn with."""
    return size * sum(_em(character) for character in plain(text))


def _em(character: str) -> float:
    if character in "iljftIr.,:;[]()|!'- ":
        return 0.42
    if character in "mMwW@%" or character > "\u2e80":
        return 1.0
    if character in "acesz":
        return 0.51
    return 0.78 if character.isupper() or not character.isascii() else 0.54
