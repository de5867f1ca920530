"""The scene elsewhere, or the camera turned, near, or finer: the image follows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nusselt.experiments.metamorphic.relation import Images, Related, Relation, Shot, same
from nusselt.experiments.search.motions import Motion, carried, turn
from nusselt.experiments.search.twins import extent
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.vectors import Floats

LARGER = 8.0
"""Times the size: an epsilon in scene units shows, float32 does not."""
NEARER = 3
"""Times the size of the image's middle, odd: centres of pixels fall on centres."""


def _turned(scene: Scene, rng: np.random.Generator) -> Related:
    return same(scene, carried(scene, turn(rng)))


def _larger(scene: Scene, rng: np.random.Generator) -> Related:
    return same(scene, carried(scene, Motion.scaling(LARGER)))


def _smaller(scene: Scene, rng: np.random.Generator) -> Related:
    return same(scene, carried(scene, Motion.scaling(1 / LARGER)))


def _moved(scene: Scene, rng: np.random.Generator) -> Related:
    low, high = extent(scene)
    return same(scene, carried(scene, Motion.step((high - low).max() * rng.choice([-1.0, 1.0], 3))))


def _mirrored(scene: Scene, rng: np.random.Generator) -> Related:
    signs = np.ones(3)
    signs[int(rng.integers(3))] = -1
    shot = Shot(carried(scene, Motion(np.diag(signs), np.zeros(3))))
    return Related(scene, (shot,), lambda images: (images[1][..., ::-1], images[0]))


def _camera(scene: Scene, fov_scale: float, up: Floats | None = None) -> Camera:
    """The same place and direction; the tangent of half the angle times a factor."""
    half = math.tan(math.radians(scene.camera.fov_y) / 2) * fov_scale
    upwards = scene.camera.up if up is None else tuple(up.tolist())
    return replace(scene.camera, fov_y=2 * math.degrees(math.atan(half)), up=upwards)


def _rolled(scene: Scene, rng: np.random.Generator) -> Related:
    """Up is now what was right: rows are columns from the right."""
    ahead = np.subtract(scene.camera.target, scene.camera.position)
    camera = _camera(scene, scene.width / scene.height, np.cross(ahead, scene.camera.up))
    shot = Shot(scene.with_(camera=camera, width=scene.height, height=scene.width))
    return Related(scene, (shot,), lambda images: (images[1][:, ::-1].swapaxes(1, 2), images[0]))


def _inner(side: int) -> tuple[slice, slice]:
    """Pixels that are seen again `NEARER` times larger, and where."""
    first, last = -(-(side - 1) // NEARER), (2 * side - 2) // NEARER
    start = NEARER * first + 1 - side
    return slice(first, last + 1), slice(start, start + NEARER * (last - first) + 1, NEARER)


def _nearer(scene: Scene, rng: np.random.Generator) -> Related | str:
    if scene.spp > 1:
        return "pixels are areas"
    (rows, far_rows), (columns, far_columns) = _inner(scene.height), _inner(scene.width)

    def sides(images: Images) -> tuple[Floats, Floats]:
        return images[1][:, far_rows, far_columns], images[0][:, rows, columns]

    shot = Shot(scene.with_(camera=_camera(scene, 1 / NEARER)))
    return Related(scene, (shot,), sides, place=lambda image: image[..., rows, columns])


def _finer(scene: Scene, rng: np.random.Generator) -> Related:
    """Of centres every third is there; of areas the mean of 2 x 2 is."""
    times = NEARER if scene.spp == 1 else 2
    shot = Shot(scene.with_(width=times * scene.width, height=times * scene.height))

    def sides(images: Images) -> tuple[Floats, Floats]:
        if scene.spp == 1:
            return images[1][:, 1::NEARER, 1::NEARER], images[0]
        return images[1].reshape(3, scene.height, 2, scene.width, 2).mean(axis=(2, 4)), images[0]

    return Related(scene, (shot,), sides)


PLACES = (
    Relation("turned", "the same image", "rotations, a fixed axis, normals in the wrong space", _turned),
    Relation("mirrored", "the image mirrored", "handedness, which side is the front, columns shifted", _mirrored),
    Relation("8 times as large", "the same image", "an epsilon in scene units, falloff, a light's area", _larger),
    Relation("an 8th as large", "the same image", "an epsilon in scene units, falloff, a light's area", _smaller),
    Relation("moved", "the same image", "places taken for directions, float32 far from the origin", _moved),
    Relation("camera rolled by 90 degrees", "the image turned", "field of view, aspect, up, rows shifted", _rolled),
    Relation("middle 3 times as near", "each third pixel", "field of view, centres of pixels, a filter", _nearer),
    Relation("finer", "the same, pixel by pixel", "centres of pixels, a filter, width - 1", _finer),
)
