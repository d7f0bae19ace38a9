"""The server of the live page: who gets nothing, whatever is tried, and what the page itself gets."""

from __future__ import annotations

import json
import socket
import sys
import threading
import time
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path

import pytest
from click.testing import CliRunner

from flywheel.cli import main
from flywheel.page import server as module
from flywheel.page.server import LARGEST_BODY, POLICY, PageServer
from flywheel.page.session import Session
from flywheel.starters import starter


class NoWorkers:
    """Nothing is computed: what reaches the workers is noted."""

    def __init__(self) -> None:
        self.asked: list[dict] = []

    def ask(self, call: str, request: dict, page: str, rest: bool) -> bytes:
        self.asked.append(request)
        return b'{"text":""}'

    def close(self) -> None:
        pass


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageServer]:
    folder = tmp_path_factory.mktemp("scenes")
    (folder / "press.toml").write_text(starter("press"))
    (folder.parent / "secret.txt").write_text("nobody's business")
    patched = pytest.MonkeyPatch()
    patched.setattr(module, "Workers", NoWorkers)
    server = PageServer(Session(folder / "press.toml"))
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    yield server
    server.shutdown()
    server.server_close()
    patched.undo()


def sent(server: PageServer, raw: bytes, seconds: float = 5.0) -> tuple[int, bytes, bytes]:
    """Status, head and body of what the server answers to these bytes."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=seconds) as client:
        client.sendall(raw)
        client.shutdown(socket.SHUT_WR)
        got = b""
        while chunk := client.recv(2**16):
            got += chunk
    head, _, body = got.partition(b"\r\n\r\n")
    return int(head.split()[1]) if head else 0, head, body


def asked(
    server: PageServer, below: str = "", method: str = "GET", body: bytes = b"", **headers: str | None
) -> tuple[int, bytes, bytes]:
    """As `sent`, with the headers of a browser but for those given; None leaves one out."""
    host = f"127.0.0.1:{server.port}"
    usual: dict[str, str | None] = {"Host": host, "Sec-Fetch-Site": "same-origin"}
    if method == "POST":
        usual |= {"Origin": f"http://{host}", "Content-Type": "application/json", "Content-Length": str(len(body))}
    usual |= {name.replace("_", "-"): value for name, value in headers.items()}
    path = below if below.startswith(("/", "http")) or below == "*" else f"/{server.secret}/{below}"
    lines = [f"{method} {path} HTTP/1.1", *(f"{name}: {value}" for name, value in usual.items() if value is not None)]
    return sent(server, "\r\n".join(lines).encode() + b"\r\n\r\n" + body)


def test_the_page_and_its_scene(served: PageServer) -> None:
    status, head, body = asked(served)
    assert status == 200
    assert b"<html" in body
    for line in (f"Content-Security-Policy: {POLICY}", "X-Content-Type-Options: nosniff", "Cache-Control: no-store"):
        assert line.encode() in head
    assert b"Referrer-Policy: no-referrer" in head
    assert b"Cross-Origin-Resource-Policy: same-origin" in head
    assert b"Access-Control" not in head
    scene = json.loads(asked(served, "api/scene")[2])
    assert scene["text"] == starter("press")
    assert {"starter/press", "starter/linkage"} <= {entry["id"] for entry in scene["examples"]}
    assert served.secret not in json.dumps(scene)
    started = json.loads(asked(served, "api/start", "POST", b'{"id": "starter/four-bar"}')[2])
    assert started["text"] == starter("four-bar")
    assert asked(served, "api/scene", Host=f"localhost:{served.port}")[0] == 200
    spanish = json.loads(asked(served, "api/language?of=es")[2])
    assert spanish["Exact flywheel"] == "Volante exacto"


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "evil.example:{port}"},
        {"Host": "127.0.0.1"},
        {"Host": "127.0.0.1:{port}.evil.example"},
        {"Host": None},
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "http://localhost:{port}"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
def test_other_hosts_and_origins_get_nothing(served: PageServer, headers: dict[str, str | None]) -> None:
    told = {name: value and value.replace("{port}", str(served.port)) for name, value in headers.items()}
    for below, method, body in (("api/scene", "GET", b""), ("api/answer", "POST", b"{}"), ("static/page.js", "GET", b"")):
        status, _, got = asked(served, below, method, body, **told)
        assert status == 403
        assert b"title" not in got
    assert asked(served, "api/scene", Host=f"127.0.0.1:{served.port}\r\nHost: evil.example")[0] == 403


def test_a_page_may_be_opened_from_anywhere_and_nothing_else(served: PageServer) -> None:
    opened = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate"}
    assert asked(served, **opened)[0] == 200
    assert asked(served, "api/scene", **opened)[0] == 403
    assert asked(served, "static/page.js", **opened)[0] == 403


@pytest.mark.parametrize(
    "path",
    ["/", "/x", "/x/", "/api/scene", "/{wrong}/", "/{wrong}/api/scene", "/{short}/", "/{secret}", "*"],
)
def test_a_wrong_secret_is_not_found_without_a_word(served: PageServer, path: str) -> None:
    names = {"wrong": served.secret[::-1], "short": served.secret[:-1], "secret": served.secret}
    status, head, body = asked(served, path.format(**names))
    assert status == 404
    assert body == b"404 Not Found\n"
    assert served.secret.encode() not in head + body


@pytest.mark.parametrize(
    "path",
    [
        "../secret.txt",
        "static/../../secret.txt",
        "static/%2e%2e/%2e%2e/secret.txt",
        "static/..%2f..%2fsecret.txt",
        "static/%252e%252e%252fsecret.txt",
        "static//etc/passwd",
        "static/%00",
        "static/",
        "static",
        "static/..\\..\\secret.txt",
        "/etc/passwd",
        "file:///etc/passwd",
        "server.py",
        "static/page.js%00.html",
        "press.toml",
    ],
)
def test_no_other_file_is_sent(served: PageServer, path: str) -> None:
    status, _, body = asked(served, path)
    assert status == 404
    assert body == b"404 Not Found\n"


def test_bodies(served: PageServer) -> None:
    before = len(served.workers.asked)
    large = b"x" * (10 * 2**20)
    assert asked(served, "api/answer", "POST", large)[0] == 413
    assert asked(served, "api/answer", "POST", b"{}", Content_Length=str(LARGEST_BODY + 1))[0] == 413
    assert asked(served, "api/answer", "POST", b"{}", Content_Length="9" * 30)[0] == 413
    chunked = {"Content_Length": None, "Transfer_Encoding": "chunked"}
    assert asked(served, "api/answer", "POST", b"a00000\r\n" + large + b"\r\n0\r\n\r\n", **chunked)[0] == 413
    for length in (None, "-1", "1e3", "２", "", "+2"):
        assert asked(served, "api/answer", "POST", b"{}", Content_Length=length)[0] in (400, 411)
    assert asked(served, "api/answer", "POST", b"{}", Content_Length="100")[0] == 400
    for kind in (None, "text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"):
        assert asked(served, "api/answer", "POST", b"{}", Content_Type=kind)[0] == 415
    for body in (b"", b"[]", b"{", b"\xff", b"[" * 100000, b'{"text": 1}', b'{"text": null}', b"9" * 5000):
        status, _, got = asked(served, "api/answer", "POST", body)
        assert status == 400
        assert b"Traceback" not in got
    assert len(served.workers.asked) == before
    assert asked(served, "api/answer", "POST", b'{"text": "\\ud800"}')[0] == 200
    assert served.workers.asked[-1]["text"] == "?"


@pytest.mark.parametrize("method", ["OPTIONS", "PUT", "DELETE", "PATCH", "TRACE", "CONNECT", "BREW"])
def test_other_methods(served: PageServer, method: str) -> None:
    status, head, _ = asked(served, "api/answer", method)
    assert status == 405
    assert b"Access-Control" not in head
    assert asked(served, "/x/api/answer", method)[0] == 404


def test_calls_by_the_wrong_method(served: PageServer) -> None:
    assert asked(served, "api/save")[0] == 405
    assert asked(served, "api/scene", "POST", b"{}")[0] == 404
    status, head, body = asked(served, "", "HEAD")
    assert (status, body) == (200, b"")
    assert b"Content-Length: 0" not in head


@pytest.mark.parametrize(
    "raw", [b"", b"\r\n\r\n", b"GET\r\n\r\n", b"\x16\x03\x01\x02\x00", b"GET / HTTP/9.9\r\n\r\n", b"GET /" + b"a" * 70000]
)
def test_what_is_no_request(served: PageServer, raw: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    status, head, body = sent(served, raw)
    assert status in (0, 400, 403, 404, 414, 505)
    assert b"Traceback" not in head + body
    assert b"aaaa" not in head + body
    out, err = capfd.readouterr()
    assert out + err == ""


def test_slow_clients_do_not_keep_others_waiting(served: PageServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """As many as the server takes, all of which send their first line and no more."""
    slow = [socket.create_connection(("127.0.0.1", served.port)) for _ in range(module._MOST_CONNECTIONS + 10)]
    try:
        for client in slow:
            client.sendall(b"GET / HTTP/1.1\r\nHost: ")
        begin = time.monotonic()
        assert asked(served, "api/watch?seen=x")[0] == 200
        assert time.monotonic() - begin < 2.0
        assert threading.active_count() < module._MOST_CONNECTIONS + 20
    finally:
        for client in slow:
            client.close()


def test_a_slow_client_is_cut_off(served: PageServer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_SECONDS_TO_ASK", 0.2)
    with socket.create_connection(("127.0.0.1", served.port), timeout=5) as client:
        client.sendall(b"GET / HTTP/1.1\r\n")
        begin = time.monotonic()
        assert client.recv(1000)[:12] in (b"", b"HTTP/1.0 408")
        assert time.monotonic() - begin < 2.0


def test_it_listens_on_this_machine_alone(served: PageServer) -> None:
    assert served.socket.getsockname()[0] == "127.0.0.1"
    assert len(served.secret) >= 22
    other = HTTPConnection("127.0.0.2", served.port, timeout=1)
    if sys.platform == "linux":
        with pytest.raises(OSError, match="refused"):
            other.connect()


def test_a_script_in_a_title_stays_a_text(served: PageServer, tmp_path: Path) -> None:
    evil = "</script><script>alert(1)</script>"
    file = tmp_path / "evil.toml"
    file.write_text(f"title = '{evil}'\n[regime]\nspeed = 1\n")
    session = served.session
    served.session = Session(file)
    try:
        status, head, body = asked(served, "api/scene")
        assert (status, b"application/json" in head, b"nosniff" in head) == (200, True, True)
        assert evil in json.loads(body)["text"]
        assert evil.encode() not in asked(served)[2]
    finally:
        served.session = session


def test_an_invitation_leads_to_the_page_once(served: PageServer) -> None:
    """What a browser is started with, others on the machine can see: it holds no secret that lasts."""
    invitation = served.invitation()
    assert served.secret not in invitation
    path = "/" + invitation.split("/", 3)[3]
    opened = {"Sec_Fetch_Site": "none", "Sec_Fetch_Mode": "navigate"}
    assert asked(served, path, Host="evil.example", **opened)[0] == 403
    assert asked(served, f"{path}api/scene")[0] == 404
    status, head, _ = asked(served, path, **opened)
    assert status == 303
    assert f"Location: /{served.secret}/".encode() in head
    assert asked(served, path, **opened)[0] == 404


def test_a_port_that_is_taken_is_told_in_a_line(served: PageServer, tmp_path: Path) -> None:
    scene = tmp_path / "press.toml"
    scene.write_text(starter("press"))
    told = CliRunner().invoke(main, ["open", str(scene), "--no-browser", "--port", str(served.port)])
    assert told.exit_code == 2
    assert f"port {served.port} cannot be used" in told.output
