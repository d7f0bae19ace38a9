"""What is no bond graph is refused, every fault at once, a line each."""

import math

import pytest

from bondgraph import (
    GY,
    TF,
    Bond,
    BondGraph,
    Builder,
    C,
    Displacement,
    Dynamics,
    Element,
    GraphError,
    I,
    Law,
    Motion,
    One,
    R,
    Reduction,
    Se,
    Sf,
    as_data,
    causality,
    draw,
    simplify,
    simulate,
    table,
)


def shaft() -> Builder:
    """A sound graph to spoil: bond 1 is M -> a, bond 2 is a -> J."""
    return Builder().one("a", displacement="x").parameter(k=2.0).signal("u").on("a", Se("M", 1.0), I("J", 2.0))


def added(b: Builder, *elements: Element) -> Builder:
    for element in elements:
        b.add(element)
    return b


def rotation_and_translation() -> Builder:
    b = Builder().one("crank", "rotation").on("crank", Se("M", 1.0), I("J", 2.0))
    return b.one("ram", "translation").on("ram", I("m", 1.0))


def faults(builder: Builder) -> list[str]:
    with pytest.raises(GraphError) as caught:
        builder.build(loose=True)
    return str(caught.value).splitlines()


TWICE = "is declared twice, as two of displacement, signal and parameter"
UNDECLARED = "which is no declared displacement, signal or parameter, nor t"
STORE = "a store's law may hold parameters only"
NO_VALUE = "has no value; give it a number or a function"
JOINED = "are joined without a transducer; put a TF or GY between them"
NO_LAW = "expected a number, a function of named quantities or a SymPy expression"

