"""One neutral description of the Mitsuba scene: it feeds both the child process and the XML text.

Mitsuba 3.9 traces shadow rays from p + n (1 + max|p|) 8.94e-5: an offset that is absolute near the origin. So
the scene is moved to the origin and scaled to 50 units before it is sent. Radiance and irradiance do not
change with scale; the intensity of a point light takes the square of it.

Only plain Python types here: a description is JSON, but for its meshes, which are PLY files beside it.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.renderer.camera.rays import view_frame
from nusselt.renderer.errors import InputError
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.vectors import Floats, frame

from .limits import close_blockers
from .ply import write_ply
from .tessellation import tessellate

SIZE = 50.0
"""Half extent of the scene as Mitsuba sees it; its valid range is about 10 to 1000."""
SUN_DISTANCE = 1e5
"""Distance of the sun's disk in scene radii: its irradiance is then off by 2e-6 in the mean (measured)."""

ROBUST = "embree_use_robust_intersections"
"""Property of the scene plugin: rays do not slip between two triangles that share an edge."""

Matrix = list[list[float]]


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
        kind (diffuse, modified_phong) and its colours.
    lights : list of dict
        kind (rectangle, disk, point, directional), placement and colour; in the scene's order.
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
        """Whether it needs the Phong surface, which the stock `mitsuba` executable does not have."""
        return any(bsdf["kind"] == "modified_phong" for bsdf in self.bsdfs)

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


def extent(scene: Scene) -> tuple[Floats, float]:
    """Centre and half extent of surfaces and of the lights that have a place."""
    geometry = build_geometry(scene)
    points = [geometry.a, geometry.b, geometry.c]
    reach = np.sqrt((geometry.axes**2).sum(axis=2)).T
    points += [geometry.center - reach, geometry.center + reach]
    points += [np.array(light.position)[:, None] for light in scene.lights if isinstance(light, PointLight)]
    every = np.hstack(points)
    if every.size == 0:
        return np.array(scene.camera.position), 1.0
    low, high = every.min(axis=1), every.max(axis=1)
    half = float((high - low).max()) / 2
    return (low + high) / 2, half if half > 0 else 1.0


def _rgb(colour: tuple[float, ...]) -> list[float]:
    return [float(c) for c in colour]


def _bsdf(material: Material) -> dict[str, Any]:
    """Stock `diffuse` wherever it can say the material: no lobe, and no albedo above one."""
    if not material.is_glossy and max(material.diffuse) <= 1:
        return {"kind": "diffuse", "reflectance": _rgb(material.diffuse)}
    return {
        "kind": "modified_phong",
        "kd": _rgb(material.diffuse),
        "ks": _rgb(material.specular),
        "exponent": float(material.shininess),
    }


def _columns(x: Floats, y: Floats, z: Floats, origin: Floats) -> Matrix:
    matrix = np.eye(4)
    for k, column in enumerate((x, y, z, origin)):
        matrix[:3, k] = column
    return matrix.tolist()


def _light(light: Light, place: Any, scale: float) -> dict[str, Any]:
    if isinstance(light, QuadLight):
        ab, ac = (np.array(v) * scale / 2 for v in (light.ab, light.ac))
        # A rectangle faces +(x cross y): ac before ab, so that it emits on the side of -(ab x ac).
        centre = place(light.corner) + ab + ac
        to_world = _columns(ac, ab, np.array(light.normal), centre)
        return {"kind": "rectangle", "to_world": to_world, "radiance": _rgb(light.radiance)}
    if isinstance(light, PointLight):
        intensity = [c * scale**2 for c in light.intensity]
        return {"kind": "point", "position": place(light.position).tolist(), "intensity": intensity}
    direction = np.array(light.direction)
    if isinstance(light, DirectionalLight):
        irradiance = _rgb(light.irradiance)
        return {"kind": "directional", "direction": (-direction).tolist(), "irradiance": irradiance}
    distance = SUN_DISTANCE * SIZE
    x, y = (v[:, 0] for v in frame(-direction[:, None]))
    radius = distance * math.tan(light.half_angle)
    to_world = _columns(x * radius, y * radius, -direction, direction * distance)
    return {"kind": "disk", "to_world": to_world, "radiance": _rgb(light.radiance)}


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
        bsdf = _bsdf(material)
        if bsdf not in bsdfs:
            bsdfs.append(bsdf)
        shapes.append({**shape, "bsdf": bsdfs.index(bsdf), "emission": _rgb(material.emission)})

    for number, mesh in enumerate(scene.meshes):
        name = f"{stem}-mesh{number}.ply"
        write_ply(folder / name, (mesh.vertices - centre[:, None]) * scale, mesh.triangles)
        add({"kind": "ply", "file": name, "smooth": False}, mesh.material)
    for number, ellipsoid in enumerate(scene.ellipsoids):
        add(_ball(ellipsoid, place, scale, folder, f"{stem}-ellipsoid{number}.ply", notes), ellipsoid.material)
    lights = [_light(light, place, scale) for light in scene.lights]
    camera = _camera(scene, place, half * scale)
    if np.abs(camera["origin"]).max() > 1e4 * half * scale:
        notes.append("the camera is more than 10,000 scene sizes away: Mitsuba's float32 hit points lose digits")
    for light in scene.lights:
        if isinstance(light, SunLight) and light.angle > 2:
            notes.append(f"the sun of {light.angle:g} degrees is a far disk in Mitsuba")
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
