"""The best design, and what changes of the data do to a design."""

import json
import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.numerics.optima import STATIONARY, descent, gradient, minimum, slopes
from tests.limits import sample
from tests.scenes import yoke

# The best design: beside closed forms and sweeps, in corners, at bounds and under limits; and where there is none.


ROTOR = {
    "load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "90 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 30},
    "flywheel": {"irregularity": 0.01},
}
"""Load T from 0 to b at w: power T b w/2pi, fluctuation T b (1 - b/2pi), flywheel that over eps w²."""


def loads(*starts):
    return [{"on": "crank", "torque": -100, "from": f"{a} deg", "to": f"{a + 60} deg"} for a in starts]


@pytest.mark.slow
def test_a_limit_that_binds_beside_a_sweep_along_it():
    """Two loads whose power together is 900 W at least: along the limit none of a sweep is better."""
    scene = flywheel.load({**ROTOR, "load": loads(0, 100)})
    result = flywheel.optimize(scene, "flywheel.exact", over={"load.1.torque": (-150, -80), "load.0.torque": (-130, -90)},
                              subject_to={"power": (900, None)}, samples=16, starts=2)  # fmt: skip
    assert result.confirmed
    assert result.limits[0].binds == "low"
    assert result.figures["power"] == pytest.approx(900, rel=1e-9)
    grid = np.array([[a, -900 * 6 / 30 - a] for a in np.linspace(-130, -90, 9)])
    kept = [row for row in grid if -150 <= row[1] <= -80]
    sweep = [flywheel.size(scene.with_({"load.0.torque": a, "load.1.torque": b}), simulate=False).flywheel.exact
             for a, b in kept]  # fmt: skip
    assert result.value <= min(sweep) * (1 + 1e-9)


def test_the_least_swing_is_where_lobes_are_equal():
    """A torque of -T for 60 deg from 0, another of S from 180 deg: equal ones leave the least swing for their sum."""
    scene = flywheel.load({**ROTOR, "load": loads(0, 180)})
    result = flywheel.optimize(scene, "energy_fluctuation/power", over={"load.0.torque": (-200, -50)}, samples=8, starts=1)
    assert result.numbers["load.0.torque"] == pytest.approx(-100, rel=1e-8)
    assert result.confirmed
    assert result.unit == ""


@pytest.mark.slow
def test_an_optimum_inside_and_one_at_a_bound():
    scene = flywheel.load(ROTOR)
    over = {"load.0.to": ("60 deg", "300 deg"), "regime.speed": (20, 40)}
    result = flywheel.optimize(scene, maximize="flywheel.exact", over=over, samples=16, starts=2)
    assert result.numbers == {"load.0.to": pytest.approx(math.pi, abs=1e-5), "regime.speed": 20.0}
    assert result.value == pytest.approx(50 * math.pi / (0.01 * 400), rel=1e-11)
    assert result.at_bounds == {"regime.speed": "low"}
    assert result.messages[0] == ("at its lower bound: regime.speed = 20 rad/s, beyond which flywheel.exact still rises")
    assert abs(result.sizing.flywheel.exact - result.value) <= 2 * result.error
    assert result.best.speed == 20.0
    assert result.as_dict()["numbers"]["regime.speed"]["before"] == 30.0


