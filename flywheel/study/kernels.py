"""The cycles of many designs in machine code: what `batch.sums` finds, sixteen designs side by side in lanes.

Every loop runs over `LANES` designs innermost, so that a compiler makes one instruction of several designs. The program of a
smooth piece is split: what depends on the design alone is worked out once, by numpy; the rest becomes straight-line loops,
cut only where a function is called. Roots of all lanes are polished together. A design with a row that its nodes leave in
doubt is left to `batch.sums`, which has the finer search.
"""

from __future__ import annotations

import hashlib
import math
import os
import sys
import threading
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numba
import numpy as np

from bondgraph.recording import Program
from flywheel.numerics import cells
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, Array
from flywheel.study import batch
from flywheel.study.batch import FAST, INERTIA, POINTS, SLOW, Givens, Pieces, Sums

LANES = 16
_L = LANES
_P = POINTS.size
_MOST_ROOTS = 48  # of a design's five functions; what has more is left to numpy
_FIT: Array = np.ascontiguousarray(cells.fit(np.eye(ORDER)).T)
_MEAN = np.ascontiguousarray(cells.MEAN)
_WEIGHTS = np.ascontiguousarray(_FIT.T @ _MEAN)
_HALF_ORDER = ORDER // 2
_TINY = 1e-300
Function = TypeVar("Function", bound=Callable[..., Any])
_options: dict[str, Any] = {"nogil": True, "error_model": "numpy"}


def _compiled(function: Function) -> Function:
    """Machine code that is kept on disk, runs without the interpreter's lock, and divides by zero as numpy does."""
    found: Function = numba.njit(cache=True, **_options)(function)
    return found


# -- sine and cosine in lanes ----------------------------------------------------------------------------------------------

_FAR = 1e5  # of an angle: within it the remainder of quarter turns is exact
_MAGIC = 6755399441055744.0  # 1.5 * 2^52: added and taken away it rounds to the nearest whole number
_QUARTER, _QUARTER_REST = 1.57079632673412561417e00, 6.07710050650619224932e-11  # pi/2 in 33 bits, and what is left
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@_compiled
def sine_cosine(rows: Any, a: int, s: int, c: int) -> None:
    """Sine and cosine of a row of lanes into two others, within an ulp.

    Source: W. J. Cody, W. Waite, Software Manual for the Elementary Functions (1980); polynomials of fdlibm (Sun, 1993).
    """
    far = False
    for i in range(_L):
        x = rows[a, i]
        far |= not abs(x) < _FAR
        k = (x * (2.0 / math.pi) + _MAGIC) - _MAGIC
        r = (x - k * _QUARTER) - k * _QUARTER_REST
        z = r * r
        sine = r + r * z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))))
        half = 0.5 * z
        w = 1.0 - half
        cosine = w + (((1.0 - w) - half) + z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6))))))
        turn = 0.25 * k
        turn = turn - ((turn + _MAGIC) - _MAGIC)  # of a turn: 0, ±1/4, ±1/2
        odd = abs(turn) == 0.25
        first = cosine if odd else sine
        second = sine if odd else cosine
        rows[s, i] = -first if (turn < -0.1) or (turn > 0.4) else first
        rows[c, i] = -second if (turn > 0.1) or (turn < -0.4) else second
    if far:
        for i in range(_L):
            x = rows[a, i]
            rows[s, i] = math.sin(x)
            rows[c, i] = math.cos(x)


# -- programs in lanes -----------------------------------------------------------------------------------------------------

_INLINE = {
    "add": "{0} + {1}",
    "subtract": "{0} - {1}",
    "multiply": "{0} * {1}",
    "divide": "{0} / {1}",
    "negative": "-{0}",
    "sqrt": "math.sqrt({0})",
    "abs": "abs({0})",
    "where": "({1} if {0} else {2})",
    "minimum": "({1} if {1} < {0} else {0})",
    "maximum": "({1} if {1} > {0} else {0})",
    "less": "{0} < {1}",
    "less_equal": "{0} <= {1}",
    "greater": "{0} > {1}",
    "greater_equal": "{0} >= {1}",
    "equal": "{0} == {1}",
    "not_equal": "{0} != {1}",
    "sign": "({0} > 0.0) - ({0} < 0.0) + 0.0",
    "logical_and": "({0} != 0) & ({1} != 0)",
    "logical_or": "({0} != 0) | ({1} != 0)",
    "logical_not": "{0} == 0",
}
"""Operations that a compiler makes one instruction of for several lanes; others are calls, lane by lane."""


class Lanes(NamedTuple):
    """A program as loops over lanes.

    `before` gives what depends on the design alone, from all inputs; `text` is the source of `fill`, which has the rest; it
    needs `rows` (rows, LANES), the first of them `before`'s outputs.
    """

    before: Program
    text: str
    rows: int


