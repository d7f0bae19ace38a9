"""A two-link arm: its equations by Lagrange, a free fall that keeps its energy, and the torques of a planned move.

Two uniform bars of 0.5 m and 0.4 m hang in a vertical plane. Prints the equations in symbols; lets the arm fall from level
and reports the energy; plans a move of 1 s, finds the two driving torques and the greatest pin forces, then turns it round:
the same torques, with a damper's worth of feedback against drift, must bring the planned move about.

    python examples/robot/two_link.py two_link.png
"""

import sys
from pathlib import Path

import numpy as np

from flywheel.arm import (
    ArmMotion,
    TwoLinkArm,
    driving_torques,
    lagrange_equations,
    reactions,
    simulate_arm,
    slender,
)

ARM = TwoLinkArm(slender(0.5, 6.0), slender(0.4, 3.0))
HANGING, RAISED = np.array([np.pi, np.pi]), np.array([1.2, 0.3])  # rad from the upward vertical
TIME = 1.0  # s


def planned(t):
    """Angles, speeds and accelerations of a move that begins and ends at rest: s = 10 u³ - 15 u⁴ + 6 u⁵, u = t/TIME."""
    u = np.asarray(t) / TIME
    way = np.multiply.outer(RAISED - HANGING, u**3 * (10 - 15 * u + 6 * u**2))
    speed = np.multiply.outer(RAISED - HANGING, 30 * u**2 * (1 - u) ** 2) / TIME
    turning = np.multiply.outer(RAISED - HANGING, 60 * u * (1 - u) * (1 - 2 * u)) / TIME**2
    return HANGING.reshape(2, *[1] * u.ndim) + way, speed, turning


def held_to_plan(t, q, qdot):
    """The planned torques, and 5 N m s/rad against every deviation of speed."""
    wanted = planned(t)
    off = qdot - wanted[1]
    return driving_torques(ARM, *wanted) - 5.0 * np.array([off[0], off[1] - off[0]])


def show_equations() -> None:
    """Both equations, and the mass matrix."""
    found = lagrange_equations()
    for left, right in zip(found.left, found.right, strict=True):
        print(f"{left} = {right}\n")
    print(f"mass matrix: {found.mass.tolist()}\n")


def fall() -> ArmMotion:
    """From level and at rest, without torques."""
    motion = simulate_arm(ARM, [np.pi / 2, np.pi / 2], [0.0, 0.0], 5.0, rtol=1e-11)
    print(f"free fall of 5 s: kinetic energy up to {motion.kinetic.max():.3f} J")
    print(f"energy kept to {motion.energy_residual:.1e} in {motion.t.size - 1} steps")
    return motion


def move() -> None:
    """Torques and pin forces of the planned move; the torques bring it about."""
    t = np.linspace(0, TIME, 201)
    torques = driving_torques(ARM, *planned(t))
    forces = [np.hypot(*force).max() for force in reactions(ARM, *planned(t))]
    print(f"\nplanned move: shoulder {np.abs(torques[0]).max():.3f} N m, elbow {np.abs(torques[1]).max():.3f} N m at most")
    print(f"pin forces: shoulder {forces[0]:.2f} N, elbow {forces[1]:.2f} N at most")
    motion = simulate_arm(ARM, *planned(0.0)[:2], TIME, torques=held_to_plan, rtol=1e-11)
    lifted = motion.kinetic[-1] + motion.potential[-1] - motion.kinetic[0] - motion.potential[0]
    print(f"followed by simulation to {np.abs(motion.q - planned(motion.t)[0]).max():.1e} rad")
    print(f"work of the torques {motion.work[-1]:.6f} J, energy gained {lifted:.6f} J")


def plot(motion: ArmMotion, path: str | Path) -> None:
    """The path of the tip in free fall, and the torques of the planned move."""
    from matplotlib.figure import Figure

    times = np.linspace(0, motion.t[-1], 2000)
    q, _ = motion.at(times)
    figure = Figure(figsize=(9, 4.5), layout="constrained")
    tip, torque = figure.subplots(1, 2)
    lengths = ARM.first.length, ARM.second.length
    x, y = (sum(bar * f(angle) for bar, f, angle in zip(lengths, (g, g), q, strict=True)) for g in (np.sin, np.cos))
    tip.plot(-x, y, color="#0072B2", linewidth=0.8)
    tip.set(xlabel="x of the tip, m", ylabel="y, m", aspect="equal", title="free fall")
    t = np.linspace(0, TIME, 201)
    for values, name, colour in zip(
        driving_torques(ARM, *planned(t)), ("shoulder", "elbow"), ("#D55E00", "#009E73"), strict=True
    ):
        torque.plot(t, values, color=colour, label=name)
    torque.set(xlabel="time, s", ylabel="torque, N m", title="planned move")
    torque.legend()
    figure.savefig(path, dpi=120)


def main(path: str | Path | None = None) -> None:
    """Print everything; draw into `path` if one is given."""
    show_equations()
    motion = fall()
    move()
    if path is not None:
        plot(motion, path)


if __name__ == "__main__":
    main(*sys.argv[1:2])
