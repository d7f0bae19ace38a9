"""The command line: arguments in, exit code out, no physics.

Exit codes: 0 done, 1 the scene or the machine is at fault (a line per fault on standard error), 2 usage. Everything but
click is imported by the command that needs it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from flywheel.faults import Fault
    from flywheel.results import Sizing

PLOT_FORMATS = (".png", ".svg", ".pdf")
_RTOL = (1e-14, 0.1)
_MOST_POINTS = 1_000_000
_SCENE = click.argument("scene", type=click.Path(path_type=Path))


@contextmanager
def _reported(scene: Path) -> Iterator[None]:
    """Turn the faults of a scene, or of the machine that it describes, into lines on standard error and exit code 1."""
    import numpy as np

    from flywheel.faults import SceneError

    try:
        with np.errstate(all="ignore"):  # a value that is not finite is reported as a fault, with its place
            yield
    except SceneError as error:
        for fault in error.faults:
            click.echo(_fault_line(scene, fault), err=True)
        sys.exit(1)


def _fault_line(scene: Path, fault: Fault) -> str:
    """`press.toml: mechanism.rod.length: found ..., expected ...; advice`; a fault of the file itself names it once."""
    whole_file = fault.path in (scene.name, "scene")
    tail = str(fault)[len(fault.path) + 2 :] if whole_file else str(fault)
    return f"{scene}: {tail}"


@contextmanager
def _written(path: Path | str) -> Iterator[None]:
    """Turn a file that cannot be written into one line on standard error and exit code 1."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        click.echo(f"{path}: cannot be written ({error.strerror or error})", err=True)
        sys.exit(1)


def _print(text: str) -> None:
    """Text to standard output; characters that its encoding lacks are replaced instead of ending the program."""
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors="replace")
    with _written("standard output"):
        click.echo(text, nl=not text.endswith("\n"))


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


# -- size ------------------------------------------------------------------------------------------------------------


def _plot_path(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    if path is not None and path.suffix.lower() not in PLOT_FORMATS:
        raise click.BadParameter(f"{str(path)!r} does not end in {', '.join(PLOT_FORMATS[:-1])} or {PLOT_FORMATS[-1]}.")
    return path


def _accuracy(context: click.Context, parameter: click.Parameter, rtol: float | None) -> float | None:
    if rtol is not None and not _RTOL[0] <= rtol <= _RTOL[1]:
        raise click.BadParameter(f"{rtol} is not from {_RTOL[0]} to {_RTOL[1]}.")
    return rtol


@main.command(short_help="Size the flywheel of a scene, or analyse a given one.")
@_SCENE
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON, SI throughout.")
@click.option("--rtol", type=float, callback=_accuracy, help="Relative accuracy asked of every figure.")
@click.option("--no-simulate", is_flag=True, help="Leave out the time simulation that confirms the result.")
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    callback=_plot_path,
    metavar="FILE.(png|svg|pdf)",
    help="Draw moment, inertia, Wittenbauer's loop and speed into a file.",
)
def size(scene: Path, as_json: bool, rtol: float | None, no_simulate: bool, plot: Path | None) -> None:
    """Size (or analyse) the flywheel of the machine in SCENE, a TOML file."""
    with _reported(scene):
        from flywheel.reading import load
        from flywheel.sizing import size as sized

        sizing = sized(load(scene), rtol, simulate=not no_simulate)
        _show(sizing, as_json)
        if plot is not None:
            _draw(sizing, plot)


def _show(sizing: Sizing, as_json: bool) -> None:
    if not as_json:
        from flywheel.report import text

        _print(text(sizing))
        return
    from flywheel.export import encoded

    _print(encoded(sizing.as_dict(), indent=2))
    for message in sizing.messages:
        click.echo(message, err=True)


def _draw(sizing: Sizing, path: Path) -> None:
    from flywheel.plots import plot

    with _written(path):
        plot(sizing, path)


# -- reduce ----------------------------------------------------------------------------------------------------------


