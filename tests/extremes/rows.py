"""One row of the page of results: what was tried, how wrong the worst answer was, and what the program said of itself."""

from typing import NamedTuple


class Row(NamedTuple):
    """One extreme.

    extreme: what is extreme, in a few words. range: what was tried. error: the worst true error, relative to the larger of
    the figure and its scale; None where the answer is a refusal. estimate: the error the program itself stated there;
    None where it states none. remark: what the reference is, or the words of the refusal.
    """

    extreme: str
    range: str
    error: float | None
    estimate: float | None
    remark: str = ""
