"""The door that every renderer goes through: a scene near the origin, its arrays and its needs, found once."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from .geometry.arrays import Geometry, build_geometry
from .geometry.recentre import near_origin
from .needs import Needs, find_needs
from .scene import Scene


class Prepared(NamedTuple):
    """What every renderer starts from.

    Parameters
    ----------
    scene : Scene
        Brought near the origin (see `recentre`): the one that ``geometry`` and ``needs`` are of.
    geometry : Geometry
    needs : Needs
    """

    scene: Scene
    geometry: Geometry
    needs: Needs


@lru_cache(maxsize=2)
def _prepared(digest: str, everything: bool, moved: bool, scene: Scene) -> Prepared:
    if moved:
        scene = near_origin(scene)
    geometry = build_geometry(scene)
    return Prepared(scene, geometry, find_needs(scene, geometry, everything))


def prepare(scene: Scene, everything: bool = False, moved: bool = True) -> Prepared:
    """A scene near the origin, its arrays and its needs, found once: the door that every renderer goes through.

    Not ``moved`` for who traces rays by another renderer's rule, which knows where the origin is.
    """
    return _prepared(scene.digest(), everything, moved, scene)
