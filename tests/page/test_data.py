"""The data of the page's drawings: the library's own figures, plain and finite, for machines of every kind."""

import json
from pathlib import Path

import numpy as np
import pytest

import flywheel
from flywheel.page import data
from flywheel.regime import turning_moment
from flywheel.sizing.results import Sizing

EXAMPLES = Path(__file__).parents[2] / "examples"
PRESS = EXAMPLES / "machines" / "press.toml"


@pytest.fixture(scope="module")
def press() -> Sizing:
    return flywheel.size(flywheel.load(PRESS), simulate=False)


@pytest.fixture(scope="module")
def answer(press: Sizing) -> dict:
    return data.answer(press, {"panels": [panel for panel in data.PANELS if panel != "motion"]})


def plain(found: dict) -> dict:
    """As the browser gets it: refuses what JSON has no word for."""
    return json.loads(json.dumps({key: value for key, value in found.items() if key != "faults"}, allow_nan=False))


# -- the library's figures -----------------------------------------------------------------------------------------------


def test_the_areas_and_their_extremes_are_those_of_the_sizing(press: Sizing, answer: dict) -> None:
    moment = answer["moment"]
    assert [(area["from"], area["to"], area["work"]) for area in moment["areas"]] == [a[:3] for a in press.areas]
    assert moment["greatest"]["value"] == press.accumulated_max
    assert moment["least"]["value"] == press.accumulated_min
    assert max(moment["work"]) == pytest.approx(press.accumulated_max, rel=1e-8)
    assert min(moment["work"]) == pytest.approx(press.accumulated_min, rel=1e-6)


def test_the_net_moment_is_the_reduced_one_and_what_drives_and_resists_adds_up_to_it(press: Sizing, answer: dict) -> None:
    phi, net = np.array(answer["phi"]), np.array(answer["moment"]["net"])
    inside = np.append(np.diff(phi) > 1e-6, False) & np.append(False, np.diff(phi) > 1e-6)
    state = flywheel.reduce(press.machine, phi[inside], balance=press.balance.value)
    assert net[inside] == pytest.approx(state.moment, abs=1e-8 * np.abs(net).max())
    parts = np.array(answer["moment"]["driving"]) + np.array(answer["moment"]["resisting"])
    assert parts == pytest.approx(net, abs=1e-9 * np.abs(net).max())
    bodies = np.sum([body["values"] for body in answer["inertia"]["bodies"]], axis=0)
    assert bodies[inside] == pytest.approx(state.inertia, rel=1e-12)


def test_a_jump_stands_at_one_angle_with_both_its_values(answer: dict) -> None:
    phi, net = np.array(answer["phi"]), np.array(answer["moment"]["net"])
    (at,) = np.flatnonzero((np.diff(phi) == 0.0) & (np.abs(np.diff(net)) > 1000.0))
    assert np.degrees(phi[at]) == pytest.approx(340.0)
    assert np.all(np.diff(phi) >= 0.0)
    assert (phi[0], phi[-1]) == (0.0, 2 * np.pi)


def test_the_tangents_cut_off_mn_and_meet_in_p(press: Sizing, answer: dict) -> None:
    found, eps, omega = answer["wittenbauer"], press.scene.irregularity, press.speed
    fast, slow = found["tangents"]
    assert found["mn"] == pytest.approx(eps * omega**2 * press.flywheel.exact, rel=1e-9)
    assert found["mn"] == pytest.approx(fast["intercept"] - slow["intercept"], rel=1e-9)
    assert fast["slope"] == pytest.approx(0.5 * (omega * (1 + eps / 2)) ** 2, rel=1e-12)
    for tangent in (fast, slow):
        on = tangent["slope"] * found["pole"][0] + tangent["intercept"]
        assert on == pytest.approx(found["pole"][1], rel=1e-9)
    above = np.array(found["energy"]) - fast["slope"] * np.array(found["inertia"]) - fast["intercept"]
    below = np.array(found["energy"]) - slow["slope"] * np.array(found["inertia"]) - slow["intercept"]
    assert above.max() == pytest.approx(0.0, abs=1e-6 * found["mn"])
    assert below.min() == pytest.approx(0.0, abs=1e-6 * found["mn"])