@pytest.mark.slow
def test_a_wheel_whose_mass_is_least():
    """A disc of given radius: mass 2 J/R², the largest allowed radius is best."""
    wheel = {"irregularity": 0.01, "shape": "disc", "outer_radius": 0.3, "material": "cast steel"}
    scene = flywheel.load({**ROTOR, "flywheel": wheel})
    result = flywheel.optimize(scene, "flywheel.mass", over={"flywheel.outer_radius": ("0.2 m", "500 mm")}, samples=4,
                              starts=1)  # fmt: skip
    exact = 50 * math.pi * 0.75 / (0.01 * 900)
    assert result.value == pytest.approx(2 * exact / 0.25, rel=1e-9)
    assert result.unit == "kg"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"minimize": "exact", "over": {"load.0.to": (1, 2)}, "subject_to": {"power": (None, "100 W")}},
         'subject_to power: found 477.465 W at the best, where load.0.to = 1 rad, expected power <= 100 W'),
        ({"minimize": "exact", "over": {"flywheel.irregularity": (2.5, 3)}}, "no design within the bounds that is"),
        ({"minimize": "mass", "over": {"load.0.to": (1, 2)}}, "give the flywheel a shape"),
        ({"minimize": "exakt", "over": {"load.0.to": (1, 2)}}, 'did you mean "exact"?'),
        ({"minimize": "exact + ", "over": {"load.0.to": (1, 2)}}, "an expression of figures"),
        ({"minimize": "exact", "over": {"load.0.too": (1, 2)}}, 'did you mean "load.0.to"?'),
        ({"minimize": "exact", "over": {"load.0.to": (1, None)}}, "two bounds (low, high)"),
        ({"minimize": "exact", "over": {"load.0.to": (2, 1)}}, "the lower one first"),
        ({"minimize": "exact", "over": {}}, "paths: found none"),
        ({"over": {"load.0.to": (1, 2)}}, "minimize: found nothing to minimize"),
        ({"minimize": "exact", "over": {"load.0.to": (1, 2)}, "subject_to": {"power": 5}}, "limits (low, high)"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_line(options, words):
    with pytest.raises(flywheel.SceneError) as error:
        flywheel.optimize(flywheel.load(ROTOR), **options, samples=4, starts=1)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_an_optimum_that_does_not_exist_is_said():
    """Nothing depends on the irregularity; and the flywheel falls on to where designs are refused."""
    scene = flywheel.load(ROTOR)
    result = flywheel.optimize(scene, "power", over={"flywheel.irregularity": (0.01, 0.02)}, samples=2, starts=1)
    assert result.messages == ("no optimum: power is the same for all designs, whatever flywheel.irregularity",)
    result = flywheel.optimize(scene, "exact", over={"flywheel.irregularity": (0.5, 3)}, samples=4, starts=1)
    ends = "no optimum within the bounds: the best ends at flywheel.irregularity = 2"
    assert any(message.startswith(ends) for message in result.messages)


def test_least_values_of_functions_with_corners():
    calls = []

    def lobes(x):
        calls.append(x.shape[1])
        return np.array([np.abs(x[0] - 0.3) + 3 * np.abs(x[1] - 0.7 * x[0]) + x[1] ** 2, 0.1 - x[0]])

    low, high = np.zeros(2), np.ones(2)
    assert minimum(lobes, np.array([0.2, 0.9]), low, high, high) == pytest.approx([0.3, 0.21], abs=1e-9)
    assert sum(calls) < 1000


WHEEL = {"irregularity": 0.01, "shape": "disc", "bore": "0.1 m", "outer_radius": 0.3, "material": "grey cast iron"}


def test_the_allowable_stress_of_a_wheel_is_kept_without_being_asked_for():
    """A bored disc gets lighter with its radius; by rho w²/4 ((3 + nu) R² + (1 - nu) r²) it bears that up to R alone."""
    scene = flywheel.load({**ROTOR, "regime": {"speed": 150}, "flywheel": WHEEL})
    result = flywheel.optimize(scene, "flywheel.mass", over={"flywheel.outer_radius": (0.2, 0.9)}, samples=4, starts=1)
    fast, density, nu = 150 * 1.005, 7200.0, 0.26
    radius = math.sqrt((4 * 11.5e6 / (density * fast**2) - (1 - nu) * 0.05**2) / (3 + nu))
    inertia = 50 * math.pi * 0.75 / (0.01 * 150**2)
    assert result.numbers["flywheel.outer_radius"] == pytest.approx(radius, rel=1e-8)
    assert result.value == pytest.approx(2 * inertia / (radius**2 + 0.05**2), rel=1e-8)
    assert result.confirmed
    assert result.limits[0][:4] == ("wheel.stress", None, 11.5e6, "Pa")
    assert result.limits[0].binds == "high"
    assert result.messages[0].startswith("the wheel's allowable stress is kept although it was not asked for")
    warned = flywheel.size(result.best).messages
    assert "grey cast iron usually stays below 30 m/s" in warned[0]
    assert set(warned) <= set(result.messages)


@pytest.mark.slow
def test_no_wheel_is_recommended_that_bursts():
    scene = flywheel.load({**ROTOR, "regime": {"speed": 150}, "flywheel": WHEEL})
    with pytest.raises(flywheel.SceneError, match=r"^subject_to wheel.stress: .* at the best, .* expected wheel.stress <="):
        flywheel.optimize(scene, "flywheel.mass", over={"flywheel.outer_radius": (0.5, 0.9)}, samples=2, starts=1)


@pytest.mark.slow
def test_figures_of_the_wheel_in_sweeps_tolerances_sensitivities_and_limits():
    scene, path = flywheel.load({**ROTOR, "flywheel": WHEEL}), "flywheel.outer_radius"
    swept = flywheel.sweep(scene, {path: [0.2, 0.4]})
    fast, radius = 30 * 1.005, np.array([0.2, 0.4])
    stress = 7200 * fast**2 / 4 * (3.26 * radius**2 + 0.74 * 0.05**2)
    assert swept["wheel.stress"] == pytest.approx(stress, rel=1e-9)
    assert swept["wheel.safety"] == pytest.approx(115e6 / stress, rel=1e-9)
    assert swept["wheel.rim_speed"] == pytest.approx(fast * radius, rel=1e-9)
    assert swept["wheel.outer_diameter"] == pytest.approx(2 * radius, rel=1e-12)
    slope = flywheel.sensitivities(scene, path, figures=["wheel.stress"]).derivative("wheel.stress", path)
    assert slope.value == pytest.approx(7200 * fast**2 / 2 * 3.26 * 0.3, rel=1e-7)
    spread = flywheel.tolerance(scene, {path: (0.2, 0.4)}, figures=["wheel.stress"], samples=64)["wheel.stress"]
    assert (spread.least.value, spread.greatest.value) == pytest.approx(tuple(stress), rel=1e-9)
    result = flywheel.optimize(scene, "mass", over={path: (0.2, 0.9)}, subject_to={"wheel.rim_speed": (None, "15 m/s")},
                              samples=2, starts=1)  # fmt: skip
    assert result.numbers[path] == pytest.approx(15 / fast, rel=1e-8)


def test_a_wheel_that_is_not_needed_has_no_stress():
    light = {
        "load": [{"on": "crank", "torque": "-1 N m", "from": 0, "to": "90 deg"}],
        "inertia": [{"on": "crank", "value": 50}],
    }
    scene = flywheel.load({**ROTOR, **light, "flywheel": WHEEL})
    swept = flywheel.sweep(scene, {"flywheel.outer_radius": [0.3]})
    assert [swept[name][0] for name in ("mass", "wheel.stress", "wheel.outer_diameter")] == [0.0, 0.0, 0.0]
    assert math.isinf(swept["wheel.safety"][0])


COUNTERWEIGHT = {
    "mechanism": {"type": "slider-crank", "crank": {"length": 0.1, "mass": 30, "com": 0.5}, "rod": {"length": 0.4}},
    "gravity": {"direction": "-90 deg"},
    "load": [{"on": "crank", "torque": "100*cos(phi) + 50*cos(2*phi)"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 10},
    "flywheel": {"irregularity": 0.01},
}
"""A weight against 100 cos(phi): balanced where m s g = 100 N m, with the swing of 50 cos(2 phi), 50 J, left over."""


@pytest.mark.slow
def test_the_ridge_of_a_product_is_followed_to_its_end():
    """On m s g = 100 the flywheel is 50/(eps w²) - m s², the least at the greatest s; beside it the swing grows."""
    over = {"mechanism.crank.com": (0.2, 1.0), "mechanism.crank.mass": (5, 80)}
    scene = flywheel.load(COUNTERWEIGHT)
    result = flywheel.optimize(scene, "exact", over=over, samples=8, starts=1)
    assert result.value == pytest.approx(50 / (0.01 * 100) - 100 / 9.80665, rel=1e-7)
    assert result.numbers["mechanism.crank.mass"] == pytest.approx(100 / 9.80665, rel=1e-6)
    assert result.numbers["mechanism.crank.com"] == pytest.approx(1.0, rel=1e-7)  # at its bound, or a rounding below it
    assert result.at_bounds == {"mechanism.crank.com": "high"}
    assert result.confirmed


@pytest.mark.parametrize(
    ("ridge", "end", "low", "high"),
    sample(
        [
            (lambda x: np.abs(x[0] * x[1] - 0.3) - 0.01 * x[0], (1.0, 0.3), (0.1, 0.1), (1.0, 1.0)),
            (lambda x: np.abs(x[0] * x[1] - 0.3) + 0.1 * (x[0] - 0.6) ** 2, (0.6, 0.5), (0.1, 0.1), (1.0, 1.0)),
            (lambda x: 5 * np.abs(x[0] ** 2 + x[1] ** 2 - 1) - x[0] - x[1], (0.5**0.5, 0.5**0.5), (-2.0, -2.0), (2.0, 2.0)),
            (lambda x: 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2 + 1, (1.0, 1.0), (-2.0, -2.0), (2.0, 2.0)),
        ],
        2,
    ),
)
def test_curved_ridges_and_where_they_end(ridge, end, low, high):
    low, high = np.array(low), np.array(high)

    def rows(x):
        return ridge(x)[None]

    result = minimum(rows, low + np.array([0.2, 0.9]) * (high - low), low, high, high - low)
    assert result == pytest.approx(end, abs=2e-6)
    assert descent(rows, np.array(end), low, high) <= STATIONARY
    beside = np.clip(np.array(end) + 0.02 * (high - low) * np.array([-1.0, 0.0]), low, high)
    assert descent(rows, beside, low, high) > STATIONARY


def test_a_bound_is_named_by_its_own_side():
    """An optimum that is off the lower bound by less than counts."""
    aim = "1 + 1000*abs(flywheel.irregularity - 0.2500000003)"
    result = flywheel.optimize(flywheel.load(ROTOR), aim, over={"flywheel.irregularity": (0.25, 0.7)}, samples=2, starts=1)
    assert result.at_bounds == {"flywheel.irregularity": "low"}
    assert any(message.startswith("at its lower bound: flywheel.irregularity = 0.25") for message in result.messages)


@pytest.mark.slow
def test_refused_designs_are_counted_with_their_reason():
    scene = flywheel.load(ROTOR)
    result = flywheel.optimize(scene, "exact", over={"flywheel.irregularity": (0.5, 3)}, samples=8, starts=1)
    assert sum(result.refused.values()) == sum(math.isnan(value) for value in result.course.values)
    assert "flywheel.irregularity: found " in next(iter(result.refused))
    assert any("designs within the bounds are refused" in message for message in result.messages)


# Derivatives of figures by the numbers of a scene, beside 30-digit ones and closed forms, and the reasons for none.


SENSITIVITIES_ROTOR = {
    "load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 30},
    "flywheel": {"irregularity": 0.01},
}


def yoke_by_hand(radius, mass, force, speed, eps):
    """The exact flywheel of the yoke: M = FR/pi less FR sin(phi) to 180 deg, I* = m R² sin²(phi)."""
    even = force * radius / mpmath.pi

    def excess(phi, z):
        work = even * phi - force * radius * (1 - mpmath.cos(phi) if phi < mpmath.pi else 2)
        return work - z * speed**2 / 2 * mass * radius**2 * mpmath.sin(phi) ** 2

    def slope(phi, z):
        moment = even - (force * radius * mpmath.sin(phi) if phi < mpmath.pi else 0)
        return moment - z * speed**2 / 2 * mass * radius**2 * mpmath.sin(2 * phi)

    def extremes(z):
        grid = [2 * mpmath.pi * k / 60 for k in range(61)]
        at = [mpmath.findroot(lambda phi: slope(phi, z), (a, b), solver="anderson")
              for a, b in pairwise(grid) if slope(a, z) * slope(b, z) < 0]  # fmt: skip
        return [excess(phi, z) for phi in (*at, mpmath.mpf(0), mpmath.pi, 2 * mpmath.pi)]

    fast, slow = (1 + eps / 2) ** 2, (1 - eps / 2) ** 2
    return (max(extremes(fast)) - min(extremes(slow))) / (eps * speed**2)


def test_derivatives_of_the_exact_flywheel_beside_30_digits():
    paths = ["mechanism.crank.length", "mechanism.yoke.mass", "load.0.force", "regime.speed", "flywheel.irregularity"]
    result = flywheel.sensitivities(flywheel.load(yoke()), paths, figures=["flywheel.exact"])
    with mpmath.workdps(30):
        at = [mpmath.mpf(result.numbers[path]) for path in paths]
        assert result.values["exact"] == pytest.approx(float(yoke_by_hand(*at)), rel=1e-12)
        for k, path in enumerate(paths):
            order = tuple(int(i == k) for i in range(len(paths)))
            true = mpmath.diff(yoke_by_hand, tuple(at), order)
            derivative = result.derivative("exact", path)
            assert abs(derivative.value - true) < min(derivative.error, 1e-8 * abs(true))
            assert derivative.left == derivative.right == derivative.value


def test_derivatives_of_a_window_in_closed_form():
    """Load T from 0 to b: fluctuation T b (1 - b/2pi), power T b w/2pi, both 0 where nothing depends on a number."""
    result = flywheel.sensitivities(
        flywheel.load(SENSITIVITIES_ROTOR), ["load[0].to", "flywheel.irregularity", "load.0.torque"]
    )
    w, b = 30.0, math.pi
    exact = 100 * b * (1 - b / math.tau) / (0.01 * w**2)
    assert result.derivative("power", "load.0.to").value == pytest.approx(100 * w / math.tau, rel=1e-8)
    assert result.derivative("exact", "load.0.to").value == pytest.approx(0.0, abs=1e-8 * exact)
    assert result.derivative("exact", "load.0.torque").value == pytest.approx(-exact / 100, rel=1e-8)
    power = result.derivative("power", "flywheel.irregularity")
    assert abs(power.value) <= power.error < 1e-5
    assert result.elasticity("flywheel.exact", "flywheel.irregularity") == pytest.approx(-1.0, rel=1e-8)
    assert math.isnan(result.elasticity("angle_speed_max", "load.0.to"))  # of a figure that is 0


def test_the_slopes_of_two_equal_lobes_are_given_with_the_reason():
    """Two equal loads: with the first larger by d the fluctuation grows by 0.75 d pi/2, smaller by d by 0.25 d pi/2."""
    loads = [{"on": "crank", "torque": -100, "from": f"{a} deg", "to": f"{a + 90} deg"} for a in (0, 180)]
    result = flywheel.sensitivities(flywheel.load({**SENSITIVITIES_ROTOR, "load": loads}), "load.0.torque")
    lobes = result.derivative("energy_fluctuation", "load.0.torque")
    assert math.isnan(lobes.value)
    assert lobes.left == pytest.approx(-0.75 * math.pi / 2, rel=1e-8)
    assert lobes.right == pytest.approx(0.25 * math.pi / 2, rel=1e-8)
    assert lobes.reason.startswith("two greatest values of W are equal, at ")
    angle = result.derivative("angle_speed_min", "load.0.torque")
    assert math.isnan(angle.value)
    assert "equal" in angle.reason
    assert not result.derivative("power", "load.0.torque").reason


@pytest.mark.slow
def test_a_lobe_that_takes_over_nearby_is_not_in_the_derivative():
    """With the first load larger by a ten-thousandth its own slope holds, and steps are smaller than that."""
    loads = [{"on": "crank", "torque": t, "from": f"{a} deg", "to": f"{a + 90} deg"} for a, t in ((0, -100.01), (180, -100))]
    result = flywheel.sensitivities(flywheel.load({**SENSITIVITIES_ROTOR, "load": loads}), "load.0.torque")
    assert result.derivative("energy_fluctuation", "load.0.torque").value == pytest.approx(-0.75 * math.pi / 2, rel=1e-8)


@pytest.mark.slow
def test_where_a_flywheel_stops_being_needed_both_slopes_are_given():
    """The machine's own inertia is what is asked for: less of it is missing one to one, more of it changes nothing."""
    whole = 50 * math.pi / (0.01 * 30**2)
    scene = flywheel.load({**SENSITIVITIES_ROTOR, "inertia": [{"on": "crank", "value": whole}]})
    flips = flywheel.sensitivities(scene, ["inertia.0.value"]).derivative("exact", "inertia.0.value")
    assert math.isnan(flips.value)
    assert (flips.left, flips.right) == (pytest.approx(-1.0, rel=1e-7), pytest.approx(0.0, abs=1e-7))
    assert flips.reason == "the flywheel is needed on one side alone"


@pytest.mark.slow
def test_a_number_at_the_end_of_its_range_has_the_slope_of_one_side():
    """Crank and motor shaft without losses: an efficiency above 1 is refused."""
    raw = {
        **SENSITIVITIES_ROTOR,
        "shafts": {"motor": {"ratio": 5, "efficiency": 1}},
        "drive": {"on": "motor", "torque": "balance"},
    }
    result = flywheel.sensitivities(flywheel.load(raw), ["shafts.motor.efficiency"])
    power = result.derivative("power", "shafts.motor.efficiency")
    assert math.isnan(power.value)
    assert math.isnan(power.right)
    assert power.left == pytest.approx(-1500.0, rel=1e-7)
    assert power.reason.startswith("refused above: shafts.motor.efficiency: found 1.000001")


def test_faults_name_the_nearest():
    scene = flywheel.load(SENSITIVITIES_ROTOR)
    for call, words in (
        ({"paths": "load.0.torqe"}, 'load.0.torqe: found no number of the scene, expected the path of one; did you mean "load.0.torque"?'),  # noqa: E501
        ({"paths": ()}, "paths: found none, expected paths of numbers"),
        ({"figures": ["exakt"]}, 'figures: found "exakt", expected a figure; did you mean "exact"?'),
        ({"figures": ["mass"]}, "mass: found no figure of this scene"),
        ({"engine": "nunba"}, 'did you mean "numba"?'),
    ):  # fmt: skip
        with pytest.raises(flywheel.SceneError) as error:
            flywheel.sensitivities(scene, **call)
        assert words in str(error.value)


@pytest.mark.slow
def test_all_numbers_are_taken_where_none_is_named_and_the_record_is_plain():
    result = flywheel.sensitivities(flywheel.load(SENSITIVITIES_ROTOR), figures=["exact"])
    assert list(result.numbers) == ["load.0.torque", "load.0.from", "load.0.to", "regime.speed", "flywheel.irregularity"]
    data = result.as_dict()["figures"]["exact"]["derivatives"]["regime.speed"]
    assert data["elasticity"] == pytest.approx(-2.0, rel=1e-8)
    assert repr(result) == "Sensitivities(1 figures by 5 numbers)"


def test_corners_jumps_and_poles_of_functions():
    def values(x):
        a, b = x
        parts = [np.exp(a) * np.sin(b), np.maximum(a - 1.0, 0.0) + a**3, np.where(a < 1.0, 0.0, 1.0) + b, 1 / (1.02 - a)]
        return np.stack(parts), 1e-15 * np.ones((4, a.size))

    result = slopes(values, np.array([1.0, 2.0]), np.array([1.0, 2.0]))
    assert result.both[0] == pytest.approx([math.e * math.sin(2), math.e * math.cos(2)], rel=1e-9)
    assert (result.left[1, 0], result.right[1, 0]) == (pytest.approx(3.0, rel=1e-8), pytest.approx(4.0, rel=1e-8))
    assert result.corner.tolist() == [[False, False], [True, False], [False, False], [False, False]]
    assert result.jump.tolist() == [[False, False], [False, False], [True, False], [False, False]]
    assert abs(result.both[3, 0] - 2500.0) < result.error[3, 0] < 1e-6
    assert result.both[2, 1] == pytest.approx(1.0, rel=1e-9)
    assert gradient(values, np.array([1.0, 2.0]), np.ones(2))[1][0] == pytest.approx(result.both[0], rel=1e-7)


# How figures spread as numbers do: extremes inside and at the ends of intervals, statistics and shares in closed form.


TOLERANCE_ROTOR = {
    "load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 30},
    "flywheel": {"irregularity": 0.01},
}
"""Load T from 0 to b at w: power T b w/2pi, fluctuation T b (1 - b/2pi)."""


@pytest.fixture(scope="module")
def within():
    vary = {"load.0.torque": ("-110 N m", "-90 N m"), "regime.speed": (25, 35), "load.0.to": ("150 deg", "230 deg")}
    return flywheel.tolerance(flywheel.load(TOLERANCE_ROTOR), vary, figures=["power", "energy_fluctuation"], samples=64)


def test_extremes_at_corners_and_within(within):
    b, t = math.radians(230), 110.0
    assert within["power"].greatest.value == pytest.approx(t * b * 35 / math.tau, rel=1e-12)
    assert within["power"].least.at == {"load.0.torque": -90.0, "regime.speed": 25.0, "load.0.to": math.radians(150)}
    greatest = within["energy_fluctuation"].greatest
    assert greatest.value == pytest.approx(t * math.pi / 2, rel=1e-12)
    assert greatest.at["load.0.to"] == pytest.approx(math.pi, abs=1e-5)
    assert within["energy_fluctuation"].least.value == pytest.approx(90 * b * (1 - b / math.tau), rel=1e-12)


def test_no_sample_lies_outside_of_the_extremes(within):
    for name, values in within.figures.items():
        assert within[name].least.value <= values.min()
        assert values.max() <= within[name].greatest.value
    low, high = within.intervals["load.0.to"]
    assert low <= within.samples[2].min() <= within.samples[2].max() <= high


def test_statistics_and_shares_of_a_product_within_their_errors(within):
    """Of y = x1 x2 x3, independent and even: with c = V(x)/m², V(y)/E(y)² is the product of all 1 + c less 1."""
    ends = np.array([[90, 110], [25, 35], [math.radians(150), math.radians(230)]])
    c = ((ends[:, 1] - ends[:, 0]) ** 2 / 12) / ends.mean(axis=1) ** 2
    whole, power = np.prod(1 + c) - 1, within["power"]
    mean = ends.mean(axis=1).prod() / math.tau
    assert power.mean == pytest.approx(mean, abs=4 * power.mean_error)
    assert power.mean_error < 1e-4 * mean
    assert power.deviation == pytest.approx(mean * math.sqrt(whole), abs=4 * power.deviation_error)
    for k, share in enumerate(power.shares.values()):
        assert share.first == pytest.approx(c[k] / whole, abs=4 * share.first_error + 1e-6)
        total = c[k] * np.prod(np.delete(1 + c, k)) / whole
        assert share.total == pytest.approx(total, abs=4 * share.total_error + 1e-6)
        assert share.first_error < 2e-3


def test_deviations_give_quantiles_with_their_sampling_errors():
    result = flywheel.tolerance(flywheel.load(TOLERANCE_ROTOR), {"load.0.torque": 2, "regime.speed": "2 rpm"}, samples=64)
    power = result["power"]
    of_torque, of_speed = 2 / 100, 2 * math.pi / 30 / 30
    deviation = 1500 * math.sqrt(of_torque**2 + of_speed**2 + (of_torque * of_speed) ** 2)
    assert power.deviation == pytest.approx(deviation, abs=4 * power.deviation_error + 1e-9)
    for z, value, error in zip((-2.3263, -1.6449, 0.0, 1.6449, 2.3263), power.quantiles, power.quantile_errors, strict=True):
        assert value == pytest.approx(1500 + z * deviation, abs=3 * error)
    assert power.least is None
    assert result["exact"].shares["regime.speed"].first == pytest.approx(0.3277, abs=1e-3)  # exact ~ T/w²
    assert result["speed"].shares["load.0.torque"].total == pytest.approx(0.0, abs=1e-9)
    assert sum(share.first for share in power.shares.values()) == pytest.approx(1.0, abs=1e-3)
    assert result.as_dict()["numbers"]["load.0.torque"]["deviation"] == 2.0


def test_the_probability_that_limits_are_kept_and_quantiles_of_one_s_choice():
    """Power T w/2 and work pi T/2 of a normal T (100, 5) and w (30, 2)."""
    limits = {"power": (None, "1.55 kW"), "energy_fluctuation": (np.pi * 45, np.pi * 55)}
    vary = {"regime.speed": 2, "load.0.torque": 5}
    options = {"keep": limits, "quantiles": (0.9,), "figures": ["exact"]}
    result = flywheel.tolerance(flywheel.load(TOLERANCE_ROTOR), vary, samples=512, **options)
    power, work = result["power"], result["energy_fluctuation"]
    speed, torque = np.random.default_rng(0).normal([[30.0], [100.0]], [[2.0], [5.0]], (2, 200_000))
    true = 0.5 * torque * speed <= 1550, np.abs(torque - 100) <= 10
    assert (power.kept.low, power.kept.high, work.kept.low) == (None, 1550, np.pi * 45)
    for kept, share in ((power.kept[2:], true[0]), (work.kept[2:], true[1]), (result.kept, true[0] & true[1])):
        assert kept[0] == pytest.approx(share.mean(), abs=3 * kept[1])
        assert 0.0 < kept[1] < 0.02
    assert power.quantiles[0] == pytest.approx(np.quantile(0.5 * torque * speed, 0.9), abs=3 * power.quantile_errors[0])
    data = result.as_dict()
    assert data["kept"]["probability"] == result.kept[0]
    assert result.kept[0] <= min(power.kept.probability, work.kept.probability)
    assert data["figures"]["power"]["kept"]["high"] == 1550
    assert [each["share"] for each in data["figures"]["power"]["quantiles"]] == [0.9]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"keep": {"power": (2, 1)}}, "keep power: found from 2 to 1, expected the lower one first"),
        ({"keep": {"power": (None, "5 kg")}}, "keep power: found"),
        ({"keep": {"powr": (None, 5)}}, "keep powr: found .*power"),
        ({"keep": {"mass": (None, 5)}}, "keep mass: found no figure of this scene|mass"),
        ({"quantiles": (0.5, 1.0)}, "quantiles: found 1.0, expected a share above 0 and below 1"),
    ],
)
def test_limits_and_quantiles_that_cannot_be_are_refused(options, words):
    with pytest.raises(flywheel.SceneError, match=words):
        flywheel.tolerance(flywheel.load(TOLERANCE_ROTOR), {"regime.speed": 2}, samples=64, **options)


