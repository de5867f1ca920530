"""Triangles about one origin, as functions that are linear in the direction.

With a common origin the edge functions of a triangle (see `watertight`) are the same for all rays and linear
in the direction (Olano & Greer 1997). In a tile of an image the direction is affine in the pixel, so their
signs at the tile's four corners tell which triangles it can see at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Floats, Ints, dot
from nusselt.renderer.watertight import edge_functions, one_norm

from .nearest import Nearest, Planes, Standing, precedence, standing_before

BLOCK = 1 << 14
"""Triangle-ray pairs handled at once: they fit the cache, and are too few for a BLAS to bring its own threads along,
which stand in each other's way when all cores are busy.
"""


@dataclass(frozen=True, eq=False)
class Pencil:
    """All triangles about one origin, as rows that are linear in the direction.

    Parameters
    ----------
    rows : (4, 3, t) float64
        Three edge functions, turned so that all are positive inside, and a row that gives, times a direction, one
        over the distance along it to the triangle's plane (Olano & Greer 1997).
    slack : (3, t) float64
        The edge functions' rounding, relative to |d|_1.
    planes : Planes
    order : (t,) int64
        See `nearest.precedence`.
    standing : Standing
        See `nearest.standing_before`.
    """

    rows: Floats
    slack: Floats
    planes: Planes
    order: Ints
    standing: Standing

    @property
    def live(self) -> NDArray[np.bool_]:
        """Whether the origin lies off each plane, (t,)."""
        return self.planes.live

    @classmethod
    def about(cls, geometry: Geometry, origin: Floats, among: Ints | None = None) -> Pencil:
        """The pencil of an origin (3, 1), of all triangles or of some (then numbered anew)."""
        g = geometry
        corners = (g.a, g.b, g.c, g.normal)
        a, b, c, normal = corners if among is None else (take(v, among) for v in corners)
        pairs = edge_functions(a, b, c, origin)
        planes = Planes.about(normal, a, origin)
        side = np.where(planes.back, 1.0, -1.0)
        rows = np.stack((*(edge * side for edge, _ in pairs), planes.nearness))
        slack, order = np.stack([slack for _, slack in pairs]), precedence(g, planes.back, among)
        return cls(rows, slack, planes, order, standing_before(g, origin, among))

    def in_tile(self, corners: Floats, among: Ints | None = None) -> Ints:
        """Which triangles, of all or of some, can be hit by directions in the cone of four corner ones (3, 4)."""
        some = np.flatnonzero(self.live) if among is None else among
        rows = self.rows[..., some]
        highest = np.max([dot(np.moveaxis(rows, 1, 0), corner) for corner in corners.T[:, :, None, None]], axis=0)
        slack = 2 * self.slack[:, some] * one_norm(corners).max()
        return np.asarray(some[(highest[:3] >= -slack).all(axis=0) & (highest[3] > 0)])

    def nearest(self, d: Floats, chosen: Ints) -> tuple[Floats, Ints]:
        """One over the distance to what is seen of the chosen triangles along each direction, and which it is.

        0 and -1 where there is none; where several tie see `nearest`. All functions are rows of one product.
        """
        found, n, size = Nearest(d), d.shape[1], float(one_norm(d).max(initial=0))
        for first in range(0, n, BLOCK):
            some = d[:, first : first + BLOCK]
            step, hits = BLOCK // some.shape[1], []
            for start in range(0, chosen.size, step):
                block = chosen[start : start + step]
                rows = np.moveaxis(self.rows[..., block], 1, 2).reshape(-1, 3)
                w = (rows @ some).reshape(4, block.size, -1)
                inside = w[3] > 0
                for edge in (0, 1, 2):
                    inside &= w[edge] >= -size * self.slack[edge, block, None]
                hits.append(start * some.shape[1] + np.flatnonzero(inside))
            k, ray = np.divmod(np.concatenate([np.empty(0, dtype=np.int64), *hits]), some.shape[1])
            if ray.size:
                found.meet(self.planes, take(chosen, k), first + ray, None)
        near, which, _ = found.seen(self.order, self.standing)
        return near, which

    def weights(self, d: Floats, triangle: Ints) -> Floats:
        """Edge functions (3, n) of directions (3, n), each of its own triangle."""
        return np.stack([dot(take(edge, triangle), d) for edge in self.rows[:3]])
