"""The injection clamp joint by joint: reactions over the stroke, beside two other routes and the source's differences.

    python injection_clamp.py [figure.png]

The source finds the reactions of its five pins from Newton's and Euler's equations and sets them against a finite-element
program, at 25 to 27 positions of the block for each pin. Here the library's reactions stand at the same positions beside
those equations written down by hand (13 unknowns), and beside the multibody program Exudyn where it is installed
(`pip install exudyn`), which steps the motion in time and is told nothing but bodies, pins, guides and the block's speed.
With a file name, draws the reactions over the stroke (figure_together.png, figure_singly.png) and the differences
(figure_differences.png).

The source tells its means, 5.86, 8.36, 11.69, 17.65 and 3.11 %, and calls the fourth its greatest error; its rows give
17.66 and 3.12 for the last two, and its greatest error is 67 %. Two things are known to stand between its two programs: the
acceleration of the coupler's centre has the wrong sign, and the finite-element model has other masses than the equations.
What they cost is found here too: the masses as much as the source's differences in a0 and a4. Where a0 differs most, at
82 mm, its force passes by zero (16 N of 998). The greatest differences of a1, a2 and a3 stand at ordinary forces, and
neither cause explains them.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import acos, asin, atan2, hypot, pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import flywheel

Array = NDArray[np.float64]

SCENE = Path(__file__).parents[1] / "machines" / "injection_clamp.toml"
JOINTS = {"a0": "block_pin", "a1": "coupler_pin", "a2": "pivot", "a3": "rod_pin", "a4": "platen_pin"}
ON = {"a0": "block", "a1": "coupler", "a2": "bell_crank", "a3": "rod", "a4": "platen"}  # the body that the force acts on
START, END = -60.0, 190.0  # mm

# Differences of the source's two programs, block's position (mm): %
TOLD = {
    "a0": (
        "-53 8.13  -47 11.70  -41 8.64  -34 19.50  -26 3.01  -16 7.91  -7 0.88  3 3.32  13 3.62  23 3.71 "
        "33 3.62  43 3.38  53 3.04  63 2.66  72 18.30  82 35.17  92 5.87  102 2.65  112 1.74  122 1.50 "
        "131 1.81  141 2.73  151 1.43  161 0.24  171 0.21  182 1.71  190 1.61"
    ),
    "a1": (
        "-50 6.93  -43 0.46  -36 10.09  -29 13.10  -22 2.17  -14 4.15  -6 3.00  2 1.98  10 1.28  20 0.13 "
        "30 0.65  39 1.18  47 1.43  55 5.20  64 0.38  72 21.55  81 1.08  90 3.44  99 5.93  108 5.48 "
        "117 2.07  126 2.93  136 9.81  146 17.14  156 25.57  166 34.90  177 43.59"
    ),
    "a2": (
        "-48 1.43777529  -32 3.28618689  -18 5.55685329  -9 29.31311103  -2 2.89036068  5 6.99237466 "
        "14 9.63915929  23 1.63923436  33 1.92231762  43 0.83424087  53 1.52851247  63 1.52027021 "
        "72 1.35309962  82 1.58925711  92 1.51329233  102 1.16701402  112 0.52913479  122 0.51579024 "
        "130 10.3458808  141 28.5008959  151 0.93821118  161 46.1959214  172 55.0805077  182 66.9967151 "
        "190 11.0824087"
    ),
    "a3": (
        "-53 4.84563853  -47 1.59569381  -41 2.47344394  -34 1.86462777  -25 6.9771561  -17 7.80723047 "
        "-7 6.64953042  3 6.17306137  13 5.86995571  23 4.33940111  33 3.82647274  43 10.770429 "
        "53 17.9274313  63 24.7009641  72 34.9281354  82 41.8810166  92 48.7143828  102 62.5141428 "
        "112 61.2797921  122 42.5631454  130 16.4125794  141 1.37050011  151 3.45687917  161 7.7040874 "
        "172 5.73790543  182 2.37351265  190 42.0622692"
    ),
    "a4": (
        "-53 5.67917789  -47 0.29328919  -41 1.86322771  -34 1.14635922  -25 4.69888056  -17 0.65794271 "
        "-7 1.6277338  3 2.20006562  13 2.52500603  23 2.66604481  33 2.65569605  43 2.51476293 "
        "53 2.2540926  63 1.88039359  72 3.33677021  82 3.14243866  92 2.80781994  102 2.28556987 "
        "112 1.4898405  122 0.33735439  130 5.4651685  141 3.98231685  151 3.40548731  161 7.85401806 "
        "172 5.04406826  182 9.00966319  190 3.33106942"
    ),
}
MEANS = {"a0": 5.86, "a1": 8.36, "a2": 11.69, "a3": 17.65, "a4": 3.11}  # as it prints them, %


def told(joint: str) -> tuple[Array, Array]:
    """The source's positions (mm) and differences (%) for a joint."""
    rows = np.array(TOLD[joint].split(), dtype=float).reshape(-1, 2)
    return rows[:, 0], rows[:, 1]


