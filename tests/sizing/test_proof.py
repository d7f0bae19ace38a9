"""Proven intervals: references of 30 digits lie inside, changed scenes have overlapping ones, and the rest is refused."""

from __future__ import annotations

import json
import math
from decimal import Decimal
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import flywheel
from flywheel.numerics import units
from flywheel.numerics.jets import Jet
from flywheel.sizing import sizing
from tests import scenes
from tests.extras import extra
from tests.limits import sample
from tests.oracle import figures
from tests.oracle.machine import Machine

balls, proof = extra("flywheel.numerics.balls"), extra("flywheel.sizing.proof")
enclosures = extra("flywheel.sizing.enclosures")
FOLDER = Path(__file__).parent.parent / "references"
REFERENCES = {r["scene"].removesuffix(".toml"): r for r in json.loads((FOLDER / "references.json").read_text())}
WIDEST = 1e-12
PRESS: dict[str, Any] = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": "80 mm"},
        "rod": {"length": "0.3 m", "mass": "9 kg"},
        "slider": {"mass": "60 kg"},
    },
    "load": [{"on": "slider", "force": "-40 kN", "from": "20 deg", "to": "165.3 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "60 rpm"},
    "flywheel": {"irregularity": "4 %"},
}


def proven(scene: dict[str, Any]) -> Any:
    return proof.proven(flywheel.load(scene))


def at(tables: Any, key: str) -> Any:
    for name in ("balance" if key == "balance.value" else key).split("."):
        tables = (tables or {}).get(name)
    return tables


@cache
def of_reference(name: str) -> Any:
    return proof.proven(flywheel.load(FOLDER / "scenes" / f"{name}.toml"))


@pytest.mark.parametrize("name", sample(sorted(REFERENCES), 3))
def test_references_of_thirty_digits_lie_inside(name: str) -> None:
    result = of_reference(name)
    assert bool(result.figures) != bool(result.reason)
    for key, (low, high) in result.figures.items():
        true = at(REFERENCES[name], key)
        assert true is None or Fraction(low) <= Fraction(Decimal(str(true))) <= Fraction(high), key


def test_most_references_with_torques_of_position_are_proven() -> None:
    result = [of_reference(name) for name in sorted(REFERENCES)[::3]]
    assert sum(bool(one.figures) for one in result) >= len(result) // 3


def test_the_sizing_lies_within_its_own_estimate_of_the_interval() -> None:
    result = flywheel.size(flywheel.load(PRESS), accuracy="proof")
    assert result.proof is not None
    low, high = result.proof.figures["flywheel.exact"]
    exact = result.flywheel.exact
    assert exact is not None
    assert low * (1 - result.error.exact) <= exact <= high * (1 + result.error.exact)
    assert high - low <= WIDEST * exact
    assert (result.accuracy, result.simulation) == ("proof", None)


def test_intervals_of_a_scene_in_other_units_and_another_order_overlap() -> None:
    other = {
        **PRESS,
        "load": [
            {"on": "slider", "from": "20 deg", "to": "165.3 deg", "force": "-25000 N"},
            {"on": "slider", "force": "-15000 N", "from": "20 deg", "to": "165.3 deg"},
        ],
    }
    other["mechanism"] = {**PRESS["mechanism"], "crank": {"length": "0.08 m"}, "slider": {"mass": "60000 g"}}
    one, two = proven(PRESS).figures, proven(other).figures
    assert one.keys() == two.keys()
    assert all(one[key][0] <= two[key][1] and two[key][0] <= one[key][1] for key in one)


@pytest.mark.parametrize("factor", [3, 7])
def test_twice_the_masses_and_forces_are_twice_the_flywheel(factor: int) -> None:
    scaled = {**PRESS, "load": [{**PRESS["load"][0], "force": f"{-40 * factor} kN"}]}
    rod = {"length": "0.3 m", "mass": f"{9 * factor} kg"}
    scaled["mechanism"] = {**PRESS["mechanism"], "rod": rod, "slider": {"mass": f"{60 * factor} kg"}}
    one, two = proven(PRESS).figures, proven(scaled).figures
    for key in ("flywheel.exact", "flywheel.inertia_torque", "balance.value", "energy_fluctuation", "reduced_inertia.min"):
        low, high = (Fraction(end) * factor for end in one[key])
        assert low <= Fraction(two[key][1]), key
        assert Fraction(two[key][0]) <= high, key


def test_numbers_are_the_decimals_that_are_written_and_not_their_floats() -> None:
    rotor = {
        "inertia": [{"on": "crank", "value": 0.1}],
        "load": [{"on": "crank", "torque": "0.1 N m", "from": 0, "to": "180 deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": "60 rpm"},
        "flywheel": {"irregularity": 0.1},
    }
    result = proven(rotor).figures
    low, high = result["reduced_inertia.max"]
    assert Fraction(low) <= Fraction(1, 10) <= Fraction(high)
    low, high = result["energy_fluctuation"]  # 0.05 N m over half a turn
    assert low <= 0.05 * math.pi <= high
    assert result["balance.value"][0] <= -0.05 <= result["balance.value"][1]


def test_values_of_a_yoke_by_its_closed_form() -> None:
    """The energy of a yoke under a constant force, 2 F r over half a turn, with its balance F r/pi."""
    yoke = scenes.yoke()
    force, length = 1000.0, 0.5
    result = proven(
        {
            **yoke,
            "mechanism": {"type": "scotch-yoke", "crank": {"length": length}, "yoke": {"mass": 20}},
            "load": [{"on": "yoke", "force": force, "from": 0, "to": "180 deg"}],
            "drive": {"torque": "balance"},
        }
    ).figures
    angle = math.asin(1 / math.pi)
    size = force * length * (2 * math.cos(angle) - (math.pi - 2 * angle) / math.pi)
    low, high = result["energy_fluctuation"]
    assert low * (1 - 1e-14) <= size <= high * (1 + 1e-14)


ROWS: dict[str, Any] = {
    "angle": [0, 61, 133.3, 360],
    "value": [-2.5, -100.5, 33.3, 7],
    "angle_unit": "deg",
    "value_unit": "kN",
}
JUMP = ROWS | {"angle": [0, 61, 61, 133.3, 360], "value": [-2.5, -100.5, 20, 33.3, 7]}
SPLINE = {"type": "law", "outputs": {"ram": {"table": {"angle": [0, 2, 4, 6.283185307179586], "value": [0, 1, 0.5, 0]}}}}
LOBE = ROWS | {"angle": [20.3, 50, 70.7, 133.35]}
TABLES: dict[str, Any] = {
    "linear": {"on": "slider", "table": ROWS},
    "pchip": {"on": "slider", "table": ROWS | {"interpolation": "pchip"}},
    "step": {"on": "slider", "table": ROWS | {"interpolation": "step"}},
    "jump": {"on": "slider", "table": JUMP | {"interpolation": "pchip"}},
    "window": {"on": "slider", "from": "61 deg", "to": "130 deg", "table": ROWS},
    "window of its own": {"on": "slider", "from": "20.3 deg", "to": "133.35 deg", "table": LOBE},
    "twice a turn": {
        "on": "crank",
        "every": "180 deg",
        "table": ROWS | {"angle": [-20, 41, 113.3, 160], "value_unit": "kN m"},
    },
    "radians": {"on": "slider", "table": {"angle": [0, 1, 2.2, 6.283185307179586], "value": [-5, -900, 300, 0.1]}},
}


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("phase", ["0 deg", "35.7 deg"])
def test_a_table_is_proven_as_its_rows_are_written(name: str, phase: str) -> None:
    scene = {**PRESS, "mechanism": PRESS["mechanism"] | {"phase": phase}, "load": [TABLES[name]]}
    result = proven(scene).figures
    true = figures.references(Machine(json.loads(json.dumps(scene))))
    for key, (low, high) in result.items():
        assert low - 1e-15 * abs(low) <= at(true, key) <= high + 1e-15 * abs(high), key
    low, high = result["flywheel.exact"]
    assert high - low < 1e-13 * high


@pytest.mark.parametrize("interpolation", ["linear", "pchip", "step"])
def test_a_factor_of_a_table_counts_as_it_is_written(interpolation: str) -> None:
    table = {**ROWS, "interpolation": interpolation}
    load = {"on": "slider", "table": table}
    greater = {**table, "value": [float(Decimal(str(value)) * Decimal("1.17")) for value in ROWS["value"]]}
    one, two = (
        proven({**PRESS, "load": [each]}).figures for each in ({**load, "factor": "117 %"}, {**load, "table": greater})
    )
    assert overlap(one, two)
    assert all(high - low <= WIDEST * abs(low) for low, high in one.values())


def test_a_drive_whose_torque_is_an_expression_is_proven() -> None:
    drag = {"on": "crank", "torque": "-drag*max(sin(phi), 0)"}
    drive = {"torque": "900*(1 + 0.2*cos(phi))"}
    scene = {**PRESS, "load": [*PRESS["load"], drag], "parameters": {"drag": "balance"}, "drive": drive}
    result, true = proven(scene).figures, figures.references(Machine(json.loads(json.dumps(scene))))
    assert {"balance.value", "flywheel.exact"} <= result.keys()
    assert all(low - 1e-15 * abs(low) <= at(true, key) <= high + 1e-15 * abs(high) for key, (low, high) in result.items())


def jointed(aim: int = 0, **rod: Any) -> dict[str, Any]:
    """The press as a linkage, its guide turned to an angle (deg)."""
    bodies = {
        "frame": {"points": {"O": [0, 0]}},
        "arm": {"points": {"B": ["80 mm", 0]}},
        "rod": {"points": {"C": ["0.3 m", 0]}, "mass": "9 kg", "guess": f"{aim} deg", **rod},
        "slider": {"mass": "60 kg"},
    }
    pins = [("O", "frame.O", "arm.origin"), ("B", "arm.B", "rod.origin"), ("C", "rod.C", "slider.origin")]
    joints: list[dict[str, Any]] = [{"name": name, "type": "pin", "between": [a, b]} for name, a, b in pins]
    guide = {"name": "slider", "type": "slide", "between": ["frame.O", "slider.origin"], "guess": "0.3 m"}
    joints.append({**guide, "direction": f"{aim} deg"})
    mechanism = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints}
    load = {**PRESS["load"][0], "from": f"{20 + aim} deg", "to": f"{165.3 + aim} deg"}
    return {**PRESS, "mechanism": mechanism, "load": [load]}


def overlap(one: Any, two: Any) -> bool:
    return bool(one) and all(one[key][0] <= two[key][1] and two[key][0] <= one[key][1] for key in one if key in two)


@pytest.mark.parametrize("aim", [0, 37, 90])
def test_a_linkage_has_the_intervals_of_the_same_mechanism_in_closed_form(aim: int) -> None:
    one, two = proven(jointed(aim)).figures, proven(PRESS).figures
    assert one.keys() == two.keys()
    assert all(one[key][0] <= two[key][1] and two[key][0] <= one[key][1] for key in one if "accumulated" not in key)
    assert all(high - low <= WIDEST * abs(low) for low, high in one.values())


OF_STROKES: dict[str, dict[str, Any]] = {
    "press": {
        "type": "press",
        "shape": "constant",
        "end": "min",
        "thickness": "12 mm",
        "diameter": "9 mm",
        "shear_strength": "400 MPa",
    },
    "compressor": {
        "type": "compressor",
        "bore": "90 mm",
        "side": "min",
        "clearance": 0.06,
        "suction": "1 bar",
        "discharge": "4 bar",
        "exponent": 1.3,
    },
    "indicator": {
        "type": "indicator",
        "bore": "90 mm",
        "side": "max",
        "position": [0, 0.3, 0.7, 1],
        "out": [5, 4.1, 1.5, 1],
        "back": [5, 2, 1.2, 1],
        "pressure_unit": "bar",
    },
}


@pytest.mark.parametrize("kind", OF_STROKES)
def test_loads_that_refer_to_the_ends_of_a_stroke_have_proven_ends(kind: str) -> None:
    """Of an offset slider-crank they are at no share of a turn; a linkage of the same lengths has them, too."""
    load = [{"on": "slider", "model": OF_STROKES[kind]}]
    slider = {**PRESS["mechanism"], "slider": {"mass": "60 kg", "offset": "31.7 mm"}}
    linkage = jointed()["mechanism"]
    linkage["bodies"]["frame"]["points"]["G"] = [0, "31.7 mm"]
    linkage["joints"][3]["between"] = ["frame.G", "slider.origin"]
    one, two = (proven({**PRESS, "mechanism": each, "load": load}).figures for each in (slider, linkage))
    near = flywheel.size(flywheel.load({**PRESS, "mechanism": slider, "load": load}), 1e-12, simulate=False)
    assert {"flywheel.exact", "balance.value"} <= one.keys()
    assert overlap({key: value for key, value in one.items() if "accumulated" not in key}, two)
    assert near.flywheel.exact == pytest.approx(one["flywheel.exact"][0], rel=1e-11)
    assert all(high - low <= WIDEST * abs(low) for figures_of in (one, two) for low, high in figures_of.values() if low)


def test_a_law_of_parameters_has_the_interval_of_its_numbers() -> None:
    def lever(x: str) -> dict[str, Any]:
        load = [{"on": "slide", "force": "-1000 N", "from": "180 deg", "to": "270 deg"}]
        return {**PRESS, "mechanism": {"type": "law", "outputs": {"slide": {"x": x, "mass": "3 kg"}}}, "load": load}

    one = proven({**lever("r/d*L*sin(phi)"), "parameters": {"r": "10 mm", "d": "60 mm", "L": "120 mm"}}).figures
    assert overlap(one, proven(lever("0.02*sin(phi)")).figures)


def test_the_motion_of_a_linkage_has_the_intervals_of_the_same_mechanism_in_closed_form() -> None:
    drive = {"torque": "900 - 110*omega"}
    scenes_of_both = [{**one, "drive": drive, "flywheel": {"inertia": 40.0}, "regime": {}} for one in (jointed(), PRESS)]
    one, two = (flywheel.size(flywheel.load(scene), accuracy="proof").proof for scene in scenes_of_both)
    assert one is not None
    assert two is not None
    assert overlap(one.figures, two.figures)


@pytest.mark.slow
def test_ranges_of_lengths_of_a_linkage_hold_those_of_samples() -> None:
    wide = proven(jointed(com=["0.12 m", 0], points={"C": ["0.3 m ± 0.01 mm", 0]})).figures
    for rod in ("0.29999 m", "0.30001 m", "0.300003 m"):
        one = proven(jointed(com=["0.12 m", 0], points={"C": [rod, 0]})).figures
        assert all(wide[key][0] <= low and high <= wide[key][1] for key, (low, high) in one.items() if key != "speed")
    least, most = (one["flywheel.exact"], wide["flywheel.exact"])
    assert 0.0 < most[1] - most[0] < 1e-4 * least[0]


def test_a_solution_over_a_wide_place_holds_those_at_its_ends() -> None:
    flint, implicit = extra("flint"), extra("flywheel.numerics.implicit")

    def square(z: Any, x: Any) -> Any:
        return (z * z - x,)

    root = implicit.ImplicitEquations(square, lambda z, x: (z * z - x, 2 * z), lambda x: (x**0.5, 0.5 / x**0.5))
    with balls.precision(96, 2):
        value, rate, slope = root(flint.arb(2.5, 0.3))
        for x in (flint.arb("2.2"), flint.arb("2.8")):
            assert value.contains(x.sqrt().mid())
            assert rate.contains((1 / (2 * x.sqrt())).mid())
            assert slope.contains((-1 / (4 * x * x.sqrt())).mid())


def test_slopes_of_a_solution_follow_its_place_and_its_numbers() -> None:
    flint, implicit = extra("flint"), extra("flywheel.numerics.implicit")

    def sides(z: Any, x: Any, p: Any) -> Any:
        return (z * z - p * x,)  # z = sqrt(p x)

    root = implicit.ImplicitEquations(sides, lambda z, x, p: (z * z - p * x, 2 * z), lambda x: (x**0.5, 0.5 / x**0.5))
    two = flint.arb(2)
    with balls.precision(96, 2):
        value, rate, slope = root(Jet(two, flint.arb(3)), flint.arb(1))  # x rises by 3
        assert value.first.contains((3 / (2 * two.sqrt())).mid())
        assert rate.first.contains((-3 / (8 * two.sqrt())).mid())
        assert slope.first.contains((9 / (32 * two.sqrt())).mid())
        value, rate, slope = root(two, Jet(flint.arb(1), flint.arb(1)))
        assert value.first.contains((two.sqrt() / 2).mid())
        assert rate.first.contains((1 / (4 * two.sqrt())).mid())
        assert slope.first.contains((-1 / (16 * two.sqrt())).mid())


def test_the_assembly_of_a_linkage_decides_its_intervals() -> None:
    bodies = {
        "frame": {"points": {"O": [0, 0], "D": [1.2, 0]}},
        "arm": {"points": {"B": [0.25, 0]}},
        "coupler": {"points": {"C": [1, 0]}},
        "rocker": {"points": {"C": [0.8, 0]}, "mass": 12, "inertia": 2, "com": [0.4, 0.1]},
    }
    pins = [("O", "frame.O", "arm.origin"), ("B", "arm.B", "coupler.origin"), ("C", "coupler.C", "rocker.C")]
    pins.append(("D", "frame.D", "rocker.origin"))
    joints = [{"name": name, "type": "pin", "between": [a, b]} for name, a, b in pins]
    table = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints}
    intervals = []
    for side in ("left", "right"):
        table["assembly"] = [{"point": "coupler.C", "side": side, "from": "arm.B", "to": "frame.D"}]
        load = [{"on": "rocker", "torque": "-30", "from": 0, "to": 2}]
        result = flywheel.size(flywheel.load({**PRESS, "mechanism": table, "gravity": {}, "load": load}), accuracy="proof")
        assert result.proof is not None
        low, high = result.proof.figures["flywheel.exact"]
        exact = result.flywheel.exact
        assert exact is not None
        assert high - low <= WIDEST * high
        assert low * (1 - result.error.exact) <= exact <= high * (1 + result.error.exact)
        intervals.append((low, high))
    assert max(low for low, _ in intervals) > 1.001 * min(high for _, high in intervals)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"load": [{"on": "slider", "force": "-1000*t"}]}, "loads depend on time"),
        ({"load": [{"on": "slider", "force": "-1000*sin(0.12345678912*phi)"}]}, "with roundings"),
    ],
)
def test_what_cannot_be_proven_is_refused_with_its_reason(change: dict[str, Any], reason: str) -> None:
    result = proven({**PRESS, **change})
    assert result.figures == {}
    assert reason in result.reason
    assert result.statement == "nothing is proven"


