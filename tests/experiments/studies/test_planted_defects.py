"""Planted defects: the catalogue is whole, the wrong ones are found, the right ones agree; the usual gates beside."""

from __future__ import annotations

import io

import numpy as np
import pytest
from rich.console import Console
from scipy import stats
from test_calibration import image_of, reference_of

from nusselt.experiments.defects import scenes
from nusselt.experiments.defects.altered import Altered
from nusselt.experiments.defects.catalogue import CONTROLS, DEFECTS, RIGHT, Control
from nusselt.experiments.defects.gates import pictures_differ, pixels_differ, structure_differs
from nusselt.experiments.studies.planted_defects import Truths, find, hardness_table, hold
from nusselt.experiments.studies.variance_table import (
    add_slopes,
    bias_of,
    mark_ties,
    markdown,
    measured_of,
    variance_interval,
)
from nusselt.experiments.verdict.level import Level
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import render

pytestmark = pytest.mark.mitsuba

LEVEL = Level(1e-3, 10)


@pytest.fixture(scope="module")
def truths():
    return Truths(5, 120.0)


def test_the_unaltered_estimator_is_area_to_the_bit():
    scene = scenes.lobes()
    for stratified in (False, True):
        ours = render(scene, Altered(samples=4, stratified=stratified), seed=3)
        np.testing.assert_allclose(ours.mean, render(scene, type(RIGHT)(samples=4, stratified=stratified), seed=3).mean)


def test_names_are_distinct_and_every_scene_has_its_control():
    assert len({planted.name for planted in DEFECTS}) == len(DEFECTS) == 30
    held = {(c.scene, c.margin) for c in CONTROLS if c.estimator == RIGHT and c.against is None}
    assert {(planted.scene, planted.margin) for planted in DEFECTS} <= held


CHEAP = (
    "gain 0.999",
    "offsets shared by all",
    "passes share their seed",
    "one NaN",
    "channels swapped",
    "sums in float16",
)


@pytest.mark.parametrize("name", CHEAP)
def test_what_pictures_do_not_show_is_found(name, truths):
    """Those that need the variance, the spread of passes, single pixels, channels or a fine margin."""
    (planted,) = [planted for planted in DEFECTS if planted.name == name]
    row = find(planted, truths, LEVEL, seed=6)
    assert (row["verdict"], row["as_claimed"], row["defect"]) == ("differs", True, name), row["reason"]
    assert row["samples_to_detection"] == row["samples"] * row["passes"]
    page = io.StringIO()
    Console(file=page, width=80).print(hardness_table([row], 80))
    for words in (name, row["scene"], "differs", f"{100 * row['bias_relative']:+.3f}"):
        assert words in page.getvalue()
    if name in ("gain 0.999", "one NaN"):
        assert not row["picture_differs"]
        assert not row["pixels_differ"]  # what the usual gates miss


def test_controls_agree(truths):
    for control in (Control(scenes.colours), Control(scenes.small_lamps), Control(scenes.colours, RIGHT, RIGHT, 5e-3)):
        row = hold(control, truths, LEVEL, seed=7)
        assert (row["verdict"], row["as_claimed"], row["defect"]) == ("agrees", True, None), row["reason"]


def test_images_and_references_change_places():
    image = render(scenes.colours(), RIGHT, seed=1, passes=3)
    there = Reference.of_image(image, "area", 4)
    np.testing.assert_allclose(there.pixel_standard_error**2 * 3, image.pixel_variance, rtol=1e-12)
    back = there.as_image()
    np.testing.assert_allclose(back.pixel_variance, image.pixel_variance, rtol=1e-12)
    np.testing.assert_array_equal(back.shaded, image.shaded)


def test_gates_are_what_they_say():
    rng = np.random.default_rng(0)
    passes = 0.5 + 0.1 * rng.normal(size=(8, 100))
    image, truth = image_of(passes), reference_of(np.full((4, 100), 0.5))
    # One pass of 4 samples: the variance of a sample is 4 times that of a pass.
    slow = 0
    for value, variance in zip(passes.mean(axis=0), passes.var(axis=0, ddof=1), strict=True):
        z = abs(value - 0.5) / (max(4 * variance, 1e-4) / 32) ** 0.5
        slow += 3 * (z > stats.norm.isf((1 - (1 - 0.01) ** (1 / 300)) / 2))
    assert pixels_differ(image, truth, 4, 8) == (slow / 300 > 0.0025)
    levels = np.floor(255 * np.clip(passes[0], 0, 1)) - np.floor(255 * 0.5)
    assert pictures_differ(image, truth) == (np.abs(levels).mean() > 1)
    assert not pictures_differ(truth_image := image_of(np.full((4, 100), 0.5)), truth)
    assert not pixels_differ(truth_image, truth, 4, 4)


def test_structural_similarity_sees_structure_and_takes_noise_for_it():
    """Its known fault: right images fail at few samples, and a gain of a thousandth passes."""
    ramp = np.linspace(0.2, 0.8, 400)
    noise = 0.1 * np.random.default_rng(0).normal(size=(2, 400))
    truth = reference_of(np.tile(ramp, (4, 1)))
    assert not structure_differs(image_of(np.tile(ramp, (2, 1))), truth)
    assert not structure_differs(image_of(np.tile(0.999 * ramp, (2, 1))), truth)
    assert structure_differs(image_of(ramp + noise), truth)
    assert structure_differs(image_of(np.tile(ramp[::-1], (2, 1))), truth)


def _row(samples: int, rms: float, efficiency: float, name: str = "a"):
    return {
        "scene": "s", "renderer": "ours", "estimator": name, "samples": samples, "rms_relative": rms,
        "variance": rms**2, "variance_interval": [0.9 * rms**2, 1.1 * rms**2], "efficiency": efficiency,
        "efficiency_interval": [0.9 * efficiency, 1.1 * efficiency], "bias_relative": 0.0,
        "bias_interval": [-0.01, 0.01], "seconds_per_sample": 1e-8,
    }  # fmt: skip


def test_slopes_and_ties_of_the_variance_table():
    rows = [_row(n, n**-0.75, 10.0) for n in (4, 16, 64)] + [_row(64, 0.1, 11.0, "b"), _row(64, 0.2, 5.0, "c")]
    add_slopes(rows)
    mark_ties(rows)
    assert rows[0]["slope"] == pytest.approx(-0.75, rel=1e-9)
    assert rows[0]["slope_interval"][0] == pytest.approx(-0.75, rel=1e-6)
    assert rows[3]["slope"] is None
    assert [row["best"] for row in rows] == [True, True, True, True, False]  # a and b overlap, c does not
    assert len(markdown(rows).splitlines()) == 2 + len(rows)


def test_intervals_of_the_variance_table_hold_where_pixels_share_their_noise():
    # 500 tables of 8 passes, all noise common to 400 pixels. At most 1e-6 of such tests fail by chance.
    rng, truth = np.random.default_rng(0), np.full(400, 2.0)
    misses = {shared: np.zeros(2) for shared in (True, False)}
    for noise in rng.normal(size=(500, 8, 1)):
        for shared, missed in misses.items():
            found = measured_of(truth + noise + 1e-3 * rng.normal(size=(8, 400)), np.ones(8), shared)
            bias, (low, high) = bias_of(found, truth, np.full(1, 2.0)), variance_interval(found)
            missed += abs(bias.value) > bias.half_width(0.01), not low < 1.0 < high
    assert misses[True][0] <= stats.binom.isf(1e-6, 500, 0.01)
    assert misses[False][0] > 250
    assert misses[True][1] < misses[False][1] / 4
