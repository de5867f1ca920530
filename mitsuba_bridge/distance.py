"""How far points are from triangles."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Floats, cross, dot


def _distance_to_segment(p: Floats, a: Floats, b: Floats) -> Floats:
    edge = b - a
    along = np.clip(dot(p - a, edge) / dot(edge, edge), 0.0, 1.0)
    rest = a + along * edge - p
    return np.sqrt(dot(rest, rest))


def distance_to_triangles(p: Floats, a: Floats, b: Floats, c: Floats) -> Floats:
    """Distance from a point (3, 1) to triangles with corners (3, t): to the face if above it, else to an edge."""
    normal = cross(b - a, c - a)
    inside = np.ones(a.shape[1], dtype=bool)
    for start, end in ((a, b), (b, c), (c, a)):
        inside &= dot(cross(end - start, p - start), normal) >= 0
    height = np.abs(dot(p - a, normal)) / np.sqrt(dot(normal, normal))
    edges = np.minimum(_distance_to_segment(p, a, b), _distance_to_segment(p, b, c))
    return np.where(inside, height, np.minimum(edges, _distance_to_segment(p, c, a)))
