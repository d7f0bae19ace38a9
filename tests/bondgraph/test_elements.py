from bondgraph import GY, TF, Builder, C, I, Law, One, Se
from bondgraph.elements import Motion


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
