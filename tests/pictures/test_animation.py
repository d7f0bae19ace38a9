"""The animation: as many frames as asked, the mechanism and the marker where they belong in each."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Polygon
from PIL import Image

import flywheel
from flywheel.numerics.faults import SceneError
from flywheel.pictures import mechanisms
from flywheel.pictures.sketch import views
from tests.limits import sample
from tests.pictures.test_sketch_views import CLAMP
from tests.scenes import press, rotor, shaper, yoke


@pytest.mark.slow
@pytest.mark.parametrize("scene", sample([press(), CLAMP], 2), ids=["press", "clamp"])
def test_a_gif_with_the_frames_asked_for(scene: dict[str, object], tmp_path: Path) -> None:
    path = tmp_path / "made.gif"
    mechanisms.animate(flywheel.load(scene), path, frames=3, fps=10)
    with Image.open(path) as image:
        assert image.format == "GIF"
        assert image.n_frames == 3  # type: ignore[attr-defined]
        assert image.info["duration"] == 100
        assert image.info["loop"] == 0
        assert image.size[0] == 880
        frames = []
        for k in range(3):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB"), dtype=int))
    assert all((one != other).any() for one, other in pairwise(frames))
    assert path.stat().st_size < 300_000


@pytest.mark.slow
@pytest.mark.parametrize("kind", sample(["clamp", "shaper"], 2))
def test_mechanism_and_marker_stand_where_the_machine_is(kind: str) -> None:
    scene = flywheel.load({"shaper": shaper(), "clamp": CLAMP}[kind])
    stage = mechanisms.stage(scene, 8)
    (view,) = views(scene)
    for k in (0, 3, 7):
        mechanisms.show(stage, k, scene)
        poses = view.poses([stage.q[k]])
        for shape, artist in stage.mechanisms[0].parts:
            if shape.kind == "pin" and isinstance(artist, Polygon):
                centre = artist.get_xy()[:-1].mean(axis=0)
                np.testing.assert_allclose(centre, 1000 * poses.point(*shape.at).value[:, 0], atol=2.0)
        ((x, y),) = stage.marker.get_xydata().tolist()  # type: ignore[union-attr]
        assert x == pytest.approx(1000 * stage.q[k] if kind == "clamp" else np.degrees(stage.q[k]))
        curve = stage.marker.axes.lines[0]  # type: ignore[union-attr]
        assert y == pytest.approx(np.interp(x, *np.asarray(curve.get_xydata()).T), rel=1e-6)
        assert ("x = " if kind == "clamp" else "φ = ") in stage.clock.get_text()


def test_a_law_beside_a_mechanism_is_named_as_left_out() -> None:
    feed = {"type": "law", "name": "feed", "outputs": {"out": {"x": "0.01*sin(phi)", "mass": 1}}}
    stage = mechanisms.stage(flywheel.load(press(mechanism=[press()["mechanism"], feed])), 2)
    assert stage.figure.get_suptitle() == "(not drawn: feed, a law without bodies)"
    assert len(stage.mechanisms) == 1


@pytest.mark.parametrize(
    ("frames", "fps", "name"), [(1, 20, "a.gif"), (601, 20, "a.gif"), (5, 0, "a.gif"), (5, 20, "a.png")]
)
def test_what_no_gif_can_be_is_refused(frames: int, fps: int, name: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"found .*, expected"):
        mechanisms.animate(flywheel.load(yoke()), tmp_path / name, frames=frames, fps=fps)


def test_a_rotor_alone_has_no_picture(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="expected a mechanism to draw"):
        mechanisms.animate(flywheel.load(rotor()), tmp_path / "a.gif")
