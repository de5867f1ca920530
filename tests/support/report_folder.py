"""A folder of results as a run leaves it, made of arithmetic: no renderer is needed to test the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from nusselt.experiments.images.write import write_image
from nusselt.experiments.results.document import document, write_json
from nusselt.experiments.results.pictures import write_difference

HOSTILE = (
    "<script>window.hacked=1</script>",
    "\"><img src=x onerror='window.hacked=2'>",
    "</script><script>window.hacked=3</script>",
    "{{ 7 * 7 }}{% raise %} & <!--",
    "a\nb\x00\u202e=HYPERLINK(1)|`x`",
)
"""Names a scene file may have."""
SIZE = (48, 64)
RASTER = (
    np.add.outer(np.linspace(0.05, 1, SIZE[0]), np.linspace(0, 1, SIZE[1]))[None]
    * np.array([1, 0.7, 0.4])[:, None, None]
)
"""Radiance (3, h, w) of the scene "right"."""


def row(scene: str, verdict: str = "agrees", as_claimed: bool | None = True, bias: float = 1e-4, **more: Any) -> dict:
    """A row as the check writes it."""
    p = stats.uniform.rvs(size=(8, 8), random_state=7)
    return {
        **{"scene": scene, "estimator": "area", "claim": "unbiased", "samples": 16, "stratified": True, "passes": 4},
        **{"margin": 1e-3, "seed": 3, "command": f"nusselt check '{scene}'", "warnings": [f"{scene} is odd"]},
        "left_out": [{"what": "sphere intersections", "why": f"{scene} has no spheres"}],
        "pixels": {"shaded": 3072, "emitter": 0, "background": 0, "unjudged": 2},
        **{"bias": bias, "bias_relative": bias, "bias_interval": [bias - 4e-4, bias + 4e-4]},
        **{"minimum_detectable_bias": 1.7e-3, "rms": 0.02, "rms_relative": 0.03, "rms_denoised_relative": 0.0},
        **{"rms_denoised_interval": [0, 0.001], "variance": 1e-3, "non_finite": 0, "course_bias": 0.01},
        **{"course_mse": 0.9, "course_expected": {"bias": [-1, 1], "mse": [0.8, 1.0]}},
        **{"verdict": verdict, "as_claimed": as_claimed, "reason": f"because {scene} is so"},
        "reference": {"renderer": "mitsuba", "version": "3.9.1", "variant": "llvm_ad_rgb", "samples": 128},
        **{"tiles": (p - 0.5).tolist(), "tile_p": p.tolist(), "seconds": {"pilot": 0.1, "ours": 2.0, "reference": 1.0}},
        **more,
    }


def timed(scene: str, renderer: str, estimator: str, scale: float) -> list[dict]:
    """An experiment's rows: errors that fall with the root of samples, times that grow with them."""
    return [
        {
            **{"experiment": "error-against-time", "scene": scene, "renderer": renderer, "estimator": estimator},
            **{"samples": n, "rms_relative": 0.1 / n**0.5, "seconds": {"median": scale * n}, "seed": 3},
        }
        for n in (1, 4, 16, 64)
    ]


def write_images(folder: Path, name: str, ours: np.ndarray, reference: np.ndarray, z: np.ndarray) -> dict[str, str]:
    """Images beside `results.json`; returns the row's ``images``."""
    write_image(folder / name / "ours.exr", ours)
    write_image(folder / name / "ours.png", ours)
    write_image(folder / name / "reference.exr", reference)
    write_difference(folder / name / "difference.exr", z)
    names = ("ours.exr", "ours.png", "reference.exr", "difference.exr")
    return {n.replace(".", "_"): f"{name}/{n}" for n in names}


def small_folder(folder: Path) -> Path:
    """A right row, a wrong one with a pixel that is not a number, an undecided one, hostile names, two experiments."""
    z = np.random.default_rng(1).normal(size=SIZE)
    right, wrong = row("right"), row("wrong", "differs", False, 0.02)
    right["images"] = write_images(folder, "right", RASTER, RASTER * 1.001, z)
    broken = RASTER * 1.02
    broken[:, 5, 7] = np.nan
    wrong["images"] = write_images(folder, "wrong", broken, RASTER, np.where(np.isnan(broken[0]), 0, z + 5))
    unknown = row("unknown", "undecided", None)
    unknown |= {"bias_relative": None, "bias_interval": None, "minimum_detectable_bias": None, "rms_relative": None}
    unknown |= {"tiles": None, "tile_p": None, "course_mse": None}
    unknown["reference"] = {"renderer": None, "version": None, "variant": None, "samples": 0}
    rows = [right, wrong, unknown, *(row(name, bias=k * 1e-5) for k, name in enumerate(HOSTILE))]
    rows += [*timed("right", "ours", "area", 0.01), *timed("right", "mitsuba", "direct", 0.03)]
    rows += [{"experiment": "convergence", "scene": HOSTILE[0], "slope": -0.5, "interval": [-0.51, -0.49]}]
    hostile = '<svg xmlns="http://www.w3.org/2000/svg" width="40" height="20"><script>window.hacked=4</script>'
    hostile += '<image href="http://example.invalid/x.png"/><rect width="40" height="20" fill="teal"/></svg>'
    (folder / "convergence").mkdir()
    (folder / "convergence" / "slopes.svg").write_text(hostile)
    write_json(document(rows, alpha=1e-3), str(folder / "results.json"))
    return folder
