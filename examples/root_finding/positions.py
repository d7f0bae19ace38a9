"""Positions with one unknown: bisection, regula falsi and Newton-Raphson on the toggle clamp's first loop, counted.

The loop a2 + a3 = a1 + a4 has two unknown angles. Without theta3 it leaves one: the end of a2 must stand a3 away from
P = (-a4, a1),

    f(theta2) = P² + a2² - a3² - 2 a2 (P_x cos theta2 + P_y sin theta2) = 0

f is least towards P (direction beta) and greatest away from it, so that [beta, beta + pi] and [beta - pi, beta] hold one
root each: the two assemblies. Every method stops as the clamp's author does, at |x_new - x_old| <= 1e-8; the last columns
show what that means for the true error.

    python examples/root_finding/positions.py
"""

from collections.abc import Callable
from itertools import pairwise
from math import atan2, cos, hypot, pi, sin
from typing import NamedTuple

A1, A2, A3 = 140.0, 167.63, 95.0  # mm
INPUTS = (-60.0, -10.0, 40.0, 90.0, 140.0, 190.0)  # a4, mm
TOLERANCE = 1e-8  # rad
MOST = 1000

Function = Callable[[float], float]


class Found(NamedTuple):
    """A root (rad) and every estimate on the way to it."""

    root: float
    path: list[float]

    @property
    def count(self) -> int:
        """Iterations."""
        return len(self.path)


def bisection(f: Function, low: float, high: float, tolerance: float = TOLERANCE) -> Found:
    """Halve the bracket until it moves no more than the tolerance; the error is at most the last half."""

    def estimate(low: float, high: float) -> float:
        return 0.5 * (low + high)

    return _bracketed(estimate, f, low, high, tolerance)


def regula_falsi(f: Function, low: float, high: float, tolerance: float = TOLERANCE) -> Found:
    """Cut the bracket where the chord crosses zero; where f bends one way, one end never moves."""

    def estimate(low: float, high: float) -> float:
        return low - f(low) * (high - low) / (f(high) - f(low))

    return _bracketed(estimate, f, low, high, tolerance)


def newton(f: Function, slope: Function, start: float, tolerance: float = TOLERANCE) -> Found:
    """Follow the tangent; one start, no bracket, and no promise which root."""
    x, path = start, []
    while len(path) < MOST:
        if slope(x) == 0.0:
            raise ArithmeticError(f"the tangent is level at {x:.6g} rad")
        before, x = x, x - f(x) / slope(x)
        path.append(x)
        if abs(x - before) <= tolerance:
            return Found(x, path)
    raise ArithmeticError(f"no root within {MOST} steps from {start:.6g} rad")


def _bracketed(estimate: Callable[[float, float], float], f: Function, low: float, high: float, tolerance: float) -> Found:
    if not f(low) * f(high) < 0.0:
        raise ValueError(f"f has one sign at {low:.6g} and {high:.6g} rad: no bracket")
    path: list[float] = []
    while len(path) < MOST:
        x = estimate(low, high)
        path.append(x)
        if f(x) == 0.0 or (len(path) > 1 and abs(x - path[-2]) <= tolerance):
            return Found(x, path)
        low, high = (low, x) if f(low) * f(x) < 0.0 else (x, high)
    raise ArithmeticError(f"no root within {MOST} steps")


def loop(a4: float) -> tuple[Function, Function, float]:
    """The loop's f (mm²), its slope, and the direction of P (rad), for a position of the driver (mm)."""
    x, y = -a4, A1
    constant = x**2 + y**2 + A2**2 - A3**2

    def f(theta: float) -> float:
        return constant - 2 * A2 * (x * cos(theta) + y * sin(theta))

    def slope(theta: float) -> float:
        return 2 * A2 * (x * sin(theta) - y * cos(theta))

    return f, slope, atan2(y, x)


def third(a4: float, theta2: float) -> float:
    """theta3 (rad) that goes with theta2."""
    return atan2(A1 - A2 * sin(theta2), -a4 - A2 * cos(theta2))