@dataclass(frozen=True)
class Clamp:
    """Lengths (m), masses (kg) and inertias (kg m²) of the clamp, and the block's constant speed (m/s)."""

    height: float = 0.140
    drive: float = 0.16763
    coupler: float = 0.095
    arm: float = 0.220
    rod: float = 0.260
    alpha: float = 0.30199  # rad, between the bell crank's arms
    block_mass: float = 43.3018
    coupler_mass: float = 1.3051
    bell_mass: float = 16.1475
    rod_mass: float = 16.7364
    platen_mass: float = 395.9400
    coupler_inertia: float = 0.0022
    bell_inertia: float = 0.1195
    rod_inertia: float = 0.1699
    speed: float = 0.3289474
    gravity: float = 9.80665


class Place(NamedTuple):
    """The clamp at one position: pins as x + iy (m), rates and accelerations of angles, accelerations of centres (m/s²)."""

    block: complex
    drive_pin: complex
    rod_pin: complex
    platen: complex
    rates: tuple[float, float, float]  # coupler, bell crank, rod
    alphas: tuple[float, float, float]
    centres: tuple[complex, complex, complex, complex]  # coupler, bell crank, rod, platen


def place(clamp: Clamp, a4: float) -> Place:
    """Circles that meet, then both loops differentiated twice; a4 in m."""
    p, v = complex(-a4, clamp.height), complex(-clamp.speed, 0.0)
    d = hypot(p.real, p.imag)
    theta2 = atan2(p.imag, p.real) + acos((d**2 + clamp.drive**2 - clamp.coupler**2) / (2 * d * clamp.drive))
    b, c = clamp.drive * _turn(theta2), clamp.arm * _turn(theta2 + clamp.alpha + pi)
    link, rod = p - b, complex(clamp.rod * sqrt(1 - (c.imag / clamp.rod) ** 2), -c.imag)

    def solved(end: complex) -> tuple[float, float]:
        """x, y of i (x b + y link) = end."""
        return _cross(-1j * end, link) / _cross(b, link), _cross(-1j * end, b) / _cross(link, b)

    omega2, omega3 = solved(v)
    alpha2, alpha3 = solved(omega2**2 * b + omega3**2 * link)
    omega6 = -omega2 * c.real / rod.real
    alpha6 = (omega2**2 * c.imag + omega6**2 * rod.imag - alpha2 * c.real) / rod.real
    at_b, at_c = (1j * alpha2 - omega2**2) * b, (1j * alpha2 - omega2**2) * c
    along = (1j * alpha6 - omega6**2) * rod
    centres = (at_b + 0.5 * (1j * alpha3 - omega3**2) * link, 0.5 * at_c, at_c + 0.5 * along, at_c + along)
    return Place(p, b, c, c + rod, (omega3, omega2, omega6), (alpha3, alpha2, alpha6), centres)


def _turn(angle: float) -> complex:
    return complex(np.cos(angle), np.sin(angle))


