"""Is every pixel right, and every block of 3 x 3? Few wrong pixels vanish in means.

A pixel's noise is not what its few passes show: rare hits would make it nothing. Four times that, or its neighbours',
and one more sample, is taken; but no more than there can be: values between 0 and a grain b have no more variance
than b times their mean. Bennett's inequality (1962) then bounds both tails, at any number of samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import ndimage, special

from nusselt.experiments.verdict.evidence import ROUNDING, TILE_MARGIN, Evidence
from nusselt.experiments.verdict.intervals import average
from nusselt.experiments.verdict.quantiles import student_quantile
from nusselt.experiments.verdict.rule import Finding
from nusselt.experiments.verdict.side import Side
from nusselt.renderer.vectors import Bools, Floats
from nusselt.renderer.words import count as counted

BLOCK = 3
"""Pixels a side."""
SAFETY = 4.0
"""How many times its estimate, of few passes and of unlike neighbours, a pixel's variance may be."""
NAMED = 3
"""Pixels that are named."""


@dataclass(frozen=True)
class Pixels:
    """Fails where a pixel or a block is off by more than its margin and beyond noise.

    Says nothing where no grain is known, nor where pixels share their light points.
    """

    name: str = "pixels"
    share: float = 2.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        ours, theirs = evidence.ours, evidence.reference
        if evidence.shares_points or _unbounded(ours) or _unbounded(theirs) or not evidence.place.size:
            return Finding(evidence.nowhere, lambda k: "", figures={"pixels_off": None, "finds_pixel": None})
        each = level / 4 / evidence.place.size
        factor = noise_factor(evidence)
        off = self._pixels(ours, theirs, evidence, factor, each)
        blocks = self._blocks(evidence, factor, each)
        mixed = np.zeros((off.shape[0], 0), dtype=bool)
        if evidence.partial:
            mixed = self._pixels(*evidence.partial, evidence, factor, level / 4 / evidence.partial[0].mean.shape[-1])
        count, some, edges = off.sum(axis=1), np.asarray(blocks.any(axis=1) & ~off.any(axis=1)), mixed.sum(axis=1)
        figures = {"pixels_off": count + edges, "finds_pixel": _finds(evidence, factor, each)}

        def say(k: int) -> str:
            said = []
            if count[k]:
                said.append(f"{counted(count[k], 'pixel', 'is')} off beyond any noise, {_named(evidence, off[k])}")
            if some[k]:
                said.append(f"blocks of 3 x 3 pixels are off, {_named(evidence, blocks[k])}")
            if edges[k]:
                said.append(f"{counted(edges[k], 'pixel', 'is')} off on the edge of a light or of the background")
            return "; ".join(said)

        return Finding((count > 0) | some | (edges > 0), say, figures=figures)

    @staticmethod
    def _pixels(ours: Side, theirs: Side, evidence: Evidence, factor: Floats, level: float) -> Bools:
        mean = np.maximum(ours.grey, theirs.grey)
        size = np.abs(ours.grey - theirs.grey) - _allowed(evidence, mean, ours is evidence.ours)
        variance, grain = bounded(evidence, (ours, theirs), mean, factor)
        return np.asarray(tail(np.maximum(size, 0.0), variance, grain) < np.log(level / 2))

    @staticmethod
    def _blocks(evidence: Evidence, factor: Floats, level: float) -> Bools:
        ours, theirs = evidence.ours, evidence.reference
        total = partial(around, evidence)
        count = total(np.ones(evidence.difference.shape))
        variance = np.zeros(evidence.difference.shape)
        grain = np.zeros(evidence.difference.shape)
        for side in (ours, theirs):
            if side.sampled:
                smooth = np.maximum(side.grey_variance, total(side.grey_variance) / count)
                variance += total(smooth)
                grain = np.maximum(grain, side.grain if side.grain is not None else 0.0)
        grain = grain * np.maximum(factor, 1.0)[:, None]
        noise = np.sqrt(variance + np.log(2 / level) * total(grain**2)) / count
        mean = total(np.maximum(ours.grey, theirs.grey)) / count
        own = total(np.broadcast_to(np.abs(evidence.offset), mean.shape)) / count
        allowed = TILE_MARGIN * evidence.margin * np.maximum(evidence.scale[:, None], mean) + 3 * own
        freedom = min((side.freedom for side in (ours, theirs) if side.sampled), default=1.0)
        quantile = student_quantile(level / 2, BLOCK**2 * freedom)
        return np.asarray(
            (np.abs(total(evidence.difference) / count) > quantile * noise + allowed) & (count == BLOCK**2)
        )