def exact(a4: float, side: int = 1) -> float:
    """The root in closed form: beta ± the triangle's angle at the pivot, by its half-tangent (Heron)."""
    d = hypot(a4, A1)
    s = (A2 + A3 + d) / 2
    return atan2(A1, -a4) + side * 2 * atan2(((s - A2) * (s - d)) ** 0.5, (s * (s - A3)) ** 0.5)


def compare(a4: float) -> tuple[Found, Found, Found]:
    """The clamp's own root by bisection, regula falsi and Newton-Raphson."""
    f, slope, beta = loop(a4)
    return bisection(f, beta, beta + pi), regula_falsi(f, beta, beta + pi), newton(f, slope, beta + pi / 2)


def tabulate(inputs: tuple[float, ...]) -> None:
    """Iterations and true errors of the three methods."""
    print("   a4, mm  theta2, rad  theta3, rad      iterations of         error, rad, of")
    print("                                     bisect regula Newton    bisect   regula   Newton")
    for a4 in inputs:
        found = compare(a4)
        root = found[-1].root
        counts = " ".join(f"{one.count:6d}" for one in found)
        errors = " ".join(f"{abs(one.root - exact(a4)):8.1e}" for one in found)
        print(f"{a4:9.1f} {root:12.8f} {third(a4, root):12.8f}  {counts}  {errors}")


def squares(path: list[float], root: float) -> list[tuple[float, float]]:
    """Error of every estimate, and its ratio to the square of the error before; only where rounding leaves a say."""
    errors = [abs(x - root) for x in path]
    return [(after, after / before**2) for before, after in pairwise(errors) if after > 1e-13]


def show_convergence(a4: float) -> None:
    """Newton's errors: each the last one squared, times |f''/(2 f')| at the root."""
    f, slope, beta = loop(a4)
    root, h = exact(a4), 1e-5
    limit = abs((slope(root + h) - slope(root - h)) / (2 * h) / (2 * slope(root)))
    print(f"\nNewton at a4 = {a4:g} mm from beta + 2 rad: error, error/(error before)^2 -> {limit:.4f}")
    for error, ratio in squares(newton(f, slope, beta + 2.0).path, root):
        print(f"{error:12.3e} {ratio:10.4f}")


def show_assemblies(a4: float) -> None:
    """The author's own guess, theta2 = 30 deg, leads to the assembly that is not the clamp's."""
    f, slope, beta = loop(a4)
    guess = newton(f, slope, pi / 6).root % (2 * pi)
    print(f"\na4 = {a4:g} mm: the clamp's theta2 = {exact(a4):.6f} rad, the other assembly's {exact(a4, -1):.6f} rad")
    print(f"Newton from the printed guess of 30 deg: {guess:.6f} rad, below beta = {beta:.6f}: the other one")


def show_dead_centre() -> None:
    """Stretched, a2 and a3 lie in line: a double root, no bracket, and Newton only halves its error."""
    a4 = (((A2 + A3) - A1) * ((A2 + A3) + A1)) ** 0.5
    f, slope, beta = loop(a4)
    path = newton(f, slope, beta + 0.5, tolerance=1e-4).path
    ratio = (path[-1] - beta) / (path[-2] - beta)
    print(f"\nstretched at a4 = {a4:.4f} mm, beyond the stroke: a double root")
    print(f"Newton: each error {ratio:.4f} of the last, {len(path)} iterations to 1e-4 rad")
    try:
        bisection(f, beta + 0.1, beta + pi)
    except ValueError as refusal:
        print(f"bisection: {refusal}")
    print("just before, regula falsi stops while its error is still above the tolerance:")
    tabulate((a4 - 0.2,))


def main() -> None:
    """Print all of it."""
    tabulate(INPUTS)
    show_convergence(190.0)
    for a4 in (INPUTS[0], INPUTS[-1]):
        show_assemblies(a4)
    show_dead_centre()


if __name__ == "__main__":
    main()
