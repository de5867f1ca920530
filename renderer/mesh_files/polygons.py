"""Polygons cut into triangles: fans from the first corner, and ears where a fan would leave the polygon.

A polygon's front and plane are those of its area vector, the sum of its fan's. Where every triangle of the fan turns
its way the fan covers the polygon once, whatever its outline. Where one turns against it the polygon is concave as seen
from that corner; where one is flat three corners lie in line, and a neighbour that has an edge between two of them
would part from it. Both are cut by their ears in that plane. A polygon that has no ears crosses itself: no cut of it
is right, and it keeps its fan. Corners off the plane stay where they are.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.surfaces import Floats
from nusselt.renderer.words import count

from .ears import cut_ears

MAX_WORK = 1 << 27
"""Sum of the squared numbers of corners of concave polygons: about half a minute."""
CORNERS = 1 << 20
"""Cut at a time: bounds the memory."""
FLAT = 1e-3
"""How far, of their extent, a flat polygon's corners lie apart along its normal: more than a file's rounding."""
ROUNDING = 1e-14

Integers = NDArray[np.int64]


def cut(vertices: Floats, counts: Integers, corners: Integers) -> tuple[Integers, list[str]]:
    """Triangles (3, t) of polygons of at least three corners each, and what there is to say of them.

    Parameters
    ----------
    vertices : (3, v) float64
    counts : (f,) int64
        Corners of each polygon.
    corners : (sum of counts,) int64
        Indices into ``vertices``, polygon after polygon.
    """
    wings = counts - 2
    starts = np.cumsum(counts) - counts
    first = np.repeat(starts, wings)
    wing = np.arange(first.size) - np.repeat(np.cumsum(wings) - wings, wings)
    triangles = np.stack((corners[first], corners[first + wing + 1], corners[first + wing + 2]))
    several = np.flatnonzero(counts > 3)
    if not several.size:
        return triangles, []
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows has no plane: it stays a fan
        normals, concave, straight, bent = _planes(vertices, triangles[:, np.repeat(counts > 3, wings)], wings[several])
    sizes, at, crossing = counts[several], np.cumsum(wings) - wings, 0
    by_ears = concave | straight
    if (sizes[by_ears].astype(float) ** 2).sum() > MAX_WORK:
        most = f"up to {int(sizes[by_ears].max())} corners"
        raise InputError("concave polygons", most, "fewer or smaller ones, or triangles")
    for size in np.unique(sizes[by_ears]).tolist():
        alike = np.flatnonzero(by_ears & (sizes == size))
        for part in np.array_split(alike, -(-alike.size * size // CORNERS)):
            index = corners[starts[several[part]][:, None] + np.arange(size)]
            ears, is_cut = cut_ears(_flattened(vertices[:, index], normals[:, part]))
            rows = at[several[part]][is_cut, None] + np.arange(size - 2)
            triangles[:, rows] = index[np.flatnonzero(is_cut)[:, None], ears[:, is_cut]]
            crossing += int((concave[part] & ~is_cut).sum())
    return triangles, _notes(int(concave.sum()) - crossing, crossing, bent)


def _notes(concave: int, crossing: int, bent: int) -> list[str]:
    return [
        f"{count(number, 'polygon', verb)} {what}"
        for number, verb, what in (
            (concave, "has", "inward corners: cut by ears, not as a fan"),
            (crossing, "has", "sides that cross: cut as a fan from its first corner, one reading of many"),
            (bent, "is", "not flat: the cut into triangles makes one shape of several"),
        )
        if number
    ]


def _planes(
    vertices: Floats, fan: Integers, wings: Integers
) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_], int]:
    """Unit normals (3, p) of polygons, which their fans leave, which have flat wings, and how many are not flat."""
    at = np.cumsum(wings) - wings
    a, b, c = (vertices[:, corner] for corner in fan)
    e, f = b - a, c - a
    scale = max(np.abs(e).max(), np.abs(f).max()) or 1.0  # squares of 1e-200 vanish
    e, f = e / scale, f / scale
    vectors = np.stack((e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]))
    normals = np.add.reduceat(vectors, at, axis=1)
    length = np.sqrt((normals**2).sum(axis=0))
    normals = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    n = np.repeat(normals, wings, axis=1)
    sizes = np.maximum((e**2).sum(axis=0), (f**2).sum(axis=0))
    along = (vectors * n).sum(axis=0)
    has = [np.logical_or.reduceat(w, at) for w in (along < -ROUNDING * sizes, np.abs(along) <= ROUNDING * sizes)]
    heights = np.stack(((e * n).sum(axis=0), (f * n).sum(axis=0)))
    spread = np.maximum.reduceat(heights.max(axis=0), at).clip(0) - np.minimum.reduceat(heights.min(axis=0), at).clip(
        max=0
    )
    bent = int((spread > FLAT * np.sqrt(np.maximum.reduceat(sizes, at))).sum())
    return normals, has[0], has[1] & (length > 0), bent


def _flattened(points: Floats, normals: Floats) -> Floats:
    """Corners (3, m, n) in the planes of normals (3, m): (2, m, n), counter-clockwise, of extent 1."""
    p = points - points[:, :, :1]
    p = p / np.abs(p).max(axis=(0, 2))[:, None]
    x, y, z = normals
    # An orthonormal frame without a case that cancels (Duff et al. 2017, JCGT 6(1)).
    sign = np.copysign(1.0, z)
    k = -1.0 / (sign + z)
    u = np.stack((1.0 + sign * x * x * k, sign * x * y * k, -sign * x))
    v = np.stack((x * y * k, sign + y * y * k, -y))
    return np.stack([(p * axis[:, :, None]).sum(axis=0) for axis in (u, v)])
