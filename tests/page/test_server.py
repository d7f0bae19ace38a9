"""The server of the page: what it serves, refuses and computes."""

from __future__ import annotations

import itertools
import json
import os
import re
import socket
import stat
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from click.testing import CliRunner

from flywheel import SceneError
from flywheel.cli import main
from flywheel.page import server
from flywheel.page import server as module
from flywheel.page.edits import Conflict, Refusal, Session
from flywheel.page.server import LARGEST_BODY, POLICY, OvertakenError, PageServer, Workers
from flywheel.starters import starter
from tests.page import browsers
from tests.page.browsers import drawn, expected, picture, shown, until

# The server of the live page: who gets nothing, whatever is tried, and what the page itself gets.


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
    reply = {name: value and value.replace("{port}", str(served.port)) for name, value in headers.items()}
    for below, method, body in (("api/scene", "GET", b""), ("api/answer", "POST", b"{}"), ("static/page.js", "GET", b"")):
        status, _, got = asked(served, below, method, body, **reply)
        assert status == 403
        assert b"title" not in got
    assert asked(served, "api/scene", Host=f"127.0.0.1:{served.port}\r\nHost: evil.example")[0] == 403


def test_a_page_may_be_opened_from_anywhere_and_nothing_else(served: PageServer) -> None:
    opened = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate"}
    assert asked(served, **opened)[0] == 200
    assert asked(served, "api/scene", **opened)[0] == 403
    assert asked(served, "static/page.js", **opened)[0] == 403


NOT_FOUND = b"404 Not Found\nEach run of flywheel open has an address of its own: open the one that it has printed.\n"


@pytest.mark.parametrize(
    "path",
    ["/", "/x", "/x/", "/api/scene", "/{wrong}/", "/{wrong}/api/scene", "/{short}/", "/{secret}", "*"],
)
def test_a_wrong_secret_is_not_found_and_the_words_are_the_same_for_all(served: PageServer, path: str) -> None:
    names = {"wrong": served.secret[::-1], "short": served.secret[:-1], "secret": served.secret}
    status, head, body = asked(served, path.format(**names))
    assert status == 404
    assert body == NOT_FOUND
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
    assert body == NOT_FOUND


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
    """The address that starts a browser is visible to others on the machine: it holds no secret that lasts."""
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
    reply = CliRunner().invoke(main, ["open", str(scene), "--no-browser", "--port", str(served.port)])
    assert reply.exit_code == 2
    assert f"port {served.port} cannot be used" in reply.output


# The scene on the disk: nothing is taken from anybody, whatever is saved, and by whom.


TEXT = starter("press")


@pytest.fixture
def press_file(tmp_path: Path) -> Path:
    file = tmp_path / "press.toml"
    file.write_text(TEXT)
    return file


def test_a_scene_is_saved_where_it_is_said_so_and_keeps_its_permissions(press_file: Path) -> None:
    press_file.chmod(0o640)
    session = Session(press_file)
    seen = session.scene()["seen"]
    with pytest.raises(Conflict) as conflict:
        session.save("title = 'new'\n", None, False, seen)
    assert conflict.value.details == {"reason": "exists", "text": TEXT, "seen": seen}
    assert press_file.read_text() == TEXT
    saved = session.save("title = 'new'\n", None, True, seen)
    assert press_file.read_text() == "title = 'new'\n"
    assert stat.S_IMODE(press_file.stat().st_mode) == 0o640
    assert session.watch(saved["seen"]) == {"seen": saved["seen"], "changed": False}
    assert os.listdir(press_file.parent) == ["press.toml"]


def test_what_has_changed_since_is_never_lost(press_file: Path) -> None:
    """Two pages of one file: the second is told what the first has written, and decides with both texts before it."""
    first, second = Session(press_file), Session(press_file)
    seen = first.scene()["seen"]
    mine = first.save("title = 'first'\n", None, True, seen)
    reply = second.watch(seen)
    assert (reply["changed"], reply["text"], reply["seen"]) == (True, "title = 'first'\n", mine["seen"])
    with pytest.raises(Conflict) as conflict:
        second.save("title = 'second'\n", None, True, seen)
    assert conflict.value.details == {"reason": "changed", "text": "title = 'first'\n", "seen": mine["seen"]}
    assert press_file.read_text() == "title = 'first'\n"
    second.save("title = 'second'\n", None, True, mine["seen"])
    assert press_file.read_text() == "title = 'second'\n"


