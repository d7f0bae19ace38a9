"""The text of a sweep."""

from flywheel.tables.designs import sweep_text as text

__all__ = ["text"]
