"""Toggle clamp: a sliding block swings a bell crank through a coupler; the bell crank pushes a platen through a rod.

The block drives: the mechanism's own coordinate psi is its displacement in m, and takes the place of the crank's angle.

Source: E. Sacotto, Dynamic analysis of the clamping unit of an injection moulding machine, ESPE. Its Jacobian has +1
for -1 at the platen, and its accelerations a term of the block (a4 v4²) that a straight guide does not have; neither
is followed here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property, partial
from itertools import chain
from math import asin, cos, hypot, inf, pi, sin, sqrt
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from flywheel.language import text as _
from flywheel.mechanisms import families as f
from flywheel.numerics.faults import Fault
from flywheel.scene.scene import BODY, POINT, Key, Mechanism, length


class ClampLengths(NamedTuple):
    """Lengths (m), angle (rad) and assembly of a toggle clamp.

    `side` is +1 if the coupler's pin on the bell crank lies left of the line from pivot to block, -1 right. `ahead`
    is +1 if the platen lies ahead of the rod's pin on the bell crank, -1 behind.
    """

    height: float
    drive: float
    clamp: float
    angle: float
    coupler: float
    rod: float
    side: int
    ahead: int


def bars(mechanism: Mechanism) -> ClampLengths:
    """Lengths, angle and assembly of a toggle clamp."""
    geometry, assembly = mechanism.geometry, mechanism.assembly
    return ClampLengths(
        geometry["frame.height"],
        geometry["bell_crank.drive_length"],
        geometry["bell_crank.clamp_length"],
        geometry["bell_crank.angle"],
        geometry["coupler.length"],
        geometry["rod.length"],
        -1 if assembly.startswith("crossed") else 1,
        -1 if assembly.endswith("-behind") else 1,
    )


def rounded(mechanism: Mechanism) -> ClampLengths:
    """The same as floats, for finding limits whatever the type of numbers of the geometry."""
    return bars(replace(mechanism, geometry={name: float(value) for name, value in mechanism.geometry.items()}))


def _folds(lengths: ClampLengths) -> list[float]:
    """Displacements (m) at which drive arm and coupler lie on one line, folded or stretched."""
    a1, a2, a3 = lengths.height, lengths.drive, lengths.coupler
    reaches = [sqrt(max(0.0, (D - a1) * (D + a1))) for D in (abs(a2 - a3), a2 + a3) if not f.exceeds(a1, D)]
    return sorted({sign * reach for reach in reaches for sign in (1, -1)})


def _crossings(lengths: ClampLengths) -> Iterator[tuple[float, float]]:
    """Displacements (m) where the rod is normal to the platen's line, or most nearly if a6 > a5, and d(theta2)/dpsi."""
    a1, a2, a5, alpha, a3, a6, side, _ = lengths
    steep = asin(min(1.0, a6 / a5))
    for theta5 in (steep, -steep, pi - steep, steep - pi)[: 4 if a6 < a5 else 2]:
        along, rise = a2 * cos(theta5 - alpha - pi), a1 - a2 * sin(theta5 - alpha - pi)
        if abs(rise) > a3:
            continue
        for run in (sqrt((a3 - rise) * (a3 + rise)), -sqrt((a3 - rise) * (a3 + rise))):
            area = along * rise - (a1 - rise) * run  # of drive arm and coupler, doubled; its sign is the assembly's
            if side * area < 0:
                yield -(along + run), -run / area


def breakpoints(lengths: ClampLengths, stroke: tuple[float, float] | None) -> tuple[float, ...]:
    """Displacements (m) inside the stroke where cells shorten, because a lock is near its ends or just off the real axis."""
    if stroke is None:
        return ()
    start, end = sorted(stroke)
    a1, uneven = lengths.height, abs(lengths.drive - lengths.coupler)
    near = [(psi, 0.0) for psi in _folds(lengths)]
    near += [(0.0, sqrt((a1 - uneven) * (a1 + uneven)))] if a1 > uneven else []
    upright = f.above_one(lengths.rod / lengths.clamp)
    near += [(psi, upright / abs(rate) if rate else inf) for psi, rate in _crossings(lengths)]
    spots = chain(*(f.graded(psi, hypot(max(start - psi, psi - end, 0.0), above), end - start) for psi, above in near))
    return tuple(sorted({psi for psi in spots if start < psi < end}))


