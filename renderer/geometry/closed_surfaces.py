"""How triangles hang together: which edges they share, and whether they close.

A surface is closed and wound one way if every edge is run along as often in one direction as in the other.
Then the rays through it cross front faces as often as back faces, wherever the camera: that is all its
silhouette needs. Surfaces that pass through themselves or meet in an edge are closed too; one that is wound
inside out does no harm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Floats, Ints


@dataclass(frozen=True, eq=False)
class Surface:
    """A closed surface.

    Parameters
    ----------
    vertices : (3, v) float64
        No two in one place.
    triangles : (3, t) int64
    edges : (2, e) int64
        Vertices of each edge, in the direction of ``left``'s winding.
    left, right : (e,) int64
        The triangles on its two sides. An edge of 2k triangles comes k times.
    """

    vertices: Floats
    triangles: Ints
    edges: Ints
    left: Ints
    right: Ints


def welded(corners: Floats) -> tuple[Floats, Ints]:
    """Distinct points of (3, n) float64 and, for each, its number: equal to the last bit, no nearness asked."""
    bits = np.ascontiguousarray((corners + 0.0).T).view(np.uint64)  # -0.0 is 0.0
    mixed = np.zeros(bits.shape[0], dtype=np.uint64)
    for column, odd in zip(bits.T, (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9), strict=True):
        mixed = (mixed ^ column) * np.uint64(odd)
        mixed ^= mixed >> np.uint64(29)
    _, first, number = np.unique(mixed, return_index=True, return_inverse=True)
    points = corners[:, first]
    if (points[:, number] != corners).any():  # two points of one hash
        rows, number = np.unique(corners.T, axis=0, return_inverse=True)
        points = rows.T
    return points, number.reshape(-1)


def closed_surface(a: Floats, b: Floats, c: Floats) -> tuple[Surface | None, str]:
    """The surface of triangles with the given corners, or why it is not closed and wound one way.

    Parameters
    ----------
    a, b, c : (3, t) float64

    Returns
    -------
    surface : Surface or None
    reason : str
        Empty for a surface.
    """
    count = a.shape[1]
    vertices, number = welded(np.hstack((a, b, c)))
    triangles = number.reshape(3, count)
    start, end = triangles.ravel(), triangles[[1, 2, 0]].ravel()
    face = np.tile(np.arange(count), 3)
    forward = start < end
    key = np.minimum(start, end) * vertices.shape[1] + np.maximum(start, end)
    _, edge = np.unique(key, return_inverse=True)
    balance = np.bincount(edge, weights=np.where(forward, 1.0, -1.0))
    if balance.any():
        uses = np.bincount(edge)
        alone, other = int(((uses == 1) & (balance != 0)).sum()), int(((uses > 1) & (balance != 0)).sum())
        told = [f"{alone} edges belong to one triangle alone: it is open"] if alone else []
        told += [f"{other} edges are run along more often one way than the other: it is wound badly"] if other else []
        return None, "; ".join(told)
    order = np.argsort(edge, kind="stable")
    ahead, back = (order[forward[order] == way] for way in (True, False))  # each edge by edge: they pair off
    return Surface(vertices, triangles, np.stack((start[ahead], end[ahead])), face[ahead], face[back]), ""
