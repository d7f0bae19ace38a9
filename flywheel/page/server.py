"""The server of the live page: on 127.0.0.1 alone, below a secret, static files from a fixed table, calls as JSON.

A page of another site, or a foreign name resolved to this machine, gets nothing: every request must name this address
as its host, come from this page if the browser states the origin, and contain the secret, which is only in the address. A
refusal states only its kind. Answers are computed in separate processes, which a newer request ends.
"""

from __future__ import annotations

import gc
import hmac
import json
import signal
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from io import BufferedReader, RawIOBase
from multiprocessing import get_context
from pathlib import Path
from secrets import token_urlsafe
from threading import Condition, Lock, Thread
from time import monotonic, perf_counter
from typing import Any, NamedTuple
from urllib.parse import parse_qsl

import numpy as np

from flywheel import language
from flywheel.numerics.faults import Fault, Remark, SceneError
from flywheel.page import data
from flywheel.page.edits import MOST_EDITS, Conflict, Draft, Refusal, Session
from flywheel.page.form import as_groups
from flywheel.reading.scenes import parse_scene, placed_in, plain_lines
from flywheel.scene.scene import Scene


def answer(request: Mapping[str, Any]) -> bytes:
    """Form, faults, remarks and figures of a text after its edits, as JSON."""
    begin = perf_counter()
    with language.use(spoken(request)), np.errstate(all="ignore"):
        draft = edited(plain_lines(request["text"]), request.get("edits"))
        text = draft.outline.text
        faults, remarks = list(draft.faults), list[Remark]()
        figures: dict[str, Any] | None = None
        try:
            scene = scene_of(text, request)
            remarks = list(scene.remarks)
            figures = data.answer(
                scene,
                request["view"] if isinstance(request.get("view"), dict) else {},
                rest=request.get("rest") is True,
                units="us" if request.get("units") == "us" else "si",
            )
            faults += placed_in(figures.pop("faults"), text)
        except SceneError as error:
            faults += placed_in(error.faults, text)
        reply = {
            "text": text,
            "form": as_groups(draft.form, draft.outline, faults),
            "faults": [as_fault(fault) for fault in faults],
            "remarks": [as_remark(remark) for remark in remarks],
            "answer": figures,
            "milliseconds": round(1e3 * (perf_counter() - begin), 3),
        }
    return json.dumps(reply, allow_nan=False, separators=(",", ":")).encode()


def edited(text: str, edits: object) -> Draft:
    """The text after the edits of a form: `path` with a `value`, with a `unit` to convert to, or with null to remove it."""
    draft = Draft(text, _drafts.get((text, language.current())))
    for edit in edits[:MOST_EDITS] if isinstance(edits, list) else ():
        path, value, unit = (edit.get(key) for key in ("path", "value", "unit")) if isinstance(edit, dict) else (None,) * 3
        if isinstance(path, str) and (value is None or isinstance(value, str)) and (unit is None or isinstance(unit, str)):
            draft.edit(path, value, unit)
    _drafts.clear()
    _drafts[draft.outline.text, language.current()] = draft
    return draft


_drafts: dict[tuple[str, str], Draft] = {}
"""The last text and the language of its form, which the next request changes at one place."""


def scene_of(text: str, request: Mapping[str, Any]) -> Scene:
    """The scene of a text, whose CSV files lie in the request's folder."""
    folder = Path(request["folder"])
    return parse_scene(text, folder=folder, file=folder / request["name"])


def spoken(request: Mapping[str, Any]) -> str:
    """The requested language; English if there is no such language."""
    tongue = request.get("language", "en")
    return tongue if tongue in language.LANGUAGES else "en"


def report(request: Mapping[str, Any]) -> bytes:
    """The worked report as the bytes of its file; a JSON object with the reason if there is none."""
    from flywheel.report import contents
    from flywheel.report.contents import html

    text = plain_lines(request["text"])
    with language.use(spoken(request)):
        try:
            units = "us" if request.get("units") == "us" else "si"
            written = html(scene_of(text, request), units=units, cover_sheet=request["cover_sheet"])
            return contents.pdf(written) if request["format"] == "pdf" else written.encode()
        except SceneError as error:
            faults = placed_in(error.faults, text)
            reply = {"message": "; ".join(map(str, faults)), "faults": [as_fault(fault) for fault in faults]}
        except contents.PrintError as error:
            reply = {"message": str(error), "faults": []}
    return json.dumps(reply).encode()


