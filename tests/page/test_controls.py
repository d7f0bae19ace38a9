"""Every control of the page by mouse and by keyboard, on a copy of the press."""

import csv
import io
import re
from xml.etree import ElementTree

import pytest

from tests.page.browsers import answered, drawn, picture, until

LENGTH = "mechanism.crank.length"


def text_of(page):
    page.keyboard.press("Alt+2")
    written = page.locator("#text").input_value()
    page.keyboard.press("Alt+1")
    return written


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


def test_the_page_shows_the_scene_and_its_answer(page):
    answered(page)
    picture(page, "press", full_page=True)
    assert page.locator("#title").text_content() == "Blanking press, flywheel on the eccentric shaft"
    assert "344.84" in page.locator("#numbers").inner_text()
    assert "confirmed" in page.locator("#state").inner_text().lower()
    assert page.locator(".panel").count() >= 7
    assert all(page.locator(".panel svg").nth(k).is_visible() for k in range(page.locator(".panel svg").count()))
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
    assert box.get_attribute("aria-invalid") == "true"
    assert page.locator("#results.old").count() == 1
    page.locator("#faults button.lead").first.click()
    assert box.evaluate("box => box === document.activeElement")
    page.click("#as-text")
    assert page.locator("#editor .mark.fault").count() == 1
    picture(page, "fault-text")
    page.locator("#faults button.lead").first.click()
    assert page.locator("#text").evaluate("area => area === document.activeElement && area.selectionStart > 0")


def test_a_slider_by_arrow_keys_is_one_step_back(page):
    drawn(page)
    before = page.locator("#numbers").inner_text()
    slider = field(page, LENGTH).locator("input[type=range]")
    slider.focus()
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
    drawn(page)
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
    drawn(page)
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
    assert page.locator("#faults li.fault").count() == 0


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
    assert help_of.get_attribute("aria-expanded") == "true"
    assert LENGTH in field(page, LENGTH).locator(".about").inner_text()


def test_the_text_is_edited_and_the_form_follows(page):
    drawn(page)
    page.keyboard.press("Alt+2")
    area = page.locator("#text")
    assert area.evaluate("area => area === document.activeElement")
    area.fill(area.input_value().replace('"80 mm"', '"85 mm"'))
    page.keyboard.press("Alt+1")
    answered(page)
    assert field(page, LENGTH).locator("input[type=text]").input_value() == "85"


def test_one_cursor_through_all_figures(page):
    drawn(page)
    angle = page.locator("#angle-range")
    angle.focus()
    page.keyboard.press("ArrowRight")
    assert page.locator("#angle").input_value() == "0.5"
    page.locator("#angle").fill("90")
    page.locator("#angle").press("Enter")
    crank = page.get_by_role("slider", name=re.compile("^Crank angle: drag"))
    assert float(crank.get_attribute("aria-valuenow")) == pytest.approx(90)
    crank.focus()
    page.keyboard.press("ArrowRight")
    assert page.locator("#angle").input_value() == "91"
    page.keyboard.press("End")
    page.keyboard.press("Home")
    assert page.locator("#angle").input_value() == "0"
    moment = page.locator('[data-panel="moment"] svg')
    moment.scroll_into_view_if_needed()
    box = moment.bounding_box()
    moment.click(position={"x": box["width"] / 2, "y": box["height"] / 3})
    assert 100 < float(page.locator("#angle").input_value()) < 260
    picture(page, "cursor", full_page=True)


def test_the_crank_is_dragged(page):
    drawn(page)
    drawing = page.locator('[data-panel="mechanism"] svg').first
    drawing.scroll_into_view_if_needed()
    pin = page.locator('[data-panel="mechanism"] svg text', has_text="crank_pin").first.bounding_box()
    pivot = page.locator('[data-panel="mechanism"] svg text', has_text="pivot").first.bounding_box()
    start = (pin["x"] + pin["width"] / 2, pin["y"] + 24)
    radius = start[0] - pivot["x"] - pivot["width"] / 2
    page.mouse.move(start[0] - 4, start[1])
    page.mouse.down()
    for part in (0.2, 0.4, 0.6, 0.8, 1.0):
        page.mouse.move(start[0] - radius * part * 0.4, start[1] - radius * part * 0.8, steps=4)
    page.mouse.up()
    assert 20 < float(page.locator("#angle").input_value()) < 120


