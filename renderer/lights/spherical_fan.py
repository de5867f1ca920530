"""Directions to a triangle or a parallelogram, uniform in solid angle: the spherical polygon as a fan about a corner.

Arvo 1995 sweeps a spherical triangle by arcs from one corner, each cutting off a known solid angle. Here with the
half-angle tangents of van Oosterom & Strackee 1983 in place of sums of angles, which cancel where the light is small
(Peters 2021, "BRDF importance sampling for polygonal lights"): tan(Omega/2) = det(a, b, c) / (1 + a.b + a.c + b.c).
A parallelogram, rectangle or not, is a fan of two such triangles; the square's u sweeps through both, so strata stay
connected.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from nusselt.renderer.vectors import Floats, cross, dot, unit

from .facing import faced_by

SMALL = 1e-14
"""Solid angle, sr, up to which the area is sampled instead, which is then as good.

Above it places are right to 1e-14 / sqrt(Omega) of the light's size, against 50 digits: contact down to heights of
1e-12 of it, needles of 1e-14, light seen edge-on; 1e-7 where it is small and seen edge-on at once. The weight is right
to eps over the cosine at the light, and to eps over the height straight before an edge.
"""
Beams = tuple[Floats, Floats]


@dataclass(frozen=True, eq=False)
class Outline:
    """The triangle corner + s ab + t ac, s + t <= 1, or, where ``four``, the parallelogram s, t <= 1.

    Corner and edges are (3, 1); it shines on the side of -(ab x ac).
    """

    corner: Floats
    ab: Floats
    ac: Floats
    four: bool


def fan_beams(outline: Outline, points: Floats, u: Floats, v: Floats, otherwise: Beams) -> Beams:
    """Beams (see `Light.beams`) of density one over the solid angle; at points that see little of it ``otherwise``."""
    d, weight = otherwise
    before = np.flatnonzero(faced_by(outline.corner, outline.ab, outline.ac, points))
    fan = _fan(outline, points[:, before])
    whole = _whole(fan)
    large = np.flatnonzero(whole > SMALL)
    index = before[large]
    if index.size:
        u, v = (np.broadcast_to(w, weight.shape)[index] for w in (u, v))
        way = _directions([(a[:, large], b[:, large], c[:, large], angle[large]) for a, b, c, angle in fan], u, v)
        d[:, index] = _places(outline, points[:, index], way)
        weight[index] = whole[large, None] / u.shape[1]
    return d, weight


Triangle = tuple[Floats, Floats, Floats, Floats]
"""Unit ways a, b, c (3, n) to its corners, b to the fan's, and its solid angle (n,)."""


def _fan(outline: Outline, points: Floats) -> list[Triangle]:
    """The triangles as points (3, n) before the light see them.

    Relative error of the angles: rounding over the cosine at the light, whatever its size.
    """
    way = outline.corner - points
    far = (way + outline.ab + outline.ac,) if outline.four else ()
    rim = (way + outline.ab, *far, way + outline.ac)
    volume, b = dot(cross(outline.ab, outline.ac), way), unit(way)
    fan = []
    for first, last in pairwise(rim):
        a, c = unit(first), unit(last)
        determinant = volume / np.sqrt(dot(way, way) * dot(first, first) * dot(last, last))
        fan.append((a, b, c, 2 * np.arctan2(determinant, _one_plus(a, b) + dot(a + b, c))))
    return fan


def _whole(fan: list[Triangle]) -> Floats:
    return np.sum([angle for *_, angle in fan], axis=0)


def _directions(fan: list[Triangle], u: Floats, v: Floats) -> Floats:
    """Unit directions (3, n, k) through (u, v), (n, k) each, of density one over the sum of the fan's angles."""
    ahead = u * _whole(fan)[:, None]
    way = _on_arc(fan[0], ahead, v)
    for triangle, (*_, passed) in zip(fan[1:], fan[:-1], strict=True):
        ahead = ahead - passed[:, None]
        way = np.where(ahead > 0, _on_arc(triangle, ahead, v), way)
    return way


def _on_arc(triangle: Triangle, ahead: Floats, v: Floats) -> Floats:
    """On the triangle's arc from b that cuts ``ahead`` (n, k) off its angle, beside a; v runs away from b.

    Its end d lies on the arc from a to c: tan(ahead/2) = det(a, b, d) / (1 + a.b + (a + b).d) is linear in the
    half-way vector m ~ a + d, and gives it as a sum of two with weights above 0: no difference of products.
    """
    a, b, c = (way[:, :, None] for way in triangle[:3])
    angle = triangle[3][:, None]
    beside = _one_plus(a, b)
    root = np.sqrt(2 * beside * _one_plus(a, c) * _one_plus(b, c))  # det(a, b, c) over the sine of angle/2
    m = a * (root * np.sin((angle - ahead) / 2)) + (a + c) * (beside * np.sin(ahead / 2))
    end = unit(m * (2 * dot(a, m) / np.maximum(dot(m, m), 1e-300)) - a)
    fall = v * _one_plus(end, -b)  # 1 - cos of the way from b: uniform along the arc in area
    rest = 2 * (1 - v) + v * _one_plus(end, b)
    return b * (1 - fall) + unit(end - dot(b, end) * b) * np.sqrt(fall * rest)


def _places(outline: Outline, points: Floats, way: Floats) -> Floats:
    """From points (3, n) along directions (3, n, k) to the light: ends are on it, whatever the rounding."""
    corner, ab, ac = (side[:, :, None] for side in (outline.corner, outline.ab, outline.ac))
    start, normal = corner - points[:, :, None], cross(ab, ac)
    toward = dot(normal, way)
    to = way * (dot(normal, start) / np.where(toward > 0, toward, np.inf)) - start
    size = dot(normal, normal)
    s = np.clip(dot(cross(to, ac), normal) / size, 0, 1)
    t = np.clip(dot(cross(ab, to), normal) / size, 0, 1)
    if not outline.four:
        over = np.maximum(s + t, 1.0)
        s, t = s / over, t / over
    return start + s * ab + t * ac


def _one_plus(a: Floats, b: Floats) -> Floats:
    """1 + a.b of unit vectors, without cancellation where they are opposite."""
    both = a + b
    return np.asarray(dot(both, both) / 2)
