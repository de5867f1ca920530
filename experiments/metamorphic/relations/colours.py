"""Brighter, darker, other colours, white: the image is linear in all of them, and what is lit all around vanishes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from nusselt.experiments.metamorphic.relation import Images, Related, Relation, Shot
from nusselt.experiments.scenes.shapes import box, sheet
from nusselt.experiments.search.colours import recoloured
from nusselt.experiments.search.motions import rows, turn
from nusselt.experiments.search.twins import TWINS
from nusselt.renderer.camera.rays import view_frame
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.vectors import Floats, unit

REFLECTED = ("diffuse", "specular")
WHITE = (1.0, 1.0, 1.0)
ROOM = 2.2
"""Half a side of a room of lights, over the camera's distance from what it looks at."""
BODY = 0.35
"""Half a side of what stands in it."""
STRAIGHT = 0.2
"""Degrees of a camera that sees a mirror's lobe head on: at 0.2 what it loses at the horizon is below 1e-4."""


def _other_lobes(scene: Scene) -> bool:
    return any(material.further for material in scene.materials)


def _brighter(scene: Scene, rng: np.random.Generator) -> Related:
    copy = next(twin for twin in TWINS if twin.name == "twice as bright").make(scene, rng)
    if copy is None:
        raise ValueError("every scene can be brighter")
    return Related(scene, (Shot(copy.scene),), lambda images: (images[1], copy.factor * images[0]))


def _dark(scene: Scene, rng: np.random.Generator) -> Related:
    dark = recoloured(scene, lights=lambda rgb: 0 * rgb, emission=lambda rgb: 0 * rgb)
    return Related(scene, (Shot(dark),), lambda images: (images[0] + images[1], images[0]))


def _permuted(scene: Scene, rng: np.random.Generator) -> Related | str:
    if _other_lobes(scene):
        return "lobes whose colours are not known"
    order = np.roll(np.arange(3), int(rng.integers(1, 3)))

    def change(rgb: Floats) -> Floats:
        return np.asarray(rgb[order])

    other = recoloured(scene, change, change, **dict.fromkeys(REFLECTED, change))
    return Related(scene, (Shot(other),), lambda images: (images[1], images[0][order]))


def _reflecting(scene: Scene, **shares: float) -> Scene:
    """A share of each lobe's colour."""

    def times(share: float) -> Callable[[Floats], Floats]:
        return lambda rgb: share * rgb

    return recoloured(scene, **{name: times(share) for name, share in shares.items()})


def _greyer(scene: Scene, rng: np.random.Generator) -> Related | str:
    """Half of what is reflected, twice: as much as all of it and nothing."""
    if _other_lobes(scene):
        return "lobes whose colours are not known"
    shots = (
        Shot(_reflecting(scene, diffuse=0.5, specular=0.5)),
        Shot(_reflecting(scene, diffuse=0.0, specular=0.0)),
    )
    return Related(scene, shots, lambda images: (2 * images[1], images[0] + images[2]))


def _lobes_apart(scene: Scene, rng: np.random.Generator) -> Related | str:
    if _other_lobes(scene) or not scene.is_glossy:
        return "no surface with two known lobes"
    shares = ({"specular": 0.0}, {"diffuse": 0.0}, {"diffuse": 0.0, "specular": 0.0})
    shots = tuple(Shot(_reflecting(scene, **some)) for some in shares)
    return Related(scene, shots, lambda images: (images[1] + images[2], images[0] + images[3]))


def _lit_all_around(middle: Floats, half: float) -> tuple[QuadLight, ...]:
    """Six squares of radiance 1 about a cube, shining inwards."""
    lights = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            inwards, one, two = np.roll(np.eye(3), axis, axis=0) * np.array([[-sign], [2 * half], [2 * half]])
            # -(ab x ac) is the side that shines.
            ab, ac = (one, two) if np.dot(np.cross(one, two), inwards) < 0 else (two, one)
            corner = middle - half * inwards - (ab + ac) / 2
            lights.append(QuadLight(tuple(corner.tolist()), tuple(ab.tolist()), tuple(ac.tolist()), WHITE))
    return tuple(lights)


