"""What axe-core finds: nothing, in light, dark, on a phone, as form and text, in dialogs, with faults, and in the report."""

import pytest

from tests.page.browsers import answered, drawn, picture, shown, until, violations

pytestmark = pytest.mark.slow

WINDOWS = {
    "light": {"color_scheme": "light"},
    "dark": {"color_scheme": "dark"},
    "phone": {"viewport": {"width": 360, "height": 740}, "color_scheme": "light"},
    "phone-dark": {"viewport": {"width": 360, "height": 740}, "color_scheme": "dark"},
}


@pytest.mark.parametrize("name", WINDOWS)
def test_the_page(name, window, press):
    page = answered(shown(window(**WINDOWS[name]).new_page(), press.address))
    picture(page, f"axe-{name}", full_page=True)
    assert violations(page) == []
    page.click("#as-text")
    page.locator("#chooser summary").click()
    picture(page, f"axe-{name}-text")
    assert violations(page) == []
    if name.startswith("phone"):
        until(page, "() => document.documentElement.scrollWidth <= 360")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_dialogs(scheme, window, press):
    page = drawn(shown(window(color_scheme=scheme).new_page(), press.address))
    for dialog in ("#new", "#save-as", "#report", "#help"):
        page.click(dialog)
        page.get_by_role("dialog").wait_for()
        picture(page, f"axe-dialog-{dialog[1:]}-{scheme}")
        assert violations(page) == []
        page.keyboard.press("Escape")
        page.get_by_role("dialog").wait_for(state="detached")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_faults_and_help(scheme, window, press):
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


@pytest.mark.parametrize("tongue", ["en", "es"])
def test_the_report(tongue, window, press, tmp_path):
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
