"""Every text of the project that is marked for translation, and what the catalogues lack of it.

    python -m tests.language.texts              # what is missing, stale or wrong, a line each
    python -m tests.language.texts --missing    # entries to fill in, as a catalogue wants them

Python marks a text as `_("...")` with flywheel.language's `text`, a script of the page as `_("...")` or `text("...")`; of an
HTML file every text and label counts, but for elements with translate="no".
"""

import ast
import re
import string
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple

from flywheel.language import LANGUAGES

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "flywheel"


class Marked(NamedTuple):
    """A text where it stands; `values` names what is put in, None where it cannot be seen, `fault` what is wrong there."""

    place: str
    text: str
    values: frozenset[str] | None = None
    fault: str = ""


class Entry(NamedTuple):
    """One entry of a catalogue, with the line of its msgid."""

    place: str
    text: str
    translation: str
    fuzzy: bool = False


# -- Python ------------------------------------------------------------------------------------------------------------


def python_texts(folder: Path = PACKAGE) -> Iterator[Marked]:
    """The marked texts of all modules."""
    for path in sorted(folder.rglob("*.py")):
        source = path.read_text("utf-8")
        if "language" in source:
            yield from module_texts(source, path.relative_to(folder.parent).as_posix())


def module_texts(source: str, name: str) -> Iterator[Marked]:
    """The marked texts of one module: calls of flywheel.language's `text`, by whatever names it was imported."""
    tree = ast.parse(source)
    marks, modules = set(), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "flywheel.language":
            marks |= {alias.asname or alias.name for alias in node.names if alias.name == "text"}
        elif isinstance(node, ast.ImportFrom) and node.module == "flywheel":
            modules |= {alias.asname or alias.name for alias in node.names if alias.name == "language"}
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    for node in sorted(calls, key=lambda node: (node.lineno, node.col_offset)):
        match node.func:
            case ast.Name(id=own) if own in marks:
                yield _call(node, f"{name}:{node.lineno}")
            case ast.Attribute(value=ast.Name(id=owner), attr="text") if owner in modules:
                yield _call(node, f"{name}:{node.lineno}")


def _call(node: ast.Call, place: str) -> Marked:
    first = node.args[0] if node.args else None
    if not isinstance(first, ast.Constant) or not isinstance(first.value, str):
        return Marked(place, "", None, "marks something else than a text that stands there")
    names = {key.arg for key in node.keywords}
    values = None if None in names else frozenset(name for name in names if name)
    return Marked(place, first.value, values)


# -- faults, remarks, messages -----------------------------------------------------------------------------------------

BUILT_IN = ("numerics", "components", "scene", "mechanisms", "reading", "machine", "regime", "sizing", "motions")
"""Folders whose faults, remarks and messages reach the page or the report."""
IN_ERRORS = ("cli", "page", "pictures", "report", "tables")
"""Folders of commands with --language, of which the texts within errors count."""
_ERRORS = {"Fault", "SceneError", "EditError", "PrintError", "UsageError", "BadParameter"}
LIBRARY_ALONE = {  # modules of calls that take no scene, and so are never heard of there
    *("components/press_work.py", "components/energy.py"),
    *("mechanisms/linkages/freedoms.py", "mechanisms/linkages/multibody.py"),
    "cli/studies.py",
    *("reading/json_schema.py", "scene/__init__.py", "mechanisms/__init__.py", "sizing/findings.py"),
}
_SILENT = {"TypeError", "AttributeError", "KeyError", "NotImplementedError", "RuntimeError", "compile", "cast"}
_SILENT |= {"Finding", "_", "require"}  # lines of the reference, texts that are marked, types of a programmer's call
_FIELD = re.compile(r"\{(?:\d+|[a-z_]+)?(?::[^{}]*)?\}")
_FORMULA = re.compile(r"^<|\*\(|\)\*|[(*] ?\{|if phi|if omega|\\[bdw]|^\{\d\} if|^v \{|\*omega|^- ?x|head")


