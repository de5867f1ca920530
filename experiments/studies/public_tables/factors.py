"""Configuration factors of the heat-transfer catalogues: the share of one face's radiation that reaches another.

Formulas as in Howell's catalogue of radiation configuration factors (its numbers are given) and Hamilton and Morgan
1952. A light of radiance 1/pi gives a face an irradiance equal to its factor to the light.
"""

from __future__ import annotations

import math

from nusselt.renderer.lights import DiskLight, SphereLight
from nusselt.renderer.sensor import Sensor
from nusselt.renderer.surfaces import Ellipsoid, Material

from .entry import Entry, PublicTable, over_disk, over_rectangle, rectangle, scene_of

SOURCE = "catalogues of configuration factors"
ONE = 1 / math.pi
UP, DOWN, ALONG = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)
EVALUATED = 1e-9
"""How well a formula is evaluated here."""


def corner_parallel(x: float, y: float) -> float:
    """From a point to a parallel rectangle x by y, in units of its distance, with a corner above it (B-3)."""
    a, b = math.sqrt(1 + x * x), math.sqrt(1 + y * y)
    return (x / a * math.atan(y / a) + y / b * math.atan(x / b)) / (2 * math.pi)


def corner_upright(x: float, y: float) -> float:
    """From a point to a rectangle in an upright plane: x wide, y high, in units of its distance (B-4)."""
    a = math.sqrt(1 + y * y)
    return (math.atan(x) - math.atan(x / a) / a) / (2 * math.pi)


def parallel_rectangles(x: float, y: float) -> float:
    """Between equal, opposite ones x by y, in units of their distance (C-11)."""
    a, b = 1 + x * x, 1 + y * y
    return (
        2
        / (math.pi * x * y)
        * (
            math.log(math.sqrt(a * b / (a + y * y)))
            + x * math.sqrt(b) * math.atan(x / math.sqrt(b))
            + y * math.sqrt(a) * math.atan(y / math.sqrt(a))
            - x * math.atan(x)
            - y * math.atan(y)
        )
    )


def coaxial_disks(r1: float, r2: float) -> float:
    """From a disk of radius r1 to a parallel one of radius r2, in units of their distance (C-41)."""
    x = 1 + (1 + r2 * r2) / (r1 * r1)
    return (x - math.sqrt(x * x - 4 * (r2 / r1) ** 2)) / 2


def _points() -> PublicTable:
    """From points beneath and beside a rectangle of 3 by 2."""
    lamp = rectangle((0.0, 0.0, 1.0), (0.0, 2.0, 0.0), (3.0, 0.0, 0.0), ONE)
    upright = Sensor((0.0, 0.0, 0.0), ALONG)
    # Seen from a wall that stands under its edge x = 0: a strip from the horizon on, 3 high over 2 wide.
    entries = (
        Entry("B-3, parallel, 3 x 2 at 1", (Sensor((0.0, 0.0, 0.0), UP),), (1.0,), corner_parallel(3, 2), EVALUATED),
        Entry("B-4, upright, 3 x 2 at 1", (upright,), (1.0,), corner_upright(2, 3), EVALUATED),
    )
    return PublicTable("point to rectangle", SOURCE, "factor", scene_of("factors-b", lamp), entries)


def _disk_to_point() -> PublicTable:
    lamp = DiskLight((0.0, 0.0, 2.0), DOWN, 1.0, (ONE,) * 3)
    on_axis = Entry("B-12, on its axis", (Sensor((0.0, 0.0, 0.0), UP),), (1.0,), 1 / 5, EVALUATED)
    sensors, weights = over_disk((0.0, 0.0, 0.0), 1.5, UP, 24)
    disks = Entry("C-41, disk of 1.5 to disk of 1 at 2", tuple(sensors), tuple(weights), coaxial_disks(0.75, 0.5), 1e-9)
    return PublicTable("to a disk", SOURCE, "factor", scene_of("factors-disk", lamp), (on_axis, disks))


def _to_sphere() -> PublicTable:
    """From points whose horizon does not cut it: (r/d)^2 times the cosine towards its centre."""
    ball = SphereLight((0.0, 0.0, 2.0), 0.5, (ONE,) * 3)
    tilt = math.radians(40)
    tilted = Sensor((0.0, 0.0, 0.0), (math.sin(tilt), 0.0, math.cos(tilt)))
    entries = (
        Entry("facing, radius 0.5 at 2", (Sensor((0.0, 0.0, 0.0), UP),), (1.0,), 1 / 16, EVALUATED),
        Entry("tilted by 40 degrees", (tilted,), (1.0,), math.cos(tilt) / 16, EVALUATED),
    )
    return PublicTable("point to sphere", SOURCE, "factor", scene_of("factors-sphere", ball), entries)


def _rectangles() -> PublicTable:
    lamp = rectangle((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), ONE)
    sensors, weights = over_rectangle((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), UP, 16)
    cube = Entry("C-11, unit squares at 1", tuple(sensors), tuple(weights), parallel_rectangles(1.0, 1.0), EVALUATED)
    printed = Entry("the same as printed, 0.1998", cube.sensors, cube.weights, 0.1998, 5e-5)
    return PublicTable("parallel squares", SOURCE, "factor", scene_of("factors-c11", lamp), (cube, printed))


def _shadowed() -> PublicTable:
    """A ball on the axis of a square hides the cone that it fills: its sine squared is taken off."""
    lamp = rectangle((-2.0, -2.0, 3.0), (0.0, 4.0, 0.0), (4.0, 0.0, 0.0), ONE)
    ball = Ellipsoid.sphere((0.0, 0.0, 1.5), 0.5, Material(diffuse=(0.0, 0.0, 0.0)))
    bare = 4 * corner_parallel(2 / 3, 2 / 3)
    entry = Entry("point, ball, square", (Sensor((0.0, 0.0, 0.0), UP),), (1.0,), bare - (0.5 / 1.5) ** 2, EVALUATED)
    scene = scene_of("factors-shadow", lamp, ellipsoids=(ball,))
    return PublicTable("shadowed by a ball", SOURCE, "factor", scene, (entry,))


def tables() -> tuple[PublicTable, ...]:
    """In the catalogue's order; the shadowed one last."""
    return _points(), _disk_to_point(), _to_sphere(), _rectangles(), _shadowed()
