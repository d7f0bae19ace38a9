"""The ends of a port's stroke: in closed form, by search on a fine grid, along a stroke, with kinks."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import flywheel
from flywheel.mechanisms.families import build, ends_of
from flywheel.numerics.faults import SceneError
from flywheel.reading.scenes import build_scene
from flywheel.scene.scene import Mechanism

STARTERS = Path(flywheel.__file__).parent / "starters"


def stroke(mechanism: Mechanism, port: str, parameters: Any = None) -> tuple[float, float]:
    ends = ends_of(mechanism, port, parameters or {})
    return ends.low, ends.high


def crank(kind: str, **lengths: float) -> Mechanism:
    geometry = {"slider.offset": 0.0, "yoke.direction": 0.0}
    geometry |= {name.replace("_", "."): value for name, value in lengths.items()}
    return Mechanism(kind, "m", geometry=geometry)


def searched(mechanism: Mechanism, port: str, sign: int, span: float, first: float = 0.0) -> float:
    """Greatest (sign 1) or least displacement by a grid, then by Brent's method."""
    family = build(mechanism)

    def goal(psi: Any) -> Any:
        return -sign * family.ports[port].position(family.position(psi, np))

    grid = first + np.linspace(0.0, span, 4001)
    best = grid[np.argmin(goal(grid))]
    step = span / 2000
    found = minimize_scalar(goal, bounds=(max(best - step, first), min(best + step, first + span)), options={"xatol": 1e-12})
    return -sign * min(float(found.fun), float(goal(best)))


def test_ends_of_an_offset_slider_crank_in_closed_form():
    r, rod, e = 0.1, 0.4, 0.05
    low, high = stroke(crank("slider-crank", crank_length=r, rod_length=rod, slider_offset=e), "slider")
    assert high == pytest.approx(np.sqrt((rod + r) ** 2 - e**2), rel=1e-15)
    assert low == pytest.approx(np.sqrt((rod - r) ** 2 - e**2), rel=1e-15)


@pytest.mark.parametrize(
    ("mechanism", "port"),
    [
        (crank("scotch-yoke", crank_length=0.1, yoke_direction=0.3), "yoke"),
        (crank("slider-crank", crank_length=0.1, rod_length=0.4, slider_offset=-0.07), "rod"),
        (crank("four-bar", ground_length=4.0, crank_length=1.0, coupler_length=2.01, rocker_length=3.0), "rocker"),
        (crank("four-bar", ground_length=4.0, crank_length=1.0, coupler_length=2.5, rocker_length=3.0), "coupler"),
        (crank("crank-shaper", crank_length=0.1, frame_length=0.3, rocker_length=0.6), "ram"),
        (crank("crank-shaper", crank_length=0.1, frame_length=0.101, rocker_length=0.6), "rocker"),
    ],
    ids=lambda item: getattr(item, "type", item),
)
def test_ends_as_a_search_finds_them(mechanism, port):
    found = stroke(mechanism, port)
    wanted = [searched(mechanism, port, sign, 2 * np.pi) for sign in (-1, 1)]
    assert found == pytest.approx(wanted, rel=1e-13, abs=1e-13)
    assert found[0] <= wanted[0] + 1e-15
    assert found[1] >= wanted[1] - 1e-15


@pytest.mark.parametrize("port", ["platen", "bell_crank", "coupler"])
def test_ends_along_a_stroke(port):
    scene = build_scene(tomllib.loads((STARTERS / "toggle-clamp.toml").read_text(encoding="utf-8")))
    mechanism = scene.mechanisms[0]
    first, last = mechanism.stroke
    found = stroke(mechanism, port)
    wanted = [searched(mechanism, port, sign, last - first, first) for sign in (-1, 1)]
    assert found == pytest.approx(wanted, rel=1e-12)
    assert ends_of(mechanism, port).before(True, 10.0) is None


def law(x: str) -> Mechanism:
    scene = {"mechanism": {"type": "law", "outputs": {"ram": {"x": x}}}, "regime": {"speed": 1}, "flywheel": {"inertia": 1}}
    return build_scene(scene | {"parameters": {"s": 0.2}}).mechanisms[0]


@pytest.mark.parametrize(
    ("x", "wanted"),
    [
        ("s*(phi/2 if phi < 2 else (2*pi - phi)/(2*pi - 2))", (0.0, 0.2)),
        ("0.3*max(sin(phi), 0)", (0.0, 0.3)),
        ("s*sin(phi) + 0.05*cos(3*phi)", None),
        ("s*abs(sin(phi))", (0.0, 0.2)),
    ],
)
def test_ends_of_laws(x, wanted):
    mechanism = law(x)
    found = stroke(mechanism, "ram", {"s": 0.2})
    phi = np.linspace(0, 2 * np.pi, 200_001)
    if wanted is None:
        values = 0.2 * np.sin(phi) + 0.05 * np.cos(3 * phi)
        wanted = values.min(), values.max()
    assert found == pytest.approx(wanted, abs=1e-9)


def linkage() -> dict[str, Any]:
    return tomllib.loads((STARTERS / "linkage.toml").read_text(encoding="utf-8"))


def test_ends_of_a_linkage_as_a_search_finds_them():
    mechanism = build_scene(linkage()).mechanisms[0]
    family = build(mechanism)
    for port, made in family.ports.items():
        if not made.returns:
            continue
        wanted = [searched(mechanism, port, sign, mechanism.travel) for sign in (-1, 1)]
        assert stroke(mechanism, port) == pytest.approx(wanted, rel=1e-12, abs=1e-13)


def test_the_way_before_an_end():
    r, rod, angle = 0.1, 0.4, 0.7
    ends = ends_of(crank("slider-crank", crank_length=r, rod_length=rod), "slider")
    x = r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2)
    assert ends.before(True, angle) == pytest.approx(r + rod - x, rel=1e-13)
    back = -r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2)
    assert ends.before(False, angle) == pytest.approx(back - (rod - r), rel=1e-13)
    assert ends.before(True, np.pi) == pytest.approx(2 * r, rel=1e-13)
    assert ends.before(True, np.pi + 0.01) is None
    assert ends.before(True, 40.0) is None


def test_a_mechanism_that_locks_is_refused():
    with pytest.raises(SceneError, match="rod"):
        stroke(crank("slider-crank", crank_length=0.4, rod_length=0.1), "slider")