def built_texts() -> Iterator[Marked]:
    """Texts of several words of which faults, remarks and messages are made, with {0} for what is put in."""
    for folder in (*BUILT_IN, *IN_ERRORS):
        for path in sorted((PACKAGE / folder).rglob("*.py")):
            name = path.relative_to(PACKAGE).as_posix()
            if name not in LIBRARY_ALONE:
                yield from built_in_module(path.read_text("utf-8"), f"flywheel/{name}", folder in IN_ERRORS)


def built_in_module(source: str, name: str, in_errors: bool = False) -> Iterator[Marked]:
    """The texts of several words of one module, but for docstrings, formulas and errors of a programmer.

    in_errors: only those within calls that make an error or a fault.
    """
    tree = ast.parse(source)
    silent, within = set[int](), set[int]()
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef)):
            silent |= {id(line.value) for line in node.body if isinstance(line, ast.Expr)}
        elif isinstance(node, ast.JoinedStr):
            silent |= {id(part) for part in node.values if isinstance(part, ast.Constant)}
            specs = [part.format_spec for part in node.values if isinstance(part, ast.FormattedValue) and part.format_spec]
            silent |= {id(part) for spec in specs for part in ast.walk(spec)}
        elif isinstance(node, ast.Call):
            called = getattr(node.func, "id", getattr(node.func, "attr", ""))
            silent |= {id(part) for part in ast.walk(node)} if called in _SILENT else set()
            within |= {id(part) for part in ast.walk(node)} if in_errors and called in _ERRORS else set()
        if isinstance(node, ast.FunctionDef) and node.name == "__repr__":
            silent |= {id(part) for part in ast.walk(node)}
    for node in ast.walk(tree):
        if id(node) in silent or (in_errors and id(node) not in within):
            continue
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
        elif isinstance(node, ast.JoinedStr):
            text = "".join(part.value if isinstance(part, ast.Constant) else "{0}" for part in node.values)  # type: ignore[misc]
        else:
            continue
        text = numbered(text)
        bare = re.sub(r'\{\d+\}|"[^"]*"', "", text)
        if (
            " " in text
            and re.search("[A-Za-z]{2}", bare)
            and not (_FORMULA.search(text) or is_formula(text) or all(map(_UNIT.fullmatch, text.split())))
        ):
            yield Marked(f"{name}:{node.lineno}", text)


_NAME = re.compile("[A-Za-z]|min|max|sin|cos|asin|acos|sqrt|integral|pi|eta|hm|omega|theta|delta|alpha|rho|lamda|tau|rms|po")


def is_formula(text: str) -> bool:
    """Tests whether a text is a formula, the same in every language: names of quantities, functions and operators.

    >>> is_formula("T_b = lamda*T_n"), is_formula("delta {0} rho"), is_formula("a start by star-delta")
    (True, True, False)
    """
    words = re.findall("[A-Za-z]+", re.sub(r"atan2|\{\d\}", "", text))
    return re.search(r"[-*/+=({]", text) is not None and all(map(_NAME.fullmatch, words))


_UNIT = re.compile(
    r"\{\d\}|[\d.]+|on|=|phi|value|([kMm]?[NJWmsgVH]|M?Pa|bar|kgf|l|rad|deg|rpm|Hz|ohm)[\^\d²]*(/(rad|mm|min|m|s)[\^\d²]*)?"
)
NOT_TRANSLATED = frozenset(  # names of units that people write, what a programmer's call is told, what is told by its parts
    [
        *("U Umdr Umdrehung vuelta turn tr tour r giri revolution", "upm vpm", "grado degree Grad", "radian radiane"),
        *("metre meter metro mètre mt", "millimetre millimeter milímetro milimetro", "pulg pulgada inch Zoll pouce"),
        *("foot feet pie", "sec seg second segundo Sekunde seconde", "minute minuto", "hr hour hora Stunde heure"),
        *("kilo kilogram kilogramme kilogramo", "gr gram gramo Gramm", "tonne tonelada", "kp kilopond", "watt vatio"),
        *("meter metre m", "kilogram kg", "gram g", "second s", "radian rad", "ampere A", "foot ft", "inch in", "pound lb"),
        *("changes of {0}", "a dict", "a TOML text", "the file {0}", "taken for {0}"),
        "a TOML text has several lines, or an equals sign",
        "a dict, the path of a TOML file, or a TOML text",
        *("joule julio", "percent pct Prozent", "a WheelAsked", "a Material, such as material('carbon steel')"),
        *("found {0}, expected {1}", "found {0}, expected {1}{2}", "line {0}", '{0} {1} such as "{2}"{3}'),
        *("a unit of {0} such as {1}", "{0} of {1}", '{0} on "{1}"', "and x {0} {1}"),
        'write {0} = {{1} = "{2}", ...}; see flywheel reference {3}',
        *(
            r"write abs(\1)",
            r"write a\1(...)",
            r"write \1(...)",
            r"write a\1\2(...)",
            r"write \1(\2)",
        ),  # of functions
        r"angles in an expression are in rad: write \1(...*pi/180)",
    ]
)


