"""Mistakes of one thing in the scene: darker, brighter, coloured, black, missing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools
from nusselt.renderer.words import count

from .camera import edges_moved, seen_through
from .case import Case, Guess
from .lamps import in_words
from .probe import Probe

MOST = 24
"""Things that are tried one by one."""


@dataclass(frozen=True)
class Thing:
    """A mesh or an ellipsoid: its words, its parts of the geometry, and the pixels (n,) that show it."""

    said: str
    surface: int
    triangles: Bools
    ellipsoids: Bools
    shown: Bools


def bodies(probe: Probe) -> list[Thing]:
    """The scene's things that reflect, in its order."""
    scene, g = probe.scene, probe.geometry
    names = [f"mesh {k + 1}, {count(mesh.triangles.shape[1], 'triangle')}" for k, mesh in enumerate(scene.meshes)]
    names += [f"sphere {k + 1}" for k in range(len(scene.ellipsoids))]
    lines = [*scene.lines[0], *scene.lines[1]] if scene.lines else []
    if len(lines) == len(names):
        names = [f"{name} (line {line})" for name, line in zip(names, lines, strict=True)]
    return [
        Thing(name, k, g.triangle_surface == k, g.ellipsoid_surface == k, probe.sight.surface == k)
        for k, name in enumerate(names[:MOST])
    ]


def one_thing(case: Case) -> Iterator[Guess]:
    """One thing's radiance times a factor, of all channels or of each; black."""
    things = bodies(case.probe)
    if sum(thing.shown.any() for thing in things) < 2:
        return
    for thing in things:
        some = thing.shown & case.shaded
        if not some.any() or not case.truth[:, some].any():
            continue
        part = np.where(some, case.truth, 0.0)
        rest = case.truth - part
        (factor,) = case.combined(part[None], rest, some)
        told = f"{thing.said} is {in_words(float(factor), case)} as bright: its material, or its normals"
        yield Guess("one-object", rest + factor * part, told, 1)
        of_channel = [case.combined(np.eye(3)[[c]][:, :, None] * part, rest, some)[0] for c in range(3)]
        factors = np.array(of_channel)[:, None]
        words = " ".join(f"{value:.3g}" for value in of_channel)
        yield Guess("one-object", rest + factors * part, f"{thing.said} has another colour: times {words}", 3)
        yield Guess("one-object", rest, f"{thing.said} is black: its normals point inwards, or it is lit from its back")


def missing(case: Case) -> Iterator[Guess]:
    """One thing that is not there: it is not seen, and casts no shadow."""
    probe, scene = case.probe, case.probe.scene
    if not edges_moved(case):
        return
    for thing in bodies(probe):
        if thing.shown.any():
            number = thing.surface - len(scene.meshes)
            meshes = tuple(mesh for k, mesh in enumerate(scene.meshes) if k != thing.surface)
            balls = tuple(ball for k, ball in enumerate(scene.ellipsoids) if k != number)
            without = Probe(scene.with_(meshes=meshes, ellipsoids=balls), probe.samples, probe.stratified)
            yield seen_through(case, without, "object-missing", (probe.x, probe.y), f"{thing.said} is not there")
