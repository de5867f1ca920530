"""Triangles that a closed body hides from the eye by itself: those that turn away, seen from outside.

A closed surface that meets itself nowhere parts space in two, and on each of its sides lies one of them. What is met
first from an eye, of that surface alone, is met on the side the eye is on.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.camera.nearest import Planes
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.vectors import Bools, Floats, cross, dot

from .faces import Faces
from .folds import contacts

FLAT = 1e-6
"""Volume of a body, relative to its surface to the power 3/2, below which its outside is not told."""
ON = 1e-4
"""Share of all directions that a body takes less or more than none or all of, and solid angle of a triangle in whose
plane the eye lies, above which it lies on the body."""


def far_sides(geometry: Geometry, faces: Faces, origin: Floats, planes: Planes) -> Bools:
    """Triangles (t,), of planes about an origin (3, 1), that no ray from there meets first."""
    found = contacts(geometry, faces)
    body, whole = found.body, found.closed
    corners = [corner - origin for corner in (geometry.a, geometry.b, geometry.c)]
    angle = _solid_angle(*corners)
    around = np.bincount(body, angle, geometry.triangles) / (4 * np.pi)
    a, b, c = (corner - corners[0][:, body] for corner in corners)  # volumes about a corner of each body
    volume = np.bincount(body, dot(a, cross(b, c)) / 6, geometry.triangles)
    surface = np.bincount(body, np.sqrt(dot(geometry.normal, geometry.normal)) / 2, geometry.triangles)
    sure = whole & (np.abs(volume) > FLAT * surface**1.5) & (np.abs(around - np.rint(around)) < ON)
    sure[body[~planes.live & (np.abs(angle) > ON)]] = False
    inside = np.abs(around) > 0.5
    shows_back = (volume < 0) != inside
    return np.asarray(sure[body] & (planes.back != shows_back[body]))


def _solid_angle(a: Floats, b: Floats, c: Floats) -> Floats:
    """Of triangles about the origin (van Oosterom & Strackee 1983), signed."""
    x, y, z = (np.sqrt(dot(v, v)) for v in (a, b, c))
    return np.asarray(2 * np.arctan2(dot(a, cross(b, c)), x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y))
