"""The cycles of many designs in machine code: the result of `batch.sums`, sixteen designs side by side in lanes.

Every loop runs over `LANES` designs innermost, so that a compiler makes one instruction of several designs. The program of a
smooth piece is split: the part that depends on the design alone is computed once, by numpy; the rest is the program's own
source in such a loop. Roots are polished sixteen at a time. A design with a row that its nodes do not resolve is summed by
numpy (`batch.summed_values`), which has the finer search.
"""

from __future__ import annotations

import hashlib
import math
import os
import sys
import threading
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import numba
import numpy as np

from bondgraph.recording import Program, source
from flywheel.designs import batch
from flywheel.designs.batch import (
    FAST,
    INERTIA,
    NO_EFFECT,
    POINTS,
    ROOT_RANGE,
    SLOW,
    TAIL_SHARE,
    TORQUE,
    WORK,
    Pieces,
    Sums,
)
from flywheel.machine.programs import DesignValues
from flywheel.numerics import cells
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, SAME, TAIL_OF_INTEGRAL, Array
from flywheel.regime.turning_moment import (
    BY_ANGLES,
    INERTIA_ROUNDING,
    MOMENT_ROUNDING,
    SHIFT,
    START_ROUNDING,
    root_of_squares,
    spread_of,
)

LANES = 16
_L = LANES
_P = POINTS.size
_ROOTS = 48 * LANES  # of the five functions of all lanes; designs that have more are left to numpy
_FIT: Array = np.ascontiguousarray(cells.fit(np.eye(ORDER)).T)
_MEAN, _TO_MIDDLE = np.ascontiguousarray(cells.MEAN), np.ascontiguousarray(cells.TO_MIDDLE)
_WEIGHTS = np.ascontiguousarray(_FIT.T @ _MEAN)
Function = TypeVar("Function", bound=Callable[..., Any])
_options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}


def _compiled(function: Function) -> Function:
    """Machine code that is kept on disk, runs without the interpreter's lock, and divides by zero as numpy does."""
    machine_code: Function = numba.njit(cache=True, **_options)(function)
    return machine_code


def _inlined(function: Function) -> Function:
    """The same for a function that becomes part of the loops that call it, which a compiler can then put in lanes."""
    machine_code: Function = numba.njit(cache=True, forceinline=True, **_options)(function)
    return machine_code


_tail, _spread_of, _root_of_squares = _inlined(cells.tail), _inlined(spread_of), _inlined(root_of_squares)


# -- programs in lanes -----------------------------------------------------------------------------------------------------

_GREATEST_ANGLE = 1e5  # of an angle: within it the remainder of quarter turns is exact
_MAGIC = 6755399441055744.0  # 1.5 * 2^52: added and taken away it rounds to the nearest whole number
_QUARTER, _QUARTER_REST = 1.57079632673412561417e00, 6.07710050650619224932e-11  # pi/2 in 33 bits, and what is left
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@_inlined
def sine(x: float, quarters: float = 0.0) -> float:
    """Sine of an angle and a number of quarter turns within an ulp, without a branch; NaN beyond the greatest angle.

    Source: W. J. Cody, W. Waite, Software Manual for the Elementary Functions (1980); polynomials of fdlibm (Sun, 1993).
    """
    k = (x * (2.0 / math.pi) + _MAGIC) - _MAGIC
    r = (x - k * _QUARTER) - k * _QUARTER_REST
    z = r * r
    even = r + r * z * (_S1 + z * (_S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))))
    half = 0.5 * z
    w = 1.0 - half
    odd = w + (((1.0 - w) - half) + z * z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6))))))
    turn = 0.25 * (k + quarters)
    turn = turn - ((turn + _MAGIC) - _MAGIC)  # of a turn: 0, ±1/4, ±1/2
    value = odd if abs(turn) == 0.25 else even
    value = -value if (turn < -0.1) or (turn > 0.4) else value
    return value if abs(x) < _GREATEST_ANGLE else math.nan


@_inlined
def cosine(x: float) -> float:
    """Cosine of an angle as the sine a quarter turn later."""
    return sine(x, 1.0)


@_inlined
def _bisected(table: Any, x: float) -> int:
    """Number of entries that are no greater, as `bisect_right`."""
    return int(np.searchsorted(table, x, "right"))


_ROW_OF = (2, 1, 0, 5, 3, 4)  # of the program's outputs I*, dI*/dphi, M*, dM*/du and the two sizes, among the values
_FILL = """{kernel}

kernel = numba.njit(forceinline=True, **options)(recorded)


def fill(first, last, middle, half, given, places, values):
    {places}
    for group in range(values.shape[0]):
        t = given[group].reshape(-1)
        for cell in range(first, last):
            v = values[group, cell].reshape(-1)
            for node in range(1, _P - 1):
                for i in range(_L):
                    t[{angle} + i] = middle[group, cell, i] + half[group, cell, i] * POINTS[node]
                for i in range(_L):
                    row = kernel({arguments})
                    {values}
"""
_lock = threading.Lock()


