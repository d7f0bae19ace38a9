"""Commands that compare designs: `sweep`, `sensitivities`, `tolerance`, `optimize`, `motor`."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from flywheel.cli.common import (
    INTERRUPTED,
    SCENE,
    STANDARD_OUTPUT,
    comma_names,
    csv_flag,
    exclusive,
    json_flag,
    loaded,
    of_ending,
    plot_option,
    quantity,
    reported,
    show,
    spare,
    within,
    written,
)

if TYPE_CHECKING:
    from flywheel.numerics.faults import SceneError
    from flywheel.scene.scene import Scene

_RTOL = (1e-14, 0.1)
_EXPECTED = "is not a PATH=LOW:HIGH:COUNT such as mechanism.crank.length=50mm:120mm:50, nor PATH=VALUE,VALUE"
_MOST_VALUES = 1_000_000  # values of one number
_ROWS = 20
_JOBS = click.option("--jobs", type=click.IntRange(1, 1000), help="Worker processes (default: none).")
_ENGINE = "Engine that sizes many designs at once, or size for one by one (default: numpy)."


def varied(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> list[tuple[str, list[str], int]]:
    """Paths with their values as texts, and the number of values between two (0: the texts are the values; 1: any)."""
    columns = []
    for text in texts:
        path, equals, values = text.partition("=")
        parts = [part.strip() for part in values.split(":")]
        if not equals or not path.strip() or not all(parts) or len(parts) > 3:
            raise click.BadParameter(f"{text!r} {_EXPECTED}.")
        if len(parts) == 1:
            columns.append((path.strip(), [part.strip() for part in values.split(",")], 0))
            continue
        if len(parts) == 2:
            columns.append((path.strip(), parts, 1))
            continue
        count = int(parts[2]) if parts[2].isdecimal() and len(parts[2]) < 9 else 0
        if not 2 <= count <= _MOST_VALUES:
            raise click.BadParameter(f"{parts[2]!r} in {text!r} is not a count from 2 to {_MOST_VALUES}.")
        columns.append((path.strip(), parts[:2], count))
    return columns


def varied_columns(scene: Scene, variations: list[tuple[str, list[str], int]]) -> dict[str, Any]:
    """The values (SI) of numbers of a scene, each with a unit of its key's dimension, or a bare number in SI."""
    import numpy as np

    from flywheel.numerics.faults import Fault, SceneError
    from flywheel.numerics.units import QuantityError
    from flywheel.reading.paths import dotted, parsed

    columns: dict[str, Any] = {}
    faults = []
    for path, texts, count in variations:
        name = dotted(path)
        if name in columns:
            faults.append(Fault(name, "two columns", "one --vary for each"))
            continue
        columns[name] = np.array([np.nan])
        try:
            values = [parsed(scene, name, text) for text in texts]
        except QuantityError as error:
            faults.append(Fault(name, error.defect, error.expected, error.advice))
            continue
        columns[name] = np.linspace(values[0], values[-1], count) if count > 1 else np.array(values)
    if faults:
        raise SceneError(faults)
    return columns