def _angles(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> tuple[float, ...]:
    if not texts:
        return ()
    from flywheel.units import QuantityError, parse_quantity

    try:
        return tuple(parse_quantity(text, "angle") for text in texts)
    except QuantityError as error:
        raise click.BadParameter(f'{error.found} is no angle with its unit, such as "30 deg" or "0.5 rad".') from None


@main.command(short_help="Print reduced inertia, moment and influence coefficients.")
@_SCENE
@click.option("--json", "as_json", is_flag=True, help="Print JSON, SI throughout.")
@click.option("--csv", "as_csv", is_flag=True, help="Print CSV, SI throughout (default).")
@click.option(
    "--points",
    type=click.IntRange(1, _MOST_POINTS),
    help="Number of angles, evenly over the cycle (default 360).",
)
@click.option(
    "--at",
    multiple=True,
    callback=_angles,
    metavar="ANGLE",
    help='A crank angle such as "30 deg"; repeatable.',
)
@click.option("--output", type=click.Path(path_type=Path), metavar="FILE", help="Write to a file instead.")
def reduce(scene: Path, as_json: bool, as_csv: bool, points: int | None, at: tuple[float, ...], output: Path | None) -> None:
    """Print I*, dI*/dphi, M* and every influence coefficient of SCENE over the crank angle."""
    if as_json and as_csv:
        raise click.UsageError("--json and --csv exclude each other.")
    if at and points is not None:
        raise click.UsageError("--at and --points exclude each other.")
    with _reported(scene):
        from flywheel.export import reduced
        from flywheel.reading import load

        text = reduced(load(scene), at, points or 360, as_json=as_json)
    if output is None:
        _print(text)
        return
    if output.exists() and output.samefile(scene):
        raise click.UsageError("--output names the scene itself.")
    with _written(output):
        output.write_text(text, encoding="utf-8", newline="")


# -- graph -----------------------------------------------------------------------------------------------------------


@main.command(short_help="Print and draw the bond graph of a scene.")
@_SCENE
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    callback=_plot_path,
    metavar="FILE.(png|svg|pdf)",
    help="Draw the graph with half arrows, causal strokes and bond numbers into a file.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "markdown", "latex"]),
    default="text",
    show_default=True,
    help="How the table of bonds is written.",
)
@click.option("--simplify", "simpler", is_flag=True, help="Apply the simplification rules first, and list what they did.")
def graph(scene: Path, plot: Path | None, form: str, simpler: bool) -> None:
    """Print the bond graph of the machine in SCENE: of every bond its half arrow, causal stroke, effort and flow."""
    with _reported(scene):
        from flywheel.diagram import draw, machine_graph, table

        shown, log = machine_graph(scene, simplified=simpler)
        text = "\n".join([*log, table(shown, form)])
        if plot is not None:
            with _written(plot):
                draw(shown, plot, scene)
        _print(text)


# -- new, reference --------------------------------------------------------------------------------------------------


def _known(context: click.Context, parameter: click.Parameter, value: str | None) -> str | None:
    """One of the names that a command knows, looked up only when it runs; else a usage error with the nearest."""
    names = _names(str(parameter.name))
    if value is None or value in names:
        return value
    from flywheel.advice import nearest

    near = nearest(value, names)
    advice = f"did you mean {near!r}?" if near else f"known: {', '.join(names)}."
    raise click.BadParameter(f"{value!r} is no {parameter.name}; {advice}")


def _names(what: str) -> list[str]:
    if what == "kind":
        from flywheel.starters import kinds

        return list(kinds())
    from flywheel.reference import topics

    return list(topics())


@main.command(short_help="Write a commented starter scene.")
@click.argument("kind", callback=_known, required=False)
@click.argument("file", type=click.Path(path_type=Path, allow_dash=True), required=False)
def new(kind: str | None, file: Path | None) -> None:
    """Write a commented starter scene of a KIND of machine into FILE (default KIND.toml; - prints it).

    Without KIND the known kinds are listed. A file that exists is never overwritten.
    """
    if kind is None:
        _print("\n".join(_names("kind")))
        return
    from flywheel.starters import starter, write_starter

    if str(file) == "-":
        _print(starter(kind))
        return
    path = file or Path(f"{kind}.toml")
    with _written(path):
        try:
            write_starter(kind, path)
        except FileExistsError:
            click.echo(f"{path}: exists already and is left as it is; give another file name", err=True)
            sys.exit(1)
    click.echo(f"wrote {path}", err=True)


@main.command(short_help="Explain the scene format.")
@click.argument("topic", callback=_known, required=False)
def reference(topic: str | None) -> None:
    """Explain the scene format: an overview, or one TOPIC."""
    from flywheel.reference import text

    _print(text(topic))
    if topic is None:
        _print(f"\nTopics: {', '.join(_names('topic'))}")
