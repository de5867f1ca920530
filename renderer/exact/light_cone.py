"""A parallelogram light as shading points see it: its edges, and the planes of its cone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry import Ints
from ..lights import QuadLight
from ..vectors import Floats, column, cross, dot

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class LightCone:
    """The visible side of a light above each point's horizon.

    Parameters
    ----------
    start, end : (3, e, n) float64
        Edges relative to the point, clockwise, so that start x end points inwards.
    planes : (3, p, n) float64
        The cone is where all planes . v >= 0. The first four are those through neighbouring corners.
    corners : (3, 4, n) float64
        Of the light, uncut.
    live : (e, n) bool
        Edges that are there.
    closed : bool
        The edges are four, each ends where the next starts, and all are live.
    """

    start: Floats
    end: Floats
    planes: Floats
    corners: Floats
    live: Bools
    closed: bool

    def take(self, index: Ints) -> LightCone:
        """The cones of the points ``index``."""
        start, end, planes, corners = (v[..., index] for v in (self.start, self.end, self.planes, self.corners))
        return LightCone(start, end, planes, corners, self.live[..., index], self.closed)


def light_corners(light: QuadLight, points: Floats) -> Floats:
    """Corners (3, 4, n) relative to points, clockwise for those the light faces."""
    ab, ac = column(light.ab), column(light.ac)
    p = column(light.corner) - points
    return np.stack((p, p + ab, p + (ab + ac), p + ac), axis=1)


def whole_cone(corners: Floats) -> LightCone:
    """Of lights wholly above the horizon."""
    end = np.roll(corners, -1, axis=1)
    return LightCone(corners, end, cross(corners, end), corners, np.ones(corners.shape[1:], dtype=bool), True)


def cut_cone(corners: Floats, normal: Floats) -> LightCone:
    """Of lights that the horizon of normals (3, n) cuts: what is left of four edges, and one along it."""
    a, b = corners, np.roll(corners, -1, axis=1)
    za, zb = dot(normal[:, None], a), dot(normal[:, None], b)
    # >= as written: an edge that lies in the horizon is kept.
    goes, comes = (za >= 0) & (zb < 0), (za < 0) & (zb >= 0)
    crosses = goes | comes
    t = np.divide(za, za - zb, out=np.zeros_like(za), where=crosses)
    crossing = a + (b - a) * t
    leaving, entering = (crossing * goes).sum(axis=1), (crossing * comes).sum(axis=1)
    start = np.concatenate((np.where(comes, crossing, a), leaving[:, None]), axis=1)
    end = np.concatenate((np.where(goes, crossing, b), entering[:, None]), axis=1)
    live = np.concatenate(((za >= 0) | (zb >= 0), np.asarray(goes.any(axis=0))[None]))
    return LightCone(start, end, np.concatenate((cross(a, b), normal[:, None]), axis=1), a, live, False)
