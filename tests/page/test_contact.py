"""A page whose program ends, or is started again: what is typed is kept, and old results say of what they are."""

from __future__ import annotations

import re
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from flywheel.page.edits import Session
from flywheel.page.server import PageServer
from tests.page.browsers import EXAMPLES, Watched, answered, expected, picture, shown, until

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext, Page, Route


@contextmanager
def started(scene: Path, port: int = 0) -> Iterator[PageServer]:
    """The program on a scene, ended with the block."""
    server = PageServer(Session(scene), port)
    threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()


@pytest.fixture
def scene(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A copy of the press, or of the example that a test names."""
    return Path(shutil.copy(EXAMPLES / getattr(request, "param", "machines/press.toml"), tmp_path))


@pytest.fixture
def start(scene: Path) -> Iterator[Callable[..., tuple[PageServer, ExitStack]]]:
    """`start(port)`: the program, and what ends it."""
    with ExitStack() as all_of_them:

        def begin(port: int = 0) -> tuple[PageServer, ExitStack]:
            one = all_of_them.enter_context(ExitStack())
            return one.enter_context(started(scene, port)), one

        yield begin


def typed(page: Page, path: str, value: str) -> None:
    box = page.locator(f'[data-field="{path}"] input[type=text]')
    box.fill(value)
    box.press("Enter")


def has_line(page: Page, line: str) -> None:
    """Wait for a line of the scene's text."""
    page.click("#as-text")
    until(page, lambda: re.search(line, page.locator("#text").input_value(), re.MULTILINE))
    page.click("#as-form")


@pytest.fixture
def left(start: Callable[..., Any], window: Callable[..., BrowserContext], watched: Watched) -> tuple[Page, int]:
    """A page with its answer, whose program has ended; and its port."""
    watched.expected += ["Failed to load resource", "ERR_"]
    server, end = start()
    page = answered(shown(window().new_page(), server.address))
    end.close()
    page.locator("[data-notice=gone]").wait_for()
    return page, server.port


@pytest.mark.slow
def test_what_is_typed_without_the_program_goes_into_the_text(left: tuple[Page, int]) -> None:
    page, _port = left
    expected(page.locator("#results.old")).to_have_count(0)  # they are those of the scene as it stands
    typed(page, "regime.speed", "61")
    typed(page, "mechanism.crank.length", "3.25 in")
    typed(page, "title", 'A "press"')
    has_line(page, r'^speed = "61 rpm"')
    has_line(page, r'^crank\.length = "3.25 in" .*half the stroke')
    has_line(page, r'^title = "A \\"press\\""')
    expected(page.locator("#unsaved")).to_have_text("not saved")
    expected(page.locator("#results.old")).to_have_count(1)
    expected(page.locator("#earlier")).to_contain_text(
        "These are the results of Blanking press, flywheel on the eccentric shaft at"
    )
    picture(page, "gone", full_page=True)


def by_slider(page: Page) -> None:
    slider = page.locator('[data-field="mechanism.crank.length"] input[type=range]')
    slider.focus()
    for _ in range(3):
        page.keyboard.press("ArrowRight")


def by_text(page: Page) -> None:
    page.click("#as-text")
    area = page.locator("#text")
    area.fill(area.input_value().replace('"80 mm"', '"85 mm"'))
    page.click("#as-form")


def added(page: Page) -> None:
    foot = page.locator('[data-path="mechanism.crank"] .foot')
    foot.locator("select").select_option("mechanism.crank.com_angle")
    foot.get_by_role("button", name="Add").click()


def chosen(field: str, value: str, kind: str = "select:not(.unit)") -> Callable[[Page], None]:
    return lambda page: void(page.locator(f'[data-field="{field}"] {kind}').select_option(value))


def void(_value: object) -> None:
    """Of an action what it returns is of no interest."""


PRESS, DRIVEN = "machines/press.toml", "drive_lines/press.toml"
EDITS: dict[
    str, tuple[str, Callable[[Page], None], str, bool]
] = {  # an edit, its line, whether only the program can make it
    "number": (PRESS, lambda page: typed(page, "regime.speed", "61"), r'^speed = "61 rpm"', False),
    "slider": (PRESS, by_slider, r'^crank\.length = "(?!80 mm)[\d.]+ mm"', False),
    "text": (PRESS, by_text, r'^crank\.length = "85 mm"', False),
    "mechanism type": (PRESS, chosen("mechanism.type", "scotch-yoke"), r'^type = "scotch-yoke"', False),
    "motor type": (DRIVEN, chosen("drive.motor.type", "synchronous"), r'^type = "synchronous"', False),
    "unit": (PRESS, chosen("mechanism.crank.length", "in", "select.unit"), r'^crank\.length = "3\.1496\d* in"', True),
    "added key": (PRESS, added, r"^crank\.com_angle = ", True),
}


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "edit", "line", "waits"), EDITS.values(), ids=EDITS.keys(), indirect=["scene"])
def test_every_kind_of_edit_outlives_the_program(
    left: tuple[Page, int],
    start: Callable[..., Any],
    edit: Callable[[Page], None],
    line: str,
    waits: bool,
    watched: Watched,
) -> None:
    """It stands in the text or waits, over results that say of what they are; the next run takes it over."""
    page, port = left
    edit(page)
    expected(page.locator("#results.old")).to_have_count(1)
    expected(page.locator("#earlier")).to_contain_text("These are the results of")
    expected(page.locator("#unsaved")).to_have_text("not saved")
    if not waits:
        has_line(page, line)
    server, _end = start(port)
    expected(page.locator("[data-notice=gone]")).to_contain_text("earlier run")
    assert "404" not in page.locator("body").inner_text()
    page.wait_for_timeout(300)  # the copy is kept once the hand rests
    other = shown(page.context.new_page(), server.address)
    other.get_by_role("button", name="Bring them back").click()
    has_line(other, line)
    expected(other.locator("#unsaved")).to_have_text("not saved")
    expected(other.locator("[data-notice=gone]")).to_have_count(0)