class TogglePosition(f.Position):
    """Positions of a toggle clamp at the block's displacement psi (m).

    The block stands at (-psi, a1) from the bell crank's pivot, at the distance D. Coupler a3 and drive arm a2 close a
    triangle over D; K is 4 x its area. The clamp arm a5 and the rod a6 make a slider-crank, whose crank angle is
    theta5 = theta2 + alpha + pi; its local ratios are by that angle.
    """

    def __init__(self, bars: ClampLengths, psi: Any, ns: Any, anchor: Any = None) -> None:
        super().__init__(psi, ns)
        self.a1, self.a2, self.a5, self.alpha, self.a3, self.a6, self.side, self.ahead = bars

    @cached_property
    def block(self) -> Any:
        """Displacement of the block along -x from above the pivot, psi (m)."""
        return self.psi

    @cached_property
    def square(self) -> Any:
        """D² = a1² + psi², in m²."""
        return self.a1**2 + self.psi**2

    @cached_property
    def area4(self) -> Any:
        """K = sqrt[((a2 + a3)² - D²)(D² - (a2 - a3)²)], Heron's form, in m²."""
        a1, longest, uneven = self.a1, self.a2 + self.a3, abs(self.a2 - self.a3)
        spare = (longest - a1) * (longest + a1) - self.psi**2
        return self.ns.sqrt(spare * ((a1 - uneven) * (a1 + uneven) + self.psi**2))

    @cached_property
    def _skew(self) -> Any:
        """D² - a2² - a3² = 2 a2 a3 cos(angle between drive arm and coupler), in m²."""
        return self.square - (self.a2**2 + self.a3**2)

    @cached_property
    def _sight(self) -> Any:
        """Angle (rad) from +x of the line from the pivot to the block, in (0, pi)."""
        return self.ns.atan2(self.a1, -self.psi)

    @cached_property
    def bell_crank(self) -> Any:
        """Angle theta2 of the drive arm from +x (rad), from the pivot to the coupler's pin."""
        uneven = (self.a2 - self.a3) * (self.a2 + self.a3)
        return self._sight + self.side * self.ns.atan2(self.area4, self.square + uneven)

    @cached_property
    def coupler(self) -> Any:
        """Angle theta3 of the coupler from +x (rad), from the bell crank's pin to the block."""
        uneven = (self.a3 - self.a2) * (self.a3 + self.a2)
        return self._sight - self.side * self.ns.atan2(self.area4, self.square + uneven)

    bell_crank_sin, bell_crank_cos = f.sine("bell_crank"), f.cosine("bell_crank")
    coupler_sin, coupler_cos = f.sine("coupler"), f.cosine("coupler")

    @cached_property
    def bell_crank_rate(self) -> Any:
        """d(theta2)/dpsi = ± 2 a3 cos theta3 / K, in rad/m."""
        return self.side * 2 * self.a3 * self.coupler_cos / self.area4

    @cached_property
    def coupler_rate(self) -> Any:
        """d(theta3)/dpsi = ∓ 2 a2 cos theta2 / K, in rad/m."""
        return -self.side * 2 * self.a2 * self.bell_crank_cos / self.area4

    @cached_property
    def bell_crank_slope(self) -> Any:
        """d²(theta2)/dpsi² = ∓ [(D² - a2² - a3²) theta2'² + 2 a3² theta3'²]/K, in rad/m²."""
        turning = self._skew * self.bell_crank_rate**2 + 2 * self.a3**2 * self.coupler_rate**2
        return -self.side * turning / self.area4

    @cached_property
    def coupler_slope(self) -> Any:
        """d²(theta3)/dpsi² = ± [2 a2² theta2'² + (D² - a2² - a3²) theta3'²]/K, in rad/m²."""
        turning = 2 * self.a2**2 * self.bell_crank_rate**2 + self._skew * self.coupler_rate**2
        return self.side * turning / self.area4

    @cached_property
    def clamp(self) -> Any:
        """Angle theta5 = theta2 + alpha + pi of the clamp arm from +x (rad), from the pivot to the rod's pin."""
        return self._opened + self.ns.pi

    @cached_property
    def _opened(self) -> Any:
        """Angle theta2 + alpha (rad): that of the clamp arm less half a turn."""
        return self.bell_crank + self.alpha

    @cached_property
    def clamp_sin(self) -> Any:
        """Sine of the clamp arm's angle."""
        return -self.ns.sin(self._opened)

    @cached_property
    def clamp_cos(self) -> Any:
        """Cosine of the clamp arm's angle."""
        return -self.ns.cos(self._opened)

    @cached_property
    def height(self) -> Any:
        """Height of the rod's pin above the platen's line, h = a5 sin theta5 (m)."""
        return self.a5 * self.clamp_sin

    @cached_property
    def reach(self) -> Any:
        """Extent of the rod along that line, q = a6 cos theta6 = ± sqrt(a6² - h²), in m.

        Where a6 >= a5 it is taken as (a6 - a5)(a6 + a5) + a5² cos² theta5, so that it keeps its digits close to a lock.
        """
        if self.a6 >= self.a5:
            square = (self.a6 - self.a5) * (self.a6 + self.a5) + (self.a5 * self.clamp_cos) ** 2
        else:
            square = (self.a6 - self.height) * (self.a6 + self.height)
        return self.ahead * self.ns.sqrt(square)

    @cached_property
    def rod(self) -> Any:
        """Angle theta6 of the rod from +x (rad), from the bell crank's pin to the platen; about pi where it is behind."""
        if self.ahead > 0:
            return self.ns.atan2(-self.height, self.reach)
        return self.ns.atan2(self.height, -self.reach) + self.ns.pi

    @cached_property
    def rod_sin(self) -> Any:
        """Sine of the rod's angle."""
        return -self.height / self.a6

    @cached_property
    def rod_cos(self) -> Any:
        """Cosine of the rod's angle."""
        return self.reach / self.a6

    @cached_property
    def rod_rate(self) -> Any:
        """d(theta6)/d(theta5) = -a5 cos theta5 / q: the ratio from the bell crank."""
        return -self.a5 * self.clamp_cos / self.reach

    @cached_property
    def rod_slope(self) -> Any:
        """Slope of that ratio by psi, h (1 - ratio²)/q theta2', in 1/m."""
        return self.height * (1 - self.rod_rate) * (1 + self.rod_rate) / self.reach * self.bell_crank_rate

    @cached_property
    def rod_turn(self) -> Any:
        """d(theta6)/dpsi, in rad/m."""
        return self.rod_rate * self.bell_crank_rate

    @cached_property
    def platen(self) -> Any:
        """Displacement of the platen along +x from the pivot, s = a5 cos theta5 + q (m)."""
        return self.a5 * self.clamp_cos + self.reach

    @cached_property
    def platen_rate(self) -> Any:
        """ds/d(theta5) = -h s / q, in m: the ratio from the bell crank; it is 0 at full stretch and keeps its digits."""
        return -self.height * self.platen / self.reach

    @cached_property
    def platen_slope(self) -> Any:
        """Slope of that ratio by psi, -[a5 s cos theta5 + s' (s' + 2 h)]/q theta2', with s' the ratio."""
        along, speed = self.a5 * self.platen * self.clamp_cos, self.platen_rate
        return -(along + speed * (speed + 2 * self.height)) / self.reach * self.bell_crank_rate


