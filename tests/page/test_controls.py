"""The page in a browser: controls, figures, motions, languages."""

import csv
import io
import json
import math
import re
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import pytest

import flywheel
from flywheel import language
from flywheel.page import data
from tests.page import browsers
from tests.page.browsers import answered, drawn, expected, in_sight, picture, served, shown, until

# Every control of the page by mouse and by keyboard, on a copy of the press.


LENGTH = "mechanism.crank.length"


def field(page, path):
    return page.locator(f'[data-field="{path}"]')


def becomes(page, expected):
    """Wait until the scene's text has a line that matches; the line."""
    page.keyboard.press("Alt+2")
    for _ in range(600):
        result = re.search(expected, page.locator("#text").input_value(), re.MULTILINE)
        if result:
            page.keyboard.press("Alt+1")
            return result[0]
        page.wait_for_timeout(100)
    raise AssertionError(f"no line {expected} in\n{page.locator('#text').input_value()}")


@contextmanager
def answers_held(page):
    """The requests for answers that the page sends within the block; at its end they go on to the server."""
    asked = []
    page.route("**/api/answer", lambda route: asked.append(route))
    yield asked
    for request in asked:
        request.continue_()
    page.unroute("**/api/answer")


@pytest.mark.slow
def test_the_page_shows_the_scene_and_its_answer(page):
    answered(page)
    picture(page, "press", full_page=True)
    assert page.locator("#title").text_content() == "Blanking press, flywheel on the eccentric shaft"
    assert "344.84" in page.locator("#numbers").inner_text()
    assert "confirmed" in page.locator("#state").inner_text().lower()
    assert page.locator(".panel").count() >= 7
    for drawing in page.locator(".panel svg").all():
        expected(drawing).to_be_visible()
    assert not re.search(r"\[object|undefined|NaN|Infinity", page.locator("main").inner_text())


@pytest.mark.slow
def test_a_number_is_typed_in_another_unit(page):
    drawn(page)
    box = field(page, LENGTH).locator("input[type=text]")
    box.fill("3.5 in")
    box.press("Enter")
    assert becomes(page, r'^crank\.length = "3.5 in".*half the stroke')
    answered(page)
    assert "344.84" not in page.locator("#numbers").inner_text()
    page.keyboard.press("Control+z")
    becomes(page, r'^crank\.length = "80 mm"')
    page.keyboard.press("Control+y")
    becomes(page, r'^crank\.length = "3.5 in"')


@pytest.mark.slow
def test_a_wrong_number_is_told_beside_its_field_and_line(page):
    drawn(page)
    box = field(page, LENGTH).locator("input[type=text]")
    box.fill("-80 mm")
    box.press("Enter")
    field(page, LENGTH).locator(".fault:not([hidden])").wait_for()
    expected(box).to_have_attribute("aria-invalid", "true")
    expected(page.locator("#results.old")).to_have_count(1)
    page.locator("#faults button.lead").first.click()
    expected(box).to_be_focused()
    page.click("#as-text")
    expected(page.locator("#editor .mark.fault")).to_have_count(1)
    picture(page, "fault-text")
    page.locator("#faults button.lead").first.click()
    expected(page.locator("#text")).to_be_focused()
    until(page, "() => document.getElementById('text').selectionStart > 0")


def entered(page, path, value):
    box = field(page, path).locator("input[type=text]")
    box.fill(value)
    box.press("Enter")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "typos", "typed", "line"),
    [
        ("regime.speed", ["6o"], "61", r'^speed = "61 rpm"'),
        ("regime.speed", ["6o rpm", "", "60 kg", "x"], "61", r'^speed = "61 rpm"'),
        ("load[0].force", ["-40o"], "-401", r'^force = "-401 kN"'),
        ("load[0].force", ["-40*", "sinn(phi)"], "-401", r'^force = "-401 kN"'),
        (LENGTH, ["-80", "8o"], "81", r'^crank\.length = "81 mm"'),
    ],
)
def test_a_field_keeps_its_unit_through_a_fault(page, path, typos, typed, line):
    answered(page)
    unit = field(page, path).locator("select.unit").input_value()
    for typo in typos:
        with page.expect_response("**/api/answer"):
            entered(page, path, typo)
        expected(field(page, path).locator("input[type=text]")).to_have_attribute("aria-invalid", "true")
        expected(field(page, path).locator("select.unit")).to_have_value(unit)
    picture(page, f"fault-{path}")
    entered(page, path, typed)
    becomes(page, line)
    expected(page.locator("#faults li.fault")).to_have_count(0)


