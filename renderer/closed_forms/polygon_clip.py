"""A parallelogram as a shading point sees it, cut at planes through that point, in double-double.

The inputs are exact float64 numbers, so every cancellation in p = P - x, in the heights n . v of the corners and in
the volume (e1 x e2) . p can be undone: their relative error is 2^-98 times the size of what was subtracted.
Each array here belongs to n points; callers compact the few that need it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nusselt.renderer.vectors import Bools, Floats

from . import double_double as dd
from .double_double import Pair

DOUBT = 2.0**-98
"""Error of a double-double height or volume, relative to the sizes of its terms."""


def ratio(a: Floats, b: Floats) -> Floats:
    """a / b, and 0 where b is not above 0; kept below 1e300."""
    with np.errstate(over="ignore"):
        quotient = np.divide(a, b, out=np.zeros(np.broadcast_shapes(np.shape(a), b.shape)), where=b > 0)
    return np.clip(quotient, -1e300, 1e300)


def exponent_scale(*vectors: Floats) -> Floats:
    """The power of two (n,) that brings the largest component of (3, n) arrays to [1/2, 1); 1 where all are 0."""
    size = np.max([np.abs(v).max(axis=0) for v in vectors], axis=0)
    return np.ldexp(1.0, -np.clip(np.frexp(size)[1], -1020, 1020))


@dataclass(frozen=True, eq=False)
class Corner:
    """A corner of the clipped polygon.

    Parameters
    ----------
    s, t : Pair of (n,)
        v = p + s e1 + t e2.
    heights : tuple of (n,) float64
        plane . v, each accurate relative to itself.
    """

    s: Pair
    t: Pair
    heights: tuple[Floats, ...]

    def where(self, mask: Bools, other: Corner) -> Corner:
        """This corner where the mask holds, the other elsewhere."""
        heights = tuple(np.where(mask, a, b) for a, b in zip(self.heights, other.heights, strict=True))
        return Corner(dd.where(mask, self.s, other.s), dd.where(mask, self.t, other.t), heights)


Edge = tuple[Corner, Corner, Bools]
"""Start, end, and where it is there."""


@dataclass(frozen=True, eq=False)
class Patch:
    """v = p + s e1 + t e2, s and t in [0, 1], as n points at the origin see it.

    Parameters
    ----------
    p, e1, e2 : Pair of (3, n)
    planes : tuple of (3, n) float64
        Normals of the planes that clip it, of any length.
    slopes : tuple of three Pair of (n,) for each plane
        Height of p, and how much e1 and e2 add to it.
    """

    p: Pair
    e1: Pair
    e2: Pair
    planes: tuple[Floats, ...]
    slopes: tuple[tuple[Pair, ...], ...]

    @classmethod
    def seen(cls, points: Floats, corner: Floats, ab: Floats, ac: Floats, planes: Sequence[Floats]) -> Patch:
        """From (3, n) arrays whose sizes lie within 1e-60 .. 1e60."""
        p, e1, e2 = dd.two_sum(corner, -points), dd.exact(ab), dd.exact(ac)  # P - x without rounding
        slopes = tuple((dd.dot(dd.exact(n), p), dd.dot(dd.exact(n), e1), dd.dot(dd.exact(n), e2)) for n in planes)
        return cls(p, e1, e2, tuple(planes), slopes)

    def take(self, index: Any) -> Patch:
        """The same for the points at ``index``."""
        p, e1, e2 = ((v[0][:, index], v[1][:, index]) for v in (self.p, self.e1, self.e2))
        slopes = tuple(tuple((h[0][index], h[1][index]) for h in three) for three in self.slopes)
        return Patch(p, e1, e2, tuple(n[:, index] for n in self.planes), slopes)

    @property
    def extent(self) -> Floats:
        """A bound (n,) of the sizes that go into a position."""
        return sum((np.abs(v[0]).sum(axis=0) for v in (self.p, self.e1, self.e2)), np.zeros(self.p[0].shape[1]))

    def corner(self, s: Pair, t: Pair) -> Corner:
        """The corner at (s, t) with its heights."""
        heights = []
        for base, along, across in self.slopes:
            heights.append(dd.value(dd.add(base, dd.add(dd.multiply(s, along), dd.multiply(t, across)))))
        return Corner(s, t, tuple(heights))

    def place(self, s: Pair, t: Pair) -> Pair:
        """v = p + s e1 + t e2, a Pair of (3, n)."""
        return dd.add(self.p, self.span(s, t))

    def span(self, s: Pair, t: Pair) -> Pair:
        """s e1 + t e2, a Pair of (3, n)."""
        return dd.add(dd.multiply(s, self.e1), dd.multiply(t, self.e2))

    def volume(self) -> tuple[Floats, Floats]:
        """(e1 x e2) . p and the bound of its absolute error, each (n,)."""
        size = np.prod([np.abs(v[0]).sum(axis=0) for v in (self.p, self.e1, self.e2)], axis=0)
        return dd.value(dd.dot(dd.cross(self.e1, self.e2), self.p)), DOUBT * size

    def outline(self) -> list[Corner]:
        """The four corners, counter-clockwise in (s, t)."""
        nought = dd.exact(np.zeros(self.p[0].shape[1]))
        one = dd.exact(np.ones(self.p[0].shape[1]))
        return [self.corner(s, t) for s, t in ((nought, nought), (one, nought), (one, one), (nought, one))]

    def clipped(self) -> list[Edge]:
        """Edges of the part above all planes, counter-clockwise in (s, t)."""
        corners = self.outline()
        everywhere = np.ones(self.p[0].shape[1], dtype=bool)
        edges: list[Edge] = [(corners[k], corners[(k + 1) % 4], everywhere) for k in range(4)]
        for k in range(len(self.planes)):
            edges = self._clip(edges, k)
        return edges

    def _clip(self, edges: list[Edge], plane: int) -> list[Edge]:
        """The edges' parts above one plane, and the edge along the plane that closes them."""
        out: list[Edge] = []
        leaving = entering = edges[0][0]
        cut = np.zeros(edges[0][2].shape, dtype=bool)
        for a, b, there in edges:
            za, zb = a.heights[plane], b.heights[plane]
            # >= as written: an edge that lies in the plane is kept.
            goes, comes = there & (za >= 0) & (zb < 0), there & (za < 0) & (zb >= 0)
            crossing = self._crossing(a.where(za >= 0, b), b.where(za >= 0, a), plane, goes | comes)
            out.append((crossing.where(comes, a), crossing.where(goes, b), there & ((za >= 0) | (zb >= 0))))
            leaving, entering = crossing.where(goes, leaving), crossing.where(comes, entering)
            cut |= goes | comes
        return [*out, (leaving, entering, cut)]

    def _crossing(self, above: Corner, below: Corner, plane: int, there: Bools) -> Corner:
        """Where an edge meets the plane, from its upper end: the share is small and exact where little is left."""
        up, down = above.heights[plane], below.heights[plane]
        fall = up - down
        ds, dt = dd.subtract(below.s, above.s), dd.subtract(below.t, above.t)
        nought, one = dd.exact(np.zeros_like(up)), dd.exact(np.ones_like(up))
        share, left = nought, up
        for _ in range(2):  # the second time for the height that the rounding of the first left over
            share = dd.add(share, dd.exact(np.divide(left, fall, out=np.zeros_like(up), where=there)))
            # An edge that lies in the plane has heights of rounding errors: its crossing is not to leave it.
            share = dd.where(dd.value(share) < 0, nought, dd.where(dd.value(share) > 1, one, share))
            found = self.corner(dd.add(above.s, dd.multiply(share, ds)), dd.add(above.t, dd.multiply(share, dt)))
            left = found.heights[plane]
        heights = tuple(0 * z if k == plane else z for k, z in enumerate(found.heights))
        return Corner(found.s, found.t, heights)
