"""Any number of triangles that shine, as one light: a lamp from a file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lobe
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.validation import Vec3, colour
from nusselt.renderer.vectors import Bools, Floats, Ints, column, cross, dot, unit
from nusselt.renderer.watertight import PLANE_ULPS, largest, one_norm

from .body import Body, Corners, Plane
from .facing import faced_by, solid_angle
from .plain import Plain
from .polygon_patch import polygon_patch
from .text import Text

MOST = 100_000
"""Triangles of one light."""
FORMS = 256
"""Triangles up to which it has a closed form: their own, summed."""
CORNERS = 64
"""Vertices beyond which the box around them stands for them."""
PAIRS = 1 << 27
"""Triangles times vertices beyond which it is not asked whether the mesh is convex."""
BLOCK = 1 << 20


@dataclass(frozen=True, eq=False, repr=False)
class MeshLight(Plain):
    """Triangles of one radiance, each emitting at its front; black as a reflector, opaque, and visible to the camera.

    Parameters
    ----------
    surface : Mesh
        1 to 100,000 triangles; its material plays no part.
    radiance : Vec3
        W m^-2 sr^-1.
    """

    surface: Mesh
    radiance: Vec3
    kind: ClassVar[str] = "mesh"
    has_extent: ClassVar[bool] = True
    at_infinity: ClassVar[bool] = False
    TEXT: ClassVar[Text] = Text("meshLight", "radiance:rgb", of_surface=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "radiance", colour("meshLight radiance", self.radiance))
        if not 1 <= self.count <= MOST:
            raise InputError("meshLight", f"{self.count} triangles", f"1 to {MOST} triangles")
        with np.errstate(over="ignore", invalid="ignore"):
            area = self.area
        if not 0 < area < math.inf:
            raise InputError("meshLight area", area, "an area above 0 and finite in double precision")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MeshLight) and self._told == other._told

    def __hash__(self) -> int:
        return hash(self._told)

    def __repr__(self) -> str:
        """With the mesh's digest: a scene's own rests on it."""
        return f"MeshLight({self.surface.digest}, {self.radiance})"

    @property
    def _told(self) -> tuple[str, Vec3]:
        return self.surface.digest, self.radiance

    @property
    def count(self) -> int:
        """Of triangles."""
        return self.surface.triangles.shape[1]

    @cached_property
    def _corners(self) -> Corners:
        return self.surface.corners

    @cached_property
    def _outwards(self) -> Floats:
        """Of each triangle the normal of its front, its area long (3, t)."""
        a, b, c = self._corners
        return cross(b - a, c - a) / 2

    @cached_property
    def _sizes(self) -> Floats:
        longest = largest(self._outwards)
        scaled = self._outwards / np.where(longest > 0, longest, 1.0)
        return np.asarray(longest * np.sqrt(dot(scaled, scaled)))

    @cached_property
    def _ends(self) -> Floats:
        """Where each triangle's share of the unit interval ends, (t,)."""
        ends = np.cumsum(self._sizes)
        return ends / ends[-1]

    @property
    def area(self) -> float:
        return float(self._sizes.sum())

    @property
    def colour(self) -> Vec3:
        return self.radiance

    def with_colour(self, rgb: Vec3) -> MeshLight:
        return replace(self, radiance=rgb)

    def _chosen(self, u: Floats, v: Floats) -> tuple[Ints, Floats]:
        """Triangles and places on them (3, ...): v's line is cut in shares of their areas, and what is left used again.

        On the triangle as on a `TriangleLight`.
        """
        k = np.minimum(np.searchsorted(self._ends, v, side="right"), self.count - 1)
        start = np.where(k > 0, self._ends[k - 1], 0.0)
        left = np.clip((v - start) / np.maximum(self._ends[k] - start, 1e-300), 0.0, 1.0)
        a, b, c = (corner[:, k] for corner in self._corners)
        way = np.sqrt(1 - u)
        return k, a + (b - a) * (1 - way) + (c - a) * (way * left)

    def beams(self, points: Floats, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        """Area measure: density 1/A over all triangles."""
        k, place = self._chosen(u, v)
        d = place - points[:, :, None]
        return d, self._worth(points, k, d) / u.shape[1]

    def _worth(self, points: Floats, k: Ints, d: Floats) -> Floats:
        """Of single beams along d (3, n, k) to triangles k, (n, k) or (1, k)."""
        a, b, c = (corner[:, k] for corner in self._corners)
        inwards = -self._outwards[:, k] * (self.area / self._sizes[k])
        return solid_angle(inwards, d) * faced_by(a, c - a, b - a, points[:, :, None])

    def worth(self, points: Floats, d: Floats) -> Floats:
        place = points[:, :, None] + d
        k = self._on(place.reshape(3, -1), np.broadcast_to(points[:, :, None], d.shape).reshape(3, -1))
        return self._worth(points, k.reshape(d.shape[1:]), d)

    def _on(self, places: Floats, points: Floats) -> Ints:
        """The triangle that each place lies on: the nearest, and of those as near one that faces its point."""
        found = np.empty(places.shape[1], dtype=np.int64)
        normal = unit(self._outwards)
        a, b, c = self._corners
        step = max(1, BLOCK // self.count)
        for start in range(0, found.size, step):
            some = slice(start, start + step)
            p = places[:, some, None]
            off = np.abs(dot(normal[:, None], p - a[:, None]))
            for first, second in ((a, b), (b, c), (c, a)):
                inwards = unit(cross(normal, second - first))
                off = np.maximum(off, -dot(inwards[:, None], p - first[:, None]))
            near = off <= off.min(axis=1, keepdims=True) + 64 * 2.0**-53 * largest(places[:, some])[:, None]
            faces = dot(normal[:, None], points[:, some, None] - a[:, None])
            found[some] = np.where(near, faces, -np.inf).argmax(axis=1)
        return found

    def at(self, u: float, v: float) -> Floats:
        return self._chosen(np.array([u]), np.array([v]))[1]

    def hull(self) -> Floats:
        """Its vertices, or the corners of the box around them where they are many."""
        used = self.anchored()
        if used.shape[1] <= CORNERS:
            return used
        low, high = used.min(axis=1), used.max(axis=1)
        return np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, 8)

    def middle(self) -> tuple[Floats, float]:
        used = self.anchored()
        place = (used.min(axis=1, keepdims=True) + used.max(axis=1, keepdims=True)) / 2
        away = used - place
        return place, float(np.sqrt(dot(away, away).max()))

    def body(self) -> Body:
        return Body(self._corners)

    def _rises(self, k: Ints) -> Bools:
        """Over which of the triangles' planes some vertex rises, by more than rounding."""
        normal, a, used = self._outwards[:, k], self._corners[0][:, k], self.anchored()
        bound = PLANE_ULPS * one_norm(normal) * (largest(a) + largest(used).max())
        return (dot(normal[:, :, None], used[:, None] - a[:, :, None]) > bound[:, None]).any(axis=1)

    @cached_property
    def hides_itself(self) -> bool:
        """Unless it is convex: then nothing of it is before any of its fronts."""
        vertices = self.anchored().shape[1]
        if self.count * vertices > PAIRS:
            return True
        step = max(1, BLOCK // vertices)
        blocks = (np.arange(k, min(k + step, self.count)) for k in range(0, self.count, step))
        return any(bool(self._rises(k).any()) for k in blocks)

    @cached_property
    def _plane(self) -> Plane | None:
        normal = column(unit(self._outwards)[:, 0])
        flat = (dot(normal, unit(self._outwards)) > 1 - 1e-12).all() and not self.hides_itself
        return (normal, column(self._corners[0][:, 0])) if flat else None

    def plane(self) -> Plane | None:
        return self._plane

    def unshadowed(self, points: ShadingPoints, glossy: bool) -> tuple[Floats, Floats]:
        """Sum of the triangles' boundary integrals (`polygon_patch`), each that faces a point.

        One that hides another is not asked for: of a mesh that is not convex this is more than it gives. Where all of
        it has cancelled, the bound is what its triangles say of theirs.
        """
        radiance, error, lost = np.zeros((3, *points.position.shape))
        for corners in np.stack(self._corners, axis=2).transpose(1, 0, 2):
            a, b, c = (column(v) for v in corners.T)
            facing = faced_by(a, c - a, b - a, points.position)
            if facing.any():
                share, bound = polygon_patch(points, facing, corners, glossy, "mesh")
                radiance += share
                error += share * bound
                lost = np.maximum(lost, np.where(share > 1e-280, 0.0, bound))
        bound = np.divide(error, radiance, out=lost, where=radiance > 1e-280).max(axis=0)
        return radiance * column(self.colour), bound

    def has_form(self, kind: type[Lobe]) -> bool:
        return kind.contour is not None and self.count <= FORMS

    @cached_property
    def _used(self) -> Floats:
        return self.surface.vertices[:, np.unique(self.surface.triangles)]

    def anchored(self) -> Floats:
        return self._used

    def moved(self, origin: Floats) -> MeshLight:
        surface = self.surface
        return replace(self, surface=replace(surface, vertices=surface.vertices - np.reshape(origin, (3, 1))))
