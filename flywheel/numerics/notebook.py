"""Display of the library's objects in notebooks: HTML from a part of the library that is imported on demand.

Scenes, machines and results do not import tables and curves; they look up the drawing function by its public name when
needed.
"""

from __future__ import annotations


def html(thing: object) -> str | None:
    """The HTML of a scene, machine or result; None if there is none or it cannot be made, so that the text is shown."""
    import flywheel

    try:
        markup: str | None = flywheel.notebooks.html(thing)
    except Exception:  # a notebook shows the object's text instead: to look at a result must never fail
        return None
    return markup


def quoted(title: str | None) -> str:
    """A title as the first part of a `repr`, shortened if necessary; empty without one."""
    if not title:
        return ""
    return f"{title if len(title) <= 48 else title[:47] + '…'!r}, "
