"""Operating points and the behaviour of a graph near them: equilibrium, linear equations, modes, transfer functions.

At a state x0 with inputs u0 the equations x' = f(x, u), y = g(x, u) become

    dx' = A dx + B du,   dy = C dx + D du,

with slopes taken in symbols, never by differences. Inputs are sources of a plain value, and signals; outputs are states, and
flows `f_NAME` and efforts `e_NAME` as laws read them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import JUNCTIONS, TIME, Element, Function, GraphError, full_digits, refuse
from bondgraph.graph import BondGraph, as_graph, new_bond
from bondgraph.motion.dynamics import Dynamics, RateLog, Walk
from bondgraph.motion.formulation import PortBond
from bondgraph.motion.stepping import field_of
from bondgraph.numerics import Array, reached_from
from bondgraph.strokes import Causality, Signal, causality, giver
from bondgraph.strokes import inputs as computed_from
from bondgraph.twin import SymbolicWalk, Twin

_MOST, _LESS = 60, 1e-3  # Newton's steps to an equilibrium; share of the rates that a whole one takes away, at least
_STEPS = 10.0 ** np.arange(-3.0, -22.0, -3.0)  # of differences, to a state or to 1: of any mixture of units some are right
_STEADY, _SAME = 1e-6, 1e-9
_RANK = 1e-9  # of the greatest singular value
_SUMS, _ROUNDING, _BALANCINGS = 1e-7, 1e-13, 20  # of rates by differences; of a state; iterations
_KINK, _BESIDE = 1e-3, 1e-9  # of the slopes, by which those to both sides differ at a kink; of a state, as near as it counts


class Mode(NamedTuple):
    """A motion exp(pole t): its angular frequency |pole| (rad/s), damping ratio, and share of every state."""

    pole: complex
    frequency: float
    damping: float
    shape: Mapping[str, complex]


@dataclass(frozen=True, eq=False)
class Linear:
    """A graph near an operating point. Made by `linearize`.

    Args:
        states, inputs, outputs: names, in the order of rows and columns.
        at: the operating point by name.
        A, B, C, D: the matrices, in numbers.
        symbolic: the same four in SymPy.
        driven: input -> quantities that depend on its rate, which these equations omit: its transfer functions are refused.

    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    at: Mapping[str, float]
    A: Array
    B: Array
    C: Array
    D: Array
    symbolic: tuple[Any, Any, Any, Any]
    driven: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def poles(self) -> NDArray[np.complex128]:
        """The eigenvalues of A."""
        return np.asarray(np.linalg.eigvals(self.A), dtype=complex)

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The free motions of the graph, slowest first."""
        values, vectors = np.linalg.eig(self.A)
        modes = []
        for k in np.argsort(np.abs(values)):
            pole, size = complex(values[k]), float(abs(values[k]))
            shape = dict(zip(self.states, map(complex, vectors[:, k]), strict=True))
            modes.append(Mode(pole, size, -pole.real / size if size else 0.0, shape))
        return tuple(modes)

    def zeros(self, u: str, y: str) -> NDArray[np.complex128]:
        """The values s at which input u has no effect on output y: det [[A - s, b], [c, d]] = 0."""
        from scipy.linalg import matrix_balance, null_space

        b, c, d = self._between(u, y)
        degree = self._relative_degree(b, c, d)
        if degree is None:
            return np.zeros(0, dtype=complex)
        A, scale = matrix_balance(self.A, permute=False, separate=True)
        b, c = b / scale[0][:, None], c * scale[0]
        outward = [c @ np.linalg.matrix_power(A, k) for k in range(degree + 1)]  # y, y', ... by the states
        gain = (outward[degree - 1] @ b)[0, 0] if degree else d[0, 0]
        free = null_space(np.vstack(outward[:degree])) if degree else np.eye(len(A))  # where y and all these stay 0
        return np.asarray(np.linalg.eigvals(free.T @ (A - b @ outward[degree] / gain) @ free), dtype=complex)

    def transfer(self, u: str, y: str) -> tuple[Array, Array]:
        """Numerator and denominator of y/u, coefficients of falling powers of s; the denominator is det(s - A)."""
        b, c, d = self._between(u, y)
        under = np.real_if_close(np.poly(self.A)) if self.states else np.ones(1)
        closed = np.real_if_close(np.poly(self.A - b @ c)) if self.states else np.ones(1)
        over, degree = closed - under + d[0, 0] * under, self._relative_degree(b, c, d)
        over[: len(over) if degree is None else degree] = 0.0
        return np.asarray(over, dtype=float), np.asarray(under, dtype=float)

    def response(self, u: str, y: str, omega: Any) -> NDArray[np.complex128]:
        """The complex ratio y/u at angular frequencies (rad/s), as a Bode diagram shows it: c (i w - A)^-1 b + d."""
        b, c, d = self._between(u, y)
        unit = np.eye(len(self.states))
        rows = [(c @ np.linalg.solve(1j * w * unit - self.A, b.astype(complex)) + d)[0, 0] for w in np.atleast_1d(omega)]
        return np.array(rows, dtype=complex)

    def bode(self, u: str, y: str, omega: Any) -> tuple[Array, Array]:
        """Magnitude (dB) and phase (degrees, unwrapped) of y/u at angular frequencies (rad/s)."""
        ratio = self.response(u, y, omega)
        return 20.0 * np.log10(np.abs(ratio)), np.degrees(np.unwrap(np.angle(ratio)))

    def draw_bode(self, u: str, y: str, omega: Any, file: str | Path | None = None) -> Any:
        """Draws magnitude and phase of y/u over angular frequency (rad/s), and saves the picture if a file is named.

        >>> from bondgraph import Builder, I, R, Se
        >>> linear = linearize(Builder().one("m").on("m", I("M", 2.0), R("d", 1.0), Se("F", 4.0)).build(), outputs=["f_m"])
        >>> [axes.get_ylabel() for axes in linear.draw_bode("F", "f_m", np.logspace(-2, 2)).axes]
        ['magnitude (dB)', 'phase (degrees)']
        """
        from bondgraph.drawing import bode_figure

        return bode_figure(np.atleast_1d(np.asarray(omega, dtype=float)), *self.bode(u, y, omega), f"{y} / {u}", file)

    def unreachable(self) -> tuple[str, ...]:
        """The states with a share in motions that no input excites, by the rank of [B, AB, ...]; none if controllable."""
        return _out_of_reach(self.A, self.B, self.states)

    def unobservable(self) -> tuple[str, ...]:
        """The states with a share in motions that no output shows; none if observable."""
        return _out_of_reach(self.A.T, self.C.T, self.states)

    def to_scipy(self) -> Any:
        """The same as a `StateSpace` of scipy.signal."""
        from scipy.signal import StateSpace

        refuse(map(self._improper, self.driven))
        return StateSpace(self.A, self.B, self.C, self.D)

    def to_control(self) -> Any:
        """The same as a `StateSpace` of python-control, with its names (`pip install 'flywheel-design[control]'`).

        Raises:
            ImportError: if that is not installed.

        """
        import control  # type: ignore[import-not-found,import-untyped,unused-ignore]

        refuse(map(self._improper, self.driven))
        names = {"states": list(self.states), "inputs": list(self.inputs), "outputs": list(self.outputs)}
        return control.ss(self.A, self.B, self.C, self.D, **names)

    def _between(self, u: str, y: str) -> tuple[Array, Array, Array]:
        for name, names, what in ((u, self.inputs, "input"), (y, self.outputs, "output")):
            if name not in names:
                raise GraphError(f"no {what} {name!r}: they are {', '.join(names) or 'none'}")
        if any(name == y or name.startswith(_RATE) for name in self.driven.get(u, ())):
            raise GraphError(self._improper(u))
        j, i = self.inputs.index(u), self.outputs.index(y)
        return self.B[:, j : j + 1], self.C[i : i + 1], self.D[i : i + 1, j : j + 1]

    def _relative_degree(self, b: Array, c: Array, d: Array) -> int | None:
        """The first of d, c b, c A b... that is not 0: the derivative of y that u is in; None if all are 0."""
        if d[0, 0]:
            return 0
        row, size = c, np.abs(c)
        for degree in range(1, len(self.states) + 1):
            if abs((row @ b)[0, 0]) > _ROUNDING * (size @ np.abs(b))[0, 0]:
                return degree
            row, size = row @ self.A, size @ np.abs(self.A)
        return None

    def _improper(self, u: str) -> str:
        return (
            f"input {u!r}: {' and '.join(self.driven[u])} depends on its rate, for a store follows it, and no A, B, C, D "
            "say that: put an R between, or ask for other inputs and outputs"
        )


_RATE = "the rate of "


def _out_of_reach(matrix: Array, inlet: Array, names: Sequence[str]) -> tuple[str, ...]:
    """The states with a share in the left null space of [B, AB, A^2 B, ...], built up orthonormally."""
    basis, fresh = np.zeros((len(names), 0)), inlet
    while fresh.size:
        left = fresh - basis @ (basis.T @ fresh)
        vectors, sizes, _ = np.linalg.svd(left, full_matrices=False)
        new = vectors[:, sizes > _RANK * max(float(np.abs(fresh).max()), 1e-300)]
        basis, fresh = np.hstack([basis, new]), matrix @ new
    beyond = np.eye(len(names)) - basis @ basis.T
    return tuple(name for name, share in zip(names, np.abs(beyond).max(axis=1, initial=0.0), strict=True) if share > 1e-6)


class Reach(NamedTuple):
    """Stores that inputs cannot move, or outputs cannot show, for any parameters, with the reason by name.

    Empty of a structurally controllable (observable) graph. Made by `reach`.
    """

    unreachable: Mapping[str, str]
    unobservable: Mapping[str, str]


def reach(graph: BondGraph, *, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> Reach:
    """Returns the stores that inputs cannot move, and outputs not show, by causal paths and derivative preference alone.

    A store is within reach of inputs where a causal path leads to it from one, and where it takes derivative causality as
    all stores prefer it, with inputs of either causality; likewise from it to an output, with sensors of either.

    Args:
        graph: the graph; parameters may be open.
        inputs: names of sources; None: all of them.
        outputs: `f_NAME`, `e_NAME`, or states `p_NAME`, `q_NAME`; None: outputs are not examined.

    Raises:
        GraphError: for unknown names, and strokes that contradict each other.

    Source: C. Sueur and G. Dauphin-Tanguy, Journal of the Franklin Institute 328 (1991) 463-494.

    >>> from bondgraph import Builder, C, I, R, Se
    >>> b = Builder().one("a").one("b").on("a", Se("F", 1.0), I("m", 1.0)).on("b", I("n", 2.0), R("d", 1.0))
    >>> reach(b.zero("s").bond("b", "s").on("s", R("r", 1.0), Se("G", lambda f_a: f_a)).build(), inputs=["F"]).unreachable
    {}

    """
    graph = as_graph(graph)
    sources = [e.name for e in graph.of_kind("Se", "Sf")]
    signals = {name: graph.reading(name) for name in outputs or ()}
    refuse(
        [f"input {n!r}: no such source; they are {', '.join(sources) or 'none'}" for n in inputs or () if n not in sources]
        + [
            f"output {n!r}: expected f_NAME, e_NAME or a state p_NAME, q_NAME"
            for n, signal in signals.items()
            if signal is None
        ]
    )
    causes = causality(graph)
    refuse(causes.conflicts)
    needs = _needs(graph, causes)
    ahead: dict[Signal, set[Signal]] = {v: set() for v in needs}
    for variable, others in needs.items():
        for other in others:
            ahead[other].add(variable)
    stores = {n: _one_port_output(graph, n, causes.strokes) for n in causes.integral}

    def beyond(paths: set[Signal], shared: BondGraph, line: Callable[[str], str]) -> dict[str, str]:
        """The stores that no path meets, or that keep integral causality with inputs or sensors of either kind."""
        stiff = causality(shared, "derivative").integral
        lost = {name: line(graph.title(name)) for name, output in stores.items() if output not in paths}
        kept = {n: f"{graph.title(n)} keeps integral causality where all prefer derivative" for n in stiff if n not in lost}
        return lost | kept

    moved = list(sources if inputs is None else inputs)
    reached = set[Signal]().union(*(reached_from(_one_port_output(graph, n, causes.strokes), ahead) for n in moved))
    free = {n: graph.elements[n]._replace(kind="R", law=1.0) for n in moved}
    path = ", ".join(graph.title(n) for n in moved) or "any input"
    freed = replace(graph, elements={**graph.elements, **free}, parts=True)
    lost = beyond(reached, freed, lambda store: f"no causal path leads to {store} from {path}")
    if outputs is None:
        return Reach(lost, {})
    at = {name: Signal(*place) if place[0] in "fe" else stores.get(name[2:]) for name, place in signals.items() if place}
    shown = set[Signal]().union(*(reached_from(v, needs) for v in at.values() if v is not None))
    elements, bonds = dict(graph.elements), list(graph.bonds)
    for name in signals:
        junction = name[2:]
        if elements[junction].kind not in JUNCTIONS:  # one in its bond, that shares what is shown
            port, junction = junction, f"{name} shown"
            elements[junction] = Element("1" if name[0] in "fp" else "0", junction)
            place = next(k for k, b in enumerate(bonds) if port in b[1:])
            inward = bonds[place].head == port
            bonds[place] = bonds[place].moved(port, junction)
            bonds.append(new_bond(bonds, *((junction, port) if inward else (port, junction))))
        elements[f"{name} sensor"] = Element("R", f"{name} sensor", 1.0)
        bonds.append(new_bond(bonds, junction, f"{name} sensor"))
    sensed = replace(graph, elements=elements, bonds=tuple(bonds), parts=True)
    end = ", ".join(signals) or "any output"
    return Reach(lost, beyond(shown, sensed, lambda store: f"no causal path leads from {store} to {end}"))


def _one_port_output(graph: BondGraph, name: str, strokes: Mapping[int, str]) -> Signal:
    """The output variable of a one-port."""
    bond = graph.bond_of(name).number
    return Signal("f" if strokes[bond] == name else "e", bond)


def _needs(graph: BondGraph, causes: Causality) -> dict[Signal, set[Signal]]:
    """The efforts and flows from which each is computed, instantly, over time, or by a law."""
    needs = {variable: set(others) for variable, others in computed_from(graph, causes.strokes).items()}
    for name, element in graph.elements.items():
        answers = [Signal(x, b.number) for b in graph.at(name) for x in "ef" if giver(b, x, causes.strokes) == name]
        read = [n for n in graph.depends_on(name) if element.kind not in JUNCTIONS]
        read = [f"f_{graph.displacements[n].of}" if n in graph.displacements else n for n in read]
        places = [place for n in read if (place := graph.reading(n)) is not None]
        also = {Signal({"p": "f", "q": "e"}.get(letter, letter), bond) for letter, bond in places}
        if name in causes.integral:
            bond = graph.bond_of(name).number
            also.add(Signal("e" if element.kind == "I" else "f", bond))
        for answer in answers:
            needs[answer] |= also
    return needs


def equilibrium(
    graph: BondGraph, *, signals: Mapping[str, Any] | None = None, near: Mapping[str, float] | None = None
) -> dict[str, float]:
    """The state at which all rates vanish, by name.

    Sums of states that no motion changes, such as the liquid in tanks, or the lengths of three springs on two freedoms, are
    those of the initial state of the search. Other displacements that nothing depends on keep their initial value.

    Args:
        graph: with a value for every parameter.
        signals: a number for every declared signal.
        near: states to start the search from; 0 (a displacement: its initial value) for the others.

    Raises:
        GraphError: if none is found, or states remain undetermined.

    >>> from bondgraph import Builder, C, I, R, Se
    >>> b = Builder().one("m").on("m", I("M", 2.0), C("k", stiffness=8.0), R("d", 1.0), Se("F", 4.0))
    >>> equilibrium(b.build())
    {'p_M': 0.0, 'q_k': 0.5}

    """
    dynamics = Dynamics(graph, signals)
    names, at = dynamics.names, partial(field_of(dynamics.within(RateLog())), 0.0)
    start = dict.fromkeys(names, 0.0) | {d.name: float(d.initial) for d in dynamics.form.displacements}
    refuse(f"near {name!r}: no such state; they are {', '.join(names)}" for name in near or {} if name not in names)
    state = np.array([(start | dict(near or {}))[name] for name in names])

    begin, first = state, np.abs(at(state))
    if not np.all(np.isfinite(first)):
        values = ", ".join(f"{name} = {value:g}" for name, value in zip(names, state, strict=True))
        raise GraphError(f"no equilibrium was sought: a law is not defined at {values}; give other states by near=")
    slopes, seen = np.zeros((len(names), len(names))), np.zeros((len(names), 0))
    for _ in range(_MOST):
        rest = at(state)
        slopes = _slopes(at, state) if dynamics.linear is None else dynamics.linear[0]
        rows, columns = _balanced(slopes)
        seen = np.hstack([seen, slopes, rest[:, None]])
        sums = _kept(rows[:, None] * seen) * rows  # of states, that no rate changes
        sums /= np.abs(sums * columns).max(axis=1, initial=0.0)[:, None]
        whole = np.vstack([rows[:, None] * slopes, sums]) * columns
        missing = np.concatenate([rows * rest, sums @ (state - begin)])
        step, part = -columns * np.linalg.lstsq(whole, missing, rcond=_RANK)[0], 1.0
        most = np.linalg.norm(rows * rest)
        while np.any(step) and not np.linalg.norm(rows * at(state + step)) < (1.0 - _LESS * part) * most:
            part, step = 0.5 * part, 0.5 * step if np.any(np.abs(step) > _ROUNDING * np.abs(state)) else 0.0 * step
        state = state + step
        size = columns * np.abs(state / columns).max(initial=0.0)
        if np.all(np.abs(step) <= _SAME * np.abs(state) + _ROUNDING * size):
            break
    scale = np.abs(slopes) @ (np.abs(state) + _ROUNDING * size) + first
    if not np.all(np.abs(at(state)) <= 1e-6 * scale):
        worst = names[int(np.argmax(np.abs(at(state)) / np.where(scale > 0.0, scale, 1.0)))]
        raise GraphError(
            f"no equilibrium was found: {worst} goes on changing, at a rate of {at(state)[names.index(worst)]:.6g}"
        )
    moved = np.abs(whole).max(axis=0, initial=0.0) > 0.0
    _, sizes, directions = np.linalg.svd(whole[:, moved])
    loose = directions[int(np.sum(sizes > _RANK * sizes.max(initial=0.0))) :]
    free = [
        n for n, share in zip(np.array(names)[moved], np.abs(loose).max(axis=0, initial=0.0), strict=True) if share > 1e-6
    ]
    if free:
        raise GraphError(
            f"the equilibrium leaves {', '.join(free)} free: nothing holds what they measure; hold it by a C or R"
        )
    state = np.where(np.abs(state) < _ROUNDING * size, 0.0, state)
    return {name: float(value) + 0.0 for name, value in zip(names, state, strict=True)}


def _balanced(matrix: Array) -> tuple[Array, Array]:
    """Factors of the rows and columns of a matrix that give entries of about 1, for any mixture of units (Ruiz's method)."""
    rows, columns = np.ones(len(matrix)), np.ones(len(matrix))
    for _ in range(_BALANCINGS):
        size = np.abs(rows[:, None] * matrix * columns)
        across, down = size.max(axis=1, initial=0.0), size.max(axis=0, initial=0.0)
        rows, columns = rows / np.sqrt(np.where(across, across, 1.0)), columns / np.sqrt(np.where(down, down, 1.0))
    return rows, columns


def _kept(rates: Array) -> Array:
    """The sums, a row each, that rates (a column each) do not change."""
    sizes = np.abs(rates).max(axis=0, initial=0.0)
    left, shares, _ = np.linalg.svd(rates / np.where(sizes > 0.0, sizes, 1.0), full_matrices=False)
    return np.asarray(left[:, int(np.sum(shares > _SUMS * shares.max(initial=0.0))) :].T)


def _differences(at: Callable[[Array], Array], state: Array) -> Array:
    """The slopes of the rates by differences: of every step, to both sides, (steps, 2, rates, states)."""
    slopes, rest = np.empty((_STEPS.size, 2, state.size, state.size)), at(state)
    with np.errstate(all="ignore"):
        for (j, step), (i, side), k in product(enumerate(_STEPS), enumerate((1.0, -1.0)), range(state.size)):
            beside = state.copy()
            beside[k] += side * step * max(1.0, abs(state[k]))
            slopes[j, i, :, k] = (at(beside) - rest) / (beside[k] - state[k])
    return slopes


def _slopes(at: Callable[[Array], Array], state: Array) -> Array:
    """The slopes of the rates by central differences, each state's with the longest step that a shorter one confirms."""
    central = _differences(at, state).mean(axis=1)
    with np.errstate(all="ignore"):
        change = np.abs(np.diff(central, axis=0)).max(axis=1, initial=0.0) / np.abs(central[:-1]).max(axis=1, initial=1e-300)
    change = np.where(np.isfinite(change), change, np.inf)
    good = change <= _STEADY
    best = np.where(good.any(axis=0), np.argmax(good, axis=0), np.argmin(change, axis=0))
    return np.stack([central[j, :, k] for k, j in enumerate(best)], axis=1) if state.size else np.zeros((0, 0))


def linearize(
    graph: BondGraph,
    *,
    at: Mapping[str, float] | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    signals: Mapping[str, float] | None = None,
) -> Linear:
    """The linear equations of a graph near a state.

    Args:
        graph: with a value for every parameter.
        at: the state by name, 0 by default; None: its equilibrium.
        inputs: names of sources of a plain value and of signals; None: all of them.
        outputs: names of states, `f_NAME`, `e_NAME`; None: the states.
        signals: a number for every declared signal.

    Raises:
        GraphError: for unknown names, laws that cannot be written as formulas, a state at a kink of a law.

    >>> from bondgraph import Builder, C, I, R, Se
    >>> b = Builder().one("m").on("m", I("M", 2.0), C("k", stiffness=8.0), R("d", 1.0), Se("F", 4.0))
    >>> linear = linearize(b.build(), outputs=["f_m"])
    >>> linear.A.tolist(), linear.B.tolist(), linear.C.tolist()
    ([[-0.5, -8.0], [0.5, 0.0]], [[1.0], [0.0]], [[0.5, 0.0]])

    """
    import sympy  # type: ignore[import-untyped]

    graph = as_graph(graph)
    dynamics = Dynamics(graph, signals)
    names, rates_of = dynamics.names, partial(field_of(dynamics.within(RateLog())), 0.0)
    try:
        point = dict.fromkeys(names, 0.0) | dict(equilibrium(graph, signals=signals) if at is None else at)
    except GraphError as error:
        raise GraphError(f"{error}; or give a state to linearize at, by at=") from error
    refuse(f"at {name!r}: no such state; they are {', '.join(names)}" for name in point if name not in names)
    here = Walk(dynamics, 0.0, [point[name] for name in names])

    def value(of: int | PortBond) -> float:
        return float(here.whole(of) if isinstance(of, int) else here.inverse(of, here.value(of.input)))

    twin = Twin(graph)
    read, finish = SymbolicWalk(twin, dynamics.form.of(twin.graph), point=value), twin.finish
    states = [finish(symbol) for symbol in read.state]
    plain = [e.name for e in graph.of_kind("Se", "Sf") if e.name in twin.own]
    symbols = {name: twin.own[name] for name in plain} | {name: finish(twin.places[name]) for name in graph.signals}
    refuse(_unknown(graph, names, inputs or (), outputs or (), symbols))
    moved = tuple(symbols if inputs is None else inputs)
    output_names = tuple(names if outputs is None else outputs)
    read.driven = {}
    rates = read.formulas()
    by_name = dict(zip(names, states, strict=True))
    shown = {name: graph.reading(name) for name in output_names if name not in by_name}
    by_name |= {name: finish(read.whole(read.form.read_variable(*signal))) for name, signal in shown.items() if signal}
    expressions = [by_name[name] for name in output_names]
    symbols_moved = [symbols[name] for name in moved]
    dots = {finish(symbol): name for name, symbol in (*twin.rates.items(), *read.driven.items())}
    driven: dict[str, tuple[str, ...]] = {}
    for name, row in zip((*(f"{_RATE}{n}" for n in names), *output_names), (*rates, *expressions), strict=True):
        for of in (dots[symbol] for symbol in row.free_symbols & dots.keys() if dots[symbol] in moved):
            driven[of] = (*driven.get(of, ()), name)
    rates, expressions = ([row.xreplace(dict.fromkeys(dots, 0)) for row in rows] for rows in (rates, expressions))
    every = [*states, *symbols.values()] if dynamics.linear is not None else None
    matrices = tuple(_jacobian(rows, by, every) for rows in (rates, expressions) for by in (states, symbols_moved))
    numbers = dict(twin.values) | {symbol: point[name] for symbol, name in zip(states, names, strict=True)}
    numbers |= {finish(twin.places[name]): float((signals or {})[name]) for name in graph.signals}
    filled = {symbol: sympy.Float(value, 17) for symbol, value in {**numbers, finish(twin.places[TIME]): 0.0}.items()}
    A, B, C, D = (np.zeros(m.shape) for m in matrices)
    for numeric, symbolic in zip((A, B, C, D), matrices, strict=True):
        for place, slope in symbolic.todok().items():
            numeric[place] = full_digits(slope.xreplace(filled))
    _check_kinks(dynamics, rates_of, point, A)
    return Linear(
        names, moved, output_names, point, A, B, C, D, (matrices[0], matrices[1], matrices[2], matrices[3]), driven
    )


def _jacobian(rows: Sequence[Any], by: Sequence[Any], every: Sequence[Any] | None) -> Any:
    """The slopes of expressions, with real symbols, because |x| has no slope otherwise; sign(x) has the slope 0.

    Those of straight lines through 0 in `every` symbol are their values at 1 and 0.
    """
    import sympy

    def steps(part: Any) -> bool:
        return isinstance(part, sympy.DiracDelta) or (isinstance(part, sympy.Derivative) and part.expr.func == sympy.sign)

    symbols = set(by).union(*(row.free_symbols for row in rows))
    slopes, real = {}, {symbol: sympy.Dummy(symbol.name, real=True) for symbol in symbols}
    back, still = {dummy: symbol for symbol, dummy in real.items()}, dict.fromkeys(every or (), 0)
    for i, row in enumerate(rows):
        smooth, used = row.xreplace(real) if every is None else row, row.free_symbols
        for j in (j for j, symbol in enumerate(by) if symbol in used):
            if every is None:
                slope = smooth.diff(real[by[j]]).replace(steps, lambda part: sympy.S.Zero).xreplace(back)
            else:
                slope = row.xreplace({**still, by[j]: 1})
            slopes[i, j] = slope
    return sympy.Matrix(sympy.SparseMatrix(len(rows), len(by), slopes))


def _unknown(graph: BondGraph, names: Sequence[str], inputs: Any, outputs: Any, symbols: Any) -> list[str]:
    faults = []
    for name in inputs:
        if name in graph.elements and graph.elements[name].kind in ("Se", "Sf") and name not in symbols:
            faults.append(f"input {name!r}: {graph.where(name)} has a law of its own; give it as a number or a signal")
        elif name not in symbols:
            faults.append(f"input {name!r}: no such source or signal; they are {', '.join(symbols) or 'none'}")
    strange = [name for name in outputs if name not in names and graph.reading(name) is None]
    return faults + [f"output {n!r}: expected a state ({', '.join(names)}), f_NAME or e_NAME" for n in strange]


def _check_kinks(dynamics: Dynamics, at: Callable[[Array], Array], point: Mapping[str, float], slopes: Array) -> None:
    """Raises if the slopes of the rates to both sides differ, whatever the step."""
    names = dynamics.names
    state = np.array([point[name] for name in names])
    rows, columns = _balanced(slopes)
    apart = rows[:, None] * np.abs(_differences(at, state) - slopes) * columns
    apart = np.where(np.isfinite(apart), apart, np.inf).max(axis=(1, 2), initial=0.0)
    for k, name in enumerate(names):
        near = _STEPS * max(1.0, abs(state[k])) >= _BESIDE * abs(state[k])
        if apart[near, k].min() > _KINK:
            step = _BESIDE * (abs(state[k]) or 1.0) * np.eye(len(names))[k]
            walks = [Walk(dynamics, 0.0, (state + side * step).tolist()) for side in (-2.0, -1.0, 0.0, 1.0, 2.0)]
            ports = [p for p in (*dynamics.form.stores, *dynamics.form.acting) if isinstance(p.element.law, Function)]
            bends = [float(np.abs(np.diff([walk.value(p.output) for walk in walks], 2)).max()) for p in ports]
            where = dynamics.graph.where(ports[int(np.argmax(bends))].element.name) if any(bends) else "a law"
            raise GraphError(f"linearize: {where} has a kink at {name} = {point[name]:g}, with another slope to either side")