def test_a_file_that_goes_is_written_anew_and_one_that_comes_is_kept(press_file: Path) -> None:
    session = Session(press_file)
    seen = session.scene()["seen"]
    press_file.unlink()
    assert session.watch(seen)["changed"] is True
    session.save("a = 1\n", None, False, seen)
    assert press_file.read_text() == "a = 1\n"
    other = press_file.with_name("other.toml")
    other.write_text("b = 1\n")
    with pytest.raises(Conflict) as conflict:
        session.save("a = 2\n", "other.toml", True, seen)
    assert conflict.value.details["reason"] == "exists"
    assert other.read_text() == "b = 1\n"
    session.save("a = 2\n", "other.toml", True, conflict.value.details["seen"])
    assert other.read_text() == "a = 2\n"


@pytest.mark.parametrize(
    "name",
    ["../out.toml", "/tmp/out.toml", "sub/../../out.toml", "press.txt", "x", "", "   ", ".toml", "sub/.toml", "a\n.toml",
     "c:x.toml", "a\\b.toml", "no/such/folder.toml", "x" * 300 + ".toml", "link/out.toml", "a\x00.toml"],
)  # fmt: skip
def test_nothing_is_written_outside_the_folder_or_under_another_ending(press_file: Path, name: str) -> None:
    (press_file.parent / "sub").mkdir()
    outside = press_file.parent.parent / f"{press_file.parent.name}-outside"
    outside.mkdir(exist_ok=True)
    (press_file.parent / "link").symlink_to(outside)
    with pytest.raises(Refusal):
        Session(press_file).save("a = 1\n", name, True, "")
    assert list(outside.iterdir()) == []
    assert sorted(os.listdir(press_file.parent)) == ["link", "press.toml", "sub"]


def test_links_stay_links(press_file: Path) -> None:
    link = press_file.with_name("link.toml")
    link.symlink_to(press_file)
    session = Session(link)
    session.save("a = 1\n", None, True, session.scene()["seen"])
    assert link.is_symlink()
    assert press_file.read_text() == "a = 1\n"


def test_a_file_that_cannot_be_written_says_so_in_a_line(press_file: Path) -> None:
    session = Session(press_file)
    press_file.chmod(0o444)
    with pytest.raises(Refusal, match=r"^press.toml cannot be written \(it is read-only\)$"):
        session.save("a = 1\n", None, True, session.scene()["seen"])
    assert press_file.read_text() == TEXT
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


def test_a_page_that_has_another_file_saves_and_watches_that_one(press_file: Path) -> None:
    """A new scene, begun in the page of another one and saved under a unique name."""
    session = Session(press_file)
    saved = session.save("a = 1\n", "mine.toml", False, "")
    mine = str(press_file.with_name("mine.toml"))
    assert saved["path"] == mine
    assert session.watch(saved["seen"], mine)["changed"] is False
    session.save("a = 2\n", mine, True, saved["seen"])
    assert (press_file.read_text(), Path(mine).read_text()) == (TEXT, "a = 2\n")
    assert session.watch(saved["seen"], mine)["text"] == "a = 2\n"
    assert session.watch("", "/etc/passwd")["text"] == TEXT


# Attacks on the page through a browser: another site that knows even the secret reads nothing and changes nothing.


HOSTILE = '<title>%s</title><img src=x onerror="window.torn=1"><script>window.torn=1</script><svg onload="window.torn=1">'


class _Elsewhere(BaseHTTPRequestHandler):
    """A site of somebody else: an empty page at every address."""

    def do_GET(self):
        body = b"<!doctype html><html lang=en><title>elsewhere</title><h1>elsewhere</h1></html>"
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *args):
        pass


@contextmanager
def another_site():
    with ThreadingHTTPServer(("127.0.0.1", 0), _Elsewhere) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture(params=["127.0.0.1", "localhost"])
def elsewhere(request, chromium, press):
    """A page of another site, on this machine's own number or name, and the page that it attacks."""
    with another_site() as port:
        context = chromium.new_context()
        tab = context.new_page()
        tab.goto(f"http://{request.param}:{port}/")
        yield tab, press
        context.close()


READ = """async (address) => {
  const got = [];
  for (const mode of ["cors", "no-cors"])
    for (const path of ["", "api/scene", "static/page.js", "api/watch?seen="])
      try {
        const reply = await fetch(address + path, {mode, credentials: "include"});
        got.push(await reply.text());
      } catch (error) { got.push(""); }
  return got;
}"""

