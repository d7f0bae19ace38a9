"""The page in Spanish: no text is left in English but for titles and names of the scene, in its dialogs neither."""

import pytest

from tests.language import texts
from tests.page.browsers import answered, picture

pytestmark = pytest.mark.slow

FLYWHEEL = {"en": "flywheel", "es": "volante"}


def told(page, language):
    """All that the page and its dialogs show in a language, as HTML."""
    page.locator("#language").select_option(language)
    page.locator("#numbers", has_text=FLYWHEEL[language]).wait_for()
    answered(page)
    found = [page.content()]
    for button in ("#new", "#save-as", "#report", "#help"):
        page.click(button)
        dialog = page.get_by_role("dialog")
        dialog.locator("option").evaluate_all("titles => titles.forEach((title) => title.remove())")
        found.append(dialog.inner_html())
        page.keyboard.press("Escape")
        dialog.wait_for(state="detached")
    return "".join(found)


def test_no_text_is_left_in_english(page, press):
    answered(page)
    english, spanish = told(page, "en"), told(page, "es")
    picture(page, "spanish", full_page=True)
    left = texts.left(english, spanish, press.scene.read_text("utf-8"))
    assert left == [], "\n".join(left)


def test_faults_are_told_in_spanish(page, press):
    page.click("#as-text")
    area = page.locator("#text")
    area.fill(area.input_value().replace('"80 mm"', '"-80 mm"').replace("[regime]", "[regimen]"))
    page.locator("#faults li.fault").first.wait_for()
    english = page.locator("#faults").inner_html()
    page.locator("#language").select_option("es")
    page.locator("#faults h3", has_text="error").first.wait_for()
    assert texts.left(english, page.locator("#faults").inner_html(), press.scene.read_text("utf-8")) == []
