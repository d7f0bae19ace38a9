"""Commented scenes to start from: one per type of mechanism, a mechanism alone, and some whole machines."""

from __future__ import annotations

from pathlib import Path

from flywheel.mechanisms import KINDS

__all__ = ["kinds", "starter", "write_starter"]

_MACHINES = (
    *("mechanism", "rotor", "areas", "press", "motor-press", "press-drive", "single-stroke"),
    *("shaper", "pump", "compressor", "engine"),
)
_LOADED, _REST, _IDLING = (
    ('name = "load"', 'duration = "4 min"'),
    ('name = "rest"', 'duration = "6 min"', "rest = true  # the motor is off; it cools by a third, as its fan stands still"),
    ('name = "idling"', 'duration = "6 min"', "loads = 0"),
)
_BRAKED = "starts = 1", 'braking = "direct-current"  # heats about as one start more; "reversal" as three'
_S7 = ('name = "load"', 'duration = "10 min"', *_BRAKED)
DUTIES: dict[str, tuple[tuple[str, ...], ...]] = {
    "s1": (('name = "load"', 'duration = "1 h"'),),
    "s2": (('name = "load"', 'duration = "30 min"'), ('name = "rest"', 'duration = "8 h"', _REST[2])),
    "s3": (_LOADED, _REST),
    "s4": ((*_LOADED, "starts = 1"), _REST),
    "s5": ((*_LOADED, *_BRAKED), _REST),
    "s6": (_LOADED, _IDLING),
    "s7": (_S7,),
    "s8": tuple(
        (f'name = "{name}"', f'duration = "{time}"', f'changes = {{drive.motor.inverter.frequency = "{frequency}"}}')
        for name, time, frequency in (("slow", "5 min", "30 Hz"), ("fast", "3 min", "60 Hz"))
    ),
}
"""The phases of each duty type of IEC 60034-1 (clause 4.2), as lines of their `[[duty]]`."""


def kinds() -> list[str]:
    """Names of the starters.

    >>> kinds()[-10:-6]
    ['compressor', 'engine', 'duty-s1', 'duty-s2']
    """
    mechanisms = (kind for kind in KINDS if _file(kind).exists() or KINDS[kind].starter)
    return [*mechanisms, *_MACHINES, *(f"duty-{duty}" for duty in DUTIES)]


def _file(kind: str) -> Path:
    return Path(__file__).parent / f"{kind}.toml"


def starter(kind: str) -> str:
    """The text of a starter scene, which can be sized as it is; one on a stroke and a mechanism alone can be moved.

    Raises KeyError for a kind that does not exist.

    >>> starter("press").splitlines()[-1]
    'irregularity = "15 %"                # presses live on their flywheel: 10 to 20 % is usual'
    """
    if kind not in kinds():
        raise KeyError(kind)
    if kind.startswith("duty-"):
        # the speed of S8 is that of its inverter
        duty = kind.removeprefix("duty-")
        text = _file("duty").read_text(encoding="utf-8").replace("S1", duty.upper())
        if duty == "s8":
            text = text.replace("\n\n# The whole motor", '\ninverter = {frequency = "50 Hz"}\n\n# The whole motor')
        return text + "\n\n".join("\n".join(("[[duty]]", *lines)) for lines in DUTIES[duty]) + "\n"
    file = _file(kind)
    return file.read_text(encoding="utf-8") if file.exists() else KINDS[kind].starter


def write_starter(kind: str, path: str | Path) -> None:
    """Writes a starter scene into a new file. Raises FileExistsError if the file exists."""
    text = starter(kind)
    path = Path(path)
    with path.open("x", encoding="utf-8") as file:
        try:
            file.write(text)
            file.flush()
        except OSError:  # a full disk: no half of a scene is left
            path.unlink()
            raise