def test_quantiles_of_designs_that_are_left_are_those_of_samples():
    result = flywheel.tolerance(flywheel.load(TOLERANCE_ROTOR), {"regime.speed": 15}, samples=64)
    assert result.refused > 0  # speeds below zero
    speeds = result.samples[0][result.samples[0] > 0.0]
    assert result["power"].quantiles == pytest.approx(np.quantile(50 * speeds, [0.01, 0.05, 0.5, 0.95, 0.99]))


def test_quantiles_of_a_flywheel_that_many_designs_do_not_need_are_none_below_0():
    """I = max(T pi/2/(eps w²) - I0, 0) of a normal T: every quantile is that of T, clipped."""
    own = 100 * math.pi / 2 / (0.01 * 900) - 0.2
    raw = {**TOLERANCE_ROTOR, "inertia": [{"on": "crank", "value": own}]}
    result = flywheel.tolerance(flywheel.load(raw), {"load.0.torque": 2.0}, samples=128)["exact"]
    for z, value, error in zip(
        (-2.3263, -1.6449, 0.0, 1.6449, 2.3263), result.quantiles, result.quantile_errors, strict=True
    ):
        true = max((100 + 2 * z) * math.pi / 2 / 9 - own, 0.0)
        assert value == pytest.approx(true, abs=3 * error)
        assert value == 0.0 or z > -1.0
    slope, least = 2 * math.pi / 18, 100 - 9 * own * 2 / math.pi  # I = slope (z - z0) above z0
    z0 = -least / 2
    density, above = math.exp(-z0 * z0 / 2) / math.sqrt(math.tau), 0.5 * math.erfc(z0 / math.sqrt(2))
    mean, square = slope * (density - z0 * above), slope**2 * ((1 + z0 * z0) * above - z0 * density)
    assert result.mean == pytest.approx(mean, abs=4 * result.mean_error)
    assert result.deviation == pytest.approx(math.sqrt(square - mean**2), abs=4 * result.deviation_error)


