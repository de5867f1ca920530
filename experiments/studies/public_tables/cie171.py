"""CIE 171:2006, test cases to assess the accuracy of lighting computer programs: the analytic ones of direct light.

The numbers are the publication's, as reproduced by those who ran it (Dau, "Validation of NVIDIA Iray against CIE
171:2006", 2016, for 5.7 with its erratum). Lengths in metres.
"""

from __future__ import annotations

import math

from nusselt.experiments.scenes.shapes import box
from nusselt.renderer.lights import CosineLight
from nusselt.renderer.surfaces import Material
from nusselt.renderer.validation import Vec3

from .entry import Entry, PublicTable, over_rectangle, points, rectangle, scene_of

SOURCE = "CIE 171:2006"
HEIGHTS = (0.25, 0.75, 1.25, 1.75, 2.25, 2.75)
DOWN, INWARDS = (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)
UP = (0.0, 0.0, 1.0)


def _wall(*heights: float) -> list[Vec3]:
    return [(2.0, 0.0, z) for z in heights]


def _level(z: float, *depths: float) -> list[Vec3]:
    return [(2.0, y, z) for y in depths]


CEILING_LAMP = rectangle((1.5, 1.5, 3.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), 1000.0)
"""1 m by 1 m, 1000 cd downwards."""


def _point_source() -> PublicTable:
    """A diffuse point source of 1000 cd, 3 m over the floor."""
    lamp = CosineLight((0.0, 0.0, 3.0), DOWN, (1000.0, 1000.0, 1000.0))
    places = ((0, 0), (0.5, 0), (1, 0), (1.5, 0), (0.5, 0.5), (1, 0.5), (1.5, 0.5), (1, 1), (1.5, 1), (1.5, 1.5))
    printed = "111.11 105.21 90.02 71.11 99.73 85.64 68.06 74.36 59.98 49.39"
    floor = points("A B C D E F G H I J", [(float(x), float(y), 0.0) for x, y in places], UP, printed)
    note = "the printed values are off by up to 0.03 %"
    return PublicTable(
        "5.2 point source", SOURCE, "lx", scene_of("cie-5.2", lamp), tuple(floor), is_right=False, note=note
    )


def _area_source() -> PublicTable:
    wall = points("A B C D E F", _wall(*HEIGHTS[::-1]), INWARDS, "32.68 75.09 81.38 69.12 53.41 39.90")
    floor = points("G H I J", _level(0.0, 0.25, 0.75, 1.25, 1.75), UP, "61.27 79.18 95.52 105.89")
    note = "the printed values are off by up to 0.26 %, of both signs: no midpoint rule gives them either"
    return PublicTable(
        "5.3 area light", SOURCE, "lx", scene_of("cie-5.3", CEILING_LAMP), (*wall, *floor), is_right=False, note=note
    )


def _flux() -> PublicTable:
    """What falls on walls and floor of the same room is what the lamp gives: pi 1000 cd."""
    sides = {
        "wall y=0": ((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 3.0), (0.0, 1.0, 0.0)),
        "wall y=4": ((0.0, 4.0, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 3.0), (0.0, -1.0, 0.0)),
        "wall x=0": ((0.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 3.0), (1.0, 0.0, 0.0)),
        "wall x=4": ((4.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 3.0), (-1.0, 0.0, 0.0)),
        "floor": ((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0), UP),
    }
    sensors, weights = [], []
    for corner, ab, ac, normal in sides.values():
        found, shares = over_rectangle(corner, ab, ac, normal, 16)
        area = math.hypot(*ab) * math.hypot(*ac)
        sensors += found
        weights += [share * area for share in shares]
    whole = Entry("walls and floor", tuple(sensors), tuple(weights), 1000 * math.pi, 1e-3)
    return PublicTable("5.4 flux conservation", SOURCE, "lm", scene_of("cie-5.4", CEILING_LAMP), (whole,))


def _lit_floor() -> PublicTable:
    lit = rectangle((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 4.0, 0.0), 1 / math.pi)
    wall = points("B C D E F", _wall(*HEIGHTS[1:]), INWARDS, "35.901 27.992 21.639 16.716 12.967", 100.0)
    ceiling = points("G H I J", _level(3.0, 0.25, 0.75, 1.25, 1.75), DOWN, "26.80 30.94 33.98 35.57", 100.0)
    return PublicTable("5.6 lit floor", SOURCE, "% of E rho", scene_of("cie-5.6", lit), (*wall, *ceiling))


def _behind_a_box() -> PublicTable:
    lit = rectangle((0.0, 4.0, 0.0), (4.0, 0.0, 0.0), (0.0, 0.0, 3.0), 1 / math.pi)
    black = Material(diffuse=(0.0, 0.0, 0.0))
    wall = points("A B C D E F", _wall(*HEIGHTS[::-1]), INWARDS, "16.07 16.33 15.40 13.32 10.32 7.08", 100.0)
    depths = (0.25, 0.75, 1.25, 1.75, 2.25)
    floor = points("G H I J K", _level(0.0, *depths), UP, "3.38 3.63 3.01 0 0", 100.0)
    scene = scene_of("cie-5.7", lit, meshes=(box((0.0, 2.5, 0.0), (4.0, 2.7, 1.0), black),))
    note = "the corrected values: Table 19 of the publication is wrong"
    return PublicTable("5.7 lit wall behind a box", SOURCE, "% of E rho", scene, (*wall, *floor), note=note)


def tables() -> tuple[PublicTable, ...]:
    """Those in reach, in order."""
    return _point_source(), _area_source(), _flux(), _lit_floor(), _behind_a_box()
