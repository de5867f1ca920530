"""Is the image right, and how sure are we?

The bias is the mean over shaded pixels of (ours - reference); its interval holds the noise of both sides. It
decides; tiles say where; the variance and the spread of the passes have tests of their own. The family-wise
false-alarm rate of a report is declared beforehand and split: half to the pooled means, a quarter to tiles, a
quarter to the rest, each by Bonferroni over its tests, so that every interval exists before any p-value does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.vectors import Floats

from .colour import colour_failures
from .course import CourseScore, course_score
from .decision import Word, decide
from .earned import Side
from .inference import (
    TILES,
    Bias,
    Bools,
    Level,
    Tiles,
    denoised_root,
    error_of_mean,
    pooled_bias,
    resting_on,
    tile_biases,
)
from .plain_pixels import ROUNDING, exact_failures, pixel_counts, shaded_on_both, still_failures, too_many_unjudged
from .spreads import Ratio, pass_spread, variance_ratio

TILE_MARGIN = 10
"""A tile's margin, and a channel's, in margins of the pooled mean: it sees places, not hairs."""
POWER = 0.99


@dataclass(frozen=True)
class Verdict:
    """All that is said of one row; "relative" is to the reference's mean over shaded pixels.

    The fields are those of `results.json`; ``tiles`` and ``tile_p`` are (8, 8), ``shaded`` is (h, w). ``broken``:
    something that has no noise differs. ``more``: how many times the samples would decide.
    """

    word: Word
    reason: str
    broken: bool
    more: float | None
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
    variance_ratio: float | None
    variance_ratio_interval: tuple[float, float] | None
    pass_spread: float | None
    excess_kurtosis: dict[str, float | None]
    course: CourseScore
    non_finite: int
    tiles: Floats
    tile_p: Floats
    tiles_without_noise: int
    shaded: Bools
    noise: dict[str, float | None]


def standard_errors(ours: Image, reference: Reference, passes: int) -> Floats:
    """(mean of ours - reference) in standard errors of both sides, pixel by pixel, (h, w); 0 where exact."""
    difference = (ours.mean - reference.mean).mean(axis=0)
    scale = np.abs(reference.mean).mean(axis=0)
    noise = ours.pixel_variance / passes + reference.pixel_standard_error**2 + (ROUNDING * scale) ** 2
    return np.divide(difference, np.sqrt(noise), out=np.zeros_like(difference), where=noise > 0)


@dataclass(frozen=True)
class Prior:
    """What is known of a row before its data are looked at.

    Parameters
    ----------
    independent : bool
        Whether our pixels have random numbers of their own; else only whole passes count.
    variance : (h, w) float64, optional
        What Mitsuba has for the same strategy and number of samples.
    tile_offset : (8, 8) float64, optional
        Size of the bias that the reference's own shadow rays bring there, radiance.
    """

    independent: bool = True
    variance: Floats | None = None
    tile_offset: Floats | None = None


NOTHING = Prior()


def judge(
    ours: Image, reference: Reference, *, passes: int, margin: float, level: Level, prior: Prior = NOTHING
) -> Verdict:
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
    prior : Prior
    """
    ours = replace(ours, unjudged=ours.unjudged | (reference.holes > 0))
    finite: Bools = np.asarray(np.isfinite(ours.mean).all(axis=0))
    judged = shaded_on_both(ours, reference) & finite & ~ours.unjudged
    difference = (ours.mean - reference.mean).mean(axis=0)
    noise = ours.pixel_variance * ours.clumping / passes
    mean = float(np.abs(reference.mean).mean(axis=0)[judged].mean()) if judged.any() else 0.0
    scale = mean if mean > 0 else 1.0  # a black reference: relative to one
    broken = exact_failures(ours, reference, finite)
    by_passes = None if prior.independent else ours.pass_means
    bias = Bias(0.0, 0.0, 1e9)
    if judged.any():
        bias = pooled_bias(difference[judged], noise[judged], reference.pass_means, by_passes)
    objection = _objection(ours, reference, judged, prior)
    tiles = tile_biases(difference, noise + reference.pixel_standard_error**2, judged, ROUNDING * scale)
    ratio, spread = _variances(ours, judged, level, prior) if judged.any() else (None, None)
    failures = broken + _place_failures(tiles, level, margin, scale, prior) + _variance_failures(ratio, spread)
    failures += colour_failures(ours, reference, judged, passes, level.rest, (TILE_MARGIN * margin + ROUNDING) * scale)
    failures += still_failures(ours, reference, judged, TILE_MARGIN * margin + ROUNDING, scale)
    reach = bias.half_width(level.pooled, normal=not objection) / scale + ROUNDING
    interval = (bias.value / scale - reach, bias.value / scale + reach)
    word, reason, more = decide(interval, margin, failures, objection, too_many_unjudged(ours))
    root, roots = _denoised(ours, reference, judged, passes, level)
    one = (ours.first - reference.mean).mean(axis=0)[judged] if judged.any() else np.zeros(1)
    rms = math.sqrt(float((one**2).mean()))
    return Verdict(
        word=word,
        reason=reason,
        broken=bool(broken),
        more=more,
        pixels=pixel_counts(ours) | {"shaded": int(judged.sum())},
        reference_mean=mean,
        bias=bias.value,
        bias_relative=bias.value / scale,
        bias_interval=interval,
        reference_error_relative=_pooled_error(reference) / scale,
        minimum_detectable_bias=margin + reach + bias.reserve(POWER) / scale,
        rms=rms,
        rms_relative=rms / scale,
        rms_denoised_relative=root / scale,
        rms_denoised_interval=(roots[0] / scale, roots[1] / scale),
        variance=float(ours.pixel_variance[judged].mean()) if judged.any() else 0.0,
        variance_ratio=ratio.value if ratio else None,
        variance_ratio_interval=ratio.interval if ratio else None,
        pass_spread=spread.value if spread else None,
        excess_kurtosis={side.name: side.excess_kurtosis for side in _sides(ours, reference, judged, prior)},
        course=course_score(ours, reference, passes),
        non_finite=int((~finite).sum()),
        tiles=tiles.bias / scale,
        tile_p=tiles.p,
        tiles_without_noise=tiles.without_noise,
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


def _sides(ours: Image, reference: Reference, judged: Bools, prior: Prior) -> tuple[Side, Side]:
    return (
        Side("ours", ours.pixel_variance[judged], ours.pass_means, not prior.independent),
        Side("the reference", reference.pixel_standard_error[judged] ** 2, reference.pass_means, True),
    )


def _objection(ours: Image, reference: Reference, judged: Bools, prior: Prior) -> str:
    """Why the difference may not be normal; empty if nothing speaks against it."""
    return next((told for side in _sides(ours, reference, judged, prior) if (told := side.objection())), "")


def _place_failures(tiles: Tiles, level: Level, margin: float, scale: float, prior: Prior) -> list[str]:
    """Tiles off by more than their margin, or than the reference's own error there where that is larger."""
    if not prior.independent:
        return []  # a tile's noise is known from its pixels only
    offset = np.zeros((TILES, TILES)) if prior.tile_offset is None else prior.tile_offset
    failing = tiles.failing(level.tile, np.maximum(TILE_MARGIN * margin * scale, offset) + ROUNDING * scale)
    return [f"{failing} of {TILES * TILES} tiles are off by more than {TILE_MARGIN} margins"] if failing else []


def _variances(ours: Image, judged: Bools, level: Level, prior: Prior) -> tuple[Ratio | None, Ratio | None]:
    """Our variance over Mitsuba's, and the spread of our passes over what independent pixels would have."""
    noise = ours.pixel_variance[judged]
    ratio = None if prior.variance is None else variance_ratio(noise, prior.variance[judged], level.rest)
    if not prior.independent:
        return ratio, None
    count = ours.pass_means.size
    pooled = float(noise.sum()) / noise.size**2
    return ratio, pass_spread(ours.pass_means, pooled, max(count - 1, 1) * resting_on(noise), level.rest)


def _variance_failures(ratio: Ratio | None, spread: Ratio | None) -> list[str]:
    failures = []
    if ratio and ratio.fails:
        failures.append(f"the variance is {ratio.value:.3g} times Mitsuba's for the same strategy")
    if spread and spread.fails:
        failures.append(f"passes vary {spread.value:.3g} times as much as independent pixels would")
    return failures


def _denoised(
    ours: Image, reference: Reference, judged: Bools, passes: int, level: Level
) -> tuple[float, tuple[float, float]]:
    """RMS error of the limit, radiance: of the mean of all passes, both sides' noise taken out."""
    if not judged.any():
        return 0.0, (0.0, 0.0)
    square = (ours.mean - reference.mean).mean(axis=0)[judged] ** 2
    noise = ours.pixel_variance[judged] / passes + reference.pixel_standard_error[judged] ** 2
    return denoised_root(square - noise, level.pooled)


def _pooled_error(reference: Reference) -> float:
    passes = reference.pass_means
    return float(np.std(passes, ddof=1)) / math.sqrt(passes.size) if passes.size > 1 else 0.0
