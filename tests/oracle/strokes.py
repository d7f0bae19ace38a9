"""A stroke by clutch and brake from the equations of its two sides, stepped by scipy with its events.

One crank, rotor or slider-crank, geared to the shaft of the clutch (ratio r), that to the motor (ratio m). With J of the
wheel's shaft, j of the motor's, and meshes that lose, the driving side is

    (J + K m² j) dw/dt = K m M(m w) - T, K = efficiency while the belt passes power to the wheel, else its reciprocal;

the driven side, with k alike for the mesh of the clutch's shaft,

    I dv/dt + I'/2 v² = k r T + F - B, F of forces on the slider and weights, B of the brake.

While the clutch slips T is its own, forwards if the wheel's side is the faster one; locked, w = r v, and both give dv/dt
and T for the K and k that fit their directions. It slips again where that T is more than it holds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

TURN = 2 * math.pi
_RTOL = 1e-12
_TINY = 1e-40
_POINTS = 6  # of Gauss' rule in a part of a step
_PARTS = 96  # of a step: the greatest temperature is searched for at their ends
_COARSE = 8  # parts at whose ends it is looked for first


class Plan(NamedTuple):
    """A machine in plain numbers; angles in rad from 0, `windows` are (from, to, force or torque on the driven side).

    `slider` is (crank, rod, mass of the rod, its centre from the crank pin, its inertia, mass of the slider), None of a
    rotor, whose windows then are torques. `friction` is against the slider, `weight` its acceleration along its own sense.
    """

    wheel: float
    rotor: float
    crank: float
    ratio: float
    belt: float
    gear_efficiency: float
    belt_efficiency: float
    motor: Callable[[Any], Any]
    clutch: float
    rise: float
    fall: float
    release: float
    brake: float
    brake_rise: float
    brake_fall: float
    engage: float
    period: float
    windows: tuple[tuple[float, float, float], ...]
    friction: float = 0.0
    weight: float = 0.0
    slider: tuple[float, float, float, float, float, float] | None = None
    static: float = math.inf
    hold: float = 0.0
    rated: Rated | None = None
    per_hour: float = math.inf
    turns: int = 1


class Rated(NamedTuple):
    """Of a motor: rated torque (N m), losses at a speed over the rated ones, its bodies, and the rise (K) that it bears.

    `heat` are the rated losses (W), by which its current goes, if `current` at a speed over the rated one is not given.
    Each body has its rise (K) at the rated point and its time constant (s); none if the windings are not judged.
    """

    torque: float
    losses: Callable[[Any], Any]
    bodies: tuple[tuple[float, float], ...] = ()
    limit: float = math.inf
    heat: float = math.nan
    current: Callable[[float], float] | None = None


def gains(plan: Plan, phi: Any, way_of: int = 1) -> tuple[Any, Any, Any]:
    """I*, dx/dphi of the slider (1 of a rotor), and the moment of weights and of friction against a way of turning."""
    if plan.slider is None:
        return plan.crank + 0 * phi, 1.0 + 0 * phi, 0.0 * phi
    r, length, mass, centre, inertia, slider = plan.slider
    root = np.sqrt(length**2 - (r * np.sin(phi)) ** 2)
    swing = -r * np.cos(phi) / root  # of the rod's angle -asin(r sin(phi)/l)
    way = -r * np.sin(phi) - r * r * np.sin(phi) * np.cos(phi) / root
    share = centre / length
    along, across = (1 - share) * -r * np.sin(phi) + share * way, (1 - share) * r * np.cos(phi)
    reduced = plan.crank + mass * (along**2 + across**2) + inertia * swing**2 + slider * way**2
    return reduced, way, plan.weight * (mass * along + slider * way) - way_of * plan.friction * way * np.sign(np.real(way))


def driven(plan: Plan, phi: float, middle: float, way_of: int = 1) -> tuple[float, float, float]:
    """I*, dI*/dphi and the moment of all but clutch and brake; windows as they are in the middle of a piece."""
    bent = gains(plan, phi + 1j * _TINY, way_of)
    reduced, way, moment = (float(np.real(part)) for part in bent)
    turned = middle % TURN
    moment += sum(force * way for low, high, force in plan.windows if low <= turned < high)
    return reduced, float(np.imag(bent[0])) / _TINY, moment


def _fits(passed: float, factor: float) -> bool:
    """Tests whether a mesh with a torque outwards, to the crank, has a factor: below 1 forwards, above it backwards."""
    return factor == 1.0 or (passed >= 0.0) == (factor < 1.0)


def driving(plan: Plan, w: float, torque: float) -> float:
    """dw/dt of the wheel's shaft against a torque of the clutch."""
    motor = float(plan.motor(plan.belt * w))
    for factor in (plan.belt_efficiency, 1 / plan.belt_efficiency):
        alpha = (factor * plan.belt * motor - torque) / (plan.wheel + factor * plan.belt**2 * plan.rotor)
        passed = motor - plan.rotor * plan.belt * alpha
        if _fits(passed, factor):
            return alpha
    return alpha


