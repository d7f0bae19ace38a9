"""The elements of a bond graph with their laws, the energy domains with their quantities and units, and the errors.

One-ports: Se and Sf (sources), I, C, R. Two-ports: TF (f_out = T f_in, e_in = T e_out) and GY (e_out = G f_in,
e_in = G f_out). Junctions: 1 (common flow) and 0 (common effort). A law or a modulus that depends on displacements, time or
signals makes the element modulated (MSe, MTF...). Laws are plain numbers, Python functions or SymPy expressions of named
quantities (`Function`), or, where a mechanism gives the positions, a `Modulus` or `Law` of its motion.

The arguments of a `Function` are displacements, signals and parameters that the graph declares, the time `t`, and for a
resistor its own flow `f`, for a compliance its own displacement `q`. Slopes come from dual numbers (`Dual`) or from SymPy,
never from differences; a formula in numpy's functions writes itself down when it is called on a `Traced`.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np


class GraphError(ValueError):
    """A graph that is not well formed, or that cannot be treated as required; the message names the elements and bonds."""


SINGULAR = "the constraints lock or branch at one of the positions: singular flow system"


def refuse(faults: Iterable[str]) -> None:
    """Raises a GraphError that lists all faults, a line each, if there are any."""
    lines = list(faults)
    if lines:
        raise GraphError("\n".join(lines))


def real(value: Any) -> Any:
    """A numpy scalar as a float: plain floats are several times faster."""
    if isinstance(value, np.ndarray) and value.ndim == 0:  # what numpy.where makes of plain numbers
        value = value.item()
    return float(value) if isinstance(value, np.floating | int) else value


def _operator(name: str) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Python's methods of an operation, by its ufunc: of the left operand, and of the right one."""

    def left(self: Any, *others: Any) -> Any:
        return self._apply(name, (self, *others))

    return left, lambda self, other: self._apply(name, (other, self))


class Operand:
    """Arithmetic by one method, `_apply(ufunc name, operands)`, for numpy's functions and Python's operators alike."""

    __add__, __radd__ = _operator("add")
    __sub__, __rsub__ = _operator("subtract")
    __mul__, __rmul__ = _operator("multiply")
    __truediv__, __rtruediv__ = _operator("divide")
    __pow__, __rpow__ = _operator("power")
    __and__, __or__, __invert__ = (_operator(f"logical_{name}")[0] for name in ("and", "or", "not"))
    __neg__, __abs__ = (_operator(name)[0] for name in ("negative", "absolute"))
    __lt__, __le__ = (_operator(name)[0] for name in ("less", "less_equal"))
    __gt__, __ge__ = (_operator(name)[0] for name in ("greater", "greater_equal"))
    __eq__, __ne__ = (_operator(name)[0] for name in ("equal", "not_equal"))
    __hash__ = None  # type: ignore[assignment]  # equal means equal values, which change

    def _apply(self, name: str, operands: tuple[Any, ...]) -> Any:
        raise NotImplementedError

    def __pos__(self) -> Any:
        return self

    def __array_ufunc__(self, ufunc: Any, method: str, *operands: Any, **kwargs: Any) -> Any:
        if method != "__call__" or kwargs:
            raise TypeError(f"numpy.{ufunc.__name__}.{method} is not known here")
        return self._apply(ufunc.__name__, operands)

    def __array_function__(self, function: Any, types: Any, operands: Any, kwargs: Any) -> Any:
        return self._apply(function.__name__, operands)

    def __float__(self) -> float:
        raise TypeError("math's functions take plain floats only: write the law with numpy's, or as a SymPy expression")


class Dual(Operand):
    """A value and its derivative: all results computed with it carry the exact derivative.

    >>> x = Dual(2.0, 1.0)
    >>> y = x**3 - 1 / x
    >>> y.value, y.slope
    (7.5, 12.25)
    """

    __slots__ = ("slope", "value")

    def __init__(self, value: Any, slope: Any) -> None:
        self.value, self.slope = value, slope

    def _apply(self, name: str, operands: tuple[Any, ...]) -> Any:
        values = [o.value if isinstance(o, Dual) else o for o in operands]
        if name in _COMPARISONS:
            return getattr(np, name)(*values)
        if name == "where":
            slopes = [o.slope if isinstance(o, Dual) else 0.0 for o in operands[1:]]
            return Dual(real(np.where(*values)), real(np.where(values[0], *slopes)))
        if name not in _PARTIALS:
            raise TypeError(f"numpy.{name} has no derivative here")
        result = real(getattr(np, name)(*values)) if name not in _OPERATORS else _OPERATORS[name](*values)
        slope: Any = 0.0
        for k, operand in enumerate(operands):
            if isinstance(operand, Dual):
                slope = slope + _PARTIALS[name][k](result, *values) * operand.slope
        return Dual(result, slope)


