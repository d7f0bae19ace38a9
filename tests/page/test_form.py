"""The data of the page and its form."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from _pytest.mark.structures import ParameterSet
from hypothesis import given, settings
from hypothesis import strategies as st

import flywheel
from flywheel import Sizing, language
from flywheel.mechanisms import KINDS
from flywheel.numerics.units import DIMENSIONS, parse_unit
from flywheel.page import data, server
from flywheel.page.edits import Draft
from flywheel.page.form import OFFERED, translated
from flywheel.pictures.diagrams import DIAGRAMS
from flywheel.reading.loads import LOAD_MODELS
from flywheel.reading.motors import MOTORS
from flywheel.reading.schema import Section
from flywheel.regime import turning_moment
from flywheel.scene.scene import POSITIVE, Key
from flywheel.starters import kinds, starter
from tests.limits import sample
from tests.mechanisms import swinging_cylinder
from tests.scenes import DRIVEN, LOADED

# The data of the page's drawings: the library's own figures, plain and finite, for machines of every kind.


EXAMPLES = Path(__file__).parents[2] / "examples"
PRESS = EXAMPLES / "machines" / "press.toml"


@pytest.fixture(scope="module")
def press() -> Sizing:
    return flywheel.size(flywheel.load(PRESS), simulate=False)


@pytest.fixture(scope="module")
def answer(press: Sizing) -> dict:
    return data.answer(press, {"panels": {"mechanism", *DIAGRAMS} - {"motion"}})


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
    result, eps, omega = answer["wittenbauer"], press.scene.irregularity, press.speed
    fast, slow = result["tangents"]
    assert result["mn"] == pytest.approx(eps * omega**2 * press.flywheel.exact, rel=1e-9)
    assert result["mn"] == pytest.approx(fast["intercept"] - slow["intercept"], rel=1e-9)
    assert fast["slope"] == pytest.approx(0.5 * (omega * (1 + eps / 2)) ** 2, rel=1e-12)
    for tangent in (fast, slow):
        on = tangent["slope"] * result["pole"][0] + tangent["intercept"]
        assert on == pytest.approx(result["pole"][1], rel=1e-9)
    above = np.array(result["energy"]) - fast["slope"] * np.array(result["inertia"]) - fast["intercept"]
    below = np.array(result["energy"]) - slow["slope"] * np.array(result["inertia"]) - slow["intercept"]
    assert above.max() == pytest.approx(0.0, abs=1e-6 * result["mn"])
    assert below.min() == pytest.approx(0.0, abs=1e-6 * result["mn"])


def test_the_speed_keeps_the_band_that_was_asked_for(press: Sizing, answer: dict) -> None:
    result = answer["speed"]
    exact = np.array(result["traces"][0]["values"])
    assert [trace["key"] for trace in result["traces"]] == ["exact", "approximate", "inertia_torque_flywheel"]
    assert (exact.min(), exact.max()) == pytest.approx(tuple(result["band"]), rel=1e-9)
    assert result["greatest"] == {"value": press.run.speed_max, "at": press.run.angle_speed_max}
    again = turning_moment.speed_over_cycle(press.cycle, press.speed, press.run, np.array(answer["phi"][5:6]))
    assert exact[5] == pytest.approx(again[0], rel=1e-12)


def test_power_comes_to_every_place_as_it_leaves_it_at_every_angle(answer: dict) -> None:
    result = answer["power_flow"]
    powers = np.array([stream["powers"] for stream in result["streams"]])
    for place in result["places"]:
        sense = [(stream["to"] == place) - (stream["from"] == place) for stream in result["streams"]]
        if place.startswith("shafts."):
            assert sense @ powers == pytest.approx(0.0, abs=1e-9 * np.abs(powers).max())
    assert result["input"] == pytest.approx(result["output"] + result["losses"], rel=1e-9)
    assert {stream["label"] for stream in result["streams"]} >= {
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
    result = data.answer(press, {"panels": ["motion"], "kind": kind, "of": "rod.com"})
    curve = flywheel.motion(press.machine, of=["rod.com"], at=result["phi"][3:-3:50], regime=True)["rod.com"]
    values = (curve.position, curve.velocity, curve.acceleration)[order]
    for row, part in zip(values, result["motion"]["curves"], strict=False):
        assert np.array(part["values"])[3:-3:50] == pytest.approx(row, abs=1e-6 * np.abs(part["values"]).max())
    assert result["motion"]["unit"] == ("m", "m/s", "m/s²")[order]


@pytest.mark.slow
def test_extremes_between_samples_are_those_of_the_survey(press: Sizing) -> None:
    result = data.answer(press, {"panels": ["motion"], "kind": "velocity", "of": "guide"})["motion"]["curves"][0]
    known = {
        e.which: e
        for e in flywheel.motion(press.machine, of=["guide"], regime=True).extremes["guide"]
        if e.quantity == "velocity"
    }
    for which in ("least", "greatest"):
        assert result[which]["value"] == pytest.approx(known[which].value, rel=1e-6)
        assert result[which]["at"] == pytest.approx(known[which].at, abs=1e-3)


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


def test_a_drawing_has_the_centres_of_its_own_scene_whatever_was_drawn_before(press: Sizing) -> None:
    def drawn(**edits: object) -> dict:
        (view,) = data.answer(press.scene.with_(edits), {"panels": ["mechanism"]}, rest=False)["mechanism"]["views"]
        return {each["body"]: each["at"][1:] for each in view["centres"]}

    first = drawn()
    assert drawn(**{"mechanism.rod.mass": 100.0}) == first
    assert drawn(**{"mechanism.rod.com": 0.1})["rod"] != first["rod"]
    assert first.keys() - drawn(**{"mechanism.slider.mass": 0.0}) == {"slider"}


# -- machines of every kind ----------------------------------------------------------------------------------------------

GONE = {
    "machines/diagram.toml": {"mechanism", "inertia", "wittenbauer", "power_flow", "reactions", "motion"},
    "machines/injection_clamp.toml": {"moment", "wittenbauer", "speed", "power_flow"},
    "machines/punch.toml": {"wittenbauer", "reactions"},
    "bond_graphs/compare_methods.toml": {"moment", "wittenbauer", "speed", "power_flow", "reactions"},
}


@pytest.mark.parametrize("name", [*GONE, "machines/press.toml"])
def test_every_panel_is_drawn_or_told_why_not_in_finite_numbers(name: str) -> None:
    scene = flywheel.load(EXAMPLES / name)
    result = plain(data.answer(scene, rest=False))
    assert set(result["why"]) == GONE.get(name, set())
    there = {"mechanism", *(key for key, kind in DIAGRAMS.items() if kind.suits(scene))}
    assert set(result["figures"]) == there - set(result["why"])
    assert all(result["why"].values())


def test_a_scene_that_cannot_be_sized_still_moves(press: Sizing) -> None:
    scene = press.scene.with_({"drive": None})
    result = data.answer(scene, {"panels": ["mechanism", "moment", "motion"]})
    assert result["figures"] == ["mechanism", "motion"]
    assert [fault.path for fault in result["faults"]] == ["load"]


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
    result = data.answer(flywheel.load(wheel), {"panels": ["moment"]}, rest=False)
    assert min(result["moment"]["net"]) < -4900.0
    assert len(result["phi"]) < 500


def test_what_was_chosen_of_the_motion_is_told_back_or_replaced(press: Sizing) -> None:
    result = data.answer(press, {"panels": ["motion"], "kind": "reaction", "of": "pivot"}, rest=False)
    assert result["views"]["chosen"] == {"kind": "reaction", "of": "pivot"}
    assert [curve["part"] for curve in result["motion"]["curves"]] == ["x", "y", "amount"]
    result = data.answer(press, {"panels": ["motion"], "kind": "nothing", "of": "nobody"}, rest=False)
    assert result["views"]["chosen"]["kind"] == "velocity"
    assert result["views"]["chosen"]["of"] in {each["id"] for each in result["views"]["of"]}


# Scenes as forms: every value has its field, and whatever is typed into one the text stays one that can be read.


FORM_EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*/*.toml"))
TEXTS = {kind: starter(kind) for kind in kinds()}
TEXTS |= {f"{file.parent.name}-{file.stem}": file.read_text() for file in FORM_EXAMPLES}
SOME = ("press", "linkage", "law")
NASTY = ('a"b', "x\ny", "'''", "\x00\x07", "1]\n[evil]\nx = 2", "\ud800", "# c", "{a = 1}", "[1,", "", "\\", "nan", "1e5")


def slow(*values: str) -> list[ParameterSet]:
    return [pytest.param(value, marks=pytest.mark.slow) for value in values]


def edited(text: str, path: str, value: str | None = None, unit: str | None = None) -> Draft:
    draft = Draft(text)
    draft.edit(path, value, unit)
    return draft


@pytest.mark.parametrize("name", [*SOME, *slow(*(name for name in TEXTS if name not in SOME))])
def test_every_value_has_a_field_and_stays_as_it_is(name: str) -> None:
    text = TEXTS[name]
    draft = Draft(text)
    fields = [field for group in draft.form for field in group.fields]
    paths = {field.path for field in fields}
    for where, place in draft.outline.places.items():
        if place in draft.outline.values:
            around = [where[: len(path)] == path or path[: len(where)] == where for path in paths]
            assert any(around), where
    for field in fields:
        if field.written is not None:
            draft.edit(field.path, field.value)
            assert draft.outline.text == text
    assert draft.faults == []


@pytest.mark.parametrize("name", ["press", "motor-press", "linkage", "law", "areas", "toggle-clamp"])
@pytest.mark.slow
def test_whatever_is_typed_the_text_can_be_read(name: str) -> None:
    form = Draft(TEXTS[name]).form
    for k, field in enumerate(field for group in form for field in group.fields if field.written is not None):
        for typed in (NASTY[k % len(NASTY)], NASTY[(k + 5) % len(NASTY)]):
            draft = edited(TEXTS[name], field.path, typed)
            tomllib.loads(draft.outline.text)
            assert draft.faults == []
            kept = [line for line in TEXTS[name].splitlines() if line in draft.outline.text.splitlines()]
            assert len(kept) >= len(TEXTS[name].splitlines()) - 1


@pytest.mark.slow
@settings(deadline=None, max_examples=200, derandomize=True)
@given(
    typed=st.text(),
    path=st.sampled_from(("title", "mechanism.crank.length", "load[0].from", "load[1].force", "flywheel.on")),
)
def test_any_text_at_all(typed: str, path: str) -> None:
    draft = edited(TEXTS["press"], path, typed)
    field = draft.field(path)
    assert draft.faults == []
    assert field is not None
    read = tomllib.loads(draft.outline.text)
    assert set(read) == set(tomllib.loads(TEXTS["press"]))
    if path == "title":
        assert field.value == typed


def test_an_edit_changes_one_value_and_keeps_comments() -> None:
    text = TEXTS["press"]
    changed = edited(text, "mechanism.crank.length", "55 mm").outline.text
    assert changed == text.replace('"50 mm"               # half', '"55 mm"               # half')
    assert edited(text, "mechanism.crank.length", "55").outline.text == changed  # in the unit that stands there
    assert 'crank.length = "1.968503937 in"  ' in edited(text, "mechanism.crank.length", unit="in").outline.text
    assert "ratio = 6\n" in edited(text, "shafts.pinion.ratio", "6").outline.text
    linkage = edited(TEXTS["linkage"], "mechanism.bodies.rod.points.far[0]", "330 mm").outline.text
    assert linkage == TEXTS["linkage"].replace('far = ["320 mm", 0]', 'far = ["330 mm", 0]')


@pytest.mark.slow
@pytest.mark.parametrize("name", ["press", "motor-press", "linkage", "law"])
def test_what_the_form_offers_can_be_added_and_taken_away(name: str) -> None:
    text = TEXTS[name]
    for group in Draft(text).form:
        for more in group.more:
            draft = edited(text, more.path, more.value)
            assert draft.faults == [], more
            paths = {group.path for group in draft.form} | {f.path for group in draft.form for f in group.fields}
            assert any(path.startswith(more.path) for path in paths), more
        if group.removable:
            draft = edited(text, group.path)
            assert draft.faults == [], group.path
            tomllib.loads(draft.outline.text)


@pytest.mark.parametrize("kind", ["scotch-yoke", "slider-crank", "four-bar", "crank-shaper", "toggle-clamp"])
def test_another_type_keeps_what_fits(kind: str) -> None:
    draft = edited(TEXTS["press"], "mechanism.type", kind)
    assert draft.faults == []
    mechanism = tomllib.loads(draft.outline.text)["mechanism"]
    assert (mechanism["type"], mechanism["name"]) == (kind, "press")
    if kind != "toggle-clamp":
        assert mechanism["crank"]["mass"] == "85 kg"
        assert 'crank.mass = "85 kg"\n' in draft.outline.text
    request = {"text": draft.outline.text, "folder": ".", "name": "x.toml", "view": {"panels": []}}
    reply = json.loads(server.answer(request))
    assert not [fault for fault in reply["faults"] if fault["path"].startswith("mechanism.") and fault["found"] == "nothing"]


def test_the_frame_of_a_four_bar_is_edited_by_the_name_that_the_scene_gives_it() -> None:
    text = starter("four-bar").replace("ground.length", "frame.length")
    fields = {field.path for group in Draft(text).form for field in group.fields}
    assert "mechanism.frame.length" in fields
    assert "mechanism.ground.length" not in fields
    shaper = edited(text, "mechanism.type", "crank-shaper")
    lengths = tomllib.loads(shaper.outline.text)["mechanism"]
    assert lengths["frame"]["length"] == tomllib.loads(text)["mechanism"]["frame"]["length"]
    back = tomllib.loads(edited(shaper.outline.text, "mechanism.type", "four-bar").outline.text)["mechanism"]
    assert (back["frame"], "ground" in back) == (lengths["frame"], False)


@pytest.mark.parametrize("model", ["punch", *slow("constant", "fan", "losses", "belt", "press", "compressor")])
def test_other_models_of_loads(model: str) -> None:
    draft = edited(TEXTS["motor-press"], "load[0].model.type", model)
    assert draft.faults == []
    request = {"text": draft.outline.text, "folder": ".", "name": "x.toml", "view": {"panels": []}}
    missing = [fault for fault in json.loads(server.answer(request))["faults"] if fault["found"] == "nothing"]
    assert missing == []


def test_faults_stand_at_their_line_and_field() -> None:
    text = (
        TEXTS["press"].replace('"420 mm"', '"20 kg"').replace('on = "press.slider"\nforce = "-250 kN"', 'force = "-250 kN"')
    )
    reply = json.loads(server.answer({"text": text, "folder": ".", "name": "x.toml"}))
    wrong = {field["path"]: field for group in reply["form"] for field in group["fields"] if field["fault"]}
    assert set(wrong) == {"mechanism.rod.length", "load[0].on"}
    assert wrong["mechanism.rod.length"]["line"] == 1 + text[: text.index('"20 kg"')].count("\n")
    assert "that is a unit of mass" in wrong["mechanism.rod.length"]["fault"]
    assert reply["answer"] is None


def test_a_text_that_is_no_toml_has_the_form_of_what_can_be_read() -> None:
    text = TEXTS["press"].replace('"420 mm"', "420 mm")
    reply = json.loads(server.answer({"text": text, "folder": ".", "name": "x.toml"}))
    assert reply["faults"][0]["line"] == 1 + text[: text.index(" 420 mm")].count("\n")
    draft = Draft(text)
    assert draft.field("mechanism.crank.length").value == "50 mm"
    draft.edit("mechanism.crank.length", "60 mm")
    draft.edit("mechanism.rod.length", "430 mm")
    assert draft.faults == []
    assert draft.outline.text == TEXTS["press"].replace('"50 mm" ', '"60 mm" ').replace('"420 mm"', '"430 mm"')


def test_sliders_hold_their_number_and_what_the_key_allows() -> None:
    for name, text in TEXTS.items():
        for group in Draft(text).form:
            for field in group.fields:
                if field.range is not None:
                    least, most, step = field.range
                    assert least <= field.number <= most, (name, field.path)
                    assert step > 0
                if field.path == "flywheel.irregularity" and field.unit == "%":
                    assert field.range.most <= 200


def test_edits_that_make_no_sense_are_faults_and_leave_the_text() -> None:
    for path, value, unit in (("a.b[3].c", "1", None), ("", "1", None), ("load[99].on", "x", None), ("title", None, "mm"),
                              ("load[x]", "1", None), ("nothing", None, None), ("mechanism", "1", None)):  # fmt: skip
        draft = edited(TEXTS["press"], path, value, unit)
        assert draft.outline.text == TEXTS["press"]
        assert len(draft.faults) == 1


# -- types -----------------------------------------------------------------------------------------------------------------

ON_A_SHAFT = LOADED % ("crank", 'type = "constant", torque = "1 N m"')
ON_A_PORT = LOADED % ("slider", 'type = "constant", force = "1 N"')


def chosen(text: str, *edits: tuple[str, str]) -> tuple[str, list[str]]:
    """The text after choices on the form, and the paths of the faults that it then has."""
    request = {"text": text, "folder": ".", "name": "x.toml", "edits": [{"path": at, "value": to} for at, to in edits]}
    request["view"] = {"panels": []}
    reply = json.loads(server.answer(request))
    return reply["text"], [fault["path"] for fault in reply["faults"]]


def choices_of_type(text: str) -> list[tuple[str, str]]:
    """Every choice of every field that says what something is."""
    fields = [field for group in Draft(text).form for field in group.fields]
    return [(field.path, to) for field in fields if field.path.rpartition(".")[2] == "type" for to in field.choices]


@pytest.mark.parametrize("first", sample(MOTORS, 3))
def test_each_motor_follows_each_other_one_without_a_fault(first: str) -> None:
    text, _faults = chosen(DRIVEN % "constant", ("drive.motor.type", first))
    for kind in MOTORS:
        changed, faults = chosen(text, ("drive.motor.type", kind))
        assert tomllib.loads(changed)["drive"]["motor"]["type"] == kind
        assert [path for path in faults if path.startswith("drive.motor")] == [], (first, kind)


@pytest.mark.parametrize("first", sample(LOAD_MODELS, 3))
def test_each_load_model_follows_each_other_one_without_a_fault(first: str) -> None:
    for kind in LOAD_MODELS:
        text = ON_A_SHAFT if kind == "belt" else ON_A_PORT
        changed, faults = chosen(text, ("load[0].model.type", first), ("load[0].model.type", kind))
        assert tomllib.loads(changed)["load"][0]["model"]["type"] == kind
        assert faults == [], (first, kind)


@pytest.mark.parametrize(("text", "speed"), [(ON_A_SHAFT, "speed"), (ON_A_PORT, "velocity")])
def test_a_fan_after_a_constant_load_has_a_speed(text: str, speed: str) -> None:
    model = tomllib.loads(chosen(text, ("load[0].model.type", "fan"))[0])["load"][0]["model"]
    assert model.keys() == {"type", "torque" if speed == "speed" else "force", speed}


@pytest.mark.parametrize("name", [*SOME, *slow(*(name for name in TEXTS if name not in SOME))])
def test_every_type_of_every_table_can_be_chosen(name: str) -> None:
    for path, to in choices_of_type(TEXTS[name]):
        text, _faults = chosen(TEXTS[name], (path, to))
        table = Draft(text).field(path)
        assert table is not None
        assert table.value == to


def test_a_family_without_a_starter_begins_with_examples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(KINDS.homes, swinging_cylinder.KIND.name, swinging_cylinder.KIND)
    text, faults = chosen(TEXTS["rotor"], ("mechanism", ""), ("mechanism.type", swinging_cylinder.KIND.name))
    assert [path for path in faults if path.startswith("mechanism")] == []
    assert tomllib.loads(text)["mechanism"]["frame"]["length"] == "250 mm"


def test_a_load_model_that_is_added_begins_with_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    keys = (Key("type", "choice", "", required=True), Key("flow", "volume flow", "", None, POSITIVE, True))
    monkeypatch.setitem(LOAD_MODELS, "sprinkler", Section("sprinkler", "a sprinkler", keys, begin={"EFFORT": None}))
    text, _faults = chosen(ON_A_SHAFT, ("load[0].model.type", "sprinkler"))
    model = tomllib.loads(text)["load"][0]["model"]
    assert model["flow"] == DIMENSIONS["volume flow"].example
    assert Draft(text).field("load[0].model.flow").unit in OFFERED["volume flow"]


def test_every_dimension_is_offered_units_of_its_own() -> None:
    assert OFFERED.keys() == DIMENSIONS.keys()
    for dimension, units in OFFERED.items():
        for unit in filter(None, units):
            parse_unit(unit, dimension)


def test_a_shaft_is_not_offered_those_that_hang_on_it() -> None:
    chain = {"wheel": "crank", "motor": "wheel", "fan": "motor"}
    shafts = "".join(f'[shafts.{name}]\nratio = 2\non = "{on}"\n' for name, on in chain.items())
    draft = Draft(TEXTS["press"] + shafts)
    offered = {name: draft.field(f"shafts.{name}.on").choices for name in chain}
    assert offered["wheel"] == ("crank", "pinion")
    assert offered["motor"] == ("crank", "pinion", "wheel")
    assert offered["fan"] == ("crank", "pinion", "wheel", "motor")
    draft.edit("shafts.motor.on", "crank", None)
    assert draft.field("shafts.wheel.on").choices == ("crank", "pinion", "motor", "fan")
    draft.edit("shafts.wheel.on", "fan", None)
    draft.edit("shafts.motor.on", "wheel", None)  # a circle, which the reader refuses: the form is there to mend it
    assert draft.field("shafts.wheel.on").choices == ("fan", "crank", "pinion")


def test_labels_titles_and_help_have_their_spanish() -> None:
    spanish = language.catalogue("es")
    assert sorted(text for text in translated() if text not in spanish) == []


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("x y z\n" * 100000, id="no TOML"),
        pytest.param(".".join("a" * 50000) + " = 1", id="a key of many parts"),
        pytest.param("a = " + "[" * 3000 + "]" * 3000, id="deep lists"),
        pytest.param(
            "[parameters]\n" + "".join(f"p{i} = {i}\n" for i in range(9000)), id="many keys", marks=pytest.mark.slow
        ),
        pytest.param(f"title = '{'x' * 10**6}'\n", id="a long title", marks=pytest.mark.slow),
    ],
)
def test_texts_beyond_measure_are_answered(text: str) -> None:
    reply = json.loads(server.answer({"text": text, "folder": ".", "name": "x.toml"}))
    assert reply["faults"]
    assert reply["text"] == text


def test_the_form_of_the_same_text_follows_the_language() -> None:
    titles = []
    for spoken in ("en", "es", "en"):
        with language.use(spoken):
            titles.append(server.edited(TEXTS["slider-crank"], []).form[0].title)
    assert titles == ["Scene", "Escena", "Scene"]


@pytest.mark.parametrize(
    ("path", "line", "typo", "unit", "typed", "written"),
    [
        ("regime.speed", 'speed = "60 rpm"', 'speed = "6o rpm"', "rpm", "60 rpm", 'speed = "60 rpm"'),
        ("load[0].force", 'force = "-400 kN"', 'force = "-40o kN"', "kN", "-400 kN", 'force = "-400 kN"'),
        ("regime.speed", 'speed = "60 rpm"', 'speed = "rpm"', "rad/s", "6 rad/s", 'speed = "6 rad/s"'),
        ("load[0].force", 'force = "-400 kN"', 'force = "-40o*sin(phi)"', None, "-400 kN", 'force = "-400 kN"'),
    ],
)
def test_a_value_that_is_opened_with_a_fault_keeps_its_unit(
    path: str, line: str, typo: str, unit: str | None, typed: str, written: str
) -> None:
    text = PRESS.read_text("utf-8")
    assert line in text
    draft = Draft(text.replace(line, typo))
    field = draft.field(path)
    assert field is not None
    assert (field.unit, field.number) == (unit, None)
    draft.edit(path, typed)
    assert draft.outline.text == text.replace(line, written)


@pytest.mark.parametrize(("key", "good", "unit"), [("constant", "8 N m", "N m"), ("proportional", "0.1 N m s", "N m s/rad")])
def test_a_model_that_turns_keeps_its_units_while_a_value_is_empty(key: str, good: str, unit: str) -> None:
    text = (EXAMPLES / "drive_lines/compressor.toml").read_text("utf-8")
    draft = Draft(text)
    draft.edit(f"load[1].model.{key}", "")
    field = draft.field(f"load[1].model.{key}")
    assert field is not None
    assert field.unit == unit
    draft.edit(f"load[1].model.{key}", good)
    assert draft.outline.text == text


def test_each_value_of_the_form_stands_at_its_span() -> None:
    text = "# ä€\U0001f600\n" + PRESS.read_text("utf-8")
    draft = Draft(text)
    fields = [field for group in server.as_groups(draft.form, draft.outline, ()) for field in group["fields"]]
    spans = {field["path"]: text[slice(*field["span"])] for field in fields if field["span"]}
    assert len(spans) > 15
    assert (spans["regime.speed"], spans["mechanism.crank.length"]) == ('"60 rpm"', '"80 mm"')
