"""Any scene ends in a result or in a fault with its place."""

import ast
import math
import re
from pathlib import Path

import mpmath as mp
import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import flywheel
from flywheel import SceneError
from flywheel.numerics.budget import BudgetError, limited, spend
from flywheel.numerics.expressions import parse
from flywheel.numerics.jets import Jet, jet_namespace
from tests.fuzzing.mutants import KINDS, mutant
from tests.fuzzing.running import (
    BY_CHANCE,
    BY_HAND,
    DEAR,
    NOT_REACHED,
    REFUSED,
    SCENES,
    Watched,
    again,
    as_expected,
    judged,
    tried,
    watched,
    way_of,
)
from tests.limits import sample

# A few of the mutants in every run, and mutants that once failed.


SAMPLE = range(7_000_000, 7_000_150)
_ONCE_FAILED = [
    *sample([name for name in SCENES if name not in (*BY_HAND, *DEAR)], 6),
    *(pytest.param(name, marks=pytest.mark.slow) for name in DEAR),
]


@pytest.mark.parametrize("seed", sample([seed for seed in SAMPLE if way_of(seed) == "library"][:60], 6))
def test_a_mutant_is_sized_or_refused(seed):
    result = tried(seed)
    assert result.verdict.outcome != "failed", result.verdict.detail


@pytest.mark.parametrize("seed", sample([seed for seed in SAMPLE if way_of(seed) not in ("library", "time", "size")][:8], 3))
def test_a_mutant_goes_through_a_command(seed):
    result = tried(seed)
    assert result.verdict.outcome != "failed", result.verdict.detail


def test_mutants_are_the_same_every_time_and_of_every_kind():
    assert mutant(12345) == mutant(12345)
    seen = set()
    for seed in SAMPLE:
        seen.add(mutant(seed).kind)
        if seen == set(KINDS):
            break
    assert seen == set(KINDS)


@pytest.mark.parametrize("name", _ONCE_FAILED)
def test_what_once_failed(name):
    outcome, detail, *_ = again(name)
    assert as_expected(name, outcome, detail), f"{outcome}: {detail}"


def test_an_outcome_is_expected_by_name():
    assert {*REFUSED, *NOT_REACHED, *BY_CHANCE, *BY_HAND} <= set(SCENES)
    assert as_expected("many_assemblies", "refused", REFUSED["many_assemblies"])
    assert not as_expected("many_assemblies", "refused", "another fault")
    assert not as_expected("many_assemblies", "sized", "")
    assert not as_expected("enormous quantity", "refused", "")


@pytest.mark.parametrize(
    ("deed", "seen"),
    [
        (lambda folder: exec("1"), r"exec '<string>'"),
        (lambda folder: eval("1"), r"exec '<string>'"),
        (lambda folder: (folder / "canary").write_text("x"), r"open '.*canary'"),
        (lambda folder: Path("/etc/hostname").open().close(), r"open '/etc/hostname'"),
        (lambda folder: __import__("subprocess").run(["true"], check=True), r"subprocess\.Popen"),
        (lambda folder: __import__("os").system("true"), r"os\.system"),
        (lambda folder: __import__("socket").socket().close(), r"socket\."),
        (lambda folder: __import__("warnings").warn("x", stacklevel=1), r"UserWarning: x"),
    ],
    ids=["exec", "eval", "write", "read", "process", "shell", "socket", "warning"],
)
def test_the_watch_sees_what_must_not_be(deed, seen, tmp_path):
    results: list[Watched] = []
    with watched(tmp_path, 2.0, results):
        deed(tmp_path)
    assert any(re.search(seen, line) for line in results[0].seen), results[0].seen


def test_the_watch_sees_no_harm_in_reading_a_scene(tmp_path):
    (tmp_path / "scene.toml").write_text("title = 'x'")
    results: list[Watched] = []
    with watched(tmp_path, 2.0, results):
        (tmp_path / "scene.toml").read_text()
    assert results[0].seen == []


def test_a_verdict_tells_a_hang(monkeypatch):
    def never(path):
        while True:
            pass

    monkeypatch.setattr("flywheel.load", never)
    monkeypatch.setattr("tests.fuzzing.running.WORK", 5)
    assert judged(mutant(1)).detail.startswith("too slow")


