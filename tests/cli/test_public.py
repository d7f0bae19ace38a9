"""What `import flywheel` brings, and what it costs."""

from importlib import import_module

import pytest

import flywheel

PARTS = (
    *("arm", "energy", "every_shaft", "gearing", "kinetostatics", "load_models", "masses", "motors"),
    *("multibody", "presses", "recovery", "transients", "two_speeds", "wheel"),
)


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
