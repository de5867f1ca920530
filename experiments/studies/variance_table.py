"""Which estimator is the least noisy for its price: bias, variance, RMS, slope, cost and efficiency, scene by scene.

Ours and Mitsuba's samplers, for the same scenes and numbers of samples. Efficiency is 1/(variance x seconds) of an
image. Rows of one scene and number of samples whose efficiency cannot be told from the best's are ties.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Group
from scipy import stats

from nusselt.experiments.check.check import seeds
from nusselt.experiments.check.expectations import appearance
from nusselt.experiments.results.exports.markdown import table_lines
from nusselt.experiments.results.figures import curves
from nusselt.experiments.results.study_tables import table
from nusselt.experiments.results.work_precision import slope
from nusselt.experiments.runs.experiment import NONE_OWN, Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.own import Own, OwnRenderer
from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.scenes.sizes import at_width
from nusselt.experiments.verdict.intervals import Bias, freedom_of, pooled_bias
from nusselt.mitsuba_bridge.reference import Reference, render_reference
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.mitsuba_bridge.variance import SAMPLERS, Setting, Spread, measure_spread
from nusselt.renderer.estimators import ESTIMATORS, Estimator
from nusselt.renderer.image import Image, render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

SCENES = ("quad-stratified", "three-lights", "cornell-boxes", "glossy")
SAMPLES = (4, 16, 64)
PASSES = 8
WIDTH = 64
LEVEL = 1e-2
"""Of every interval."""
ERROR = 1e-4
"""Relative standard error of the reference's mean."""


@dataclass(frozen=True)
class Method:
    """An estimator of ours, or a sampler of Mitsuba's, at a number of samples."""

    renderer: str
    name: str
    samples: int
    estimator: Estimator | None = None
    program: OwnRenderer | None = None

    @property
    def title(self) -> str:
        return f"Mitsuba {self.name}" if self.renderer == "mitsuba" else self.name


def own_methods(own: Own, scene: Scene, samples: int) -> list[Method]:
    """The user's estimators, which our renderer runs, and the user's renderers."""
    ways = [(name, make) for one in own.estimators for name, make in one.ways(scene).items()]
    found = [Method("ours", name, samples, make(samples)) for name, make in ways]
    return found + [Method("program", one.name, samples, program=one) for one in own.renderers]


def methods(samples: int) -> list[Method]:
    """Ours, random and stratified where that is a choice, and Mitsuba's samplers."""
    found = []
    for kind in ESTIMATORS:
        for stratified in (False, True):
            estimator = kind(samples=samples, stratified=stratified)
            one_way = kind.name not in ("area", "control-variate")
            if not (one_way and stratified):
                suffix = "" if one_way else " stratified" if stratified else " random"
                found.append(Method("ours", kind.name + suffix, samples, estimator))
    return found + [Method("mitsuba", sampler, samples) for sampler in SAMPLERS]


@dataclass(frozen=True)
class Measured:
    """Passes of one method.

    Parameters
    ----------
    mean, variance : (n,) float64
        Of each judged pixel.
    pass_means, squares : (r,) float64
        Each pass's mean over the pixels, and its mean square about the pixels' means: an estimate of the variance.
    seconds : (r,) float64
    shares_points : bool
        Whether pixels share their light points: then only whole passes are independent.
    """

    mean: Floats
    variance: Floats
    pass_means: Floats
    squares: Floats
    seconds: Floats
    shares_points: bool = False


def measure_ours(scene: Scene, estimator: Estimator, judged: Bools, seed: int, passes: int) -> Measured:
    """Passes timed one by one, the first apart; one where nothing is random."""
    needs = prepare(scene).needs
    count = passes if estimator.is_random(needs) else 1
    render(scene, estimator, seed=seed)  # fills caches
    images, seconds = [], []
    for number in range(count):
        started = time.perf_counter()
        image: Image = render(scene, estimator, seed=seed + 1 + number)
        seconds.append(time.perf_counter() - started)
        images.append(image.mean.mean(axis=0)[judged])
    return measured_of(np.array(images), np.array(seconds), estimator.shares_points)


def measure_program(
    scene: Scene, program: OwnRenderer, samples: int, judged: Bools, seed: int, passes: int
) -> Measured:
    """A program's images, each a pass; nothing is known of its pixels, so that only whole images are independent."""
    with program.opened(scene) as image:
        made = [image(samples, seed + number) for number in range(passes)]
    values = np.array([radiance.mean(axis=0)[judged] for radiance, _ in made])
    return measured_of(values, np.array([seconds for _, seconds in made]), shares_points=True)


def measured_of(passes: Floats, seconds: Floats, shares_points: bool) -> Measured:
    """From passes (r, n) over the judged pixels."""
    mean, free = passes.mean(axis=0), max(len(passes) - 1, 1)
    off = (passes - mean) ** 2
    squares, variance = off.mean(axis=1) * len(passes) / free, off.sum(axis=0) / free
    return Measured(mean, variance, passes.mean(axis=1), squares, seconds, shares_points)