def test_a_verdict_tells_a_traceback(monkeypatch):
    def wrong(path):
        raise KeyError("x")

    monkeypatch.setattr("flywheel.load", wrong)
    verdict = judged(mutant(1))
    assert verdict.outcome == "failed"
    assert verdict.detail.startswith("KeyError")


def test_a_table_of_too_many_lines_is_refused_before_it_is_taken_apart(tmp_path):
    (tmp_path / "t.csv").write_text("0,1\n" * 40_001)
    (tmp_path / "scene.toml").write_text(
        'load = [{on = "crank", table = {file = "t.csv"}}]\nregime.speed = 1\nflywheel.inertia = 1'
    )
    with pytest.raises(SceneError, match=r'table\.file .*: found 40001 lines in "t\.csv", expected at most 40000'):
        flywheel.load(tmp_path / "scene.toml")


def test_a_search_is_given_up_after_so_much_work():
    spend(1e12)  # without a limit
    with limited(10.0):
        spend(6.0)
        with limited(100.0):
            spend(50.0)
        with pytest.raises(BudgetError, match="no steady motion within the search limit"):
            spend(6.0)
    spend(1e12)


# Expressions of the whole grammar: values are Python's own, slopes of jets those of 50-digit differences.


NAMES = ("phi", "x", "F")
FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log")
_PLAIN = {name: getattr(math, name) for name in FUNCTIONS} | {"atan2": math.atan2, "pi": math.pi}
_PLAIN |= {"abs": abs, "min": min, "max": max, "sign": lambda u: (u > 0) - (u < 0)}
_LONG = {name: getattr(mp, name) for name in (*FUNCTIONS, "atan2", "sign")} | {"abs": abs, "min": min, "max": max}
_JETS = jet_namespace(np)
_MORE = {"derandomize": True, "deadline": None, "suppress_health_check": [HealthCheck.filter_too_much, HealthCheck.too_slow]}

_numbers = st.sampled_from(["0", "1", "2", "3", "0.5", "1.25", "7e-1", "12", "1e2", ".3", "pi"])
_names = st.sampled_from(NAMES)


def _larger(inner):
    one = st.builds("{}({})".format, st.sampled_from([*FUNCTIONS, "abs", "sign"]), inner)
    two = st.builds("({} {} {})".format, inner, st.sampled_from(["+", "-", "*", "/"]), inner)
    power = st.builds("({})**{}".format, inner, st.sampled_from(["2", "3", "-1", "0.5", "1.5", "0", "(-2)", "8"]))
    choice = st.builds("({} if {} < {} else {})".format, inner, inner, inner, inner)
    chosen = st.builds("{}({}, {})".format, st.sampled_from(["min", "max", "atan2"]), inner, inner)
    test = st.builds("({} {} {})".format, inner, st.sampled_from(["<", "<=", ">", ">="]), inner)
    logic = st.builds("(({} < {}) {} (not {} > 1))".format, inner, inner, st.sampled_from(["and", "or"]), inner)
    return one | two | two | power | choice | chosen | test | logic | st.builds("-{}".format, inner)


formulas = st.recursive(_names | _numbers, _larger, max_leaves=8)
places = st.fixed_dictionaries({name: st.floats(-3, 7).map(lambda value: round(value, 3)) for name in NAMES})


def _by_python(text, values):
    """Python's value of a text whose tree holds nothing that the grammar does not; None where it has none."""
    tree = ast.parse(text, mode="eval")
    assert not any(isinstance(node, (ast.Attribute, ast.Subscript, ast.Lambda)) for node in ast.walk(tree))
    try:
        result = eval(compile(tree, "<test>", "eval"), {"__builtins__": {}}, _PLAIN | values)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):  # the first: a complex number compared
        return None
    return None if isinstance(result, complex) else float(result)


@settings(max_examples=50, **_MORE)
@given(formulas, places)
def test_values_are_those_of_python(text, values):
    expected = _by_python(text, values)
    near = [_by_python(text, values | {name: value + 1e-10}) for name, value in values.items()]
    assume(expected is not None and None not in near)
    assume(all(abs(other - expected) <= 1e-7 * max(1.0, abs(expected)) for other in near))  # no jump, no pole
    result = float(parse(text, frozenset({"F"})).evaluate(values, np))
    assert math.isclose(result, expected, rel_tol=1e-10, abs_tol=1e-10), (text, values)


