"""What the camera sees: the nearest surface along rays that share one origin.

Triangles by `edge_functions` where they are few, by `screen_boxes` where they are many; disks and ellipsoids one
by one.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.flat_disks import disk_place, within_disk
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Floats, Ints, dot, frame, transform, unit
from nusselt.renderer.watertight import one_norm

from .nearest import Planes
from .screen_boxes import ImageBoxes, kept_boxes


@dataclass(frozen=True, eq=False)
class Hits:
    """The nearest hits of n rays.

    Parameters
    ----------
    surface : (n,) int64
        Row of the surface tables, -1 where nothing was hit.
    position : (3, n) float64
        On the surface to a few ulps of its own coordinates, however far the camera is.
    normal : (3, n) float64
        Unit geometric normal of the front side.
    distance : (n,) float64
        Ray parameter, in lengths of the direction given; inf where nothing was hit.
    ellipsoid : (n,) int64
        Index of the ellipsoid hit, -1 for other surfaces and misses.
    triangle : (n,) int64
        Index of the triangle hit, -1 for other surfaces and misses.
    """

    surface: Ints
    position: Floats
    normal: Floats
    distance: Floats
    ellipsoid: Ints
    triangle: Ints


@dataclass(frozen=True, eq=False)
class Seen:
    """Which surface each of n rays meets first, and what tells where.

    Parameters
    ----------
    triangle, disk, ellipsoid : (n,) int64
        The one that is met, -1 for the others.
    weight : (3, n) float64
        Edge functions of the triangle.
    distance : (n,) float64
        Ray parameter, in lengths of the direction given; inf where nothing is met.
    """

    triangle: Ints
    weight: Floats
    disk: Ints
    ellipsoid: Ints
    distance: Floats

    def take(self, index: Ints) -> Seen:
        """Those of the rays ``index`` (k,)."""
        return Seen(*(take(getattr(self, part.name), index) for part in fields(self)))


ULPS = 16 * 2.0**-53
"""Rounding of an origin in an ellipsoid's own space, relative to the terms it is summed of."""


def origin_in(geometry: Geometry, index: int, origin: Floats) -> tuple[Floats, float]:
    """The origin (3, 1) in an ellipsoid's own space, o, and |o|^2 - 1: above 0 outside.

    Exactly 0 where rounding cannot tell: who stands on the surface looks from inside, whatever the digits' last.
    """
    inverse, center = geometry.inverse[index], geometry.center[:, [index]]
    o = transform(inverse, origin - center)
    terms = transform(np.abs(inverse), np.abs(origin) + np.abs(center))
    outside = dot(o, o).item() - 1
    return o, 0.0 if abs(outside) <= ULPS * (dot(np.abs(o), terms).item() + 1) else outside


def ellipsoid_distance(geometry: Geometry, index: int, origin: Floats, d: Floats, certain: bool = False) -> Floats:
    """First positive crossing of an ellipsoid from the origin (3, 1) along d (3, n); inf where there is none.

    With ``certain`` directions that miss it by a hair are taken to touch it.

    The discriminant is taken from the closest approach, 1 - |o - (o.d)d|^2, which keeps its digits for
    spheres far away (Haines et al. 2019); the nearer root avoids the difference of two close numbers.
    """
    o, c = origin_in(geometry, index, origin)
    d = transform(geometry.inverse[index], d)
    length2 = dot(d, d)
    b = dot(np.broadcast_to(o, d.shape), d)
    closest = o - d * (b / length2)
    discriminant = length2 * (1 - dot(closest, closest))
    root = np.sqrt(np.maximum(discriminant, 0))
    q = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        t0, t1 = q / length2, c / q
    near, far = np.minimum(t0, t1), np.maximum(t0, t1)
    t = np.where(near > 0, near, far)
    hit = certain | (discriminant >= 0)
    return np.where(hit & (t > 0), t, np.inf)


def nearer_disks(geometry: Geometry, origin: Floats, d: Floats, near: Floats, triangle: Ints) -> tuple[Floats, Ints]:
    """What is seen once disks are there: one over the distance (n,), and the disk (n,) or -1.

    Parameters
    ----------
    origin : (3, 1) float64
    d : (3, n) float64
    near : (n,) float64
        One over the distance to the triangle seen without them; 0 where there is none.
    triangle : (n,) int64
        That triangle, -1 for none.

    Notes
    -----
    Of ties within rounding: a front before a black back, a light before what it lies on, then the first of the scene
    (`nearest`).
    """
    g, n, sizes = geometry, d.shape[1], one_norm(d)
    near, disk = near.copy(), np.full(n, -1)
    rounding, rank = np.zeros(n), np.zeros(n, dtype=np.int64)
    on = np.flatnonzero(triangle >= 0)
    k = triangle[on]
    planes = Planes.about(take(g.normal, k), take(g.a, k), origin)
    rounding[on] = planes.height * near[on] + planes.slope * sizes[on]
    rank[on] = 2 * planes.back + (g.light[g.triangle_surface[k]] < 0)
    for index in range(g.disks):
        planes = Planes.about(g.disk_normal[:, [index]], g.disk_center[:, [index]], origin)
        if not planes.live[0]:
            continue
        here, slope = dot(planes.nearness, d), planes.slope * sizes
        ahead = np.flatnonzero(here > slope)
        k = ahead[within_disk(g, index, origin, d[:, ahead])]
        doubt = planes.height * here[k] + slope[k]
        mine = 2 * int(planes.back[0]) + int(g.light[g.disk_surface[index]] < 0)
        tied = np.abs(here[k] - near[k]) <= doubt + rounding[k]
        won = np.where(tied, mine < rank[k], here[k] > near[k])
        k, doubt = k[won], doubt[won]
        near[k], rounding[k], rank[k], disk[k] = here[k], doubt, mine, index
    return near, disk