def test_a_window_that_varies_beyond_the_cycle_goes_on_at_its_beginning():
    """From 300 deg to 360 ± 1 deg: a window of 60 ± 1 deg, whose power is in proportion."""
    raw = {**TOLERANCE_ROTOR, "load": [{"on": "crank", "torque": "-100 N m", "from": "300 deg", "to": "360 deg"}]}
    result = flywheel.tolerance(flywheel.load(raw), {"load[0].to": "1 deg"}, samples=64)
    power = result["power"]
    assert result.refused == 0
    assert power.mean == pytest.approx(500.0, abs=3 * power.mean_error + 1e-9)
    assert power.deviation == pytest.approx(500.0 / 60, abs=3 * power.deviation_error + 1e-6)
    slowest = result["angle_speed_min"]  # where the load ends
    assert math.degrees(slowest.mean - slowest.nominal) == pytest.approx(0.0, abs=1e-2)
    assert math.degrees(slowest.deviation) == pytest.approx(1.0, rel=1e-2)
    assert (power.quantiles[0] - 500) / (500 / 60) == pytest.approx(-2.3263, abs=3 * power.quantile_errors[0] * 60 / 500)


def test_shares_are_not_given_where_designs_are_refused():
    result = flywheel.tolerance(flywheel.load(TOLERANCE_ROTOR), {"regime.speed": 15, "load.0.torque": 20}, samples=64)
    assert result.refused > 0
    assert result["power"].shares == {}
    assert result["power"].deviation > 0.0
    assert result.messages[-1].startswith("no shares of the variance are given: some designs are refused")