def locked(plan: Plan, phi: float, v: float, middle: float, brake: float = 0.0) -> tuple[float, float]:
    """dv/dt of the crank and the torque of the clutch, against a torque of the brake."""
    reduced, slope, moment = driven(plan, phi, middle)
    moment -= brake
    motor = float(plan.motor(plan.belt * plan.ratio * v))
    r, result = plan.ratio, (0.0, 0.0)
    for belt in (plan.belt_efficiency, 1 / plan.belt_efficiency):
        for gear in (plan.gear_efficiency, 1 / plan.gear_efficiency):
            inertia = plan.wheel + belt * plan.belt**2 * plan.rotor
            alpha = (gear * r * belt * plan.belt * motor + moment - slope * v * v / 2) / (reduced + gear * r * r * inertia)
            torque = belt * plan.belt * motor - inertia * r * alpha
            result = alpha, torque
            passed = motor - plan.rotor * plan.belt * r * alpha
            if _fits(torque, gear) and _fits(passed, belt):
                return result
    return result


class Run:
    """Figures of a stroke, collected as it is stepped."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.lowest, self.highest, self.clutch_torque = math.inf, -math.inf, 0.0
        self.motor_work = self.motor_square = 0.0
        self.pieces: list[tuple[Any, Callable[[Any], Any]]] = []

    def step(
        self, rate: Callable[[float, Any], list[float]], start: list[float], t: float, *goals: Any, last: float = 60.0
    ) -> Any:
        """Step to the first goal, or to a last time; a goal is a function of time and state, and its direction."""
        events = []
        for value, sense in goals:
            event = lambda t, y, value=value: value(t, y)  # noqa: E731
            event.terminal, event.direction = True, sense  # type: ignore[attr-defined]
            events.append(event)
        result = solve_ivp(
            rate, (t, last), start, method="DOP853", rtol=_RTOL, atol=1e-13, events=events or None, dense_output=True
        )
        assert result.success, result.message
        return result

    def speeds(self, found: Any, of: Callable[[Any], Any]) -> None:
        """Extremes of the wheel's speed along a piece, which is kept."""
        self.pieces.append((found, of))
        top = self.most(found, lambda t, y: of(y))
        bottom = -self.most(found, lambda t, y: -of(y))
        self.highest, self.lowest = max(self.highest, top), min(self.lowest, bottom)

    def most(self, found: Any, of: Callable[[float, Any], Any]) -> float:
        """The greatest value along a piece, of time and state."""
        times = np.unique(np.concatenate([np.linspace(a, b, 9) for a, b in zip(found.t[:-1], found.t[1:], strict=True)]))
        values = np.array([of(t, found.sol(t)) for t in times])
        k = int(values.argmax())
        low, high = times[max(k - 1, 0)], times[min(k + 1, times.size - 1)]
        finer = minimize_scalar(
            lambda t: -of(t, found.sol(t)), bounds=(low, high), method="bounded", options={"xatol": 1e-12}
        )
        return max(float(values[k]), -float(finer.fun))

    def greatest(self, of: Callable[[Any], Any]) -> float:
        """The greatest value over the stroke, of the motor's speed."""
        return max(self.most(result, lambda t, y, own=own: of(self.plan.belt * own(y))) for result, own in self.pieces)

    def losses(self, rated: Rated) -> tuple[Any, Any, Any]:
        """Times (s), weights (s) and losses over the rated ones at Gauss' nodes of parts of all steps."""
        nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
        times, lasting, losses = [], [], []
        for result, of in self.pieces:
            steps = zip(result.t[:-1], result.t[1:], strict=True)
            edges = np.concatenate([np.linspace(*each, _PARTS + 1)[:-1] for each in steps])
            half = 0.5 * np.diff(edges, append=result.t[-1])[:, None]
            times.append((edges[:, None] + half * (1.0 + nodes)).ravel())
            lasting.append((half * weights).ravel())
            losses.append(rated.losses(self.plan.belt * of(result.sol(times[-1]))))
        return np.concatenate(times), np.concatenate(lasting), np.concatenate(losses)