@pytest.mark.slow
def test_a_field_goes_back_to_its_last_good_value(page):
    answered(page)
    entered(page, "regime.speed", "61")
    becomes(page, r'^speed = "61 rpm"')
    entered(page, "regime.speed", "6o")
    field(page, "regime.speed").get_by_role("button", name="Back to 61 rpm").click()
    becomes(page, r'^speed = "61 rpm"')
    expected(field(page, "regime.speed").locator("input[type=text]")).to_have_value("61")
    entered(page, "regime.speed", "6o")
    expected(page.locator("#faults li.fault")).to_have_count(1)
    field(page, "regime.speed").locator("select.unit").select_option("rad/s")
    entered(page, "regime.speed", "7")
    becomes(page, r'^speed = "7 rad/s"')


@pytest.mark.slow
def test_a_slider_by_arrow_keys_is_one_step_back(page):
    answered(page)
    before = page.locator("#numbers").inner_text()
    slider = field(page, LENGTH).locator("input[type=range]")
    slider.focus()
    with answers_held(page):  # to draw one between two keys takes longer than a step's pause on a slow machine
        for _ in range(5):
            page.keyboard.press("ArrowRight")
    result = float(re.search(r'"([\d.]+) mm"', becomes(page, r'^crank\.length = "(?!80 mm).*'))[1])
    assert result > 80
    answered(page)
    assert page.locator("#numbers").inner_text() != before
    page.click("#undo")
    becomes(page, r'^crank\.length = "80 mm"')
    page.locator("#undo:disabled").wait_for()


@pytest.mark.slow
def test_a_slider_dragged_by_mouse_is_one_step_back(page):
    answered(page)
    slider = field(page, LENGTH).locator("input[type=range]")
    box = slider.bounding_box()
    page.mouse.move(box["x"] + box["width"] * 0.4, box["y"] + box["height"] / 2)
    page.mouse.down()
    for k in range(10):
        page.mouse.move(box["x"] + box["width"] * (0.4 + 0.03 * k), box["y"] + box["height"] / 2)
        page.wait_for_timeout(30)
    page.mouse.up()
    becomes(page, r'^crank\.length = "(?!80 mm)')
    page.click("#undo")
    becomes(page, r'^crank\.length = "80 mm"')
    page.click("#redo")
    becomes(page, r'^crank\.length = "(?!80 mm)')


@pytest.mark.slow
def test_a_unit_is_chosen_and_the_length_stays(page):
    answered(page)
    before = page.locator("#numbers").inner_text()
    unit = field(page, LENGTH).locator("select.unit")
    unit.focus()
    unit.select_option("in")
    becomes(page, r'^crank\.length = "3\.1496\d* in"')
    answered(page)
    assert page.locator("#numbers").inner_text().split("exact")[1][:20] == before.split("exact")[1][:20]


@pytest.mark.slow
def test_a_choice_gives_another_mechanism_or_tells_what_it_lacks(page):
    drawn(page)
    field(page, "mechanism.type").locator("select").select_option("scotch-yoke")
    page.locator("#faults li").first.wait_for()
    page.click("#undo")
    answered(page)
    expected(page.locator("#faults li.fault")).to_have_count(0)


@pytest.mark.slow
def test_a_key_is_added_and_taken_away(page):
    drawn(page)
    foot = page.locator('[data-path="flywheel"] .foot').first
    options = foot.locator("select option").evaluate_all("options => options.map((option) => option.value)")
    foot.locator("select").select_option(next(filter(None, options)))
    foot.get_by_role("button", name="Add").click()
    page.locator("#undo:not(:disabled)").wait_for()
    page.keyboard.press("Control+z")
    page.locator("#undo:disabled").wait_for()


@pytest.mark.slow
def test_help_of_a_field_opens(page):
    drawn(page)
    help_of = field(page, LENGTH).get_by_role("button", name=re.compile("^Help on"))
    help_of.focus()
    page.keyboard.press("Enter")
    expected(help_of).to_have_attribute("aria-expanded", "true")
    expected(field(page, LENGTH).locator(".about")).to_contain_text(LENGTH)


@pytest.mark.slow
def test_the_text_is_edited_and_the_form_follows(page):
    drawn(page)
    page.keyboard.press("Alt+2")
    area = page.locator("#text")
    expected(area).to_be_focused()
    area.fill(area.input_value().replace('"80 mm"', '"85 mm"'))
    page.keyboard.press("Alt+1")
    answered(page)
    expected(field(page, LENGTH).locator("input[type=text]")).to_have_value("85")