WRITE = """async (address) => {
  const body = JSON.stringify({text: "title = \\"torn\\"", path: null, over: true, seen: ""});
  for (const type of ["application/json", "text/plain", "application/x-www-form-urlencoded"])
    for (const mode of ["cors", "no-cors"])
      try { await fetch(address + "api/save", {method: "POST", mode, body, headers: {"Content-Type": type}}); } catch {}
  navigator.sendBeacon(address + "api/save", new Blob([body], {type: "text/plain"}));
}"""


@pytest.mark.slow
def test_another_site_reads_nothing(elsewhere):
    tab, served = elsewhere
    assert set(tab.evaluate(READ, served.address)) == {""}
    assert set(tab.evaluate(READ, served.origin + "/")) == {""}


@pytest.mark.slow
def test_another_site_writes_nothing(elsewhere):
    tab, served = elsewhere
    before = served.scene.read_bytes()
    tab.evaluate(WRITE, served.address)
    tab.evaluate(
        """(address) => {
          document.body.innerHTML = `<form method=post enctype=text/plain target=hidden action="${address}api/save">
            <input name='{"text":"title = 1","path":null,"over":true,"seen":"' value='"}'></form>
            <iframe name=hidden></iframe>`;
          document.forms[0].submit();
        }""",
        served.address,
    )
    tab.wait_for_timeout(300)
    assert served.scene.read_bytes() == before
    assert [path.name for path in served.scene.parent.glob("*.toml")] == [served.scene.name]


@pytest.mark.slow
def test_another_site_shows_it_in_no_frame_and_runs_none_of_its_scripts(elsewhere):
    tab, served = elsewhere
    tab.evaluate(
        """async (address) => {
          const frame = document.createElement("iframe");
          frame.src = address;
          const script = document.createElement("script");
          script.type = "module";
          script.src = address + "static/page.js";
          script.onload = () => (window.ran = true);
          const done = new Promise((end) => (frame.onload = end));
          document.body.append(frame, script);
          await done;
        }""",
        served.address,
    )
    tab.wait_for_timeout(300)
    framed = [frame for frame in tab.frames if frame != tab.main_frame]
    assert all(frame.query_selector("#results") is None for frame in framed)
    assert tab.evaluate("window.ran") is None


@pytest.mark.slow
def test_a_window_that_another_site_opens_is_out_of_its_reach(elsewhere):
    tab, served = elsewhere
    with tab.context.expect_page() as opening:
        tab.evaluate("(address) => { window.other = window.open(address); }", served.address)
    opening.value.wait_for_load_state()
    assert tab.evaluate("() => { try { return window.other.document.title } catch { return null } }") is None
    assert opening.value.evaluate("window.opener") is None


@pytest.mark.slow
def test_a_name_bent_to_this_machine_gets_nothing(chromium, press):
    with browsers.launched(chromium.browser_type, "--host-resolver-rules=MAP rebound.test 127.0.0.1") as result:
        tab = result.new_page()
        reply = tab.goto(press.address.replace("127.0.0.1", "rebound.test"))
        assert reply.status == 403
        assert "Blanking" not in tab.content()
        assert tab.evaluate("fetch('api/scene').then((reply) => reply.status)") == 403


@pytest.mark.slow
def test_wrong_secrets_and_paths_get_nothing(page, watched):
    watched.expected.append("Failed to load resource")
    secret = page.url.split("/")[3]
    paths = [
        "/",
        f"/{secret}",
        f"/{secret[:-1]}/",
        f"/{secret}x/",
        f"/{secret}/../",
        f"/{secret}/static/..%2f..%2f__init__.py",
    ]
    paths += [
        f"/{secret}/static/%2e%2e/server.py",
        f"/{secret}/press.toml",
        f"/{secret}/static//etc/passwd",
        f"/{secret}/api/",
    ]
    statuses = page.evaluate("(paths) => Promise.all(paths.map((path) => fetch(path).then((reply) => reply.status)))", paths)
    assert [status for status in statuses if status not in (400, 403, 404)] == []


@pytest.mark.slow
def test_ten_megabytes_are_refused_and_the_page_lives_on(page, watched):
    watched.expected.append("Failed to load resource")
    post = """(size) => fetch("api/answer", {method: "POST", headers: {"Content-Type": "application/json"},
      body: JSON.stringify({text: "x".repeat(size), edits: [], view: {}, rest: false, language: "en", units: "si"})})
      .then((reply) => reply.status)"""
    assert page.evaluate(post, 10**7) == 413
    assert page.evaluate(post, 10) == 200


