"""A scene's text: the line of every key, and the probable meaning of a text that is no TOML.

`tomllib` decides which texts are TOML and reads them; this module gives places. One scanner walks the text by TOML's lexical
rules: for a valid text it records the line of every key, table and item; for an invalid one it describes the errors in words
that do not presuppose TOML's specification.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import reduce
from itertools import islice
from typing import Any, NamedTuple, TypeVar

from flywheel.numerics.faults import Fault, Remark, quote
from flywheel.reading.fields import child, heading
from flywheel.reading.schema import LINKAGE_SECTIONS, SECTIONS

Finding = TypeVar("Finding", Fault, Remark)
Path = tuple[str | int, ...]
"""Keys, and numbers of items from 0."""

_ARRAYS = frozenset(section.name for section in (*SECTIONS.values(), *LINKAGE_SECTIONS) if section.array)
_MOST_TROUBLES = 20
_MOST_COUNTED = 200
_MOST_PARTS = 100  # of a key: paths of more would take the square of their length
_LARGEST = 2**17  # characters of a text whose lines are reported: longer texts would take longer than reading
_LONGEST = 80  # of a line that an advice writes out
_PART = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\[^\n])*"|'[^'\n]*')"""
_KEY = re.compile(rf"{_PART}(?:[ \t]*\.[ \t]*{_PART})*")
_BLANK = re.compile(r"[ \t]*(?:#[^\n]*)?")
_GAP = re.compile(r"[ \t]*")
_BLANKS = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_HEADING = re.compile(rf"(\[\[?)[ \t]*({_KEY.pattern})[ \t]*(\]\]?)(?=[ \t]*(?:#|$))", re.MULTILINE)
_LONG_TEXT = re.compile(r'"""(?:[^\\]|\\.)*?"""(?:""|"(?!"))?|\'\'\'.*?\'\'\'(?:\'\'|\'(?!\'))?', re.DOTALL)
_TEXT = re.compile(r""""(?:[^"\\\n]|\\[^\n])*"|'[^'\n]*'""")
_PLAIN = re.compile(r"""[+-]?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?|"[\w .,;:^/()*+-]*"|'[\w .,;:^/()*+-]*'""")
_DATE = r"\d{4}-\d\d-\d\d[ ]\d\d:[^\s,\]}#]*"
_SCALAR = re.compile(rf"{_DATE}|[^\s,\[\]{{}}#\"']+")
_WORD = r"(?!(?:true|false|nan|inf)\b)[A-Za-z][\w. -]*"
_BRACKETS = re.compile(rf"{_TEXT.pattern}|#[^\n]*|[\[\](){{}}]|\n[ \t]*\[\[?[ \t]*{_WORD}\]", re.MULTILINE)
_STATEMENT = re.compile(rf"[ \t]*(?:{_KEY.pattern}[ \t]*=|\[\[?[ \t]*{_WORD}\]\]?[ \t]*(?:#|$))", re.MULTILINE)
_CURLY = str.maketrans(dict.fromkeys("“”„‟«»″〝〞", '"') | dict.fromkeys("‘’‚‛′`´", "'"))
_INVISIBLE = re.compile("[\u00a0\u00ad\u2000-\u200f\u2028-\u202f\u2060\u3000\ufeff]")
_TRUTHS = {"true": "true", "yes": "true", "on": "true", "false": "false", "no": "false", "off": "false"}
_NO_COMMENT = ("//", "/*", ";", "%", "--", "<!--")
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"


class _Trouble(Exception):
    """Reason why a text is no TOML, and where."""

    def __init__(self, at: int, defect: str, expected: str, advice: str = "", *, resume: int | None = None) -> None:
        self.at, self.defect, self.expected, self.advice = at, defect, expected, advice
        self.resume = resume  # where scanning continues: None behind this line
        super().__init__(defect)


class Index(NamedTuple):
    """The line of every key, table and item of a text, by its path as faults write it; the tables written [[so]]."""

    lines: Mapping[str, int]
    paths: Mapping[str, Path]
    headings: frozenset[Path]

    def placed(self, fault: Finding) -> Finding:
        """The fault with its line, of its key or of the table that lacks it, and the tables of arrays on the way to it.

        These are counted from 1: "the 2nd [[load]]". The fault is unchanged if its line is unknown.
        """
        where = fault.path
        while where and where not in self.lines:
            where = where[: max(where.rfind("."), where.rfind("["), 0)]
        if not where or fault.line is not None:
            return fault
        path, words = self.paths[where], []
        for k in range(len(path), 0, -1):
            if path[:k] in self.headings:
                name = ".".join(part for part in path[:k] if isinstance(part, str))
                count = int(path[k - 1]) + 1
                ordinals = {1: f"the {count}st [[{name}]]", 2: f"the {count}nd [[{name}]]", 3: f"the {count}rd [[{name}]]"}
                th = f"the {count}th [[{name}]]"
                words.append(th if count % 100 in (11, 12, 13) else ordinals.get(count % 10, th))
        return fault._replace(line=self.lines[where], item=" of ".join(words))


