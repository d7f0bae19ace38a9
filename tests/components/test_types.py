"""Every type of motor and of load model has what the places need that show one: form, report, tables, JSON, pictures."""

from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path

import pytest
from click.testing import CliRunner

import flywheel
from flywheel import language
from flywheel.cli import main
from flywheel.components.energy import Energy
from flywheel.components.load_models import MODELS, is_loss, model_of
from flywheel.components.motors import Motor
from flywheel.page.edits import Draft
from flywheel.reading.loads import LOAD_MODELS
from flywheel.reading.motors import MOTORS, TABLES
from tests.limits import sample
from tests.scenes import DRIVEN, LOADED

REFERENCE = Path(flywheel.__file__).parent / "reference"
BELT = 'type = "belt", tight = "6 N", slack = "2 N", radius = "20 mm"'
ON_A_PORT = ("press", "punch", "indicator", "compressor")


def begun(text: str, path: str, kind: str) -> str:
    """The text after a choice of this type on the form."""
    draft = Draft(text)
    draft.edit(path, kind)
    assert draft.faults == []
    return draft.outline.text


def motor_text(kind: str) -> str:
    return begun(DRIVEN % ("constant" if kind != "constant" else "line"), "drive.motor.type", kind)


def load_text(kind: str) -> str:
    place = "slider" if kind in ON_A_PORT else "crank"
    before = BELT if kind != "belt" else 'type = "constant", torque = "1 N m"'
    return begun(LOADED % (place, before), "load[0].model.type", kind)


def output(*arguments: str) -> str:
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output or result.exception
    return result.stdout


def translated(words: str) -> None:
    assert not words or words in language.catalogue("es"), words


def every_place(scene: str, tmp_path: Path) -> tuple[str, str]:
    """A scene through every place that shows it; its report in English and in Spanish."""
    file = tmp_path / "scene.toml"
    file.write_text(scene, encoding="utf-8")
    assert "Traceback" not in output("size", str(file), "--full")
    json.loads(output("size", str(file), "--json"))
    json.loads(output("power", str(file), "--json"))
    output("power", str(file))
    flywheel.power_flow(flywheel.size(flywheel.load(file), simulate=False)).plot(tmp_path / "power.svg")
    output("size", str(file), "--language", "es")
    reports = [tmp_path / f"{name}.html" for name in ("en", "es")]
    for report in reports:
        output("report", str(file), "-o", str(report), "--language", report.stem)
    english, spanish = (report.read_text("utf-8") for report in reports)
    return english, spanish


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize("kind", sample(MOTORS, 9))
def test_a_type_of_motor_has_what_every_place_needs(kind: str, tmp_path: Path) -> None:
    section, text = MOTORS[kind], motor_text(kind)
    motor = flywheel.load(text).motor
    assert isinstance(motor, Motor)
    assert type(motor) is section.makes
    assert set(section.begin) <= {key.name for key in section.keys}
    assert f'"{kind}"' in (REFERENCE / "motor.md").read_text("utf-8")
    translated(motor.title)
    translated(motor.formula)
    facts = [*motor.facts()]
    assert facts or motor.points
    assert all(fact.words and (fact.value is not None or fact.formula or not fact.symbol) for fact in facts)
    assert motor.heated is None or {motor.heated, f"{motor.heated}_share"} <= {*Energy._fields}
    assert (motor.heated is None) == (type(motor).heats is Motor.heats)
    assert (motor.heated is None) == (motor.heat(motor.no_load_speed or 1.0) is None)
    assert ("start" in {key.name for key in section.keys}) == bool(motor.starts)
    assert {one.name for one in fields(motor)} >= {"inertia", "start"}
    english, spanish = every_place(text, tmp_path)
    with language.use("es"):
        words = language.message(motor.title)
    assert motor.title in english
    assert words in spanish
    assert all(fact.words.split(".")[0] in english for fact in facts)


WITHIN = [
    (kind, key.name)
    for kind, section in MOTORS.items()
    if kind not in ("dc", "engine")
    for key in section.keys
    if key.name in TABLES
]  # of the two others, first values belong to another kind of motor, or stand instead of a torque


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize(("kind", "table"), sample(WITHIN, 3))
def test_a_table_within_a_motor_s_own_has_what_every_place_needs(kind: str, table: str, tmp_path: Path) -> None:
    values = ", ".join(f"{key} = {json.dumps(value)}" for key, value in TABLES[table].begin.items())
    text = motor_text(kind).replace("motor = {", f"motor = {{{table} = {{{values}}}, ")
    assert getattr(flywheel.load(text).motor, table) is not None
    every_place(text, tmp_path)


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize("kind", sample(LOAD_MODELS, 9))
def test_a_load_model_has_what_every_place_needs(kind: str, tmp_path: Path) -> None:
    text, model = load_text(kind), MODELS[kind]
    load = flywheel.load(text).loads[0]
    assert model_of(load.model) is model
    assert is_loss(load.model) == model.loss
    assert f"`{kind}`" in (REFERENCE / "load-models.md").read_text("utf-8")
    if not model.loss:  # whose stream has words of its own
        translated(model.words)
    translated(model.formula)
    english, _ = every_place(text, tmp_path)
    assert model.formula[:6].split("=")[0] in english


def test_every_type_has_one_entry() -> None:
    assert MODELS.keys() == LOAD_MODELS.keys()
    made = {section.makes for section in MOTORS.values()}
    assert len(made) == len(MOTORS)
    assert len({motor.title for motor in made}) == len(made)
