"""The command line: arguments in, exit code out, no physics.

Exit codes: 0 done, 1 the scene or the machine is at fault (a line per fault on standard error), 2 usage, 130 ended
by Ctrl-C. Everything except click is imported by the command that needs it.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import click

from flywheel.cli.common import INTERRUPTED, STANDARD_OUTPUT, exit_if_unwritten, show, written
from flywheel.language import LANGUAGES, message, use

__all__ = ["main"]

_MODULES = ("machines", "studies", "motions")  # of commands, those that are asked for most often first


def _version(context: click.Context, parameter: click.Parameter, print_it: bool) -> None:
    if not print_it or context.resilient_parsing:
        return
    from importlib.metadata import PackageNotFoundError, version

    try:
        click.echo(f"flywheel {version('flywheel-design')}")
    except PackageNotFoundError:
        click.echo("flywheel, run from its source without being installed")
    context.exit()


class _Commands(click.Group):
    """A group of commands; if standard output is closed or full, any of them ends with a line and exit code 1.

    A module of commands is imported when one of its commands, or the list of all, is needed.
    """

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Runs a command; if standard output is closed, a file that refuses all writing replaces it."""
        if sys.stdout is None:
            sys.stdout = open(os.open(os.devnull, os.O_RDONLY), "w", encoding="utf-8")  # noqa: SIM115
        return super().main(*args, **kwargs)

    def list_commands(self, context: click.Context) -> list[str]:
        """The names of all commands."""
        for module in _MODULES:
            self._add(module)
        return super().list_commands(context)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """The command of a name, if there is one."""
        for module in _MODULES:
            if name not in self.commands:
                self._add(module)
        return super().get_command(context, name)

    def _add(self, module: str) -> None:
        for command in import_module(f"flywheel.cli.{module}").COMMANDS:
            self.add_command(command)

    def make_context(self, *args: Any, **kwargs: Any) -> click.Context:
        """Reads the arguments; help and version are written to standard output."""
        with written(STANDARD_OUTPUT):
            return super().make_context(*args, **kwargs)

    def invoke(self, context: click.Context) -> Any:
        """Runs the command that the arguments name; Ctrl-C before it has a result gives one line and exit code 130.

        Usage errors are in the language of --language, even if it stands after the fault.
        """
        texts = [*context.args, ""]
        named = [after if text == "--language" else text.partition("--language=")[2] for text, after in pairwise(texts)]
        try:
            with written(STANDARD_OUTPUT):
                result = super().invoke(context)
        except click.UsageError as error:
            language = next((name for name in named if name in LANGUAGES), "en")
            lines = StringIO()
            error.show(lines)
            with use(language):
                click.echo("\n".join(message(line, numbers=False) for line in lines.getvalue().splitlines()), err=True)
            context.exit(error.exit_code)
        except KeyboardInterrupt:
            click.echo("interrupted", err=True)
            sys.exit(INTERRUPTED)
        exit_if_unwritten(context)
        return result


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
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

    Start with `flywheel new press`, then `flywheel size press.toml`. `flywheel reference` prints an overview of the scene
    format and the names of all topics.
    """


def _valid_name(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """Returns a valid name, looked up only when the command runs; else a usage error with the nearest name."""
    names = _names(str(parameter.name))
    if value is None or value in names:
        return value
    from flywheel.numerics.faults import nearest

    near = nearest(value, names)
    advice = f"did you mean {near!r}?" if near else f"known: {', '.join(names)}."
    raise click.BadParameter(f"{value!r} is not a {parameter.name}; {advice}")


def _names(what: str) -> list[str]:
    if what == "kind":
        from flywheel.starters import kinds

        return list(kinds())
    from flywheel.reference import topics

    return list(topics())


@click.command(short_help="Write a commented starter scene.")
@click.argument("kind", callback=_valid_name, required=False)
@click.argument("file", type=click.Path(path_type=Path, allow_dash=True), required=False)
def new(kind: str | None, file: Path | None) -> None:
    """Write a commented starter scene of a KIND of machine into FILE (default KIND.toml; - prints it).

    Without KIND the known kinds are listed. A file that exists is never overwritten.
    """
    if kind is None:
        show("\n".join(_names("kind")))
        return
    from flywheel.starters import starter, write_starter

    if str(file) == "-":
        show(starter(kind))
        return
    path = file or Path(f"{kind}.toml")
    with written(path, at_once=True):
        try:
            write_starter(kind, path)
        except FileExistsError:
            click.echo(f"{path}: exists already and is left as it is; give another file name", err=True)
            sys.exit(1)
    click.echo(f"wrote {path}", err=True)


@click.command(short_help="Print the overview of the scene format, or one topic.")
@click.argument("topic", callback=_valid_name, required=False)
@click.option("--schema", is_flag=True, help="Print the format as a JSON Schema, for editors, and nothing else.")
def reference(topic: str | None, schema: bool) -> None:
    """Print the overview of the scene format, or one TOPIC: `flywheel reference motor`. The overview ends with all topics.

    An editor that knows TOML (taplo, Even Better TOML) completes, explains and checks a scene by the schema: write it beside
    the scene with "flywheel reference --schema > flywheel.schema.json", and "#:schema ./flywheel.schema.json" into the
    scene's first line.
    """
    from flywheel.reference import schema_text, text

    if schema:
        if topic is not None:
            raise click.UsageError("--schema is that of every topic: leave the topic out.")
        show(schema_text())
        return
    show(text(topic))
    if topic is None:
        show(f"\nThis is the overview. `flywheel reference TOPIC` prints one of these topics:\n{', '.join(_names('topic'))}")


for _command in (new, reference):
    main.add_command(_command)