def _vanishing(scene: Scene, camera: Camera, *bodies: Mesh | Ellipsoid) -> Related:
    """A scene of these alone, in a room of lights: each is as bright as the lights behind it."""
    eye, at = np.array(camera.position), np.array(camera.target)
    room = scene.with_(
        camera=camera,
        meshes=tuple(body for body in bodies if isinstance(body, Mesh)),
        ellipsoids=tuple(body for body in bodies if isinstance(body, Ellipsoid)),
        lights=_lit_all_around(at, ROOM * float(np.sqrt(((eye - at) ** 2).sum()))),
    )

    def sides(images: Images) -> tuple[Floats, Floats]:
        return images[1], np.ones_like(images[1])

    return Related(room, (Shot(room),), sides)


def _size(scene: Scene) -> tuple[Floats, float]:
    """What the camera looks at, and the size of what fills its image there."""
    ahead = np.subtract(scene.camera.target, scene.camera.position)
    half = np.tan(np.radians(scene.camera.fov_y) / 2) * min(1.0, scene.width / scene.height)
    return np.array(scene.camera.target), float(np.sqrt((ahead**2).sum()) * min(half, 1.0))


def _white_box(scene: Scene, rng: np.random.Generator) -> Related:
    middle, size = _size(scene)
    cube = box((-BODY * size,) * 3, (BODY * size,) * 3, Material(WHITE))
    turned = Mesh(turn(rng).points(cube.vertices) + middle[:, None], cube.triangles, cube.material)
    return _vanishing(scene, scene.camera, turned)


def _white_ball(scene: Scene, rng: np.random.Generator) -> Related | str:
    if not scene.ellipsoids:
        return "no ball or ellipsoid"
    middle, size = _size(scene)
    axes = turn(rng).matrix @ np.diag(rng.uniform(0.6, 1.6, 3)) * BODY * size
    ellipsoid = Ellipsoid(tuple(middle.tolist()), rows(axes), Material(WHITE))
    return _vanishing(scene, scene.camera, ellipsoid)


def _white_lobe(scene: Scene, rng: np.random.Generator) -> Related | str:
    """Seen head on the lobe's norm is 1: (s + 2) / (2 pi) times the integral of cos^(s + 1)."""
    if not scene.is_glossy:
        return "no glossy surface"
    shininess = max(material.shininess for material in scene.materials if max(material.specular) > 0)
    camera = replace(scene.camera, fov_y=STRAIGHT)
    at = np.array(camera.target)
    _, right, up = (unit(axis)[:, 0] for axis in view_frame(scene))
    half = math.dist(camera.target, camera.position) * BODY
    corners = [at + half * (x * right + y * up) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    a, b, c, d = (tuple(p.tolist()) for p in corners)
    return _vanishing(scene, camera, sheet(a, b, c, d, Material((0.0, 0.0, 0.0), WHITE, shininess)))


COLOURS = (
    Relation("twice as bright", "the image twice", "curves, clamps, ambient light, 8 bits", _brighter),
    Relation("all dark", "a black image", "ambient light, light that nobody sends", _dark),
    Relation("colours permuted", "channels permuted", "channels exchanged or averaged, white balance", _permuted),
    Relation("half as reflecting", "half of what is reflected", "albedo twice, curves, indirect light", _greyer),
    Relation("lobes apart", "images add up", "lobes that share, clamp or replace each other", _lobes_apart),
    Relation("white box lit all around", "it vanishes", "cosines, pi, falloff, a light's area, a gain", _white_box),
    Relation("white ball lit all around", "it vanishes", "normals of balls, cosines, pi, a gain", _white_ball),
    Relation("white lobe lit all around", "it vanishes", "the lobe's norm, a cosine, its direction", _white_lobe),
)