def warmest(rated: Rated, period: float, times: Any, lasting: Any, losses: Any) -> float:
    """The greatest rise (K) of losses that repeat for ever: the convolution of all that was, at the ends of all parts.

    Between the ends of two parts that are equally long it is the top of a parabola.
    """

    def rise(end: float) -> float:
        since = np.mod(end - times, period)  # of the losses that were last; those of all periods before are a series
        return float(
            sum(r / tau * (lasting * losses) @ np.exp(-since / tau) / -math.expm1(-period / tau) for r, tau in rated.bodies)
        )

    edges = np.concatenate(([0.0], np.cumsum(lasting.reshape(-1, _POINTS).sum(axis=1))))[:-1].tolist()
    best = max(range(0, len(edges), _COARSE), key=lambda k: rise(edges[k]))
    best = max(range(max(best - _COARSE, 0), min(best + _COARSE + 1, len(edges))), key=lambda k: rise(edges[k]))
    beside, top = edges[max(best - 1, 0) : best + 2], rise(edges[best])
    if len(beside) < 3 or not math.isclose(beside[1] - beside[0], beside[2] - beside[1], rel_tol=1e-6):
        return top
    below, above = rise(beside[0]) - top, rise(beside[2]) - top
    return top - (above - below) ** 2 / (8 * (above + below)) if above + below < 0 else top


def returning(plan: Plan, w: float, phi: float) -> dict[str, float]:
    """The stroke that returns, by Newton's method on differences, from one nearby."""
    state = np.array([w, phi])

    def off(at: Any) -> tuple[Any, dict[str, float]]:
        figures = stroke(plan, *at.tolist())
        return np.array([figures["speed"], figures["rest"] - plan.turns * TURN]) - at, figures

    for _ in range(12):
        left, figures = off(state)
        if abs(left[0]) <= 1e-9 * state[0] and abs(left[1]) <= 1e-9:
            return figures
        moves = np.diag([1e-4 * state[0], 1e-3])
        slopes = np.array([(off(state + move)[0] - left) / move.sum() for move in moves]).T
        state = state - np.linalg.solve(slopes, left)
    raise AssertionError("no stroke returns")


def shares(plan: Plan, figures: dict[str, float]) -> dict[str, float]:
    """The loads over their limits of a stroke that returns."""
    result = {"time of the stroke": figures["stroke_time"] / plan.period}
    result["clutch heat an hour"] = 3600.0 * figures["clutch_heat"] / plan.period / plan.per_hour
    if plan.rated is not None:
        result["motor torque"] = figures["motor_torque_rms"] / plan.rated.torque
        result["motor heat"] = figures["motor_heat"]
    if "temperature" in figures and plan.rated is not None:
        result["motor temperature"] = figures["temperature"] / plan.rated.limit
    return result