@pytest.mark.slow
def test_one_cursor_through_all_figures(page):
    answered(page)
    angle = page.locator("#angle")
    page.locator("#angle-range").focus()
    page.keyboard.press("ArrowRight")
    expected(angle).to_have_value("0.5")
    angle.fill("90")
    angle.press("Enter")
    crank = page.get_by_role("slider", name=re.compile("^Crank angle: drag"))
    expected(crank).to_have_attribute("aria-valuenow", "90")
    crank.focus()
    page.keyboard.press("ArrowRight")
    expected(angle).to_have_value("91")
    page.keyboard.press("End")
    expected(angle).to_have_value("359")
    page.keyboard.press("Home")
    expected(angle).to_have_value("0")
    moment = page.locator('[data-panel="moment"] svg')
    moment.scroll_into_view_if_needed()
    box = moment.bounding_box()
    moment.click(position={"x": box["width"] / 2, "y": box["height"] / 3})
    until(page, lambda: 100 < float(angle.input_value()) < 260)
    picture(page, "cursor", full_page=True)


def crank_in_hand(page):
    """Press the mouse on the crank's pin; its place and the crank's length on the screen."""
    drawing = page.locator('[data-panel="mechanism"] svg').first
    drawing.scroll_into_view_if_needed()
    pin = drawing.locator("text", has_text="crank_pin").first.bounding_box()
    pivot = drawing.locator("text", has_text="pivot").first.bounding_box()
    x, y = pin["x"] + pin["width"] / 2, pin["y"] + 24
    page.mouse.move(x - 4, y)
    page.mouse.down()
    return x, y, x - pivot["x"] - pivot["width"] / 2


@pytest.mark.slow
def test_the_crank_is_dragged(page):
    answered(page)
    x, y, radius = crank_in_hand(page)
    for part in (0.2, 0.4, 0.6, 0.8, 1.0):
        page.mouse.move(x - radius * part * 0.4, y - radius * part * 0.8, steps=4)
    page.mouse.up()
    until(page, lambda: 40 < float(page.locator("#angle").input_value()) < 120)


@pytest.mark.slow
def test_a_crank_in_hand_stays_there_when_an_answer_comes(page):
    """The answer that a run in time confirms comes whenever it comes: the figures are drawn anew under the hand."""
    answered(page)
    with answers_held(page) as request:
        field(page, LENGTH).locator("input[type=range]").press("ArrowRight")
        until(page, lambda: request)
        x, y, radius = crank_in_hand(page)
        page.mouse.move(x - radius * 0.1, y - radius * 0.2, steps=4)
        until(page, lambda: 5 < float(page.locator("#angle").input_value()) < 40)
    answered(page)
    page.mouse.move(x - radius * 0.4, y - radius * 0.8, steps=8)
    page.mouse.up()
    until(page, lambda: 40 < float(page.locator("#angle").input_value()) < 120)


@pytest.mark.slow
def test_a_hand_that_goes_far_between_two_frames_is_followed_all_the_way(page):
    """Half a turn within one event, as a slow machine tells it: the moves between stand in the event."""
    answered(page)
    x, y, radius = crank_in_hand(page)
    page.evaluate(
        """([x, y, r]) => {
          const move = (turn, more = {}) => new PointerEvent("pointermove", {
            clientX: x - r + r * Math.cos(turn), clientY: y - r * Math.sin(turn), pointerId: 1, bubbles: true, ...more});
          const coalescedEvents = Array.from({length: 12}, (_, k) => move((Math.PI * (k + 1)) / 12));
          document.querySelector('[data-panel="mechanism"] svg').dispatchEvent(move(Math.PI, {coalescedEvents}));
        }""",
        [x, y, radius],
    )
    page.mouse.up()
    until(page, lambda: 160 < float(page.locator("#angle").input_value()) < 200)


@pytest.mark.slow
def test_play_and_pause(page):
    answered(page)
    angle, play = page.locator("#angle"), page.locator("#play")
    page.locator("#pace").select_option("4")
    play.focus()
    page.keyboard.press("Enter")
    expected(play).to_have_attribute("aria-pressed", "true")
    until(page, "() => document.getElementById('angle-range').valueAsNumber > 0")
    page.keyboard.press("Control+Enter")
    expected(play).to_have_attribute("aria-pressed", "false")
    stopped = angle.input_value()  # 0 perhaps: where frames are late the crank goes by tenths of a turn
    page.wait_for_timeout(300)
    expected(angle).to_have_value(stopped)


