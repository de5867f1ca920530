"""Is the image right, and how sure are we?

The bias is the mean over shaded pixels of (ours - reference); its interval holds the noise of both sides. It
decides; the other rules say where, and look at what a mean cannot see. The family-wise false-alarm rate of a report
is declared beforehand and split among the rules: see `rules` and `level`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.vectors import Bools, Floats

from .course import CourseScore, course_score
from .decision import Word, decide
from .evidence import (
    NO_EXPECTATIONS,
    ROUNDING,
    Expectations,
    evidence_of,
    judged_pixels,
    pixel_counts,
    unjudged,
)
from .intervals import error_of_mean
from .level import Level, findings

NoiseWord = Literal["as expected", "noisier", "quieter", "alike"]


@dataclass(frozen=True)
class Verdict:
    """All that is said of one row; "relative" is to the reference's mean over shaded pixels.

    The fields are those of `results.json`; ``tiles`` and ``tile_p`` are (8, 8), ``shaded`` is (h, w). ``broken``:
    something that no estimator computes differs. ``more``: how many times the samples would decide. ``noise_word``:
    what its noise is beside the expected, "alike" where pixels have it in common. ``finds``: what contrast, residual
    (RMS) and single pixel this row would have found, relative.
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
    noise_word: NoiseWord | None
    noise_alike: float | None
    pixels_off: int | None
    finds: dict[str, float | None]
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


def judge(
    ours: Image,
    reference: Reference,
    *,
    passes: int,
    margin: float,
    level: Level,
    expectations: Expectations = NO_EXPECTATIONS,
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
    expectations : Expectations
    """
    evidence = evidence_of(ours, reference, passes, margin, expectations)
    said = findings(evidence, level)
    word, reason, more = decide(said.values())
    figures = {name: _of_row(value) for finding in said.values() for name, value in finding.figures.items()}
    judged = judged_pixels(ours, reference)
    noise = {name: figures.pop(name) for name in ("bias_relative_standard_error", "bias_relative_freedom")}
    finds = {name: figures.pop(f"finds_{name}") for name in ("contrast", "rms", "pixel")}
    scale = float(evidence.scale[0])
    return Verdict(
        word=word,
        reason=reason,
        more=more,
        pixels=pixel_counts(ours) | {"shaded": int(judged.sum()), "unjudged": int(unjudged(ours, reference).sum())},
        reference_error_relative=reference.pooled_error / scale,
        **_errors(ours, reference, judged, scale),
        variance=float(ours.pixel_variance[judged].mean()) if judged.any() else 0.0,
        course=course_score(ours, reference, passes),
        shaded=judged,
        noise_word=_noise_word(figures.pop("variance_off"), figures["variance_ratio"], figures["noise_alike"]),
        finds=finds,
        noise=noise | _noise_of_figures(ours, reference, judged, scale),
        **figures,
    )


def _noise_word(off: bool | None, ratio: float | None, alike: float | None) -> NoiseWord | None:
    """What is said of the noise; None where it could not be compared."""
    if alike is not None:
        return "alike"
    if off is None or ratio is None:
        return None
    return ("noisier" if ratio > 1 else "quieter") if off else "as expected"


def _of_row(values: Any) -> Any:
    """A figure of the only row: a number, a pair, an array or a dict of them; None where there is none."""
    if isinstance(values, dict):
        return {name: _of_row(value) for name, value in values.items()}
    if values is None or (values.ndim < 3 and np.isnan(values[0]).any()):
        return None
    row = values[0]
    return row.item() if row.ndim == 0 else tuple(row.tolist()) if row.ndim == 1 else row


def _errors(ours: Image, reference: Reference, judged: Bools, scale: float) -> dict[str, Any]:
    """RMS error of the first pass."""
    square = (ours.first - reference.mean).mean(axis=0)[judged] ** 2
    rms = math.sqrt(float(square.mean())) if judged.any() else 0.0
    return {"rms": rms, "rms_relative": rms / scale}


def _noise_of_figures(ours: Image, reference: Reference, judged: Bools, scale: float) -> dict[str, float | None]:
    """The standard errors by which two runs are compared, and one pass's mean square error without the reference's."""
    square = ((ours.first - reference.mean).mean(axis=0) ** 2 - reference.pixel_standard_error**2) / scale**2
    return {
        "variance_standard_error": error_of_mean(ours.pixel_variance, judged),
        "mse_relative": float(square[judged].mean()) if judged.any() else None,
        "mse_relative_standard_error": error_of_mean(square, judged),
    }