def index(text: str, mapping: Mapping[str, Any]) -> Index | None:
    r"""The lines of a text that holds a mapping; None if the scanner and `tomllib` do not see the same keys in it.

    >>> text = "[regime]\nspeed = 1\n[[load]]\non = 'crank'\n"
    >>> index(text, tomllib.loads(text)).lines
    {'regime': 1, 'load': 3, 'regime.speed': 2, 'load[0]': 3, 'load[0].on': 4}
    """
    if len(text) > _LARGEST:
        return None
    scanner = _Scanner(text)
    try:
        troubles = list(scanner.troubles())
    except RecursionError:
        return None
    if troubles or set(scanner.lines) != set(_paths(mapping, ())):
        return None
    texts: dict[Path, str] = {(): ""}
    for path in sorted(scanner.lines, key=len):
        texts[path] = _joined_path(texts[path[:-1]], path[-1])
    many = Counter(texts.values())
    paths = {text: path for path, text in texts.items() if path and many[text] == 1}
    lines = {text: scanner.lines[path] for text, path in paths.items()}
    return Index(lines, paths, frozenset(scanner.headings))


def placed(faults: Iterable[Finding], text: str, mapping: Mapping[str, Any]) -> list[Finding]:
    """Faults of a scene, or remarks, with the lines on which they stand."""
    lines = index(text, mapping)
    return [fault if lines is None else lines.placed(fault) for fault in faults]


def _paths(value: object, path: Path) -> Iterator[Path]:
    """The paths of everything in a mapping but itself."""
    items = value.items() if isinstance(value, Mapping) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield (*path, key)
        yield from _paths(item, (*path, key))


def _joined_path(path: str, part: str | int) -> str:
    return child(path, part) if isinstance(part, str) else f"{path}[{part}]"


class Value(NamedTuple):
    """Place of a value in a text: its key begins `at` (for a list's item, the item), the value runs from `start` to `stop`.

    It is a `statement` where it has its line to itself, below the heading of that `block`. One that is no TOML is not
    `good`, and runs to the end of its line.
    """

    at: int
    start: int
    stop: int
    statement: bool
    block: int
    good: bool


class TomlBlock(NamedTuple):
    """A heading, from its first bracket `at` to behind its last, and the path of the table that follows."""

    path: Path
    at: int
    stop: int


class Outline(NamedTuple):
    """A text with the place of everything in it; `mapping` holds as much as can be read where it is no TOML.

    `troubles` counts the errors that prevent its reading. `places` has paths as faults write them. A text far longer than a
    handwritten scene has no outline.
    """

    text: str
    mapping: dict[str, Any]
    values: Mapping[Path, Value]
    blocks: tuple[TomlBlock, ...]
    lines: Mapping[Path, int]
    places: Mapping[str, Path]
    troubles: int

    def line(self, path: Path) -> int | None:
        """The line on which a key, a table or an item stands."""
        return self.lines.get(path)


def outline(text: str) -> Outline:
    r"""Locates every value of a text, even in a text that is not valid TOML.

    >>> document = outline("[regime]\nspeed = '60 rpm' # of the crank\ncycle = 720 deg\n")
    >>> document.mapping, document.troubles, document.text[slice(*document.values["regime", "speed"][1:3])]
    ({'regime': {'speed': '60 rpm'}}, 1, "'60 rpm'")
    """
    if len(text) > _LARGEST:
        return Outline(text, {}, {}, (TomlBlock((), 0, 0),), {}, {}, 0)
    scanner, readable = _Scanner(text), True
    try:
        troubles = sum(1 for _ in islice(scanner.troubles(), _MOST_COUNTED))
    except RecursionError:
        troubles, readable = 1, False
    try:
        mapping = tomllib.loads(text) if readable else _readable(scanner)
        troubles = 0 if readable else troubles
    except (ValueError, RecursionError):
        mapping, troubles = _readable(scanner), max(troubles, 1)
    texts: dict[Path, str] = {(): ""}
    for path in sorted(scanner.lines, key=len):
        texts[path] = _joined_path(texts.get(path[:-1], ""), path[-1])
    places = {name: path for path, name in texts.items() if path}
    return Outline(text, mapping, scanner.pairs, tuple(scanner.blocks), scanner.lines, places, troubles)


def _readable(scanner: _Scanner) -> dict[str, Any]:
    """The tables and values that can be read in a text that is no TOML."""
    mapping: dict[str, Any] = {}
    blocks: list[tuple[Path, Any]] = [(block.path, {}) for block in scanner.blocks[1:]]
    for path, value in scanner.pairs.items():
        if value.statement and value.good:
            with suppress(ValueError, RecursionError):
                blocks.append((path, tomllib.loads(f"value = {scanner.text[value.start : value.stop]}")["value"]))
    for path, table in blocks:
        place: Any = mapping
        for part, after in zip(path, (*path[1:], None), strict=True):
            fresh: Any = table if after is None else [] if isinstance(after, int) else {}
            if isinstance(place, list) and isinstance(part, int):
                if part >= len(place):
                    place.append(fresh)
                place = place[min(part, len(place) - 1)]
            elif isinstance(place, dict):
                place = place.setdefault(part, fresh)
    return mapping


