"""A report is written whole, over nothing that is not one; a PDF asks for a browser; the command says what is wrong."""

from pathlib import Path

import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.report import files
from tests.report.scenes import EXAMPLES, sized

DIAGRAM = EXAMPLES / "machines/diagram.toml"


@pytest.fixture
def page(monkeypatch):
    monkeypatch.setattr(files, "html", lambda *given, **options: "<!DOCTYPE html><!-- flywheel report -->\n<p>ours</p>")


def run(*arguments):
    return CliRunner().invoke(main, ["report", *map(str, arguments)])


@pytest.mark.usefixtures("page")
def test_a_report_replaces_a_report_and_nothing_else(tmp_path):
    scene, path, other = flywheel.load(DIAGRAM), tmp_path / "a.html", tmp_path / "b.html"
    for _ in range(2):
        files.write(scene, path)
    assert path.read_text().endswith("ours</p>")
    other.write_text("<!DOCTYPE html>\n<p>mine</p>")
    with pytest.raises(OSError, match="exists already"):
        files.write(scene, other)
    assert other.read_text().endswith("mine</p>")
    with pytest.raises(ValueError, match=r"\.html, \.htm or \.pdf"):
        files.write(scene, tmp_path / "a.doc")


@pytest.mark.usefixtures("page")
def test_without_a_browser_a_pdf_is_refused_in_a_line(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "browsers", lambda: iter(()))
    found = run(DIAGRAM, "-o", tmp_path / "a.pdf")
    assert found.exit_code == 1
    assert len(found.output.splitlines()) == 1
    assert "a PDF needs a browser" in found.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("page")
def test_a_browser_that_fails_leaves_nothing_behind(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "browsers", lambda: iter(("/bin/false",)))
    found = run(DIAGRAM, "-o", tmp_path / "a.pdf")
    assert (found.exit_code, list(tmp_path.iterdir())) == (1, [])
    assert "printed nothing" in found.output


@pytest.mark.usefixtures("page")
def test_the_command_never_writes_over_its_scene(tmp_path):
    scene = tmp_path / "press.html"
    scene.write_text(DIAGRAM.read_text())
    assert run(scene, "-o", scene).exit_code != 0
    assert scene.read_text() == DIAGRAM.read_text()


def test_the_command_says_what_is_wrong(tmp_path):
    solutions = tmp_path / "printed.toml"
    solutions.write_text("[other]\n")
    assert run(DIAGRAM, "-o", tmp_path / "a.doc").exit_code == 2
    for text, told in (
        ("[other]\n", "no table 'diagram'"),
        ('[[diagram.row]]\nwhat = "A"\nfigure = "x"\n', "diagram.row[0]"),
        ('[[diagram.row]]\nwhat = "A"\nfigure = "x"\nprinted = "1"\nfigur = 2\n', "figur"),
        ("[", "no such file"),
    ):
        solutions.write_text(text)
        found = run(DIAGRAM, "-o", tmp_path / "a.html", "--printed", solutions)
        assert found.exit_code == 1
        assert told in found.output
    assert not (tmp_path / "a.html").exists()


@pytest.mark.slow
@pytest.mark.parametrize("language", ["en", "es"])
def test_a_whole_report_is_one_file_that_asks_for_nothing(tmp_path, language):
    path = tmp_path / "a.html"
    files.write(sized("exams/p103_1.toml"), path, language=language)
    text = path.read_text()
    assert f'<html lang="{language}">' in text
    assert "<math" in text
    assert text.count("<svg") > 6
    assert "<script" not in text
    assert "src=" not in text
    assert 'href="http' not in text
    assert ("348,989" in text) == (language == "es")
    assert isinstance(Path(path).stat().st_size, int)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["machines/injection_clamp", "bond_graphs/compare_methods", "regimes/punch_press"])
def test_scenes_without_a_flywheel_say_what_is_left_out(name):
    text = flywheel.report.html(flywheel.load(EXAMPLES / f"{name}.toml"))
    assert ("So there are no steps of a steady regime" in text) == (name != "regimes/punch_press")
