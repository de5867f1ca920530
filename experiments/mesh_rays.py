"""Rays a second on a big closed mesh: from the camera, to common light points, and one by one.

    python -m experiments.mesh_rays --triangles 100000

One process, one thread if OMP_NUM_THREADS=1; processor seconds, the first run of each apart.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

import click
import numpy as np

from renderer.camera import pixel_centres
from renderer.common_visibility import CommonVisibility
from renderer.estimators.common_points import lattice
from renderer.image import prepare
from renderer.scene import QuadLight
from renderer.vectors import column, dot
from renderer.view import look

from .generated import generated


def _seconds(work: Callable[[], Any], repeats: int) -> list[float]:
    """Processor seconds of each run, the first dropped."""
    work()
    found = []
    for _ in range(repeats):
        started = time.process_time()
        work()
        found.append(time.process_time() - started)
    return found


def measure(triangles: int, side: int, points: int, repeats: int) -> dict[str, Any]:
    """Millions of rays a second (median), and mismatches between the two shadow methods."""
    scene = generated("mesh", triangles).with_(width=side, height=side)
    geometry, needs = prepare(scene)
    x, y = pixel_centres(range(side), range(side))
    camera = _seconds(lambda: look(scene, geometry, x, y), repeats)
    view = look(scene, geometry, x, y).points
    (source,) = needs.sources
    light = source.light
    if not isinstance(light, QuadLight):
        raise TypeError("the scene has a quad light")
    common = CommonVisibility.of(source)
    row: dict[str, Any] = {"triangles": triangles, "side": side, "camera Mray/s": x.size / np.median(camera) / 1e6}
    floor = view.position[2] < 1e-9
    for name, mine in (("floor", floor), ("floor and mesh", np.ones_like(floor))):
        rays, seconds, slow, mismatches = 0, 0.0, 0.0, 0
        for u, v in lattice(points).T:
            eye = column(light.corner) + u * column(light.ab) + v * column(light.ac)
            d = eye - view.position
            k = np.flatnonzero(mine & (dot(view.normal, d) > 0))
            p, own, way = view.position[:, k], view.ellipsoid[k], d[:, k]
            started = time.process_time()
            seen = common.seen(p, own, way, eye, False)
            seconds += time.process_time() - started
            started = time.process_time()
            one_by_one = source.blockers.visible(p, own, way[:, :, None], False)[:, 0]
            slow += time.process_time() - started
            rays += k.size
            mismatches += int((seen != one_by_one).sum())
        row |= {
            f"{name}: rays": rays,
            f"{name}: common Mray/s": rays / seconds / 1e6,
            f"{name}: hierarchy Mray/s": rays / slow / 1e6,
            f"{name}: mismatches": mismatches,
        }
    return row


@click.command()
@click.option("--triangles", default=100_000, show_default=True)
@click.option("--side", default=256, show_default=True, help="Pixels.")
@click.option("--points", default=13, show_default=True, help="Light points.")
@click.option("--repeats", default=5, show_default=True)
def main(triangles: int, side: int, points: int, repeats: int) -> None:
    """Rays a second, as JSON on standard output."""
    click.echo(json.dumps(measure(triangles, side, points, repeats), indent=1))


if __name__ == "__main__":
    main()
