"""Speed of the live page: from the event of a slider to the figures drawn anew, in a browser.

    python tests/benchmarks/bench_page.py [--quick] [SCENE ...]

In each of eleven examples one slider is dragged back and forth by the mouse, a move each 16 ms. "drawn" is what the page
itself notes (`flywheelTimings`): until every figure in sight is made anew. It consists of the wait for the answer under
way, the server's work, the transfer of the answer, and its drawing. "longest" is the longest task of the browser.
Beside the milliseconds stands the time of a fixed piece of work of Python on the same machine in the same run, calls, floats
and short arrays, 10 ms on an ordinary one: limits are told in such pieces, as milliseconds are those of a machine. Without a
browser, or without playwright, there is nothing to time. Exit code 1 above the limits of the press.
"""

from __future__ import annotations

import math
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.page.browsers import EXAMPLES, Missing, answered, browser, served, shown

MEDIAN, MOST = 50.0, 100.0  # ms asked of two cores that have nothing else to do
LIMITS = (
    12.0,
    30.0,
)  # pieces of work for median and 95th percentile; 5 and 10 would be the milliseconds on an ordinary machine
SLIDERS = {
    "machines/press": "mechanism.crank.length",
    "machines/shaper": "mechanism.ram.mass",
    "machines/engine": "mechanism.rod.mass",
    "machines/three_cylinder": "mechanism[0].rod.mass",
    "drive_lines/press": "mechanism.slider.mass",
    "drive_lines/compressor": "mechanism.slider.mass",
    "drive_lines/c_frame_press": "mechanism.slider.mass",
    "linkages/toggle_press": "mechanism.bodies.crank.mass",
    "linkages/whitworth": "mechanism.bodies.crank.mass",
    "linkages/six_bar": "mechanism.bodies.crank.mass",
    "linkages/cam_press": "mechanism.bodies.cam.mass",
}
PRESS = "machines/press"
SHARE = 0.1  # of a slider's length, to each side of its middle
TASKS = """() => {
  window.longest = 0;
  const note = (list) => list.getEntries().forEach((task) => { window.longest = Math.max(window.longest, task.duration); });
  new PerformanceObserver(note).observe({entryTypes: ["longtask"]});
}"""


def piece() -> float:
    """Milliseconds of a fixed piece of work, the best of five."""
    x, times = np.linspace(0.0, 1.0, 20), []
    for _ in range(5):
        start = time.perf_counter()
        for k in range(2000):
            (np.sin(x) * x).sum() + math.exp(math.sin(k)) + len(str(k))
        times.append(1e3 * (time.perf_counter() - start))
    return min(times)


def drag(page: Any, path: str, moves: int) -> None:
    """Drag the slider of a field back and forth."""
    slider = page.locator(f'[data-field="{path}"] input[type=range]')
    if not slider.is_visible():
        page.evaluate("document.querySelectorAll('#form details').forEach((group) => { group.open = true; })")
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    across = box["x"] + box["width"] * (0.5 + SHARE * np.sin(np.linspace(0.0, 4 * np.pi, moves)))
    height = box["y"] + box["height"] / 2
    page.mouse.move(float(across[0]), height)
    page.mouse.down()
    for x in across:
        page.mouse.move(float(x), height)
        page.wait_for_timeout(16)
    page.mouse.up()


def timed(page: Any, path: str, moves: int) -> dict[str, Any]:
    """Milliseconds of every redraw, by their parts, and of the longest task."""
    drag(page, path, 20)  # everything has been imported and compiled once
    answered(page)
    page.evaluate("flywheelTimings.reset()")
    page.evaluate(TASKS)
    drag(page, path, moves)
    answered(page)
    samples = page.evaluate("flywheelTimings.samples")
    total, call, draw, server = (
        np.array([sample[name] or 0.0 for sample in samples]) for name in ("total", "call", "draw", "server")
    )
    parts = {"wait": total - call - draw, "server": server, "transfer": call - server, "drawing": draw}
    return {"drawn": total, **parts, "longest": page.evaluate("longest")}


def main() -> int:
    """Print the times; 1 above the limits."""
    quick = "--quick" in sys.argv
    names = [name for name in sys.argv[1:] if name in SLIDERS] or ([PRESS] if quick else list(SLIDERS))
    high = (0.0, 0.0)
    try:
        with browser() as program:
            print(f"asked on two idle cores: {MEDIAN:g} ms at the median, {MOST:g} ms for 95 %; medians of the parts")
            titles = ("median", "95 %", "pieces", "95 %", "wait", "server", "transfer", "drawing", "longest")
            print(f"{'':26}redraws" + "".join(f"{title:>9}" for title in titles))
            for name in names:
                with tempfile.TemporaryDirectory() as folder:
                    for file in [EXAMPLES / f"{name}.toml", *(EXAMPLES / name).parent.glob("*.csv")]:
                        shutil.copy(file, folder)
                    with served(Path(folder) / f"{Path(name).name}.toml") as server:
                        page = answered(shown(program.new_page(viewport={"width": 1280, "height": 800}), server.address))
                        before = piece()
                        times = timed(page, SLIDERS[name], 80 if quick else 200)
                        of_work = (before + piece()) / 2
                        page.close()
                median, most = (float(value) for value in np.percentile(times["drawn"], [50, 95]))
                figures = [median, most, median / of_work, most / of_work]
                figures += [float(np.median(times[part])) for part in ("wait", "server", "transfer", "drawing")]
                line = "".join(f"{figure:9.1f}" for figure in (*figures, times["longest"]))
                print(f"{name:26}{len(times['drawn']):7}{line}", flush=True)
                high = (median / of_work, most / of_work) if name == PRESS else high
    except Missing as reason:
        print(f"the page is not timed: {reason}")
        return 0
    room = 1.5 if quick else 1.0  # a part of the moves: other load counts more
    return int(high[0] > room * LIMITS[0] or high[1] > room * LIMITS[1])


if __name__ == "__main__":
    sys.exit(main())
