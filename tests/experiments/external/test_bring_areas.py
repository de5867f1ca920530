"""Pixels that are averages over their areas: judged so if asked, told so if not, unless something is wrong."""

from __future__ import annotations

import numpy as np
import pytest
from brought import ROOM, judged

from nusselt.experiments.external import comparison
from nusselt.experiments.external.diagnosis.diagnose import Diagnosis
from nusselt.experiments.independent.render import Options
from nusselt.experiments.independent.render import render as render_apart
from nusselt.experiments.studies.brought_images import scene_named, text_of
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render

RAYS = 16
MARGIN = 0.03
TOLD = "your pixels are areas: --pixel-rule area"


@pytest.fixture(autouse=True)
def undiagnosed(monkeypatch):
    monkeypatch.setattr(comparison, "diagnose", lambda *_: Diagnosis(()))


def jittered(seed: int) -> np.ndarray:
    """A path tracer's: every sample has a camera ray of its own, anywhere in the pixel."""
    return render(ROOM.with_(spp=RAYS), Area(samples=1), seed=seed).mean.transpose(1, 2, 0)


def darkened(image: np.ndarray) -> np.ndarray:
    """Surfaces a tenth too dark; lights right."""
    return np.where(image < 1.5, 0.9 * image, image)


@pytest.mark.parametrize("count", [1, 2])
def test_jittered_images_by_area(count):
    images = [jittered(k) for k in range(count)]
    asked = {"samples": RAYS, "margin": MARGIN, "pixel_rule": "area"}
    row = judged(ROOM, images, **asked)
    assert row["verdict"] == "agrees", row["reason"]
    assert "by area" in row["reference"]["notes"][0]
    assert any("pixels are areas" in note for note in row["warnings"])
    assert judged(ROOM, [darkened(image) for image in images], **asked)["verdict"] == "differs"


@pytest.mark.parametrize("count", [2])
def test_jittered_images_that_were_taken_for_centres(count):
    images = [jittered(k) for k in range(count)]
    row = judged(ROOM, images, samples=RAYS, margin=MARGIN)
    assert row["verdict"] == "undecided"
    assert row["as_claimed"] is None
    assert row["reason"].startswith(TOLD)
    row = judged(ROOM, [darkened(image) for image in images], samples=RAYS, margin=MARGIN)
    assert row["verdict"] == "differs"
    assert TOLD not in row["reason"]


def test_a_sliver_between_the_centres_is_no_mistake():
    """A light's corner that reaches into a pixel of the background, with no edge of centres beside it."""
    images = [render_apart(text_of("quad-stratified"), 64, Options(16, jittered=True, seed=seed)) for seed in (1, 2)]
    row = judged(scene_named("quad-stratified", 64), images, samples=16, margin=MARGIN)
    assert row["verdict"] == "undecided"
    assert row["reason"].startswith(TOLD)


@pytest.mark.parametrize("corner", [(0, 1), (1, 1)])
def test_a_camera_that_is_off_is_not_told_to_be_areas(corner):
    """Rays a quarter of a pixel off: pixels at edges differ, as an average's do."""
    fine = ROOM.with_(width=2 * ROOM.width, height=2 * ROOM.height)
    row_, column = corner
    image = render(fine, Area(samples=RAYS), seed=1).mean[:, row_::2, column::2].transpose(1, 2, 0)
    row = judged(ROOM, [image], samples=RAYS, margin=MARGIN)
    assert row["verdict"] == "differs"
    assert TOLD not in row["reason"]


def test_a_scene_that_says_so_itself():
    made = ROOM.with_(spp=4, light_samples=4)
    images = [render(made, Area(samples=4), seed=k).mean.transpose(1, 2, 0) for k in (1, 2)]
    assert judged(made, images, margin=0.1)["verdict"] == "agrees"
    wrong = [np.where(image < 1.5, 0.7 * image, image) for image in images]
    assert judged(made, wrong, margin=0.1)["verdict"] == "differs"