def test_play_and_pause(page):
    drawn(page)
    page.locator("#pace").select_option("4")
    page.locator("#play").focus()
    page.keyboard.press("Enter")
    page.locator("#play[aria-pressed=true]").wait_for()
    until(page, "() => document.getElementById('angle-range').valueAsNumber > 0")
    page.keyboard.press("Control+Enter")
    page.locator("#play[aria-pressed=false]").wait_for()
    assert float(page.locator("#angle").input_value()) > 0


def test_panels_are_chosen_and_remembered(page):
    drawn(page)
    page.locator("#chooser summary").focus()
    page.keyboard.press("Enter")
    boxes = page.locator("#choice input")
    assert boxes.count() >= 7
    boxes.nth(1).focus()
    page.keyboard.press("Space")
    page.locator('[data-panel="moment"]').wait_for(state="detached")
    page.reload()
    answered(page)
    assert page.locator('[data-panel="moment"]').count() == 0
    page.locator("#chooser summary").click()
    page.locator("#choice input").nth(1).click()
    page.locator('[data-panel="moment"]').wait_for()


def test_figures_out_of_sight_wait_until_they_are_seen_or_the_hand_rests(page):
    answered(page)

    def quick_alone(route):
        if not route.request.post_data_json["rest"]:
            route.continue_()

    page.route("**/api/answer", quick_alone)
    slider = field(page, LENGTH).locator("input[type=range]")
    slider.focus()
    page.keyboard.press("ArrowRight")
    waiting = page.locator(".panel.old")
    waiting.first.wait_for(state="attached")
    assert page.locator('[data-panel="mechanism"].old').count() == 0
    assert page.locator('[data-panel="motion"].old').get_attribute("aria-busy") == "true"
    page.locator('[data-panel="motion"]').scroll_into_view_if_needed()
    page.locator('[data-panel="motion"]:not(.old)').wait_for()
    page.unroute("**/api/answer")
    slider.focus()
    page.keyboard.press("ArrowRight")
    answered(page)
    assert waiting.count() == 0


def test_what_of_the_motion_is_shown(page):
    drawn(page)
    page.locator('[data-panel="motion"]').scroll_into_view_if_needed()
    for kind in ("position", "acceleration", "reaction"):
        page.locator("#view-kind").select_option(kind)
        page.locator('[data-panel="motion"] svg', has_text=kind.capitalize()).first.wait_for(state="attached")
    joints = page.locator("#view-of option")
    assert joints.count() >= 3


def test_each_figure_is_had_as_svg_png_and_csv(page):
    drawn(page)
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
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == paper
    assert "lb ft²" in page.locator("#numbers").inner_text()
    picture(page, "dark-us", full_page=True)


def test_help_opens_by_key_and_closes_by_escape(page):
    drawn(page)
    page.locator("#help").focus()
    page.keyboard.press("F1")
    page.get_by_role("dialog", name="Help").wait_for()
    page.keyboard.press("Escape")
    page.get_by_role("dialog").wait_for(state="detached")
    assert page.locator("#help").evaluate("button => button === document.activeElement")


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


def _report(page, kind, tongue):
    drawn(page)
    page.click("#report")
    dialog = page.get_by_role("dialog")
    dialog.locator(f'input[name="format"][value="{kind}"]').check()
    dialog.locator(f'input[name="tongue"][value="{tongue}"]').check()
    with page.expect_download(timeout=300_000) as coming:
        dialog.get_by_role("button", name="Download").click()
    assert coming.value.suggested_filename == f"press.{kind}"
    return coming.value.path().read_bytes()


def test_the_keyboard_reaches_every_control_in_their_order(page):
    drawn(page)
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
