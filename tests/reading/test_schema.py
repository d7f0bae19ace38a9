"""The schema of scenes and the reference of their keys."""

import copy
import json
import math
import re
import tomllib

import pytest
from click.testing import CliRunner
from jsonschema import Draft7Validator

import flywheel
from flywheel import SceneError, load
from flywheel.cli import main
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.linkage import linkage_of
from flywheel.numerics.units import DIMENSIONS, UNITS, parse_quantity
from flywheel.reading.json_schema import json_schema
from flywheel.reading.loads import LOAD_MODELS
from flywheel.reading.motors import CURVE, MOTORS
from flywheel.reading.scenes import build_scene
from flywheel.reading.schema import (
    CLUTCH,
    COUPLING,
    COUPLING_KEYS,
    JOINT,
    JOINT_KEYS,
    LINKAGE_SECTIONS,
    MECHANISM,
    OUTPUT,
    SECTIONS,
    TABLE,
    TOP,
    WHEEL_KEYS,
    Range,
)
from flywheel.reference import text, topics
from tests import regimes
from tests.fuzzing.mutants import at, corpus, places
from tests.limits import sample

# The list of keys is consistent in itself.


OTHER_KINDS = {
    *(
        "text",
        "name",
        "choice",
        "law",
        "position",
        "table",
        "numbers",
        "index",
        "unit",
        "tables",
        "list",
        "flag",
        "model",
        "changes",
    ),
}
LISTS = [TOP, MECHANISM.keys, OUTPUT.keys, TABLE.keys, CURVE.keys]
LISTS += [section.keys for section in (*SECTIONS.values(), *LINKAGE_SECTIONS, *LOAD_MODELS.values(), *MOTORS.values())]
LISTS += [part.keys for kind in KINDS.values() for part in kind.parts] + [kind.keys for kind in KINDS.values()]
LISTS += [(*SECTIONS["flywheel"].keys, *WHEEL_KEYS), CLUTCH.keys]
KEYS = [key for keys in LISTS for key in keys]


def test_no_key_is_listed_twice():
    for keys in LISTS:
        assert len({key.name for key in keys}) == len(keys), keys


def test_every_key_is_of_a_known_kind_with_a_fitting_default():
    for key in KEYS:
        assert all(part in DIMENSIONS for part in key.kind.split(" | ")) or key.kind in OTHER_KINDS, key
        assert key.about, key
        assert not (key.required and key.default is not None), key
        assert not isinstance(key.default, float) or key.default in key.range, key
        assert key.kind != "choice" or key.default is None or key.default in key.choices, key


def test_the_example_of_a_key_is_a_value_it_takes():
    inputs = [key for key in KEYS if key.example]
    assert all(parse_quantity(key.example, key.kind) in key.range for key in inputs)
    assert {"ratio", "poles", "breakdown_ratio", "efficiency"} <= {key.name for key in inputs}
    for key in KEYS:
        if key.kind == "number" and not key.example:  # then that of all numbers must suit it
            assert parse_quantity(DIMENSIONS["number"].example, "number") in key.range, key


@pytest.mark.parametrize(
    ("bounds", "inside", "outside", "words"),
    [
        (Range(), [0, -1e300], [math.nan], "any"),
        (Range(0.0), [0, 1], [-1e-300, math.nan], "at least 0"),
        (Range(0.0, low_open=True), [1e-40], [0, 1e-60, math.nan], "above 0"),
        (Range(0.0, 2.0, True, True), [1.99], [0, 2, math.inf], "above 0 and below 2"),
        (Range(1e-14, 0.1), [1e-14, 0.1], [0, 0.2, "0.05"], "at least 1e-14 and at most 0.1"),
    ],
)
def test_ranges(bounds, inside, outside, words):
    assert all(value in bounds for value in inside)
    assert not any(value in bounds for value in outside)
    assert str(bounds) == words


@pytest.mark.parametrize(("section", "owned"), [(JOINT, JOINT_KEYS), (COUPLING, COUPLING_KEYS)])
def test_every_key_of_joints_and_couplings_belongs_to_some_type(section, owned):
    common = {"name", "type", "between"}
    assert {key.name for key in section.keys} == common.union(*owned.values())
    assert next(key for key in section.keys if key.name == "type").choices == tuple(owned)


