"""Recording of arithmetic as straight-line programs: computation with recorded numbers, operation by operation.

A walk over a graph does the same arithmetic at every state. Done once with numbers of a `Recorder`, it leaves a tape of
operations behind, each one once. From the tape comes a `Program`: operations, the places of constants, the names of inputs,
and nothing else. It runs over plain numbers, arrays of positions and of designs, numba's machine code, and any other numbers
with the same functions (intervals, jets, many digits).

An input with a value is a parameter: comparisons are answered by the value, and stand on the tape as guards, so that the
record holds for all parameters that keep them. An input without a value is a variable: a comparison of it is an operation
like any other, and a branch on its result fails. An operation that would lose the record fails too.

Source: A. Griewank, A. Walther, Evaluating Derivatives, 2nd ed., SIAM 2008, chapter 2 (evaluation traces).
"""

from __future__ import annotations

import math
import operator
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache, reduce
from itertools import accumulate, combinations
from numbers import Real
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import SHORT, Operand

__all__ = ["LOST", "NAMESPACE", "Complex", "Conditions", "Program", "Recorded", "Recorder", "solved", "source"]

_SYMBOLS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}
_COMPARISONS = {
    "less": ("<", operator.lt),
    "less_equal": ("<=", operator.le),
    "greater": (">", operator.gt),
    "greater_equal": (">=", operator.ge),
    "equal": ("==", operator.eq),
    "not_equal": ("!=", operator.ne),
}
_MIRRORED = {"greater": "less", "greater_equal": "less_equal"}
_LOGIC = ("logical_and", "logical_or", "logical_not")
_MATH = (  # functions that the math module has under this name
    *("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "acosh", "exp", "log", "sinh", "cosh", "tanh", "hypot"),
    *("log1p", "expm1", "floor", "ceil"),
)
_BY_NUMPY = SHORT | {"arccosh": "acosh", "absolute": "abs", "fabs": "abs", "positive": "add", "float_power": "power"}
_BY_NUMPY |= {"bitwise_and": "logical_and", "bitwise_or": "logical_or", "invert": "logical_not"}
_NUMPY = {name: name for name in (*_SYMBOLS, *_COMPARISONS, *_LOGIC, *_MATH)}
_NUMPY |= {name: name for name in ("power", "negative", "abs", "sign", "minimum", "maximum", "where")}
LOST = "a recorded number has no plain value here: results computed with it would be missing from the record"


class Recorder:
    """The tape: records all operations on its inputs.

    >>> recorder = Recorder()
    >>> r, phi = recorder.input("r", 0.5), recorder.input("phi")
    >>> x = r * NAMESPACE.cos(phi) if r > 0.0 else 0.0 * phi
    >>> program = recorder.program([x, x * x + 1.0])
    >>> program.function("math")(0.5, 0.0), program.operations
    ((0.5, 1.25), (('cos', 1), ('multiply', 0, 3), ('multiply', 4, 4), ('add', 5, 2)))
    >>> recorder.conditions().kept(np.array([1.0, -1.0]), 0.0).tolist()
    [True, False]
    """

    def __init__(self, *, exact: bool = False) -> None:
        self.exact = exact  # the inputs stand for numbers without rounding: what is solved for stays a call
        self.inputs: list[Recorded] = []
        self.guards: list[tuple[Recorded, str, bool]] = []  # difference, less, less_equal or equal to 0, whether it holds
        self._names: list[str] = []
        self._tape: list[tuple[Any, ...]] = []  # of every node: operation and operands; ("input", k); ("place", value)
        self._nodes: dict[tuple[Any, ...], Recorded] = {}
        self._guarded: set[tuple[int, str]] = set()
        self.solved: dict[Any, Any] = {}  # functions that stay calls, each once

    def input(self, name: str, value: float | None = None) -> Recorded:
        """A number still to come: a parameter with the value that it has now, or a variable."""
        self._names.append(name)
        node = self._node(("input", len(self.inputs)), None if value is None else float(value))
        self.inputs.append(node)
        return node

    def operation(self, name: str, operands: Sequence[Any]) -> Any:
        """The result of an operation; the same one twice is one node, and one that has no effect is left out."""
        short = _SHORTER.get(name)
        shorter = NotImplemented if short is None else short(*operands)
        if shorter is not NotImplemented:
            return shorter
        numbers, values = [], []
        for operand in operands:
            node = operand if type(operand) is Recorded and operand.recorder is self else self.node(operand)
            numbers.append(node.number)
            if node.value is not None:
                values.append(node.value)
        key = (name, *numbers)
        earlier = self._nodes.get(key)
        if earlier is not None:
            return earlier
        value = None
        if len(values) == len(numbers):
            try:
                value = _OF_PLAIN[name](*values)
            except (ValueError, ArithmeticError):  # infinite or NaN if it is not defined
                with np.errstate(all="ignore"):
                    value = float(getattr(np, _NUMPY[name])(*values))
        return self._node(key, value)

    def compared(self, name: str, left: Any, right: Any) -> Any:
        """A comparison: of parameters its answer, on record as a guard; of variables a recorded truth value."""
        a, b = self.node(left), self.node(right)
        if a.value is None or b.value is None:
            return self.operation(name, (left, right))
        answer: bool = _COMPARISONS[name][1](a.value, b.value)
        relation, turned = _MIRRORED.get(name, name), name in _MIRRORED
        difference = self.operation("subtract", (right, left) if turned else (left, right))
        if isinstance(difference, Recorded):
            relation, holds = ("equal", not answer) if relation == "not_equal" else (relation, answer)
            if (difference.number, relation) not in self._guarded:
                self._guarded.add((difference.number, relation))
                self.guards.append((difference, relation, holds))
        return answer

    def program(self, outputs: Iterable[Any], inputs: Sequence[Recorded] | None = None) -> Program:
        """The part of the tape that leads from the inputs to the outputs (recorded or plain numbers).

        inputs: the arguments, in turn; all there are where none are given. A TypeError where others are needed too.
        """
        numbers = [self.node(output).number for output in outputs]
        live, todo = set(numbers), list(numbers)
        while todo:
            entry = self._tape[todo.pop()]
            if entry[0] not in ("input", "place"):
                fresh = [n for n in entry[1:] if n not in live]
                live.update(fresh)
                todo += fresh
        ordered = sorted(live)
        places = [n for n in ordered if self._tape[n][0] == "place"]
        taken = self.inputs if inputs is None else inputs
        new = {node.number: k for k, node in enumerate(taken)}
        new |= {n: len(new) + k for k, n in enumerate(places)}
        operations = []
        for n in ordered:
            if n not in new:
                new[n] = len(new)
                name, *operands = self._tape[n]
                if name == "input":
                    raise TypeError(f"the outputs need {self._names[operands[0]]}, which is not among the inputs")
                operations.append((name, *[new[m] for m in operands]))
        values, names = tuple(self._tape[n][1] for n in places), tuple(self._names[self._tape[n.number][1]] for n in taken)
        return Program(names, values, tuple(operations), tuple(new[n] for n in numbers))

    def tabulated(self, at: Recorded, knots: Sequence[float], columns: Sequence[Sequence[float]]) -> list[Any]:
        """The entries of columns in the interval of `at` between ascending knots; one entry more than there are knots."""
        interval = self.operation("interval", (at, tuple(knots)))
        rows = [tuple(column) for column in columns]
        return [row[0] if row.count(row[0]) == len(row) else self.operation("entry", (row, interval)) for row in rows]

    def call(
        self, function: Callable[..., Any], arguments: Sequence[Any], results: int = 0, values: Sequence[Any] | None = None
    ) -> Any:
        """A call that stays a call: one number (results = 0), or all entries of its tuple, with their present values."""
        node = self._kept(("call", *[self.node(value).number for value in (function, *arguments)]))
        if not results:
            return node
        entries = [("entry", node.number, self._place(("index", k), k).number) for k in range(results)]
        return [self._kept(*entry) for entry in zip(entries, values or [None] * results, strict=True)]

    def through(self, function: Callable[..., Any], arguments: Sequence[Any], results: int = 0) -> Any:
        """The result of a function of recorded numbers, operation by operation; a call where that cannot be recorded.

        It also stays a call if it chooses between values, because the others may be undefined.
        """
        before = len(self._tape)
        try:
            outcome = function(*arguments)
            entries = outcome if results else (outcome,)
            plain = all(isinstance(entry, Recorded | float | int) for entry in entries) and len(entries) == (results or 1)
            if plain and not any(entry[0] == "where" for entry in self._tape[before:]):
                return outcome
        except Exception:  # whatever it is that a function does with a number still to come
            pass
        del self._tape[before:]
        self._nodes = {key: node for key, node in self._nodes.items() if node.number < before}
        return self.call(function, arguments, results)

    def conditions(self, inputs: Sequence[Recorded] | None = None) -> Conditions:
        """The guards so far, for any parameters: a function of these inputs (of all by default)."""
        program = self.program((difference for difference, _, _ in self.guards), inputs)
        return Conditions(
            program, tuple(relation for _, relation, _ in self.guards), tuple(holds for *_, holds in self.guards)
        )

    def node(self, value: Any) -> Recorded:
        """The node of a recorded number, or of a constant: places are distinguished by the bits of their values."""
        if isinstance(value, Recorded):
            if value.recorder is not self:
                raise TypeError("numbers of two recordings do not mix")
            return value
        if type(value) is tuple:
            return self._place(value, value)
        if callable(value):
            return self._place(("function", id(value)), value)
        plain = value if type(value) is bool else float(value)
        return self._place((plain, math.copysign(1.0, plain), type(plain)), plain)

    def _place(self, keys: tuple[Any, ...], value: Any) -> Recorded:
        key = ("place", keys)
        earlier = self._nodes.get(key)
        if earlier is None:
            earlier = self._nodes[key] = Recorded(self, len(self._tape), value)
            self._tape.append(("place", value))
        return earlier

    def _kept(self, key: tuple[Any, ...], value: Any = None) -> Recorded:
        """The node of an operation, made if it does not exist yet."""
        earlier = self._nodes.get(key)
        return self._node(key, value) if earlier is None else earlier

    def _node(self, key: tuple[Any, ...], value: Any) -> Recorded:
        node = self._nodes[key] = Recorded(self, len(self._tape), value)
        self._tape.append(key)
        return node


class Recorded(Operand):
    """A number on a tape; its present value, where it depends on parameters alone (None if it depends on variables)."""

    __slots__ = ("number", "recorder", "value")
    is_recorded = True  # for those that know it by this name alone

    def __init__(self, recorder: Recorder, number: int, value: Any) -> None:
        self.recorder, self.number, self.value = recorder, number, value

    def __repr__(self) -> str:
        return f"Recorded({self.recorder._tape[self.number][0]}, {self.value})"

    def _apply(self, name: str, operands: tuple[Any, ...]) -> Any:
        name = _BY_NUMPY.get(name, name)
        for operand in operands:
            if not isinstance(operand, _PLAIN):
                if isinstance(operand, np.ndarray):
                    return _over_arrays(name, operands)
                if isinstance(operand, complex) and name in _SYMBOLS:
                    a, b = (o if isinstance(o, Complex) else Complex(o.real, o.imag) for o in operands)
                    return _OF_PLAIN[name](a, b)
                return NotImplemented
        if name in _COMPARISONS:
            return self.recorder.compared(name, *operands)
        if name in _NUMPY:
            return self.recorder.operation(name, operands)
        if name in _ARRAY_FUNCTIONS:
            return _ARRAY_FUNCTIONS[name](*operands)
        raise TypeError(f"numpy.{name} cannot be recorded")

    def __array_function__(self, function: Any, types: Any, operands: Any, kwargs: Any) -> Any:
        name = function.__name__
        if name in _ARRAY_FUNCTIONS:
            return _ARRAY_FUNCTIONS[name](*operands, **kwargs)
        return super().__array_function__(function, types, operands, kwargs)

    @property
    def real(self) -> Recorded:
        """Itself."""
        return self

    @property
    def imag(self) -> float:
        """The imaginary part, which is 0."""
        return 0.0

    def __format__(self, form: str) -> str:  # in texts it stands for what it is now
        return repr(self) if self.value is None else format(self.value, form)

    def __bool__(self) -> bool:
        if self.value is None:
            raise TypeError("a recording cannot branch on a value that is not known yet")
        return bool(self.recorder.compared("not_equal", self, 0.0))

    def __float__(self) -> float:
        raise TypeError(LOST)

    def __hash__(self) -> int:  # type: ignore[override]  # as that of floats: equal numbers meet, and leave a guard
        return hash((id(self.recorder), self.number)) if self.value is None else hash(self.value)

    def __floordiv__(self, other: Any) -> Any:
        return NAMESPACE.floor(self / other)

    def __rfloordiv__(self, other: Any) -> Any:
        return NAMESPACE.floor(other / self)

    def __mod__(self, other: Any) -> Any:
        return self - other * NAMESPACE.floor(self / other)

    def __rmod__(self, other: Any) -> Any:
        return other - self * NAMESPACE.floor(other / self)

    def is_integer(self) -> bool:
        """True for a whole number, as of a float."""
        return bool(self == NAMESPACE.floor(self))

    def __floor__(self) -> Any:
        return NAMESPACE.floor(self)

    def __ceil__(self) -> Any:
        return -NAMESPACE.floor(-self)

    def __int__(self) -> int:
        whole = NAMESPACE.floor(self) if self >= 0.0 else -NAMESPACE.floor(-self)
        if isinstance(whole, Recorded):
            raise TypeError(LOST)
        return int(whole)

    def __round__(self, digits: int | None = None) -> int:
        if digits is not None:
            raise TypeError(LOST)
        return int(NAMESPACE.floor(self + 0.5))


Real.register(Recorded)
for _name in ("sin", "cos", "tan", "arcsin", "arccos", "arccosh", "arctan", "arctan2", "sqrt", "exp", "log", "hypot"):

    def _method(self: Recorded, *others: Any, name: str = _name) -> Any:
        return self._apply(name, (self, *others))

    setattr(Recorded, _name, _method)  # how numpy's functions reach the entries of an array of objects

for _name in _SYMBOLS:

    def _left(self: Recorded, other: Any, name: str = _name) -> Any:
        usual = type(other) is Recorded or type(other) is float
        return self.recorder.operation(name, (self, other)) if usual else self._apply(name, (self, other))

    def _right(self: Recorded, other: Any, name: str = _name) -> Any:
        usual = type(other) is float
        return self.recorder.operation(name, (other, self)) if usual else self._apply(name, (other, self))

    _python = {"subtract": "sub", "multiply": "mul", "divide": "truediv"}.get(_name, _name)
    setattr(Recorded, f"__{_python}__", _left)  # the same as an `Operand` has, without a look at other kinds of numbers
    setattr(Recorded, f"__r{_python}__", _right)

_PLAIN: Any = (Recorded, float, int, bool, np.floating, np.integer, np.bool_)


class Complex:
    """A complex number of two recorded parts, for sums and products."""

    __slots__ = ("imag", "real")
    __array_ufunc__ = None

    def __init__(self, real: Any, imag: Any) -> None:
        self.real, self.imag = real, imag

    def __add__(self, other: Any) -> Complex:
        return Complex(self.real + other.real, self.imag + other.imag)

    def __sub__(self, other: Any) -> Complex:
        return Complex(self.real - other.real, self.imag - other.imag)

    def __mul__(self, other: Any) -> Complex:
        a, b, c, d = self.real, self.imag, other.real, other.imag
        return Complex(a * c - b * d, a * d + b * c)

    def __neg__(self) -> Complex:
        return Complex(-self.real, -self.imag)

    __radd__, __rmul__ = __add__, __mul__


def _over_arrays(name: str, operands: tuple[Any, ...]) -> Any:
    """An operation on arrays and recorded numbers, entry by entry."""
    arrays = [np.asarray(o, dtype=object) if isinstance(o, Recorded) else np.asarray(o) for o in operands]
    arrays = list(np.broadcast_arrays(*arrays))
    function = getattr(NAMESPACE, name)
    entries = np.empty(arrays[0].shape, dtype=object)
    for at in np.ndindex(entries.shape):
        entries[at] = function(*(array[at] for array in arrays))
    truths = name in _COMPARISONS and all(isinstance(value, bool | np.bool_) for value in entries.flat)
    return entries.astype(bool) if truths else entries[()]


_OF_PLAIN: dict[str, Callable[..., Any]] = {
    **{name: getattr(math, name) for name in _MATH},
    **{name: compare for name, (_, compare) in _COMPARISONS.items()},
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": operator.truediv,
    "power": math.pow,
    "negative": operator.neg,
    "abs": abs,
    "sign": lambda a: float((a > 0.0) - (a < 0.0)),
    "minimum": min,
    "maximum": max,
    "where": lambda test, yes, no: yes if test else no,
    "logical_and": lambda a, b: bool(a and b),
    "logical_or": lambda a, b: bool(a or b),
    "logical_not": lambda a: not a,
}


# -- what is left out of a tape --------------------------------------------------------------------------------------------


def _is(value: Any, number: float) -> bool:
    return not isinstance(value, Recorded) and value == number


def _sum(a: Any, b: Any = 0.0) -> Any:
    if type(a) is type(b):
        return NotImplemented
    return b if _is(a, 0.0) else a if _is(b, 0.0) else NotImplemented


def _minus(a: Any, b: Any) -> Any:
    if type(a) is type(b):
        return 0.0 if a is b else NotImplemented
    return a if _is(b, 0.0) else -b if _is(a, 0.0) else NotImplemented


def _times(a: Any, b: Any) -> Any:
    if type(a) is type(b):
        return NotImplemented
    if _is(a, 0.0) or _is(b, 0.0):
        return 0.0
    return b if _is(a, 1.0) else a if _is(b, 1.0) else NotImplemented


def _over(a: Any, b: Any) -> Any:
    if type(a) is type(b):
        return NotImplemented
    return 0.0 if _is(a, 0.0) else a if _is(b, 1.0) else NotImplemented


def _to_power(a: Any, b: Any) -> Any:
    if _is(b, 0.0):
        return 1.0
    return a if _is(b, 1.0) else a * a if _is(b, 2.0) else NotImplemented


def _opposite(a: Any) -> Any:
    entry = a.recorder._tape[a.number]
    if entry[0] != "negative":
        return NotImplemented
    operand = entry[1]
    return Recorded(a.recorder, operand, None if a.value is None else -a.value)


def _chosen(test: Any, yes: Any, no: Any) -> Any:
    if isinstance(test, Recorded) and test.value is None:
        return yes if yes is no else NotImplemented
    return yes if test else no


def _both(a: Any, b: Any) -> Any:
    if not isinstance(a, Recorded):
        return b if a else False
    return NotImplemented if isinstance(b, Recorded) else a if b else False


def _either(a: Any, b: Any) -> Any:
    if not isinstance(a, Recorded):
        return True if a else b
    return NotImplemented if isinstance(b, Recorded) else True if b else a


def _lower(a: Any, b: Any) -> Any:
    return NotImplemented if _varies(a, b) else b if b < a else a


def _higher(a: Any, b: Any) -> Any:
    return NotImplemented if _varies(a, b) else b if b > a else a


def _size(a: Any) -> Any:
    return NotImplemented if _varies(a) else -a if a < 0.0 else a


def _sense(a: Any) -> Any:
    return NotImplemented if _varies(a) else 1.0 if a > 0.0 else -1.0 if a < 0.0 else 0.0


def _whole(a: Any) -> Any:
    """The floor of a parameter is a plain number, with two guards."""
    if _varies(a) or not math.isfinite(a.value):
        return NotImplemented
    below = float(math.floor(a.value))
    return below if a >= below and a < below + 1.0 else NotImplemented


def _varies(*operands: Any) -> bool:
    """True if some operand depends on a variable, so that no comparison is answered."""
    return any(isinstance(operand, Recorded) and operand.value is None for operand in operands)


_SHORTER: dict[str, Callable[..., Any]] = {
    "add": _sum,
    "subtract": _minus,
    "multiply": _times,
    "divide": _over,
    "power": _to_power,
    "negative": _opposite,
    "where": _chosen,
    "logical_and": _both,
    "logical_or": _either,
    "minimum": _lower,
    "maximum": _higher,
    "abs": _size,
    "sign": _sense,
    "floor": _whole,
    "ceil": lambda a: NotImplemented if _varies(a) else -NAMESPACE.floor(-a),
}


# -- functions by their names -----------------------------------------------------------------------------------------------


def _function(name: str) -> Callable[..., Any]:
    of_arrays = getattr(np, _NUMPY[name])

    def function(*operands: Any) -> Any:
        for operand in operands:
            if isinstance(operand, Recorded):
                return operand._apply(name, operands)
            if isinstance(operand, np.ndarray) and operand.dtype == object:
                return _over_arrays(name, operands)
        return of_arrays(*operands)

    function.__name__ = name
    return function


def _searchsorted(ascending: Any, value: Any, side: str = "left") -> Any:
    if isinstance(value, np.ndarray):
        return np.array([_searchsorted(ascending, one, side) for one in value.flat]).reshape(value.shape)
    return (bisect_left if side == "left" else bisect_right)(list(ascending), value)


def _where(test: Any, yes: Any, no: Any) -> Any:
    if isinstance(test, bool | np.bool_):
        return yes if test else no
    if any(isinstance(operand, np.ndarray) for operand in (test, yes, no)):
        return _over_arrays("where", (test, yes, no))
    return test.recorder.operation("where", (test, yes, no))


def _clip(value: Any, low: Any, high: Any) -> Any:
    return NAMESPACE.minimum(NAMESPACE.maximum(value, low), high)


_ARRAY_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "where": _where,
    "clip": _clip,
    "searchsorted": _searchsorted,
    "shape": lambda value: (),
    "ndim": lambda value: 0,
    "size": lambda value: 1,
    "broadcast_to": lambda value, shape: np.broadcast_to(np.asarray(value, dtype=object), shape)[()],
    "zeros_like": lambda value: 0.0,
    "ones_like": lambda value: 1.0,
    "square": lambda value: value * value,
    "degrees": lambda value: value * (180.0 / math.pi),
    "radians": lambda value: value * (math.pi / 180.0),
}

