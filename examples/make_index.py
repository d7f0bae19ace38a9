"""Write README.md beside this file, the index of the examples, and the picture of each in pictures/.

    python examples/make_index.py                       # all of it, some minutes
    python examples/make_index.py regimes/ press.toml   # the pictures of these alone, words of all

A scene's picture is its mechanism at a handful of angles, or the plot of its sizing where it has none; a script's are those
that it draws beside the file that it is given, or that of the machine that it is about. The words are the scenes' titles and
the scripts' first lines.
"""

from __future__ import annotations

import ast
import subprocess
import sys
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

HERE = Path(__file__).parent
PICTURES = HERE / "pictures"
SMALL, LARGE = (480, 64), (900, 256)  # points across and colours of scenes' pictures, of scripts'

FOLDERS = {
    "machines": "Machines to start from",
    "exams": "Exams of a mechanisms course, with the printed answers beside ours and the misprints named",
    "regimes": "Motors and loads that depend on speed, start and stop",
    "linkages": "Any linkage",
    "joint_forces": "Forces in the joints",
    "dynamics": "Direct dynamics by several routes",
    "bond_graphs": "Bond graphs",
    "robot": "Several degrees of freedom",
    "drive_lines": "Drive lines: shafts in series, what binds the flywheel, the choice of a motor",
    "designs": "The best of many designs",
    "root_finding": "Positions",
}
ALIKE = {
    "dynamics/three_routes": "regimes/section_c",
    "root_finding/positions": "machines/injection_clamp",
}  # the same machine
STARTERS = {"joint_forces/dimensioning": "four-bar"}  # the machine of a starter scene


HEAD = """Every scene runs with `flywheel size SCENE`, or with `flywheel reduce SCENE` and `flywheel motion SCENE` where its
driver slides one way (`[stroke]`); every script with `python SCRIPT`, and with `python SCRIPT figure.png` where it has
pictures of its own. [notebooks/gallery.ipynb](notebooks/gallery.ipynb) is for Jupyter: what the library's objects show
of themselves.
"""


METHODS, CLAMP = (
    "[compare_methods.py](bond_graphs/compare_methods.py)",
    "[injection_clamp.py](joint_forces/injection_clamp.py)",
)
SOURCES = (  # whose figure, what it shows, where it is drawn again
    (
        "thesis, slider-crank by bond graph",
        "37-39, table 8: Rosenberg's graph",
        "[rosenberg.py](bond_graphs/rosenberg.py): not 17 bonds",
    ),
    ("", "2: torque motor of a valve in words", "[torque_motor.py](bond_graphs/torque_motor.py), with its bond graph"),
    ("", "40, 41, 54-56: triangle, instant centre, theta = sin t", f"{METHODS}, `_sine`"),
    (
        "",
        "43-46: crank and slider by Lagrange",
        f"{METHODS}, `_free` with theta overwritten as in print; `_rest` under a torque",
    ),
    ("", "47, 51: velocity by the transformer, by the dynamics", f"{METHODS}, `_dynamics`: it divides by the modulus"),
    ("", "3.1: natural coordinates, Raven's method, only named there", f"{METHODS}, on all pictures of imposed motions"),
    ("", "52, 53: 5 rad/s; eq. 86", f"{METHODS}, `_steady`, and a row of its table"),
    (
        "paper, slider-crank as DAE",
        "4, 5: angles and speeds of crank and coupler",
        "[section_c.py](regimes/section_c.py), `_seconds`",
    ),
    ("slides, injection clamp", "positions to accelerations, read-out", "[injection_clamp.py](machines/injection_clamp.py)"),
    ("", "centres of mass", "the same, `_centres`: the coupler's is printed with the other sign"),
    ("", "reactions along x, together and singly", f"{CLAMP}, `_together`, `_singly`"),
    ("", "joints against a finite-element program", f"{CLAMP}, `_differences`: against equations by hand and Exudyn"),
    ("course on mechanisms", "worked exams", "[exams](exams)"),
)


