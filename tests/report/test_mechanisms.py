"""The steps from the mechanism to I* and M*: formulas printed agree with the library, and substitutions with results."""

import operator
import re
from functools import reduce as fold
from math import acos, asin, atan, atan2, cos, exp, log, pi, sin, sqrt, tan
from xml.etree import ElementTree

import numpy as np
import pytest

import flywheel
from flywheel import language
from flywheel.report import formulas, mechanisms
from flywheel.report.document import Document, Section, Step, Table, html, steps, substitution, unreproduced, untraced
from flywheel.report.positions import sheet

SHAPER = {
    "type": "crank-shaper",
    "crank": {"length": 0.12, "mass": 60, "inertia": 2.4, "com": 0.02},
    "frame": {"length": 0.42},
    "rocker": {"length": 0.7, "mass": 38, "inertia": 1.6, "com": 0.34, "com_angle": 0.1},
    "block": {"mass": 3, "inertia": 0.004},
    "rocker_pin": {"mass": 2},
    "ram": {"mass": 140},
}
CRANK = {
    "type": "slider-crank",
    "phase": "30 deg",
    "crank": {"length": 0.08, "mass": 12, "inertia": 0.4, "com": 0.015, "com_angle": 0.3},
    "rod": {"length": 0.4, "mass": 9, "inertia": 0.2, "com": 0.17, "com_angle": -0.05},
    "slider": {"mass": 42, "offset": 0.02},
}
FOUR_BAR = {
    "type": "four-bar",
    "ground": {"length": 0.5},
    "crank": {"length": 0.1, "mass": 2, "com": 0.03},
    "coupler": {"length": 0.45, "mass": 3, "inertia": 0.05, "com": 0.2, "com_angle": 0.2},
    "rocker": {"length": 0.3, "mass": 4, "inertia": 0.06, "com": 0.15},
}
YOKE = {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20, "direction": "40 deg"}, "block": {"mass": 2}}
PINS = [
    {"name": "O", "type": "pin", "between": ["frame.O", "wheel.origin"]},
    {"name": "A", "type": "pin", "between": ["wheel.A", "rod.origin"]},
    {"name": "B", "type": "pin", "between": ["rod.B", "piston.origin"]},
    {"name": "G", "type": "slide", "between": ["frame.O", "piston.origin"], "angle": 0, "guess": 0.5},
]
LINKAGE = {
    "type": "linkage",
    "driver": "O",
    "bodies": {
        "frame": {"points": {"O": [0, 0]}},
        "wheel": {"points": {"A": [0.1, 0]}, "mass": 3, "inertia": 0.02, "com": [0.02, 0.01]},
        "rod": {"points": {"B": [0.4, 0]}, "mass": 2, "inertia": 0.03, "com": [0.15, 0.02], "guess": 0},
        "piston": {"mass": 5},
    },
    "joints": PINS,
}
RUN = {"regime": {"speed": 10}, "flywheel": {"inertia": 1}, "gravity": {"direction": "-60 deg"}}


def machine(mechanism, **more):
    return flywheel.Machine(flywheel.load({"mechanism": mechanism, **RUN, **more}))


@pytest.mark.parametrize("mechanism", [SHAPER, CRANK, FOUR_BAR, FOUR_BAR | {"assembly": "crossed"}, YOKE, LINKAGE])
def test_closed_formulas_agree_with_the_reduction_at_every_angle(mechanism):
    of = machine(mechanism)
    for phi in np.linspace(0.05, 6.2, 5):
        made = sheet(of, of.scene.mechanisms[0], float(phi))
        state = flywheel.reduce(of, [phi], balance=0.0)
        for symbols, values in ((made.gains, state.gains), (made.slopes, state.gain_slopes)):
            for velocity, symbol in symbols.items():
                expected = values[f"{made.mechanism.name}.{velocity}"][0]
                assert made.values[symbol].value == pytest.approx(expected, abs=1e-9)
        worked = [step for section in made.shown() for step in steps([section]) if step.numbers]
        assert len(worked) > 2
        for step in worked:
            plain = {number.symbol: number.value for number in step.numbers}
            assert formulas.value(step.formula, plain) == pytest.approx(step.result.value, abs=1e-9)


