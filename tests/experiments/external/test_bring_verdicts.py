"""Right images are not told to differ, whatever the chance of their noise; the wrong one beside each is."""

from __future__ import annotations

import numpy as np
import pytest
from brought import BALL, ROOM, honest, judged
from builders import floor, lamp, scene
from test_bring_programs import run

from nusselt.experiments.external import comparison
from nusselt.experiments.external.diagnosis.diagnose import Diagnosis
from nusselt.experiments.results.compare import compare_rows
from nusselt.experiments.scenes.catalogue import load
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import PointLight

SEEDS = 3
"""Right images judged at alpha = 0.001 each: at these fixed seeds none is told to differ. When noise was seen and not
known, half of the single ones were, and 5 of 12 pairs of half floats."""


@pytest.fixture
def undiagnosed(monkeypatch):
    """What an image looks like takes seconds, and is not asked."""
    monkeypatch.setattr(comparison, "diagnose", lambda *_: Diagnosis(()))


@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.parametrize("stratified", [True, False])
@pytest.mark.parametrize("kind", [np.float32, np.float16])
@pytest.mark.parametrize("count", [1, 2])
def test_right_images_with_penumbrae_do_not_differ(kind, count, stratified):
    for seed in range(SEEDS):
        images = [honest(ROOM, 10 * seed + k, 4, stratified).astype(kind) for k in range(count)]
        row = judged(ROOM, images, samples=4, stratified=stratified)
        assert row["verdict"] != "differs", row["reason"]


@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.parametrize("count", [1, 2])
def test_few_wrong_pixels_in_the_same_images_differ(count):
    """Three dead pixels in the lit floor; a mean does not see them at a margin of 1 %."""
    images = [honest(ROOM, k) for k in range(count)]
    lit = np.argwhere(images[0].min(axis=2) > 0.9 * np.median(images[0][images[0] > 0]))
    for image in images:
        image[tuple(lit[[5, 60, 90]].T)] = 0.0
    assert judged(ROOM, images, margin=0.01)["verdict"] == "differs"


def test_the_same_image_twice_is_one_and_said():
    image = honest(ROOM, 1)
    row, alone = judged(ROOM, [image, image], margin=0.02), judged(ROOM, [image], margin=0.02)
    assert row["verdict"] == alone["verdict"] != "differs"
    assert row["bias_interval"] == alone["bias_interval"]
    assert any("does not use the seed" in note for note in row["warnings"])
    assert not any("does not use the seed" in note for note in alone["warnings"])
    assert "correlated-seeds" not in [mistake["name"] for mistake in row["likely_mistakes"]]


@pytest.mark.usefixtures("undiagnosed")
def test_the_noise_of_images_is_said_and_counts_where_it_is_asked():
    """A quarter and four times the samples, and one image twice, all right in the mean; the expected one is claimed."""
    word_of = {16: "as expected", 4: "noisier", 64: "quieter"}
    for samples, word in word_of.items():
        images = [honest(ROOM, seed, samples) for seed in (1, 2)]
        row = judged(ROOM, images, margin=0.1, noise="expected", samples=16, stratified=True)
        assert (row["verdict"], row["noise_word"]) == ("agrees", word), row["reason"]
        assert row["as_claimed"] is (samples == 16)
    image = honest(ROOM, 1)
    row = judged(ROOM, [image, image], margin=0.1)
    assert (row["verdict"], row["noise_word"], row["as_claimed"]) == ("agrees", "alike", True)


@pytest.mark.usefixtures("undiagnosed")
def test_pixels_that_share_noise_are_told_alike():
    """Neighbours of a right image averaged in pairs, of two seeds: the noise is alike, the mean is not hurt."""
    images = [honest(ROOM, seed) for seed in (1, 2)]
    smooth = honest(ROOM, 9, 1024)
    alike = [smooth + (image - smooth).reshape(42, 28, 2, 3).mean(axis=2).repeat(2, axis=1) for image in images]
    row = judged(ROOM, alike, margin=0.1)
    assert row["noise_word"] == "alike", row["reason"]
    assert judged(ROOM, images, margin=0.1)["noise_word"] == "as expected"


@pytest.mark.usefixtures("undiagnosed")
def test_a_renderer_that_picks_one_light_a_sample_is_right():
    """A point light and a lamp, one at random for every sample; off by a tenth it differs."""
    made = scene(floor(), lights=(PointLight((1.0, 2.0, 1.0), (9.0, 8.0, 7.0)), lamp(1.5)), size=(40, 30))
    each = [made.with_(lights=(light,)) for light in made.lights]
    rng = np.random.default_rng(4)

    def picked(seed: int) -> np.ndarray:
        total = np.zeros((30, 40, 3))
        for k in range(16):
            values = [2 * honest(one, 100 * seed + k, 1, False) for one in each]
            total += np.where(rng.random((30, 40, 1)) < 0.5, *values) / 16
        return total

    for images in ([picked(1)], [picked(1), picked(2)]):
        assert judged(made, images, margin=0.05)["verdict"] != "differs"
    assert judged(made, [1.3 * picked(1), 1.3 * picked(2)], margin=0.05)["verdict"] == "differs"


