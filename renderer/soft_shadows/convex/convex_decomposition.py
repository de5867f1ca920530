"""A scene's triangles as convex pieces: closed convex bodies, convex quadrilaterals, and triangles.

Fewer pieces, and fewer edges, is all that is gained: any grouping gives the same shadows.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.vectors import Floats, Ints, cross, distinct, dot, unit

from .convex import FLAT, Convex, Loop, _chain

LARGEST = 64
"""Triangles in a body that may become one piece."""
FACES = 24
"""Faces of a body that may become one piece."""
THIN = 1e-9
"""A body with a face whose plane is known no better than this, relative to its size, stays in parts."""


@lru_cache(maxsize=4)
def convex_pieces(geometry: Geometry) -> tuple[Convex, ...]:
    """All triangles of a scene, each in exactly one piece."""
    corners = np.stack((geometry.a, geometry.b, geometry.c), axis=2)  # (3, t, 3 corners)
    t = corners.shape[1]
    if t == 0:
        return ()
    points, index = np.unique(corners.reshape(3, -1), axis=1, return_inverse=True)
    index = index.reshape(t, 3)
    pairs, closed = _neighbours(index)
    label = _components(t, pairs)
    pieces: list[Convex] = []
    alone = np.ones(t, dtype=bool)
    order = np.argsort(label, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(label[order])) + 1):
        if 4 <= group.size <= LARGEST and closed[group].all():
            body = _closed_body(points, index, group)
            if body is not None:
                pieces.append(body)
                alone[group] = False
    for i, j in pairs:
        if alone[i] and alone[j]:
            quad = _quadrilateral(points, index, int(i), int(j))
            if quad is not None:
                pieces.append(quad)
                alone[[i, j]] = False
    for i in np.flatnonzero(alone):
        pieces.append(Convex(points[:, index[i]], ((0, 1, 2),), (int(i),)))
    return tuple(pieces)


def _neighbours(index: Ints) -> tuple[Ints, Ints]:
    """Pairs of triangles that share an edge with each other alone, run opposite ways; triangles with three such."""
    t = index.shape[0]
    start, end = index.ravel(), np.roll(index, -1, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    twice = same & ~np.r_[False, same[:-1]] & ~np.r_[same[1:], False]
    first, second = order[:-1][twice], order[1:][twice]
    opposite = start[first] == end[second]
    first, second = first[opposite], second[opposite]
    count = np.bincount(np.r_[first // 3, second // 3], minlength=t)
    return np.stack((first // 3, second // 3), axis=1), count == 3


def _components(count: int, pairs: Ints) -> Ints:
    """Label of each triangle's connected component."""
    label = np.arange(count)
    while pairs.size:
        low = np.minimum(label[pairs[:, 0]], label[pairs[:, 1]])
        before = label.copy()
        np.minimum.at(label, pairs[:, 0], low)
        np.minimum.at(label, pairs[:, 1], low)
        label = label[label]
        if (label == before).all():
            break
    return label


def _closed_body(points: Floats, index: Ints, group: Ints) -> Convex | None:
    """The closed convex body of these triangles, if it is one."""
    used, local = np.unique(index[group], return_inverse=True)
    vertices, local = points[:, used], local.reshape(-1, 3)
    a, b, c = (vertices[:, local[:, k]] for k in range(3))
    normal = unit(cross(b - a, c - a))
    height = dot(normal[:, :, None], vertices[:, None, :] - a[:, :, None])  # (triangles, vertices)
    room = _rounding(a, b, c, vertices)
    if room.max() > THIN * np.abs(vertices - vertices[:, :1]).max():
        return None
    above, below = (height > room[:, None]).any(), (height < -room[:, None]).any()
    if above and below:
        return None
    if above:  # wound inside out
        local = local[:, ::-1]
    flat = (np.abs(height[:, local]) <= room[:, None, None]).all(axis=2)  # (triangle, triangle): in its plane
    flat = (flat & flat.T) | np.eye(group.size, dtype=bool)
    face = flat.argmax(axis=1)
    loops = [_outline(local[face == f]) for f in distinct(face)]
    if not 4 <= len(loops) <= FACES or min(map(len, loops)) < 3:
        return None
    return Convex(vertices, tuple(loops), tuple(group.tolist()))


def _rounding(a: Floats, b: Floats, c: Floats, vertices: Floats) -> Floats:
    """How far (t,) a vertex that lies in a triangle's plane may seem to lie from it: more for needles."""
    size = np.abs(vertices - vertices[:, :1]).max()
    edges = np.stack((b - a, c - b, a - c))
    longest = np.sqrt((edges**2).sum(axis=1).max(axis=0))
    area = cross(b - a, c - a)
    width = np.sqrt(dot(area, area)) / np.maximum(longest, 1e-300)
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray(FLAT * size + 4 * 2.0**-53 * np.abs(vertices).max() * (1 + size / width))


def _outline(triangles: Ints) -> Loop:
    edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)}
    return _chain({a: b for a, b in edges if (b, a) not in edges})


def _quadrilateral(points: Floats, index: Ints, i: int, j: int) -> Convex | None:
    """Two triangles as one convex quadrilateral, if they are coplanar and it is convex."""
    loop = _outline(index[[i, j]])
    if len(loop) != 4:
        return None
    v = points[:, list(loop)]
    step = np.roll(v, -1, axis=1) - v
    turn = cross(step, np.roll(step, -1, axis=1))
    n = unit(cross(v[:, [2]] - v[:, [0]], v[:, [3]] - v[:, [1]]))
    off = np.abs(dot(n, v - v[:, :1]))
    room = FLAT * np.abs(step).max() + 4 * 2.0**-53 * np.abs(v).max()
    if off.max() > room or (dot(n, turn) <= 0).any():
        return None
    return Convex(v, ((0, 1, 2, 3),), (i, j))
