"""Commands that show a scene as pages: `report`, `open`."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

import click

from flywheel.cli.common import SCENE, reported, show, spare, within, written
from flywheel.scene.accuracy import LEVELS, RTOL


@click.command("open", short_help="Open a scene as a live page in the browser.")
@click.argument("scene", type=click.Path(path_type=Path, readable=False), required=False)
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port of this machine, else any free one.")
@click.option("--no-browser", is_flag=True, help="Print the page's address without opening a browser.")
@click.option("--language", type=click.Choice(["en", "es"]), default="en", help="English (default) or Spanish.")
def open_page(scene: Path | None, port: int, no_browser: bool, language: str) -> None:
    """Show SCENE, a TOML file, as a page in the browser: a form of its values, and figures that follow them.

    Without SCENE the page offers starters. The page is served on this machine alone, at an address with a secret in it,
    until Ctrl+C ends the command. The file is changed only where the page is told to save.
    """
    from flywheel.page.server import PageServer
    from flywheel.page.session import Session

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


def _report_path(context: click.Context, parameter: click.Parameter, path: Path) -> Path:
    if path.suffix.lower() not in (".html", ".htm", ".pdf"):
        raise click.BadParameter(f"{str(path)!r} does not end in .html or .pdf.")
    return path


@click.command(short_help="Write a worked report, every step with its numbers, as HTML or PDF.")
@SCENE
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    callback=_report_path,
    metavar="FILE.(html|pdf)",
    help="The report's file; a PDF is printed by a browser that is installed.",
)
@click.option("--language", type=click.Choice(["en", "es"]), default="en", help="English (default) or Spanish.")
@click.option("--units", type=click.Choice(["si", "us"]), default="si", help="us: results in US units beside those in SI.")
@click.option("--page", type=click.Choice(["all", "summary"]), default="all", help="summary: the first page alone, to sign.")
@click.option("--rtol", type=float, callback=within(*RTOL), help="Relative accuracy asked of every figure.")
@click.option("--accuracy", type=click.Choice(LEVELS), help="normal, confirm or audit (default), as of size.")
@click.option(
    "--printed",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A file with a printed solution, JSON or TOML, which is set beside ours (topic report).",
)
def report(
    scene: Path,
    output: Path,
    language: str,
    units: str,
    page: str,
    rtol: float | None,
    accuracy: str | None,
    printed: Path | None,
) -> None:
    """Write the worked report of SCENE, a TOML file: every step as formula, substitution with numbers, and result.

    Its first page says what a designer signs: machine, motor, train, flywheel, what binds, speeds, remarks.
    One file without anything from the network, to be printed on A4 and handed out. A scene without a flywheel gives the
    steps that it has.
    """
    spare(scene, output)
    with reported(scene):
        from flywheel import language as languages
        from flywheel.reading.scenes import input_files, load
        from flywheel.report import files
        from flywheel.report.contents import sized
        from flywheel.report.solutions import solution

        if output.suffix.lower() == ".pdf":
            try:
                files.browser()
            except files.PrintError as error:
                click.echo(f"{output}: {error}", err=True)
                sys.exit(1)
        with languages.use(language):
            beside = None if printed is None else solution(printed, scene)
            found = sized(load(scene), rtol, accuracy)
            with written(output):
                try:
                    read = [*input_files(scene), *([] if printed is None else [printed])]
                    files.write(found, output, units=units, printed=beside, page=page, inputs=read)
                except files.PrintError as error:
                    click.echo(f"{output}: {error}", err=True)
                    sys.exit(1)


COMMANDS = (open_page, report)
