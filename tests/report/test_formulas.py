"""One text is shown as a formula, shown with numbers, and worked out."""

import math

import pytest

from flywheel import language
from flywheel.report import formulas
from flywheel.report.formulas import FormulaError, Quantity


def alttext(shown: str) -> str:
    return shown.split('alttext="')[1].split('"')[0]


@pytest.mark.parametrize(
    ("formula", "told"),
    [
        ("J = (W_max - W_min)/(epsilon*omega**2)", "J = (W_max − W_min)/(ε ω^2)"),
        ("y = a - (b - c)", "y = a − (b − c)"),
        ("y = a - b - c", "y = a − b − c"),
        ("y = (a/b)**2", "y = (a/b)^2"),
        ("y = -(a + b)/c", "y = (−(a + b))/c"),
        ("y = a/(b*c)", "y = a/(b c)"),
        ("x = sqrt(l**2 - (r*sin(phi))**2)", "x = √(l^2 − (r sin(φ))^2)"),
        ("W(phi) = integral(M_star(psi), psi, 0, phi)", "W(φ) = ∫ from 0 to φ of M*(ψ) dψ"),
        ("a = b = c", "a = b = c"),
    ],
)
def test_a_formula_is_read_out_as_it_is_meant(formula, told):
    assert alttext(formulas.mathml(formula)) == told


def test_numbers_stand_in_brackets_where_they_would_be_misread():
    numbers = {"a": Quantity("a", 2.0, "m"), "b": Quantity("b", -3.0, "m")}
    assert alttext(formulas.mathml("y = a - b", numbers)) == "y = 2 m − (−3 m)"
    assert alttext(formulas.mathml("y = a**2", numbers)) == "y = (2 m)^2"
    assert alttext(formulas.mathml("y = a*b", numbers)) == "y = 2 m · (−3 m)"


def test_numbers_have_the_decimal_mark_of_the_language_and_powers_of_ten():
    with language.use("es"):
        assert alttext(formulas.equation(Quantity("omega", 6.283185307, "rad/s"))) == "ω = 6,28319 rad/s"
    assert formulas.number_shown(Quantity("", -1.2e-7, "J")).text == "−1.2·10⁻⁷ J"
    assert formulas.bare(Quantity("phi", math.pi / 6, "°")) == "30"


def test_a_formula_is_worked_out_in_si():
    assert formulas.value("y = sin(phi)/2", {"phi": Quantity("phi", math.pi / 6, "°").shown}) == pytest.approx(0.25)
    assert formulas.symbols("y = a*sin(phi) + pi") == {"a", "phi"}
    assert not formulas.computable("W = integral(M, phi, 0, Phi)")
    with pytest.raises(FormulaError, match="worked out"):
        formulas.value("y = a", {})
    with pytest.raises(FormulaError, match="no formula"):
        formulas.mathml("y = (a")


def test_a_long_sum_has_several_rows():
    numbers = {f"W_{k}": Quantity(f"W_{k}", 1234.567 * k, "J") for k in range(1, 12)}
    shown = formulas.mathml("W = " + " + ".join(numbers), numbers)
    assert shown.count("<mtr>") > 1
    assert alttext(shown).count("J") == 11


def test_names_of_a_scene_are_indices():
    assert formulas.symbol_text(f"g_{formulas.index('scotch-yoke.yoke')}") == "g_scotch-yoke.yoke"
    assert formulas.symbol_text("DeltaW") == "ΔW"