NAMESPACE: Any = SimpleNamespace(pi=math.pi, **{name: _function(name) for name in _NUMPY})
NAMESPACE.where = _where
NAMESPACE.clip = _clip


# -- linear systems -------------------------------------------------------------------------------------------------------


def solved(matrix: Sequence[Sequence[Any]], right: Sequence[Any]) -> list[Any]:
    """The solution x of A x = b, of recorded and plain numbers; entries that are plain zeros cost nothing.

    Blocks of one and two unknowns are solved by themselves, which divides only by their determinants; the rest is
    eliminated with rows exchanged where a pivot is the larger one. Rows may be more than unknowns where they agree.

    >>> recorder = Recorder()
    >>> a = recorder.input("a")
    >>> program = recorder.program(solved([[0.0, a], [2.0, 1.0]], [6.0, 7.0]))
    >>> program.function("math")(3.0)
    (2.5, 2.0)
    """
    rows = [({k: v for k, v in enumerate(row) if not _is(v, 0.0)}, b) for row, b in zip(matrix, right, strict=True)]
    solution: dict[int, Any] = {}
    while len(solution) < len(matrix[0]):
        for i, (entries, b) in enumerate(rows):  # what is known goes to the right
            for k in entries.keys() & solution.keys():
                b = b - entries[k] * solution[k]
            rows[i] = {k: v for k, v in entries.items() if k not in solution}, b
        rows = [row for row in rows if row[0]]
        if len(rows) < len(matrix[0]) - len(solution):
            raise TypeError("a linear system that is singular")
        block = next(_blocks(rows), None)
        solution |= _eliminated(rows) if block is None else block
    return [solution[k] for k in sorted(solution)]