class _Scanner:
    """A walk over a text, statement by statement: it notes the places of paths, and the tables written [[so]]."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self.lines: dict[Path, int] = {}
        self.headings: dict[Path, int] = {}
        self.counts: dict[Path, int] = {}
        self.values: dict[Path, int] = {}  # lines of keys that were given a value, which nothing may be added to
        self.tables: dict[Path, int] = {}  # lines of the headings of tables
        self.dotted: dict[Path, int] = {}  # lines of tables that came to be by a dotted key
        self.pairs: dict[Path, Value] = {}
        self.blocks = [TomlBlock((), 0, 0)]
        self.prefix: Path = ()
        self.braces = 0  # inline tables that are open
        self.repeated: set[Path] = set()  # tables with a second heading
        self.again = False  # whether the keys are those below a second heading

    def line(self, at: int) -> int:
        """Number of the line in which a place of the text stands, from 1."""
        return bisect_right(self.starts, at)

    def end(self, at: int) -> int:
        """End of the line."""
        place = self.text.find("\n", at)
        return len(self.text) if place < 0 else place

    def troubles(self) -> Iterator[_Trouble]:
        """Errors of syntax, one at most for each statement; scanning continues after each if possible."""
        at = 0
        while (at := self._skip(at)) < len(self.text):
            self.braces = 0
            try:
                at = self._heading(at) if self.text[at] == "[" else self._pair(at, self.prefix)
            except _Trouble as trouble:
                yield trouble
                at = self.end(trouble.at) if trouble.resume is None else trouble.resume

    def _skip(self, at: int, blanks: re.Pattern[str] = _BLANKS) -> int:
        """The position behind blanks and comments."""
        match = blanks.match(self.text, at)
        return at if match is None else match.end()

    def _keys(self, text: str) -> tuple[str, ...]:
        """The parts of a dotted key, limited in number."""
        if text.count(".") > _MOST_PARTS:
            raise RecursionError
        if '"' not in text and "'" not in text:
            return tuple(part.strip() for part in text.split("."))
        keys: list[str] = []
        table: Any = tomllib.loads(f"{text} = 0")
        while isinstance(table, dict):
            key, table = next(iter(table.items()))
            keys.append(key)
        return tuple(keys)

    def _heading(self, at: int) -> int:
        """Position after the heading of a table, or of one more table of an array."""
        match = _HEADING.match(self.text, at)
        if match is None or len(match[1]) != len(match[3]):
            raise _heading_trouble(at, self.text[at : self.end(at)])
        *above, last = self._keys(match[2])
        path: Path = ()
        for key in above:  # of an array of tables its last one is meant
            path = (*path, key)
            if path in self.counts:
                path = (*path, self.counts[path] - 1)
        path, heading, line, many = (*path, last), match.group(), self.line(at), match[1] == "[["
        name, first, keyed = heading.strip("[] \t"), self.tables.get(path), self.values.get(path) or self.dotted.get(path)
        if many and (first or keyed) and path not in self.counts:
            if first:
                repeated, self.prefix, self.again = path in self.repeated, path, True
                self.repeated.add(path)
                if repeated:
                    return match.end()
            taken, advice = self.values.get(path) or first or keyed, "write it in one way only"
            advice = f"line {taken} has it as one table; {f'write {heading} there as well' if first else advice}"
            raise _Trouble(at, heading, "one way of writing it", advice)
        if not many and path in self.counts:
            raise _Trouble(at, heading, f"[[{name}]]", f"write [[{name}]], as in line {self.lines[path]}")
        if not many and first:
            repeated, self.prefix, self.again = path in self.repeated, path, True
            self.repeated.add(path)
            if repeated:
                return match.end()
            expected, advice = "each table once", f"put its keys below {heading} in line {first}"
            if name in _ARRAYS:
                expected, advice = f"[[{name}]]", f"write [[{name}]] for each; the first is in line {first}"
            raise _Trouble(at, f"{heading} a second time", expected, advice)
        if not many and keyed:
            advice = f"write all of it below {heading}, or all of it with keys such as in line {keyed}"
            raise _Trouble(at, f"{heading}, which line {keyed} has begun", "one way of writing it", advice)
        for k in range(1, len(path)):  # tables above, which may have no heading of their own
            self.lines.setdefault(path[:k], line)
            if taken := self.values.get(path[:k]):
                name = reduce(_joined_path, path[:k], "")
                raise _Trouble(at, f"a part of {name}", f"nothing more, as {name} has its value in line {taken}", "keep one")
        if many:
            self.counts[path] = self.counts.get(path, 0) + 1
            self.prefix = (*path, self.counts[path] - 1)
            self.lines.setdefault(path, line)
            self.lines[self.prefix] = self.headings[self.prefix] = line
        else:
            self.prefix = path
            self.tables[path] = self.lines[path] = line
        self.again = False
        self.blocks.append(TomlBlock(self.prefix, at, match.end()))
        return match.end()

    def _pair(self, at: int, prefix: Path, match: re.Match[str] | None = None) -> int:
        """The position behind a key and its value, which end a line except in an inline table (its key is matched)."""
        ending = match is None
        match = match or _KEY.match(self.text, at)
        equals = -1 if match is None else self._skip(match.end(), _GAP)
        if match is None or self.text[equals : equals + 1] != "=":
            raise _key_trouble(at, self.text[at : self.end(at)])
        key, line, path = match.group(), self.line(at), (*prefix, *self._keys(match.group()))
        for k in range(len(prefix) + 1, len(path)):  # tables that the key's dots make
            if path[:k] in self.values:
                name, advice = reduce(_joined_path, path[:k], ""), f"has a value in line {self.values[path[:k]]}"
                raise _Trouble(at, f"{key}, which is a part of {name}", "one of the two", f"{name} {advice}")
            if path[:k] not in self.tables:
                self.dotted.setdefault(path[:k], line)
            self.lines.setdefault(path[:k], line)
        start = self._skip(equals + 1, _GAP)
        if self.again and path in self.values:
            return self._value(start, path, key if ending else "")
        for register in (self.values, self.tables, self.dotted):
            if path in register:
                defect = f"{key} a second time" if register is self.values else f"{key} as a value"
                advice = f"it stands in line {register[path]} already: keep one of the two"
                raise _Trouble(at, defect, f"one {key}", advice)
        if path in self.counts:
            raise _Trouble(at, f"{key} as a value", f"one {key}", f"line {self.lines[path]} has it as a table")
        self.lines[path] = self.values[path] = line
        self.pairs[path] = pair = Value(at, start, self.end(start), ending, len(self.blocks) - 1, False)
        stop = self._value(start, path, key if ending else "")
        if ending and self._skip(stop, _BLANK) < self.end(stop):
            raise _value_trouble(start, key, self.text[start : self.end(stop)], stop - start)
        self.pairs[path] = pair._replace(stop=stop, good=True)
        return stop

    def _value(self, at: int, path: Path, key: str) -> int:
        """The position behind a value; `key`: its key if that has the line to itself."""
        mark = self.text[at : at + 1]
        if mark == "[":
            return self._list(at, path)
        if mark == "{":
            self.braces += 1
            try:
                stop = self._members(at, path)
            except _Trouble as inside:  # the advice writes out all of the outermost table
                raise (self._mended(inside, at) if self.braces == 1 else inside) from None
            self.braces -= 1
            return stop
        if (quotes := self.text[at : at + 3]) in ('"""', "'''"):
            match = _LONG_TEXT.match(self.text, at)
            if match is None:
                defect, advice = f"{quotes} that is never closed", "where the text ends, or one quote on either side"
                raise _Trouble(at, defect, "a text that ends", f"write {quotes} {advice}", resume=len(self.text))
            return match.end()
        if mark and mark in "\"'":
            match = _TEXT.match(self.text, at)
            if match is not None and _is_value(match.group()):
                return match.end()
            trouble = _text_trouble(at, key, self.text[at : self.end(at)] if match is None else match.group(), match is None)
            follows = self.text[self.end(at) + 1 : self.end(self.end(at) + 1)]
            if match is None and follows.count(mark) == 1 and not re.match(rf"\s*({_KEY.pattern})\s*[=:]", follows):
                trouble.advice = f"write all of it on one line, or between {3 * mark} and {3 * mark}"
                trouble.resume = self.end(self.end(at) + 1)
            raise trouble
        match = _SCALAR.match(self.text, at)
        if match is None or not _is_value(match.group()):
            rest = self.text[at : self.end(at)]
            raise _value_trouble(at, key, rest, 0) if key else _item_trouble(at, rest)
        return match.end()

    def _list(self, at: int, path: Path) -> int:
        """The position behind a list, whose items may be on many lines."""
        opening, number = at, 0
        if re.match(rf"\[\s*{_KEY.pattern}[ \t]*=", self.text[at : at + _LONGEST]):
            raise self._mended(_Trouble(at, _glimpse(self.text[at:]), "a table between braces", "write { and }"), at)
        at = self._within(at + 1, opening)
        while self.text[at] != "]":
            self.lines[(*path, number)] = self.line(at)
            stop = self._value(at, (*path, number), "")
            self.pairs[(*path, number)] = Value(at, at, stop, False, len(self.blocks) - 1, True)
            at = self._within(stop, opening)
            if self.text[at] not in ",]":
                start = max(self.text.rfind(mark, 0, at) for mark in ",[\n") + 1
                item = re.split(r"[,\]\n#]", self.text[start:], maxsplit=1)[0].strip()
                if re.fullmatch(rf"{_NUMBER}\s*[^\W\d_].*|{_NUMBER}\s*[%°]", item):
                    raise _bare_trouble(start, "", item)
                defect = f"{_glimpse(self.text[at:])} after an item"
                raise _Trouble(at, defect, "a comma between items, or ]", "put a comma")
            at = self._within(at + 1, opening) if self.text[at] == "," else at
            number += 1
        return at + 1

    def _within(self, at: int, opening: int) -> int:
        """The next item of a list, or its end; a list that another statement interrupts was never closed."""
        at = self._skip(at)
        start = self.starts[self.line(at) - 1]
        fresh = self.line(at) > self.line(opening) and not self.text[start:at].strip()
        if at < len(self.text) and not (fresh and _STATEMENT.match(self.text, start)):
            return at
        defect = f"{_glimpse(self.text[opening:])}, a list that does not end"
        resume = start if at < len(self.text) and not self.braces else len(self.text)
        raise _Trouble(opening, defect, "a list between [ and ]", "put ] after its last item", resume=resume)

    def _mended(self, trouble: _Trouble, opening: int) -> _Trouble:
        """A fault in a table between brackets of any kind with its line written out; scanning continues behind the table."""
        closing = _closing(self.text, opening)
        if closing is None:
            return trouble
        start = self.starts[self.line(opening) - 1]
        key, equals, _ = self.text[start:opening].partition("=")
        table = _braced(self.text[opening + 1 : closing])
        behind = _without_comment(self.text[closing + 1 : self.end(closing)]).strip(",; ")
        if equals and table and not behind and _KEY.fullmatch(key.strip()):
            trouble.advice = _written(key.strip(), (table,)) or trouble.advice
        trouble.resume = self.end(closing)
        return trouble

    def _members(self, opening: int, path: Path) -> int:
        """The keys of a table between braces, up to its end."""
        at = self._skip(opening + 1, _GAP)
        if self.text[at : at + 1] == "}":
            return at + 1
        advice = "write all of it on one line and } at its end, or give it a heading of its own"
        defect = f"{_glimpse(self.text[opening:])} without its }}"
        is_open = _Trouble(opening, defect, "a table between braces on one line", advice)
        while True:
            match = _KEY.match(self.text, at)
            if at == self.end(at) or self.text[at] == "#":
                raise is_open
            equals = -1 if match is None else self._skip(match.end(), _GAP)
            if match is None or self.text[equals : equals + 1] != "=":
                raise _inline_trouble(at, self.text[at : self.end(at)])
            at = self._skip(self._pair(at, path, match), _GAP)
            mark = self.text[at : at + 1]
            if mark == "}":
                return at + 1
            if not mark or mark in "\n#":
                raise is_open
            if mark != ",":
                advice = 'put a comma, and texts such as "480 mm" in quotes'
                raise _Trouble(at, f"{_glimpse(self.text[at:])} after a value", "a comma between keys, or }", advice)
            at = self._skip(at + 1, _GAP)


