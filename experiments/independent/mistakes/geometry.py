"""Mistakes of what the camera meets, of normals, and of where things stand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nusselt.experiments.independent.rays import LIGHT, NOTHING, Hits, trace
from nusselt.experiments.independent.world import Floats, World

from .mistake import Mistake, Step, by_chance


def _losing(share: float) -> Step:
    """The step `trace` that loses a share of the camera's hits: they show nothing."""

    def step(world: World, o: Floats, d: Floats) -> Hits:
        hits = trace(world, o, d)
        lost = by_chance(d, share)
        return replace(hits, surface=np.where(lost, NOTHING, hits.surface), light=np.where(lost, -1, hits.light))

    return step


def _painted(world: World, o: Floats, d: Floats) -> Hits:
    """Triangles are seen before balls, wherever they lie."""
    behind, right = (
        trace(replace(world, balls=world.balls[:0], ball_material=world.ball_material[:0]), o, d),
        trace(world, o, d),
    )
    flat = (behind.surface >= 0) & (right.surface != LIGHT)
    return Hits(**{name: np.where(flat, vars(behind)[name], vars(right)[name]) for name in vars(right)})


def _turned(change: Step) -> Step:
    """The step `trace` with other normals on balls: change(world, hits, on the first ball)."""

    def step(world: World, o: Floats, d: Floats) -> Hits:
        hits = trace(world, o, d)
        if not len(world.balls):
            return hits
        on = hits.surface == len(world.triangles)
        return replace(hits, normal=np.where(on, change(world, hits), hits.normal))

    return step


def _local(world: World, hits: Hits) -> Floats:
    """Places on the first unit ball."""
    inverse = np.linalg.inv(world.balls[0])
    return np.asarray(inverse[:3, :3] @ hits.position + inverse[:3, 3:])


def _by_matrix(world: World, hits: Hits) -> Floats:
    normal = world.balls[0][:3, :3] @ _local(world, hits)
    return np.asarray(normal / np.linalg.norm(normal, axis=0))


def _bumps(world: World, hits: Hits) -> Floats:
    normal = hits.normal + 0.1 * np.sin(25 * hits.position)
    return np.asarray(normal / np.linalg.norm(normal, axis=0))


def _less(world: World) -> World:
    """Without half of the box's top."""
    kept = np.arange(len(world.triangles)) != 10
    return replace(world, triangles=world.triangles[kept], triangle_material=world.triangle_material[kept])


GEOMETRY = (
    Mistake("1 in 1000 camera hits lost", "they show nothing", "ball", "trace", _losing(0.001)),
    Mistake("1 in 100 camera hits lost", "they show nothing", "ball", "trace", _losing(0.01)),
    Mistake("balls behind all triangles", "first in the list, not nearest", "ball", "trace", _painted),
    Mistake(
        "ball's normals inwards", "it is seen from its back", "ball", "trace", _turned(lambda world, hits: -hits.normal)
    ),
    Mistake("normals not normalised", "1.2 long", "ball", "trace", _turned(lambda world, hits: 1.2 * hits.normal)),
    Mistake("normals by the matrix", "not by its inverse transpose", "egg", "trace", _turned(_by_matrix)),
    Mistake("normals of the unit ball", "not transformed", "egg", "trace", _turned(_local)),
    Mistake("bumpy normals", "5 degrees and more", "ball", "trace", _turned(_bumps)),
    Mistake("missing ball", "it is not read", "ball", "text", lambda text: text.replace("\nsphere", "\n#sphere")),
    Mistake("missing triangle", "one of the box's top is not read", "tilted lamp and box", "world", _less),
    Mistake("rotation the other way", "its sign", "egg", "text", lambda text: text.replace("0 0 1 30", "0 0 1 -30")),
    Mistake(
        "rotation after scale",
        "transforms in the wrong order",
        "egg",
        "text",
        lambda text: text.replace("rotate 0 0 1 30\nscale .3 .7 .4", "scale .3 .7 .4\nrotate 0 0 1 30"),
    ),
    Mistake("ball moved", "by 0.03", "ball", "text", lambda text: text.replace("sphere .5 ", "sphere .53 ")),
    Mistake("ball 1 % too small", "its radius", "ball", "text", lambda text: text.replace("0 .6\n", "0 .594\n")),
)