@pytest.mark.slow
def test_panels_are_chosen_and_remembered(page):
    answered(page)
    page.locator("#chooser summary").focus()
    page.keyboard.press("Enter")
    boxes = page.locator("#choice input")
    until(page, lambda: boxes.count() >= 7)
    boxes.nth(1).focus()
    page.keyboard.press("Space")
    page.locator('[data-panel="moment"]').wait_for(state="detached")
    page.reload()
    answered(page)
    expected(page.locator('[data-panel="moment"]')).to_have_count(0)
    page.locator("#chooser summary").click()
    page.locator("#choice input").nth(1).click()
    page.locator('[data-panel="moment"]').wait_for()


@pytest.mark.slow
def test_figures_out_of_sight_wait_until_they_are_seen_or_the_hand_rests(page):
    in_sight(answered(page))

    def quick_alone(route):
        if not route.request.post_data_json["rest"]:
            route.continue_()

    page.route("**/api/answer", quick_alone)
    slider = field(page, LENGTH).locator("input[type=range]")
    slider.focus()
    page.keyboard.press("ArrowRight")
    waiting = page.locator(".panel.old")
    waiting.first.wait_for(state="attached")
    expected(page.locator('[data-panel="mechanism"].old')).to_have_count(0)
    expected(page.locator('[data-panel="motion"].old')).to_have_attribute("aria-busy", "true")
    page.locator('[data-panel="motion"]').scroll_into_view_if_needed()
    page.locator('[data-panel="motion"]:not(.old)').wait_for()
    page.unroute("**/api/answer")
    slider.focus()
    page.keyboard.press("ArrowRight")
    answered(page)
    expected(waiting).to_have_count(0)


@pytest.mark.slow
def test_what_of_the_motion_is_shown(page):
    answered(page)
    page.locator('[data-panel="motion"]').scroll_into_view_if_needed()
    for kind in ("position", "acceleration", "reaction"):
        page.locator("#view-kind").select_option(kind)
        page.locator('[data-panel="motion"] svg', has_text=kind.capitalize()).first.wait_for(state="attached")
    until(page, lambda: page.locator("#view-of option").count() >= 3)


@pytest.mark.slow
def test_each_figure_is_had_as_svg_png_and_csv(page):
    answered(page)
    panels = page.locator(".panel")
    assert panels.count() >= 7
    for k in range(panels.count()):
        _files_of(page, panels.nth(k))


def _files_of(page, panel):
    panel.scroll_into_view_if_needed()
    panel.locator("svg").first.wait_for()
    kept = {}
    for kind in ("SVG", "PNG", "CSV"):
        button = panel.get_by_role("button", name=re.compile(f"^{kind}"))
        with page.expect_download() as coming:
            button.click() if kind != "CSV" else button.press("Enter")
        assert coming.value.suggested_filename.endswith(f".{kind.lower()}")
        kept[kind] = coming.value.path().read_bytes()
    tree = ElementTree.fromstring(kept["SVG"])
    assert tree.tag == "{http://www.w3.org/2000/svg}svg"
    assert b"<script" not in kept["SVG"]
    assert b"var(" not in kept["SVG"]
    assert any((part.text or "").strip() for part in tree.iter("{http://www.w3.org/2000/svg}text"))
    assert kept["PNG"].startswith(b"\x89PNG")
    rows = [row for row in csv.reader(io.StringIO(kept["CSV"].decode())) if row]
    assert len(rows) > 10
    assert {len(row) for row in rows} == {len(rows[0])}


@pytest.mark.slow
def test_theme_and_units_are_remembered(page):
    drawn(page)
    page.locator("#theme").select_option("dark")
    paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.locator("#units").select_option("us")
    page.locator("#numbers", has_text="lb ft²").wait_for()
    page.reload()
    answered(page)
    expected(page.locator("body")).to_have_css("background-color", paper)
    expected(page.locator("#numbers")).to_contain_text("lb ft²")
    expected(page.locator("#figures-si")).to_be_visible()
    picture(page, "dark-us", full_page=True)


@pytest.mark.slow
def test_help_opens_by_key_and_closes_by_escape(page):
    drawn(page)
    page.locator("#help").focus()
    page.keyboard.press("F1")
    page.get_by_role("dialog", name="Help").wait_for()
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="detached")
    expected(page.locator("#help")).to_be_focused()


@pytest.mark.slow
def test_another_scene_is_begun_and_taken_back(page):
    drawn(page)
    page.click("#new")
    page.get_by_role("dialog").wait_for()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.get_by_role("dialog").get_by_role("button", name="Open").click()
    page.locator("#title", has_text="Blanking press, flywheel").wait_for(state="detached")
    answered(page)
    page.click("#undo")
    page.locator("#title", has_text="Blanking press, flywheel").wait_for()