def _closing(text: str, opening: int) -> int | None:
    """Place of the bracket that closes the one at a place, of whatever kind; None if a heading comes first."""
    depth = 0
    for match in _BRACKETS.finditer(text, opening):
        mark = match.group()
        if mark[0] == "\n":
            return None
        depth += (mark in "[{(") - (mark in "]})")
        if depth == 0 and mark in "]})":
            return match.start()
    return None


def _braced(inner: str) -> str:
    """A table between braces on one line, from keys and values as a beginner writes them; empty if there are none.

    >>> _braced("length: 480 mm; mass = 2,5")
    '{length = "480 mm", mass = 2.5}'
    """
    lines = " \n".join(line if '"' in line or "'" in line else _without_comment(line) for line in inner.split("\n"))
    plain = re.sub(r"(?<=\d),(?=\d)", ".", lines.translate(_CURLY))
    pairs = []
    for piece in filter(str.strip, re.findall(r"""(?:"[^"\n]*"|'[^'\n]*'|[^,;\n"'])+""", plain)):
        match = re.fullmatch(rf"\s*({_KEY.pattern})\s*[=:]\s*(.*?)\s*", piece)
        value = next(filter(_is_value, (match[2], *_ways(match[2]), *_quoted(match[2]))), "") if match else ""
        if match is None or not value:
            return ""
        pairs.append(f"{match[1]} = {value}")
    return f"{{{', '.join(pairs)}}}"


