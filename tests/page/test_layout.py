"""The layout of page and report: no answer of any example is cut off at any width, and roots cover what they are of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

import flywheel
import flywheel.report
from flywheel import language
from flywheel.numerics.faults import SceneError
from flywheel.tables.summary import summary
from tests.page.browsers import EXAMPLES, answered, expected, until

if TYPE_CHECKING:
    from playwright.sync_api import Page

WIDTHS = (390, 768, 1024, 1152, 1280, 1366, 1440, 1536, 1680, 1920)

_CUT_OFF = """async (answers) => {
  const { showNumbers } = await import(new URL("static/numbers.js", location));
  const numbers = document.getElementById("numbers");
  const wide = (part) => part.scrollWidth > part.clientWidth + 1;
  return Object.entries(answers).flatMap(([name, blocks]) => {
    showNumbers(numbers, blocks);
    numbers.querySelectorAll("details").forEach((part) => (part.open = true));
    const parts = [document.documentElement, ...document.querySelectorAll("#results, #numbers, #numbers .wide-table")];
    return parts.filter(wide).map((part) => `${name}: ${part.scrollWidth} px in ${part.clientWidth}: ${part.textContent}`);
  });
}"""


_HEIGHTS = """() => [...document.querySelectorAll("msqrt")]
  .filter((root) => root.querySelector(":scope mfrac"))
  .map((root) => [root, root.querySelector("mfrac")].map((part) => part.getBoundingClientRect().height))"""


_ON_HATCHING = """() => {
  const boxes = (part) => [...document.querySelectorAll(`[data-panel=mechanism] svg ${part}`)]
    .map((one) => [one.textContent, one.getBoundingClientRect()]);
  const grounds = boxes('path[data-body=frame][fill=none][stroke-width="1"]');
  const names = boxes('text:not([visibility=hidden])');
  const common = (a, b, low, high) => Math.min(a[high], b[high]) - Math.max(a[low], b[low]);
  const deep = (a, b) => common(a, b, "top", "bottom") > 4 && common(a, b, "left", "right") > 0;
  const found = grounds.flatMap(([, ground]) => names.filter(([, name]) => deep(ground, name)).map(([words]) => words));
  return [grounds.length, names.length, found];
}"""


def answers() -> dict[str, list[Any]]:
    """The answers of all examples that can be sized, in both languages, and in English in US units."""
    found = {}
    for example in sorted(EXAMPLES.glob("*/*.toml")):
        try:
            sizing = flywheel.size(flywheel.load(example))
        except SceneError:
            continue
        for tongue, units in (("en", "si"), ("en", "us"), ("es", "si")):
            with language.use(tongue):
                blocks = [block.as_dict() for block in summary(sizing, units)]
            found[f"{example.stem}, {tongue}, {units}"] = blocks
    return found


@pytest.mark.slow
def test_no_answer_of_an_example_is_cut_off(page: Page) -> None:
    answered(page)
    given = answers()
    assert len(given) > 60
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 800})
        assert page.evaluate(_CUT_OFF, given) == [], f"at {width} px"


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
def test_a_page_that_is_printed_has_its_title_and_no_empty_panel(page: Page) -> None:
    """Nothing that only a screen needs, and figures that fill their sheets."""
    answered(page)
    page.locator("#chooser summary").click()
    page.evaluate("document.querySelector('[data-panel=motion] .why').hidden = false")  # as of one that cannot be drawn
    sheets = page.pdf(format="A4").count(b"/Type /Page\n")
    assert 2 <= sheets <= 4
    page.emulate_media(media="print")
    expected(page.locator("#title")).to_be_visible()
    expected(page.locator("[data-panel=moment]")).to_be_visible()
    for part in ("#scene", "#cursor", "#choices", "[data-panel=motion]", "[data-panel=moment] button", ".top button"):
        expected(page.locator(part).first).to_be_hidden()
    width = page.evaluate("document.getElementById('title').scrollWidth - document.getElementById('title').clientWidth")
    assert width <= 0


@pytest.mark.slow
@pytest.mark.parametrize("angle", ["0", "45", "90", "180", "270"])
def test_names_of_a_mechanism_stand_off_its_hatching(page: Page, angle: str) -> None:
    answered(page)
    page.locator("#angle").fill(angle)
    page.locator("#angle").press("Enter")
    until(page, "(angle) => document.querySelector('[role=slider]').ariaValueNow === angle", angle)
    grounds, names, found = page.evaluate(_ON_HATCHING)
    assert grounds == 2
    assert names >= 6
    assert found == []
