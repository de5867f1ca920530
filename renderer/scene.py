"""What a scene is made of: frozen, validated, in physical units.

Lengths are in scene units (call them metres), angles in degrees where a name says so. All colours are
linear RGB. Small vectors are tuples of three floats; only meshes hold arrays, component-first (3, n).
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field, fields, replace
from typing import Any

from .errors import InputError
from .expected_pixel import ExpectedPixel
from .lights import Light, QuadLight
from .sensor import Sensor
from .surfaces import Ellipsoid, Material, Mesh
from .validation import Vec3, finite, parallel, vector

MAX_SIDE = 65_536


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
            object.__setattr__(self, name, vector(f"camera {name}", getattr(self, name)))
        object.__setattr__(self, "fov_y", finite("camera fov", self.fov_y))
        if not 0 < self.fov_y < 180:
            raise InputError("camera fov", self.fov_y, "an angle in (0, 180) degrees")
        if self.position == self.target:
            raise InputError("camera target", self.target, "a point other than the camera's position")
        view: Vec3 = tuple(t - p for t, p in zip(self.target, self.position, strict=True))  # type: ignore[assignment]
        vector("camera view", view)
        if max(map(abs, self.up)) == 0 or parallel(view, self.up):
            raise InputError("camera up", self.up, "a direction not parallel to the view")


@dataclass(frozen=True)
class Origin:
    """Where a scene comes from that is another program's, which can read it itself.

    Parameters
    ----------
    file : str
    lights : tuple of int
        That program's numbers of our lights.
    content : str
        What the scene was when it was read: one that was changed since is that file's no more.
    words : str
        What it says, where it is no file.
    """

    file: str
    lights: tuple[int, ...]
    content: str
    words: str = ""


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
    sensors : tuple of Sensor
        Points whose irradiance is asked for. They change no pixel.
    pixels : tuple of ExpectedPixel
        What some pixels should show. They change none.
    name, output : str
        For reports; the file's own name for its PNG.
    warnings : tuple of str
        What the reader ignored, with its line. Not part of the scene's identity.
    lines : tuple of tuple of int
        Of the file: where each mesh begins, each ellipsoid stands, each light. Empty where there is no file; not part
        of the scene's identity.
    origin : Origin, optional
        The file of another program that it was read from. Not part of the scene's identity.
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
    sensors: tuple[Sensor, ...] = ()
    pixels: tuple[ExpectedPixel, ...] = ()
    name: str = "scene"
    output: str = "raytrace.png"
    warnings: tuple[str, ...] = field(default=(), compare=False)
    lines: tuple[tuple[int, ...], ...] = field(default=(), compare=False, repr=False)
    origin: Origin | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            side = getattr(self, name)
            if not isinstance(side, int) or not 1 <= side <= MAX_SIDE:
                raise InputError(f"size {name}", side, f"a whole number from 1 to {MAX_SIDE}")
        for name in ("light_samples", "spp"):
            count = getattr(self, name)
            if not isinstance(count, int) or not 1 <= count <= 1 << 24:
                raise InputError(name.replace("_", ""), count, "a whole number from 1 to 16777216")
        if self.spp > 1 and self.is_textured:
            raise InputError("spp", self.spp, "1, pixel centres: a texture varies inside a pixel")
        if self.integrator not in INTEGRATORS:
            raise InputError("integrator", self.integrator, " or ".join(INTEGRATORS))
        if self.stratify and math.isqrt(self.light_samples) ** 2 != self.light_samples:
            raise InputError("lightsamples", self.light_samples, "a square number (1, 4, 9, ...) with lightstratify on")

    def with_(self, **changes: Any) -> Scene:
        """A copy with some fields changed."""
        return replace(self, **changes)

    @property
    def quad_lights(self) -> tuple[QuadLight, ...]:
        """The lights that are parallelograms."""
        return tuple(quad for quad in (light.parallelogram() for light in self.lights) if quad is not None)

    @property
    def materials(self) -> tuple[Material, ...]:
        """The material of every mesh, then of every ellipsoid."""
        return *(mesh.material for mesh in self.meshes), *(ellipsoid.material for ellipsoid in self.ellipsoids)

    @property
    def is_glossy(self) -> bool:
        return any(material.is_glossy for material in self.materials)

    @property
    def is_textured(self) -> bool:
        return any(mesh.uv is not None for mesh in self.meshes)

    def refuse_textures(self, where: str) -> None:
        """Refuse a scene with textures where they would be lost.

        Raises
        ------
        InputError
        """
        for number, mesh in enumerate(self.meshes):
            if mesh.uv is not None:
                raise InputError("texture", f"of mesh {number + 1}", f"surfaces of one colour: {where} has no textures")

    def digest(self) -> str:
        """SHA-256 of everything that can change a pixel, as hex; names and warnings left out."""
        told = hashlib.sha256()
        for entry in fields(self):
            if entry.name in ("name", "output", "warnings", "lines", "meshes", "sensors", "pixels", "origin"):
                continue
            told.update(f"{entry.name}={getattr(self, entry.name)!r};".encode())
        for mesh in self.meshes:
            told.update(f"mesh={mesh.digest};".encode())
        return told.hexdigest()
