"""Commands of one machine: `size`, `power`, `tradeoff`, `reduce`, `graph`, `reactions`, and its live page and report."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from math import isfinite
from pathlib import Path
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

from flywheel.cli.common import (
    INTERRUPTED,
    MOST_POINTS,
    OUTPUT,
    SCENE,
    CourseOptions,
    at_option,
    comma_names,
    coordinates,
    course_options,
    csv_flag,
    exclusive,
    hand_over,
    json_flag,
    language_option,
    loaded,
    of_ending,
    plot_option,
    quantity,
    remarked,
    reported,
    show,
    slides,
    spare,
    watched,
    within,
    written,
)
from flywheel.cli.common import speed as speed_of
from flywheel.language import message
from flywheel.language import text as _
from flywheel.scene.scene import LEVELS, NORMAL, RTOL

if TYPE_CHECKING:
    from flywheel.machine.reactions import Array
    from flywheel.motions.joint_forces import JointForces
    from flywheel.motions.motion import Transient
    from flywheel.scene.scene import Scene


from contextlib import suppress


@click.command(short_help="Size the flywheel of a scene, or analyse a given one.")
@SCENE
@json_flag("Print the result as JSON, SI throughout.")
@click.option("--rtol", type=float, callback=within(*RTOL), help="Required relative accuracy of every figure.")
@click.option("--no-simulate", is_flag=True, help="Leave out the time simulation that confirms the result (normal).")
@click.option(
    "--accuracy",
    type=click.Choice(LEVELS),
    help="normal, or fast: the exact figures. confirm: these, and the motion by collocation. audit (default): these, and "
    "the motion stepped in time. proof: the exact figures with intervals in which they are proven to lie.",
)
@click.option("--full", is_flag=True, help="Print the full listing: every figure with all its digits, in SI.")
@click.option(
    "--units",
    type=click.Choice(["si", "us"]),
    help="Units of the summary: si (default), or us for WR² in lb ft², hp, psi, lbf ft, in.",
)
@language_option("Language of the summary (default en).")
@click.option(
    "--explain", is_flag=True, help="Explain the method of solution and its choice, what was left out, and the cost."
)
@plot_option("Draw moment, inertia, Wittenbauer's loop and speed into a file.")
def size(
    scene: Path,
    as_json: bool,
    rtol: float | None,
    no_simulate: bool,
    accuracy: str | None,
    full: bool,
    units: str | None,
    language: str | None,
    explain: bool,
    plot: Path | None,
) -> None:
    """Size (or analyse) the flywheel of the machine in SCENE, a TOML file, and print a summary.

    --full prints all figures, including areas and reduced inertia.
    """
    for option, value in (("units", units), ("language", language)):
        if value is not None and (full or as_json):
            raise click.UsageError(f"--{option} is for the summary: --{'json' if as_json else 'full'} is SI, in English.")
    exclusive(full=full, json=as_json)
    if no_simulate and accuracy not in (None, "fast", NORMAL):
        raise click.UsageError(f"--no-simulate means --accuracy normal, and contradicts --accuracy {accuracy}.")
    spare(scene, plot)
    with reported(scene):
        from flywheel.language import use
        from flywheel.reading.scenes import load
        from flywheel.sizing import sizing

        read = load(scene)
        if read.single_stroke is not None:
            options: dict[str, object] = {"accuracy": accuracy, "no-simulate": no_simulate, "explain": explain}
            if value := next((name for name, value in options.items() if value), None):
                raise click.UsageError(f"--{value} does not apply to [single_stroke]: every figure is that of the motion.")
            _stroke_by_stroke(read, rtol, as_json, full, units, language, plot)
            return
        result, explained = sizing.size(read, rtol, accuracy=NORMAL if no_simulate else accuracy), None
        if explain:
            from flywheel.tables.explanation import explanation

            explained = explanation(result)
        if as_json or full:
            from flywheel.tables import sizing as listing
        if as_json:
            show(listing.json(result, None if explained is None else explained.as_dict()))
            remarked(scene, listing.remarks(result))
            for message in result.messages:
                click.echo(message, err=True)
        else:
            from flywheel.tables import summary

            with use(language or "en"):
                text = listing.text(result) if full else summary.text(result, units or "si")
            show(text if explained is None else f"{text}\n{explained.text()}")
        if plot is not None:
            from flywheel.pictures import sizing as picture

            with written(plot), use(language or "en"):
                picture.plot(result, plot)


def _stroke_by_stroke(
    scene: Scene, rtol: float | None, as_json: bool, full: bool, units: str | None, language: str | None, plot: Path | None
) -> None:
    """Print the periodic stroke of a machine with clutch and brake, and draw it."""
    from flywheel.language import use
    from flywheel.motions.single_stroke import single_stroke
    from flywheel.tables import strokes
    from flywheel.tables.rows import encoded

    stroke = single_stroke(scene, rtol)
    with use(language or "en"):
        show(encoded(stroke.as_dict()) if as_json else strokes.full(stroke) if full else strokes.text(stroke, units or "si"))
        if plot is not None:
            with written(plot):
                stroke.plot(plot)


def _speed(context: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
    if text is None or quantity(text, "speed", "velocity") is not None:
        return text
    raise click.BadParameter(
        f'{text!r} is not a speed with its unit, such as "60 rpm", or "0.3 m/s" where the driver slides.'
    )


def _angle(context: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    if text is None:
        return None
    angle = quantity(text, "angle")
    if angle is None:
        raise click.BadParameter(f'{text!r} is not an angle with its unit, such as "30 deg" or "0.5 rad".')
    return angle


@click.command(short_help="Print reduced inertia, moment and influence coefficients.")
@SCENE
@json_flag()
@csv_flag("Print CSV, SI throughout (default).")
@click.option(
    "--points",
    type=click.IntRange(1, MOST_POINTS),
    help="Number of angles, evenly over the cycle, or of positions along the stroke (default 360).",
)
@at_option()
@click.option(
    "--speed",
    callback=_speed,
    metavar="SPEED",
    help="A constant speed such as \"60 rpm\", for figures that depend on it (default: the scene's, or the machine's own).",
)
@plot_option(
    "Draw I*, M* with the share of every load, and influence coefficients over the whole cycle or stroke into a file."
)
@language_option(expose_value=False)
@click.option(
    "--of",
    multiple=True,
    metavar="NAME",
    help="With --plot: a body, slide, joint or point whose influence coefficient is drawn; repeatable (default: bodies and "
    "slides).",
)
@OUTPUT
def reduce(
    scene: Path,
    as_json: bool,
    as_csv: bool,
    points: int | None,
    at: tuple[str, ...],
    speed: str | None,
    plot: Path | None,
    of: tuple[str, ...],
    output: Path | None,
) -> None:
    """Print I*, dI*/dphi, M*, every influence coefficient and position of SCENE over the crank angle.

    If the driver slides, these are m*, dm*/dx and F* over its position. Along a stroke of known speed the driving action,
    speeds and accelerations are added. A scene with a mechanism alone is enough.
    """
    exclusive(json=as_json, csv=as_csv)
    exclusive(at=at, points=points)
    if of and plot is None:
        raise click.UsageError("--of goes with --plot.")
    spare(scene, output, plot)
    with reported(scene):
        from flywheel.tables.reduction import reduced

        machine_scene = loaded(scene)
        own = None if speed is None else speed_of(speed, slides(machine_scene), "--speed")
        if plot is not None:
            from flywheel.pictures import kinematics as picture

            with written(plot):
                picture.plot_reduction(machine_scene, plot, of=of, speed=own)
        text, conditions = reduced(
            machine_scene, coordinates(at, slides(machine_scene)), points or 360, speed=own, as_json=as_json
        )
    if conditions:
        click.echo(conditions, err=True)
    hand_over(text, output, scene)


@click.command(short_help="Print and draw the bond graph of a scene.")
@SCENE
@plot_option("Draw the graph with half arrows, causal strokes and bond numbers into a file.")
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "markdown", "latex"]),
    default="text",
    show_default=True,
    help="Format of the table of bonds.",
)
@click.option("--simplify", "simpler", is_flag=True, help="Apply the simplification rules first, and list their effects.")
@click.option(
    "--map", "mapped", is_flag=True, help="Print the element that each part became; the picture has parts in colours."
)
@language_option("Language of map, picture and messages (default en).")
def graph(scene: Path, plot: Path | None, form: str, simpler: bool, mapped: bool, language: str | None) -> None:
    """Print the bond graph of the machine in SCENE: of every bond its half arrow, causal stroke, effort and flow."""
    if mapped and form == "latex":
        raise click.UsageError("--map is text or markdown: --format latex is for the table of bonds.")
    if language is not None and not mapped and plot is None:
        raise click.UsageError("--language is that of map and picture: add --map or --plot.")
    spare(scene, plot)
    with reported(scene):
        from flywheel.language import message, use
        from flywheel.reading.scenes import load
        from flywheel.tables.reduction import draw_graph, graph_map, graph_table, machine_graph, map_table

        source = load(scene)
        drawn, log = machine_graph(source, simplified=simpler)
        with use(language or "en"):
            rows = graph_map(drawn, source) if mapped else ()
            text = "\n".join([*map(message, log), map_table(drawn, rows, form) if mapped else graph_table(drawn, form)])
            if plot is not None:
                with written(plot):
                    draw_graph(drawn, plot, scene, rows)
            show(text)


@click.command(short_help="Print and draw the power flow of a steady cycle.")
@SCENE
@click.option(
    "--at",
    callback=_angle,
    metavar="ANGLE",
    help='Show the powers, and the energy stored, at a crank angle such as "90 deg" too; the picture shows those.',
)
@json_flag()
@click.option("--rtol", type=float, callback=within(*RTOL), help="Required relative accuracy of every figure.")
@plot_option("Draw the Sankey diagram from the motor to the tool into a file.")
@language_option("Language of table, picture and messages (default en).")
def power(scene: Path, at: float | None, as_json: bool, rtol: float | None, plot: Path | None, language: str | None) -> None:
    """Print the power flow of SCENE from its input through every mesh to the loads, with all losses.

    The powers are means over the steady cycle with the given or sized flywheel. Losses and loads sum to the input.
    """
    if language is not None and as_json and plot is None:
        raise click.UsageError("--language is for table and picture: --json is SI, in English.")
    spare(scene, plot)
    with reported(scene):
        from flywheel.language import use
        from flywheel.numerics.faults import Fault, SceneError
        from flywheel.sizing import sizing

        flow = sizing.size(loaded(scene), rtol, accuracy=NORMAL).power_flow
        if flow is None:
            raise SceneError([Fault("areas", "a diagram of areas", "a machine", "areas do not show where the power goes")])
        from flywheel.tables import power as listing

        with use(language or "en"):
            show(listing.json(flow, at) if as_json else listing.text(flow, at))
            if plot is not None:
                from flywheel.pictures import power_flow as picture

                with written(plot):
                    picture.plot(flow, plot, at=at)


# -- reactions -------------------------------------------------------------------------------------------------------

_TABLE_POINTS, _CURVE_POINTS = (
    24,
    360,
)  # positions in tables for reading; in data, pictures and the search for the largest forces


def _components(context: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> tuple[str, ...]:
    from flywheel.motions.joint_forces import COMPONENTS
    from flywheel.numerics.faults import suggestion

    names = comma_names(context, parameter, values)
    for name in names:
        if name not in COMPONENTS:
            raise click.BadParameter(f"{name!r} is not a component; {suggestion(name, COMPONENTS)}")
    return names


@click.command(short_help="Print and draw the driving action and the forces in every joint.")
@SCENE
@json_flag()
@csv_flag()
@click.option(
    "--points",
    type=click.IntRange(1, MOST_POINTS),
    help="Number of positions, or of times (default 24; 360 for CSV, JSON and the picture).",
)
@at_option("repeatable. With --from: the starting position.")
@click.option(
    "--speed",
    callback=_speed,
    metavar="SPEED",
    help='A constant speed such as "60 rpm", instead of that of the steady cycle with its flywheel, or of the stroke.',
)
@click.option("--quasi-static", is_flag=True, help="Leave inertia forces out.")
@click.option("--no-friction", is_flag=True, help="Leave friction in the joints out.")
@click.option(
    "--over", type=click.Choice(["driver", "time"]), help="Tables and curves over the driver's position or the time."
)
@click.option(
    "--of", multiple=True, callback=comma_names, metavar="JOINT", help="A joint; repeatable, or with commas (default: all)."
)
@click.option(
    "--component",
    "components",
    multiple=True,
    callback=_components,
    metavar="NAME",
    help="x, y, normal, moment, resultant, driving, friction, ...; repeatable, or with commas (default: all but x and y of "
    "joints that are not pins).",
)
@click.option("--together", is_flag=True, help="Draw one panel for each component with all joints, not one for each joint.")
@click.option("--hodograph", is_flag=True, help="Draw the reactions as hodographs instead of curves.")
@click.option(
    "--breaks", is_flag=True, help="Add to CSV and JSON both sides of the positions or times at which laws switch."
)
@course_options(start=None)
@plot_option(
    "Draw the reactions: as curves with --over or along a motion in time; else polar for pins, over the motion for slides, "
    "with one file for each of several mechanisms: FILE-NAME.png."
)
@language_option(expose_value=False)
@OUTPUT
def reactions(
    scene: Path,
    as_json: bool,
    as_csv: bool,
    points: int | None,
    at: tuple[str, ...],
    speed: str | None,
    quasi_static: bool,
    no_friction: bool,
    over: str | None,
    of: tuple[str, ...],
    components: tuple[str, ...],
    together: bool,
    hodograph: bool,
    breaks: bool,
    start: str | None,
    end: str | None,
    no_drive: bool,
    wheel: float | None,
    plot: Path | None,
    output: Path | None,
) -> None:
    """Print the driving action of every mechanism in SCENE and the reactions in its joints.

    The motion is the steady regime, the stroke, a constant --speed, or a motion in time: --from rest --until "5 s", as in
    `flywheel simulate`.
    """
    course = CourseOptions(start, end, no_drive, wheel)
    exclusive(json=as_json, csv=as_csv)
    exclusive(hodograph=hodograph, together=together)
    exclusive(**{"speed": speed, "a motion in time (from, until, no-drive)": course.in_time})
    if course.in_time and len(at) > 1:
        raise click.UsageError("A motion in time starts at one place: give --at once.")
    if not course.in_time:
        exclusive(at=at, points=points)
        if wheel is not None:
            raise click.UsageError("--flywheel belongs to a motion in time: give --from or --until.")
    over = over or ("time" if course.in_time else "driver" if components or together else None)
    kinds: dict[str, Any] = {"inertia": not quasi_static, "friction": not no_friction}
    as_data = as_json or as_csv
    count = points or (_CURVE_POINTS if as_data else _TABLE_POINTS)
    spare(scene, output, plot)
    with reported(scene), watched(end) as watching:
        import numpy as np

        from flywheel.machine.machine import Machine
        from flywheel.motions.joint_forces import joint_errors, joint_forces
        from flywheel.tables import reduction as forces

        machine_scene = loaded(scene)
        if course.in_time:
            watching.sliding = slides(machine_scene)
            run = course.follow(machine_scene, at[0] if at else None, watching)
            result, dense_forces = _along(run, count, breaks, kinds)
        else:
            kinds["speed"] = None if speed is None else speed_of(speed, slides(machine_scene), "--speed")
            backwards = over == "time" and (kinds["speed"] or 0.0) < 0.0
            result, dense_forces = _at(
                machine_scene, coordinates(at, slides(machine_scene)), count, breaks, kinds, backwards
            )
        dense = dense_forces() if dense_forces is not None and (plot is not None or not as_data) else None
        if plot is not None:
            drawn = dense or joint_forces(machine_scene, np.unique(result.motion.phi), **kinds)
            if over is not None and not hodograph:
                _draw_curves(machine_scene, forces.cleared(drawn), (over, of, components, together), plot)
            else:
                _draw_hodographs(forces.cleared(result if points and not course.in_time else drawn), of, plot)
        if as_json:
            errors = joint_errors(
                result.machine or Machine(machine_scene), result, inertia=kinds["inertia"], friction=kinds["friction"]
            )
            text = forces.forces_json(machine_scene, result, errors, of, components)
        elif as_csv:
            text = forces.forces_csv(machine_scene, result, over, of, components)
        elif over is None and not of:
            text = forces.forces_text(machine_scene, result, dense)
        else:
            text = forces.curves_text(machine_scene, result, dense, over or "driver", of, components)
        for message in forces.forces_messages(machine_scene, result) if as_data else ():
            click.echo(message, err=True)
    hand_over(text, output, scene)


def _at(
    scene: Scene, places: Sequence[float], count: int, breaks: bool, kinds: Mapping[str, Any], backwards: bool
) -> tuple[JointForces, Callable[[], JointForces] | None]:
    """Forces at positions (evenly spaced if none are named), and a function for close positions; in the order of time."""
    import numpy as np

    from flywheel.machine.machine import Machine
    from flywheel.motions.joint_forces import close_angles, closely, joint_forces, spread

    machine = Machine(scene)
    order = slice(None, None, -1 if backwards else 1)
    result = joint_forces(machine, places or spread(scene, count)[order], **kinds)
    if breaks:
        every = np.unique(np.concatenate((result.motion.phi, close_angles(result, 0))))
        result = joint_forces(machine, every[order], **kinds)

    def along(phi: Array) -> JointForces:
        return joint_forces(machine, phi, **kinds)

    return result, None if places else lambda: closely(result, along, max(count, _CURVE_POINTS))


def _along(
    run: Transient, count: int, breaks: bool, kinds: Mapping[str, Any]
) -> tuple[JointForces, Callable[[], JointForces] | None]:
    """The same along a motion in time, from its start to its end."""
    from flywheel.motions.joint_forces import along_run, closely_along
    from flywheel.motions.motion import evenly

    trail = run.motion.trail
    assert trail is not None
    return along_run(run, *evenly(trail, count, breaks), **kinds), partial(closely_along, run, **kinds)


def _draw_hodographs(joint_forces_along: JointForces, of: Sequence[str], path: Path) -> None:
    """Draws one picture for each mechanism, over the machine's position; with several the file names contain their names."""
    from flywheel.motions.joint_forces import joints_named
    from flywheel.pictures.reactions import polar

    names: dict[str, list[str]] = {}
    for mechanism, joint in joints_named(joint_forces_along, of):
        names.setdefault(mechanism, []).append(joint)
    for name, joints in names.items():
        own = joint_forces_along.mechanisms[name]
        forces = own._replace(poses=own.poses._replace(q=joint_forces_along.motion.phi))
        file = path if len(joint_forces_along.mechanisms) == 1 else path.with_stem(f"{path.stem}-{name}")
        with written(file):
            polar(forces, file, joints)
            click.echo(f"wrote {file}", err=True)


