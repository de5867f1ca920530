"""Where a scene's origin lies in Mitsuba, and how long its unit is.

Mitsuba 3.9 traces shadow rays from p + n (1 + max|p|) 8.94e-5, and a point on a triangle is as good as float32 holds
its corners. So a scene is centred and scaled to 50 units. Where that would leave what is seen within a fraction of
them (a table on a ground that reaches the horizon, a lamp as far as the moon), what is seen is placed by itself:
the rest may reach far beyond, since errors then grow with the distance from what is seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from nusselt.renderer.camera.first_hits import first_hits
from nusselt.renderer.camera.rays import primary_directions
from nusselt.renderer.geometry.arrays import Geometry, build_geometry
from nusselt.renderer.scene import Scene
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats, column
from nusselt.renderer.visibility.segments import box_corners

from .origin import own_file

SIZE = 50.0
"""Half extent of the scene as Mitsuba sees it; its valid range is about 10 to 1000."""
WIDE = 8.0
"""A scene so many times as large as what is seen of it is placed by what is seen."""
RAYS = 32
"""Camera rays a side, at most, that look for it."""
NEAREST = 0.02
"""Share of what is seen that may be nearer to the camera than the length that is scaled to SIZE."""


@dataclass(frozen=True)
class Placement:
    """Where the scene's points go: (p - centre) scale.

    Parameters
    ----------
    centre : Vec3
        The scene's point at Mitsuba's origin.
    near : float
        The scene's length that is SIZE in Mitsuba: of what is seen, or the half extent of an ordinary scene.
    half : float
        No surface or light of the scene is further than this from the centre, along any axis.
    wide : bool
        Whether it was placed by what is seen.
    """

    centre: Vec3
    near: float
    half: float
    wide: bool = False

    @property
    def unit(self) -> float:
        """The scene's length that is 1 in Mitsuba."""
        return self.near / SIZE

    @property
    def scale(self) -> float:
        """Lengths in Mitsuba over lengths in the scene."""
        return SIZE / self.near

    @property
    def reach(self) -> float:
        """`half` in Mitsuba."""
        return self.half * self.scale if self.wide else SIZE

    def away(self, points: Floats) -> Floats:
        """max|p - centre| of points (3, n)."""
        return np.asarray(np.abs(points - column(self.centre)).max(axis=0, initial=0.0))


def place(scene: Scene, normalise: bool = True) -> Placement:
    """Where a scene goes; found once.

    Without ``normalise`` it stays where and as large as it is, as one that Mitsuba reads from its own file does.
    """
    found = _place(scene.with_(name="", output="", integrator="direct", light_samples=1, stratify=False))
    stays = not normalise or own_file(scene) is not None
    return Placement((0.0, 0.0, 0.0), SIZE, found.half) if stays else found


@lru_cache(maxsize=4)
def _place(scene: Scene) -> Placement:
    geometry = build_geometry(scene)
    points = _places(scene, geometry)
    if points.size == 0:
        return Placement(scene.camera.position, 1.0, 1.0)
    low, high = points.min(axis=1), points.max(axis=1)
    half = float((high - low).max()) / 2 or 1.0
    x, y, z = ((low + high) / 2).tolist()
    ordinary = Placement((x, y, z), half, half)
    seen = _seen(scene, geometry)
    if seen.size == 0:
        return ordinary
    centre, near = _about(seen, column(scene.camera.position))
    if half < WIDE * near:
        return ordinary
    x, y, z = centre[:, 0].tolist()
    return Placement((x, y, z), near, float(np.abs(points - centre).max()), wide=True)


def seen_box(scene: Scene) -> Floats:
    """Corners (3, 8) of a box around what is seen, or around all of an ordinary scene."""
    within = _seen if place(scene).wide else _places
    points = within(scene, build_geometry(scene))
    return box_corners(points) if points.size else np.zeros((3, 0))


def _places(scene: Scene, geometry: Geometry) -> Floats:
    """Points (3, n) whose box holds surfaces and the lights that have a place."""
    g, reach = geometry, np.sqrt((geometry.axes**2).sum(axis=2)).T
    lights = [light.hull() for light in scene.lights if not light.at_infinity]
    return np.hstack([g.a, g.b, g.c, g.center - reach, g.center + reach, *lights])


def _seen(scene: Scene, geometry: Geometry) -> Floats:
    """What some camera rays, evenly over the image, meet, (3, n)."""
    columns, rows = (np.linspace(0.5, side - 0.5, min(side, RAYS)) for side in (scene.width, scene.height))
    x, y = (v.ravel() for v in np.meshgrid(columns, rows))
    corners = primary_directions(scene, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    hits = first_hits(geometry, column(scene.camera.position), primary_directions(scene, x, y), corners)
    return hits.position[:, hits.surface >= 0]


def _about(seen: Floats, camera: Floats) -> tuple[Floats, float]:
    """The centre (3, 1) and the length of what is seen.

    An error in proportion to the distance from the centre is judged by the camera, to whom it is smaller the further
    away: the camera itself is a good centre where it sees things both near and far, the middle of them where it is
    far from all.
    """
    to_camera = np.maximum(np.abs(seen - camera).max(axis=0), 1e-300)
    middle = np.median(seen, axis=1, keepdims=True)
    centre = min((middle, camera), key=lambda c: float((np.abs(seen - c).max(axis=0) / to_camera).mean()))
    spread = float(np.median(np.abs(seen - centre).max(axis=0)))
    return centre, min(spread, float(np.quantile(to_camera, NEAREST))) or 1.0
