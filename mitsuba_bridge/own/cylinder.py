"""Mitsuba's cylinder, which is no surface of ours, as a mesh: only where that is asked for, and said with its error."""

from __future__ import annotations

import math

import numpy as np

from nusselt.renderer.surfaces import Material, Mesh
from nusselt.renderer.vectors import Floats, column, frame, unit

from .nodes import Node
from .shapes import IGNORED, mesh_of, round_axes

FACETS = 1024
"""Around it; each is two triangles."""
DEPTH = 1 - math.cos(math.pi / FACETS)
"""Of a facet's middle below its corners, over the radius."""


def cylinder_of(shape: Node, matrix: Floats, material: Material) -> Mesh:
    """An open cylinder, its facets' corners outside by as much as their middles are inside.

    Parameters
    ----------
    shape : Node
    matrix : (4, 4) float64
        Places it after its own.
    material : Material
    """
    shape.holds("BSDF")
    shape.only("p0", "p1", "radius", "to_world", "flip_normals", *IGNORED)
    round_axes(shape, shape.matrix())
    start, end = column(shape.point("p0", (0.0, 0.0, 0.0))), column(shape.point("p1", (0.0, 0.0, 1.0)))
    if not (start != end).any():
        raise shape.refused("p0 and p1 in one place", "two ends")
    e, f = frame(unit(end - start))
    angle = 2 * math.pi * np.arange(FACETS) / FACETS
    ring = shape.number("radius", 1.0) * (1 + DEPTH / 2) * (e * np.cos(angle) + f * np.sin(angle))
    k, n = np.arange(FACETS), (np.arange(FACETS) + 1) % FACETS
    faces = np.hstack((np.stack((k, n, n + FACETS)), np.stack((k, n + FACETS, k + FACETS))))
    return mesh_of(np.hstack((start + ring, end + ring)), faces, matrix @ shape.matrix(), shape, material)


def cylinder_note(shape: Node) -> str:
    """What is said of one."""
    tilt = math.degrees(math.pi / FACETS)
    return (
        f"{shape.place}: {shape.title} is a mesh of {FACETS} facets, up to {DEPTH / 2:.1e} of its radius off, "
        f"its normals up to {tilt:.2f} degrees"
    )
