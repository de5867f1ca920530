"""What light falls on: materials, triangle meshes, ellipsoids; frozen, validated. Meshes hold arrays, (3, n)."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import lobes
from .errors import InputError
from .lobes import Lambert, Lobe, Phong
from .lobes.protocol import from_values, values_of
from .texture import Texture
from .validation import Vec3, colour, finite, vector

Floats: TypeAlias = NDArray[np.floating[Any]]


@dataclass(frozen=True, repr=False)
class Material:
    """Lambert plus modified Phong plus any further lobes, and emission that is seen but lights nothing.

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
    further : tuple of Lobe
        Lobes of other kinds, at most one of each; black ones are dropped.
    texture : Texture, optional
        The diffuse albedo where it varies; ``diffuse`` is then the most it is. Meshes with uv alone have one.
    """

    diffuse: Vec3 = (0.0, 0.0, 0.0)
    specular: Vec3 = (0.0, 0.0, 0.0)
    shininess: float = 1.0
    emission: Vec3 = (0.0, 0.0, 0.0)
    further: tuple[Lobe, ...] = ()
    texture: Texture | None = None

    def __post_init__(self) -> None:
        if self.texture is not None:
            object.__setattr__(self, "diffuse", self.texture.peak)
        for lobe in (Lambert(self.diffuse), Phong(self.specular, self.shininess)):
            for name, value in values_of(lobe).items():
                object.__setattr__(self, name, value)
        object.__setattr__(self, "emission", colour("emission", self.emission))
        object.__setattr__(self, "further", _further(self.further))

    @classmethod
    def of(cls, values: Mapping[str, Any], emission: Vec3 = (0.0, 0.0, 0.0)) -> Material:
        """The material of these parameters of lobes, by their names; what is not named is its kind's default."""
        named = {name: values[name] for name in NAMED if name in values}
        others = (kind for kind in lobes.LOBES if kind not in (Lambert, Phong))
        return cls(**named, emission=emission, further=tuple(from_values(kind, values) for kind in others))

    @property
    def lobes(self) -> tuple[Lobe, ...]:
        """All of them; Lambert's and Phong's even if they are black."""
        return Lambert(self.diffuse), Phong(self.specular, self.shininess), *self.further

    @property
    def is_glossy(self) -> bool:
        """Whether it has a lobe besides Lambert's."""
        return any(lobe.glossy and max(lobe.albedo) > 0 for lobe in self.lobes)

    def __repr__(self) -> str:
        """With what it has: digests rest on it, and do not change where a kind of lobe is new."""
        names = [*NAMED, "emission", *(name for name in ("further", "texture") if getattr(self, name))]
        return f"Material({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"


NAMED = tuple(parameter.name for kind in (Lambert, Phong) for parameter in kind.PARAMETERS)
"""The parameters that are fields of a material."""


def _further(given: Iterable[Lobe]) -> tuple[Lobe, ...]:
    """Checked, in the order of `LOBES`, without the black ones."""
    known = lobes.LOBES
    for lobe in given:
        if type(lobe) not in known or isinstance(lobe, (Lambert, Phong)):
            raise InputError(
                "material lobe", type(lobe).__name__, "a kind that LOBES lists, other than Lambert and Phong"
            )
    there = sorted((lobe for lobe in given if max(lobe.albedo) > 0), key=lambda lobe: known.index(type(lobe)))
    if len({type(lobe) for lobe in there}) < len(there):
        raise InputError("material lobes", ", ".join(lobe.kind for lobe in there), "one of each kind")
    return tuple(there)


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
    uv : (2, v) float64, optional
        Where each vertex is in its material's texture; none without one.
    """

    vertices: Floats
    triangles: NDArray[np.int64]
    material: Material = field(default_factory=Material)
    uv: Floats | None = None

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
        arrays = {"vertices": vertices, "triangles": triangles}
        if self.material.texture is not None:
            arrays["uv"] = _checked_uv(self.uv, vertices.shape[1])
        elif self.uv is not None:
            raise InputError("mesh uv", "given", "none without a texture")
        for name, array in arrays.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Mesh)
            and self.material == other.material
            and np.array_equal(self.vertices, other.vertices)
            and np.array_equal(self.triangles, other.triangles)
            and (self.uv is None or other.uv is None or np.array_equal(self.uv, other.uv))
        )

    def __hash__(self) -> int:
        return hash(self.digest)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything about it, as hex; found once."""
        told = hashlib.sha256(f"{self.vertices.shape},{self.triangles.shape},{self.material!r};".encode())
        told.update(self.vertices.data)
        told.update(self.triangles.data)
        if self.uv is not None:
            told.update(self.uv.data)
        return told.hexdigest()

    @property
    def corners(self) -> tuple[Floats, Floats, Floats]:
        """The three corners of every triangle, each (3, t)."""
        a, b, c = (self.vertices[:, index] for index in self.triangles)
        return a, b, c


def _checked_uv(uv: Floats | None, count: int) -> Floats:
    """What is built anew from a mesh with a texture, and forgets where it was, fails here and loses nothing."""
    found = np.array(math.nan if uv is None else uv, dtype=np.float64, order="C")
    if found.shape != (2, count) or not np.isfinite(found).all():
        raise InputError("mesh uv", "none" if uv is None else found.shape, f"(2, {count}) finite, for a texture")
    return found


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
        if self.material.texture is not None:
            raise InputError("sphere texture", self.material.texture, "one colour: meshes alone have textures")
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
