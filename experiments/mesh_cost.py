"""What big meshes cost: seconds and memory against triangles and against pixels, with the growth's exponent.

    python -m experiments.mesh_cost --out cost.json

Every figure in a process of its own, so that its peak of memory is its own.
"""

from __future__ import annotations

import json
import multiprocessing
import resource
import time
from pathlib import Path
from typing import Any

import click
import numpy as np

from renderer.estimators import estimator_named
from renderer.image import prepare, render

from .files import replacing
from .generated import generated

TRIANGLES = (1_000, 10_000, 100_000, 400_000, 1_000_000)
SIDES = (128, 256, 512, 1024, 2048)


def one(estimator: str, samples: int, triangles: int, side: int) -> dict[str, Any]:
    """Load, prepare and render the scene ``mesh`` once."""
    started = time.process_time()
    scene = generated("mesh", triangles).with_(width=side, height=side)
    made = time.process_time()
    prepare(scene)
    prepared = time.process_time()
    render(scene, estimator_named(estimator, samples, False))
    return {
        "estimator": estimator,
        "samples": samples,
        "triangles": scene.meshes[-1].triangles.shape[1],
        "side": side,
        "made": made - started,
        "prepare": prepared - made,
        "render": time.process_time() - prepared,
        "peak_bytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
    }


def _alone(task: tuple[str, int, int, int]) -> dict[str, Any]:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(one, task)


def exponent(sizes: list[float], seconds: list[float]) -> float:
    """Slope of log seconds over log size, by least squares."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


@click.command()
@click.option("--estimator", default="common-points", show_default=True)
@click.option("--samples", default=21, show_default=True)
@click.option("--triangles", type=int, multiple=True, default=TRIANGLES, show_default=True)
@click.option("--sides", type=int, multiple=True, default=SIDES, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="FILE.json")
def main(estimator: str, samples: int, triangles: tuple[int, ...], sides: tuple[int, ...], out: Path) -> None:
    """Cost against triangles at 256 x 256, and against pixels at 100,000 triangles."""
    rows = []
    for count in triangles:
        rows.append(_alone((estimator, samples, count, 256)) | {"series": "triangles"})
        click.echo(rows[-1])
    for side in sides:
        rows.append(_alone((estimator, samples, 100_000, side)) | {"series": "pixels"})
        click.echo(rows[-1])
    found = {}
    for series, size in (("triangles", "triangles"), ("pixels", "side")):
        mine = [row for row in rows if row["series"] == series]
        if len(mine) > 1:
            power = 1 if series == "triangles" else 2
            found[series] = exponent([row[size] ** power for row in mine], [row["render"] for row in mine])
    with replacing(out) as target:
        target.write_text(json.dumps({"rows": rows, "exponents": found}, indent=1))
    click.echo(f"exponents: {found}")


if __name__ == "__main__":
    main()