def troubles(text: str, name: str, message: str) -> list[Fault]:
    r"""Faults of a text that `tomllib` refuses with its own `message`; `name` is that of the file.

    >>> fault = troubles("[regime]\nspeed = 60 rpm", "press.toml", "")[0]
    >>> fault.place, fault.defect, fault.advice
    ('line 2, column 9', '60 rpm without quotes', 'write speed = "60 rpm"')
    """
    scanner = _Scanner(text)
    faults: list[Fault] = []
    try:
        for trouble in scanner.troubles():
            line = scanner.line(trouble.at)
            column = trouble.at - scanner.starts[line - 1] + 1
            faults.append(Fault(name, trouble.defect, trouble.expected, trouble.advice, line, column))
            if len(faults) == _MOST_TROUBLES:
                break
    except RecursionError:
        pass
    match = re.search(r"\(at (?:line (\d+), column (\d+)|end of document)\)", message)
    stop = int(match[1]) if match and match[1] else None
    if faults and (stop is None or (faults[0].line or 0) <= stop):
        return faults
    what = message[: match.start()].strip() if match else message[:100]
    at = int(match[2]) if match and match[2] else None
    what = f"a text that is no TOML ({what})" if match else "a number of too many digits"
    return [Fault(name, what, "a scene in TOML", "", stop, at)]


