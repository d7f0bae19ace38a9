"""The language of what people read: English as it stands in the code, other languages from catalogues of gettext's format.

A folder for each language holds one catalogue for each subject, `es/report.po`: the English text and its translation. A
text is marked where it stands, `_("Exact flywheel")`, with `_` this module's `text`; scripts of the page mark theirs alike.

>>> with use("es"):
...     text("Exact flywheel"), number("3.14")
('Volante exacto', '3,14')
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from importlib.resources import files
from types import MappingProxyType

LANGUAGES: Mapping[str, str] = MappingProxyType({"en": "English", "es": "Español"})
"""The languages that there are, each by its own name."""

_current: ContextVar[str] = ContextVar("language", default="en")
_ENTRY = re.compile(r'^msgid ((?:"(?:[^"\\]|\\.)*"\s*)+)^msgstr ((?:"(?:[^"\\]|\\.)*"\s*)+)', re.MULTILINE)
_PIECE = re.compile(r'"(?:[^"\\]|\\.)*"')
_DECIMAL_POINT = re.compile(r"(?<=\d)\.(?=\d)")


@contextmanager
def use(language: str) -> Iterator[None]:
    """Texts and numbers in this language while the block runs, in this thread alone; ValueError for another one."""
    if language not in LANGUAGES:
        raise ValueError(f"found the language {language!r}, expected one of {', '.join(LANGUAGES)}")
    token = _current.set(language)
    try:
        yield
    finally:
        _current.reset(token)


def current() -> str:
    """The language in use, "en" unless a block says otherwise."""
    return _current.get()


def text(message: str, **values: object) -> str:
    """The message in the language in use, English where it has no translation, with values put in: `{name}`."""
    told = catalogue(_current.get()).get(message, message)
    return told.format(**values) if values else told


def number(written: str) -> str:
    """A number as written in English, with the decimal mark of the language in use: 0.5 is 0,5 in Spanish."""
    return _DECIMAL_POINT.sub(",", written) if _current.get() == "es" else written


@cache
def catalogue(language: str) -> Mapping[str, str]:
    """Every text of a language by its English, of all its catalogues; nothing for English itself."""
    if language == "en":
        return MappingProxyType({})
    found: dict[str, str] = {}
    for entry in files(__package__).joinpath(language).iterdir():
        if entry.name.endswith(".po"):
            found |= entries(entry.read_text("utf-8"))
    return MappingProxyType(found)


def entries(po: str) -> dict[str, str]:
    r"""The translations of a catalogue's text, without its head and without what is not translated yet.

    >>> entries('msgid "slider"\nmsgstr "corredera"\n')
    {'slider': 'corredera'}
    """

    def joined(pieces: str) -> str:
        return "".join(ast.literal_eval(piece) for piece in _PIECE.findall(pieces))

    pairs = ((joined(of), joined(to)) for of, to in _ENTRY.findall(po))
    return {message: told for message, told in pairs if message and told}
