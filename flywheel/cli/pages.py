"""Commands that show a scene as a page: `open`."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

import click

from flywheel.cli.common import reported, show


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

        webbrowser.open(server.address)
    with suppress(KeyboardInterrupt):
        server.serve_forever()
    with suppress(KeyboardInterrupt):
        server.server_close()


COMMANDS = (open_page,)