def main(*redrawn: str) -> None:
    """Draws the pictures, all of them or those of the examples named, and writes the text."""
    PICTURES.mkdir(exist_ok=True)
    old = [line.split(" | ") for line in (HERE / "README.md").read_text(encoding="utf-8").splitlines() if "![" in line]
    drawn = {links.removeprefix("| "): pictures[:-2] for links, _, pictures in old}
    lines = [
        "# Examples\n",
        HEAD,
        "\n## Figures of the sources, drawn again\n",
        "| source | figures | here |",
        "| --- | --- | --- |",
    ]
    lines += [f"| {' | '.join(row)} |" for row in SOURCES]
    for folder, heading in FOLDERS.items():
        lines += [f"\n## {heading}\n", "| example | what it is | |", "| --- | --- | --- |"]
        stems = sorted({path.stem for path in (HERE / folder).iterdir() if path.suffix in (".toml", ".py")})
        for stem in stems:
            files = [path for suffix in (".toml", ".py") if (path := HERE / folder / f"{stem}{suffix}").exists()]
            links = ", ".join(f"[{path.name}]({folder}/{path.name})" for path in files)
            again = (
                links not in drawn
                or not redrawn
                or any(word in f"{folder}/{path.name}" for word in redrawn for path in files)
            )
            lines.append(f"| {links} | {words(files[0])} | {picture(folder, stem) if again else drawn[links]} |")
    (HERE / "README.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def words(path: Path) -> str:
    """The title of a scene, or the first line of a script."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".toml":
        return str(tomllib.loads(text)["title"])
    return (ast.get_docstring(ast.parse(text)) or "").splitlines()[0]


def picture(folder: str, stem: str) -> str:
    """Markdown of an example's pictures, which are drawn if they can be; empty where nothing is to be seen."""
    name = f"{folder}_{stem}"
    if f"{folder}/{stem}" in ALIKE:
        found = [PICTURES / f"{ALIKE[f'{folder}/{stem}'].replace('/', '_')}.png"]
    else:
        scene, script = HERE / folder / f"{stem}.toml", HERE / folder / f"{stem}.py"
        with TemporaryDirectory() as here:
            if f"{folder}/{stem}" in STARTERS:
                scene = Path(here) / "starter.toml"
                subprocess.run(
                    [sys.executable, "-m", "flywheel", "new", STARTERS[f"{folder}/{stem}"], str(scene)], check=True
                )
            draws = script.exists() and "sys.argv[1" in script.read_text(encoding="utf-8")
            if scene.exists():
                draw(scene, Path(here) / f"{name}.png")
            if draws:
                command(script, Path(here) / f"{name}.png")
            found = [shrink(path, *(LARGE if draws else SMALL)) for path in sorted(Path(here).glob("*.png"))]
    return " ".join(f"![{path.stem.removeprefix(folder + '_').replace('_', ' ')}](pictures/{path.name})" for path in found)


def draw(scene: Path, target: Path) -> None:
    """Draw a scene's mechanism, or its sizing."""
    command("-m", "flywheel", "draw", scene, "-o", target)
    if not target.exists():
        command("-m", "flywheel", "size", scene, "--no-simulate", "--plot", target)


def command(*words: str | Path) -> None:
    """Run a script, or a module."""
    subprocess.run([sys.executable, *map(str, words)], capture_output=True, check=False, cwd=HERE.parent)


def shrink(path: Path, width: int, colours: int) -> Path:
    """A small copy of a picture beside the others."""
    with Image.open(path) as large:
        small = large.convert("RGB").resize((width, round(large.height * width / large.width)), Image.Resampling.LANCZOS)
    small.quantize(colours).save(PICTURES / path.name, optimize=True)
    return PICTURES / path.name


if __name__ == "__main__":
    main(*sys.argv[1:])
