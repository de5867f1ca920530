"""What a verdict is made of, against slow and obvious versions, and what each part is there to catch."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats
from test_calibration import image_of, reference_of

from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.scenes.sizes import small
from nusselt.experiments.verdict.decision import decide
from nusselt.experiments.verdict.evidence import Expectations, evidence_of
from nusselt.experiments.verdict.intervals import Bias, pooled_bias, welch
from nusselt.experiments.verdict.judge import judge
from nusselt.experiments.verdict.level import Level, findings
from nusselt.experiments.verdict.rule import Finding
from nusselt.experiments.verdict.rules import RULES
from nusselt.experiments.verdict.rules.mean import of_interval
from nusselt.experiments.verdict.rules.noise_free import NoiseFree
from nusselt.experiments.verdict.rules.normality import FEWEST, PASSES, excess_kurtosis, is_heavy, side_objections
from nusselt.experiments.verdict.rules.pass_spread import pass_spread
from nusselt.experiments.verdict.rules.variance_ratio import log_ratio_error, variance_ratio
from nusselt.experiments.verdict.side import Side
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.estimators import Analytic, Area
from nusselt.renderer.image import render

FALSE_ALARM = 1e-6


def crossings(walks: int, looks: int, level_at) -> int:
    """How many of so many sums of normal steps are called wrong at any of their looks."""
    rng = np.random.default_rng(1)
    sums = rng.normal(size=(walks, looks)).cumsum(axis=1)
    times = np.arange(1, looks + 1)
    limits = [stats.norm.isf(level_at(time) / 2) for time in times]
    return int((np.abs(sums) / np.sqrt(times) > limits).any(axis=1).sum())


def test_looking_after_every_pass_keeps_the_declared_rate():
    """4,000 sums, 1,000 looks each, at 5 %: binomial bound at 1e-6; looking as if once is caught."""
    level = Level(0.05, 1)
    rule = 0.05 / len(RULES)
    alarms = crossings(4000, 1000, lambda time: level.at_time(time).alpha / 0.05 * rule)
    assert alarms <= stats.binom.isf(FALSE_ALARM, 4000, rule)
    assert crossings(4000, 1000, lambda time: rule) > stats.binom.isf(FALSE_ALARM, 4000, rule)
    assert level.at_time(3.0).rows == 1


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
    assert log_ratio_error(ours[None], theirs[None])[0] == pytest.approx(
        slow, rel=5 / math.sqrt(2 * 400)
    )  # 5 sd of 400 resamples


def test_the_bootstrap_is_scipys():
    rng = np.random.default_rng(11)
    ours, theirs = rng.gamma(2.0, size=(2, 3, 50))
    slow = stats.bootstrap(
        (ours, theirs),
        lambda x, y, axis: np.log(x.mean(axis=axis) / y.mean(axis=axis)),
        paired=True,
        axis=-1,
        n_resamples=400,
        batch=10,
        method="basic",
        rng=np.random.default_rng(0),
    )
    np.testing.assert_allclose(log_ratio_error(ours, theirs), slow.standard_error, rtol=1e-9)


def test_ten_times_the_variance_fails_and_a_right_one_does_not():
    rng = np.random.default_rng(2)
    sigma2 = rng.gamma(2.0, size=3000)
    ours, theirs = sigma2 * rng.chisquare(7, size=(2, 1, 3000)) / 7
    rows = np.concatenate((ours, 10 * ours, ours / 2))
    ratio = variance_ratio(rows, np.repeat(theirs, 3, axis=0), FALSE_ALARM)
    assert ratio.low[0] < 1 < ratio.high[0]
    assert ratio.fails.tolist() == [False, True, True]


def test_variance_where_one_side_has_none():
    some, none = np.ones((1, 50)), np.zeros((1, 50))
    assert np.isnan(variance_ratio(none, none, 1e-3).value)
    assert not variance_ratio(none, none, 1e-3).fails
    assert variance_ratio(none, some, 1e-3).fails  # seeds shared between passes
    assert variance_ratio(some, none, 1e-3).fails


def test_passes_of_pixels_that_share_their_numbers_vary_too_much():
    rng = np.random.default_rng(3)
    own, shared = rng.normal(size=(40, 500)), rng.normal(size=(40, 1)) + np.zeros((40, 500))
    rows = np.stack((own, shared))
    spread = pass_spread(rows.mean(axis=2), rows.var(axis=1, ddof=1) / 40, FALSE_ALARM)
    assert spread.fails.tolist() == [False, True]


def test_spread_of_passes_covers_as_often_as_it_says():
    values = np.random.default_rng(5).normal(size=(1500, 12, 60))
    spread = pass_spread(values.mean(axis=2), values.var(axis=1, ddof=1) / 12, 0.1)
    covered = ((spread.low <= 1) & (spread.high >= 1)).sum()
    low, high = stats.binom.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], 1500, 0.9)
    assert low <= covered <= high


def objection(name: str, noise, passes, by_passes: bool) -> str:
    """What is said of one row's side; empty where nothing is."""
    zero = np.zeros((1, 1, noise.size))
    said = side_objections(Side(name, zero, zero, noise[None], passes[None], by_passes))
    return next((sentence for rows, sentence in said if rows[0]), "")


