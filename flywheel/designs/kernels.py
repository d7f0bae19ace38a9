"""The cycles of many designs in machine code: the result of `batch.sums`, sixteen designs side by side in lanes.

Every loop runs over `LANES` designs innermost, so that a compiler makes one instruction of several designs. The program of a
smooth piece is split: the part that depends on the design alone is computed once, by numpy; the rest becomes straight-line
loops, interrupted only by function calls. Roots of all lanes are polished together. A design with a row that its nodes do
not resolve is left to `batch.sums`, which has the finer search.
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
from typing import Any, TypeVar

import numba
import numpy as np

from bondgraph.recording import Program, source
from flywheel.designs import batch
from flywheel.designs.batch import FAST, INERTIA, POINTS, SLOW, Pieces, Sums
from flywheel.machine.programs import DesignValues
from flywheel.numerics import cells
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, SAME, Array
from flywheel.regime.turning_moment import BY_ANGLES, INERTIA_ROUNDING, MOMENT_ROUNDING, SHIFT

LANES = 16
_L = LANES
_P = POINTS.size
_ROOTS = 48 * LANES  # of the five functions of all lanes; designs that have more are left to numpy
_FIT: Array = np.ascontiguousarray(cells.fit(np.eye(ORDER)).T)
_MEAN = np.ascontiguousarray(cells.MEAN)
_WEIGHTS = np.ascontiguousarray(_FIT.T @ _MEAN)
_HALF_ORDER = ORDER // 2
_LEAST_DIVISOR = 1e-300
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

(_START_AT, _BALANCE, _BY_UNKNOWN, _NET, _EXCHANGED, _WORK_ERROR, _VARIATION, _INERTIA_ERROR, _FIRST) = range(9)
_GREATEST, _LEAST, _FASTEST, _SLOWEST, _ANGLE, _MOVING, _EXTENT, _MEAN_AT, _LARGEST, _DOUBT = (
    9,
    14,
    19,
    20,
    21,
    22,
    24,
    28,
    30,
    31,
)
_TAIL = cells.TAIL_OF_INTEGRAL
_ROOT_RANGE = 1.0 - 1e-12
_TAIL_SHARE, _NO_EFFECT = 1e-6, 1e-9
_EPS = ROUNDING
# rows of LANES numbers that belong to one cell
(_HALF, _MIDDLE, _RIGHT, _END, _TAILS, _NOISE, _INERTIA, _LOW, _HIGH, _START, _STOP, _CELL) = (
    k * _L for k in (0, 1, 2, 3, 4, 7, 9, 10, 11, 12, 14, 16)
)
# and to the whole cycle: sums over cells, and the values at the last node
(_SHIFTED, _CUT, _SIZE, _WORST, _MOST, _AREA, _AREA_ERROR, _BEFORE, _SWING, _CYCLE) = (
    k * _L for k in (0, 2, 4, 6, 7, 8, 9, 10, 12, 14)
)


@_compiled
def balanced(values: Any, cellwise: Any, unknown: bool, out: Any) -> None:
    """The balance of the net work, and M* and its sizes with it."""
    for i in range(_L):
        out[_BALANCE, i] = 0.0
        out[_BY_UNKNOWN, i] = 0.0
        out[_WORK_ERROR, i] = 1.0  # first the factor by which a balance spreads errors, see `turning_moment.spread_of`
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
        out[_WORK_ERROR, i] = 0.5 * (1.0 + size[i] / abs(own[i])) if own[i] != 0.0 else np.inf
        out[_BALANCE, i] = -net[i] / own[i] + 0.0 if abs(own[i]) > _NO_EFFECT * size[i] else np.nan
        net[i] = out[_BALANCE, i]
    for cell in range(values.shape[0]):
        v = values[cell].reshape(-1)
        for node in range(1, ORDER + 1):
            for i in range(_L):
                added = net[i] * v[(5 * _P + node) * _L + i]
                v[node * _L + i] += added
                v[(3 * _P + node) * _L + i] += abs(added)


@_compiled
def fitted(v: Any, s: Any, folded: Any) -> None:
    """Series of M*, dI*/dphi and I* on one cell: even coefficients from sums of values at ±t, odd ones from differences."""
    for row in range(3):
        base, to = row * _P * _L, row * ORDER * _L
        for i in range(_L):
            for node in range(_HALF_ORDER):
                left, right = v[base + (node + 1) * _L + i], v[base + (ORDER - node) * _L + i]
                folded[node * _L + i] = left + right
                folded[(_HALF_ORDER + 1 + node) * _L + i] = left - right
            folded[_HALF_ORDER * _L + i] = v[base + (_HALF_ORDER + 1) * _L + i]
        for k in range(0, ORDER, 2):
            for i in range(_L):
                even = 0.0
                for node in range(_HALF_ORDER + 1):
                    even += _FIT[k, node] * folded[node * _L + i]
                s[to + k * _L + i] = even
        for k in range(1, ORDER, 2):
            for i in range(_L):
                odd = 0.0
                for node in range(_HALF_ORDER):
                    odd += _FIT[k, node] * folded[(_HALF_ORDER + 1 + node) * _L + i]
                s[to + k * _L + i] = odd


@_compiled
def at_ends(v: Any, s: Any, w: Any) -> None:
    """M* and dI*/dphi at the ends of a cell, and I* there."""
    for i in range(_L):
        for row in range(2):
            even, odd = 0.0, 0.0
            for k in range(ORDER // 2):
                even += s[(row * ORDER + 2 * k) * _L + i]
                odd += s[(row * ORDER + 2 * k + 1) * _L + i]
            even += s[(row * ORDER + ORDER - 1) * _L + i]
            v[row * _P * _L + i] = even - odd
            v[(row * _P + _P - 1) * _L + i] = even + odd
    for i in range(_L):
        even, odd = 0.0, 0.0
        for k in range(ORDER // 2):
            even += s[(2 * ORDER + 2 * k) * _L + i]
            odd += s[(2 * ORDER + 2 * k + 1) * _L + i]
        even += s[(2 * ORDER + ORDER - 1) * _L + i]
        w[_LOW + i] = even - odd
        w[_HIGH + i] = even + odd


@_compiled
def cut_off(s: Any, w: Any) -> None:
    """The errors of the interpolants, as in `cells.tail`."""
    for row in range(3):
        base = row * ORDER + ORDER - 6
        for i in range(_L):
            first = max(abs(s[base * _L + i]), abs(s[(base + 1) * _L + i]))
            middle = max(abs(s[(base + 2) * _L + i]), abs(s[(base + 3) * _L + i]))
            last = max(abs(s[(base + 4) * _L + i]), abs(s[(base + 5) * _L + i]))
            decay = min(max(last / max(middle, _LEAST_DIVISOR), middle / max(first, _LEAST_DIVISOR)), 0.9)
            w[_TAILS + row * _L + i] = max(10.0 * decay * max(last, middle * decay) / (1.0 - decay), last)


@_compiled
def summed(v: Any, s: Any, w: Any, c: Any, first: bool) -> None:
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
            w[_NOISE + own + i] = _EPS * w[_RIGHT + i] * steep / w[_HALF + i] + w[_TAILS + own + i]
        for i in range(_L):
            most, total = 0.0, 0.0
            for node in range(ORDER):
                value = v[(size + node + 1) * _L + i]
                most = max(most, value)
                total += _WEIGHTS[node] * value
            w[_NOISE + own + i] += 32 * _EPS * most
            c[_SIZE + own + i] += total * w[_HALF + i]
            c[_CUT + own + i] += _TAIL * w[_TAILS + own + i] * w[_HALF + i]
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
        error = w[_TAILS + 2 * _L + i] + INERTIA_ROUNDING * most + 2 * _EPS * w[_END + i] * steep
        w[_INERTIA + i] = error
        c[_WORST + i] = max(c[_WORST + i], error)
        c[_MOST + i] = max(c[_MOST + i], largest)
        c[_AREA + i] += mean * w[_HALF + i]
        c[_AREA_ERROR + i] += _TAIL * error * w[_HALF + i]


@_compiled
def errors_of(values: Any, series: Any, cellwise: Any, c: Any, folded: Any, unknown: bool, out: Any) -> None:
    """Series, accumulated values and every error of a cycle."""
    number = values.shape[0]
    c[:] = 0.0
    for cell in range(number):
        v, s, w = values[cell].reshape(-1), series[cell].reshape(-1), cellwise[cell].reshape(-1)
        for i in range(2 * _L):
            w[_START + i] = 0.0 if cell == 0 else cellwise[cell - 1, _STOP // _L + i // _L, i % _L]
        fitted(v, s, folded)
        at_ends(v, s, w)
        cut_off(s, w)
        summed(v, s, w, c, cell == 0)
    for i in range(_L):
        end = cellwise[0, _END // _L, i]
        out[_START_AT, i] = cellwise[0, _LOW // _L, i]
        out[_FIRST, i] = cellwise[0, _INERTIA // _L, i]
        out[_NET, i] = cellwise[number - 1, _STOP // _L, i]
        out[_EXCHANGED, i] = c[_SIZE + i]
        angle = BY_ANGLES * math.sqrt(c[_SHIFTED + i]) + SHIFT * c[_SWING + i]
        turn = BY_ANGLES * math.sqrt(c[_SHIFTED + _L + i]) + SHIFT * c[_SWING + _L + i]
        out[_WORK_ERROR, i] *= c[_CUT + i] + MOMENT_ROUNDING * c[_SIZE + i] + angle
        out[_VARIATION, i] = c[_CUT + _L + i] + MOMENT_ROUNDING * c[_SIZE + _L + i] + turn
        out[_INERTIA_ERROR, i] = c[_WORST + i]
        out[_LARGEST, i] = c[_MOST + i]
        out[_MEAN_AT, i] = c[_AREA + i] / end
        out[_MEAN_AT + 1, i] = c[_AREA_ERROR + i] / end
    for cell in range(number):
        w = cellwise[cell].reshape(-1)
        for i in range(_L):
            left, right = w[_LOW + i], w[_HIGH + i]
            w[_LOW + i], w[_HIGH + i] = min(left, right), max(left, right)


@_compiled
def candidates(values: Any, cellwise: Any, factors: Any, doubt: Any, row: Any, where: Any, between: Any) -> int:
    """Gaps of the points between which a function changes its sign, for all lanes; see `batch._roots`.

    `where` takes function, cell and lane, `between` the gap's ends and the secant's root. Doubtful ones are marked.
    """
    number, most = 0, where.shape[1]
    low, high = np.zeros(_L), np.zeros(_L)
    for function in range(5):
        of_work, factor = 0.0 if function == INERTIA else 1.0, factors[function]
        for cell in range(values.shape[0]):
            v, w = values[cell].reshape(-1), cellwise[cell].reshape(-1)
            for point in range(_P):
                for i in range(_L):
                    row[point * _L + i] = of_work * v[point * _L + i] + factor[i] * v[(_P + point) * _L + i]
            for i in range(_L):
                low[i] = high[i] = row[i]
            for point in range(1, _P):
                for i in range(_L):
                    value = row[point * _L + i]
                    low[i] = value if value < low[i] else low[i]
                    high[i] = value if value > high[i] else high[i]
            for i in range(_L):
                size = abs(factor[i])
                level = of_work * w[_NOISE + i] + size * w[_NOISE + _L + i]
                far = max(-low[i], high[i])
                near = low[i] if low[i] > 0.0 else -high[i] if high[i] < 0.0 else 0.0
                if of_work * w[_TAILS + i] + size * w[_TAILS + _L + i] > _TAIL_SHARE * far:
                    doubt[i] = 1.0
                elif near <= 0.5 * (far - near) or near <= level:
                    number = _gaps(row, i, level, function, cell, number, most, doubt, where, between)
    return number


@_compiled
def _gaps(
    row: Any, i: int, level: float, function: int, cell: int, number: int, most: int, doubt: Any, where: Any, between: Any
) -> int:
    """The changes of sign of one row of one lane."""
    first, last = 1, _P - 2  # points that may be the lowest of a dip
    if abs(row[i]) <= level:  # an end that is no more than noise is an extreme's place as it is
        row[i] = row[_L + i]
        first = 2
    if abs(row[(_P - 1) * _L + i]) <= level:
        row[(_P - 1) * _L + i] = row[(_P - 2) * _L + i]
        last = _P - 3
    for point in range(_P - 1):
        here, after = row[point * _L + i], row[(point + 1) * _L + i]
        if point > 0:
            before, size = row[(point - 1) * _L + i], abs(here)
            same = (before > 0.0) == (here > 0.0) and (after > 0.0) == (here > 0.0)
            lowest = same and size <= abs(before) and size <= abs(after) and first <= point <= last
            if size <= level or (lowest and size < 0.5 * (max(abs(before), abs(after)) - size)):
                doubt[i] = 1.0
                return number
        if (here > 0.0) != (after > 0.0):
            if number == most:
                doubt[i] = 1.0
                return number
            where[0, number], where[1, number], where[2, number] = function, cell, i
            left, right = POINTS[point], POINTS[point + 1]
            between[0, number], between[1, number] = left, right
            between[2, number] = left + (right - left) * here / (here - after)
            number += 1
    return number


@_compiled
def polished(series: Any, factors: Any, where: Any, between: Any, number: int, doubt: Any, rows: Any, state: Any) -> None:
    """Newton's method towards all roots at once, kept in their gaps; one that does not converge is doubtful.

    `rows` (3 * ORDER roots) holds the series of M*, of dI*/dphi, and the function's; `state` intermediate rows.
    """
    for r in range(number):
        function, cell, i = where[0, r], where[1, r], where[2, r]
        of_work, factor = 0.0 if function == INERTIA else 1.0, factors[function, i]
        for k in range(ORDER):
            moment, slope = series[cell, 0, k, i], series[cell, 1, k, i]
            rows[k * _ROOTS + r] = moment
            rows[(ORDER + k) * _ROOTS + r] = slope
            rows[(2 * ORDER + k) * _ROOTS + r] = of_work * moment + factor * slope
    for step in range(5):
        # values by Clenshaw's recurrence, slopes by the one of the second kind: T_k' = k U_(k-1)
        for r in range(number):
            t = between[2, r]
            value, before, slope, earlier = 0.0, 0.0, 0.0, 0.0
            for k in range(ORDER - 1, 0, -1):
                c = rows[(2 * ORDER + k) * _ROOTS + r]
                value, before = c + 2.0 * t * value - before, value
                slope, earlier = k * c + 2.0 * t * slope - earlier, slope
            value = rows[2 * ORDER * _ROOTS + r] + t * value - before
            state[r] = value / slope if slope != 0.0 else 0.0
        largest = 0.0
        for r in range(number):
            between[2, r] = min(max(between[2, r] - state[r], between[0, r]), between[1, r])
            largest = max(largest, abs(state[r]))
        if step > 1 and largest <= 1e-9:
            break
    for r in range(number):
        if abs(state[r]) > 1e-5 and between[1, r] > between[0, r]:
            doubt[where[2, r]] = 1.0


@_compiled
def accumulated(cellwise: Any, where: Any, between: Any, number: int, rows: Any, state: Any) -> None:
    """W and I* - I*(0) at all roots, from the series of M* and dI*/dphi integrated: into the first rows of `state`."""
    for which in range(2):
        base = which * ORDER
        for r in range(number):
            t = between[2, r]
            value, before, start = 0.0, 0.0, 0.0
            for k in range(ORDER, 0, -1):  # of T_k: (c[k-1] - c[k+1])/2k, and 2 c[0] for c[0]
                c = (2.0 if k == 1 else 1.0) * rows[(base + k - 1) * _ROOTS + r]
                c = (c - (rows[(base + k + 1) * _ROOTS + r] if k + 1 < ORDER else 0.0)) * (0.5 / k)
                value, before = c + 2.0 * t * value - before, value
                start += c if k % 2 == 0 else -c
            state[which * _ROOTS + r] = t * value - before - start
    for r in range(number):
        cell, i = where[1, r], where[2, r]
        half = cellwise[cell, _HALF // _L, i]
        state[r] = cellwise[cell, _START // _L, i] + half * state[r]
        state[_ROOTS + r] = cellwise[cell, _START // _L + 1, i] + half * state[_ROOTS + r]


@_compiled
def compared(
    series: Any,
    cellwise: Any,
    factors: Any,
    where: Any,
    between: Any,
    outcome: int,
    state: Any,
    places: Any,
    doubt: Any,
    out: Any,
) -> None:
    """The extremes of every function over edges and roots, the places of the fastest and the slowest point, those of I*."""
    number = series.shape[0]
    for function in range(5):
        of_work = 0.0 if function == INERTIA else 1.0
        for i in range(_L):
            out[_GREATEST + function, i], out[_LEAST + function, i] = 0.0, 0.0  # at the first edge
        for k in range(2):
            if function == FAST + k:
                for i in range(_L):
                    places[k, i], places[k + 2, i], out[_MOVING + k, i] = 0.0, -1.0, 0.0
        for cell in range(number):
            for i in range(_L):
                value = of_work * cellwise[cell, _STOP // _L, i] + factors[function, i] * cellwise[cell, _STOP // _L + 1, i]
                place, t = (cell + 1, -1.0) if cell + 1 < number else (cell, 1.0)
                if value > out[_GREATEST + function, i]:
                    out[_GREATEST + function, i] = value
                    if function == FAST:
                        places[0, i], places[2, i], out[_MOVING, i] = place, t, cellwise[cell, _STOP // _L + 1, i]
                if value < out[_LEAST + function, i]:
                    out[_LEAST + function, i] = value
                    if function == SLOW:
                        places[1, i], places[3, i], out[_MOVING + 1, i] = place, t, cellwise[cell, _STOP // _L + 1, i]
    for r in range(outcome):
        function, cell, i = where[0, r], where[1, r], where[2, r]
        value = factors[function, i] * state[_ROOTS + r] + (0.0 if function == INERTIA else state[r])
        if value > out[_GREATEST + function, i]:
            out[_GREATEST + function, i] = value
            if function == FAST:
                places[0, i], places[2, i], out[_MOVING, i] = cell, between[2, r], state[_ROOTS + r]
        if value < out[_LEAST + function, i]:
            out[_LEAST + function, i] = value
            if function == SLOW:
                places[1, i], places[3, i], out[_MOVING + 1, i] = cell, between[2, r], state[_ROOTS + r]
        if function == INERTIA:
            inside, w = value_at(series, 2, cell, i, between[2, r]), cellwise[cell]
            w[_LOW // _L, i] = min(w[_LOW // _L, i], inside)
            w[_HIGH // _L, i] = max(w[_HIGH // _L, i], inside)
    enough, reached = np.zeros(_L), np.zeros(_L)
    for k in range(2):  # where rounding alone tells several extremes apart, which is the first is in doubt
        function, sign = FAST + k, 1.0 - 2.0 * k
        for i in range(_L):
            greatest, least = out[_GREATEST + function, i], out[_LEAST + function, i]
            enough[i] = (greatest if k == 0 else -least) - SAME * max(abs(greatest), abs(least))
            reached[i] = 1.0 if enough[i] <= 0.0 else 0.0  # at the first edge
        for cell in range(number):
            for i in range(_L):
                value = cellwise[cell, _STOP // _L, i] + factors[function, i] * cellwise[cell, _STOP // _L + 1, i]
                reached[i] += 1.0 if sign * value >= enough[i] else 0.0
        for r in range(outcome):
            i = where[2, r]
            if where[0, r] == function and sign * (state[r] + factors[function, i] * state[_ROOTS + r]) >= enough[i]:
                reached[i] += 1.0
        for i in range(_L):
            if reached[i] > 1.0:
                doubt[i] = 1.0
    for i in range(_L):
        out[_EXTENT, i], out[_EXTENT + 1, i] = np.inf, -np.inf
        out[_EXTENT + 2, i], out[_EXTENT + 3, i] = -np.inf, -np.inf
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
def placed(values: Any, series: Any, cellwise: Any, factors: Any, places: Any, doubt: Any, out: Any) -> None:
    """The angles of the fastest and the slowest point, with the error of the worse; see `batch.places`."""
    number, of_half, of_noise = series.shape[0], _HALF // _L, _NOISE // _L
    for i in range(_L):
        end = cellwise[0, _END // _L, i]
        own = out[_WORK_ERROR, i] / end
        out[_ANGLE, i] = 4 * _EPS * end
        for k in range(2):
            cell, t, factor = int(places[k, i]), places[k + 2, i], factors[FAST + k, i]
            w, size, error = cellwise[cell], abs(factor), 0.0
            half = w[of_half, i]
            edge = cell + (1 if t > 0.0 else 0)
            if abs(t) < 1.0:
                out[_FASTEST + k, i] = w[_MIDDLE // _L, i] + half * t
            else:
                out[_FASTEST + k, i] = 0.0 if edge == 0 else cellwise[edge - 1, _RIGHT // _L, i]
            if abs(t) < _ROOT_RANGE:
                slope = abs(slope_at(series, 0, cell, i, t) + factor * slope_at(series, 1, cell, i, t)) / half
                noise = w[of_noise, i] + size * w[of_noise + 1, i] + own
                noise += factors[5, i] * size * abs(value_at(series, 1, cell, i, t))
                error = min(noise / max(slope, _LEAST_DIVISOR), 2 * half)
            if abs(t) >= _ROOT_RANGE - 8 * _EPS * end / half:
                before, after = (edge - 1) % number, edge % number
                left = values[before, 0, _P - 1, i] + factor * values[before, 1, _P - 1, i]
                right = values[after, 0, 0, i] + factor * values[after, 1, 0, i]
                of_left = cellwise[before, of_noise, i] + size * cellwise[before, of_noise + 1, i] + own
                of_right = cellwise[after, of_noise, i] + size * cellwise[after, of_noise + 1, i] + own
                if not (abs(left) > of_left and abs(right) > of_right and (left > 0.0) != (right > 0.0)):
                    doubt[i] = 1.0
            out[_ANGLE, i] = max(out[_ANGLE, i], error + 4 * _EPS * end)


@_compiled
def cycles(values: Any, edges: Any, middle: Any, half: Any, factors: Any, unknown: bool, out: Any) -> None:
    """All sums of the cycles of groups of lanes, (groups, rows, LANES)."""
    number = half.shape[1]
    series, cellwise, sums_of = np.zeros((number, 3, ORDER, _L)), np.zeros((number, _CELL // _L, _L)), np.zeros(_CYCLE)
    folded, row, places, doubt = np.zeros(ORDER * _L), np.zeros(_P * _L), np.zeros((4, _L)), np.zeros(_L)
    where, between = np.zeros((3, _ROOTS), np.int64), np.zeros((3, _ROOTS))
    rows, state = np.zeros(3 * ORDER * _ROOTS), np.zeros(2 * _ROOTS)
    for g in range(values.shape[0]):
        doubt[:] = 0.0
        for cell in range(number):
            for i in range(_L):
                cellwise[cell, _HALF // _L, i] = half[g, cell, i]
                cellwise[cell, _MIDDLE // _L, i] = middle[g, cell, i]
                cellwise[cell, _RIGHT // _L, i] = edges[g, cell + 1, i]
                cellwise[cell, _END // _L, i] = edges[g, number, i]
        balanced(values[g], cellwise, unknown, out[g])
        errors_of(values[g], series, cellwise, sums_of, folded, unknown, out[g])
        extremes = candidates(values[g], cellwise, factors[g], doubt, row, where, between)
        polished(series, factors[g], where, between, extremes, doubt, rows, state)
        accumulated(cellwise, where, between, extremes, rows, state)
        compared(series, cellwise, factors[g], where, between, extremes, state, places, doubt, out[g])
        placed(values[g], series, cellwise, factors[g], places, doubt, out[g])
        for i in range(_L):
            out[g, _DOUBT, i] = doubt[i]


# -- chunks ----------------------------------------------------------------------------------------------------------------

_BLOCK_CELLS = 48  # cells of a group of lanes that are filled before they are worked on: so much stays in the cache


def sums(pieces: Pieces, givens: DesignValues, columns: Array, edges: Array) -> Sums:
    """The cycles of a chunk of designs, as `batch.sums`."""
    count = edges.shape[1]
    groups = -(-count // _L)

    def grouped(*rows: Any) -> Array:
        """Rows of designs as (groups, rows, LANES); the last design fills up the last group."""
        full = np.empty((len(rows), groups * _L))
        for into, row in zip(full, rows, strict=True):
            into[:count] = row
        full[:, count:] = full[:, count - 1 : count]
        return np.ascontiguousarray(full.reshape(len(rows), groups, _L).swapaxes(0, 1))

    square, eps = givens.speed**2, givens.irregularity
    fast, slow = (-0.5 * (1 + sign * eps / 2) ** 2 * square for sign in (1, -1))
    factors = grouped(0.0, fast, slow, -0.5 * square, 1.0, givens.loose)
    at = grouped(*edges)
    half = 0.5 * (at[:, 1:] - at[:, :-1])
    middle = at[:, :-1] + half
    prepared = []
    for piece, program in pieces:
        of_design, places, fill = filler(program)
        prepared.append((fill, piece, grouped(*of_design(*columns), 0.0), places))
    size = max(1, _BLOCK_CELLS // half.shape[1])
    values, out = np.zeros((size, half.shape[1], 6, _P, _L)), np.empty((groups, _DOUBT + 1, _L))
    for first in range(0, groups, size):
        part = slice(first, min(first + size, groups))
        block = values[: part.stop - first]
        for fill, piece, given, places in prepared:
            fill(piece.start, piece.stop, middle[part], half[part], given[part], places, block)
        cycles(block, at[part], middle[part], half[part], factors[part], givens.unknown, out[part])
    rows = out.swapaxes(0, 1).reshape(_DOUBT + 1, -1)[:, :count]
    totals = Sums(
        **dict(zip(Sums._fields, rows[:9], strict=False)),
        greatest=rows[_GREATEST:_LEAST],
        least=rows[_LEAST:_FASTEST],
        fastest=rows[_FASTEST],
        slowest=rows[_SLOWEST],
        angle=rows[_ANGLE],
        moving=rows[_MOVING:_EXTENT],
        extent=rows[_EXTENT:_MEAN_AT],
        mean=rows[_MEAN_AT:_LARGEST],
        largest=rows[_LARGEST],
    )
    doubtful = np.flatnonzero((rows[_DOUBT] != 0.0) | np.isnan(rows[_EXCHANGED] + rows[_LARGEST]))
    if doubtful.size:
        own = givens.of(doubtful)
        for into, value in zip(totals, batch.sums(pieces, own, columns[:, doubtful], edges[:, doubtful]), strict=True):
            into[..., doubtful] = value
    return totals