@pytest.mark.slow
@pytest.mark.parametrize("tongue", ["en", "es"])
def test_the_report_is_downloaded(page, tongue):
    report = _report(page, "html", tongue).decode()
    assert f'<html lang="{tongue}"' in report
    assert "<math" in report


@pytest.mark.slow
def test_the_report_is_downloaded_as_pdf(page):
    assert _report(page, "pdf", "en").startswith(b"%PDF-")


@pytest.mark.slow
def test_the_cover_sheet_is_downloaded(page):
    sheet = _report(page, "html", "en", "cover_sheet").decode()
    assert "Cover sheet" in sheet
    assert "Designed by" in sheet
    assert "<math" not in sheet


def _report(page, kind, tongue, part="all"):
    drawn(page)
    page.click("#report")
    dialog = page.get_by_role("dialog")
    dialog.locator(f'input[name="part"][value="{part}"]').check()
    dialog.locator(f'input[name="format"][value="{kind}"]').check()
    dialog.locator(f'input[name="tongue"][value="{tongue}"]').check()
    with page.expect_download(timeout=300_000) as coming:
        dialog.get_by_role("button", name="Download").click()
    assert coming.value.suggested_filename == f"press{'-cover-sheet' if part == 'cover_sheet' else ''}.{kind}"
    return coming.value.path().read_bytes()


@pytest.mark.slow
def test_the_keyboard_reaches_every_control_in_their_order(page):
    answered(page)
    page.locator("#form details").evaluate_all("folds => folds.forEach((fold) => { fold.open = false; })")
    page.evaluate("document.body.focus()")
    seen = []
    for _ in range(120):
        page.keyboard.press("Tab")
        name = page.evaluate("document.activeElement.id || document.activeElement.getAttribute('aria-label') || ''")
        if "angle" in seen and not name:
            break
        seen.append(name)
    wanted = [
        "new",
        "save",
        "save-as",
        "report",
        "units",
        "language",
        "theme",
        "help",
        "as-form",
        "as-text",
        "play",
        "angle",
    ]
    order = [seen.index(name) for name in wanted]
    assert order == sorted(order)


# The watch over the browser sees what it is there for: requests that leave this machine, errors on the console.


@pytest.fixture
def blank(window):
    tab = window().new_page()
    tab.goto("data:text/html,<html lang=en><title>blank</title><main><h1>Blank</h1></main></html>")
    return tab


def test_a_request_to_another_host_is_stopped_and_told(blank, watched):
    watched.expected.append("Failed to load resource")
    blank.evaluate("fetch('http://192.0.2.1/x').catch(() => null)")
    browsers.until(blank, lambda: watched.left == ["http://192.0.2.1/x"])
    watched.left.clear()
    watched.check()


@pytest.mark.parametrize("script", ["console.error('torn')", "setTimeout(() => { throw new Error('torn') })"])
def test_what_is_told_on_the_console_is_a_failure(blank, watched, script):
    blank.evaluate(script)
    browsers.until(blank, lambda: [complaint for complaint in watched.complaints if "torn" in complaint])
    watched.complaints.clear()


@pytest.mark.slow
def test_axe_sees_a_picture_without_a_text(blank):
    assert browsers.violations(blank) == []
    blank.evaluate("document.querySelector('main').append(document.createElement('img'))")
    assert any(line.startswith("image-alt") for line in browsers.violations(blank))


def test_a_named_browser_that_is_none_is_told(monkeypatch):
    monkeypatch.setenv(browsers.BROWSER, "/nowhere/chrome")
    with pytest.raises(browsers.Missing, match="FLYWHEEL_BROWSER names /nowhere/chrome, which is no program"):
        browsers.executable()


# The drawings of the page in a browser: dragged, pointed at, moved by keys; complete at 360 px; files that stand alone.


if TYPE_CHECKING:
    from playwright.sync_api import Page, Route

ROOT = Path(__file__).parents[2]
STATIC = ROOT / "flywheel" / "page" / "static"
EXAMPLES = ROOT / "examples"

