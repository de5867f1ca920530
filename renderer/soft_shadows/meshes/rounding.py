"""A bound of what rounding does to the light that a closed surface keeps from points: all of the error there is."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.geometry.ragged import expand, take
from nusselt.renderer.vectors import Bools, Floats, column, cross, dot

from .contour import HORIZON, Pieces
from .light_frame import Candidates, LightFrame
from .overlap import GRID

EPS = 2.0**-52

STEPS = 8
"""Roundings of a relative 2^-53, at the worst, in each quantity whose rounding `edge_terms` and `rounding` follow:
coordinates, products of three sums, roots and angles: 16."""


FLAT = 1e-8
"""Angle between faces that are one for this: what either hides of the other is below the horizon's tolerance."""


def rounding(
    cut: Pieces, x: Floats, n: Floats, size: Floats, frame: LightFrame, doubt: Floats, lengths: Floats
) -> Floats:
    """Bound (n,) of the error of the hidden irradiance of points x with normals n, (3, n), for unit radiance.

    Parameters
    ----------
    cut : Pieces
    size : (n,) float64
        Magnitude of all coordinates.
    doubt : (n,) float64
        Sum over all of Lambert's terms: see `contour.edge_terms`.
    lengths : (n,) float64
        Of the lines on the light along which overlaps were integrated.

    Notes
    -----
    It holds for coordinates that are themselves rounded, relative to ``size``: turned twins agree. Seen from the point
    that is the more, the nearer a piece is; on the light it sweeps that times the piece's length, and once the rim's
    where it ends there, under the largest integrand. All ends on the light are off by what the projection makes of
    rounding, and by the grid that strips are kept to. What is cut `HORIZON` above the horizon counts in a light that
    reaches down to there.
    """
    count = x.shape[1]
    reach, height, nearest, largest = _light(x, frame)
    scale = STEPS * EPS * np.sqrt(dot(frame.rows[:2].T, frame.rows[:2].T).max()) * (1 + (reach + size) / height)
    length = np.abs(cut.p[1] - cut.p[0]) + np.abs(cut.q[1] - cut.q[0]) + (cut.enters >= 0) + (cut.leaves >= 0)
    near = np.sqrt(np.minimum(dot(cut.a, cut.a), dot(cut.b, cut.b)))
    with np.errstate(divide="ignore"):
        moved = np.bincount(cut.owner, np.divide(length, near, out=np.zeros_like(near), where=length > 0), count)
        low = np.bincount(cut.owner, np.where((cut.enters == 4) | (cut.leaves == 4), 2 / near, 0.0), count)
    lowest = dot(n[:, None, :], frame.rim[:, :, None] - x[:, None, :]).min(axis=0)
    tolerance = HORIZON * size
    over = np.where(lowest < tolerance, tolerance * (low + 1 / nearest), 0.0)
    off = (GRID + scale * (reach + size)) * lengths + scale * reach * size * moved
    return STEPS * EPS * doubt + largest * (off + over)


def on_folds(edges: Candidates, height: Floats, x: Floats, n: Floats, size: Floats) -> Bools:
    """Which points x with normals n, (3, m), lie on an edge to rounding, on the planes of two faces at an angle.

    Rounding decides whether such a point is before the other face or behind it, and that is all that the face hides.
    ``height`` (f, m) is theirs over the faces, ``size`` (m,) the magnitude of all coordinates.
    """
    found = np.zeros(x.shape[1], dtype=bool)
    tolerance = 2 * STEPS * EPS * size
    face, who = np.divmod(np.flatnonzero(np.abs(height) <= tolerance), x.shape[1])
    across = cross(take(edges.plane[:3], face), take(n, who))
    angle = np.sqrt(dot(across, across))
    k = np.flatnonzero(angle > FLAT)
    face, who, angle = face[k], who[k], angle[k]
    if k.size == 0:
        return found
    # The edges of each such face, by face.
    beside = np.concatenate((edges.left, edges.right))
    sort = np.argsort(beside, kind="stable")
    first = np.searchsorted(beside[sort], face)
    which, nth = expand(np.searchsorted(beside[sort], face, side="right") - first)
    edge = sort[first[which] + nth] % edges.count
    a = take(edges.start, edge) - take(x, who[which])
    way = take(edges.end, edge) - take(edges.start, edge)
    share = np.clip(-dot(a, way) / np.maximum(dot(way, way), 1e-300), 0, 1)
    gap = a + share * way
    near = dot(gap, gap) * angle[which] ** 2 <= (2 * tolerance[who[which]]) ** 2
    found[who[which[near]]] = True
    return found


def _light(x: Floats, frame: LightFrame) -> tuple[Floats, Floats, Floats, Floats]:
    """Distance of the farthest corner, of the light's plane, of the nearest point at least; the largest integrand."""
    ab, ac = column(frame.light.ab), column(frame.light.ac)
    corners = frame.rim[:, :, None] - x[:, None, :]
    reach = np.sqrt(dot(corners, corners).max(axis=0))
    area = float(np.sqrt(dot(cross(ab, ac), cross(ab, ac)))[0])
    p, q, height = frame.point(x)
    beside = [np.maximum(np.maximum(-v, v - 1), 0) * area / np.sqrt(dot(w, w)) for v, w in ((p, ac), (q, ab))]
    height = np.maximum(height, 1e-300)
    nearest = np.sqrt(height**2 + np.maximum(*beside) ** 2)
    return reach, height, nearest, area * height / nearest**3
