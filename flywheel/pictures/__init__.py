"""Pictures: of a sizing, of mechanisms still and moving, of the forces in joints.

`diagrams`, `forms` and `sketch` give the contents as data; only the others import matplotlib. A picture
has two forms: "screen" in colours, and "print", which uses dashes, hatches and greys.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from flywheel import language
from flywheel.language import text as _
from flywheel.numerics.units import figure

__all__ = ["FORMS", "current_form", "form", "noun", "written"]

FORMS = ("screen", "print")

_current: ContextVar[str] = ContextVar("form", default="screen")


@contextmanager
def form(name: str) -> Iterator[None]:
    """Pictures in this form while the block runs, in this thread alone; ValueError for a form that is not in `FORMS`."""
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


_PLAIN = 1e8  # below it numbers are written without a power of ten


def written(value: float, most: int = 5, error: float = 0.0) -> str:
    """A number with a true minus sign and the decimal mark of the language in use."""
    digits = figure(value, error, most)
    if "e+" in digits and abs(value) < _PLAIN:
        digits = f"{float(digits):.0f}"
    return language.number(digits.replace("-", "−"))


def noun(name: str) -> str:
    """Returns the name of an inertia in a legend, bodies by their names in the scene: `press.rod` is "rod (press)"."""
    if name.startswith("inertia on "):
        return _("inertia on {shaft}", shaft=name[11:])
    if name.endswith(" others"):
        return _("{number} others", number=name[:-7])
    mechanism, _dot, body = name.rpartition(".")
    return f"{body} ({mechanism})" if mechanism else name
