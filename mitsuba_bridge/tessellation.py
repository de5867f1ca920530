"""Ellipsoids as meshes: Mitsuba's sphere takes no other transform than rotation and uniform scale.

(3.9 only warns about a non-uniform one, and reports wrong normals for an instanced sphere.)
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Floats

RINGS = 192


def tessellate(axes: Floats) -> tuple[Floats, Floats, NDArray[Any], float]:
    """The unit sphere under ``axes`` (3, 3) as vertices and normals (3, v), triangles (3, t), and its relative error.

    Rings of latitude and twice as many meridians; pushed out so that the mesh straddles the surface. The error
    is the largest distance from the surface over the semi-axis in that direction.
    """
    theta = math.pi * np.arange(1, RINGS) / RINGS
    phi = math.pi * np.arange(2 * RINGS) / RINGS
    ring = np.stack(
        [np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)), np.outer(np.cos(theta), phi**0)]
    ).reshape(3, -1)
    vertices = np.hstack((ring, [[0, 0], [0, 0], [1, -1]]))
    m, last = phi.size, RINGS - 2
    k = np.arange(m)
    n = (k + 1) % m
    top, bottom = np.full(m, ring.shape[1]), np.full(m, ring.shape[1] + 1)
    faces = [np.stack((top, k, n)), np.stack((bottom, last * m + n, last * m + k))]
    r = np.arange(last)[:, None] * m
    faces += [np.stack([v.ravel() for v in (r + k, r + m + k, r + m + n)])]
    faces += [np.stack([v.ravel() for v in (r + k, r + m + n, r + n)])]
    # A chord of one ring step lies 1 - cos(pi/2/RINGS)^2 inside; half of it is moved to the outside.
    inside = 1 - math.cos(math.pi / 2 / RINGS) ** 2
    triangles = np.hstack(faces)
    if np.linalg.det(axes) < 0:
        triangles = triangles[::-1]  # mirrored axes turn the triangles' backs outside; a sphere has none
    normals = np.linalg.inv(axes).T @ vertices
    normals /= np.linalg.norm(normals, axis=0)
    return np.asarray(axes) @ (vertices * (1 + inside / 2)), normals, triangles, inside / 2