@lru_cache(maxsize=64)
def lanes(program: Program) -> Lanes:
    """Split a program by whether it needs the angle, its first input, and write that part as loops over lanes."""
    names, places, operations, outputs = program
    base = len(names) + len(places)
    needs = [True] + [False] * (base - 1)
    for _, *operands in operations:
        needs.append(any(needs[n] for n in operands))
    used = {n for k, (_, *operands) in enumerate(operations) if needs[base + k] for n in operands} | set(outputs)
    given = sorted(n for n in used if not needs[n] and not len(names) <= n < base)
    before = Program(names, places, *_part(operations, base, [not need for need in needs], given))

    # stages: a call is made once all lanes of its operand are there
    stage, calls = [0] * base, dict[int, list[int]]()
    for k, (name, *operands) in enumerate(operations):
        n, first = base + k, max((stage[m] for m in operands), default=0)
        called = needs[n] and name not in _INLINE
        stage.append(first + called)
        if called:
            calls.setdefault(first, []).append(n)
    place = {n: k for k, n in enumerate(given)}
    place[0] = len(place)
    for n in range(base, base + len(operations)):  # what another stage, a call or the result needs has a row of its own
        if needs[n] and (n in outputs or _is_call(operations, base, n) or _crosses(operations, base, n, stage, needs)):
            place[n] = len(place)
    lines = list[str]()
    for level in range(max(stage) + 1):
        own = [n for n in range(base, len(needs)) if needs[n] and stage[n] == level and not _is_call(operations, base, n)]
        lines += _loop(own, operations, base, len(names), place)
        lines += _calls(calls.get(level, []), operations, base, len(names), place)
    for row, n in enumerate(outputs):
        target, value = f"values[group, {_ROW_OF[row]}, node + 1, cell, i]", _value(n, len(names), base, place)
        lines += ["for i in range(_L):", f"    {target} = {value}"]
    body = "\n                ".join(lines)
    constants = [f"x{len(names) + k} = places[{k}]" for k in range(len(places))]
    text = _FILL.format(constants="\n    ".join(constants or ["pass"]), given=len(given), angle=place[0], body=body)
    return Lanes(before, text, len(place) + 1)  # and one for what is not needed


_ROW_OF = (2, 1, 0, 5, 3, 4)  # of the program's outputs I*, dI*/dphi, M*, dM*/du and the two sizes, among the values
_FILL = """def fill(first, last, middle, half, given, places, table, flat, values):
    {constants}
    for group in range(values.shape[0]):
        for k in range({given}):
            for i in range(_L):
                table[k, i] = given[group, k, i]
        for cell in range(first, last):
            for node in range(_NODES.size):
                for i in range(_L):
                    table[{angle}, i] = middle[group, cell, i] + half[group, cell, i] * _NODES[node]
                {body}
"""


def _part(operations: Any, base: int, chosen: list[bool], outputs: list[int]) -> tuple[tuple[Any, ...], tuple[int, ...]]:
    """The chosen operations with their operands' new numbers, and the outputs'."""
    new, kept = {n: n for n in range(base)}, list[tuple[Any, ...]]()
    for k, (name, *operands) in enumerate(operations):
        if chosen[base + k]:
            new[base + k] = base + len(kept)
            kept.append((name, *[new[n] for n in operands]))
    return tuple(kept), tuple(new[n] for n in outputs)


def _is_call(operations: Any, base: int, n: int) -> bool:
    return n >= base and operations[n - base][0] not in _INLINE


def _crosses(operations: Any, base: int, n: int, stage: list[int], needs: list[bool]) -> bool:
    """Whether a later stage or a call needs what is worked out in one."""
    users = [base + k for k, (_, *operands) in enumerate(operations) if n in operands]
    return any(needs[m] and (stage[m] != stage[n] or _is_call(operations, base, m)) for m in users)


def _value(n: int, inputs: int, base: int, place: dict[int, int]) -> str:
    """What stands for a node in code, inside a loop over lanes i."""
    return f"flat[{place[n] * _L} + i]" if n in place else f"x{n}" if inputs <= n < base else f"v{n}"


def _loop(own: list[int], operations: Any, base: int, inputs: int, place: dict[int, int]) -> list[str]:
    """The operations of one stage in one loop over the lanes."""
    lines = list[str]()
    inside = set(own)
    for n in own:
        name, *operands = operations[n - base]
        given = [f"v{m}" if m in inside else _value(m, inputs, base, place) for m in operands]
        lines.append(f"    v{n} = {_INLINE[name].format(*given)}")
        if n in place:
            lines.append(f"    {_value(n, inputs, base, place)} = v{n}")
    return ["for i in range(_L):", *lines] if lines else []