def of_mitsuba(spread: Spread, judged: Bools) -> Measured:
    """Mitsuba's passes; the first, which compiles, is left out of the times."""
    mean, variance = spread.mean[judged], spread.variance[judged]
    return Measured(mean, variance, spread.pass_means, np.full(1, variance.mean()), spread.seconds[1:])


def row_of(scene: Scene, method: Method, found: Measured, reference: Reference, judged: Bools) -> dict[str, Any]:
    """Bias and variance with their intervals, RMS error, cost and efficiency."""
    truth = reference.mean.mean(axis=0)[judged]
    scale = float(truth.mean())
    passes, count = found.pass_means.size, found.variance.size
    bias = bias_of(found, truth, reference.pass_means)
    variance = float(found.variance.mean())
    low, high = variance_interval(found)
    square = float(((found.mean - truth) ** 2).mean()) - float((reference.pixel_standard_error[judged] ** 2).mean())
    rms = math.sqrt(max(square - variance / passes + variance, 0.0))  # of one pass: its bias and its variance
    seconds = float(np.median(found.seconds))
    claim = "unbiased" if method.estimator is None else method.estimator.claim(prepare(scene).needs)
    return {
        "scene": scene.name,
        "estimator": method.title,
        "renderer": method.renderer,
        "claim": claim,
        "samples": method.samples,
        "passes": passes,
        "bias_relative": bias.value / scale,
        "bias_interval": [(bias.value + sign * bias.half_width(LEVEL)) / scale for sign in (-1, 1)],
        "bias_standard_error": bias.standard_error / scale,
        "bias_freedom": bias.freedom,
        "variance": variance,
        "variance_interval": [low, high],
        "rms_relative": rms / scale,
        "seconds": found.seconds.tolist(),
        "seconds_per_sample": seconds / (method.samples * count),
        "efficiency": 1 / (variance * seconds) if variance > 0 else None,
        "efficiency_interval": [1 / (high * seconds), 1 / (low * seconds)] if low > 0 else None,
        "as_claimed": _holds(claim, bias),
    }


def bias_of(found: Measured, truth: Floats, reference_passes: Floats) -> Bias:
    """Over the judged pixels (n,)."""
    ours = found.pass_means if found.shares_points else None
    return pooled_bias(found.mean - truth, found.variance / found.pass_means.size, reference_passes, ours)


def _holds(claim: str, bias: Bias) -> bool:
    """Whether no bias is seen, at 1e-6, where none is claimed; the verdict on a margin is the main job's."""
    return claim in ("biased", "consistent") or bool(np.abs(bias.value) <= bias.half_width(1e-6))


def variance_interval(found: Measured) -> tuple[float, float]:
    """Of the mean variance over pixels, on a logarithmic scale.

    By the spread over pixels, each an estimate; where pixels share their light points, by the spread over passes.
    """
    parts, free = (found.squares, found.squares.size - 1.0) if found.shares_points else (found.variance, 0.0)
    mean = float(parts.mean())
    if mean == 0:
        return 0.0, 0.0
    error = float(parts.std(ddof=1)) / mean / math.sqrt(parts.size)
    reach = float(stats.t.isf(LEVEL / 2, max(free or freedom_of(parts) - 1, 1.0))) * error
    return mean * math.exp(-reach), mean * math.exp(reach)


def add_slopes(rows: Sequence[dict[str, Any]]) -> None:
    """Log RMS against log samples, over all rows of a scene and method, with its interval, on each of them."""
    for row in rows:
        line = [r for r in rows if (r["scene"], r["estimator"]) == (row["scene"], row["estimator"])]
        points = [(r["samples"], r["rms_relative"]) for r in line if r["rms_relative"] > 0]
        row["slope"], row["slope_interval"] = None, None
        if len({x for x, _ in points}) >= 3 and row["variance"] > 0:
            row["slope"], *row["slope_interval"] = slope(*zip(*points, strict=True))


def mark_ties(rows: Sequence[dict[str, Any]]) -> None:
    """``best`` on the most efficient row of a scene and number of samples, ours and Mitsuba's apart, and its ties.

    Times of two renderers are not compared here; an image without noise and without bias is beyond efficiency.
    """
    for row in rows:
        peers = [r for r in rows if all(r[k] == row[k] for k in ("scene", "samples", "renderer")) and r["efficiency"]]
        best = max(peers, key=lambda r: r["efficiency"], default=None)
        row["best"] = bool(
            row["efficiency"]
            and best
            and row["efficiency_interval"]
            and best["efficiency_interval"]
            and row["efficiency_interval"][1] >= best["efficiency_interval"][0]
        )