_Equation = tuple[dict[int, Any], Any]  # entries by unknown, and the right side


def _blocks(rows: Sequence[_Equation]) -> Iterator[dict[int, Any]]:
    """Unknowns that one equation gives, or two."""
    for entries, right in rows:
        if len(entries) == 1:
            ((k, entry),) = entries.items()
            yield {k: right / entry}
    for (one, p), (two, q) in combinations(rows, 2):
        if len(one.keys() | two.keys()) == 2:
            j, k = sorted(one.keys() | two.keys())
            a, b, c, d = (entries.get(n, 0.0) for entries in (one, two) for n in (j, k))
            determinant = a * d - b * c
            if not _is(determinant, 0.0):
                yield {j: (p * d - b * q) / determinant, k: (a * q - p * c) / determinant}


def _eliminated(rows: Sequence[_Equation]) -> dict[int, Any]:
    """All unknowns of the equations, by Gauss's elimination with partial pivoting."""
    columns = sorted({k for entries, _ in rows for k in entries})
    table = [[*(entries.get(k, 0.0) for k in columns), right] for entries, right in rows]
    for k in range(len(columns)):
        for i in range(k + 1, len(table)):
            larger = abs(table[i][k]) > abs(table[k][k])
            pairs = list(zip(table[k], table[i], strict=True))
            table[k] = [NAMESPACE.where(larger, b, a) for a, b in pairs]
            table[i] = [NAMESPACE.where(larger, a, b) for a, b in pairs]
        for i in range(k + 1, len(table)):
            factor = table[i][k] / table[k][k]
            table[i] = [0.0 if j <= k else b - factor * a for j, (a, b) in enumerate(zip(table[k], table[i], strict=True))]
    solution: dict[int, Any] = {}
    for k in reversed(range(len(columns))):
        partial_sum = sum((table[k][j] * solution[columns[j]] for j in range(k + 1, len(columns))), 0.0)
        solution[columns[k]] = (table[k][-1] - partial_sum) / table[k][k]
    return solution


