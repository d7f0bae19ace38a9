"""Commands that write texts: `new`, `reference`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from flywheel.cli.common import show, written


def _known(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """One of the names that a command knows, looked up only when it runs; else a usage error with the nearest."""
    names = _names(str(parameter.name))
    if value is None or value in names:
        return value
    from flywheel.numerics.faults import nearest

    near = nearest(value, names)
    advice = f"did you mean {near!r}?" if near else f"known: {', '.join(names)}."
    raise click.BadParameter(f"{value!r} is no {parameter.name}; {advice}")


def _names(what: str) -> list[str]:
    if what == "kind":
        from flywheel.starters import kinds

        return list(kinds())
    from flywheel.reference import topics

    return list(topics())


@click.command(short_help="Write a commented starter scene.")
@click.argument("kind", callback=_known, required=False)
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
    with written(path):
        try:
            write_starter(kind, path)
        except FileExistsError:
            click.echo(f"{path}: exists already and is left as it is; give another file name", err=True)
            sys.exit(1)
    click.echo(f"wrote {path}", err=True)


@click.command(short_help="Explain the scene format.")
@click.argument("topic", callback=_known, required=False)
@click.option("--schema", is_flag=True, help="Print the format as a JSON Schema, for editors, and nothing else.")
def reference(topic: str | None, schema: bool) -> None:
    """Explain the scene format: an overview, or one TOPIC.

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
        show(f"\nTopics: {', '.join(_names('topic'))}")


COMMANDS = (new, reference)
