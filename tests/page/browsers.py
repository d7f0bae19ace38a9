"""A browser for the tests of the page: where one is found, the live page in it, what it asked for and complained of.

FLYWHEEL_BROWSER=/opt/chrome/chrome   the browser to take, before any that is found
FLYWHEEL_BROWSER_TESTS=required       no browser, or no playwright, is a failure instead of a skip
FLYWHEEL_SCREENSHOTS=/tmp/pictures    a folder in which tests leave pictures of what they saw, to be looked at
FLYWHEEL_SLOWDOWN=6                   pages compute so many times slower: no test may hang on how fast they draw
"""

from __future__ import annotations

import inspect
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, Queue
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, BrowserType, Locator, LocatorAssertions, Page, Route

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
BROWSER, REQUIRED, PICTURES = "FLYWHEEL_BROWSER", "FLYWHEEL_BROWSER_TESTS", "FLYWHEEL_SCREENSHOTS"
SLOWDOWN = "FLYWHEEL_SLOWDOWN"

_NAMES = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"),
    *("microsoft-edge", "microsoft-edge-stable", "msedge", "brave-browser"),
)
_PLACES = (
    "/usr/bin/chromium",
    "/snap/bin/chromium",
    "/opt/google/chrome/chrome",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
)
_ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/\S+")
_SECONDS = 60.0
_PATIENCE = 120_000.0  # ms, on a machine that has much else to do


class Missing(Exception):
    """No browser, or nothing to drive it with; the message says which, and what to install."""


# -- a browser ---------------------------------------------------------------------------------------------------------


def executable(kind: BrowserType | None = None) -> str:
    """The browser to take: the one that is named, one on the path, one in a usual place, playwright's own."""
    named = os.environ.get(BROWSER)
    if named:
        result = shutil.which(named)
        if result is None:
            raise Missing(f"{BROWSER} names {named}, which is no program")
        return result
    own = [kind.executable_path] if kind else []
    for place in (*filter(None, map(shutil.which, _NAMES)), *_PLACES, *own):
        if os.access(place, os.X_OK):
            return place
    raise Missing(f"no browser is found: install chromium, or name one in {BROWSER}")


@contextmanager
def browser(*options: str) -> Iterator[Browser]:
    """A browser without a window; Missing where there is none."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as reason:
        raise Missing("playwright is not installed: pip install -e '.[dev,browser]'") from reason
    with sync_playwright() as playwright, launched(playwright.chromium, *options) as result:
        yield result


@contextmanager
def launched(kind: BrowserType, *options: str) -> Iterator[Browser]:
    """A browser of playwright's kind with options of its own."""
    root = hasattr(os, "geteuid") and os.geteuid() == 0  # which Chromium runs without its sandbox alone
    usual = ["--disable-gpu", "--disable-background-networking", "--no-first-run", *(["--no-sandbox"] if root else [])]
    result = kind.launch(executable_path=executable(kind), args=[*usual, *options])
    try:
        yield result
    finally:
        result.close()


# -- the server --------------------------------------------------------------------------------------------------------


class Served:
    """The program `flywheel open` on a scene: its address, the scene's file, what it has printed."""

    def __init__(self, process: subprocess.Popen[str], scene: Path) -> None:
        self.process, self.scene = process, scene
        self.lines = Queue[str]()
        self.printed = list[str]()
        threading.Thread(target=self._listen, daemon=True).start()
        self.address = self._address()

    @property
    def origin(self) -> str:
        """Scheme, host and port."""
        return "{0.scheme}://{0.netloc}".format(urlsplit(self.address))

    @property
    def port(self) -> int:
        """The port on which it listens."""
        return int(urlsplit(self.address).port or 0)

    def _listen(self) -> None:
        for line in self.process.stdout or ():
            self.lines.put(line)
        self.lines.put("")  # it has ended

    def _address(self) -> str:
        while True:
            try:
                self.printed.append(self.lines.get(timeout=_SECONDS))
            except Empty:
                self.process.kill()
                raise AssertionError(f"no address within {_SECONDS:g} s; printed: {''.join(self.printed)}") from None
            if result := _ADDRESS.search(self.printed[-1]):
                return result[0]
            assert self.printed[-1], f"the server has ended with {self.process.wait()}; printed: {''.join(self.printed)}"