def numbered(text: str) -> str:
    """A text with its placeholders numbered as they come, without blanks around it."""
    pieces = _FIELD.split(text.strip())
    return "".join(piece + (f"{{{k}}}" if k + 1 < len(pieces) else "") for k, piece in enumerate(pieces))


# -- scripts and HTML --------------------------------------------------------------------------------------------------

_MARK = re.compile(r"(?<![\w.$])(?:_|text)\(\s*(?!\))")
_LITERAL = re.compile(r""""(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'|`(?:[^`\\$]|\\.|\$(?!\{))*`""")
_PLUS = re.compile(r"\s*\+\s*")
_COMMENT = re.compile(r"""("(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'|`(?:[^`\\]|\\.)*`)|//[^\n]*|/\*.*?\*/""", re.DOTALL)
_KEYS = re.compile(r"\s*,\s*\{([^{}]*)\}\s*,?\s*\)")
_ESCAPES = {"n": "\n", "t": "\t"}


def script_texts(folder: Path = PACKAGE) -> Iterator[Marked]:
    """The marked texts of all scripts of the page."""
    for path in sorted(folder.rglob("*.js")):
        yield from one_script(path.read_text("utf-8"), path.relative_to(folder.parent).as_posix())


def one_script(source: str, name: str) -> Iterator[Marked]:
    """The marked texts of a script; comments do not count, nor does the definition of `text` itself."""
    source = _COMMENT.sub(lambda found: found[1] or re.sub(r"[^\n]", " ", found[0]), source)
    for found in _MARK.finditer(source):
        if re.search(r"function\s+$", source[: found.start()]):
            continue
        place = f"{name}:{source.count(chr(10), 0, found.start()) + 1}"
        pieces, at = [], found.end()
        while piece := _LITERAL.match(source, at):
            pieces.append(_unquoted(piece[0]))
            plus = _PLUS.match(source, piece.end())
            at = plus.end() if plus else piece.end()
            if not plus:
                break
        if not pieces or source[at : at + 1].strip() not in (",", ")", ""):
            yield Marked(place, "", None, "marks something else than a text that stands there")
            continue
        yield Marked(place, "".join(pieces), _keys(source, at))


def _keys(source: str, at: int) -> frozenset[str] | None:
    if source[at:].lstrip().startswith(")"):
        return frozenset()
    given = _KEYS.match(source, at)
    names = [part.partition(":")[0].strip().strip("\"'") for part in given[1].split(",")] if given else [""]
    names = [name for name in names if name] if given else names
    return frozenset(names) if all(name.isidentifier() for name in names) else None


def _unquoted(literal: str) -> str:
    def char(found: re.Match[str]) -> str:
        code = found[1]
        if code[0] == "u":
            return chr(int(code[1:].strip("{}"), 16))
        return _ESCAPES.get(code, code)

    return re.sub(r"\\(u[0-9a-fA-F]{4}|u\{[0-9a-fA-F]+\}|.)", char, literal[1:-1])


