"""Random mechanisms: a table of a scene, and the ports that loads may push at."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Any

Table = dict[str, Any]
Ports = list[tuple[str, str, float]]


def short(value: float, digits: int = 4) -> float:
    """A number as a user would write it."""
    return float(f"{value:.{digits}g}")


def length(draw: Random) -> float:
    """A crank's length."""
    return short(0.02 * 100 ** draw.random())


def mass(draw: Random) -> float:
    """A mass, or none."""
    return 0 if draw.random() < 0.15 else short(0.1 * 2000 ** draw.random())


def body(draw: Random, size: float, *, bent: bool = True) -> Table:
    """A body of some length: mass, inertia and centre of mass."""
    m = mass(draw)
    result: Table = {"mass": m, "inertia": short(m * size**2 / 12), "com": short(size * draw.uniform(0, 1))}
    if bent and draw.random() < 0.4:
        result["com_angle"] = f"{draw.randint(-180, 180)} deg"
    return result if draw.random() < 0.85 else {}


def share(draw: Random) -> float:
    """A crank's length as a share of the one that it may not reach; close to 1 now and then."""
    return draw.uniform(0.1, 0.6) if draw.random() < 0.85 else 1 - 10 ** draw.uniform(-6, -1)


def scotch_yoke(draw: Random) -> tuple[Table, Ports]:
    """A scotch yoke."""
    r = length(draw)
    table: Table = {"crank": {"length": r} | body(draw, r), "yoke": {"mass": mass(draw)}, "block": {"mass": mass(draw)}}
    if draw.random() < 0.4:
        table["yoke"]["direction"] = f"{draw.randint(-170, 170)} deg"
    return {"type": "scotch-yoke"} | table, [("yoke", "force", 2 * r)]


def slider_crank(draw: Random) -> tuple[Table, Ports]:
    """A slider-crank, with an offset now and then."""
    r = length(draw)
    rod = short(r / share(draw))
    rod = rod if rod > r else r * 1.0001
    table: Table = {"crank": {"length": r} | body(draw, r), "rod": {"length": rod} | body(draw, rod)}
    table["slider"] = {"mass": mass(draw)}
    if draw.random() < 0.4:
        table["slider"]["offset"] = short(0.9 * (rod - r) * draw.uniform(-1, 1))
    return {"type": "slider-crank"} | table, [("slider", "force", 2 * r), ("rod", "torque", 1.0)]


def four_bar(draw: Random) -> tuple[Table, Ports]:
    """A crank-rocker or a drag-link, put together either way."""
    rest = [1.0, draw.uniform(0.5, 1.2), draw.uniform(0.5, 1.2)]
    longest = max(rest)
    room = sum(rest) - 2 * longest  # of the shortest bar, by Grashof
    size = 10 ** draw.uniform(-1, 0.3)
    shortest = min(rest) * 0.95 if room > min(rest) else room * (0.97 if draw.random() < 0.8 else 1 - 1e-4)
    shortest *= draw.uniform(0.3, 1) if draw.random() < 0.8 else 1.0
    drag = draw.random() < 0.35
    bars = [shortest, *rest] if drag else [rest[0], shortest, *rest[1:]]
    ground, crank, coupler, rocker = (short(size * bar) for bar in bars)
    table: Table = {"ground": {"length": ground}, "crank": {"length": crank} | body(draw, crank)}
    table |= {"coupler": {"length": coupler} | body(draw, coupler), "rocker": {"length": rocker} | body(draw, rocker)}
    table["assembly"] = draw.choice(["open", "crossed"])
    return {"type": "four-bar"} | table, [("coupler", "torque", 1.0), ("rocker", "torque", 1.0)]


