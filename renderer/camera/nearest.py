"""Of what lies on a ray the one that is seen: the nearest, and of what ties within rounding always the same.

Faces that lie on each other are met at distances that differ in their last bits, by turns from pixel to pixel.
Tied are all hits that may be the nearest, each known to its own rounding. Of those one that turns its front to the
viewer is seen before one that turns its black back, a light before the surface it lies on, and then the first of the
scene. It takes all hits of a ray to say so, and nothing else: not the order, the blocks or the tile they came in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Floats, Ints, dot
from nusselt.renderer.watertight import PLANE_ULPS, SLOPE_ULPS, largest, one_norm

MANY = 1 << 20
"""Hits kept before those are let go that cannot be seen any more: bounds the memory."""


@dataclass(frozen=True)
class Planes:
    """Planes of triangles about one origin.

    Parameters
    ----------
    nearness : (3, t) float64
        Times a direction d: one over the distance along it to the plane (Olano & Greer 1997).
    height, slope : (t,) float64
        Its rounding: relative to itself, from the origin's height over the plane; and relative to |d|_1.
    back : (t,) bool
        Whether the origin lies behind it.
    live : (t,) bool
        Whether it does not lie in it.
    """

    nearness: Floats
    height: Floats
    slope: Floats
    back: NDArray[np.bool_]
    live: NDArray[np.bool_]

    @classmethod
    def about(cls, normal: Floats, a: Floats, origin: Floats) -> Planes:
        """Planes through points a (3, t)."""
        height, size = dot(a - origin, normal), one_norm(normal)
        bound = PLANE_ULPS * size * (largest(a) + largest(origin))
        away = np.abs(height)
        live = away > bound
        safe = np.where(live, away, 1.0)
        back = height > 0
        nearness = normal / np.where(back, safe, -safe)
        return cls(nearness, bound / safe, SLOPE_ULPS * size / safe, back, live)


def precedence(geometry: Geometry, back: NDArray[np.bool_], among: Ints | None = None) -> Ints:
    """Ranks of triangles (all, or some) with the eye at their ``back`` (t,) or not; least first, no two the same."""
    surface = geometry.triangle_surface if among is None else geometry.triangle_surface[among]
    return np.arange(back.size) + back.size * (2 * back + (geometry.light[surface] < 0))


class Nearest:
    """Hits along directions d (3, n), told in any order.

    Parameters
    ----------
    d : (3, n) float64
    """

    def __init__(self, d: Floats) -> None:
        self.d, self.size = d, one_norm(d)
        self.sure = np.zeros(d.shape[1])  # some hit is at least as near
        self.hits: list[list[Any]] = []  # ray, name, one over the distance, the most that may be, what was told
        self.held = 0

    def meet(self, planes: Planes, k: Ints, ray: Ints, names: Ints | None, *told: Floats) -> None:
        """Pairs (m,) of a plane and a direction inside its triangle, to be known as ``names`` (t,) if not by number.

        Those that run along their plane or away from it hit nothing. What else is ``told`` of a pair (m,) is kept.
        """
        near = dot(take(planes.nearness, k), take(self.d, ray))
        slope = take(planes.slope, k) * take(self.size, ray)
        rounding = take(planes.height, k) * near + slope
        hit = np.flatnonzero(near > slope)
        pairs = [ray, near - rounding, k if names is None else take(names, k), near, near + rounding, *told]
        if hit.size < k.size:
            pairs = [take(values, hit) for values in pairs]
        np.maximum.at(self.sure, pairs[0], pairs.pop(1))
        self.hits.append(pairs)
        self.held += pairs[0].size
        if self.held > MANY:
            whole, tied = self._tied()
            self.hits, self.held = [[take(values, tied) for values in whole]], 0

    def _tied(self) -> tuple[list[Any], Ints]:
        """All hits, and which of them may still be seen."""
        whole = self.hits[0]
        if len(self.hits) > 1:
            whole = [np.concatenate(parts) for parts in zip(*self.hits, strict=True)]
        return whole, np.flatnonzero(whole[3] >= take(self.sure, whole[0]))

    def seen(self, order: Ints) -> tuple[Floats, Ints, list[Floats]]:
        """One over the distance (n,), what is seen (n,), and what was told of it; 0 and -1 where there is nothing.

        Parameters
        ----------
        order : (t,) int64
            `precedence` of what there is to hit.
        """
        n = self.sure.size
        if not self.hits:
            return np.zeros(n), np.full(n, -1), []
        (ray, name, near, _, *told), tied = self._tied()
        ray, rank = take(ray, tied), take(order, take(name, tied))
        first = np.full(n, np.iinfo(np.int64).max)
        np.minimum.at(first, ray, rank)
        won = np.flatnonzero(rank == take(first, ray))
        ray, won = take(ray, won), take(tied, won)

        def spread(values: Any, nothing: int) -> Any:
            out = np.full(n, nothing, dtype=values.dtype)
            out[ray] = take(values, won)
            return out

        return spread(near, 0), spread(name, -1), [spread(values, 0) for values in told]
