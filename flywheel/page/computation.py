"""Processes that compute for the page: one for what a moving hand asks, one for what takes its time, one for a report.

The server itself never computes, so that it answers whatever goes on. Of the requests that wait for a process the newest
of a page wins; those that it overtakes are dropped. What takes too long is ended with its process, and another one begins.
"""

from __future__ import annotations

import gc
import json
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from threading import Condition, Lock, Thread
from time import monotonic
from typing import Any

QUICK_SECONDS = 20.0
"""The longest that an answer without time stepping may take."""
REST_SECONDS = 120.0
"""The longest that an answer may take."""
REPORT_SECONDS = 300.0
"""The longest that a report may take."""
_LATE = 1.5  # seconds after which a computation that nobody waits for any more is ended


class OvertakenError(Exception):
    """A request that a newer one of the same page has made pointless."""


class _Ticket:
    """A request that waits for a process, or is being answered."""

    def __init__(self, page: str) -> None:
        self.page = page
        self.overtaken = False


class _Worker:
    """A process that answers one request at a time."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._turn = Condition(Lock())
        self._waiting: list[_Ticket] = []
        self._busy: _Ticket | None = None
        self._closed = False
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=_compute, args=(theirs,), daemon=True)
        with _without_interrupts():
            self._process.start()
        theirs.close()

    def ask(self, call: str, request: Mapping[str, Any], page: str) -> bytes:
        """What the process answers; raises OvertakenError where a newer request of the page comes before that."""
        ticket = _Ticket(page)
        with self._turn:
            self._overtake(page)
            self._waiting.append(ticket)
            self._turn.notify_all()
            while not ticket.overtaken and (self._busy is not None or self._waiting[0] is not ticket):
                self._turn.wait()
            if ticket.overtaken or self._closed:
                raise OvertakenError
            self._waiting.remove(ticket)
            self._busy = ticket
        try:
            return self._answer(call, request, ticket)
        finally:
            with self._turn:
                self._busy = None
                self._turn.notify_all()

    def _overtake(self, page: str) -> None:
        """Drop what the page asked before; what is being answered ends if it takes long."""
        for ticket in [*self._waiting, *filter(None, [self._busy])]:
            ticket.overtaken = ticket.overtaken or ticket.page == page
        self._waiting = [ticket for ticket in self._waiting if not ticket.overtaken]

    def overtake(self, page: str) -> None:
        """Drop what the page asked before, for it asks something else now."""
        with self._turn:
            self._overtake(page)
            self._turn.notify_all()

    def _answer(self, call: str, request: Mapping[str, Any], ticket: _Ticket) -> bytes:
        """The bytes of an answer; of one that takes too long, or whose process has died, a fault that says so."""
        begin = monotonic()
        try:
            self._connection.send_bytes(json.dumps([call, request]).encode())
            while not self._connection.poll(0.05):
                passed = monotonic() - begin
                if ticket.overtaken and passed > _LATE:
                    self._restart()
                    raise OvertakenError
                if passed > self.seconds:
                    self._restart()
                    return failure(f"a computation that has not ended after {self.seconds:.0f} s", request)
            return self._connection.recv_bytes()
        except (EOFError, OSError):
            self._restart()
            return failure("a computation whose process has ended", request)

    def _restart(self) -> None:
        if not self._closed:
            self._end()
            self._start()

    def _end(self) -> None:
        with suppress(OSError):
            self._connection.close()
        self._process.kill()
        self._process.join(5.0)

    def close(self) -> None:
        """End the process."""
        with self._turn:
            self._closed = True
            for ticket in self._waiting:
                ticket.overtaken = True
            self._turn.notify_all()
        self._end()


class Workers:
    """The processes for a hand that moves, and for one that rests; a report begins its own."""

    def __init__(self) -> None:
        self._quick = _Worker(QUICK_SECONDS)
        self._thorough = _Worker(REST_SECONDS)
        self._report = Lock()

    def ask(self, call: str, request: Mapping[str, Any], page: str, rest: bool) -> bytes:
        """The answer to a page, as JSON; raises OvertakenError where it is no longer wanted."""
        if rest:
            return self._thorough.ask(call, request, page)
        Thread(target=self._thorough.overtake, args=(page,), daemon=True).start()
        return self._quick.ask(call, request, page)

    def report(self, request: Mapping[str, Any]) -> bytes:
        """The bytes of a report, or a JSON object of faults, by a process of its own: one report at a time."""
        with self._report:
            worker = _Worker(REPORT_SECONDS)
            try:
                return worker.ask("report", request, "")
            finally:
                worker.close()

    def close(self) -> None:
        """End the processes."""
        self._quick.close()
        self._thorough.close()


def failure(found: str, request: Mapping[str, Any]) -> bytes:
    """What a page gets where nothing could be computed: the text as it was, and why."""
    fault = {"path": "scene", "line": None, "found": found, "expected": "an answer in time", "advice": ""}
    fault["message"] = message = f"found {found}, expected {fault['expected']}"
    told = {"message": message, "text": request.get("text", ""), "form": None, "faults": [fault], "remarks": []}
    return json.dumps(told | {"answer": None, "milliseconds": 0}).encode()


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Ctrl+C is for the server: a process that begins in this block does not hear it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _compute(connection: Any) -> None:
    """What a process does: requests in, answers out, until the server is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from flywheel.page.answers import CALLS

    gc.collect()
    gc.freeze()  # what has been imported stays: it is not searched for waste again and again
    gc.set_threshold(20_000, 20, 20)
    while True:
        try:
            call, request = json.loads(connection.recv_bytes())
        except (EOFError, OSError):
            return
        try:
            answer = CALLS[call](request)
        except Exception as error:  # a defect: the page says so, and lives on
            answer = failure(f"an internal error ({type(error).__name__})", request)
        with suppress(BrokenPipeError):
            connection.send_bytes(answer)