def scene_rows(
    scene: Scene, samples: Sequence[int], passes: int, seed: int, timeout: float, own: Own = NONE_OWN
) -> list[dict[str, Any]]:
    """All rows of a scene, the user's among them.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba's LLVM variant cannot run here.
    """
    _, ours_seed, their_seed = seeds(seed, scene.name, "variance-table")
    reference = render_reference(
        appearance(scene), seed=their_seed, target_relative_se=ERROR, max_samples=1 << 15, timeout=timeout
    )
    chosen = [method for count in samples for method in (*methods(count), *own_methods(own, scene, count))]
    theirs = [method for method in chosen if method.renderer == "mitsuba"]
    settings = [Setting(method.name, method.samples, passes + 1) for method in theirs]
    spreads = dict(zip(theirs, measure_spread(scene, settings, seed=their_seed + 1, timeout=timeout), strict=True))
    seen = render(scene, ESTIMATORS[0](), tolerance=ray_tolerance(scene))
    judged = seen.shaded & ~seen.unjudged & (reference.emitter == 0) & (reference.background == 0)
    rows = []
    for method in chosen:
        if method.program is not None:
            found = measure_program(scene, method.program, method.samples, judged, ours_seed + 1, passes)
        elif method.estimator is None:
            found = of_mitsuba(spreads[method], judged)
        else:
            found = measure_ours(scene, method.estimator, judged, ours_seed, passes)
        rows.append(row_of(scene, method, found, reference, judged))
    add_slopes(rows)
    mark_ties(rows)
    return rows


def scene_job(scene: Scene, samples: tuple[int, ...], passes: int, seed: int, own: Own) -> Outcome:
    """All rows of a scene."""
    return Outcome(scene_rows(scene, samples, passes, seed, 600.0, own))


def jobs(settings: Settings) -> list[Job]:
    """A scene each, one at a time: they are timed."""
    quick, tiny = (SCENES[1:3], SAMPLES[:2], WIDTH // 2, PASSES), (SCENES[:1], SAMPLES[:1], 8, 3)
    names, samples, width, passes = settings.pick((SCENES, SAMPLES, WIDTH, PASSES), quick, tiny)
    shared = {"samples": samples, "passes": passes, "seed": settings.seed, "own": settings.own}
    return [
        Job(scene_job, {"scene": at_width(load(name), width), **shared}, alone=True)
        for name in settings.scenes or names
    ]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """RMS error against seconds, a figure a scene."""
    found = {}
    for outcome in outcomes:
        lines: dict[str, tuple[list[float], list[float]]] = {}
        for row in outcome.rows:
            if row["variance"] > 0:
                xs, ys = lines.setdefault(row["estimator"], ([], []))
                xs.append(float(np.median(row["seconds"])))
                ys.append(row["rms_relative"])
        scene = outcome.rows[0]["scene"]
        found[scene] = curves(lines, "seconds of an image", "relative RMS of a pixel", f"{scene}: error against time")
    return found


HEADER = (
    "scene",
    "N",
    "method",
    "bias %",
    "+-",
    "variance",
    "+- %",
    "RMS %",
    "slope",
    "ns/sample",
    "efficiency",
    "best",
)


def cells(row: dict[str, Any]) -> list[str]:
    """One row for the terminal and Markdown."""
    low, high = row["bias_interval"]
    reach = (row["variance_interval"][1] / row["variance"] - 1) if row["variance"] else 0.0
    slope = row["slope"]
    return [
        row["scene"],
        str(row["samples"]),
        row["estimator"],
        f"{100 * row['bias_relative']:+.3f}",
        f"{50 * (high - low):.3f}",
        f"{row['variance']:.3g}",
        f"{100 * reach:.1f}",
        f"{100 * row['rms_relative']:.3f}",
        "" if slope is None else f"{slope:.2f}",
        f"{1e9 * row['seconds_per_sample']:.0f}",
        "no noise" if row["efficiency"] is None else f"{row['efficiency']:.3g}",
        "*" if row["best"] else "",
    ]


def variance_table(rows: Sequence[dict[str, Any]], width: int) -> Group:
    """For the terminal."""
    caption = (
        "bias and RMS in % of the reference's mean; intervals at 99 %; * the most efficient of its renderer, scene and "
        "N, or not to be told from it."
    )
    lines = [dict(zip(HEADER, cells(row), strict=True)) for row in rows]
    return table(lines, "Variance of estimators, ours and Mitsuba's samplers", width, caption=caption)


def markdown(rows: Sequence[dict[str, Any]]) -> str:
    """The same as a Markdown table."""
    return "".join(f"{line}\n" for line in table_lines(HEADER, map(cells, rows)))


VARIANCE_TABLE = Experiment(
    "variance-table",
    "bias, variance, slope and efficiency of every estimator and of Mitsuba's samplers",
    jobs,
    figures,
    SCENES,
    table=variance_table,
    text=markdown,
    takes_own=True,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(VARIANCE_TABLE)