@pytest.mark.slow
@pytest.mark.parametrize("place", ["title", "name"])
def test_a_script_in_the_scene_is_text(place, opened, window, tmp_path):
    source = (browsers.EXAMPLES / "machines/press.toml").read_text()
    hostile = HOSTILE % place
    line = next(line for line in source.splitlines() if line.startswith("title" if place == "title" else "name"))
    (tmp_path / "press.toml").write_text(source.replace(line, f"{place} = '{hostile}'"))
    tab = browsers.shown(window().new_page(), opened().address)
    tab.click("#as-text")
    browsers.expected(tab.locator("#text")).to_have_value(re.compile(re.escape(hostile)))
    if place == "title":
        tab.get_by_role("heading", name=hostile, exact=True).wait_for()
    else:
        tab.wait_for_selector("#faults li")
    assert tab.evaluate("window.torn") is None


# The processes that compute for the page: the newest request wins, and what takes long keeps nobody waiting.


def request(kind: str, **more: object) -> dict[str, object]:
    return {"text": starter(kind), "folder": ".", "name": "x.toml", "view": {"panels": ["speed"]}, **more}


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    result = Workers()
    yield result
    result.close()


@pytest.mark.slow
def test_an_answer_comes_while_another_one_takes_its_time(workers: Workers) -> None:
    workers.ask("answer", request("press"), "a", False)
    slow = threading.Thread(target=workers.ask, args=("answer", request("compressor", rest=True), "b", True))
    slow.start()
    reply = json.loads(workers.ask("answer", request("press"), "a", False))
    assert reply["faults"] == []
    assert reply["answer"]["title"] == "Eccentric press, 250 kN"
    slow.join()


@pytest.mark.slow
def test_of_the_requests_that_wait_the_newest_of_a_page_wins(workers: Workers, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve requests of one page while its process is at work, as of a hand that moves faster than the machine computes."""
    free, answer = threading.Event(), workers._quick._answer
    monkeypatch.setattr(workers._quick, "_answer", lambda *call: free.wait(60.0) and answer(*call))
    answered, overtaken = [], []

    def ask(number: int) -> None:
        try:
            answered.append((number, workers.ask("answer", request("press", edits=[]), "hand", False)))
        except OvertakenError:
            overtaken.append(number)

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(12)]
    for thread, arrived in zip(threads[:2], [lambda: workers._quick._busy, lambda: workers._quick._waiting], strict=True):
        thread.start()
        while not arrived():
            time.sleep(0.001)
    for before, thread in itertools.pairwise(threads[1:]):
        thread.start()
        before.join(60.0)  # the newer one has taken its place
    free.set()
    for thread in threads:
        thread.join()
    assert sorted(overtaken) == list(range(1, 11))
    assert sorted(number for number, _ in answered) == [0, 11]
    assert all(json.loads(answer)["answer"] for _, answer in answered)


@pytest.mark.slow
def test_what_takes_too_long_is_ended_with_its_process_and_another_one_begins(
    workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers._quick, "seconds", 0.0)
    reply = json.loads(workers.ask("answer", request("compressor", text=starter("compressor") + " ", rest=True), "a", False))
    assert reply["answer"] is None
    assert "has not ended" in reply["faults"][0]["message"]
    edits = [{"path": "title", "value": "Mine"}]
    reply = json.loads(workers.ask("answer", request("press", edits=edits), "a", False))
    assert 'title = "Mine"' in reply["text"]  # what a hand has typed is not lost with the answer
    monkeypatch.setattr(workers._quick, "seconds", server.QUICK_SECONDS)
    assert json.loads(workers.ask("answer", request("press"), "a", False))["answer"] is not None


@pytest.mark.slow
def test_a_process_that_dies_is_replaced(workers: Workers) -> None:
    workers._quick._process.kill()
    workers._quick._process.join()
    assert "process has ended" in json.loads(workers.ask("answer", request("press"), "a", False))["faults"][0]["message"]
    assert json.loads(workers.ask("answer", request("press"), "a", False))["answer"] is not None


# The scene and its file: saved only when asked for, never over what somebody else has written.


@pytest.fixture
def own(opened, window, watched):  # in this order: the window is closed before its server ends
    """A page with a server and a file of its own; that a save is refused stands on the console too."""
    watched.expected += ["409", "422"]
    served = opened()
    return drawn(shown(window().new_page(), served.address)), served.scene


def write(page, old, new):
    """Change the scene's text in the text view."""
    page.click("#as-text")
    area = page.locator("#text")
    area.fill(area.input_value().replace(old, new))
    page.locator("#unsaved:not(:empty)").wait_for()


def press_of_files(page, name):
    page.get_by_role("dialog").get_by_role("button", name=name, exact=True).click()


@pytest.mark.slow
def test_the_file_is_replaced_only_after_a_question(own):
    page, scene = own
    before = scene.read_text()
    write(page, '"80 mm"', '"85 mm"')
    page.keyboard.press("Control+s")
    page.get_by_role("dialog").wait_for()
    assert scene.read_text() == before
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="detached")
    assert scene.read_text() == before
    page.click("#save")
    expected(page.locator(".differences li", has_text="85 mm")).to_have_count(1)
    press_of_files(page, "Save")
    page.locator("#unsaved:empty").wait_for(state="attached")
    assert scene.read_text() == before.replace('"80 mm"', '"85 mm"')


