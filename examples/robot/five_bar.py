"""A five-bar with two motors draws a circle: inertia matrix, driving torques, reactions, and the motion that they make.

Two cranks of 250 mm, 300 mm apart, carry two rods of 400 mm that meet at the tip: two degrees of freedom in a closed loop.
Prints the reduced inertia matrix along the circle; the torques of both motors, found from g = 2 virtual powers and again
with all reactions from Newton's and Euler's equations; lets them bring the circle about by simulation; and lets the arms
fall freely, which keeps their energy.

    python examples/robot/five_bar.py five_bar.png
"""

import sys
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

import flywheel
from flywheel import freedoms

ARM = {"points": {"knee": ["250 mm", 0]}, "mass": "1.2 kg", "inertia": "0.007 kg m^2", "com": ["110 mm", 0]}
ROD = {"points": {"tip": ["400 mm", 0]}, "mass": "0.5 kg", "inertia": "0.007 kg m^2", "com": ["200 mm", 0]}
PINS = {
    "left_motor": ["frame.left", "left.origin"],
    "right_motor": ["frame.right", "right.origin"],
    "left_knee": ["left.knee", "left_rod.origin"],
    "right_knee": ["right.knee", "right_rod.origin"],
    "tip": ["left_rod.tip", "right_rod.tip"],
}
FIVE_BAR = flywheel.load_linkage({
    "mechanism": {
        "type": "linkage",
        "driver": ["left_motor", "right_motor"],
        "start": ["140 deg", "40 deg"],
        "assembly": [{"point": "left_rod.tip", "side": "left", "from": "left.knee", "to": "right.knee"}],
        "bodies": {
            "frame": {"points": {"left": ["-150 mm", 0], "right": ["150 mm", 0]}},
            "left": ARM,
            "right": ARM,
            "left_rod": ROD,
            "right_rod": ROD,
        },
        "joints": [{"name": name, "type": "pin", "between": between} for name, between in PINS.items()],
    }
})  # fmt: skip
TIP = "left_rod", FIVE_BAR.link("left_rod").point("tip")[1:]
DOWN = (0.0, -9.80665)
CENTRE, RADIUS, TIME = 0.43j, 0.06, 0.8  # m, m, s


def circle(t):
    """Place, velocity and acceleration of the tip: once round, from rest to rest, s = 10 u³ - 15 u⁴ + 6 u⁵, u = t/TIME."""
    u = np.asarray(t) / TIME
    angle = 2 * np.pi * (u**3 * (10 - 15 * u + 6 * u**2)) - np.pi / 2
    speed = 2 * np.pi * 30 * u**2 * (1 - u) ** 2 / TIME
    turning = 2 * np.pi * 60 * u * (1 - u) * (1 - 2 * u) / TIME**2
    out = RADIUS * np.exp(1j * angle)
    return CENTRE + out, 1j * speed * out, (1j * turning - speed**2) * out


def motors(tip, velocity, acceleration):
    """Angles, rates and accelerations of both motors: circles that intersect, then the tip's influence coefficients."""
    angles = []
    for base, side in ((-0.15, 1), (0.15, -1)):  # the left knee bends to the left, the right one to the right
        reach = tip - base
        bend = np.arccos((0.25**2 + np.abs(reach) ** 2 - 0.4**2) / (2 * 0.25 * np.abs(reach)))
        angles.append(np.angle(reach) + side * bend)
    q = np.array(angles)
    place = freedoms.positions(FIVE_BAR, q)
    coefficients = np.array([place.by(name).point(*TIP).rate for name in ("left_motor", "right_motor")])

    def solved(vector):
        """Rates of the motors at which the tip has a velocity."""
        columns = np.stack((vector.real, vector.imag), axis=-1)[..., None]
        return np.linalg.solve(coefficients.transpose(2, 1, 0), columns)[..., 0].T

    qdot = solved(velocity)
    x, y = place.motion(qdot).point(*TIP).slope  # of the tip with both motors at a constant speed
    return q, qdot, solved(acceleration - (x + 1j * y))


