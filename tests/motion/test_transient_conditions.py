import pytest

from flywheel import SceneError
from flywheel.motion.transients import Until, until
from flywheel.scene.scene import TURN


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("5 s", Until("time", 5.0)),
        ("2 min", Until("time", 120.0)),
        ("10 turns", Until("way", 10 * TURN)),
        ("1 turn", Until("way", TURN)),
        ("90 deg", Until("way", TURN / 4)),
        ("30 rpm", Until("speed", TURN / 2)),
        ("0.3 m/s", Until("speed", 0.3)),
        ("95 %", Until("share", 0.95)),
        ("regime", Until("regime")),
        (" stop ", Until("stop")),
    ],
)
def test_every_kind_of_end(text, expected):
    found = until(text)
    assert (found.kind, found.value) == (expected.kind, pytest.approx(expected.value, rel=1e-15))


@pytest.mark.parametrize(
    "text", ["", "5", "-5 s", "0 s", "five turns", "- turns", "1e999 turns", "e %", "3 kg", "soon", "nan s"]
)
def test_what_is_no_end_is_a_fault(text):
    with pytest.raises(SceneError, match="until"):
        until(text)
