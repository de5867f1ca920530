"""Directions to a rectangle, uniform in solid angle, along its own sides.

Ureña, Fajardo & King 2013, "An Area-Preserving Parametrization for Spherical Rectangles": u cuts the solid angle by a
line of constant x, v goes along it. Equal strata of the square are then compact parts of the light, where those of a
fan about a corner (`spherical_fan`) are wedges: around a lamp of 1 m in a room the variance is 0.68 of the fan's with
16 strata, 0.61 with 64 (medians), in 0.3 of its time. With independent samples the two are alike.
"""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.vectors import Floats, cross, dot, unit

from .facing import faced_by
from .spherical_fan import Beams, Outline, fan_beams

LARGE = 1e-3
"""Solid angle, sr, from which it is used: a sum of four angles, less 2 pi, where digits cancel that the fan keeps.

Above it places are right to 1e-10 of the light's size, and weights to 1e-12, against 50 digits.
"""
RIGHT = 1e-12
"""Cosine between the sides of what is a rectangle."""


def is_rectangle(outline: Outline) -> bool:
    """Whether the sides of a parallelogram are at right angles."""
    return bool(abs(dot(unit(outline.ab), unit(outline.ac)).item()) <= RIGHT)


def rectangle_beams(outline: Outline, points: Floats, u: Floats, v: Floats, otherwise: Beams) -> Beams:
    """Beams (see `Light.beams`) to a rectangle, of density one over the solid angle; by the fan where that is small."""
    d, weight = otherwise
    u, v = (np.broadcast_to(w, weight.shape) for w in (u, v))
    before = faced_by(outline.corner, outline.ab, outline.ac, points)
    sides = _sides(outline, points)
    angles = _angles(*sides)
    whole = np.sum(angles, axis=0) - 2 * math.pi
    large = before & (whole > LARGE)
    far, near = np.flatnonzero(before & ~large), np.flatnonzero(large)
    if far.size:
        d[:, far], weight[far] = fan_beams(outline, points[:, far], u[far], v[far], (d[:, far], weight[far]))
    if near.size:
        s, t = _places(
            [side[near, None] for side in sides],
            whole[near, None],
            (angles[2] + angles[3])[near, None],
            u[near],
            v[near],
        )
        corner, ab, ac = (side[:, :, None] for side in (outline.corner, outline.ab, outline.ac))
        d[:, near] = corner - points[:, near, None] + s * ab + t * ac
        weight[near] = whole[near, None] / u.shape[1]
    return d, weight


def _sides(outline: Outline, points: Floats) -> tuple[Floats, ...]:
    """x0, x1, y0, y1 and -z (n,) of the rectangle from points (3, n), along its sides and before it."""
    corner, x, y = outline.corner - points, unit(outline.ab), unit(outline.ac)
    x0, y0, z = dot(x, corner), dot(y, corner), -np.abs(dot(unit(cross(x, y)), corner))
    return x0, x0 + dot(x, outline.ab), y0, y0 + dot(y, outline.ac), z


def _angles(x0: Floats, x1: Floats, y0: Floats, y1: Floats, z: Floats) -> tuple[Floats, ...]:
    """At the corners of the spherical rectangle, between the planes of neighbouring sides, y0's and x1's first.

    By sine and cosine: an arc cosine alone loses half its digits where the light is seen edge-on.
    """

    def between(a: Floats, b: Floats) -> Floats:
        return np.arctan2(np.abs(z) * np.sqrt(a * a + b * b + z * z), a * b)

    return between(y0, x1), between(-x1, y1), between(-y1, -x0), between(x0, -y0)


def _places(sides: list[Floats], whole: Floats, last: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Shares s, t (n, k) of the way along both sides; ``last`` is the sum of the angles beside y1's and x0's planes."""
    x0, x1, y0, y1, z = sides
    b0, b1 = -y0 / np.hypot(z, y0), y1 / np.hypot(z, y1)
    angle = u * whole + 2 * math.pi - last
    with np.errstate(divide="ignore"):
        slope = (np.cos(angle) * b0 - b1) / np.sin(angle)
        c = np.clip(np.copysign(1 / np.hypot(slope, b0), slope), -1, 1)
        x = np.clip(-c * z / np.sqrt(1 - c * c), x0, x1)
    distance = np.hypot(x, z)
    low, high = y0 / np.hypot(distance, y0), y1 / np.hypot(distance, y1)
    h = low + v * (high - low)
    with np.errstate(divide="ignore"):
        y = np.clip(h * distance / np.sqrt(np.maximum(1 - h * h, 0)), y0, y1)
    return (x - x0) / (x1 - x0), (y - y0) / (y1 - y0)
