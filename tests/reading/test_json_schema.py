"""The JSON Schema for editors: made from the reader's lists, it takes every good scene and no misspelt one."""

import copy
import json
import re
import tomllib

import pytest
from click.testing import CliRunner
from jsonschema import Draft7Validator

from flywheel.cli import main
from flywheel.mechanisms import KINDS
from flywheel.numerics.faults import SceneError
from flywheel.reading.json_schema import json_schema
from flywheel.reading.load_models import LOAD_MODELS
from flywheel.reading.motors import MOTORS
from flywheel.reading.scenes import build_scene
from flywheel.reading.schema import MECHANISM, SECTIONS, TOP, WHEEL_KEYS
from flywheel.reference import text
from tests.fuzzing.corpus import corpus
from tests.fuzzing.structure import at, places
from tests.limits import sample

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


def every_kind_of_place():
    """Name, scene and path of one place for each key of each type of table that the project's scenes have."""
    found = {}
    for name, scene in sorted(SCENES.items(), key=lambda item: len(str(item[1]))):
        for path in places(scene):
            above = [at(scene, path[:k]) for k in range(1, len(path))]
            types = tuple(table["type"] for table in above if isinstance(table, dict) and "type" in table)
            chosen = [isinstance(part, int) or (k > 0 and path[k - 1] in FREE) for k, part in enumerate(path)]
            where = tuple("*" if free else part for part, free in zip(path, chosen, strict=True))
            found.setdefault((where, types), (name, scene, path))
    return found.values()


def test_it_is_a_schema():
    Draft7Validator.check_schema(SCHEMA)


def test_every_scene_of_the_project_is_valid():
    for name, scene in SCENES.items():
        assert not list(Draft7Validator(SCHEMA).iter_errors(scene)), name


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
        found = tables["flywheel"]["properties"][key.name] if key in WHEEL_KEYS else tables[key.name]
        assert found["description"].startswith(key.about)
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
    shown = text("overview")
    assert "#:schema ./flywheel.schema.json" in shown
    assert tomllib.loads(re.search(r"    \[\[rule\]\]\n(?:    .*\n)+", shown)[0])["rule"][0]["schema"] == {
        "path": "flywheel.schema.json"
    }
