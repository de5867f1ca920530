"""What can be left out of a scene, and what can be said more simply."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from nusselt.experiments.scenes.shapes import box
from nusselt.experiments.scenes.sizes import at_width
from nusselt.experiments.search.shrink import rounded, simpler
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Mesh

Part = tuple[int, ...]
"""A kind of thing (0 meshes, 1 ellipsoids, 2 lights) and its number; or a mesh's number and a triangle's."""
KINDS = ("lights", "meshes", "ellipsoids")
LEAST = 8
"""Pixels a side."""
DIGITS = (0, 1, 2, 3, 4)


def things(scene: Scene) -> list[Part]:
    """Every light, mesh and ellipsoid."""
    return [(kind, k) for kind, name in enumerate(KINDS) for k in range(len(getattr(scene, name)))]


def with_things(scene: Scene, kept: Sequence[Part]) -> Scene:
    """Of a scene these alone."""
    chosen = set(kept)
    return scene.with_(
        **{
            name: tuple(thing for k, thing in enumerate(getattr(scene, name)) if (kind, k) in chosen)
            for kind, name in enumerate(KINDS)
        }
    )


def triangles(scene: Scene) -> list[Part]:
    """Every triangle of every mesh."""
    return [(m, t) for m, mesh in enumerate(scene.meshes) for t in range(mesh.triangles.shape[1])]


def with_triangles(scene: Scene, kept: Sequence[Part]) -> Scene:
    """Of all triangles these alone; meshes of none are left out, and vertices that none uses."""
    meshes = []
    for number, mesh in enumerate(scene.meshes):
        chosen = [t for m, t in kept if m == number]
        if chosen:
            used, index = np.unique(mesh.triangles[:, chosen], return_inverse=True)
            meshes.append(Mesh(mesh.vertices[:, used], index.reshape(3, -1), mesh.material))
    return scene.with_(meshes=tuple(meshes))


def plainer(scene: Scene) -> Iterator[Scene]:
    """Plain colours; balls for ellipsoids, cubes for balls; fewer pixels and samples; rounder numbers."""
    yield from simpler(scene)
    yield from _rounds(scene)
    for width in (scene.width // 4, scene.width // 2):
        if width >= LEAST and (smaller := at_width(scene, width)).height >= LEAST:
            yield smaller
    for count in (1, 4, 16):
        if count < scene.light_samples:
            yield scene.with_(light_samples=count)
    if scene.stratify:
        yield scene.with_(stratify=False)
    for digits in DIGITS:
        try:
            yield rounded(scene, digits)
        except InputError:
            continue


def _rounds(scene: Scene) -> Iterator[Scene]:
    for k, one in enumerate(scene.ellipsoids):
        if one.radius is None:
            radius = float(abs(np.linalg.det(np.array(one.axes))) ** (1 / 3))
            ball = replace(Ellipsoid.sphere(one.center, radius), material=one.material)
            yield scene.with_(ellipsoids=(*scene.ellipsoids[:k], ball, *scene.ellipsoids[k + 1 :]))
        else:
            low, high = (np.array(one.center) + side * one.radius / math.sqrt(2) for side in (-1, 1))
            cube = box(tuple(low.tolist()), tuple(high.tolist()), one.material)
            rest = (*scene.ellipsoids[:k], *scene.ellipsoids[k + 1 :])
            yield scene.with_(meshes=(*scene.meshes, cube), ellipsoids=rest)
