"""A quad light's own coordinates, in which projection from a point is two products and a sum."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.vectors import Floats, Ints, column, cross, dot, transform, unit
from nusselt.renderer.visibility.silhouette import Outline


@dataclass(frozen=True, eq=False)
class LightFrame:
    """(p, q, r): corner + p ab + q ac + r normal, r > 0 where the light shines; sheared lights are squares too.

    Parameters
    ----------
    light : QuadLight
    rows : (3, 3) float64
        World vector to (p, q, r).
    rim : (3, 4) float64
        Corners, counter-clockwise seen from where it shines: (0, 0), (0, 1), (1, 1), (1, 0).
    """

    light: QuadLight
    rows: Floats
    rim: Floats

    @classmethod
    def of(cls, light: QuadLight) -> LightFrame:
        """The frame of a light."""
        return _frame(light)

    @classmethod
    def turned(cls, light: QuadLight, corner: int) -> LightFrame:
        """The frame whose origin is the ``corner`` (0 to 3) of the light's own rim."""
        return _turned(light, corner)

    def point(self, x: Floats) -> Floats:
        """Coordinates of points (3, n)."""
        return transform(self.rows, x - self.rim[:, :1])


@lru_cache(maxsize=64)
def _frame(light: QuadLight) -> LightFrame:
    p, ab, ac = column(light.corner), column(light.ab), column(light.ac)
    rows = np.linalg.inv(np.hstack((ab, ac, unit(-cross(ab, ac)))))
    return LightFrame(light, rows, np.hstack((p, p + ac, p + ab + ac, p + ab)))


@lru_cache(maxsize=64)
def _turned(light: QuadLight, corner: int) -> LightFrame:
    rim = _frame(light).rim
    at, after, before = (rim[:, (corner + k) % 4] for k in (0, 1, 3))
    ab, ac = (tuple((v - at).tolist()) for v in (before, after))
    return _frame(QuadLight(tuple(at.tolist()), ab, ac, light.radiance))


@dataclass(frozen=True, eq=False)
class Candidates:
    """Edges that may be silhouette edges before the light, from somewhere in a box of receivers.

    Parameters
    ----------
    start, end : (3, e) float64
        World.
    local_start, local_end : (3, e) float64
        The same in the light's frame.
    plane : (4, f) float64
        Planes n, n . a of the faces beside them.
    left, right : (e,) int64
        Which of those.
    size : float
        Magnitude of all coordinates, the light's too.
    """

    start: Floats
    end: Floats
    local_start: Floats
    local_end: Floats
    plane: Floats
    left: Ints
    right: Ints
    size: float

    @classmethod
    def of(cls, outline: Outline, frame: LightFrame) -> Candidates:
        """All edges of an outline."""
        plane = outline.plane / np.sqrt(dot(outline.plane[:3], outline.plane[:3]))
        local = frame.point(outline.start), frame.point(outline.end)
        size = float(np.abs(outline.start).max(initial=np.abs(frame.rim).max()))
        return cls(outline.start, outline.end, *local, plane, outline.left, outline.right, size)

    @property
    def count(self) -> int:
        return self.start.shape[1]

    def heights(self, x: Floats) -> Floats:
        """Of points x (3, n) over the faces, (f, n)."""
        return np.asarray(self.plane.T @ np.vstack((x, -np.ones(x.shape[1]))))

    def near(self, x: Floats, local: Floats) -> Candidates:
        """Without those that surely do not matter to any of the points x (3, n), ``local`` in the light's frame.

        Dropped are edges whose faces both look towards all of the points' bounding box, or both away from it
        (affine in x), and edges beyond one side of the light: whether a point projects beyond p = c is the sign
        of r_P (c - p_x) + r_x (p_P - c), affine in each coordinate of x, so that the box's corners tell.
        """
        low, high = x.min(axis=1), x.max(axis=1)
        centre, half = (low + high) / 2, (high - low) / 2
        plane = self.plane
        height = plane[0] * centre[0] + plane[1] * centre[1] + plane[2] * centre[2] - plane[3]
        reach = np.abs(plane[0]) * half[0] + np.abs(plane[1]) * half[1] + np.abs(plane[2]) * half[2]
        reach += 1e-13 * (np.abs(plane[3]) + np.abs(x).max())
        sure = (height > reach).astype(np.int8) - (height < -reach)
        out = take(sure, self.left) * take(sure, self.right) > 0
        low, high = local.min(axis=1), local.max(axis=1)
        slack = 1e-12 * (1 + max(np.abs(low).max(), np.abs(high).max())) ** 2
        for axis in (0, 1):
            for bound, sign, extreme in ((0.0, 1.0, low[axis]), (1.0, -1.0, high[axis])):
                beyond = np.ones(self.count, dtype=bool)
                for end in (self.local_start, self.local_end):
                    lever = end[2] * (sign * (bound - extreme))
                    arm = sign * (end[axis] - bound)
                    beyond &= lever + np.maximum(arm * low[2], arm * high[2]) < -slack
                out |= beyond
        k = np.flatnonzero(~out)
        left, right = take(self.left, k), take(self.right, k)
        used = np.zeros(plane.shape[1], dtype=bool)
        used[left] = used[right] = True
        number = np.cumsum(used) - 1
        start, end, first, last = (take(v, k) for v in (self.start, self.end, self.local_start, self.local_end))
        return Candidates(start, end, first, last, plane[:, used], take(number, left), take(number, right), self.size)