def test_paths_are_taken_as_messages_write_them():
    scene, path = flywheel.load(TOLERANCE_ROTOR), "load[0].to"
    spread = flywheel.tolerance(scene, {path: ("170 deg", "190 deg")}, figures=["power"], samples=64)
    assert spread["power"].least.value == pytest.approx(3000 * math.radians(170) / math.tau, rel=1e-12)
    best = flywheel.optimize(scene, f"power + 0*{path}", over={path: ("170 deg", "190 deg")}, starts=1)
    assert best.numbers["load.0.to"] == pytest.approx(math.radians(170))
    slopes = flywheel.sensitivities(scene, [path])
    assert slopes.derivative("power", path).value == pytest.approx(3000 / math.tau, rel=1e-8)
    assert slopes.elasticity("power", path) == pytest.approx(1.0, rel=1e-8)
    assert flywheel.sweep(scene, {path: [1.0, 2.0]})[path].tolist() == [1.0, 2.0]
    for call in (flywheel.tolerance, lambda scene, both: flywheel.optimize(scene, "power", over=both)):
        with pytest.raises(flywheel.SceneError, match=r"load\.0\.to: found two values, expected one"):
            call(scene, {path: (1.0, 2.0), "load.0.to": (1.0, 2.0)})


@pytest.mark.slow
def test_designs_that_are_refused_are_counted():
    """An efficiency above 1 is no machine: half of a scatter about 1."""
    raw = {
        **TOLERANCE_ROTOR,
        "shafts": {"motor": {"ratio": 5, "efficiency": 0.999}},
        "drive": {"on": "motor", "torque": "balance"},
    }
    result = flywheel.tolerance(flywheel.load(raw), {"shafts.motor.efficiency": 0.001}, figures=["power"], samples=64)
    assert result.refused == pytest.approx(0.16 * 128, abs=4)
    assert result.reason.startswith("shafts.motor.efficiency: found 1.0")
    assert 1500 < result["power"].quantiles[0] < result["power"].quantiles[-1] < 1506


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ({"": 1}, "paths: found no number of the scene"),
        (2.5, "vary: found 2.5, expected paths, each with (low, high)"),
        ({}, "paths: found none"),
        ({"load.0.torqe": 1}, 'did you mean "load.0.torque"?'),
        ({"regime.speed": (35, 25)}, "regime.speed: found from 35 to 25, expected a low end below the high one"),
        ({"regime.speed": (25, 30, 35)}, "regime.speed: found 3 numbers"),
        ({"regime.speed": -1}, "regime.speed: found a standard deviation of -1"),
        ({"regime.speed": "1 mm"}, "expected a speed"),
        (
            {"regime.speed": 1, "load.0.to": (1, 2)},
            "found a standard deviation together with intervals, expected all of one kind",
        ),
    ],
)
def test_what_is_no_tolerance_is_refused(vary, words):
    with pytest.raises(flywheel.SceneError) as error:
        flywheel.tolerance(flywheel.load(TOLERANCE_ROTOR), vary)
    assert words in str(error.value)


