"""Polygons cut by their ears: many of equal size at once.

An ear is a corner whose two neighbours see each other; it is cut off, and what is left has one corner fewer. Every
triangle that is cut off turns the way the polygon does, so together they cover it once: the signed areas of a
triangulation always sum to the polygon's.

References
----------
G. H. Meisters, "Polygons have ears", American Mathematical Monthly 82 (1975).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.surfaces import Floats

ROUNDING = 4e-15
"""Of a doubled area, where the polygon's extent is 1: a corner that turns by less is straight."""


def _turn(a: Floats, b: Floats, c: Floats) -> Floats:
    """Doubled area of the triangle: positive where a, b, c run counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


class _Rings:
    """What is left of every polygon: rings of corners, and how good an ear each corner is."""

    def __init__(self, points: Floats) -> None:
        _, self.polygons, self.corners = points.shape
        self.points, self.row = points, np.arange(self.polygons)
        ring = np.arange(self.corners)
        self.before = np.tile(np.roll(ring, 1), (self.polygons, 1))
        self.after = np.tile(np.roll(ring, -1), (self.polygons, 1))
        self.turns = _turn(np.roll(points, 1, axis=2), points, np.roll(points, -1, axis=2))
        self.quality = np.empty(self.turns.shape)
        for corner in ring:
            self._judge(np.full(self.polygons, corner))

    def _around(self, corner: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        return self.before[self.row, corner], corner, self.after[self.row, corner]

    def _judge(self, corner: NDArray[np.intp]) -> None:
        """Area over squared sides of the corner's triangle; -inf where it is no ear."""
        a, b, c = (self.points[:, self.row, k] for k in self._around(corner))
        area = self.turns[self.row, corner]
        sides = sum(((p - q) ** 2).sum(axis=0) for p, q in ((a, b), (b, c), (c, a)))
        a, b, c = a[..., None], b[..., None], c[..., None]
        p = self.points
        inside = (_turn(a, b, p) >= 0) & (_turn(b, c, p) >= 0) & (_turn(c, a, p) >= 0)
        same = [(p == q).all(axis=0) for q in (a, b, c)]  # where a ring touches itself its corners come twice
        blocked = (inside & (self.turns <= ROUNDING) & ~(same[0] | same[1] | same[2])).any(axis=1)
        good = np.maximum(area, 0) / np.maximum(sides, np.finfo(float).tiny)
        self.quality[self.row, corner] = np.where(blocked | ~(area >= -ROUNDING), -np.inf, good)

    def cut(self) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Cut the best ear of every ring: its three corners (3, m), and whether there was one."""
        best = self.quality.argmax(axis=1)
        before, _, after = ear = self._around(best)
        is_ear = self.quality[self.row, best] >= 0
        self.after[self.row, before], self.before[self.row, after] = after, before
        self.quality[self.row, best], self.turns[self.row, best] = -np.inf, np.inf  # gone, and in nobody's way
        for corner in (before, after):
            self.turns[self.row, corner] = _turn(*(self.points[:, self.row, k] for k in self._around(corner)))
        for corner in (before, after):
            self._judge(corner)
        return np.stack(ear), is_ear


def cut_ears(points: Floats) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Triangles of polygons in the plane.

    Parameters
    ----------
    points : (2, m, n) float64
        Corners of m polygons of n corners, counter-clockwise, of extent about 1.

    Returns
    -------
    triangles : (3, m, n - 2) int
        Numbers of corners, counter-clockwise.
    is_cut : (m,) bool
        False where some step found no ear: the polygon crosses itself.
    """
    rings = _Rings(points)
    cuts = [rings.cut() for _ in range(rings.corners - 2)]
    return np.stack([ear for ear, _ in cuts], axis=2), np.all([good for _, good in cuts], axis=0)
