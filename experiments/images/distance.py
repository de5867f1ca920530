"""How far one image is from another: the field's figures, over pixels that are finite in both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from scipy import ndimage

from nusselt.renderer.vectors import Bools, Floats

from .formats.png import to_levels

EPSILON = 0.01
"""Added to the square of the reference: Rousselle et al. 2011, and pbrt's `imgtool`."""
WINDOW = 7
"""Side of the window of the structural similarity, in pixels."""
Pixels = np.ndarray[Any, np.dtype[np.float32]]
"""An image (h, w, 3), as FLIP takes it."""
NEIGHBOURS = 3
"""Side of the squares of pixels over which a variance that two seeds tell is averaged."""


@dataclass(frozen=True)
class Pair:
    """Two sides of a comparison.

    Parameters
    ----------
    a, b : (n, 3, h, w) float64
        Radiance, an image a seed.
    levels : bool
        Whether either was read from whole levels.
    """

    a: Floats
    b: Floats
    levels: bool = False

    @property
    def means(self) -> tuple[Floats, Floats]:
        """Each side's mean over its seeds, (3, h, w)."""
        return self.a.mean(axis=0), self.b.mean(axis=0)

    @property
    def finite(self) -> Bools:
        """Pixels (h, w) that are finite in every image."""
        return np.asarray(np.isfinite(self.a).all(axis=(0, 1)) & np.isfinite(self.b).all(axis=(0, 1)))

    @property
    def signed(self) -> Floats:
        """A − B (h, w), mean of the channels, over B's mean; 0 where B is black all over."""
        a, b = self.means
        size = abs(float(b[:, self.finite].mean())) if self.finite.any() else 0.0
        with np.errstate(invalid="ignore"):
            return np.asarray((a - b).mean(axis=0) / size) if size else np.zeros(b.shape[1:])

    @property
    def variance(self) -> Floats | None:
        """Of A − B (h, w), mean of the channels, from both sides' seeds; None where a side has one image."""
        if min(len(self.a), len(self.b)) < 2:
            return None
        with np.errstate(invalid="ignore"):
            return np.asarray(sum(side.mean(axis=1).var(axis=0, ddof=1) / len(side) for side in (self.a, self.b)))


def z_scores(pair: Pair) -> tuple[Floats, float] | None:
    """A − B in standard errors: pixel by pixel (h, w), variances averaged over their neighbours, and of the mean.

    The mean's takes pixels to be independent. None where a side has one image.
    """
    variance = pair.variance
    if variance is None:
        return None
    a, b = (np.where(pair.finite, side.mean(axis=0), 0.0) for side in pair.means)
    known = np.where(pair.finite, variance, 0.0)
    around = ndimage.uniform_filter(known, NEIGHBOURS, mode="reflect")
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.where(a == b, 0.0, (a - b) / np.sqrt(np.maximum(around, 0.0)))
        total = float(np.float64((a - b).sum()) / np.sqrt(known.sum())) if (a != b).any() else 0.0
    return np.where(pair.finite, z, np.nan), total


def relative_mse(pair: Pair) -> float:
    """Mean of (A − B)² / (B² + 0.01) over pixels and channels."""
    a, b = (side[:, pair.finite] for side in pair.means)
    return float(np.mean((a - b) ** 2 / (b**2 + EPSILON))) if a.size else float("nan")


def similarity(pair: Pair) -> float | None:
    """Structural similarity (Wang et al. 2004) of the two as eight-bit pictures; None below 7 pixels a side."""
    from skimage.metrics import structural_similarity

    if min(pair.a.shape[-2:]) < WINDOW:
        return None
    a, b = map(to_levels, pair.means)
    return float(structural_similarity(a, b, channel_axis=0, win_size=WINDOW))


def flip(pair: Pair) -> tuple[float, str] | None:
    """Mean FLIP (Andersson et al. 2020; of radiance HDR-FLIP, 2021) and its kind; None where its package is not there.

    Both are of linear values as sRGB shows them, at 67 pixels a degree; pixels that are not finite are alike.
    """
    try:
        evaluate = import_module("flip_evaluator").evaluate
    except ImportError:
        return None
    test, reference = (_for_flip(side, pair) for side in pair.means)
    if pair.levels:
        kind, told = "LDR-FLIP", evaluate(reference, test, "LDR", inputsRGB=False, applyMagma=False)
    elif not (reference.any() or test.any()):
        return 0.0, "HDR-FLIP"
    else:
        exposures = _exposures(evaluate, reference, test)
        kind = "HDR-FLIP at exposures of what shows light" if exposures else "HDR-FLIP"
        told = evaluate(reference, test, "HDR", inputsRGB=False, applyMagma=False, parameters=exposures)
    return float(told[1]), kind


def _exposures(evaluate: Callable[..., Any], reference: Pixels, test: Pixels) -> dict[str, float]:
    """Those HDR-FLIP gives the pixels that show light, where most of the reference show none; else it finds its own.

    It raises its exposure until the median is bright: of a median of 0 by 2^24, at which nothing is dark enough. It is
    asked about light alone.
    """
    lit = reference.max(axis=2) > 0
    if 2 * lit.sum() >= lit.size:
        return {}
    light = reference[lit] if lit.any() else test[test.max(axis=2) > 0]
    some = np.ascontiguousarray(light[None])
    told = evaluate(some, some, "HDR", inputsRGB=False, applyMagma=False)[2]
    return {name: told[name] for name in ("startExposure", "stopExposure", "numExposures")}


def _for_flip(side: Floats, pair: Pair) -> Pixels:
    radiance = np.where(pair.finite, side, 0.0).clip(0, 1 if pair.levels else None)
    return np.ascontiguousarray(radiance.transpose(1, 2, 0), dtype=np.float32)
