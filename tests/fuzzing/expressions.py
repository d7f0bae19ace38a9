"""Expressions of a random grammar, hostile texts, and where in a scene they are put."""

import random
from collections.abc import Callable
from typing import Any

from tests.fuzzing.structure import at, places, put

_NAMES = ("phi", "phi", "phi", "x", "v", "omega", "t", "pi")
_CONSTANTS = ("0", "1", "2", "3", "0.5", "1e-9", "1e3", "1e9", "1e-300", "1e300", "7", "100", "1e-3", "-1", "0.1")
_CALLS = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "abs", "sign")
_SHAPES = (
    *("{0} + {1}", "{0} - {1}", "{0}*{1}", "{0}/{1}", "({0})**{2}", "-({0})", "({0} < {1})", "({0} >= {1})", "({0} == {1})"),
    *("({0} if {1} > {3} else {3})", "min({0}, {1})", "max({0}, {1}, {3})", "atan2({0}, {1})", "({0})*({1})", "({0})/({1})"),
    *("({0} < {1} < {3})", "(not {0})", "({0} and {1})", "({0} or {1})", "({0})**({1})", "{0} - ({1}) + {3}"),
)
_EXPONENTS = ("2", "3", "0.5", "-1", "-2", "8", "64", "-64", "1.5", "1e-9", "0", "63.5", "0.1")

HOSTILE = (
    *("__import__('os').system('touch canary')", "().__class__", "phi.__class__", "phi.real", "(lambda: 1)()"),
    *("[phi for x in y]", "(y := phi)", "f'{phi}'", "import os", "exec('1')", "eval('1')", "open('canary','w')"),
    *("print(phi)", "phi[0]", "{phi}", "globals()", "phi if x", "yield phi", "await phi", "*phi", "**phi", "phi;phi"),
    *("phi = 1", "sin", "sin()", "sin(phi, x)", "sin(*phi)", "sin(x=phi)", "min(phi)", "atan2(phi)", "rhi", "рhi", "ｐｈｉ"),
    *("phі", "sіn(phi)", "phi²", "√phi", "π", "φ", "phi**phi**phi", "9**9**9**9", "phi**64**64", "((phi**64)**64)**64"),
    *("2**-1e308", "1e308*1e308", "1e400", "0/0", "1/0", "-" * 500 + "phi", "not " * 100 + "phi"),
    *("(" * 59 + "phi" + ")" * 59, "(" * 5000 + "phi", "sin(" * 58 + "phi" + ")" * 58, "+".join(["phi"] * 10000)),
    *("+".join(["phi"] * 200), "<".join(["phi"] * 200), "phi<" * 400 + "1", "*".join(["phi"] * 249), "sin(1e6*phi)"),
    *("sin(1e4*phi)", "sin(1e3*phi)", "cos(300*phi)", "sin(1e300*phi)", "abs(sin(1000*phi))", "tan(50*phi)"),
    *("sign(sin(500*phi))", "(sin(2000*phi) > 0)", "max(sin(300*phi), cos(301*phi))", "sqrt(abs(sin(100*phi)))"),
    *("sin(exp(phi*3))", "1/sin(phi)", "1/(phi - 1)", "1/(1 + 1e12*(phi - 1)**2)", "1/(1e-300 + (phi-1)**2)", "tan(phi)"),
    *("tan(phi/4)", "log(phi)", "sqrt(-1)", "sqrt(sin(phi))", "sqrt(phi - 3)", "log(sin(phi))", "asin(2*sin(phi))"),
    *("acos(phi)", "(phi - 3)**0.5", "(phi - 3)**-1", "abs(phi - 3)**-0.5", "exp(exp(exp(phi)))", "exp(1000*phi)"),
    *("exp(-1e9*(phi - 2)**2)", "exp(-1/phi**2)", "sin(1/phi)", "sin(1/(phi - 1))", "phi*sin(1/(phi - 1))"),
    *("abs(abs(abs(sin(7*phi)) - 0.5) - 0.25)", "min(phi, 1e-300)", "atan(1e12*(phi - 2))", "atan2(sin(phi), cos(phi))"),
    *("atan2(0, 0)", "atan2(0*phi, 0*phi)", "sign(phi)*0", "(phi == phi)", "sin(omega*1e9)", "v**3", "1/v", "1/omega"),
    *("exp(v)", "sign(v)", "sin(t*1e9)", "t", "omega**64", "x**64", "1e300*x", "1/x", "sqrt(v)", "log(omega)"),
    *("sign(omega - 10)", "(omega > 10)*100", "1e6*(omega - 1)**3", "-1e12*v", "v if v > 0 else 1e9*v", "0", "0*phi"),
    *("-0.0", "1e-320", "1e308", "-1e308*phi", "1e160*sin(phi)", "1e-160*sin(phi)", "sin(phi)+1e-17", " phi ", "\tphi"),
    *("phi" * 700, "a" * 1999, "phi\n", "phi\0", "", " ", "nan", "inf", "None", "True", "1j", "1_000", "0x10", "'a'"),
    *("...", "1e"),
)


