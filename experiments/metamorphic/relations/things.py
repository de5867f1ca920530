"""The same surfaces said otherwise, and what stands outside all light and sight."""

from __future__ import annotations

import functools

import numpy as np

from nusselt.experiments.metamorphic.relation import Related, Relation, same
from nusselt.experiments.search.twins import TWINS
from nusselt.renderer.scene import Scene

TWIN = {twin.name: twin for twin in TWINS}


def _twin(name: str, why_not: str, scene: Scene, rng: np.random.Generator) -> Related | str:
    """A scene that the search for exactness knows as another way to say this one."""
    copy = TWIN[name].make(scene, rng)
    return why_not if copy is None else same(scene, copy.scene)


def twin(name: str, likely: str, why_not: str = "") -> Relation:
    """A relation of it: the image stays."""
    return Relation(name, "the same image", likely, functools.partial(_twin, name, why_not))


SURROUNDED = "it would stand in the way of a light that is infinitely far"
THINGS = (
    twin("objects shuffled", "the last or first object treated apart, materials, not the nearest hit"),
    twin("triangles from another corner", "intersection that prefers a corner or an edge"),
    twin("no vertex shared", "cracks, indices of vertices"),
    twin("subdivided", "cracks, a triangle forgotten, indices of vertices"),
    twin("a far thing more", "the scene's bounds, an acceleration structure, endless shadow rays", SURROUNDED),
)
