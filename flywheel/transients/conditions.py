"""How long a machine is to be followed: a time, a way, a speed, a share of its regime, its regime, or its stop."""

from __future__ import annotations

import re
from typing import Literal, NamedTuple

from flywheel.advice import show
from flywheel.faults import Fault, SceneError
from flywheel.scene import TURN
from flywheel.units import QuantityError, parse_quantity

Kind = Literal["time", "way", "speed", "share", "regime", "stop"]
_DIMENSIONS: tuple[tuple[Kind, str], ...] = (("time", "time"), ("way", "angle"), ("speed", "speed"), ("speed", "velocity"))
_TURNS = re.compile(r"\s*([-+.\deE]+)\s*turns?\s*")
_SHARE = re.compile(r"\s*([-+.\deE]+)\s*%\s*")
_EXPECTED = '"regime", "stop", or a time, a number of turns, a speed or a share of the regime\'s, such as "5 s" or "95 %"'


class Until(NamedTuple):
    """The end of a motion: time (s), way (rad), speed (rad/s; m/s where a driver slides), share of the regime's speed."""

    kind: Kind
    value: float = 0.0


def until(text: str) -> Until:
    """What a text says of the end of a motion; a SceneError where it says nothing that is known.

    >>> until("5 s"), until("2 turns").kind, until("95 %"), until("regime").kind
    (Until(kind='time', value=5.0), 'way', Until(kind='share', value=0.95), 'regime')
    """
    word = text.strip()
    if word == "regime":
        return Until("regime")
    if word == "stop":
        return Until("stop")
    found = _counted(text) or _measured(text)
    if found is None or not 0.0 < found.value < float("inf"):
        raise SceneError([Fault("until", show(text), _EXPECTED)])
    return found


def _counted(text: str) -> Until | None:
    """Turns, and shares of the regime's speed."""
    for pattern in (_TURNS, _SHARE):
        if match := pattern.fullmatch(text):
            try:
                number = float(match[1])
            except ValueError:
                return None
            return Until("way", number * TURN) if pattern is _TURNS else Until("share", number / 100)
    return None


def _measured(text: str) -> Until | None:
    for kind, dimension in _DIMENSIONS:
        try:
            if not _bare(text):
                return Until(kind, parse_quantity(text, dimension))
        except QuantityError:
            continue
    return None


def _bare(text: str) -> bool:
    """Whether a text is a number without a unit, which could be anything."""
    try:
        float(text)
    except ValueError:
        return False
    return True