def test_every_velocity_that_carries_mass_or_weight_is_explained():
    for mechanism in (SHAPER, CRANK, FOUR_BAR, YOKE, LINKAGE):
        of = machine(mechanism)
        family, made = of.family(of.scene.mechanisms[0]), sheet(of, of.scene.mechanisms[0], 1.0)
        carrying = {mass.velocity for mass in family.masses} | {weight.velocity for weight in family.weights}
        assert carrying - {"crank"} <= set(made.gains)


NAMESPACE = {"sin": sin, "cos": cos, "tan": tan, "arcsin": asin, "arccos": acos, "arctan": atan, "atan2": atan2, "ln": log}


def worked_out(node, mark="."):
    """What a MathML element comes to, as a text for Python: read from what is shown, by nobody who wrote it."""
    tag, inner = node.tag.rpartition("}")[2], [worked_out(child, mark) for child in node]
    match tag:
        case "mn":
            return node.text.replace(mark, ".").replace("−", "-")
        case "mtext":
            return "*pi/180" if node.text == "°" else ""
        case "mspace":
            return ""
        case "mi":
            return {"π": "pi"}.get(node.text, node.text)
        case "mo":
            return {"−": "-", "·": "*", "\u2062": "*", "\u2061": "", "|": "|"}.get(node.text, node.text)
        case "mfrac":
            return f"(({inner[0]})/({inner[1]}))"
        case "msup":
            return f"(({inner[0]})**({inner[1]}))"
        case "msqrt":
            return f"sqrt({''.join(inner)})"
    return "".join(inner)


@pytest.mark.parametrize(("tongue", "mark"), [("en", "."), ("es", ",")])
def test_what_is_shown_of_a_substitution_evaluates_to_the_shown_result(tongue, mark):
    of, seen = machine(CRANK), 0
    with language.use(tongue):
        made = sheet(of, of.scene.mechanisms[0], 2.0)
        for step in (step for section in made.shown() for step in section.parts if step.numbers):
            shown = formulas.mathml(step.formula, {n.symbol: n for n in substitution(step)})
            text = worked_out(
                ElementTree.fromstring(shown.replace("&#x2061;", "\u2061").replace("&#x2062;", "\u2062")), mark
            )
            found = eval(text.rpartition("=")[2], {**NAMESPACE, "pi": pi, "sqrt": sqrt, "exp": exp})
            result = step.result._replace(value=found)
            assert result.written == step.result.written or found == pytest.approx(step.result.value, rel=1e-9)
            seen += 1
    assert seen > 12


def test_loop_equations_of_a_linkage_close_where_its_unknowns_are():
    of = machine(LINKAGE)
    made = sheet(of, of.scene.mechanisms[0], 2.0)
    (loop,) = (
        section for section in made.shown() if any(isinstance(p, Step) and p.formula.endswith(" = 0") for p in section.parts)
    )
    plain = {symbol: value.value for symbol, value in made.values.items()}
    equations = [part.formula.removesuffix(" = 0") for part in loop.parts if isinstance(part, Step)]
    assert len(equations) == 2
    assert max(abs(formulas.value(f"a = {equation}", plain)) for equation in equations) < 1e-12
    (system,) = (p for s in made.shown() for p in s.parts if isinstance(p, Table) and len(p.head) == 4)
    rows = np.array([[cell.shown for cell in row[1:]] for row in system.rows])
    unknowns = np.linalg.solve(rows[:, :-1], rows[:, -1])
    assert unknowns == pytest.approx([made.values["theta_rod_prime"].value, made.values["s_G_prime"].value], rel=1e-4)


# -- whole sections: with pictures -------------------------------------------------------------------------------------

