"""Irradiance of a uniform disk at infinity, cut by the receiver's horizon."""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.lights import SunLight
from nusselt.renderer.vectors import Floats, column, dot


def sun_irradiance(light: SunLight, normals: Floats) -> Floats:
    """Irradiance on planes of the given normals, relative to a plane that faces the sun's centre.

    Lambert's boundary integral 1/2 of n.(u x du) along the cap's circle and the horizon. With
    theta the angle from the normal to the centre and alpha the cap's half angle, cos(phi0) = -cot(alpha)
    cot(theta) and psi the half width of the cap on the horizon, the part above the horizon gives
    phi0 sin^2(alpha) cos(theta) - sin(alpha) cos(alpha) sin(theta) sin(phi0) + psi; wholly above it,
    pi sin^2(alpha) cos(theta).

    Relative error: rounding wholly above; 1e-16/alpha^2 across the horizon, where terms of order alpha leave
    one of order alpha^3 (5e-12 for the sun's 0.25 degrees).

    Parameters
    ----------
    normals : (3, n) float64
        Unit normals.

    Returns
    -------
    (n,) float64
        Multiply by ``light.irradiance``.
    """
    alpha = light.half_angle
    sin_a, cos_a = math.sin(alpha), math.cos(alpha)
    cos_t = dot(column(light.direction), normals)
    x = normals - cos_t * column(light.direction)
    sin_t = np.sqrt(dot(x, x))  # from the perpendicular part: keeps its digits near the pole
    across = np.abs(cos_t) < sin_a
    cos_phi = np.clip(-cos_t * cos_a / np.where(across, sin_t * sin_a, 1.0), -1.0, 1.0)
    sin_phi = np.sqrt(1 - cos_phi * cos_phi)
    half_width = sin_a * sin_phi
    psi = np.arctan2(half_width, cos_a * sin_t - sin_a * cos_phi * cos_t)
    cut = np.arccos(cos_phi) * sin_a * sin_a * cos_t - sin_a * cos_a * sin_t * sin_phi + psi
    return np.where(across, np.maximum(cut, 0.0) / (math.pi * sin_a * sin_a), np.maximum(cos_t, 0.0))