@pytest.mark.slow
def test_another_name_and_a_name_that_is_taken(own):
    page, scene = own
    before = scene.read_text()
    other = scene.with_name("other.toml")
    other.write_text("title = 'mine'\n")
    write(page, '"80 mm"', '"85 mm"')
    page.click("#save-as")
    page.locator("#file-name").fill("other.toml")
    page.locator("#file-name").press("Enter")
    page.get_by_role("dialog").get_by_role("button", name="Cancel").wait_for()
    page.locator(".differences").wait_for()
    assert other.read_text() == "title = 'mine'\n"
    press_of_files(page, "Cancel")
    page.click("#save-as")
    page.locator("#file-name").fill("third.toml")
    press_of_files(page, "Save")
    page.locator("#notices", has_text="third.toml").or_(page.locator("#file", has_text="third.toml")).first.wait_for()
    assert '"85 mm"' in scene.with_name("third.toml").read_text()
    assert (scene.read_text(), other.read_text()) == (before, "title = 'mine'\n")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["../out.toml", "/tmp/flywheel_out.toml"])
def test_a_name_elsewhere_is_refused(own, name):
    page, scene = own
    write(page, '"80 mm"', '"85 mm"')
    page.click("#save-as")
    page.locator("#file-name").fill(name)
    press_of_files(page, "Save")
    page.locator("#notices", has_text="not saved").wait_for()
    assert not scene.parent.parent.joinpath("out.toml").exists()
    assert {path.suffix for path in scene.parent.iterdir()} <= {".toml", ".csv"}


@pytest.mark.slow
def test_a_change_on_the_disk_is_told_and_not_overwritten(own):
    page, scene = own
    write(page, '"80 mm"', '"85 mm"')
    theirs = scene.read_text().replace('"480 mm"', '"500 mm"')
    scene.write_text(theirs)
    page.locator("#notices", has_text="changed").wait_for()
    picture(page, "changed")
    page.click("#save")
    page.get_by_role("dialog").wait_for()
    assert scene.read_text() == theirs
    press_of_files(page, "Cancel")
    page.locator("#notices").get_by_role("button", name="Take theirs").click()
    expected(page.locator("#text")).to_have_value(theirs)
    page.keyboard.press("Control+z")
    until(page, "() => document.getElementById('text').value.includes('\"85 mm\"')")
    assert scene.read_text() == theirs


@pytest.mark.slow
def test_two_pages_on_one_scene_lose_nothing(own):
    page, scene = own
    before = scene.read_text()
    other = drawn(shown(page.context.new_page(), page.url))
    write(page, '"80 mm"', '"85 mm"')
    write(other, '"480 mm"', '"500 mm"')
    page.click("#save")
    press_of_files(page, "Save")
    page.locator("#unsaved:empty").wait_for(state="attached")
    assert scene.read_text() == before.replace('"80 mm"', '"85 mm"')
    other.click("#save")
    other.get_by_role("dialog").wait_for()
    press_of_files(
        other, "Save" if other.get_by_role("dialog").get_by_role("button", name="Save", exact=True).count() else "Cancel"
    )
    other.locator("#notices", has_text="changed").or_(other.get_by_role("dialog")).first.wait_for()
    assert scene.read_text() == before.replace('"80 mm"', '"85 mm"')
    expected(other.locator("#text")).to_have_value(re.compile('"500 mm"'))


@pytest.mark.slow
def test_edits_that_were_not_saved_come_back(own):
    page, scene = own
    write(page, '"80 mm"', '"85 mm"')
    page.on("dialog", lambda dialog: dialog.accept())
    page.reload()
    page.get_by_role("button", name="Bring them back").click()
    page.click("#as-text")
    expected(page.locator("#text")).to_have_value(re.compile('"85 mm"'))
    assert '"80 mm"' in scene.read_text()