_HTML = """<!doctype html><html lang="en"><meta charset="utf-8"><title>figures</title>
<link rel="stylesheet" href="page.css"><div class="panels" id="panels"></div>
<script type="module" src="begin.js"></script>"""
_BEGIN = """
import { draw, panels } from "./figures/index.js";
import { number, speak, text } from "./language.js";
const { answer, texts } = await (await fetch("answer.json")).json();
if (texts) speak("es", texts);
const figures = {};
for (const { id, title, why } of panels(answer)) {
  const [section, heading, host] = ["section", "h3", "div"].map((name) => document.createElement(name));
  section.className = "panel";
  heading.textContent = why ?? title;
  section.append(heading, host);
  document.getElementById("panels").append(section);
  if (why === null) figures[id] = draw(host, id, answer, { text, number, units: "si" });
  host.dataset.figure = id;
}
document.addEventListener("cursor", ({ detail }) => { for (const id in figures) figures[id].move(detail.phi); });
Object.assign(window, { figures, answer });
document.body.dataset.drawn = "yes";
"""
_CLASHES = """() => [...document.querySelectorAll("#panels svg")].flatMap((svg) => {
  const [box, found] = [svg.getBoundingClientRect(), []];
  const texts = [...svg.querySelectorAll("text")]
    .filter((each) => each.textContent.trim() && each.getAttribute("visibility") !== "hidden")
    .map((each) => [each.textContent, each.getBoundingClientRect()]);
  texts.forEach(([words, a], k) => {
    if (a.left < box.left - 1 || a.right > box.right + 1 || a.bottom > box.bottom + 1) found.push(`out: ${words}`);
    for (const [others, b] of texts.slice(k + 1)) {
      const x = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const y = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (x > 2 && y > 4) found.push(`${words} | ${others}`);
    }
  });
  return found;
})"""


@pytest.fixture
def drawn_figure(window: Callable[..., Any]) -> Callable[..., "Page"]:
    """`drawn("machines/press.toml", width=360, tongue="es")`: every figure of an example, without a server."""

    def begin(example: str, width: int = 1000, tongue: str = "en", **options: Any) -> "Page":
        with language.use(tongue):
            answer = data.answer(flywheel.load(EXAMPLES / example), rest=False)
            texts = dict(language.catalogue("es")) if tongue == "es" else None
        del answer["faults"]

        def serve(route: "Route") -> None:
            name = route.request.url.partition("figures.test/")[2]
            made = {"": (_HTML, "text/html"), "begin.js": (_BEGIN, "text/javascript")}
            made["answer.json"] = (json.dumps({"answer": answer, "texts": texts}), "application/json")
            if name in made:
                body, kind = made[name]
                route.fulfill(body=body, content_type=kind)
            elif (STATIC / name).is_file():
                kind = {".js": "text/javascript", ".css": "text/css"}[Path(name).suffix]
                route.fulfill(body=(STATIC / name).read_text("utf-8"), content_type=kind)
            else:
                route.fulfill(status=204)

        page = window(viewport={"width": width, "height": 900}, **options).new_page()
        page.route("http://figures.test/**", serve)
        page.goto("http://figures.test/")
        page.wait_for_selector("body[data-drawn]")
        return page

    return begin


def readout(page: "Page", figure: str) -> list[str]:
    """The bold texts of a figure: its values at the cursor among them."""
    bold = page.locator(f"[data-figure={figure}] svg text[font-weight=bold]")
    return bold.all_text_contents()


@pytest.mark.slow
def test_a_crank_that_is_dragged_takes_the_cursor_along_in_every_figure(drawn_figure: Callable[..., "Page"]) -> None:
    page = drawn_figure("machines/press.toml")
    crank = page.locator("[data-figure=mechanism] svg path[data-body=crank]").last.bounding_box()
    assert crank is not None
    pivot = crank["x"], crank["y"] + crank["height"] / 2
    hand = crank["x"] + crank["width"] - 6.0
    page.mouse.move(hand, pivot[1])
    page.mouse.down()
    page.mouse.move(pivot[0], pivot[1] - 40.0, steps=12)
    page.mouse.up()
    slider = page.locator("[role=slider]")
    until(page, lambda: 70.0 < float(slider.get_attribute("aria-valuenow") or 0.0) < 110.0)
    angle = float(slider.get_attribute("aria-valuenow") or 0.0)
    expected(slider).to_have_attribute("aria-valuetext", re.compile(re.escape(f"{angle:.1f}°")))
    for figure in ("moment", "inertia", "wittenbauer", "speed", "motion"):
        reply = next(float(words.rstrip(" °")) for words in readout(page, figure) if words.endswith("°"))
        assert reply == pytest.approx(angle, abs=0.1)


