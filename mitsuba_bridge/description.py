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
from nusselt.renderer.lights import Light
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.vectors import Floats, dot, unit

from .cutting import cut
from .lights import approximations, described, rgb
from .limits import close_blockers, coarse_lights, far_lifted
from .lobes import is_stock, surface
from .origin import own_file
from .placement import SIZE, Placement, place, seen_box
from .ply import write_ply
from .tessellation import tessellate, tessellate_about

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
        kind (rectangle, disk, sphere, ply, point, spot, …), placement, colour, and whether it has a ``body`` that stays
        as a black blocker where it is not lit; in the scene's order.
    two_sided, boxed : bool
        Whether backs reflect; whether a pixel is its box rather than its centre.
    scale : float
        Lengths here over lengths in the scene.
    centre : list of float
        The scene's point that lies at the origin here.
    notes, limits : list of str
        What is approximate, and where Mitsuba itself is not right, in plain sentences.
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
    limits: list[str]

    @property
    def is_glossy(self) -> bool:
        """Whether it needs a surface that the stock `mitsuba` executable does not have."""
        return not all(is_stock(bsdf["kind"]) for bsdf in self.bsdfs)

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


def _camera(scene: Scene, place: Any, size: float, near: float) -> dict[str, Any]:
    look, _, up = (v[:, 0] for v in view_frame(scene))
    origin = place(scene.camera.position)
    away = float(np.abs(origin).max())
    return {
        "origin": origin.tolist(),
        "target": (origin + look * max(size, away)).tolist(),
        "up": (up / np.abs(up).max()).tolist(),
        "fov": scene.camera.fov_y,
        "near": 1e-5 * near,
        "far": 10 * (size + away),
        "width": scene.width,
        "height": scene.height,
    }


@dataclass(frozen=True)
class _Files:
    """Where things go, and the meshes that are written there."""

    placement: Placement
    folder: Path
    stem: str
    notes: list[str]

    def place(self, point: Any) -> Floats:
        """From the scene's points (3,) to Mitsuba's."""
        return (np.asarray(point, dtype=np.float64) - np.array(self.placement.centre)) * self.scale

    @property
    def scale(self) -> float:
        return self.placement.scale

    def mesh(self, mesh: Mesh, number: int) -> dict[str, Any]:
        """A mesh, its large triangles in pieces."""
        name, centre = f"{self.stem}-mesh{number}.ply", np.array(self.placement.centre)[:, None]
        pieces = cut(np.stack(mesh.corners, axis=2), self.placement)
        if pieces is None:
            write_ply(self.folder / name, (mesh.vertices - centre) * self.scale, mesh.triangles)
            return {"kind": "ply", "file": name, "smooth": False}
        vertices, triangles = pieces.reshape(3, -1), np.arange(pieces.shape[1] * 3).reshape(-1, 3).T
        write_ply(self.folder / name, (vertices - centre) * self.scale, triangles)
        self.notes.append(
            f"mesh {number + 1} reaches far beyond what is seen: its {mesh.triangles.shape[1]} triangles are "
            f"{triangles.shape[1]} pieces in Mitsuba, small near what is seen"
        )
        return {"kind": "ply", "file": name, "smooth": False}

    def light(self, light: Light, number: int, reach: float) -> dict[str, Any]:
        """A light; one that is triangles is a mesh."""
        entry = described(light, self.place, self.scale, reach) | {"body": light.body() is not None}
        corners, triangles = entry.pop("corners", None), entry.pop("triangles", None)
        if corners is None:
            return entry
        name = f"{self.stem}-light{number}.ply"
        write_ply(self.folder / name, np.array(corners).T, np.array(triangles))
        return {**entry, "file": name}

    def ball(self, ellipsoid: Ellipsoid, number: int) -> dict[str, Any]:
        """A sphere, or an ellipsoid as a mesh; also a sphere that is large and close by."""
        near = _seen_from_close_by(ellipsoid, self.placement)
        if near is None and ellipsoid.radius is not None:
            radius = ellipsoid.radius * self.scale
            return {"kind": "sphere", "center": self.place(ellipsoid.center).tolist(), "radius": radius}
        name, axes = f"{self.stem}-ellipsoid{number}.ply", np.array(ellipsoid.axes) * self.scale
        if near is None:
            vertices, normals, triangles, error = tessellate(axes)
            origin, told = self.place(ellipsoid.center), f"{error:.1e} of its size off"
        else:
            foot, finest = near
            vertices, normals, triangles, error = tessellate_about(axes, foot, finest)
            on = np.array(ellipsoid.center) + np.array(ellipsoid.axes) @ foot[:, 0]
            origin, told = self.place(on), f"{error:.1e} of the distance from what is seen off"
        write_ply(self.folder / name, vertices + origin[:, None], triangles, normals)
        what = "an ellipsoid" if ellipsoid.radius is None else "a large sphere"
        self.notes.append(f"{what} is a mesh of {triangles.shape[1]} triangles in Mitsuba, up to {told}")
        return {"kind": "ply", "file": name, "smooth": True}


