"""Pixels whose edges cannot be cut: where too many meet, or the books do not balance. Rays tell what they show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.estimators.common_points import lattice
from nusselt.renderer.vectors import Floats, Ints

from .moments import Pieces
from .regions import Regions

SAMPLED = 64, 8192
"""Least and most rays in a pixel that cannot be cut exactly."""
ALL = 1 << 20
"""Rays in all such pixels, beyond the least."""
HALF_PLANE = 0.5
"""Error of the share that n points of a lattice give of a half-plane, times n^(3/4)."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """Pixels (n,), in order, whose pieces were found by rays, and the error of a piece's share."""

    pixel: Ints
    error: float


def rays_in(pixels: Ints, among: int, tolerance: float) -> Floats:
    """Where rays are sent in each of some pixels ``among`` so many, (2, n): a sixth of the tolerance is their error."""
    most = 36 * HALF_PLANE**2 * pixels.size / among / tolerance**2
    afford = min(SAMPLED[1], ALL // max(pixels.size, 1))
    rays = lattice(max(SAMPLED[0], round(min(most ** (2 / 3), afford))))
    return np.asarray(rays + 0.5 / rays.shape[1])


def resampled(pieces: Pieces, pixels: Ints, rays: Floats, regions: Regions) -> Pieces:
    """Pieces of the given pixels from a lattice of rays instead."""
    if pixels.size == 0:
        return pieces
    count = rays.shape[1]
    row, column = np.divmod(pixels, regions.lens.width)
    x, y = (place[:, None] + offset for place, offset in ((column, rays[0]), (row, rays[1])))
    seen = regions.seen(x.ravel(), y.ravel())
    base = int(seen.max(initial=0)) + 2
    key, inverse = np.unique(np.repeat(pixels, count) * base + seen + 1, return_inverse=True)
    moments = (np.ones(seen.size), x.ravel(), y.ravel())
    total, sx, sy = (np.bincount(inverse, m) for m in moments)
    mx, my = sx / total, sy / total
    du, dv = x.ravel() - mx[inverse], y.ravel() - my[inverse]
    covariance = np.stack([np.bincount(inverse, product) / total for product in (du * du, du * dv, dv * dv)])
    kept = np.flatnonzero(~np.isin(pieces.cell, pixels))
    found = Pieces(key // base, key % base - 1, total / count, mx, my, covariance)
    return Pieces(
        *(
            np.concatenate((getattr(pieces, n)[..., kept], getattr(found, n)), axis=-1)
            for n in found.__dataclass_fields__
        )
    )


def shares_error(cell: Ints, value: Floats, sampled: Sampled) -> float:
    """Sum of squares of what the pieces' shares of sampled pixels may be wrong by: no refinement of values mends it."""
    k = np.flatnonzero(np.isin(cell, sampled.pixel))
    brightest = np.zeros(sampled.pixel.size)
    np.maximum.at(brightest, np.searchsorted(sampled.pixel, cell[k]), (value[:, k] ** 2).sum(axis=0))
    return float(brightest.sum()) * sampled.error**2
