"""Motion without any load, inertia that vanishes, flywheels that come out negative, and dead centres: in closed form."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp  # type: ignore[import-untyped]

import flywheel
from flywheel.sizing.results import Sizing

from .machines import Scene
from .measured import Found, Row, refusal, worst

R, L, MASS, SPEED = 0.1, 0.3, 2.0, 10.0
FREE = (1e-14, 1e-6, 0.05, 1.0, 1.99)
DWELL = "0.1*sin(phi)**3 if phi < pi else 0"  # max x'² = 0.09 (4/27): at sin² = 2/3


def yoke(eps: float, **more: Any) -> Scene:
    """A yoke of 2 kg, and nothing else: I* = m R² sin²."""
    machine = {"type": "scotch-yoke", "crank": {"length": R}, "yoke": {"mass": MASS}}
    return {"mechanism": machine, "regime": {"speed": SPEED}, "flywheel": {"irregularity": eps}} | more


def slider(wheel: dict[str, float], crank: float = 0.0, **more: Any) -> Scene:
    """A slider of 2 kg on a crank that may weigh nothing."""
    lengths = {"crank": {"length": R, "inertia": crank}, "rod": {"length": L}, "slider": {"mass": MASS}}
    return {"mechanism": {"type": "slider-crank"} | lengths, "regime": {"speed": SPEED}, "flywheel": wheel} | more


def dwelling(eps: float, **more: Any) -> Scene:
    """A slide of 3 kg that rests for half a turn."""
    machine = {"type": "law", "outputs": {"slide": {"x": DWELL, "mass": 3}}}
    return {"mechanism": machine, "regime": {"speed": SPEED}, "flywheel": {"irregularity": eps}} | more


def sized(scene: Scene, *, simulate: bool = False) -> Sizing:
    """The scene, sized."""
    return flywheel.size(flywheel.load(scene), simulate=simulate)


def slider_peak() -> Any:
    """The greatest I* of the slider: m x'² at its greatest speed."""

    def speed(phi: Any) -> Any:
        return R * mp.sin(phi) * (1 + R * mp.cos(phi) / mp.sqrt(mp.mpf(L) ** 2 - (R * mp.sin(phi)) ** 2))

    return mp.mpf(MASS) * speed(mp.findroot(lambda phi: mp.diff(speed, phi), mp.mpf("1.27"))) ** 2


def free(eps: float, most: Any, least: Any = 0) -> Any:
    """The flywheel of M* = 0: (z- max I* - z+ min I*)/(2 eps), and no less than none."""
    e = mp.mpf(eps)
    return max(((1 - e / 2) ** 2 * most - (1 + e / 2) ** 2 * least) / (2 * e), mp.zero)


def machines() -> dict[str, tuple[Any, Any]]:
    """What makes a scene of an irregularity, and its greatest I*."""
    return {
        "yoke": (yoke, mp.mpf(MASS) * mp.mpf(R) ** 2),
        "slider-crank": (lambda eps: slider({"irregularity": eps}), slider_peak()),
        "dwell": (dwelling, mp.mpf(3) * mp.mpf("0.01") * 9 * mp.mpf(4) / 27),
    }


@cache
def without_loads() -> list[Found]:
    """Name, true error and estimate of every machine at every irregularity; errors by the scale of the figure."""
    found = []
    with mp.workdps(30):
        for name, (scene, most) in machines().items():
            for eps in FREE:
                result, true = sized(scene(eps)), free(eps, most)
                assert result.flywheel.exact is not None
                assert result.error.exact is not None
                error = float(abs(result.flywheel.exact - true) / true)
                found.append(Found(f"{name}, eps {eps:g}", error, result.error.exact))
    return found


BARE = {
    "a slider-crank": slider({"inertia": 0.0}),
    "all but": slider({"inertia": 1e-15}),
    "a dwell": dwelling(0.05, flywheel={"inertia": 0.0}),
}


def results() -> list[Row]:
    """Free motion, the flywheels that are not needed, and what is refused."""
    rows = [worst("M* = 0, I* down to 0", "eps 1e-14..1.99", without_loads())]
    return rows + [Row("I* = 0 and no flywheel", name, None, None, refusal(scene)) for name, scene in BARE.items()]


def test_without_loads_the_exact_flywheel_is_that_of_the_inertia_alone() -> None:
    for found in without_loads():
        assert found.honest, found
        assert found.estimate < 5e-8, found


def test_without_loads_the_areas_know_of_no_flywheel() -> None:
    found = sized(yoke(0.05), simulate=True)
    assert found.energy_fluctuation == 0.0
    assert [area.work for area in found.areas] == [0.0]
    assert found.flywheel.approximate == found.flywheel.approximate_total == 0.0
    assert found.simulation is not None
    assert found.simulation.irregularity == pytest.approx(0.05, rel=1e-10)
    assert found.simulation.irregularity_approximate is None
    assert any("no steady motion with the approximate flywheel" in said for said in found.messages)


@settings(derandomize=True, deadline=None, max_examples=8)
@given(st.floats(-12, 0.29).map(lambda power: 10.0**power), st.floats(0.0, 0.05))
def test_a_crank_that_weighs_takes_its_share_of_the_flywheel(eps: float, crank: float) -> None:
    found = sized(slider({"irregularity": eps}, crank))
    assert found.reduced_inertia is not None
    assert found.flywheel.exact is not None
    true = free(eps, found.reduced_inertia.greatest, found.reduced_inertia.least)
    assert found.flywheel.exact == pytest.approx(float(true), rel=1e-10, abs=1e-9 * found.reduced_inertia.greatest)
    assert found.flywheel.needed is (found.flywheel.exact > 0.0)


