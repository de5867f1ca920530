"""Right images whose noise is another than was supposed: quieter than their levels are wide, or of paths ended."""

from __future__ import annotations

import numpy as np
import pytest

from nusselt.experiments.check.question import Question
from nusselt.experiments.studies.honest_images import CASES, FORMAT, Case, brought, made, scene_named

WIDTH = 40


def word(name: str, case: Case, margin: float, change=lambda image: image, seed: int = 5, width: int = WIDTH) -> str:
    """The verdict on images of a case at a margin, changed."""
    assert case in CASES
    images = [change(image) for image in made(name, case, 16, range(seed, seed + case.images), width)]
    question = Question("area", samples=16, stratified=case.strata, margin=margin, pixel_rule=case.rule)
    scene = scene_named(name, width, case.rule)
    return str(brought(scene, images, question, FORMAT[case.written], mistakes=False).row["verdict"])


QUIET = Case(written="PNG truncated", images=2, jittered=True, rule="area")


def test_levels_that_no_noise_evens_out_are_expected_as_they_are():
    """A floor under the sun, each pixel one level of 28: half of one is nearly 2 % of it."""
    assert word("open sun", QUIET, 2e-3) == "undecided"
    assert word("open sun", QUIET, 2e-3, lambda image: 1.01 * image) == "undecided"
    assert word("open sun", QUIET, 1e-3, lambda image: 1.002 * image) == "undecided"
    assert word("open sun", QUIET, 2e-3, lambda image: 1.05 * image) == "differs"
    assert word("open sun", QUIET, 4e-2) == "agrees"


@pytest.mark.parametrize("name", ["point", "direction"])
def test_one_image_of_paths_ended_at_random_is_noisy_and_not_wrong(name):
    case = Case("roulette", strata=False, images=1)
    assert word(name, case, 0.01) != "differs"
    assert word(name, case, 0.01, lambda image: 1.1 * image) == "differs"


@pytest.mark.parametrize("factor", [1.02, 0.9])
def test_without_noise_a_factor_is_no_path_ended(factor):
    case = Case("area", strata=True, images=1)
    assert word("point", case, 0.01) == "agrees"
    assert word("point", case, 0.01, lambda image: factor * image) == "differs"
    spots = np.random.default_rng(3).random((WIDTH, 1, 1)) < 0.05
    assert word("point", case, 0.01, lambda image: np.where(spots[: len(image)], 1.1 * image, image)) == "differs"


def test_few_plain_pixels_beside_an_edge_do_not_speak_against_areas():
    """Of 32 beside the lamp three differ: a tenth of them, but for chance."""
    case = Case(images=1, jittered=True)
    assert word("cornell", case, 0.01, seed=2505, width=64) == "undecided"


@pytest.mark.parametrize("seed", [60000, 60034])
def test_levels_of_another_rule_are_not_told_from_a_bias_of_half_a_level(seed):
    """Nobody says how the levels were made, and the usual rules fit alike; a whole level is no rule's."""
    case = Case(written="PNG int(256 x)", images=2)
    assert word("open sun", case, 1e-3, seed=seed, width=64) == "undecided"
    assert word("open sun", case, 1e-3, lambda image: 1.06 * image, seed=seed, width=64) == "differs"