def test_objections_to_the_normal_approximation():
    rng = np.random.default_rng(6)
    fine = rng.normal(size=40)
    noise = np.ones(400)
    assert objection("ours", noise, fine, False) == ""
    assert objection("ours", np.zeros(400), fine[:1], True) == ""  # nothing is random
    assert f"fewer than {PASSES}" in objection("the reference", noise, fine[:8], True)
    assert objection("ours", noise, fine[:8], False) == ""  # its error comes from the pixels
    few = np.zeros(400)
    few[: FEWEST - 1] = 1.0
    assert f"fewer than {FEWEST} pixels" in objection("ours", few, fine, False)
    heavy = fine.copy()
    heavy[7] = 12.0  # one firefly among the passes
    assert is_heavy(heavy)
    assert "heavy-tailed" in objection("ours", noise, heavy, False)


def test_normal_passes_are_rarely_called_heavy():
    """1,000 sets at 1e-6 each: two alarms have a chance of 5e-7."""
    rng = np.random.default_rng(7)
    assert is_heavy(rng.normal(size=(1000, 32))).sum() <= 1


def test_values_that_are_alike_but_for_their_rounding_have_no_moments():
    values = np.nextafter(np.full((2, 32), 0.3), np.arange(32) % 3)
    assert np.ptp(values) > 0
    assert not is_heavy(values).any()
    assert np.isnan(excess_kurtosis(Side.of_passes("rounded", values[:, :, None, None], by_passes=True))).all()


YES, NO = np.ones(1, dtype=bool), np.zeros(1, dtype=bool)


def interval(low: float, high: float) -> Finding:
    return of_interval(np.array([low]), np.array([high]), 1e-3)


def failure(sentence: str) -> Finding:
    return Finding(YES, lambda k: sentence)


def objecting(sentence: str, more: float) -> Finding:
    return Finding(NO, lambda k: sentence, YES, np.array([more]))


AGREEING = interval(-0.0005, 0.0004)
FEW_PASSES, UNSEEN = objecting("few passes", 2.0), objecting("24 of 14204 ...", math.inf)


def test_an_image_without_noise_asks_for_samples_of_the_reference():
    room = small(load("quad"), 32)
    exact, noisy = render(room, Analytic()), render(room, Area(samples=4), seed=1, passes=32)
    theirs = Reference.of_image(render(room, Area(samples=4), seed=2, passes=32), "mitsuba", 4)
    for ours, passes, whose in ((exact, 1, "the reference's samples"), (noisy, 32, "the samples")):
        finding = findings(evidence_of(ours, theirs, passes, 5e-3), Level(1e-3, 1))["mean"]
        assert f"times {whose} would decide" in finding.say(0)


