"""What the package offers, and when sympy is imported."""

from __future__ import annotations

import subprocess
import sys

import pytest

from flywheel.components import robot_arm


def test_every_name_is_there():
    assert all(hasattr(robot_arm, name) for name in robot_arm.__all__)
    with pytest.raises(AttributeError, match="no attribute 'three_links'"):
        robot_arm.three_links  # noqa: B018


def test_only_the_symbols_import_sympy():
    code = "import sys, flywheel.arm as a; f = lambda: print('sympy' in sys.modules); f(); a.lagrange_equations; f()"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["False", "True"]