def _draw_curves(
    scene: Scene,
    forces: JointForces,
    which: tuple[str, Sequence[str], Sequence[str], bool],
    path: Path,
) -> None:
    """Draws curves over the driver's position or the time, all in one picture."""
    from flywheel.motions.joint_forces import RESULTANT, axis, force_curves
    from flywheel.pictures.reactions import curves

    over, of, components, together = which
    chosen, along = force_curves(forces, of, components), axis(forces, over)
    if not components:  # its size beside a force would hide it
        chosen = [curve for curve in chosen if curve.component != RESULTANT]
    with written(path):
        title = _(
            "{title}: forces in the joints, {condition}",
            title=scene.title or _("Machine"),
            condition=message(forces.condition),
        )
        curves(chosen, along, title, path, together=together)
        click.echo(f"wrote {path}", err=True)


# -- tradeoff --------------------------------------------------------------------------------------------------------

_QUIET = 2.0  # seconds before the first output
_EVERY, _EVERY_ON_TERMINALS = 5.0, 0.25  # seconds between two words


def _seconds(context: click.Context, parameter: click.Parameter, budget: float) -> float:
    if not (isfinite(budget) and budget > 0.0):
        raise click.BadParameter(f"{budget:g} is not a number of seconds above 0.")
    return budget


