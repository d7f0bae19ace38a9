import math

import pytest

from bondgraph import GraphError
from bondgraph.laws import refuse, size_faults


def test_all_faults_are_raised_together():
    with pytest.raises(GraphError) as caught:
        refuse(f"fault {k}" for k in range(2))
    assert str(caught.value) == "fault 0\nfault 1"


def test_nothing_is_raised_without_faults():
    refuse(())


@pytest.mark.parametrize("value", [0.0, -1.0, math.inf, math.nan])
def test_sizes_are_finite_and_above_0(value):
    assert size_faults([("r", 1.0), ("m", value)]) == [f"m: found {value}, expected a number above 0"]
