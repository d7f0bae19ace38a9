"""Every text in both languages."""

import ast
import re

import pytest
from click.testing import CliRunner

import flywheel
from flywheel import Fault, report, starters
from flywheel.cli import main
from flywheel.language import message, use
from tests.language import texts
from tests.limits import sample
from tests.page.browsers import EXAMPLES

# No text that is marked lacks its translation; and the gatherer sees what is marked, wherever it stands.


@pytest.mark.parametrize("language", texts.languages())
def test_no_text_of_report_or_page_lacks_its_translation(language):
    result = texts.findings(texts.marked(), language)
    assert result == []


FIRST_WORDS = re.compile(
    r"(What|Where|How|Whether|Which|When|Why|Who|By|Of|For|From|At|As|In|Those|That|So|Everything|Nothing|Something|Its|Their"
    r"|Our|Before|Without|More|Some|Another|Other|No|If)\b"
)
"""With which no docstring of a function begins: it begins with a verb in the third person or a noun of what it returns."""


def test_a_function_says_what_it_does_or_returns():
    result = []
    for path in (*texts.PACKAGE.rglob("*.py"), *(texts.ROOT / "bondgraph").rglob("*.py")):
        source = path.read_text("utf-8")
        suspect = re.search(r'"""\s*' + FIRST_WORDS.pattern, source)  # only then is it worth the time of a parse
        for node in ast.walk(ast.parse(source)) if suspect else ():
            text = (ast.get_docstring(node) or "") if isinstance(node, ast.FunctionDef) else ""
            if FIRST_WORDS.match(text):
                result.append(f"{path.relative_to(texts.ROOT)}:{node.lineno}: {text.splitlines()[0]}")
    assert result == []


@pytest.mark.slow
@pytest.mark.parametrize("language", texts.languages())
def test_no_fault_remark_or_message_lacks_its_translation(language):
    known = {entry.text for entry in texts.entries(language) if entry.translation} | texts.NOT_TRANSLATED
    assert [f"{text.place}: {text.text}" for text in texts.built_texts() if text.text not in known] == []


def test_an_inserted_part_is_joined_by_the_grammar_of_the_language():
    with use("es"):
        assert Fault("drive", "nothing", "a motor").description.startswith(": no hay nada, se esperaba")
        assert Fault("drive", "a motor", "no drive").description == ": hay un motor, se esperaba ningún accionamiento"


def test_a_fault_is_told_by_its_parts():
    fault = Fault(
        "mechanism.rod.length", '"0,6 m"', 'a length such as "250 mm" or a bare number in m', "write 0.6, not 0,6", 5
    )
    expected = 'una longitud como "250 mm" o un número sin unidad en m; escriba 0.6, no 0,6'
    with use("es"):
        assert fault.description == f' (línea 5): hay "0,6 m", se esperaba {expected}'
    assert "found" in fault.description
    keys = Fault("load[0].x", 'key "x"', "a known key", "valid here: bore, from, on, to")
    with use("es"):
        assert keys.description.endswith("; válidos aquí: bore, from, on, to")


@pytest.mark.parametrize(
    ("english", "spanish"),
    [
        ('"a table of units"', '"a table of units"'),
        ("the crank pin runs at 401.5 m/s", "el botón de la manivela corre a 401,5 m/s"),
        ('write "0.5 mm" if millimetres are meant', 'escriba "0.5 mm" si quiere decir milímetros'),
        ("nobody has heard of this", "nobody has heard of this"),
        ("nobody has heard of this and of that at all", "nobody has heard of this and of that at all"),
        (
            "friction in joints is that of the motion's own speed and acceleration; "
            "at a constant 12.5 rad/s it would give 74.3 kg m^2, 0.3 % more",
            "el rozamiento en las articulaciones es el de la velocidad y aceleración del propio movimiento; "
            "a una velocidad constante de 12,5 rad/s daría 74,3 kg m^2, un 0,3 % más",
        ),
        (
            "stalled at crank angle 30 deg after 2.5 s: M* at rest is 5 N m, before losses in meshes",
            "calada con la manivela a 30 deg tras 2,5 s: M* en reposo es 5 N m, antes de las pérdidas de los engranes",
        ),
        (
            "the crank stops 20.5 deg before stop_at; it would stop there with its brake put on at about 335 deg, "
            "or with a brake of about 400 N m",
            "la manivela se para 20,5 grados antes de stop_at; se pararía en stop_at con su freno aplicado a unos 335 "
            "grados, o con un freno de unos 400 N m",
        ),
        (
            "rtol 1e-09 not reached: 0.2 J of net work (0.01 of the swing) are left over in the cycle, and may belong "
            "anywhere in it: the exact inertia is good to 0.01, the work is good to 0.01",
            "rtol 1e-09 no alcanzado: quedan de sobra en el ciclo 0,2 J de trabajo neto (0,01 de la variación), que pueden "
            "estar en cualquier punto de él: inercia exacta con un error de 0,01, trabajo con un error de 0,01",
        ),
    ],
)
def test_a_message_is_told_with_what_is_in_quotes_left_alone(english, spanish):
    with use("es"):
        assert message(english) == spanish


def test_a_module_is_read_by_the_names_it_imports():
    source = (
        "from flywheel.language import text as _\nfrom flywheel import language\n"
        '_("a {n} " "b", n=1)\nlanguage.text("c")\n_(x)\nother.text("d")\ntext("e")\n'
    )
    result = list(texts.module_texts(source, "m"))
    assert [(text.text, text.values) for text in result] == [("a {n} b", {"n"}), ("c", frozenset()), ("", None)]
    assert [bool(text.fault) for text in result] == [False, False, True]


