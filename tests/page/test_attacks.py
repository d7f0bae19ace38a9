"""Attacks on the page through a browser: another site that knows even the secret reads nothing and changes nothing."""

import re
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from tests.page import browsers

pytestmark = pytest.mark.slow

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


def test_another_site_reads_nothing(elsewhere):
    tab, served = elsewhere
    assert set(tab.evaluate(READ, served.address)) == {""}
    assert set(tab.evaluate(READ, served.origin + "/")) == {""}


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


def test_a_window_that_another_site_opens_is_out_of_its_reach(elsewhere):
    tab, served = elsewhere
    with tab.context.expect_page() as opening:
        tab.evaluate("(address) => { window.other = window.open(address); }", served.address)
    opening.value.wait_for_load_state()
    assert tab.evaluate("() => { try { return window.other.document.title } catch { return null } }") is None
    assert opening.value.evaluate("window.opener") is None


def test_a_name_bent_to_this_machine_gets_nothing(chromium, press):
    with browsers.launched(chromium.browser_type, "--host-resolver-rules=MAP rebound.test 127.0.0.1") as found:
        tab = found.new_page()
        reply = tab.goto(press.address.replace("127.0.0.1", "rebound.test"))
        assert reply.status == 403
        assert "Blanking" not in tab.content()
        assert tab.evaluate("fetch('api/scene').then((reply) => reply.status)") == 403


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


def test_ten_megabytes_are_refused_and_the_page_lives_on(page, watched):
    watched.expected.append("Failed to load resource")
    post = """(size) => fetch("api/answer", {method: "POST", headers: {"Content-Type": "application/json"},
      body: JSON.stringify({text: "x".repeat(size), edits: [], view: {}, rest: false, language: "en", units: "si"})})
      .then((reply) => reply.status)"""
    assert page.evaluate(post, 10**7) == 413
    assert page.evaluate(post, 10) == 200


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