@pytest.mark.usefixtures("undiagnosed")
def test_a_scene_of_point_lights_has_no_noise_and_is_compared_exactly():
    made = scene(floor(), ellipsoids=(BALL,), lights=(PointLight((1.0, 2.0, 1.0), (9.0, 8.0, 7.0)),), size=(40, 30))
    image = render(made, Area()).mean.transpose(1, 2, 0)
    row = judged(made, [image.astype(np.float32)])
    assert (row["verdict"], row["variance"]) == ("agrees", 0)
    off = np.argwhere(image.min(axis=2) > np.median(image[image > 0]))[7]
    image[tuple(off)] *= 1.05
    row = judged(made, [image.astype(np.float32)])
    assert row["verdict"] == "differs"
    assert "without noise" in row["reason"]


def test_nothing_is_likely_where_it_agrees():
    image = honest(ROOM, 2)
    levels = np.rint(255 * np.clip(image, 0, 1)).astype(np.uint8)
    row = judged(ROOM, [levels], margin=0.05, quantisation="round")
    assert row["verdict"] == "agrees", row["reason"]
    assert row["likely_mistakes"] == []
    wrong = np.where((image > 0) & (image < 5), 6 * image, image)  # of the surfaces alone
    row = judged(ROOM, [wrong], margin=0.05)
    assert row["likely_mistakes"][0]["name"] == "light-scale"


def test_a_mistake_in_common_is_not_noise_in_common():
    """Two images without shadows: their noise is as independent as ever."""
    bare = ROOM.with_(ellipsoids=())
    images = [np.where(honest(bare, k) > 5, honest(ROOM, k), honest(bare, k)) for k in (1, 2)]
    row = judged(ROOM, images, margin=0.01)
    assert row["verdict"] == "differs"
    assert "correlated-seeds" not in [mistake["name"] for mistake in row["likely_mistakes"][:1]]


@pytest.mark.usefixtures("undiagnosed")
@pytest.mark.parametrize("factor", [0.5, 0.1])
def test_two_dark_images_vary_as_little_as_they_are_dark(factor):
    images = [np.where((image := honest(ROOM, k)) > 5, image, factor * image) for k in (1, 2)]
    row = judged(ROOM, images, margin=0.01)
    assert not row["single_image"]
    assert row["bias_interval"][1] < factor - 0.99 < row["bias_interval"][1] + 0.02


@pytest.mark.usefixtures("undiagnosed")
def test_dark_images_with_noise_in_common_still_count_as_one():
    image, other = honest(ROOM, 1, stratified=False), honest(ROOM, 2, stratified=False)
    both = [np.where(one > 5, one, 0.1 * one) for one in (image, 0.9 * image + 0.1 * other)]
    assert judged(ROOM, both, stratified=False, margin=0.01)["single_image"]


@pytest.mark.parametrize("share", [0.1, 1e-6])
def test_images_with_noise_in_common_count_as_one_and_are_told_so(share):
    """A tenth of other noise, or a sum in another order."""
    one, other = honest(ROOM, 1, stratified=False), honest(ROOM, 2, stratified=False)
    row = judged(ROOM, [one, (1 - share) * one + share * other], stratified=False)
    assert row["verdict"] == "undecided", row["reason"]
    assert row["single_image"]
    assert any("count as one" in note for note in row["warnings"])
    assert row["likely_mistakes"][0]["name"] == "correlated-seeds"


@pytest.mark.usefixtures("undiagnosed")
def test_two_runs_of_a_renderer_are_compared():
    """Another seed shows nothing; half of the samples show twice the variance."""
    made = scene(floor(), lights=(lamp(1.0, 0.6),), size=(96, 72), name="floor")

    def rows(seed: int, samples: int) -> list[dict]:
        return [judged(made, [honest(made, seed + k, samples, False) for k in (0, 1)], margin=0.03, samples=16)]

    baseline = rows(1, 16)
    again = compare_rows(baseline, rows(11, 16))
    assert (again.status, again.tests, again.changes) == (0, 3, ())
    worse = compare_rows(baseline, rows(21, 8))
    assert worse.status == 1
    assert "variance" in {change.figure for change in worse.changes}


@pytest.mark.parametrize(("option", "value"), [("quantisation", "round"), ("quantisation", "floor256")])
def test_options_of_levels_are_refused_with_radiance(option, value):
    with pytest.raises(InputError, match=option):
        judged(ROOM, [honest(ROOM, 1)], **{option: value})


@pytest.mark.parametrize("option", [("--tolerance", 1e-3), ("--shadow-origin", "mitsuba"), ("--runs", 2)])
def test_options_that_images_have_no_use_for_are_refused(tmp_path, option):
    np.save(tmp_path / "image.npy", honest(ROOM, 1))
    status, _, error = run("check", "quad", tmp_path / "image.npy", *option)
    assert status == 2
    assert "makes no use of it" in error


@pytest.mark.usefixtures("undiagnosed")
def test_an_image_without_noise_of_a_scene_with_a_closed_form():
    """Nothing is known of its noise but what its differences say: none, and then three pixels are seen."""
    made = load("quad").with_(width=48, height=36)
    image = render(made, Analytic()).mean.transpose(1, 2, 0)
    assert judged(made, [image.astype(np.float32)])["verdict"] == "agrees"
    sampled = judged(made, [honest(made, 1)])
    assert sampled["verdict"] == "undecided"
    image[24, 20:23] *= 0.8
    assert judged(made, [image])["verdict"] == "differs"