# The JSON Schema for editors: made from the reader's lists, it takes every good scene and no misspelt one.


SCHEMA = json_schema()
VALID = Draft7Validator(SCHEMA).is_valid
SCENES = {base.name: tomllib.loads(base.text) for base in corpus()}
FREE = ("parameters", "shafts", "outputs", "bodies", "points", "ports", "changes")
"""Tables whose keys are names that a scene chooses."""
PUNCH = """
regime.speed = 9
flywheel.irregularity = 0.1
load = [{on = "crank", torque = "-500 N m", from = "240 deg", to = "360 deg"}]
drive.torque = "balance"
"""
BARS = "type = 'four-bar', crank.length = 1, coupler.length = 4, rocker.length = 3"


def every_kind_of_place():
    """Name, scene and path of one place for each key of each type of table that the project's scenes have."""
    result = {}
    for name, scene in sorted(SCENES.items(), key=lambda item: len(str(item[1]))):
        for path in places(scene):
            above = [at(scene, path[:k]) for k in range(1, len(path))]
            types = tuple(table["type"] for table in above if isinstance(table, dict) and "type" in table)
            chosen = [isinstance(part, int) or (k > 0 and path[k - 1] in FREE) for k, part in enumerate(path)]
            where = tuple("*" if free else part for part, free in zip(path, chosen, strict=True))
            result.setdefault((where, types), (name, scene, path))
    return result.values()


def test_it_is_a_schema():
    Draft7Validator.check_schema(SCHEMA)


def test_every_scene_of_the_project_is_valid():
    for name, scene in SCENES.items():
        assert not list(Draft7Validator(SCHEMA).iter_errors(scene)), name


def test_frame_and_ground_of_a_four_bar_are_both_in_the_schema():
    for name in ("ground", "frame"):
        assert VALID(tomllib.loads(f"{PUNCH}mechanism = {{{BARS}, {name}.length = 4}}")), name


@pytest.mark.parametrize("part", sample(range(4), 4))
def test_no_key_may_be_misspelt_and_no_value_of_another_type(part):
    kinds = list(every_kind_of_place())
    assert len(kinds) > 300
    for name, scene, path in kinds[part::4]:
        if "changes" in path[:-1]:
            continue  # values by the paths of another scene
        value, tree = at(scene, path), copy.deepcopy(scene)
        table, key = at(tree, path[:-1]), path[-1]
        table[key] = True
        assert not VALID(tree) or isinstance(value, bool), (name, path)
        if isinstance(value, (int, float, str)):
            table[key] = [value, value, value]
            assert not VALID(tree), (name, path)
        if isinstance(key, str) and not (len(path) > 1 and path[-2] in FREE):
            del table[key]
            table[f"{key}_"] = value
            assert not VALID(tree), (name, path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("regime.speed = 9", "regime.speed = -9"),
        ("regime.speed = 9", "regime.speed = 'quick'"),
        ("irregularity = 0.1", "irregularity = 2"),
        ("irregularity = 0.1", "irregularity = 0.1\nflywheel.inertia = 3"),
        ("irregularity = 0.1", "shape = 'oval'\nflywheel.irregularity = 0.1"),
        ("flywheel.irregularity = 0.1", "flywheel.on = 'crank'"),
        ("torque = '-500 N m', ", ""),
        ("torque = '-500 N m', ", "torque = 3, force = 3, "),
        ("on = 'crank', ", ""),
        ("to = '360 deg'", "to = '360 deg', while = 'w > 0'"),
        ("torque = '-500 N m', ", "model = {type = 'fun', torque = 3}, "),
        ("torque = '-500 N m', ", "model = {torque = 3}, "),
        ("torque = '-500 N m', ", "model = {type = 'belt', tight = 3, power = 5}, "),
        ("torque = '-500 N m', ", "table = {file = 'a.csv', angle = [0, 1], value = [1, 2]}, "),
        ("torque = '-500 N m', ", "table = {angle = [0, 1]}, "),
        ("drive.torque = 'balance'", "drive.motor = {type = 'induction', power = '5 kW', speed = 9, frequency = 50}"),
        ("drive.torque = 'balance'", "drive.motor = {type = 'dc', voltage = 9, resistance = 1, constant = 1, power = 3}"),
        ("drive.torque = 'balance'", "mechanism = {type = 'four-bars'}"),
        ("drive.torque = 'balance'", "mechanism = {type = 'slider-crank', crank.length = 1}"),
        ("drive.torque = 'balance'", f"mechanism = {{{BARS}}}"),
        ("drive.torque = 'balance'", f"mechanism = {{{BARS}, ground.length = 4, frame.length = 4}}"),
        ("drive.torque = 'balance'", "mechanism = [{type = 'scotch-yoke', crank.length = 1}, {crank.length = 1}]"),
        ("drive.torque = 'balance'", "areas.values = [1, -1]"),
        ("drive.torque = 'balance'", "stroke = {from = 0, to = 1, speed = 1}"),
    ],
)
def test_what_the_reader_refuses(old, new):
    plain = PUNCH.replace('"', "'")
    assert VALID(tomllib.loads(plain))
    assert old in plain
    wrong = tomllib.loads(plain.replace(old, new))
    assert not VALID(wrong)
    with pytest.raises(SceneError):
        build_scene(wrong)


