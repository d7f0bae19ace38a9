"""The report as a file: HTML as it is, PDF by the print of a browser that is installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from bondgraph.storage.files import replacement, write_text
from flywheel.report.contents import Given, html
from flywheel.report.solutions import Solution

FORMATS = (".html", ".htm", ".pdf")
"""The endings of a report's file."""

_NAMES = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "microsoft-edge-stable",
    "msedge",
    "brave-browser",
    "brave",
    "headless_shell",
)
_PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "/Applications/Brave Browser.app/Contents/MacOS/Brave Browser",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
    r"C:\Program Files\Microsoft\Edge\Application\msedge.exe",
)
_SECONDS = 120.0  # that a browser may take for a print
_CHOICE = "FLYWHEEL_BROWSER"


class PrintError(RuntimeError):
    """A report that cannot be printed: no browser, or one that fails."""


def browsers() -> Iterator[str]:
    """The browsers that can print without a window: one named by FLYWHEEL_BROWSER, then those that are installed."""
    if named := os.environ.get(_CHOICE):
        yield named
    for name in _NAMES:
        if found := shutil.which(name):
            yield found
    yield from (place for place in _PLACES if Path(place).is_file())


def browser() -> str:
    """The first of them.

    Raises:
        PrintError: if there is none.

    """
    found = next(browsers(), None)
    if found is None:
        raise PrintError(
            "a PDF needs a browser: none of chromium, chrome, edge, brave was found; install one, name it in "
            f"{_CHOICE}, or write .html and print that"
        )
    return found


def pdf(page: str) -> bytes:
    """A report's HTML as PDF, printed by a browser that neither opens a window nor asks the network.

    Raises:
        PrintError: if there is no browser, or it prints nothing.

    """
    program = browser()
    with TemporaryDirectory(prefix="flywheel-report-") as folder:
        source, made = Path(folder) / "report.html", Path(folder) / "report.pdf"
        source.write_text(page, encoding="utf-8")
        options = [
            "--headless",
            "--disable-gpu",
            "--disable-background-networking",
            "--disable-extensions",
            "--no-first-run",
            "--no-pdf-header-footer",
            "--proxy-server=127.0.0.1:9",
            f"--user-data-dir={folder}/profile",
            f"--print-to-pdf={made}",
        ]
        if sys.platform == "linux" and hasattr(os, "geteuid") and os.geteuid() == 0:
            options.append("--no-sandbox")  # which the administrator's account does not have
        try:
            done = subprocess.run(
                [program, *options, source.as_uri()], capture_output=True, timeout=_SECONDS, check=False, text=True
            )
        except subprocess.TimeoutExpired:
            raise PrintError(f"{program} did not finish the print within {_SECONDS:.0f} s") from None
        except OSError as error:
            raise PrintError(f"{program} cannot be run ({error.strerror})") from None
        if not made.is_file() or not made.read_bytes().startswith(b"%PDF-"):
            last = next((line for line in reversed(done.stderr.splitlines()) if line.strip()), "no word why")
            raise PrintError(f"{program} printed nothing: {last}")
        return made.read_bytes()


def write(
    given: Given,
    path: str | Path,
    *,
    language: str | None = None,
    units: str = "si",
    printed: Solution | None = None,
    page: str = "all",
    inputs: Iterable[str | Path] = (),
) -> None:
    """Write a report into a file, HTML or PDF as its ending says, whole or not at all.

    Args:
        given: as in `html`, as are language, units and printed.
        path: ends in .html, .htm or .pdf. A file there is replaced only if it is of that kind.
        language: "en" or "es"; the language in use if None.
        units: "si" or "us".
        printed: a printed solution to be set beside.
        page: "all", or "summary" for the first page alone.
        inputs: files that were read, which are never replaced.

    Raises:
        ValueError: for another ending.
        OSError: if the file cannot be written.
        PrintError: if a PDF cannot be printed.
        SceneError: if the machine cannot run as its scene says.

    """
    kind = Path(path).suffix.lower()
    if kind not in FORMATS:
        raise ValueError(f"found {str(path)!r}, expected a file name ending in .html, .htm or .pdf")
    written = html(given, language=language, units=units, printed=printed, page=page)
    if kind != ".pdf":
        write_text(path, written, inputs)
        return
    with replacement(path, "pdf", inputs) as fresh:
        fresh.write_bytes(pdf(written))
