"""Machines that work stroke by stroke, drawn from a seed, beside the equations of their two sides."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

import flywheel
from flywheel import SceneError
from tests.estimates.bars import short
from tests.generated.judging import Verdict
from tests.generated.scenes import Rng, Scene, chance, spread
from tests.oracle.motors import kloss, rated, servo, slip_heat
from tests.oracle.strokes import TURN, Plan, Rated, over_limits, returning, shares, stroke

_NAMES = ("abs", "sqrt", "sign")
_SLOW = 0.05  # of the rate: where a load is beyond its limit that is so at any rate
_WHEEL = 1e-7  # relative, beside the estimate of a flywheel of limits
_RATE, _RATED_ONE = 1e-7, 5  # beside the estimate of the greatest rate; every how manieth scene has it
_FLOOR = 1e-8  # relative, beside the estimate: what the oracle itself is good to


def drawn_strokes(seed: int) -> tuple[Scene, Plan]:
    """A scene with clutch and brake, and the same in plain numbers."""
    rng, more, again = (np.random.default_rng([seed, kind]) for kind in (77, 78, 79))
    crank_speed, ratio, belt = spread(rng, 3.0, 12.0), short(rng.uniform(1.0, 8.0), 3), short(rng.uniform(0.5, 6.0), 3)
    wheel_speed = crank_speed * ratio
    turns, gear, belts = chance(rng, 0.4), short(rng.uniform(0.85, 1.0), 3), short(rng.uniform(0.85, 1.0), 3)
    gear, belts = (1.0 if chance(rng, 0.4) else each for each in (gear, belts))
    slider, radius = None, 0.0
    crank, mean = spread(rng, 0.5, 20.0), 0.0
    if not turns:
        radius = spread(rng, 0.02, 0.12)
        slider = (
            radius,
            short(radius * rng.uniform(3.0, 8.0)),
            spread(rng, 2, 40),
            short(radius * rng.uniform(0, 2)),
            0.0,
            0.0,
        )
        slider = (*slider[:4], short(0.1 * slider[2] * slider[1] ** 2), spread(rng, 5, 200))
        mean = 0.5 * radius**2 * (slider[5] + slider[2])
    behind = (crank + mean) / ratio**2
    rotor = short(0.1 * behind / belt**2)
    wheel = short(behind * rng.uniform(2.0, 20.0))
    energy = 0.5 * wheel * wheel_speed**2
    clutch = short(behind * wheel_speed / rng.uniform(0.02, 0.08) * rng.uniform(1.0, 2.0))
    rise = short(rng.uniform(0.01, 0.06), 2) if chance(rng, 0.6) else 0.0
    brake = short((crank + mean) * crank_speed / rng.uniform(0.03, 0.1))
    release = float(rng.integers(280, 330))
    engage = release if chance(rng, 0.3) else release + float(rng.integers(1, 25))
    low = float(rng.integers(80, 170))
    high = low + float(rng.integers(5, 60))
    work = energy * rng.uniform(0.05, 0.25)
    if slider is None:
        force = -short(work / math.radians(high - low))
    else:
        ways = radius * (math.cos(math.radians(low)) - math.cos(math.radians(min(high, 180.0))))
        force = short(work / max(ways, 0.05 * radius))  # up, as the ram comes down
        high = min(high, 180.0)
    friction = short(0.02 * work / radius) if slider is not None and chance(rng, 0.5) else 0.0
    weighs = slider is not None and chance(rng, 0.5)
    lasting = TURN / crank_speed
    period = short(lasting * rng.uniform(1.5, 4.0) + 0.2)
    rate, continuous = short(60.0 / period), 2 if chance(more, 0.25) else 1
    static, arm = short(1e6 * clutch), 1.0 if slider is None else radius * math.sin(math.radians(low))
    most = short(clutch * ratio * rng.uniform(1.02, 1.3) * (1.0 + behind / wheel) / arm)  # slips again under this
    if chance(rng, 0.4) and most * arm * math.radians(high - low) < 0.4 * energy:
        force, static = math.copysign(most, force), short(clutch * rng.uniform(1.0, 1.1))
    shafts: Scene = {
        "wheel": {"ratio": ratio, "efficiency": gear, "clutch": {"torque": clutch, "static_torque": static}},
        "motor": {"on": "wheel", "ratio": belt, "efficiency": belts},
    }
    shafts["wheel"]["clutch"] |= {"disengage": f"{release:g} deg", "rise": rise}
    between = math.radians(max(engage - release, 3.0)) / crank_speed
    hold, fall = (short(rng.uniform(0.0, 0.7) * between, 2) if chance(rng, 0.5) else 0.0 for _ in range(2))
    shafts["wheel"]["clutch"] |= {"hold": hold, "fall": fall}
    brake_rise = short(rng.uniform(0.01, 0.04), 2) if chance(rng, 0.5) else 0.0
    brake_fall = short(rng.uniform(0.001, 0.004), 2) if chance(rng, 0.4) else 0.0
    speed = short(belt * wheel_speed)
    judged, wheel_of = None, {"inertia": wheel}
    drop = behind / (wheel + behind) + work / (wheel * wheel_speed**2)
    sizes, power = chance(more, 0.3), 2.0 * work / period
    if sizes:
        power = continuous * (power + behind * wheel_speed**2 / period)
        wheel_of = {"limits": {"irregularity": short(drop * more.uniform(0.8, 1.4))}}
    if chance(rng, 0.5):
        slope = short(1.5 * power / speed / (0.1 * speed))
        drive: Scene = {"on": "motor", "torque": f"{slope!r}*({speed!r} - omega)"}
        text = drive["torque"]
        if chance(more, 0.4):
            motor = _servo(more, short(power / speed), speed)
            drive, text = {"on": "motor", "motor": motor}, servo(motor)
            rest = motor["standstill_torque"] = short(motor["torque"] * again.uniform(1.0, 1.5))
            judged = _judged_servo(motor, rest, _law(text), _warms(again, motor, period))
            _brakes(again, motor, power)
    else:
        power = short(power + 1.0)
        full = speed * rng.uniform(0.92, 0.97)
        motor = {"type": "induction", "power": power, "speed": short(full), "poles": 2, "breakdown_ratio": 2.4}
        motor["frequency"] = f"{short(speed / TURN)!r} Hz"
        if chance(more, 0.5):
            _fed(more, motor)
            _brakes(again, motor["inverter"], power)
        drive, text, bodies = {"on": "motor", "motor": motor}, kloss(motor), _warms(rng, motor, period)
        most, heat = rated(motor)
        lost, law = slip_heat(motor), _law(text)
        judged = Rated(most, np.vectorize(lambda w: lost(law(w), w) / heat), bodies, 105.0 if bodies else math.inf, heat)
        if sizes:
            wheel_of["limits"] |= {name: short(more.uniform(0.5, 1.5), 3) for name in ("motor_rms", "motor_heat")}
            wheel_of["limits"] |= {"motor_torque": short(more.uniform(1.2, 2.2), 3)} if chance(more, 0.5) else {}
    scene: Scene = {
        "title": f"strokes {seed}",
        "shafts": shafts,
        "inertia": [{"on": "crank", "value": crank}, {"on": "motor", "value": rotor}],
        "load": [{"on": "crank" if slider is None else "slider", "from": f"{low:g} deg", "to": f"{high:g} deg"}],
        "brake": [{"torque": brake, "engage": f"{engage:g} deg", "rise": brake_rise, "fall": brake_fall}],
        "single_stroke": {"rate": f"{rate!r} 1/min", "continuous": continuous},
        "drive": drive,
        "flywheel": {"on": "wheel", **wheel_of},
    }
    scene["load"][0]["torque" if slider is None else "force"] = force
    if slider is not None:
        r, length, mass, centre, inertia, block = slider
        rod = {"length": length, "mass": mass, "com": centre, "inertia": inertia}
        scene["mechanism"] = {"type": "slider-crank", "crank": {"length": r}, "rod": rod, "slider": {"mass": block}}
        if friction:
            scene["load"].append({"on": "slider", "force": f"-{friction!r}*sign(v)"})
        if weighs:
            scene["gravity"] = {"direction": "180 deg"}
    per_hour = short(1800.0 * behind * wheel_speed**2 / period * rng.uniform(1.05, 2.0))
    shafts["wheel"]["clutch"]["heat_per_hour"] = per_hour
    rows = (continuous - 1) * TURN
    plan = Plan(
        wheel, rotor, crank, ratio, belt, gear, belts, _law(text), clutch, rise, fall,
        math.radians(release) + rows, brake, brake_rise, brake_fall, math.radians(engage) + rows, continuous * 60.0 / rate,
        ((math.radians(low), math.radians(high), force),), friction, -9.80665 if weighs else 0.0, slider,
        static, hold, judged, per_hour, continuous,
    )  # fmt: skip
    return scene, plan


def _law(text: str) -> Any:
    """A torque (N m) over the speed of its shaft."""
    law, names = compile(text, "motor", "eval"), {name: getattr(np, name) for name in _NAMES} | {"min": min, "max": max}
    return lambda omega: eval(law, names, {"omega": omega})


def _servo(rng: Rng, torque: float, speed: float) -> Scene:
    """A servo drive that idles at about a speed; its peak curve cuts off what it gives in the stroke."""
    motor = {
        "type": "servo",
        "speed": speed,
        "torque": torque,
        "set_speed": short(speed),
        "droop": short(rng.uniform(0.02, 0.1)),
    }
    motor |= {"peak_torque": short(torque * rng.uniform(1.5, 4.0)), "corner_speed": short(speed * rng.uniform(0.7, 1.15))}
    return motor | {"maximum_speed": short(1.6 * speed), "efficiency": 0.9, "braking": "regenerative"}


def _judged_servo(motor: Scene, rest: float, law: Any, bodies: tuple[tuple[float, float], ...]) -> Rated:
    """A servo drive's rated figures: losses by torque and continuous curve, current by torque."""
    torque, speed = motor["torque"], motor["speed"]

    def losses(omega: Any) -> Any:
        curve = max(0.0, rest - (rest - torque) * abs(omega) / speed)
        return (law(omega) ** 2 + rest**2 - curve**2) / rest**2

    heat, limit = torque * speed * (1.0 / motor["efficiency"] - 1.0), 105.0 if bodies else math.inf
    return Rated(torque, np.vectorize(losses), bodies, limit, heat, lambda omega: abs(law(omega)) / torque)


