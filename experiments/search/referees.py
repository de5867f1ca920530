"""Two referees with formulas of their own: samples of the light's area, and of directions from the surface.

Lambert kd / pi, and the modified Phong lobe ks (s + 2) / (2 pi) max(w.u, 0)^s, each times n.u. Both are told as bounded
shares of the light's radiance, so that the error of their mean has a bound at a named level without any normality:
Maurer and Pontil's empirical Bernstein bound (2009), |mean - mu| <= sqrt(2 V ln(4/d) / n) + 7 R ln(4/d) / (3 (n - 1)).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, column, cross, dot, frame

from .casters import FLAT, coplanar, end_of, hidden, in_plane, reach
from .sensitivity import to_light

LEVEL = 1e-12
"""Chance that one mean is off by more than its bound: 1e-6 for a run of up to a million of them."""
BATCH = 4096
"""Samples at once."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Radiance (3, n), and how far it may be off at `LEVEL` for each of its ``means`` means."""

    mean: Floats
    width: Floats
    means: int


@dataclass
class _Mean:
    """A running mean (n,) of values in [0, range]."""

    range: Floats
    count: int = 0
    total: Floats | float = 0.0
    square: Floats | float = 0.0

    def add(self, value: Floats) -> None:
        self.count += value.shape[1]
        self.total = self.total + value.sum(axis=1)
        self.square = self.square + (value**2).sum(axis=1)

    @property
    def mean(self) -> Floats:
        return np.asarray(self.total / self.count)

    @property
    def width(self) -> Floats:
        n, told = self.count, math.log(4 / LEVEL)
        variance = np.maximum(self.square - n * self.mean**2, 0) / (n - 1)
        return np.asarray(np.sqrt(2 * variance * told / n) + 7 * self.range * told / (3 * (n - 1)))


Shares = Callable[[Geometry, ShadingPoints, QuadLight, int, np.random.Generator], tuple[_Mean, _Mean]]


def _lobe(points: ShadingPoints, u: Floats) -> Floats:
    """max(w.u, 0)^s for unit directions (3, n, k); 0 at a right angle for every s."""
    cosine = dot(points.mirror[:, :, None], u)
    with np.errstate(under="ignore"):
        return np.where(cosine > 0, np.maximum(cosine, 0) ** points.shininess[:, None], 0.0)


def _front(points: ShadingPoints, light: QuadLight, size: float) -> Floats:
    """Height of each point before the light, (n,); 0 to rounding is behind."""
    above = dot(column(light.normal), points.position - column(light.corner))
    return np.where(above > FLAT * size, above, 0.0)


def _size(geometry: Geometry, points: ShadingPoints) -> float:
    parts = (geometry.a, geometry.b, geometry.c, points.position)
    return max(float(np.abs(v).max(initial=0)) for v in parts)


def by_area(
    geometry: Geometry, points: ShadingPoints, light: QuadLight, samples: int, rng: np.random.Generator
) -> tuple[_Mean, _Mean]:
    """Diffuse and glossy share from uniform points of the light."""
    corner, ab, ac = (column(v)[:, :, None] for v in (light.corner, light.ab, light.ac))
    front = _front(points, light, _size(geometry, points))
    skip = coplanar(geometry, points.position) | in_plane(geometry, light)
    s = points.shininess
    distance, height = to_light(points, light)
    most = np.where(distance > 0, light.area * height / np.where(distance > 0, distance, 1.0) ** 3, np.inf)
    diffuse, glossy = _Mean(most / math.pi), _Mean(most * (s + 2) / (2 * math.pi))
    for first in range(0, samples, BATCH):
        u, v = rng.random((2, 1, points.count, min(BATCH, samples - first)))
        q = corner + u * ab + v * ac
        d = q - points.position[:, :, None]
        r2 = np.maximum(dot(d, d), 1e-300)
        d = d / np.sqrt(r2)
        seen = ~hidden(geometry, points, q, skip) & (front > 0)[:, None]
        arriving = seen * np.maximum(dot(points.normal[:, :, None], d), 0) * (front[:, None] / r2**1.5) * light.area
        diffuse.add(arriving / math.pi)
        glossy.add(arriving * _lobe(points, d) * ((s + 2) / (2 * math.pi))[:, None])
    return diffuse, glossy


