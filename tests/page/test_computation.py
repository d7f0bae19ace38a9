"""The processes that compute for the page: the newest request wins, and what takes long keeps nobody waiting."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator

import pytest

from flywheel.page import computation
from flywheel.page.computation import OvertakenError, Workers
from flywheel.starters import starter

pytestmark = pytest.mark.slow  # two processes that import the library


def request(kind: str, **more: object) -> dict[str, object]:
    return {"text": starter(kind), "folder": ".", "name": "x.toml", "view": {"panels": ["speed"]}, **more}


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    found = Workers()
    yield found
    found.close()


def test_an_answer_comes_while_another_one_takes_its_time(workers: Workers) -> None:
    workers.ask("answer", request("press"), "a", False)
    slow = threading.Thread(target=workers.ask, args=("answer", request("compressor", rest=True), "b", True))
    slow.start()
    told = json.loads(workers.ask("answer", request("press"), "a", False))
    assert told["faults"] == []
    assert told["answer"]["title"] == "Eccentric press, 250 kN"
    slow.join()


def test_of_the_requests_that_wait_the_newest_of_a_page_wins(workers: Workers) -> None:
    """Twelve requests of one page at once, as of a hand that moves faster than the machine computes."""
    answered, overtaken = [], []

    def ask(number: int) -> None:
        try:
            answered.append((number, workers.ask("answer", request("press", edits=[]), "hand", False)))
        except OvertakenError:
            overtaken.append(number)

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(12)]
    for thread in threads:
        thread.start()
        time.sleep(0.002)
    for thread in threads:
        thread.join()
    assert 11 in [number for number, _ in answered]
    assert overtaken  # how many hangs on how fast the machine computes beside them
    assert all(json.loads(answer)["answer"] for _, answer in answered)


def test_what_takes_too_long_is_ended_with_its_process_and_another_one_begins(
    workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers._quick, "seconds", 0.0)
    told = json.loads(workers.ask("answer", request("compressor", text=starter("compressor") + " "), "a", False))
    assert told["answer"] is None
    assert "has not ended" in told["faults"][0]["message"]
    monkeypatch.setattr(workers._quick, "seconds", computation.QUICK_SECONDS)
    assert json.loads(workers.ask("answer", request("press"), "a", False))["answer"] is not None


def test_a_process_that_dies_is_replaced(workers: Workers) -> None:
    workers._quick._process.kill()
    workers._quick._process.join()
    assert "process has ended" in json.loads(workers.ask("answer", request("press"), "a", False))["faults"][0]["message"]
    assert json.loads(workers.ask("answer", request("press"), "a", False))["answer"] is not None
