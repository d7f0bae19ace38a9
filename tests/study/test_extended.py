"""The reference of comparisons, against figures computed at 30 digits apart from this package."""

import json
from pathlib import Path

import numpy as np
import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.study import reference
from tests.limits import sample

FOLDER = Path(__file__).parents[1] / "references"
REFERENCES = {entry["scene"]: entry for entry in json.loads((FOLDER / "references.json").read_text()) if "balance" in entry}
HALF_A_DIGIT = 2e-15
WIDE = {"press-narrow.toml": 1e-11}  # eps is so small there that rounding of angles matters


@pytest.mark.parametrize("name", sample(REFERENCES, 12))
def test_the_true_figure_is_within_the_doubt(name):
    true = REFERENCES[name]
    machine = Machine(flywheel.load(FOLDER / "scenes" / name))
    scene, crank = machine.scene, machine.scene.flywheel_ratio**2
    if scene.irregularity is not None:
        value, doubt = (part / crank for part in reference.flywheel_inertia(machine))
        wanted, scale = float(true["flywheel"]["exact"]), float(true["flywheel"]["approximate_total"])
        value = max(value, 0.0)
    else:
        value, doubt = reference.irregularity(machine, (scene.inertia or 0.0) * crank)
        wanted, scale = float(true["simulation"]["irregularity"]), 0.0
    scale = max(abs(wanted), scale)
    assert abs(value - wanted) <= doubt + HALF_A_DIGIT * scale
    assert doubt <= WIDE.get(name, 1e-13) * scale


def test_gauss_is_exact_for_polynomials():
    powers = np.arange(48, dtype=np.longdouble)
    integrals = reference._WEIGHTS @ reference._NODES[:, None] ** powers
    wanted = np.where(powers % 2 == 0, 2 / (powers + 1), 0)
    assert np.abs(integrals - wanted).max() <= 8 * np.finfo(np.longdouble).eps
