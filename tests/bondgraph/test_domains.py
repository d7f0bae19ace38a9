from bondgraph.domains import DOMAINS


def test_every_domain_names_its_four_quantities():
    assert {"translation", "rotation", "electric", "magnetic", "hydraulic", "thermal", "chemical"} == set(DOMAINS)
    assert DOMAINS["rotation"].effort.unit == "N m"
    assert DOMAINS["hydraulic"].flow.unit == "m^3/s"
