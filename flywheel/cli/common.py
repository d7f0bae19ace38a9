"""Common parts of the commands: arguments, faults as lines on standard error, files and text that are written."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from math import pi
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from flywheel.language import LANGUAGES, message, use
from flywheel.language import text as _

if TYPE_CHECKING:
    from flywheel.motions.motion import Transient
    from flywheel.numerics.faults import Remark
    from flywheel.regime.free_motion import Watching
    from flywheel.scene.scene import Scene

PLOT_FORMATS = (".png", ".svg", ".pdf")
FORMS = ("screen", "print")  # of pictures
MOST_POINTS = 1_000_000
INTERRUPTED = 130
"""Exit code of a command that the user has ended by Ctrl-C."""
STANDARD_OUTPUT = "standard output"
_LANGUAGE = "flywheel.language"  # of a context: the language of its pictures, faults and remarks
_UNWRITTEN = "flywheel.unwritten"  # of a context: whether a file could not be written


# -- arguments -------------------------------------------------------------------------------------------------------


def of_ending(*endings: str) -> Callable[[click.Context, click.Parameter, Path | None], Path | None]:
    """The check of an option's file: its name has one of these endings."""
    listed = " or ".join(filter(None, (", ".join(endings[:-1]), endings[-1])))

    def check(context: click.Context, parameter: click.Parameter, path: Path | None) -> Path | None:
        if path is not None and path.suffix.lower() not in endings:
            raise click.BadParameter(f"{str(path)!r} does not end in {listed}.")
        return path

    return check


def within(low: float, high: float) -> Callable[[click.Context, click.Parameter, float | None], float | None]:
    """A callback that refuses numbers outside [low, high]; an option that is not given is accepted."""

    def checked(context: click.Context, parameter: click.Parameter, value: float | None) -> float | None:
        if value is not None and not low <= value <= high:
            raise click.BadParameter(f"{value} is not from {low} to {high}.")
        return value

    return checked


_PLACES = {
    "angle": 'an angle with its unit, such as "30 deg" or "0.5 rad"',
    "length": 'a position with its unit, such as "190 mm"',
}