@lru_cache(maxsize=2048)  # a table has a piece for each of its rows
def filler(program: Program) -> tuple[Callable[..., Any], Array, Any]:
    """A program split by whether it needs the angle, its first input.

    Returns the function of values that depend on the design alone, from the other inputs; the constants; and a function that
    fills a piece's cells with the rest: the designs' values are rows of lanes in its `given`, and a last row is for angles.
    It is compiled once for programs of the same operations.
    """
    before, rest = program.split(-1)
    ends = np.cumsum([0, *map(np.size, rest.places)]).tolist()
    opened = [
        f"p{k} = places[{ends[k]}{f':{ends[k + 1]}' if np.ndim(place) else ''}]" for k, place in enumerate(rest.places)
    ]
    own = [f"t[{k * _L} + i]" for k in range(len(rest.inputs))]
    text = _FILL.format(
        kernel=source(rest, "math"),
        places="\n    ".join(opened or ["pass"]),
        angle=(len(own) - 1) * _L,
        arguments=", ".join((*own, *(f"p{k}" for k in range(len(opened))))),
        values="\n                    ".join(f"v[({row} * _P + node) * _L + i] = row[{k}]" for k, row in enumerate(_ROW_OF)),
    )
    with _lock:
        return before.function(), rest.constants, _kept(text)


@lru_cache(maxsize=64)
def _kept(text: str) -> Any:
    """Source compiled to machine code, cached on disk by its text and this module's; once for equal ones."""
    digest = hashlib.sha256(f"{_OWN}{text}".encode()).hexdigest()[:32]
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or _cache_folder()) / "flywheel"
    space = {**_MATH, "__name__": __name__, "numba": numba, "options": _options, "_L": _L, "_P": _P, "POINTS": POINTS}
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
    """Folder of this system for files that can be made again."""
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    local = os.environ.get("LOCALAPPDATA") if sys.platform == "win32" else os.environ.get("XDG_CACHE_HOME")
    return Path(local) if local else Path.home() / ".cache"


_OWN = hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
_MATH = Program((), (), (), ()).function("math").__globals__ | {"sin": sine, "cos": cosine, "bisect_right": _bisected}


# -- one group of lanes ----------------------------------------------------------------------------------------------------

_WIDTHS = {"greatest": 5, "least": 5, "apart": 3, "moving": 2, "extent": 4, "mean": 2}  # rows of a sum, if it has several
_ROWS = np.cumsum([0, *(_WIDTHS.get(name, 1) for name in Sums._fields)]).tolist()
(_START_AT, _BALANCE, _BY_UNKNOWN, _NET, _EXCHANGED, _WORK_ERROR, _VARIATION, _INERTIA_ERROR, _FIRST, _OF_NET) = _ROWS[:10]
(_GREATEST, _LEAST, _APART, _FASTEST, _SLOWEST, _ANGLE, _MOVING, _EXTENT, _MEAN_AT, _LARGEST, _DOUBT) = _ROWS[10:]
# rows of LANES numbers that belong to one cell
(_HALF, _MIDDLE, _RIGHT, _END, _TAILS, _NOISE, _INERTIA, _LOW, _HIGH, _START, _STOP, _CELL) = (
    k * _L for k in (0, 1, 2, 3, 4, 7, 9, 10, 11, 12, 14, 16)
)
# and to the whole cycle: sums over cells, and the values at the last node
(_SHIFTED, _CUT, _SIZE, _WORST, _MOST, _AREA, _AREA_ERROR, _BEFORE, _SWING, _CYCLE) = (
    k * _L for k in (0, 2, 4, 6, 7, 8, 9, 10, 12, 14)
)
# and to a block of roots, after three series with two zeros beyond each
_TERMS = ORDER + 2
(_LEFT, _RIGHT_END, _AT, _STEP, _GAINED, _BLOCK) = ((3 * _TERMS + k) * _L for k in (0, 1, 2, 3, 4, 6))


