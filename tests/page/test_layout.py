"""The page's layout: no answer of any example is cut off at any width, in both languages and systems of units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

import flywheel
from flywheel import language
from flywheel.numerics.faults import SceneError
from flywheel.tables.summary import summary
from tests.page.browsers import EXAMPLES, answered

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