def as_fault(fault: Fault) -> dict[str, Any]:
    """A fault as the page shows it, at its line and beside its field, in the language in use."""
    words = {
        key: language.message(part, numbers=False)
        for key, part in zip(("found", "expected", "advice"), fault[1:4], strict=True)
    }
    return {"path": fault.path, "line": fault.line, "column": fault.column, **words, "message": fault.sentence}


def as_remark(remark: Remark) -> dict[str, Any]:
    """A remark as the page shows it."""
    words = {"found": language.message(remark.defect), "advice": language.message(remark.advice)}
    return {"path": remark.path, "line": remark.line, **words, "message": remark.sentence}


CALLS: dict[str, Callable[[Mapping[str, Any]], bytes]] = {"answer": answer, "report": report}


QUICK_SECONDS = 20.0
"""Longest time (s) of an answer without time stepping."""
REST_SECONDS = 120.0
"""Longest time (s) of an answer."""
REPORT_SECONDS = 300.0
"""Longest time (s) of a report."""
_LATE = 1.5  # seconds after which a computation that nobody waits for any more is ended


class OvertakenError(Exception):
    """A request replaced by a newer one of the same page."""


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
        """Answer of the process; raises OvertakenError where a newer request of the page comes before that."""
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
        """Drops the earlier requests of the page; the running one ends if it takes long."""
        for ticket in [*self._waiting, *filter(None, [self._busy])]:
            ticket.overtaken = ticket.overtaken or ticket.page == page
        self._waiting = [ticket for ticket in self._waiting if not ticket.overtaken]

    def overtake(self, page: str) -> None:
        """Drops the earlier requests of the page."""
        with self._turn:
            self._overtake(page)
            self._turn.notify_all()

    def _answer(self, call: str, request: Mapping[str, Any], ticket: _Ticket) -> bytes:
        """The bytes of an answer; a fault if it takes too long or its process has died."""
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
        """Ends the process."""
        with self._turn:
            self._closed = True
            for ticket in self._waiting:
                ticket.overtaken = True
            self._turn.notify_all()
        self._end()


class Workers:
    """The processes for answers during a drag and after it; each report starts its own."""

    def __init__(self) -> None:
        self._quick = _Worker(QUICK_SECONDS)
        self._thorough = _Worker(REST_SECONDS)
        self._report = Lock()

    def ask(self, call: str, request: Mapping[str, Any], page: str, rest: bool) -> bytes:
        """The answer to a page, as JSON; raises OvertakenError if a newer request has replaced it."""
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
        """Ends the processes."""
        self._quick.close()
        self._thorough.close()


def failure(defect: str, request: Mapping[str, Any]) -> bytes:
    """Answer to a page if nothing could be computed: the text with its edits, and the reason."""
    with language.use(spoken(request)):
        text = edited(plain_lines(request.get("text", "")), request.get("edits")).outline.text
    fault = {"path": "scene", "line": None, "found": defect, "expected": "an answer in time", "advice": ""}
    fault["message"] = message = f"found {defect}, expected {fault['expected']}"
    reply = {"message": message, "text": text, "form": None, "faults": [fault], "remarks": []}
    return json.dumps(reply | {"answer": None, "milliseconds": 0}).encode()


@contextmanager
def _without_interrupts() -> Iterator[None]:
    """Makes a process started in this block ignore Ctrl+C, which is for the server."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _compute(connection: Any) -> None:
    """Main loop of a process: requests in, answers out, until the server ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    from flywheel.page.server import CALLS

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


HOST = "127.0.0.1"
SECRET_BYTES = 24
LARGEST_BODY = 2**20
_MOST_CONNECTIONS = 48
_SECONDS_TO_ASK = 10.0  # from the first byte to the last of a request
_SECONDS_TO_ANSWER = 30.0  # to a client that reads slowly
_DISCARDED = 2**25  # bytes of a refused body that are read off, so that the refusal arrives

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
}
_TYPES = {
    "html": "text/html; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "json": "application/json",
    "svg": "image/svg+xml",
    "png": "image/png",
    "pdf": "application/pdf",
}


class Reply(NamedTuple):
    """Reply to a call: a status, a body and its kind; the name under which a browser keeps a file."""

    body: bytes
    kind: str = "json"
    status: HTTPStatus = HTTPStatus.OK
    name: str = ""


_ELSEWHERE = "Each run of flywheel open has an address of its own: open the one that it has printed.\n"


class RefusedError(Exception):
    """A request that is answered with a status alone."""

    def __init__(self, status: HTTPStatus) -> None:
        self.status = status
        super().__init__(status.phrase)


def _json(value: Mapping[str, Any], status: HTTPStatus = HTTPStatus.OK) -> Reply:
    return Reply(json.dumps(value, allow_nan=False, separators=(",", ":")).encode(), status=status)