@click.command(short_help="Measure the cost of accuracy: every method on a scene.")
@SCENE
@click.option("--rtol", type=float, callback=within(*RTOL), help="Relative error to be kept (default: the scene's).")
@click.option(
    "--budget",
    type=float,
    default=60.0,
    show_default=True,
    callback=_seconds,
    metavar="SECONDS",
    help="Time after which no further method is started.",
)
@plot_option("Draw errors over times into a file.")
@json_flag()
def tradeoff(scene: Path, rtol: float | None, budget: float, plot: Path | None, as_json: bool) -> None:
    """Run every method that applies to SCENE; print the true error and time of each, and the cheapest one.

    Ctrl-C ends the comparison and prints the finished methods.
    """
    spare(scene, plot)
    with reported(scene):
        with _progress(budget) as progress:
            from flywheel.study import tradeoff as study

            result = study.tradeoff(loaded(scene), rtol, budget=budget, progress=progress)
        from flywheel.tables import designs

        show(designs.tradeoff_json(result) if as_json else designs.tradeoff_text(result))
        for line in designs.unfinished(result) if as_json else ():
            click.echo(line, err=True)
        if plot is not None:
            from flywheel.pictures import designs as picture

            with written(plot):
                picture.plot_tradeoff(result, plot)
    if result.interrupted:
        sys.exit(INTERRUPTED)


