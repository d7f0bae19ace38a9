"""The layout of page and report, on screen and on paper: nothing is cut off, names stand apart, axe finds nothing.

In Spanish no text is left in English.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import flywheel
import flywheel.report
from flywheel import language
from flywheel.motions.single_stroke import single_stroke
from flywheel.page import data
from flywheel.page.data import Subject
from flywheel.page.edits import Draft
from flywheel.page.form import as_groups
from flywheel.report import document as documents
from flywheel.report.document import Figure, Part, Section
from tests.language import texts
from tests.page.browsers import EXAMPLES, Served, answered, drawn, expected, in_sight, picture, shown, until, violations

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page

WIDTHS = (390, 768, 1024, 1280, 1440, 1536, 1920, 2560)
SCENES = {
    folder: sorted(EXAMPLES.glob(f"{folder}/*.toml"))
    for folder in ("bond_graphs", "designs", "drive_lines", "exams", "linkages", "machines", "regimes")
}

_SHOW = """async ({ groups, answer, texts, tongue, units }) => {
  const load = (name) => import(new URL(`static/${name}.js`, location));
  const [{ speak }, { renewForm }, { showNumbers }, { showPanels }] = await Promise.all(
    ["language", "form", "numbers", "panels"].map(load),
  );
  speak(tongue, texts);
  renewForm(groups, "another");
  showNumbers(document.getElementById("numbers"), answer.numbers);
  showPanels(answer, units, true);
  document.querySelectorAll("#numbers details").forEach((part) => (part.open = true));
}"""

_CUT_OFF = """async () => {
  const wide = (part) => part.scrollWidth > part.clientWidth + 1;
  const parts = [document.documentElement, ...document.querySelectorAll(
    "#form, #form fieldset, #form select, #results, #numbers, #numbers .wide-table, .panel, .panel .host, .panel h3")];
  const cut = parts.filter(wide).map((part) =>
    `${part.id || part.className}: ${part.scrollWidth} px in ${part.clientWidth}: ${part.textContent.slice(0, 80)}`);
  const clashes = [...document.querySelectorAll("#panels svg")].flatMap((svg) => {
    const [box, bad] = [svg.getBoundingClientRect(), []];
    const title = svg.closest("[data-panel]").dataset.panel;
    const names = [...svg.querySelectorAll("text")]
      .filter((each) => each.textContent.trim() && each.getAttribute("visibility") !== "hidden")
      .map((each) => [each.textContent, each.getBoundingClientRect()]);
    names.forEach(([words, a], k) => {
      const outside = a.left < box.left - 1 || a.right > box.right + 1 || a.bottom > box.bottom + 1;
      if (outside) bad.push(`${title}: ${words} outside`);
      for (const [others, b] of names.slice(k + 1)) {
        const x = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const y = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        if (x > 2 && y > 4) bad.push(`${title}: ${words} | ${others}`);
      }
    });
    return bad;
  });
  return [...cut, ...clashes];
}"""


_WIDER = """() => {
  const edge = document.body.getBoundingClientRect().right + 1;
  const over = (part) => part.getBoundingClientRect().right > edge;
  const scrolled = (part) => part.scrollWidth > part.clientWidth + 1;
  const found = [...document.querySelectorAll("body *:not(svg *)")].filter(over);
  const parts = [document.documentElement, ...document.querySelectorAll(".formula, .scroll")].filter(scrolled);
  return [...found, ...parts].map((part) => `${part.closest("[id]")?.id} ${part.tagName}: ${part.textContent.slice(0, 80)}`);
}"""


_HEIGHTS = """() => [...document.querySelectorAll("msqrt")]
  .filter((root) => root.querySelector(":scope mfrac"))
  .map((root) => [root, root.querySelector("mfrac")].map((part) => part.getBoundingClientRect().height))"""


_PRINTED = """() => {
  dispatchEvent(new Event("beforeprint"));
  const figures = [...document.querySelectorAll(".panel:has(svg)")].filter((panel) => panel.checkVisibility());
  const texts = figures.map((panel) => panel.querySelector("svg")).flatMap((svg) => {
    const scale = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
    return [...svg.querySelectorAll("text")].map((text) => 0.75 * scale * Number(text.getAttribute("font-size")));
  });
  const columns = new Set(figures.map((panel) => panel.getBoundingClientRect().left));
  return { least: Math.min(...texts), panels: figures.length, columns: columns.size };
}"""


_NAMES = """() => {
  const svg = document.querySelector("[data-panel=mechanism] svg");
  const range = document.getElementById("angle-range");
  const found = { grounds: 0, names: 0, bad: [] };
  const apart = (a, b) => a.right < b.left + 1 || b.right < a.left + 1 || a.bottom < b.top + 3 || b.bottom < a.top + 3;
  for (let n = 0; n < 36; n++) {
    range.value = Number(range.min) + (n / 36) * (range.max - range.min);
    range.dispatchEvent(new Event("input"));
    const still = svg.querySelectorAll("[data-body=frame]:is([data-kind=ground], [data-kind=arrow])");
    const points = [...still].flatMap((path) => {
      const on = path.getScreenCTM();
      const count = Math.floor(path.getTotalLength() / 3);
      return Array.from({ length: count }, (_, k) => path.getPointAtLength(3 * k).matrixTransform(on));
    });
    const names = [...svg.querySelectorAll("text")].map((text) => ({ text, box: text.getBoundingClientRect() }));
    Object.assign(found, { grounds: points.length, names: names.length });
    names.forEach(({ text, box }, k) => {
      const on = ({ x, y }) => x > box.left + 1 && x < box.right - 1 && y > box.top + 3 && y < box.bottom - 3;
      if (text.getAttribute("visibility") === "hidden") found.bad.push(`${n}: ${text.textContent} hidden`);
      else if (points.some(on)) found.bad.push(`${n}: ${text.textContent} on hatching`);
      const under = names.slice(0, k).find((other) => !apart(box, other.box));
      if (under) found.bad.push(`${n}: ${text.textContent} on ${under.text.textContent}`);
    });
  }
  return found;
}"""


def test_every_example_is_shown() -> None:
    assert {path for paths in SCENES.values() for path in paths} == set(EXAMPLES.glob("*/*.toml"))


@cache
def subject(example: Path) -> Subject:
    """The sizing or the stroke of an example; its scene if it has neither."""
    scene = flywheel.load(example)
    if scene.single_stroke is not None:
        return single_stroke(scene)
    return flywheel.size(scene) if scene.stroke is None and scene.has_flywheel and scene.has_speed else scene


@pytest.mark.slow
@pytest.mark.parametrize("folder", SCENES)
def test_nothing_of_a_page_is_cut_off_or_covered(page: Page, folder: str) -> None:
    """Form, numbers, verdicts, notes and the texts of figures, at every width, in both languages and systems of units."""
    answered(page)
    bad = []
    for example, (tongue, units) in product(SCENES[folder], (("en", "si"), ("es", "us"))):
        with language.use(tongue):
            draft = Draft(example.read_text("utf-8"))
            groups = as_groups(draft.form, draft.outline, ())
            answer = data.answer(subject(example), units=units)
        texts = dict(language.catalogue(tongue)) if tongue != "en" else {}
        del answer["faults"]
        page.evaluate(_SHOW, {"groups": groups, "answer": answer, "texts": texts, "tongue": tongue, "units": units})
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 800})
            in_sight(page)
            bad += [f"{example.stem}, {tongue}, {units}, {width} px: {each}" for each in page.evaluate(_CUT_OFF)]
    assert not bad, "\n".join(bad)


@pytest.mark.slow
@pytest.mark.parametrize("folder", SCENES)
def test_nothing_of_a_report_is_wider_than_its_sheet(window: Any, tmp_path: Path, folder: str) -> None:
    """On A4 within its margins, and on every screen; a telephone scrolls within formulas and tables alone.

    Figures are as wide as their column whatever they show: blank ones stand for them.
    """
    page = window(viewport={"width": 673, "height": 1032}).new_page()
    report = tmp_path / "report.html"
    bad = []
    for example, tongue in product(SCENES[folder], ("en", "es")):
        with language.use(tongue):
            document = flywheel.report.worked(subject(example))
            report.write_text(documents.html(replace(document, parts=blank(document.parts))), "utf-8")
        page.emulate_media(media="print")
        page.set_viewport_size({"width": 673, "height": 1032})
        page.goto(report.as_uri())
        until(page, "() => [...document.fonts].every((font) => font.status === 'loaded')")
        assert page.locator("h2").count() >= 2
        bad += [f"{example.stem}, {tongue}, on paper: {each}" for each in page.evaluate(_WIDER)]
        page.emulate_media(media="screen")
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 800})
            inner = page.evaluate("document.documentElement.scrollWidth")
            wide = page.evaluate(_WIDER) if width > 390 else []
            bad += [f"{example.stem}, {tongue}, {width} px: {each}" for each in (*wide, *([inner] if inner > width else []))]
    assert not bad, "\n".join(bad)


def blank(parts: Iterable[Part]) -> tuple[Part, ...]:
    """Parts of a report with blank figures."""
    empty = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 4 3"></svg>'
    return tuple(
        replace(part, parts=blank(part.parts))
        if isinstance(part, Section)
        else replace(part, svg=empty)
        if isinstance(part, Figure)
        else part
        for part in parts
    )


@pytest.mark.slow
def test_roots_and_brackets_of_a_report_cover_what_is_under_them(window: Any, tmp_path: Any) -> None:
    """By the font that the file carries, whatever fonts the system has."""
    report = tmp_path / "report.html"
    flywheel.report.write(flywheel.load(EXAMPLES / "machines/press.toml"), report)
    page = window().new_page()
    page.goto(report.as_uri())
    until(page, "() => [...document.fonts].map((font) => font.status).join() === 'loaded'")
    until(page, "() => getComputedStyle(document.querySelector('math')).fontFamily.startsWith('\"Flywheel Math\"')")
    heights = page.evaluate(_HEIGHTS)
    assert len(heights) >= 3
    assert all(root >= fraction + 2.0 for root, fraction in heights), heights


@pytest.mark.slow
@pytest.mark.parametrize(("example", "tongue"), [("machines/press.toml", "en"), ("linkages/six_bar.toml", "es")])
def test_a_page_that_is_printed_has_its_title_and_no_empty_panel(
    opened: Callable[..., Served], window: Callable[..., BrowserContext], example: str, tongue: str
) -> None:
    """Nothing that only a screen needs; figures in two columns, whose texts can be read."""
    page = answered(shown(window().new_page(), opened(example, "--language", tongue).address))
    page.locator("#chooser summary").click()
    page.evaluate("document.querySelector('[data-panel=motion] .why').hidden = false")  # as of one that cannot be drawn
    pages = page.pdf(format="A4", prefer_css_page_size=True).count(b"/Type /Page\n")
    assert 2 <= pages <= 3
    assert page.evaluate("document.querySelector('[data-panel=moment] svg').viewBox.baseVal.width") > 600  # as before
    page.set_viewport_size({"width": 703, "height": 1032})  # of an A4 sheet within its margins
    page.emulate_media(media="print")
    expected(page.locator("#title")).to_be_visible()
    expected(page.locator("[data-panel=moment]")).to_be_visible()
    for part in ("#form", "#cursor", "#choices", "[data-panel=motion]", "[data-panel=moment] button", ".top button"):
        expected(page.locator(part).first).to_be_hidden()
    width = page.evaluate("document.getElementById('title').scrollWidth - document.getElementById('title').clientWidth")
    assert width <= 0
    printed = page.evaluate(_PRINTED)
    assert printed["least"] >= 6.0
    assert printed["panels"] >= 6
    assert printed["columns"] == 2


@pytest.mark.slow
def test_a_page_with_faults_is_printed_with_them(page: Page) -> None:
    page.locator('[data-field="mechanism.crank.length"] input').first.fill("-80")
    page.keyboard.press("Enter")
    page.locator("#faults li.fault").wait_for()
    page.emulate_media(media="print")
    expected(page.locator("#faults li.fault")).to_be_visible()
    expected(page.locator("#form")).to_be_hidden()


@pytest.mark.slow
@pytest.mark.parametrize("example", ["machines/press.toml", "machines/shaper.toml", "machines/pump.toml"])
def test_names_of_a_mechanism_stand_off_its_hatching_arrow_and_one_another(
    opened: Callable[..., Served], window: Callable[..., BrowserContext], example: str
) -> None:
    """At every angle, on a phone, in the narrowest of two columns and in one wide card; none is left out."""
    page = answered(shown(window().new_page(), opened(example).address))
    for width in (390, 1280, 1366):
        page.set_viewport_size({"width": width, "height": 800})
        page.wait_for_timeout(200)
        result = page.evaluate(_NAMES)
        assert result["grounds"] >= 20
        assert result["names"] >= 6
        assert result["bad"] == [], f"at {width} px"


# What axe-core finds: nothing, in light, dark, on a phone, as form and text, in dialogs, with faults, and in the report.


WINDOWS: dict[str, Any] = {
    "light": {"color_scheme": "light"},
    "dark": {"color_scheme": "dark"},
    "phone": {"viewport": {"width": 360, "height": 740}, "color_scheme": "light"},
    "phone-dark": {"viewport": {"width": 360, "height": 740}, "color_scheme": "dark"},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", WINDOWS)
def test_the_page(name: str, window: Callable[..., BrowserContext], press: Served) -> None:
    page = answered(shown(window(**WINDOWS[name]).new_page(), press.address))
    picture(page, f"axe-{name}", full_page=True)
    assert violations(page) == []
    page.click("#as-text")
    page.locator("#chooser summary").click()
    picture(page, f"axe-{name}-text")
    assert violations(page) == []
    if name.startswith("phone"):
        until(page, "() => document.documentElement.scrollWidth <= 360")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_dialogs(scheme: str, window: Callable[..., BrowserContext], press: Served) -> None:
    page = drawn(shown(window(color_scheme=scheme).new_page(), press.address))
    for dialog in ("#new", "#save-as", "#report", "#help"):
        page.click(dialog)
        page.get_by_role("dialog").wait_for()
        picture(page, f"axe-dialog-{dialog[1:]}-{scheme}")
        assert violations(page) == []
        page.keyboard.press("Escape")
        page.get_by_role("dialog").wait_for(state="detached")


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_faults_and_help(scheme: str, window: Callable[..., BrowserContext], press: Served) -> None:
    page = drawn(shown(window(color_scheme=scheme).new_page(), press.address))
    page.click("#as-text")
    area = page.locator("#text")
    area.fill(area.input_value().replace('"80 mm"', '"-80 mm"'))
    page.locator("#faults li.fault").wait_for()
    assert violations(page) == []
    page.click("#as-form")
    page.locator(".help").first.click()
    picture(page, f"axe-faults-{scheme}")
    assert violations(page) == []


@pytest.mark.slow
@pytest.mark.parametrize("tongue", ["en", "es"])
def test_the_report(tongue: str, window: Callable[..., BrowserContext], press: Served, tmp_path: Path) -> None:
    page = drawn(shown(window().new_page(), press.address))
    page.click("#report")
    page.get_by_role("dialog").locator(f'input[name="tongue"][value="{tongue}"]').check()
    with page.expect_download(timeout=300_000) as coming:
        page.get_by_role("dialog").locator("button.main").click()
    report = tmp_path / "report.html"
    coming.value.save_as(report)
    page.goto(report.as_uri())
    picture(page, f"report-{tongue}", full_page=True)
    assert violations(page) == []


# The page in Spanish: no text is left in English but for titles and names of the scene, in its dialogs neither.


FLYWHEEL = {"en": "flywheel", "es": "volante"}


def stated(page, language):
    """All that the page and its dialogs show in a language, as HTML."""
    page.locator("#language").select_option(language)
    page.locator("#numbers", has_text=FLYWHEEL[language]).wait_for()
    answered(page)
    result = [page.content()]
    for button in ("#new", "#save-as", "#report", "#help"):
        page.click(button)
        dialog = page.get_by_role("dialog")
        dialog.locator("option").evaluate_all("titles => titles.forEach((title) => title.remove())")
        result.append(dialog.inner_html())
        page.keyboard.press("Escape")
        dialog.wait_for(state="detached")
    return "".join(result)


@pytest.mark.slow
def test_no_text_is_left_in_english(page, press):
    answered(page)
    english, spanish = stated(page, "en"), stated(page, "es")
    picture(page, "spanish", full_page=True)
    left = texts.left(english, spanish, press.scene.read_text("utf-8"))
    assert left == [], "\n".join(left)


@pytest.mark.slow
def test_faults_are_told_in_spanish(page, press):
    page.click("#as-text")
    area = page.locator("#text")
    area.fill(area.input_value().replace('"80 mm"', '"-80 mm"').replace("[regime]", "[regimen]"))
    page.locator("#faults li.fault").first.wait_for()
    english = page.locator("#faults").inner_html()
    page.locator("#language").select_option("es")
    page.locator("#faults h3", has_text="error").first.wait_for()
    assert texts.left(english, page.locator("#faults").inner_html(), press.scene.read_text("utf-8")) == []
