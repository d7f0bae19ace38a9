import numpy as np

from bondgraph import DOMAINS

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
