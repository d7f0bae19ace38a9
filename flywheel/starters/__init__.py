"""Commented scenes to start from: one per type of mechanism, a mechanism alone, and some whole machines."""

from __future__ import annotations

from pathlib import Path

from flywheel.mechanisms import KINDS

__all__ = ["kinds", "starter", "write_starter"]

_MACHINES = (
    *("mechanism", "rotor", "areas", "press", "motor-press", "press-drive", "single-stroke"),
    *("shaper", "pump", "compressor", "engine"),
)


def kinds() -> list[str]:
    """Names of the starters.

    >>> kinds()[-4:]
    ['shaper', 'pump', 'compressor', 'engine']
    """
    return [*(kind for kind in KINDS if _file(kind).exists() or KINDS[kind].starter), *_MACHINES]


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
    file = _file(kind)
    return file.read_text(encoding="utf-8") if file.exists() else KINDS[kind].starter


def write_starter(kind: str, path: str | Path) -> None:
    """Writes a starter scene into a new file. Raises FileExistsError rather than touch a file that is there."""
    text = starter(kind)
    path = Path(path)
    with path.open("x", encoding="utf-8") as file:
        try:
            file.write(text)
            file.flush()
        except OSError:  # a full disk: no half of a scene is left
            path.unlink()
            raise
