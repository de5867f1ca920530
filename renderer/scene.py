"""What a scene is made of: frozen, validated, in physical units.

Lengths are in scene units (call them metres), angles in degrees where a name says so. All colours are
linear RGB. Small vectors are tuples of three floats; only meshes hold arrays, component-first (3, n).
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

Vec3: TypeAlias = tuple[float, float, float]
Floats: TypeAlias = NDArray[np.floating[Any]]
MAX_SIDE = 65_536


def _finite(name: str, value: object) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, value, "a finite number") from None
    if not math.isfinite(number):
        raise InputError(name, value, "a finite number")
    return number + 0.0  # -0.0 becomes 0.0: equal scenes have equal digests


def _vector(name: str, value: object) -> Vec3:
    try:
        components: tuple[object, ...] = tuple(value)  # type: ignore[arg-type]
    except TypeError:
        components = ()
    if len(components) != 3:
        raise InputError(name, value, "three finite numbers")
    return _finite(name, components[0]), _finite(name, components[1]), _finite(name, components[2])


def _colour(name: str, value: object) -> Vec3:
    rgb = _vector(name, value)
    if min(rgb) < 0:
        raise InputError(name, value, "three numbers, none negative")
    return rgb


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(name: str, v: Vec3) -> Vec3:
    scale = max(map(abs, v))  # first: squares of 1e-200 vanish
    if scale == 0:
        raise InputError(name, v, "a vector that is not zero")
    x, y, z = (c / scale for c in v)
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def _direction(name: str, value: object) -> Vec3:
    """A unit vector; one that is so already to rounding is kept, so that a copy of a light equals it."""
    v = _vector(name, value)
    if abs(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - 1) < 2e-15:
        return v
    return _vector(name, _unit(name, v))


def _parallel(a: Vec3, b: Vec3) -> bool:
    """Whether two vectors span no area to rounding; scale-free."""
    ua, ub = _unit("", a), _unit("", b)
    return max(map(abs, _cross(ua, ub))) < 4e-16


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Parameters
    ----------
    position, target, up : Vec3
        Points, and the direction that is up in the image. ``up`` need not be perpendicular to the view.
    fov_y : float
        Vertical field of view in degrees, in (0, 180).
    """

    position: Vec3
    target: Vec3
    up: Vec3
    fov_y: float

    def __post_init__(self) -> None:
        for name in ("position", "target", "up"):
            object.__setattr__(self, name, _vector(f"camera {name}", getattr(self, name)))
        object.__setattr__(self, "fov_y", _finite("camera fov", self.fov_y))
        if not 0 < self.fov_y < 180:
            raise InputError("camera fov", self.fov_y, "an angle in (0, 180) degrees")
        if self.position == self.target:
            raise InputError("camera target", self.target, "a point other than the camera's position")
        view: Vec3 = tuple(t - p for t, p in zip(self.target, self.position, strict=True))  # type: ignore[assignment]
        _vector("camera view", view)
        if max(map(abs, self.up)) == 0 or _parallel(view, self.up):
            raise InputError("camera up", self.up, "a direction not parallel to the view")


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
            object.__setattr__(self, name, _colour(name, getattr(self, name)))
        object.__setattr__(self, "shininess", _finite("shininess", self.shininess))
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
        vertices = np.array(self.vertices, dtype=np.float64, order="C") + 0.0  # -0.0 as in _finite
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
        object.__setattr__(self, "center", _vector("sphere center", self.center))
        rows = tuple(_vector("sphere axes", row) for row in self.axes)
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
        radius = _finite("sphere radius", radius)
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
class QuadLight:
    """A parallelogram corner + u ab + v ac, u, v in [0, 1], that emits on the side of -(ab x ac) only.

    Black as a reflector on both sides, opaque, and visible to the camera.

    Parameters
    ----------
    corner, ab, ac : Vec3
        Corner and the two edges from it.
    radiance : Vec3
        W m^-2 sr^-1.
    """

    corner: Vec3
    ab: Vec3
    ac: Vec3
    radiance: Vec3

    def __post_init__(self) -> None:
        for name in ("corner", "ab", "ac"):
            object.__setattr__(self, name, _vector(f"quadLight {name}", getattr(self, name)))
        object.__setattr__(self, "radiance", _colour("quadLight radiance", self.radiance))
        for name in ("ab", "ac"):
            if max(map(abs, getattr(self, name))) == 0:
                raise InputError(f"quadLight {name}", getattr(self, name), "an edge that is not zero")
        if _parallel(self.ab, self.ac):
            raise InputError("quadLight ac", self.ac, "an edge not parallel to ab (the light would have no area)")
        if not 0 < self.area < math.inf:
            raise InputError("quadLight area", self.area, "an area above 0 and finite in double precision")

    @property
    def area(self) -> float:
        return math.hypot(*_cross(self.ab, self.ac))

    @property
    def normal(self) -> Vec3:
        """Unit normal of the emitting side, -(ab x ac)/|ab x ac|."""
        ux, uy, uz = _unit("", _cross(_unit("", self.ab), _unit("", self.ac)))
        return -ux, -uy, -uz