def _is_value(text: str) -> bool:
    """Tests whether a text is one value of TOML."""
    if _PLAIN.fullmatch(text):
        return True
    if "\n" in text:
        return False
    try:
        return set(tomllib.loads(f"a = {text}")) == {"a"}
    except (ValueError, RecursionError):
        return False


def _glimpse(text: str) -> str:
    """The beginning of the wrong text, on one line."""
    line = text.split("\n", 1)[0].strip()
    return quote(line)[1:-1] if line else "the end of the line"


def _written(key: str, values: Iterable[str]) -> str:
    """The advice to write the first valid one of some values; empty if none is valid, or the line is long."""
    good = next((value for value in values if _is_value(value)), "")
    line = f"{key} = {good}" if key else good
    return f"write {line}" if good and len(line) <= _LONGEST and line.isprintable() else ""


def _quoted(text: str) -> Iterator[str]:
    """A text in quotes of either kind."""
    if "\\" not in text:
        yield f'"{text}"'
    yield f"'{text}'"


def _without_comment(text: str) -> str:
    return text.split("#", 1)[0].strip()


_STRAIGHT = "straight quotes, \" or '"
_A_VALUE = "a number, or a text in quotes"


def _value_trouble(at: int, key: str, rest: str, behind: int) -> _Trouble:
    """The fault of an invalid value, or of text `behind` it."""
    text = _without_comment(rest)
    head, tail = rest[:behind].strip(), rest[behind:].strip()
    if head and head[0] not in "\"'[{":
        head = ""
    if not text:
        return _Trouble(at, f"nothing after {key} =", _A_VALUE, f"write a value after {key} =, or leave the line out")
    if _INVISIBLE.search(text) and not head:
        plain = _INVISIBLE.sub(" ", text).strip()
        return _Trouble(
            at, "a space that is not an ordinary one", "ordinary spaces", _written(key, (plain, *_quoted(plain)))
        )
    if re.search("[“”„‟«»″‘’‚‛′`´]", text):
        plain = text.translate(_CURLY)
        inner = plain.strip("\"' ")
        return _Trouble(at, f"{_glimpse(text)}, with typographic quotes", _STRAIGHT, _written(key, _quoted(inner)))
    ended = text.rstrip(",; ")
    if ended != text and (_is_value(ended) or _is_value(ended.replace(",", "."))):
        advice = _written(key, (ended, ended.replace(",", ".")))
        return _Trouble(at + len(ended), f"{text[-1]} at the end of the line", "the line's end", advice)
    if re.match(rf"\(\s*{_KEY.pattern}\s*=", text):
        ways = (_braced(text[1:].removesuffix(")")),)
        return _Trouble(at, _glimpse(text), "a table between braces", _written(key, ways) or "write { and }")
    for mark in _NO_COMMENT:
        value, sign, _ = rest.partition(mark)
        if sign and _is_value(value.strip()) and rest.strip() != f"{value}{sign}":
            return _Trouble(at + len(value), f"{mark} after a value", "# before a comment", "write # before the comment")
    if match := re.search(rf"(?<=[ \t])({_KEY.pattern})[ \t]*=", text):
        defect = f"{match[1]} = on the same line"
        return _Trouble(at + match.start(), defect, "one key on a line", f"begin a new line with {match[1]}")
    if head[:1] == "[" and set(tail) <= {"]"}:
        return _Trouble(at + behind, f"{tail} after {_glimpse(head)}", "as many ] as [", _written(key, (head,)))
    if head in ("''", '""') and (inner := text.strip("\"'")):
        return _Trouble(
            at, f"{_glimpse(text)}, with quotes twice", "one quote on either side", _written(key, _quoted(inner))
        )
    if head:  # such as "60" rpm, or quotes within quotes of the same kind
        inner = text[1:-1] if text[-1] == text[0] and len(text) > len(head) else text
        joined = text[0] + head[1:-1] + " " + text[len(head) :].strip().strip("\"'") + text[0]
        advice = _written(key, (joined,) if inner == text and head[0] in "\"'" else _quoted(inner))
        return _Trouble(at, f"{_glimpse(tail)} after {_glimpse(head)}", "nothing after a value", advice)
    return _bare_trouble(at, key, text)