def _calls(wanted: list[int], operations: Any, base: int, inputs: int, place: dict[int, int]) -> list[str]:
    """Calls of one stage: sine and cosine of one operand together, in lanes; others lane by lane."""
    lines, angles = list[str](), dict[int, dict[str, int]]()
    for n in wanted:
        name, *operands = operations[n - base]
        if name in ("sin", "cos") and operands[0] in place:
            angles.setdefault(operands[0], {})[name] = place[n]
            continue
        given = [_value(m, inputs, base, place) for m in operands]
        call = f"math.{'pow' if name == 'power' else name}({', '.join(given)})"
        lines += ["for i in range(_L):", f"    {_value(n, inputs, base, place)} = {call}"]
    for operand, found in angles.items():
        rows = [found.setdefault(name, len(place)) for name in ("sin", "cos")]
        lines.append(f"sine_cosine(table, {place[operand]}, {rows[0]}, {rows[1]})")
    return lines


def _kept(text: str) -> Any:
    """Source compiled to machine code, which is kept on disk for the next time: by its text, and this module's."""
    digest = hashlib.sha256(f"{_OWN}{text}".encode()).hexdigest()[:32]
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or _cache_folder()) / "flywheel"
    space = {"__name__": __name__, "math": math, "_L": _L, "_NODES": NODES, "sine_cosine": sine_cosine}
    path = folder / f"cells_{digest}.py"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            part = path.with_suffix(f".{os.getpid()}_{threading.get_ident()}")
            part.write_text(text)
            part.replace(path)
        exec(compile(text, str(path), "exec"), space)
        return numba.njit(cache=True, **_options)(space["fill"])
    except (OSError, RuntimeError):  # nowhere to keep it
        exec(compile(text, "<recorded>", "exec"), space)
        return numba.njit(**_options)(space["fill"])


def _cache_folder() -> Path:
    """Where this system keeps what can be made again."""
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    local = os.environ.get("LOCALAPPDATA") if sys.platform == "win32" else os.environ.get("XDG_CACHE_HOME")
    return Path(local) if local else Path.home() / ".cache"


_OWN = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
_fillers: dict[str, Any] = {}
_lock = threading.Lock()


def filler(program: Program) -> tuple[Lanes, Any]:
    """What fills the values of a piece's cells, compiled once for programs of the same operations."""
    found = lanes(program)
    with _lock:
        if found.text not in _fillers:
            _fillers[found.text] = _kept(found.text)
    return found, _fillers[found.text]


# -- one group of lanes ----------------------------------------------------------------------------------------------------

(_START, _BALANCE, _BY_UNKNOWN, _NET, _EXCHANGED, _WORK_ERROR, _VARIATION, _INERTIA_ERROR, _FIRST) = range(9)
_GREATEST, _LEAST, _FASTEST, _SLOWEST, _ANGLE, _EXTENT, _MEAN_AT, _LARGEST, _DOUBT = 9, 14, 19, 20, 21, 22, 26, 28, 29
_EVALUATION = 24 * ROUNDING
_TAIL = cells.TAIL_OF_INTEGRAL
_INSIDE = 1.0 - 1e-12
_SHARE, _NO_EFFECT = 1e-6, 1e-9
_EPS = ROUNDING


@_compiled
def balanced(values: Any, half: Any, unknown: bool, out: Any) -> None:
    """The balance of the net work, and M* and its sizes with it."""
    number = half.shape[0]
    for i in range(_L):
        out[_BALANCE, i] = 0.0
        out[_BY_UNKNOWN, i] = 0.0
    if not unknown:
        return
    net, own, size = np.zeros(_L), np.zeros(_L), np.zeros(_L)
    for cell in range(number):
        for node in range(ORDER):
            weight = _WEIGHTS[node]
            for i in range(_L):
                share = weight * half[cell, i]
                net[i] += share * values[0, node + 1, cell, i]
                own[i] += share * values[5, node + 1, cell, i]
                size[i] += share * abs(values[5, node + 1, cell, i])
    for i in range(_L):
        out[_BY_UNKNOWN, i] = own[i]
        out[_BALANCE, i] = -net[i] / own[i] + 0.0 if abs(own[i]) > _NO_EFFECT * size[i] else np.nan
    for node in range(1, ORDER + 1):
        for cell in range(number):
            for i in range(_L):
                added = out[_BALANCE, i] * values[5, node, cell, i]
                values[0, node, cell, i] += added
                values[3, node, cell, i] += abs(added)


