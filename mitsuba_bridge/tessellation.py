"""Ellipsoids as meshes: Mitsuba's sphere takes no other transform than rotation and uniform scale.

(3.9 only warns about a non-uniform one, and reports wrong normals for an instanced sphere.)
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Floats, frame

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


def tessellate_about(axes: Floats, foot: Floats, finest: float) -> tuple[Floats, Floats, NDArray[Any], float]:
    """The same with triangles the smaller the nearer they are to one place: for what is seen from close by.

    Rings about the place, each wider than the last by a step of its own meridians, up to the other side.

    Parameters
    ----------
    axes : (3, 3) float64
        Columns are the semi-axes.
    foot : (3, 1) float64
        The place, on the unit sphere.
    finest : float
        Angle on the unit sphere of the innermost ring.

    Returns
    -------
    vertices : (3, v) float64
        From the foot: what is near it keeps its digits.
    normals, triangles
        As in `tessellate`.
    error : float
        Largest distance of a triangle from the surface over its distance from the foot.
    """
    step = 2 * math.pi / RINGS
    widest = 0.9 * math.pi
    theta = np.geomspace(finest, widest, max(2, math.ceil(math.log(widest / finest) / step)))
    theta = np.concatenate((theta, np.arange(widest + step, math.pi, step)))
    phi = step * np.arange(RINGS)
    e, f = frame(foot)
    around = e[:, :, None] * np.cos(phi) + f[:, :, None] * np.sin(phi)
    sine, drop = np.sin(theta)[None, :, None], (2 * np.sin(theta / 2) ** 2)[None, :, None]
    ring = (around * sine - foot[:, :, None] * drop).reshape(3, -1)
    from_foot = np.hstack((ring, np.zeros((3, 1)), -2 * foot))
    m, last = phi.size, theta.size - 1
    k = np.arange(m)
    n = (k + 1) % m
    middle, far = np.full(m, ring.shape[1]), np.full(m, ring.shape[1] + 1)
    r = np.arange(last)[:, None] * m
    faces = [np.stack((middle, k, n)), np.stack((far, last * m + n, last * m + k))]
    faces += [np.stack([v.ravel() for v in (r + k, r + m + k, r + m + n)])]
    faces += [np.stack([v.ravel() for v in (r + k, r + m + n, r + n)])]
    triangles = np.hstack(faces)
    if np.linalg.det(axes) < 0:
        triangles = triangles[::-1]
    normals = np.linalg.inv(axes).T @ (from_foot + foot)
    normals /= np.linalg.norm(normals, axis=0)
    return np.asarray(axes) @ from_foot, normals, triangles, step**2 / 2