@contextmanager
def _progress(budget: float) -> Iterator[_Progress]:
    """Progress of a long comparison on standard error, in one line that is rewritten on a terminal."""
    progress, over = _Progress(budget), Event()

    def tick() -> None:
        pause = _QUIET
        while not over.wait(pause):
            progress.tell()
            pause = _EVERY_ON_TERMINALS if progress.rewriting else _EVERY

    ticker = Thread(target=tick, daemon=True)
    ticker.start()
    try:
        yield progress
    finally:
        over.set()
        ticker.join()
        progress.erase()


class _Progress:
    """Progress of a comparison: the method that is running."""

    def __init__(self, budget: float) -> None:
        self.budget = budget
        self.begun = monotonic()
        self.line = "finding the reference"
        self.rewriting = sys.stderr.isatty()
        self.written = False

    def __call__(self, k: int, count: int, name: str) -> None:
        self.line = f"{k + 1} of {count}: {name}"

    def tell(self) -> None:
        """Writes the current method."""
        line = f"{self.line} ({monotonic() - self.begun:.0f} s of about {self.budget:g} s)"
        if not self.rewriting:
            click.echo(line, err=True)
            return
        from shutil import get_terminal_size

        self.written = True
        click.echo(f"\r\x1b[2K{line[: get_terminal_size().columns - 1]}", err=True, nl=False, color=True)

    def erase(self) -> None:
        """Clear the line of the terminal."""
        if self.written:
            click.echo("\r\x1b[2K", err=True, nl=False, color=True)