@contextmanager
def served(scene: Path, *options: str) -> Iterator[Served]:
    """The page of a scene, by a process of its own that ends with the block."""
    command = [sys.executable, "-m", "flywheel", "open", str(scene), "--no-browser", "--port", "0", *options]
    environment = os.environ | {"PYTHONUNBUFFERED": "1"}
    with subprocess.Popen(
        command, cwd=scene.parent, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
    ) as process:
        try:
            yield Served(process, scene)
            assert process.poll() is None, f"the server has ended with {process.poll()} before its tests"
        finally:
            process.terminate()
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


# -- a page ------------------------------------------------------------------------------------------------------------


_BEYOND = re.compile(r"^(?!(?:about|blob|data|file):|http://127\.0\.0\.1:)")


class Watched:
    """Requests of pages of a context beyond this machine, and their errors."""

    def __init__(self) -> None:
        self.left, self.complaints = list[str](), list[str]()
        self.expected = list[str]()

    def watch(self, context: BrowserContext) -> None:
        """Record every request to another host, which is stopped, and every error that is told on the console.

        What stays on this machine does not pass through here: the page may give such a request up at any time.
        """

        def stopped(route: Route) -> None:
            self.left.append(route.request.url)
            route.abort()

        context.route(_BEYOND, stopped)
        context.on("console", lambda message: self.complain(message.type, message.text))
        context.on("weberror", lambda error: self.complain("error", str(error.error)))

    def complain(self, kind: str, text: str) -> None:
        """Record an error or a warning, unless it is one that the test expects."""
        if kind in ("error", "warning") and not any(part in text for part in self.expected):
            self.complaints.append(f"{kind}: {text}")

    def check(self) -> None:
        """Nothing left this machine and nothing was complained of."""
        assert not self.left, f"asked for beyond this machine: {self.left}"
        assert not self.complaints, f"told on the console: {self.complaints}"


def slowed(page: Page) -> None:
    """Have a page compute as slowly as the environment asks for."""
    rate = float(os.environ.get(SLOWDOWN, "1"))
    if rate > 1.0:
        page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": rate})


def shown(page: Page, address: str) -> Page:
    """The page at an address, with its scene read; what is computed of it may still be coming."""
    page.goto(address)
    page.wait_for_selector("#file:not(:empty)")
    return page


def answered(page: Page) -> Page:
    """The page with the answer to its scene as it stands, confirmed in time where that is possible."""
    page.wait_for_selector("#state[data-state=done]", state="attached", timeout=_PATIENCE)
    return page


def drawn(page: Page) -> Page:
    """The page with figures of its scene, which a run in time need not have confirmed yet."""
    page.wait_for_selector(".panel svg", state="attached", timeout=_PATIENCE)
    return page


def until(page: Page, condition: str | Callable[[], object], arg: Any = None, seconds: float = 60.0) -> None:
    """Ask until a script of the page, or a function here, is true: pages draw in frames of their own, after any action.

    It asks from outside, as the page forbids scripts from texts: none may wait inside it.
    """
    end = time.monotonic() + seconds
    while not (page.evaluate(condition, arg) if isinstance(condition, str) else condition()):
        assert time.monotonic() < end, f"not true after {seconds:g} s: {_written(condition)}"
        page.wait_for_timeout(50)


def _written(condition: str | Callable[[], object]) -> str:
    return condition if isinstance(condition, str) else inspect.getsource(condition).strip()


def expected(part: Locator) -> LocatorAssertions:
    """Expectation of a part of the page within a minute: `expected(page.locator("#angle")).to_have_value("91")`."""
    from playwright.sync_api import expect

    expect.set_options(timeout=60_000)
    return expect(part)


_FRAMES = """() => Promise.race([
  new Promise((on) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(on, 0, true)))),
  new Promise((on) => setTimeout(on, 5000, false)),
])"""


def in_sight(page: Page) -> Page:
    """The page once a frame has told its figures which of them are in sight; a browser that draws none is asked for one."""
    for _ in range(5):
        if page.evaluate(_FRAMES):
            return page
        page.bring_to_front()
        page.screenshot()
    raise AssertionError("the browser draws no frame")


def picture(page: Page, name: str, **options: Any) -> None:
    """A picture of the page, where pictures are asked for."""
    folder = os.environ.get(PICTURES)
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        page.screenshot(path=str(Path(folder) / f"{name}.png"), **options)


def violations(page: Page, context: Any = None) -> list[str]:
    """Violations that axe-core finds on the page, a line each: rule, elements, and its message."""
    from axe_playwright_python.sync_playwright import Axe

    result = Axe().run(page, context).response["violations"]
    return [
        f"{rule['id']} ({rule['impact']}) {node['target']}: {node['failureSummary']}".replace("\n", " ")
        for rule in result
        for node in rule["nodes"]
    ]
