"""How much rounding of a scene's own numbers may change a point's light.

A rotation rounds coordinates: what is rendered then is another scene, 1e-16 of the coordinates away. Its edges are seen
elsewhere by that over their distance, and sweep so much of the light; the point itself sees the light elsewhere by it
over the light's distance. This follows from the geometry and asks no renderer.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, column, cross, dot

from .motions import corners

EPSILON = 2.0**-53
ROUNDINGS = 64.0
"""Roundings of a coordinate, of either twin, times edges that cross the light."""
FLAT = 16 * EPSILON
"""What is this low over a point's plane, relative to the coordinates, is taken to lie in it."""


def to_segments(p: Floats, a: Floats, b: Floats) -> Floats:
    """Distances of points (3, n) from segments (3, n, m) or (3, 1, m), each (n, m)."""
    along, to = b - a, p[:, :, None] - a
    length2 = dot(along, along)
    t = np.clip(dot(to, along) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    off = to - t * along
    return np.sqrt(dot(off, off))


def to_light(points: ShadingPoints, light: QuadLight) -> tuple[Floats, Floats]:
    """Distance of each point from the parallelogram, and height over its plane, each (n,)."""
    p, ring = points.position, corners(light)
    normal = -column(light.normal)  # of ab x ac
    to = p - ring[:, :1]
    height = np.abs(dot(normal, to))
    away = to_segments(p, ring[:, None], np.roll(ring, -1, axis=1)[:, None]).min(axis=1)
    ab, ac = column(light.ab), column(light.ac)
    u, v = dot(cross(to, ac), normal) / light.area, dot(cross(ab, to), normal) / light.area
    over = (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
    return np.where(over, height, away), height


def scale_of(points: ShadingPoints, light: Light) -> Floats:
    """The most a light can give (3, n): radiance times solid angle times the largest reflectance, no cosine."""
    lobe = points.specular * ((points.shininess + 2) / (2 * np.pi))
    reflectance = points.diffuse / np.pi + lobe
    quad = light.parallelogram()
    if quad is not None:
        distance = np.maximum(to_light(points, quad)[0], np.sqrt(quad.area) * 1e-12)
        angle = np.minimum(quad.area / distance**2, 2 * np.pi)
        return np.asarray(reflectance * angle * column(quad.radiance))
    if not isinstance(light, PointLight | DirectionalLight):
        raise TypeError(f"no random scene has a {light.kind} light")
    place, _ = light.middle()
    d = place - points.position
    return np.asarray(reflectance / (1 if light.at_infinity else dot(d, d)) * column(light.colour))


def nearest(points: ShadingPoints, geometry: Geometry, size: float) -> Floats:
    """Distance (n,) of the nearest edge above each point's plane; for round bodies, what stands for it.

    An edge's silhouette turns by its displacement over its distance; a sphere's by that over the tangent's length.
    """
    p, n = points.position, points.normal
    low = FLAT * size
    found = np.full(points.count, np.inf)
    if geometry.triangles:
        a = np.hstack((geometry.a, geometry.b, geometry.c))
        b = np.hstack((geometry.b, geometry.c, geometry.a))
        ha = dot(n[:, :, None], a[:, None] - p[:, :, None]) - low
        hb = dot(n[:, :, None], b[:, None] - p[:, :, None]) - low
        rise = np.where(ha == hb, 1.0, ha - hb)
        cut = a[:, None] + np.clip(ha / rise, 0, 1) * (b - a)[:, None]
        starts = np.where(ha > 0, a[:, None], cut)
        ends = np.where(hb > 0, b[:, None], cut)
        away = to_segments(p, starts, ends)
        found = np.where((ha > 0) | (hb > 0), away, np.inf).min(axis=1)
    for index in range(geometry.ellipsoids):
        axes, inverse = geometry.axes[index], geometry.inverse[index]
        lengths = np.linalg.svd(axes, compute_uv=False)
        local = np.einsum("ij,jn->in", inverse, p - geometry.center[:, [index]])
        tangent = np.sqrt(np.maximum(dot(local, local) - 1, 0))
        own = points.ellipsoid == index
        away = lengths[2] * np.where(own, 1.0, tangent) * lengths[2] / lengths[0]
        top = dot(n, geometry.center[:, [index]] - p) + np.sqrt(((axes.T @ n) ** 2).sum(axis=0))
        found = np.where(own | (top > low), np.minimum(found, away), found)
    return found


def input_noise(points: ShadingPoints, geometry: Geometry, lights: tuple[Light, ...], size: float) -> Floats:
    """What rounding of coordinates of up to ``size`` may change of each point's radiance, (3, n)."""
    edge = np.maximum(nearest(points, geometry, size), EPSILON * size)
    total = np.zeros((3, points.count))
    for light in lights:
        blur = 1.0 + points.shininess * (points.specular.max(axis=0) > 0)
        quad = light.parallelogram()
        if quad is not None:
            distance, _ = to_light(points, quad)
            distance = np.maximum(distance, EPSILON * size)
            longest = max(np.sqrt((np.array(v) ** 2).sum()) for v in (quad.ab, quad.ac))
            thin = quad.area / longest
            swept = size / edge * (1 + (distance + longest) / thin)
            own = blur * (1 + size / distance) * (1 + size / thin)
            total += ROUNDINGS * EPSILON * (swept + own) * scale_of(points, light)
        else:
            total += ROUNDINGS * EPSILON * blur * (1 + size / edge) * scale_of(points, light)
    return total
