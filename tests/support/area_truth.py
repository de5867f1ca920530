"""Truth for pixels by area: brute force, from the plain renderer, with no line drawn.

`python tests/support/area_truth.py` renders every pixel as a jittered grid of SIDE x SIDE rays, each shaded, in two
halves; half their RMS difference, over the pixels that no light's body is seen in, is the stated error of their
mean. It shares nothing with `nusselt.renderer.pixels`
but the estimator. Kept in area_truth.npz.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from builders import GREY, box, floor, lamp, quad, scene, sphere_mesh

from nusselt.experiments.scenes import catalogue
from nusselt.experiments.scenes.cameras import views
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators import Analytic
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

KEPT = Path(__file__).with_name("area_truth.npz")
SIDE = 24
"""Cells in a pixel's side, one ray in each and in each half."""
SIZE = 40, 30


def solids() -> Scene:
    """Spheres, an ellipsoid, a mesh and boxes that pass through each other and the floor."""
    red, blue = Material((0.7, 0.2, 0.1)), Material((0.1, 0.2, 0.8), emission=(0.02, 0.0, 0.05))
    ball = Ellipsoid.sphere((-0.7, 0.35, 0.4), 0.45, red)
    egg = Ellipsoid((0.8, 0.5, 0.5), ((0.3, 0.1, 0.0), (0.0, 0.5, 0.1), (0.1, 0.0, 0.25)), blue)
    ball_mesh = sphere_mesh(5, 0.5)
    rock = Mesh(ball_mesh.vertices + np.array([[0.1], [0.3], [-0.6]]), ball_mesh.triangles, GREY)
    wall = quad((-2, 0, -1.5), (2, 0, -1.5), (2, 2, -1.8), (-2, 2, -1.8), red)
    block = box((0.2, -0.1, -0.5), (0.9, 0.4, 0.3), GREY)
    slanted = lamp(1.7, 0.4, (6.0, 5.0, 4.0))
    camera = Camera((0.3, 1.4, 3.6), (0.0, 0.4, 0.0), (0.0, 1.0, 0.0), 42.0)
    return scene(floor(), wall, block, rock, ellipsoids=(ball, egg), lights=(slanted,), camera=camera, name="solids")


def scenes() -> list[Scene]:
    """Five cameras on each of five scenes; `analytic` leaves the shadows out, so that the truth is exact."""
    classic = [catalogue.load(name) for name in ("quad", "near-light", "cornell-boxes", "cornell")]
    return [view.with_(width=SIZE[0], height=SIZE[1]) for one in (*classic, solids()) for view in views(one)]


def half(view: Scene, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean radiance (3, h, w) of one jittered grid a pixel, and the light bodies' share (h, w)."""
    view, geometry, needs = prepare(view)
    rng, estimator = np.random.default_rng(seed), Analytic()
    out, lights = np.empty((3, view.height, view.width)), np.empty((view.height, view.width))
    i, j = (index.ravel() for index in np.meshgrid(np.arange(SIDE), np.arange(SIDE), indexing="ij"))
    for row in range(view.height):
        u, v = rng.random((2, view.width, SIDE * SIDE))
        x = np.arange(view.width)[:, None] + (j + u) / SIDE
        y = row + (i + v) / SIDE
        seen = look(view, geometry, x.ravel(), y.ravel())
        radiance = seen.emission.copy()
        for source in needs.sources:
            radiance[:, seen.lit] += estimator(seen.points, source, rng)
        out[:, row] = radiance.reshape(3, view.width, -1).mean(axis=2)
        lights[row] = seen.emitter.reshape(view.width, -1).mean(axis=1)
    return out, lights


def main() -> None:
    kept = {}
    for view in scenes():
        (one, lights), (other, more) = half(view, 1), half(view, 2)
        truth, judged = (one + other) / 2, lights + more == 0
        error = np.sqrt(((one - other)[:, judged] ** 2).sum() / (truth[:, judged] ** 2).sum()) / 2
        print(view.name, f"{error:.1e}", flush=True)
        kept[view.name] = truth.astype(np.float32)
        kept[view.name + "/error"] = np.array(error)
    np.savez_compressed(KEPT, **kept)


if __name__ == "__main__":
    sys.exit(main())