@_compiled
def balanced(values: Any, cellwise: Any, unknown: bool, out: Any) -> None:
    """The balance of the net work, and M* and its sizes with it."""
    out[_BALANCE : _BY_UNKNOWN + 1] = 0.0
    out[_WORK_ERROR], out[_OF_NET] = 1.0, 0.0  # first the factor by which a balance spreads errors, and its own work
    if not unknown:
        return
    net, own, size = np.zeros(_L), np.zeros(_L), np.zeros(_L)
    for cell in range(values.shape[0]):
        v, w = values[cell].reshape(-1), cellwise[cell].reshape(-1)
        for i in range(_L):
            a, b, c = 0.0, 0.0, 0.0
            for node in range(ORDER):
                per_unknown = v[(5 * _P + node + 1) * _L + i]
                a += _WEIGHTS[node] * v[(node + 1) * _L + i]
                b += _WEIGHTS[node] * per_unknown
                c += _WEIGHTS[node] * abs(per_unknown)
            net[i] += a * w[_HALF + i]
            own[i] += b * w[_HALF + i]
            size[i] += c * w[_HALF + i]
    for i in range(_L):
        out[_BY_UNKNOWN, i] = own[i]
        out[_WORK_ERROR, i], _ = _spread_of(own[i], size[i], 0.0)
        out[_BALANCE, i] = -net[i] / own[i] + 0.0 if abs(own[i]) > NO_EFFECT * size[i] else np.nan
        net[i] = out[_BALANCE, i]
        out[_OF_NET, i] = abs(net[i]) * size[i]
    for cell in range(values.shape[0]):
        v = values[cell].reshape(-1)
        for node in range(1, ORDER + 1):
            for i in range(_L):
                added = net[i] * v[(5 * _P + node) * _L + i]
                v[node * _L + i] += added
                v[(3 * _P + node) * _L + i] += abs(added)


@_compiled
def fitted(v: Any, s: Any, w: Any, folded: Any) -> None:
    """Series of M*, dI*/dphi and I* on one cell, their values at its ends, and the errors of the interpolants.

    Even coefficients follow from sums of values at ±t, odd ones from differences.
    """
    middle = ORDER // 2
    for row in range(3):
        base, to = row * _P * _L, row * ORDER * _L
        for i in range(_L):
            for node in range(middle):
                left, right = v[base + (node + 1) * _L + i], v[base + (ORDER - node) * _L + i]
                folded[node * _L + i], folded[(middle + 1 + node) * _L + i] = left + right, left - right
            folded[middle * _L + i] = v[base + (middle + 1) * _L + i]
        for k in range(ORDER):
            first = k % 2 * (middle + 1) * _L
            for i in range(_L):
                total = 0.0
                for node in range(middle):
                    total += _FIT[k, node] * folded[first + node * _L + i]
                s[to + k * _L + i] = total + _FIT[k, middle] * folded[middle * _L + i]  # which is 0 of an odd one
        for i in range(_L):
            even, odd = s[to + i], 0.0
            for k in range(1, ORDER, 2):
                odd += s[to + k * _L + i]
                even += s[to + (k + 1) * _L + i]
            v[base + i], v[base + (_P - 1) * _L + i] = even - odd, even + odd
        last = to + (ORDER - 6) * _L
        for i in range(_L):
            first_pair = max(abs(s[last + i]), abs(s[last + _L + i]))
            second = max(abs(s[last + 2 * _L + i]), abs(s[last + 3 * _L + i]))
            third = max(abs(s[last + 4 * _L + i]), abs(s[last + 5 * _L + i]))
            w[_TAILS + row * _L + i], _ = _tail(first_pair, second, third)
    for i in range(_L):
        left, right = v[2 * _P * _L + i], v[(3 * _P - 1) * _L + i]
        w[_LOW + i], w[_HIGH + i] = min(left, right), max(left, right)


