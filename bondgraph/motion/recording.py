"""Recording a computation once, as straight-line code that runs many times faster than the walk that made it.

A walk over a graph does the same arithmetic at every state. Run once on `Node`s instead of numbers, it leaves behind the
list of its operations; `Recorder.function` compiles that list. Only operations and places of values make up the code, no
name or text of a graph does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from bondgraph.operands import Dual, Operand


class Recorder:
    """Takes down what is computed with its nodes.

    >>> recorder = Recorder()
    >>> x, y = recorder.inputs(2)
    >>> f = recorder.function([x * y + 1.0, recorder.call(max, (x, y), 0)])
    >>> f(2.0, 3.0)
    (7.0, 3.0)
    """

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._known: dict[str, Node] = {}
        self._constants: dict[str, Any] = {}
        self._inputs: list[str] = []
        self._count = 0

    def inputs(self, count: int) -> list[Node]:
        """Nodes that stand for the arguments of the function."""
        self._inputs = [self._name() for _ in range(count)]
        return [Node(self, name) for name in self._inputs]

    def operation(self, operator: str, left: Any, right: Any) -> Node:
        """The node of left operator right; the same operation twice is one node."""
        text = f"{self._text(left)} {operator} {self._text(right)}"
        if text not in self._known:
            node = self._known[text] = Node(self, self._name())
            self._lines.append(f"{node.name} = {text}")
        return self._known[text]

    def call(self, function: Callable[..., Any], arguments: Sequence[Any], results: int) -> Any:
        """A call that stays a call: one node (results = 0), or as many as the tuple that it returns holds."""
        called = f"{self._text(function)}({', '.join(self._text(a) for a in arguments)})"
        nodes = [Node(self, self._name()) for _ in range(results or 1)]
        targets = ", ".join(node.name for node in nodes) + ("," if results == 1 else "")
        self._lines.append(f"{targets} = {called}")
        return nodes if results else nodes[0]

    def through(self, function: Callable[..., Any], arguments: Sequence[Any], results: int) -> Any:
        """What a function computes with nodes, taken down operation by operation; one call where it cannot be followed."""
        lines, known = len(self._lines), dict(self._known)
        try:
            found = function(*arguments)
            entries = found if results else (found,)
            if all(isinstance(entry, Node | float | int) for entry in entries) and len(entries) == (results or 1):
                return found
        except Exception:  # whatever it is that a law does with a value still to come
            pass
        del self._lines[lines:]
        self._known = known
        return self.call(function, arguments, results)

    def function(self, outputs: Sequence[Any]) -> Callable[..., tuple[Any, ...]]:
        """The compiled function from the inputs to the outputs."""
        returned = "".join(f"{self._text(value)}, " for value in outputs)
        body = "\n    ".join([*self._lines, f"return ({returned})"])
        constants = ", ".join(f"{name}={name}" for name in self._constants)  # defaults are local: faster than globals
        source = f"def recorded({', '.join(self._inputs)}, {constants}):\n    {body}\n"
        space: dict[str, Any] = dict(self._constants)
        exec(compile(source, "<recorded>", "exec"), space)
        compiled: Callable[..., tuple[Any, ...]] = space["recorded"]
        return compiled

    def _name(self) -> str:
        self._count += 1
        return f"v{self._count}"

    def _text(self, value: Any) -> str:
        if isinstance(value, Node):
            return value.name
        name = f"c{len(self._constants)}"
        if isinstance(value, float | int):
            known = next((n for n, v in self._constants.items() if type(v) is type(value) and repr(v) == repr(value)), None)
            if known is not None:
                return known
        self._constants[name] = value
        return name


class Node(Operand):
    """A value still to come, in a recording; arithmetic with 0 and 1 is left out."""

    __slots__ = ("name", "recorder")

    def __init__(self, recorder: Recorder, name: str) -> None:
        self.recorder, self.name = recorder, name

    def _apply(self, name: str, operands: tuple[Any, ...]) -> Any:
        if any(isinstance(operand, Dual) for operand in operands):
            return NotImplemented  # a dual number of nodes takes nodes, not the other way round
        if name in _CALLS:
            return self.recorder.call(_CALLS[name], operands, 0)
        if name == "negative":
            return self.recorder.operation("-", 0.0, operands[0])
        if name not in _SYMBOLS:
            raise TypeError(f"numpy.{name} cannot be recorded")
        left, right = operands
        return _trivial(name, left, right, lambda: self.recorder.operation(_SYMBOLS[name], left, right))

    def __bool__(self) -> bool:
        raise TypeError("a recording cannot branch on a value still to come")


_SYMBOLS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/", "power": "**"}

_CALLS: dict[str, Callable[..., Any]] = {
    **{name: getattr(math, name) for name in ("sqrt", "sin", "cos", "tan", "exp", "log", "sinh", "cosh", "tanh", "hypot")},
    "arcsin": math.asin,
    "arccos": math.acos,
    "arctan": math.atan,
    "arctan2": math.atan2,
    "absolute": abs,
    "maximum": max,
    "minimum": min,
    "square": lambda a: a * a,
    "sign": lambda a: math.copysign(1.0, a) if a else a,
}


def _trivial(name: str, left: Any, right: Any, otherwise: Callable[[], Any]) -> Any:
    """What is left of an operation with 0 or 1, if it needs no code."""
    if name == "add" and (_is(left, 0.0) or _is(right, 0.0)):
        return right if _is(left, 0.0) else left
    if name == "subtract" and _is(right, 0.0):
        return left
    if name in ("multiply", "divide") and _is(right, 1.0):
        return left
    if name == "multiply" and _is(left, 1.0):
        return right
    if name == "multiply" and (_is(left, 0.0) or _is(right, 0.0)):
        return 0.0
    return 0.0 if name == "divide" and _is(left, 0.0) else otherwise()


def _is(value: Any, number: float) -> bool:
    return isinstance(value, float | int) and value == number


def recorded(
    function: Callable[..., Any], matrix: Sequence[Sequence[Any]], right: Sequence[Sequence[Any]]
) -> list[list[Any]]:
    """A call of a solver for A X = B, recorded as one call on the entries."""
    entries = [entry for row in (*matrix, *right) for entry in row]
    recorder = next(entry.recorder for entry in entries if isinstance(entry, Node))
    size, columns = len(matrix), len(right[0])

    def flat(*values: Any) -> tuple[Any, ...]:
        a = [values[i * size : (i + 1) * size] for i in range(size)]
        rest = values[size * size :]
        b = [rest[i * columns : (i + 1) * columns] for i in range(size)]
        return tuple(entry for row in function(a, b) for entry in row)

    results = recorder.call(flat, entries, size * columns)
    return [results[i * columns : (i + 1) * columns] for i in range(size)]
