"""Irradiance of one point after the other as Mitsuba's light sampling finds it; runs in the child only.

The scene holds the light alone, where and as large as it is given: nothing is moved into Mitsuba's valid range.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from .scene_dict import BLACK

PASSES = 8
"""Independent passes, for a standard error."""


def _light(case: dict[str, Any]) -> Any:
    """The parallelogram, turned so that it shines on the point: both of its sides count."""
    x, p, e1, e2 = (np.array(case[name], dtype=np.float64) for name in ("x", "P", "e1", "e2"))
    if np.cross(e1, e2) @ (x - p) < 0:
        e1, e2 = e2, e1
    normal = np.cross(e1, e2)
    size = np.sqrt(normal @ normal)
    matrix = np.eye(4)
    for k, column in enumerate((e1 / 2, e2 / 2, normal / size if size > 0 else normal, p + e1 / 2 + e2 / 2)):
        matrix[:3, k] = column
    emitter = {"type": "area", "radiance": {"type": "rgb", "value": [1.0, 1.0, 1.0]}}
    shape = {"type": "rectangle", "to_world": mi.ScalarTransform4f(matrix.tolist()), "bsdf": BLACK, "emitter": emitter}
    return mi.load_dict({"type": "scene", "light": shape})


def _interaction(case: dict[str, Any]) -> Any:
    n = np.array(case["n"], dtype=np.float64)
    n /= np.abs(n).max()
    n /= np.sqrt(n @ n)
    found = dr.zeros(mi.SurfaceInteraction3f)
    found.p = mi.Point3f(case["x"])
    found.n = mi.Normal3f(n.tolist())
    found.sh_frame = mi.Frame3f(mi.Vector3f(found.n))
    dr.make_opaque(found)  # else every case is a kernel of its own
    return found


def strata(rows: int, samples: int, rng: np.random.Generator) -> Any:
    """A point in each of ``samples`` cells of the unit square, row after row."""
    side = math.isqrt(samples)
    i, j = np.divmod(np.arange(samples), side)
    u, v = rng.random((2, rows, samples))
    return mi.Point2f(((i + u) / side).ravel().astype(np.float32), ((j + v) / side).ravel().astype(np.float32))


def irradiance_at(case: dict[str, Any], samples: int, seed: int) -> NDArray[np.float64]:
    """Means of each pass."""
    scene, place = _light(case), _interaction(case)
    sample, weight = scene.sample_emitter_direction(place, strata(PASSES, samples, np.random.default_rng(seed)), True)
    cosine = dr.dot(mi.Vector3f(place.n), sample.d)
    dr.eval(weight, cosine)
    values = np.array(weight[0], dtype=np.float64) * np.maximum(np.array(cosine, dtype=np.float64), 0)
    return values.reshape(PASSES, -1).mean(axis=1)


def patches(job: dict[str, Any], folder: Path, progress: Callable[[int, int], None]) -> dict[str, NDArray[Any]]:
    """``mean`` and ``standard_error`` (n,) of the job's cases; NaN where Mitsuba refuses one or breaks on it."""
    cases = job["cases"]
    seeds = np.random.SeedSequence(job["seed"]).generate_state(len(cases))
    mean, error = np.full(len(cases), np.nan), np.full(len(cases), np.nan)
    for number, case in enumerate(cases):
        try:
            found = irradiance_at(case, job["samples"], int(seeds[number]))
        except RuntimeError:
            continue  # a singular transform: it says so, and that is its answer
        mean[number] = found.mean()
        error[number] = found.std(ddof=1) / np.sqrt(PASSES)
        progress(number + 1, len(cases))
    return {"mean": mean, "standard_error": error}