def _decided(expression, values):
    """Tests whether no branch is about to change."""
    return all(abs(switch.evaluate(values, np)) > 1e-3 for switch in expression.switches())


def _long_slope(text, values, of=1):
    """First or second slope by phi with 50 digits; None where the two sides differ, or there is none."""
    with mp.workdps(50):
        names = _LONG | {"pi": mp.pi} | {name: mp.mpf(repr(value)) for name, value in values.items()}
        step = mp.mpf(10) ** -15
        code = compile(text, "<test>", "eval")
        try:
            ends = [mp.mpf(eval(code, {"__builtins__": {}}, names | {"phi": names["phi"] + k * step})) for k in (-1, 0, 1)]
        except (AttributeError, TypeError, ValueError, ZeroDivisionError):  # complex numbers among them
            return None
        left, right = (ends[1] - ends[0]) / step, (ends[2] - ends[1]) / step
        if of == 2:
            return float((right - left) / step)
        smooth = abs(left - right) <= 1e-9 * max(1, abs(left))
        return float((left + right) / 2) if smooth else None


_KERNELS = [
    *(f"{name}(0.3*sin(phi) + 0.4)" for name in (*FUNCTIONS, "abs", "sign")),
    *("atan2(phi, x)", "atan2(x, phi)", "min(phi**2, 9)", "max(phi, x*phi)", "(phi + 3)**1.5", "(phi + 3)**-2", "x**phi"),
    *("phi/(x + phi)", "(2 if phi < 3 else phi)", "phi**(phi > 1)", "-phi*sin(phi)", "(phi < 1)*phi**3"),
]


@pytest.mark.parametrize("text", _KERNELS)
def test_slopes_of_every_function(text):
    values = {"phi": 1.25, "x": 2.5, "F": 0.0}
    jet = parse(text).evaluate(values | {"phi": Jet(1.25, 1.0, 0.0)}, _JETS)
    result = jet if isinstance(jet, Jet) else Jet(jet, 0.0, 0.0)
    first, second = _long_slope(text, values), _long_slope(text, values, of=2)
    assert first is not None
    assert second is not None
    assert [float(result.first), float(result.second)] == pytest.approx([first, second], rel=1e-12, abs=1e-12)


@settings(max_examples=25, **_MORE)
@given(formulas, places)
def test_slopes_of_jets_are_those_of_differences(text, values):
    expression = parse(text, frozenset({"F"}))
    assume("phi" in expression.names and _decided(expression, values))
    expected = _long_slope(text, values)
    assume(expected is not None and abs(expected) < 1e12)
    jet = expression.evaluate(values | {"phi": Jet(values["phi"], 1.0, 0.0)}, _JETS)
    result = jet.first if isinstance(jet, Jet) else 0.0
    assume(np.isfinite(result))  # such as sqrt(phi**2) at 0, or (phi - phi)**0
    assert math.isclose(float(result), expected, rel_tol=1e-6, abs_tol=1e-6), (text, values)


@settings(max_examples=25, **_MORE)
@given(formulas, places)
def test_first_and_second_slopes_agree(text, values):
    expression = parse(text, frozenset({"F"}))
    assume("phi" in expression.names and _decided(expression, values))

    def jet(shift):
        result = expression.evaluate(values | {"phi": Jet(values["phi"] + shift, 1.0, 0.0)}, _JETS)
        return result if isinstance(result, Jet) else Jet(result, 0.0, 0.0)

    step = 1e-5
    near, far = ((jet(k * step).first - jet(-k * step).first) / (2 * k * step) for k in (1, 2))
    here = jet(0.0)
    assume(np.isfinite([near, far, here.second]).all())
    assume(abs(near - far) <= 1e-4 * max(1.0, abs(near)) and abs(here.first) < 1e6)  # no kink, and digits to spare
    assert math.isclose(float(here.second), float(near), rel_tol=1e-3, abs_tol=1e-3), (text, values)
