"""Every line in space that could be seen as an edge in the image.

Edges of faces and disks; the lines where triangles pass through each other or through disks; silhouettes of
ellipsoids, and the curves in which planes cut them, as polygons of equal area; and creases, where a light's own plane
cuts a surface and the light goes out. A line too many costs time and changes nothing: what is seen on its two sides
decides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.camera.first_hits import origin_in
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.flat_disks import disk_rim
from nusselt.renderer.lights import Light
from nusselt.renderer.lights.body import Plane
from nusselt.renderer.vectors import Floats, Ints, cross, dot, frame, transform, unit

from .faces import Faces
from .folds import contacts
from .projection import Lens

CHORD = 2e-4
"""How far, in pixels, the polygon of a curve may lie from it."""
PAIRS = 1 << 19
"""Pairs of triangles beyond which their intersections are not searched."""


@dataclass(frozen=True, eq=False)
class Lines:
    """Segments in the image.

    Parameters
    ----------
    start, end : (2, s) float64
        Pixels.
    reach : (s,) float64
        How far beside the line its two sides are certain to be different regions, in pixels.
    """

    start: Floats
    end: Floats
    reach: Floats


SIDE = 1e-8
"""The same for straight edges: well above rounding, well below what counts."""


def find_lines(geometry: Geometry, faces: Faces, planes: list[tuple[Floats, Floats]], lens: Lens, folds: Ints) -> Lines:
    """All candidate edges of an image.

    Parameters
    ----------
    planes : list of (normal (3, 1), point (3, 1))
        The lights' planes, at which surfaces are creased.
    folds : (k,) int64
        Edges of faces that are known otherwise.
    """
    outline = [np.delete(ends, folds, axis=1) for ends in (faces.start, faces.end)]
    straight = [(outline[0], outline[1]), crossings(geometry)]
    straight += [_cuts(geometry, normal, point) for normal, point in planes]
    for index in range(geometry.disks):
        own = geometry.disk_normal[:, [index]], geometry.disk_center[:, [index]]
        if not any(np.array_equal(own, plane) for plane in planes):
            straight.append(disk_cuts(geometry, index))
    a, b, _ = lens.project(*(np.hstack(part) for part in zip(*straight, strict=True)))
    starts, ends, reach = [a], [b], [np.full(a.shape[1], SIDE)]
    for index in range(geometry.ellipsoids):
        for ring in _rings(geometry, faces, planes, lens, index):
            a, b, _ = lens.project(*_polygon(geometry, lens, index, *ring))
            starts.append(a)
            ends.append(b)
            reach.append(np.full(a.shape[1], 2 * CHORD))
    for index in range(geometry.disks):
        a, b, _ = lens.project(*_disk_polygon(geometry, lens, index))
        starts.append(a)
        ends.append(b)
        reach.append(np.full(a.shape[1], 2 * CHORD))
    return Lines(np.hstack(starts), np.hstack(ends), np.concatenate(reach))


def searched(g: Geometry, faces: Faces) -> bool:
    """Whether every line in which surfaces meet is among those of `find_lines`.

    Not those of two ellipsoids, of two disks, or of one of each.
    """
    half = np.sqrt((g.axes**2).sum(axis=2)).T
    near = (np.abs(g.center[:, :, None] - g.center[:, None]) <= half[:, :, None] + half[:, None]).all(axis=0)
    round_ = g.disks == 0 or g.disks + g.ellipsoids == 1
    flat = g.triangles**2 <= PAIRS or not contacts(g, faces).crossed
    return round_ and flat and int(near.sum()) <= g.ellipsoids


def _corners(g: Geometry) -> Floats:
    return np.stack((g.a, g.b, g.c), axis=2)


def _cut(corners: Floats, height: Floats) -> tuple[Floats, Floats]:
    """Where triangles (3, k, 3) cross height (k, 3) zero, given that they do: two ends (3, k)."""
    after, rise = np.roll(corners, -1, axis=2), np.roll(height, -1, axis=1) - height
    crosses = (height < 0) != (np.roll(height, -1, axis=1) < 0)
    t = -height / np.where(crosses, rise, 1.0)
    points = corners + t * (after - corners)
    first, last = crosses.argmax(axis=1), 2 - crosses[:, ::-1].argmax(axis=1)
    every = np.arange(corners.shape[1])
    return points[:, every, first], points[:, every, last]


def _straddles(height: Floats, slack: float) -> NDArray[np.bool_]:
    return np.asarray((height.min(axis=-1) < -slack) & (height.max(axis=-1) > slack))


def _cuts(g: Geometry, normal: Floats, point: Floats) -> tuple[Floats, Floats]:
    """Triangles cut by a plane."""
    corners = _corners(g)
    height = dot(normal[:, :, None], corners - point[:, :, None])
    slack = 1e-12 * float(np.abs(corners - point[:, :, None]).max(initial=0))
    cut = np.flatnonzero(_straddles(height, slack))
    return _cut(corners[:, cut], height[cut])


def crossings(g: Geometry) -> tuple[Floats, Floats]:
    """Segments in which pairs of triangles meet, coplanar ones apart."""
    nothing = np.zeros((3, 0)), np.zeros((3, 0))
    if not g.triangles > 1 or g.triangles**2 > PAIRS:
        return nothing
    corners, normal = _corners(g), unit(g.normal)
    height = dot(normal[:, :, None, None], corners[:, None] - g.a[:, :, None, None])  # over plane i, of triangle j
    slack = 1e-12 * float(np.abs(corners).max())
    # One may touch the other's plane from one side (a box on a floor): it is its edge that is seen then.
    cuts = _straddles(height, slack)
    i, j = np.nonzero(np.triu(cuts & cuts.T, 1))
    if i.size == 0:
        return nothing
    along = unit(cross(normal[:, i], normal[:, j]))
    ends = np.stack([*_cut(corners[:, j], height[i, j]), *_cut(corners[:, i], height[j, i])])  # (4, 3, k)
    origin = ends[0]
    where = np.stack([dot(along, end - origin) for end in ends])
    low = np.maximum(where[:2].min(axis=0), where[2:].min(axis=0))
    high = np.minimum(where[:2].max(axis=0), where[2:].max(axis=0))
    meet = np.flatnonzero(high > low)
    origin, along, low, high = origin[:, meet], along[:, meet], low[meet], high[meet]
    return origin + low * along, origin + high * along


Ring = tuple[Floats, float]
"""A plane m . l = delta in the ellipsoid's unit ball, m a unit vector (3, 1)."""