@pytest.mark.slow
def test_keys_turn_the_crank_and_both_values_of_a_jump_are_told(drawn_figure: Callable[..., "Page"]) -> None:
    page = drawn_figure("machines/press.toml")
    page.locator("[role=slider]").focus()
    page.keyboard.press("End")
    expected(page.locator("[role=slider]")).to_have_attribute("aria-valuenow", "359")
    for _ in range(19):
        page.keyboard.press("ArrowLeft")
    expected(page.locator("[role=slider]")).to_have_attribute("aria-valuenow", "340")
    values = readout(page, "moment")
    net = next(words for words in values if "→" in words)
    before, after = (float(part.split()[0].replace("−", "-")) for part in net.split("→"))
    moment = page.evaluate("answer.moment.net")
    assert before > 0.0
    assert after == pytest.approx(min(moment) / 1000, rel=1e-3)


@pytest.mark.slow
def test_a_curve_that_is_pointed_at_moves_the_mechanism(drawn_figure: Callable[..., "Page"]) -> None:
    page = drawn_figure("machines/injection_clamp.toml")
    curve = page.locator("[data-figure=motion] svg")
    box = curve.bounding_box()
    assert box is not None
    curve.click(position={"x": box["width"] - 3.0, "y": box["height"] / 2})
    expected(page.locator("[role=slider]")).to_have_attribute("aria-valuetext", "190.0 mm")


@pytest.mark.slow
def test_bands_of_power_lead_out_or_back_as_it_flows_at_the_cursor(drawn_figure: Callable[..., "Page"]) -> None:
    page = drawn_figure("machines/press.toml")
    reply = page.locator("[data-figure=power_flow] svg text", has_text="flywheel").locator("xpath=following-sibling::*[1]")
    for degrees, sense in ((300, 1), (345, -1)):
        value = page.evaluate(
            """(least) => {
              const k = answer.phi.findIndex((phi) => phi >= least);
              figures.power_flow.move(answer.phi[k]);
              return answer.power_flow.streams.find((stream) => stream.label === "flywheel").powers[k];
            }""",
            math.radians(degrees),
        )
        assert sense * value > 0.0
        written, unit = (reply.text_content() or "").replace("−", "-").split()
        assert float(written) * {"W": 1.0, "kW": 1e3}[unit] == pytest.approx(value, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    "example", ["machines/press.toml", "machines/pump.toml", "machines/shaper.toml", "machines/diagram.toml"]
)
def test_no_text_covers_another_or_leaves_its_figure_on_a_phone(drawn_figure: Callable[..., "Page"], example: str) -> None:
    page = drawn_figure(example, width=360, tongue="es")
    until(page, "() => document.documentElement.scrollWidth <= innerWidth")
    assert page.evaluate(_CLASHES) == []
    assert page.eval_on_selector_all("#panels svg", "all => all.every((each) => each.querySelector('title').textContent)")


@pytest.mark.slow
def test_files_stand_alone(drawn_figure: Callable[..., "Page"]) -> None:
    page = drawn_figure("exams/p103_1.toml", color_scheme="dark")
    for figure in page.evaluate("Object.keys(figures)"):
        svg = page.evaluate(f"new XMLSerializer().serializeToString(figures['{figure}'].svg())")
        assert "var(" not in svg
        assert 'fill="#ffffff"' in svg
        assert re.search(r"<title[^>]*>[^<]+</title>", svg)
        header, first = page.evaluate(f"figures['{figure}'].csv()").splitlines()[:2]
        assert header.startswith("crank angle [rad],")
        assert len(first.split(",")) == len(header.split(","))


@pytest.mark.slow
def test_the_page_shows_them_and_another_mechanism_can_be_chosen(
    opened: Callable[..., Any], window: Callable[..., Any]
) -> None:
    page = answered(shown(window().new_page(), opened("machines/pump.toml").address))
    select = page.locator("[data-panel=reactions] select")
    select.select_option("plunger2")
    answered(page)
    expected(select).to_have_value("plunger2")
    expected(page.locator("[role=slider]")).to_have_attribute("aria-valuenow", "0")


# Lengths and masses are typed, and motion and reactions of a body and a joint seen: a linkage and the injection clamp.


CASES = {  # a body, a joint of it, a length and a mass that are typed
    "linkages/six_bar.toml": ("jaw", "toggle", None, "mechanism.bodies.jaw.mass"),
    "machines/injection_clamp.toml": ("rod", "rod_pin", "mechanism.rod.length", "mechanism.rod.mass"),
}