def test_keys_are_explained_and_have_the_defaults_of_the_reader():
    tables = SCHEMA["properties"]
    for key in (*TOP, *WHEEL_KEYS):
        result = tables["flywheel"]["properties"][key.name] if key in WHEEL_KEYS else tables[key.name]
        assert result["description"].startswith(key.about)
    for section in SECTIONS.values():
        table = tables[section.name]
        own = table["items"] if section.array else table["additionalProperties"] if section.named else table
        for key in () if section is MECHANISM else section.keys:
            assert own["properties"][key.name]["description"].startswith(key.about)
            assert own["properties"][key.name].get("default") == key.default


def test_every_type_has_its_own_table():
    kinds = {f"mechanism.{name}" for name in KINDS}
    assert set(SCHEMA["definitions"]) == kinds | {f"motor.{name}" for name in MOTORS} | {
        f"model.{name}" for name in LOAD_MODELS
    }


def test_the_command_prints_it_alone():
    run = CliRunner().invoke(main, ["reference", "--schema"])
    assert run.exit_code == 0
    assert json.loads(run.stdout) == SCHEMA
    assert CliRunner().invoke(main, ["reference", "--schema", "load"]).exit_code == 2


def test_the_overview_says_how_an_editor_finds_it():
    output = text("overview")
    assert "#:schema ./flywheel.schema.json" in output
    assert tomllib.loads(re.search(r"    \[\[rule\]\]\n(?:    .*\n)+", output)[0])["rule"][0]["schema"] == {
        "path": "flywheel.schema.json"
    }


# The reference explains every key that the format knows; its examples can be sized, or without a flywheel reduced.


SECTION_TOPICS = {name: name for name in SECTIONS} | {"damper": "spring"}
SECTION_TOPICS |= dict.fromkeys(("brake", "single_stroke"), "single-stroke")
EXAMPLES = [(topic, block) for topic in topics() for block in re.findall(r"```toml\n(.*?)```", text(topic), re.DOTALL)]


def quoted(topic: str) -> set[str]:
    """The words that a topic puts between backquotes."""
    return set(re.findall(r"`([^`\n]+)`", text(topic)))


@pytest.mark.parametrize("section", list(SECTIONS.values()), ids=lambda section: section.name)
def test_every_key_of_every_table(section):
    assert {key.name for key in section.keys} <= quoted(SECTION_TOPICS[section.name])
    written = f"[[{section.name}]]" if section.array else f"[{section.name}"
    assert written in text("overview")


@pytest.mark.parametrize("kind", list(KINDS.values()), ids=lambda kind: kind.name)
def test_every_key_and_port_of_every_mechanism(kind):
    keys = {f"{part.name}.{key.name}" for part in kind.parts for key in part.keys}
    keys |= {key.name for key in kind.keys} | {port.name for port in kind.ports}
    keys |= {choice for key in kind.keys for choice in key.choices}
    assert keys <= quoted(kind.name)
    assert kind.name in text("mechanism")


