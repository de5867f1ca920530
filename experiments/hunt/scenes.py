"""Random scenes of what a renderer can do; and what a scene holds, of which each kind can be taken out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from nusselt.experiments.check.question import PixelRule, with_pixel_rule
from nusselt.experiments.search.colours import recoloured
from nusselt.experiments.search.examine import stream
from nusselt.experiments.search.generator import KINDS, random_scene
from nusselt.experiments.search.motions import Motion, carried
from nusselt.experiments.search.twins import extent
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight
from nusselt.renderer.pixels import render_area
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.vectors import cross, dot, unit

NEAR = ("as made", "turned")
APART = 0.03
"""Standard deviation of a thing's step, where things are a few units large: no planes are left in common."""
LIT = 0.1
"""Share of the pixels, at least, on which light falls."""
DARK = 1000
"""Scenes in a row without one to show."""
THINNER, WIDER = 1e-3, 3.0
"""Times the size of all else: a side of a thin light at most, of a vast one at least."""
SAME_PLANE = 1e-9
"""In unit normals, and in scene units, of things a few units large."""
THIN = ("sheets", "mixed")
"""Kinds with boxes of no thickness in single precision."""
TIES, FAR = "ties", "far"
EXTREMES = (TIES, FAR)
"""Of scenes, only where they are asked for: planes in common and sheets of no thickness; tiny, huge and far ones."""


@dataclass(frozen=True)
class Ingredient:
    """What a scene may hold: whether one does, and the scene without it."""

    name: str
    there: Callable[[Scene], bool]
    without: Callable[[Scene], Scene]


def _lights(name: str, kind: type) -> Ingredient:
    return Ingredient(
        name,
        lambda scene: any(isinstance(light, kind) for light in scene.lights),
        lambda scene: scene.with_(lights=tuple(light for light in scene.lights if not isinstance(light, kind))),
    )


def _bodies(name: str, round_: bool) -> Ingredient:
    return Ingredient(
        name,
        lambda scene: any((one.radius is not None) == round_ for one in scene.ellipsoids),
        lambda scene: scene.with_(ellipsoids=tuple(e for e in scene.ellipsoids if (e.radius is not None) != round_)),
    )


def _sized(name: str, is_so: Callable[[float, float, float], bool]) -> Ingredient:
    """Parallelogram lights of a shortest and a longest side, beside the size of all else."""

    def there(scene: Scene, light: object) -> bool:
        if not isinstance(light, QuadLight):
            return False
        sides = [float(np.linalg.norm(side)) for side in (light.ab, light.ac)]
        low, high = extent(scene.with_(lights=()))
        return is_so(min(sides), max(sides), float((high - low).max()))

    return Ingredient(
        name,
        lambda scene: any(there(scene, light) for light in scene.lights),
        lambda scene: scene.with_(lights=tuple(light for light in scene.lights if not there(scene, light))),
    )


def _first_alone(scene: Scene) -> Scene:
    meshes = scene.meshes[:1]
    return scene.with_(meshes=meshes, ellipsoids=() if meshes else scene.ellipsoids[:1])


INGREDIENTS: tuple[Ingredient, ...] = (
    _lights("point", PointLight),
    _lights("directional", DirectionalLight),
    _sized("thin light", lambda short, long, size: short < THINNER * size),
    _sized("vast light", lambda short, long, size: long > WIDER * size),
    _bodies("ellipsoid", False),
    _bodies("sphere", True),
    Ingredient(
        "glossy",
        lambda scene: any(material.is_glossy for material in scene.materials),
        lambda scene: recoloured(scene, specular=lambda rgb: 0 * rgb),
    ),
    Ingredient(
        "several lights", lambda scene: len(scene.lights) > 1, lambda scene: scene.with_(lights=scene.lights[:1])
    ),
    Ingredient("several things", lambda scene: len(scene.meshes) + len(scene.ellipsoids) > 1, _first_alone),
    _lights("quad", QuadLight),
    Ingredient("triangle", lambda scene: bool(scene.meshes), lambda scene: scene.with_(meshes=())),
)
"""The rarest first: what can be missed without missing the others."""
NAMES = tuple(one.name for one in INGREDIENTS)