LARGE = 20.0
"""A sphere so many times as large as it is far from what is seen is a mesh: Mitsuba knows its points to 6e-8 of it."""


def _seen_from_close_by(ellipsoid: Ellipsoid, placement: Placement) -> tuple[Floats, float] | None:
    """For an ellipsoid that is far larger than what is seen and passes close by: the nearest place, on the unit sphere
    (3, 1), and an angle there that is short against what is seen.
    """
    axes = np.array(ellipsoid.axes)
    sizes = np.linalg.svd(axes, compute_uv=False)
    if not placement.wide or sizes[0] < LARGE * placement.near:
        return None
    local = np.linalg.solve(axes, np.array(placement.centre) - np.array(ellipsoid.center))[:, None]
    height = abs(np.sqrt(dot(local, local)).item() - 1)
    near = max(height * float(sizes[-1]), placement.near)
    if sizes[0] < LARGE * near or not local.any():
        return None
    return unit(local), min(near / float(sizes[0]) / 4, 0.1)


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
    own = own_file(scene) is not None
    if normalise or not own:  # of a file that is rendered itself, surfaces are not looked at
        scene.refuse_textures("what is written for Mitsuba")
    placement = place(scene, normalise)
    notes: list[str] = []
    files = _Files(placement, folder, stem, notes)
    bsdfs: list[dict[str, Any]] = []
    shapes: list[dict[str, Any]] = []

    def add(shape: dict[str, Any], material: Material) -> None:
        bsdf = surface(material)
        if bsdf not in bsdfs:
            bsdfs.append(bsdf)
        shapes.append({**shape, "bsdf": bsdfs.index(bsdf), "emission": rgb(material.emission)})

    for number, mesh in enumerate(scene.meshes):
        add(files.mesh(mesh, number), mesh.material)
    for number, ellipsoid in enumerate(scene.ellipsoids):
        add(files.ball(ellipsoid, number), ellipsoid.material)
    reach = placement.reach if normalise else placement.half
    lights = [files.light(light, number, reach) for number, light in enumerate(scene.lights)]
    camera = _camera(scene, files.place, reach, SIZE if normalise else reach)
    if placement.wide:
        notes.append(
            f"the scene is {placement.half / placement.near:.2g} times as large as what is seen of it: "
            f"{placement.near:.3g} is 50 units in Mitsuba, about {tuple(float(f'{x:.3g}') for x in placement.centre)}"
        )
    if np.abs(camera["origin"]).max() > 1e4 * reach:
        notes.append("the camera is more than 10,000 scene sizes away: Mitsuba's float32 hit points lose digits")
    for light in scene.lights:
        notes += approximations(light)
    limits: list[str] = []
    if normalise or own:
        seen = seen_box(scene)
        limits = close_blockers(scene, seen, placement.near) + coarse_lights(scene, seen)
    if own:
        limits += far_lifted(scene, placement.half)
    description = Description(
        camera,
        shapes,
        bsdfs,
        lights,
        scene.two_sided,
        scene.spp > 1,
        files.scale,
        list(placement.centre),
        notes,
        limits,
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