DRIVE = f.line("bell_crank")
CLAMP = f.BodyLine("bell_crank", *map(attrgetter, ("clamp", "clamp_sin", "clamp_cos", "bell_crank_rate")))
ROD = f.line("rod")._replace(rate=attrgetter("rod_turn"))


def family(mechanism: Mechanism, parameters: Mapping[str, float]) -> f.Family:
    """Chain of a toggle clamp: block -> bell crank -> rod and platen; the coupler straight from the block."""
    lengths, mass = bars(mechanism), f.body(mechanism, "block").mass
    weight = () if mass == 0 else (f.Weight("block", mass, pi, "block"),)
    parts = f.joined(
        f.Parts((f.Velocity("block", False, (f.Term("crank", 1.0),)),), f.carried("block", mass, "block"), weight),
        f.Parts((f.driven("bell_crank", True), f.driven("coupler", True), f.driven("rod", True, "bell_crank"))),
        f.pivoted(CLAMP, mechanism, "bell_crank"),
        f.floating(f.line("coupler"), mechanism, "coupler", lengths.drive, DRIVE),
        f.floating(ROD, mechanism, "rod", lengths.clamp, CLAMP),
        f.sliding(mechanism, "platen", 0.0, "bell_crank"),
    )
    ports = {name: f.Port(name, attrgetter(name)) for name in ("block", "platen", "bell_crank", "coupler", "rod")}
    return f.Family(*parts, ports, partial(TogglePosition, lengths), breakpoints(rounded(mechanism), mechanism.stroke))