_COMPARISONS = ("less", "less_equal", "greater", "greater_equal", "equal", "not_equal")

_OPERATORS: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "power": lambda a, b: a**b,
    "negative": lambda a: -a,
}

_PARTIALS: dict[str, tuple[Callable[..., Any], ...]] = {  # of each argument: (result, *values) -> partial derivative
    "add": (lambda r, a, b: 1.0, lambda r, a, b: 1.0),
    "subtract": (lambda r, a, b: 1.0, lambda r, a, b: -1.0),
    "multiply": (lambda r, a, b: b, lambda r, a, b: a),
    "divide": (lambda r, a, b: 1.0 / b, lambda r, a, b: -r / b),
    "power": (lambda r, a, b: b * a ** (b - 1) if np.any(b) else 0.0, lambda r, a, b: r * np.log(a)),
    "negative": (lambda r, a: -1.0,),
    "absolute": (lambda r, a: np.sign(a),),
    "sign": (lambda r, a: 0.0,),
    "square": (lambda r, a: 2.0 * a,),
    "sqrt": (lambda r, a: 0.5 / r,),
    "sin": (lambda r, a: np.cos(a),),
    "cos": (lambda r, a: -np.sin(a),),
    "tan": (lambda r, a: 1.0 + r * r,),
    "arcsin": (lambda r, a: 1.0 / np.sqrt((1.0 - a) * (1.0 + a)),),
    "arccos": (lambda r, a: -1.0 / np.sqrt((1.0 - a) * (1.0 + a)),),
    "arctan": (lambda r, a: 1.0 / (1.0 + a * a),),
    "arctan2": (lambda r, y, x: x / (x * x + y * y), lambda r, y, x: -y / (x * x + y * y)),
    "hypot": (lambda r, a, b: a / r, lambda r, a, b: b / r),
    "exp": (lambda r, a: r,),
    "log": (lambda r, a: 1.0 / a,),
    "sinh": (lambda r, a: np.cosh(a),),
    "cosh": (lambda r, a: np.sinh(a),),
    "tanh": (lambda r, a: 1.0 - r * r,),
    "maximum": (lambda r, a, b: np.where(a >= b, 1.0, 0.0), lambda r, a, b: np.where(a >= b, 0.0, 1.0)),
    "minimum": (lambda r, a, b: np.where(a <= b, 1.0, 0.0), lambda r, a, b: np.where(a <= b, 0.0, 1.0)),
}


class Traced(Operand):
    """A SymPy expression that numpy's functions accept, so that a numpy formula yields its own expression."""

    __slots__ = ("expression",)

    def __init__(self, expression: Any) -> None:
        self.expression = expression

    def _apply(self, name: str, operands: tuple[Any, ...]) -> Any:
        import sympy  # type: ignore[import-untyped]

        values = [untraced(operand) for operand in operands]
        if name == "where":
            return Traced(sympy.Piecewise((values[1], values[0]), (values[2], True)))
        if name in _OPERATORS or name in _COMPOUND:
            return Traced((_OPERATORS | _COMPOUND)[name](*values))
        if name not in _SYMPY_NAMES:
            raise TypeError(f"numpy.{name} has no symbolic form here")
        return Traced(getattr(sympy, _SYMPY_NAMES[name])(*values))

    def __bool__(self) -> bool:
        raise TypeError("it branches on its argument; numpy.where can be followed")


_COMPOUND: dict[str, Callable[..., Any]] = {
    "square": lambda a: a**2,
    "hypot": lambda a, b: (a**2 + b**2) ** 0.5,
}

SHORT = {"arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2"}  # numpy's names, and all others'
_SYMPY_NAMES = {name: name for name in ("sqrt", "sin", "cos", "tan", "exp", "log", "sinh", "cosh", "tanh", "sign")} | SHORT
_SYMPY_NAMES |= {"less": "Lt", "less_equal": "Le", "greater": "Gt", "greater_equal": "Ge", "equal": "Eq", "not_equal": "Ne"}
_SYMPY_NAMES |= {"logical_and": "And", "logical_or": "Or", "logical_not": "Not"}
_SYMPY_NAMES |= {"absolute": "Abs", "maximum": "Max", "minimum": "Min"}


def untraced(value: Any) -> Any:
    """A traced expression as SymPy's; a float that is a whole number as an integer, so that formulas stay readable."""
    if isinstance(value, Traced):
        return value.expression
    if isinstance(value, float | np.floating) and float(value).is_integer():
        return int(value)
    return value


