"""The command line: arguments in, exit code out, no physics.

Exit codes: 0 done, 1 the scene or the machine is at fault (a line per fault on standard error), 2 usage. Everything but
click is imported by the command that needs it.
"""

from __future__ import annotations

import click

from flywheel.cli import machines, pictures, texts, tradeoffs, transients

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


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
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


for _command in (*machines.COMMANDS, *transients.COMMANDS, *tradeoffs.COMMANDS, *pictures.COMMANDS, *texts.COMMANDS):
    main.add_command(_command)