ELEMENTS_AND_BONDS = {
    "to nobody": (
        shaft().bond("a", "nowhere"),
        ["bond 3: no element 'nowhere' to join 1:a to; the junctions are a"],
    ),
    "nearly a name": (
        Builder().one("shaft").on("shfat", I("J", 1.0)),
        ["bond 1: no element 'shfat' to join I:J to; did you mean 'shaft'?"],
    ),
    "one-port": (shaft().bond("a", "J"), ["I:J has 2 bonds, a one-port has 1"]),
    "no junction": (
        added(Builder(), Se("M", 1.0), I("J", 1.0)).bond("M", "J"),
        ["bond 1: joins Se:M and I:J directly; put a 1- or 0-junction between them"],
    ),
    "islands": (shaft().one("b").on("b", I("m", 1.0), R("r", 1.0)), ["not connected to the rest: b, m, r"]),
    "nothing": (Builder(), ["the graph is empty"]),
}
NAMES = {
    "of nobody": (
        shaft().displacement("y", "nowhere"),
        ["displacement 'y': 'nowhere' is no 1-junction of the graph"],
    ),
    "of a one-port": (shaft().displacement("y", "J"), ["displacement 'y': 'J' is no 1-junction of the graph"]),
    "of a 0-junction": (
        shaft().zero("n").bond("a", "n").port("n", C("c", 1.0)).displacement("y", "n"),
        ["displacement 'y': 'n' is no 1-junction of the graph"],
    ),
    "nan": (
        shaft().displacement("y", "a", math.nan),
        ["displacement 'y': found initial value nan, expected a finite number"],
    ),
    "twice": (shaft().signal("x").parameter(u=1.0), [f"'u' {TWICE}", f"'x' {TWICE}"]),
    "time": (shaft().signal("t"), ["'t' is declared, but always means the time"]),
    **{
        f"parameter {value}": (
            shaft().parameter(p=value),
            [f"parameter 'p': found {value!r}, expected a finite number, or None where it is still open"],
        )
        for value in (math.nan, math.inf, "2", [1.0])
    },
}
LAWS = {
    "undeclared": (
        shaft().on("a", Se("F", lambda x, y, k, u, t: x)),
        [f"MSe:F, bond 3: depends on 'y', {UNDECLARED}"],
    ),
    "modulus": (
        shaft().one("b").transform("a", "b", lambda phi: phi, name="T"),
        [f"MTF:T, bond 3, bond 4: depends on 'phi', {UNDECLARED}"],
    ),
    "another's own": (
        shaft().on("a", R("r", lambda q: q), C("c", lambda f: f)),
        [
            f"R:r, bond 3: depends on 'q', {UNDECLARED}; its own flow is f",
            f"C:c, bond 4: depends on 'f', {UNDECLARED}; its own displacement is q",
        ],
    ),
    "no own": (shaft().on("a", Se("F", lambda f: f)), [f"MSe:F, bond 3: depends on 'f', {UNDECLARED}"]),
    "inertia": (shaft().on("a", I("m", lambda x, k: x * k)), [f"I:m, bond 3: varies with x; {STORE}"]),
    "compliance": (
        shaft().on("a", C("c", lambda q, x, t: q * x * t)),
        [f"C:c, bond 3: varies with x, t; {STORE}; its own displacement is q"],
    ),
    "missing": (shaft().on("a", C("c")), [f"C:c, bond 3: {NO_VALUE}"]),
    "none": (shaft().on("a", Se("F", None)), [f"Se:F, bond 3: {NO_VALUE}"]),
    "nan": (shaft().on("a", R("r", math.nan)), ["R:r, bond 3: found nan, expected a finite number"]),
    "inf": (shaft().on("a", R("r", -math.inf)), ["R:r, bond 3: found -inf, expected a finite number"]),
    "zero": (
        shaft().on("a", C("c", 0.0)),
        ["C:c, bond 3: found compliance 0, expected another number; a rigid joint is left out"],
    ),
    **{
        f"{value}": (shaft().on("a", R("r", value)), [f"R:r, bond 3: found {value!r}, {NO_LAW}"])
        for value in ("3 * x", [1.0], 1j)
    },
}
DOMAINS_AND_SOURCES = {
    "two domains": (
        rotation_and_translation().bond("crank", "ram"),
        [f"bond 4: 1:crank (rotation) and 1:ram (translation) {JOINED}"],
    ),
    "through one without": (
        rotation_and_translation().one("middle").bond("crank", "middle").bond("middle", "ram"),
        [f"bond 1, 2, 3, 4, 5: 1:crank (rotation) and 1:ram (translation) {JOINED}"],
    ),
    "one-ports": (
        shaft().on("a", R("r", 1.0, "electric"), C("c", 1.0, "rotation")),
        [f"bond 1, 2, 3, 4: R:r (electric) and C:c (rotation) {JOINED}"],
    ),
    "two flows": (
        shaft().on("a", Sf("v", 1.0), Sf("w", 2.0)),
        ["Sf:v (bond 3) and Sf:w (bond 4) both set the flow of 1:a; keep one of them"],
    ),
    "two efforts": (
        Builder().zero("n").on("n", Se("p", 1.0), Se("s", 2.0), C("c", 1.0)),
        ["Se:p (bond 1) and Se:s (bond 2) both set the effort of 0:n; keep one of them"],
    ),
    "equal junctions": (
        shaft().on("a", Sf("v", 1.0)).one("b").one("c").bond("a", "b").bond("b", "c").on("c", Sf("w", 1.0)),
        ["Sf:v (bond 3) and Sf:w (bond 6) both set the flow of 1:a; keep one of them"],
    ),
}
CASES = [*ELEMENTS_AND_BONDS.items(), *NAMES.items(), *LAWS.items(), *DOMAINS_AND_SOURCES.items()]


@pytest.mark.parametrize(("builder", "expected"), [case for _, case in CASES], ids=[name for name, _ in CASES])
def test_what_is_wrong_is_said_and_nothing_else(builder, expected):
    assert faults(builder) == expected