def places(context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> tuple[str, ...]:
    """Texts that are angles or positions; the scene decides which of the two is expected."""
    for text in texts:
        if all(quantity(text, dimension) is None for dimension in _PLACES):
            raise click.BadParameter(f"{text!r} is not {_PLACES['angle']}, nor {_PLACES['length']}.")
    return texts


def quantity(text: str, *dimensions: str) -> float | None:
    """A quantity (SI) in the first dimension that fits the text; None if none fits."""
    from flywheel.numerics.units import QuantityError, parse_quantity

    for dimension in dimensions:
        try:
            return parse_quantity(text, dimension)
        except QuantityError:
            continue
    return None


def speed(text: str, sliding: bool, option: str) -> float:
    """A speed of the crank, or of a driver that slides (SI), given to an option."""
    value = quantity(text, "velocity" if sliding else "speed")
    if value is None:
        kind = 'velocity, such as "0.3 m/s"' if sliding else 'speed, such as "60 rpm"'
        raise click.BadParameter(f"{text!r} is not a {kind}.", param_hint=option)
    return value


def coordinates(texts: tuple[str, ...], sliding: bool) -> list[float]:
    """Angles of the crank, or positions of a driver that slides (SI)."""
    dimension = "length" if sliding else "angle"
    values = [quantity(text, dimension) for text in texts]
    for text, value in zip(texts, values, strict=True):
        if value is None:
            raise click.BadParameter(f"{text!r} is not {_PLACES[dimension]}.", param_hint="--at")
    return [value for value in values if value is not None]


SCENE = click.argument("scene", type=click.Path(path_type=Path, readable=False))
OUTPUT = click.option("--output", type=click.Path(path_type=Path), metavar="FILE", help="Write to a file instead.")


def json_flag(help: str = "Print JSON, SI throughout.") -> Callable[[Any], Any]:
    """The flag --json."""
    return click.option("--json", "as_json", is_flag=True, help=help)


def csv_flag(help: str = "Print CSV, SI throughout.") -> Callable[[Any], Any]:
    """The flag --csv."""
    return click.option("--csv", "as_csv", is_flag=True, help=help)


def picture_option(endings: str, callback: Callable[..., Any], help: str) -> Callable[[Any], Any]:
    """The option -o, --output or --plot of a command that only draws."""
    file = click.Path(path_type=Path)
    return click.option("-o", "--output", "--plot", "output", type=file, callback=callback, metavar=endings, help=help)


def plot_option(help: str) -> Callable[[Any], Any]:
    """The option --plot, with the file of a picture, and --style, its form."""
    file = click.Path(path_type=Path)
    plot = click.option("--plot", type=file, callback=of_ending(*PLOT_FORMATS), metavar="FILE.(png|svg|pdf)", help=help)
    return lambda command: plot(style_option(command))


def language_option(help: str = "Language of picture and messages (default en).", **settings: Any) -> Callable[[Any], Any]:
    """The option --language: the language of a command's pictures, faults, remarks and help."""
    return click.option("--language", type=click.Choice([*LANGUAGES]), callback=_spoken, help=help, **settings)


def _spoken(context: click.Context, parameter: click.Parameter, language: str | None) -> str | None:
    context.meta[_LANGUAGE] = language or "en"
    return language


def requested_language() -> str:
    """The language of --language; English for a command without it."""
    context = click.get_current_context(silent=True)
    return "en" if context is None else str(context.meta.get(_LANGUAGE, "en"))


def style_option(command: Any) -> Any:
    """The option --style: the form in which a command's pictures are drawn."""
    help_text = "Pictures for the screen, in colours, or for print: greys, dashes and hatches."
    option = click.option(
        "--style", type=click.Choice(FORMS), expose_value=False, callback=_in_form, default="screen", help=help_text
    )
    return option(command)


def _in_form(context: click.Context, parameter: click.Parameter, style: str) -> None:
    if style != FORMS[0]:
        from flywheel import pictures

        context.with_resource(pictures.form(style))


def at_option(rest: str = "repeatable.") -> Callable[[Any], Any]:
    """The option --at: angles of the crank, or positions of a driver that slides."""
    text = f'A crank angle such as "30 deg", or a position of a driver that slides, such as "190 mm"; {rest}'
    return click.option("--at", multiple=True, callback=places, metavar="ANGLE", help=text)


def exclusive(**options: object) -> None:
    """Raises a usage error if two options that exclude each other are given."""
    if all(options.values()):
        raise click.UsageError(f"{' and '.join(f'--{name}' for name in options)} exclude each other.")


# -- scenes ----------------------------------------------------------------------------------------------------------


def loaded(path: Path) -> Scene:
    """The scene in a file, its remarks as lines on standard error."""
    from flywheel.reading.scenes import load

    scene = load(path)
    remarked(path, scene.remarks)
    return scene


def slides(scene: Scene) -> bool:
    """Tests whether a scene's driver slides, so that its coordinate is a position."""
    return scene.sliding


def comma_names(context: click.Context, parameter: click.Parameter, values: tuple[str, ...]) -> tuple[str, ...]:
    """Names of a repeatable option, each of which may contain several, separated by commas."""
    return tuple(name.strip() for value in values for name in value.split(",") if name.strip())


@contextmanager
def reported(scene: Path) -> Iterator[None]:
    """Turn the faults of a scene, or of the machine that it describes, into lines on standard error and exit code 1."""
    import numpy as np

    from flywheel.numerics.faults import SceneError

    try:
        with np.errstate(all="ignore"):  # a value that is not finite is reported as a fault, with its place
            yield
    except SceneError as error:
        from flywheel.reading.scenes import placed

        with use(requested_language()):
            for fault in placed(error.faults, scene):  # `press.toml: mechanism.rod.length: found ..., expected ...; advice`
                of_file = fault.path in (scene.name, str(scene), "scene")  # which is named once
                click.echo(f"{scene}{fault.description}" if of_file else f"{scene}: {fault}", err=True)
        sys.exit(1)


def remarked(scene: Path, remarks: Iterable[Remark]) -> None:
    """Remarks on a scene as lines on standard error."""
    with use(requested_language()):
        for remark in remarks:
            click.echo(f"{scene}: {_('remark')}: {remark}", err=True)


# -- output ----------------------------------------------------------------------------------------------------------


@contextmanager
def written(path: Path | str, at_once: bool = False) -> Iterator[None]:
    """Reports a file that cannot be written in one line on standard error; pictures are drawn in the language of --language.

    The command continues to its other outputs and ends with exit code 1; at once if there is no other output.
    """
    drawn = Path(path).suffix.lower() in PLOT_FORMATS
    try:
        with use(requested_language()) if drawn else nullcontext():
            yield
    except BrokenPipeError:
        raise
    except OSError as error:
        if path == STANDARD_OUTPUT:  # what is left in its buffer goes nowhere when the program ends
            sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        if error.errno == errno.EEXIST and error.filename:
            path = error.filename  # which of several files is another's
        reason = "it is closed" if error.errno == errno.EBADF else error.strerror or str(error)
        folder = Path(path).parent
        lost = error.errno == errno.ENOENT and not folder.is_dir()
        tail = f": {str(folder)!r} is no folder" if lost and folder.exists() else f": there is no folder {str(folder)!r}"
        with use(requested_language()):
            click.echo(
                f"{path}: {message(f'cannot be written ({reason})' + (tail if lost else ''), numbers=False)}", err=True
            )
        if at_once or path == STANDARD_OUTPUT:
            sys.exit(1)
        click.get_current_context().meta[_UNWRITTEN] = True


def exit_if_unwritten(context: click.Context) -> None:
    """End with exit code 1 if a file could not be written."""
    if context.meta.get(_UNWRITTEN):
        sys.exit(1)


def show(text: str) -> None:
    """Writes text to standard output; characters missing in its encoding are replaced."""
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors="replace")
    with written(STANDARD_OUTPUT):
        click.echo(text, nl=not text.endswith("\n"))