def over_limits(plan: Plan, figures: dict[str, float], asked: dict[str, float]) -> dict[str, float]:
    """Limited figures of the flywheel over their limits."""
    high, low = figures["speed_greatest"], figures["speed_least"]
    result = {"irregularity": 2.0 * (high - low) / (high + low)}
    if plan.rated is not None:
        result["motor_torque"] = figures["motor_torque_peak"] / plan.rated.torque
        result |= {"motor_rms": figures["motor_torque_rms"] / plan.rated.torque, "motor_heat": figures["motor_heat"]}
    return {name: result[name] / most for name, most in asked.items()}


def marks(plan: Plan) -> list[float]:
    """Crank angles within a turn at which the driven side's laws change."""
    dead = [0.0, math.pi] if plan.slider is not None else []
    return sorted({*dead, *(angle for window in plan.windows for angle in window[:2])})


def _mirrored(plan: Plan) -> Plan:
    """The machine whose marks lie at the negative angles."""
    return plan._replace(windows=tuple((-high % TURN, -low % TURN, force) for low, high, force in plan.windows))


def ahead(plan: Plan, phi: float) -> float:
    """The next of the marks, not reduced to a turn."""
    turn = math.floor(phi / TURN) * TURN
    result = [turn + k * TURN + mark for k in (0, 1) for mark in (*marks(plan), 0.0) if turn + k * TURN + mark > phi + 1e-11]
    return min(result)


