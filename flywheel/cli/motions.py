"""Commands that follow or draw motion: `simulate`, `motion`, `draw`, `animate`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from flywheel.cli.common import (
    MOST_POINTS,
    PLOT_FORMATS,
    SCENE,
    CourseOptions,
    at_option,
    coordinates,
    course_options,
    exclusive,
    hand_over,
    json_flag,
    language_option,
    loaded,
    of_ending,
    picture_option,
    plot_option,
    quantity,
    remarked,
    reported,
    slides,
    spare,
    style_option,
    watched,
    within,
    written,
)
from flywheel.cli.common import speed as speed_of

_RTOL = (1e-13, 0.1)
_POINTS = 500
_ROWS = 4  # positions of a motion whose instant centres are printed by default


def _place(context: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
    if text is None or quantity(text, "angle", "length") is not None:
        return text
    raise click.BadParameter(f'{text!r} is not an angle such as "90 deg", nor a position such as "190 mm".')


@click.command(short_help="Follow a machine in time: run-up, run-down, load step, stall.")
@SCENE
@course_options(start="rest")
@click.option("--at", "place", callback=_place, metavar="ANGLE", help='Starting position, such as "90 deg" (default 0).')
@click.option("--csv", "csv_file", metavar="FILE", help="Write the motion as CSV, SI throughout; - prints it.")
@json_flag("Print JSON, SI throughout, with the motion.")
@plot_option("Draw speed, torques and energy over time into a file.")
@language_option(expose_value=False)
@click.option(
    "--points",
    type=click.IntRange(2, MOST_POINTS),
    default=_POINTS,
    show_default=True,
    help="Times in CSV and JSON, evenly from start to end.",
)
@click.option("--breaks", is_flag=True, help="Add to CSV and JSON the times at which laws switch, once for each side.")
@click.option(
    "--rtol", type=float, default=1e-9, show_default=True, callback=within(*_RTOL), help="Allowed error of the motion."
)
@click.option("--output", type=click.Path(path_type=Path), metavar="FILE", help="Write the text or JSON to a file instead.")
def simulate(
    scene: Path,
    start: str,
    place: str | None,
    end: str | None,
    no_drive: bool,
    wheel: float | None,
    csv_file: str | None,
    as_json: bool,
    plot: Path | None,
    points: int,
    breaks: bool,
    rtol: float,
    output: Path | None,
) -> None:
    """Follow the machine in SCENE in time, from a start to an end, and print the result.

    A stall is reported with its angle and time. The table of energies lists all works and heats.
    """
    table = None if csv_file in (None, "-") else Path(str(csv_file))
    spare(scene, output, table, plot)
    if csv_file == "-" and as_json and output is None:
        raise click.UsageError("--csv - and --json exclude each other.")
    with reported(scene), watched(end) as watching:
        from flywheel.tables import motions

        machine_scene = loaded(scene)
        watching.sliding = slides(machine_scene)
        course = CourseOptions(start, end, no_drive, wheel).follow(machine_scene, place, watching, rtol)
        if plot is not None:
            from flywheel.pictures import kinematics as picture

            with written(plot):
                picture.plot_transient(course, plot)
        if table is not None:
            hand_over(motions.transient_csv(course, points, breaks), table, scene)
        write = motions.transient_csv if csv_file == "-" else motions.transient_json if as_json else None
        text = motions.transient_text(course) if write is None else write(course, points, breaks)
    hand_over(text, output, scene)


# -- the motion of everything ----------------------------------------------------------------------------------------


@click.command(short_help="Position, velocity and acceleration of every body, joint and point.")
@SCENE
@click.option(
    "--of",
    multiple=True,
    metavar="NAME",
    help="A body, joint, point, slide or shaft; repeatable, or with commas (default: all).",
)
@click.option(
    "--over",
    type=click.Choice(["driver", "time"]),
    help="Variable of the horizontal axis (default: the driver; with --law and --from time).",
)
@click.option(
    "--at",
    multiple=True,
    metavar="PLACE",
    help='A position such as "30 deg" or "190 mm", over time "0.2 s"; repeatable. With --from an angle is the start.',
)
@click.option(
    "--points",
    type=click.IntRange(2, MOST_POINTS),
    help="Number of positions, evenly spaced, in place of --at (default 361).",
)
@click.option("--speed", "pace", metavar="SPEED", help='A constant speed such as "210 rpm", or scene: that of the scene.')
@click.option("--regime", is_flag=True, help="Along the steady regime, with the flywheel given or sized.")
@click.option("--law", metavar="LAW", help='The driver in time: an expression such as "sin(t)" (rad or m), or a CSV file.')
@course_options(start=None)
@click.option("--full", is_flag=True, help="All bodies, joints and points, not the extremes of the ports alone.")
@click.option("--csv", "as_csv", is_flag=True, help="Print CSV, SI throughout.")
@json_flag("Print JSON, SI throughout, with every figure's error.")
@plot_option("Draw position, velocity and acceleration into a file; with --instant-centres these, at up to four positions.")
@language_option(expose_value=False)
@click.option(
    "--instant-centres",
    "with_centres",
    is_flag=True,
    help="Add the instant centres of every two bodies, and the velocities of points by them.",
)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="FILE", help="Write the text, CSV or JSON to a file."
)
def motion(
    scene: Path,
    of: tuple[str, ...],
    over: str | None,
    at: tuple[str, ...],
    points: int | None,
    pace: str | None,
    regime: bool,
    law: str | None,
    start: str | None,
    end: str | None,
    no_drive: bool,
    wheel: float | None,
    full: bool,
    as_csv: bool,
    as_json: bool,
    plot: Path | None,
    with_centres: bool,
    output: Path | None,
) -> None:
    """Print position, velocity and acceleration of all moving parts of SCENE, over the driver or over time.

    They are per unit of the driver (g and g') by default. The driver may also move at a constant --speed, in the steady
    --regime, by a --law of time with --until "2 s", or as in `flywheel simulate`: --from rest --until "5 s".
    """
    course = CourseOptions(start, None if law else end, no_drive, wheel)
    exclusive(json=as_json, csv=as_csv)
    drivers = {"speed": pace, "regime": regime, "law": law, "a motion in time (from, until, no-drive)": course.in_time}
    named = [name for name, value in drivers.items() if value]
    if len(named) > 1:
        exclusive(**dict.fromkeys(named[:2], True))
    if wheel is not None and not (regime or course.in_time):
        raise click.UsageError("--flywheel goes with --regime or --from.")
    timed = over == "time" or (over is None and bool(law or course.in_time))
    begins = [text for text in at if course.in_time and quantity(text, "angle", "length") is not None]
    rows = [text for text in at if text not in begins]
    exclusive(at=rows, points=points)
    if len(begins) > 1:
        raise click.UsageError("A motion in time starts at one place: give --at once.")
    spare(scene, output, plot)
    with reported(scene), watched(end) as watching:
        from flywheel.motions import driver, kinematics
        from flywheel.tables import motions as listing

        lasting = None if law is None or end is None else _duration(end)
        machine = loaded(scene) if law is None else driver.scene_moved(scene, law, lasting)
        remarked(scene, machine.remarks if law is not None else ())
        watching.sliding = sliding = slides(machine)
        if wheel is not None and regime:
            machine = machine.with_flywheel(wheel)
        result = kinematics.motion(
            machine,
            of=[name.strip() for names in of for name in names.split(",")],
            over=over,
            at=(_times(rows) if timed or course.in_time else coordinates(tuple(rows), sliding)) or None,
            points=points,
            speed=pace if pace in (None, "scene") else speed_of(pace, sliding, "--speed"),
            law=law,
            until=lasting,
            regime=regime,
            transient=course.follow(machine, begins[0] if begins else None, watching) if course.in_time else None,
        )
        listed = bool(rows) or points is not None
        tables = bool(of) or listed
        centres = None
        if with_centres:
            from flywheel.motions.velocities import instant_centres

            count = result.q.size
            few = list(range(count)) if as_csv or as_json or listed else [k * (count - 1) // _ROWS for k in range(_ROWS)]
            centres = instant_centres(machine, result.q[few], speed=None if result.rate is None else result.rate[few])
        if plot is not None:
            with written(plot):
                if centres is not None:
                    from flywheel.pictures.mechanisms import draw_centres

                    draw_centres(centres, plot)
                else:
                    from flywheel.pictures import kinematics as picture

                    picture.plot(result, plot)
        if as_csv or as_json:
            text = (listing.motion_csv if as_csv else listing.motion_json)(result, centres)
        else:
            text = listing.motion_text(result, listed=listed, tables=tables, full=full or tables)
            text += "" if centres is None else f"\n{listing.velocities_text(centres)}"
    for message in result.messages if as_csv else ():
        click.echo(message, err=True)
    hand_over(text, output, scene)


def _duration(text: str) -> float:
    time = quantity(text, "time")
    if time is None or time <= 0.0:
        raise click.BadParameter(f'{text!r} is not a duration such as "2 s".', param_hint="--until")
    return time


def _times(texts: list[str]) -> list[float]:
    """Times (s) given to --at."""
    times = [quantity(text, "time") for text in texts]
    for text, value in zip(texts, times, strict=True):
        if value is None:
            raise click.BadParameter(f'{text!r} is not a time with its unit, such as "0.2 s".', param_hint="--at")
    return [value for value in times if value is not None]


# -- pictures --------------------------------------------------------------------------------------------------------


def _target(scene: Path, output: Path | None, ending: str) -> Path:
    """The file to write: the named one, else a new file with the scene's name."""
    if output is not None:
        return output
    path = Path(scene.with_suffix(ending).name)
    if os.path.lexists(path):
        click.echo(f"{path}: exists already and is left as it is; name a file with --plot", err=True)
        sys.exit(1)
    return path


def _tell(output: Path | None, target: Path) -> None:
    """Prints the name of the file, if the user did not choose it."""
    if output is None:
        click.echo(f"wrote {target}", err=True)


@click.command("draw", short_help="Draw the mechanisms of a scene and the paths of their points.")
@SCENE
@at_option("repeatable, the first one is drawn bold (default: several over the motion).")
@click.option(
    "--path",
    "points",
    multiple=True,
    metavar="NAME",
    help="A joint or a point whose path is drawn, such as B or rod.P; repeatable (default: all that move).",
)
@picture_option(
    "FILE.(png|svg|pdf)",
    of_ending(*PLOT_FORMATS),
    "Write the picture to this file (default: the scene's name with .png in this folder, if there is no such file yet).",
)
@style_option
def draw_mechanisms(scene: Path, at: tuple[str, ...], points: tuple[str, ...], output: Path | None) -> None:
    """Draw the mechanisms of SCENE at chosen positions, with the paths that their points describe."""
    spare(scene, output)
    with reported(scene):
        from flywheel.pictures.mechanisms import draw

        machine_scene = loaded(scene)
        coordinates_drawn = coordinates(at, slides(machine_scene))
        target = _target(scene, output, ".png")
        with written(target):
            draw(machine_scene, target, at=coordinates_drawn, points=points)
            _tell(output, target)


@click.command("animate", short_help="Animate the mechanisms of a scene beside the curve of speed.")
@SCENE
@picture_option(
    "FILE.gif",
    of_ending(".gif"),
    "Write the animation to this file (default: the scene's name with .gif in this folder, if there is no such file yet).",
)
@click.option("--frames", type=click.IntRange(2, 600), default=60, show_default=True, help="Frames, evenly in time.")
@click.option("--fps", type=click.IntRange(1, 50), default=20, show_default=True, help="Frames shown in a second.")
def animate_mechanisms(scene: Path, output: Path | None, frames: int, fps: int) -> None:
    """Animate the mechanisms of SCENE over a cycle or stroke, with a marker that runs along the speed curve.

    The speed is that of the steady cycle with the given or sized flywheel. Along a stroke the curve is the velocity of the
    driven part at the stroke's own speed.
    """
    spare(scene, output)
    with reported(scene):
        from flywheel.pictures.animation import animate

        machine_scene = loaded(scene)
        target = _target(scene, output, ".gif")
        with written(target):
            animate(machine_scene, target, frames=frames, fps=fps)
            _tell(output, target)


COMMANDS = (simulate, motion, draw_mechanisms, animate_mechanisms)