@pytest.mark.parametrize("name", BARE)
def test_a_machine_that_weighs_nothing_somewhere_is_refused_without_a_flywheel(name: str) -> None:
    said = refusal(BARE[name])
    assert said.startswith("flywheel.inertia: found I* + J = 0 kg m² at crank angle")
    assert "expected a positive inertia everywhere" in said


def test_a_dwell_is_confirmed_in_time_with_its_flywheel() -> None:
    found = sized(dwelling(0.05), simulate=True)
    assert found.simulation is not None
    assert found.error.simulation is not None
    assert abs(found.simulation.irregularity / 0.05 - 1) <= found.error.simulation < 1e-9


def test_a_flywheel_that_would_be_negative_is_none() -> None:
    """The machine's own irregularity is that of its I*: (sqrt(max) - sqrt(min)) / (sqrt(max) + sqrt(min)), twice."""
    wheel = {"on": "far", "irregularity": 1.2}
    found = sized(slider({"irregularity": 0.0}, 0.02, shafts={"far": {"ratio": 7.0}}, flywheel=wheel), simulate=True)
    assert found.flywheel.exact == 0.0
    assert found.flywheel.needed is False
    assert found.flywheel.bracket is not None
    assert found.flywheel.bracket[0] < 0.0
    most, least = mp.sqrt(slider_peak() + mp.mpf(0.02)), mp.sqrt(mp.mpf(0.02))
    assert found.simulation is not None
    assert found.simulation.irregularity == pytest.approx(float(2 * (most - least) / (most + least)), rel=1e-9)
    assert found.speed == SPEED


def pushed(load: dict[str, Any]) -> Sizing:
    """A load of 100 N on the slider, in some window that reaches from dead centre to dead centre."""
    loads = [{"on": "slider"} | load]
    return sized(slider({"irregularity": 0.05}, 0.02, load=loads, drive={"torque": "balance"}))


def test_loads_that_switch_at_the_dead_centres_are_one_and_the_same() -> None:
    said: list[dict[str, Any]] = [
        {"force": -100, "while": "v > 0"},
        {"force": "-100 if v > 0 else 0"},
        {"force": -100, "from": "180 deg", "to": "360 deg"},
        {"force": "-100 if phi >= pi else 0"},
    ]
    one, *others = [pushed(load) for load in said]
    assert one.balance is not None
    assert one.balance.value == pytest.approx(100 * 2 * R / (2 * float(mp.pi)), rel=1e-13)
    for other in others:
        assert other.balance is not None
        assert other.balance.value == pytest.approx(one.balance.value, rel=1e-13)
        assert other.flywheel.exact == pytest.approx(one.flywheel.exact, rel=1e-12)
        assert len(other.areas) == len(one.areas)


@pytest.mark.parametrize("width", [1e-3, 1e-7])
def test_a_push_at_the_dead_centre_does_no_work(width: float) -> None:
    at = [{"on": "slider", "force": -100, "from": f"{180 - width} deg", "to": f"{180 + width} deg"}]
    found = sized(slider({"irregularity": 0.05}, 0.02, load=at, drive={"torque": "balance"}))
    none = sized(slider({"irregularity": 0.05}, 0.02))
    assert found.flywheel.exact == pytest.approx(none.flywheel.exact, rel=1e-4 * width)
    assert found.balance is not None
    assert abs(found.balance.value) < 1e-12


def test_a_spring_at_rest_at_the_dead_centre_stores_what_the_stroke_takes() -> None:
    spring = [{"on": "slider", "stiffness": 1e12, "rest": R + L}]
    found = sized(slider({"irregularity": 0.05}, 0.02, spring=spring))
    assert found.energy_fluctuation == pytest.approx(0.5 * 1e12 * (2 * R) ** 2, rel=1e-12)
    assert len(found.areas) == 2


def test_reactions_at_the_dead_centres_are_those_of_the_slider_that_turns_back() -> None:
    """x'' = -r w² (1 ± r/l): the rod pulls the slider back, nothing presses on its guide, and the crank need not push."""
    scene = flywheel.load(slider({"inertia": 1.0}, 0.02))
    found = flywheel.joint_forces(scene, [0.0, float(mp.pi)], speed=SPEED).mechanisms["slider-crank"]
    true = [-MASS * R * SPEED**2 * (1 + R / L), MASS * R * SPEED**2 * (1 - R / L)]
    assert found.components["slider_pin"]["x"] == pytest.approx(true, rel=1e-12)
    assert abs(found.components["guide"]["normal"]).max() < 1e-12
    assert abs(found.action).max() < 1e-12


def test_the_graph_at_a_dead_centre_has_a_gain_of_zero_and_not_a_hole() -> None:
    scene = flywheel.load(slider({"inertia": 1.0}, 0.02, load=[{"on": "slider", "force": -100}]))
    state = flywheel.reduce(scene, [0.0, float(mp.pi)])
    assert abs(state.gains["slider-crank.slider"]).max() < 1e-16
    assert state.inertia.tolist() == [0.02, 0.02]
    assert abs(state.moment).max() < 1e-14
