"""What light falls on: materials, triangle meshes, ellipsoids; frozen, validated. Meshes hold arrays, (3, n)."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .validation import Vec3, colour, finite, vector

Floats: TypeAlias = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Material:
    """Lambert plus modified Phong, and emission that is seen but lights nothing.

    f = diffuse/pi + specular (shininess + 2)/(2 pi) max(r.w, 0)^shininess, with r the mirror direction of
    the viewer (Lafortune & Willems 1994). At shininess 0 the lobe is 1 where r.w > 0 and 0 elsewhere.

    Parameters
    ----------
    diffuse, specular : Vec3
        Albedo of each term, dimensionless, none negative (above 1 is legal).
    shininess : float
        Phong exponent, at least 0.
    emission : Vec3
        Radiance seen directly, W m^-2 sr^-1. It is not a light.
    """

    diffuse: Vec3 = (0.0, 0.0, 0.0)
    specular: Vec3 = (0.0, 0.0, 0.0)
    shininess: float = 1.0
    emission: Vec3 = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("diffuse", "specular", "emission"):
            object.__setattr__(self, name, colour(name, getattr(self, name)))
        object.__setattr__(self, "shininess", finite("shininess", self.shininess))
        if self.shininess < 0:
            raise InputError("shininess", self.shininess, "an exponent of at least 0")

    @property
    def is_glossy(self) -> bool:
        return max(self.specular) > 0


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one material, in world space.

    Parameters
    ----------
    vertices : (3, v) float64
        Positions.
    triangles : (3, t) int64
        Indices into ``vertices``; counter-clockwise seen from the front.
    material : Material
        Shared by all triangles.
    """

    vertices: Floats
    triangles: NDArray[np.int64]
    material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64, order="C") + 0.0  # -0.0 as in finite
        if np.size(self.triangles) and np.asarray(self.triangles).dtype.kind not in "iu":
            raise InputError("mesh triangles dtype", np.asarray(self.triangles).dtype, "whole numbers")
        triangles = np.array(self.triangles, dtype=np.int64, order="C")
        if vertices.ndim != 2 or vertices.shape[0] != 3:
            raise InputError("mesh vertices shape", vertices.shape, "(3, v)")
        if triangles.ndim != 2 or triangles.shape[0] != 3:
            raise InputError("mesh triangles shape", triangles.shape, "(3, t)")
        if not np.isfinite(vertices).all():
            bad = vertices[:, ~np.isfinite(vertices).all(axis=0)][:, 0]
            raise InputError("mesh vertex", tuple(bad.tolist()), "finite coordinates")
        if triangles.size and (triangles.min() < 0 or triangles.max() >= vertices.shape[1]):
            bad_index = int(triangles.min()) if triangles.min() < 0 else int(triangles.max())
            raise InputError("mesh index", bad_index, f"0 <= index < {vertices.shape[1]}")
        flat = np.flatnonzero(~has_area(*(vertices[:, corner] for corner in triangles)))
        if flat.size:
            raise InputError("mesh triangle", f"number {int(flat[0])}", "three corners that span an area")
        for name, array in (("vertices", vertices), ("triangles", triangles)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Mesh)
            and self.material == other.material
            and np.array_equal(self.vertices, other.vertices)
            and np.array_equal(self.triangles, other.triangles)
        )

    def __hash__(self) -> int:
        return hash(self.digest)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything about it, as hex; found once."""
        told = hashlib.sha256(f"{self.vertices.shape},{self.triangles.shape},{self.material!r};".encode())
        told.update(self.vertices.data)
        told.update(self.triangles.data)
        return told.hexdigest()

    @property
    def corners(self) -> tuple[Floats, Floats, Floats]:
        """The three corners of every triangle, each (3, t)."""
        a, b, c = (self.vertices[:, index] for index in self.triangles)
        return a, b, c


def has_area(a: Floats, b: Floats, c: Floats) -> NDArray[np.bool_]:
    """Which triangles (corners (3, t)) span an area; scale-free, so that 1e-30 metres are no needle.

    A corner that lies within a few ulps of the line through the other two spans none: its normal would be
    rounding noise.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # an edge that overflows ends as NaN: no area
        e, f = b - a, c - a
        size = np.maximum(np.abs(e).max(axis=0, initial=0), np.abs(f).max(axis=0, initial=0))
        safe = np.where(size > 0, size, 1.0)
        e, f = e / safe, f / safe
    doubled_area = np.linalg.norm(np.cross(e, f, axis=0), axis=0)
    shortest = np.minimum(
        np.minimum(np.linalg.norm(e, axis=0), np.linalg.norm(f, axis=0)), np.linalg.norm(f - e, axis=0)
    )
    return (size > 0) & (doubled_area > 4e-16 * shortest)


@dataclass(frozen=True)
class Ellipsoid:
    """The image of the unit sphere under x -> center + axes @ x; a sphere where the axes allow it.

    Parameters
    ----------
    center : Vec3
        World-space centre.
    axes : tuple of three Vec3
        Rows of the 3 x 3 matrix whose columns are the semi-axes.
    material : Material
        Surface.
    """

    center: Vec3
    axes: tuple[Vec3, Vec3, Vec3]
    material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("sphere center", self.center))
        rows = tuple(vector("sphere axes", row) for row in self.axes)
        if len(rows) != 3:
            raise InputError("sphere axes", self.axes, "a 3 x 3 matrix")
        object.__setattr__(self, "axes", rows)
        matrix = np.array(rows)
        scale = np.abs(matrix).max()
        if scale == 0 or np.linalg.svd(matrix / scale, compute_uv=False)[-1] < 1e-12:
            raise InputError("sphere axes", self.axes, "three independent semi-axes (a radius above 0)")

    @classmethod
    def sphere(cls, center: Vec3, radius: float, material: Material | None = None) -> Ellipsoid:
        """A sphere of ``radius`` > 0 (scene units) about ``center``."""
        radius = finite("sphere radius", radius)
        if radius <= 0:
            raise InputError("sphere radius", radius, "a radius above 0")
        axes = ((radius, 0.0, 0.0), (0.0, radius, 0.0), (0.0, 0.0, radius))
        return cls(center, axes, material or Material())

    @property
    def radius(self) -> float | None:
        """The radius if this is a sphere to 1e-12, else None."""
        (a, *rest), (b, c, d), (e, f, g) = self.axes
        if not any((*rest, b, d, e, f)) and abs(a) == abs(c) == abs(g):
            return abs(a)  # to the last bit
        values = np.linalg.svd(np.array(self.axes), compute_uv=False)
        return float(values[1]) if values[0] - values[2] <= 1e-12 * values[0] else None


@dataclass(frozen=True)
class FlatDisk:
    """A flat disk, black on both sides but for what its front emits: the body of a light, never a surface of its own.

    Parameters
    ----------
    center : Vec3
    normal : Vec3
        Unit normal of the front.
    radius : float
        Above 0, scene units.
    """

    center: Vec3
    normal: Vec3
    radius: float