@pytest.mark.parametrize("samples", [0, 1, 3, 12])
def test_samples_are_a_power_of_two(samples):
    with pytest.raises(flywheel.SceneError, match="a power of two, 2 or more"):
        flywheel.optimize(flywheel.load(ROTOR), "exact", over={"load.0.to": (1, 2)}, samples=samples, starts=1)


# -- correlated numbers, and limited ones ------------------------------------------------------------------------------

WINDOW = ROTOR | {"load": [{"on": "crank", "torque": "-100 N m", "from": "30 deg", "to": "120 deg"}]}
"""Load T from a to b at w: power T (b - a) w/2pi, linear in the two."""
PER_RAD = 100 * 30 / math.tau


@pytest.mark.parametrize("rho", [-0.6, 0.8])
def test_correlated_numbers_of_a_linear_figure(rho):
    """The variance of b - a is s_a² + s_b² - 2 rho s_a s_b."""
    vary, correlations = {"load.0.from": 0.03, "load.0.to": 0.05}, {("load[0].from", "load[0].to"): rho}
    result = flywheel.tolerance(flywheel.load(WINDOW), vary, samples=64, figures=["power"], correlations=correlations)
    spread, variance = result["power"], 0.03**2 + 0.05**2 - 2 * rho * 0.03 * 0.05
    assert spread.mean == pytest.approx(PER_RAD * math.pi / 2, rel=1e-9)
    assert spread.deviation == pytest.approx(PER_RAD * math.sqrt(variance), rel=1e-8)
    assert np.corrcoef(result.samples)[0, 1] == pytest.approx(rho, abs=0.2)
    assert spread.shares == {}
    assert result.messages[-1] == "no shares of the variance are given: numbers are correlated"
    assert result.as_dict()["correlations"] == [{"of": ["load.0.from", "load.0.to"], "value": rho}]


@pytest.mark.parametrize("ends", [(2.0, 2.2), (2.05, None)])
def test_numbers_that_are_kept_within_limits(ends):
    """A normal distribution cut off at its limits has the mean m + s (f(a) - f(b))/Z, f the density and Z the share."""
    nominal, sigma = 2 * math.pi / 3, 0.05
    low, high = ((math.inf if end is None else end - nominal) / sigma for end in ends)
    share = mpmath.ncdf(high) - mpmath.ncdf(low)
    mean = nominal + sigma * float((mpmath.npdf(low) - mpmath.npdf(high)) / share)
    scene, within = flywheel.load(WINDOW), {"load.0.to": ends}
    result = flywheel.tolerance(scene, {"load.0.to": sigma}, within=within, samples=512, quantiles=[0.5], figures=["power"])
    spread = result["power"]
    assert result.samples.min() >= ends[0]
    assert result.samples.max() <= (ends[1] or math.inf)
    assert spread.mean == pytest.approx(PER_RAD * (mean - math.pi / 6), abs=5 * spread.mean_error + 1e-6)
    middle = mpmath.findroot(lambda x: mpmath.ncdf(x) - mpmath.ncdf(low) - share / 2, 0.0)
    assert spread.quantiles[0] == pytest.approx(PER_RAD * (nominal + sigma * float(middle) - math.pi / 6), rel=3e-3)


def test_the_command_states_correlations_and_limits(tmp_path):
    scene = tmp_path / "rotor.toml"
    scene.write_text(
        "load = [{on = 'crank', torque = '-100 N m', from = '30 deg', to = '90 deg'}]\n"
        "drive.torque = 'balance'\nregime.speed = '300 rpm'\nflywheel.irregularity = 0.02\n"
    )
    vary = ("--vary", "load.0.to=±2deg", "--vary", "load.0.from=±1deg", "--samples", "64", "--of", "power")

    def run(*options):
        return CliRunner().invoke(main, ["tolerance", str(scene), *vary, *options])

    result = run("--within", "load.0.to=88deg:91deg", "--correlate", "load.0.to,load.0.from=0.5")
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    assert lines[1].split() == ["load.0.to", "90", "±", "2", "deg", "within", "88", "to", "91"]
    assert lines[3] == "  correlation of load.0.to and load.0.from: 0.5"
    assert "is not PATH,PATH=RHO" in run("--correlate", "load.0.to=0.5").stderr


