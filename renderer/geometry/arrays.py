"""A scene's surfaces as arrays: a pile of triangles, one of ellipsoids, one of flat disks, one table of materials.

The bodies of lights are among them: they are seen, they block, and they reflect nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.lobes import Lobe
from nusselt.renderer.lobes.protocol import Columns, from_values, values_of
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import FlatDisk, Material
from nusselt.renderer.texture import Painted
from nusselt.renderer.vectors import Bools, Floats, Ints

from .triangle_normals import triangle_normals


@dataclass(frozen=True, eq=False)
class Geometry:
    """Surfaces of a scene; equal to itself alone, so that what is made of it can be kept.

    Parameters
    ----------
    a, b, c : (3, t) float64
        Triangle corners, counter-clockwise from the front; an emitter's front is its emitting side.
    normal : (3, t) float64
        (b - a) x (c - a), twice the area long.
    triangle_surface, ellipsoid_surface, disk_surface : (t,), (e,), (m,) int64
        Row of the surface tables.
    center : (3, e) float64
    axes, inverse : (e, 3, 3) float64
        Unit sphere to ellipsoid, and back.
    disk_center, disk_normal : (3, m) float64
        Unit normals of the front.
    disk_radius : (m,) float64
    emission : (3, s) float64
        Surface table of the radiance seen from the front.
    lobes : tuple of kinds of lobe
        That some surface has; Lambert's and Phong's always.
    columns : mapping
        Surface tables of their parameters, by name: (3, s) or (s,).
    light : (s,) int64
        Index into ``scene.lights`` of the light this surface is, or -1.
    painted : tuple of Painted
        Meshes whose diffuse albedo varies; that of ``columns`` is the most it is.
    """

    a: Floats
    b: Floats
    c: Floats
    normal: Floats
    triangle_surface: Ints
    center: Floats
    axes: Floats
    inverse: Floats
    ellipsoid_surface: Ints
    disk_center: Floats
    disk_normal: Floats
    disk_radius: Floats
    disk_surface: Ints
    emission: Floats
    lobes: tuple[type[Lobe], ...]
    columns: Columns
    light: Ints
    painted: tuple[Painted, ...]

    @property
    def triangles(self) -> int:
        return self.a.shape[1]

    @property
    def ellipsoids(self) -> int:
        return self.center.shape[1]

    @property
    def disks(self) -> int:
        return self.disk_radius.size

    @property
    def reflects(self) -> Bools:
        """Surfaces (s,) that have an albedo."""
        out: Bools = np.zeros(self.light.size, dtype=bool)
        for kind in self.lobes:
            out |= self.columns[kind.PARAMETERS[0].name].max(axis=0, initial=0) > 0
        return out


def build_geometry(scene: Scene) -> Geometry:
    """Lay a scene's surfaces out in arrays: meshes, ellipsoids, then lights, in file order."""
    corners = [mesh.corners for mesh in scene.meshes]
    counts = [mesh.triangles.shape[1] for mesh in scene.meshes]
    surfaces: list[Material] = list(scene.materials)
    light_of = [-1] * len(surfaces)
    owners = list(range(len(scene.meshes)))
    disks: list[tuple[FlatDisk, int]] = []
    balls = [(ball, len(scene.meshes) + k) for k, ball in enumerate(scene.ellipsoids)]
    for index, light in enumerate(scene.lights):
        body = light.body()
        if body is not None:
            corners.append(body.corners)
            counts.append(body.corners[0].shape[1])
            owners.append(len(surfaces))
            disks += [(disk, len(surfaces)) for disk in body.disks]
            balls += [(ball, len(surfaces)) for ball in body.balls]
            surfaces.append(Material(emission=light.colour))
            light_of.append(index)
    empty = np.empty((3, 0))
    a, b, c = (np.hstack([empty, *(triple[k] for triple in corners)]) for k in range(3))
    axes = np.array([ball.axes for ball, _ in balls]).reshape(-1, 3, 3)
    lobes, columns = lobe_tables(surfaces)
    return Geometry(
        a=a,
        b=b,
        c=c,
        normal=triangle_normals(a, b, c),
        triangle_surface=np.repeat(np.array(owners, dtype=np.int64), counts),
        center=np.array([ball.center for ball, _ in balls]).reshape(-1, 3).T,
        axes=axes,
        inverse=np.linalg.inv(axes),
        ellipsoid_surface=np.array([surface for _, surface in balls], dtype=np.int64),
        disk_center=np.array([disk.center for disk, _ in disks]).reshape(-1, 3).T,
        disk_normal=np.array([disk.normal for disk, _ in disks]).reshape(-1, 3).T,
        disk_radius=np.array([disk.radius for disk, _ in disks], dtype=np.float64),
        disk_surface=np.array([surface for _, surface in disks], dtype=np.int64),
        emission=np.array([m.emission for m in surfaces], dtype=np.float64).reshape(-1, 3).T,
        lobes=lobes,
        columns=columns,
        light=np.array(light_of, dtype=np.int64),
        painted=tuple(_painted(scene)),
    )


def _painted(scene: Scene) -> Iterator[Painted]:
    first = 0
    for mesh in scene.meshes:
        if mesh.uv is not None and mesh.material.texture is not None:
            yield Painted(first, mesh.uv[:, mesh.triangles], mesh.material.texture)
        first += mesh.triangles.shape[1]


def lobe_tables(surfaces: Sequence[Material]) -> tuple[tuple[type[Lobe], ...], Columns]:
    """The kinds of lobe that surfaces have, and a column of each of their parameters."""
    of_surface = [{type(lobe): lobe for lobe in material.lobes} for material in (*surfaces, Material())]
    kinds = tuple(dict.fromkeys(kind for lobes in of_surface for kind in lobes))
    columns: dict[str, Floats] = {}
    for kind in kinds:
        rows = [values_of(lobes.get(kind) or from_values(kind, {})) for lobes in of_surface[:-1]]
        for parameter in kind.PARAMETERS:
            table = np.array([row[parameter.name] for row in rows], dtype=np.float64)
            columns[parameter.name] = table.reshape(-1, 3).T if parameter.is_colour else table
    return kinds, columns
