"""The scene and its file: saved only when asked for, never over what somebody else has written."""

import re

import pytest

from tests.page.browsers import drawn, expected, picture, shown, until

pytestmark = pytest.mark.slow


@pytest.fixture
def own(opened, window, watched):  # in this order: the window is closed before its server ends
    """A page with a server and a file of its own; that a save is refused stands on the console too."""
    watched.expected += ["409", "422"]
    served = opened()
    return drawn(shown(window().new_page(), served.address)), served.scene


def write(page, old, new):
    """Change the scene's text in the text view."""
    page.click("#as-text")
    area = page.locator("#text")
    area.fill(area.input_value().replace(old, new))
    page.locator("#unsaved:not(:empty)").wait_for()


def press(page, name):
    page.get_by_role("dialog").get_by_role("button", name=name, exact=True).click()


def test_the_file_is_replaced_only_after_a_question(own):
    page, scene = own
    before = scene.read_text()
    write(page, '"80 mm"', '"85 mm"')
    page.keyboard.press("Control+s")
    page.get_by_role("dialog").wait_for()
    assert scene.read_text() == before
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="detached")
    assert scene.read_text() == before
    page.click("#save")
    expected(page.locator(".differences li", has_text="85 mm")).to_have_count(1)
    press(page, "Save")
    page.locator("#unsaved:empty").wait_for(state="attached")
    assert scene.read_text() == before.replace('"80 mm"', '"85 mm"')


def test_another_name_and_a_name_that_is_taken(own):
    page, scene = own
    before = scene.read_text()
    other = scene.with_name("other.toml")
    other.write_text("title = 'mine'\n")
    write(page, '"80 mm"', '"85 mm"')
    page.click("#save-as")
    page.locator("#file-name").fill("other.toml")
    page.locator("#file-name").press("Enter")
    page.get_by_role("dialog").get_by_role("button", name="Cancel").wait_for()
    page.locator(".differences").wait_for()
    assert other.read_text() == "title = 'mine'\n"
    press(page, "Cancel")
    page.click("#save-as")
    page.locator("#file-name").fill("third.toml")
    press(page, "Save")
    page.locator("#notices", has_text="third.toml").or_(page.locator("#file", has_text="third.toml")).first.wait_for()
    assert '"85 mm"' in scene.with_name("third.toml").read_text()
    assert (scene.read_text(), other.read_text()) == (before, "title = 'mine'\n")


@pytest.mark.parametrize("name", ["../out.toml", "/tmp/flywheel_out.toml"])
def test_a_name_elsewhere_is_refused(own, name):
    page, scene = own
    write(page, '"80 mm"', '"85 mm"')
    page.click("#save-as")
    page.locator("#file-name").fill(name)
    press(page, "Save")
    page.locator("#notices", has_text="not saved").wait_for()
    assert not scene.parent.parent.joinpath("out.toml").exists()
    assert {path.suffix for path in scene.parent.iterdir()} <= {".toml", ".csv"}


def test_a_change_on_the_disk_is_told_and_not_overwritten(own):
    page, scene = own
    write(page, '"80 mm"', '"85 mm"')
    theirs = scene.read_text().replace('"480 mm"', '"500 mm"')
    scene.write_text(theirs)
    page.locator("#notices", has_text="changed").wait_for()
    picture(page, "changed")
    page.click("#save")
    page.get_by_role("dialog").wait_for()
    assert scene.read_text() == theirs
    press(page, "Cancel")
    page.locator("#notices").get_by_role("button", name="Take theirs").click()
    expected(page.locator("#text")).to_have_value(theirs)
    page.keyboard.press("Control+z")
    until(page, "() => document.getElementById('text').value.includes('\"85 mm\"')")
    assert scene.read_text() == theirs


def test_two_pages_on_one_scene_lose_nothing(own):
    page, scene = own
    before = scene.read_text()
    other = drawn(shown(page.context.new_page(), page.url))
    write(page, '"80 mm"', '"85 mm"')
    write(other, '"480 mm"', '"500 mm"')
    page.click("#save")
    press(page, "Save")
    page.locator("#unsaved:empty").wait_for(state="attached")
    assert scene.read_text() == before.replace('"80 mm"', '"85 mm"')
    other.click("#save")
    other.get_by_role("dialog").wait_for()
    press(other, "Save" if other.get_by_role("dialog").get_by_role("button", name="Save", exact=True).count() else "Cancel")
    other.locator("#notices", has_text="changed").or_(other.get_by_role("dialog")).first.wait_for()
    assert scene.read_text() == before.replace('"80 mm"', '"85 mm"')
    expected(other.locator("#text")).to_have_value(re.compile('"500 mm"'))


def test_edits_that_were_not_saved_come_back(own):
    page, scene = own
    write(page, '"80 mm"', '"85 mm"')
    page.on("dialog", lambda dialog: dialog.accept())
    page.reload()
    page.get_by_role("button", name="Bring them back").click()
    page.click("#as-text")
    expected(page.locator("#text")).to_have_value(re.compile('"85 mm"'))
    assert '"80 mm"' in scene.read_text()