def _cross(a: complex, b: complex) -> float:
    return (a.conjugate() * b).imag


def by_newton(clamp: Clamp, a4: Array, *, printed_centre: bool = False) -> dict[str, Array]:
    """Reactions (N, rows x and y) at the block's positions (mm), by 13 equations.

    The unknowns are the 10 components of the pins' forces, the two guides' normal forces and what drives the block.

    Args:
        clamp: its sizes.
        a4: positions, mm.
        printed_centre: take the acceleration of the coupler's centre as the source prints it, with the sign turned round.

    """
    found = np.array([_forces(clamp, place(clamp, 1e-3 * x), printed_centre) for x in a4])
    return {joint: found[:, 2 * k : 2 * k + 2].T for k, joint in enumerate(JOINTS)}


def _forces(clamp: Clamp, at: Place, printed_centre: bool) -> Array:
    """a0 x, y ... a4 x, y, the guides' normal forces, the driving force; each pin's force acts on the body of `ON`."""
    middle = (0.5 * (at.block + at.drive_pin), 0.5 * at.rod_pin, 0.5 * (at.rod_pin + at.platen))
    a_coupler, *others = at.centres
    moving = (-a_coupler if printed_centre else a_coupler, *others)
    left, right = np.zeros((13, 13)), np.zeros(13)

    def body(row: int, mass: float, acceleration: complex, pins: Mapping[int, tuple[float, complex]]) -> None:
        """Mass times acceleration = forces + weight, in x and y; `pins` has the sign with which a pin's force acts."""
        right[row : row + 2] = mass * acceleration.real, mass * (acceleration.imag + clamp.gravity)
        for pin, (sign, _) in pins.items():
            left[row, 2 * pin] = left[row + 1, 2 * pin + 1] = sign

    def turning(row: int, inertia: float, alpha: float, centre: complex, pins: Mapping[int, tuple[float, complex]]) -> None:
        """Inertia times alpha = sum of moments about the centre of mass."""
        right[row] = inertia * alpha
        for pin, (sign, end) in pins.items():
            left[row, 2 * pin : 2 * pin + 2] = -sign * (end - centre).imag, sign * (end - centre).real

    body(0, clamp.block_mass, 0j, {0: (1.0, at.block)})
    left[0, 12], left[1, 10] = 1.0, 1.0
    bodies = (
        (clamp.coupler_mass, clamp.coupler_inertia, {0: (-1.0, at.block), 1: (1.0, at.drive_pin)}),
        (clamp.bell_mass, clamp.bell_inertia, {1: (-1.0, at.drive_pin), 2: (1.0, 0j), 3: (-1.0, at.rod_pin)}),
        (clamp.rod_mass, clamp.rod_inertia, {3: (1.0, at.rod_pin), 4: (-1.0, at.platen)}),
    )
    for k, (mass, inertia, pins) in enumerate(bodies):
        body(2 + 3 * k, mass, moving[k], pins)
        turning(4 + 3 * k, inertia, at.alphas[k], middle[k], pins)
    body(11, clamp.platen_mass, moving[3], {4: (1.0, at.platen)})
    left[12, 11] = 1.0
    return np.linalg.solve(left, right)


def by_library(a4: Array) -> dict[str, Array]:
    """The same by `flywheel.joint_forces`, with the source's signs: each force acts on the body of `ON`."""
    scene = flywheel.load(SCENE)
    found = flywheel.joint_forces(scene, 1e-3 * a4).mechanisms["toggle-clamp"]
    joint = found.poses.linkage.joint
    return {
        letter: found.forces[name] * (1.0 if joint(name).second == ON[letter] else -1.0) for letter, name in JOINTS.items()
    }


