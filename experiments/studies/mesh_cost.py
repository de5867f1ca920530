"""What big meshes cost: seconds and memory against triangles and against pixels, with the growth's exponent.

Every figure in a process of its own, so that its peak of memory is its own; processor seconds of one core.
"""

from __future__ import annotations

import multiprocessing
import resource
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.results.figures import BLUE, RED, canvas
from nusselt.experiments.results.work_precision import slope
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.scenes.procedural import generated
from nusselt.renderer.estimators import estimator_named
from nusselt.renderer.image import render
from nusselt.renderer.prepared import prepare

TRIANGLES: tuple[int, ...] = (1_000, 10_000, 100_000, 400_000, 1_000_000)
SIDES: tuple[int, ...] = (128, 256, 512, 1024, 2048)
BIGGEST = (400_000, 1024)
"""Triangles and pixels a side whose peak of memory is bounded."""
MOST_BYTES = 2 << 30
COMMON = ("common-points", 21)
EXACT = ("exact", 1)
SERIES = {"triangles": ("triangles", 1), "pixels": ("side", 2), "memory": ("side", 2)}
"""What grows in each series, and to what power."""


def peak_bytes() -> int:
    """This process's largest resident memory: the kernel's own mark, which, unlike ru_maxrss, a parent does not set."""
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def one(estimator: str, samples: int, triangles: int, side: int) -> dict[str, Any]:
    """Load, prepare and render the scene ``mesh`` once."""
    started = time.process_time()
    scene = generated("mesh", triangles).with_(width=side, height=side)
    made = time.process_time()
    prepare(scene)
    prepared = time.process_time()
    image = render(scene, estimator_named(estimator, samples, False))
    return {
        "estimator": estimator,
        "samples": samples,
        "triangles": scene.meshes[-1].triangles.shape[1],
        "side": side,
        "made": made - started,
        "prepare": prepared - made,
        "render": time.process_time() - prepared,
        "peak_bytes": peak_bytes(),
        "finite": bool(np.isfinite(image.mean).all()),
    }


def alone(series: str, estimator: str, samples: int, triangles: int, side: int) -> Outcome:
    """The same in a process of its own. A time is shown, never judged; memory is."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        row = pool.apply(one, (estimator, samples, triangles, side))
    finite = row.pop("finite")
    bounded = triangles > BIGGEST[0] or side > BIGGEST[1] or row["peak_bytes"] <= MOST_BYTES
    return Outcome([{"series": series} | row | {"as_claimed": finite and bounded}])


def jobs(settings: Settings) -> list[Job]:
    """Triangles at 256 pixels a side, pixels at 100,000 triangles, and the biggest of both."""
    counts, sides = settings.pick((TRIANGLES, SIDES), ((1_000, 8_000), (32, 64)), ((500, 1_000), (8, 16)))
    few, small = settings.pick((100_000, 256), (8_000, 32), (1_000, 16))
    asked = [("triangles", *COMMON, count, small) for count in counts]
    asked += [("pixels", *COMMON, few, side) for side in sides]
    if settings.pick(True, True, False):
        asked += [("triangles", *EXACT, count, small // 2) for count in counts]
        asked += [("pixels", *EXACT, few, side // 2) for side in sides[:3]]
    if settings.pick(True, False, False):
        asked.append(("memory", *COMMON, *BIGGEST))
    names = ("series", "estimator", "samples", "triangles", "side")
    return [Job(alone, dict(zip(names, entry, strict=True)), alone=True) for entry in asked]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Seconds and bytes against triangles and pixels."""
    rows = [outcome.rows[0] for outcome in outcomes]
    drawn = canvas(9, 4)
    for axis, series in zip(drawn.subplots(1, 2), ("triangles", "pixels"), strict=True):
        name, power = SERIES[series]
        for (estimator, samples), colour in ((COMMON, BLUE), (EXACT, RED)):
            mine = [row for row in rows if row["series"] == series and row["estimator"] == estimator]
            if not mine:
                continue
            sizes, seconds = [row[name] ** power for row in mine], [row["render"] for row in mine]
            label = f"{estimator} {samples}, exponent {slope(sizes, seconds)[0]:.2f}"
            axis.loglog(sizes, seconds, "o-", color=colour, label=label)
        axis.set(xlabel=series, ylabel="processor seconds of one image")
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8, loc="lower left", bbox_to_anchor=(0, 1))
    return {"cost": drawn}


MESH_COST = Experiment("mesh-cost", "seconds and memory of big meshes against triangles and pixels", jobs, figures)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(MESH_COST)