def test_correlations_and_limits_that_cannot_be():
    scene, vary = flywheel.load(WINDOW), {"load.0.from": 0.03, "load.0.to": 0.05, "regime.speed": 1.0}
    pairs = {("load.0.from", "load.0.to"): 0.9, ("load.0.to", "regime.speed"): 0.9, ("load.0.from", "regime.speed"): -0.9}
    for options, output in (
        ({"correlations": pairs}, "expected those of a positive definite matrix"),
        ({"correlations": {("load.0.from", "load.0.to"): 1.0}}, "expected a number between -1 and 1"),
        ({"correlations": {("load.0.from", "power"): 0.5}}, "no pair of numbers that scatter"),
        ({"within": {"load.0.to": (3.0, 3.1)}}, "expected 0.1 % or more"),
        ({"within": {"flywheel.irregularity": (0.01, 0.02)}}, "no deviation of it"),
    ):
        with pytest.raises(flywheel.SceneError, match=output):
            flywheel.tolerance(scene, vary, samples=64, **options)


# -- choices -----------------------------------------------------------------------------------------------------------

ARMED = {"irregularity": 0.02, "shape": "arms", "outer_radius": "600 mm", "width": "120 mm", "bore": "60 mm", "arms": 6}
CHOICES = {"flywheel.arms": range(4, 7), "flywheel.material": ["grey cast iron", "carbon steel"]}


def masses(scene):
    """The wheel's mass with every combination of choices, infinite where it is too weak."""
    result = {}
    for arms in CHOICES["flywheel.arms"]:
        for material in CHOICES["flywheel.material"]:
            design = scene.with_({"flywheel.arms": arms, "flywheel.material": material})
            wheel = flywheel.size(design, simulate=False).built.wheel
            result[str(arms), material] = wheel.mass if wheel.utilisation <= 1.0 else math.inf
    return result


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_every_combination_of_choices_is_searched_and_the_best_is_chosen(jobs):
    scene = flywheel.load(ROTOR | {"flywheel": ARMED | {"material": "carbon steel"}})
    alone = masses(scene)
    result = flywheel.optimize(scene, "mass", choose=CHOICES, jobs=jobs)
    assert {tuple(each.choices.values()): each.value or math.inf for each in result.alternatives} == pytest.approx(alone)
    assert tuple(result.choices.values()) == min(alone, key=alone.get)
    assert result.value == pytest.approx(min(alone.values()), rel=1e-9)
    assert result.best.wheel.material.name == result.choices["flywheel.material"]
    values = [each.value for each in result.alternatives if each.value is not None]
    assert values == sorted(values)
    assert result.confirmed
    assert result.as_dict()["alternatives"][0] == {"choices": result.choices, "value": result.value, "reason": ""}


def test_each_combination_has_its_own_best_numbers():
    """The flywheel is least at the greatest irregularity, times 1, 16 and 36."""
    scene = flywheel.load(ROTOR | {"parameters": {"teeth": 20}})
    over, choose = {"flywheel.irregularity": (0.01, 0.02)}, {"parameters.teeth": [30, 20, 25]}
    objective = "exact*(parameters.teeth - 24)**2"
    result = flywheel.optimize(scene, objective, over=over, choose=choose, samples=4, starts=1)
    assert (result.choices, [each.choices["parameters.teeth"] for each in result.alternatives]) == (
        {"parameters.teeth": "25"},
        ["25", "20", "30"],
    )
    alone = flywheel.size(scene.with_({"flywheel.irregularity": 0.02}), simulate=False).flywheel.exact
    assert [each.value / alone for each in result.alternatives] == pytest.approx([1.0, 16.0, 36.0], rel=1e-9)
    assert result.numbers == pytest.approx({"flywheel.irregularity": 0.02})
    assert result.at_bounds == {"flywheel.irregularity": "high"}


def test_an_interruption_keeps_the_combinations_that_were_searched(monkeypatch):
    from flywheel.designs import optimum

    own, last = optimum._alternative, ["25"]

    def interrupted(*arguments):
        if arguments[-1][0]["parameters.teeth"] in last:
            raise KeyboardInterrupt
        return own(*arguments)

    monkeypatch.setattr(optimum, "_alternative", interrupted)
    scene = flywheel.load(ROTOR | {"parameters": {"teeth": 20}})
    options = {"choose": {"parameters.teeth": [30, 20, 25]}, "over": {"load.0.to": (1.0, 2.0)}, "samples": 4, "starts": 1}
    result = flywheel.optimize(scene, "exact + parameters.teeth", **options)
    assert (result.interrupted, result.confirmed, result.choices) == (True, False, {"parameters.teeth": "20"})
    assert result.messages[0] == "interrupted: 1 of 3 combinations were not searched"
    last.append("30")
    with pytest.raises(KeyboardInterrupt):
        flywheel.optimize(scene, "exact + parameters.teeth", **options)


def test_a_choice_continues_from_the_combinations_of_its_file(tmp_path, monkeypatch):
    from flywheel.designs import optimum

    own, searched, file = optimum._alternative, [], tmp_path / "choice.jsonl"

    def counted(*arguments):
        searched.append(arguments[-1][0]["parameters.teeth"])
        return own(*arguments)

    monkeypatch.setattr(optimum, "_alternative", counted)
    scene = flywheel.load(ROTOR | {"parameters": {"teeth": 20}})
    options = {"over": {"load.0.to": (1.0, 2.0)}, "samples": 4, "starts": 1, "resume": file}
    first = flywheel.optimize(scene, "exact + parameters.teeth", choose={"parameters.teeth": [30, 20]}, **options)
    with file.open("a") as broken:
        broken.write('[{"parameters.teeth": "25"}, 3')  # as a process leaves it that is killed
    again = flywheel.optimize(scene, "exact + parameters.teeth", choose={"parameters.teeth": [30, 20, 25]}, **options)
    assert searched == ["30", "20", "25"]
    assert [each.choices["parameters.teeth"] for each in again.alternatives] == ["20", "25", "30"]
    assert (again.alternatives[0], again.alternatives[2]) == first.alternatives
    assert again.value == first.value
    with pytest.raises(flywheel.SceneError, match="a file of another search"):
        flywheel.optimize(scene, "exact", choose={"parameters.teeth": [30, 20]}, **options)


@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n\x00", b"{}\nnonsense\n"])
def test_a_file_that_is_no_search_is_refused_and_kept(content, tmp_path):
    file = tmp_path / "choice.jsonl"
    file.write_bytes(content)
    with pytest.raises(flywheel.SceneError, match="a file of another search"):
        flywheel.optimize(flywheel.load(ROTOR), "exact", choose={"regime.speed": [30, 20]}, resume=file)
    assert file.read_bytes() == content


