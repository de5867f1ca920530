"""What a verdict is made of, against slow and obvious versions, and what each part is there to catch."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from nusselt.experiments.decision import decide
from nusselt.experiments.earned import FEWEST, PASSES, Side, is_heavy
from nusselt.experiments.inference import Bias, Level, pooled_bias, welch
from nusselt.experiments.plain_pixels import too_many_unjudged
from nusselt.experiments.runs.measure import small
from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.spreads import log_ratio_error, pass_spread, variance_ratio
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render

FALSE_ALARM = 1e-6


def test_looks_spend_the_declared_rate_and_no_more():
    level = Level(1e-3, rows=3)
    spent = sum(level.at_look(k).alpha for k in range(1, 2000))
    assert spent == pytest.approx(1e-3, rel=1e-3)
    assert spent < 1e-3
    assert level.at_look(4).rows == 3


def test_by_passes_the_noise_of_pixels_is_not_looked_at():
    rng = np.random.default_rng(0)
    mine, theirs = rng.normal(size=40), rng.normal(size=32)
    bias = pooled_bias(np.full(9, 0.25), np.full(9, 1e9), theirs, mine)
    a, b = np.var(mine, ddof=1) / 40, np.var(theirs, ddof=1) / 32
    assert bias.standard_error == pytest.approx(math.sqrt(a + b), rel=1e-12)
    assert bias.freedom == pytest.approx((a + b) ** 2 / (a**2 / 39 + b**2 / 31), rel=1e-12)
    assert welch(1.0, (a, 39.0), (b, 31.0)).half_width(1e-3) == pytest.approx(bias.half_width(1e-3), rel=1e-12)


def test_welch_agrees_with_scipy():
    rng = np.random.default_rng(4)
    mine, theirs = rng.normal(1.0, 2.0, 40), rng.normal(0.0, 1.0, 35)
    value = float(mine.mean() - theirs.mean())
    bias = welch(value, (np.var(mine, ddof=1) / 40, 39.0), (np.var(theirs, ddof=1) / 35, 34.0))
    interval = stats.ttest_ind(mine, theirs, equal_var=False).confidence_interval(0.99)
    assert value + bias.half_width(0.01) == pytest.approx(interval.high, rel=1e-12)


def test_what_is_not_normal_gets_chebyshevs_interval():
    bias = Bias(0.0, 2.0, 1e9)
    assert bias.half_width(1e-4, normal=False) == pytest.approx(200.0)
    assert bias.half_width(1e-4) < 8


def test_pixel_bootstrap_agrees_with_the_delta_method():
    rng = np.random.default_rng(1)
    ours, theirs = rng.gamma(2.0, size=(2, 4000))
    influence = ours / ours.mean() - theirs / theirs.mean()
    slow = influence.std(ddof=1) / math.sqrt(4000)
    assert log_ratio_error(ours, theirs) == pytest.approx(slow, rel=5 / math.sqrt(2 * 400))  # 5 sd of 400 resamples


def test_ten_times_the_variance_fails_and_a_right_one_does_not():
    rng = np.random.default_rng(2)
    sigma2 = rng.gamma(2.0, size=3000)
    ours, theirs = sigma2 * rng.chisquare(7, size=(2, 3000)) / 7
    right = variance_ratio(ours, theirs, FALSE_ALARM)
    assert right.interval[0] < 1 < right.interval[1]
    assert not right.fails
    assert variance_ratio(10 * ours, theirs, FALSE_ALARM).fails
    assert variance_ratio(ours / 2, theirs, FALSE_ALARM).fails


def test_variance_where_one_side_has_none():
    some, none = np.ones(50), np.zeros(50)
    assert variance_ratio(none, none, 1e-3) is None
    assert variance_ratio(none, some, 1e-3).fails  # seeds shared between passes
    assert variance_ratio(some, none, 1e-3).fails


def test_passes_of_pixels_that_share_their_numbers_vary_too_much():
    rng = np.random.default_rng(3)
    own, shared = rng.normal(size=(40, 500)), rng.normal(size=(40, 1)) + np.zeros((40, 500))
    for values, fails in ((own, False), (shared, True)):
        pooled = values.var(axis=0, ddof=1).sum() / 500**2
        assert pass_spread(values.mean(axis=1), pooled, 39 * 500, FALSE_ALARM).fails == fails


def test_spread_of_passes_covers_as_often_as_it_says():
    rng = np.random.default_rng(5)
    covered = 0
    for _ in range(1500):
        values = rng.normal(size=(12, 60))
        found = pass_spread(values.mean(axis=1), values.var(axis=0, ddof=1).sum() / 3600, 11 * 60, 0.1)
        covered += found.interval[0] <= 1 <= found.interval[1]
    low, high = stats.binom.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], 1500, 0.9)
    assert low <= covered <= high


def test_objections_to_the_normal_approximation():
    rng = np.random.default_rng(6)
    fine = rng.normal(size=40)
    noise = np.ones(400)
    assert Side("ours", noise, fine, False).objection() == ""
    assert Side("ours", np.zeros(400), fine[:1], True).objection() == ""  # nothing is random
    assert f"fewer than {PASSES}" in Side("the reference", noise, fine[:8], True).objection()
    assert Side("ours", noise, fine[:8], False).objection() == ""  # its error comes from the pixels
    few = np.zeros(400)
    few[: FEWEST - 1] = 1.0
    assert f"fewer than {FEWEST} pixels" in Side("ours", few, fine, False).objection()
    heavy = fine.copy()
    heavy[7] = 12.0  # one firefly among the passes
    assert is_heavy(heavy)
    assert "heavy-tailed" in Side("ours", noise, heavy, False).objection()


def test_normal_passes_are_rarely_called_heavy():
    """1,000 sets at 1e-6 each: two alarms have a chance of 5e-7."""
    rng = np.random.default_rng(7)
    assert sum(is_heavy(values) for values in rng.normal(size=(1000, 32))) <= 1


def test_words():
    word, reason, more = decide((-0.0005, 0.0004), 1e-3, [])
    assert (word, more) == ("agrees", None)
    assert decide((-0.0005, 0.0004), 1e-3, [], "few passes") == ("undecided", "few passes", 2.0)
    assert decide((0.0011, 0.002), 1e-3, [])[0] == "differs"
    assert decide((-0.002, -0.0011), 1e-3, [])[0] == "differs"
    assert decide((-0.0001, 0.0001), 1e-3, ["a tile"])[:2] == ("differs", "a tile")
    word, reason, more = decide((-0.002, 0.002), 1e-3, [])
    assert word == "undecided"
    assert more == 6  # 1.3 (2/1)^2, rounded up
    assert f"{more:.0f} times the samples" in reason
    assert decide((0.0005, 0.0015), 1e-3, [])[2] is None  # on the margin


def test_pixels_on_edges_leave_a_row_undecided_and_hide_no_defect():
    """A small image of a room whose corners pass through pixel centres is not wrong: it shows too little."""
    agreeing = (-0.0005, 0.0004)
    assert decide(agreeing, 1e-3, [], "few passes", "24 of 14204 ...") == ("undecided", "24 of 14204 ...", None)
    assert decide((0.0011, 0.002), 1e-3, [], unseen="24 of 14204 ...")[0] == "differs"
    assert decide(agreeing, 1e-3, ["a tile"], unseen="24 of 14204 ...")[0] == "differs"


def test_few_pixels_have_their_share_on_edges():
    """The same room: 480 pixels wide it can be judged, 120 wide it cannot."""

    def told(width: int) -> str:
        scene = small(load("cornell"), width)
        return too_many_unjudged(render(scene, Area(samples=1), tolerance=ray_tolerance(scene)))

    assert told(480) == ""
    assert "lie within rounding of an edge" in told(120)


def test_the_advised_samples_decide():
    """The interval shrinks with the root of the samples: with the advised number it lies inside, or outside."""
    for centre in (0.0, 4e-4, -8e-4, 1.5e-3, -3e-3):
        half = 2e-3
        word, _, more = decide((centre - half, centre + half), 1e-3, [])
        if word != "undecided":
            continue
        half /= math.sqrt(more)
        assert decide((centre - half, centre + half), 1e-3, [])[0] != "undecided"


def test_pixels_without_noise_are_compared_one_by_one():
    from test_calibration import image_of, reference_of

    from nusselt.experiments.plain_pixels import still_failures

    right = np.ones((4, 100))
    ours, theirs = image_of(right), reference_of(right)
    judged = np.ones((10, 10), dtype=bool)
    assert still_failures(ours, theirs, judged, 0.01, 1.0) == []
    right[:, 7] = 1.02
    assert "1 of 100 pixels" in still_failures(image_of(right), theirs, judged, 0.01, 1.0)[0]
    right[0, 7] = 1.1  # it has noise: not this test's matter
    assert still_failures(image_of(right), theirs, judged, 0.01, 1.0) == []


def test_black_pixels_of_a_noisy_reference_may_have_missed_what_is_rare():
    from test_calibration import image_of, reference_of

    from nusselt.experiments.plain_pixels import still_failures

    ours = image_of(np.full((4, 100), 0.02))
    black = np.zeros((32, 100))
    judged = np.ones((10, 10), dtype=bool)
    assert "100 of 100 pixels" in still_failures(ours, reference_of(black), judged, 0.01, 1.0)[0]
    black[::2, 0] = 1.0  # it has noise elsewhere
    assert still_failures(ours, reference_of(black), judged, 0.01, 1.0) == []
    black[:, 1] = 1.0  # without noise and not black: a point light's pixel, say
    assert "1 of 1 pixels" in still_failures(ours, reference_of(black), judged, 0.01, 1.0)[0]
