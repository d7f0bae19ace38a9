"""The Sankey diagram of a power flow: its widths are what its labels say, so these must add up along the trunk."""

import numpy as np
import pytest

import flywheel
from flywheel.pictures import power_flow

PRESS = {
    "shafts": {
        "flywheel": {"ratio": 6, "efficiency": 0.97},
        "motor": {"on": "flywheel", "ratio": 4, "efficiency": 0.96},
    },
    "inertia": [{"on": "flywheel", "value": 0.4}, {"on": "motor", "value": 0.02}],
    "load": [{"on": "crank", "torque": "-900 N m", "from": "100 deg", "to": "160 deg"}],
    "drive": {"on": "motor", "torque": "balance"},
    "regime": {"speed": 8},
    "flywheel": {"on": "flywheel", "irregularity": 0.1},
}


@pytest.mark.parametrize("angle", [115.0, 130.0])
def test_the_trunk_carries_what_its_streams_bring_and_take(angle):
    """The crank has neither loss nor store of its own: what it carries is what its load takes."""
    flow = flywheel.size(flywheel.load(PRESS), simulate=False).power_flow
    load = next(k for k, stream in enumerate(flow.streams) if stream.kind == "load")
    picture = power_flow.draw(flow, np.radians(angle))
    labels = [text.get_text().split("\n") for text in picture.axes[0].texts]
    value, unit = next(label[1] for label in labels if label[0] == "crank").split()
    assert unit == "kW"
    assert 1000 * float(value) == pytest.approx(flow.at(np.radians(angle))[load], rel=6e-3)
