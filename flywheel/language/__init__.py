"""The language of all texts for users: English as in the code, other languages from catalogues of gettext's format.

A folder for each language holds one catalogue for each subject, `es/report.po`: the English text and its translation. A
text is marked in the code, `_("Exact flywheel")`, with `_` this module's `text`; scripts of the live page do the same.
Faults, remarks and messages are composed in the code without marks: `message` recognises them by the templates of the
catalogue `faults.po`, `"{0} together with {1}"`.

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
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Any

__all__ = [
    "DECIMAL_MARKS", "LANGUAGES", "catalogue", "current", "entries", "message", "number", "text", "untranslated", "use",
]  # fmt: skip

LANGUAGES: Mapping[str, str] = MappingProxyType({"en": "English", "es": "Español"})
"""The available languages, each by its own name."""
DECIMAL_MARKS: Mapping[str, str] = MappingProxyType({"en": ".", "es": ","})

_JOINTS: Mapping[str, tuple[re.Pattern[str], Mapping[str, str]]] = MappingProxyType(
    {
        "es": (
            re.compile(r"\b(hay nada|hay ning|de el |a el |o o(?=\w))"),
            {"hay nada": "no hay nada", "hay ning": "no hay ning", "de el ": "del ", "a el ": "al ", "o o": "u o"},
        )
    }
)
"""Places where an inserted text changes the words before it: pairs that no sentence has, and their replacements."""

_current: ContextVar[str] = ContextVar("language", default="en")
_ENTRY = re.compile(r'^msgid ((?:"(?:[^"\\]|\\.)*"\s*)+)^msgstr ((?:"(?:[^"\\]|\\.)*"\s*)+)', re.MULTILINE)
_PIECE = re.compile(r'"(?:[^"\\]|\\.)*"')
_DECIMAL_POINT = re.compile(r"(?<=\d)\.(?=\d)")
_FIGURE = re.compile(r"(?<![=\w.,])(\d+)\.(?=\d)")
_NAMES = re.compile(r"[\w.-]+(, [\w.-]+)+")  # keys, of which some are English words, such as from and to
_QUOTED = re.compile(r'("[^"]*")')
_PLACEHOLDER = re.compile(r"\{(\d+)\}")
_ENGLISH = re.compile(
    r"(?<!-)\b(the|is|are|of|that|which|with|would|it|its|for|from|to|by|at|on|than|there|beyond)\b(?![.(\[=])"
)


@contextmanager
def use(language: str) -> Iterator[None]:
    """Uses this language for texts and numbers while the block runs, in this thread alone; ValueError for an unknown one."""
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
    """The message in the language in use (English without a translation), with values inserted: `{name}`."""
    translation = catalogue(_current.get()).get(message, message)
    return _joined(translation.format(**values)) if values else translation


def _joined(words: str) -> str:
    """A sentence with inserted parts by the grammar of the language in use."""
    pairs, instead = _JOINTS.get(_current.get(), (None, {}))
    return pairs.sub(lambda match: instead[match[0]], words) if pairs else words


def number(written: str) -> str:
    """A number as written in English, with the decimal mark of the language in use: 0.5 is 0,5 in Spanish."""
    return _DECIMAL_POINT.sub(DECIMAL_MARKS[_current.get()], written)


def message(words: str, numbers: bool = True) -> str:
    """A fault, remark or message in the language in use, quoted parts unchanged; English if no template fits.

    Numbers get the decimal mark of the language, unless they are those of a scene's text, which has points.

    >>> with use("es"):
    ...     print(message('did you mean "slider"?'), message("not confirmed in time: the motion takes too many steps"))
    ¿quería decir "slider"? sin confirmar en el tiempo: el movimiento necesita demasiados pasos
    """
    language = _current.get()
    if language == "en" or not words:
        return words
    translated = catalogue(language).get(words) or _by_templates(language, words)
    if not numbers:
        return _joined(translated)
    pieces = _QUOTED.split(_joined(translated))
    return "".join(piece if k % 2 else _FIGURE.sub(rf"\1{DECIMAL_MARKS[language]}", piece) for k, piece in enumerate(pieces))


def untranslated(words: str) -> bool:
    """Tests whether the language in use is another and has no translation of a message, which so stays English.

    >>> with use("es"):
    ...     untranslated("how wide it is"), untranslated("guesses of one"), untranslated('"what is it"')
    (True, False, False)
    """
    foreign = _current.get() != "en" and _ENGLISH.search(_QUOTED.sub("", words))
    return bool(foreign) and message(words, numbers=False) == words


@lru_cache(2048)
def _by_templates(language: str, sentence: str) -> str:
    """A text by the longest template that fits, inserted parts translated in the same way; else wholly English."""
    exact, templates = _templates(language)
    words = sentence.strip()
    if not words or (words[0] == words[-1] == '"' and words.count('"') == 2):
        return sentence
    if words in exact:
        return sentence.replace(words, exact[words])
    for longest, pattern, translation in templates:
        fit = pattern.fullmatch(words) if longest in words else None
        if fit is None or sum(value.count('"') % 2 for value in fit.groups()) > words.count('"') % 2:
            continue  # or the template would part what is in quotes
        values = [value if value.count('"') % 2 else _by_templates(language, value) for value in fit.groups()]
        if any(_ENGLISH.search(_QUOTED.sub("", value)) for value in values if not _NAMES.fullmatch(value)):
            continue  # a whole sentence in English rather than one half in it
        return sentence.replace(words, _PLACEHOLDER.sub(lambda place: values[int(place[1])], translation))  # noqa: B023
    return sentence


@cache
def _templates(language: str) -> tuple[Mapping[str, str], tuple[tuple[str, re.Pattern[str], str], ...]]:
    """The faults without placeholders, and the templates: their longest words, a pattern, the translation."""
    exact, templates = {}, []
    for english, translation in entries(_folder(language).joinpath("faults.po").read_text("utf-8")).items():
        pieces = _PLACEHOLDER.split(english)[::2]
        if len(pieces) == 1:
            exact[english] = translation
            continue
        pattern = re.compile("(.*?)".join(map(re.escape, pieces)), re.DOTALL)
        templates.append((len("".join(pieces)), max(pieces, key=len), pattern, translation))
    templates.sort(key=lambda template: -template[0])
    return MappingProxyType(exact), tuple(template[1:] for template in templates)


@cache
def catalogue(language: str) -> Mapping[str, str]:
    """Every text of a language by its English: marked texts before equal faults; empty for English itself."""
    if language == "en":
        return MappingProxyType({})
    texts: dict[str, str] = {}
    catalogues = [entry for entry in _folder(language).iterdir() if entry.name.endswith(".po")]
    for entry in sorted(catalogues, key=lambda entry: (entry.name != "faults.po", entry.name)):
        texts |= entries(entry.read_text("utf-8"))
    return MappingProxyType(texts)


def _folder(language: str) -> Any:
    from importlib.resources import files  # English needs none

    return files(__package__).joinpath(language)


def entries(po: str) -> dict[str, str]:
    r"""The translations of a catalogue's text, without its head and without untranslated entries.

    >>> entries('msgid "slider"\nmsgstr "corredera"\n')
    {'slider': 'corredera'}
    """

    def joined(pieces: str) -> str:
        return "".join(ast.literal_eval(piece) for piece in _PIECE.findall(pieces))

    pairs = ((joined(of), joined(to)) for of, to in _ENTRY.findall(po))
    return {message: translation for message, translation in pairs if message and translation}
