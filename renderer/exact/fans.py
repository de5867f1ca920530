"""Outlines of pieces as points see them: one column for each pair of a point and a piece."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import Ints
from ..vectors import Floats, cross, dot
from .heights import sharpened
from .light_cone import Bools, LightCone
from .lines import clip
from .occluders import Occluders


@dataclass(frozen=True)
class Fan:
    """Pairs of a point and a piece whose outlines have equally many edges.

    Parameters
    ----------
    point : (q,) int64
        Ascending.
    corners, planes : (3, k, q) float64
        The outline relative to the point, clockwise, and its edges' planes, which point inwards.
    """

    point: Ints
    corners: Floats
    planes: Floats

    def take(self, index: Ints) -> Fan:
        """Some of the pairs."""
        return Fan(self.point[index], self.corners[..., index], self.planes[..., index])

    def hides(self, light: LightCone) -> tuple[Floats, Floats]:
        """The part [lo, hi] (e, q) of each light edge that each pair hides."""
        start = self._heights(light.start[..., self.point])
        if light.closed:
            return clip(start, np.roll(start, -1, axis=1))
        return clip(start, self._heights(light.end[..., self.point]))

    def before(self, light: LightCone) -> tuple[Floats, Floats]:
        """The part [lo, hi] (k, q) of each outline's edge that lies in the light's cone."""
        height = dot(light.planes[:, :, None][..., self.point], self.corners[:, None])
        a = light.corners[..., self.point]
        sharpened(height[:4], a, np.roll(a, -1, axis=1), self.corners)
        return clip(height, np.roll(height, -1, axis=1))

    def cover(self, pair: Ints, start: Floats, end: Floats) -> tuple[Floats, Floats]:
        """The part [lo, hi] (c,) of edges (3, c) that the pairs numbered (c,) hide."""
        mine = self.take(pair)
        lo, hi = clip(mine._heights(start[:, None]), mine._heights(end[:, None]))
        return lo[0], hi[0]

    def _heights(self, d: Floats) -> Floats:
        """Of directions (3, e, q) over the edges' planes, (k, e, q)."""
        height = dot(self.planes[:, :, None], d[:, None])
        there = (self.planes != 0).any(axis=0) if self.corners.shape[1] > 4 else None  # outlines are padded
        return sharpened(height, self.corners, np.roll(self.corners, -1, axis=1), d, there)


def fans_of(points: Floats, occluders: Occluders, point: Ints, piece: Ints) -> tuple[list[Fan], Ints]:
    """Pairs sorted into fans, and the points (k,) that lie inside a piece."""
    row, width, edge_on = occluders.outline(points[:, point], piece)
    inside = point[width == 0]
    fans = []
    for k in np.unique(width[width > 0]).tolist():
        mine = np.flatnonzero((width == k) & ~edge_on)
        if mine.size:
            loop = occluders.outlines.table[row[mine], :k].T
            corners = occluders.vertices[:, loop] - points[:, None, point[mine]]
            fans.append(Fan(point[mine], corners, cross(corners, np.roll(corners, -1, axis=1))))
    return fans, inside


def touching(fan: Fan, hides: tuple[Floats, Floats], before: tuple[Floats, Floats], hidden: Bools) -> Ints:
    """Pairs that meet the light of a point that is not hidden."""
    meets = (hides[0] < hides[1]).any(axis=0) | (before[0] < before[1]).any(axis=0)
    return np.flatnonzero(meets & ~hidden[fan.point])
