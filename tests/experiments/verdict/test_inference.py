"""The statistics under a verdict, against slow and obvious versions, on null and on planted data."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from nusselt.experiments.verdict.evidence import TILES, tile_numbers
from nusselt.experiments.verdict.intervals import pooled_bias, resting_on
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.quantiles import normal_quantile, student_quantile, student_tail
from nusselt.experiments.verdict.rules import MEAN, RULES
from nusselt.experiments.verdict.rules.pass_spread import pass_spread
from nusselt.experiments.verdict.rules.tiles import Tiles, tile_biases

FALSE_ALARM = 1e-6


@pytest.mark.parametrize("level", [0.5, 0.99, 1e-3, 1e-9, 1e-30])
def test_quantiles_are_those_of_the_laws(level):
    freedom = np.array([1.0, 3.5, 31, 1e9])
    assert normal_quantile(level) == pytest.approx(stats.norm.isf(level), rel=1e-12)
    np.testing.assert_allclose(student_quantile(level, freedom), stats.t.isf(level, freedom), rtol=1e-12)
    reached = student_quantile(level, freedom)
    np.testing.assert_allclose(student_tail(reached, freedom), level, rtol=1e-6)


def test_the_spread_of_passes_is_held_against_both_tails_of_f():
    """The upper one from its own end: 1 - level / 2 would be one at levels below a rounding."""
    rng = np.random.default_rng(1)
    passes, noise = rng.normal(size=(1, 9)), np.full((1, 400), 9.0)
    for level in (1e-2, 1e-6, 1e-18):
        found = pass_spread(passes, noise, level)
        law = stats.f(8, 8 * resting_on(noise))
        assert law.sf(found.value / found.low) == pytest.approx(level / 2, rel=1e-6)
        assert law.cdf(found.value / found.high) == pytest.approx(level / 2, rel=1e-6)


def test_level_splits_the_declared_rate_and_no_more():
    level = Level(1e-3, rows=11)
    assert 11 * sum(level.of(rule) for rule in RULES) == pytest.approx(1e-3, rel=1e-12)
    assert level.of(MEAN) == pytest.approx(1e-3 / 2 / 11, rel=1e-12)
    assert level.of(Tiles()) == pytest.approx(1e-3 * 3 / 22 / 11, rel=1e-12)
    assert level.of(MEAN) > 0 == sum(level.of(rule) for rule in RULES if rule.share is None)


def test_pooled_bias_is_the_mean_with_both_sides_noise():
    rng = np.random.default_rng(0)
    difference, noise, passes = rng.normal(size=500), rng.random(500), rng.normal(size=32)
    bias = pooled_bias(difference, noise, passes)
    a = sum(noise.tolist()) / 500**2
    b = sum((x - passes.mean()) ** 2 for x in passes) / 31 / 32
    assert bias.value == pytest.approx(sum(difference.tolist()) / 500, rel=1e-12)
    assert bias.standard_error == pytest.approx(math.sqrt(a + b), rel=1e-12)
    freedom = (a + b) ** 2 / (a**2 / (2 * resting_on(noise)) + b**2 / 31)
    assert bias.freedom == pytest.approx(freedom, rel=1e-12)


def test_without_noise_the_interval_has_no_width():
    bias = pooled_bias(np.full(10, 0.5), np.zeros(10), np.array([1.0]))
    assert (bias.value, bias.standard_error, bias.half_width(1e-6)) == (0.5, 0.0, 0.0)


def test_noise_on_one_pixel_rests_on_one_pixel():
    assert resting_on(np.ones(100)) == pytest.approx(100)
    assert resting_on(np.eye(1, 100)[0]) == pytest.approx(1)
    assert resting_on(np.zeros(7)) == 7
    assert resting_on(np.full(9, 1e-300)) == pytest.approx(9)  # squares would vanish


def simulate(rng, reports: int, pixels: int, passes: int, bias: float = 0.0):
    """Null reports: our pixels' noise known from their own passes, the reference's from its own."""
    inside = 0
    sigma = rng.gamma(2.0, 0.5, pixels)
    for _ in range(reports):
        mine = rng.normal(size=(4, pixels)) * sigma
        theirs = rng.normal(size=(passes, pixels)) * sigma
        difference = mine.mean(axis=0) - theirs.mean(axis=0) + bias
        found = pooled_bias(difference, mine.var(axis=0, ddof=1) / 4, theirs.mean(axis=1))
        inside += abs(found.value) <= found.half_width(0.05)
    return inside


def test_intervals_cover_as_often_as_they_say():
    """2000 null reports at 5 %: binomial two-sided bounds at 1e-6."""
    covered = simulate(np.random.default_rng(3), 2000, 200, 32)
    low, high = stats.binom.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], 2000, 0.95)
    assert low <= covered <= high


def test_intervals_miss_a_planted_bias():
    assert simulate(np.random.default_rng(3), 200, 200, 32, bias=0.3) < 100


def tiles_of(difference, noise, judged=None, rounding=1e-12):
    """Of one row of images (h, w)."""
    judged = np.ones(difference.shape, dtype=bool) if judged is None else judged
    tile = tile_numbers(*difference.shape)[judged]
    return tile_biases(difference[judged][None], noise[judged][None], tile, np.array([rounding]))


def test_tiles_are_the_means_of_their_pixels():
    rng = np.random.default_rng(1)
    difference, noise = rng.normal(size=(2, 37, 50))
    noise = noise**2
    judged = rng.random((37, 50)) < 0.7
    judged[:5, :7] = False  # the first tile has no pixel
    tiles = tiles_of(difference, noise, judged)
    for i in range(TILES):
        for j in range(TILES):
            cell = np.zeros((37, 50), dtype=bool)
            rows = [y for y in range(37) if y * TILES // 37 == i]
            columns = [x for x in range(50) if x * TILES // 50 == j]
            cell[np.ix_(rows, columns)] = True
            cell &= judged
            if not cell.any():
                assert np.isnan(tiles.bias[0, i, j])
                continue
            assert tiles.bias[0, i, j] == pytest.approx(difference[cell].mean(), rel=1e-12)
            assert tiles.error[0, i, j] == pytest.approx(math.sqrt(noise[cell].sum()) / cell.sum(), rel=1e-12)


def test_null_tiles_have_uniform_p_values_and_a_planted_one_fails():
    rng = np.random.default_rng(5)
    noise = np.full((160, 160), 4.0)
    difference = rng.normal(size=(160, 160)) * 2
    tiles = tiles_of(difference, noise)
    assert stats.kstest(tiles.p.ravel(), "uniform").pvalue > FALSE_ALARM
    assert tiles.failing(1e-6, 0.0) == 0
    difference[20:40, 60:80] += 1.0
    planted = tiles_of(difference, noise)
    assert planted.failing(1e-6, 0.0) == 1
    assert planted.failing(1e-6, 2.0) == 0  # inside a declared margin


def test_exact_tiles_have_no_p_value_and_still_can_fail():
    difference = np.zeros((16, 16))
    difference[0, 0] = 1.0
    tiles = tiles_of(difference, np.zeros((16, 16)))
    assert np.isnan(tiles.p).all()
    assert tiles.failing(1e-6, 0.1) == 1
