"""The instrument calibrated: the array version is the real one, null data hardly ever differ, power is as printed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy import stats

from nusselt.experiments import spreads
from nusselt.experiments.inference import Level
from nusselt.experiments.many_reports import Rows, judge_many
from nusselt.experiments.studies import calibration
from nusselt.experiments.studies.calibration import (
    SIMULATED,
    World,
    false_alarms,
    from_pool,
    interval,
    power,
    power_at_smallest,
)
from nusselt.experiments.verdict import Prior, judge
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image


def image_of(passes) -> Image:
    """A grey image with these passes (n, p)."""
    p = passes.shape[1]
    side = int(p**0.5)
    plane = (side, side)
    mean, variance = passes.mean(axis=0).reshape(plane), passes.var(axis=0, ddof=1).reshape(plane)
    zero, three = np.zeros(plane), (3, *plane)
    return Image(
        first=np.broadcast_to(passes[0].reshape(plane), three),
        mean=np.broadcast_to(mean, three),
        variance=np.broadcast_to(variance, three),
        pixel_variance=variance,
        level_mean=np.zeros(three),
        level_variance=np.zeros(three),
        emitter=zero,
        background=zero,
        unjudged=zero > 0,
        pass_means=passes.mean(axis=1),
        back_faces=0,
        left_out=(),
    )


def reference_of(passes) -> Reference:
    """A grey reference with these passes (r, p)."""
    made = image_of(passes)
    error = np.sqrt(made.pixel_variance / len(passes))
    return Reference(
        mean=made.mean,
        standard_error=np.broadcast_to(error, made.mean.shape),
        pixel_standard_error=error,
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


def delta_method(ours, theirs):
    return float((ours / ours.mean() - theirs / theirs.mean()).std(ddof=1) / ours.size**0.5)


@pytest.mark.parametrize("world", SIMULATED, ids=lambda world: world.name)
def test_the_array_version_is_the_real_one(world, monkeypatch):
    """Null, and with a bias, a tile and a variance that differ."""
    monkeypatch.setattr(spreads, "log_ratio_error", delta_method)
    rng, level, margin = np.random.default_rng(8), Level(0.05, 2), 1e-3
    rows = world.rows(rng, 12)
    ours = rows.ours.astype(np.float64)
    ours[3] *= 1.3
    ours[4, :, 0] += 50
    ours[5] = 1 + 3 * (ours[5] - 1)
    theirs = rows.theirs.astype(np.float64)
    others = None if rows.others is None else rows.others.astype(np.float64)
    many = judge_many(Rows(ours, theirs, others, rows.independent), margin, level)
    words = set()
    for k in range(12):
        image, reference = image_of(ours[k]), reference_of(theirs[k])
        variance = None if others is None else image_of(others[k]).pixel_variance
        prior = Prior(independent=rows.independent, variance=variance)
        one = judge(image, reference, passes=len(ours[k]), margin=margin, level=level, prior=prior)
        words.add(one.word)
        assert (one.word == "differs") == many.differs[k], (k, one.reason)
        assert one.bias_relative == pytest.approx(many.bias[k], rel=1e-9, abs=1e-12)
        assert one.bias_interval[1] == pytest.approx(many.bias[k] + many.reach[k], rel=1e-9, abs=1e-12)
        assert one.minimum_detectable_bias == pytest.approx(many.smallest[k], rel=1e-9)
        if many.objected[k]:
            assert one.word != "agrees"
    assert "differs" in words


@pytest.mark.parametrize("world", SIMULATED, ids=lambda world: world.name)
def test_null_reports_hardly_ever_differ(world):
    """400 reports at 5 %: more than 45 alarms have a chance of 1e-6 if the rate is 5 %."""
    row = false_alarms(world, 0.05, 400, 0.07, seed=3)
    assert row["hits"] <= stats.binom.isf(1e-6, 400, 0.05), row
    if "heavy" in world.name or world.name in ("nearly without noise", "one pixel"):
        assert row["undecided_share"] > 0.1


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
    liar = World("shared, and not said", calibration._shared)
    assert false_alarms(liar, 0.05, 100, 0.07, seed=6)["hits"] > 50


def test_heavy_tails_and_few_passes_never_agree():
    """With a margin so wide that everything else would."""
    rng = np.random.default_rng(9)
    for world in SIMULATED:
        found = judge_many(world.rows(rng, 40), 10.0, Level(1e-3, 1))
        rows = world.rows(rng, 3)
        for k in range(3):
            few = reference_of(rows.theirs[k, :8].astype(np.float64))
            image = image_of(rows.ours[k].astype(np.float64))
            prior = Prior(independent=rows.independent)
            one = judge(image, few, passes=len(rows.ours[k]), margin=10.0, level=Level(1e-3, 1), prior=prior)
            assert one.word == "undecided", one.reason
            assert "decide" in one.reason
        assert found.objected.dtype == bool


def test_swapped_channels_differ_though_their_average_is_right():
    rng = np.random.default_rng(12)
    level = np.array([0.8, 0.5, 0.2])[:, None, None]
    noise = rng.normal(size=(40, 1, 20, 20)) * 0.05
    image, reference = (image_of(noise[:4, 0].reshape(4, -1)), reference_of(noise[4:, 0].reshape(36, -1)))
    for order, word in (((0, 1, 2), "agrees"), ((2, 1, 0), "differs")):
        ours = dataclasses.replace(image, mean=level[list(order)] + image.mean, first=level + image.first)
        theirs = dataclasses.replace(reference, mean=level + reference.mean, pass_means=0.5 + reference.pass_means)
        assert judge(ours, theirs, passes=4, margin=0.05, level=Level(1e-3, 1)).word == word


def test_a_pool_is_dealt_without_repeats():
    pool = np.arange(100.0)[:, None]
    hands = from_pool(pool)(np.random.default_rng(0), 50, 7)
    assert hands.shape == (50, 7, 1)
    assert all(len(set(hand.ravel().tolist())) == 7 for hand in hands)


def test_interval_is_clopper_and_pearsons():
    low, high = interval(3, 200)
    assert stats.binom.sf(2, 200, low) == pytest.approx(0.005, rel=1e-6)
    assert stats.binom.cdf(3, 200, high) == pytest.approx(0.005, rel=1e-6)
