"""How far points, triangles and ellipsoids are from triangles: exact to rounding, or from below where it says so."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, cross, dot, transform

Triangle = tuple[Floats, Floats, Floats]
"""Three corners, each (3, 1) or (3, t); against others they are broadcast."""


def _distance_to_segment(p: Floats, a: Floats, b: Floats) -> Floats:
    edge = b - a
    along = np.clip(dot(p - a, edge) / dot(edge, edge), 0.0, 1.0)
    rest = a + along * edge - p
    return np.sqrt(dot(rest, rest))


def distance_to_triangles(p: Floats, a: Floats, b: Floats, c: Floats) -> Floats:
    """Distance from a point (3, 1) to triangles with corners (3, t): to the face if above it, else to an edge."""
    normal = cross(b - a, c - a)
    inside = np.ones(np.broadcast_shapes(p.shape, a.shape)[1], dtype=bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= dot(cross(end - start, p - start), normal) >= 0
    height = np.abs(dot(p - a, normal)) / np.sqrt(dot(normal, normal))
    edges = np.minimum(_distance_to_segment(p, a, b), _distance_to_segment(p, b, c))
    return np.where(inside, height, np.minimum(edges, _distance_to_segment(p, c, a)))


def _between_segments(p: Floats, q: Floats, a: Floats, b: Floats) -> Floats:
    """Distance between segments p q and a b (Ericson 2005, 5.1.9), or more where their ends are nearer.

    The nearest places of the lines, brought into p q and then into a b. Where a clamp moves one the nearest pair has an
    end in it, and the distances of ends, which the caller takes too, are the smaller; likewise for parallel ones.
    """
    u, v, w = q - p, b - a, p - a
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    square = uu * vv - uv * uv
    s = np.clip(np.divide(uv * vw - vv * uw, square, out=np.zeros_like(square), where=square > 0), 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    rest = w + s * u - t * v
    return np.sqrt(dot(rest, rest))


def _pierces(p: Floats, q: Floats, a: Floats, b: Floats, c: Floats) -> Bools:
    """Whether segments p q pass through triangles, their ends on opposite sides of the plane."""
    normal = cross(b - a, c - a)
    here, there = dot(p - a, normal), dot(q - a, normal)
    across = here * there < 0
    place = p + (q - p) * np.divide(here, here - there, out=np.zeros_like(here), where=across)
    for start, end in ((a, b), (b, c), (c, a)):
        across &= dot(cross(end - start, place - start), normal) >= 0
    return across


def between_triangles(one: Triangle, others: Triangle) -> Floats:
    """Distance (t,) from a triangle to triangles; 0 where they meet or pass through each other.

    Two triangles are nearest at a corner of one of them or between two edges, or an edge of one pierces the other.
    """
    edges = [(triangle[k], triangle[(k + 1) % 3]) for triangle in (one, others) for k in range(3)]
    nearest = np.full(np.broadcast_shapes(one[0].shape, others[0].shape)[1], np.inf)
    for mine in edges[:3]:
        for theirs in edges[3:]:
            nearest = np.minimum(nearest, _between_segments(*mine, *theirs))
    for corner in one:
        nearest = np.minimum(nearest, distance_to_triangles(corner, *others))
    for corner in others:
        nearest = np.minimum(nearest, distance_to_triangles(corner, *one))
    meets = np.zeros(nearest.shape, dtype=bool)
    for mine in edges[:3]:
        meets |= _pierces(*mine, *others)
    for theirs in edges[3:]:
        meets |= _pierces(*theirs, *one)
    return np.where(meets, 0.0, nearest)


def from_ellipsoid(center: Floats, axes: Floats, inverse: Floats, a: Floats, b: Floats, c: Floats) -> Floats:
    """Distance (t,) from an ellipsoid's surface to triangles, or points (a, b, c alike), from below; 0 if they cross.

    Exact in the space where it is the unit sphere, and no less than the shortest semi-axis times that.
    """
    corners = [transform(inverse, corner - center) for corner in (a, b, c)]
    origin, point = np.zeros((3, 1)), np.array_equal(a, b)
    nearest = np.sqrt(dot(corners[0], corners[0])) if point else distance_to_triangles(origin, *corners)
    farthest = np.sqrt(np.max([dot(corner, corner) for corner in corners], axis=0))
    apart = np.where(nearest >= 1, nearest - 1, np.where(farthest <= 1, 1 - farthest, 0.0))
    return np.asarray(apart * np.linalg.svd(axes, compute_uv=False)[-1])