def by_exudyn(clamp: Clamp, a4: Array, finer: int = 1) -> dict[str, Array] | None:
    """The same by Exudyn, stepped from -60 mm in steps of 0.1 mm or less; None where it is not installed.

    Forces are the multipliers of its revolute joints. Trapezoidal rule on the constraints' velocities, of order 2.
    """
    try:
        import exudyn as exu
        from exudyn import utilities as parts
    except ImportError:
        return None
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddObject(parts.ObjectGround())
    bodies, nodes = {"frame": ground}, {}
    for name, mass, inertia, (centre, angle), (velocity, rate) in _starts(clamp):
        nodes[name] = mbs.AddNode(
            parts.NodeRigidBody2D(
                referenceCoordinates=[centre.real, centre.imag, angle],
                initialVelocities=[velocity.real, velocity.imag, rate],
            )
        )
        bodies[name] = mbs.AddObject(parts.RigidBody2D(mass=mass, inertia=inertia, nodeNumber=nodes[name]))
        middle = mbs.AddMarker(parts.MarkerBodyPosition(bodyNumber=bodies[name], localPosition=[0.0, 0.0, 0.0]))
        mbs.AddLoad(parts.Force(markerNumber=middle, loadVector=[0.0, -mass * clamp.gravity, 0.0]))

    def marker(name: str, at: complex) -> Any:
        return mbs.AddMarker(parts.MarkerBodyPosition(bodyNumber=bodies[name], localPosition=[at.real, at.imag, 0.0]))

    half = (0.5 * clamp.coupler, 0.5 * clamp.arm, 0.5 * clamp.rod)
    drive_pin = clamp.drive * _turn(-clamp.alpha - pi) - half[1]
    pins = (
        (("coupler", half[0]), ("block", 0j)),
        (("bell_crank", drive_pin), ("coupler", -half[0])),
        (("frame", 0j), ("bell_crank", -half[1])),
        (("bell_crank", half[1]), ("rod", -half[2])),
        (("rod", half[2]), ("platen", 0j)),
    )
    joints = [
        mbs.AddObject(parts.RevoluteJoint2D(markerNumbers=[marker(*first), marker(*second)])) for first, second in pins
    ]
    still = mbs.AddMarker(parts.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(parts.NodePointGround()), coordinate=0))
    for name, coordinate in (("block", 1), ("block", 2), ("platen", 1), ("platen", 2), ("block", 0)):
        held = mbs.AddMarker(parts.MarkerNodeCoordinate(nodeNumber=nodes[name], coordinate=coordinate))
        driven = (
            {}
            if coordinate
            else {
                "offsetUserFunction": lambda mbs, t, number, offset: -clamp.speed * t,
                "offsetUserFunction_t": lambda mbs, t, number, offset: -clamp.speed,
            }
        )
        mbs.AddObject(parts.CoordinateConstraint(markerNumbers=[still, held], **driven))
    mbs.Assemble()
    multipliers: list[Array] = []

    def keep(mbs: Any, t: float) -> bool:
        multipliers.append(np.array(mbs.systemData.GetAECoordinates()))
        return True

    mbs.SetPostStepUserFunction(keep)
    per_mm = 10 * finer
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime = 1e-3 * (END - START) / clamp.speed
    settings.timeIntegration.numberOfSteps = round((END - START) * per_mm)
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.timeIntegration.newton.relativeTolerance = 1e-10
    if not mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2):
        raise RuntimeError("Exudyn does not get through the stroke")
    of = np.array(multipliers)[np.round((a4 - START) * per_mm).astype(int)].T
    return {letter: -of[list(mbs.systemData.GetObjectLTGAE(number))] for letter, number in zip(JOINTS, joints, strict=True)}