def test_the_speed_keeps_the_band_that_was_asked_for(press: Sizing, answer: dict) -> None:
    found = answer["speed"]
    exact = np.array(found["traces"][0]["values"])
    assert [trace["key"] for trace in found["traces"]] == ["exact", "approximate", "inertia_torque_flywheel"]
    assert (exact.min(), exact.max()) == pytest.approx(tuple(found["band"]), rel=1e-9)
    assert found["greatest"] == {"value": press.run.speed_max, "at": press.run.angle_speed_max}
    again = turning_moment.speed_over_cycle(press.cycle, press.speed, press.run, np.array(answer["phi"][5:6]))
    assert exact[5] == pytest.approx(again[0], rel=1e-12)


def test_power_comes_to_every_place_as_it_leaves_it_at_every_angle(answer: dict) -> None:
    found = answer["power_flow"]
    powers = np.array([stream["powers"] for stream in found["streams"]])
    for place in found["places"]:
        sense = [(stream["to"] == place) - (stream["from"] == place) for stream in found["streams"]]
        if place.startswith("shafts."):
            assert sense @ powers == pytest.approx(0.0, abs=1e-9 * np.abs(powers).max())
    assert found["input"] == pytest.approx(found["output"] + found["losses"], rel=1e-9)
    assert {stream["label"] for stream in found["streams"]} >= {
        "drive",
        "flywheel",
        "weights on crank",
        "load on slider (1)",
    }


def test_reactions_are_those_of_joint_forces(press: Sizing, answer: dict) -> None:
    phi = np.array(answer["phi"])
    some = np.flatnonzero(np.append(np.diff(phi) > 1e-6, False) & np.append(False, np.diff(phi) > 1e-6))[::40]
    forces = flywheel.joint_forces(press.machine, phi[some]).mechanisms["press"]
    for joint in answer["reactions"]["joints"]:
        there = np.array([joint["x"], joint["y"]])[:, some]
        assert there == pytest.approx(forces.forces[joint["name"]], abs=1e-6 * joint["largest"]["value"])
    action = np.array(answer["reactions"]["driving"][0]["values"])[some]
    assert action == pytest.approx(forces.action, abs=1e-6 * np.abs(action).max())
    names = {joint["name"]: (joint["first"], joint["second"]) for joint in answer["reactions"]["joints"]}
    assert names["slider_pin"] == ("rod", "slider")


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "order"), [("position", 0), ("velocity", 1), ("acceleration", 2)])
def test_motion_is_that_of_motion_with_its_extremes(press: Sizing, kind: str, order: int) -> None:
    found = data.answer(press, {"panels": ["motion"], "kind": kind, "of": "rod.com"})
    curve = flywheel.motion(press.machine, of=["rod.com"], at=found["phi"][3:-3:50], regime=True)["rod.com"]
    values = (curve.position, curve.velocity, curve.acceleration)[order]
    for row, part in zip(values, found["motion"]["curves"], strict=False):
        assert np.array(part["values"])[3:-3:50] == pytest.approx(row, abs=1e-6 * np.abs(part["values"]).max())
    assert found["motion"]["unit"] == ("m", "m/s", "m/s²")[order]


@pytest.mark.slow
def test_extremes_between_samples_are_those_of_the_survey(press: Sizing) -> None:
    found = data.answer(press, {"panels": ["motion"], "kind": "velocity", "of": "guide"})["motion"]["curves"][0]
    known = {
        e.which: e
        for e in flywheel.motion(press.machine, of=["guide"], regime=True).extremes["guide"]
        if e.quantity == "velocity"
    }
    for which in ("least", "greatest"):
        assert found[which]["value"] == pytest.approx(known[which].value, rel=1e-6)
        assert found[which]["at"] == pytest.approx(known[which].at, abs=1e-3)


