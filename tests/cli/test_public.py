"""What `import flywheel` brings, and what it costs."""

import subprocess
import sys
from importlib import import_module

import pytest

import flywheel

PARTS = (
    *("arm", "energy", "every_shaft", "gearing", "kinetostatics", "load_models", "masses", "motors"),
    *("multibody", "presses", "recovery", "transients", "two_speeds", "wheel"),
)


def test_parts_of_the_library_need_no_import_of_their_own():
    code = f"import flywheel; print(*(getattr(flywheel, name).__name__ for name in {PARTS}))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert found == [import_module(f"flywheel.{name}").__name__ for name in PARTS]


def test_the_import_itself_is_free():
    code = "import sys; before = set(sys.modules); import flywheel; print(*sorted(set(sys.modules) - before))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert [name for name in found if name.startswith("flywheel.")] == []
    assert not {"numpy", "scipy", "sympy", "matplotlib"} & set(found)


def test_every_name_is_listed_and_there():
    assert set(dir(flywheel)) == set(flywheel.__all__) >= set(PARTS)
    assert all(hasattr(flywheel, name) for name in flywheel.__all__)
    with pytest.raises(AttributeError, match="no attribute 'wheels'"):
        _ = flywheel.wheels


def test_parts_are_imported_under_their_public_names():
    """As the README and the examples name them; the same module under each name, never a second copy of it."""
    from flywheel.linkage.solution import solve
    from flywheel.load_models.gas import piston_area
    from flywheel.wheel import choose

    assert solve is import_module("flywheel.mechanisms.linkages.positions").solve
    assert piston_area is import_module("flywheel.components.gas_forces").piston_area
    assert choose is flywheel.wheel.choose
    with pytest.raises(ModuleNotFoundError):
        import_module("flywheel.wheels")
