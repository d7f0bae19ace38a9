"""Libraries that are optional: a test that needs one is skipped without it, and fails where .ci/run asks for all of them."""

import importlib
import os
from types import ModuleType

import pytest

REQUIRED = "FLYWHEEL_EXTRA_TESTS"


def extra(name: str) -> ModuleType:
    """A library, or a test that is skipped, or fails where it is required."""
    try:
        return importlib.import_module(name)
    except ImportError:
        if os.environ.get(REQUIRED):
            pytest.fail(f"not tested, as {name} is not installed", pytrace=False)
        pytest.skip(f"{name} is not installed", allow_module_level=True)
