"""Lights cut, exchanged, summed, shut in and half covered."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from nusselt.experiments.metamorphic.relation import Images, Related, Relation, Shot, changed_view, same, seen_within
from nusselt.experiments.scenes.shapes import box, sheet
from nusselt.experiments.search.colours import recoloured
from nusselt.experiments.search.twins import extent
from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight, SunLight, TriangleLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.vectors import Bools, Floats

from .things import twin

BLACK = Material()
DARK = (0.0, 0.0, 0.0)
TIGHT = 0.02
"""Gap between a light and what shuts it in, over the light's size: shadow rays must reach its end."""
BEFORE, COVERED = 0.1, 1.5
"""How far a sheet stands before a light, over the light's size; its sides over the light's."""
FAR, NARROW = 1e3, 1e-4
"""Distance of a far light over the scene's size; its side over that distance."""
NO_QUAD = "no light is a parallelogram"


def _first_quad(scene: Scene) -> QuadLight | None:
    return next(iter(scene.quad_lights), None)


def _off(scene: Scene, lights: range) -> Scene:
    """These lights do not shine."""
    return scene.with_(lights=tuple(v.with_colour(DARK) if k in lights else v for k, v in enumerate(scene.lights)))


def _apart(scene: Scene, rng: np.random.Generator) -> Related | str:
    """Images of the first half of the lights, with what glows, and of the others."""
    count = len(scene.lights)
    if count < 2:
        return "fewer than two lights"
    cut = int(rng.integers(1, count))
    shots = (
        Shot(_off(scene, range(cut, count))),
        Shot(recoloured(_off(scene, range(cut)), emission=lambda rgb: 0 * rgb)),
    )
    return Related(scene, shots, lambda images: (images[1] + images[2], images[0]))


def _triangles(scene: Scene, rng: np.random.Generator) -> Related | str:
    """Two triangles for every parallelogram; their front is where its corners run counter-clockwise."""
    if not scene.quad_lights:
        return NO_QUAD

    def halves(light: Light) -> tuple[Light, ...]:
        quad = light.parallelogram()
        if quad is None:
            return (light,)
        corner, ab, ac = (np.array(v) for v in (quad.corner, quad.ab, quad.ac))
        a, b, c, d = (tuple(p.tolist()) for p in (corner, corner + ac, corner + ab + ac, corner + ab))
        return TriangleLight(a, b, c, quad.radiance), TriangleLight(a, c, d, quad.radiance)

    return same(scene, scene.with_(lights=tuple(itertools.chain(*map(halves, scene.lights)))))


def _box(low: Floats, high: Floats, inwards: bool) -> Mesh:
    return box(tuple(low.tolist()), tuple(high.tolist()), BLACK, inwards=inwards)


def _around(scene: Scene, inwards: bool) -> Iterator[Mesh]:
    """A black box around every light; around all there is, where one is infinitely far."""
    low, high = extent(scene)
    for light in scene.lights:
        ends = low[:, None] + (high - low)[:, None] * [0, 1] if light.at_infinity else light.hull()
        gap = TIGHT * max(np.ptp(ends, axis=1).max(), TIGHT * (high - low).max())
        yield _box(ends.min(axis=1) - gap, ends.max(axis=1) + gap, inwards)


def _added_to_first(images: Images) -> tuple[Floats, Floats]:
    """Differences beside the scene's own brightness, which says how large they are."""
    return images[0] + images[1], images[0] + images[2]


def _shut_in(inwards: bool, scene: Scene, rng: np.random.Generator) -> Related | str:
    if not scene.lights:
        return "no light"
    boxes = list(_around(scene, inwards))
    local = [mesh for mesh, light in zip(boxes, scene.lights, strict=True) if not light.at_infinity]

    def within(p: Floats) -> Bools:
        return _any(
            (p >= mesh.vertices.min(axis=1)[:, None]) & (p <= mesh.vertices.max(axis=1)[:, None]) for mesh in local
        )

    return _dark_but_seen(scene.with_(meshes=(*scene.meshes, *boxes)), within)


def _shut_in_balls(scene: Scene, rng: np.random.Generator) -> Related | str:
    ends = [light.hull() for light in scene.lights if not light.at_infinity]
    if not ends or len(ends) < len(scene.lights):
        return "no light, or one that is infinitely far"
    low, high = extent(scene)
    balls = []
    for hull in ends:
        middle = (hull.min(axis=1) + hull.max(axis=1)) / 2
        reach = np.sqrt(((hull - middle[:, None]) ** 2).sum(axis=0)).max()
        radius = float(reach + TIGHT * max(reach, TIGHT * (high - low).max()))
        balls.append(Ellipsoid.sphere(tuple(middle.tolist()), radius, BLACK))

    def within(p: Floats) -> Bools:
        return _any(
            ((p - np.array(ball.center)[:, None]) ** 2).sum(axis=0, keepdims=True) <= (ball.radius or 0.0) ** 2
            for ball in balls
        )

    return _dark_but_seen(scene.with_(ellipsoids=(*scene.ellipsoids, *balls)), within)


def _any(tests: Iterable[Bools]) -> Bools:
    """Points that pass one of several tests in all of their rows, (n,)."""
    return np.asarray(np.any([test.all(axis=0) for test in tests], axis=0))