def stroke(plan: Plan, w: float, phi: float) -> dict[str, float]:
    """The figures of a stroke from a speed of the wheel's shaft (rad/s) and an angle at which the crank stands (rad)."""
    run, r = Run(plan), plan.ratio
    start = w

    def motor(speed: float) -> tuple[float, float]:
        torque = float(plan.motor(plan.belt * speed))
        return torque * plan.belt * speed, torque * torque

    # states: wheel, angle, crank's speed, heat of the clutch, of the brake, work and square of the motor's torque
    t, y = 0.0, [w, phi, 0.0, 0.0, 0.0, 0.0, 0.0]
    hold, turns = _released(plan, phi, 0.0)  # the way in which the crank turns, which may fall back before the clutch bites
    sense, let_go, brake_on, lock, slip = 1, math.inf, math.inf, math.nan, math.nan
    again, where = 0.0, math.nan  # the time of slips under the work, and the angle of the first

    def share(t: float, time: float) -> float:
        """Of the clutch's torque at a time, in the piece around another."""
        if math.isinf(let_go):
            return t / plan.rise if time < plan.rise else 1.0
        return 1.0 if time < let_go + plan.hold else max(0.0, 1.0 - (t - let_go - plan.hold) / plan.fall)

    def brakes(t: float, time: float) -> float:
        if time < plan.brake_fall:
            return plan.brake * (1.0 - t / plan.brake_fall)
        if time < brake_on:
            return 0.0
        return plan.brake * ((t - brake_on) / plan.brake_rise if time < brake_on + plan.brake_rise else 1.0)

    while True:
        angles = [ahead(plan, y[1])] + [each for each in (plan.release, plan.engage) if each > y[1] + 1e-11]
        end = min(angles) if turns > 0 else -ahead(_mirrored(plan), -y[1])
        times = (
            [plan.rise, plan.brake_fall, hold]
            if math.isinf(let_go)
            else [let_go + plan.hold, let_go + plan.hold + plan.fall]
        )
        last = min(each for each in (*times, brake_on + plan.brake_rise, 60.0) if each > t + 1e-13)
        middle, time = 0.5 * (y[1] + end), 0.5 * (t + last)
        angle = lambda t, y, end=end: y[1] - end  # noqa: E731
        before = t
        if sense:

            def slips(
                t: float,
                y: Any,
                middle: float = middle,
                time: float = time,
                sense: int = sense,
                turns: int = turns,
                hold: float = hold,
            ) -> list[float]:
                torque, brake = sense * plan.clutch * share(t, time), turns * brakes(t, time)
                reduced, slope, moment = driven(plan, y[1], middle, turns)
                gear = plan.gear_efficiency if torque * turns > 0.0 else 1.0 / plan.gear_efficiency
                alpha = (gear * r * torque + moment - brake - slope * y[2] ** 2 / 2) / reduced if time > hold else 0.0
                heat = torque * (y[0] - r * y[2])
                return [driving(plan, y[0], torque), y[2], alpha, heat, brake * y[2], *motor(y[0])]

            apart = lambda t, y, sense=sense: sense * (y[0] - r * y[2])  # noqa: E731
            # from the other side of 0, so that a step which passes over the whole way back is not taken for a start
            rests = [(lambda t, y, turns=turns: y[2] + 1e-13 * turns, -turns)] if time > hold else []
            result = run.step(slips, y, t, (apart, -1), (angle, turns), *rests, last=last)
            if rests and result.t_events[2].size:
                assert math.isnan(lock), "the crank stalls"
                run.speeds(result, lambda y: y[0])
                t, y = float(result.t[-1]), result.y[:, -1].tolist()
                y[2] = 0.0
                hold, turns = _released(plan, y[1], t)
                continue
            run.speeds(result, lambda y: y[0])
        else:
            y[0] = r * y[2]

            def joined(t: float, y: Any, middle: float = middle, time: float = time) -> list[float]:
                brake = brakes(t, time)
                alpha, _ = locked(plan, y[1], y[2], middle, brake)
                return [r * alpha, y[2], alpha, 0.0, brake * y[2], *motor(r * y[2])]

            def passes(t: float, y: Any, middle: float = middle, time: float = time) -> float:
                return locked(plan, y[1], y[2], middle, brakes(t, time))[1]

            def spare(t: float, y: Any, time: float = time, passes: Callable[[float, Any], float] = passes) -> float:
                return plan.static * share(t, time) - abs(passes(t, y))

            tight = spare(t, y) < 0.0
            result = None
            if not tight:
                result = run.step(joined, y, t, (spare, -1), (angle, 1), (lambda t, y: y[2], -1), last=last)
                assert not result.t_events[2].size, "the machine stalls"
                run.speeds(result, lambda y: r * y[2])
                passed = run.most(result, lambda t, y, passes=passes: abs(passes(t, y)))
                run.clutch_torque = max(run.clutch_torque, passed)
            if tight or (result is not None and result.t_events[0].size):
                if result is not None:
                    t, y = float(result.t[-1]), result.y[:, -1].tolist()
                y[0] = r * y[2]
                sense = 1 if passes(t, y) > 0.0 else -1
                if math.isinf(let_go):
                    where = y[1] if math.isnan(where) else where
                    run.clutch_torque = plan.static
                continue
        t, y = float(result.t[-1]), result.y[:, -1].tolist()
        if sense and not math.isnan(lock) and math.isinf(let_go):
            again += t - before
        if sense and result.t_events[0].size:
            if math.isnan(lock):
                slip, lock = t, y[1]
            sense = 0
        elif result.t_events[1].size:
            y[1] = end
            if end == plan.release:
                let_go = t
            if end == plan.engage:
                brake_on = t
        if t >= let_go + plan.hold + plan.fall - 1e-13:
            break
    release, wheel = t, y[0] if sense else r * y[2]
    if math.isinf(brake_on):
        t, y = _alone(plan, run, t, y, plan.engage, 0.0)
        brake_on = t
    t, y = _alone(plan, run, t, y, math.inf, brake_on)
    rest = y[1]

    def recovers(t: float, y: Any) -> list[float]:
        return [driving(plan, y[0], 0.0), *motor(y[0])]

    result = run.step(recovers, [wheel, y[5], y[6]], release, last=plan.period)
    run.speeds(result, lambda y: y[0])
    warm: dict[str, float] = {}
    if plan.rated is not None:
        times, lasting, losses = run.losses(plan.rated)
        warm["motor_heat"] = float(lasting @ losses) / plan.period
        heat, share, motor_of = plan.rated.heat, plan.rated.losses, plan.motor
        warm["inverter_current"] = run.greatest(plan.rated.current or (lambda w: math.sqrt(share(w))))
        warm["power_returned"] = max(0.0, run.greatest(lambda w: -motor_of(w) * w - heat * share(w)))
        if plan.rated.bodies:
            warm["temperature"] = warmest(plan.rated, plan.period, times, lasting, losses)
    return {
        **warm,
        "speed": float(result.y[0, -1]),
        "rest": rest,
        "slip_time": slip,
        "lock_angle": lock,
        "clutch_torque": run.clutch_torque,
        **({} if math.isnan(where) else {"second_slip_angle": where}),
        "clutch_heat": y[3],
        "brake_heat": y[4],
        "holding_torque": abs(driven(plan._replace(friction=0.0), rest, rest)[2]),
        "motor_torque_peak": run.greatest(lambda w: abs(plan.motor(w))),
        "brake_angle": rest - plan.engage,
        "stopping_time": t - brake_on,
        "second_slip_time": again,
        "stroke_time": t,
        "speed_least": run.lowest,
        "speed_greatest": run.highest,
        "wheel_energy": (plan.wheel + plan.belt**2 * plan.rotor) * (start**2 - run.lowest**2) / 2,
        "mean_power": float(result.y[1, -1]) / plan.period,
        "motor_torque_rms": math.sqrt(float(result.y[2, -1]) / plan.period),
    }