def _starts(clamp: Clamp) -> list[tuple[str, float, float, tuple[complex, float], tuple[complex, float]]]:
    """Bodies at the start: name, mass, inertia, (centre, angle), (its velocity, rate)."""
    at = place(clamp, 1e-3 * START)
    link, rod = at.block - at.drive_pin, at.platen - at.rod_pin
    omega3, omega2, omega6 = at.rates
    v, v_c = complex(-clamp.speed, 0.0), 1j * omega2 * at.rod_pin
    v_coupler, v_rod = 1j * omega2 * at.drive_pin + 0.5j * omega3 * link, v_c + 0.5j * omega6 * rod
    angle = float(np.angle(at.rod_pin))
    slow, fast = clamp.coupler_mass, clamp.bell_mass
    return [
        ("block", clamp.block_mass, 1.0, (at.block, 0.0), (v, 0.0)),
        (
            "coupler",
            slow,
            clamp.coupler_inertia,
            (0.5 * (at.block + at.drive_pin), float(np.angle(link))),
            (v_coupler, omega3),
        ),
        ("bell_crank", fast, clamp.bell_inertia, (0.5 * at.rod_pin, angle), (0.5 * v_c, omega2)),
        (
            "rod",
            clamp.rod_mass,
            clamp.rod_inertia,
            (0.5 * (at.rod_pin + at.platen), asin(rod.imag / clamp.rod)),
            (v_rod, omega6),
        ),
        ("platen", clamp.platen_mass, 1.0, (at.platen, 0.0), (v_c + 1j * omega6 * rod, 0.0)),
    ]


# -- tables and figures -------------------------------------------------------------------------------------------------


def apart(found: Array, other: Array) -> Array:
    """Differences of the forces' magnitudes, as the source takes them: % of the other's."""
    return 100.0 * np.abs(np.hypot(*found) / np.hypot(*other) - 1.0)


def compare() -> dict[str, dict[str, tuple[Array, Array]]]:
    """Positions (mm) and differences (%) of each comparison, by joint."""
    clamp = Clamp()
    weighed = replace(clamp, coupler_mass=1.4561, bell_mass=16.33, rod_mass=18.816, block_mass=33.293 + 8.7075)
    a4 = np.unique(np.concatenate([told(joint)[0] for joint in JOINTS]))
    ours, by_hand, stepped = by_library(a4), by_newton(clamp, a4), by_exudyn(clamp, a4)
    slipped, heavier = by_newton(clamp, a4, printed_centre=True), by_newton(weighed, a4)
    pairs = {ROUTES[0]: (ours, by_hand), CAUSES[0]: (slipped, by_hand), CAUSES[1]: (heavier, by_hand)}
    if stepped is not None:
        pairs[ROUTES[1]] = (ours, stepped)
    found = {"source": {joint: told(joint) for joint in JOINTS}}
    for name in (name for name in (*ROUTES, *CAUSES) if name in pairs):
        off = {joint: apart(pairs[name][0][joint], pairs[name][1][joint]) for joint in JOINTS}
        found[name] = {joint: (told(joint)[0], off[joint][np.searchsorted(a4, told(joint)[0])]) for joint in JOINTS}
    return found


ROUTES = ("by hand", "Exudyn")
CAUSES = ("its coupler", "its masses")


def summary(found: dict[str, dict[str, tuple[Array, Array]]]) -> None:
    """Means and greatest differences of every joint."""

    def short(value: float) -> str:
        return f"{value:.2f}" if value >= 0.005 or value == 0.0 else f"{value:.0e}"

    print("differences of the force in a joint over the stroke, %: mean, greatest (at the block's position, mm)")
    print("  joint  printed" + "".join(f"{name:>22s}" for name in found))
    for joint, printed in MEANS.items():
        line = f"  {joint}{printed:12.2f}"
        for by_joint in found.values():
            places, off = by_joint[joint]
            line += (
                f"{short(off.mean()):>8s}{short(off.max()):>8s} {f'({places[off.argmax()]:.0f})' if off.max() else '':>5s}"
            )
        print(line)
    print(
        "printed, source: its equations against its finite-element program, the means as printed and as its rows give them"
    )
    print("by hand, Exudyn: this library against them")
    print(
        "its coupler, its masses: the equations with the source's sign of the coupler's acceleration, or with the masses of"
    )
    print("its finite-element model as far as they are told (coupler, bell crank, rod, block), against the true ones")