# -- programs ---------------------------------------------------------------------------------------------------------------


class Program(NamedTuple):
    """Straight-line code as plain data. Nodes are numbered: the inputs, then the places, then the operations in turn.

    Attributes:
        inputs: names of the arguments.
        places: values of the constants; a tuple is a table; called functions are there too.
        operations: name and numbers of the operands.
        outputs: numbers of the returned nodes.

    """

    inputs: tuple[str, ...]
    places: tuple[Any, ...]
    operations: tuple[tuple[Any, ...], ...]
    outputs: tuple[int, ...]

    @property
    def plain(self) -> bool:
        """True for arithmetic and tables, without calls: then there is machine code for it."""
        return not any(name == "call" for name, *_ in self.operations)

    def function(self, kind: Any = "numpy") -> Callable[..., tuple[Any, ...]]:
        """The program as a function of its inputs, in turn, that returns a tuple of its outputs.

        Args:
            kind: `"numpy"` for arrays that broadcast and numpy's numbers, `"math"` for plain floats (where something is not
                defined, ValueError or ArithmeticError), `"numba"` for arrays in machine code, or a namespace that gives the
                functions by their numpy names, as `NAMESPACE` does, for numbers of any other kind.

        Code depends on the operations alone: programs with other places share it.

        """
        if kind == "numba":
            return _over_broadcast(self)
        named = kind if isinstance(kind, str) else "space"
        if isinstance(kind, str):
            space = _GLOBALS[kind]
        else:
            # numpy's names; operators where the namespace has none
            functions: dict[str, Any] = {name: compare for name, (_, compare) in _COMPARISONS.items()}
            functions |= {"bisect_right": bisect_right, "abs": abs, "power": operator.pow, "divide": operator.truediv}
            functions |= {name: getattr(kind, name) for name in _NUMPY if hasattr(kind, name)}
            functions.setdefault("hypot", lambda a, b: functions["sqrt"](a * a + b * b))
            space = functions
        code = _code(named, len(self.inputs), self._lengths, self.operations, self.outputs)
        tables = named == "numpy" and any(type(place) is tuple for place in self.places)
        places = tuple(np.array(p) if type(p) is tuple else p for p in self.places) if tables else self.places
        return FunctionType(code, space, "recorded", places)

    @property
    def constants(self) -> Any:
        """The constants in one array, tables one entry after another."""
        return np.concatenate([np.ravel(np.asarray(place, dtype=float)) for place in self.places] or [np.empty(0)])

    @property
    def _lengths(self) -> tuple[int, ...]:
        """The number of entries of the table at each place; 0 of a number."""
        return tuple(len(place) if type(place) is tuple else 0 for place in self.places)

    def only(self, outputs: int) -> Program:
        """The part of the program that its first outputs need."""
        return self._between(range(len(self.inputs)), self.outputs[:outputs])

    def split(self, late: int) -> tuple[Program, Program]:
        """The program in two: of all inputs but the last few, to be run once, and of what that gives and those last ones.

        Where `late` is negative, the first few are the late ones.

        >>> program = Program(("a", "b", "c"), (2.0,), (("sin", 0), ("multiply", 4, 3), ("add", 5, 2)), (6, 5))
        >>> early, rest = program.split(1)
        >>> early.operations, early.outputs, rest.operations, rest.outputs
        ((('sin', 0), ('multiply', 3, 2)), (4,), (('add', 0, 1),), (2, 0))
        """
        whole, first = len(self.inputs), len(self.inputs) + len(self.places)
        own = range(-late, whole) if late < 0 else range(whole - late)
        depends = [n < whole and n not in own for n in range(first)]
        for _, *operands in self.operations:
            depends.append(any(depends[n] for n in operands))
        used = (n for k, (_, *operands) in enumerate(self.operations) if depends[first + k] for n in operands)
        passed = sorted({n for n in (*used, *self.outputs) if not depends[n] and not whole <= n < first})
        return self._between(own, passed), self._between([*passed, *(n for n in range(whole) if depends[n])], self.outputs)

    def bound(self, values: Sequence[Any]) -> Program:
        """The program with values of its first inputs as places.

        >>> Program(("a", "b"), (2.0,), (("add", 0, 1), ("multiply", 3, 2)), (4,)).bound([5.0]).function("math")(1.0)
        (12.0,)
        """
        many, rest = len(values), len(self.inputs) - len(values)
        new = [*range(rest, rest + many), *range(rest)]
        operations = tuple((name, *(new[n] if n < len(new) else n for n in own)) for name, *own in self.operations)
        outputs = tuple(new[n] if n < len(new) else n for n in self.outputs)
        return Program(self.inputs[many:], (*values, *self.places), operations, outputs)

    def _between(self, inputs: Sequence[int], outputs: Sequence[int]) -> Program:
        """The operations that lead from some numbers to others; numbers that are no inputs have their own names."""
        own, first, live, inner = len(self.inputs), len(self.inputs) + len(self.places), set(outputs), list[int]()
        for n in reversed(range(first, first + len(self.operations))):
            if n in live and n not in inputs:
                live.update(self.operations[n - first][1:])
                inner.insert(0, n)
        places = [n for n in range(own, first) if n in live]
        new = {n: k for k, n in enumerate([*inputs, *places, *inner])}
        steps = (self.operations[n - first] for n in inner)
        operations = tuple((name, *(new[n] for n in operands)) for name, *operands in steps)
        names = tuple(self.inputs[n] if n < own else f"early {n}" for n in inputs)
        return Program(names, tuple(self.places[n - own] for n in places), operations, tuple(new[n] for n in outputs))


