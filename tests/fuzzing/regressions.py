"""Scenes that once led to a traceback, a warning, a hang or a fault too long, by content: here and in the folder `kept`."""

import re
from pathlib import Path

_ROTOR = """
[[inertia]]
on = "crank"
value = 2
[drive]
torque = "balance"
[regime]
speed = "130 rpm"
[flywheel]
irregularity = "5 %"
"""
_MOTOR = """
[drive]
motor = {type = "dc", voltage = "220 V", power = "1.5 kW", speed = "1000 rpm", efficiency = "82 %"}
[flywheel]
irregularity = "2 %"
"""
_CYLINDER = """
[mechanism]
type = "linkage"
driver = "slide"
bodies = {frame = {points = {O = [0, 0]}}, ram = {mass = 2}}
joints = [{name = "slide", type = "slide", between = ["frame.O", "ram.origin"]}]
[stroke]
from = 0.4
to = 0.6
speed = "50 mm/s"
"""


def _loads(*laws: str) -> str:
    return "".join(f'[[load]]\non = "crank"\ntorque = "{law}"\n' for law in laws)


SCENES = {
    "a sine of speed": _ROTOR + _loads("sin(omega*1e9)", "-60*sin(phi)"),
    "a load that varies little": _MOTOR + _loads("1*cos(2*phi - 2.273)**2 - tan(phi/8) - tan(phi/8)"),
    "a thousand jumps and a motor": _MOTOR + _loads("sign(sin(500*phi))"),
    "enormous beside ordinary": _ROTOR + _loads("1e300", "-100*abs(sin(1.5*phi))"),
    "squares out of range": _ROTOR + _loads("1e160*sin(phi)"),
    "enormous quantity": _ROTOR + '[[load]]\non = "crank"\ntorque = "1000000000000000000 N m"\n' + _loads("-9e3*sin(phi)"),
    "an exponent that jumps": _ROTOR + _loads("max(2*sin(phi), abs(omega**(phi < 1)))"),
    "an exponent that varies": _ROTOR + _loads("min(tan(1.0*(phi > 1000)) - max(abs(omega**phi), 100), 3)**-2"),
    "a long text, infinite": _ROTOR + _loads("+".join(["phi"] * 200) + " + 1/phi"),
    "a driving force out of range": _CYLINDER + '[[load]]\non = "slide"\nforce = "-1e308*x*100 + (0 - pi)**(-v)"\n',
    "line separators": _ROTOR.replace("130 rpm", "130 " + "\u2028" * 100),
    "a number of a million digits": _ROTOR + '[[load]]\non = "crank"\ntable = {file = "digits.csv"}\n',
    "names of columns in UTF-16": _ROTOR + '[[load]]\non = "crank"\ntable = {file = "wide.csv", column = "torque"}\n',
}
SCENES |= {file.stem: file.read_text() for file in sorted((Path(__file__).parent / "kept").glob("*.toml"))}

FILES = {
    "wide.csv": "angle,torque\n0,1\n6.283185307179586,1\n".encode("utf-16-be"),
    "digits.csv": b"0," + b"1" * 10**5 + b"\n6.283185307179586,1\n",
}

REFUSED = {
    "a sine of speed": "flywheel.irregularity: found no periodic motion near",
    "enormous beside ordinary": "load[0].torque: found a value that comes to",
    "squares out of range": "load[0].torque: found a value that comes to",
    "a long text, infinite": "load[0].torque: found a value that is not finite at crank angle 0 deg (1/phi: a division",
    "a driving force out of range": "load[0].force: found a value that is not finite at slide position 0.5 m and 0.05 m/s",
    "line separators": 'regime.speed: found "130 \\u2028',
    "a number of a million digits": 'load[0].table.value: found "1111',
    "names of columns in UTF-16": 'load[0].table.file: found "wide.csv", a text in UTF-16',
    "end_of_the_range": "load[0].force: found a value that comes to",
    "law_out_of_range": "mechanism.outputs.table.theta: found a second derivative that is not finite",
    "layered_mesh": "regime: found a steady motion that is not found in bearable time",
    "many_assemblies": "mechanism: found guesses that do not tell the assemblies apart",
    "nearly_standing_still": "flywheel.inertia: found I* + J = 0 kg m² at crank angle ",
    "sense_of_a_dwell": "load[0]: found linkage.ram, whose velocity changes sign too often",
    "sine_of_speed_on_a_linkage": "flywheel.irregularity: found no periodic motion near",
    "steep_torque_of_speed": "flywheel.irregularity: found a machine that stalls at crank angle",
    "switch_that_chases_its_cells": "load: found laws that switch",
    "ten_thousand_waves_and_a_motor": "load[2].torque: found sin(1e4*phi): varies too fast for 10000 cells",
    "wave_too_fast_to_follow": "load[0].torque: found sin(exp(phi*3)): varies too fast for 10000 cells",
}
"""How the first fault of those that are refused begins; all others are sized."""
NOT_REACHED = ("balance_to_the_last_digit",)
BY_CHANCE = ("next_to_no_load",)
"""Sized: whether as well as asked, the last digit of a speed decides."""
DEAR = (
    *("enormous quantity", "layered_mesh", "sine_of_speed_on_a_linkage", "a thousand jumps and a motor"),
    *("steep_torque_of_speed", "law_out_of_range"),
)
"""Seconds each: not in the default run."""
BY_HAND = ("a sine of speed", "a load that varies little")
"""The dearest, each like another one: `python -m tests.fuzzing --kept` tries them with all others."""


def as_expected(name: str, outcome: str, detail: str) -> bool:
    """Whether a scene came to what it has come to since it was mended."""
    if name in REFUSED:
        return outcome == "refused" and re.sub(r" \([^()]*line \d+\)", "", detail, count=1).startswith(REFUSED[name])
    if name in BY_CHANCE:
        return outcome == "sized" and detail in ("", "not reached")
    return (outcome, detail) == ("sized", "not reached" if name in NOT_REACHED else "")
