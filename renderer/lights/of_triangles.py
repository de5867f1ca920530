"""What triangles of one radiance are: a triangle, a parallelogram, or a mesh that shines."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.validation import Vec3, triple
from nusselt.renderer.vectors import Floats, Ints

from .mesh import MeshLight
from .quad import QuadLight
from .triangle import TriangleLight

Lit = TriangleLight | QuadLight | MeshLight
ROUND = 1e-6
"""Relative difference of the sides of a parallelogram, as single precision has them."""


def of_triangles(vertices: Floats, faces: NDArray[np.int64], radiance: Vec3) -> Lit:
    """The light that shines at the fronts of triangles; vertices (3, v), faces (3, t) counter-clockwise from there."""
    if faces.shape[1] == 1:
        a, b, c = (triple(vertices[:, k]) for k in faces[:, 0])
        return TriangleLight(a, b, c, radiance)
    corner = _parallelogram(vertices, faces) if faces.shape[1] == 2 else None
    if corner is None:
        return MeshLight(Mesh(vertices, faces), radiance)
    p, ab, ac = (triple(v) for v in corner)
    return QuadLight(p, ac, ab, radiance)  # ours shines along -(ab x ac)


def _parallelogram(vertices: Floats, faces: Ints) -> tuple[Floats, Floats, Floats] | None:
    """A corner and the edges from it, counter-clockwise from the front, of two triangles; None if they are none."""
    first, second = (vertices[:, faces[:, k]] for k in range(2))
    size = np.abs(first - first[:, :1]).max()
    for k in range(3):  # the corner that the other triangle has not
        corner, nxt, last = (first[:, (k + step) % 3] for step in range(3))
        if any(np.abs(second[:, j] - (nxt + last - corner)).max() < ROUND * size for j in range(3)):
            shared = [min(np.abs(second[:, j] - v).max() for j in range(3)) for v in (nxt, last)]
            return (corner, nxt - corner, last - corner) if max(shared) < ROUND * size else None
    return None