@pytest.mark.parametrize(
    ("written", "text", "values"),
    [
        ('_("a {n} b", {n: 3})', "a {n} b", {"n"}),
        ("text('it\\'s', {a, \"b\": 2})", "it's", {"a", "b"}),
        ('_("one " +\n  `two`)', "one two", frozenset()),
        ('_("\\u00b0 x", values)', "° x", None),
        ('node.textContent = text("é")', "é", frozenset()),
    ],
)
def test_a_script_is_read_without_its_comments(written, text, values):
    (result,) = texts.one_script(f'// _("no")\nawait answer.text(); /* text("no") */ {written}', "x.js")
    assert (result.text, result.values, result.fault) == (text, values, "")


def test_a_script_that_marks_a_name_is_told():
    source = "export function text(message) {}\nhost.append(text(label));"
    (result,) = texts.one_script(source, "x.js")
    assert result.place == "x.js:2"
    assert result.fault


def test_html_gives_texts_and_labels_but_not_what_is_kept():
    page = '<p title="A b">Hello <b translate="no">X</b> you<br> all</p><script>var x</script><svg><text>z</text></svg>'
    assert [result.text for result in texts.one_html(page, "i.html")] == ["A b", "Hello", "you", "all"]


def test_a_catalogue_gives_all_its_entries(tmp_path):
    po = tmp_path / "x.po"
    po.write_text(
        'msgid ""\nmsgstr "Language: es\\n"\n\n# a.py:3\nmsgid "one"\nmsgstr ""\n"uno "\n"solo"\n\n'
        '#, fuzzy\nmsgid "two"\nmsgstr "dos"\n\nmsgid "three"\nmsgstr ""\n'
    )
    assert [(entry.text, entry.translation, entry.fuzzy) for entry in texts.catalogue(po)] == [
        ("one", "uno solo", False),
        ("two", "dos", True),
        ("three", "", False),
    ]


# A report in Spanish leaves no text in English, but for titles and names that the scene gives and sources that it cites.


SCENES = {
    "press": (EXAMPLES / "machines/press.toml").read_text("utf-8"),
    "motor-press": starters.starter("motor-press"),
    "geared-press": (EXAMPLES / "drive_lines/press.toml").read_text("utf-8"),
}
STAY = re.compile(r"Se:slider\.|MSe:drive\.torque|\w+ \([\w-]+\)")  # names of bonds in their graph, of bodies of a mechanism


def test_what_is_the_same_in_both_languages_is_told():
    page = '<h1 title="the same label">%s</h1><p>crank_pin</p><p>my own press</p><svg><text>turns a minute</text></svg>'
    result = texts.left(page % "one two", page % "uno dos", 'title = "my own press"')
    assert result == ["the same label", "turns a minute"]


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_no_text_of_a_report_is_left_in_english(name):
    scene = flywheel.load(SCENES[name])
    pages = [report.html(scene, language=language) for language in ("en", "es")]
    assert [text for text in texts.left(*pages, SCENES[name]) if not STAY.fullmatch(text)] == []


@pytest.mark.parametrize(
    ("command", "spanish", "english"),
    sample(
        [
            (["simulate", "--until", "0.3 s"], "Terminado con la manivela a ", "ended at"),
            (["motion"], "movimiento por unidad del elemento motriz", "per unit"),
            (["reactions", "--speed", "60 rpm", "--over", "time"], "fuerzas en los pares, a 60 rpm", "forces in the joints"),
            (["reduce"], "reducido a la manivela", "reduced to"),
        ],
        4,
    ),
)
def test_a_picture_is_drawn_in_spanish(command, spanish, english, tmp_path):
    picture = tmp_path / "picture.svg"
    scene = EXAMPLES / "machines/press_given.toml"
    result = CliRunner().invoke(main, [command[0], str(scene), *command[1:], "--language", "es", "--plot", str(picture)])
    assert result.exit_code == 0, result.output
    drawn = " ".join(re.findall(r">([^<>]+)</", picture.read_text("utf-8")))
    assert spanish in drawn
    assert english not in drawn.lower()


# What a terminal says: usage errors, files that cannot be written, faults of which a part has no translation.


@pytest.mark.parametrize(
    ("arguments", "spanish"),
    [
        (["size", "--language", "es"], "Error: Falta el argumento 'SCENE'."),
        (["size", "s.toml", "--foo", "--language=es"], "Error: No existe la opción '--foo'."),
        (
            ["motion", "s.toml", "--language", "es", "--at", "3"],
            "Error: Valor no válido de --at: '3' no es un ángulo",
        ),
        (["simulate", "s.toml", "--from", "3", "--language", "es"], "Error: Valor no válido de '--from': '3' no es rest ni"),
        (
            ["size", "s.toml", "--language", "es", "--plot", "no/p.png"],
            "no/p.png: no se puede escribir (no existe el",
        ),
        (
            ["motion", "s.toml", "--language", "es", "--law", "2*t"],
            "s.toml: until: hay una ley sin final, se esperaba cuánto dura",
        ),
    ],
)
def test_a_terminal_is_answered_in_its_language(arguments, spanish, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(starters.starter("slider-crank"))
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code in (1, 2)
    assert result.stderr.splitlines()[-1].startswith(spanish)
    usage = result.stderr.splitlines()[0]
    assert usage.startswith(f"Uso: main {arguments[0]} ") or result.exit_code == 1