@click.command(short_help="Size many designs, in which numbers of a scene vary.")
@SCENE
@click.option(
    "--vary",
    "spans",
    callback=varied,
    metavar="PATH=LOW:HIGH:COUNT",
    multiple=True,
    help="A number of the scene and its values, such as mechanism.crank.length=50mm:120mm:50; repeatable, all combinations.",
)
@click.option("--samples", type=click.IntRange(1), help="Number of designs spread over --vary PATH=LOW:HIGH.")
@click.option(
    "--method",
    type=click.Choice(["latin", "sobol", "random"]),
    default="latin",
    show_default=True,
    help="How to spread samples: Latin hypercube, Sobol sequence, at random.",
)
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Seed of the samples.")
@click.option(
    "--designs",
    "rows_of",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="FILE",
    help="Size the designs of a table, CSV or Parquet: a row each, columns named by paths; in place of --vary.",
)
@plot_option("Draw it: curves over one number, a map of two, parallel coordinates of more.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write a table of all designs as CSV, SI throughout; - prints it.")
@click.option(
    "--npz",
    type=click.Path(path_type=Path),
    callback=of_ending(".npz"),
    metavar="FILE.npz",
    help="Save finished designs in a file, from which the same sweep continues.",
)
@click.option(
    "--parquet",
    type=click.Path(path_type=Path),
    callback=of_ending(".parquet"),
    metavar="FILE.parquet",
    help="Write the table of --csv as Parquet, with units in its metadata; needs pyarrow.",
)
@_JOBS
@click.option(
    "--rtol",
    type=float,
    default=1e-10,
    show_default=True,
    callback=within(*_RTOL),
    help="Required relative error of every figure.",
)
@click.option(
    "--engine",
    type=click.Choice(["numpy", "numba", "size"]),
    help=_ENGINE,
)
@click.option("--rows", type=click.IntRange(2, 1000), default=_ROWS, show_default=True, help="Designs in the table shown.")
def sweep(
    scene: Path,
    spans: list[tuple[str, list[str], int]],
    samples: int | None,
    method: str,
    seed: int,
    rows_of: Path | None,
    plot: Path | None,
    csv_file: str | None,
    npz: Path | None,
    parquet: Path | None,
    jobs: int | None,
    rtol: float,
    engine: str | None,
    rows: int,
) -> None:
    """Size all designs of SCENE with the values given by --vary, in all combinations; or samples, or those of a table.

    A number is named by its path: keys joined by dots, items of arrays counted from 0 (load.0.from). A faulty design is
    refused alone, with its reason. Ctrl-C ends a sweep and keeps the finished designs: the same command continues it.
    """
    if bool(spans) == (rows_of is not None):
        raise click.UsageError("Missing option '--vary', or '--designs'." if not spans else "--vary excludes --designs.")
    for path, texts, count in spans:
        if (count == 1) != (samples is not None and len(texts) > 1):
            defect = "is not a PATH=LOW:HIGH, as --samples takes it" if samples is not None else _EXPECTED
            raise click.BadParameter(f"'{path}={':'.join(texts)}' {defect}.", param_hint="--vary")
    table = None if csv_file in (None, "-") else Path(str(csv_file))
    spare(scene, table, plot, npz, parquet)
    with reported(scene):
        from flywheel.designs import sweep as study
        from flywheel.designs.sweep_results import UNWRITTEN, csv_lines, needed
        from flywheel.numerics.faults import SceneError
        from flywheel.reading.paths import dotted
        from flywheel.tables import designs

        machine_scene, source = loaded(scene), "--vary" if rows_of is None else "--designs"
        columns: dict[str, Any] = {dotted(path): () for path, *_ in spans}
        pool = jobs if jobs is not None and jobs > 1 else None
        files = [file for file in (npz, parquet, table) if file is not None]
        try:
            columns = varied_columns(machine_scene, spans) if rows_of is None else study.read_columns(machine_scene, rows_of)
            if samples is not None:
                ranges = {path: (ends[0], ends[-1]) for path, ends in columns.items()}
                columns = study.sampled(ranges, samples, method, seed)
            if parquet is not None:
                needed("pyarrow", "--parquet")
            grid = rows_of is None and samples is None
            with written(files[0] if files else STANDARD_OUTPUT, at_once=True):
                result = study.sweep(machine_scene, columns, rtol, grid=grid, executor=pool, engine=engine, file=files)
        except SceneError as error:
            _refuse_arguments(error, {*map(str, files)}, source, columns, rows_of)
            raise
        unwritten = [message for message in result.messages if f": {UNWRITTEN}" in message]
        for message in unwritten:
            click.echo(message, err=True)
        if plot is not None:
            from flywheel.pictures import designs as picture

            with written(plot):
                picture.plot_sweep(result, plot)
    if csv_file == "-":
        for line in designs.notes(result):
            click.echo(line, err=True)
        show("".join(csv_lines(result)))
    else:
        show(designs.sweep_text(result, rows))
    if result.missing:
        sys.exit(INTERRUPTED)
    if len(result.reasons) == len(result) or unwritten:
        sys.exit(1)