@_compiled
def fitted(values: Any, series: Any, row: int, cell: int) -> None:
    """The series of one row of values on one cell, and for M* and dI*/dphi the values at the cell's ends."""
    for k in range(ORDER):
        sign = 1.0 if k % 2 == 0 else -1.0
        for i in range(_L):
            series[row, k, cell, i] = _FIT[k, _HALF_ORDER] * values[row, _HALF_ORDER + 1, cell, i]
        for node in range(_HALF_ORDER):
            weight = _FIT[k, node]
            for i in range(_L):
                series[row, k, cell, i] += weight * (
                    values[row, node + 1, cell, i] + sign * values[row, ORDER - node, cell, i]
                )
    if row == 2:
        return
    for i in range(_L):
        values[row, 0, cell, i] = 0.0
        values[row, _P - 1, cell, i] = 0.0
    for k in range(ORDER):
        sign = 1.0 if k % 2 == 0 else -1.0
        for i in range(_L):
            values[row, 0, cell, i] += sign * series[row, k, cell, i]
            values[row, _P - 1, cell, i] += series[row, k, cell, i]


@_compiled
def cut_off(series: Any, row: int, cell: int, tails: Any) -> None:
    """The error of the interpolant, as `cells.tail` has it."""
    for i in range(_L):
        first = max(abs(series[row, ORDER - 6, cell, i]), abs(series[row, ORDER - 5, cell, i]))
        middle = max(abs(series[row, ORDER - 4, cell, i]), abs(series[row, ORDER - 3, cell, i]))
        last = max(abs(series[row, ORDER - 2, cell, i]), abs(series[row, ORDER - 1, cell, i]))
        decay = min(max(last / max(middle, _TINY), middle / max(first, _TINY)), 0.9)
        tails[row, cell, i] = 10.0 * decay * max(last, middle * decay) / (1.0 - decay)


@_compiled
def errors_of(
    values: Any,
    series: Any,
    tails: Any,
    edges: Any,
    middle: Any,
    half: Any,
    noise: Any,
    start: Any,
    extents: Any,
    unknown: bool,
    out: Any,
) -> None:
    """Series, accumulated values and every error of a cycle, as `turning_moment.assembled` has them."""
    number = half.shape[0]
    last = np.zeros((2, _L))  # the value at the node before, from which it differs
    shifted, interpolation, size = np.zeros((2, _L)), np.zeros((2, _L)), np.zeros((2, _L))
    inertias = np.zeros((number, _L))
    steep, most, slope, before, two = np.zeros(_L), np.zeros(_L), np.zeros(_L), np.zeros(_L), np.zeros(_L)
    for i in range(_L):
        for k in (_MEAN_AT, _MEAN_AT + 1, _LARGEST, _INERTIA_ERROR):
            out[k, i] = 0.0
        start[0, 0, i] = 0.0
        start[1, 0, i] = 0.0
    for cell in range(number):
        for row in range(3):
            fitted(values, series, row, cell)
            cut_off(series, row, cell, tails)
        for row in range(2):
            for i in range(_L):
                steep[i] = 0.0
                slope[i] = 0.0
                before[i] = 0.0
                start[row, cell + 1, i] = 0.0
                most[i] = 0.0
            for k in range(ORDER - 1, 0, -1):  # coefficients of the slope: d[k-1] = d[k+1] + 2 k c[k]
                for i in range(_L):
                    two[i] = before[i] + 2.0 * k * series[row, k, cell, i]
                    steep[i] += abs(two[i]) if k > 1 else 0.5 * abs(two[i])
                    before[i] = slope[i]
                    slope[i] = two[i]
            for k in range(0, ORDER, 2):
                for i in range(_L):
                    start[row, cell + 1, i] += _MEAN[k] * series[row, k, cell, i]
            for node in range(1, ORDER + 1):
                for i in range(_L):
                    size[row, i] += _WEIGHTS[node - 1] * half[cell, i] * values[row + 3, node, cell, i]
                    most[i] = max(most[i], values[row + 3, node, cell, i])
            for i in range(_L):
                start[row, cell + 1, i] = start[row, cell, i] + half[cell, i] * start[row, cell + 1, i]
                noise[row, cell, i] = (
                    tails[row, cell, i] + 32 * _EPS * most[i] + _EPS * edges[cell + 1, i] * steep[i] / half[cell, i]
                )
                interpolation[row, i] += _TAIL * tails[row, cell, i] * half[cell, i]
            for node in range(ORDER):
                here = NODES[node]
                for i in range(_L):
                    value = values[row, node + 1, cell, i]
                    moved = (value - last[row, i]) * (middle[cell, i] + half[cell, i] * here)
                    shifted[row, i] += moved * moved if node + cell > 0 else 0.0
                    last[row, i] = value
        for i in range(_L):
            steep[i] = 0.0
            most[i] = 0.0
            slope[i] = 0.0
            two[i] = 0.0
            extents[0, cell, i] = 0.0
            extents[1, cell, i] = 0.0
        for k in range(ORDER):
            sign = 1.0 if k % 2 == 0 else -1.0
            for i in range(_L):
                extents[0, cell, i] += sign * series[2, k, cell, i]
                extents[1, cell, i] += series[2, k, cell, i]
                steep[i] = max(steep[i], abs(values[1, k + 1, cell, i]))
                most[i] = max(most[i], abs(values[2, k + 1, cell, i]))
                slope[i] += abs(series[2, k, cell, i])
                two[i] += _MEAN[k] * series[2, k, cell, i]
        for i in range(_L):
            inertias[cell, i] = tails[2, cell, i] + _EVALUATION * most[i] + 2 * _EPS * edges[number, i] * steep[i]
            out[_INERTIA_ERROR, i] = max(out[_INERTIA_ERROR, i], inertias[cell, i])
            out[_LARGEST, i] = max(out[_LARGEST, i], slope[i])
            out[_MEAN_AT, i] += two[i] * half[cell, i] / edges[number, i]
            extents[2, cell, i] = inertias[cell, i]
            out[_MEAN_AT + 1, i] += _TAIL * inertias[cell, i] * half[cell, i] / edges[number, i]
    shifts = 2.0 if unknown else 1.0
    for i in range(_L):
        out[_FIRST, i] = inertias[0, i]
        out[_NET, i] = start[0, number, i]
        out[_EXCHANGED, i] = size[0, i]
        angle = 2 * _EPS * math.sqrt(shifted[0, i])
        out[_WORK_ERROR, i] = shifts * (interpolation[0, i] + _EVALUATION * size[0, i] + angle)
        out[_VARIATION, i] = interpolation[1, i] + _EVALUATION * size[1, i] + 2 * _EPS * math.sqrt(shifted[1, i])
        out[_START, i] = extents[0, 0, i]
    for cell in range(number):  # the ends of each cell, in order of size
        for i in range(_L):
            left, right = extents[0, cell, i], extents[1, cell, i]
            extents[0, cell, i] = min(left, right)
            extents[1, cell, i] = max(left, right)


