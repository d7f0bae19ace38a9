"""Mutations of CSV files, and of the names by which a scene asks for them."""

import os
import random
from pathlib import Path
from typing import Any

from tests.fuzzing.structure import at, places, put

_NAMES = (
    *("../indicator.csv", "/etc/passwd", "/dev/zero", "/dev/stdin", "/dev/tty", "/proc/self/environ", "folder", "fifo"),
    *("link.csv", "missing.csv", "", ".", "..", "./", "~/x.csv", "x\0.csv", "a" * 5000, "a/" * 2000 + "b", "\ud7ff.csv"),
    *("http://x/y.csv", "C:\\x.csv", "file:///etc/passwd", "folder/../indicator.csv", "././indicator.csv", "scene.toml"),
    *("*.csv", "fifo.csv", "-", "loop.csv", "outside/hosts", "nul", "con.csv", "\n.csv", " indicator.csv", "$HOME/x.csv"),
    *("|touch canary",),
)
_CELLS = (
    *("", "nan", "inf", "-inf", "1e400", "1e-400", "x", "1,5", "0x10", "١", "−1", "1 2", '"1"', '"', "'", "1e5", "-0"),
    *("9" * 500, "#1", "=cmd()", "1;2", "\0", "1_0", "1e", "+1", ".5", "5.", "1e308", "1e-320", "None", "[1]", " 1 "),
    *("1\u00a0",),
)
_WHOLE = (
    *(b"", b"\n", b"\0", b"\xff\xfe", b"angle,value\n", b"0,1\n", b"0\n1\n2\n", b'"', b'"\n' * 1000, b"#\n#\n", b",\n,\n"),
    *(b"0,1\n0,1\n", b"0,0\n360,0\n", b"1," * 10**5, b"0,1\n" * 10**5, b"0,1\r360,2\r", b"0;1\n360;2\n", b"0\t1\n360\t2\n"),
    *(b"0 1\n360 2\n", b"a,b\n0,1\n180,-1\n360,1\n", b"0,1e308\n180,-1e308\n360,1e308\n", b"0,0\n1e-300,1\n360,0\n"),
    *(b'"a,b",c\n0,1\n360,2\n', b"\n".join(b"%d,%d" % (i, i % 7) for i in range(361))),
    *(b"\n".join(b"%.6f,%d" % (i * 0.01, (i % 2) * 2 - 1) for i in range(36001)),),
    *(b"\n".join(b"%.7f,%d" % (i * 0.001, i % 3) for i in range(360001)), b"0," + b"1" * 10**6 + b"\n360,1\n"),
)


def names(rng: random.Random, tree: dict[str, Any]) -> None:
    """A name of a file, a column or a way of interpolation that cannot be."""
    tables = [path[:-1] for path in places(tree) if path[-1] == "file"]
    if not tables:
        loads = tree.setdefault("load", [])
        if not isinstance(loads, list):
            return
        loads.append({"on": "crank", "table": {"file": "indicator.csv", "angle_unit": "deg"}})
        tables = [("load", len(loads) - 1, "table")]
    table = rng.choice(tables)
    key, values = rng.choice(
        (
            ("file", _NAMES),
            ("file", _NAMES),
            ("column", (0, 1, 2, 3, -1, 10**9, 1.5, True, "", "x", "pressure", [1], {"a": 1})),
            ("interpolation", ("step", "pchip", "linear", "spline", "", 3)),
            ("angle_unit", ("deg", "rad", "rev", "m", "", "N", 1, "deg^2", "%")),
            ("value_unit", ("N", "kN", "bar", "m", "", "GN^9", 3, "kgf")),
        )
    )
    if isinstance(at(tree, table), dict):
        put(tree, (*table, key), rng.choice(values))


def content(rng: random.Random, raw: bytes) -> bytes:
    """A table's content with cells, rows or columns spoilt, or another altogether."""
    if rng.random() < 0.35:
        return rng.choice(_WHOLE)
    rows = [row.split(",") for row in raw.decode("utf-8", "replace").split("\n")]
    for _ in range(rng.choice((1, 1, 2, 5))):
        row = rng.choice(rows)
        way = rng.randrange(6)
        if way == 0:
            row[rng.randrange(len(row))] = rng.choice(_CELLS)
        elif way == 1:
            rows.insert(rng.randrange(len(rows)), list(row))
        elif way == 2 and len(rows) > 1:
            rows.remove(row)
        elif way == 3:
            row.append(rng.choice(_CELLS))
        elif way == 4:
            other = rng.choice(rows)
            row[:], other[:] = list(other), list(row)
        else:
            row.pop()
            row.append(rng.choice(("0", "1e3", "-1e3", "1e9", "1e-9", "360", "720")))
    return "\n".join(",".join(row) for row in rows).encode()


def lay_traps(folder: Path) -> None:
    """What may lie beside a scene besides files: a folder, a pipe that nobody writes to, links to outside and in circles."""
    (folder / "folder").mkdir()
    os.mkfifo(folder / "fifo")
    os.mkfifo(folder / "fifo.csv")
    (folder / "link.csv").symlink_to("/etc/hostname")
    (folder / "loop.csv").symlink_to("loop.csv")
    (folder / "outside").symlink_to("/etc")
