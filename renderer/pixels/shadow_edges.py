"""What may throw a light's shadow: edges of faces and disks, where they cut, and lines along which bodies turn."""

from __future__ import annotations

from functools import partial

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.flat_disks import disk_rim
from nusselt.renderer.lights import Light
from nusselt.renderer.vectors import Floats, cross, dot, frame, transform

from .candidate_edges import crossings, disk_cuts
from .faces import apex
from .regions import Regions

SIDES = 64
"""Edges that stand for the line along which an ellipsoid turns from a light."""
FLAT = 1e-9
"""Heights over a surface's plane that are none, relative to the edge's distance."""


def shadow_edges(regions: Regions, light: Light) -> tuple[Floats, Floats]:
    """All that may throw a light's shadow, as segments, found once."""
    if light not in regions.shadow_edges:
        g = regions.geometry
        edges = [crossings(g), *map(partial(_rim, g), range(g.disks))]
        edges += [disk_cuts(g, index) for index in range(g.disks)]
        edges += [_turning(regions, light), *(_terminator(g, index, light) for index in range(g.ellipsoids))]
        start, end = (np.hstack(ends) for ends in zip(*edges, strict=True))
        regions.shadow_edges[light] = start, end
    return regions.shadow_edges[light]


def _turning(regions: Regions, light: Light) -> tuple[Floats, Floats]:
    """Edges of faces, but those whose two faces lie beside each other, seen from all of the light: nothing jumps there.

    How high a place is over the plane through an edge and another place is affine in the latter: its sign at the hull's
    corners is its sign everywhere on the light.
    """
    g, faces = regions.geometry, regions.faces
    hull = light.hull()
    side = np.zeros((2, faces.start.shape[1]))
    for row, triangle in zip(side, faces.beside, strict=True):
        corner = apex(g, triangle, faces.start, faces.end)
        normal = cross(faces.end - faces.start, corner - faces.start)
        to = hull[:, :, None] - (0.0 if light.at_infinity else 1.0) * faces.start[:, None]
        height, slack = dot(normal[:, None], to), FLAT * np.sqrt(dot(normal, normal) * dot(to, to).max(axis=0))
        row[:] = (height > slack).all(axis=0) * 1.0 - (height < -slack).all(axis=0)
    kept = np.flatnonzero((side[0] * side[1] >= 0) | (faces.beside[0] < 0))
    return faces.start[:, kept], faces.end[:, kept]


def _rim(g: Geometry, index: int) -> tuple[Floats, Floats]:
    """A disk's rim, as SIDES edges."""
    points = disk_rim(g, index, 2 * np.pi * np.arange(SIDES) / SIDES)
    return points, np.roll(points, -1, axis=1)


def _terminator(g: Geometry, index: int, light: Light) -> tuple[Floats, Floats]:
    """Where an ellipsoid turns from a light's middle, as SIDES edges; none if the middle is inside it."""
    inverse, center = g.inverse[index], g.center[:, [index]]
    middle, _ = light.middle()
    to = transform(inverse, middle if light.at_infinity else middle - center)
    away = np.sqrt(dot(to, to)).item()
    delta = 0.0 if light.at_infinity else 1 / max(away, np.finfo(float).tiny)
    if delta >= 1:
        return np.zeros((3, 0)), np.zeros((3, 0))
    u, v = frame(to / away)
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    ring = delta * to / away + np.sqrt(1 - delta**2) * (np.cos(angle) * u + np.sin(angle) * v)
    points = center + transform(g.axes[index], ring)
    return points, np.roll(points, -1, axis=1)
