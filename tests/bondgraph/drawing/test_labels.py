import pytest

from bondgraph import Builder, I, R, Se
from bondgraph.drawing.layout import labels, mathtext, plain, short_names, width
from tests.bondgraph.drawing.drawn_graphs import condensed, hub, motor


def test_labels_say_symbol_name_and_what_a_law_varies_with():
    found = labels(condensed())
    assert found["T"][:2] == ("MTF", ("T(theta)",))
    assert found["J"][:2] == ("I", ("J",))
    assert found["crank"] == ("1", ("crank",), True)


def test_names_that_only_join_their_neighbours_are_left_out():
    found = labels(motor())
    assert found["rotor-crank"].lines == ()
    assert found["rotor-crank.rate"].lines == ()
    assert labels(hub())["crank->cylinder0.rod.com.x"][:2] == ("TF", ("2",))


def test_a_shared_first_part_is_left_out_where_the_rest_is_clear():
    b = Builder().one("press.rod").on("press.rod", I("press.mass[0]", 1.0), Se("load", 1.0), Se("drive.torque", 1.0))
    assert short_names(b.build()) == {
        "press.rod": "rod",
        "press.mass[0]": "mass[0]",
        "load": "load",
        "drive.torque": "drive.torque",
    }


def test_first_parts_stay_where_anything_would_be_told_apart_no_more():
    names = short_names(hub(2))
    assert names["cylinder0.mass[0]"] == "cylinder0.mass[0]"
    b = Builder().one("rod").on("rod", I("press.rod", 1.0), R("press.B", 1.0))
    assert short_names(b.build())["press.B"] == "press.B"


def test_long_names_wrap_at_their_dots_and_lose_nothing():
    lines = labels(hub())["cylinder0.rod.com.x"].lines
    assert lines == ("cylinder0.", "rod.com.x")
    assert all("".join(label.lines) in {*hub().elements, "2", ""} for label in labels(hub()).values())


@pytest.mark.parametrize(
    ("name", "tex", "read"),
    [
        ("theta", r"$\theta$", "θ"),
        ("m_1x", "$m_{1x}$", "m1x"),
        ("omega2", r"$\omega_{2}$", "ω2"),
        ("damping", "damping", "damping"),
        ("Jm", "Jm", "Jm"),
        ("mass[0]", "mass[0]", "mass[0]"),
        ("3.5", "3.5", "3.5"),
        ("a$b", r"a\$b", "a$b"),
    ],
)
def test_single_and_greek_letters_are_symbols_and_words_stay_words(name, tex, read):
    assert mathtext(name) == tex
    if "$" not in name:
        assert plain(name) == read


def test_width_grows_with_the_text_and_the_font():
    assert width("I:mm", 10.0) > width("I:m", 10.0)
    assert width("I:m", 20.0) == pytest.approx(2.0 * width("I:m", 10.0))
