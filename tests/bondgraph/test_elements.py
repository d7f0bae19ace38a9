"""Energy domains and their units, and how elements are drawn."""

import numpy as np

from bondgraph import DOMAINS, GY, TF, Builder, C, I, Law, Motion, One, Se

EXPONENTS = {  # of kg, m, s, A, K, mol
    "N": (1, 1, -2, 0, 0, 0), "m": (0, 1, 0, 0, 0, 0), "s": (0, 0, 1, 0, 0, 0), "rad": (0, 0, 0, 0, 0, 0),
    "V": (1, 2, -3, -1, 0, 0), "A": (0, 0, 0, 1, 0, 0), "C": (0, 0, 1, 1, 0, 0), "Wb": (1, 2, -2, -1, 0, 0),
    "Pa": (1, -1, -2, 0, 0, 0), "m^3": (0, 3, 0, 0, 0, 0), "K": (0, 0, 0, 0, 1, 0), "W": (1, 2, -3, 0, 0, 0),
    "J": (1, 2, -2, 0, 0, 0), "mol": (0, 0, 0, 0, 0, 1),
}  # fmt: skip
SI = {unit: np.array(exponents) for unit, exponents in EXPONENTS.items()}


def dimension(unit):
    """The exponents of a unit such as `N m/s`."""
    above, _, below = unit.partition("/")
    return sum(SI[part] for part in above.split()) - sum(SI[part] for part in below.split())


def times(*units):
    return sum(map(dimension, units))


def test_effort_times_flow_is_power_in_every_domain():
    assert {"translation", "rotation", "electric", "magnetic", "hydraulic", "thermal", "chemical"} == set(DOMAINS)
    for domain in DOMAINS.values():
        assert (times(domain.effort.unit, domain.flow.unit) == dimension("W")).all(), domain.name


def test_momentum_and_displacement_are_integrals_over_time():
    for domain in DOMAINS.values():
        assert (dimension(domain.displacement.unit) == times(domain.flow.unit, "s")).all(), domain.name
        if domain.momentum.unit != "-":
            assert (dimension(domain.momentum.unit) == times(domain.effort.unit, "s")).all(), domain.name


def test_modulated_elements_show_an_m():
    law = Law(lambda here, anchor: here.q, Motion("crank"))
    b = Builder()
    b.add(One("crank"))
    b.port("crank", Se("F", law))
    b.port("crank", C("spring", law))
    graph = b.build()
    assert "MSe:F -> 1:crank" in str(graph)
    assert graph.at("spring")[0].head == "spring"


def test_plain_numbers_leave_an_element_unmodulated():
    assert [e.symbol for e in (Se("s", 1.0), I("i", 2.0), TF("t", 3.0), GY("g", 4.0), One("j"))] == [
        "Se",
        "I",
        "TF",
        "GY",
        "1",
    ]