class Conditions(NamedTuple):
    """Guards as a program of differences, with the relation of each to 0 and whether it holds."""

    program: Program
    relations: tuple[str, ...]
    holds: tuple[bool, ...]

    def kept(self, *inputs: Any) -> Any:
        """True if every guard stands as it was recorded, at inputs that broadcast."""
        with np.errstate(all="ignore"):
            differences = self.program.function()(*inputs)
        rows = zip(differences, self.relations, self.holds, strict=True)
        answers = [getattr(np, relation)(difference, 0.0) == holds for difference, relation, holds in rows]
        shape = np.broadcast_shapes(*(np.shape(value) for value in inputs))
        return reduce(np.logical_and, answers, np.ones(shape, dtype=bool))


_COMMON = {name: f"{{0}} {symbol} {{1}}" for name, symbol in _SYMBOLS.items()}
_COMMON |= {"negative": "-{0}", "entry": "{0}[{1}]", "interval": 'searchsorted({1}, {0}, "right")'}
_SCALAR = {
    **_COMMON,
    **{name: f"{{0}} {symbol} {{1}}" for name, (symbol, _) in _COMPARISONS.items()},
    "sign": "1.0 if {0} > 0.0 else -1.0 if {0} < 0.0 else 0.0",
    "minimum": "{1} if {1} < {0} else {0}",
    "maximum": "{1} if {1} > {0} else {0}",
    "where": "{1} if {0} else {2}",
    "logical_and": "{0} and {1}",
    "logical_or": "{0} or {1}",
    "logical_not": "not {0}",
    "power": "pow({0}, {1})",
    "interval": "bisect_right({1}, {0})",
}
_TWICE = ("sign", "minimum", "maximum")  # templates that take an operand twice
_DEEPEST = 24  # brackets in one statement
_TEMPLATES = {
    "math": _SCALAR,
    "numba": _SCALAR | {"interval": _COMMON["interval"]},
    "numpy": _COMMON,
    "space": _COMMON | {"interval": _SCALAR["interval"], "divide": "divide({0}, {1})"},
}
_GLOBALS: dict[str, dict[str, Any]] = {
    "math": {**{name: getattr(math, name) for name in _MATH}, "pow": math.pow, "abs": abs, "bisect_right": bisect_right},
    "numpy": {**{name: getattr(np, name) for name in _NUMPY}, "searchsorted": np.searchsorted},
}


