"""What the README, the reference and the index of the examples show runs as it stands, and what they link to is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "examples/README.md", "tests/benchmarks/README.md", "tests/extremes/README.md")
SCRIPTS = (
    "README.md",
    "flywheel/reference/joints.md",
    pytest.param("flywheel/reference/bond-graphs.md", marks=pytest.mark.slow),
)
LINKS = [
    (page, path) for page in PAGES for path in set(re.findall(r"\]\(([^)#:]+)\)", (ROOT / page).read_text(encoding="utf-8")))
]


@pytest.mark.parametrize("page", SCRIPTS)
def test_the_python_of_a_page_runs_as_it_stands(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, page, "exec"), {})
    assert capsys.readouterr().out


@pytest.mark.parametrize(("page", "path"), sorted(LINKS))
def test_every_link_leads_somewhere(page: str, path: str) -> None:
    assert ((ROOT / page).parent / path).exists()


def test_every_example_is_in_the_index_with_a_picture() -> None:
    index = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\]\(([^)#:]+)\)", index))
    found = {
        path.relative_to(ROOT / "examples").as_posix()
        for kind in ("*/*.py", "*/*.toml")
        for path in (ROOT / "examples").glob(kind)
    }
    assert found - linked == set()
    for line in index.splitlines():
        if line.startswith("| [") and ".toml)" in line:
            assert "![" in line
