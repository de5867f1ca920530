"""What the camera sees: the nearest surface along rays that share one origin.

With a common origin the edge functions of a triangle (see `watertight`) are the same for all rays and linear
in the direction (Olano & Greer 1997). In a tile of an image the direction is affine in the pixel, so their
signs at the tile's four corners tell which triangles it can see at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .geometry import Geometry, Ints
from .shadows import plane_bound
from .vectors import Floats, dot, transform, unit
from .watertight import edge_functions, one_norm

BLOCK = 1 << 15
"""Triangle-ray pairs handled at once: bounds the memory, and fits the cache."""


@dataclass(frozen=True)
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
        Index of the ellipsoid hit, -1 for triangles and misses.
    """

    surface: Ints
    position: Floats
    normal: Floats
    distance: Floats
    ellipsoid: Ints


@dataclass(frozen=True)
class Pencil:
    """All triangles about one origin, as rows that are linear in the direction.

    Parameters
    ----------
    rows : (4, 3, t) float64
        Three edge functions, turned so that all are positive inside, and a row that gives, times a direction, one
        over the distance along it to the triangle's plane (Olano & Greer 1997).
    slack : (3, t) float64
        The edge functions' rounding, relative to |d|_1.
    live : (t,) bool
        Whether the origin lies off the plane.
    """

    rows: Floats
    slack: Floats
    live: NDArray[np.bool_]

    @classmethod
    def about(cls, geometry: Geometry, origin: Floats) -> Pencil:
        """The pencil of an origin (3, 1)."""
        pairs = edge_functions(geometry.a, geometry.b, geometry.c, origin)
        height = dot(geometry.a - origin, geometry.normal)
        live = np.abs(height) > plane_bound(geometry.normal, geometry.a, origin)
        side = np.where(height < 0, -1.0, 1.0)
        nearness = geometry.normal / np.where(live, height, 1.0)
        rows = np.stack((*(edge * side for edge, _ in pairs), nearness))
        return cls(rows, np.stack([slack for _, slack in pairs]), live)

    def in_tile(self, corners: Floats, among: Ints | None = None) -> Ints:
        """Which triangles, of all or of some, can be hit by directions in the cone of four corner ones (3, 4)."""
        some = np.flatnonzero(self.live) if among is None else among
        rows = self.rows[..., some]
        highest = np.max([dot(np.moveaxis(rows, 1, 0), corner) for corner in corners.T[:, :, None, None]], axis=0)
        slack = 2 * self.slack[:, some] * one_norm(corners).max()
        return np.asarray(some[(highest[:3] >= -slack).all(axis=0) & (highest[3] > 0)])

    def nearest(self, d: Floats, chosen: Ints) -> tuple[Floats, Ints]:
        """One over the distance to the nearest of the chosen triangles along each direction, and which it is.

        0 and -1 where there is none. All functions are rows of one product, by einsum: a BLAS brings its own
        threads along, which stand in each other's way when all cores are busy.
        """
        n = d.shape[1]
        best, which = np.zeros(n), np.full(n, -1)
        rays, size = np.arange(n), float(one_norm(d).max(initial=0))
        step = max(1, BLOCK // max(n, 1))
        for start in range(0, chosen.size, step):
            block = chosen[start : start + step]
            w = np.einsum("rck,cn->rkn", self.rows[..., block], d)  # (4, block, n)
            inside = w[0] >= -size * self.slack[0, block, None]
            for edge in (1, 2):
                inside &= w[edge] >= -size * self.slack[edge, block, None]
            near = w[3] * inside
            nearest = near.argmax(axis=0)
            found = near[nearest, rays]
            better = found > best
            best[better] = found[better]
            which[better] = block[nearest[better]]
        return best, which

    def points(self, geometry: Geometry, d: Floats, triangle: Ints) -> Floats:
        """Where directions (3, n) meet the planes of triangles (n,): off them by ulps of the corners alone.

        From the corners, not from origin + t d, however far the camera is.
        """
        w = np.stack([dot(edge[:, triangle], d) for edge in self.rows[:3]])
        w = w / w.sum(axis=0)
        a, b, c = (corner[:, triangle] for corner in (geometry.a, geometry.b, geometry.c))
        return np.asarray(w[0] * a + w[1] * b + w[2] * c)


def ellipsoid_distance(geometry: Geometry, index: int, origin: Floats, d: Floats, certain: bool = False) -> Floats:
    """First positive crossing of an ellipsoid from the origin (3, 1) along d (3, n); inf where there is none.

    With ``certain`` directions that miss it by a hair are taken to touch it.

    The discriminant is taken from the closest approach, 1 - |o - (o.d)d|^2, which keeps its digits for
    spheres far away (Haines et al. 2019); the nearer root avoids the difference of two close numbers.
    """
    inverse = geometry.inverse[index]
    o, d = transform(inverse, origin - geometry.center[:, [index]]), transform(inverse, d)
    length2 = dot(d, d)
    b = dot(np.broadcast_to(o, d.shape), d)
    closest = o - d * (b / length2)
    discriminant = length2 * (1 - dot(closest, closest))
    c = dot(o, o) - 1
    root = np.sqrt(np.maximum(discriminant, 0))
    q = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        t0, t1 = q / length2, c / q
    near, far = np.minimum(t0, t1), np.maximum(t0, t1)
    t = np.where(near > 0, near, far)
    hit = certain | (discriminant >= 0)
    return np.where(hit & (t > 0), t, np.inf)


def first_hits(geometry: Geometry, origin: Floats, d: Floats, corners: Floats | None = None) -> Hits:
    """Nearest hit of each ray.

    Parameters
    ----------
    origin : (3, 1) float64
        Common origin.
    d : (3, n) float64
        Directions, of any length.
    corners : (3, 4) float64, optional
        Directions whose cone holds all of ``d``: triangles outside it are left out.
    """
    pencil = Pencil.about(geometry, origin)
    chosen = np.flatnonzero(pencil.live) if corners is None else pencil.in_tile(corners)
    near, triangle = pencil.nearest(d, chosen)
    n = d.shape[1]
    distance = np.divide(1.0, near, out=np.full(n, np.inf), where=near > 0)
    ellipsoid = np.full(n, -1)
    for index in range(geometry.ellipsoids):
        t = ellipsoid_distance(geometry, index, origin, d)
        nearer = t < distance
        distance = np.where(nearer, t, distance)
        ellipsoid[nearer] = index
    triangle = np.where(ellipsoid < 0, triangle, -1)
    return hits_at(geometry, pencil, origin, d, triangle, ellipsoid, distance)


def hits_at(
    geometry: Geometry, pencil: Pencil, origin: Floats, d: Floats, triangle: Ints, ellipsoid: Ints, distance: Floats
) -> Hits:
    """Hits on surfaces that are known: triangles' planes, or ellipsoids at a known distance; -1 for neither."""
    n = d.shape[1]
    position, normal = np.zeros((3, n)), np.zeros((3, n))
    surface = np.full(n, -1)
    on_triangle = np.flatnonzero(triangle >= 0)
    if on_triangle.size:
        k = triangle[on_triangle]
        position[:, on_triangle] = pencil.points(geometry, d[:, on_triangle], k)
        normal[:, on_triangle] = unit(geometry.normal[:, k])
        surface[on_triangle] = geometry.triangle_surface[k]
    for index in range(geometry.ellipsoids):
        mine = np.flatnonzero(ellipsoid == index)
        inverse, center = geometry.inverse[index], geometry.center[:, [index]]
        local = unit(transform(inverse, origin - center) + transform(inverse, d[:, mine]) * distance[mine])
        position[:, mine] = center + transform(geometry.axes[index], local)
        normal[:, mine] = unit(transform(inverse.T, local))
        surface[mine] = geometry.ellipsoid_surface[index]
    return Hits(surface, position, normal, distance, ellipsoid)
