"""Where a scene leaves the range in which Mitsuba is right: said in plain sentences, not hidden.

Up to version 3.9 a shadow ray ends at 1 - 8.94e-4 of its way to the light. A blocker beyond is not seen: 45 % of
the full light was found to come through one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.arrays import Geometry, build_geometry
from nusselt.renderer.lights import PointLight, QuadLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats, column, cross, dot

CLOSE = 1e-3
"""Blockers closer to a light than this share of the shadow ray's length are ignored by Mitsuba 3.9."""
GRID = 3
"""Points a side at which a parallelogram is compared with the triangles; their corners are compared with all of it."""


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


def _distance(light: QuadLight | PointLight, geometry: Geometry, others: NDArray[np.intp]) -> float:
    """From a light to the nearest triangle, of those chosen (t,), that its light can meet; infinity where none is."""
    a, b, c = (corner[:, others] for corner in (geometry.a, geometry.b, geometry.c))
    if isinstance(light, PointLight):
        return float(distance_to_triangles(column(light.position), a, b, c).min(initial=np.inf))
    corner, ab, ac = column(light.corner), column(light.ab), column(light.ac)
    heights = np.stack([dot(p - corner, column(light.normal)) for p in (a, b, c)])
    size = np.sqrt(dot(ab, ab) + dot(ac, ac))
    ahead = (heights > 1e-12 * size).any(axis=0)
    a, b, c = a[:, ahead], b[:, ahead], c[:, ahead]
    found = [np.inf]
    steps = np.linspace(0, 1, GRID)
    for u in steps:
        found += [float(distance_to_triangles(corner + u * ab + v * ac, a, b, c).min(initial=np.inf)) for v in steps]
    # The other way round: corners of triangles in front of the middle of the light.
    inverse = np.linalg.pinv(np.hstack((ab, ac)))
    for p, height in zip((a, b, c), heights[:, ahead], strict=True):
        u, v = inverse @ (p - corner)
        over = (height > 0) & (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
        found.append(float(height[over].min(initial=np.inf)))
    return min(found)


def close_blockers(scene: Scene, half: float) -> list[str]:
    """A sentence for every light with a surface so close before it that Mitsuba 3.9 may look past it.

    Parameters
    ----------
    half : float
        Half extent of the scene; no shadow ray is longer than its diagonal, 2 sqrt(3) half.
    """
    geometry = build_geometry(scene)
    owner = geometry.light[geometry.triangle_surface]
    reach = CLOSE * 2 * 3**0.5 * half
    notes = []
    for number, light in enumerate(scene.lights):
        if not isinstance(light, QuadLight | PointLight):
            continue
        distance = _distance(light, geometry, np.flatnonzero(owner != number))
        if distance < reach:
            where = f"lies {distance:.2g} before" if distance > 1e-9 * half else "touches"
            notes.append(
                f"a surface {where} light {number + 1}: Mitsuba up to 3.9 looks past what is closer to a light "
                f"than a thousandth of the way (here up to {reach:.2g})"
            )
    return notes