def test_bodies_stand_where_motion_has_their_points(press: Sizing, answer: dict) -> None:
    (view,) = answer["mechanism"]["views"]
    rod, phi = view["bodies"]["rod"], np.array(answer["phi"])
    (centre,) = [each["at"] for each in view["centres"] if each["body"] == "rod"]
    k = [10, 100, 200]
    turn, x, y = (np.array(rod[name])[k] for name in ("turn", "x", "y"))
    at = np.stack(
        (x + centre[1] * np.cos(turn) - centre[2] * np.sin(turn), y + centre[1] * np.sin(turn) + centre[2] * np.cos(turn))
    )
    assert at == pytest.approx(flywheel.motion(press.machine, of=["rod.com"], at=phi[k])["rod.com"].position, abs=1e-9)


# -- machines of every kind ----------------------------------------------------------------------------------------------

GONE = {
    "machines/diagram.toml": {"mechanism", "inertia", "wittenbauer", "power_flow", "reactions", "motion"},
    "machines/injection_clamp.toml": {"moment", "wittenbauer", "speed", "power_flow"},
    "machines/punch.toml": {"wittenbauer", "reactions"},
    "bond_graphs/compare_methods.toml": {"moment", "wittenbauer", "speed", "power_flow", "reactions"},
}


@pytest.mark.parametrize("name", [*GONE, "machines/press.toml"])
def test_every_panel_is_drawn_or_told_why_not_in_finite_numbers(name: str) -> None:
    found = plain(data.answer(flywheel.load(EXAMPLES / name), rest=False))
    assert set(found["why"]) == GONE.get(name, set())
    assert set(found["figures"]) == set(data.PANELS) - set(found["why"])
    assert all(found["why"].values())


def test_a_scene_that_cannot_be_sized_still_moves(press: Sizing) -> None:
    scene = press.scene.with_({"drive": None})
    found = data.answer(scene, {"panels": ["mechanism", "moment", "motion"]})
    assert found["figures"] == ["mechanism", "motion"]
    assert [fault.path for fault in found["faults"]] == ["load"]


def test_a_moving_hand_gets_fewer_positions_and_digits_of_the_same_curves(press: Sizing, answer: dict) -> None:
    moving = data.answer(press, {"panels": ["moment"]}, rest=False)
    assert len(moving["phi"]) < 0.6 * len(answer["phi"])
    assert set(moving) >= {"phi", "moment"}
    assert "speed" not in moving
    net = np.interp(moving["phi"][40:60], answer["phi"], answer["moment"]["net"])
    assert moving["moment"]["net"][40:60] == pytest.approx(net, abs=1e-3 * np.abs(net).max())
    assert all(value == round(value, 6) for value in moving["moment"]["work"][:50])


@pytest.mark.slow
def test_a_narrow_peak_is_not_missed() -> None:
    load = {"on": "crank", "torque": "-5000*exp(-((phi-2)/1e-3)**2)"}
    wheel = {"load": [load], "drive": {"torque": "balance"}, "regime": {"speed": 10}, "flywheel": {"irregularity": 0.1}}
    found = data.answer(flywheel.load(wheel), {"panels": ["moment"]}, rest=False)
    assert min(found["moment"]["net"]) < -4900.0
    assert len(found["phi"]) < 500


def test_what_was_chosen_of_the_motion_is_told_back_or_replaced(press: Sizing) -> None:
    found = data.answer(press, {"panels": ["motion"], "kind": "reaction", "of": "pivot"}, rest=False)
    assert found["views"]["chosen"] == {"kind": "reaction", "of": "pivot"}
    assert [curve["part"] for curve in found["motion"]["curves"]] == ["x", "y", "amount"]
    found = data.answer(press, {"panels": ["motion"], "kind": "nothing", "of": "nobody"}, rest=False)
    assert found["views"]["chosen"]["kind"] == "velocity"
    assert found["views"]["chosen"]["of"] in {each["id"] for each in found["views"]["of"]}