def static_files() -> dict[str, Any]:
    """Every file of the page by its address below the secret: no other file is ever sent from the disk."""
    by_path: dict[str, Any] = {}

    def collect(folder: Any, address: str) -> None:
        for entry in folder.iterdir():
            if entry.is_dir():
                collect(entry, f"{address}{entry.name}/")
            elif entry.name.rpartition(".")[2] in _TYPES:
                by_path[f"{address}{entry.name}"] = entry

    collect(files(__package__) / "static", "static/")
    by_path[""] = by_path.pop("static/index.html")
    return by_path


class PageServer(ThreadingHTTPServer):
    """The page of one scene.

    The address with the secret is `address`; `serve_forever` serves until `shutdown`, `server_close` ends the processes.
    """

    daemon_threads = True
    request_queue_size = 64

    def __init__(self, session: Session, port: int = 0) -> None:
        super().__init__((HOST, port), _Handler, bind_and_activate=False)
        self.session = session
        self.secret = token_urlsafe(SECRET_BYTES)
        self._invitation = ""
        self.files = static_files()
        self._lock = Lock()
        self._open: dict[socket.socket, float] = {}  # since when each asks; inf: it is answered
        try:
            self.server_bind()
            self.server_activate()
        except OSError:
            self.socket.close()
            raise
        self.workers = Workers()

    @property
    def port(self) -> int:
        """The port on which it listens."""
        return int(self.server_address[1])

    @property
    def address(self) -> str:
        """Address to type into the browser; whoever has it may use the page."""
        return f"http://{HOST}:{self.port}/{self.secret}/"

    def invitation(self) -> str:
        """An address that leads to the page once, because other users of this machine can see a browser's arguments."""
        self._invitation = token_urlsafe(SECRET_BYTES)
        return f"http://{HOST}:{self.port}/{self._invitation}/"

    def invited(self, token: str) -> bool:
        """Tests whether a request comes by an invitation, which is valid once."""
        with self._lock:
            invited = bool(self._invitation) and hmac.compare_digest(token.encode(), self._invitation.encode())
            self._invitation = "" if invited else self._invitation
            return invited

    def server_bind(self) -> None:
        """Binds without a query to a name server."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1) if sys.platform != "win32" else None
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = HOST, int(self.server_address[1])

    def server_close(self) -> None:
        """Frees the port, and ends the processes that compute."""
        super().server_close()
        self.workers.close()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Starts a thread for the request; if there are too many, the oldest incomplete request is closed."""
        with self._lock:
            if len(self._open) >= _MOST_CONNECTIONS:
                oldest = min(self._open, key=lambda connection: self._open[connection])
                with suppress(OSError):
                    (oldest if self._open[oldest] < float("inf") else request).shutdown(socket.SHUT_RDWR)
            self._open[request] = monotonic()
        super().process_request(request, client_address)

    def mark_complete(self, request: socket.socket) -> None:
        """Marks a request as complete, so that it is answered."""
        with self._lock:
            if request in self._open:
                self._open[request] = float("inf")

    def shutdown_request(self, request: Any) -> None:
        """Closes a connection: sends the remaining bytes, and reads what a refused client still sends, up to a limit."""
        with suppress(OSError):
            request.shutdown(socket.SHUT_WR)
            end, left = monotonic() + 1.0, _DISCARDED
            while (seconds := end - monotonic()) > 0 and left > 0:
                request.settimeout(seconds)
                got = len(request.recv(2**16))
                if not got:
                    break
                left -= got
        with self._lock:
            self._open.pop(request, None)
        self.close_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignores clients that disconnect; prints nothing, because addresses contain the secret."""


class _Unhurried(RawIOBase):
    """A socket's bytes until a deadline, so that a slow client does not occupy a thread for long."""

    def __init__(self, connection: socket.socket, seconds: float) -> None:
        self._connection, self._end = connection, monotonic() + seconds

    def readable(self) -> bool:
        """True, which a buffered reader requires."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Reads bytes of the connection until the deadline."""
        left = self._end - monotonic()
        if left <= 0:
            raise TimeoutError
        self._connection.settimeout(left)
        return self._connection.recv_into(buffer)


