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
WIDTH, COLOURS = 480, 64

FOLDERS = {
    "machines": "Machines to start from",
    "exams": "Exams of a mechanisms course, with the printed answers beside ours and the misprints named",
    "regimes": "Motors and loads that depend on speed, start and stop",
    "linkages": "Any linkage",
    "joint_forces": "Forces in the joints",
    "dynamics": "Direct dynamics by several routes",
    "bond_graphs": "Bond graphs",
    "robot": "Several degrees of freedom",
    "root_finding": "Positions",
}
ALIKE = {
    "dynamics/three_routes": "regimes/section_c",
    "root_finding/positions": "machines/injection_clamp",
}  # the same machine
STARTERS = {"joint_forces/dimensioning": "four-bar"}  # the machine of a starter scene


HEAD = """Every scene runs with `flywheel size SCENE`, or with `flywheel reduce SCENE` and `flywheel motion SCENE` where its
driver slides one way (`[stroke]`); every script with `python SCRIPT`, and with `python SCRIPT figure.png` where it has
pictures of its own.
"""


def main(*redrawn: str) -> None:
    """The pictures, all of them or those of what is named so, and the page."""
    PICTURES.mkdir(exist_ok=True)
    old = [line.split(" | ") for line in (HERE / "README.md").read_text(encoding="utf-8").splitlines() if "](" in line]
    page, drawn = ["# Examples\n", HEAD], {links.removeprefix("| "): pictures[:-2] for links, _, pictures in old}
    for folder, heading in FOLDERS.items():
        page += [f"\n## {heading}\n", "| example | what it is | |", "| --- | --- | --- |"]
        stems = sorted({path.stem for path in (HERE / folder).iterdir() if path.suffix in (".toml", ".py")})
        for stem in stems:
            files = [path for suffix in (".toml", ".py") if (path := HERE / folder / f"{stem}{suffix}").exists()]
            links = ", ".join(f"[{path.name}]({folder}/{path.name})" for path in files)
            again = (
                links not in drawn
                or not redrawn
                or any(word in f"{folder}/{path.name}" for word in redrawn for path in files)
            )
            page.append(f"| {links} | {words(files[0])} | {picture(folder, stem) if again else drawn[links]} |")
    (HERE / "README.md").write_text("\n".join(page) + "\n", encoding="utf-8")


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
            if scene.exists():
                draw(scene, Path(here) / f"{name}.png")
            if script.exists() and "sys.argv[1" in script.read_text(encoding="utf-8"):
                command(script, Path(here) / f"{name}.png")
            found = [shrink(path) for path in sorted(Path(here).glob("*.png"), key=lambda path: len(path.stem) > len(name))]
    return " ".join(f"![{path.stem.removeprefix(folder + '_').replace('_', ' ')}](pictures/{path.name})" for path in found)


def draw(scene: Path, target: Path) -> None:
    """Draw a scene's mechanism, or its sizing."""
    command("-m", "flywheel", "draw", scene, "-o", target)
    if not target.exists():
        command("-m", "flywheel", "size", scene, "--no-simulate", "--plot", target)


def command(*words: str | Path) -> None:
    """Run a script, or a module."""
    subprocess.run([sys.executable, *map(str, words)], capture_output=True, check=False, cwd=HERE.parent)


def shrink(path: Path) -> Path:
    """A small copy of a picture beside the others."""
    with Image.open(path) as large:
        small = large.convert("RGB").resize((WIDTH, round(large.height * WIDTH / large.width)), Image.Resampling.LANCZOS)
    small.quantize(COLOURS).save(PICTURES / path.name, optimize=True)
    return PICTURES / path.name


if __name__ == "__main__":
    main(*sys.argv[1:])
