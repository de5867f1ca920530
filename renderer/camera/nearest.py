"""Of what lies on a ray the one that is seen: the nearest, and of what ties within rounding always the same.

Faces that lie on each other are met at distances that differ in their last bits, by turns from pixel to pixel.
Tied are all hits that may be the nearest, each known to its own rounding. Of those one that turns its front to the
viewer is seen before one that turns its black back, a light before the surface it lies on, and then the first of the
scene. It takes all hits of a ray to say so, and nothing else: not the order, the blocks or the tile they came in.

A far eye cannot tell what the surfaces' own coordinates can: which of two planes a hardly visible step apart is the
outer one. Whatever is seen is then asked for its shadows, and those know. So of two tied surfaces the first is seen
only where the other does not stand before it beyond the rounding of shadow rays: else it would be seen in its shadow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Bools, Floats, Ints, dot
from nusselt.renderer.watertight import PLANE_ULPS, SLOPE_ULPS, edge_functions, largest, one_norm

MANY = 1 << 20
"""Hits kept before those are let go that cannot be seen any more: bounds the memory."""


@dataclass(frozen=True, eq=False)
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


Standing = Callable[[Ints, Ints, Floats], Bools]
"""Whether triangles ``over`` (m,) stand before the hits of ``under`` (m,) along directions (3, m)."""


def standing_before(geometry: Geometry, origin: Floats, among: Ints | None = None) -> Standing:
    """For triangles (all, or some) about an origin (3, 1): beyond the rounding that shadow rays have, and opaque."""

    def before(over: Ints, under: Ints, d: Floats) -> Bools:
        k, hit = (v if among is None else take(among, v) for v in (over, under))
        corners = take(geometry.a, hit), take(geometry.b, hit), take(geometry.c, hit)
        w = np.stack([dot(edge, d) for edge, _ in edge_functions(*corners, origin)])
        w = w / (w[0] + w[1] + w[2])
        p = w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2]  # as `first_hits` has it
        n, a = take(geometry.normal, k), take(geometry.a, k)
        height, eye = dot(n, p - a), dot(n, origin - a)
        beyond = np.abs(height) > PLANE_ULPS * one_norm(n) * (largest(a) + largest(p))
        opaque = [take(geometry.light, take(geometry.triangle_surface, t)) < 0 for t in (k, hit)]
        return np.asarray(beyond & ((height > 0) != (eye > 0)) & opaque[0] & opaque[1])

    return before


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

    def seen(self, order: Ints, standing: Standing) -> tuple[Floats, Ints, list[Floats]]:
        """One over the distance (n,), what is seen (n,), and what was told of it; 0 and -1 where there is nothing.

        Parameters
        ----------
        order : (t,) int64
            `precedence` of what there is to hit.
        standing : Standing
            `standing_before` of the same.
        """
        n = self.sure.size
        if not self.hits:
            return np.zeros(n), np.full(n, -1), []
        (ray, name, near, _, *told), tied = self._tied()
        won = self._first(take(ray, tied), take(name, tied), order, standing)
        ray, won = take(ray, take(tied, won)), take(tied, won)

        def spread(values: Any, nothing: int) -> Any:
            out = np.full(n, nothing, dtype=values.dtype)
            out[ray] = take(values, won)
            return out

        return spread(near, 0), spread(name, -1), [spread(values, 0) for values in told]

    def _first(self, ray: Ints, name: Ints, order: Ints, standing: Standing) -> Ints:
        """Which of tied hits (m,) are seen, one a ray."""
        rank, winner = take(order, name), np.full(self.sure.size, -1)
        winner[ray] = np.arange(ray.size)
        left = np.flatnonzero(take(np.bincount(ray, minlength=1), ray) > 1)
        while left.size:  # fewer each time: what is seen does not stand before itself
            mine = take(ray, left)
            first = np.full(winner.size, np.iinfo(np.int64).max)
            np.minimum.at(first, mine, take(rank, left))
            won = left[take(rank, left) == take(first, mine)]
            winner[ray[won]] = won
            seen = take(winner, mine)
            rivals = np.flatnonzero(left != seen)
            over, under = take(left, rivals), take(seen, rivals)
            left = over[standing(take(name, over), take(name, under), take(self.d, take(ray, over)))]
        return np.asarray(winner[winner >= 0])