def _refuse_arguments(
    error: SceneError, files: set[str], source: str, columns: dict[str, Any], rows_of: Path | None
) -> None:
    """Reports faults of paths, or of another sweep's file, as faults of the arguments, not of a line of the scene."""
    texts, line = (
        {*columns, "engine", "columns", "--parquet", "a table of designs", "samples"},
        f"{rows_of and rows_of.name}, ",
    )
    if any(fault.path not in texts and not fault.path.startswith((line, *files)) for fault in error.faults):
        return
    for fault in error.faults:
        click.echo(f"{source} {fault}" if fault.path in columns else str(fault), err=True)
    sys.exit(1)


# -- sensitivities, tolerance, optimize --------------------------------------------------------------------------------

_PLOT_OF = "Figures in table and picture; repeatable, or with commas (default: mass, exact, irregularity, power)."
_OWN = ("paths", "figures", "figure", "samples", "engine", "vary", "over", "minimize", "maximize", "subject_to", "quantiles")
_COMPARED = re.compile(r"<=|>=|<|>")


_OF = click.option("--of", multiple=True, callback=comma_names, metavar="FIGURE", help=_PLOT_OF)


def _value(text: str) -> str | float:
    """A text with a unit unchanged; a number alone as a float (SI)."""
    try:
        return float(text)
    except ValueError:
        return text


