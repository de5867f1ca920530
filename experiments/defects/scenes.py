"""The scenes that show the defects: small, so that a reference takes a second or two."""

from __future__ import annotations

from nusselt.experiments.scenes import shapes
from nusselt.experiments.scenes.shapes import plate
from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

SIZE = (64, 48)
GREY = Material((0.5, 0.5, 0.5))
COLOURED = Material((0.7, 0.4, 0.2))
GLOSSY = Material((0.2, 0.2, 0.2), (0.6, 0.6, 0.6), 5.0)
ABOVE = Camera((0.3, 3.0, 5.0), (0.0, 0.3, 0.0), (0.0, 1.0, 0.0), 42.0)


def floor(half: float = 2.5, material: Material = GREY) -> Mesh:
    """A square that faces up."""
    return plate((-half, half), (-half, half), 0.0, material)


def lamp(y: float = 2.0, half: float = 0.5, radiance: tuple[float, float, float] = (5.0, 5.0, 5.0)) -> QuadLight:
    """A square light that shines down."""
    return shapes.lamp((-half, half), (-half, half), y, radiance)


def _scene(
    name: str,
    *meshes: Mesh,
    lights: tuple[Light, ...] = (),
    ellipsoids: tuple[Ellipsoid, ...] = (),
    camera: Camera = ABOVE,
) -> Scene:
    return Scene(*SIZE, camera, meshes, ellipsoids, lights, name=name)


def open_floor() -> Scene:
    """Nothing in the way."""
    return _scene("open floor", floor(), lights=(lamp(),))


def penumbra() -> Scene:
    """A sphere and a slanted sheet under the lamp; the light in view."""
    sheet = shapes.sheet((-1.6, 0.5, 0.4), (-0.5, 0.6, 0.5), (-0.6, 0.7, -0.6), (-1.5, 0.6, -0.7), GREY)
    ball = Ellipsoid.sphere((0.7, 0.45, 0.2), 0.4, GREY)
    return _scene("penumbra", floor(), sheet, lights=(lamp(1.7),), ellipsoids=(ball,))


def behind_the_light() -> Scene:
    """A wall on either side of a light that stands upright."""
    light = QuadLight((0.0, 0.7, -0.5), (0, 0, 1.0), (0, 0.8, 0), (5.0, 5.0, 5.0))
    left = shapes.sheet((-1.5, 0, 1.5), (-1.5, 0, -1.5), (-1.5, 2, -1.5), (-1.5, 2, 1.5), GREY)
    right = shapes.sheet((1.5, 0, -1.5), (1.5, 0, 1.5), (1.5, 2, 1.5), (1.5, 2, -1.5), GREY)
    return _scene("walls", floor(), left, right, lights=(light,))


def near_ceiling() -> Scene:
    """A light 0.001 below a ceiling, as in the Cornell box."""
    ceiling = plate((-1.5, 1.5), (1.5, -1.5), 2.0, GREY)
    low = Camera((0.2, 0.8, 4.0), (0.0, 0.7, 0.0), (0.0, 1.0, 0.0), 42.0)
    return _scene("near ceiling", floor(), ceiling, lights=(lamp(1.999, 0.3),), camera=low)


def near_blocker() -> Scene:
    """A sheet 0.01 below a light."""
    sheet = shapes.sheet((-0.4, 1.99, 0.5), (0.1, 1.99, 0.5), (0.1, 1.99, -0.5), (-0.4, 1.99, -0.5), GREY)
    return _scene("near blocker", floor(), sheet, lights=(lamp(),))


def lobes() -> Scene:
    """A glossy floor and ball with an odd exponent, lit from the side: mirror directions that face away."""
    side = QuadLight((-2.0, 0.4, -0.6), (0, 0, 1.2), (0, 1.0, 0.3), (6.0, 6.0, 6.0))
    ball = Ellipsoid.sphere((0.4, 0.6, 0.0), 0.6, GLOSSY)
    return _scene("lobes", floor(material=GLOSSY), lights=(side,), ellipsoids=(ball,))


def colours() -> Scene:
    """A coloured floor; the light out of view."""
    down = Camera((0.0, 3.0, 0.6), (0.0, 0.0, -0.1), (0.0, 1.0, 0.0), 40.0)
    return _scene("colours", floor(material=COLOURED), lights=(lamp(4.0, 0.7, (6.0, 5.0, 3.0)),), camera=down)


def three_lights() -> Scene:
    """Three lamps, seen from below."""
    lights = tuple(
        QuadLight((x - 0.25, 1.6, -0.25), (0, 0, 0.5), (0.5, 0, 0), c)
        for x, c in ((-1.2, (6.0, 6.0, 6.0)), (0.0, (1.0, 1.0, 4.0)), (1.2, (4.0, 1.0, 1.0)))
    )
    low = Camera((0.3, 1.0, 5.0), (0.0, 0.8, 0.0), (0.0, 1.0, 0.0), 42.0)
    ball = Ellipsoid.sphere((0.0, 0.4, 0.3), 0.4, GREY)
    return _scene("three lights", floor(), lights=lights, ellipsoids=(ball,), camera=low)


def sheared() -> Scene:
    """A light that is a slanting parallelogram."""
    return _scene(
        "sheared light", floor(), lights=(QuadLight((-0.9, 1.2, -0.4), (0.1, 0, 0.8), (1.2, 0, 0.7), (5.0,) * 3),)
    )


def small_lamps() -> Scene:
    """A point light and a sun from one side."""
    lights = (PointLight((0.8, 1.4, 0.5), (3.0, 3.0, 3.0)), DirectionalLight((0.2, 1.0, 0.3), (0.2, 0.2, 0.2)))
    return _scene("point light", floor(), lights=lights)


def umbra() -> Scene:
    """The middle of a ball's shadow under a wide sun."""
    down = Camera((0.0, 0.9, 2.4), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 9.0)
    ball = Ellipsoid.sphere((0.0, 2.2, 0.0), 0.24, GREY)
    return _scene(
        "umbra", floor(1.0), lights=(SunLight((0.0, 1.0, 0.0), (2.0,) * 3, 12.0),), ellipsoids=(ball,), camera=down
    )


def turned_ellipsoid() -> Scene:
    """An ellipsoid whose axes are neither symmetric nor orthogonal."""
    ball = Ellipsoid((0.0, 0.7, 0.0), ((0.7, 0.45, 0.0), (0.0, 0.4, 0.2), (0.1, 0.0, 0.5)), GREY)
    return _scene("turned ellipsoid", floor(), lights=(lamp(2.5),), ellipsoids=(ball,))