def tail(size: Floats, variance: Floats, grain: Floats) -> Floats:
    """Log of Bennett's bound of the chance that a sum is off by ``size`` to one side; -inf where nothing is random."""
    with np.errstate(divide="ignore", invalid="ignore"):
        u = grain * size / variance
        log = -variance / grain**2 * (special.xlog1py(1 + u, u) - u)
    return np.where(variance > 0, log, np.where(size > 0, -np.inf, 0.0))


def noise_factor(evidence: Evidence) -> Floats:
    """How much larger the noise of ours is than it is expected to be, (b,), at least 1: so much larger are its grains.

    Without the hundredth of the pixels that has most of it: noise that is concentrated is a finding.
    """
    ours = evidence.ours.grey_variance
    if evidence.variance is None or evidence.claims_variance:
        return np.ones(len(ours))
    kept = ours <= np.quantile(ours, 0.99, axis=-1, keepdims=True)
    mine, expected = average(np.where(kept, ours, 0.0)), average(np.where(kept, evidence.variance, 0.0))
    return np.maximum(np.divide(mine, expected, out=np.ones_like(mine), where=expected > 0), 1.0)


def _unbounded(side: Side) -> bool:
    return side.sampled and side.grain is None


def bounded(evidence: Evidence, sides: tuple[Side, Side], mean: Floats, factor: Floats) -> tuple[Floats, Floats]:
    """Bounds of the variance of a pixel's difference and of what one sample brings to it, (b, n).

    Parameters
    ----------
    mean : (b, n) float64
    factor : (b,) float64
        See `noise_factor`.
    """
    variance, largest = np.zeros(mean.shape), np.zeros(mean.shape)
    for side, times in zip(sides, (np.reshape(factor, (-1, 1)), np.ones(())), strict=True):
        if side.sampled and side.grain is not None:
            grain = np.broadcast_to(side.grain, mean.shape) * times
            seen = side.grey_variance
            if sides[0] is evidence.ours:
                seen = np.maximum(seen, around(evidence, seen) / around(evidence, np.ones(seen.shape)))
            variance = variance + np.minimum(np.maximum(mean, 0.0) * grain, SAFETY * seen + grain**2)
            largest = np.maximum(largest, grain)
    return variance, largest


def around(evidence: Evidence, values: Floats) -> Floats:
    """Sums over each judged pixel's block of 3 x 3, (b, n)."""
    summed = ndimage.convolve(evidence.spread_out(values), np.ones((1, BLOCK, BLOCK)), mode="constant")
    return np.asarray(summed.reshape(len(values), -1)[:, evidence.place])


def _allowed(evidence: Evidence, mean: Floats, judged: bool = True) -> Floats:
    """What a pixel may be off by, (b, n): its margin; where judged, also thrice the reference's own shadow offset."""
    margin = (TILE_MARGIN * evidence.margin + ROUNDING) * np.maximum(evidence.scale[:, None], np.abs(mean))
    return np.asarray(margin + (3 * np.abs(evidence.offset) if judged else 0.0))


def _finds(evidence: Evidence, factor: Floats, level: float) -> Floats:
    """What half of the pixels, missing or doubled, would be found at, (b,), relative: about."""
    mean = evidence.reference.grey
    variance, _ = bounded(evidence, (evidence.ours, evidence.reference), mean, factor)
    return np.asarray(
        np.median(_allowed(evidence, mean) + np.sqrt(2 * np.log(2 / level) * variance), axis=1) / evidence.scale
    )


def _named(evidence: Evidence, off: Bools) -> str:
    row, column = np.divmod(evidence.place[off][:NAMED], evidence.shape[1])
    places = ", ".join(f"({x}, {y})" for x, y in zip(column, row, strict=True))
    return f"at {places}" + (" ..." if off.sum() > NAMED else "")