@_compiled
def candidates(values: Any, tails: Any, noise: Any, factors: Any, doubt: Any, where: Any, between: Any) -> int:
    """Gaps of the points between which a function changes its sign, for all lanes: as `batch.crossings` finds them.

    `where` takes function, cell and lane, `between` the gap's ends and the secant's root. What is in doubt is marked.
    """
    number, found, most = noise.shape[1], 0, where.shape[1]
    row, low, high = np.zeros((_P, _L)), np.zeros(_L), np.zeros(_L)
    for function in range(5):
        of_work = 0.0 if function == INERTIA else 1.0
        for cell in range(number):
            for i in range(_L):
                low[i], high[i] = np.inf, -np.inf
            for point in range(_P):
                for i in range(_L):
                    value = of_work * values[0, point, cell, i] + factors[function, i] * values[1, point, cell, i]
                    row[point, i] = value
                    low[i] = min(low[i], value)
                    high[i] = max(high[i], value)
            for i in range(_L):
                size = abs(factors[function, i])
                level = of_work * noise[0, cell, i] + size * noise[1, cell, i]
                far = max(-low[i], high[i])
                near = low[i] if low[i] > 0.0 else -high[i] if high[i] < 0.0 else 0.0
                if of_work * tails[0, cell, i] + size * tails[1, cell, i] > _SHARE * far:
                    doubt[i] = 1.0
                elif near <= 0.5 * (far - near) or near <= level:
                    found = _gaps(row, i, level, function, cell, found, most, doubt, where, between)
    return found


@_compiled
def _gaps(
    row: Any, i: int, level: float, function: int, cell: int, found: int, most: int, doubt: Any, where: Any, between: Any
) -> int:
    """The changes of sign of one row of one lane."""
    first, last = 1, _P - 2  # points that may be the lowest of a dip
    if abs(row[0, i]) <= level:  # an end that is no more than noise is an extreme's place as it is
        row[0, i] = row[1, i]
        first = 2
    if abs(row[_P - 1, i]) <= level:
        row[_P - 1, i] = row[_P - 2, i]
        last = _P - 3
    for point in range(_P - 1):
        here, after = row[point, i], row[point + 1, i]
        if point > 0:
            before, size = row[point - 1, i], abs(here)
            same = (before > 0.0) == (here > 0.0) and (after > 0.0) == (here > 0.0)
            lowest = same and size <= abs(before) and size <= abs(after) and first <= point <= last
            if size <= level or (lowest and size < 0.5 * (max(abs(before), abs(after)) - size)):
                doubt[i] = 1.0
                return found
        if (here > 0.0) != (after > 0.0):
            if found == most:
                doubt[i] = 1.0
                return found
            where[0, found], where[1, found], where[2, found] = function, cell, i
            left, right = POINTS[point], POINTS[point + 1]
            between[0, found], between[1, found] = left, right
            between[2, found] = left + (right - left) * here / (here - after)
            found += 1
    return found


