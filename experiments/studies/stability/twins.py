"""Whole images, each against a twin that must look the same: scaled, moved, cut up, or known exactly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from nusselt.experiments.scenes.shapes import GREY, SHINY, WHITE, box, lamp, moved, pieces, plate, room, scaled, scene
from nusselt.renderer.estimators import Analytic, ControlVariate, Estimator, VisibilityAnalytic
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material

ROUNDING = 1e-12
"""What rounding may add up to in an image."""
SEEN = 1e-9
"""The same where inputs are rounded in scaling: a light seen at a grazing angle magnifies it."""


@dataclass(frozen=True)
class Twin:
    """Two scenes with one image.

    Parameters
    ----------
    name : str
    one, other : Scene
        The extreme one, and its twin.
    estimator : Estimator
        For both, with the same random numbers.
    bound : float
        Relative difference a pixel may show.
    factor : float
        The extreme image over its twin.
    centre : bool
        The extreme image is its twin's middle pixel.
    ask : bool
        Mitsuba is shown the extreme scene as it is.
    """

    name: str
    one: Scene
    other: Scene
    estimator: Estimator
    bound: float = ROUNDING
    factor: float = 1.0
    centre: bool = False
    ask: bool = False


CV = ControlVariate(samples=9, stratified=True)
FLOOR = plate((-2, 2), (-2, 2), 0)
LAMP = lamp((-0.5, 0.5), (-0.5, 0.5), 2)


def _scales() -> Iterator[Twin]:
    for factor in (1e-30, 1e-6, 1e-3, 1e6, 1e30):
        yield Twin(f"scaled by {factor:g}", scaled(room(), factor), room(), CV, SEEN, ask=True)
    for away in (1e3, 1e6, 1e9):
        far = moved(room(), (away, -away / 2, away / 4))  # exact: a room's coordinates are multiples of 1/16
        yield Twin(f"moved {away:g} from the origin", far, room(), CV, SEEN, ask=True)
    for radiance in (1e-30, 1e30):
        white = radiance * WHITE[0], radiance * WHITE[1], radiance * WHITE[2]
        lights = tuple(replace(light, radiance=white) for light in room().quad_lights)
        yield Twin(f"radiance times {radiance:g}", room().with_(lights=lights), room(), CV, factor=radiance)


def _whole_and_cut() -> Iterator[Twin]:
    for exponent in (0.0, 0.5, 20.0, 1e3, 1e4, 1e6):
        floor = plate((-2, 2), (-2, 2), 0, Material((0.125, 0.125, 0.125), (0.5, 0.5, 0.5), exponent))
        wide = lamp((-1.5, 1.5), (-2.5, 0.5), 2)
        yield Twin(
            f"exponent {exponent:g}, the light whole and in 16 pieces",
            scene(floor, lights=(wide,)),
            scene(floor, lights=pieces(wide, 4)),
            Analytic(),
        )
    standing = QuadLight((-1.0, 0.0, -1.0), (2.0, 0.0, 0.0), (0.0, 1.0, 0.0), WHITE)
    one, other = scene(FLOOR, lights=(standing,)), scene(FLOOR, lights=pieces(standing, 4))
    yield Twin("light touching the floor, whole and in 16 pieces", one, other, Analytic(), ask=True)


def _contacts() -> Iterator[Twin]:
    half = lamp((-0.5, 0.0), (-0.5, 0.5), 2)
    four = VisibilityAnalytic(samples=4)
    for gap in (1e-3, 1e-6, 1e-12):
        shade = plate((0.0, 0.5), (-0.5, 0.5), 2 - gap)
        covered = scene(FLOOR, shade, lights=(LAMP,), camera=LOW)
        bound = ROUNDING if gap < 1e-6 else 10 * gap
        yield Twin(
            f"a plate {gap:g} before half of the light",
            covered,
            scene(FLOOR, lights=(half,), camera=LOW),
            four,
            bound,
            ask=True,
        )
    glued = scene(FLOOR, box((0.0, 1.5, -0.5), (0.5, 2.0, 0.5)), lights=(LAMP,), camera=LOW)
    below = scene(FLOOR, box((0.0, 1.5, -0.5), (0.5, 2.0 - 1e-12, 0.5)), lights=(LAMP,), camera=LOW)
    yield Twin("a block touching the light, and 1e-12 below it", glued, below, four)
    on_top = scene(FLOOR, plate((-0.75, 0.5), (-0.5, 0.75), 1e-12), lights=(LAMP,))
    yield Twin(
        "a plate 1e-12 above the floor, and the floor", on_top, scene(FLOOR, lights=(LAMP,)), CV, 1e-11, ask=True
    )
    yield Twin("coincident triangles", scene(FLOOR, FLOOR, lights=(LAMP,)), scene(FLOOR, lights=(LAMP,)), CV)


def _limits() -> Iterator[Twin]:
    level = QuadLight((3.0, 0.0, -0.5), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), WHITE)
    one = scene(FLOOR, lights=(LAMP, level))
    yield Twin("a light seen edge-on, and none", one, scene(FLOOR, lights=(LAMP,)), CV)
    sky = lamp((-(2.0**30), 2.0**30), (-(2.0**30), 2.0**30), 8, (1.0, 1.0, 1.0))
    glowing = plate((-2, 2), (-2, 2), 0, Material(emission=GREY.diffuse))
    yield Twin("a light that fills the hemisphere", scene(FLOOR, lights=(sky,)), scene(glowing), Analytic())
    black = QuadLight(LAMP.corner, LAMP.ab, LAMP.ac, (0.0, 0.0, 0.0))
    yield Twin("no light, and a black one", scene(FLOOR), scene(FLOOR, lights=(black,)), CV)
    one, other = room().with_(width=1, height=1), room().with_(width=3, height=3)
    yield Twin("one pixel, and the middle one of nine", one, other, Analytic(), centre=True)
    inside = room().camera
    outwards = scene(box((-2, 0, -2), (2, 3, 2), SHINY), lights=(LAMP,), camera=inside, two_sided=True)
    inwards = scene(box((-2, 0, -2), (2, 3, 2), SHINY, inwards=True), lights=(LAMP,), camera=inside)
    yield Twin("camera inside a two-sided box, and in a room", outwards, inwards, CV)
    ball = (Ellipsoid.sphere((0.0, 1.0, 0.0), 8.0, GREY),)
    yield Twin(
        "camera inside a one-sided ball, and no light",
        scene(ellipsoids=ball, lights=(LAMP,)),
        scene(ellipsoids=ball),
        CV,
    )


LOW = Camera((0.25, 1.25, 6.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)
"""Sees the floor and no upper side of what hangs from the light."""


def twins() -> list[Twin]:
    """All of them."""
    return [*_scales(), *_whole_and_cut(), *_contacts(), *_limits()]