def _released(plan: Plan, phi: float, t: float) -> tuple[float, int]:
    """Time (s), after a given one, at which friction and the opening brake no longer hold the crank; and its direction."""
    _, way, _ = gains(plan, phi)
    free = driven(plan._replace(friction=0.0), phi, phi + 1e-9)[2]

    def pushes(t: Any, sense: int) -> Any:
        """The moment by which the clutch and what acts on the crank exceed friction and brake, forwards or backwards."""
        torque = plan.clutch * (np.minimum(1.0, t / plan.rise) if plan.rise else 1.0)
        brake = plan.brake * np.maximum(0.0, 1 - t / plan.brake_fall) if plan.brake_fall else 0.0
        passed = plan.ratio * torque * plan.gear_efficiency**sense
        return sense * (passed + free) - plan.friction * abs(way) - brake

    times = np.linspace(t, max(t, plan.rise, plan.brake_fall), 2001)
    firsts = {}
    for sense in (1, -1):
        there = np.flatnonzero(pushes(times, sense) + 0.0 * times > 0.0)
        if there.size:
            k = int(there[0])
            ends = float(times[max(k - 1, 0)]), float(times[k])
            firsts[sense] = t if k == 0 else float(brentq(pushes, *ends, args=(sense,), xtol=1e-18, rtol=1e-15))
    assert firsts, "the crank does not move"
    sense = min(firsts, key=lambda each: firsts[each])
    return firsts[sense], sense


def _alone(plan: Plan, run: Run, t: float, y: list[float], goal: float, begin: float) -> tuple[float, list[float]]:
    """The driven side alone, up to an angle, or with the brake that is put on at a time until it stands."""
    brakes = math.isinf(goal)
    while True:
        end = min(ahead(plan, y[1]), goal)
        full = begin + plan.brake_rise
        last = full if brakes and t < full - 1e-13 else 60.0
        middle = 0.5 * (y[1] + end)

        def rate(t: float, y: Any, middle: float = middle, last: float = last) -> list[float]:
            rising = last < 60.0
            brake = plan.brake * ((t - begin) / plan.brake_rise if rising else 1.0) if brakes else 0.0
            reduced, slope, moment = driven(plan, y[1], middle)
            return [0.0, y[2], (moment - brake - slope * y[2] ** 2 / 2) / reduced, 0.0, brake * y[2], 0.0, 0.0]

        result = run.step(rate, y, t, (lambda t, y: y[2], -1), (lambda t, y, end=end: y[1] - end, 1), last=last)
        t, y = float(result.t[-1]), result.y[:, -1].tolist()
        if result.t_events[0].size or (result.t_events[1].size and end == goal):
            return t, y