class _Page(HTMLParser):
    """Gathers the texts and labels of an HTML file."""

    LABELS = ("aria-label", "title", "placeholder", "alt", "aria-description", "aria-roledescription")
    EMPTY = ("meta", "link", "input", "br", "hr", "img", "base", "col", "source", "wbr")

    def __init__(self, name: str) -> None:
        super().__init__(convert_charrefs=True)
        self.name, self.found = name, list[Marked]()
        self.open = list[tuple[str, bool]]()

    @property
    def silent(self) -> bool:
        return any(kept for _, kept in self.open)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        keep = tag in ("script", "style", "svg", "code") or given.get("translate") == "no"
        if not (self.silent or keep):
            for label in self.LABELS:
                self.add(given.get(label) or "")
        if tag not in self.EMPTY:
            self.open.append((tag, keep))

    def handle_endtag(self, tag: str) -> None:
        while self.open and self.open.pop()[0] != tag:
            pass

    def handle_data(self, data: str) -> None:
        if not self.silent:
            self.add(data)

    def add(self, text: str) -> None:
        words = " ".join(text.split())
        if any(c.isalpha() for c in words):
            self.found.append(Marked(f"{self.name}:{self.getpos()[0]}", words, frozenset()))


def html_texts(folder: Path = PACKAGE) -> Iterator[Marked]:
    """The texts and labels of all HTML files."""
    for path in sorted(folder.rglob("*.html")):
        yield from one_html(path.read_text("utf-8"), path.relative_to(folder.parent).as_posix())


def one_html(source: str, name: str) -> list[Marked]:
    """The texts and labels of an HTML file."""
    page = _Page(name)
    page.feed(source)
    page.close()
    return page.found


# -- what is shown -----------------------------------------------------------------------------------------------------

_STAY = frozenset(("min", "rad", "rev", "rpm", "deg", "turn", "kg", "mm", "lb", "lbf", "hp", "in", "ft"))  # units in both


class _LivePage(_Page):
    """Gathers what a finished page shows, drawings and what the page itself translates among it."""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        named = tag == "option" and given.get("lang") is not None  # a language, by its own name
        keep = named or tag in ("head", "script", "style", "code", "kbd", "textarea", "annotation")
        if not (self.silent or keep):
            for label in self.LABELS:
                self.add(given.get(label) or "")
        if tag not in self.EMPTY:
            self.open.append((tag, keep))


def shown(source: str) -> list[str]:
    """The texts and labels that a finished page shows."""
    page = _LivePage("page")
    page.feed(source)
    page.close()
    return [result.text for result in page.found]


def left(english: str, translated: str, scene: str) -> list[str]:
    """Texts of two and more words that a page has in both languages, and that are none of the scene's own.

    A body of a mechanism, such as "rod (press)", has the names that the scene gives to both.
    """
    own, names = " ".join(scene.split()), set(re.findall(r"\w+", scene))
    both = {text for text in set(shown(english)) & set(shown(translated)) if " " in text and text not in own}
    bodies = {text for text in both if (parts := re.fullmatch(r"(\w+) \((\w+)\)", text)) and set(parts.groups()) <= names}
    return sorted(text for text in both - bodies if len(_words(text)) > 1)


def _words(text: str) -> list[str]:
    """The words of a text, without units and names such as crank_pin or crank.length."""
    result = re.findall(r"(?<![\w.:])[A-Za-z]{2,}(?![\w*:]|\.\w)", text)
    return [word for word in result if word not in _STAY]


# -- catalogues --------------------------------------------------------------------------------------------------------

_STRING = re.compile(r'"(?:[^"\\]|\\.)*"')


def catalogue(path: Path) -> Iterator[Entry]:
    """The entries of a catalogue, those too that lack their translation; its head is left out."""
    kept: dict[str, str] = {}
    part, line, fuzzy = "", 0, False
    for k, written in enumerate([*path.read_text("utf-8").splitlines(), 'msgid ""'], 1):
        stripped = written.strip()
        if stripped.startswith("msgid"):
            if kept.get("msgid"):
                yield Entry(f"{path.parent.name}/{path.name}:{line}", kept["msgid"], kept.get("msgstr", ""), fuzzy)
                fuzzy = False
            kept, line = {}, k
        if stripped.startswith("#"):
            if kept.get("msgstr") is not None and kept.get("msgid"):
                yield Entry(f"{path.parent.name}/{path.name}:{line}", kept["msgid"], kept["msgstr"], fuzzy)
                kept, fuzzy = {}, False
            fuzzy = fuzzy or (stripped.startswith("#,") and "fuzzy" in stripped)
            continue
        if word := re.match(r"msg\w+", stripped):
            part = word[0]
        if part and stripped:
            kept[part] = kept.get(part, "") + "".join(ast.literal_eval(text) for text in _STRING.findall(stripped))