def formula(rng: random.Random, depth: int = 4) -> str:
    """A text of the grammar; one in three hundred characters or so is well-behaved."""
    if depth == 0 or rng.random() < 0.15:
        return rng.choice(_NAMES if rng.random() < 0.6 else _CONSTANTS)
    if rng.random() < 0.35:
        return f"{rng.choice(_CALLS)}({formula(rng, depth - 1)})"
    inner = [formula(rng, depth - 1) for _ in range(3)]
    return rng.choice(_SHAPES).format(inner[0], inner[1], rng.choice(_EXPONENTS), inner[2])


def tame(rng: random.Random) -> str:
    """A formula of phi that is mostly finite: what a designer might write."""
    k, a, b = rng.choice((1, 2, 3, 7, 24)), rng.choice((0.1, 1, 100, 1e4)), rng.uniform(0, 6)
    shapes = (
        *(f"{a}*sin({k}*phi)", f"{a}*cos({k}*phi - {b:.3f})**{k}", f"{a}*max(sin({k}*phi), 0)", f"{a}*(phi > {b:.3f})"),
        *(f"{a}*exp(-(({k}*phi - {b:.3f})/{1 / a})**2)", f"{a}/(1.01 + sin({k}*phi))", f"{a}*abs(sin({k}*phi))**0.5"),
        *(f"-{a}*x", f"-{a}*v", f"-{a}*sign(v)", f"{a}*(v > 0)*x", f"-{a}*v*abs(v)", f"{a} - {b}*omega"),
        *(f"-{a}*tan(phi/{4 * k})",),
    )
    return " + ".join(rng.choice(shapes) for _ in range(rng.choice((1, 1, 2, 4))))


def mangled(rng: random.Random, text: str) -> str:
    """A text with a few characters changed."""
    some = list(text)
    for _ in range(rng.choice((1, 2, 4))):
        spot = rng.randrange(len(some) + 1)
        some[spot : spot + rng.choice((0, 1, 2))] = rng.choice("()*/+-<>=,. 0e^xvphi_[]'\"é²\\")
    return "".join(some)


def any_expression(rng: random.Random) -> str:
    """A hostile text, a random formula, one with faults, or a tame one."""
    ways: tuple[Callable[[], str], ...] = (
        *(lambda: rng.choice(HOSTILE), lambda: formula(rng, rng.choice((1, 2, 3, 4, 6))), lambda: tame(rng)),
        *(lambda: mangled(rng, tame(rng)), lambda: f"{rng.choice(HOSTILE)} + {formula(rng, 2)}"),
        *(lambda: f"1e3*({formula(rng, 3)})",),
    )
    return rng.choice(ways)()


def expressions(rng: random.Random, tree: dict[str, Any]) -> None:
    """An expression put where a scene has a force, torque, position, or into a load that is added."""
    keys = ("force", "torque", "while", "x", "theta")
    found = [path for path in places(tree) if path[-1] in keys and isinstance(at(tree, path), (str, int, float))]
    found = [path for path in found if at(tree, path) != "balance"]
    text = any_expression(rng)
    if found and rng.random() < 0.75:
        put(tree, rng.choice(found), text)
    else:
        loads = tree.setdefault("load", [])
        load = {"on": "crank", "torque": text}
        if rng.random() < 0.3:
            load |= {"from": "30 deg", "to": "200 deg"}
        if isinstance(loads, list):
            loads.append(load)
    if rng.random() < 0.5 and "motor" not in str(tree.get("drive")):
        tree["drive"] = {"torque": "balance"}
