"""Mechanisms that all but lock, against 30 digits; those that do are refused, with the length and the angle."""

from __future__ import annotations

import pytest

from tests.limits import sample

from .cases import light
from .machines import Scene, crank_shaper, four_bar
from .measured import Row, measured, names, refusal, row

NEAR = names("rod", "offset", "change point", "shaper")
GROUPS = {
    "slider-crank": ("rod", "r/l 0.99..0.999999, offset 0"),
    "slider-crank with offset": ("offset", "l above r + |e| by 1e-3..1e-6"),
    "four-bar": ("change point", "1e-3..1e-6 from a change point, open, crossed, folded, drag link"),
    "crank-shaper": ("shaper", "frame/crank within 1e-3..1e-6 of 1"),
}
LOCKED: dict[str, tuple[Scene, str, str]] = {
    "r = l": (light(0.1, 0.0), "mechanism.rod.length", "the crank locks at 90 and 270 deg"),
    "r = l but for rounding": (light(0.1 * (1 + 1e-13), 0.0), "mechanism.rod.length", "the crank locks at 90 and 270 deg"),
    "r above l": (light(0.05, 0.0), "mechanism.rod.length", "the crank locks at 30, 150, 210 and 330 deg"),
    "r + e = l": (light(0.3, 0.2), "mechanism.rod.length", "the crank locks at 270 deg"),
    "r - e = l": (light(0.3, -0.2), "mechanism.rod.length", "the crank locks at 90 deg"),
    "c + L = d + r": (four_bar(bars=(0.4, 0.1, 0.3, 0.2)), "mechanism.coupler.length", "the crank locks at 180 deg"),
    "L - c = d - r": (four_bar(bars=(0.4, 0.1, 0.2, 0.5)), "mechanism.coupler.length", "the crank locks at 0 deg"),
    "a double rocker": (four_bar(bars=(0.4, 0.3, 0.2, 0.3)), "mechanism.rocker.length", "the crank locks at "),
    "bars too short": (four_bar(bars=(1.0, 0.1, 0.3, 0.3)), "mechanism.coupler.length", "it closes at no crank angle"),
    "d = r, shaper": (crank_shaper(crank=0.3, frame=0.3), "mechanism.frame.length", "the crank locks at 180 deg"),
    "parallelogram": (four_bar(bars=(0.4, 0.1, 0.4, 0.1)), "mechanism.rocker.length", "the crank locks at "),
}


def results() -> list[Row]:
    """One row per mechanism, and the words of every refusal."""
    near = [row(key, said, (i for n in names(group) for i in measured(n))) for key, (group, said) in GROUPS.items()]
    return near + [Row("locked", key, None, None, refusal(scene)) for key, (scene, *_) in LOCKED.items()]


@pytest.mark.parametrize("name", sample(NEAR, 3))
def test_close_to_a_lock_every_figure_is_known_to_its_estimate_and_to_rtol(name: str) -> None:
    assert [item for item in measured(name) if not item.honest] == []
    assert [item for item in measured(name) if not item.kept] == []


@pytest.mark.slow
def test_only_the_shaper_loses_digits() -> None:
    assert [i for n in NEAR if "shaper" not in n for i in measured(n) if i.rtol == 1e-9 and i.estimate > 1e-9] == []
    assert max(found.error or 0.0 for found in results()) < 1e-9


@pytest.mark.parametrize("name", LOCKED)
def test_what_locks_is_refused_with_the_length_and_the_angle(name: str) -> None:
    scene, path, where = LOCKED[name]
    said = refusal(scene)
    assert said.startswith(f"{path}: found ")
    assert where in said