@dataclass(frozen=True)
class PointLight:
    """Irradiance intensity cos / R^2 at distance R.

    Parameters
    ----------
    position : Vec3
    intensity : Vec3
        Radiant intensity, W/sr.
    """

    position: Vec3
    intensity: Vec3

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", _vector("point position", self.position))
        object.__setattr__(self, "intensity", _colour("point intensity", self.intensity))


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light.

    Parameters
    ----------
    direction : Vec3
        *Towards* the light; made unit length.
    irradiance : Vec3
        On a plane that faces the light, W m^-2.
    """

    direction: Vec3
    irradiance: Vec3

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _direction("directional direction", self.direction))
        object.__setattr__(self, "irradiance", _colour("directional irradiance", self.irradiance))


@dataclass(frozen=True)
class SunLight:
    """A uniform disk at infinity, not seen by the camera.

    Its radiance is irradiance / (pi sin^2 alpha), alpha the half angle: exactly the irradiance named, on a
    plane that faces it.

    Parameters
    ----------
    direction : Vec3
        Towards the centre; made unit length.
    irradiance : Vec3
        On a plane that faces the centre, W m^-2.
    angle : float
        Full angular diameter 2 alpha in degrees, in (0, 180).
    """

    direction: Vec3
    irradiance: Vec3
    angle: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _direction("sun direction", self.direction))
        object.__setattr__(self, "irradiance", _colour("sun irradiance", self.irradiance))
        object.__setattr__(self, "angle", _finite("sun angle", self.angle))
        if not 0 < self.angle < 180:
            raise InputError("sun angle", self.angle, "an angular diameter in (0, 180) degrees")
        if math.sin(self.half_angle) ** 2 == 0 or math.isinf(max(self.radiance)):
            raise InputError("sun angle", self.angle, "an angle wide enough for the radiance to be finite")

    @property
    def half_angle(self) -> float:
        """alpha in radians."""
        return math.radians(self.angle) / 2

    @property
    def radiance(self) -> Vec3:
        """W m^-2 sr^-1."""
        r, g, b = (e / (math.pi * math.sin(self.half_angle) ** 2) for e in self.irradiance)
        return r, g, b


Light: TypeAlias = QuadLight | PointLight | DirectionalLight | SunLight

INTEGRATORS = ("analyticdirect", "direct")


@dataclass(frozen=True)
class Scene:
    """Everything an image needs.

    Parameters
    ----------
    width, height : int
        Image size in pixels, 1 to 65,536 a side.
    camera : Camera
    meshes : tuple of Mesh
    ellipsoids : tuple of Ellipsoid
    lights : tuple of Light
        In file order.
    integrator : {"analyticdirect", "direct"}
        Which estimator the scene asks for.
    light_samples : int
        Shadow samples per extended light.
    stratify : bool
        Whether they form a sqrt(N) x sqrt(N) grid of strata; N must then be a square.
    spp : int
        1: the ray through the pixel's centre. Above 1: that many uniform rays over the pixel's box.
    two_sided : bool
        Whether surfaces also reflect at their back.
    name, output : str
        For reports; the file's own name for its PNG.
    warnings : tuple of str
        What the reader ignored, with its line. Not part of the scene's identity.
    """

    width: int
    height: int
    camera: Camera
    meshes: tuple[Mesh, ...] = ()
    ellipsoids: tuple[Ellipsoid, ...] = ()
    lights: tuple[Light, ...] = ()
    integrator: str = "direct"
    light_samples: int = 1
    stratify: bool = False
    spp: int = 1
    two_sided: bool = False
    name: str = "scene"
    output: str = "raytrace.png"
    warnings: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            side = getattr(self, name)
            if not isinstance(side, int) or not 1 <= side <= MAX_SIDE:
                raise InputError(f"size {name}", side, f"a whole number from 1 to {MAX_SIDE}")
        for name in ("light_samples", "spp"):
            count = getattr(self, name)
            if not isinstance(count, int) or not 1 <= count <= 1 << 24:
                raise InputError(name.replace("_", ""), count, "a whole number from 1 to 16777216")
        if self.integrator not in INTEGRATORS:
            raise InputError("integrator", self.integrator, " or ".join(INTEGRATORS))
        if self.stratify and math.isqrt(self.light_samples) ** 2 != self.light_samples:
            raise InputError("lightsamples", self.light_samples, "a square number (1, 4, 9, ...) with lightstratify on")

    def with_(self, **changes: Any) -> Scene:
        """A copy with some fields changed."""
        return replace(self, **changes)

    @property
    def quad_lights(self) -> tuple[QuadLight, ...]:
        return tuple(light for light in self.lights if isinstance(light, QuadLight))

    @property
    def materials(self) -> tuple[Material, ...]:
        """The material of every mesh, then of every ellipsoid."""
        return *(mesh.material for mesh in self.meshes), *(ellipsoid.material for ellipsoid in self.ellipsoids)

    @property
    def is_glossy(self) -> bool:
        return any(material.is_glossy for material in self.materials)

    def digest(self) -> str:
        """SHA-256 of everything that can change a pixel, as hex; names and warnings left out."""
        told = hashlib.sha256()
        for entry in fields(self):
            if entry.name in ("name", "output", "warnings", "meshes"):
                continue
            told.update(f"{entry.name}={getattr(self, entry.name)!r};".encode())
        for mesh in self.meshes:
            told.update(f"mesh={mesh.digest};".encode())
        return told.hexdigest()