@_compiled
def polished(series: Any, factors: Any, where: Any, between: Any, found: int, doubt: Any, rows: Any, state: Any) -> None:
    """Newton's method towards all roots at once, kept in their gaps; what does not settle is in doubt.

    `rows` (3 * ORDER, roots) holds the series of M*, of dI*/dphi, and the function's; `state` intermediate rows.
    """
    for r in range(found):
        function, cell, i = where[0, r], where[1, r], where[2, r]
        of_work, factor = 0.0 if function == INERTIA else 1.0, factors[function, i]
        for k in range(ORDER):
            moment, slope = series[0, k, cell, i], series[1, k, cell, i]
            rows[k, r] = moment
            rows[ORDER + k, r] = slope
            rows[2 * ORDER + k, r] = of_work * moment + factor * slope
    for step in range(5):
        largest = 0.0
        for r in range(found):
            for k in range(6):
                state[k, r] = 0.0
        # values by Clenshaw's recurrence, slopes by the one of the second kind: T_k' = k U_(k-1)
        for k in range(ORDER - 1, 0, -1):
            for r in range(found):
                t, c = between[2, r], rows[2 * ORDER + k, r]
                b = c + 2.0 * t * state[0, r] - state[1, r]
                state[1, r] = state[0, r]
                state[0, r] = b
                d = k * c + 2.0 * t * state[2, r] - state[3, r]
                state[3, r] = state[2, r]
                state[2, r] = d
        for r in range(found):
            t = between[2, r]
            value, slope = rows[2 * ORDER, r] + t * state[0, r] - state[1, r], state[2, r]
            moved = value / slope if slope != 0.0 else 0.0
            state[4, r] = moved
            between[2, r] = min(max(t - moved, between[0, r]), between[1, r])
            largest = max(largest, abs(moved))
        if step > 1 and largest <= 1e-9:
            break
    for r in range(found):
        if abs(state[4, r]) > 1e-5 and between[1, r] > between[0, r]:
            doubt[where[2, r]] = 1.0


@_compiled
def accumulated(half: Any, start: Any, where: Any, between: Any, found: int, rows: Any, state: Any) -> None:
    """W and I* - I*(0) at all roots, from the series of M* and dI*/dphi integrated: into the first two rows of `state`."""
    for which in range(2):
        base = which * ORDER
        for r in range(found):
            for k in range(2, 5):
                state[k, r] = 0.0
        for k in range(ORDER, 0, -1):
            share, sign = 0.5 / k, 1.0 if k % 2 == 0 else -1.0
            for r in range(found):
                t = between[2, r]
                c = (2.0 if k == 1 else 1.0) * rows[base + k - 1, r]
                c -= rows[base + k + 1, r] if k + 1 < ORDER else 0.0
                c *= share
                b = c + 2.0 * t * state[2, r] - state[3, r]
                state[3, r] = state[2, r]
                state[2, r] = b
                state[4, r] -= sign * c
        for r in range(found):
            state[which, r] = state[4, r] + between[2, r] * state[2, r] - state[3, r]
    for r in range(found):
        cell, i = where[1, r], where[2, r]
        state[0, r] = start[0, cell, i] + half[cell, i] * state[0, r]
        state[1, r] = start[1, cell, i] + half[cell, i] * state[1, r]


