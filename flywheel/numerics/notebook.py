"""Display of the library's objects in notebooks: HTML written by a part of the library that is imported later.

Scenes, machines and results know nothing of tables and curves; they find the drawing function by its public name when
needed.
"""

from __future__ import annotations


def html(thing: object) -> str | None:
    """The HTML of a scene, machine or result; None, so that its text is shown, if there is none or it cannot be made."""
    import flywheel

    try:
        markup: str | None = flywheel.notebooks.html(thing)
    except Exception:  # a notebook shows the object's text instead: to look at a result must never fail
        return None
    return markup


def quoted(title: str | None) -> str:
    """A title as the first part of a `repr`, cut where it runs on; empty without one."""
    if not title:
        return ""
    return f"{title if len(title) <= 48 else title[:47] + '…'!r}, "