def _warms(rng: Rng, motor: Scene, period: float) -> tuple[tuple[float, float], ...]:
    """Gives a motor windings that warm up, mostly: rise (K) and time constant (s) of each part."""
    if not chance(rng, 0.6):
        return ()
    constant, warmth = short(period * 10 ** rng.uniform(-0.5, 3.0)), short(rng.uniform(30.0, 100.0))
    motor["thermal"] = {"time_constant": constant, "class": "F", "rise": f"{warmth!r} K"}
    if not chance(rng, 0.5):
        return ((warmth, constant),)
    share, quick = short(rng.uniform(0.1, 0.6), 2), short(constant * rng.uniform(0.02, 0.5))
    motor["thermal"] |= {"winding_time_constant": quick, "winding_share": share}
    return ((1.0 - share) * warmth, constant), (share * warmth, quick)


def _brakes(rng: Rng, table: Scene, power: float) -> None:
    """Gives an inverter one of the uses of what its motor returns."""
    table["braking"] = str(rng.choice(["none", "regenerative", "resistor"]))
    if table["braking"] == "resistor":
        table["chopper_power"] = short(power * 10 ** rng.uniform(-2.0, 0.5))


def _fed(rng: Rng, motor: Scene) -> None:
    """Puts a motor of two poles and another frequency of the mains on an inverter that turns its field as fast."""
    hertz = float(motor["frequency"].split()[0])
    torque, slip, mains = (
        motor["power"] / motor["speed"],
        TURN * hertz - motor["speed"],
        short(hertz * rng.choice([0.8, 1.0, 1.4])),
    )
    motor |= {"speed": short(TURN * mains - slip), "frequency": f"{mains!r} Hz"}
    motor["power"] = short(torque * motor["speed"])
    motor["inverter"] = {"frequency": f"{hertz!r} Hz", "overcurrent": short(rng.uniform(1.5, 3.0), 3)}
    motor["inverter"] |= {"torque_limit": short(rng.uniform(0.9, 2.2), 3)} if chance(rng, 0.6) else {}


