"""Write README.md beside this file, the index of the examples, and the picture of each in pictures/.

    python examples/make_index.py

A scene's picture is its mechanism at a handful of angles, or the plot of its sizing where it has none; a script's is the one
that it draws, or that of the machine that it is about. The words are the scenes' titles and the scripts' first lines.
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
    "robot": "A two-link arm",
    "root_finding": "Positions",
}
ALIKE = {
    "dynamics/three_routes": "regimes/section_c",
    "root_finding/positions": "machines/injection_clamp",
}  # the same machine
STARTERS = {"joint_forces/dimensioning": "four-bar"}  # the machine of a starter scene


def main() -> None:
    """The pictures and the page."""
    PICTURES.mkdir(exist_ok=True)
    page = ["# Examples\n", "Every scene runs with `flywheel size SCENE`, every script with `python SCRIPT`.\n"]
    for folder, heading in FOLDERS.items():
        page += [f"\n## {heading}\n", "| example | what it is | |", "| --- | --- | --- |"]
        stems = sorted({path.stem for path in (HERE / folder).iterdir() if path.suffix in (".toml", ".py")})
        for stem in stems:
            files = [path for suffix in (".toml", ".py") if (path := HERE / folder / f"{stem}{suffix}").exists()]
            links = ", ".join(f"[{path.name}]({folder}/{path.name})" for path in files)
            page.append(f"| {links} | {words(files[0])} | {picture(folder, stem)} |")
    (HERE / "README.md").write_text("\n".join(page) + "\n", encoding="utf-8")


def words(path: Path) -> str:
    """The title of a scene, or the first line of a script."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".toml":
        return str(tomllib.loads(text)["title"])
    return (ast.get_docstring(ast.parse(text)) or "").splitlines()[0]


def picture(folder: str, stem: str) -> str:
    """Markdown of an example's picture, which is drawn if it can be; empty where nothing is to be seen."""
    name = ALIKE.get(f"{folder}/{stem}", f"{folder}/{stem}").replace("/", "_")
    target = PICTURES / f"{name}.png"
    scene, script = HERE / folder / f"{stem}.toml", HERE / folder / f"{stem}.py"
    if f"{folder}/{stem}" in STARTERS:
        with TemporaryDirectory() as here:
            scene = Path(here) / "starter.toml"
            subprocess.run([sys.executable, "-m", "flywheel", "new", STARTERS[f"{folder}/{stem}"], str(scene)], check=True)
            drawn(scene, target)
    elif f"{folder}/{stem}" not in ALIKE and not (drawn(scene, target) if scene.exists() else run(script, target)):
        return ""
    return f"![{stem.replace('_', ' ')}](pictures/{name}.png)"


def drawn(scene: Path, target: Path) -> bool:
    """Draw a scene's mechanism, or its sizing; whether that could be done."""
    target.unlink(missing_ok=True)
    ways = (["draw", str(scene), "-o", str(target)], ["size", str(scene), "--no-simulate", "--plot", str(target)])
    return any(done([sys.executable, "-m", "flywheel", *way], target) for way in ways)


def run(script: Path, target: Path) -> bool:
    """Run a script that draws what it is given a name for; whether there is a picture then."""
    target.unlink(missing_ok=True)
    return "sys.argv[1" in script.read_text(encoding="utf-8") and done([sys.executable, str(script), str(target)], target)


def done(command: list[str], target: Path) -> bool:
    """Whether a command ends well and leaves a picture, which is made small."""
    ended = subprocess.run(command, capture_output=True, check=False, cwd=HERE.parent).returncode
    if ended or not target.exists():
        return False
    with Image.open(target) as large:
        small = large.convert("RGB").resize((WIDTH, round(large.height * WIDTH / large.width)), Image.Resampling.LANCZOS)
    small.quantize(COLOURS).save(target, optimize=True)
    target.with_stem(f"{target.stem}_graph").unlink(missing_ok=True)  # the second picture of a script that draws two
    return True


if __name__ == "__main__":
    main()