@click.command("open", short_help="Open a scene as a live page in the browser.")
@click.argument("scene", type=click.Path(path_type=Path, readable=False), required=False)
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port of this machine, else any free one.")
@click.option("--no-browser", is_flag=True, help="Print the page's address without opening a browser.")
@language_option("English (default) or Spanish.", default="en")
def open_page(scene: Path | None, port: int, no_browser: bool, language: str) -> None:
    """Open SCENE, a TOML file, as a live page in the browser: a form of its values, and figures that follow them.

    Without SCENE the page offers starters. The server is reachable only from this computer, at an address with a secret;
    Ctrl+C ends it. Only Save on the page changes the file.
    """
    from flywheel.page.edits import Session
    from flywheel.page.server import PageServer

    with reported(scene or Path("scene")):
        session = Session(scene, language)
    try:
        server = PageServer(session, port)
    except OSError as error:
        raise click.UsageError(f"port {port} cannot be used ({error.strerror}): give another one, or none.") from error
    show(f"{server.address}\nCtrl+C ends it.")
    sys.stdout.flush()
    if not no_browser:
        import webbrowser

        with suppress(webbrowser.Error):
            webbrowser.open(server.invitation())
    with suppress(KeyboardInterrupt):
        server.serve_forever()
    with suppress(KeyboardInterrupt):
        server.server_close()


