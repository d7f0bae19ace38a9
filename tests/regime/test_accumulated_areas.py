"""The level `fast`: bounds that hold, and nothing but what bounds take."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.regime.accumulated_areas import Terms, bounds_of_inertia, bounds_of_irregularity
from tests import regimes, scenes
from tests.references.test_references import FOLDER, REFERENCES, error

MACHINES = [name for name, true in REFERENCES.items() if "balance" in true]


def fast(scene: Any, **options: Any) -> flywheel.Sizing:
    return flywheel.size(flywheel.load(scene), accuracy="fast", **options)


@pytest.mark.parametrize("name", MACHINES)
def test_the_exact_figure_lies_between_its_bounds(name: str) -> None:
    true, sizing = REFERENCES[name], fast(FOLDER / "scenes" / f"{name}.toml")
    bounds = sizing.bounds
    assert bounds is not None
    given = sizing.scene.inertia is not None
    figure = float(true["simulation"]["irregularity"] if given else true["flywheel"]["exact"])
    assert bounds.of == ("irregularity" if given else "exact")
    assert bounds.least <= figure <= bounds.greatest
    assert 0.0 <= bounds.width <= 2.0
    assert sizing.flywheel.exact is None
    if not given:
        assert sizing.flywheel.needed in (None, true["flywheel"]["needed"])
        total = float(true["flywheel"]["approximate_total"])
        off = error(sizing.flywheel.approximate, true["flywheel"]["approximate"], total)
        assert off <= sizing.error.approximate + 4e-16 <= sizing.rtol
        off = error(sizing.flywheel.inertia_torque, true["flywheel"]["inertia_torque"], total)
        assert off <= sizing.error.inertia_torque + 4e-16
    else:
        low, high = (sizing.simulation.irregularity * (1 + sign * sizing.error.simulation) for sign in (-1, 1))
        assert low <= figure <= high


@pytest.mark.parametrize("name", ["press", "yoke-100rad", "near-lock-offset", "law-dwell", "yoke-analysis"])
def test_bounds_are_proven_at_a_loose_rtol_too(name: str) -> None:
    true, sizing = REFERENCES[name], fast(FOLDER / "scenes" / f"{name}.toml", rtol=0.01)
    given = sizing.scene.inertia is not None
    figure = float(true["simulation"]["irregularity"] if given else true["flywheel"]["exact"])
    assert sizing.bounds.least <= figure <= sizing.bounds.greatest


def drawn(chance: random.Random) -> dict[str, Any]:
    """A slider-crank or yoke of random size, mass, speed, load and irregularity or flywheel."""
    speed, length = 10 ** chance.uniform(0, 2), 10 ** chance.uniform(-2, 0)
    mass, start = 10 ** chance.uniform(-1, 2), chance.uniform(0, 300)
    given = {"inertia": 10 ** chance.uniform(-1, 2) * mass * length**2}
    asked = {"irregularity": 10 ** chance.uniform(-3, 0.25)}
    slider = {
        "type": "slider-crank",
        "crank": {"length": length, "inertia": chance.uniform(0, 1) * mass * length**2},
        "rod": {"length": length * chance.uniform(1.1, 5), "mass": chance.uniform(0, 1) * mass},
        "slider": {"mass": mass},
    }
    yoke = {"type": "scotch-yoke", "crank": {"length": length}, "yoke": {"mass": mass}}
    kind, port = chance.choice([(slider, "slider"), (yoke, "yoke")])
    force = mass * length * speed**2 * 10 ** chance.uniform(-2, 1)
    return {
        "mechanism": kind,
        "gravity": {},
        "load": [{"on": port, "force": -force, "from": f"{start} deg", "to": f"{start + chance.uniform(10, 50)} deg"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": speed},
        "flywheel": chance.choice([given, asked]),
    }


def test_bounds_hold_for_a_hundred_random_machines() -> None:
    chance, widths, compared = random.Random(20), [], 0
    while compared < 100:
        scene = flywheel.load(drawn(chance))
        try:
            exact = flywheel.size(scene, accuracy="normal")
        except flywheel.SceneError:
            continue  # it stops within the cycle
        bounds = flywheel.size(scene, accuracy="fast").bounds
        figure = exact.flywheel.exact if scene.inertia is None else exact.simulation.irregularity
        doubt = 1e-9 * figure
        assert bounds.least - doubt <= figure <= bounds.greatest + doubt, scene
        widths.append(bounds.width)
        compared += 1
    assert sorted(widths)[50] < 1.0  # bounds that say nothing would hold too


def terms(areas: float, torque: float, least: float, greatest: float) -> Terms:
    return Terms((areas,) * 2, (torque,) * 2, (least,) * 2, (greatest,) * 2, greatest - least)


def test_either_bound_is_the_other_turned_round() -> None:
    """For eps within the bounds of J, J lies within the bounds of eps, and outside without; by bisection on both."""
    for areas, torque, least, greatest in [(2.0, 1.8, 0.1, 0.9), (0.4, 0.9, 0.0, 2.0), (5.0, 5.0, 1.0, 1.0)]:
        found = terms(areas, torque, least, greatest)
        for inertia in (0.5, 3.0, 50.0):
            low, high = bounds_of_irregularity(found, inertia)
            for eps in np.geomspace(1e-3, 1.99, 200):
                inside = low <= eps <= high
                below, above = bounds_of_inertia(found, float(eps))
                slack = 1e-12 * (1 + inertia)
                assert (below - slack <= inertia <= above + slack) >= inside
                if not low * (1 - 1e-12) <= eps <= high * (1 + 1e-12):
                    assert not below + slack < inertia < above - slack


def test_both_bounds_fall_with_the_irregularity() -> None:
    found = terms(2.0, 1.8, 0.1, 0.9)
    ends = np.array([bounds_of_inertia(found, eps) for eps in np.linspace(1e-3, 1.999, 400)])
    assert (np.diff(ends, axis=0) < 0.0).all()


def test_nothing_bounds_the_irregularity_of_a_machine_that_may_stop() -> None:
    assert bounds_of_irregularity(terms(1.0, 1.0, 0.0, 1.0), 0.0)[1] == 2.0


def test_bounds_meet_where_the_inertia_is_constant() -> None:
    sizing = fast(scenes.rotor(inertia=[{"on": "crank", "value": 5}]))
    exact = flywheel.size(sizing.scene, accuracy="normal").flywheel.exact
    assert sizing.bounds.width < 1e-12
    assert sizing.bounds.least <= exact <= sizing.bounds.greatest
    assert sizing.flywheel.needed is True


def test_bounds_decide_that_no_flywheel_is_needed() -> None:
    heavy = fast(scenes.rotor(inertia=[{"on": "crank", "value": 5000}]))
    assert (heavy.flywheel.needed, heavy.bounds.least, heavy.bounds.greatest) == (False, 0.0, 0.0)
    open_ = fast(scenes.press(regime={"speed": "120 rpm"}, flywheel={"irregularity": 1.8}))
    exact = flywheel.size(open_.scene, accuracy="normal")
    assert open_.flywheel.needed in (None, exact.flywheel.needed)


def test_where_rounding_alone_varies_the_speed_nothing_is_needed() -> None:
    coasting = scenes.rotor(drive={"torque": 0}, load=[], inertia=[{"on": "crank", "value": 1}])
    sizing = fast(coasting)
    assert (sizing.flywheel.needed, sizing.flywheel.approximate, sizing.bounds.greatest) == (False, 0.0, 0.0)
    given = fast(coasting | {"flywheel": {"inertia": 2}})
    assert given.simulation.irregularity == 0.0


def test_a_machine_that_the_areas_prove_to_stop_is_refused() -> None:
    with pytest.raises(flywheel.SceneError, match="stops within the cycle"):
        fast(scenes.rotor(flywheel={"inertia": 1e-3}))
    with pytest.raises(flywheel.SceneError, match="stops within the cycle"):
        fast(scenes.rotor(flywheel={"inertia": 0}))


@pytest.mark.parametrize("name", ["pump", "section-c", "geared-loss", "dc-inductance"])
def test_torques_that_depend_on_speed_are_bounded_by_nothing_and_that_is_said(name: str) -> None:
    for given in ({"inertia": 5}, {"irregularity": 0.05}):
        scene = flywheel.load(regimes.scene(name, **given))
        sizing, exact = (flywheel.size(scene, accuracy=level) for level in ("fast", "normal"))
        assert sizing.bounds is None
        assert sizing.error.exact is None
        assert sizing.error.simulation is None
        assert any("nothing is proven" in message for message in sizing.messages)
        if scene.inertia is None:
            assert sizing.flywheel.approximate == pytest.approx(exact.flywheel.approximate, rel=1e-8)
        assert sizing.as_dict()["constant_speed"] == pytest.approx(exact.cyclic.constant_speed, rel=1e-12)
        assert sizing.speed == pytest.approx(exact.cyclic.constant_speed, rel=1e-12)


def test_what_is_null_at_this_level() -> None:
    sized = fast(scenes.press()).as_dict()
    assert [sized["flywheel"][key] for key in ("exact", "inertia")] == [None, None]
    assert [sized[key] for key in ("simulation", "gd2", "energy", "certificate", "wheel")] == [None] * 5
    assert sized["shafts"] == []
    assert set(sized["bounds"]) == {"of", "least", "greatest", "width"}
    given = fast(scenes.press(flywheel={"inertia": 30})).as_dict()
    assert given["gd2"] == 120
    assert given["simulation"]["route"] == "areas"
    assert given["simulation"]["speed_max"] is None


def test_a_wide_bracket_says_so_in_the_messages_of_reached() -> None:
    sizing = fast(FOLDER / "scenes" / "shaper-analysis.toml")
    assert sizing.bounds.width > 0.5
    assert not sizing.reached
    assert not any("simulation" in message for message in sizing.messages)
