"""Commands that draw mechanisms: `draw`, `animate`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click

from flywheel.cli.common import SCENE, coordinates, places, plot_path, remarked, reported, spare, written


def _gif_path(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
    if path is not None and path.suffix.lower() != ".gif":
        raise click.BadParameter(f"{str(path)!r} does not end in .gif.")
    return path


def _target(scene: Path, output: Path | None, ending: str) -> Path:
    """The file to write: the one that was named, else one of the scene's name that does not exist yet."""
    if output is not None:
        return output
    path = Path(scene.with_suffix(ending).name)
    if os.path.lexists(path):
        click.echo(f"{path}: exists already and is left as it is; name a file with -o", err=True)
        sys.exit(1)
    return path


def _tell(output: Path | None, target: Path) -> None:
    """Where the file went, if its name was not the user's."""
    if output is None:
        click.echo(f"wrote {target}", err=True)


@click.command("draw", short_help="Draw the mechanisms of a scene and the paths of their points.")
@SCENE
@click.option(
    "--at",
    multiple=True,
    callback=places,
    metavar="ANGLE",
    help='A crank angle such as "30 deg", or a position of a driver that slides, such as "190 mm"; repeatable, the first '
    "one is drawn bold (default: a handful over the motion).",
)
@click.option(
    "--path",
    "points",
    multiple=True,
    metavar="NAME",
    help="A joint or a point whose path is drawn, such as B or rod.P; repeatable (default: all that move).",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    callback=plot_path,
    metavar="FILE.(png|svg|pdf)",
    help="Where the picture goes (default: the scene's name with .png, here, if there is no such file yet).",
)
def draw_mechanisms(scene: Path, at: tuple[str, ...], points: tuple[str, ...], output: Path | None) -> None:
    """Draw the mechanisms of SCENE at chosen positions, with the paths that their points describe."""
    spare(scene, output)
    with reported(scene):
        from flywheel.pictures.mechanisms import draw
        from flywheel.reading.scenes import load

        loaded = load(scene)
        remarked(scene, loaded.remarks)
        wanted = coordinates(at, loaded.reduction_element == "slide")
        target = _target(scene, output, ".png")
        with written(target):
            draw(loaded, target, at=wanted, points=points)
    _tell(output, target)


@click.command("animate", short_help="Animate the mechanisms of a scene beside the curve of speed.")
@SCENE
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    callback=_gif_path,
    metavar="FILE.gif",
    help="Where the animation goes (default: the scene's name with .gif, here, if there is no such file yet).",
)
@click.option("--frames", type=click.IntRange(2, 600), default=60, show_default=True, help="Frames, evenly in time.")
@click.option("--fps", type=click.IntRange(1, 50), default=20, show_default=True, help="Frames shown in a second.")
def animate_mechanisms(scene: Path, output: Path | None, frames: int, fps: int) -> None:
    """Animate the mechanisms of SCENE over a cycle or stroke, with a marker that runs along the speed curve.

    The speed is that of the steady cycle with the flywheel given or sized; along a stroke the curve is the velocity of what
    the mechanism drives, at the stroke's own speed.
    """
    spare(scene, output)
    with reported(scene):
        from flywheel.pictures.animation import animate
        from flywheel.reading.scenes import load

        loaded = load(scene)
        remarked(scene, loaded.remarks)
        target = _target(scene, output, ".gif")
        with written(target):
            animate(loaded, target, frames=frames, fps=fps)
    _tell(output, target)


COMMANDS = (draw_mechanisms, animate_mechanisms)
