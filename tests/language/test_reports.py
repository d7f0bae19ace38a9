"""A report in Spanish leaves no text in English, but for titles and names that the scene gives and sources that it cites."""

import pytest

import flywheel
from flywheel import report, starters
from tests.language import texts
from tests.page.browsers import EXAMPLES

SCENES = {
    "press": (EXAMPLES / "machines/press.toml").read_text("utf-8"),
    "motor-press": starters.starter("motor-press"),
    "geared-press": (EXAMPLES / "drive_lines/press.toml").read_text("utf-8"),
}
STAY = {"Se:slider.", "MSe:drive.torque"}  # names of bonds in their graph


def test_what_is_the_same_in_both_languages_is_told():
    page = '<h1 title="the same label">%s</h1><p>crank_pin</p><p>my own press</p><svg><text>turns a minute</text></svg>'
    found = texts.left(page % "one two", page % "uno dos", 'title = "my own press"')
    assert found == ["the same label", "turns a minute"]


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_no_text_of_a_report_is_left_in_english(name):
    scene = flywheel.load(SCENES[name])
    pages = [report.html(scene, language=language) for language in ("en", "es")]
    assert [text for text in texts.left(*pages, SCENES[name]) if text not in STAY] == []