def crank_shaper(draw: Random) -> tuple[Table, Ports]:
    """A shaper, or a Whitworth quick return where the crank is the longer one."""
    d = length(draw)
    ratio = share(draw)
    r = short(d * ratio) if draw.random() < 0.6 else short(d / ratio)
    r = r if r != d else short(1.001 * d)
    long = short((d + r) * draw.uniform(1.1, 2))
    table: Table = {"crank": {"length": r} | body(draw, r), "frame": {"length": d}, "rocker": {"length": long}}
    table["rocker"] |= body(draw, long)
    table |= {"block": {"mass": mass(draw)}, "rocker_pin": {"mass": mass(draw)}, "ram": {"mass": mass(draw)}}
    return {"type": "crank-shaper"} | table, [("ram", "force", 2 * long * min(r / d, 1)), ("rocker", "torque", 1.0)]


def law(draw: Random) -> tuple[Table, Ports]:
    """Outputs written as expressions, or as a table."""
    size = length(draw)
    texts = [
        f"{size!r}*sin(phi)",
        f"{size!r}*(1 - cos(phi)) + {short(0.2 * size)!r}*sin(2*phi)",
        f"{size!r}*cos(phi)**3",
        f"{size!r}*sin(phi)**4 if phi < pi else 0",
        f"{size!r}*max(sin(phi), 0)**3",
        f"{size!r}*(phi/pi - sin(2*phi)/(2*pi)) if phi < pi else {size!r}*(2 - phi/pi + sin(2*phi)/(2*pi))",
    ]
    if draw.random() < 0.35:
        count = draw.choice([6, 9, 13])
        angle = [360 * k / (count - 1) for k in range(count)]
        value = [short(size * draw.uniform(-1, 1)) for _ in angle[1:]]
        output: Table = {"table": {"angle": angle, "value": [*value, value[0]], "angle_unit": "deg"}}
        return {"type": "law", "outputs": {"ram": output | {"mass": mass(draw)}}}, [("ram", "force", size)]
    if draw.random() < 0.3:
        turn = {"theta": f"phi + {short(draw.uniform(0.1, 0.9))!r}*sin(phi)", "inertia": short(10 ** draw.uniform(-2, 1))}
        return {"type": "law", "outputs": {"disc": turn}}, [("disc", "torque", 6.0)]
    return {"type": "law", "outputs": {"ram": {"x": draw.choice(texts), "mass": mass(draw)}}}, [("ram", "force", size)]


def link(draw: Random, size: float, **points: list[float]) -> Table:
    """A body of a linkage."""
    result: Table = {"points": points} if points else {}
    m = mass(draw)
    if m:
        result |= {"mass": m, "inertia": short(m * size**2 / 12)}
        result["com"] = [short(size * draw.uniform(0, 1)), short(0.2 * size * draw.uniform(-1, 1))]
    return result


def pin(name: str, one: str, two: str) -> Table:
    """A pin."""
    return {"name": name, "type": "pin", "between": [one, two]}


def slide(name: str, one: str, two: str, direction: str, guess: float) -> Table:
    """A slide on the frame."""
    return {"name": name, "type": "slide", "between": [one, two], "direction": direction, "guess": short(guess)}


def linked_slider(draw: Random) -> tuple[Table, Ports]:
    """A slider-crank as a linkage, its guide turned."""
    r = length(draw)
    rod, aim = short(r / draw.uniform(0.1, 0.7)), draw.choice([0, 90, -90, 37])
    bodies = {
        "frame": {"points": {"O": [0, 0]}},
        "arm": link(draw, r, B=[r, 0]),
        "rod": link(draw, rod, C=[rod, 0]) | {"guess": f"{aim} deg"},
        "ram": {"mass": short(1 + 50 * draw.random())},
    }
    joints = [pin("O", "frame.O", "arm.origin"), pin("B", "arm.B", "rod.origin"), pin("C", "rod.C", "ram.origin")]
    joints.append(slide("ram", "frame.O", "ram.origin", f"{aim} deg", rod))
    return {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints}, [("ram", "force", 2 * r)]


