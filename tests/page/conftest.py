"""Fixtures of the tests that need a browser; where none is found each is skipped, with one line that says so for all."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.page.browsers import EXAMPLES, REQUIRED, Missing, Served, Watched, browser, served, shown, slowed

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

_SKIPPED = "the page is not tested in a browser"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Whatever takes a browser is marked so."""
    for item in items:
        if "chromium" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.browser)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """All tests that are skipped for lack of a browser are told in one line, at one place."""
    report = yield
    if report.skipped and isinstance(report.longrepr, tuple) and report.longrepr[2].startswith(f"Skipped: {_SKIPPED}"):
        report.longrepr = ("tests/page", 0, report.longrepr[2])
    return report


@pytest.fixture(scope="session")
def _found() -> Iterator[Browser | str]:
    """A browser, or why there is none."""
    with ExitStack() as stack:
        try:
            result: Browser | str = stack.enter_context(browser())
        except Missing as reason:
            result = str(reason)
        yield result


@pytest.fixture
def chromium(_found: Browser | str) -> Browser:
    """The browser of this run; the test is skipped where there is none, and fails where one is required."""
    if not isinstance(_found, str):
        return _found
    if os.environ.get(REQUIRED):
        pytest.fail(f"the page was not tested in a browser: {_found}", pytrace=False)
    pytest.skip(f"{_SKIPPED}: {_found}")


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Callable[..., Served]]:
    """`opened("machines/press.toml")`: the page of a copy of an example, by a process that ends with the test."""
    with ExitStack() as stack:

        def begin(example: str | Path = "machines/press.toml", *options: str) -> Served:
            source = EXAMPLES / example
            scene = tmp_path / source.name
            if not scene.exists():
                shutil.copy(source, scene)
                for table in source.parent.glob("*.csv"):
                    shutil.copy(table, tmp_path)
            return stack.enter_context(served(scene, *options))

        yield begin


@pytest.fixture
def watched() -> Watched:
    """Requests of pages beyond this machine, and their errors; both are failures at the end of the test."""
    return Watched()


@pytest.fixture
def window(chromium: Browser, watched: Watched) -> Iterator[Callable[..., BrowserContext]]:
    """`window(color_scheme="dark")`: a window of its own, with its own cookies and settings."""
    with ExitStack() as stack:

        def begin(**options: Any) -> BrowserContext:
            settings = {"viewport": {"width": 1280, "height": 800}, "locale": "en-GB", "accept_downloads": True} | options
            context = chromium.new_context(**settings)
            context.set_default_timeout(60_000)
            stack.callback(context.close)
            watched.watch(context)
            context.on("page", slowed)
            return context

        yield begin
    watched.check()


@pytest.fixture(scope="session")
def press(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """The page's server for a copy of the press, which all tests share that do not save."""
    scene = tmp_path_factory.mktemp("press") / "press.toml"
    shutil.copy(EXAMPLES / "machines/press.toml", scene)
    before = scene.read_bytes()
    with served(scene) as result:
        yield result
    assert scene.read_bytes() == before, "a test has saved the scene that all share"


@pytest.fixture
def page(window: Callable[..., BrowserContext], press: Served) -> Page:
    """The live page of the press in a window of its own: what is edited there no other test sees."""
    return shown(window().new_page(), press.address)