TIME = "t"
OWN_FLOW = "f"
OWN_EFFORT = "e"
OWN_DISPLACEMENT = "q"
OWN_MOMENTUM = "p"
OWN = {"R": OWN_FLOW, "C": OWN_DISPLACEMENT, "I": OWN_MOMENTUM}  # what a law of this kind calls its own
_ALWAYS_OWN = (OWN_FLOW, OWN_DISPLACEMENT)


def own_name(kind: str, names: Iterable[str], declared: Iterable[str]) -> str | None:
    """The name of the element's own quantity in a law of these names; a resistor's is its flow f, or its effort e.

    f and q are always the element's own, e and p unless the graph declares these names.

    >>> own_name("R", ("f", "theta"), ()), own_name("R", ("e",), ()), own_name("R", ("e",), ("e",))
    ('f', 'e', None)
    """
    names, declared = set(names), set(declared)
    may = (OWN_FLOW, OWN_EFFORT) if kind == "R" else (OWN[kind],) if kind in OWN else ()
    return next((n for n in may if n in names and (n in _ALWAYS_OWN or n not in declared)), None)


@dataclass(frozen=True, eq=False)
class Function:
    """A law given as a function of quantities of the graph (`of`, their names).

    Args:
        law: a Python function written with numpy's functions, or a SymPy expression.
        arguments: the names in `law`: its parameters, or the free symbols of the expression.
        of: their names in the graph, in the same order.

    >>> import numpy as np
    >>> square = function(lambda theta: np.sin(theta) ** 2)
    >>> square.of
    ('theta',)
    >>> square.partials(0.5) == (np.sin(0.5) ** 2, (2 * np.sin(0.5) * np.cos(0.5),))
    True
    >>> square.symbolic()
    sin(theta)**2

    """

    law: Any
    arguments: tuple[str, ...]
    of: tuple[str, ...]

    def __reduce__(self) -> tuple[Any, ...]:
        return Function, (self.law, self.arguments, self.of)  # without what is compiled

    def renamed(self, names: Mapping[str, str]) -> Function:
        """The same function of quantities with other names in the graph."""
        return replace(self, of=tuple(names.get(name, name) for name in self.of))

    @property
    def is_expression(self) -> bool:
        """True if it was given as a SymPy expression."""
        return is_symbolic(self.law)

    @cached_property
    def is_affine(self) -> bool:
        """True of a SymPy expression that is a straight line in all its arguments; False for Python functions."""
        if not self.is_expression:
            return False
        slopes = [self.law.diff(symbol) for symbol in self.law.free_symbols]
        return not any(slope.has(*self.law.free_symbols) for slope in slopes)

    def __call__(self, *values: Any) -> Any:
        """The value at the arguments' values: numbers, arrays, dual numbers."""
        if not self.is_expression:
            return real(self.law(*values))
        plain = all(isinstance(value, float | int) for value in values)
        return self._compiled["value", plain](*values)

    def partials(self, *values: Any) -> tuple[Any, tuple[Any, ...]]:
        """The value and its derivative with respect to each argument."""
        if self.is_expression:
            plain = all(isinstance(value, float | int) for value in values)
            value, *slopes = self._compiled["partials", plain](*values)
            return value, tuple(slopes)
        value, slopes = None, []
        for k in range(len(values)):
            seeded = [Dual(v, 1.0) if j == k else v for j, v in enumerate(values)]
            try:
                dual = self.law(*seeded)
            except TypeError as error:
                raise GraphError(
                    f"the slope of a law of {', '.join(self.of)} is needed, but cannot be determined: {error}"
                ) from error
            slopes.append(real(dual.slope) if isinstance(dual, Dual) else 0.0)
            value = real(dual.value if isinstance(dual, Dual) else dual)
        return (self.law() if value is None else value), tuple(slopes)

    def symbolic(self, symbols: Mapping[str, Any] | None = None) -> Any:
        """The SymPy expression, in `symbols` by the graph's names (plain symbols of these names if none is given).

        Raises:
            GraphError: if it cannot be followed symbolically (it branches, or calls other than numpy's functions).

        """
        import sympy

        symbols = symbols or {}
        values = [symbols.get(name, sympy.Symbol(name)) for name in self.of]
        if self.is_expression:
            by_name = dict(zip(self.arguments, values, strict=True))
            return self.law.xreplace({s: by_name[s.name] for s in self.law.free_symbols})
        try:
            traced = self.law(*(Traced(sympy.sympify(value, strict=True)) for value in values))
            return sympy.sympify(untraced(traced), strict=True)  # strict: text is refused, never evaluated
        except (TypeError, AttributeError, sympy.SympifyError) as error:
            raise GraphError(f"cannot be written as a formula ({error}): give it as a SymPy expression") from error

    @cached_property
    def _compiled(self) -> Mapping[tuple[str, bool], Callable[..., Any]]:
        import sympy

        order = [sympy.Dummy(real=True) for _ in self.arguments]  # as plain symbols, |x| and sign(x) have no real slope
        by_name = dict(zip(self.arguments, order, strict=True))
        expression = self.law.xreplace({s: by_name[s.name] for s in self.law.free_symbols})
        slopes = [sympy.diff(expression, symbol).replace(sympy.DiracDelta, lambda *at: sympy.S.Zero) for symbol in order]
        whole = [full_digits(expression) for expression in (expression, *slopes)]
        try:
            return {
                (kind, plain): sympy.lambdify(order, what, modules="math" if plain else "numpy", cse=True)
                for kind, what in (("value", whole[0]), ("partials", whole))
                for plain in (True, False)
            }
        except KeyError as error:  # SymPy's way to say that it has no code for an infinity
            raise GraphError(f"the law {str(self.law)[:80]} has no finite value: it holds {error.args[0]}") from error