def test_a_diagram_of_areas_is_refused() -> None:
    areas = {
        "areas": {"values": [100, -100], "scale": "1 J"},
        "regime": {"speed": "60 rpm"},
        "flywheel": {"irregularity": 0.02},
    }
    result = flywheel.size(flywheel.load(areas), accuracy="proof")
    assert result.proof is not None
    assert "no machine" in result.proof.reason


def test_without_the_extra_one_line_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sizing, "find_spec", lambda name: None)
    result = flywheel.size(flywheel.load(PRESS), accuracy="proof").proof
    assert result is not None
    assert result.reason == "python-flint, which is not installed: pip install 'flywheel-design[proof]'"
    assert "\n" not in result.reason


def test_a_ratio_as_it_is_written() -> None:
    assert units.exact_ratio("-1.25e-2 kN", "force") == (-125 * 1000, 10**4)
    top, bottom = units.exact_ratio("180 deg", "angle")
    assert top / bottom == math.pi


TURNS: dict[str, dict[str, Any]] = {
    "a coupler that turns back": {
        "mechanism": {
            "type": "four-bar",
            "ground": {"length": 0.9},
            "crank": {"length": 0.3},
            "coupler": {"length": 0.8, "mass": 2},
            "rocker": {"length": 0.6, "mass": 3, "inertia": 0.1},
            "assembly": "open",
        },
        "load": [{"on": "coupler", "torque": "-5*sign(v)"}],
    },
    "a follower that turns back": {
        "mechanism": {"type": "law", "outputs": {"follower": {"x": "0.1*sin(phi)+0.02*sin(2*phi)", "mass": 3}}},
        "load": [{"on": "follower", "force": "-5*sign(v)"}],
    },
    "a torque that switches": {
        "mechanism": PRESS["mechanism"],
        "load": [{"on": "crank", "torque": "-max(30, 55*sin(phi) + 7*cos(2*phi))"}],
    },
}