def fields(text: str) -> frozenset[str]:
    """The names of what is put into a text."""
    return frozenset(name for _, name, _, _ in string.Formatter().parse(text) if name is not None)


def marked() -> list[Marked]:
    """Every marked text."""
    return [*python_texts(), *script_texts(), *html_texts()]


def languages() -> list[str]:
    """The languages that have catalogues."""
    return [language for language in LANGUAGES if language != "en"]


def entries(language: str) -> list[Entry]:
    """The entries of a language's catalogues."""
    return [entry for path in sorted((PACKAGE / "language" / language).glob("*.po")) for entry in catalogue(path)]


BY_VARIABLES = ("faults.po", "form.po")
"""Catalogues whose texts are told without marks: templates of what is put together, keys of the scene format."""
BY_NAME = ("flywheel/page/form.py", "flywheel/pictures/__init__.py")
"""Modules that mark keys of the scene format and names of bodies, which are not written there."""


# -- findings ----------------------------------------------------------------------------------------------------------


def missing(texts: list[Marked], language: str) -> list[Marked]:
    """Texts without a translation, each once."""
    known = {entry.text for entry in entries(language) if entry.translation}
    first = {text.text: text for text in reversed(texts) if not text.fault and text.text not in known}
    return sorted(first.values())


def findings(texts: list[Marked], language: str) -> list[str]:
    """Faults, a line each: texts without translation, placeholders that differ, stale, fuzzy, or translated twice."""
    lines = [f"{text.place}: {text.fault}" for text in texts if text.fault and not text.place.startswith(BY_NAME)]
    lines += [f'{text.place}: "{text.text}" has no translation ({language})' for text in missing(texts, language)]
    for text in texts:
        if text.values and text.values != _fields(text.text):
            lines.append(f'{text.place}: "{text.text}" is given {sorted(text.values)}')
    used = {text.text for text in texts if not text.fault}
    by_variables = tuple(f"{language}/{name}" for name in BY_VARIABLES)
    seen: dict[str, Entry] = {}
    for entry in entries(language):
        if entry.fuzzy:
            lines.append(f'{entry.place}: "{entry.text}" is marked fuzzy')
        if not entry.translation:
            lines.append(f'{entry.place}: "{entry.text}" is not translated')
        elif _fields(entry.text) != _fields(entry.translation) and not entry.place.startswith(f"{language}/faults.po"):
            lines.append(f'{entry.place}: "{entry.text}" and "{entry.translation}" take different values')
        if entry.text not in used and not entry.place.startswith(by_variables):
            lines.append(f'{entry.place}: "{entry.text}" stands nowhere')
        if entry.place.startswith(f"{language}/faults.po"):
            continue  # a marked text that reads the same goes before
        if (other := seen.setdefault(entry.text, entry)).translation != entry.translation:
            lines.append(f'{entry.place}: "{entry.text}" is told otherwise in {other.place}')
    return sorted(set(lines))


def _fields(text: str) -> frozenset[str]:
    try:
        return fields(text)
    except ValueError:  # a brace that is no placeholder: such a text takes no values
        return frozenset()


def main() -> int:
    """Tell what is wrong; how many lines."""
    texts, wrong = marked(), 0
    for language in languages():
        if "--missing" in sys.argv:
            for text in missing(texts, language):
                quoted = '"' + text.text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
                print(f'# {text.place}\nmsgid {quoted}\nmsgstr ""\n')
            continue
        lines = findings(texts, language)
        wrong += len(lines)
        print(*lines, f"{len(texts)} marked texts, {len(entries(language))} entries, {len(lines)} findings", sep="\n")
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