def hand_over(text: str, output: Path | None, scene: Path) -> None:
    """Writes text to a file, or to standard output if no file is named."""
    if output is None:
        show(text)
        return
    from bondgraph.files import write_text
    from flywheel.reading.scenes import input_files

    with written(output):
        write_text(output, text, input_files(scene))


def spare(scene: Path, *outputs: Path | None) -> None:
    """Checks outputs before the calculation: a usage error for an input file, a line for one that cannot be written.

    The kind of a picture follows from its ending; a text is compared with the existing file when it is written.
    """
    named = [output for output in outputs if output is not None]
    if not named:
        return
    from bondgraph.files import InputError, check
    from flywheel.reading.scenes import input_files

    for output in named:
        ending = output.suffix.lower()
        with written(output, at_once=True):
            try:
                check(
                    output,
                    ending[1:] if ending in (*PLOT_FORMATS, ".gif", ".npz", ".parquet") else "text",
                    input_files(scene),
                )
            except InputError as error:
                said = "names the scene itself" if output.samefile(scene) else error.strerror
                raise click.UsageError(f"{output}: {said}.") from error
    places = [output.resolve() for output in named]
    for k, place in enumerate(places):
        if place in places[:k] and (place.is_file() or not place.exists()):
            raise click.UsageError(f"{named[k]} is named for two outputs.")


_EVERY = 5.0  # seconds between two words on a long motion


