"""A family of mechanisms is one file: `swinging_cylinder.py`, registered, does all that those of the toolkit do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import flywheel
from flywheel import reference
from flywheel.mechanisms import KINDS, register
from tests.mechanisms import swinging_cylinder

SCENE = """
[mechanism]
type = "swinging-cylinder"
crank = {length = "60 mm", mass = "3 kg", inertia = "0.002 kg m^2", com = "20 mm"}
frame.length = "250 mm"
cylinder = {inertia = "0.05 kg m^2"}

[[load]]
on = "swinging-cylinder.rod"
force = "4 kN"
from = 0
to = "180 deg"

[drive]
torque = "balance"

[regime]
speed = "240 rpm"

[flywheel]
irregularity = "2 %"
"""


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(KINDS, "homes", dict(KINDS.homes))
    register(swinging_cylinder.KIND)
    return


def scene(tmp_path: Path, text: str = SCENE) -> flywheel.Scene:
    path = tmp_path / "engine.toml"
    path.write_text(text, encoding="utf-8")
    return flywheel.load(path)


def test_it_is_sized_from_a_file(tmp_path: Path) -> None:
    result = flywheel.size(scene(tmp_path))
    assert result.balance.value == pytest.approx(-4000 * 0.12 / (2 * math.pi), rel=1e-12)


def test_its_reduction_follows_its_geometry(tmp_path: Path) -> None:
    phi = np.linspace(0.1, 6.2, 7)
    state = flywheel.reduce(scene(tmp_path), phi)
    swing = 0.06 * (0.06 - 0.25 * np.cos(phi)) / (0.06**2 + 0.25**2 - 2 * 0.06 * 0.25 * np.cos(phi))
    assert state.inertia == pytest.approx(0.002 + 3 * 0.02**2 + 0.05 * swing**2, rel=1e-13)


def test_it_has_reactions_and_a_picture(tmp_path: Path) -> None:
    forces = flywheel.joint_forces(scene(tmp_path), [math.pi / 2]).mechanisms["swinging-cylinder"]
    assert {"pivot", "pin", "trunnion", "bore"} <= set(forces.forces)
    assert flywheel.draw(scene(tmp_path)).axes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("frame.length", "frame.lenght", 'did you mean "length"?'),
        ('"250 mm"', '"-1 mm"', "above 0"),
        ('"250 mm"', '"50 mm"', "the crank locks at 0 deg"),
        ("swinging-cylinder.rod", "swinging-cylinder.bar", "rod"),
        ('type = "swinging-cylinder"', 'type = "swinging-cylindre"', 'did you mean "swinging-cylinder"?'),
    ],
)
def test_its_faults_are_told(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(flywheel.SceneError) as caught:
        scene(tmp_path, SCENE.replace(old, new))
    assert any(message in str(fault) for fault in caught.value.faults)


def test_its_page_is_in_the_reference() -> None:
    page = reference.text("swinging-cylinder")
    assert "`frame.length` | length above 0, required" in page
    assert "mass at least 0, default 0.0" in page
    assert "s = sqrt(r^2 + d^2 - 2 r d cos phi)" in page
    assert "swinging-cylinder" in reference.topics()


def test_a_name_is_taken_once() -> None:
    with pytest.raises(ValueError, match="called 'four-bar' already"):
        register(swinging_cylinder.KIND._replace(name="four-bar"))