def by_direction(
    geometry: Geometry, points: ShadingPoints, light: QuadLight, samples: int, rng: np.random.Generator
) -> tuple[_Mean, _Mean]:
    """Diffuse share from directions with the density of the cosine, glossy share with that of the lobe."""
    front = _front(points, light, _size(geometry, points))
    skip = coplanar(geometry, points.position) | in_plane(geometry, light)
    s = points.shininess
    most = (s + 2) / (s + 1)
    diffuse, glossy = _Mean(np.ones(points.count)), _Mean(most)
    for first in range(0, samples, BATCH):
        u, v = rng.random((2, points.count, min(BATCH, samples - first)))
        d = _about(points.normal, np.sqrt(u), v)
        diffuse.add(_meets(geometry, points, light, front, skip, d) * 1.0)
        if not points.is_glossy:
            glossy.add(np.zeros(u.shape))
            continue
        d = _about(points.mirror, u ** (1 / (s + 1))[:, None], v)
        cosine = np.maximum(dot(points.normal[:, :, None], d), 0)
        glossy.add(_meets(geometry, points, light, front, skip, d) * cosine * most[:, None])
    return diffuse, glossy


def _about(axis: Floats, cosine: Floats, turn: Floats) -> Floats:
    """Unit directions (3, n, k) at an angle to an axis (3, n)."""
    a, b = (v[:, :, None] for v in frame(axis))
    sine, phi = np.sqrt(np.maximum(1 - cosine**2, 0)), 2 * math.pi * turn
    return sine * np.cos(phi) * a + sine * np.sin(phi) * b + cosine * axis[:, :, None]


def _meets(
    geometry: Geometry, points: ShadingPoints, light: QuadLight, front: Floats, skip: Floats, d: Floats
) -> Floats:
    """Whether the ray along d (3, n, k) meets the light's front before anything else, (n, k)."""
    normal = -column(light.normal)  # of ab x ac: away from the points
    fall = dot(normal[:, :, None], d)
    t = np.where(fall > 0, front[:, None], 0.0) / np.where(fall > 0, fall, 1.0)
    q = points.position[:, :, None] + t * d
    to = q - column(light.corner)[:, :, None]
    ab, ac = (np.broadcast_to(column(v)[:, :, None], to.shape) for v in (light.ab, light.ac))
    u, v = dot(cross(to, ac), normal[:, :, None]) / light.area, dot(cross(ab, to), normal[:, :, None]) / light.area
    on = (t > 0) & (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1) & (dot(points.normal[:, :, None], d) > 0)
    q = np.where(on, q, (points.position + points.normal * reach(geometry, points))[:, :, None])  # any end that is none
    return np.asarray(on & ~hidden(geometry, points, q, skip))


REFEREES: dict[str, Shares] = {"area": by_area, "direction": by_direction}


def ask(
    name: str, scene: Scene, geometry: Geometry, points: ShadingPoints, samples: int, rng: np.random.Generator
) -> Estimate:
    """One referee's reflected radiance of all lights."""
    mean, width, means = np.zeros((3, points.count)), np.zeros((3, points.count)), 0
    for light in scene.lights:
        quad = light.parallelogram()
        if quad is not None:
            diffuse, glossy = REFEREES[name](geometry, points, quad, samples, rng)
            colour = column(quad.radiance)
            for albedo, part in ((points.diffuse, diffuse), (points.specular, glossy)):
                share = colour * albedo
                mean += share * part.mean
                # A width is infinite where nothing is known: of what reflects nothing, all is.
                width += share * np.where(share > 0, part.width, 0.0)
            means += 2 * points.count
        elif not isinstance(light, PointLight | DirectionalLight):
            raise TypeError(f"no referee knows a {light.kind} light")
        else:
            mean += _sharp(geometry, points, light)
    return Estimate(mean, width, means)


def _sharp(geometry: Geometry, points: ShadingPoints, light: Light) -> Floats:
    """Radiance (3, n) of a light without extent."""
    end = end_of(geometry, points, light)
    d = end - points.position
    r2 = dot(d, d)
    u = d / np.sqrt(r2)
    seen = ~hidden(geometry, points, end[:, :, None], coplanar(geometry, points.position))[:, 0]
    strength = column(light.colour) / (1 if light.at_infinity else r2)
    s = points.shininess
    lobe = points.specular * ((s + 2) / (2 * math.pi) * _lobe(points, u[:, :, None])[:, 0])
    return np.asarray(strength * seen * np.maximum(dot(points.normal, u), 0) * (points.diffuse / math.pi + lobe))