def test_keys_of_mechanisms_outputs_tables_and_the_top():
    assert {key.name for key in MECHANISM.keys} <= quoted("mechanism")
    assert {key.name for key in OUTPUT.keys} <= quoted("law")
    assert {key.name for key in TOP} <= quoted("overview")
    sections = {
        "linkage": LINKAGE_SECTIONS,
        "load-models": LOAD_MODELS.values(),
        "motor": MOTORS.values(),
        "tables": [TABLE],
    }
    lists = {topic: [key for section in of for key in section.keys] for topic, of in sections.items()}
    for topic, keys in (lists | {"wheel": WHEEL_KEYS}).items():
        assert {key.name for key in keys} <= quoted(topic), topic
        assert {choice for key in keys for choice in key.choices} <= quoted(topic), topic


def test_every_joint_of_the_named_mechanisms():
    for kind in ("scotch-yoke", "slider-crank", "four-bar", "crank-shaper"):
        scene = load(next(block for topic, block in EXAMPLES if topic == kind))
        row = next(line for line in text("reactions").splitlines() if line.startswith(f"| `{kind}`"))
        joints = [joint.name for joint in linkage_of(scene.mechanisms[0]).joints]
        assert row.split("|")[2].strip() == ", ".join(joints)


def test_every_unit_with_a_name_of_its_own():
    prefixed = re.compile(r"(?:n|µ|u|m|c|d|da|h|k|M|G)(?:m|g|s|N|Nm|J|W|Pa|bar|rad|cal|Wh|V|A|H|ohm|Ω)|Ncm")
    words = set(re.findall(r"[^\s,|()`]+", text("quantities")))
    assert {name for name in UNITS if not prefixed.fullmatch(name)} <= words


def test_every_key_of_the_results():
    scene = load(next(block for topic, block in EXAMPLES if topic == "slider-crank"))
    result = flywheel.size(scene, simulate=True).as_dict()
    nested = [key for name in ("flywheel", "simulation", "error", "balance") for key in result[name]]
    expected = {*result, *nested, *result["areas"][0], *result["reduced_inertia"], *result["energy"], *result["shafts"][0]}
    assert expected <= quoted("results")


@pytest.mark.parametrize(
    "name", [name if name != "light" else pytest.param(name, marks=pytest.mark.slow) for name in regimes.BAD]
)
def test_every_machine_without_a_regime_is_explained(name):
    names = re.findall(r"^- \*\*(.*?)\*\*", text("regime"), re.MULTILINE)
    with pytest.raises(flywheel.SceneError) as caught:
        flywheel.size(load(regimes.BAD[name].scene), simulate=False)
    assert any(each in str(caught.value) for each in names)


@pytest.mark.parametrize(("topic", "block"), sample(EXAMPLES, 3), ids=[topic for topic, _ in EXAMPLES])
def test_examples_can_be_sized(topic, block):
    scene = load(block)
    assert topic in (*KINDS, *SECTIONS, "overview", "tables", "load-models", "motor", "wheel")
    if scene.stroke is not None or not scene.has_flywheel:  # reduced, not sized
        ends = [0.0, 1.0] if scene.stroke is None else [scene.stroke.start, scene.stroke.end]
        assert (flywheel.reduce(scene, ends).inertia >= 0).all()
        return
    result = flywheel.size(scene, simulate=False)
    assert result.energy_fluctuation > 0


def test_every_mechanism_has_an_example():
    assert set(KINDS) <= {topic for topic, _ in EXAMPLES}


def test_topics_read_well_on_a_screen():
    for topic in topics():
        lines = text(topic).splitlines()
        assert lines[0].startswith("# "), topic
        assert all(len(line) <= 145 and line == line.rstrip() for line in lines), topic


def test_topics_and_files_agree():
    assert text() == text("overview")
    assert set(re.findall(r"topics? ([a-z-]+)", " ".join(map(text, topics())))) <= {*topics(), "each", "states"}
    with pytest.raises(KeyError):
        text("../faults")