@_compiled
def summed(v: Any, s: Any, w: Any, c: Any, by_directions: Any, first: bool) -> None:
    """Adds one cell to the sums of a cycle, and to the noise of its series; see `turning_moment.assembled`."""
    for row in range(2):
        own, size = row * _L, (row + 3) * _P
        for i in range(_L):  # steepness: sizes of the slope's coefficients, d[k-1] = d[k+1] + 2 k c[k]
            steep, after, here = 0.0, 0.0, 0.0
            for k in range(ORDER - 1, 1, -1):
                derivative = after + 2.0 * k * s[(row * ORDER + k) * _L + i]
                steep += abs(derivative)
                after, here = here, derivative
            steep += 0.5 * abs(after + 2.0 * s[(row * ORDER + 1) * _L + i])
            w[_NOISE + own + i] = ROUNDING * w[_RIGHT + i] * steep / w[_HALF + i] + w[_TAILS + own + i]
        for i in range(_L):
            most, total = 0.0, 0.0
            for node in range(ORDER):
                value = v[(size + node + 1) * _L + i]
                most = max(most, value)
                total += _WEIGHTS[node] * value
            w[_NOISE + own + i] += 32 * ROUNDING * most
            c[_SIZE + own + i] += total * w[_HALF + i]
            c[_CUT + own + i] += TAIL_OF_INTEGRAL * w[_TAILS + own + i] * w[_HALF + i]
        for i in range(_L):
            mean = 0.0
            for k in range(0, ORDER, 2):
                mean += _MEAN[k] * s[(row * ORDER + k) * _L + i]
            w[_STOP + own + i] = w[_START + own + i] + mean * w[_HALF + i]
        for i in range(_L):
            total, swing, last = 0.0, 0.0, c[_BEFORE + own + i]
            if first:
                last = v[(row * _P + 1) * _L + i]
            for node in range(ORDER):
                value = v[(row * _P + node + 1) * _L + i]
                moved = (value - last) * (w[_MIDDLE + i] + w[_HALF + i] * NODES[node])
                total += moved * moved
                swing += abs(value - last)
                last = value
            c[_SHIFTED + own + i] += total
            c[_SWING + own + i] += swing
            c[_BEFORE + own + i] = last
    for i in range(_L):
        steep, most, largest, mean = 0.0, 0.0, 0.0, 0.0
        for k in range(ORDER):
            steep = max(steep, abs(v[(_P + k + 1) * _L + i]))
            most = max(most, abs(v[(2 * _P + k + 1) * _L + i]))
        for k in range(ORDER):
            largest += abs(s[(2 * ORDER + k) * _L + i])
            mean += _MEAN[k] * s[(2 * ORDER + k) * _L + i]
        error = w[_TAILS + 2 * _L + i] + INERTIA_ROUNDING * most + 2 * ROUNDING * w[_END + i] * steep
        w[_INERTIA + i] = error
        w[_NOISE + i] += by_directions[i] * math.sqrt(most)
        c[_WORST + i] = max(c[_WORST + i], error)
        c[_MOST + i] = max(c[_MOST + i], largest)
        c[_AREA + i] += mean * w[_HALF + i]
        c[_AREA_ERROR + i] += TAIL_OF_INTEGRAL * error * w[_HALF + i]


