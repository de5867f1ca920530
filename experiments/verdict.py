"""Is the image right, and how sure are we?

The bias is the mean over shaded pixels of (ours - reference); its interval holds the noise of both sides. The
family-wise false-alarm rate of a report is declared beforehand and split: half to the pooled means, a quarter
to tiles, a quarter to the rest, each by Bonferroni over its tests, so that every interval exists before any
p-value does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import stats

from mitsuba_bridge.reference import Reference
from renderer.image import Image
from renderer.vectors import Floats

from .course import CourseScore, course_score
from .statistics import TILES, Bias, Bools, Level, denoised_root, error_of_mean, pooled_bias, resting_on, tile_biases

ROUNDING = 2e-6
"""Relative rounding of Mitsuba's float32 radiance, as measured on noise-free pixels (5e-7 to 2e-6)."""
TILE_MARGIN = 10
"""A tile's margin in margins of the pooled mean: it sees places, not hairs."""
UNJUDGED = 1e-3
"""Share of the shaded pixels that may lie within rounding of an edge."""
POWER = 0.99
FEWEST = 30
"""Noise that rests on fewer pixels than this is not taken for normal."""

Word = Literal["agrees", "differs", "undecided"]


@dataclass(frozen=True)
class Verdict:
    """All that is said of one row; "relative" is to the reference's mean over shaded pixels.

    The fields are those of `results.json`; ``tiles`` and ``tile_p`` are (8, 8), ``shaded`` is (h, w).
    """

    word: Word
    reason: str
    pixels: dict[str, int]
    reference_mean: float
    bias: float
    bias_relative: float
    bias_interval: tuple[float, float]
    reference_error_relative: float
    minimum_detectable_bias: float
    rms: float
    rms_relative: float
    rms_denoised_relative: float
    rms_denoised_interval: tuple[float, float]
    variance: float
    course: CourseScore
    non_finite: int
    tiles: Floats
    tile_p: Floats
    shaded: Bools
    noise: dict[str, float | None]


def standard_errors(ours: Image, reference: Reference, passes: int) -> Floats:
    """(mean of ours - reference) in standard errors of both sides, pixel by pixel, (h, w); 0 where exact."""
    difference = (ours.mean - reference.mean).mean(axis=0)
    scale = np.abs(reference.mean).mean(axis=0)
    noise = ours.pixel_variance / passes + reference.pixel_standard_error**2 + (ROUNDING * scale) ** 2
    return np.divide(difference, np.sqrt(noise), out=np.zeros_like(difference), where=noise > 0)


def judge(ours: Image, reference: Reference, *, passes: int, margin: float, level: Level) -> Verdict:
    """Compare an image with a reference.

    Parameters
    ----------
    ours : Image
    reference : Reference
    passes : int
        How many passes ``ours.mean`` averages.
    margin : float
        Relative bias declared not to matter, above 0.
    level : Level
        False-alarm rate.
    """
    finite: Bools = np.asarray(np.isfinite(ours.mean).all(axis=0))
    judged = _shaded(ours, reference) & finite & ~ours.unjudged
    difference = (ours.mean - reference.mean).mean(axis=0)
    noise = ours.pixel_variance * ours.clumping / passes
    mean = float(np.abs(reference.mean).mean(axis=0)[judged].mean()) if judged.any() else 0.0
    scale = mean if mean > 0 else 1.0  # a black reference: relative to one
    failures = _exact_failures(ours, reference, finite)
    if judged.any():
        bias = pooled_bias(difference[judged], noise[judged], reference.pass_means)
    else:
        bias = Bias(0.0, 0.0, 1e9)
    tiles = tile_biases(difference, noise + reference.pixel_standard_error**2, judged, ROUNDING * scale)
    failing = tiles.failing(level.tile, (TILE_MARGIN * margin + ROUNDING) * scale)
    if failing:
        failures.append(f"{failing} of {TILES * TILES} tiles are off by more than {TILE_MARGIN} margins")
    reach = bias.half_width(level.pooled) / scale + ROUNDING
    interval = (bias.value / scale - reach, bias.value / scale + reach)
    word, reason = _decide(interval, margin, failures)
    if word == "agrees" and resting_on(noise[judged]) < FEWEST:
        word, reason = (
            "undecided",
            f"the noise rests on fewer than {FEWEST} pixels: more samples would decide",
        )
    one = (ours.first - reference.mean).mean(axis=0)[judged] if judged.any() else np.zeros(1)
    expected = (ours.pixel_variance + reference.pixel_standard_error**2)[judged] if judged.any() else np.zeros(1)
    denoised, denoised_interval = denoised_root(one**2 - expected, level.pooled)
    rms = math.sqrt(float((one**2).mean()))
    return Verdict(
        word=word,
        reason=reason,
        pixels=pixel_counts(ours) | {"shaded": int(judged.sum())},
        reference_mean=mean,
        bias=bias.value,
        bias_relative=bias.value / scale,
        bias_interval=interval,
        reference_error_relative=_pooled_error(reference) / scale,
        minimum_detectable_bias=margin + reach + float(stats.norm.isf(1 - POWER)) * bias.standard_error / scale,
        rms=rms,
        rms_relative=rms / scale,
        rms_denoised_relative=denoised / scale,
        rms_denoised_interval=(denoised_interval[0] / scale, denoised_interval[1] / scale),
        variance=float(ours.pixel_variance[judged].mean()) if judged.any() else 0.0,
        course=course_score(ours, reference, passes),
        non_finite=int((~finite).sum()),
        tiles=tiles.bias / scale,
        tile_p=tiles.p,
        shaded=judged,
        noise=_noise_of_figures(ours, reference, judged, scale, bias),
    )


