"""Mitsuba's shapes as our meshes and ellipsoids."""

from __future__ import annotations

import itertools
import math

import numpy as np

from nusselt.renderer.placed import ROUND, ball, moved, outside_out
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.vectors import Floats, Ints

from .nodes import Node

FILES = ("obj", "ply", "serialized")
IGNORED = ("silhouette_sampling_weight",)


def shape_of(shape: Node, matrix: Floats, material: Material) -> Mesh | Ellipsoid:
    """A shape that is no light, placed by a matrix (4, 4) after its own."""
    shape.holds("BSDF")
    if shape.plugin == "sphere":
        shape.only("center", "radius", "to_world", "flip_normals", *IGNORED)
        _not_flipped(shape)
        _plain(shape, material)
        return _sphere(shape, matrix, material)
    if shape.plugin in FILES:
        shape.only(
            *("filename", "to_world", "face_normals", "flip_normals", "flip_tex_coords", "shape_index"), *IGNORED
        )
        return mesh_of(*triangles_of(shape), matrix, shape, material, None if shape.mesh is None else shape.mesh[3])
    if shape.plugin in ("rectangle", "cube"):
        shape.only("to_world", "flip_normals", *IGNORED)
        if shape.plugin == "cube":
            _plain(shape, material)
            return mesh_of(*CUBE, matrix @ shape.matrix(), shape, material)
        return mesh_of(*RECTANGLE, matrix @ shape.matrix(), shape, material, RECTANGLE_UV)
    way_on = "; --as-mesh puts a mesh in its place" * (shape.plugin == "cylinder")
    raise shape.refused(shape.plugin, ", ".join(("rectangle", "cube", "sphere", "instance", *FILES)) + way_on)


SMOOTH = 1e-3
"""By which a shading normal may be off its face's."""


def triangles_of(shape: Node) -> tuple[Floats, Ints]:
    """What Mitsuba has loaded of a mesh, unless its shading normals bend light: ours are those of the faces."""
    if shape.mesh is None:
        raise shape.refused("no triangles", "a mesh that Mitsuba loads")
    vertices, faces, normals, _ = shape.mesh
    if normals.size:
        a, b, c = (vertices[:, k] for k in faces)
        flat = np.cross(b - a, c - a, axis=0)
        flat /= np.maximum(np.sqrt((flat * flat).sum(axis=0)), 1e-300)
        if any(np.abs((normals[:, k] * flat).sum(axis=0) - 1).max(initial=0.0) > SMOOTH for k in faces):
            raise shape.refused("shading normals", "flat faces: face_normals, true")
    return vertices, faces


def _not_flipped(shape: Node) -> None:
    if shape.flag("flip_normals"):
        raise shape.refused("flip_normals", "a surface that faces outwards")


def round_axes(shape: Node, matrix: Floats) -> float:
    """By how much a transform scales a sphere; what does more to it is not what Mitsuba makes an ellipsoid of."""
    axes = matrix[:3, :3]
    square = float((axes[:, 0] ** 2).sum())
    if np.abs(axes.T @ axes - square * np.eye(3)).max() > ROUND * square or np.linalg.det(axes) <= 0:
        raise shape.refused("a to_world that stretches, shears or mirrors it", "one that turns, moves or scales it")
    radius = shape.number("radius", 1.0)
    if not radius > 0:
        raise shape.refused(f"radius {radius:g}", "a radius above 0")
    return radius * math.sqrt(square)


def _sphere(shape: Node, matrix: Floats, material: Material) -> Ellipsoid:
    """Round by its own transform; an instance may stretch it."""
    own = shape.matrix()
    radius = round_axes(shape, own)
    centre = matrix @ own @ np.append(shape.point("center", (0.0, 0.0, 0.0)), 1.0)
    there = matrix.copy()
    there[:3, 3] = centre[:3]
    return ball(there, radius, material)


def _plain(shape: Node, material: Material) -> None:
    if material.texture is not None:
        raise shape.refused("a texture", f"one colour of a {shape.plugin}: rectangles and meshes with uv have textures")


def mesh_of(
    vertices: Floats, faces: Ints, matrix: Floats, shape: Node, material: Material, uv: Floats | None = None
) -> Mesh:
    """A mesh moved; one that is mirrored keeps its outside outside, as Mitsuba's normals do.

    ``uv`` (2, v) is where vertices are in textures, if anywhere.
    """
    if material.texture is not None and (uv is None or not uv.size):
        raise shape.refused("a texture", "a mesh with texture coordinates")
    outside = outside_out(faces, matrix, shape.flag("flip_normals"))
    return Mesh(moved(matrix, vertices), outside, material, None if material.texture is None else uv)


RECTANGLE = (
    np.array([(-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (-1.0, 1.0, 0.0)]).T,
    np.array([(0, 1, 2), (0, 2, 3)]).T,
)
RECTANGLE_UV = RECTANGLE[0][:2] / 2 + 0.5
_CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=3))).T
_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
CUBE = (_CORNERS, np.array([t for a, b, c, d in _FACES for t in ((a, b, c), (a, c, d))]).T)