@_compiled
def errors_of(values: Any, series: Any, cellwise: Any, c: Any, folded: Any, by_directions: Any, out: Any) -> None:
    """Series, accumulated values and every error of a cycle."""
    number = values.shape[0]
    c[:] = 0.0
    for cell in range(number):
        v, s, w = values[cell].reshape(-1), series[cell].reshape(-1), cellwise[cell].reshape(-1)
        for i in range(2 * _L):
            w[_START + i] = 0.0 if cell == 0 else cellwise[cell - 1, _STOP // _L + i // _L, i % _L]
        fitted(v, s, w, folded)
        summed(v, s, w, c, by_directions, cell == 0)
    for i in range(_L):
        end = cellwise[0, _END // _L, i]
        rise, most, steep = 0.0, 0.0, 0.0
        for k in range(ORDER):
            rise += _TO_MIDDLE[k] * series[0, 1, k, i]
            most, steep = max(most, abs(values[0, 2, k + 1, i])), max(steep, values[0, 4, k + 1, i])
        half, right = cellwise[0, _HALF // _L, i], cellwise[0, _RIGHT // _L, i]
        out[_START_AT, i] = values[0, 2, 1 + ORDER // 2, i] - half * rise
        out[_FIRST, i] = TAIL_OF_INTEGRAL * cellwise[0, _TAILS // _L + 1, i] * half
        out[_FIRST, i] += START_ROUNDING * most + (SHIFT + BY_ANGLES * right) * steep
        out[_NET, i] = cellwise[number - 1, _STOP // _L, i]
        out[_EXCHANGED, i], out[_INERTIA_ERROR, i], out[_LARGEST, i] = c[_SIZE + i], c[_WORST + i], c[_MOST + i]
        spread = out[_WORK_ERROR, i]
        _, of_exchange = _spread_of(1.0, 2.0 * spread - 1.0, out[_OF_NET, i] / max(c[_SIZE + i], 1e-300))
        anywhere, rounding = c[_CUT + i] + SHIFT * c[_SWING + i], MOMENT_ROUNDING * c[_SIZE + i]
        squares = BY_ANGLES**2 * c[_SHIFTED + i]
        out[_OF_NET, i] = anywhere + _root_of_squares(rounding, squares)  # all of every cell
        out[_WORK_ERROR, i] = spread * anywhere + _root_of_squares(of_exchange * rounding, spread**2 * squares)
        out[_WORK_ERROR, i] += 0.5 * by_directions[i] * math.sqrt(end * abs(c[_AREA + i]))
        k = _L + i
        once = SHIFT * c[_SWING + k] + abs(cellwise[number - 1, _STOP // _L + 1, i])
        rounding, squares = MOMENT_ROUNDING * c[_SIZE + k], BY_ANGLES**2 * c[_SHIFTED + k]
        out[_VARIATION, i] = c[_CUT + k] + 0.5 * once + _root_of_squares(0.5 * rounding, 0.5 * squares)
        out[_MEAN_AT, i] = c[_AREA + i] / end
        out[_MEAN_AT + 1, i] = c[_AREA_ERROR + i] / end


@_compiled
def candidates(values: Any, cellwise: Any, factors: Any, doubt: Any, row: Any, where: Any, between: Any) -> int:
    """Gaps of the points between which a function changes its sign, for all lanes; see `batch._roots`.

    `where` takes function, cell and lane, `between` the gap's ends and the secant's root. Doubtful ones are marked.
    """
    number, most, last = 0, where.shape[1], (_P - 1) * _L
    level, far, turns = np.zeros(_L), np.zeros(_L), np.zeros(_L)
    for function in range(5):
        of_work, factor = 0.0 if function == INERTIA else 1.0, factors[function]
        for cell in range(values.shape[0]):
            v, w = values[cell].reshape(-1), cellwise[cell].reshape(-1)
            for k in range(0, _P * _L, _L):
                for i in range(_L):
                    row[k + i] = of_work * v[k + i] + factor[i] * v[k + _P * _L + i]
            for i in range(_L):
                level[i] = of_work * w[_NOISE + i] + abs(factor[i]) * w[_NOISE + _L + i]
                far[i] = max(abs(row[i]), abs(row[last + i]))
                turns[i] = 0.0 if (row[i] > 0.0) == (row[_L + i] > 0.0) else 1.0
            for k in range(0, last - _L, _L):  # within noise, or a dip towards zero and back
                for i in range(_L):
                    left, here, right = row[k + i], row[k + _L + i], row[k + 2 * _L + i]
                    before, size, after = abs(left), abs(here), abs(right)
                    same = (right > 0.0) == (here > 0.0)
                    dip = (size <= before) & (size <= after) & (size < 0.5 * (max(before, after) - size))
                    dip &= same & ((left > 0.0) == (here > 0.0))
                    doubt[i] = 1.0 if (size <= level[i]) | dip else doubt[i]
                    turns[i] += 0.0 if same else 1.0
                    far[i] = max(far[i], size)
            for i in range(_L):
                cut = of_work * w[_TAILS + i] + abs(factor[i]) * w[_TAILS + _L + i]
                doubt[i] = 1.0 if cut > TAIL_SHARE * far[i] else doubt[i]
                # an end that is no more than noise is an extreme's place as it is
                left, right, first, beside = row[i], row[last + i], row[_L + i], row[last - _L + i]
                row[i] = first if abs(left) <= level[i] else left
                row[last + i] = beside if abs(right) <= level[i] else right
            for i in range(_L):
                if number + turns[i] > most:
                    doubt[i] = 1.0
                elif turns[i] > 0.0 and doubt[i] == 0.0:
                    for point in range(_P - 1):
                        here, after = row[point * _L + i], row[(point + 1) * _L + i]
                        if (here > 0.0) != (after > 0.0):
                            where[0, number], where[1, number], where[2, number] = function, cell, i
                            left, right = POINTS[point], POINTS[point + 1]
                            between[0, number], between[1, number] = left, right
                            between[2, number] = left + (right - left) * here / (here - after)
                            number += 1
    return number


@_compiled
def polished(series: Any, cellwise: Any, factors: Any, where: Any, between: Any, number: int, doubt: Any, c: Any) -> None:
    """Newton's method towards the roots, a block of them in lanes, kept in their gaps; then W and I* - I*(0) there.

    One that does not converge is doubtful. `c` takes the series of M*, of dI*/dphi and of the function, for all lanes;
    `between` the local abscissa in its third row, and the two values in the first two.
    """
    for first in range(0, number, _L):
        for i in range(_L):
            r = min(first + i, number - 1)
            function, cell, lane = where[0, r], where[1, r], where[2, r]
            of_work, factor = 0.0 if function == INERTIA else 1.0, factors[function, lane]
            c[_LEFT + i], c[_RIGHT_END + i], c[_AT + i] = between[0, r], between[1, r], between[2, r]
            for k in range(ORDER):
                moment, slope, twice = series[cell, 0, k, lane], series[cell, 1, k, lane], 2.0 if k == 0 else 1.0
                c[k * _L + i], c[(_TERMS + k) * _L + i] = twice * moment, twice * slope
                c[(2 * _TERMS + k) * _L + i] = of_work * moment + factor * slope
        for step in range(5):
            # values by Clenshaw's recurrence, slopes by the one of the second kind: T_k' = k U_(k-1)
            for i in range(_L):
                t = c[_AT + i]
                value, before, slope, earlier = 0.0, 0.0, 0.0, 0.0
                for k in range(ORDER - 1, 0, -1):
                    term = c[(2 * _TERMS + k) * _L + i]
                    value, before = term + 2.0 * t * value - before, value
                    slope, earlier = k * term + 2.0 * t * slope - earlier, slope
                value = c[2 * _TERMS * _L + i] + t * value - before
                moved = value / slope if slope != 0.0 else 0.0
                c[_AT + i], c[_STEP + i] = min(max(t - moved, c[_LEFT + i]), c[_RIGHT_END + i]), abs(moved)
            largest = 0.0
            for i in range(_L):
                largest = max(largest, c[_STEP + i])
            if step > 1 and largest <= 1e-9:
                break
        for row in range(2):
            for i in range(_L):
                t = c[_AT + i]
                value, before, start = 0.0, 0.0, 0.0
                for k in range(ORDER, 0, -1):  # of T_k: (c[k-1] - c[k+1])/2k, and 2 c[0] for c[0]
                    term = (c[(row * _TERMS + k - 1) * _L + i] - c[(row * _TERMS + k + 1) * _L + i]) * (0.5 / k)
                    value, before = term + 2.0 * t * value - before, value
                    start = term - start
                c[_GAINED + row * _L + i] = t * value - before + start
        for i in range(min(number - first, _L)):
            r = first + i
            cell, lane = where[1, r], where[2, r]
            if c[_STEP + i] > 1e-5 and between[1, r] > between[0, r]:
                doubt[lane] = 1.0
            half = cellwise[cell, _HALF // _L, lane]
            between[2, r] = c[_AT + i]
            between[0, r] = cellwise[cell, _START // _L, lane] + half * c[_GAINED + i]
            between[1, r] = cellwise[cell, _START // _L + 1, lane] + half * c[_GAINED + _L + i]


@_compiled
def compared(
    series: Any, cellwise: Any, factors: Any, where: Any, between: Any, outcome: int, best: Any, doubt: Any, out: Any
) -> None:
    """The extremes of every function over edges and roots, and those of I*.

    `best` (functions, 2, 4, LANES) takes the greatest value and the negative least, cell, local abscissa and I* - I*(0).
    """
    number, work_at, variation_at, reached = series.shape[0], _STOP // _L, _STOP // _L + 1, np.zeros(_L)
    best[:] = 0.0  # at the first edge
    best[:, :, 2] = -1.0
    for function in range(5):
        of_work, factor = 0.0 if function == INERTIA else 1.0, factors[function]
        for k in range(2):
            e, sign = best[function, k], 1.0 - 2.0 * k
            for cell in range(number):
                place, t = (cell + 1.0, -1.0) if cell + 1 < number else (1.0 * cell, 1.0)
                for i in range(_L):
                    variation = cellwise[cell, variation_at, i]
                    value = sign * (of_work * cellwise[cell, work_at, i] + factor[i] * variation)
                    better = value > e[0, i]
                    e[0, i], e[1, i] = value if better else e[0, i], place if better else e[1, i]
                    e[2, i], e[3, i] = t if better else e[2, i], variation if better else e[3, i]
    for r in range(outcome):
        function, cell, i = where[0, r], where[1, r], where[2, r]
        value = factors[function, i] * between[1, r] + (0.0 if function == INERTIA else between[0, r])
        for k in range(2):
            if (1.0 - 2.0 * k) * value > best[function, k, 0, i]:
                best[function, k, 0, i], best[function, k, 1, i] = (1.0 - 2.0 * k) * value, cell
                best[function, k, 2, i], best[function, k, 3, i] = between[2, r], between[1, r]
        if function == INERTIA:
            inside, w = value_at(series, 2, cell, i, between[2, r]), cellwise[cell]
            w[_LOW // _L, i] = min(w[_LOW // _L, i], inside)
            w[_HIGH // _L, i] = max(w[_HIGH // _L, i], inside)
    out[_GREATEST:_LEAST], out[_LEAST:_APART] = best[:, 0, 0], 0.0 - best[:, 1, 0]
    for k, function in enumerate((WORK, FAST, TORQUE)):  # wherever in their cells the extremes lie
        out[_APART + k] = out[_WORK_ERROR] + np.abs(factors[function]) * out[_VARIATION]
    out[_APART + 1] += np.abs(factors[FAST] - factors[SLOW]) * out[_VARIATION]
    for k in range(2):  # where rounding alone tells several extremes apart, which is the first is in doubt
        function, sign = FAST + k, 1.0 - 2.0 * k
        out[_MOVING + k] = best[function, k, 3]
        enough = best[function, k, 0] - SAME * np.maximum(np.abs(best[function, 0, 0]), np.abs(best[function, 1, 0]))
        for i in range(_L):
            reached[i] = 1.0 if enough[i] <= 0.0 else 0.0  # at the first edge
        for cell in range(number):
            for i in range(_L):
                value = cellwise[cell, work_at, i] + factors[function, i] * cellwise[cell, variation_at, i]
                reached[i] += 1.0 if sign * value >= enough[i] else 0.0
        for r in range(outcome):
            i = where[2, r]
            if where[0, r] == function and sign * (between[0, r] + factors[function, i] * between[1, r]) >= enough[i]:
                reached[i] += 1.0
        for i in range(_L):
            doubt[i] = 1.0 if reached[i] > 1.0 else doubt[i]
    out[_EXTENT], out[_EXTENT + 1 : _MEAN_AT] = np.inf, -np.inf
    for cell in range(number):
        w = cellwise[cell]
        for i in range(_L):
            out[_EXTENT, i] = min(out[_EXTENT, i], w[_LOW // _L, i])
            out[_EXTENT + 1, i] = max(out[_EXTENT + 1, i], w[_HIGH // _L, i])
    for cell in range(number):
        w = cellwise[cell]
        for i in range(_L):
            error = w[_INERTIA // _L, i]
            out[_EXTENT + 2, i] = max(out[_EXTENT + 2, i], out[_EXTENT, i] - w[_LOW // _L, i] + error)
            out[_EXTENT + 3, i] = max(out[_EXTENT + 3, i], w[_HIGH // _L, i] - out[_EXTENT + 1, i] + error)


@_compiled
def value_at(series: Any, row: int, cell: int, i: int, t: float) -> Any:
    """A series at a local abscissa, by Clenshaw's recurrence."""
    b, after = 0.0, 0.0
    for k in range(ORDER - 1, 0, -1):
        b, after = series[cell, row, k, i] + 2.0 * t * b - after, b
    return series[cell, row, 0, i] + t * b - after


@_compiled
def slope_at(series: Any, row: int, cell: int, i: int, t: float) -> Any:
    """A series' derivative by the local abscissa, from T_k' = k U_(k-1)."""
    b, after = 0.0, 0.0
    for k in range(ORDER - 1, 0, -1):
        b, after = k * series[cell, row, k, i] + 2.0 * t * b - after, b
    return b


@_compiled
def placed(values: Any, edges: Any, series: Any, cellwise: Any, factors: Any, best: Any, doubt: Any, out: Any) -> None:
    """The angles of the fastest and the slowest point, with the error of the worse; see `batch.places`."""
    number, of_half, of_noise = series.shape[0], _HALF // _L, _NOISE // _L
    for i in range(_L):
        end = edges[number, i]
        own = out[_OF_NET, i] / end
        out[_ANGLE, i] = 4 * ROUNDING * end
        for k in range(2):
            cell, t, factor = int(best[FAST + k, k, 1, i]), best[FAST + k, k, 2, i], factors[FAST + k, i]
            w, size, error = cellwise[cell], abs(factor), 0.0
            half = w[of_half, i]
            edge = cell + (1 if t > 0.0 else 0)
            out[_FASTEST + k, i] = w[_MIDDLE // _L, i] + half * t if abs(t) < 1.0 else edges[edge, i]
            if abs(t) < ROOT_RANGE:
                slope = abs(slope_at(series, 0, cell, i, t) + factor * slope_at(series, 1, cell, i, t)) / half
                noise = w[of_noise, i] + size * w[of_noise + 1, i] + own
                noise += factors[5, i] * size * abs(value_at(series, 1, cell, i, t))
                error = min(noise / max(slope, 1e-300), 2 * half)
            if abs(t) >= ROOT_RANGE - 8 * ROUNDING * end / half:
                before, after = (edge - 1) % number, edge % number
                left = values[before, 0, _P - 1, i] + factor * values[before, 1, _P - 1, i]
                right = values[after, 0, 0, i] + factor * values[after, 1, 0, i]
                of_left = cellwise[before, of_noise, i] + size * cellwise[before, of_noise + 1, i] + own
                of_right = cellwise[after, of_noise, i] + size * cellwise[after, of_noise + 1, i] + own
                if not (abs(left) > of_left and abs(right) > of_right and (left > 0.0) != (right > 0.0)):
                    doubt[i] = 1.0
            out[_ANGLE, i] = max(out[_ANGLE, i], error + 4 * ROUNDING * end)


@_compiled
def cycles(values: Any, edges: Any, middle: Any, half: Any, factors: Any, unknown: bool, out: Any) -> None:
    """All sums of the cycles of groups of lanes, (groups, rows, LANES)."""
    number = half.shape[1]
    series, cellwise, sums_of = np.zeros((number, 3, ORDER, _L)), np.zeros((number, _CELL // _L, _L)), np.zeros(_CYCLE)
    folded, row, best, doubt = np.zeros(ORDER * _L), np.zeros(_P * _L), np.zeros((5, 2, 4, _L)), np.zeros(_L)
    where, between = np.zeros((3, _ROOTS), np.int64), np.zeros((3, _ROOTS))
    block = np.zeros(_BLOCK)
    for g in range(values.shape[0]):
        doubt[:] = 0.0
        cellwise[:, 0], cellwise[:, 1], cellwise[:, 2], cellwise[:, 3] = half[g], middle[g], edges[g, 1:], edges[g, number]
        balanced(values[g], cellwise, unknown, out[g])
        errors_of(values[g], series, cellwise, sums_of, folded, factors[g, 6], out[g])
        extremes = candidates(values[g], cellwise, factors[g], doubt, row, where, between)
        polished(series, cellwise, factors[g], where, between, extremes, doubt, block)
        compared(series, cellwise, factors[g], where, between, extremes, best, doubt, out[g])
        placed(values[g], edges[g], series, cellwise, factors[g], best, doubt, out[g])
        out[g, _DOUBT] = doubt


# -- chunks ----------------------------------------------------------------------------------------------------------------

_DOUBTFUL = 512  # designs that numpy sums up at a time
_BLOCK_CELLS = 48  # cells of a group of lanes that are filled before they are worked on: so much stays in the cache


def _grouped(count: int, *rows: Any) -> Array:
    """Rows of designs as (groups, rows, LANES); the last design fills up the last group."""
    full = np.empty((len(rows), -(-count // _L) * _L))
    for into, row in zip(full, rows, strict=True):
        into[:count] = row
    full[:, count:] = full[:, count - 1 : count]
    return np.ascontiguousarray(full.reshape(len(rows), -1, _L).swapaxes(0, 1))


def _filled(pieces: Pieces, columns: Array, edges: Array) -> tuple[tuple[Array, Array, Array], Callable[..., None]]:
    """Edges, middles and half widths of the cells of groups, and what fills an array with the values of some groups."""
    count = edges.shape[1]
    at = _grouped(count, *edges)
    half = 0.5 * (at[:, 1:] - at[:, :-1])
    middle = at[:, :-1] + half
    prepared = []
    for piece, program in pieces:
        of_design, places, function = filler(program)
        prepared.append((function, piece, _grouped(count, *of_design(*columns), 0.0), places))

    def fill(part: slice, values: Array) -> None:
        for function, piece, given, places in prepared:
            function(piece.start, piece.stop, middle[part], half[part], given[part], places, values)

    return (at, middle, half), fill


def sums(pieces: Pieces, givens: DesignValues, columns: Array, edges: Array) -> Sums:
    """The cycles of a chunk of designs, as `batch.sums`."""
    count = edges.shape[1]
    square, eps = givens.speed**2, givens.irregularity
    fast, slow = (-0.5 * (1 + sign * eps / 2) ** 2 * square for sign in (1, -1))
    factors = _grouped(count, 0.0, fast, slow, -0.5 * square, 1.0, givens.loose, givens.by_directions)
    (at, middle, half), fill = _filled(pieces, columns, edges)
    groups, number, _ = half.shape
    size = max(1, _BLOCK_CELLS // number)
    values, out = np.zeros((size, number, 6, _P, _L)), np.empty((groups, _DOUBT + 1, _L))
    for first in range(0, groups, size):
        part = slice(first, min(first + size, groups))
        block = values[: part.stop - first]
        fill(part, block)
        cycles(block, at[part], middle[part], half[part], factors[part], givens.unknown, out[part])
    rows = out.swapaxes(0, 1).reshape(_DOUBT + 1, -1)[:, :count]
    totals = Sums(*(rows[k] if end - k == 1 else rows[k:end] for k, end in pairwise(_ROWS)))
    doubtful = np.flatnonzero((rows[_DOUBT] != 0.0) | np.isnan(rows[_EXCHANGED] + rows[_LARGEST]))
    for few in np.split(doubtful, range(_DOUBTFUL, doubtful.size, _DOUBTFUL)) if doubtful.size else ():
        own = _sums_by_numpy(pieces, givens.of(few), columns[:, few], edges[:, few])
        for into, value in zip(totals, own, strict=True):
            into[..., few] = value
    return totals


def _sums_by_numpy(pieces: Pieces, givens: DesignValues, columns: Array, edges: Array) -> Sums:
    """The same by numpy, from values that machine code has computed where no angle is too great for its sine."""
    (_, middle, _), fill = _filled(pieces, columns, edges)
    groups, number, _ = middle.shape
    values = np.zeros((groups, number, 6, _P, _L))
    fill(slice(None), values)
    if np.isnan(values).any():
        return batch.sums(pieces, givens, columns, edges)
    rows = np.moveaxis(values, (2, 3), (0, 1)).swapaxes(2, 3).reshape(6, _P, number, -1)[..., : edges.shape[1]]
    return batch.summed_values(np.ascontiguousarray(rows), givens, edges)
