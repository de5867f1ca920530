"""Rays a second on a big closed mesh: from the camera, to common light points, and one by one.

Processor seconds of one core, the first run of each apart. The two shadow methods are each other's oracle.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from nusselt.experiments.results.figures import BLUE, RED, canvas, name_lines
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.scenes.procedural import generated
from nusselt.renderer.camera.first_hits import first_hits
from nusselt.renderer.camera.rays import pixel_centres, primary_directions
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators.common_points import lattice
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import column, dot
from nusselt.renderer.visibility.shared_points import CommonVisibility

GOALS = {"camera": 10.0, "common points, floor": 5.0}
"""Millions of rays a second at 100,000 triangles; shown, never judged."""
COUNTS = (1_000, 10_000, 100_000, 400_000)
MISMATCHES = 1e-4
"""Share of rays on which the two shadow methods may differ: those that graze an edge to rounding."""


def _seconds(work: Callable[[], Any], repeats: int) -> list[float]:
    """Processor seconds of each run, the first dropped."""
    work()
    found = []
    for _ in range(repeats):
        started = time.process_time()
        work()
        found.append(time.process_time() - started)
    return found


def _row(what: str, triangles: int, rays: int, raw: list[float], mismatches: int | None = None) -> dict[str, Any]:
    speed = rays / float(np.median(raw)) / 1e6
    goal = GOALS.get(what) if triangles >= 90_000 else None
    row = {"what": what, "triangles": triangles, "rays": rays, "million_a_second": speed, "goal": goal}
    row |= {"within_goal": None if goal is None else speed >= goal, "mismatches": mismatches, "raw": raw}
    return row | {"as_claimed": mismatches is None or mismatches <= MISMATCHES * rays}


def measure(triangles: int, side: int, points: int, repeats: int) -> Outcome:
    """A row for camera rays, and for shadow rays of the floor and of everything, in both methods."""
    scene = generated("mesh", triangles).with_(width=side, height=side)
    scene, geometry, needs = prepare(scene)
    x, y = pixel_centres(range(side), range(side))
    origin, d = column(scene.camera.position), primary_directions(scene, x, y)
    pixel = primary_directions(scene, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    rows = [_row("camera", triangles, x.size, _seconds(lambda: first_hits(geometry, origin, d, pixel), repeats))]
    view = look(scene, geometry, x, y).points
    (source,) = needs.sources
    floor = view.position[2] < 1e-9
    for where, mine in (("floor", floor), ("floor and mesh", np.ones_like(floor))):
        found = [_shadows(source, view.take(np.flatnonzero(mine)), points) for _ in range(repeats + 1)][1:]
        rays, mismatches = found[0][0], found[0][3]
        rows.append(_row(f"common points, {where}", triangles, rays, [one[1] for one in found], mismatches))
        rows.append(_row(f"one by one, {where}", triangles, rays, [one[2] for one in found]))
    return Outcome(rows)


def _shadows(source: Source, view: ShadingPoints, points: int) -> tuple[int, float, float, int]:
    """Rays to light points, seconds by common points and one by one, and rays on which they differ."""
    light, common = source.light, CommonVisibility.of(source.blockers, source.light)
    rays, fast, slow, mismatches = 0, 0.0, 0.0, 0
    for u, v in lattice(points).T:
        eye = light.at(u, v)
        if eye is None:
            raise TypeError(f"points have no place of a {light.kind} light in common")
        d = eye - view.position
        k = np.flatnonzero(dot(view.normal, d) > 0)
        p, own, way = view.position[:, k], view.ellipsoid[k], d[:, k]
        started = time.process_time()
        seen = common.seen(p, own, way, eye, light.at_infinity, outside=view.outside[k])
        between = time.process_time()
        one_by_one = source.blockers.visible(p, own, way[:, :, None], light.at_infinity)[:, 0]
        slow += time.process_time() - between
        fast += between - started
        rays += k.size
        mismatches += int((seen != one_by_one).sum())
    return rays, fast, slow, mismatches


def jobs(settings: Settings) -> list[Job]:
    """One a size of mesh."""
    counts, side, points, repeats = settings.pick((COUNTS, 256, 13, 3), ((2_000, 8_000), 64, 3, 1), ((500,), 12, 1, 1))
    rest = {"side": side, "points": points, "repeats": repeats}
    return [Job(measure, {"triangles": count} | rest, alone=True) for count in counts]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Rays a second."""
    rows = [row for outcome in outcomes for row in outcome.rows]
    drawn = canvas(8.5, 4.5)
    axis = drawn.subplots()
    for what in dict.fromkeys(row["what"] for row in rows):
        mine = [row for row in rows if row["what"] == what]
        axis.loglog([row["triangles"] for row in mine], [row["million_a_second"] for row in mine], "o-", label=what)
    for goal, colour in zip(GOALS.values(), (BLUE, RED), strict=True):
        axis.axhline(goal, color=colour, lw=0.6)
    axis.set(xlabel="triangles", ylabel="million rays a second, one core; lines: goals at 100,000")
    axis.grid(alpha=0.3)
    name_lines(axis)
    return {"rays": drawn}


MESH_RAYS = Experiment("mesh-rays", "rays a second on big closed meshes, by every method", jobs, figures)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(MESH_RAYS)
