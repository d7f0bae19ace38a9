"""The command line: arguments in, exit code out, no physics.

Exit codes: 0 done, 1 the scene or the machine is at fault (a line per fault on standard error), 2 usage. Everything but
click is imported by the command that needs it.
"""

from __future__ import annotations

import os
import sys
from typing import Any

import click

from flywheel.cli import machines, motions, texts
from flywheel.cli.common import STANDARD_OUTPUT, written

__all__ = ["main"]


def _version(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if not wanted or context.resilient_parsing:
        return
    from importlib.metadata import PackageNotFoundError, version

    try:
        click.echo(f"flywheel {version('flywheel-design')}")
    except PackageNotFoundError:
        click.echo("flywheel, run from its source without being installed")
    context.exit()


class _Program(click.Group):
    """A group of commands; standard output that is closed or full ends any of them with a line and exit code 1."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        if sys.stdout is None:  # closed; a file that refuses what is written says so
            sys.stdout = open(os.open(os.devnull, os.O_RDONLY), "w", encoding="utf-8")  # noqa: SIM115
        return super().main(*args, **kwargs)

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        with written(STANDARD_OUTPUT):
            return super().make_context(*args, **kwargs)

    def invoke(self, context: click.Context) -> Any:
        with written(STANDARD_OUTPUT):
            return super().invoke(context)


@click.group(cls=_Program, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_version,
    help="Show the version and exit.",
)
def main() -> None:
    """Flywheel design: from a mechanism to its reduced inertia and moment, and to an exact flywheel.

    Start with `flywheel new press`, then `flywheel size press.toml`; `flywheel reference` explains the scene format.
    """


for _command in (*machines.COMMANDS, *motions.COMMANDS, *texts.COMMANDS):
    main.add_command(_command)
