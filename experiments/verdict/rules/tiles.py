"""Is it right everywhere? Welch's t in each of 8 x 8 tiles says where; it sees places, not hairs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from nusselt.experiments.verdict.evidence import ROUNDING, TILE_MARGIN, TILES, Evidence
from nusselt.experiments.verdict.quantiles import normal_quantile, student_quantile, student_tail
from nusselt.experiments.verdict.rule import Finding
from nusselt.renderer.vectors import Bools, Floats


@dataclass(frozen=True)
class TileBiases:
    """Bias by place.

    Parameters
    ----------
    bias, error, freedom, p : (b, 8, 8) float64
        Mean difference, its standard error and degrees of freedom, and the two-sided p-value of no bias; NaN
        where a tile has no pixel, and p also where it has no noise.
    """

    bias: Floats
    error: Floats
    freedom: Floats
    p: Floats

    def failing(self, level: float, margin: float | Floats) -> Floats:
        """How many tiles of each row lie beyond +-margin (radiance, one or (b, 8, 8)) at this false-alarm rate each."""
        margin = np.broadcast_to(margin, self.bias.shape)
        # A t quantile is never below the normal one: most tiles need no t.
        doubtful = np.abs(self.bias) > normal_quantile(level / 2) * self.error + margin
        reach = student_quantile(level / 2, self.freedom[doubtful]) * self.error[doubtful] + margin[doubtful]
        failing = np.zeros(doubtful.shape, dtype=bool)
        failing[doubtful] = np.abs(self.bias[doubtful]) > reach
        return np.asarray(failing.sum(axis=(-2, -1)))

    @property
    def without_noise(self) -> Floats:
        """Tiles of each row that have pixels and no noise: compared to rounding, and left out of the p-values."""
        return np.asarray((~np.isnan(self.bias) & np.isnan(self.p)).sum(axis=(-2, -1)))


def tile_biases(difference: Floats, noise: Floats, tile: NDArray[np.int64], rounding: Floats) -> TileBiases:
    """The mean of every tile's pixels.

    Parameters
    ----------
    difference, noise : (b, n) float64
        Ours minus the reference, and the variance of that from both sides.
    tile : (n,) int64
        See `evidence.tile_numbers`.
    rounding : (b,) float64
        Errors below this are no noise.
    """
    rows = len(noise)
    place = tile + TILES**2 * np.arange(rows)[:, None]

    def total(values: Floats) -> Floats:
        sums = np.bincount(place.ravel(), np.broadcast_to(values, place.shape).ravel(), minlength=rows * TILES**2)
        return np.asarray(sums, dtype=np.float64).reshape(rows, TILES, TILES)

    count = total(np.ones(()))
    size = np.maximum(count, 1)
    variance, squares = total(noise), total(noise**2)
    bias = np.where(count > 0, total(difference) / size, np.nan)
    error = np.sqrt(variance) / size
    freedom = np.divide(variance**2, squares, out=np.full(size.shape, 1e9), where=squares > 0)
    noisy: Bools = (count > 0) & (error > rounding[:, None, None])
    p = np.full(size.shape, np.nan)
    p[noisy] = 2 * student_tail(np.abs(bias[noisy]) / error[noisy], freedom[noisy])
    return TileBiases(bias, error, np.maximum(freedom, 1.0), p)


@dataclass(frozen=True)
class Tiles:
    """Fails where tiles are off by more than their margin, or than the reference's own error there if that is more.

    A tile's noise is not what its few passes show, where rare samples bring much: one more of the largest is taken, as
    in blocks of pixels. Where pixels share their light points a tile's noise is not known: then nothing fails.
    """

    name: str = "tiles"
    share: float = 3.0

    def __call__(self, evidence: Evidence, level: float) -> Finding:
        ours, reference, scale = evidence.ours, evidence.reference, evidence.scale[:, None, None]
        noise = ours.grey_variance * ours.clumping + reference.grey_variance
        tiles = tile_biases(evidence.difference, noise, evidence.tile, ROUNDING * evidence.scale)
        allowed = _of_offset(evidence.offset, evidence.tile)
        margin = np.maximum(TILE_MARGIN * evidence.margin * scale, allowed) + ROUNDING * scale
        rare = replace(tiles, error=np.hypot(tiles.error, _one_sample(evidence, level / TILES**2)))
        count = rare.failing(level / TILES**2, margin)
        figures = {"tiles": tiles.bias / scale, "tile_p": tiles.p, "tiles_without_noise": tiles.without_noise}
        return Finding(
            evidence.nowhere if evidence.shares_points else count > 0,
            lambda k: f"{count[k]} of {TILES**2} tiles are off by more than {TILE_MARGIN} margins" if count[k] else "",
            figures=figures,
        )


def _one_sample(evidence: Evidence, level: float) -> Floats:
    """What rare samples may add to the standard error of each tile's mean, (b, 8, 8); 0 where none are known.

    Grains of a single image are as coarse as its differences ask for, which mistakes do too: it is given none.
    """
    rows, tile = len(evidence.ours.grey), evidence.tile
    largest = np.zeros((rows, TILES**2))
    for side in (evidence.ours, evidence.reference):
        if side.sampled and side.grain is not None and side.passes.shape[1] > 1:
            grain = np.broadcast_to(side.grain, (rows, tile.size))
            np.maximum.at(largest, (np.arange(rows)[:, None], tile), grain)
    count = np.maximum(np.bincount(tile, minlength=TILES**2), 1)
    return np.asarray((np.sqrt(np.log(2 / level)) * largest / count).reshape(rows, TILES, TILES))


def _of_offset(offset: Floats | float, tile: NDArray[np.int64]) -> Floats:
    """Size (8, 8) of what the reference's own shadow rays bring: its mean and two of its standard errors."""
    step = np.broadcast_to(offset, tile.shape)
    count, total, square = (
        np.bincount(tile, weights, minlength=TILES**2) for weights in (np.ones(step.size), step, step**2)
    )
    size = np.maximum(count, 1)
    return np.asarray(np.abs(total / size) + 2 * np.sqrt(square) / size).reshape(TILES, TILES)
