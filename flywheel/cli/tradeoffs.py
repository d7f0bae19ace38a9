"""The command that measures what accuracy costs: `tradeoff`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING

import click

from flywheel.accuracy import RTOL
from flywheel.cli.common import SCENE, plot_path, remarked, reported, show, spare, within, written

if TYPE_CHECKING:
    from flywheel.tradeoffs.result import Tradeoff

_QUIET = 2.0  # seconds before anything is told
_EVERY, _EVERY_ON_TERMINALS = 5.0, 0.25  # seconds between two words
_INTERRUPTED = 130  # exit code


def _seconds(context: click.Context, parameter: click.Parameter, budget: float) -> float:
    if not (isfinite(budget) and budget > 0.0):
        raise click.BadParameter(f"{budget:g} is no number of seconds above 0.")
    return budget


@click.command(short_help="Measure what accuracy costs: every method on a scene.")
@SCENE
@click.option("--rtol", type=float, callback=within(*RTOL), help="Relative error to be kept (default: the scene's).")
@click.option(
    "--budget",
    type=float,
    default=60.0,
    show_default=True,
    callback=_seconds,
    metavar="SECONDS",
    help="Time after which no further method is begun.",
)
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    callback=plot_path,
    metavar="FILE.(png|svg|pdf)",
    help="Draw errors over times into a file.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, SI throughout.")
def tradeoff(scene: Path, rtol: float | None, budget: float, plot: Path | None, as_json: bool) -> None:
    """Run every method that can answer SCENE, and tell the true error and the time of each, and which is the cheapest.

    Ctrl-C ends the comparison: what was finished is told.
    """
    spare(scene, plot)
    with _interruptible(), reported(scene):
        with _told(budget) as progress:
            from flywheel.reading.scenes import load
            from flywheel.tradeoffs.comparison import tradeoff as compared

            loaded = load(scene)
            remarked(scene, loaded.remarks)
            found = compared(loaded, rtol, budget=budget, progress=progress)
        _show(found, as_json)
        if plot is not None:
            _draw(found, plot)
    if found.interrupted:
        sys.exit(_INTERRUPTED)


@contextmanager
def _interruptible() -> Iterator[None]:
    """Ctrl-C, wherever it comes and nothing is left to tell, is one line and an exit code."""
    try:
        yield
    except KeyboardInterrupt:
        click.echo("interrupted", err=True)
        sys.exit(_INTERRUPTED)


def _show(found: Tradeoff, as_json: bool) -> None:
    from flywheel.writing.tradeoffs import text, unfinished

    if not as_json:
        show(text(found))
        return
    from flywheel.writing.export import encoded

    show(encoded(found.as_dict(), indent=2))
    for told in unfinished(found):
        click.echo(told, err=True)


def _draw(found: Tradeoff, path: Path) -> None:
    from flywheel.pictures.tradeoffs import plot

    with written(path):
        plot(found, path)


# -- progress --------------------------------------------------------------------------------------------------------


@contextmanager
def _told(budget: float) -> Iterator[_Progress]:
    """What tells of a long comparison on standard error, in one line that is written anew where that is a terminal."""
    progress = _Progress(budget)
    over = Event()
    ticker = Thread(target=_tick, args=(progress, over), daemon=True)
    ticker.start()
    try:
        yield progress
    finally:
        over.set()
        ticker.join()
        progress.erase()


def _tick(progress: _Progress, over: Event) -> None:
    pause = _QUIET
    while not over.wait(pause):
        progress.tell()
        pause = _EVERY_ON_TERMINALS if progress.rewriting else _EVERY


class _Progress:
    """Which method is being run."""

    def __init__(self, budget: float) -> None:
        self.budget = budget
        self.begun = monotonic()
        self.line = "finding the reference"
        self.rewriting = sys.stderr.isatty()
        self.shown = False

    def __call__(self, k: int, count: int, name: str) -> None:
        self.line = f"{k + 1} of {count}: {name}"

    def tell(self) -> None:
        """Write where the comparison is."""
        line = f"{self.line} ({monotonic() - self.begun:.0f} s of about {self.budget:g} s)"
        if not self.rewriting:
            click.echo(line, err=True)
            return
        from shutil import get_terminal_size

        self.shown = True
        click.echo(f"\r\x1b[2K{line[: get_terminal_size().columns - 1]}", err=True, nl=False, color=True)

    def erase(self) -> None:
        """Leave a terminal's line as it was."""
        if self.shown:
            click.echo("\r\x1b[2K", err=True, nl=False, color=True)


COMMANDS = (tradeoff,)