@pytest.mark.slow
def test_a_page_of_another_start_asks_to_be_loaded_again_and_hands_over_its_text(
    left: tuple[Page, int], start: Callable[..., Any]
) -> None:
    page, port = left
    server, _end = start(port)
    expected(page.locator("[data-notice=gone]")).to_contain_text("earlier run")
    typed(page, "regime.speed", "61")
    expected(page.locator("#results.old")).to_have_count(1)
    has_line(page, r'^speed = "61 rpm"')
    assert "404" not in page.locator("body").inner_text()
    picture(page, "other", full_page=True)
    page.wait_for_timeout(300)  # the copy is kept once the hand rests
    other = shown(page.context.new_page(), server.address)
    other.get_by_role("button", name="Bring them back").click()
    has_line(other, r'^speed = "61 rpm"')
    expected(answered(other).locator("#unsaved")).to_have_text("not saved")


@pytest.mark.slow
def test_a_save_shows_what_the_disk_has_not_what_was_opened(
    page: Page, scene: Path, start: Callable[..., Any], watched: Watched
) -> None:
    watched.expected += ["Failed to load resource", "ERR_"]
    server, _end = start()
    own = answered(shown(page.context.new_page(), server.address))
    own.route("**/api/watch?*", lambda route: route.abort())
    typed(own, "regime.speed", "61")
    has_line(own, r'^speed = "61 rpm"')
    theirs = scene.read_text().replace('"480 mm"', '"500 mm"')
    scene.write_text(theirs)
    own.unroute("**/api/watch?*")
    own.click("#save")
    expected(own.locator(".differences li.theirs", has_text="500 mm")).to_have_count(1)
    own.get_by_role("dialog").get_by_role("button", name="Cancel").click()
    assert scene.read_text() == theirs


@pytest.mark.slow
def test_what_is_typed_stays_where_its_answer_is_given_up(page: Page, watched: Watched) -> None:
    watched.expected.append("503")
    answered(page)
    refused = list[str]()

    def given_up(route: Route) -> None:
        if '"mechanism.crank.length"' in (route.request.post_data or "") and not refused:
            refused.append(route.request.url)
            route.fulfill(status=503, json={"error": "the answer takes too long"})
        else:
            route.continue_()

    page.route("**/api/answer", given_up)
    typed(page, "mechanism.crank.length", "91")
    has_line(page, r'^crank\.length *= *"91 mm"')
    assert len(refused) == 1
    answered(page)
