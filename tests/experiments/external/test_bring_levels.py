"""Whole levels: what they do to a value on average, and the course's scores of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from nusselt.experiments.external.expected import course_scores
from nusselt.experiments.external.shared_noise import common_noise
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.transfer import RULES, Quantiser, Transfer
from nusselt.experiments.verdict.alike import Alike

FALSE_ALARM = 1e-6


def levels(quantiser: Quantiser, x: np.ndarray) -> np.ndarray:
    top, encoded = quantiser.top, quantiser.transfer.encode(x)
    whole = {
        "truncate": np.floor(top * encoded),
        "round": np.rint(top * encoded),
        "floor256": np.minimum(np.floor((top + 1) * encoded), top),
    }[quantiser.rule]
    return whole.astype(np.uint8 if quantiser.top == 255 else np.uint16)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("curve", ["linear", "srgb", "gamma:2.2"])
@pytest.mark.parametrize("deviation", [0.0, 0.0005, 0.002, 0.01])
def test_the_expected_level_is_the_mean_of_noisy_ones(rule, curve, deviation):
    quantiser = Quantiser(255, Transfer(curve), rule)
    mean = np.array([0.1003, 0.2501, 0.5002, 0.77])[:, None]
    noisy = mean + deviation * np.random.default_rng(5).standard_normal((4, 100_000))
    decoded = quantiser.decode(Raw(levels(quantiser, noisy)))
    expected = quantiser.expected(mean[:, 0], np.full(4, deviation))
    error = decoded.std(axis=1) / math.sqrt(decoded.shape[1])
    # A curve bends a bin by up to width^2 f''/24 f'^2 of a level: below a thousandth here.
    assert (np.abs(decoded.mean(axis=1) - expected) <= stats.norm.isf(FALSE_ALARM / 2) * error + 3e-3 / 255).all()


def test_the_test_sees_half_a_level():
    quantiser = Quantiser(255, Transfer(), "round")
    other = Quantiser(255, Transfer(), "truncate")
    x = 0.5 + 0.01 * np.random.default_rng(5).standard_normal(100_000)
    off = other.decode(Raw(levels(quantiser, x))).mean() - other.expected(np.array([0.5]), np.array([0.01]))[0]
    assert off * 255 == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("curve", ["linear", "srgb", "gamma:2.2"])
def test_curves_are_inverses(curve):
    x = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(Transfer(curve).decode(Transfer(curve).encode(x)), x, atol=1e-12)


def test_saturated_is_what_noise_can_push_to_the_top():
    quantiser = Quantiser(255, Transfer(), "truncate")
    mean, deviation = np.array([0.5, 0.97, 1.2, 0.97, 0.0]), np.array([0.01, 0.01, 0.0, 0.0, 0.1])
    np.testing.assert_array_equal(quantiser.saturated(mean, deviation), [False, True, True, False, False])


def test_course_scores_are_of_whole_levels():
    truth = np.random.default_rng(1).random((3, 20, 20)) * 1.2
    same = course_scores(to_levels(truth).astype(float), truth)
    assert (same.bias, same.mse) == (0.0, 0.0)
    darker = course_scores(to_levels(truth).astype(float) - 2, truth)
    assert (darker.bias, darker.mse) == (2.0, 4.0)


def test_noise_in_common_is_seen_and_independent_noise_is_not():
    rng = np.random.default_rng(2)
    one, other, shared = rng.standard_normal((3, 90, 120))
    assert common_noise([one, other]) == 0.0
    assert common_noise([one + shared, other + shared]) == pytest.approx(0.5, abs=0.1)


def test_noise_repeated_from_row_to_row_is_seen():
    rng = np.random.default_rng(3)
    assert Alike.of(rng.standard_normal((90, 120)), 1e-6).correlation == 0.0
    alike = Alike.of(np.tile(rng.standard_normal((30, 120)), (3, 1)), 1e-6)
    assert alike.correlation > 0.9
    assert alike.step in ((0, 30), (0, 60))