def first_hits(geometry: Geometry, origin: Floats, d: Floats, corners: Floats | None = None, frames: int = 1) -> Hits:
    """Nearest hit of each ray; see `nearest_surfaces`."""
    return hits_at(geometry, origin, d, nearest_surfaces(geometry, origin, d, corners, frames))


def nearest_surfaces(geometry: Geometry, origin: Floats, d: Floats, corners: Floats | None, frames: int = 1) -> Seen:
    """What each ray meets first.

    Parameters
    ----------
    origin : (3, 1) float64
        Common origin.
    d : (3, n) float64
        Directions, of any length.
    corners : (3, 3) float64 or None
        Directions c, c + u and c + v through three corners of a pixel, so that d is a multiple of
        c + x u + y v: what is found about the image plane is kept for further calls. None: every ray tests
        every triangle.
    frames : int
        So many times the same pixels, in turn, each time at one place in all of them.
    """
    if corners is None:
        boxes = ImageBoxes.about(geometry, origin, None)
    else:
        boxes = kept_boxes(geometry, origin.astype(float).tobytes(), corners.astype(float).tobytes())
    distance, triangle, weight = boxes.nearest(d, frames)
    n = d.shape[1]
    ellipsoid, disk = np.full(n, -1), np.full(n, -1)
    if geometry.disks:
        near, disk = nearer_disks(geometry, origin, d, 1 / distance, triangle)
        distance = np.where(disk < 0, distance, 1 / np.where(disk < 0, 1.0, near))
    for index in range(geometry.ellipsoids):
        t = ellipsoid_distance(geometry, index, origin, d)
        nearer = t < distance
        distance = np.where(nearer, t, distance)
        ellipsoid[nearer] = index
    triangle, disk = np.where((ellipsoid < 0) & (disk < 0), triangle, -1), np.where(ellipsoid < 0, disk, -1)
    return Seen(triangle, weight, disk, ellipsoid, distance)


def hits_at(geometry: Geometry, origin: Floats, d: Floats, seen: Seen) -> Hits:
    """Hits on surfaces that are known: triangles by their edge functions, disks, ellipsoids at a distance."""
    position, normal, surface = _on_triangles(geometry, seen.triangle, seen.weight)
    for index in range(geometry.disks):
        mine = np.flatnonzero(seen.disk == index)
        up = geometry.disk_normal[:, [index]]
        x, y = disk_place(geometry, index, origin, d[:, mine])
        e, f = frame(up)
        position[:, mine] = geometry.disk_center[:, [index]] + x * e + y * f
        normal[:, mine] = up
        surface[mine] = geometry.disk_surface[index]
    for index in range(geometry.ellipsoids):
        mine = np.flatnonzero(seen.ellipsoid == index)
        inverse, center = geometry.inverse[index], geometry.center[:, [index]]
        local = unit(transform(inverse, origin - center) + transform(inverse, d[:, mine]) * seen.distance[mine])
        position[:, mine] = center + transform(geometry.axes[index], local)
        normal[:, mine] = unit(transform(inverse.T, local))
        surface[mine] = geometry.ellipsoid_surface[index]
    return Hits(surface, position, normal, seen.distance, seen.ellipsoid, seen.triangle)


def _on_triangles(geometry: Geometry, triangle: Ints, weight: Floats) -> tuple[Floats, Floats, Ints]:
    """Position, normal and surface of hits on triangles (n,), with zeros and -1 where there is none (-1)."""
    n = triangle.size
    on = np.flatnonzero(triangle >= 0)
    everywhere = on.size == n
    if on.size == 0:
        return np.zeros((3, n)), np.zeros((3, n)), np.full(n, -1)
    k, w = (triangle, weight) if everywhere else (triangle[on], take(weight, on))
    # From the corners, not from origin + t d: off the plane by ulps of the corners alone.
    w = w / (w[0] + w[1] + w[2])
    at = w[0] * take(geometry.a, k)
    at += w[1] * take(geometry.b, k)
    at += w[2] * take(geometry.c, k)
    up = unit(take(geometry.normal, k))
    rows = take(geometry.triangle_surface, k)
    if everywhere:
        return at, up, rows
    position, normal, surface = np.zeros((3, n)), np.zeros((3, n)), np.full(n, -1)
    position[:, on], normal[:, on], surface[on] = at, up, rows
    return position, normal, surface