def full_digits(expression: Any) -> Any:
    """The expression with floats that are printed at 17 digits: at SymPy's own 15 they would change."""
    import sympy

    return replaced(expression, lambda x: sympy.Float(repr(float(x)), 17) if isinstance(x, sympy.Float) else x)


def exact(expression: Any) -> Any:
    """The expression with integers for floats that are whole, and fractions for halves.

    >>> import sympy
    >>> exact(1.0 * sympy.Symbol("x") ** 0.5 + 2.0)
    sqrt(x) + 2
    """
    import sympy

    def half(x: Any) -> Any:
        return sympy.Rational(int(2 * x), 2) if isinstance(x, sympy.Float) and float(2 * x).is_integer() else x

    return replaced(expression, half)


def replaced(expression: Any, by: Callable[[Any], Any]) -> Any:
    """The expression with parts replaced; each part is visited once, however many references it has."""
    done: dict[Any, Any] = {}

    def made(part: Any) -> Any:
        if part not in done:
            new = by(part)
            if new is part:
                inner = [made(argument) for argument in part.args]
                same = all(one is old for one, old in zip(inner, part.args, strict=True))
                new = part if same else part.func(*inner)
            done[part] = new
        return done[part]

    return made(expression)


def parts(*expressions: Any) -> set[Any]:
    """All parts of expressions, each once."""
    all_parts, todo = set[Any](), list(expressions)
    while todo:
        if (part := todo.pop()) not in all_parts:
            all_parts.add(part)
            todo += part.args
    return all_parts


def is_symbolic(law: Any) -> bool:
    """True for a SymPy expression; SymPy is not imported to find out."""
    return hasattr(law, "free_symbols") and hasattr(law, "xreplace")