@pytest.mark.parametrize(
    ("builder", "line"),
    [
        (shaft().bond("a", "a"), "bond 3: joins 'a' to itself"),
        (added(shaft(), Sf("v", lambda t: t)), "MSf:v has 0 bonds, a one-port has 1"),
        (shaft().one("b"), "1:b has no bond"),
        (shaft().zero("n"), "0:n has no bond"),
        *(
            (
                added(shaft().one("b").on("b", I("m", 1.0)), made).bond("a", "T").bond("b", "T"),
                f"{made.kind}:T has 2 bonds in and 0 out, expected 1 and 1",
            )
            for made in (TF("T", 2.0), GY("T", 2.0))
        ),
        (
            Builder().one("b", "rotational").on("b", Se("M", 1.0), I("J", 1.0)),
            "1:b: found domain 'rotational', expected one of translation, rotation, electric, magnetic, hydraulic, thermal, "
            "chemical",
        ),
    ],
)
def test_what_is_wrong_is_said_among_what_follows_from_it(builder, line):
    assert line in faults(builder)


@pytest.mark.parametrize(
    ("elements", "bonds", "displacements", "expected"),
    [
        ([Element("X", "a"), One("b")], [Bond(1, "a", "b")], (), ["X:a: no such kind of element"]),
        (
            [One("a"), I("J", 1.0), Se("M", 1.0)],
            [Bond(1, "a", "J"), Bond(1, "M", "a")],
            (),
            ["two bonds are numbered 1"],
        ),
        (  # faults that hide others come first
            [Element("X", "a"), Element("Y", "b"), I("J", math.nan)],
            [Bond(1, "a", "c")],
            (),
            [
                "X:a: no such kind of element",
                "Y:b: no such kind of element",
                "bond 1: no element 'c' to join X:a to; the junctions are none",
            ],
        ),
        (
            [One("a"), I("J", 1.0)],
            [Bond(1, "a", "J")],
            [Displacement("x", "J")],
            ["displacement 'x': 'J' is no 1-junction of the graph"],
        ),
    ],
)
def test_graphs_without_a_builder_are_checked_too(elements, bonds, displacements, expected):
    with pytest.raises(GraphError) as caught:
        BondGraph({e.name: e for e in elements}, tuple(bonds), {d.name: d for d in displacements})
    assert str(caught.value).splitlines() == expected


def test_elements_listed_under_another_name():
    with pytest.raises(GraphError, match="I:J is listed as 'K'; use its own name"):
        BondGraph({"a": One("a"), "K": I("J", 1.0)}, (Bond(1, "a", "K"),))


def test_what_is_sound_has_no_faults():
    sound = shaft().on("a", R("r", lambda f, x, t: f * x * t), C("c", lambda q, k: k * q**3)).build()
    assert (sound.depends_on("r"), sound.depends_on("c")) == (("x", "t"), ())
    assert shaft().on("a", Se("F", Law(lambda here, anchor: here.q, Motion("a")))).build().symbol("F") == "MSe"
    assert rotation_and_translation().transform("crank", "ram", 0.5).build().domain(Bond(4, "", "")).name == "rotation"
    rivals = Builder().one("a").on("a", Se("M", 1.0), Se("N", 2.0), Sf("v", 1.0)).one("b").on("b", Sf("w", 1.0))
    assert len(rivals.between("a", "b", C("c", 1.0)).build().bonds) == 7


def test_faults_of_every_sort_come_at_once():
    b = shaft().on("a", C("c"), R("r", lambda y: y), Sf("v", 1.0), Sf("w", 1.0)).displacement("z", "J").signal("x")
    b.one("b", "rotational").on("b", I("m", math.nan))
    found = "\n".join(faults(b))
    for part in ("not connected", "'z'", "'x' is declared twice", "C:c", "'y'", "I:m", "'rotational'", "both set the flow"):
        assert part in found


@pytest.mark.parametrize("use", [simulate, table, causality, draw, simplify, as_data, Dynamics, Reduction])
def test_a_builder_in_place_of_a_graph_is_told_to_build(use):
    given = Builder().one("a").on("a", I("J", 1.0))
    with pytest.raises(GraphError, match=r"found a Builder, expected a BondGraph; call its build\(\) first"):
        use(given, 1.0) if use in (simulate, Reduction) else use(given)


@pytest.mark.parametrize("wrong", ["I", None, [I("J", 1.0)], 3.0])
def test_what_is_no_element_cannot_be_hung(wrong):
    with pytest.raises(GraphError, match="expected an element, such as I"):
        Builder().one("a").on("a", wrong)