def curve(page, title, before=None):
    """The curves of the motion, once their figure has a title and they are no longer those before."""
    page.locator('[data-panel="motion"]').scroll_into_view_if_needed()
    until(
        page,
        """([title, before]) => {
          const svg = document.querySelector('[data-panel="motion"] svg');
          return svg?.textContent.includes(title) && svg.textContent !== before;
        }""",
        [title, before],
    )
    answered(page)  # whose figures the last answer draws once more
    return page.locator('[data-panel="motion"] svg').first.text_content()


def typed(page, path, value):
    """Type a value into its field, in folds that are opened."""
    page.locator("#form details").evaluate_all("folds => folds.forEach((fold) => { fold.open = true; })")
    box = page.locator(f'[data-field="{path}"] input[type=text]')
    box.fill(value)
    box.press("Enter")


@pytest.mark.slow
@pytest.mark.parametrize("example", CASES)
def test_a_body_and_a_joint_are_chosen_and_follow_what_is_typed(opened, window, example):
    body, joint, length, mass = CASES[example]
    served = opened(example)
    page = drawn(shown(window().new_page(), served.address))
    page.locator("#view-kind").select_option("acceleration")
    page.locator("#view-of").select_option(body)
    accelerated = curve(page, f"Acceleration of {body}")
    if length:
        typed(page, length, "270 mm")
        curve(page, f"Acceleration of {body}", accelerated)
    page.locator("#view-kind").select_option("reaction")
    page.locator("#view-of").select_option(joint)
    reacting = curve(page, f"Reaction in {joint}")
    typed(page, mass, "3000 kg")
    assert curve(page, f"Reaction in {joint}", reacting)
    picture(page, f"motion-{body}", full_page=True)


# The rate of a press that works stroke by stroke, by mouse: its time axis follows, and nothing else moves.


STROKES = """
shafts.wheel = {ratio = 4, clutch = {torque = 120, disengage = "300 deg"}}
inertia = [{on = "crank", value = 5}]
load = [{on = "crank", torque = "-150 N m", from = "120 deg", to = "200 deg"}]
brake = [{torque = 400, engage = "310 deg"}]
drive = {on = "wheel", torque = "2*(40 - omega)"}
flywheel = {on = "wheel", inertia = 1.5}
[single_stroke]
rate = "20 1/min"
"""
STROKE_FRAMES = """() => {
  window.frames = [];
  const panel = document.querySelector("[data-panel=single_stroke]");
  const figures = document.getElementById("panels");
  const seen = () => {
    const svg = panel.querySelector("svg");
    return {
      most: Number(document.getElementById("angle-range").max),
      at: [figures.getBoundingClientRect().top, panel.getBoundingClientRect().left, panel.getBoundingClientRect().width],
      boxes: [...svg.querySelectorAll("rect[stroke]")].map((box) => box.getAttribute("x")),
    };
  };
  new MutationObserver(() => frames.push(seen())).observe(panel.querySelector("svg"), { childList: true });
  return seen();
}"""


@pytest.mark.slow
def test_the_rate_of_strokes_is_dragged_and_the_time_axis_follows(tmp_path, window):
    scene = tmp_path / "strokes.toml"
    scene.write_text(STROKES)
    with served(scene) as server:
        page = answered(shown(window(viewport={"width": 1280, "height": 1400}).new_page(), server.address))
        expected(page.locator("#angle-range")).to_have_attribute("max", "3")
        slider = field(page, "single_stroke.rate").locator("input[type=range]")
        slider.scroll_into_view_if_needed()
        box, share = slider.bounding_box(), slider.evaluate("one => (one.value - one.min) / (one.max - one.min)")
        x, y = box["x"] + 8 + share * (box["width"] - 16), box["y"] + box["height"] / 2
        before = page.evaluate(STROKE_FRAMES)
        page.mouse.move(x, y)
        page.mouse.down()
        for k in range(1, 9):
            page.mouse.move(x + 2 * k, y)
            until(page, f"() => frames.length >= {k}")  # it is drawn anew while the mouse is down
        frames = page.evaluate("frames")
        page.mouse.up()
        answered(page)
        most = float(page.locator("#angle-range").get_attribute("max"))
        rate = float(re.search(r"[\d.]+", becomes(page, r'^rate = "[\d.]+ 1/min"'))[0])
        assert rate > 22.0
        assert most == pytest.approx(60.0 / rate, rel=1e-6)
        assert len({round(frame["most"], 4) for frame in frames}) >= 8
        assert all(frame["most"] < 3.0 for frame in frames)
        assert {tuple(frame["at"]) for frame in frames} == {tuple(before["at"])}
        assert {tuple(frame["boxes"]) for frame in frames} == {tuple(before["boxes"])}
        picture(page, "strokes")
