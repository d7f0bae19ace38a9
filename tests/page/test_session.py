"""The scene on the disk: nothing is taken from anybody, whatever is saved, and by whom."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from flywheel.numerics.faults import SceneError
from flywheel.page.session import Conflict, Refusal, Session
from flywheel.starters import starter

TEXT = starter("press")


@pytest.fixture
def press(tmp_path: Path) -> Path:
    file = tmp_path / "press.toml"
    file.write_text(TEXT)
    return file


def test_a_scene_is_saved_where_it_is_said_so_and_keeps_its_permissions(press: Path) -> None:
    press.chmod(0o640)
    session = Session(press)
    seen = session.scene()["seen"]
    with pytest.raises(Conflict) as asked:
        session.save("title = 'new'\n", None, False, seen)
    assert asked.value.told == {"reason": "exists", "text": TEXT, "seen": seen}
    assert press.read_text() == TEXT
    saved = session.save("title = 'new'\n", None, True, seen)
    assert press.read_text() == "title = 'new'\n"
    assert stat.S_IMODE(press.stat().st_mode) == 0o640
    assert session.watch(saved["seen"]) == {"seen": saved["seen"], "changed": False}
    assert os.listdir(press.parent) == ["press.toml"]


def test_what_has_changed_since_is_never_lost(press: Path) -> None:
    """Two pages of one file: the second is told what the first has written, and decides with both texts before it."""
    first, second = Session(press), Session(press)
    seen = first.scene()["seen"]
    mine = first.save("title = 'first'\n", None, True, seen)
    told = second.watch(seen)
    assert (told["changed"], told["text"], told["seen"]) == (True, "title = 'first'\n", mine["seen"])
    with pytest.raises(Conflict) as asked:
        second.save("title = 'second'\n", None, True, seen)
    assert asked.value.told == {"reason": "changed", "text": "title = 'first'\n", "seen": mine["seen"]}
    assert press.read_text() == "title = 'first'\n"
    second.save("title = 'second'\n", None, True, mine["seen"])
    assert press.read_text() == "title = 'second'\n"


def test_a_file_that_goes_is_written_anew_and_one_that_comes_is_kept(press: Path) -> None:
    session = Session(press)
    seen = session.scene()["seen"]
    press.unlink()
    assert session.watch(seen)["changed"] is True
    session.save("a = 1\n", None, False, seen)
    assert press.read_text() == "a = 1\n"
    other = press.with_name("other.toml")
    other.write_text("b = 1\n")
    with pytest.raises(Conflict) as asked:
        session.save("a = 2\n", "other.toml", True, seen)
    assert asked.value.told["reason"] == "exists"
    assert other.read_text() == "b = 1\n"
    session.save("a = 2\n", "other.toml", True, asked.value.told["seen"])
    assert other.read_text() == "a = 2\n"


@pytest.mark.parametrize(
    "name",
    ["../out.toml", "/tmp/out.toml", "sub/../../out.toml", "press.txt", "x", "", "   ", ".toml", "sub/.toml", "a\n.toml",
     "c:x.toml", "a\\b.toml", "no/such/folder.toml", "x" * 300 + ".toml", "link/out.toml", "a\x00.toml"],
)  # fmt: skip
def test_nothing_is_written_outside_the_folder_or_under_another_ending(press: Path, name: str) -> None:
    (press.parent / "sub").mkdir()
    outside = press.parent.parent / f"{press.parent.name}-outside"
    outside.mkdir(exist_ok=True)
    (press.parent / "link").symlink_to(outside)
    with pytest.raises(Refusal):
        Session(press).save("a = 1\n", name, True, "")
    assert list(outside.iterdir()) == []
    assert sorted(os.listdir(press.parent)) == ["link", "press.toml", "sub"]


def test_links_stay_links(press: Path) -> None:
    link = press.with_name("link.toml")
    link.symlink_to(press)
    session = Session(link)
    session.save("a = 1\n", None, True, session.scene()["seen"])
    assert link.is_symlink()
    assert press.read_text() == "a = 1\n"


def test_a_file_that_cannot_be_written_says_so_in_a_line(press: Path) -> None:
    session = Session(press)
    press.chmod(0o444)
    with pytest.raises(Refusal, match=r"^press.toml cannot be written \(it is read-only\)$"):
        session.save("a = 1\n", None, True, session.scene()["seen"])
    assert press.read_text() == TEXT
    with pytest.raises(Refusal, match="1 MiB"):
        session.save("x" * (2**20 + 1), "new.toml", False, "")


def test_line_ends_and_the_mark_of_an_editor_stay(tmp_path: Path) -> None:
    file = tmp_path / "windows.toml"
    file.write_bytes(b"\xef\xbb\xbftitle = 'x'\r\n[gravity]\r\n")
    session = Session(file)
    scene = session.scene()
    assert scene["text"] == "title = 'x'\n[gravity]\n"
    session.save("title = 'y'\n[gravity]\n", None, True, scene["seen"])
    assert file.read_bytes() == b"\xef\xbb\xbftitle = 'y'\r\n[gravity]\r\n"


def test_a_page_without_a_scene_gets_its_file_when_it_is_saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    session = Session()
    assert (session.scene()["text"], session.scene()["path"], session.scene()["seen"]) == ("", None, "")
    with pytest.raises(Refusal):
        session.save(TEXT, None, False, "")
    session.save(TEXT, "mine.toml", False, "")
    assert (tmp_path / "mine.toml").read_text() == TEXT
    assert session.scene()["text"] == TEXT


@pytest.mark.parametrize("name", ["none.toml", "folder"])
def test_what_is_no_scene_is_not_opened(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(SceneError):
        Session(tmp_path / name)


def test_a_page_that_has_another_file_saves_and_watches_that_one(press: Path) -> None:
    """A new scene, begun in the page of another one and saved under a name of its own."""
    session = Session(press)
    saved = session.save("a = 1\n", "mine.toml", False, "")
    mine = str(press.with_name("mine.toml"))
    assert saved["path"] == mine
    assert session.watch(saved["seen"], mine)["changed"] is False
    session.save("a = 2\n", mine, True, saved["seen"])
    assert (press.read_text(), Path(mine).read_text()) == (TEXT, "a = 2\n")
    assert session.watch(saved["seen"], mine)["text"] == "a = 2\n"
    assert session.watch("", "/etc/passwd")["text"] == TEXT
