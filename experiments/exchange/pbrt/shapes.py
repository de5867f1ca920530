"""pbrt's shapes as triangles and balls, and as lights.

A triangle's front is where its corners run counter-clockwise before its transform; ReverseOrientation turns it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import Light
from nusselt.renderer.lights.of_triangles import of_triangles
from nusselt.renderer.mesh_files import find_inside, read_mesh_file
from nusselt.renderer.placed import Faces, ball, ball_light, disk_light, is_round, placed
from nusselt.renderer.surfaces import Ellipsoid, Mesh, has_area
from nusselt.renderer.vectors import Floats

from .lights import area_radiance
from .state import State
from .tokens import Directive

SHAPES = ("trianglemesh", "plymesh", "bilinearmesh", "sphere", "disk")
FLAT = 1e-5
"""How far, of its size, a patch's corner may lie off the plane of the others."""
SMOOTH = 1e-3
"""By which a shading normal may be off its face's."""


def shape_of(directive: Directive, state: State, world: Floats, folder: Path) -> Mesh | Ellipsoid | Light:
    """A shape in the world: a surface, or a light where an AreaLightSource is current.

    Parameters
    ----------
    world : (4, 4) float64
        From the file's world to ours.
    """
    matrix = world @ state.transform
    if directive.kind in ("sphere", "disk"):
        return _round(directive, state, matrix)
    if directive.kind not in SHAPES:
        raise directive.refused(directive.kind, ", ".join(SHAPES))
    vertices, faces = _TRIANGLES[directive.kind](directive, folder)
    vertices, faces = placed(vertices, faces, matrix, state.inside_out)
    if not faces.size:
        raise directive.refused("no area", "a triangle that spans an area")
    if state.area is None:
        return Mesh(vertices, faces, state.material)
    a, b, c = (vertices[:, k] for k in faces)
    area = float(np.sqrt((np.cross(b - a, c - a, axis=0) ** 2).sum(axis=0)).sum()) / 2
    # Each triangle is a light of pbrt's, and each patch, of two triangles.
    lights = faces.shape[1] // (2 if directive.kind == "bilinearmesh" else 1)
    return of_triangles(vertices, faces, area_radiance(state.area, area, lights))


def _round(directive: Directive, state: State, matrix: Floats) -> Ellipsoid | Light:
    partial = {"sphere": ("zmin", "zmax", "phimax"), "disk": ("innerradius", "phimax")}[directive.kind]
    directive.only("radius", *(("height",) if directive.kind == "disk" else ()))
    radius = directive.number("radius", 1.0)
    if not radius > 0:
        raise directive.refused(f"radius {radius:g}", f"a radius above 0, and no {', '.join(partial)}", "radius")
    if state.area is None:
        if directive.kind == "disk":
            raise directive.refused("disk", "a disk that shines: AreaLightSource before it")
        return ball(matrix, radius, state.material)
    if np.linalg.det(state.transform[:3, :3]) < 0:
        raise directive.refused("a mirroring transform", "one that does not: pbrt's two rules for its front differ")
    size = radius * abs(float(np.linalg.det(matrix[:3, :3]))) ** (1 / 3)
    if directive.kind == "sphere":
        if state.inside_out:
            raise directive.refused("ReverseOrientation", "a ball that shines outwards")
        return ball_light(matrix, radius, area_radiance(state.area, 4 * np.pi * size**2, 1))
    if not is_round(matrix):
        raise directive.refused("a transform that stretches", "one that turns, moves or scales")
    lifted = np.eye(4)
    lifted[2, 3] = directive.number("height", 0.0)
    side = (0.0, 0.0, -1.0 if state.inside_out else 1.0)
    return disk_light(matrix @ lifted, radius, side, area_radiance(state.area, np.pi * size**2, 1))


def _triangles(directive: Directive, folder: Path) -> tuple[Floats, Faces]:
    directive.only("P", "indices", "N", "S", "uv", "faceIndices")
    points = directive.triples("P", ("point3", "point"))
    count = points.shape[1]
    indices = directive.indices("indices", np.arange(3.0) if count == 3 else None, count)
    if indices.size % 3 or not indices.size:
        raise directive.refused(f"indices: {indices.size}", "three for each triangle", "indices")
    faces = indices.reshape(-1, 3).T
    if "N" in directive.parameters:
        _refuse_smooth(directive, points, faces)
    return points, faces


def _refuse_smooth(directive: Directive, points: Floats, faces: Faces) -> None:
    """Shading normals bend light, and turn fronts: those of the faces alone do nothing."""
    normals = directive.triples("N", ("normal", "normal3"))
    if normals.shape != points.shape:
        raise directive.refused(f"{normals.shape[1]} normals", f"{points.shape[1]}", "N")
    a, b, c = (points[:, k] for k in faces)
    flat = np.cross(b - a, c - a, axis=0)
    for k in faces:
        n = normals[:, k]
        size = np.sqrt((flat**2).sum(axis=0) * (n**2).sum(axis=0))
        if ((flat * n).sum(axis=0) < (1 - SMOOTH) * size).any():
            raise directive.refused("N, shading normals", "flat faces", "N")


def _ply(directive: Directive, folder: Path) -> tuple[Floats, Faces]:
    directive.only("filename", "edgelength")
    try:
        surface = read_mesh_file(find_inside(folder, directive.word("filename", "")))
    except InputError as error:
        raise error.at(f"{directive.where}: {error.where}" if error.where else directive.where) from None
    if any("normal" in note for note in surface.notes):
        raise directive.refused("a file with normals", "flat faces: a PLY file without nx, ny, nz")
    return surface.vertices, surface.triangles


def _patches(directive: Directive, folder: Path) -> tuple[Floats, Faces]:
    """Corners run (0, 0), (1, 0), (0, 1), (1, 1)."""
    directive.only("P", "indices", "uv", "faceIndices")
    points = directive.triples("P", ("point3", "point"))
    count = points.shape[1]
    indices = directive.indices("indices", np.arange(4.0) if count == 4 else None, count)
    if indices.size % 4 or not indices.size:
        raise directive.refused(f"indices: {indices.size}", "four for each patch", "indices")
    a, b, c, d = indices.reshape(-1, 4).T
    corners = np.stack([points[:, k] for k in (a, b, d, c)])
    sides = corners[1:] - corners[0]
    volume = np.abs((np.cross(sides[0], sides[1], axis=0) * sides[2]).sum(axis=0))
    if (volume > FLAT * np.sqrt((sides**2).sum(axis=1)).max(axis=0) ** 3).any():
        raise directive.refused("a patch that is bent", "flat patches")
    faces = np.hstack((np.stack((a, b, c)), np.stack((b, d, c))))
    if not has_area(*(points[:, k] for k in faces)).any():
        raise directive.refused("no area", "a patch that spans an area")
    return points, faces


_TRIANGLES = {"trianglemesh": _triangles, "plymesh": _ply, "bilinearmesh": _patches}
