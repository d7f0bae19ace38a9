"""The drawings of the page in a browser: dragged, pointed at, moved by keys; complete at 360 px; files that stand alone."""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import flywheel
from flywheel import language
from flywheel.page import data
from tests.page.browsers import answered, expected, shown, until

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
def drawn(window: Callable[..., Any]) -> Callable[..., "Page"]:
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
def test_a_crank_that_is_dragged_takes_the_cursor_along_in_every_figure(drawn: Callable[..., "Page"]) -> None:
    page = drawn("machines/press.toml")
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
        told = next(float(words.rstrip(" °")) for words in readout(page, figure) if words.endswith("°"))
        assert told == pytest.approx(angle, abs=0.1)


@pytest.mark.slow
def test_keys_turn_the_crank_and_both_values_of_a_jump_are_told(drawn: Callable[..., "Page"]) -> None:
    page = drawn("machines/press.toml")
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
def test_a_curve_that_is_pointed_at_moves_the_mechanism(drawn: Callable[..., "Page"]) -> None:
    page = drawn("machines/injection_clamp.toml")
    curve = page.locator("[data-figure=motion] svg")
    box = curve.bounding_box()
    assert box is not None
    curve.click(position={"x": box["width"] - 3.0, "y": box["height"] / 2})
    expected(page.locator("[role=slider]")).to_have_attribute("aria-valuetext", "190.0 mm")


@pytest.mark.slow
def test_bands_of_power_lead_out_or_back_as_it_flows_at_the_cursor(drawn: Callable[..., "Page"]) -> None:
    page = drawn("machines/press.toml")
    told = page.locator("[data-figure=power_flow] svg text", has_text="flywheel").locator("xpath=following-sibling::*[1]")
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
        written, unit = (told.text_content() or "").replace("−", "-").split()
        assert float(written) * {"W": 1.0, "kW": 1e3}[unit] == pytest.approx(value, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    "example", ["machines/press.toml", "machines/pump.toml", "machines/shaper.toml", "machines/diagram.toml"]
)
def test_no_text_covers_another_or_leaves_its_figure_on_a_phone(drawn: Callable[..., "Page"], example: str) -> None:
    page = drawn(example, width=360, tongue="es")
    until(page, "() => document.documentElement.scrollWidth <= innerWidth")
    assert page.evaluate(_CLASHES) == []
    assert page.eval_on_selector_all("#panels svg", "all => all.every((each) => each.querySelector('title').textContent)")


@pytest.mark.slow
def test_files_stand_alone(drawn: Callable[..., "Page"]) -> None:
    page = drawn("exams/p103_1.toml", color_scheme="dark")
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