@lru_cache(maxsize=512)
def _code(
    kind: str, inputs: int, places: tuple[int, ...], operations: tuple[Any, ...], outputs: tuple[int, ...]
) -> CodeType:
    """Code with the places as defaults of its last arguments: local variables are the fastest."""
    space: dict[str, Any] = {}
    exec(compile(_source(kind, inputs, places, operations, outputs), "<recorded>", "exec"), space)
    code: CodeType = space["recorded"].__code__
    return code


def source(program: Program, kind: str) -> str:
    """The text that is compiled for `"math"`, `"numpy"` or `"numba"`: names are numbered, and constants are arguments."""
    return _source(kind, len(program.inputs), program._lengths, program.operations, program.outputs)


def _source(kind: str, inputs: int, places: tuple[int, ...], operations: tuple[Any, ...], outputs: tuple[int, ...]) -> str:
    """A statement for each value that is used several times; the others stand where they are used.

    For arrays every operation is a statement, and names whose values are no longer needed are used again, which frees these.
    """
    templates, first = _TEMPLATES[kind], inputs + len(places)
    statement = list(range(len(operations))) if kind == "numpy" else _statements(first, operations, outputs)
    last = dict.fromkeys(outputs, len(operations))  # statement where a value is needed for the last time
    for k, (_, *operands) in enumerate(operations):
        for n in operands:
            last[n] = max(last.get(n, 0), statement[k])
    ending: dict[int, list[str]] = {}
    texts, lines, free = [f"x{k}" for k in range(first)], [], list[str]()
    for k, (name, *operands) in enumerate(operations):
        parts, template = [texts[n] for n in operands], templates.get(name)
        if name == "call":
            name, *parts = parts
        text = template.format(*parts) if template else f"{name}({', '.join(parts)})"
        if statement[k] == k:
            free += ending.pop(k, []) if kind == "numpy" else []
            own = free.pop() if free else f"v{k}"
            ending.setdefault(last[first + k], []).append(own)
            lines.append(f"{own} = {text}")
            texts.append(own)
        else:
            texts.append(f"({text})" if template else text)
    if kind == "numba":
        ends = list(accumulate(length or 1 for length in places))
        parts = [f"{end - n}:{end}" if n else f"{end - 1}" for n, end in zip(places, ends, strict=True)]
        opened = [f"x{inputs + k} = places[{part}]" for k, part in enumerate(parts)]
        arguments, lines = [*texts[:inputs], "places"], opened + lines
    else:
        arguments = texts[:first]
    returned = "".join(f"{texts[n]}, " for n in outputs)
    body = "\n    ".join([*lines, f"return ({returned})"])
    return f"def recorded({', '.join(arguments)}):\n    {body}\n"