def _noise_of_figures(
    ours: Image, reference: Reference, judged: Bools, scale: float, bias: Bias
) -> dict[str, float | None]:
    """The standard errors by which two runs are compared, and one pass's mean square error without the reference's."""
    square = ((ours.first - reference.mean).mean(axis=0) ** 2 - reference.pixel_standard_error**2) / scale**2
    return {
        "bias_relative_standard_error": bias.standard_error / scale,
        "bias_relative_freedom": bias.freedom,
        "variance_standard_error": error_of_mean(ours.pixel_variance, judged),
        "mse_relative": float(square[judged].mean()) if judged.any() else None,
        "mse_relative_standard_error": error_of_mean(square, judged),
    }


def pixel_counts(ours: Image) -> dict[str, int]:
    """Pixels by what our camera sees there."""
    return {
        "shaded": int(ours.shaded.sum()),
        "emitter": int((ours.emitter > 0).sum()),
        "background": int((ours.background == 1).sum()),
        "unjudged": int(ours.unjudged.sum()),
    }


def _shaded(ours: Image, reference: Reference) -> Bools:
    return ours.shaded & (reference.emitter == 0) & (reference.background == 0)


def _pooled_error(reference: Reference) -> float:
    passes = reference.pass_means
    return float(np.std(passes, ddof=1)) / math.sqrt(passes.size) if passes.size > 1 else 0.0


def _exact_failures(ours: Image, reference: Reference, finite: Bools) -> list[str]:
    """What must hold without any noise: finite values, the same kinds of pixel, the same plain pixels."""
    failures = []
    if not finite.all():
        failures.append(f"{int((~finite).sum())} pixels are not finite")
    unjudged, shaded = int((ours.unjudged & ours.shaded).sum()), int(ours.shaded.sum())
    if unjudged > UNJUDGED * max(shaded, 1):
        failures.append(f"{unjudged} of {shaded} shaded pixels lie within rounding of an edge")
    # Where a pixel's box is part emitter or part background the shares are random, and are not compared.
    whole = ~ours.unjudged
    for share in (ours.emitter, ours.background, reference.emitter, reference.background):
        whole = whole & ((share == 0) | (share == 1))
    other = whole & ((ours.emitter != reference.emitter) | (ours.background != reference.background))
    if other.any():
        failures.append(f"{int(other.sum())} pixels show an emitter or the background on one side only")
    plain = whole & finite & ~other & ((ours.emitter == 1) | (ours.background == 1))
    off = (np.abs(ours.mean - reference.mean) > ROUNDING * np.abs(reference.mean)).any(axis=0)
    if (plain & off).any():
        failures.append(f"{int((plain & off).sum())} emitter or background pixels differ beyond rounding")
    return failures


def _decide(interval: tuple[float, float], margin: float, failures: list[str]) -> tuple[Word, str]:
    low, high = interval
    where = f"the bias lies in [{low:+.3%}, {high:+.3%}]"
    if low > margin or high < -margin:
        failures = [f"{where}, outside the margin of {margin:.3%}", *failures]
    if failures:
        return "differs", "; ".join(failures)
    if -margin <= low and high <= margin:
        return "agrees", f"{where}, inside the margin of {margin:.3%}"
    return "undecided", f"{where}: {_advice(interval, margin)}"


def _advice(interval: tuple[float, float], margin: float) -> str:
    """How many times the samples would decide, if the bias is what it seems."""
    centre, half = (interval[0] + interval[1]) / 2, (interval[1] - interval[0]) / 2
    room = abs(margin - abs(centre))
    factor = 1.3 * (half / room) ** 2 if room > 0 else math.inf
    if factor > 1e4:
        return "it sits on the margin; declare another margin"
    return f"about {max(2, math.ceil(factor))} times the samples would decide"