def _start(context: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
    if text in (None, "rest", "regime"):
        return text
    speed = quantity(text, "speed", "velocity")
    if speed is None:
        raise click.BadParameter(f'{text!r} is neither rest nor regime, nor a speed with its unit, such as "200 rpm".')
    if speed < 0.0:
        raise click.BadParameter(f"{text!r} is below 0: the machine is followed forwards.")
    return text


def _end(context: click.Context, parameter: click.Parameter, text: str | None) -> str | None:
    if text is None:
        return None
    from flywheel.motions.transients import until
    from flywheel.numerics.faults import SceneError

    try:
        until(text)
    except SceneError as error:
        raise click.BadParameter(f"found {error.faults[0].defect}, expected {error.faults[0].expected}.") from None
    return text


def _wheel(context: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    if text is None:
        return None
    value = quantity(text, "inertia")
    if value is None or value < 0.0:
        raise click.BadParameter(f'{text!r} is not an inertia with its unit, such as "2 kg m^2".')
    return value


_END = (
    '"5 s", "2 turns", "90 deg" or "50 mm" of travel, "200 rpm", "95 %" of the regime\'s speed, regime, or stop (default: '
    "regime; with --no-drive stop; on a stroke its end)."
)


class CourseOptions(NamedTuple):
    """Options of a motion in time: its start, its end, whether the drive is off, the flywheel (kg m²)."""

    start: str | None
    end: str | None
    no_drive: bool
    wheel: float | None

    @property
    def in_time(self) -> bool:
        """True if a motion in time is requested."""
        return self.start is not None or self.end is not None or self.no_drive

    def follow(self, scene: Scene, place: str | None, watching: Watching | None, rtol: float = 1e-9) -> Transient:
        """The motion of a scene from a place, as the options say."""
        from flywheel.motions.transients import transient

        sliding, start = slides(scene), self.start or "rest"
        return transient(
            scene,
            start=start if start in ("rest", "regime") else speed(start, sliding, "--from"),
            at=None if place is None else coordinates((place,), sliding)[0],
            end=self.end,
            drive=not self.no_drive,
            inertia=self.wheel,
            rtol=rtol,
            watching=watching,
        )


def course_options(*, start: str | None) -> Callable[[Any], Any]:
    """The options of a motion in time, except for its starting position; `start` is the default of --from."""
    words = 'rest, regime, or "200 rpm".'
    declared = (
        click.option(
            "--from",
            "start",
            default=start,
            show_default=bool(start),
            callback=_start,
            metavar="START",
            help=words if start else f"Along a motion in time, as `flywheel simulate` follows it: {words}",
        ),
        click.option("--until", "end", callback=_end, metavar="END", help=_END),
        click.option("--no-drive", is_flag=True, help="Let the machine run down without its drive."),
        click.option(
            "--flywheel", "wheel", callback=_wheel, metavar="INERTIA", help='Such as "2 kg m^2" (default: the scene\'s).'
        ),
    )

    def options(command: Any) -> Any:
        for option in reversed(declared):
            command = option(command)
        return command

    return options


@contextmanager
def watched(end: str | None) -> Iterator[_Watching]:
    """Prints progress of a long motion on standard error every few seconds; Ctrl-C ends it with a line and exit code 130."""
    watching = _Watching(end)
    try:
        yield watching
    except KeyboardInterrupt:
        click.echo(f"interrupted{watching.place}", err=True)
        sys.exit(INTERRUPTED)


class _Watching:
    """Progress of a motion, printed on standard error when it takes long."""

    def __init__(self, end: str | None) -> None:
        self.end = "" if end is None else f" until {end}"
        self.sliding = False
        self.t, self.phi, self.run = 0.0, 0.0, 0
        self.next = monotonic() + _EVERY

    def __call__(self, t: float, phi: float) -> None:
        self.run += t < self.t or not self.run
        self.t, self.phi = t, phi
        if monotonic() >= self.next:
            self.next = monotonic() + _EVERY
            click.echo(f"following the motion{self.end}{self.place}", err=True)

    @property
    def place(self) -> str:
        """Time, position and run: a motion is followed again with a smaller tolerance until two runs agree."""
        place = f"{self.phi:.4g} m" if self.sliding else f"{self.phi / (2 * pi):.4g} turns"
        return f" at {self.t:.4g} s, {place}, run {self.run}" if self.run else ""
