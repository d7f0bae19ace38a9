"""The reference explains every key that the format knows; its examples can be sized, or without a flywheel reduced."""

import re

import pytest

import flywheel
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.linkage import linkage_of
from flywheel.numerics.units import UNITS
from flywheel.reading.load_models import LOAD_MODELS
from flywheel.reading.motors import MOTORS
from flywheel.reading.scenes import load
from flywheel.reading.schema import LINKAGE_SECTIONS, MECHANISM, OUTPUT, SECTIONS, TABLE, TOP, WHEEL_KEYS
from flywheel.reference import text, topics
from tests import regimes

SECTION_TOPICS = {name: name for name in SECTIONS} | {"damper": "spring"}
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
    wanted = {*result, *nested, *result["areas"][0], *result["reduced_inertia"], *result["energy"], *result["shafts"][0]}
    assert wanted <= quoted("results")


@pytest.mark.parametrize(
    "name", [name if name != "light" else pytest.param(name, marks=pytest.mark.slow) for name in regimes.BAD]
)
def test_every_machine_without_a_regime_is_explained(name):
    names = re.findall(r"^- \*\*(.*?)\*\*", text("regime"), re.MULTILINE)
    with pytest.raises(flywheel.SceneError) as caught:
        flywheel.size(load(regimes.BAD[name].scene), simulate=False)
    assert any(each in str(caught.value) for each in names)


@pytest.mark.parametrize(("topic", "block"), EXAMPLES, ids=[topic for topic, _ in EXAMPLES])
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