@pytest.mark.parametrize("name", TURNS)
def test_angles_at_which_a_load_breaks_are_proven_wherever_the_search_ended(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Interval Newton steps prove them, from angles 1e-9 rad beside them too; where the slope may be 0, none is."""
    scene = {key: PRESS[key] for key in ("drive", "regime", "flywheel")} | TURNS[name]
    result = proven(scene).figures["flywheel.exact"]
    assert result[1] - result[0] < 1e-13 * result[1]
    true = figures.references(Machine(json.loads(json.dumps(scene))))["flywheel"]["exact"]
    assert result[0] - 1e-14 * result[1] < float(true) < result[1] * (1 + 1e-14)
    implicit = extra("flywheel.numerics.implicit")
    near = implicit.zero_near
    monkeypatch.setattr(implicit, "zero_near", lambda function, at: near(function, at + 1e-9))
    assert proven(scene).figures["flywheel.exact"] == pytest.approx(result, rel=1e-14)
    monkeypatch.setattr(implicit, "zero_near", lambda function, at: near(lambda x: (function(x)[0] * 0 + 1, 0 * x), at))
    assert proven(scene).reason == "an angle at which a load breaks is not proven"


@pytest.mark.parametrize(
    ("least", "proven"), [("0", True), ("1e-60", True), ("-1e-60", True), ("1e-20", False), ("-1e-20", False)]
)
def test_zeros_of_a_function_that_touches_zero_count_as_one_where_none_is_farther_away(least: str, proven: bool) -> None:
    """Those of f(1 + t) = 1 - cos(t) + c are at about t = ± sqrt(-2 c)."""
    flint, implicit = extra("flint"), extra("flywheel.numerics.implicit")
    with balls.precision(256, 4):

        def touching(x: Any) -> tuple[Any, Any]:
            return 1 - (x - 1).cos() + flint.arb(least), (x - 1).sin()

        near = flint.arb(1, 1e-16)
        with pytest.raises(balls.UnprovenError, match="an angle at which a load breaks"):
            implicit.zero_near(touching, near)
        if proven:
            root = implicit.double_zero_near(touching, near, 2.0**-60)
            apart = (-2 * flint.arb(least)).sqrt() if least.startswith("-") else 0
            assert all(root.contains(1 + side * apart) for side in (-1, 1))
        else:
            with pytest.raises(balls.UnprovenError, match="an angle at which a load breaks"):
                implicit.double_zero_near(touching, near, 2.0**-60)


@pytest.mark.parametrize("start", [0, -37, 20.3])
def test_positions_of_a_table_are_proven_as_the_spline_through_its_rows(start: float) -> None:
    """The reference has the spline's slopes in long doubles; rows begin anywhere, so that a cubic is cut in two at 0."""
    rows = {"angle": [start + k for k in (0, 61, 150, 222, 360)], "value": [0, 0.11, 0.3, -0.07, 0], "angle_unit": "deg"}
    law = {"type": "law", "outputs": {"ram": {"table": rows, "mass": 7}}, "phase": "11 deg"}
    scene = PRESS | {"mechanism": law, "load": [{"on": "ram", "force": -900, "from": "310 deg", "to": "170 deg"}]}
    result = proven(scene).figures
    true = figures.references(Machine(json.loads(json.dumps(scene))))["flywheel"]
    for key in ("exact", "approximate_total", "inertia_torque"):
        low, high = result[f"flywheel.{key}"]
        assert low * (1 - 1e-16) <= true[key] <= high * (1 + 1e-16), key
        assert high - low <= 1e-14 * high, key


def test_two_lobes_that_differ_in_the_tenth_digit() -> None:
    flint = extra("flint")

    def lobes(phi: Any) -> list[Any]:
        value = (2 * phi).sin() + phi.sin() * flint.arb("1e-10")
        return [value, 2 * (2 * phi).cos() + phi.cos() * flint.arb("1e-10")]

    with balls.precision(96, 14):
        cells = balls.models([lobes], [flint.arb(0), flint.arb.pi() * 2], 14, [1.0, 1.0], 1e-20)
        curves = [balls.BallCurve(c.low - c.middle, c.high - c.middle, *c.polynomials) for c in cells]
        low, high = balls.ends(balls.greatest(curves, 1e-18))
    lowest = 1.0 + 1e-10 * math.sin(math.pi / 4)  # the other lobe is as much below 1
    assert low <= lowest + 1e-19
    assert high >= lowest - 1e-19
    assert high - low < 1e-15


def test_a_function_that_is_not_smooth_is_refused() -> None:
    flint = extra("flint")
    with balls.precision(96, 14), pytest.raises(balls.UnprovenError, match="not smooth"):
        balls.models([lambda phi: [(phi * phi).sqrt()]], [flint.arb(-1), flint.arb(1)], 14, [1.0], 1e-20)


@pytest.mark.parametrize("value", [0.5000000000000001, 1 / 3, math.sqrt(2), math.inf])
def test_a_constant_that_may_have_been_calculated_is_refused(value: float) -> None:
    with pytest.raises(balls.UnprovenError):
        balls.constant(value)


@pytest.mark.parametrize("value", [0.1, -2.5, 1e-3, math.pi, 2 * math.pi, -math.pi / 2, 9.80665])
def test_constants_hold_what_was_written(value: float) -> None:
    ball = balls.constant(value)
    assert abs(float(ball.mid()) - value) <= 1e-15 * abs(value)
    assert not ball.rad().is_zero() or value in (-2.5,)


def test_the_irregularity_of_a_given_wheel_holds_what_it_was_sized_for() -> None:
    low, high = proven(PRESS).figures["flywheel.exact"]
    given = {**PRESS, "flywheel": {"inertia": low}}
    heavier = proven({**PRESS, "flywheel": {"inertia": high * (1 + 1e-9)}}).figures["simulation.irregularity"]
    least, most = proven(given).figures["simulation.irregularity"]
    assert heavier[1] < least <= most <= 0.04 * (1 + 1e-14)
    assert least >= 0.04 * (1 - 1e-14)


def test_a_wheel_too_light_for_a_motion_is_not_proven_to_have_one() -> None:
    light = {**PRESS, "mechanism": {"type": "slider-crank", "crank": {"length": "80 mm"}, "rod": {"length": "0.3 m"}}}
    light["mechanism"]["slider"] = {"mass": "1 kg"}
    result = proven({**light, "flywheel": {"inertia": "1 kg m²"}})
    assert (result.figures, result.reason) == ({}, "the motion with a flywheel so light")


def test_figures_close_to_zero_are_as_narrow_as_all_others() -> None:
    """The exact flywheel is 7e-11 of the whole inertia that is required: the crank has almost all of it."""
    rotor = {
        "inertia": [{"on": "crank", "value": "3.18297128 kg m^2"}],
        "load": [{"on": "crank", "torque": "10 N m", "from": 0, "to": "180 deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": "10 rad/s"},
        "flywheel": {"irregularity": 0.04935},
    }
    low, high = proven(rotor).figures["flywheel.exact"]
    assert 0.0 < high - low <= WIDEST * low
    assert high < 1e-9


def test_a_machine_without_fluctuation_is_proven_to_need_no_flywheel() -> None:
    rotor = {"inertia": [{"on": "crank", "value": 1.398}], "load": [{"on": "crank", "torque": "-8.448"}]}
    result = proven({**rotor, "drive": {"torque": "balance"}, "regime": {"speed": 0.3}, "flywheel": {"irregularity": 0.01}})
    low, high = result.figures["flywheel.exact"]
    assert low <= 0.0 <= high < 1e-12
    assert result.figures["balance.value"][0] <= 8.448 <= result.figures["balance.value"][1]


def test_the_least_of_a_function_whose_minimum_is_flat_is_enclosed() -> None:
    """Its least is 0 at -0.1, of fourth order, by polynomials about 0.2."""
    flint = extra("flint")
    with balls.precision(128, 24):
        flat = flint.arb_poly([flint.arb("0.3"), 1]) ** 4 * flint.arb_poly([2, flint.arb("0.7"), 1, -1])
        curve = balls.BallCurve(flint.arb(-1), flint.arb(1), -flat, -flat.derivative())
        greatest = balls.greatest([curve], 1e-24)
    assert greatest.contains(0)
    assert float(greatest.rad()) < 1e-23


@pytest.mark.parametrize("order", [1, -1])
def test_a_function_of_which_a_part_is_not_finite_has_no_greatest_value(order: int) -> None:
    flint = extra("flint")
    curves = [
        balls.BallCurve(flint.arb(-1), flint.arb(1), flint.arb_poly([own, 1]), flint.arb_poly([own])) for own in (1, "nan")
    ]
    with pytest.raises(balls.UnprovenError, match="an extreme that stays open"):
        balls.greatest(curves[::order], 1e-3)


@pytest.mark.parametrize("number", [3.2568879938186406e-13, 6283185307179.587])
def test_a_number_with_roundings_is_no_multiple_of_pi_for_its_size(number: float) -> None:
    with pytest.raises(balls.UnprovenError, match="with roundings"):
        balls.constant(number)