def locks(mechanism: Mechanism) -> list[Fault]:
    """A clamp that cannot go through its stroke: it names the length to change and the displacements where it locks.

    Drive arm and coupler must reach the block and not lie on one line. A rod longer than the clamp arm always reaches;
    a shorter one locks where it is normal to the platen's line.
    """
    path = mechanism.path
    if mechanism.stroke is None:
        advice = "its block goes one way: add [stroke] with from, to and speed"
        return [Fault(f"{path}.type", "a toggle-clamp without a stroke", "the stroke of its block", advice)]
    lengths, (start, end) = rounded(mechanism), sorted(mechanism.stroke)
    height, drive, coupler = lengths.height, lengths.drive, lengths.coupler

    slack = f.TOUCH * max(abs(start), abs(end))

    def within(places: Iterable[float]) -> list[float]:
        return sorted(psi for psi in places if start - slack <= psi <= end + slack)

    def fault(key: str, length: float, expected: str, places: list[float]) -> list[Fault]:
        listed = " and ".join(f"{psi:.6g}" for psi in places)
        where = f"the clamp locks where its block is at {listed} m" if listed else "it closes nowhere in the stroke"
        return [Fault(f"{path}.{key}", f"{length:.9g} m", expected, where)]

    far, near = hypot(height, max(-start, end)), hypot(height, max(start, -end, 0.0))
    if not f.exceeds(drive + coupler, far) or not f.exceeds(near + min(drive, coupler), max(drive, coupler)):
        least, most = max(far - drive, drive - near), drive + near
        if f.exceeds(most, least):
            return fault("coupler.length", coupler, f"between {least:.9g} and {most:.9g} m", within(_folds(lengths)))
        return fault("bell_crank.drive_length", drive, f"more than {(far - near) / 2:.9g} m", within(_folds(lengths)))
    if f.exceeds(lengths.rod, lengths.clamp):
        return []
    across = within(psi for psi, _ in _crossings(lengths))
    if not across and f.exceeds(lengths.rod, abs(TogglePosition(lengths, start, np).height)):
        return []
    expected = f"a rod longer than bell_crank.clamp_length = {lengths.clamp:.9g} m"
    return fault("rod.length", lengths.rod, expected, across)