def table(t, q) -> None:
    """The inertia matrix along the circle."""
    print("  t, s   left, deg  right, deg   I*11, kg m2   I*12      I*22")
    for k in range(0, t.size, (t.size - 1) // 8):
        matrix = freedoms.mass_matrix(FIVE_BAR, q[:, k])
        left, right = np.degrees(q[:, k])
        print(f"{t[k]:6.2f} {left:11.3f} {right:11.3f} {matrix[0, 0]:12.6f} {matrix[0, 1]:10.6f} {matrix[1, 1]:9.6f}")


def planned(t, q, qdot, qddot):
    """Torques by virtual powers and by Newton and Euler; the greatest forces in the pins."""
    torques = freedoms.driving_actions(FIVE_BAR, q, qdot, qddot, gravity=DOWN)
    found = freedoms.reactions(FIVE_BAR, q, qdot, qddot, t=t, gravity=DOWN)
    both = np.array(list(torques.values()))
    apart = np.abs(both - np.array([found.actions[name] for name in torques])).max()
    print(f"\ntorques: left {np.abs(both[0]).max():.4f} N m, right {np.abs(both[1]).max():.4f} N m at most")
    print(f"virtual powers and Newton-Euler differ by {apart:.1e} N m")
    for extreme in found.extremes():
        print(f"  {extreme.joint:12s} {extreme.force:8.3f} N at {extreme.at:.3f} s")
    return both


def followed(t, q, qdot, torques) -> None:
    """The torques, interpolated, with a little damping of what is off the plan, bring the circle about."""
    drive, plan = make_interp_spline(t, torques.T, k=7), make_interp_spline(t, qdot.T, k=7)

    def motor(k):
        return lambda time, _, rates: float(drive(time)[k] - 2.0 * (rates[k] - plan(time)[k]))

    drives = {"left_motor": motor(0), "right_motor": motor(1)}
    run = freedoms.simulate(FIVE_BAR, q[:, 0], qdot[:, 0], TIME, drives, gravity=DOWN, rtol=1e-7)
    reached, _ = run.at(t)
    print(f"\nfollowed by simulation to {np.abs(reached - q).max():.1e} rad, error {run.error:.1e} (estimated)")
    print(f"work of the motors against energy: {run.energy_residual:.1e}; loops open by {run.closure:.1e} m at most")


def fall() -> None:
    """From rest, without torques."""
    run = freedoms.simulate(FIVE_BAR, np.radians([120.0, 55.0]), [0.0, 0.0], 0.15, gravity=DOWN)
    print(f"\nfree fall of 0.15 s: kinetic energy {run.kinetic[-1]:.6f} J, kept to {run.energy_residual:.1e}")


def plot(t, q, torques, path: str | Path) -> None:
    """The linkage along the circle, and the torques over time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 4.2), layout="constrained")
    view, curves = figure.subplots(1, 2)
    place = freedoms.positions(FIVE_BAR, q)
    poses = place.motion(0.0)
    tip = poses.point(*TIP).value
    for k, shade in ((0, 1.0), (2 * t.size // 5, 0.35), (3 * t.size // 5, 0.35)):
        for side, colour in (("left", "#0072B2"), ("right", "#D55E00")):
            corners = [poses.point(side, (0, 0)), poses.point(side, (0.25, 0)), poses.point(f"{side}_rod", (0.4, 0))]
            x, y = np.array([corner.value[:, k] for corner in corners]).T
            view.plot(x, y, "o-", color=colour, alpha=shade, markersize=4)
    view.plot(*tip, color="black", linewidth=1)
    view.set(xlabel="x, m", ylabel="y, m", aspect="equal", title="the tip draws a circle")
    for values, name, colour in zip(torques, ("left motor", "right motor"), ("#0072B2", "#D55E00"), strict=True):
        curves.plot(t, values, color=colour, label=name)
    curves.set(xlabel="time, s", ylabel="torque, N m", title="driving torques")
    curves.legend()
    figure.savefig(path, dpi=120)


def main(path: str | Path | None = None) -> None:
    """Print everything; draw into `path` if one is given."""
    t = np.linspace(0, TIME, 161)
    q, qdot, qddot = motors(*circle(t))
    table(t, q)
    torques = planned(t, q, qdot, qddot)
    followed(t, q, qdot, torques)
    fall()
    if path is not None:
        plot(t, q, torques, path)


if __name__ == "__main__":
    main(*sys.argv[1:2])