def _dark_but_seen(shut: Scene, within: Callable[[Floats], Bools]) -> Related:
    """A scene with its lights, beside the same without; what is shut in with a light may be lit."""
    shots = Shot(shut), Shot(_off(shut, range(len(shut.lights))))
    return Related(shut, shots, _added_to_first, hidden=seen_within(shut, within))


def _sheet(light: QuadLight, start: float, end: float) -> Mesh:
    """Black, before a light, from one share of its first edge to another."""
    corner, ab, ac = (np.array(v) for v in (light.corner, light.ab, light.ac))
    size = max(np.sqrt((v**2).sum()) for v in (ab, ac))
    low = corner + BEFORE * size * np.array(light.normal) - (COVERED - 1) / 2 * (ab + ac)
    corners = [low + COVERED * (u * ab + v * ac) for u, v in ((start, 0), (end, 0), (end, 1), (start, 1))]
    a, b, c, d = (tuple(p.tolist()) for p in corners)
    return sheet(a, b, c, d, BLACK)


def _covered(scene: Scene, rng: np.random.Generator) -> Related | str:
    """What passes one sheet, and what passes the other: as much as passes none and both."""
    light = _first_quad(scene)
    if light is None:
        return NO_QUAD
    cut = float(rng.uniform(0.3, 0.7))
    one, two = _sheet(light, 0, cut), _sheet(light, cut, 1)
    scenes = [scene.with_(meshes=(*scene.meshes, *meshes)) for meshes in ((one,), (two,), (one, two))]
    shots = tuple(map(Shot, scenes))
    hidden = changed_view(scene, scenes[2])
    return Related(scene, shots, lambda x: (x[1] + x[2], x[0] + x[3]), hidden=hidden)


def _dark_light(scene: Scene, rng: np.random.Generator) -> Related | str:
    """A light that does not shine blocks as a sheet does."""
    light = _first_quad(scene)
    if light is None:
        return NO_QUAD
    mesh = _sheet(light, 0.1, 0.6)
    a, b, _, d = mesh.vertices.T
    dark = QuadLight(tuple(a.tolist()), tuple((b - a).tolist()), tuple((d - a).tolist()), DARK)
    blocked = scene.with_(meshes=(*scene.meshes, mesh))
    return Related(
        blocked,
        (Shot(blocked), Shot(scene.with_(lights=(*scene.lights, dark)))),
        lambda images: (images[2], images[1]),
    )


def _far_pair(scene: Scene, light: Light) -> tuple[Light, QuadLight] | None:
    """A light without extent, moved far or narrowed, and a small parallelogram that gives as much; irradiance is 1."""
    low, high = extent(scene)
    middle, far = (low + high) / 2, FAR * float((high - low).max())
    white = (1.0, 1.0, 1.0)
    if isinstance(light, PointLight):
        way = np.subtract(light.position, middle)
    elif isinstance(light, DirectionalLight | SunLight):
        way = np.array(light.direction)
    else:
        return None
    way = way / np.sqrt((way**2).sum())
    place = middle + far * way
    there: Light = DirectionalLight(tuple(way.tolist()), white)
    if isinstance(light, PointLight):
        there = PointLight(tuple(place.tolist()), (far**2,) * 3)
    elif isinstance(light, SunLight):
        there = SunLight(tuple(way.tolist()), white, float(np.degrees(NARROW)))
    across = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
    ab = across / np.sqrt((across**2).sum()) * NARROW * far
    ac = np.cross(way, ab)  # -(ab x ac) is against the way
    corner = place - (ab + ac) / 2
    return there, QuadLight(tuple(corner.tolist()), tuple(ab.tolist()), tuple(ac.tolist()), (NARROW**-2,) * 3)


def _far_off(scene: Scene, rng: np.random.Generator) -> Related | str:
    pairs = [pair for pair in (_far_pair(scene, light) for light in scene.lights) if pair]
    if not pairs:
        return "no point, directional or sun light"
    one, two = (scene.with_(lights=(light,)) for light in pairs[0])
    hidden = changed_view(one, two)
    shots = Shot(one), Shot(two)
    return Related(one, shots, lambda images: (images[1], images[2]), hidden=hidden, bound=0.01)


LAMPS = (
    twin("lights in two", "where a light is sampled, its density, its corners", NO_QUAD),
    twin("lights in four", "where a light is sampled, its density, its corners", NO_QUAD),
    twin("lights from another corner", "an axis of the light sampled otherwise, its normal", NO_QUAD),
    twin("lights in another order", "a light forgotten or treated apart", "fewer than two lights"),
    Relation("lights apart", "images add up", "lights chosen or summed wrongly, curves, ambient light", _apart),
    Relation("lights as triangles", "the same image", "density of a light's kind", _triangles, ("triangle",)),
    Relation("lights shut in", "no light", "shadow rays forgotten or too short", functools.partial(_shut_in, False)),
    Relation(
        "lights shut in inside out",
        "no light",
        "shadow rays that leave out backs",
        functools.partial(_shut_in, True),
    ),
    Relation("lights shut in balls", "no light", "balls forgotten by shadow rays, or too small", _shut_in_balls),
    Relation("light half covered", "halves add up", "visibility that is no sum over rays, thin things", _covered),
    Relation("dark light for a sheet", "the same image", "lights forgotten by shadow rays", _dark_light),
    Relation("far small light", "the same image to 1 %", "units of lights without extent", _far_off, ("quad",)),
)
