"""A public table, entry by entry: each a sum of sensors' readings, and what was printed of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.lights import Light, QuadLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.sensor import Sensor
from nusselt.renderer.surfaces import Ellipsoid, Mesh
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats

ANYWHERE = Camera((1.0, 2.0, 1.5), (2.0, 0.0, 0.0), (0.0, 0.0, 1.0), 45.0)
"""Nothing is seen: sensors alone are read."""


@dataclass(frozen=True)
class Entry:
    """One number of a table: the sum of ``weights`` times the irradiance of its sensors.

    Parameters
    ----------
    name : str
        As the table has it, or its place.
    sensors : tuple of Sensor
    weights : tuple of float
    printed : float
    half_unit : float
        Of the last digit that is printed, or how well the formula is evaluated.
    """

    name: str
    sensors: tuple[Sensor, ...]
    weights: tuple[float, ...]
    printed: float
    half_unit: float


@dataclass(frozen=True)
class PublicTable:
    """A table and its scene.

    Parameters
    ----------
    name, source, unit : str
    scene : Scene
        Without sensors.
    entries : tuple of Entry
    is_right : bool
        Whether all of its digits are: then that is claimed. Else its deviations are stated.
    note : str
        What is known of it.
    """

    name: str
    source: str
    unit: str
    scene: Scene
    entries: tuple[Entry, ...]
    is_right: bool = True
    note: str = ""

    @property
    def whole(self) -> Scene:
        """The scene with every entry's sensors, in their order."""
        return self.scene.with_(sensors=tuple(sensor for entry in self.entries for sensor in entry.sensors))

    def sums(self, readings: Floats, power: int = 1) -> Floats:
        """The entries (..., m) from readings (..., n) of all their sensors, or of variances: squares of weights."""
        ends = np.cumsum([len(entry.sensors) for entry in self.entries])
        parts = np.split(readings, ends[:-1], axis=-1)
        return np.stack(
            [
                (part * np.array(entry.weights) ** power).sum(axis=-1)
                for part, entry in zip(parts, self.entries, strict=True)
            ],
            axis=-1,
        )


def scene_of(name: str, *lights: Light, meshes: tuple[Mesh, ...] = (), ellipsoids: tuple[Ellipsoid, ...] = ()) -> Scene:
    """A scene that nobody looks at."""
    return Scene(1, 1, ANYWHERE, meshes, ellipsoids, lights, light_samples=64, stratify=True, name=name)


def rectangle(corner: Vec3, ab: Vec3, ac: Vec3, radiance: float) -> QuadLight:
    """A light that shines along ab x ac."""
    return QuadLight(corner, ac, ab, (radiance, radiance, radiance))


def points(names: str, places: list[Vec3], normal: Vec3, printed: str, weight: float = 1.0) -> list[Entry]:
    """An entry for each place, its digits as printed."""
    return [
        Entry(name, (Sensor(place, normal),), (weight,), float(digits), half_unit(digits))
        for name, place, digits in zip(names.split(), places, printed.split(), strict=True)
    ]


def half_unit(digits: str) -> float:
    """Half of the last digit's unit."""
    return 0.5 * 10.0 ** -len(digits.partition(".")[2])


def over_rectangle(corner: Vec3, ab: Vec3, ac: Vec3, normal: Vec3, order: int) -> tuple[list[Sensor], list[float]]:
    """Sensors and weights whose sum is the mean over a rectangle: Gauss and Legendre's rule, order by order."""
    t, w = np.polynomial.legendre.leggauss(order)
    u, v = np.meshgrid((t + 1) / 2, (t + 1) / 2, indexing="ij")
    places = np.array(corner) + u[..., None] * np.array(ab) + v[..., None] * np.array(ac)
    weights = np.outer(w, w) / 4
    return [Sensor(tuple(p), normal) for p in places.reshape(-1, 3).tolist()], weights.ravel().tolist()


def over_disk(centre: Vec3, radius: float, normal: Vec3, order: int) -> tuple[list[Sensor], list[float]]:
    """The same over a disk about the z axis, on which readings do not depend on the angle."""
    t, w = np.polynomial.legendre.leggauss(order)
    x, y, z = centre
    places = [(x + radius * r, y, z) for r in np.sqrt((t + 1) / 2).tolist()]
    return [Sensor(place, normal) for place in places], (w / 2).tolist()