def skeleton(mechanism: Mechanism, position: TogglePosition) -> f.Skeleton:
    """The bell crank's own x axis runs to the coupler's pin; its centre of mass counts from the clamp arm."""
    lengths = bars(mechanism)
    tilt = lengths.angle + pi
    members = {
        "frame": f.Member({"pivot": f.HERE, "block_guide": (0.0, lengths.height), "platen_guide": f.HERE}),
        "block": f.Member({"block_guide": f.HERE, "block_pin": f.HERE}),
        "coupler": f.Member({"coupler_pin": f.HERE, "block_pin": (lengths.coupler, 0.0)}, position.coupler),
        "bell_crank": f.Member(
            {
                "pivot": f.HERE,
                "coupler_pin": (lengths.drive, 0.0),
                "rod_pin": (lengths.clamp * cos(tilt), lengths.clamp * sin(tilt)),
            },
            position.bell_crank,
            tilt,
        ),
        "rod": f.Member({"rod_pin": f.HERE, "platen_pin": (lengths.rod, 0.0)}, position.rod),
        "platen": f.Member({"platen_pin": f.HERE, "platen_guide": f.HERE}),
    }
    joints = (
        f.Slide("block_guide", "frame", "block", pi),
        f.Pin("block_pin", "block", "coupler"),
        f.Pin("coupler_pin", "coupler", "bell_crank"),
        f.Pin("pivot", "frame", "bell_crank"),
        f.Pin("rod_pin", "bell_crank", "rod"),
        f.Pin("platen_pin", "rod", "platen"),
        f.Slide("platen_guide", "frame", "platen", at=position.platen),
    )
    side = ("bell_crank", "coupler_pin"), ("frame", "pivot"), ("block", "block_pin"), lengths.side
    return members, joints, (side,)


def derivation(made: f.Derivation) -> None:
    """a2 at theta2 and a3 at theta3 reach the block at (-x, a1); a5 at theta5 and a6 at theta6 the platen at (s, 0)."""
    p, m = made.position, made.mechanism
    made.equations(
        "a_2*cos(theta_2) + a_3*cos(theta_3) = -x",
        "a_2*sin(theta_2) + a_3*sin(theta_3) = a_1",
        "a_5*cos(theta_5) + a_6*cos(theta_6) = s",
        "a_5*sin(theta_5) + a_6*sin(theta_6) = 0",
    )
    side, ahead = ("-" if m.assembly.startswith("crossed") else "+"), not m.assembly.endswith("-behind")
    made.part(_("Positions, by the diagonal D from the bell crank's pivot to the block"))
    made.find("D", "sqrt(a_1**2 + x**2)", "m", _("Length of the diagonal"))
    made.find("delta", "atan2(a_1, -x)", "°", _("Angle of the diagonal"))
    made.find(
        "rho",
        "acos((D**2 + a_2**2 - a_3**2)/(2*D*a_2))",
        "°",
        _("Angle between diagonal and drive arm, by the law of cosines"),
    )
    made.angle("theta_2", f"delta {side} rho", _("Angle of the drive arm of the bell crank"), float(p.bell_crank))
    made.angle(
        "theta_3", "atan2(a_1 - a_2*sin(theta_2), -x - a_2*cos(theta_2))", _("Angle of the coupler"), float(p.coupler)
    )
    made.find("theta_5", "theta_2 + alpha + pi", "°", _("Angle of the clamp arm of the bell crank"), values=p.clamp)
    made.angle(
        "theta_6",
        "-asin(a_5*sin(theta_5)/a_6)" if ahead else "pi + asin(a_5*sin(theta_5)/a_6)",
        _("Angle of the rod"),
        float(p.rod),
    )
    made.find("s", "a_5*cos(theta_5) + a_6*cos(theta_6)", "m", _("Place of the platen"), values=p.platen)
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("theta_2_prime", "cos(theta_3)/(a_2*sin(theta_2 - theta_3))", "1/m", values=p.bell_crank_rate)
    made.find("theta_3_prime", "-cos(theta_2)/(a_3*sin(theta_2 - theta_3))", "1/m", values=p.coupler_rate)
    made.find("theta_6_prime", "-(a_5*cos(theta_5)*theta_2_prime)/(a_6*cos(theta_6))", "1/m", values=p.rod_turn)
    made.find("theta_5_prime", "theta_2_prime", "1/m")
    s1 = p.platen_rate * p.bell_crank_rate
    made.find("s_prime", "-(a_5*sin(theta_5)*theta_2_prime) - a_6*sin(theta_6)*theta_6_prime", f.ONE, values=s1)
    made.part(_("Their derivatives g′"))
    text = "-(a_3*theta_3_prime**2 + a_2*cos(theta_2 - theta_3)*theta_2_prime**2)/(a_2*sin(theta_2 - theta_3))"
    made.find("theta_2_second", text, "1/m²", values=p.bell_crank_slope)
    text = "(a_2*theta_2_prime**2 + a_3*cos(theta_2 - theta_3)*theta_3_prime**2)/(a_3*sin(theta_2 - theta_3))"
    made.find("theta_3_second", text, "1/m²", values=p.coupler_slope)
    made.find("theta_5_second", "theta_2_second", "1/m²")
    top = "a_5*sin(theta_5)*theta_2_prime**2 - a_5*cos(theta_5)*theta_2_second + a_6*sin(theta_6)*theta_6_prime**2"
    slope = p.rod_slope * p.bell_crank_rate + p.rod_rate * p.bell_crank_slope
    made.find("theta_6_second", f"({top})/(a_6*cos(theta_6))", "1/m²", values=slope)
    text = "-(a_5*cos(theta_5)*theta_2_prime**2) - a_5*sin(theta_5)*theta_2_second"
    text += " - a_6*cos(theta_6)*theta_6_prime**2 - a_6*sin(theta_6)*theta_6_second"
    slope = p.platen_slope * p.bell_crank_rate + p.platen_rate * p.bell_crank_slope
    made.find("s_second", text, "1/m", values=slope)
    made.moves(block="x", bell_crank="theta_2", coupler="theta_3", rod="theta_6", platen="s")
    made.pivoted("bell_crank", "theta_5", "bell_crank")
    made.floating("coupler", "theta_3", ("a_2", "theta_2", "theta_2_prime", "theta_2_second"))
    made.floating("rod", "theta_6", ("a_5", "theta_5", "theta_5_prime", "theta_5_second"))