def test_faults_of_choices():
    scene = flywheel.load(ROTOR | {"flywheel": ARMED | {"material": "carbon steel"}})
    for choose, output in (
        ({"flywheel.arms": []}, "flywheel.arms: found nothing, expected a list of values"),
        ({"flywheel.arms": "4,5"}, "expected a list of values"),
        ({"flywheel.arms": range(200), "flywheel.width": range(1, 99)}, "19600 combinations, expected at most 10000"),
        ({"flywheel.material": ["cheese", "chalk"]}, "flywheel.material"),
    ):
        with pytest.raises(flywheel.SceneError, match=output):
            flywheel.optimize(scene, "mass", choose=choose)
    result = flywheel.optimize(scene, "mass", choose={"flywheel.material": ["cheese", "carbon steel"]})
    assert [each.value is None for each in result.alternatives] == [False, True]
    assert "cheese" in result.alternatives[1].reason


@pytest.mark.slow
def test_the_command_chooses_whole_numbers_texts_and_motors(tmp_path):
    scene, table = tmp_path / "rotor.toml", tmp_path / "motors.csv"
    table.write_text(
        "name,power (kW),speed (rpm),poles,frequency (Hz),breakdown_ratio\nsmall,3,1440,4,50,2.8\nlarge,7.5,1450,4,50,2.8\n"
    )
    scene.write_text(
        "shafts.motor.ratio = 5\ninertia = [{on = 'crank', value = 2}]\n"
        "load = [{on = 'crank', torque = '-100 N m', from = 0, to = '90 deg'}]\n"
        "drive = {on = 'motor', motor = {type = 'line', power = '3 kW', speed = '1440 rpm', no_load_speed = '1500 rpm'}}\n"
        "flywheel = {irregularity = 0.02, shape = 'disc', width = '50 mm', material = 'carbon steel'}\n"
    )

    def run(*options):
        return CliRunner().invoke(main, ["optimize", str(scene), "--minimize", *options])

    result = run("mass + drive.motor.power/1000", "--choose", f"drive.motor={table}", "--json")
    assert result.exit_code == 0, result.stderr
    names = [each["choices"]["drive.motor"] for each in json.loads(result.stdout)["alternatives"]]
    assert sorted(names) == ["large", "small"]
    text = run("mass", "--choose", "flywheel.width=50mm,80 mm", "--choose", "flywheel.material=carbon steel,cheese")
    assert "Of 4 combinations the best: " in text.stdout
    assert "2 without a design: flywheel.material" in text.stdout
    assert max(map(len, text.stdout.splitlines())) <= 80
    for options, output in (
        (("mass",), "Give --over PATH=LOW:HIGH or --choose"),
        (("mass", "--choose", "flywheel.arms"), "is not a path, once, with its values"),
        (("mass", "--choose", "flywheel.width=1,2", "--plot", "x.png"), "--plot draws the search over numbers"),
    ):
        wrong = run(*options)
        assert (wrong.exit_code, output in " ".join(wrong.stderr.split())) == (2, True)


# -- several figures ---------------------------------------------------------------------------------------------------


def test_the_front_of_power_and_flywheel_lies_on_its_closed_form():
    """Over the load's end b: power T b w/2pi, flywheel T b (1 - b/2pi)/(eps w²), which both grow with b up to pi."""
    over = {"load.0.to": ("40 deg", "170 deg")}
    result = flywheel.pareto(flywheel.load(ROTOR), ["exact"], maximize=["power"], over=over, points=5, samples=4, starts=1)
    ends = np.array([point.numbers["load.0.to"] for point in result.points])
    assert ends == pytest.approx(
        np.radians(np.linspace(40, 170, 5)), rel=1e-8
    )  # levels of power are even, as it is b's share
    exact, power = np.array([point.values for point in result.points]).T
    assert power == pytest.approx(100 * ends * 30 / math.tau, rel=1e-8)
    assert exact == pytest.approx(100 * ends * (1 - ends / math.tau) / (0.01 * 30**2), rel=1e-8)
    assert (result.greatest, result.units, result.searches) == ((False, True), ("kg m^2", "W"), 5)
    assert all(point.confirmed for point in result.points)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_choice_that_is_worse_in_everything_has_no_design_in_the_front(jobs):
    """Load T or 2 T from 0 to b: with 2 T the same power takes half of b, and more flywheel."""
    scene, over = flywheel.load(ROTOR), {"load.0.to": (1.0, 2.0)}
    options = {"over": over, "choose": {"load.0.torque": [-100, -150]}, "points": 3, "samples": 4, "starts": 1, "jobs": jobs}
    result = flywheel.pareto(scene, ["energy_fluctuation"], maximize=["load.0.to"], **options)
    assert {point.choices["load.0.torque"] for point in result.points} == {"-100"}
    assert [point.numbers["load.0.to"] for point in result.points] == pytest.approx([1.0, 1.5, 2.0], rel=1e-8)
    assert result.searches == 2 * (2 + 1)


@pytest.mark.slow
def test_three_figures_and_limits_of_a_front():
    over = {"load.0.to": (1.0, 2.0), "flywheel.irregularity": (0.01, 0.03)}
    options = {"over": over, "points": 2, "samples": 4, "starts": 1, "subject_to": {"power": (None, 800.0)}}
    objectives = ["exact", "flywheel.irregularity"]
    result = flywheel.pareto(flywheel.load(ROTOR), objectives, maximize=["power"], **options)
    values = np.array([point.values for point in result.points])
    assert values[:, 2].max() == pytest.approx(800.0, rel=1e-8)
    better = (values[:, None, :2] <= values[None, :, :2]).all(axis=2) & (values[:, None, 2] >= values[None, :, 2])
    assert better.sum() == len(values)  # each only as good as itself
    for objectives, output in ((["exact"], "two or more figures"), (["exact", "exact"], "two or more figures")):
        with pytest.raises(flywheel.SceneError, match=output):
            flywheel.pareto(flywheel.load(ROTOR), objectives, over=over)
    with pytest.raises(flywheel.SceneError, match="mass: found no figure of this scene"):
        flywheel.pareto(flywheel.load(ROTOR), ["exact", "mass"], over=over, samples=4, starts=1)


@pytest.mark.slow
def test_the_command_lists_and_draws_a_front(tmp_path):
    scene, picture = tmp_path / "rotor.toml", tmp_path / "front.png"
    scene.write_text(
        "load = [{on = 'crank', torque = '-100 N m', from = 0, to = '90 deg'}]\n"
        "drive.torque = 'balance'\nregime.speed = '300 rpm'\nflywheel.irregularity = 0.02\n"
    )
    figures = ("--minimize", "exact", "--maximize", "power", "--points", "3", "--starts", "1", "--plot", str(picture))
    run = CliRunner().invoke(main, ["optimize", str(scene), "--over", "load.0.to=40deg:170deg", *figures])
    assert run.exit_code == 0, run.stderr
    assert run.stdout.startswith("Designs between the least exact and the greatest power: 3\n")
    assert [line.split()[2] for line in run.stdout.splitlines()[3:6]] == ["40", "105", "170"]
    assert picture.stat().st_size > 5_000