@_compiled
def compared(
    edges: Any,
    series: Any,
    start: Any,
    factors: Any,
    where: Any,
    between: Any,
    found: int,
    state: Any,
    extents: Any,
    places: Any,
    out: Any,
) -> None:
    """The extremes of every function over edges and roots, the places of the fastest and the slowest point, those of I*."""
    number = start.shape[1] - 1
    for function in range(5):
        of_work = 0.0 if function == INERTIA else 1.0
        for i in range(_L):
            out[_GREATEST + function, i], out[_LEAST + function, i] = -np.inf, np.inf
        for edge in range(number + 1):
            for i in range(_L):
                value = of_work * start[0, edge, i] + factors[function, i] * start[1, edge, i]
                if function == FAST and value > out[_GREATEST + FAST, i]:
                    places[0, i] = edge
                if function == SLOW and value < out[_LEAST + SLOW, i]:
                    places[1, i] = edge
                out[_GREATEST + function, i] = max(out[_GREATEST + function, i], value)
                out[_LEAST + function, i] = min(out[_LEAST + function, i], value)
    for k in range(2):
        for i in range(_L):
            edge = places[k, i]
            places[k, i] = min(edge, number - 1)
            places[k + 2, i] = 1.0 if edge == number else -1.0
    for r in range(found):
        function, cell, i = where[0, r], where[1, r], where[2, r]
        value = factors[function, i] * state[1, r] + (0.0 if function == INERTIA else state[0, r])
        if value > out[_GREATEST + function, i]:
            out[_GREATEST + function, i] = value
            if function == FAST:
                places[0, i], places[2, i] = cell, between[2, r]
        if value < out[_LEAST + function, i]:
            out[_LEAST + function, i] = value
            if function == SLOW:
                places[1, i], places[3, i] = cell, between[2, r]
        if function == INERTIA:
            inside = value_at(series, 2, cell, i, between[2, r])
            extents[0, cell, i] = min(extents[0, cell, i], inside)
            extents[1, cell, i] = max(extents[1, cell, i], inside)
    for i in range(_L):
        out[_EXTENT, i], out[_EXTENT + 1, i] = np.inf, -np.inf
        out[_EXTENT + 2, i], out[_EXTENT + 3, i] = -np.inf, -np.inf
    for cell in range(number):
        for i in range(_L):
            out[_EXTENT, i] = min(out[_EXTENT, i], extents[0, cell, i])
            out[_EXTENT + 1, i] = max(out[_EXTENT + 1, i], extents[1, cell, i])
    for cell in range(number):
        for i in range(_L):
            out[_EXTENT + 2, i] = max(out[_EXTENT + 2, i], out[_EXTENT, i] - extents[0, cell, i] + extents[2, cell, i])
            out[_EXTENT + 3, i] = max(out[_EXTENT + 3, i], extents[1, cell, i] - out[_EXTENT + 1, i] + extents[2, cell, i])


@_compiled
def value_at(series: Any, row: int, cell: int, i: int, t: float) -> Any:
    """A series at a local abscissa, by Clenshaw's recurrence."""
    b, after = 0.0, 0.0
    for k in range(ORDER - 1, 0, -1):
        b, after = series[row, k, cell, i] + 2.0 * t * b - after, b
    return series[row, 0, cell, i] + t * b - after


@_compiled
def slope_at(series: Any, row: int, cell: int, i: int, t: float) -> Any:
    """A series' derivative by the local abscissa, from T_k' = k U_(k-1)."""
    b, after = 0.0, 0.0
    for k in range(ORDER - 1, 0, -1):
        b, after = k * series[row, k, cell, i] + 2.0 * t * b - after, b
    return b


@_compiled
def placed(
    edges: Any, middle: Any, half: Any, values: Any, series: Any, noise: Any, factors: Any, places: Any, doubt: Any, out: Any
) -> None:
    """The angles of the fastest and the slowest point, with the error of the worse; see `batch._places`."""
    number = half.shape[0]
    for i in range(_L):
        out[_ANGLE, i] = 0.0
        end = edges[number, i]
        own = out[_WORK_ERROR, i] / end
        for k in range(2):
            cell, t, factor = int(places[k, i]), places[k + 2, i], factors[FAST + k, i]
            wide, size, error = half[cell, i], abs(factor), 0.0
            edge = cell + (1 if t > 0.0 else 0)
            out[_FASTEST + k, i] = middle[cell, i] + wide * t if abs(t) < 1.0 else edges[edge, i]
            if abs(t) < _INSIDE:
                slope = max(abs(slope_at(series, 0, cell, i, t) + factor * slope_at(series, 1, cell, i, t)) / wide, _TINY)
                error = min((noise[0, cell, i] + size * noise[1, cell, i] + own) / slope, 2 * wide)
            if abs(t) >= _INSIDE - 8 * _EPS * end / wide:
                before, after = (edge - 1) % number, edge % number
                left = values[0, _P - 1, before, i] + factor * values[1, _P - 1, before, i]
                right = values[0, 0, after, i] + factor * values[1, 0, after, i]
                of_left = noise[0, before, i] + size * noise[1, before, i] + own
                of_right = noise[0, after, i] + size * noise[1, after, i] + own
                if not (abs(left) > of_left and abs(right) > of_right and (left > 0.0) != (right > 0.0)):
                    doubt[i] = 1.0
            out[_ANGLE, i] = max(out[_ANGLE, i], error + 4 * _EPS * end)


