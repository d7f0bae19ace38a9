"""What `import flywheel` brings, and what it costs."""

import subprocess
import sys

import pytest

import flywheel

PARTS = (
    *("arm", "energy", "every_shaft", "gearing", "kinetostatics", "load_models", "masses", "motors"),
    *("multibody", "presses", "recovery", "transients", "two_speeds", "wheel"),
)


def test_parts_of_the_library_need_no_import_of_their_own():
    code = f"import flywheel; print(*(getattr(flywheel, name).__name__ for name in {PARTS}))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert found == [f"flywheel.{name}" for name in PARTS]


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


def test_load_models_bring_their_modules():
    code = "import flywheel; m = flywheel.load_models; print(*(getattr(m, name).__name__ for name in dir(m)))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "flywheel.load_models.presses" in found
    assert len(found) == 5
    with pytest.raises(AttributeError, match="no attribute 'steam'"):
        _ = flywheel.load_models.steam
