"""Draw examples/page.gif for the README: the live page of a shaper, its crank turned, and then made longer and shorter.

python -m tests.benchmarks.page_animation
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

from tests.page.browsers import browser, served, shown

if TYPE_CHECKING:
    from playwright.sync_api import Page

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENE = EXAMPLES / "machines" / "shaper.toml"
WINDOW = {"width": 1400, "height": 1440}
WIDTH, COLOURS, PERIOD = 900, 128, 140  # points across; ms a frame
TURN = range(0, 360, 12)  # degrees of the crank
LENGTHS = (*range(120, 181, 6), *range(180, 119, -6))  # mm of it
SHOWN = ("Mechanism", "Turning moment", "Wittenbauer's diagram", "Speed over the cycle")


def frames(page: Page) -> Iterator[Image.Image]:
    """The page at every angle of a turn, and at every length of the crank."""
    page.locator("#chooser summary").click()
    for label in page.locator("#choice label").all():
        label.locator("input").set_checked(label.inner_text().strip() in SHOWN)
    page.locator("#chooser summary").click()
    angle, length = page.locator("#angle"), page.locator("[data-slider-of='mechanism.crank.length']")
    for degrees in TURN:
        angle.fill(str(degrees))
        angle.press("Enter")
        page.wait_for_timeout(100)
        yield _seen(page)
    for millimetres in LENGTHS:
        length.fill(str(millimetres))
        page.wait_for_timeout(400)
        yield _seen(page)


def _seen(page: Page) -> Image.Image:
    page.evaluate("name => { document.getElementById('file').textContent = name }", SCENE.name)
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def main() -> None:
    """Write the picture."""
    with served(SCENE) as server, browser() as chromium:
        page = shown(chromium.new_page(viewport=WINDOW), server.address)
        page.wait_for_timeout(3000)
        result = [
            frame.resize((WIDTH, WIDTH * frame.height // frame.width), Image.Resampling.LANCZOS) for frame in frames(page)
        ]
    palette = result[len(result) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
    drawn = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in result]
    drawn[0].save(EXAMPLES / "page.gif", save_all=True, append_images=drawn[1:], duration=PERIOD, loop=0, optimize=True)


if __name__ == "__main__":
    main()
