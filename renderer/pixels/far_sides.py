"""Triangles that a closed body hides from the eye by itself: those that turn away, seen from outside.

A closed surface that meets itself nowhere parts space in two, and on each of its sides lies one of them. What is met
first from an eye, of that surface alone, is met on the side the eye is on.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.vectors import Bools, Floats, cross, dot

from .faces import Faces
from .folds import contacts

FLAT = 1e-6
"""Volume of a body, relative to its surface to the power 3/2, below which its outside is not told."""


def far_sides(geometry: Geometry, faces: Faces, origin: Floats, back: Bools) -> Bools:
    """Triangles (t,) that no ray from the origin (3, 1) meets first; it lies at the ``back`` of some (t,)."""
    found = contacts(geometry, faces)
    body, whole = found.body, found.closed
    corners = [corner - origin for corner in (geometry.a, geometry.b, geometry.c)]
    around = np.bincount(body, _solid_angle(*corners), geometry.triangles) / (4 * np.pi)
    a, b, c = (corner - corners[0][:, body] for corner in corners)  # volumes about a corner of each body
    volume = np.bincount(body, dot(a, cross(b, c)) / 6, geometry.triangles)
    surface = np.bincount(body, np.sqrt(dot(geometry.normal, geometry.normal)) / 2, geometry.triangles)
    sure = whole & (np.abs(volume) > FLAT * surface**1.5) & (np.abs(np.abs(around) - 0.5) > 0.25)
    inside = np.abs(around) > 0.5
    shows_back = (volume < 0) != inside
    return np.asarray(sure[body] & (back != shows_back[body]))


def _solid_angle(a: Floats, b: Floats, c: Floats) -> Floats:
    """Of triangles about the origin (van Oosterom & Strackee 1983), signed."""
    x, y, z = (np.sqrt(dot(v, v)) for v in (a, b, c))
    return np.asarray(2 * np.arctan2(dot(a, cross(b, c)), x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y))
