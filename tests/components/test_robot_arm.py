"""What the package offers, and when sympy is imported."""

from __future__ import annotations

import pytest

from flywheel.components import robot_arm


def test_every_name_is_there():
    assert all(hasattr(robot_arm, name) for name in robot_arm.__all__)
    with pytest.raises(AttributeError, match="no attribute 'three_links'"):
        robot_arm.three_links  # noqa: B018
