"""The instrument calibrated: many rows are judged as one, null data hardly ever differ, power is as printed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import stats

from nusselt.experiments.studies import worlds
from nusselt.experiments.studies.calibration import false_alarms, interval, power, power_at_smallest
from nusselt.experiments.studies.stopping import AT_ANY_TIME, DOUBLING, times_to_decide
from nusselt.experiments.studies.worlds import SIMULATED, World, from_pool, simulated
from nusselt.experiments.verdict.decision import decide
from nusselt.experiments.verdict.evidence import Expectations
from nusselt.experiments.verdict.judge import judge
from nusselt.experiments.verdict.level import Level, findings
from nusselt.experiments.verdict.rules.channels import Channels
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image


def image_of(passes) -> Image:
    """An image with these passes, (n, p) grey or (n, c, p)."""
    side = int(passes.shape[-1] ** 0.5)
    values = np.broadcast_to(passes.reshape(len(passes), -1, side, side), (len(passes), 3, side, side))
    grey, zero = values.mean(axis=1), np.zeros((side, side))
    return Image(
        first=values[0],
        mean=values.mean(axis=0),
        variance=values.var(axis=0, ddof=1),
        pixel_variance=grey.var(axis=0, ddof=1),
        level_mean=np.zeros((3, side, side)),
        level_variance=np.zeros((3, side, side)),
        emitter=zero,
        background=zero,
        unjudged=zero > 0,
        pass_means=grey.mean(axis=(1, 2)),
        back_faces=0,
        left_out=(),
    )


def reference_of(passes) -> Reference:
    """A reference with these passes, (r, p) grey or (r, c, p)."""
    made = image_of(passes)
    return Reference(
        mean=made.mean,
        standard_error=np.sqrt(made.variance / len(passes)),
        pixel_standard_error=np.sqrt(made.pixel_variance / len(passes)),
        emitter=made.emitter,
        background=made.background,
        holes=np.zeros_like(made.background),
        pass_means=made.pass_means,
        samples=len(passes),
        passes=len(passes),
        renderer="simulated",
        version="",
        variant="",
        llvm=None,
        notes=(),
        seconds={},
    )


@pytest.mark.parametrize("world", SIMULATED, ids=lambda world: world.name)
def test_rows_of_a_batch_are_judged_as_alone(world):
    """Null, and with a bias, a pixel and a variance that differ: simulated evidence, and that of images, row by row."""
    rng, level, margin = np.random.default_rng(8), Level(0.05, 2), 1e-3
    n, r, k = world.passes
    ours, theirs, others = np.split(world.draw(rng, 12, n + r + k).astype(np.float64), [n, n + r], axis=1)
    ours[3] *= 1.3
    ours[4, ..., 0] += 50
    ours[5] = 1 + 3 * (ours[5] - 1)
    evidence = simulated(ours, theirs, others if k else None, margin, world.shares_points, world.grain)
    many = findings(evidence, level)
    side = int(ours.shape[-1] ** 0.5)
    for row in range(12):
        image, reference = image_of(ours[row]), reference_of(theirs[row])
        variance = image_of(others[row]).pixel_variance if k else None
        grains = [None if world.grain is None else np.full((side, side), world.grain / passes) for passes in (n, r)]
        expectations = Expectations(world.shares_points, variance, None, None, *grains)
        verdict = judge(image, reference, passes=n, margin=margin, level=level, expectations=expectations)
        word, reason, more = decide(many.values(), row)
        assert (verdict.word, verdict.more) == (word, more), (row, verdict.reason, reason)
        figures = many["mean"].figures
        for name in ("bias_relative", "bias_interval", "minimum_detectable_bias"):
            assert getattr(verdict, name) == pytest.approx(figures[name][row], rel=1e-9, abs=1e-12)
        np.testing.assert_allclose(verdict.tiles, many["tiles"].figures["tiles"][row], rtol=1e-9, atol=1e-12)
    assert many["mean"].fails.any() or many["tiles"].fails.any()


@pytest.mark.parametrize("world", SIMULATED, ids=lambda world: world.name)
def test_null_reports_hardly_ever_differ(world):
    """400 reports at 5 %: more than 45 alarms have a chance of 1e-6 if the rate is 5 %."""
    row = false_alarms(world, 0.05, 400, 0.07, seed=3)
    assert row["hits"] <= stats.binom.isf(1e-6, 400, 0.05), row
    if "heavy" in world.name or world.name in ("nearly without noise", "one pixel"):
        assert row["undecided_share"] > 0.1


def test_rare_hits_false_alarm_where_what_a_sample_brings_is_not_told():
    """The same hits with a grain of nothing: the guard is what keeps the rate."""
    few = next(world for world in SIMULATED if world.name == "hits in few pixels")
    liar = dataclasses.replace(few, grain=1e-12)
    allowed = stats.binom.isf(1e-6, 200, 0.05)
    assert false_alarms(few, 0.05, 200, 0.07, seed=3)["hits"] <= allowed
    assert false_alarms(liar, 0.05, 200, 0.07, seed=3)["hits"] > allowed


def test_a_decision_looked_for_at_any_time_takes_no_more_samples():
    """Of a right image whose first look is too noisy; rows of both ways, within five standard errors of their mean."""
    (now, wrong), (before, _) = (
        times_to_decide(way, 0.0, 0.5, np.random.default_rng(2), 1000) for way in (AT_ANY_TIME, DOUBLING)
    )
    assert wrong <= stats.binom.isf(1e-6, 1000, 1e-3)
    assert now.mean() < before.mean() + 5 * np.hypot(now.std(), before.std()) / 1000**0.5
    assert now.mean() < before.mean()


def test_a_planted_bias_is_found_as_often_as_predicted():
    """1000 rows: observed and predicted within 5 binomial sd and 1 % for the approximate degrees of freedom."""
    for bias in (5e-3, 8e-3, 1e-2):
        row = power(SIMULATED[0], bias, 1e-3, 250, seed=4)
        sd = (row["expected"] * (1 - row["expected"]) / row["reports"]) ** 0.5
        assert row["rate"] == pytest.approx(row["expected"], abs=5 * sd + 0.01), row


def test_power_at_the_smallest_detectable_bias_is_what_is_printed():
    """2000 rows: binomial bounds at 1e-6 around 0.99."""
    row = power_at_smallest(SIMULATED[0], 1e-3, 500, seed=5)
    low, high = stats.binom.ppf([5e-7, 1 - 5e-7], row["reports"], 0.99)
    assert low <= row["hits"] <= high


def test_an_instrument_that_lies_is_caught():
    """Pixels that share their numbers, judged as if they did not: alarms in far more than 5 % of the reports."""
    liar = World("shared, and not said", worlds._shared)
    assert false_alarms(liar, 0.05, 100, 0.07, seed=6)["hits"] > 50


def test_heavy_tails_and_few_passes_never_agree():
    """With a margin so wide that everything else would."""
    rng = np.random.default_rng(9)
    for world in (world for world in SIMULATED if world.grain is None or world.shares_points):
        n, _, _ = world.passes
        ours, few = np.split(world.draw(rng, 3, n + 8), [n], axis=1)
        said = findings(simulated(ours, few, None, 10.0, world.shares_points), Level(1e-3, 1)).values()
        for row in range(3):
            word, reason, _ = decide(said, row)
            assert word == "undecided", reason
            assert "decide" in reason


@pytest.mark.parametrize("shares_points", [False, True])
def test_swapped_channels_differ_though_their_average_is_right(shares_points):
    rng = np.random.default_rng(12)
    level = np.array([0.8, 0.5, 0.2])[:, None]
    noise = rng.normal(size=(1, 72, 1, 1 if shares_points else 400)) * 0.02
    ours, theirs = np.split(noise + np.zeros(400), 2, axis=1)
    for order, word in (((0, 1, 2), "agrees"), ((2, 1, 0), "differs")):
        evidence = simulated(level[list(order)] + ours, level + theirs, None, 0.05, shares_points)
        said = findings(evidence, Level(1e-3, 1))
        assert decide(said.values())[0] == word
        assert said["channels"].fails[0] == (word == "differs")


def test_a_grey_image_of_the_right_brightness_differs():
    """Pixels of two colours with equal means of channels: no mean sees the average in their place."""
    rng = np.random.default_rng(14)
    colours = np.array([[0.8, 0.5, 0.2], [0.2, 0.5, 0.8]]).T
    right = np.tile(colours, (1, 200)) + 0.02 * rng.standard_normal((1, 36, 3, 400))
    grey = 0.5 + 0.02 * rng.standard_normal((1, 4, 3, 400))
    for image, word in ((right[:, :4], "agrees"), (grey, "differs")):
        said = findings(simulated(image, right[:, 4:], None, 0.05, False), Level(1e-3, 1))
        assert decide(said.values())[0] == word
        assert said["residual"].fails[0] == (word == "differs")


def test_channels_that_share_points_need_more_than_their_pixels_noise():
    """Judged as if each pixel had light points of its own, colours that are right are called wrong."""
    rng = np.random.default_rng(13)
    world = next(world for world in SIMULATED if world.name == "shared light points, three channels")
    right = world.rows(rng, 200)
    liar = dataclasses.replace(right, shares_points=False)
    rule, level = Channels(), 0.01
    assert rule(right, level).fails.sum() <= stats.binom.isf(1e-6, 200, level)
    assert rule(liar, level).fails.sum() > 100


def test_a_pool_is_dealt_without_repeats():
    pool = np.arange(100.0)[:, None]
    hands = from_pool(pool)(np.random.default_rng(0), 50, 7)
    assert hands.shape == (50, 7, 1)
    assert all(len(set(hand.ravel().tolist())) == 7 for hand in hands)


def test_interval_is_clopper_and_pearsons():
    low, high = interval(3, 200)
    assert stats.binom.sf(2, 200, low) == pytest.approx(0.005, rel=1e-6)
    assert stats.binom.cdf(3, 200, high) == pytest.approx(0.005, rel=1e-6)