def _rings(g: Geometry, faces: Faces, planes: list[tuple[Floats, Floats]], lens: Lens, index: int) -> list[Ring]:
    """Silhouette and plane sections of one ellipsoid, in its own space."""
    center, axes = g.center[:, [index]], g.axes[index]
    eye, outside = origin_in(g, index, lens.origin)
    distance = math.sqrt(1 + outside)
    found: list[Ring] = [(eye / distance, 1 / distance)] if outside > 0 else []
    half = np.sqrt((axes**2).sum(axis=1))[:, None]
    low, high = (f(_corners(g), axis=2) for f in (np.min, np.max))
    touched = ((low <= center + half) & (high >= center - half)).all(axis=0)
    near = np.zeros(faces.count, dtype=bool)
    near[faces.of_triangle[touched]] = True
    flat = faces.triangle[near]
    sections = [(g.normal[:, [k]], g.a[:, [k]]) for k in flat] + planes
    for normal, point in sections:
        m = transform(axes.T, normal)
        length = math.sqrt(dot(m, m).item())
        delta = dot(normal, point - center).item() / length
        if abs(delta) < 1 - 1e-12:
            found.append((m / length, delta))
    return found


def _polygon(g: Geometry, lens: Lens, index: int, m: Floats, delta: float) -> tuple[Floats, Floats]:
    """The ring as a closed polygon in space, its area the ring's."""
    center, axes = g.center[:, [index]], g.axes[index]
    angle, swell = _steps(lens, center, float(np.linalg.norm(axes, 2)))
    u, v = frame(m)
    radius = math.sqrt(1 - delta * delta) * swell
    local = delta * m + radius * (np.cos(angle) * u + np.sin(angle) * v)
    points = center + transform(axes, local)
    return points, np.roll(points, -1, axis=1)


def _steps(lens: Lens, center: Floats, largest: float) -> tuple[Floats, float]:
    """Angles (k,) of a polygon that stands for a curve of that size, and how much larger its area makes it."""
    away = float(np.linalg.norm(center - lens.origin))
    pixels = largest / max(away - largest, 1e-2 * largest) * lens.height / 2 / float(np.linalg.norm(lens.up))
    count = int(np.clip(math.pi * math.sqrt(pixels / (2 * CHORD)), 16, 8192))
    angle = 2 * math.pi * (np.arange(count) + 0.31) / count
    return angle, math.sqrt(2 * math.pi / count / math.sin(2 * math.pi / count))


def _disk_polygon(g: Geometry, lens: Lens, index: int) -> tuple[Floats, Floats]:
    """A disk's rim as a closed polygon in space, of the disk's area."""
    points = disk_rim(g, index, *_steps(lens, g.disk_center[:, [index]], float(g.disk_radius[index])))
    return points, np.roll(points, -1, axis=1)


def disk_cuts(g: Geometry, index: int) -> tuple[Floats, Floats]:
    """Where a disk passes through triangles: segments within its rim."""
    center, radius = g.disk_center[:, [index]], float(g.disk_radius[index])
    start, end = _cuts(g, g.disk_normal[:, [index]], center)
    along, way = end - start, start - center
    square, half = dot(along, along), dot(along, way)
    inside = half * half - square * (dot(way, way) - radius * radius)
    k = np.flatnonzero((square > 0) & (inside > 0))
    start, along, square, half, root = start[:, k], along[:, k], square[k], half[k], np.sqrt(inside[k])
    low, high = np.maximum((-half - root) / square, 0.0), np.minimum((root - half) / square, 1.0)
    meet = np.flatnonzero(low < high)
    return start[:, meet] + low[meet] * along[:, meet], start[:, meet] + high[meet] * along[:, meet]


def light_planes(lights: tuple[Light, ...]) -> list[Plane]:
    """Normal and point of the lights' own planes, where they have one."""
    return [plane for plane in (light.plane() for light in lights) if plane is not None]
