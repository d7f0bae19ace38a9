"""Properties are tried on the same examples in every run, and no example is timed."""

import gc
from collections.abc import Generator

import pytest
from hypothesis import settings

settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")

collect_ignore = ["benchmarks"]  # programs, run by .ci/run; nothing in them is a test


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keeps collected items to the end: searching them for garbage took a fifth of the time of collection."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


@pytest.fixture
def blank(monkeypatch: pytest.MonkeyPatch) -> None:
    """Empty diagrams in reports: where their words are read they need not be drawn, which takes seconds."""
    from flywheel.report import contents
    from flywheel.report.document import Figure

    drawn = '<svg viewBox="0 0 2 1"></svg>'
    monkeypatch.setattr(contents, "panel", lambda _sizing, kind: Figure(drawn, kind, kind))
