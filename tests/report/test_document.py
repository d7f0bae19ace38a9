"""A document tells where each number comes from, and its substitutions give the results that it shows."""

from html.parser import HTMLParser

import pytest

from flywheel.report.document import (
    Document,
    Figure,
    Formula,
    Items,
    Note,
    Quantity,
    Section,
    Step,
    Table,
    html,
    inline_svg,
    substitution,
    unreproduced,
    untraced,
)

GREATEST, LEAST = Quantity("W_max", 25.550982911183, "J"), Quantity("W_min", -525.55098291118, "J")
TABLE = Table("Works", ("what", "symbol", "work, J"), (("greatest", Formula("W_max"), GREATEST), ("least", "", LEAST)))
STEP = Step("Fluctuation", "DeltaW = W_max - W_min", (GREATEST, LEAST), Quantity("DeltaW", 551.10196582237, "J"))


def document(*parts):
    return Document("A <title>", "", (Section("One", parts),))


def test_a_number_that_nothing_gave_is_told():
    assert untraced(document(TABLE, STEP)) == []
    assert untraced(document(STEP, TABLE)) == ["Fluctuation: W_max", "Fluctuation: W_min"]


def test_a_result_that_its_numbers_do_not_give_is_told():
    wrong = Step("Fluctuation", STEP.formula, STEP.numbers, Quantity("DeltaW", 551.103, "J"))
    assert unreproduced(document(TABLE, STEP)) == []
    assert unreproduced(document(TABLE, wrong)) == ["Fluctuation"]
    assert "do not suffice" in html(document(TABLE, wrong))


def test_differences_have_the_digits_that_they_need():
    near = Step("d", "d = a - b", (Quantity("a", 1234.56789), Quantity("b", 1234.5)), Quantity("d", 0.06789))
    assert [number.written for number in substitution(near)] == ["1234.56789", "1234.5"]


class _Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.headings, self.open = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if "id" in given:
            self.ids.append(given["id"])
        if tag == "a":
            self.links.append(given["href"].removeprefix("#"))
        if tag in ("h1", "h2", "h3", "h4"):
            self.headings.append(int(tag[1]))


def test_a_page_has_ids_of_its_own_links_that_lead_somewhere_and_headings_in_order():
    drawn = '<svg width="2" height="1"><path id="a"/><use xlink:href="#a"/></svg>'
    inner = Section("Two", (Figure(drawn, "A", "B"), Figure(lambda: drawn, "C", "D"), Items(("x",))))
    page = _Page(html(document(TABLE, STEP, Note("text & more", "remark"), inner)))
    assert len(set(page.ids)) == len(page.ids)
    assert set(page.links) <= set(page.ids)
    assert page.headings == [1, 2, 3]
    assert page.links.count("table-1") == 2


def test_texts_are_no_markup():
    page = html(document(Table("<b>", ("<i>",), (("<script>",),)), Step("<u>", result=Quantity("x", 1.0))))
    assert "<script>" not in page
    assert "<b>" not in page
    assert "A &lt;title&gt;" in page


def test_two_drawings_share_no_id():
    drawn = '<svg viewBox="0 0 1 1"><clipPath id="c"/><g id="loose" clip-path="url(#c)"/></svg>'
    first, second = (inline_svg(drawn, name, "t", "d") for name in ("one", "two"))
    assert 'id="one-1"' in first
    assert "url(#two-1)" in second
    assert "loose" not in first


@pytest.mark.parametrize(("unit", "told"), [("kg m²", "lb ft²"), ("W", "hp"), ("", "(3 lb")])
def test_results_have_us_units_beside(unit, told):
    page = html(Document("T", "", (Step("s", result=Quantity("x", 2.0, unit)),), customary=True))
    assert (told in page) == bool(unit)