def linked_bars(draw: Random) -> tuple[Table, Ports]:
    """A crank-rocker as a linkage, with a second one behind it now and then: Watt's six-bar."""
    size, c = 10 ** draw.uniform(-1, 0.3), draw.uniform(0.85, 1.05)
    crank, frame = short(size * draw.uniform(0.15, 0.3)), {"O": [0, 0], "D": [short(1.2 * size), 0]}
    coupler, rocker = short(c * size), short(0.8 * size)
    side = draw.choice(["left", "right"])
    joints = [
        pin("O", "frame.O", "arm.origin"),
        pin("B", "arm.B", "coupler.origin"),
        pin("C", "coupler.C", "rocker.C"),
        pin("D", "frame.D", "rocker.origin"),
    ]
    bodies = {
        "frame": {"points": frame},
        "arm": link(draw, crank, B=[crank, 0]),
        "coupler": link(draw, coupler, C=[coupler, 0]),
        "rocker": link(draw, rocker, C=[rocker, 0], E=[short(0.5 * rocker), short(-0.3 * rocker)]),
    }
    sides = [{"point": "coupler.C", "side": side, "from": "arm.B", "to": "frame.D"}]
    ports = [("rocker", "torque", 1.0), ("coupler", "torque", 1.0)]
    if draw.random() < 0.5:
        frame["F"] = [short(2.2 * size), short(-0.1 * size)]
        bodies |= {"link": link(draw, size, G=[short(1.1 * size), 0]), "bar": link(draw, size, G=[short(0.9 * size), 0])}
        joints += [pin("E", "rocker.E", "link.origin"), pin("G", "link.G", "bar.G"), pin("F", "frame.F", "bar.origin")]
        sides.append({"point": "link.G", "side": "left", "from": "rocker.E", "to": "frame.F"})
        ports = [("bar", "torque", 1.0), ("tip", "force", size)]
    table: Table = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints, "assembly": sides}
    if ports[-1][0] == "tip":
        table["ports"] = {"tip": {"point": "bar.G", "direction": f"{draw.randint(-180, 180)} deg"}}
    return table, ports


def toggle_press(draw: Random) -> tuple[Table, Ports]:
    """A knuckle-joint press: a crank's rod pushes the knee of two links, the lower of which carries the ram."""
    size = 10 ** draw.uniform(-0.6, 0.4)
    crank = short(0.11 * size * draw.uniform(0.6, 1))
    frame = {"shaft": [short(-0.9 * size), short(-0.35 * size)], "head": [0, 0], "guide": [0, 0]}
    bodies = {
        "frame": {"points": frame},
        "arm": link(draw, crank, pin=[crank, 0]),
        "rod": link(draw, 0.75 * size, knee=[short(0.75 * size), 0]),
        "upper": link(draw, 0.35 * size, knee=[short(0.35 * size), 0]),
        "lower": link(draw, 0.4 * size, end=[short(0.4 * size), 0]) | {"guess": "-90 deg"},
        "ram": {"mass": short(1 + 300 * draw.random())},
    }
    joints = [
        pin("shaft", "frame.shaft", "arm.origin"),
        pin("B", "arm.pin", "rod.origin"),
        pin("head", "frame.head", "upper.origin"),
        pin("K", "rod.knee", "upper.knee"),
        pin("L", "rod.knee", "lower.origin"),
        pin("R", "lower.end", "ram.origin"),
        slide("ram", "frame.guide", "ram.origin", "-90 deg", 0.7 * size),
    ]
    sides = [{"point": "rod.knee", "side": "right", "from": "arm.pin", "to": "frame.head"}]
    table = {"type": "linkage", "driver": "shaft", "bodies": bodies, "joints": joints, "assembly": sides}
    return table, [("ram", "force", 0.2 * size)]


KINDS: dict[str, Callable[[Random], tuple[Table, Ports]]] = {
    "scotch-yoke": scotch_yoke, "slider-crank": slider_crank, "four-bar": four_bar, "crank-shaper": crank_shaper,
    "law": law, "linked slider": linked_slider, "linked bars": linked_bars, "toggle press": toggle_press,
}  # fmt: skip