def test_words():
    word, reason, more = decide([AGREEING])
    assert (word, more) == ("agrees", None)
    assert "inside the margin" in reason
    assert decide([AGREEING, FEW_PASSES]) == ("undecided", "few passes", 2.0)
    assert decide([interval(0.0011, 0.002)])[0] == "differs"
    assert decide([interval(-0.002, -0.0011)])[0] == "differs"
    assert decide([interval(-0.0001, 0.0001), failure("a tile")])[:2] == ("differs", "a tile")
    word, reason, more = decide([interval(-0.002, 0.002)])
    assert word == "undecided"
    assert more == 6  # 1.3 (2/1)^2, rounded up
    assert f"if it is right, about {more:.0f} times the samples" in reason
    assert decide([interval(0.0005, 0.0015)])[2] is None  # on the margin
    wide = decide([interval(-0.02, 0.01)])
    assert wide[2] == 293  # what a right image needs, whatever the noise makes of its middle: 1.3 (15/1)^2


def test_pixels_on_edges_leave_a_row_undecided_and_hide_no_defect():
    """A small image of a room whose corners pass through pixel centres is not wrong: it shows too little."""
    assert decide([AGREEING, FEW_PASSES, UNSEEN]) == ("undecided", "24 of 14204 ...", None)
    assert decide([interval(0.0011, 0.002), UNSEEN])[0] == "differs"
    assert decide([AGREEING, failure("a tile"), UNSEEN])[0] == "differs"


def test_few_pixels_have_their_share_on_edges():
    """The same room: 120 pixels wide it can be judged, with fifty pixels of a thousand hidden it cannot."""
    scene = small(load("cornell"), 120)
    image = render(scene, Area(samples=1), tolerance=ray_tolerance(scene))

    def said(unjudged) -> Finding:
        seen = dataclasses.replace(image, unjudged=unjudged)
        return NoiseFree()(evidence_of(seen, Reference.of_image(seen, "itself", 1), 1, 1e-3), 0.0)

    assert image.unjudged.any()
    assert not said(image.unjudged).objects[0]
    hidden = np.arange(image.unjudged.size).reshape(image.unjudged.shape) % 20 == 0
    assert said(hidden).objects[0]
    assert "lie within rounding of an edge" in said(hidden).say(0)


def test_an_image_of_lights_alone_leaves_nothing_to_judge():
    """Of several passes too: no rule divides by its number of shaded pixels."""
    made = image_of(np.ones((4, 100)))
    plain = dataclasses.replace(made, emitter=np.ones((10, 10)))
    expectations = Expectations(grain=np.ones((10, 10)), reference_grain=np.ones((10, 10)))
    reference = dataclasses.replace(Reference.of_image(plain, "itself", 1), pass_means=np.ones(32))
    verdict = judge(plain, reference, passes=4, margin=1e-3, level=Level(), expectations=expectations)
    assert (verdict.word, "nothing to judge" in verdict.reason) == ("undecided", True)


def test_the_advised_samples_decide():
    """With the advised number the interval of a right image lies inside; of a wrong one, where the middle stays."""
    for centre in (0.0, 4e-4, -8e-4, 1.5e-3, -3e-3):
        half = 2e-3
        word, _, more = decide([interval(centre - half, centre + half)])
        if word != "undecided":
            continue
        right = abs(centre) <= half
        centre, half = 0.0 if right else centre, half / math.sqrt(more)
        assert decide([interval(centre - half, centre + half)])[0] != "undecided"


def still_pixels(ours, theirs, sampled: bool) -> str:
    """What is said of an image and a reference with these passes, where 1 % is allowed."""
    known = Expectations(sampled=np.full((10, 10), sampled))
    evidence = evidence_of(image_of(ours), reference_of(theirs), len(ours), 1e-3, known)
    return NoiseFree()(evidence, 0.0).say(0)


def test_pixels_known_to_be_without_noise_are_compared_one_by_one():
    right = np.ones((2, 100))
    theirs = right.copy()
    assert still_pixels(right, theirs, sampled=False) == ""
    right[:, 7] = 1.02
    assert "1 of 100 pixels" in still_pixels(right, theirs, sampled=False)


def test_equal_values_are_not_taken_for_certainty():
    """Pixels that may be random and came out equal in every pass are not compared exactly; nor are a reference's."""
    ours = np.full((4, 100), 0.02)
    assert still_pixels(ours, np.zeros((2, 100)), sampled=True) == ""
    assert still_pixels(ours, np.zeros((32, 100)), sampled=False) == ""
    assert "100 of 100 pixels" in still_pixels(ours, np.zeros((2, 100)), sampled=False)