class _Handler(BaseHTTPRequestHandler):
    """One request, one answer, and the connection is closed."""

    server: PageServer
    protocol_version = "HTTP/1.0"
    server_version, sys_version = "flywheel", ""

    def setup(self) -> None:
        """Prepares a connection whose request must arrive in time."""
        super().setup()
        self.rfile = BufferedReader(_Unhurried(self.connection, _SECONDS_TO_ASK))

    def do_GET(self) -> None:
        """Answers with a file of the page, or a call that changes nothing."""
        self._answered(self._get)

    def do_HEAD(self) -> None:
        """Answers as to GET, without the body."""
        self._answered(self._get)

    def do_POST(self) -> None:
        """Answers a call with JSON."""
        self._answered(self._post)

    def __getattr__(self, name: str) -> Any:
        """Answers every other method in the same way."""
        if name.startswith("do_"):
            return lambda: self._answered(self._no_method)
        raise AttributeError(name)

    def _no_method(self) -> Reply:
        self._below_secret()
        raise RefusedError(HTTPStatus.METHOD_NOT_ALLOWED)

    def _answered(self, answer: Callable[[], Reply]) -> None:
        """Sends the answer of a call or the reason of its failure, never a traceback."""
        try:
            reply = answer()
        except RefusedError as refused:
            words = _ELSEWHERE if refused.status is HTTPStatus.NOT_FOUND else ""
            reply = Reply(f"{refused.status.value} {refused.status.phrase}\n{words}".encode(), "txt", refused.status)
        except TimeoutError:
            status = HTTPStatus.REQUEST_TIMEOUT
            reply = Reply(f"{status.value} {status.phrase}\n".encode(), "txt", status)
        except OSError:
            return
        except Exception as error:
            reply = _json({"message": f"the server failed ({type(error).__name__})"}, HTTPStatus.INTERNAL_SERVER_ERROR)
        self._send(reply)

    def _send(self, reply: Reply) -> None:
        self.server.mark_complete(self.connection)
        self.connection.settimeout(_SECONDS_TO_ANSWER)
        self.send_response(reply.status)
        self.send_header("Content-Type", _TYPES.get(reply.kind, "text/plain; charset=utf-8"))
        self.send_header("Content-Length", str(len(reply.body)))
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        if reply.name:
            self.send_header("Content-Disposition", f'attachment; filename="{reply.name}"')
        if reply.status == HTTPStatus.SEE_OTHER:
            self.send_header("Location", f"/{self.server.secret}/")
        if reply.status == HTTPStatus.METHOD_NOT_ALLOWED:
            self.send_header("Allow", "GET, HEAD, POST")
        self.send_header("Connection", "close")
        self.close_connection = True
        with suppress(OSError):
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(reply.body)

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Sends the status alone for an invalid request."""
        status = HTTPStatus(code)
        self.command = getattr(self, "command", None) or "GET"
        self.request_version = "HTTP/1.0"
        self._send(Reply(f"{status.value} {status.phrase}\n".encode(), "txt", status))

    def handle_expect_100(self) -> bool:
        """Lets a client that waits before it sends its body get the answer itself."""
        return True

    def log_message(self, format: str, *args: Any) -> None:
        """Writes no log, because addresses hold the secret."""

    # -- who may ask

    def _below_secret(self) -> tuple[str, dict[str, str]]:
        """The address below the secret and its query, of an allowed request."""
        hosts = self.headers.get_all("Host") or []
        port = "" if self.server.port == 80 else f":{self.server.port}"  # which browsers leave out
        if len(hosts) != 1 or hosts[0] not in (f"{HOST}{port}", f"localhost{port}"):
            raise RefusedError(HTTPStatus.FORBIDDEN)
        address, _, query = self.path.partition("?")
        secret, slash, below = address.removeprefix("/").partition("/")
        if not hmac.compare_digest(secret.encode(), self.server.secret.encode()) or not slash:
            if self.command == "GET" and slash and not below and self.server.invited(secret):
                raise RefusedError(HTTPStatus.SEE_OTHER)  # to the page
            raise RefusedError(HTTPStatus.NOT_FOUND)
        origins, site = self.headers.get_all("Origin") or [], self.headers.get("Sec-Fetch-Site", "same-origin")
        opened = self.command == "GET" and not below and self.headers.get("Sec-Fetch-Mode") == "navigate"
        if any(origin != f"http://{hosts[0]}" for origin in origins):
            raise RefusedError(HTTPStatus.FORBIDDEN)
        if site not in ("same-origin", "none") and not opened:
            raise RefusedError(HTTPStatus.FORBIDDEN)
        return below, dict(parse_qsl(query[:1000], max_num_fields=10, keep_blank_values=True))

    # -- what is answered

    def _get(self) -> Reply:
        below, query = self._below_secret()
        if below in self.server.files:
            name = self.server.files[below].name
            return Reply(self.server.files[below].read_bytes(), name.rpartition(".")[2])
        with _refusals():
            if below == "api/scene":
                return _json(self.server.session.scene())
            if below == "api/watch":
                return _json(self.server.session.watch(query.get("seen", ""), query.get("path", "")))
            if below == "api/language":
                if query.get("of") not in language.LANGUAGES:
                    raise RefusedError(HTTPStatus.BAD_REQUEST)
                return _json(dict(language.catalogue(query["of"])))
        raise RefusedError(HTTPStatus.METHOD_NOT_ALLOWED if below in _CALLS else HTTPStatus.NOT_FOUND)

    def _post(self) -> Reply:
        below, _ = self._below_secret()
        if below not in _CALLS:
            raise RefusedError(HTTPStatus.NOT_FOUND)
        # it must state its length, which is limited
        if (self.headers.get("Content-Type") or "").partition(";")[0].strip().lower() != "application/json":
            raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
        lengths = self.headers.get_all("Content-Length") or []
        if "Transfer-Encoding" in self.headers:  # of a length that nobody knows
            raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        if len(lengths) != 1 or not (lengths[0].isascii() and lengths[0].isdigit()):
            raise RefusedError(HTTPStatus.LENGTH_REQUIRED)
        if len(lengths[0]) > 9 or int(lengths[0]) > LARGEST_BODY:
            raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        body = self.rfile.read(int(lengths[0]))
        if len(body) < int(lengths[0]):
            raise RefusedError(HTTPStatus.BAD_REQUEST)
        self.server.mark_complete(self.connection)
        try:
            content = json.loads(body)
        except (ValueError, RecursionError):
            raise RefusedError(HTTPStatus.BAD_REQUEST) from None
        if not isinstance(content, dict):
            raise RefusedError(HTTPStatus.BAD_REQUEST)
        with _refusals():
            return _CALLS[below](self.server, content)


@contextmanager
def _refusals() -> Iterator[None]:
    """Turns wrong kinds of values in a call into a bad request."""
    try:
        yield
    except (TypeError, KeyError, ValueError):
        raise RefusedError(HTTPStatus.BAD_REQUEST) from None


def _text(request: Mapping[str, Any], name: str, default: str = "") -> str:
    """A text of a call; invalid Unicode becomes the replacement character."""
    value = request.get(name, default)
    if not isinstance(value, str):
        raise TypeError(name)
    return value.encode("utf-8", "replace").decode("utf-8")


def _with_place(server: PageServer, message: dict[str, Any]) -> dict[str, Any]:
    """The message with the folder and the name of its text, for a worker."""
    folder = server.session.folder_of(_text(message, "origin"))
    return {**message, "text": _text(message, "text"), "folder": str(folder), "name": server.session.name}


def _answer(server: PageServer, message: dict[str, Any]) -> Reply:
    """Form, faults and figures of a text."""
    try:
        return Reply(
            server.workers.ask("answer", _with_place(server, message), _text(message, "page"), bool(message.get("rest")))
        )
    except OvertakenError:
        return _json({"reason": "overtaken"}, HTTPStatus.CONFLICT)


def _report(server: PageServer, message: dict[str, Any]) -> Reply:
    """The worked report as a file, or its cover sheet alone, which has a file name of its own."""
    kind, alone = _text(message, "format", "html"), message.get("cover_sheet", False)
    if kind not in ("html", "pdf") or not isinstance(alone, bool):
        raise ValueError(f"{kind} {alone}")
    answer = server.workers.report({**_with_place(server, message), "format": kind, "cover_sheet": alone})
    if answer[:1] == b"{":
        return Reply(answer, status=HTTPStatus.UNPROCESSABLE_ENTITY)
    return Reply(answer, kind, name=f"{server.session.stem}{'-cover-sheet' * alone}.{kind}")


def _save(server: PageServer, request: dict[str, Any]) -> Reply:
    """Writes the text to the disk, or answers with the reason why not."""
    path = request.get("path")
    try:
        place = None if path is None else _text(request, "path")
        saved = server.session.save(_text(request, "text"), place, request.get("over") is True, _text(request, "seen"))
    except Conflict as conflict:
        return _json(conflict.details, HTTPStatus.CONFLICT)
    except Refusal as refusal:
        return _json({"reason": "refused", "message": str(refusal)}, HTTPStatus.UNPROCESSABLE_ENTITY)
    return _json(saved)


def _start(server: PageServer, request: dict[str, Any]) -> Reply:
    """A starter or an example."""
    return _json(server.session.start(_text(request, "id")))


_CALLS = {"api/answer": _answer, "api/report": _report, "api/save": _save, "api/start": _start}
