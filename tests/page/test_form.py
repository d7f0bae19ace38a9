"""Scenes as forms: every value has its field, and whatever is typed into one the text stays one that can be read."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
from _pytest.mark.structures import ParameterSet
from hypothesis import given, settings
from hypothesis import strategies as st

from flywheel import language
from flywheel.page import answers
from flywheel.page.edits import Draft
from flywheel.page.form import translated
from flywheel.starters import kinds, starter

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*/*.toml"))
TEXTS = {kind: starter(kind) for kind in kinds()}
TEXTS |= {f"{file.parent.name}-{file.stem}": file.read_text() for file in EXAMPLES}
SOME = ("press", "linkage", "law")
NASTY = ('a"b', "x\ny", "'''", "\x00\x07", "1]\n[evil]\nx = 2", "\ud800", "# c", "{a = 1}", "[1,", "", "\\", "nan", "1e5")
PLACES = ("title", "mechanism.crank.length", "load[0].from", "load[1].force", "flywheel.on")


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
    fields = [field for group in draft.form.groups for field in group.fields]
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
    for k, field in enumerate(field for group in form.groups for field in group.fields if field.written is not None):
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
    field = draft.form.field(path)
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
    for group in Draft(text).form.groups:
        for more in group.more:
            draft = edited(text, more.path, more.value)
            assert draft.faults == [], more
            paths = {group.path for group in draft.form.groups} | {
                f.path for group in draft.form.groups for f in group.fields
            }
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
    told = json.loads(answers.answer(request))
    assert not [fault for fault in told["faults"] if fault["path"].startswith("mechanism.") and fault["found"] == "nothing"]


@pytest.mark.parametrize("model", ["punch", *slow("constant", "fan", "losses", "belt", "press", "compressor")])
def test_other_models_of_loads(model: str) -> None:
    draft = edited(TEXTS["motor-press"], "load[0].model.type", model)
    assert draft.faults == []
    request = {"text": draft.outline.text, "folder": ".", "name": "x.toml", "view": {"panels": []}}
    missing = [fault for fault in json.loads(answers.answer(request))["faults"] if fault["found"] == "nothing"]
    assert missing == []


def test_faults_stand_at_their_line_and_field() -> None:
    text = (
        TEXTS["press"].replace('"420 mm"', '"20 kg"').replace('on = "press.slider"\nforce = "-250 kN"', 'force = "-250 kN"')
    )
    told = json.loads(answers.answer({"text": text, "folder": ".", "name": "x.toml"}))
    wrong = {field["path"]: field for group in told["form"] for field in group["fields"] if field["fault"]}
    assert set(wrong) == {"mechanism.rod.length", "load[0].on"}
    assert wrong["mechanism.rod.length"]["line"] == 1 + text[: text.index('"20 kg"')].count("\n")
    assert "that is a unit of mass" in wrong["mechanism.rod.length"]["fault"]
    assert told["answer"] is None


def test_a_text_that_is_no_toml_has_the_form_of_what_can_be_read() -> None:
    text = TEXTS["press"].replace('"420 mm"', "420 mm")
    told = json.loads(answers.answer({"text": text, "folder": ".", "name": "x.toml"}))
    assert told["faults"][0]["line"] == 1 + text[: text.index(" 420 mm")].count("\n")
    draft = Draft(text)
    assert draft.form.field("mechanism.crank.length").value == "50 mm"
    draft.edit("mechanism.crank.length", "60 mm")
    draft.edit("mechanism.rod.length", "430 mm")
    assert draft.faults == []
    assert draft.outline.text == TEXTS["press"].replace('"50 mm" ', '"60 mm" ').replace('"420 mm"', '"430 mm"')


def test_sliders_hold_their_number_and_what_the_key_allows() -> None:
    for name, text in TEXTS.items():
        for group in Draft(text).form.groups:
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


def test_a_shaft_is_not_offered_those_that_hang_on_it() -> None:
    chain = {"wheel": "crank", "motor": "wheel", "fan": "motor"}
    shafts = "".join(f'[shafts.{name}]\nratio = 2\non = "{on}"\n' for name, on in chain.items())
    draft = Draft(TEXTS["press"] + shafts)
    offered = {name: draft.form.field(f"shafts.{name}.on").choices for name in chain}
    assert offered["wheel"] == ("crank", "pinion")
    assert offered["motor"] == ("crank", "pinion", "wheel")
    assert offered["fan"] == ("crank", "pinion", "wheel", "motor")
    draft.edit("shafts.motor.on", "crank", None)
    assert draft.form.field("shafts.wheel.on").choices == ("crank", "pinion", "motor", "fan")
    draft.edit("shafts.wheel.on", "fan", None)
    draft.edit("shafts.motor.on", "wheel", None)  # a circle, which the reader refuses: the form is there to mend it
    assert draft.form.field("shafts.wheel.on").choices == ("fan", "crank", "pinion")


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
    told = json.loads(answers.answer({"text": text, "folder": ".", "name": "x.toml"}))
    assert told["faults"]
    assert told["text"] == text


def test_the_form_of_the_same_text_follows_the_language() -> None:
    titles = []
    for spoken in ("en", "es", "en"):
        with language.use(spoken):
            titles.append(answers.edited(TEXTS["slider-crank"], []).form.groups[0].title)
    assert titles == ["Scene", "Escena", "Scene"]