@click.command(short_help="Write a worked report, every step with its numbers, as HTML or PDF.")
@SCENE
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    callback=of_ending(".html", ".htm", ".pdf"),
    metavar="FILE.(html|pdf)",
    help="The report's file; a PDF is printed by a browser that is installed.",
)
@language_option("English (default) or Spanish.", default="en")
@click.option("--units", type=click.Choice(["si", "us"]), default="si", help="us: results in US units as well as in SI.")
@click.option("--cover-sheet", is_flag=True, help="The cover sheet alone, to sign.")
@click.option("--rtol", type=float, callback=within(*RTOL), help="Required relative accuracy of every figure.")
@click.option("--accuracy", type=click.Choice(LEVELS), help="normal, confirm or audit (default), as for size.")
@click.option(
    "--printed",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A file with a printed solution, JSON or TOML, to compare with ours (topic report).",
)
def report(
    scene: Path,
    output: Path,
    language: str,
    units: str,
    cover_sheet: bool,
    rtol: float | None,
    accuracy: str | None,
    printed: Path | None,
) -> None:
    """Write the worked report of SCENE, a TOML file: every step as formula, substitution with numbers, and result.

    The cover sheet for the signatures has machine, motor, drive train, flywheel, limits, speeds and remarks.
    The report is one file for A4 that needs no network. For a scene without a flywheel it has the steps that apply.
    """
    spare(scene, output)
    with reported(scene):
        from flywheel import language as languages
        from flywheel.reading.scenes import input_files, load
        from flywheel.report import contents
        from flywheel.report.contents import sized
        from flywheel.report.solutions import solution

        if output.suffix.lower() == ".pdf":
            try:
                contents.browser()
            except contents.PrintError as error:
                click.echo(f"{output}: {error}", err=True)
                sys.exit(1)
        with languages.use(language):
            beside = None if printed is None else solution(printed, scene)
            document = sized(load(scene), rtol, accuracy)
            with written(output):
                try:
                    read = [*input_files(scene), *([] if printed is None else [printed])]
                    contents.write(document, output, units=units, printed=beside, cover_sheet=cover_sheet, inputs=read)
                except contents.PrintError as error:
                    click.echo(f"{output}: {error}", err=True)
                    sys.exit(1)


COMMANDS = (size, power, reduce, graph, reactions, tradeoff, open_page, report)
