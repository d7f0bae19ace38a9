"""The ports that a linkage offers: places where loads, springs and added inertia may act."""

from __future__ import annotations

from collections.abc import Iterable

from flywheel.linkage.description import FIXED, FRAME, PIN, SLIDE, SLOT, Joint, Linkage

CRANK, STROKE = "crank", "slide"
"""What the coordinate of a driver that turns, and of one that slides, is called where loads act on it."""


def offered(linkage: Linkage, points: Iterable[str] = ()) -> dict[str, bool]:
    """Ports by name, True where one rotates: bodies that can turn, slides and slots, then `points`.

    The body that a turning driver turns against the frame is no port: what acts on it acts on its shaft. Nor is a
    driver that is called `slide`, as its coordinate is.
    """
    held = {FRAME, *straight(linkage.joints), *_turned(linkage)}
    ports = {link.name: True for link in linkage.links if link.name not in held}
    ports |= {joint.name: False for joint in linkage.joints if joint.kind in (SLIDE, SLOT)}
    ports |= dict.fromkeys(points, False)
    return {name: turns for name, turns in ports.items() if name != STROKE or linkage.driver != STROKE}


def straight(joints: Iterable[Joint]) -> set[str]:
    """Bodies that slides and fixed joints hold to the frame, one after the other: they cannot turn."""
    joints = [joint for joint in joints if joint.kind in (SLIDE, FIXED)]
    held = {FRAME}
    for _ in joints:
        held |= {body for joint in joints for body in joint[2:4] if held & set(joint[2:4])}
    return held - {FRAME}


def _turned(linkage: Linkage) -> set[str]:
    """The body that the driver turns, where it is a pin of the frame."""
    pins = [joint for joint in linkage.joints if joint.name == linkage.driver and joint.kind == PIN]
    return {body for pin in pins for body in (pin.first, pin.second) if FRAME in (pin.first, pin.second)} - {FRAME}


def shadowing(ports: Iterable[str], sliding: bool) -> list[str]:
    """Ports that bear a name by which loads reach the driver."""
    return [name for name in ports if name == (STROKE if sliding else CRANK)]
