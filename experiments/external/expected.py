"""What a right image of a scene scores: our own renders of the same estimator at some of its pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from nusselt.experiments.check.question import Question
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.verdict.course import SURE
from nusselt.experiments.verdict.quantiles import normal_quantile
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats
from nusselt.renderer.words import count

from .diagnosis.probe import LOOK, Probe, Sight

PASSES = 8


@dataclass(frozen=True)
class Renders:
    """Passes of an estimator at some pixels.

    Parameters
    ----------
    passes : (p, 3, n) float64
        Radiance.
    deviation : (3, h, w) float64
        Standard deviation of one pass; what was not rendered takes its neighbour's.
    pixel_variance : (h, w) float64
        Variance of the channels' average.
    pixels : (n,) int64
        Row-major numbers of the pixels.
    """

    passes: Floats
    deviation: Floats
    pixel_variance: Floats
    pixels: np.ndarray


def supposed_sampling(scene: Scene, question: Question) -> tuple[Estimator, int]:
    """The estimator whose noise an image is supposed to have, and camera rays a pixel.

    A scene that says ``spp`` says how many rays take all their light samples each. Where pixels were asked to be areas,
    every sample is supposed to be a camera ray of its own, as in a path tracer.
    """
    estimator = question.of(scene)
    if scene.spp > 1 and question.pixel_rule == "area":
        return type(estimator)(samples=1, stratified=False), estimator.samples
    return estimator, scene.spp


def described(estimator: Estimator) -> str:
    """An estimator's name and samples."""
    kind = "stratified sample" if estimator.stratified else "sample"
    return f"{estimator.name}, {count(estimator.samples, kind)} per light"


def own_renders(scene: Scene, estimator: Estimator, rays: int, seed: int = 1) -> Renders:
    """Render some pixels of a scene some times with an estimator, through their centres or (rays > 1) their boxes."""
    samples = estimator.samples * rays
    probe = Probe(scene, samples, estimator.stratified)
    random = scene.spp > 1 or estimator.is_random(prepare(scene).needs)
    passes = np.stack(
        [_pass(probe, estimator, rays, np.random.default_rng([seed, k])) for k in range(PASSES if random else 1)]
    )
    deviation, variance = _noise(passes)
    numbers = (probe.rows * scene.width + probe.columns).ravel()
    return Renders(passes, probe.spread_out(deviation), probe.spread_out(variance), numbers)


def _noise(passes: Floats) -> tuple[Floats, Floats]:
    if len(passes) == 1:
        return np.zeros(passes.shape[1:]), np.zeros(passes.shape[2:])
    return passes.std(axis=0, ddof=1), passes.mean(axis=1).var(axis=0, ddof=1)


def _pass(probe: Probe, estimator: Estimator, rays: int, rng: np.random.Generator) -> Floats:
    if probe.scene.spp == 1:
        return _shaded(probe, probe.sight, estimator, rng)
    total = np.zeros((3, probe.x.size))
    for _ in range(rays):
        u, v = rng.random((2, probe.x.size)) - 0.5
        total += _shaded(probe, probe.look(probe.x + u, probe.y + v), estimator, rng)
    return total / rays


def _shaded(probe: Probe, sight: Sight, estimator: Estimator, rng: np.random.Generator) -> Floats:
    out = sight.emission.copy()
    needs = prepare(probe.scene).needs
    for start in range(0, sight.points.count, LOOK):
        some = np.arange(start, min(start + LOOK, sight.points.count))
        points = sight.points.take(some)
        out[:, sight.lit[some]] += reflected(points, needs, partial(estimator, rng=rng))
    return out


@dataclass(frozen=True)
class Scores:
    """The course's two scores of an image, in 8-bit levels and levels squared."""

    bias: float
    mse: float


def course_scores(levels: Floats, truth: Floats, blur: float = 0.0) -> Scores:
    """Bias and "variance" of eight-bit levels (3, n) against a reference in the course's own eight bits.

    Parameters
    ----------
    truth : (3, n) float64
        Radiance of the reference: clamped, times 255 and truncated here, as the course's own image is.
    blur : float
        Mean variance of the reference's own noise, levels squared, taken out.
    """
    step = to_levels(truth).astype(np.float64) - levels
    return Scores(float(step.mean()), max(float((step * step).mean()) - blur, 0.0))


def expected_scores(renders: Renders, truth: Floats, blur: float, size: int) -> dict[str, tuple[float, float]]:
    """The interval each score of a right image of ``size`` pixels falls into.

    Parameters
    ----------
    truth : (3, n) float64
        At the renders' pixels.
    """
    steps = to_levels(truth).astype(np.float64) - np.stack([to_levels(one) for one in renders.passes])
    sigmas = normal_quantile(SURE / 2)
    found = {}
    for name, values, less in (("bias", steps, 0.0), ("mse", steps * steps, blur)):
        of_pixels = values.mean(axis=1)  # channels share their light samples
        whole = of_pixels.mean(axis=0)
        error = math.sqrt(float(whole.var()) / whole.size + float(of_pixels.var()) / size)
        centre = float(values.mean()) - less
        found[name] = (centre - sigmas * error, centre + sigmas * error)
    found["mse"] = (max(found["mse"][0], 0.0), found["mse"][1])
    return found