KIND = f.Kind(
    "toggle-clamp",
    "a sliding block swings a bell crank through a coupler; a rod from the bell crank pushes a platen straight",
    family,
    (
        f.Part("frame", "the frame", (length("block's line above the pivot", "height"),)),
        f.Part("block", "drives: it slides along the line y = frame.height, and has the coupler's pin", (), POINT),
        f.Part(
            "bell_crank",
            "turns about a fixed pivot, its first pin; its line runs to the rod's pin",
            (
                length("pivot to coupler pin", "drive_length"),
                length("pivot to rod pin", "clamp_length"),
                Key("angle", "angle", "from the drive arm's extension beyond the pivot to the clamp arm", required=True),
            ),
            BODY,
        ),
        f.Part("coupler", "from the bell crank (its first pin) to the block", (length("between its pins"),), BODY),
        f.Part("rod", "from the bell crank (its first pin) to the platen", (length("between its pins"),), BODY),
        f.Part("platen", "moves along the line y = 0, which passes through the pivot", (), POINT),
    ),
    (
        Key(
            "assembly",
            "choice",
            "side of the line pivot - block where the coupler's other pin lies: open left, crossed right; behind: the "
            "platen lies behind the rod's other pin",
            "open",
            choices=("open", "crossed", "open-behind", "crossed-behind"),
        ),
    ),
    (
        f.Displacement("block", False, "displacement of the block along -x, from above the pivot"),
        f.Displacement("platen", False, "displacement of the platen along +x, from the pivot"),
        f.Displacement("bell_crank", True, "angle from +x of the line from the pivot to the coupler pin"),
        f.Displacement("coupler", True, "angle from +x of the line from the bell crank to the block"),
        f.Displacement("rod", True, "angle from +x of the line from the bell crank to the platen"),
    ),
    locks,
    skeleton,
    {"block": "block_guide", "platen": "platen_guide"},
    driver="slides",
    symbols={
        "frame.height": "a_1",
        "bell_crank.drive_length": "a_2",
        "coupler.length": "a_3",
        "bell_crank.clamp_length": "a_5",
        "rod.length": "a_6",
        "bell_crank.angle": "alpha",
    },
    heights=("frame.height",),
    derivation=derivation,
    main=("platen_guide",),
)
