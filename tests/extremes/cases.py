"""The scenes whose figures are known at 30 digits, and the pairs of speed and irregularity asked of each."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, tau
from typing import Any, NamedTuple

from tests.extremes.machines import KNOWN, MACHINES, Scene, crank_shaper, four_bar, running, slider_crank

IRREGULARITIES = (1e-14, 1e-12, 1e-9, 1e-6, 1e-3, 0.05, 1.0, 1.9, 1.99)
SPEEDS = (1e-6, 1e-3, 1.0, 100.0, 1e4, 1e6)
WIDTHS = ("20", "5", "1", "0.1", "0.01", "0.001")  # deg
GAPS = (0.0, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-9)  # rad


class Case(NamedTuple):
    """A scene, what is extreme in it, how far it goes, and the pairs (speed, irregularity) asked of it.

    slivers: some of its areas are narrower than what rounding leaves of an angle, and may be left out.
    """

    group: str
    range: str
    scene: Scene
    asked: tuple[tuple[float, float], ...]
    slivers: bool = False


def case(group: str, range_: str, scene: Scene) -> Case:
    """A case asked for its own speed and irregularity alone."""
    return Case(group, range_, scene, ((scene["regime"]["speed"], scene["flywheel"]["irregularity"]),))


def sweeps() -> Iterator[tuple[str, Case]]:
    """Every mechanism over all irregularities at its own speed, over all speeds at 0.05, and at the four corners."""
    for name in KNOWN:
        scene = MACHINES[name]()
        own = scene["regime"]["speed"]
        request = {(speed, eps) for speed in (1e-6, own, 1e6) for eps in (1e-14, 1.99)}
        if name != "law":  # whose expressions take their time
            request |= {(own, eps) for eps in IRREGULARITIES} | {(speed, 0.05) for speed in SPEEDS}
        yield f"sweep {name}", Case("sweep", name, scene, tuple(sorted(request)))


def geometries() -> Iterator[tuple[str, Case]]:
    """Mechanisms that all but lock."""
    for share in (0.99, 0.9999, 0.999999):
        yield f"r/l {share}", case("rod", f"r/l = {share}", light(0.1 / share, 0.0))
    for spare in (1e-3, 1e-6):
        for offset in (0.2, -0.2):
            scene = light(0.3 * (1 + spare), offset)
            yield f"offset {offset} {spare}", case("offset", f"l = (r + |e|)(1 + {spare})", scene)
    for spare in (1e-3, 1e-6):
        for assembly in ("open", "crossed"):
            scene = four_bar(bars=(0.4, 0.1, 0.3 * (1 + spare), 0.2), assembly=assembly)
            yield f"stretched {assembly} {spare}", case("change point", f"c + L above d + r by {spare}", scene)
        scene = four_bar(bars=(0.4, 0.1, 0.2, 0.5 - spare))
        yield f"folded {spare}", case("change point", f"L - c below d - r by {spare}", scene)
        scene = four_bar(bars=(0.1, 0.3 * (1 + spare), 0.35, 0.15 + 0.3 * spare))
        yield f"drag link {spare}", case("change point", f"a drag link, {spare} from it", scene)
    for spare in (1e-3, 1e-6, -1e-6):
        yield f"shaper {spare}", case("shaper", f"d = r (1 + {spare})", crank_shaper(crank=0.3, frame=0.3 * (1 + spare)))


def light(rod: float, offset: float) -> Scene:
    """A slider-crank that works while its slider moves outward."""
    scene = slider_crank(rod=rod, offset=offset)
    scene["load"] = [{"on": "slider", "force": 500.0, "while": "v > 0"}]
    return scene


def pressing(loads: list[dict[str, Any]], scene: Scene | None = None) -> Scene:
    """A slider-crank without weights, under loads of its slider."""
    mechanism = {
        "type": "slider-crank",
        "crank": {"length": 0.1},
        "rod": {"length": 0.3},
        "slider": {"mass": 0.001},
    }
    return running({"mechanism": mechanism, "load": loads, **(scene or {})}, 10.0)


def push(start: str, end: str) -> dict[str, Any]:
    """A load of the slider in a window."""
    return {"on": "slider", "force": -1e4, "from": f"{start} deg", "to": f"{end} deg"}


def windows() -> Iterator[tuple[str, Case]]:
    """Narrow windows: one, one across the seam, several, and two that touch."""
    for width in WIDTHS:
        wide = float(width)
        where = f"{width} deg"
        yield f"window {width}", case("window", where, pressing([push("330", f"{330 + wide!r}")]))
        yield f"seam {width}", case("window", where, pressing([push(f"{-wide / 4!r}", f"{wide * 3 / 4!r}")]))
        several = [push(f"{40 * k + 1}", f"{40 * k + 1 + wide!r}") for k in (3, 5, 7, 8)]
        yield f"several {width}", case("windows", where, pressing(several))
        touching = [push("300", f"{300 + wide!r}"), push(f"{300 + wide!r}", f"{300 + 2 * wide!r}")]
        yield f"touching {width}", case("windows", where, pressing(touching))


def turning(loads: list[dict[str, Any]]) -> Scene:
    """A shaft alone under torques."""
    return running({"load": [{"on": "crank", **load} for load in loads]}, 10.0)


def coincidences() -> Iterator[tuple[str, Case]]:
    """Kinks, jumps and ends of windows that all but coincide, with each other and with the seam."""
    corner = pi / 2
    for gap in GAPS:
        near, far = f"{gap:g} rad", corner + gap
        sway = {"torque": "30*sin(phi)"}
        kink = {"torque": f"-100*abs(phi - {far!r})", "from": 0.3, "to": corner}
        yield f"kink {gap}", case("coincidence", near, turning([kink, sway]))
        jump = {"table": {"angle": [0, corner, far, tau], "value": [10, 100, -100, 30]}}
        yield f"jump {gap}", case("coincidence", near, turning([jump]))
        pair = [{"torque": -100.0, "from": 0.5, "to": corner}, {"torque": 60.0, "from": far, "to": 4.0}]
        yield f"windows {gap}", case("coincidence", near, turning(pair))
        seam = [{"torque": -100.0, "from": gap, "to": 2.0}, {"torque": 60.0, "from": 4.0, "to": tau - gap}]
        yield f"seam {gap}", case("coincidence", near, turning(seam))._replace(slivers=0 < gap < 1e-13)


TABLES: dict[str, tuple[list[float], list[float]]] = {
    "one jump": ([0, 1, 1, tau], [10, 100, -100, 30]),
    "two jumps": ([0, 1, 1, 2, 2, tau], [10, 100, -100, 30, -20, 10]),
    "jump at the seam": ([0, 2, tau], [100, -50, -80]),
    "no jump at the seam": ([0, 2, tau], [100, -150, 100]),
    "from before the seam": ([-1, 0, 0, 1, tau - 1], [50, -20, 70, 10, -40]),
    "from behind it": ([1, 2, 2, tau + 1], [50, -20, 70, 10]),
    "jump beside jump": ([0, 1, 1, 1 + 1e-9, 1 + 1e-9, tau], [10, 100, -100, 30, -20, 10]),
}


def tables() -> Iterator[tuple[str, Case]]:
    """Tables with repeated angles, read in every way."""
    for name, (angle, value) in TABLES.items():
        for way in ("linear", "step", "pchip"):
            table = {"angle": angle, "value": value, "interpolation": way}
            yield f"table {name} {way}", case("table", name, turning([{"table": table}]))


def cases() -> dict[str, Case]:
    """All of them, by name."""
    return dict([*sweeps(), *geometries(), *windows(), *coincidences(), *tables()])