def _bare_trouble(at: int, key: str, remedy: str) -> _Trouble:
    """The fault of a value without quotes that is no number."""
    if _is_value(plain := remedy.lstrip("=: ")):
        return _Trouble(at, f"{remedy[: len(remedy) - len(plain)].strip()} after =", "one =", _written(key, (plain,)))
    if remedy.lower() in _TRUTHS:
        return _Trouble(at, remedy, "true or false, in small letters", _written(key, (_TRUTHS[remedy.lower()],)))
    if "\\" in remedy and remedy[:1] not in "\"'":
        return _Trouble(at, f"{_glimpse(remedy)} without quotes", "a text in quotes", _written(key, (f"'{remedy}'",)))
    if match := re.match(r"([+-]?[1-9]\d{0,2}(?:,\d{3})+)(?![\d,])", remedy):
        rest, whole = remedy[match.end() :], match[1].replace(",", "")
        advice = _written(key, (whole + rest, *_quoted(whole + rest))) if rest[:1] != "." else ""
        comma = f"{match[1].replace(',', '.', 1).rstrip('0')}0" if match[1].count(",") == 1 else ""
        advice += f", or {comma} if the comma is a decimal one" if advice and comma else ""
        return _Trouble(at, f"{_glimpse(remedy)}, with a comma", "a number without commas", advice)
    point = re.sub(r"^([+-]?\d{1,3}(?:\.\d{3})*),(\d+)(?!\d|,)", lambda m: f"{m[1].replace('.', '')}.{m[2]}", remedy)
    point = re.sub(r"^([+-]?\d+),(\d+)(?!\d|,)", r"\1.\2", point)
    if point != remedy:
        return _Trouble(
            at, f"{_glimpse(remedy)}, with a decimal comma", "a decimal point", _written(key, (point, *_quoted(point)))
        )
    if re.fullmatch(_NUMBER, remedy):
        plain = re.sub(r"^([+-]?)0*(?=\d)", r"\1", re.sub(r"^([+-]?)\.", r"\g<1>0.", remedy))
        plain = re.sub(r"\.(?!\d)", ".0", plain)
        return _Trouble(at, remedy, "a digit on either side of the point, and no zeros in front", _written(key, (plain,)))
    if match := re.match(r"[+-]?\d{1,3}(?:[ '’]\d{3})+(?!\d)", remedy):
        plain = re.sub(r"[ '’]", "", match[0]) + remedy[match.end() :]
        return _Trouble(at, remedy, "a number without blanks", _written(key, (plain, *_quoted(plain))))
    if (match := re.fullmatch(rf"({_NUMBER})\s*/\s*({_NUMBER})", remedy)) and float(match[2]):
        value = f"{float(match[1]) / float(match[2]):.10g}"
        return _Trouble(at, f"{remedy}, a division", "a number", _written(key, (value,)))
    if re.fullmatch(rf"[\[(]?\s*{_NUMBER}(?:\s*[,;]\s*{_NUMBER})+\s*[\])]?", remedy):
        numbers = ", ".join(re.findall(_NUMBER, remedy))
        defect = (
            f"{_glimpse(remedy)}, a list without [ and ]"
            if key
            else f"{_glimpse(remedy)}, with separators other than commas"
        )
        advice = _written(key, (f"[{numbers}]",)) if key else f"write {numbers}"
        return _Trouble(at, defect, "a list such as [0, 90]", advice)
    if remedy.lower() in ("none", "null", "nil", "nada", "-", "?"):
        return _Trouble(at, remedy, _A_VALUE, "leave the line out where there is no value")
    plain = remedy.strip("\"'") if remedy.count('"') + remedy.count("'") == 1 else remedy
    defect = f"{_glimpse(remedy)} without {'quotes' if plain == remedy else 'one of its quotes'}"
    return _Trouble(at, defect, _A_VALUE, _written(key, _quoted(plain)) or "put it in quotes")


def _text_trouble(at: int, key: str, text: str, is_open: bool) -> _Trouble:
    """The fault of a text that is not closed, or contains a backslash that is an escape between double quotes."""
    if text[0] == '"' and "\\" in text:
        inner = _without_comment(text).strip('"')
        ways = (f"'{inner}'", f'"{inner.replace(chr(92), "/")}"')
        short = [way for way in ways if _is_value(way) and len(way) <= _LONGEST]
        advice = f"write {' or '.join(short)}" if short else "write it in single quotes, or / for every backslash"
        expected = "no backslash between double quotes, where it begins an escape"
        return _Trouble(at, f"a backslash in {_glimpse(_without_comment(text))}", expected, advice)
    if not is_open:
        return _Trouble(at, _glimpse(text), "a text of printable characters on one line")
    inner = _without_comment(text)[1:].rstrip().rstrip("".join(map(chr, _CURLY))).rstrip("\"'")
    defect = f"{_glimpse(text)} without its closing quote"
    advice = _written(key, (f"{text[0]}{inner}{text[0]}",)) if key else ""
    return _Trouble(at, defect, f"a text between two {text[0]} on one line", advice or f"put {text[0]} at its end")


