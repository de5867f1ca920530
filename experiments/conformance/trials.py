"""Everything that our estimators are tested by, as one list that any estimator is put through.

Each trial is a function of the estimator's class; it returns a sentence for what it found, or raises `Failed`.
Statistical ones have a false-alarm rate of 1e-6.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import stats

from nusselt.experiments.verdict.intervals import Bias, pooled_bias
from nusselt.renderer.estimators import Analytic, Area, Estimator
from nusselt.renderer.image import Image, render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene

from .scenes import DULL, SCENES, open_scene, shadow_scene

FALSE_ALARM = 1e-6
SAMPLES = 4
PASSES = 32
CLAIMS = ("exact", "unbiased", "consistent", "biased")

Kind = type[Estimator]


class Failed(Exception):
    """A trial that was not passed; the message says what was found."""


@dataclass(frozen=True)
class Outcome:
    """One trial's result."""

    trial: str
    passed: bool
    found: str


def _made(kind: Kind, samples: int = SAMPLES) -> Estimator:
    return kind(samples=samples, stratified=True)


def _random(estimator: Estimator, scene: Scene) -> bool:
    return estimator.is_random(prepare(scene).needs)


def _bias(image: Image, truth: Image, estimator: Estimator) -> Bias:
    """Of the mean over shaded pixels; by whole passes where those of one share their light points."""
    shaded = image.shaded
    step = (image.mean - truth.mean).mean(axis=0)[shaded]
    noise = image.pixel_variance[shaded] / image.pass_means.size
    return pooled_bias(step, noise, truth.pass_means, image.pass_means if estimator.shares_points else None)


def _off(image: Image, truth: Image, estimator: Estimator) -> tuple[float, bool]:
    """Pooled difference in standard errors of both, and whether it is too large; without noise, for rounding."""
    bias = _bias(image, truth, estimator)
    error, scale = float(bias.standard_error), float(np.abs(truth.mean).max())
    if error <= 1e-12 * scale:
        largest = float(np.abs(image.mean - truth.mean).mean(axis=0)[image.shaded].max(initial=0.0))
        return (math.inf, True) if largest > 1e-9 * scale else (0.0, False)
    return abs(float(bias.value)) / error, bool(np.abs(bias.value) > bias.half_width(FALSE_ALARM))


@lru_cache(maxsize=len(SCENES))
def _truth(name: str) -> Image:
    """A scene by area sampling with many points."""
    return render(SCENES[name], Area(samples=64, stratified=True), seed=99, passes=PASSES)


def protocol(kind: Kind) -> str:
    """Names, claims, shapes; the same seed gives the same bits; what comes in is left alone."""
    estimator = _made(kind)
    if not (isinstance(estimator.name, str) and estimator.name and isinstance(estimator.summary, str)):
        raise Failed("name and summary must be text")
    if not isinstance(estimator.shares_points, bool):
        raise Failed("shares_points must be a bool")
    if estimator.samples != SAMPLES:
        raise Failed(f"samples is {estimator.samples} after samples={SAMPLES}")
    for name, scene in SCENES.items():
        needs = prepare(scene).needs
        if estimator.claim(needs) not in CLAIMS:
            raise Failed(f"claims {estimator.claim(needs)!r} of {name}: one of {', '.join(CLAIMS)}")
        if not isinstance(estimator.is_random(needs), bool | np.bool_):
            raise Failed("is_random must be a bool")
    first, again = (render(shadow_scene(), estimator, seed=7, passes=2) for _ in range(2))
    if not np.array_equal(first.mean, again.mean):
        raise Failed("two renders with one seed differ: something random is not from rng")
    if not np.isfinite(first.mean).all() or first.mean.min() < -10 * abs(float(first.mean.max())):
        raise Failed("pixels that are not finite")
    other = render(shadow_scene(), estimator, seed=8, passes=2)
    if _random(estimator, shadow_scene()) == np.array_equal(first.mean, other.mean):
        raise Failed("is_random does not fit what two seeds give")
    return "names, shapes, one seed one image"


def oracles(kind: Kind) -> str:
    """Where nothing blocks: the closed forms, by what it claims."""
    worst = 0.0
    for glossy in (False, True):
        scene = open_scene(glossy)
        estimator = _made(kind)
        claim = estimator.claim(prepare(scene).needs)
        exact = render(scene, Analytic())
        passes = PASSES if _random(estimator, scene) else 1
        image = render(scene, estimator, seed=3, passes=passes)
        errors, is_off = _off(image, exact, estimator)
        off = float(np.abs(image.mean - exact.mean).max() / exact.mean.max())
        worst = max(worst, off)
        if claim == "exact" and off > 1e-9:
            raise Failed(f"claims exact; off the closed form by {off:.2e}")
        if claim == "unbiased" and is_off:
            raise Failed(f"claims unbiased; {errors:.1f} standard errors off the closed form")
        if claim == "consistent":
            _shrinks(kind, scene, exact)
    return f"the closed forms, within {worst:.1e} of the brightest value"


