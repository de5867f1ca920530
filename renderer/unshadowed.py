"""What a light reflects where nothing is in the way, in closed form: Lambert plus the modified Phong lobe.

Reflected radiance = L [ kd/pi E + ks (s+2)/(2 pi) I(s) ], E the irradiance and I the lobe integral of the light's
polygon for unit radiance (`irradiance`, `phong_lobe`).
"""

from __future__ import annotations

import math

import numpy as np

from .closed_forms.irradiance import irradiance
from .closed_forms.phong_lobe import phong_lobe
from .closed_forms.sun import sun_irradiance
from .geometry.arrays import Ints
from .light_points import colour, faced_by, sun_directions
from .lights import QuadLight, SunLight
from .shading import ShadingPoints, reflect
from .vectors import Floats, column, dot

RADII, ANGLES = 12, 24
"""Nodes over the sun's disk for a glossy surface: Gauss-Legendre in the squared radius, equal steps around."""


def quad_patch(points: ShadingPoints, corner: Floats, ab: Floats, ac: Floats, glossy: bool) -> tuple[Floats, Floats]:
    """Light of the parallelogram corner + u ab + v ac, one-sided, of unit radiance.

    Parameters
    ----------
    corner, ab, ac : (3, 1) or (3, n) float64
        Emits on the side of -(ab x ac).

    Returns
    -------
    radiance : (3, n) float64
        Reflected.
    bound : (n,) float64
        Of its relative error; what is below 1e-280 is nothing.
    """
    facing = faced_by(corner, ab, ac, points.position)
    heights = [dot(points.normal, v - points.position) for v in (corner, corner + ab, corner + ac, corner + ab + ac)]
    lit = np.flatnonzero(facing & (np.maximum.reduce(heights) > 0))  # the others are the dearest, and get nothing
    out, error = np.zeros_like(points.position), np.zeros_like(points.position)
    if lit.size:
        where = [_of(v, lit) for v in (corner, ab, ac)]
        value, bound = irradiance(points.position[:, lit], points.normal[:, lit], *where)
        out[:, lit] = points.diffuse[:, lit] * (value / math.pi)
        error[:, lit] = out[:, lit] * bound
    if glossy:
        shiny = np.flatnonzero((points.specular > 0).any(axis=0) & facing)
        if shiny.size:
            few = points.take(shiny)
            where = [_of(v, shiny) for v in (corner, ab, ac)]
            power, bound = phong_lobe(few.position, few.normal, few.mirror, few.shininess, *where)
            lobe = few.specular * ((few.shininess + 2) / (2 * math.pi) * power)
            out[:, shiny] += lobe
            error[:, shiny] += lobe * bound
    return out, np.divide(error, out, out=np.zeros_like(out), where=out > 1e-280).max(axis=0)


def _of(v: Floats, index: Ints) -> Floats:
    """The chosen columns of vectors that may be one for all."""
    return v if v.shape[1] == 1 else v[:, index]


def quad_light(points: ShadingPoints, light: QuadLight, glossy: bool) -> tuple[Floats, Floats]:
    """Reflected radiance (3, n) due to a whole parallelogram light, and a bound (n,) of its relative error."""
    corner, ab, ac = column(light.corner), column(light.ab), column(light.ac)
    radiance, bound = quad_patch(points, corner, ab, ac, glossy)
    return radiance * colour(light), bound


def sun_light(points: ShadingPoints, light: SunLight, glossy: bool) -> Floats:
    """Reflected radiance (3, n) due to the sun: closed form for Lambert, quadrature over its disk for the lobe.

    The quadrature's relative error is below 1e-12 while the disk lies above both horizons and the exponent times
    alpha^2 is below about 100; across a horizon it is about 1/300 of the lobe's share.
    """
    out = points.diffuse * (sun_irradiance(light, points.normal) / math.pi)
    shiny = np.flatnonzero((points.specular > 0).any(axis=0)) if glossy else np.empty(0, dtype=np.int64)
    for start in range(0, shiny.size, 4096):
        some = shiny[start : start + 4096]
        few = points.take(some)
        nodes, weights = np.polynomial.legendre.leggauss(RADII)
        u = np.repeat((nodes + 1) / 2, ANGLES)[None]
        v = np.tile((np.arange(ANGLES) + 0.5) / ANGLES, RADII)[None]
        d = np.broadcast_to(sun_directions(light, u, v), (3, some.size, u.size))
        share = np.repeat(weights / 2, ANGLES) / ANGLES / dot(column(light.direction)[:, :, None], d[:, :1])
        with_lobe = reflect(few, d, share, True)
        out[:, some] += with_lobe - reflect(few, d, share, False)
    return out * colour(light)
