"""Lengths and masses are typed, and motion and reactions of a body and a joint seen: a linkage and the injection clamp."""

import pytest

from tests.page.browsers import answered, drawn, picture, shown, until

pytestmark = pytest.mark.slow

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
