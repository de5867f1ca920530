"""One neutral description of the Mitsuba scene: it feeds both the child process and the XML text.

Mitsuba 3.9 traces shadow rays from p + n (1 + max|p|) 8.94e-5: an offset that is absolute near the origin. So
the scene is moved to the origin and scaled to 50 units before it is sent. Radiance and irradiance do not
change with scale; the intensity of a point light takes the square of it.

Only plain Python types here: a description is JSON, but for its meshes, which are PLY files beside it.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.camera.rays import view_frame
from nusselt.renderer.errors import InputError
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.vectors import Floats

from .lights import SIZE, approximations, described, rgb
from .limits import close_blockers
from .lobes import is_stock, surface
from .ply import write_ply
from .tessellation import tessellate

ROBUST = "embree_use_robust_intersections"
"""Property of the scene plugin: rays do not slip between two triangles that share an edge."""


@dataclass(frozen=True)
class Description:
    """A scene as Mitsuba is to see it.

    Parameters
    ----------
    camera : dict
        origin, target, up, fov (vertical, degrees), near, far, width, height.
    shapes : list of dict
        kind (ply, sphere, rectangle), its placement, ``bsdf`` (an index) and ``emission``, seen but no light.
    bsdfs : list of dict
        kind, Mitsuba's type, and its parameters: numbers, and colours as lists; see `lobes.surface`.
    lights : list of dict
        kind (rectangle, disk, point, directional), placement, colour, and whether it has a ``body`` that stays as a
        black blocker where it is not lit; in the scene's order.
    two_sided, boxed : bool
        Whether backs reflect; whether a pixel is its box rather than its centre.
    scale : float
        Lengths here over lengths in the scene.
    centre : list of float
        The scene's point that lies at the origin here.
    notes : list of str
        What is approximate, in plain sentences.
    """

    camera: dict[str, Any]
    shapes: list[dict[str, Any]]
    bsdfs: list[dict[str, Any]]
    lights: list[dict[str, Any]]
    two_sided: bool
    boxed: bool
    scale: float
    centre: list[float]
    notes: list[str]

    @property
    def is_glossy(self) -> bool:
        """Whether it needs a surface that the stock `mitsuba` executable does not have."""
        return not all(is_stock(bsdf["kind"]) for bsdf in self.bsdfs)

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


def extent(scene: Scene) -> tuple[Floats, float]:
    """Centre and half extent of surfaces and of the lights that have a place."""
    geometry = build_geometry(scene)
    points = [geometry.a, geometry.b, geometry.c]
    reach = np.sqrt((geometry.axes**2).sum(axis=2)).T
    points += [geometry.center - reach, geometry.center + reach]
    points += [light.hull() for light in scene.lights if not light.at_infinity]
    every = np.hstack(points)
    if every.size == 0:
        return np.array(scene.camera.position), 1.0
    low, high = every.min(axis=1), every.max(axis=1)
    half = float((high - low).max()) / 2
    return (low + high) / 2, half if half > 0 else 1.0


def _camera(scene: Scene, place: Any, size: float) -> dict[str, Any]:
    look, _, up = (v[:, 0] for v in view_frame(scene))
    origin = place(scene.camera.position)
    away = float(np.abs(origin).max())
    return {
        "origin": origin.tolist(),
        "target": (origin + look * max(size, away)).tolist(),
        "up": (up / np.abs(up).max()).tolist(),
        "fov": scene.camera.fov_y,
        "near": 1e-5 * size,
        "far": 10 * (size + away),
        "width": scene.width,
        "height": scene.height,
    }


def _ball(ellipsoid: Ellipsoid, place: Any, scale: float, folder: Path, name: str, notes: list[str]) -> dict[str, Any]:
    if ellipsoid.radius is not None:
        return {"kind": "sphere", "center": place(ellipsoid.center).tolist(), "radius": ellipsoid.radius * scale}
    vertices, normals, triangles, error = tessellate(np.array(ellipsoid.axes) * scale)
    write_ply(folder / name, vertices + place(ellipsoid.center)[:, None], triangles, normals)
    notes.append(
        f"an ellipsoid is a mesh of {triangles.shape[1]} triangles in Mitsuba, up to {error:.1e} of its size off"
    )
    return {"kind": "ply", "file": name, "smooth": True}


def describe(scene: Scene, folder: Path, stem: str = "scene", normalise: bool = True) -> Description:
    """Describe a scene, its meshes written as PLY into ``folder``.

    Parameters
    ----------
    folder : Path
        Existing folder for the meshes.
    stem : str
        First part of their names.
    normalise : bool
        Move and scale into Mitsuba's valid range. Without it the image is what Mitsuba makes of the raw scene.

    Raises
    ------
    InputError
        If the numbers do not fit float32 even so.
    """
    centre, half = extent(scene)
    if not normalise:
        centre = np.zeros(3)
    scale = SIZE / half if normalise else 1.0
    notes = close_blockers(scene, half) if normalise else []

    def place(point: Any) -> Floats:
        return (np.asarray(point, dtype=np.float64) - centre) * scale

    bsdfs: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []

    def add(shape: dict[str, Any], material: Material) -> None:
        bsdf = surface(material)
        if bsdf not in bsdfs:
            bsdfs.append(bsdf)
        shapes.append({**shape, "bsdf": bsdfs.index(bsdf), "emission": rgb(material.emission)})

    for number, mesh in enumerate(scene.meshes):
        name = f"{stem}-mesh{number}.ply"
        write_ply(folder / name, (mesh.vertices - centre[:, None]) * scale, mesh.triangles)
        add({"kind": "ply", "file": name, "smooth": False}, mesh.material)
    for number, ellipsoid in enumerate(scene.ellipsoids):
        add(_ball(ellipsoid, place, scale, folder, f"{stem}-ellipsoid{number}.ply", notes), ellipsoid.material)
    lights = [described(light, place, scale) | {"body": light.body() is not None} for light in scene.lights]
    camera = _camera(scene, place, half * scale)
    if np.abs(camera["origin"]).max() > 1e4 * half * scale:
        notes.append("the camera is more than 10,000 scene sizes away: Mitsuba's float32 hit points lose digits")
    for light in scene.lights:
        notes += approximations(light)
    description = Description(
        camera, shapes, bsdfs, lights, scene.two_sided, scene.spp > 1, scale, centre.tolist(), notes
    )
    _check_range(description)
    return description


def _check_range(description: Description) -> None:
    """Mitsuba is float32: what does not fit is refused by name rather than rendered as zero or infinity."""
    for light in description.lights:
        for name in ("radiance", "intensity", "irradiance"):
            for value in light.get(name, ()):
                if value != 0 and not 1e-30 < value < 1e30:
                    raise InputError(
                        f"{light['kind']} {name}", value, "a value Mitsuba's float32 can hold (1e-30 to 1e30)"
                    )
