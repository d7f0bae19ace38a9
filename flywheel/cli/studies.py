"""Commands that compare designs: `sweep`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flywheel.cli.common import SCENE, loaded, plot_option, reported, show, spare, within, written

if TYPE_CHECKING:
    from flywheel.numerics.faults import SceneError
    from flywheel.scene.scene import Scene

_RTOL = (1e-14, 0.1)
_MOST = 1_000_000  # values of one number
_ROWS = 20


def varied(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> list[tuple[str, list[str], int]]:
    """Paths with their values as texts, and how many values to put between two of them (0: they are the values)."""
    found = []
    for text in texts:
        path, equals, values = text.partition("=")
        parts = [part.strip() for part in values.split(":")]
        if not equals or not path.strip() or not all(parts) or len(parts) not in (1, 3):
            told = "is no PATH=LOW:HIGH:COUNT such as mechanism.crank.length=50mm:120mm:50, nor PATH=VALUE,VALUE"
            raise click.BadParameter(f"{text!r} {told}.")
        if len(parts) == 1:
            found.append((path.strip(), [part.strip() for part in values.split(",")], 0))
            continue
        count = int(parts[2]) if parts[2].isdecimal() and len(parts[2]) < 9 else 0
        if not 2 <= count <= _MOST:
            raise click.BadParameter(f"{parts[2]!r} in {text!r} is no count from 2 to {_MOST}.")
        found.append((path.strip(), parts[:2], count))
    return found


def varied_columns(scene: Scene, asked: list[tuple[str, list[str], int]]) -> dict[str, Any]:
    """The values (SI) of numbers of a scene, each of them in the unit that its key asks for, or as a bare number in SI."""
    import numpy as np

    from flywheel.numerics.faults import Fault, SceneError
    from flywheel.numerics.units import QuantityError
    from flywheel.reading.paths import dotted, parsed

    columns: dict[str, Any] = {}
    faults = []
    for path, texts, count in asked:
        name = dotted(path)
        if name in columns:
            faults.append(Fault(name, "two columns", "one --vary for each"))
            continue
        columns[name] = np.array([np.nan])
        try:
            values = [parsed(scene, name, text) for text in texts]
        except QuantityError as error:
            faults.append(Fault(name, error.found, error.expected, error.advice))
            continue
        columns[name] = np.linspace(values[0], values[-1], count) if count else np.array(values)
    if faults:
        raise SceneError(faults)
    return columns


def npz_path(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    """The file of a sweep, which its ending tells to be one."""
    if path is not None and path.suffix.lower() != ".npz":
        raise click.BadParameter(f"{str(path)!r} does not end in .npz.")
    return path


@click.command(short_help="Size many designs, in which numbers of a scene vary.")
@SCENE
@click.option(
    "--vary",
    "asked",
    callback=varied,
    metavar="PATH=LOW:HIGH:COUNT",
    multiple=True,
    required=True,
    help="A number of the scene and its values, such as mechanism.crank.length=50mm:120mm:50; repeatable, all combinations.",
)
@plot_option("Draw it: curves over one number, a map of two, parallel coordinates of more.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write a table of all designs as CSV, SI throughout; - prints it.")
@click.option(
    "--npz",
    type=click.Path(path_type=Path),
    callback=npz_path,
    metavar="FILE.npz",
    help="Keep what is finished in a file; the same sweep goes on from it.",
)
@click.option("--jobs", type=click.IntRange(1, 1000), help="Worker processes (default: none, all is done here).")
@click.option(
    "--rtol", type=float, default=1e-10, show_default=True, callback=within(*_RTOL), help="Error asked of every figure."
)
@click.option(
    "--engine",
    type=click.Choice(["numpy", "numba", "size"]),
    help="What sizes many designs at once, or size for one by one (default: numpy).",
)
@click.option("--rows", type=click.IntRange(2, 1000), default=_ROWS, show_default=True, help="Designs in the table shown.")
def sweep(
    scene: Path,
    asked: list[tuple[str, list[str], int]],
    plot: Path | None,
    csv_file: str | None,
    npz: Path | None,
    jobs: int | None,
    rtol: float,
    engine: str | None,
    rows: int,
) -> None:
    """Size every design of SCENE in which the numbers given with --vary take their values, in all combinations.

    A number is named by its path: keys joined by dots, in arrays the place counted from 0 (load.0.from). A design at fault
    is refused alone, with its reason. Ctrl-C ends a sweep and keeps what is finished.
    """
    table = None if csv_file in (None, "-") else Path(str(csv_file))
    spare(scene, table, plot, npz)
    with reported(scene):
        from flywheel.numerics.faults import SceneError
        from flywheel.reading.paths import dotted
        from flywheel.study import sweep as study
        from flywheel.study.sweep_files import csv_lines, write_csv
        from flywheel.tables import sweeps

        given = loaded(scene)
        columns: dict[str, Any] = {dotted(path): () for path, *_ in asked}
        pool = jobs if jobs is not None and jobs > 1 else None
        try:
            columns = varied_columns(given, asked)
            found = study.sweep(given, columns, rtol, grid=True, executor=pool, engine=engine, file=npz)
        except SceneError as error:
            _refuse_arguments(error, npz, columns)
            raise
        if table is not None:
            with written(table):
                write_csv(found, table)
        if plot is not None:
            from flywheel.pictures import sweeps as picture

            with written(plot):
                picture.plot(found, plot)
    if csv_file == "-":
        for line in sweeps.notes(found):
            click.echo(line, err=True)
        show("".join(csv_lines(found)))
    else:
        show(sweeps.text(found, rows))
    if found.missing:
        sys.exit(130)
    if len(found.reasons) == len(found):
        sys.exit(1)


def _refuse_arguments(error: SceneError, npz: Path | None, columns: dict[str, Any]) -> None:
    """What is wrong with paths and with a file of another sweep is told of these, not of a line of the scene."""
    own = [fault for fault in error.faults if fault.path in columns or fault.path in (str(npz), "engine", "columns")]
    if len(own) < len(error.faults):
        return
    for fault in own:
        click.echo(f"--vary {fault}" if fault.path in columns else str(fault), err=True)
    sys.exit(1)


COMMANDS = (sweep,)
