"""UsdGeom shapes as triangles and ellipsoids."""

from __future__ import annotations

import numpy as np

from nusselt.mitsuba_bridge.own.shapes import CUBE
from nusselt.renderer.errors import InputError
from nusselt.renderer.mesh_files.surface import from_polygons
from nusselt.renderer.placed import Faces, ball, placed
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.vectors import Floats

from .prims import Notes, Prim

SHAPES = ("Mesh", "Cube", "Sphere")


def triangles_of(prim: Prim, notes: Notes) -> tuple[Floats, Faces]:
    """A mesh or cube in the world, fronts outwards."""
    inside_out = str(prim.get("orientation", "rightHanded")) == "leftHanded"
    is_cube = prim.kind == "Cube"
    vertices, faces = (prim.number("size", 2.0) / 2 * CUBE[0], CUBE[1]) if is_cube else _polygons(prim, notes)
    world, turned = placed(vertices, faces, prim.matrix(), inside_out and not is_cube)
    if turned.shape[1] < faces.shape[1]:
        notes.say(prim, f"{faces.shape[1] - turned.shape[1]} triangles without area are left out")
    return world, turned


def _polygons(prim: Prim, notes: Notes) -> tuple[Floats, Faces]:
    scheme = str(prim.get("subdivisionScheme", "catmullClark"))
    if scheme != "none":
        notes.say(prim, f"subdivisionScheme {scheme}: the polygons are taken as they are, not subdivided")
    if len(prim.get("holeIndices", ()) or ()):
        raise prim.refused("holeIndices", "faces without holes")
    points = np.array(prim.get("points", ()), dtype=np.float64).reshape(-1, 3).T
    counts = np.array(prim.get("faceVertexCounts", ()), dtype=np.int64)
    corners = np.array(prim.get("faceVertexIndices", ()), dtype=np.int64)
    if counts.sum() != corners.size:
        raise prim.refused(f"{corners.size} faceVertexIndices", f"{counts.sum()}, as faceVertexCounts say")
    try:
        surface = from_polygons(
            points, counts, corners, corners, lambda k: f"point {k}", lambda k: f"face {k}", notes=()
        )
    except InputError as error:
        raise error.at(prim.place) from None
    for note in surface.notes:
        notes.say(prim, note)
    return surface.vertices, surface.triangles


def ellipsoid_of(prim: Prim, material: Material) -> Ellipsoid:
    """A sphere under any affine transform."""
    return ball(prim.matrix(), prim.number("radius", 1.0), material)