def function(law: Any) -> Function:
    """A `Function` of the names that a Python function's parameters, or an expression's symbols, have.

    Parameters with a default value are constants of the function and stay out.

    >>> function(lambda f, theta, k=2.0: k * f * np.sin(theta)).of
    ('f', 'theta')
    """
    if isinstance(law, Function):
        return law
    if is_symbolic(law):
        names = tuple(sorted(symbol.name for symbol in law.free_symbols))
        twice = [name for name in set(names) if names.count(name) > 1]
        if twice:
            raise GraphError(f"two symbols of the expression are named {twice[0]!r}, with different assumptions")
        return Function(law, names, names)
    if not callable(law):
        raise GraphError(f"found {law!r}, expected a number, a function of named quantities or a SymPy expression")
    parameters = inspect.signature(law).parameters.values()
    spread = [p.name for p in parameters if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    if spread:
        raise GraphError(
            f"a law's parameters name what it depends on: found *{spread[0]}, expected names such as theta or t"
        )
    names = tuple(p.name for p in parameters if p.default is p.empty)
    return Function(law, names, names)


def law_of(law: Any) -> Any:
    """A number as a float, a callable or symbolic object as a `Function`; finished laws unchanged."""
    if law is None or isinstance(law, float | Law | Modulus):
        return law
    if isinstance(law, int | np.floating | np.integer):
        return float(law)
    if getattr(law, "is_recorded", False) is True:
        return law
    if is_symbolic(law) and not law.free_symbols:
        try:
            return float(law)
        except TypeError as error:
            raise GraphError(f"found {law}, expected a real number") from error
    return function(law) if is_symbolic(law) or callable(law) else law


# -- elements and domains ------------------------------------------------------------------------------------------------


class Quantity(NamedTuple):
    """The name of a physical quantity and its SI unit."""

    name: str
    unit: str


class Domain(NamedTuple):
    """An energy domain: effort times flow is power; momentum and displacement are their integrals over time.

    Except in `heat`, whose pseudo bonds carry temperature and heat flow: the power audit leaves them out.

    >>> DOMAINS["hydraulic"].effort, DOMAINS["hydraulic"].displacement.unit
    (Quantity(name='pressure', unit='Pa'), 'm^3')
    """

    name: str
    effort: Quantity
    flow: Quantity
    momentum: Quantity
    displacement: Quantity


_QUANTITIES = """
translation: force [N], velocity [m/s], momentum [N s], displacement [m]
rotation: torque [N m], angular velocity [rad/s], angular momentum [N m s], angle [rad]
electric: voltage [V], current [A], flux linkage [V s], charge [C]
magnetic: magnetomotive force [A], flux rate [Wb/s], - [-], magnetic flux [Wb]
hydraulic: pressure [Pa], volume flow [m^3/s], pressure momentum [Pa s], volume [m^3]
thermal: temperature [K], entropy flow [W/K], - [-], entropy [J/K]
heat: temperature [K], heat flow [W], - [-], heat [J]
chemical: chemical potential [J/mol], molar flow [mol/s], - [-], amount of substance [mol]
"""

HEAT = "heat"
DOMAINS: dict[str, Domain] = {
    name: Domain(name, *(Quantity(*pair) for pair in re.findall(r"([^,[]+) \[([^]]+)\],? ?", quantities)))
    for name, quantities in (line.split(": ") for line in _QUANTITIES.strip().splitlines())
}


class Motion(NamedTuple):
    """The source of the positions of a modulus or law: the velocity graph cannot give them.

    `position(q, ns, q_anchor)` is called with the displacement q of the 1-junction named `of`, the namespace of
    functions that fits q (numpy, mpmath, sympy...) and the displacement in the middle of the smooth piece that q lies
    in, and returns an object from which the laws of this motion take their values.
    """

    of: str
    position: Callable[[Any, Any, Any], Any] = lambda q, ns, q_anchor: q


class Here(NamedTuple):
    """The arguments of a source's law at a set of positions: the displacement q, the motion's position, the namespace.

    A law that is `moving` also sees the flow dq/dt of the motion's 1-junction (`speed`), that of its own (`flow`), and the
    time.
    """

    q: Any
    position: Any
    ns: Any
    speed: Any = None
    flow: Any = None
    time: Any = None


class Modulus(NamedTuple):
    """A transformer's ratio T(q) and its slope dT/dq, both picked from the motion's position."""

    value: Callable[[Any], Any]
    slope: Callable[[Any], Any]
    motion: Motion


class Law(NamedTuple):
    """An effort that depends on position: `effort(here, anchor)`.

    `anchor` is the same as `here` in the middle of the smooth piece: every switch (a window's end, a comparison) is
    decided there, so that a piece never sees its neighbour's branch. `per_unknown` is the factor of the one unknown
    parameter that a balance solves for: the whole effort is effort + unknown * per_unknown. `moving`: it depends on speed
    or time too, on those of `Here` that `sees` names. `acts(anchor)` is false in pieces where the effort is 0 throughout;
    it is None if the effort acts everywhere.
    """

    effort: Callable[[Here, Here], Any]
    motion: Motion
    per_unknown: Callable[[Here, Here], Any] | None = None
    moving: bool = False
    sees: tuple[str, ...] = ("speed", "flow", "time")
    acts: Callable[[Here], Any] | None = None


class Field(NamedTuple):
    """The law of several ports: a matrix (rows of numbers or expressions), or an energy. `Builder.field` takes it."""

    matrix: Any = None
    energy: Function | None = None


class Displacement(NamedTuple):
    """A declared displacement: the integral of the flow of the 1-junction `of`, with its value at the start."""

    name: str
    of: str
    initial: float = 0.0


ONE_PORTS = frozenset({"Se", "Sf", "I", "C", "R"})
TWO_PORTS = frozenset({"TF", "GY"})
JUNCTIONS = frozenset({"0", "1"})
SOURCES = frozenset({"Se", "Sf"})
STORES = frozenset({"I", "C"})


class Element(NamedTuple):
    """A named element: its kind, its law (None for junctions), its energy domain, and the part to which it belongs.

    A one-port without a domain of its own takes that of its junction.
    """

    kind: str
    name: str
    law: float | Function | Law | Modulus | Field | None = None
    domain: str = ""
    part: str = ""

    @property
    def symbol(self) -> str:
        """The kind as it is drawn: MSe, MTF... where the law is no plain number (parameters count as modulation here)."""
        modulated = self.kind in SOURCES | TWO_PORTS and not isinstance(self.law, int | float | None)
        return f"M{self.kind}" if modulated else self.kind


def One(name: str, domain: str = "", when: Any = None) -> Element:
    """A 1-junction: one flow, efforts sum to zero. With `when`, switched: while that does not hold, its flow is 0.

    >>> One("switch", when=lambda t: t > 1.0).law.symbolic()
    t - 1
    """
    return Element("1", name, None if when is None else _margin(f"1:{name}", when), domain)


def Zero(name: str, domain: str = "", when: Any = None) -> Element:
    """A 0-junction: one effort, flows sum to zero. With `when`, switched: while that does not hold, its effort is 0.

    >>> Zero("clutch", when=lambda t, f_motor: (t > 1.0) & (f_motor < 5.0)).law.symbolic()
    Min(5 - f_motor, t - 1)
    """
    return Element("0", name, None if when is None else _margin(f"0:{name}", when), domain)


def _margin(where: str, when: Any) -> Function:
    """A condition as a number that is above 0 if it holds: of a > b, a - b; of several, the least or the greatest."""
    import sympy
    from sympy.core.relational import Relational  # type: ignore[import-untyped]

    def number(law: Any) -> Any:
        if isinstance(law, sympy.Or | sympy.And | sympy.Not):
            parts = [number(part) for part in law.args]
            return (
                -parts[0] if isinstance(law, sympy.Not) else (sympy.Max if isinstance(law, sympy.Or) else sympy.Min)(*parts)
            )
        if isinstance(law, Relational) and law.rel_op in ("<", "<=", ">", ">="):
            return law.gts - law.lts
        if isinstance(law, sympy.Expr) and law.free_symbols:
            return law
        raise GraphError(f"{where}: found when = {law}, expected a condition of named quantities, such as t > 1")

    try:
        law = function(when)
        return function(number(law.symbolic()))
    except GraphError as error:
        why = str(error)
        raise GraphError(why if why.startswith(where) else f"{where}: its condition {why}") from error


def Se(name: str, effort: Any, domain: str = "", part: str = "") -> Element:
    """A source of effort: a number, or a function of displacements, time and signals (MSe).

    >>> Se("battery", 12.0).symbol, Se("mains", lambda t: 325.0 * np.sin(314.0 * t)).symbol
    ('Se', 'MSe')
    """
    return Element("Se", name, law_of(effort), domain, part)


def Sf(name: str, flow: Any, domain: str = "", part: str = "") -> Element:
    """A source of flow: a number, or a function of displacements, time and signals (MSf).

    >>> Sf("pump", 2e-3).symbol, Sf("road", lambda t: 0.1 * np.cos(t)).symbol
    ('Sf', 'MSf')
    """
    return Element("Sf", name, law_of(flow), domain, part)


def I(name: str, inertia: Any = None, domain: str = "", part: str = "", *, energy: Any = None) -> Element:  # noqa: E743
    """An inertia: p = I f, with a number, an expression of parameters, or any f(p) with a function of p.

    A matrix, or an energy of several momenta (and displacements), is a field: `Builder.field`.

    >>> I("coils", [[2.0, 1.0], [1.0, 3.0]]).law.matrix
    [[2.0, 1.0], [1.0, 3.0]]
    """
    return Element("I", name, _shared(f"I:{name}", inertia, energy), domain, part)


def C(name: str, law: Any = None, domain: str = "", part: str = "", *, stiffness: Any = None, energy: Any = None) -> Element:
    """A compliance: e = q/C with `law` = C a number, any e(q) with a function of q, or linear by its stiffness 1/C.

    A matrix, or an energy of several displacements, is a field: `Builder.field`.

    >>> C("spring", 0.125).law == C("spring", stiffness=8.0).law == 0.125
    True
    """
    if stiffness is None:
        return Element("C", name, _shared(f"C:{name}", law, energy), domain, part)
    if law is not None or energy is not None:
        raise GraphError(
            f"C:{name}: found a {'compliance' if energy is None else 'energy'} and a stiffness, expected one of them"
        )
    if not stiffness:
        raise GraphError(f"C:{name}: found stiffness 0, expected a number other than 0; leave a spring of no stiffness out")
    return Element("C", name, law_of(1.0 / stiffness), domain, part)


def R(name: str, law: Any, domain: str = "", part: str = "") -> Element:
    """A resistor: e = R f with a number, any e(f) with a function of its own flow f (and of displacements, time...).

    A matrix is a field: `Builder.field`.

    >>> R("drag", lambda f: 2.0 * f * abs(f)).law.of, R("diode", lambda e: 1e-9 * np.exp(e / 0.05)).law.of
    (('f',), ('e',))
    """
    return Element("R", name, _shared(f"R:{name}", law, None), domain, part)


def RS(name: str, law: Any, domain: str = "", part: str = "") -> Element:
    """A resistor with a thermal port: its dissipated power heats the body at its second bond.

    It is attached to a junction like R, and bonded to the 0-junction of a body: `b.on("shaft", RS("rub", 0.5)).bond("rub",
    "body")`. In the graph it is the resistor, and a source of the entropy flow e f/T, so that its power comes back as heat;
    in the domain `heat` a source of the heat flow e f.

    >>> from bondgraph import Builder
    >>> b = Builder().one("shaft").on("shaft", I("J", 2.0), RS("rub", 0.5)).zero("body", "thermal").on("body", C("c", 4.0))
    >>> [element.name for element in b.bond("rub", "body").build().of_kind("R", "Sf")]
    ['rub', 'rub.heat']
    """
    return Element("RS", name, law_of(law), domain, part)


def TF(name: str, ratio: Any) -> Element:
    """A transformer: f_out = T f_in, e_in = T e_out; with a function or a `Modulus`, a modulated one (MTF).

    >>> TF("gear", 3.0).symbol, TF("crank", lambda theta: -0.2 * np.sin(theta)).symbol
    ('TF', 'MTF')
    """
    return Element("TF", name, law_of(ratio))


def GY(name: str, ratio: Any) -> Element:
    """A gyrator: e_out = G f_in, e_in = G f_out; with a function, a modulated one (MGY).

    >>> GY("motor", 0.3).symbol, GY("series motor", lambda f_armature: 0.3 * f_armature).symbol
    ('GY', 'MGY')
    """
    return Element("GY", name, law_of(ratio))


def renamed(element: Element, elements: Mapping[str, str], displacements: Mapping[str, str]) -> Any:
    """Returns an element's law with other names of elements and displacements, old -> new."""
    law = element.law
    if isinstance(law, Function):
        fixed = (TIME, OWN.get(element.kind))
        read = {f"{letter}_{old}": f"{letter}_{new}" for old, new in elements.items() for letter in "fepq"}
        return law.renamed({old: new for old, new in {**read, **displacements}.items() if old not in fixed})
    if isinstance(law, Modulus | Law):
        return law._replace(motion=law.motion._replace(of=elements.get(law.motion.of, law.motion.of)))
    return law


# -- fields: several ports of one energy, or of one matrix ---------------------------------------------------------------

_OF_STATE = re.compile(r"([pqx])(_.*|[0-9]*)")  # an argument that says itself whether it is a momentum or a displacement

_SAME, _SINGULAR = 1e-12, 1e15  # of a matrix's greatest entry: what rounding leaves; its condition


def _shared(where: str, law: Any, energy: Any) -> Any:
    """A law, or the field of a matrix or an energy."""
    if energy is not None:
        if law is not None:
            raise GraphError(f"{where}: found a law and an energy, expected one of them")
        return Field(energy=function(energy))
    rows = type(law) in (list, tuple) and any(isinstance(row, list | tuple | np.ndarray) for row in law)
    return Field(law) if rows or len(getattr(law, "shape", ())) == 2 else law_of(law)


def ports_of(
    element: Any, junctions: Sequence[str], named: Mapping[str, str], parameters: Iterable[str]
) -> Iterator[tuple[str, Element]]:
    """Yields the one-ports of a field, NAME_PORT each, whose laws read one another's states (of a resistor: flows).

    e = C^-1 q, f = I^-1 p, e = R f with a matrix; with an energy, its derivative by each port's own state.

    Args:
        element: the field.
        junctions: those of its ports in order.
        named: more of them by name; of an energy, by its argument.
        parameters: further names that an energy may contain.

    Raises:
        GraphError: if the matrix or the energy does not fit a field with these ports.

    """
    import sympy

    if not isinstance(element, Element):
        raise GraphError(f"found {element!r}, expected an element, such as I('coils', [[2.0, 1.0], [1.0, 3.0]])")
    where, field = f"{element.kind}:{element.name}", element.law
    if not isinstance(field, Field):
        raise GraphError(f"{where}: found {field!r}, expected a matrix, or energy=...; attach a one-port by on(...)")
    arguments = [n for n in field.energy.of if n not in parameters] if field.energy is not None else []
    port_names = arguments or list(map(str, range(1, 1 + len(junctions))))
    port_names += [n for n in named if n not in arguments]
    ports = {**dict(zip(port_names, junctions, strict=False)), **named}
    if len(junctions) > len(port_names) or set(port_names[: len(junctions)]) & set(named):
        raise GraphError(
            f"{where}: found {len(junctions) + len(named)} junctions for {len(port_names)} ports ({', '.join(port_names)})"
        )
    kinds = dict.fromkeys(ports, element.kind)
    if field.energy is not None:
        _check_arguments(where, field.energy, list(ports), parameters)
        for port in ports:
            state_match = _OF_STATE.fullmatch(port)
            kinds[port] = ("I" if state_match[1] == "p" else "C") if state_match else element.kind
    own = {port: OWN[kind] for port, kind in kinds.items()}
    names = {port: f"{own[port]}_{element.name}_{port}" for port in ports}
    symbols = {port: sympy.Symbol(name, real=True) for port, name in names.items()}
    if field.energy is not None:
        try:
            energy = field.energy.symbolic(symbols)
        except GraphError as error:
            raise GraphError(f"{where}: its energy {error}") from error
        laws = [energy.diff(symbol) for symbol in symbols.values()]
        for port in (p for p, law in zip(ports, laws, strict=True) if law == 0):
            raise GraphError(f"{where}: its energy is no function of the port {port!r}")
    else:
        laws = [
            sum(k * x for k, x in zip(row, symbols.values(), strict=True))
            for row in _rows(where, element.kind, field.matrix, len(ports))
        ]
    for port, law in zip(ports, laws, strict=True):
        mine = symbols[port]
        read = sorted({s.name for s in law.free_symbols} - {mine.name})
        expression = law.xreplace({s: sympy.Symbol(own[port] if s == mine else s.name) for s in law.free_symbols})
        of, name = (own[port], *read), f"{element.name}_{port}"
        alone = field.energy is None and not {*read}.difference(parameters)  # a port that no other acts on is a plain one
        k = list(ports).index(port)
        rule = law_of(np.asarray(field.matrix, dtype=object)[k, k]) if alone else Function(expression, of, of)
        yield ports[port], Element(kinds[port], name, rule, element.domain, element.part)


def _check_arguments(where: str, energy: Function, ports: Sequence[str], parameters: Iterable[str]) -> None:
    names = ", ".join(ports) or "none"
    for name in (n for n in energy.of if n not in {*ports, *parameters}):
        raise GraphError(
            f"{where}: its energy depends on {name!r}, which is neither one of its ports ({names}) "
            "nor a parameter declared before"
        )
    for port in (p for p in ports if p not in energy.of):
        raise GraphError(
            f"{where}: its energy is no function of the port {port!r}; it is one of {', '.join(energy.of) or 'nothing'}"
        )


def _rows(where: str, kind: str, entries: Any, ports: int) -> list[list[Any]]:
    """The rows by which efforts (of an inertia: flows) follow from the ports' states (of a resistor: flows)."""
    import sympy

    lines = entries.tolist() if hasattr(entries, "tolist") else list(entries)
    rows = [list(row) if isinstance(row, list | tuple | np.ndarray) else [row] for row in lines]
    size = len(rows)
    if any(len(row) != size for row in rows):
        raise GraphError(
            f"{where}: found rows of {', '.join(str(len(row)) for row in rows)} entries, expected a square matrix"
        )
    if size != ports:
        raise GraphError(f"{where}: found {ports} ports for a matrix of {size} rows, expected {size}")
    numbers = not any(is_symbolic(entry) and entry.free_symbols for row in rows for entry in row)
    if numbers:
        try:
            rows = np.array(rows, dtype=float).tolist()
        except (TypeError, ValueError) as error:
            raise GraphError(f"{where}: found a matrix with entries that are no numbers or expressions ({error})") from error
        if not np.all(np.isfinite(rows)):
            raise GraphError(f"{where}: found a matrix with entries that are not finite, expected finite numbers")
    if kind != "R":
        for i in range(size):
            for j in range(i):
                entries, other = rows[i][j], rows[j][i]
                if entries != other and not (numbers and abs(entries - other) <= _SAME * np.abs(rows).max()):
                    raise GraphError(
                        f"{where}: found {entries} in row {i + 1}, column {j + 1} of its matrix and {other} in row {j + 1}, "
                        f"column {i + 1}, expected the same: no energy has such a matrix"
                    )
    elif numbers:
        least = float(np.linalg.eigvalsh(np.array(rows) + np.array(rows).T)[0]) / 2.0
        if least < -_SAME * float(np.abs(rows).max()):
            raise GraphError(f"{where}: its matrix has the eigenvalue {least:.6g} in its symmetric part: it generates power")
    if not numbers:
        whole = sympy.Matrix(rows)
        return list((whole if kind == "R" else whole.inv("ADJ").applyfunc(sympy.factor)).tolist())
    if kind != "R":
        if not np.linalg.cond(rows) < _SINGULAR:
            raise GraphError(
                f"{where}: its matrix is singular: one port follows the others; give one port fewer, and a transformer to it"
            )
        inverse = np.linalg.inv(rows)
        rows = (0.5 * (inverse + inverse.T)).tolist()
    return [[sympy.Float(repr(entry), 17) if entry else sympy.S.Zero for entry in row] for row in rows]