def spans(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    """Returns the two ends for each path, or for `tolerance` one standard deviation written after ±."""
    alone, intervals = parameter.name == "vary", dict[str, Any]()
    for text in texts:
        path, equals, values = (part.strip() for part in text.partition("="))
        sigma = next((values[len(sign) :].strip() for sign in ("±", "+-", "+/-") if values.startswith(sign)), "")
        parts = (sigma,) if sigma and alone else tuple(part.strip() for part in values.split(":"))
        if not equals or not path or not all(parts) or (len(parts) != 2 and not sigma):
            expected = "PATH=LOW:HIGH, such as mechanism.rod.length=590mm:610mm"
            raise click.BadParameter(f"{text!r} is not a {expected}{', nor PATH=±SIGMA' if alone else ''}.")
        if path in intervals:
            raise click.BadParameter(f"{path} is given twice.")
        numbers = [_value(part) for part in parts]
        intervals[path] = numbers[0] if sigma else tuple(numbers)
    return intervals


def pairs(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[tuple[str, str], float]:
    """Correlations of pairs of paths."""
    values = dict[tuple[str, str], float]()
    for text in texts:
        paths, _, value = (part.strip() for part in text.partition("="))
        two = [path.strip() for path in paths.split(",")]
        try:
            values[two[0], two[1]] = float(value)
        except (ValueError, IndexError):
            raise click.BadParameter(f"{text!r} is not PATH,PATH=RHO, such as load.0.from,load.0.to=0.8.") from None
    return values


def choices(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    """Values to choose from by path: a list, whole numbers LOW:HIGH, or the motors of a table by their names."""
    from flywheel.numerics.faults import SceneError
    from flywheel.reading.catalogue import read_catalogue

    lists = dict[str, Any]()
    for text in texts:
        path, equals, values = (part.strip() for part in text.partition("="))
        if not equals or not path or not values or path in lists:
            raise click.BadParameter(f"{text!r} is not a path, once, with its values: flywheel.arms=4,5,6 or 4:6.")
        ends = values.split(":")
        if values.lower().endswith(".csv"):
            try:
                lists[path] = {motor.name: dict(motor.table) for motor in read_catalogue(values).motors}
            except (SceneError, OSError) as error:
                raise click.BadParameter(str(error)) from None
        elif len(ends) == 2 and all(end.strip().isdecimal() for end in ends):
            lists[path] = list(range(int(ends[0]), int(ends[1]) + 1))
        else:
            lists[path] = [_value(part.strip()) for part in values.split(",")]
    return lists


def limits(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, tuple[Any, Any]]:
    """Limits of figures from `power<=5kW`, `power >= 2 kW` or `2kW <= power <= 5kW`, those of one figure together."""
    bounds: dict[str, tuple[Any, Any]] = {}
    for text in texts:
        parts, signs = [part.strip() for part in _COMPARED.split(text)], [sign[0] for sign in _COMPARED.findall(text)]
        if len(parts) not in (2, 3) or not all(parts) or len(set(signs)) != 1:
            raise click.BadParameter(f"{text!r} is not a limit such as power<=5kW, power>=2kW or 2kW<=power<=5kW.")
        if signs[0] == ">":
            parts = parts[::-1]  # from the lowest on
        if len(parts) == 3:
            bounds[parts[1]] = (_value(parts[0]), _value(parts[2]))
        elif signs[0] == "<":
            bounds[parts[0]] = (bounds.get(parts[0], (None, None))[0], _value(parts[1]))
        else:
            bounds[parts[1]] = (_value(parts[0]), bounds.get(parts[1], (None, None))[1])
    return bounds


@contextmanager
def _arguments(*options: dict[str, Any]) -> Iterator[None]:
    """Reports faults of the arguments as such, not as faults of a line of the scene."""
    from flywheel.designs.variation import NAMES
    from flywheel.numerics.faults import SceneError
    from flywheel.reading.paths import dotted

    own = {dotted(name) for option in options for name in option} | {*_OWN, *NAMES}
    try:
        yield
    except SceneError as error:
        if not all(fault.path in own or fault.path.startswith(("subject_to ", "keep ")) for fault in error.faults):
            raise
        for fault in error.faults:
            click.echo(str(fault), err=True)
        sys.exit(1)


def _drawn(picture: Any, result: Any, plot: Path | None, names: tuple[str, ...] = ()) -> None:
    if plot is not None:
        with written(plot):
            picture(result, plot, *([names] if names else []))


@click.command(short_help="Print the derivatives of figures by numbers of a scene.")
@SCENE
@click.argument("paths", nargs=-1)
@_OF
@json_flag()
@plot_option("Draw the changes of figures: bars, the longest first.")
@click.option("--engine", type=click.Choice(["numpy", "numba", "size"]), help=_ENGINE)
def sensitivities(
    scene: Path, paths: tuple[str, ...], of: tuple[str, ...], as_json: bool, plot: Path | None, engine: str | None
) -> None:
    """Print the derivatives of the figures of SCENE by its numbers at PATHS (such as load.0.from), or by all of them.

    Their error is about 1e-8 where the figures are smooth. If two lobes are equal, or a number is at the end of its range,
    the slopes on both sides are given, with the reason.
    """
    spare(scene, plot)
    with reported(scene):
        from flywheel.designs import variation as study
        from flywheel.designs.variation import figure_names
        from flywheel.tables import designs
        from flywheel.tables.rows import encoded

        machine_scene = loaded(scene)
        with _arguments(dict.fromkeys((*paths, *of))):
            names = tuple(figure_names(of))
            result = study.sensitivities(machine_scene, paths or None, engine=engine)
            study.check_figures(result, names)
        if plot is not None:
            from flywheel.pictures import designs as picture

            _drawn(picture.plot_sensitivities, result, plot, names)
        show(encoded(result.as_dict(), indent=2) if as_json else designs.sensitivities_text(result, names))


@click.command(short_help="Print the spread of figures for numbers within tolerances.")
@SCENE
@click.option(
    "--vary",
    callback=spans,
    multiple=True,
    required=True,
    metavar="PATH=LOW:HIGH|±SIGMA",
    help="An interval, mechanism.rod.length=595mm:605mm, or a standard deviation, load.0.from=±1deg; repeatable, all alike.",
)
@_OF
@click.option("--samples", type=int, default=512, show_default=True, help="A power of two; twice as many samples are taken.")
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Seed of the samples.")
@click.option(
    "--keep",
    callback=limits,
    multiple=True,
    metavar="FIGURE<=VALUE",
    help='A limit, such as "power<=5kW", and the probability that it is kept; repeatable.',
)
@click.option(
    "--quantile",
    "quantiles",
    type=click.FloatRange(0.0, 1.0, min_open=True, max_open=True),
    multiple=True,
    help="A share of the designs, such as 0.95, in place of 0.01, 0.5 and 0.99; repeatable.",
)
@click.option(
    "--within",
    callback=spans,
    multiple=True,
    metavar="PATH=LOW:HIGH",
    help="Limits of a number with a standard deviation: parts beyond them are sorted out; repeatable.",
)
@click.option(
    "--correlate",
    "correlations",
    callback=pairs,
    multiple=True,
    metavar="PATH,PATH=RHO",
    help="Correlation of two numbers with standard deviations, from -1 to 1; repeatable.",
)
@json_flag()
@plot_option("Draw histograms of figures, and the contributions to their variance.")
@click.option("--engine", type=click.Choice(["numpy", "numba", "size"]), help=_ENGINE)
def tolerance(
    scene: Path,
    vary: dict[str, Any],
    of: tuple[str, ...],
    samples: int,
    seed: int,
    keep: dict[str, tuple[Any, Any]],
    quantiles: tuple[float, ...],
    within: dict[str, Any],
    correlations: dict[tuple[str, str], float],
    as_json: bool,
    plot: Path | None,
    engine: str | None,
) -> None:
    """Print the effect of tolerances of some numbers on the figures of SCENE, and the share of each number.

    Intervals: the least and greatest value of every figure, by optimisation. Deviations: mean, deviation and quantiles.
    Ctrl-C ends the command and prints the results of the designs so far.
    """
    spare(scene, plot)
    with reported(scene):
        from flywheel.designs import tolerance as study
        from flywheel.designs.variation import figure_names
        from flywheel.tables import designs
        from flywheel.tables.rows import encoded

        machine_scene, options = loaded(scene), dict[str, Any](samples=samples, seed=seed, engine=engine, keep=keep)
        options |= {"quantiles": quantiles} if quantiles else {}
        options |= {"within": within, "correlations": correlations}
        with _arguments(vary, dict.fromkeys(of)):
            names = tuple(figure_names(of))
            result = study.tolerance(machine_scene, vary, figures=names or None, **options)
        if plot is not None:
            from flywheel.pictures import designs as picture

            _drawn(picture.plot_tolerance, result, plot, names)
        show(encoded(result.as_dict(), indent=2) if as_json else designs.tolerance_text(result, names))
    if result.interrupted:
        sys.exit(INTERRUPTED)


@click.command(short_help="Find the numbers of a scene that minimize or maximize a figure.")
@SCENE
@click.option(
    "--minimize",
    multiple=True,
    metavar="FIGURE",
    help="Such as flywheel.exact, flywheel.mass, power; or an expression of some. Of several figures, also to maximize, the "
    "designs are listed that no other one betters in all.",
)
@click.option("--maximize", multiple=True, metavar="FIGURE", help="The same, to maximize.")
@click.option(
    "--points",
    type=click.IntRange(2, 1000),
    default=9,
    show_default=True,
    help="Of several figures: the number of levels of each beyond the first.",
)
@click.option(
    "--over",
    callback=spans,
    multiple=True,
    metavar="PATH=LOW:HIGH",
    help="A number of the scene and its bounds, such as mechanism.rod.length=400mm:800mm; repeatable.",
)
@click.option(
    "--choose",
    callback=choices,
    multiple=True,
    metavar="PATH=VALUE,VALUE|LOW:HIGH",
    help='Values to choose from, such as "flywheel.material=grey cast iron,carbon steel"; whole numbers, flywheel.arms=4:8; '
    "motors of a table, drive.motor=motors.csv; repeatable, all combinations.",
)
@click.option(
    "--subject-to",
    "limits",
    callback=limits,
    multiple=True,
    metavar="FIGURE<=VALUE",
    help='A limit that figures keep, such as "power<=5kW"; repeatable.',
)
@click.option(
    "--starts",
    type=click.IntRange(1, 1000),
    default=4,
    show_default=True,
    help="Number of searches, each from another design.",
)
@click.option("--seed", type=click.IntRange(0, 2**32 - 1), default=0, show_default=True, help="Seed of the first designs.")
@_JOBS
@click.option(
    "--resume",
    type=click.Path(dir_okay=False, path_type=Path),
    help="File in which finished combinations of --choose are kept; the same command continues from it.",
)
@json_flag()
@plot_option("Draw the course of the search.")
@click.option("--engine", type=click.Choice(["numpy", "numba", "size"]), help=_ENGINE)
def optimize(
    scene: Path,
    minimize: tuple[str, ...],
    maximize: tuple[str, ...],
    points: int,
    over: dict[str, Any],
    choose: dict[str, Any],
    limits: dict[str, tuple[Any, Any]],
    starts: int,
    seed: int,
    jobs: int | None,
    resume: Path | None,
    as_json: bool,
    plot: Path | None,
    engine: str | None,
) -> None:
    """Find the numbers of SCENE, within bounds, that minimize or maximize a figure and keep limits of other figures.

    The best design is confirmed by sizing it and designs around it, none of which may be better. Of several figures the
    command lists the front: the designs that no other one betters in one figure without being worse in another. Ctrl-C ends
    the search and prints the best design so far.
    """
    if not (minimize or maximize):
        raise click.UsageError("Give --minimize FIGURE or --maximize FIGURE.")
    if not (over or choose):
        raise click.UsageError("Give --over PATH=LOW:HIGH or --choose PATH=VALUE,VALUE.")
    several = len(minimize) + len(maximize) > 1
    if resume is not None and (several or not choose):
        raise click.UsageError("--resume keeps the combinations of --choose, for a single figure.")
    if plot is not None and not over and not several:
        raise click.UsageError("--plot draws the search over numbers: give --over PATH=LOW:HIGH.")
    spare(scene, plot)
    with reported(scene):
        from flywheel.designs import optimum, pareto
        from flywheel.designs.sweep_results import ParetoFront
        from flywheel.tables import designs
        from flywheel.tables.rows import encoded

        options: dict[str, Any] = {"over": over, "choose": choose, "subject_to": limits, "starts": starts, "seed": seed}
        machine_scene, options = loaded(scene), options | {"engine": engine, "jobs": jobs or 1, "progress": None}
        result: optimum.Optimum | ParetoFront
        with _arguments(over, limits, choose, {"choose": None}):
            if several:
                result = pareto.pareto(machine_scene, minimize, maximize=maximize, points=points, **options)
            else:
                aim = "minimize" if minimize else "maximize"
                options |= {aim: (minimize + maximize)[0], "resume": resume}
                result = optimum.optimize(machine_scene, **options)
        if plot is not None:
            from flywheel.pictures import designs as picture

            _drawn(picture.plot_front if isinstance(result, ParetoFront) else picture.plot_optimum, result, plot)
        text = designs.front_text(result) if isinstance(result, ParetoFront) else designs.optimum_text(result)
        show(encoded(result.as_dict(), indent=2) if as_json else text)
        for message in result.messages if as_json else ():
            click.echo(message, err=True)
    if result.interrupted:
        sys.exit(INTERRUPTED)


_WHEEL = {"inertia": "inertia", "mass": "mass", "diameter": "length"}


def _of_wheel(context: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> dict[str, float]:
    """Bounds or prices of a wheel, by inertia, mass or diameter."""
    inertias: dict[str, float] = {}
    for text in values:
        name, equals, value = (part.strip() for part in text.partition("="))
        limit = parameter.name == "wheel_limits"
        number = quantity(value, _WHEEL[name] if limit else "number") if equals and name in _WHEEL else None
        if number is None or name in inertias:
            names, example = ", ".join(_WHEEL), "mass=300 kg" if limit else "mass=3.5"
            raise click.BadParameter(
                f'{text!r}: one of {names} once, with its {"bound" if limit else "price"}: "{example}".'
            )
        inertias[name] = number
    return inertias


@click.command(short_help="Choose a motor, with its flywheel, from a table of motors.")
@SCENE
@click.option(
    "--catalogue",
    type=click.Path(path_type=Path),
    required=True,
    metavar="FILE.csv",
    help="The table: name, power, speed, poles, frequency, breakdown_ratio, inertia, price... (topic catalogue).",
)
@click.option(
    "--ratio",
    type=click.Choice(["adjusted", "fixed"]),
    help="adjusted (default if the motor has a shaft of its own): the ratio of its shaft is adapted to each motor, so that "
    "the crank keeps its speed; fixed: the ratio is the scene's.",
)
@click.option(
    "--at",
    metavar="ANGLE",
    help='Crank angle at the start, such as "30 deg" (default: 0); worst: the angle with the greatest load.',
)
@click.option("--start-time", metavar="TIME", help='Longest time that a start may take, such as "10 s" (default: any).')
@click.option(
    "--wheel-limit",
    "wheel_limits",
    callback=_of_wheel,
    multiple=True,
    metavar="NAME=VALUE",
    help='Greatest inertia, mass or diameter of the flywheel, such as "mass=300 kg"; repeatable.',
)
@click.option(
    "--wheel-price",
    "wheel_prices",
    callback=_of_wheel,
    multiple=True,
    metavar="NAME=PRICE",
    help='Price of the flywheel for each kg m^2 of inertia, kg of mass, m of diameter, such as "mass=3.5"; repeatable.',
)
@click.option("--skip-faulty", is_flag=True, help="Leave faulty rows of the table out instead of refusing it.")
@click.option("--rtol", type=float, callback=within(*_RTOL), help="Required relative error of each flywheel.")
@_JOBS
@click.option("--rows", type=click.IntRange(1, 10_000), default=_ROWS, show_default=True, help="Motors in the table shown.")
@json_flag()
@csv_flag()
def motor(
    scene: Path,
    catalogue: Path,
    ratio: str | None,
    at: str | None,
    start_time: str | None,
    wheel_limits: dict[str, float],
    wheel_prices: dict[str, float],
    skip_faulty: bool,
    rtol: float | None,
    jobs: int | None,
    rows: int,
    as_json: bool,
    as_csv: bool,
) -> None:
    """Size SCENE with every motor of a table in place of its drive; list the suitable ones, the cheapest first.

    The others are listed with the reason: too weak to start or drive the machine; too hot in operation or during the
    start; a limit that no flywheel keeps. Limits are rated heat and torque, or [flywheel.limits]. Ctrl-C ends the search
    and prints the finished motors.
    """
    exclusive(json=as_json, csv=as_csv)
    angle = 0.0 if at is None else at if at == "worst" else quantity(at, "angle")
    if angle is None:
        raise click.BadParameter(f'{at!r} is not an angle with its unit, such as "30 deg".', param_hint="--at")
    longest = None if start_time is None else quantity(start_time, "time")
    if start_time is not None and longest is None:
        raise click.BadParameter(f'{start_time!r} is not a time with its unit, such as "10 s".', param_hint="--start-time")
    with reported(scene):
        from flywheel.designs import catalogue as study
        from flywheel.numerics.faults import SceneError
        from flywheel.reading.catalogue import read_catalogue
        from flywheel.tables import designs
        from flywheel.tables.rows import encoded

        machine_scene = loaded(scene)
        try:
            table = read_catalogue(catalogue, skip_faulty=skip_faulty)
        except SceneError as error:
            for fault in error.faults:
                click.echo(str(fault), err=True)
            sys.exit(1)
        for fault in table.faults:
            click.echo(f"left out: {fault}", err=True)
        with _arguments({"ratio": None}):
            result = study.suitable_motors(
                machine_scene,
                table,
                ratio=ratio,
                at=angle,
                start_time=longest,
                wheel_limits=wheel_limits,
                wheel_prices=wheel_prices,
                rtol=rtol,
                jobs=jobs or 1,
                progress=None,
            )
        if as_csv:
            show(designs.motors_csv(result))
        else:
            show(encoded(result.as_dict(), indent=2) if as_json else designs.motors_text(result, rows))
        for note in result.notes if as_json or as_csv else ():
            click.echo(note, err=True)
    if result.missing:
        click.echo(f"interrupted: {result.missing} motors were not examined; the table holds those before", err=True)
        sys.exit(INTERRUPTED)
    if not result.suitable:
        click.echo("no motor of the table is suitable", err=True)
        sys.exit(1)


COMMANDS = (sweep, sensitivities, tolerance, optimize, motor)
