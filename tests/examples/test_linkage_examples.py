"""The example linkages move as closed forms say, and need the flywheels that energy says."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import flywheel
from flywheel.mechanisms.linkages.positions import Poses, solve
from flywheel.scene.scene import Scene

FOLDER = Path(__file__).parents[2] / "examples" / "linkages"
TURN = 2 * math.pi
PHI = np.radians(np.arange(0.0, 361.0, 2.5))


@cache
def scene(name: str) -> Scene:
    return flywheel.load(FOLDER / f"{name}.toml")


def poses(name: str, q: NDArray[np.float64] = PHI) -> Poses:
    linkage = scene(name).mechanisms[0].linkage
    assert linkage is not None
    return solve(linkage, 0.0, TURN).poses(q)


def test_the_offset_slider_crank_is_that_of_the_named_type():
    text = (FOLDER / "offset_slider_crank.toml").read_text(encoding="utf-8")
    named = """
[mechanism]
type = "slider-crank"
crank = { length = "60 mm", mass = "8 kg", inertia = "0.02 kg m^2", com = "6 mm" }
rod = { length = "240 mm", mass = "3.2 kg", inertia = "0.024 kg m^2", com = "80 mm" }
slider = { mass = "2.1 kg", offset = "15 mm" }
"""
    rest = text[text.index("[[load]]") :].replace('"cylinder"', '"slider"')
    expected = flywheel.size(flywheel.load(named + rest), simulate=False)
    found = flywheel.size(scene("offset_slider_crank"), simulate=False)
    assert found.flywheel.exact == pytest.approx(expected.flywheel.exact, rel=1e-11)
    assert found.balance is not None
    assert expected.balance is not None
    assert found.balance.value == pytest.approx(expected.balance.value, rel=1e-11)
    assert found.reduced_inertia == pytest.approx(expected.reduced_inertia, rel=1e-11)


def test_whitworths_lever_and_ram():
    found = poses("whitworth")
    lever = np.unwrap(np.arctan2(0.12 * np.sin(PHI) + 0.05, 0.12 * np.cos(PHI)))
    ram = -0.09 * np.cos(lever) + np.sqrt(0.42**2 - (0.09 * np.sin(lever)) ** 2)
    assert found.angle("lever").value == pytest.approx(lever, abs=1e-12)
    assert found.point("ram", (0.0, 0.0)).value[0] == pytest.approx(ram, abs=1e-12)


def test_whitworths_return_is_quick():
    level = math.asin(0.05 / 0.12)  # the lever lies along the ram's line at -level and pi + level of the crank
    forward = np.linspace(-level, math.pi + level, 181)[1:-1] % TURN
    assert (poses("whitworth", np.sort(forward)).point("ram", (0.0, 0.0)).rate[0] > 0).all()
    assert math.degrees(math.pi + 2 * level) == pytest.approx(229, abs=0.5)


def test_the_geared_cranks_carry_the_ram_along_a_line():
    ram = poses("geared_five_bar").point("right_rod", (0.45, 0.0)).value
    depth = 0.07 * np.sin(PHI) - np.sqrt(0.45**2 - (0.16 - 0.07 * np.cos(PHI)) ** 2)
    assert ram[0] == pytest.approx(np.zeros_like(PHI), abs=1e-12)
    assert ram[1] == pytest.approx(depth, abs=1e-12)


@pytest.mark.slow
def test_the_cam_swings_the_bell_crank_by_a_cycloid():
    found = poses("cam_press")
    rise, dwell, fall = (math.radians(angle) for angle in (120.0, 30.0, 90.0))

    def cycloid(u: NDArray[np.float64]) -> NDArray[np.float64]:
        inside = np.clip(u, 0.0, 1.0)
        return inside - np.sin(TURN * inside) / TURN

    swing = math.radians(16.0)
    angle = swing * (0.5 - cycloid(PHI / rise) + cycloid((PHI - rise - dwell) / fall))
    assert found.angle("bell_crank").value == pytest.approx(angle, abs=1e-12)
    sideways = 0.22 + 0.2 * np.cos(angle) - 0.42
    ram = 0.2 * np.sin(angle) - np.sqrt(0.26**2 - sideways**2)
    assert found.point("ram", (0.0, 0.0)).value[1] == pytest.approx(ram, abs=1e-12)


def test_the_crusher_keeps_its_lengths_and_does_the_work_of_its_stroke():
    found = poses("six_bar")
    ends = [
        ("pitman", (-0.1, -1.05), (-0.56, 0.3), 0.48, 0.1),
        ("jaw", (0.0, 0.0), (0.62, 1.35), 0.0, 0.0),
    ]
    for body, at, fixed, along, across in ends:
        gap = found.point(body, at).value - np.array(fixed)[:, None]
        assert np.hypot(*gap) == pytest.approx(np.full(PHI.size, math.hypot(along, across)), abs=1e-12)
    gap = found.point("jaw", (-0.02, -1.05)).value - found.point("pitman", (0.06, -1.05)).value
    assert np.hypot(*gap) == pytest.approx(np.full(PHI.size, math.hypot(0.52, 0.1)), abs=1e-12)
    face = poses("six_bar", np.linspace(0.0, TURN, 5001)).point("jaw", (0.12, -0.7)).value[0]
    sized = flywheel.size(scene("six_bar"), simulate=False)
    assert sized.balance is not None
    assert sized.balance.value * TURN == pytest.approx(450e3 * np.ptp(face), rel=1e-6)


def toggled(phi: NDArray[np.float64]) -> tuple[NDArray[np.complex128], ...]:
    """Crank pin, knee and ram of the toggle press, by two circles: knee from pin and head, ram from the knee."""
    pin = complex(-0.9, -0.35) + 0.11 * np.exp(1j * phi)
    along = (0.79**2 - 0.35**2 + abs(pin) ** 2) / (2 * abs(pin))
    knee = pin - pin / abs(pin) * (along - 1j * np.sqrt(0.79**2 - along**2))
    return pin, knee, 1j * (knee.imag - np.sqrt(0.4**2 - knee.real**2))


def test_the_toggle_stretches_at_the_bottom_of_the_stroke():
    found, (_, knee, ram) = poses("toggle_press"), toggled(PHI)
    assert found.point("rod", (0.79, 0.0)).value == pytest.approx(np.array([knee.real, knee.imag]), abs=1e-12)
    assert found.point("ram", (0.0, 0.0)).value == pytest.approx(np.array([ram.real, ram.imag]), abs=1e-12)
    assert ram.imag[0] == ram.imag.min() == pytest.approx(-0.75, abs=1e-12)
    assert np.ptp(ram.imag) == pytest.approx(0.151, abs=2e-4)
    falling = PHI.size // 2
    pressing = PHI[falling:][ram.imag[falling:] < -0.748]
    assert TURN - pressing[0] == pytest.approx(math.radians(38), abs=math.radians(2.5))


def test_the_motor_of_the_toggle_press_does_the_work_of_coining():
    sized = flywheel.size(scene("toggle_press"), simulate=False)
    assert sized.balance is not None
    work = 600e6 * 0.002**2 / 2  # of a force that rises by 600 MN/m over 2 mm
    assert sized.balance.value == pytest.approx(work / TURN / 9, rel=1e-9)
    assert sized.power == pytest.approx(work * 40 / 60, rel=1e-9)


@pytest.mark.slow
def test_the_flywheel_of_the_toggle_press_from_positions_alone():
    """Wittenbauer's I = [max(W - z+ w² I*/2) - min(W - z- w² I*/2)]/(eps w²), energies by differences of positions."""
    phi = np.linspace(0.0, TURN, 40001)
    pin, knee, ram = toggled(phi)
    centres = {140: 2 / 11 * pin, 75: pin + 38 / 79 * (knee - pin), 60: knee / 2, 66: (knee + ram) / 2, 320: ram}
    lines = {4.5: (knee - pin) / 0.79, 0.7: knee / 0.35, 1.0: (ram - knee) / 0.4}
    moving = [m * abs(np.gradient(z, phi, edge_order=2)) ** 2 for m, z in (centres | lines).items()]
    inertia = 2.4 + np.sum(moving, axis=0)
    assert flywheel.reduce(scene("toggle_press"), phi[::100]).inertia == pytest.approx(inertia[::100], rel=1e-6)

    height = sum(m * z.imag for m, z in centres.items())
    depth = np.maximum(-0.748 - ram.imag, 0.0)
    coining = 300e6 * np.where(phi > math.pi, depth**2, 0.0)  # done while the ram goes down, before phi = 360 deg
    work = coining[-1] / TURN * phi - coining - 9.80665 * (height - height[0])
    square, eps = (40 / 60 * TURN) ** 2, 0.15
    above, below = (work - (1 + sign * eps / 2) ** 2 * square * inertia / 2 for sign in (1, -1))
    expected = (above.max() - below.min()) / (eps * square) / 9**2
    sized = flywheel.size(scene("toggle_press"), simulate=False)
    assert sized.flywheel.exact == pytest.approx(expected, rel=1e-6)
