"""Other random numbers, more of them, other ones: the same image on average."""

from __future__ import annotations

import math

import numpy as np

from nusselt.experiments.metamorphic.relation import Images, Related, Relation, Shot, may_have_noise
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

MORE = 4
OTHER = 1 << 20
"""Between seeds."""


def _equal(images: Images) -> tuple[Floats, Floats]:
    return images[1], images[0]


def _noise(scene: Scene) -> str:
    return "" if may_have_noise(scene) else "nothing in it is random"


def _seeds(scene: Scene, rng: np.random.Generator) -> Related | str:
    return _noise(scene) or Related(scene, (Shot(scene, step=OTHER),), _equal, stirs=True)


def _samples(scene: Scene, rng: np.random.Generator) -> Related | str:
    return _noise(scene) or Related(scene, (Shot(scene, more=MORE),), _equal)


def _strata(scene: Scene, rng: np.random.Generator) -> Related | str:
    if math.isqrt(scene.light_samples) ** 2 != scene.light_samples:
        return "a number of samples that is no square"
    return _noise(scene) or Related(scene, (Shot(scene.with_(stratify=not scene.stratify)),), _equal)


def _threads(scene: Scene, rng: np.random.Generator) -> Related | str:
    return Related(scene, (Shot(scene, threads=1),), _equal)


CHANCE = (
    Relation("other seeds", "other noise", "the seed is ignored", _seeds, ("seed",)),
    Relation("4 times the samples", "the same image", "divisors, samples lost or clamped, a biased mean", _samples),
    Relation("strata or none", "the same image", "strata left out, shifted or used twice", _strata),
    Relation("one thread", "the same image", "threads that share state", _threads, ("threads",)),
)
