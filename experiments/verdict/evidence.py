"""What the rules look at: two sides at the same pixels, b rows at once. A report's row is a batch of one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.vectors import Bools, Floats

from .alike import Alike
from .intervals import average
from .side import Seen, Side

TILES = 8
"""Tiles a side."""
TILE_MARGIN = 10
"""A tile's margin, a channel's and a single pixel's, in margins of the pooled mean: they see places, not hairs."""
CHANCE = 1e-3
"""How often an image without likeness has its interval widened by one."""
STILL = 2
"""Passes, at most, of a reference in which nothing is random."""
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
        What one pass should have: Mitsuba's for the same strategy and number of samples, or our estimator's.
    offset : (h, w) float64, optional
        The bias that the reference's own shadow rays bring there, radiance.
    sampled : (h, w) bool, optional
        Pixels whose value of ours may be random, by scene and estimator; None: all, if there are several passes.
    grain, reference_grain : (h, w) float64, optional
        See `Side`.
    freedom : float, optional
        Degrees of freedom of our pixels' variance; None: the passes less one.
    claims_variance : bool
        Whether another variance is a defect of ours, or only to be said.
    dark : str
        Why there is no light to judge, where it is known.
    """

    shares_points: bool = False
    variance: Floats | None = None
    offset: Floats | None = None
    sampled: Bools | None = None
    grain: Floats | None = None
    reference_grain: Floats | None = None
    freedom: float | None = None
    claims_variance: bool = True
    dark: str = ""


NO_EXPECTATIONS = Expectations()


@dataclass(frozen=True)
class Evidence:
    """All of b rows of images of one size.

    Parameters
    ----------
    ours, reference : Side
    shape : (int, int)
        Height and width of the images.
    place : (n,) int64
        Row-major number of each judged pixel.
    everywhere : (Seen, Seen)
        Ours and the reference at every pixel.
    unjudged : (p,) bool
        Pixels within rounding of an edge, which no rule judges.
    margin : float
        Relative bias declared not to matter, above 0.
    shares_points : bool
        See `Expectations`.
    still : (n,) bool
        Pixels that are known to be without noise on either side.
    variance : (b, n) float64, optional
        What the variance of our mean should be.
    offset : (n,) float64 or 0
        See `Expectations`.
    noise : (b, h, w) float64, optional
        One pass of ours less the mean of all: what is left of it is noise, alike on no two pixels.
    partial : (Side, Side), optional
        The pixels that are in part a light or nothing.
    claims_variance, dark
        See `Expectations`.
    """

    ours: Side
    reference: Side
    shape: tuple[int, int]
    place: NDArray[np.int64]
    everywhere: tuple[Seen, Seen]
    unjudged: Bools
    margin: float
    shares_points: bool = False
    variance: Floats | None = None
    offset: Floats | float = 0.0
    noise: Floats | None = None
    partial: tuple[Side, Side] | None = None
    still: Bools | bool = False
    claims_variance: bool = True
    dark: str = ""

    @property
    def tile(self) -> NDArray[np.int64]:
        """Which of the 8 x 8 tiles each judged pixel belongs to, (n,), row by row."""
        return np.asarray(tile_numbers(*self.shape).ravel()[self.place])

    def spread_out(self, values: Floats) -> Floats:
        """Values (b, n) of the judged pixels in their places, (b, h, w); 0 elsewhere."""
        image = np.zeros((values.shape[0], self.shape[0] * self.shape[1]))
        image[:, self.place] = values
        return image.reshape(-1, *self.shape)

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

    def seen(side: Image | Reference) -> Seen:
        channels = side.mean.shape[0]
        return Seen(side.mean.reshape(1, channels, -1), side.emitter.reshape(1, -1), side.background.reshape(1, -1))

    def both(where: Bools) -> tuple[Side, Side]:
        def at(values: Floats) -> Floats:
            return values[None, ..., where]

        def of(grain: Floats | None) -> Floats | None:
            return None if grain is None else grain[where]

        sampled = bool(_sampled(ours, passes, expectations)[where].any())
        return Side(
            "ours",
            at(ours.mean),
            at(ours.variance) / passes,
            at(ours.pixel_variance) / passes,
            ours.pass_means[None],
            expectations.shares_points,
            sampled,
            of(expectations.grain),
            expectations.shares_points,
            max(passes - 1, 1) if expectations.freedom is None else expectations.freedom,
            ours.clumping * alike.clumping,
        ), Side(
            "the reference",
            at(reference.mean),
            at(reference.standard_error) ** 2,
            at(reference.pixel_standard_error) ** 2,
            reference.pass_means[None],
            True,
            reference.pass_means.size > STILL,
            of(expectations.reference_grain),
            freedom=max(reference.pass_means.size - 1, 1),
        )

    judged = judged_pixels(ours, reference)
    noise = None if passes == 1 else np.where(judged, (ours.first - ours.mean).mean(axis=0), 0.0)
    alike = Alike() if noise is None or expectations.shares_points else Alike.of(noise, CHANCE)
    mixed = _mixed(ours, reference)
    variance, offset = expectations.variance, expectations.offset
    mine, theirs = both(judged)
    return Evidence(
        mine,
        theirs,
        shape=judged.shape,
        place=np.flatnonzero(judged),
        everywhere=(seen(ours), seen(reference)),
        unjudged=unjudged(ours, reference).ravel(),
        margin=margin,
        shares_points=expectations.shares_points,
        variance=None if variance is None else variance[None, judged] / passes,
        offset=0.0 if offset is None else offset[judged],
        noise=None if noise is None else noise[None],
        partial=both(mixed) if mixed.any() else None,
        still=~_sampled(ours, passes, expectations)[judged] & (reference.pass_means.size <= STILL),
        claims_variance=expectations.claims_variance,
        dark=expectations.dark,
    )


def _sampled(ours: Image, passes: int, expectations: Expectations) -> Bools:
    """Pixels (h, w) whose value of ours may be random."""
    if expectations.sampled is not None:
        return expectations.sampled
    return np.full(ours.emitter.shape, passes > 1 or bool(ours.pixel_variance.any()))


def _mixed(ours: Image, reference: Reference) -> Bools:
    """Pixels (h, w) that are in part a light or nothing, on either side."""
    shares = np.stack((ours.emitter, ours.background, reference.emitter, reference.background))
    part = ((shares > 0) & (shares < 1)).any(axis=0)
    return np.asarray(part & np.isfinite(ours.mean).all(axis=0) & ~unjudged(ours, reference))


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