def held(scene: Scene) -> tuple[str, ...]:
    """What a scene holds, by name."""
    return tuple(one.name for one in INGREDIENTS if one.there(scene))


def without(scene: Scene, name: str) -> Scene | None:
    """A scene without one of `NAMES`; None where it has none, or nothing else to see by it."""
    one = next(one for one in INGREDIENTS if one.name == name)
    less = one.without(scene) if one.there(scene) else scene
    return less if less is not scene and less.lights and (less.meshes or less.ellipsoids) else None


def drawn(
    seed: int,
    shape: tuple[int, int],
    samples: int,
    cannot: Sequence[str],
    also: Sequence[str],
    two_sided: bool = False,
    rule: PixelRule = "centre",
) -> Iterator[Scene]:
    """Scenes without end, the same ones for the same arguments; dark ones, by four samples of ours, are left out.

    Of pixels that are areas, so are those that see a light: a thin one is met by few rays, and outshines all else.

    Parameters
    ----------
    shape : (int, int)
        Width and height in pixels.
    samples : int
        Per light.
    cannot, also : sequence of str
        Of `NAMES` and of `EXTREMES`.
    two_sided : bool
        Whether surfaces reflect on their backs.
    rule : {"centre", "area"}
        What a pixel shows.
    """
    kinds, last = [kind for kind in KINDS if TIES in also or kind not in THIN], 0
    for number in count():
        if number - last > DARK:
            raise InputError("cannot", ", ".join(cannot), "what leaves scenes in which light falls on something")
        made = random_scene(kinds[number % len(kinds)], number // len(kinds), seed)
        if FAR not in also and (made.kind == "far" or made.placed not in NEAR):
            continue
        size = {"width": shape[0], "height": shape[1], "light_samples": samples, "stratify": True}
        scene = with_pixel_rule(made.scene.with_(**size, two_sided=two_sided), rule)
        for one in INGREDIENTS:
            scene = one.without(scene) if one.name in cannot else scene
        if TIES not in also:
            scene = _apart(_turned_one_way(scene), stream(seed, made.scene.name))
        if _shows_light(scene) and not (rule == "area" and _sees_a_light(scene)):
            last = number
            yield scene


def _turned_one_way(scene: Scene) -> Scene:
    """Without a mesh's triangles that lie in an earlier one's plane and face the other way: which is seen is a tie."""

    def kept(mesh: Mesh) -> Mesh:
        a, b, c = mesh.corners
        n = unit(cross(b - a, c - a))
        planes = np.vstack((n, dot(n, a)))
        facing = np.abs(planes[:, :, None] + planes[:, None, :]).max(axis=0) < SAME_PLANE
        left = ~np.triu(facing, 1).any(axis=0)
        return mesh if left.all() else replace(mesh, triangles=mesh.triangles[:, left])

    return scene.with_(meshes=tuple(map(kept, scene.meshes)))


def _apart(scene: Scene, rng: np.random.Generator) -> Scene:
    """Every thing a step away from where it was, as far as its place is from the others' in size."""

    def moved(name: str) -> tuple[object, ...]:
        things = []
        for thing in getattr(scene, name):
            alone = scene.with_(**{"lights": (), "meshes": (), "ellipsoids": (), name: (thing,)})
            things.append(getattr(carried(alone, Motion.step(APART * rng.normal(size=3))), name)[0])
        return tuple(things)

    return scene.with_(**{name: moved(name) for name in ("lights", "meshes", "ellipsoids")})


def _shows_light(scene: Scene) -> bool:
    image = render(scene, Area(samples=4))
    return bool((image.shaded & (image.mean > 0).any(axis=0)).mean() >= LIT)


def _sees_a_light(scene: Scene) -> bool:
    return bool(render_area(scene, Analytic(), tolerance=0.5).image.emitter.any())