def _item_trouble(at: int, rest: str) -> _Trouble:
    """The fault of an invalid item of a list, or value of an inline table."""
    item = re.split(r"[,\]}#]", rest, maxsplit=1)[0].strip()
    if not item:
        return _Trouble(at, _glimpse(rest), "a value", "a comma or a bracket stands where a value should")
    trouble = _bare_trouble(at, "", item.translate(_CURLY).strip("\"'") if item.translate(_CURLY) != item else item)
    if item.translate(_CURLY) != item:
        trouble.defect, trouble.expected = f"{_glimpse(item)}, with typographic quotes", _STRAIGHT
    return trouble


def _inline_trouble(at: int, rest: str) -> _Trouble:
    """The fault of an entry in an inline table that is no key with its value."""
    match = re.match(rf"({_KEY.pattern})[ \t]*:", rest)
    if match:
        return _Trouble(at, f"{match[1]}: with a colon", "= between key and value", f"write {match[1]} = ...")
    if rest.startswith("}"):
        return _Trouble(at, "a comma before }", "no comma after the last value", "leave the comma out")
    return _Trouble(at, _glimpse(rest), 'a key and its value, such as on = "crank"')


def _key_trouble(at: int, line: str) -> _Trouble:
    """The fault of a line that is no key with its value."""
    text = _without_comment(line)
    if line.startswith("```"):
        return _Trouble(at, _glimpse(line), "the scene alone", "leave the lines with ``` out")
    if line.startswith(_NO_COMMENT):
        return _Trouble(at, _glimpse(line), "# before a comment", "write # at the beginning of the line")
    if _INVISIBLE.search(line):
        return _Trouble(at, f"an invisible character in {_glimpse(line)}", "ordinary spaces", "retype this line")
    plain = text.translate(_CURLY)
    if match := re.match(rf"({_KEY.pattern})\s*:=?\s*(.*)", plain):
        if not match[2]:
            return _Trouble(at, text, "a table's heading in brackets, or key = value", _as_heading(match[1]))
        advice = _written(match[1], _ways(match[2])) or "write = for :"
        return _Trouble(at, f"{_glimpse(text)}, with a colon", "= between key and value", advice)
    key, equals, value = (piece.strip() for piece in plain.partition("="))
    if equals and not key:
        return _Trouble(at, f"{_glimpse(text)} without a key", "key = value")
    if equals and re.fullmatch(r"[\w-]+(?:[ \t]+[\w-]+)+", key):
        dotted = re.sub(r"[ \t]+", ".", key)
        return _Trouble(at, f"{_glimpse(key)}, a key with blanks", "a key without blanks", _written(dotted, _ways(value)))
    if equals:
        bare = re.sub("[\"']", "", key)
        advice = _written(bare, _ways(value)) if _KEY.fullmatch(bare) else "flywheel reference has the keys"
        expected = "a key of letters a to z, digits, _ and -"
        return _Trouble(at, f"the key {_glimpse(text.partition('=')[0])}", expected, advice)
    if match := re.match(rf"({_KEY.pattern})\s+(\S.*)", plain):
        advice = _written(match[1], _ways(match[2]))
        return _Trouble(at, f"{_glimpse(text)} without =", "= between key and value", advice)
    return _Trouble(at, _glimpse(line), "key = value, or a table's heading such as [regime]", _as_heading(text))


def _ways(value: str) -> Iterator[str]:
    """Possible meanings of a value, the most likely first."""
    yield value
    yield value.rstrip(",; ")
    trouble = _bare_trouble(0, "k", value)
    if trouble.advice.startswith("write k = "):
        yield trouble.advice.removeprefix("write k = ")


def _as_heading(name: str) -> str:
    """The advice for a name that stands alone."""
    name = name.strip(" :<>(){}[]\"'")
    if name not in SECTIONS:
        return f"write {name} = and its value" if _KEY.fullmatch(name) else ""
    return f"write {heading(name)}"


def _heading_trouble(at: int, line: str) -> _Trouble:
    """The fault of a line that begins with a bracket and is no heading."""
    text = _without_comment(line)
    match = re.match(r"(\[+)([^\[\]=]*)(\]*)[ \t]*(.*)", text)
    if match is None:
        return _Trouble(at, _glimpse(text), "a heading such as [regime] or [[load]]")
    name = re.sub(r"[ \t]+", ".", match[2].translate(_CURLY).strip(" \t\"':.;,"))
    many = len(match[1]) > 1 or len(match[3]) > 1
    many = many and not (name in SECTIONS and not SECTIONS[name].array)
    proper = f"[[{name}]]" if many else f"[{name}]"
    plain = bool(_KEY.fullmatch(name))
    if match[4] and match[3] and plain:
        advice = f"write {proper} alone, and what follows on the next line"
        return _Trouble(
            at, f"{_glimpse(match[4])} after {_glimpse(text[: match.start(4)])}", "a heading alone on its line", advice
        )
    expected = "a heading such as [regime] or [[load]]"
    return _Trouble(at, _glimpse(text), expected, f"write {proper}" if plain else "")
