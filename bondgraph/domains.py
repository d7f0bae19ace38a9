"""The energy domains: what effort, flow, momentum and displacement are called in each, and their units."""

from __future__ import annotations

from typing import NamedTuple


class Quantity(NamedTuple):
    """The name of a physical quantity and its SI unit."""

    name: str
    unit: str


class Domain(NamedTuple):
    """An energy domain: effort times flow is power; momentum and displacement are their integrals over time.

    >>> DOMAINS["hydraulic"].effort, DOMAINS["hydraulic"].displacement.unit
    (Quantity(name='pressure', unit='Pa'), 'm^3')
    """

    name: str
    effort: Quantity
    flow: Quantity
    momentum: Quantity
    displacement: Quantity


def _domain(name: str, *pairs: tuple[str, str]) -> Domain:
    effort, flow, momentum, displacement = (Quantity(*pair) for pair in pairs)
    return Domain(name, effort, flow, momentum, displacement)


DOMAINS: dict[str, Domain] = {
    domain.name: domain
    for domain in (
        _domain(
            "translation",
            ("force", "N"),
            ("velocity", "m/s"),
            ("momentum", "N s"),
            ("displacement", "m"),
        ),
        _domain(
            "rotation",
            ("torque", "N m"),
            ("angular velocity", "rad/s"),
            ("angular momentum", "N m s"),
            ("angle", "rad"),
        ),
        _domain("electric", ("voltage", "V"), ("current", "A"), ("flux linkage", "V s"), ("charge", "C")),
        _domain(
            "magnetic",
            ("magnetomotive force", "A"),
            ("flux rate", "Wb/s"),
            ("-", "-"),
            ("magnetic flux", "Wb"),
        ),
        _domain(
            "hydraulic",
            ("pressure", "Pa"),
            ("volume flow", "m^3/s"),
            ("pressure momentum", "Pa s"),
            ("volume", "m^3"),
        ),
        _domain("thermal", ("temperature", "K"), ("entropy flow", "W/K"), ("-", "-"), ("entropy", "J/K")),
        _domain(
            "chemical",
            ("chemical potential", "J/mol"),
            ("molar flow", "mol/s"),
            ("-", "-"),
            ("amount of substance", "mol"),
        ),
    )
}