LOADS = [
    {"on": "slider", "force": "-40 kN", "from": "100 deg", "to": "200 deg"},
    {"on": "slider", "force": "-200*sign(v) if phi < 2 else -300*sign(v)"},
    {"on": "slider", "table": {"angle": [0, 3, 2 * pi], "value": [0, -500, 0]}},
    {"on": "crank", "model": {"type": "fan", "torque": 20, "speed": 12}},
]
WHOLE = {
    "mechanism": CRANK,
    "load": LOADS,
    "spring": [{"on": "slider", "stiffness": 2000, "rest": 0.3}],
    "damper": [{"on": "slider", "coefficient": 40}],
    "inertia": [{"on": "motor", "value": 0.4}],
    "shafts": {"motor": {"ratio": 5}},
    "drive": {"on": "motor", "torque": "balance"},
    "regime": {"speed": 10},
    "gravity": {},
}


def sections_of(scene, tongue="en"):
    with language.use(tongue):
        found = mechanisms.sections(scene)
        return found, html(Document("A machine", "", found))


@pytest.mark.slow
@pytest.mark.parametrize("tongue", ["en", "es"])
def test_a_machine_with_loads_of_every_kind_is_explained_to_the_last_number(tongue):
    scene = flywheel.load(WHOLE)
    found, text = sections_of(scene, tongue)
    document = Document("A machine", "", found)
    assert untraced(document) == []
    assert unreproduced(document) == []
    assert text.count("<svg") == 4
    assert "<text" in text
    by_symbol = {step.result.symbol: step.result.value for step in steps(found) if step.result is not None}
    phi = by_symbol["phi"]
    state = flywheel.reduce(scene, [phi], balance=None, speed=10.0)
    assert by_symbol["I_star"] == pytest.approx(state.inertia[0])
    assert by_symbol["M_star"] == pytest.approx(state.moment[0])
    assert by_symbol["I_star_prime"] == pytest.approx(state.slope[0])
    (moments,) = (p for s in found for p in s.parts if isinstance(p, Table) and p.head[-1].startswith("M*"))
    assert {"70 −", "70 +"} <= {row[0] for row in moments.rows}  # 100 deg of a mechanism that is 30 deg ahead


@pytest.mark.slow
@pytest.mark.parametrize("name", ["exams/p103_1", "machines/punch", "linkages/whitworth"])
def test_examples_are_explained_to_the_last_number(request, name):
    scene = flywheel.load(request.config.rootpath / f"examples/{name}.toml")
    found, _ = sections_of(scene)
    document = Document("A machine", "", found)
    assert untraced(document) == []
    assert unreproduced(document) == []
    shares = [
        s.result for s in steps(found) if s.result is not None and re.match(r"[Mm]_star_\w+$|I_star_\w+$", s.result.symbol)
    ]
    assert shares
    assert fold(operator.and_, (np.isfinite(share.value) for share in shares))


def test_the_clamp_agrees_along_its_stroke(request):
    of = flywheel.Machine(flywheel.load(request.config.rootpath / "examples/machines/injection_clamp.toml"))
    for x in (-0.05, 0.1):
        made, state = sheet(of, of.scene.mechanisms[0], x), flywheel.reduce(of, [x], speed=0.3)
        for velocity, symbol in made.gains.items():
            assert made.values[symbol].value == pytest.approx(state.gains[f"toggle-clamp.{velocity}"][0], abs=1e-9)
        for velocity, symbol in made.slopes.items():
            assert made.values[symbol].value == pytest.approx(state.gain_slopes[f"toggle-clamp.{velocity}"][0], abs=1e-8)


def test_a_scene_of_areas_has_no_such_steps():
    scene = flywheel.load(
        {"areas": {"values": [1, -1], "scale": 1}, "regime": {"speed": 1}, "flywheel": {"irregularity": 0.1}}
    )
    assert mechanisms.sections(scene) == ()
    assert isinstance(Section("", ()), Section)