@_compiled
def cycles(values: Any, edges: Any, middle: Any, half: Any, factors: Any, unknown: bool, out: Any) -> None:
    """Everything about the cycles of groups of lanes: (groups, rows, LANES) of sums."""
    number = half.shape[1]
    series, tails, noise = np.zeros((3, ORDER, number, _L)), np.zeros((3, number, _L)), np.zeros((2, number, _L))
    start, extents, places, doubt = np.zeros((2, number + 1, _L)), np.zeros((3, number, _L)), np.zeros((4, _L)), np.zeros(_L)
    most = _MOST_ROOTS * _L
    where, between = np.zeros((3, most), np.int64), np.zeros((3, most))
    rows, state = np.zeros((3 * ORDER, most)), np.zeros((6, most))
    for g in range(values.shape[0]):
        doubt[:] = 0.0
        balanced(values[g], half[g], unknown, out[g])
        errors_of(values[g], series, tails, edges[g], middle[g], half[g], noise, start, extents, unknown, out[g])
        found = candidates(values[g], tails, noise, factors[g], doubt, where, between)
        polished(series, factors[g], where, between, found, doubt, rows, state)
        accumulated(half[g], start, where, between, found, rows, state)
        compared(edges[g], series, start, factors[g], where, between, found, state, extents, places, out[g])
        placed(edges[g], middle[g], half[g], values[g], series, noise, factors[g], places, doubt, out[g])
        for i in range(_L):
            out[g, _DOUBT, i] = doubt[i]


# -- chunks ----------------------------------------------------------------------------------------------------------------

_BLOCK = 48  # cells of a group of lanes that are filled before they are worked on: so much stays in the cache


def sums(pieces: Pieces, givens: Givens, columns: Array, edges: Array) -> Sums:
    """The cycles of a chunk of designs, as `batch.sums`."""
    count = edges.shape[1]
    groups = -(-count // _L)

    def grouped(rows: Any) -> Array:
        """(rows, designs) as (groups, rows, LANES); the last design fills up the last group."""
        rows = np.broadcast_to(rows, (np.shape(rows)[0], count))
        full = np.concatenate((rows, np.repeat(rows[:, -1:], groups * _L - count, axis=1)), axis=1)
        return np.ascontiguousarray(full.reshape(len(rows), groups, _L).swapaxes(0, 1))

    square, eps = givens.speed**2, givens.irregularity
    fast, slow = (-0.5 * (1 + sign * eps / 2) ** 2 * square for sign in (1, -1))
    factors = grouped(np.stack(np.broadcast_arrays(0.0 * square, fast, slow, -0.5 * square, 0.0 * square + 1.0)))
    at = grouped(edges)
    half = 0.5 * (at[:, 1:] - at[:, :-1])
    middle = at[:, :-1] + half
    prepared = []
    for piece, program in pieces:
        split, fill = filler(program)
        before = [np.broadcast_to(row, (count,)) for row in split.before.function()(0.0, *columns)]
        given = grouped(np.stack(before)) if before else np.zeros((groups, 1, _L))
        table = np.zeros((split.rows, _L))
        prepared.append((fill, piece, given, np.array([*program.places, 0.0]), table, table.reshape(-1)))
    size = max(1, _BLOCK // half.shape[1])
    values, out = np.zeros((size, 6, _P, half.shape[1], _L)), np.empty((groups, _DOUBT + 1, _L))
    for first in range(0, groups, size):
        part = slice(first, min(first + size, groups))
        block = values[: part.stop - first]
        for fill, piece, given, places, table, flat in prepared:
            fill(piece.start, piece.stop, middle[part], half[part], given[part], places, table, flat, block)
        cycles(block, at[part], middle[part], half[part], factors[part], givens.unknown, out[part])
    rows = out.swapaxes(0, 1).reshape(_DOUBT + 1, -1)[:, :count]
    found = Sums(
        **dict(zip(Sums._fields, rows[:9], strict=False)),
        greatest=rows[_GREATEST:_LEAST],
        least=rows[_LEAST:_FASTEST],
        fastest=rows[_FASTEST],
        slowest=rows[_SLOWEST],
        angle=rows[_ANGLE],
        extent=rows[_EXTENT:_MEAN_AT],
        mean=rows[_MEAN_AT:_LARGEST],
        largest=rows[_LARGEST],
    )
    doubtful = np.flatnonzero(rows[_DOUBT])
    if doubtful.size:
        asked: dict[str, Any] = givens._asdict()
        own = givens._replace(**{name: each[doubtful] for name, each in asked.items() if np.ndim(each)})
        for into, value in zip(found, batch.sums(pieces, own, columns[:, doubtful], edges[:, doubtful]), strict=True):
            into[..., doubtful] = value
    return found
