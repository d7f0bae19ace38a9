"""The watch over the browser sees what it is there for: requests that leave this machine, errors on the console."""

import pytest

from tests.page import browsers


@pytest.fixture
def blank(window):
    tab = window().new_page()
    tab.goto("data:text/html,<html lang=en><title>blank</title><main><h1>Blank</h1></main></html>")
    return tab


def test_a_request_to_another_host_is_stopped_and_told(blank, watched):
    watched.expected.append("Failed to load resource")
    blank.evaluate("fetch('http://192.0.2.1/x').catch(() => null)")
    browsers.until(blank, lambda: watched.left == ["http://192.0.2.1/x"])
    watched.left.clear()
    watched.check()


@pytest.mark.parametrize("script", ["console.error('torn')", "setTimeout(() => { throw new Error('torn') })"])
def test_what_is_told_on_the_console_is_a_failure(blank, watched, script):
    blank.evaluate(script)
    browsers.until(blank, lambda: [complaint for complaint in watched.complaints if "torn" in complaint])
    watched.complaints.clear()


@pytest.mark.slow
def test_axe_sees_a_picture_without_a_text(blank):
    assert browsers.violations(blank) == []
    blank.evaluate("document.querySelector('main').append(document.createElement('img'))")
    assert any(line.startswith("image-alt") for line in browsers.violations(blank))


def test_a_named_browser_that_is_none_is_told(monkeypatch):
    monkeypatch.setenv(browsers.BROWSER, "/nowhere/chrome")
    with pytest.raises(browsers.Missing, match="FLYWHEEL_BROWSER names /nowhere/chrome, which is no program"):
        browsers.executable()
