"""Pictures: of a sizing, of mechanisms still and moving, of the forces in joints.

Only these modules import matplotlib. A picture has two forms: "screen" in colours, and "print", which tells everything by
dashes, hatches and greys.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

FORMS = ("screen", "print")

_current: ContextVar[str] = ContextVar("form", default="screen")


@contextmanager
def form(name: str) -> Iterator[None]:
    """Pictures in this form while the block runs, in this thread alone; ValueError for another one than of `FORMS`."""
    if name not in FORMS:
        raise ValueError(f"found the form {name!r}, expected one of {', '.join(FORMS)}")
    token = _current.set(name)
    try:
        yield
    finally:
        _current.reset(token)


def current_form() -> str:
    """The form in use, "screen" unless a block says otherwise."""
    return _current.get()