def tried_strokes(seed: int) -> list[Verdict]:
    """The verdict on the stroke that returns: it does, by the oracle, and each figure is right within its error."""
    scene, plan = drawn_strokes(seed)
    begun, rates = time.monotonic(), seed % _RATED_ONE == 0
    try:
        result = flywheel.single_stroke(flywheel.load(scene), rates=rates)
    except SceneError as error:
        return [Verdict("strokes", "refused", str(error), time.monotonic() - begun, 0.0)]
    took, begun = time.monotonic() - begun, time.monotonic()
    plan, (speed, rest) = plan._replace(wheel=result.inertia), result.phases.begin
    true = stroke(plan, speed, rest)
    lines = []

    def compare(name: str, value: float, right: float, error: float, scale: float) -> None:
        if not abs(value - right) <= error + _FLOOR * scale:
            lines.append(f"{name} {value!r} beside {right!r}, error {error:.2g}")

    compare("speed after", speed, true.pop("speed"), 0.0, speed)
    compare("angle after", rest + plan.turns * TURN, true.pop("rest"), 0.0, TURN)
    if plan.rated is not None:
        true["motor_heat"] *= plan.rated.heat
    scales: dict[str, float] = {"lock_angle": 1.0, "wheel_energy": plan.wheel * speed**2, "brake_angle": 1.0}
    scales |= {"holding_torque": plan.brake, "power_returned": plan.wheel * speed**2 / plan.period}
    motor = result.scene.motor
    if result.inverter_current is None or plan.rated is None:
        for name in ("inverter_current", "power_returned"):
            true.pop(name, None)
    else:
        tripped = ["overcurrent"] * bool(true["inverter_current"] > motor.inverter.overcurrent)
        returned = true["power_returned"]
        tripped += ["overvoltage"] * bool(motor.inverter.braking == "none" and returned > 1e-9 * motor.rated.power)
        tripped += ["chopper_power"] * bool(motor.inverter.braking == "resistor" and returned > motor.inverter.chopper_power)
        if tripped != [trip.kind for trip in result.trips]:
            lines.append(f"trips {[trip.kind for trip in result.trips]}, beside {tripped}")
    for name, right in true.items():
        value: Any = result.figures[name]
        compare(name, value, right, result.error[name], max(abs(right), scales.get(name, 0.0)))
    compare("energy that is missing", result.energy_residual, 0.0, result.error["energy_residual"], 1.0)
    if rates and result.decides in shares(plan, true):
        for way in (-1.0, 1.0) if result.greatest_rate else (1.0,):  # a little slower all is within, a little faster not
            rate = result.greatest_rate + way * (result.error["greatest_rate"] + _RATE * result.greatest_rate)
            rate = rate or _SLOW * result.rate
            there = plan._replace(period=plan.turns / rate)
            most = max(shares(there, returning(there, speed, rest)).values())
            if (most > 1.0) != (way > 0.0):
                lines.append(f"greatest rate {result.greatest_rate!r}, {most!r} of the limit at {rate!r}")
    if result.limits:
        request = {name: limit.requirement for name, limit in result.limits.items()}
        for way in (-1.0, 1.0):  # a little lighter it breaks the limit that decides, a little heavier it keeps all
            inertia = result.inertia + way * (result.error["inertia"] + _WHEEL * result.inertia)
            there = plan._replace(wheel=inertia)
            beyond = over_limits(there, returning(there, speed, rest), request)
            if (beyond[result.binding] > 1.0) == (way > 0.0) or (way > 0.0 and max(beyond.values()) > 1.0):
                lines.append(f"flywheel {result.inertia!r} by {result.binding}, {beyond} of the limits with {inertia!r}")
    outcome = "wrong" if lines else "right"
    return [Verdict("strokes", outcome, "; ".join(lines), took, time.monotonic() - begun)]
