"""What the rules look at: two sides at the same pixels, b rows at once. A report's row is a batch of one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.vectors import Bools, Floats

from .intervals import average

TILES = 8
"""Tiles a side."""
TILE_MARGIN = 10
"""A tile's margin, a channel's and a single pixel's, in margins of the pooled mean: they see places, not hairs."""
ROUNDING = 2e-6
"""Relative rounding of Mitsuba's float32 radiance, as measured on noise-free pixels (5e-7 to 2e-6)."""


@dataclass(frozen=True)
class Expectations:
    """What is known of a row before its data are looked at.

    Parameters
    ----------
    shares_points : bool
        Whether our pixels share their light points (see `Estimator`): then only whole passes are independent.
    variance : (h, w) float64, optional
        What Mitsuba has for the same strategy and number of samples.
    tile_offset : (8, 8) float64, optional
        Size of the bias that the reference's own shadow rays bring there, radiance.
    """

    shares_points: bool = False
    variance: Floats | None = None
    tile_offset: Floats | None = None


NO_EXPECTATIONS = Expectations()


@dataclass(frozen=True)
class Side:
    """What one renderer says of the n judged pixels.

    Parameters
    ----------
    name : str
        For sentences.
    mean, variance : (b, c, n) float64
        Radiance in c channels, and the variance of that mean.
    grey_variance : (b, n) float64
        The same of the channels' average: a pixel's channels share their light samples.
    passes : (b, r) float64
        Mean over pixels and channels, pass by pass.
    by_passes : bool
        Whether the standard error of its pooled mean comes from the passes alone.
    """

    name: str
    mean: Floats
    variance: Floats
    grey_variance: Floats
    passes: Floats
    by_passes: bool

    @classmethod
    def of_passes(cls, name: str, passes: Floats, by_passes: bool) -> Side:
        """From all values (b, r, c, n) of r passes."""
        count, channels = passes.shape[1:3]
        variance = passes.var(axis=1, ddof=1, dtype=np.float64) / count
        grey = passes.mean(axis=2, dtype=np.float64)
        grey_variance = variance[:, 0] if channels == 1 else grey.var(axis=1, ddof=1) / count
        mean = passes.mean(axis=1, dtype=np.float64)
        return cls(name, mean, variance, grey_variance, grey.mean(axis=2), by_passes)

    @property
    def is_random(self) -> Bools:
        """(b,)"""
        return np.asarray(self.grey_variance.max(axis=-1, initial=0.0) > 0)


@dataclass(frozen=True)
class Seen:
    """One side at every pixel: radiance (b, c, p), and shares of camera rays that meet a light or nothing, (b, p)."""

    mean: Floats
    emitter: Floats
    background: Floats

    @property
    def is_whole(self) -> Bools:
        """Where no share is a random one, because a pixel's box is part emitter or part background."""
        shares = np.stack((self.emitter, self.background))
        return np.asarray(((shares == 0) | (shares == 1)).all(axis=0))

    @property
    def shaded(self) -> Bools:
        return np.asarray((self.emitter == 0) & (self.background == 0))


@dataclass(frozen=True)
class Evidence:
    """All of b rows of images of one size.

    Parameters
    ----------
    ours, reference : Side
    tile : (n,) int64
        Which of the 8 x 8 tiles each judged pixel belongs to, row by row.
    everywhere : (Seen, Seen)
        Ours and the reference at every pixel.
    unjudged : (p,) bool
        Pixels within rounding of an edge, which no rule judges.
    margin : float
        Relative bias declared not to matter, above 0.
    shares_points : bool
        See `Expectations`.
    clumping : float
        See `Image`.
    variance : (b, n) float64, optional
        What the variance of our mean should be.
    tile_offset : (8, 8) float64 or 0
        See `Expectations`.
    """

    ours: Side
    reference: Side
    tile: NDArray[np.int64]
    everywhere: tuple[Seen, Seen]
    unjudged: Bools
    margin: float
    shares_points: bool = False
    clumping: float = 1.0
    variance: Floats | None = None
    tile_offset: Floats | float = 0.0

    @cached_property
    def difference(self) -> Floats:
        """Ours minus the reference, (b, n), channels averaged."""
        return np.asarray((self.ours.mean - self.reference.mean).mean(axis=1))

    @cached_property
    def reference_mean(self) -> Floats:
        """(b,)"""
        return average(np.abs(self.reference.mean).mean(axis=1))

    @cached_property
    def scale(self) -> Floats:
        """What "relative" is to, (b,): one beside a black reference."""
        return np.where(self.reference_mean > 0, self.reference_mean, 1.0)

    @property
    def nowhere(self) -> Bools:
        """No row, (b,)."""
        return np.zeros(self.difference.shape[0], dtype=bool)


def judged_pixels(ours: Image, reference: Reference) -> Bools:
    """Pixels (h, w) that are shaded on both sides, finite, and away from edges."""
    finite = np.isfinite(ours.mean).all(axis=0)
    return np.asarray(
        ours.shaded & (reference.emitter == 0) & (reference.background == 0) & finite & ~unjudged(ours, reference)
    )


def unjudged(ours: Image, reference: Reference) -> Bools:
    """Pixels (h, w) on an edge, or where the reference's ray slips through a surface."""
    return ours.unjudged | (reference.holes > 0)


def evidence_of(
    ours: Image, reference: Reference, passes: int, margin: float, expectations: Expectations = NO_EXPECTATIONS
) -> Evidence:
    """A batch of one row; see `judge.judge`."""
    judged = judged_pixels(ours, reference)

    def at(values: Floats) -> Floats:
        return values[None, ..., judged]

    def seen(side: Image | Reference) -> Seen:
        channels = side.mean.shape[0]
        return Seen(side.mean.reshape(1, channels, -1), side.emitter.reshape(1, -1), side.background.reshape(1, -1))

    variance, offset = expectations.variance, expectations.tile_offset
    return Evidence(
        Side(
            "ours",
            at(ours.mean),
            at(ours.variance) / passes,
            at(ours.pixel_variance) / passes,
            ours.pass_means[None],
            expectations.shares_points,
        ),
        Side(
            "the reference",
            at(reference.mean),
            at(reference.standard_error) ** 2,
            at(reference.pixel_standard_error) ** 2,
            reference.pass_means[None],
            True,
        ),
        tile=tile_numbers(*judged.shape)[judged],
        everywhere=(seen(ours), seen(reference)),
        unjudged=unjudged(ours, reference).ravel(),
        margin=margin,
        shares_points=expectations.shares_points,
        clumping=ours.clumping,
        variance=None if variance is None else at(variance) / passes,
        tile_offset=0.0 if offset is None else offset,
    )


def tile_numbers(height: int, width: int) -> NDArray[np.int64]:
    """Which of the 8 x 8 tiles each pixel belongs to, (h, w), row by row."""
    rows = np.minimum(np.arange(height) * TILES // height, TILES - 1)
    columns = np.minimum(np.arange(width) * TILES // width, TILES - 1)
    return np.asarray(rows[:, None] * TILES + columns, dtype=np.int64)


def pixel_counts(ours: Image) -> dict[str, int]:
    """Pixels by what our camera sees there."""
    return {
        "shaded": int(ours.shaded.sum()),
        "emitter": int((ours.emitter > 0).sum()),
        "background": int((ours.background == 1).sum()),
        "unjudged": int(ours.unjudged.sum()),
    }
