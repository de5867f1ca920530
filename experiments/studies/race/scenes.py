"""The scenes of the race: classic ones, and closed meshes over a floor, small and big."""

from __future__ import annotations

import numpy as np

from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.scenes.shapes import lamp, plate
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Material, Mesh

NAMES = ("quad", "near-light", "cornell-boxes", "cornell", "bumpy-ball", "mesh")
RINGS = 24
GREY = Material((0.6, 0.6, 0.6))


def race_scene(name: str, side: int) -> Scene:
    """A scene of the race, ``side`` pixels high and as wide as its own shape says."""
    scene = bumpy_ball_scene() if name == "bumpy-ball" else load(name)
    return scene.with_(width=max(1, round(side * scene.width / scene.height)), height=side)


def bumpy_ball_scene() -> Scene:
    """A bumpy ball of about 2,200 triangles over a floor, under a square light."""
    floor = plate((-2, 2), (-2, 2), 0.0, GREY)
    light = lamp((-0.5, 0.5), (-0.5, 0.5), 3.0, (9.0, 9.0, 8.0))
    camera = Camera((0.3, 2.4, 4.6), (0.0, 0.6, 0.0), (0.0, 1.0, 0.0), 38.0)
    return Scene(256, 256, camera, (floor, bumpy_ball(RINGS)), (), (light,), name="bumpy-ball")


def bumpy_ball(rings: int) -> Mesh:
    """A closed ball around (0, 0.9, 0), its radius a smooth function of the direction."""
    around = 2 * rings
    theta, phi = np.pi * np.arange(1, rings) / rings, 2 * np.pi * np.arange(around) / around
    sine = np.outer(np.sin(theta), np.ones(around))
    ring = np.stack((sine * np.cos(phi), np.outer(np.cos(theta), np.ones(around)), -sine * np.sin(phi)))
    unit = np.hstack((ring.reshape(3, -1), [[0, 0], [1, -1], [0, 0]]))
    bumps = 1 + 0.08 * np.sin(5 * unit[0] + 1) * np.sin(6 * unit[1]) * np.sin(5 * unit[2] + 2)
    k, r = np.arange(around), np.arange(rings - 2)[:, None]
    after = (k + 1) % around
    a, b, c, d = (r * around + k, r * around + after, (r + 1) * around + k, (r + 1) * around + after)
    top, bottom, last = unit.shape[1] - 2, unit.shape[1] - 1, (rings - 2) * around
    triangles = [np.stack(np.broadcast_arrays(*corners)).reshape(3, -1) for corners in ((a, c, d), (a, d, b))]
    triangles += [
        np.stack((np.full(around, top), k, after)),
        np.stack((np.full(around, bottom), last + after, last + k)),
    ]
    return Mesh(0.6 * bumps * unit + np.array([[0], [0.9], [0]]), np.hstack(triangles), GREY)
