"""Cost of exact shadows against the number of occluders, and where sampling would be cheaper.

Boxes float between a floor and a lamp, their number doubling from 1 to 64 while their common volume stays: every
floor point keeps most of them as candidates. Exact and sampled are timed in one run, interleaved, by processor time of
one thread; the sampled side is the control variate with the samples that bring its root mean square error to a target,
found from its error at two sample counts.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from nusselt.renderer.estimators import ControlVariate, Estimator, Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.needs import Source
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import Material, Mesh
from nusselt.renderer.vectors import Floats
from nusselt.renderer.visibility.segments import Blockers

COUNTS = (1, 2, 4, 8, 16, 32, 64)
TARGETS = (1e-2, 1e-3, 1e-4)
LAMP = QuadLight((-0.5, 2.0, -0.5), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def boxes(count: int, seed: int) -> tuple[Mesh, ...]:
    """Boxes of common volume 0.1, at random between floor and lamp, turned at random about the vertical."""
    rng = np.random.default_rng(seed)
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]).T
    half = (0.1 / count) ** (1 / 3) / 2
    made = []
    for _ in range(count):
        turn, centre = rng.uniform(0, np.pi), rng.uniform([-0.6, 0.6, -0.6], [0.6, 1.4, 0.6])
        c, s = np.cos(turn), np.sin(turn)
        corners = np.array([[half * (1 if i >> k & 1 else -1) for k in range(3)] for i in range(8)]).T
        vertices = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ corners + centre[:, None]
        made.append(Mesh(vertices, triangles, Material((0.5, 0.5, 0.5))))
    return tuple(made)


def floor_points(count: int, seed: int) -> ShadingPoints:
    """Points under the lamp."""
    rng = np.random.default_rng(seed)
    position = rng.uniform(-0.8, 0.8, (3, count)) * np.array([[1.0], [0.0], [1.0]])
    up = np.broadcast_to(np.array([[0.0], [1.0], [0.0]]), (3, count)).copy()
    grey = np.full((3, count), 0.5)
    return ShadingPoints(position, up, up, up, (Lambert,), {"diffuse": grey}, np.full(count, -1), np.zeros(count, bool))


def _timed(run: Callable[[], Floats], repeats: int) -> tuple[Floats, list[float]]:
    """The result, and raw seconds of every run but the first."""
    value, seconds = run(), []
    for _ in range(repeats):
        started = time.process_time()
        run()
        seconds.append(time.process_time() - started)
    return value, seconds


def occluder_cost(points: int = 1000, repeats: int = 3, seed: int = 0) -> list[dict[str, Any]]:
    """One row for each number of boxes.

    Returns
    -------
    rows : list of dict
        ``boxes``, ``microseconds`` (exact, a point), ``raw_seconds``, ``sampled``: for each target of relative error
        the samples and microseconds a point that sampling is expected to take (None beyond 10^6 samples).
    """
    rows = []
    few = floor_points(points, seed)
    for count in COUNTS:
        scene = Scene(8, 8, Camera((0, 3, 6), (0, 0, 0), (0, 1, 0), 40), boxes(count, seed), (), (LAMP,))
        geometry = build_geometry(scene)
        source = Source(0, LAMP, Blockers.everything(geometry), False)

        def shade(estimator: Estimator, where: Source = source) -> Floats:
            return estimator(few, where, np.random.default_rng(seed))

        exact, seconds = _timed(partial(shade, Exact()), repeats)
        errors, costs = [], []
        for side in (8, 24):
            sampling = ControlVariate(samples=side * side, stratified=True)
            sampled, spent = _timed(partial(shade, sampling), 1)
            errors.append(float(np.sqrt(((sampled - exact) ** 2).mean()) / exact.mean()))
            costs.append(min(spent) / points * 1e6)
        slope = np.log(errors[1] / errors[0]) / np.log(9.0)
        each = (costs[1] - costs[0]) / (24 * 24 - 8 * 8)
        sampled_rows = []
        for target in TARGETS:
            samples = 64 * (target / errors[0]) ** (1 / slope)
            beyond = samples > 1e6
            sampled_rows.append(
                {
                    "target": target,
                    "samples": None if beyond else float(samples),
                    "microseconds": None if beyond else float(costs[0] + each * max(samples - 64, 0)),
                }
            )
        rows.append(
            {
                "boxes": count,
                "points": points,
                "microseconds": min(seconds) / points * 1e6,
                "raw_seconds": seconds,
                "slope": float(slope),
                "sampled": sampled_rows,
            }
        )
    return rows


if __name__ == "__main__":
    print(json.dumps(occluder_cost(), indent=1))
