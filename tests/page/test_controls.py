"""Every control of the page by mouse and by keyboard, on a copy of the press."""

import csv
import io
import re
from contextlib import contextmanager
from xml.etree import ElementTree

import pytest

from tests.page.browsers import answered, drawn, expected, in_sight, picture, until

LENGTH = "mechanism.crank.length"


def field(page, path):
    return page.locator(f'[data-field="{path}"]')


def becomes(page, expected):
    """Wait until the scene's text has a line that matches; the line."""
    page.keyboard.press("Alt+2")
    for _ in range(600):
        found = re.search(expected, page.locator("#text").input_value(), re.MULTILINE)
        if found:
            page.keyboard.press("Alt+1")
            return found[0]
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


pytestmark = pytest.mark.slow


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


def test_a_slider_by_arrow_keys_is_one_step_back(page):
    answered(page)
    before = page.locator("#numbers").inner_text()
    slider = field(page, LENGTH).locator("input[type=range]")
    slider.focus()
    with answers_held(page):  # to draw one between two keys takes longer than a step's pause on a slow machine
        for _ in range(5):
            page.keyboard.press("ArrowRight")
    found = float(re.search(r'"([\d.]+) mm"', becomes(page, r'^crank\.length = "(?!80 mm).*'))[1])
    assert found > 80
    answered(page)
    assert page.locator("#numbers").inner_text() != before
    page.click("#undo")
    becomes(page, r'^crank\.length = "80 mm"')
    page.locator("#undo:disabled").wait_for()


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


def test_a_unit_is_chosen_and_the_length_stays(page):
    answered(page)
    before = page.locator("#numbers").inner_text()
    unit = field(page, LENGTH).locator("select.unit")
    unit.focus()
    unit.select_option("in")
    becomes(page, r'^crank\.length = "3\.1496\d* in"')
    answered(page)
    assert page.locator("#numbers").inner_text().split("exact")[1][:20] == before.split("exact")[1][:20]


def test_a_choice_gives_another_mechanism_or_tells_what_it_lacks(page):
    drawn(page)
    field(page, "mechanism.type").locator("select").select_option("scotch-yoke")
    page.locator("#faults li").first.wait_for()
    page.click("#undo")
    answered(page)
    expected(page.locator("#faults li.fault")).to_have_count(0)


def test_a_key_is_added_and_taken_away(page):
    drawn(page)
    foot = page.locator('[data-path="flywheel"] .foot').first
    options = foot.locator("select option").evaluate_all("options => options.map((option) => option.value)")
    foot.locator("select").select_option(next(filter(None, options)))
    foot.get_by_role("button", name="Add").click()
    page.locator("#undo:not(:disabled)").wait_for()
    page.keyboard.press("Control+z")
    page.locator("#undo:disabled").wait_for()


def test_help_of_a_field_opens(page):
    drawn(page)
    help_of = field(page, LENGTH).get_by_role("button", name=re.compile("^Help on"))
    help_of.focus()
    page.keyboard.press("Enter")
    expected(help_of).to_have_attribute("aria-expanded", "true")
    expected(field(page, LENGTH).locator(".about")).to_contain_text(LENGTH)


def test_the_text_is_edited_and_the_form_follows(page):
    drawn(page)
    page.keyboard.press("Alt+2")
    area = page.locator("#text")
    expected(area).to_be_focused()
    area.fill(area.input_value().replace('"80 mm"', '"85 mm"'))
    page.keyboard.press("Alt+1")
    answered(page)
    expected(field(page, LENGTH).locator("input[type=text]")).to_have_value("85")


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


def test_the_crank_is_dragged(page):
    answered(page)
    x, y, radius = crank_in_hand(page)
    for part in (0.2, 0.4, 0.6, 0.8, 1.0):
        page.mouse.move(x - radius * part * 0.4, y - radius * part * 0.8, steps=4)
    page.mouse.up()
    until(page, lambda: 40 < float(page.locator("#angle").input_value()) < 120)


def test_a_crank_in_hand_stays_there_when_an_answer_comes(page):
    """The answer that a run in time confirms comes whenever it comes: the figures are drawn anew under the hand."""
    answered(page)
    with answers_held(page) as asked:
        field(page, LENGTH).locator("input[type=range]").press("ArrowRight")
        until(page, lambda: asked)
        x, y, radius = crank_in_hand(page)
        page.mouse.move(x - radius * 0.1, y - radius * 0.2, steps=4)
        until(page, lambda: 5 < float(page.locator("#angle").input_value()) < 40)
    answered(page)
    page.mouse.move(x - radius * 0.4, y - radius * 0.8, steps=8)
    page.mouse.up()
    until(page, lambda: 40 < float(page.locator("#angle").input_value()) < 120)


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


def test_what_of_the_motion_is_shown(page):
    answered(page)
    page.locator('[data-panel="motion"]').scroll_into_view_if_needed()
    for kind in ("position", "acceleration", "reaction"):
        page.locator("#view-kind").select_option(kind)
        page.locator('[data-panel="motion"] svg', has_text=kind.capitalize()).first.wait_for(state="attached")
    until(page, lambda: page.locator("#view-of option").count() >= 3)


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
    picture(page, "dark-us", full_page=True)


def test_help_opens_by_key_and_closes_by_escape(page):
    drawn(page)
    page.locator("#help").focus()
    page.keyboard.press("F1")
    page.get_by_role("dialog", name="Help").wait_for()
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="detached")
    expected(page.locator("#help")).to_be_focused()


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


@pytest.mark.parametrize("tongue", ["en", "es"])
def test_the_report_is_downloaded(page, tongue):
    report = _report(page, "html", tongue).decode()
    assert f'<html lang="{tongue}"' in report
    assert "<math" in report


def test_the_report_is_downloaded_as_pdf(page):
    assert _report(page, "pdf", "en").startswith(b"%PDF-")


def test_one_page_to_sign_is_downloaded(page):
    sheet = _report(page, "html", "en", "summary").decode()
    assert "Data sheet of the drive" in sheet
    assert "Designed by" in sheet
    assert "<math" not in sheet


def _report(page, kind, tongue, pages="all"):
    drawn(page)
    page.click("#report")
    dialog = page.get_by_role("dialog")
    dialog.locator(f'input[name="pages"][value="{pages}"]').check()
    dialog.locator(f'input[name="format"][value="{kind}"]').check()
    dialog.locator(f'input[name="tongue"][value="{tongue}"]').check()
    with page.expect_download(timeout=300_000) as coming:
        dialog.get_by_role("button", name="Download").click()
    assert coming.value.suggested_filename == f"press{'-sheet' if pages == 'summary' else ''}.{kind}"
    return coming.value.path().read_bytes()


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