def planted_scenes(kind: Kind) -> str:
    """Blockers, horizons, every kind of light, tiny and huge: against area sampling with many points."""
    told = []
    for name, scene in SCENES.items():
        estimator = _made(kind)
        claim = estimator.claim(prepare(scene).needs)
        # Where a bias is admitted only its fall is judged, in renders of its own.
        passes = 1 if claim != "unbiased" else PASSES if estimator.shares_points else 8
        truth, image = _truth(name), render(scene, estimator, seed=1, passes=passes)
        if not np.isfinite(image.mean).all():
            raise Failed(f"{name}: pixels that are not finite")
        errors, is_off = _off(image, truth, estimator)
        if claim in ("exact", "unbiased") and is_off:
            raise Failed(f"{name}: claims {claim}; {errors:.1f} standard errors off area sampling")
        if claim == "consistent":
            _shrinks(kind, scene, truth)
        told.append(f"{name} {errors:.1f}" if math.isfinite(errors) else name)
    return "standard errors off area sampling: " + ", ".join(told)


def _root(image: Image, truth: Image) -> float:
    """RMS error of the limit of many passes: both sides' noise taken out."""
    s = image.shaded
    noise = sum(side.pixel_variance[s] / side.pass_means.size for side in (image, truth))
    square = (image.mean - truth.mean).mean(axis=0)[s] ** 2 - noise
    error = float(square.std()) / math.sqrt(square.size)
    return math.sqrt(max(float(square.mean()) - 3 * error, 0.0))


def _shrinks(kind: Kind, scene: Scene, truth: Image) -> None:
    """Of many no fewer samples in all than of few: the noise that is taken out is no larger there."""
    few, many = (_root(render(scene, _made(kind, n), seed=4, passes=passes), truth) for n, passes in ((1, 8), (16, 2)))
    if many > max(0.5 * few, 2e-3 * float(truth.mean.mean())):
        raise Failed(f"claims consistent; its bias went from {few:.2e} to {many:.2e} with 16 times the samples")


def convergence(kind: Kind) -> str:
    """The variance falls at least as fast as 1/N."""
    scene = shadow_scene(DULL)
    if not _random(_made(kind), scene):
        return "nothing is random"
    variances = {}
    for n in (1, 4, 16):
        image = render(scene, _made(kind, n), seed=5, passes=PASSES)
        variances[n] = float(image.pixel_variance[image.shaded].mean())
    if variances[16] <= 0:
        return "no noise at 16 samples"
    order = math.log(variances[16] / variances[1]) / math.log(16)
    # The mean of some hundred variances with 31 degrees of freedom each is known to a few percent.
    if order > -0.93:
        raise Failed(f"the variance falls as N^{order:.2f}; 1/N is the least")
    return f"the variance falls as N^{order:.2f}"


def independence(kind: Kind) -> str:
    """Passes do not share random numbers, nor do pixels unless it says so: then their mean varies as they say."""
    scene = shadow_scene(DULL)
    estimator = _made(kind)
    if not _random(estimator, scene):
        return "nothing is random"
    image = render(scene, estimator, seed=6, passes=128)
    steps = image.pass_means - image.pass_means.mean()
    serial = float((steps[1:] * steps[:-1]).sum() / (steps**2).sum())
    # The first autocorrelation of r independent passes has a standard deviation of 1/sqrt(r) (Bartlett 1946).
    if abs(serial) * math.sqrt(128) > stats.norm.isf(FALSE_ALARM / 2):
        raise Failed(f"passes are correlated with the next: {serial:+.2f}")
    s = image.shaded
    usual = float(image.pixel_variance[s].sum()) / int(s.sum()) ** 2
    ratio = float(image.pass_means.var(ddof=1)) / usual
    reach = stats.chi2.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], 127) / 127
    alike = reach[0] * 0.9 <= ratio <= reach[1] * 1.1
    if not alike and not estimator.shares_points:
        raise Failed(f"passes vary {ratio:.2f} times as much as independent pixels would")
    shared = "; its pixels share their light points" if estimator.shares_points else ""
    return f"passes vary {ratio:.2f} times as independent pixels would{shared}"


TRIALS: tuple[Callable[[Kind], str], ...] = (protocol, oracles, planted_scenes, convergence, independence)


def run_trial(trial: Callable[[Kind], str], kind: Kind) -> Outcome:
    """One trial; an estimator that raises has failed it."""
    name = trial.__name__.replace("_", " ")
    try:
        return Outcome(name, True, trial(kind))
    except Failed as failure:
        return Outcome(name, False, str(failure))
    except Exception as error:
        return Outcome(name, False, f"{type(error).__name__}: {error}")


def error_against_time(kind: Kind, scene: Scene, truth: Image, truth_passes: int) -> list[dict[str, Any]]:
    """RMS of one pass and its wall times, by samples; the first run apart."""
    rows = []
    for samples in (4, 16, 64):
        estimator = _made(kind, samples)
        seconds = []
        for seed in range(4):
            started = time.perf_counter()
            image = render(scene, estimator, seed=seed)
            seconds.append(time.perf_counter() - started)
        square = (image.mean - truth.mean).mean(axis=0)[image.shaded] ** 2
        left = float((square - truth.pixel_variance[image.shaded] / truth_passes).mean())
        rows.append({"samples": samples, "rms": math.sqrt(max(left, 0.0)), "first": seconds[0], "seconds": seconds[1:]})
    return rows
