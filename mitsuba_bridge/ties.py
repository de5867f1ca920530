"""Surfaces that lie in one place: which of two is seen there is decided by rounding, in any renderer.

Ours sees the front before a black back and a light before what it lies on; Mitsuba what its rounding says, speckled.
Pixels that show such a place are not to be judged.
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.camera.first_hits import Hits, first_hits
from nusselt.renderer.camera.rays import pixel_centres, primary_directions
from nusselt.renderer.geometry.arrays import Geometry, build_geometry
from nusselt.renderer.geometry.ragged import expand
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats, Ints, column, cross, dot, unit

from .lights import cover
from .placement import Placement, place
from .tolerance import SLIDE

PAIRS = 1 << 22
"""Pairs of triangles that are looked at: beyond, lights and the smallest meshes are compared with all."""


class _Faces:
    """Triangles of surfaces and of what covers the disks: corners (3, f) each, unit normals, surface rows."""

    def __init__(self, scene: Scene, geometry: Geometry) -> None:
        g = geometry
        disks = [cover(scene.lights[g.light[row]])[0] for row in g.disk_surface]
        self.a, self.b, self.c = (
            np.hstack([corner, *(disk[k] for disk in disks)]) for k, corner in enumerate((g.a, g.b, g.c))
        )
        sizes = [disk[0].shape[1] for disk in disks]
        self.surface = np.concatenate((g.triangle_surface, np.repeat(g.disk_surface, sizes)))
        self.first_of_disk = g.triangles + np.cumsum([0, *sizes])[: len(disks)]
        self.normal = unit(cross(self.b - self.a, self.c - self.a))

    @property
    def count(self) -> int:
        return int(self.surface.size)

    def corners(self, index: Ints) -> tuple[Floats, Floats, Floats]:
        return self.a[:, index], self.b[:, index], self.c[:, index]


def tied(scene: Scene) -> tuple[Bools, list[str]]:
    """Pixels (h, w) that show two unlike surfaces in one place, and a sentence that names the surfaces."""
    geometry, placement = build_geometry(scene), place(scene)
    faces = _Faces(scene, geometry)
    one, other = _pairs(faces, _alike(scene, geometry), scene.two_sided, placement)
    pixels = np.zeros(scene.height * scene.width, dtype=bool)
    bodies = _bodies(scene, geometry)
    if one.size == 0 and bodies.size == 0:
        return pixels.reshape(scene.height, scene.width), []
    x, y = pixel_centres(range(scene.width), range(scene.height))
    corners = primary_directions(scene, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    hits = first_hits(geometry, column(scene.camera.position), primary_directions(scene, x, y), corners)
    said = set()
    for pixel, first, second in (
        _on_faces(faces, geometry, hits, one, other, placement),
        _on_bodies(geometry, hits, bodies),
    ):
        pixels[pixel] = True
        said |= {tuple(sorted(pair)) for pair in zip(first.tolist(), second.tolist(), strict=True)}
    names = "; ".join(_both(*(_name(geometry, scene, row) for row in pair)) for pair in sorted(said)[:3])
    told = [f"{names} lie in one place: which is seen there is rounding, in Mitsuba as in any renderer"] if said else []
    return pixels.reshape(scene.height, scene.width), told


def _alike(scene: Scene, geometry: Geometry) -> Ints:
    """A number for each row of the surface tables, the same for those that look the same: lights and textures never."""
    looks = [(m, -1 if m.texture is None else row) for row, m in enumerate(scene.materials)]
    kinds = {look: number for number, look in enumerate(dict.fromkeys(looks))}
    own = [kinds[look] for look in looks]
    return np.array([*own, *(len(kinds) + np.arange(geometry.light.size - len(own)))], dtype=np.int64)


def _pairs(faces: _Faces, alike: Ints, two_sided: bool, placement: Placement) -> tuple[Ints, Ints]:
    """Faces that lie in one plane, overlap and do not look the same, both ways round."""
    sizes = np.bincount(faces.surface, minlength=1)[faces.surface]
    chosen = np.argsort(sizes, kind="stable")[: max(1, PAIRS // max(faces.count, 1))]
    found: list[tuple[Ints, Ints]] = []
    reach = np.max([placement.away(corner) for corner in (faces.a, faces.b, faces.c)], axis=0, initial=0.0)
    step = max(1, (1 << 18) // max(faces.count, 1))
    for start in range(0, chosen.size, step):
        some = chosen[start : start + step]
        n, at = faces.normal[:, some, None], faces.a[:, some, None]
        tolerance = SLIDE * (placement.near + np.minimum(reach[some, None], reach[None]))
        same = np.abs(np.abs(dot(n, faces.normal[:, None])) - 1) < 1e-9
        for corner in (faces.a, faces.b, faces.c):
            same &= np.abs(dot(n, corner[:, None] - at)) <= tolerance
        back = dot(n, faces.normal[:, None]) < 0
        unlike = alike[faces.surface[some], None] != alike[None, faces.surface]
        i, j = np.nonzero(same & (unlike | (back & (not two_sided))))
        found.append((some[i], j))
    one, other = (np.concatenate(part) for part in zip(*found, strict=True)) if found else (np.empty(0, int),) * 2
    meet = _overlap(faces, one, other)
    one, other = one[meet], other[meet]
    both = np.unique(np.stack((np.concatenate((one, other)), np.concatenate((other, one)))), axis=1)
    return both[0], both[1]


def _overlap(faces: _Faces, one: Ints, other: Ints) -> Bools:
    """Which pairs of faces of one plane share more than an edge: no edge of either has the other outside."""
    meet = np.ones(one.size, dtype=bool)
    for mine, theirs in ((one, other), (other, one)):
        corners, others = faces.corners(mine), faces.corners(theirs)
        for k in range(3):
            start, end = corners[k], corners[(k + 1) % 3]
            inwards = cross(faces.normal[:, mine], end - start)
            size = np.sqrt(dot(inwards, inwards))
            depth = np.max([dot(inwards, p - start) for p in others], axis=0, initial=-np.inf)
            meet &= depth > 1e-9 * size * size
    return meet


def _on_faces(
    faces: _Faces, g: Geometry, hits: Hits, one: Ints, other: Ints, placement: Placement
) -> tuple[Ints, Ints, Ints]:
    """Pixels that hit the one of a pair within the other, and the rows of both surfaces."""
    face = hits.triangle.copy()
    for disk in range(g.disks):
        on = (hits.triangle < 0) & (hits.surface == g.disk_surface[disk])
        face[on] = faces.first_of_disk[disk]  # any piece of it: all lie in its plane
    first_of = np.arange(faces.count)
    for disk in range(g.disks):
        mine = faces.surface == g.disk_surface[disk]
        first_of[mine] = faces.first_of_disk[disk]
    one = first_of[one]
    order = np.argsort(one, kind="stable")
    one, other = one[order], other[order]
    low, high = np.searchsorted(one, face, "left"), np.searchsorted(one, face, "right")
    pixel, number = expand(np.where(face >= 0, high - low, 0))
    partner = other[low[pixel] + number]
    p = hits.position[:, pixel]
    inside = np.ones(pixel.size, dtype=bool)
    corners = faces.corners(partner)
    tolerance = SLIDE * (placement.near + placement.away(p))
    for k in range(3):
        start, end = corners[k], corners[(k + 1) % 3]
        inwards = cross(faces.normal[:, partner], end - start)
        inside &= dot(inwards, p - start) >= -tolerance * np.sqrt(dot(inwards, inwards))
    pixel, partner = pixel[inside], partner[inside]
    return pixel, hits.surface[pixel], faces.surface[partner]


def _bodies(scene: Scene, g: Geometry) -> Ints:
    """Pairs (2, k) of ellipsoids that are one and the same but for their looks."""
    where = np.hstack((g.center.T, g.axes.reshape(-1, 9)))
    _, number = np.unique(where, axis=0, return_inverse=True)
    number = number.ravel()
    looks = _alike(scene, g)[g.ellipsoid_surface]
    i, j = np.nonzero((number[:, None] == number) & (looks[:, None] != looks)) if number.size < 4096 else ((), ())
    return np.array([i, j], dtype=np.int64)


def _on_bodies(g: Geometry, hits: Hits, bodies: Ints) -> tuple[Ints, Ints, Ints]:
    pixel = np.flatnonzero(np.isin(hits.ellipsoid, bodies[0]))
    partner = dict(zip(*bodies.tolist(), strict=True))
    other = np.array([partner[e] for e in hits.ellipsoid[pixel].tolist()], dtype=int)
    return pixel, hits.surface[pixel], g.ellipsoid_surface[other]


def _both(one: str, other: str) -> str:
    return f"{one} and {other}" if one != other else f"two faces of {one}"


def _name(g: Geometry, scene: Scene, row: int) -> str:
    if g.light[row] >= 0:
        return f"light {g.light[row] + 1}"
    meshes = len(scene.meshes)
    return f"mesh {row + 1}" if row < meshes else f"sphere {row - meshes + 1}"