def rows(found: dict[str, dict[str, tuple[Array, Array]]]) -> None:
    """Every position: the force, and the differences."""
    routes = [name for name in ROUTES if name in found]
    for joint, name in JOINTS.items():
        places, source = told(joint)
        force = np.hypot(*by_library(places)[joint])
        print(
            f"\n{joint}, {name}\n{'a4, mm':>8s}{'force, N':>12s}{'source, %':>11s}"
            + "".join(f"{r + ', %':>12s}" for r in routes)
        )
        for k, a4 in enumerate(places):
            line = f"{a4:8.0f}{force[k]:12.3f}{source[k]:11.2f}"
            print(line + "".join(f"{found[route][joint][1][k]:12.1e}" for route in routes))


COLOURS = dict(zip(JOINTS, ("#56B4E9", "#D55E00", "#009E73", "#CC79A7", "#000000"), strict=True))


def plot(path: Path, found: dict[str, dict[str, tuple[Array, Array]]]) -> None:
    """Fx of all joints together; of each alone, with Fy and the resultant; and the differences."""
    a4 = np.linspace(START, END, 501)
    forces = by_library(a4)
    figure, (panel,) = panels(1, (9.0, 5.0))
    for joint, force in forces.items():
        wide = {"a0": 5.0}.get(joint, 1.6)  # under a1, which is nearly the same: the coupler is light
        panel.plot(a4, force[0], color=COLOURS[joint], linewidth=wide, label=f"{joint} on the {ON[joint].replace('_', ' ')}")
    panel.set(title="Reactions along x against the block", ylabel="Fx, N")
    panel.legend(frameon=False)
    figure.savefig(path.with_stem(f"{path.stem}_together"), dpi=100)
    figure, axes = panels(len(JOINTS), (9.0, 13.0))
    for panel, (joint, force) in zip(axes, forces.items(), strict=True):
        panel.plot(a4, np.hypot(*force), color="#999999", linewidth=3.5, label="F")
        panel.plot(a4, force[0], color=COLOURS[joint], label="Fx")
        panel.plot(a4, force[1], color=COLOURS[joint], linestyle="--", label="Fy")
        panel.set(title=f"{joint}, {JOINTS[joint].replace('_', ' ')}: on the {ON[joint].replace('_', ' ')}", ylabel="N")
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    figure.savefig(path.with_stem(f"{path.stem}_singly"), dpi=100)
    figure, axes = panels(len(JOINTS), (9.0, 13.0))
    for panel, joint in zip(axes, JOINTS, strict=True):
        for name, (colour, marker) in STYLES.items():
            if name in found:
                places, off = found[name][joint]
                panel.semilogy(places, off.clip(1e-14), color=colour, marker=marker, markersize=4, linewidth=1.0, label=name)
        panel.set(title=f"{joint}, {JOINTS[joint].replace('_', ' ')}", ylabel="difference, %", ylim=(1e-14, 1e3))
    figure.suptitle("Differences of the force: the source's from its finite-element program, this library's from two others")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
    figure.savefig(path.with_stem(f"{path.stem}_differences"), dpi=100)


STYLES = {
    "source": ("#D55E00", "o"),
    CAUSES[1]: ("#E69F00", "v"),
    CAUSES[0]: ("#CC79A7", "^"),
    ROUTES[1]: ("#0072B2", "s"),
    ROUTES[0]: ("#000000", "."),
}


def panels(count: int, size: tuple[float, float]) -> tuple[Any, list[Any]]:
    """A figure of panels one below the other, against the block's position."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    axes = list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])
    for panel in axes:
        panel.set_xlim(START, END + 3.0)
        panel.grid(color="#DDDDDD", linewidth=0.6)
    axes[-1].set_xlabel("block, a4, mm")
    return figure, axes


def main(path: str | None = None) -> None:
    """Print the tables; draw the figures if a name is given."""
    found = compare()
    summary(found)
    if ROUTES[1] not in found:
        print("Exudyn is not installed: its column is left out (pip install exudyn)")
    rows(found)
    if path is not None:
        plot(Path(path), found)


if __name__ == "__main__":
    main(*sys.argv[1:2])