def _statements(first: int, operations: tuple[Any, ...], outputs: tuple[int, ...]) -> list[int]:
    """The statement that each operation is part of, by the operation that it ends with."""
    users: list[list[int]] = [[] for _ in operations]
    for k, (name, *operands) in enumerate(operations):
        for n in operands:
            if n >= first:
                users[n - first] += [k, k] if name in _TWICE else [k]
    for n in outputs:
        if n >= first:
            users[n - first] += [len(operations)] * 2
    statement, depth = list(range(len(operations))), [1] * len(operations)
    for k, (_, *operands) in enumerate(operations):
        inner = [depth[n - first] for n in operands if n >= first and len(users[n - first]) == 1]
        depth[k] += max(inner, default=0)
        if len(users[k]) == 1 and depth[k] == _DEEPEST:
            users[k] *= 2
    for k in reversed(range(len(operations))):
        if len(users[k]) == 1:
            statement[k] = statement[users[k][0]]
    return statement


def _over_broadcast(program: Program) -> Callable[..., tuple[Any, ...]]:
    """A kernel over arrays that broadcast, one state after another."""
    run, places = _loop(len(program.inputs), program._lengths, program.operations, program.outputs), program.constants

    def over(*inputs: Any) -> tuple[Any, ...]:
        arrays = np.broadcast_arrays(*(np.asarray(value, dtype=float) for value in inputs))
        shape = arrays[0].shape if arrays else ()
        outcome = np.empty((len(program.outputs), math.prod(shape)))
        run(np.array([array.ravel() for array in arrays]).reshape(len(arrays), -1), places, outcome)
        return tuple(row.reshape(shape)[()] for row in outcome)

    return over


@lru_cache(maxsize=64)
def _loop(inputs: int, places: tuple[int, ...], operations: tuple[Any, ...], outputs: tuple[int, ...]) -> Any:
    """Machine code that runs a program state by state."""
    import numba  # an extra: only who asks for machine code needs it

    space = {**_GLOBALS["math"], "searchsorted": np.searchsorted}
    exec(compile(_source("numba", inputs, places, operations, outputs), "<recorded>", "exec"), space)
    kernel = numba.njit(space["recorded"], error_model="numpy", nogil=True)
    arguments = ", ".join(f"inputs[{k}, i]" for k in range(inputs))
    assigned = "\n        ".join(f"found[{k}, i] = row[{k}]" for k in range(len(outputs)))
    text = f"def run(inputs, places, found):\n    for i in range(found.shape[1]):\n        row = kernel({arguments}, places)"
    exec(compile(f"{text}\n        {assigned}\n", "<recorded>", "exec"), space := {"kernel": kernel})
    return numba.njit(space["run"], nogil=True)
