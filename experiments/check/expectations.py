"""What is known of a row before its data: whether pixels share their light points, Mitsuba's own variance for the
same strategy, and where its ray offset is known to be wrong.
"""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from nusselt.experiments.verdict.evidence import Expectations
from nusselt.mitsuba_bridge.lights import strata_alike
from nusselt.mitsuba_bridge.origin import own_file
from nusselt.mitsuba_bridge.ray_offset import mitsuba_offset
from nusselt.mitsuba_bridge.reference import Reference, ReferenceUnavailable
from nusselt.mitsuba_bridge.variance import Setting, measure_spread
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Area, Estimator, SolidAngle
from nusselt.renderer.image import render
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats
from nusselt.renderer.visibility.ray_offset import RayOffset

from .ceiling import grain_of_reference, sample_ceilings
from .unlit import unlit


def appearance(scene: Scene) -> Scene:
    """The scene without what only our estimators read: scenes that look alike share a reference."""
    return scene.with_(integrator="direct", light_samples=1, stratify=False, name="", output="", warnings=())


STRATEGIES = {("area", False): "independent", ("area", True): "stratified"}
"""Mitsuba's sampler that draws points on a light as (estimator, stratified) of ours does."""
PATHS = 1 << 25
"""Paths, at most, over pixels, samples and passes, from which its variance is measured."""
PASSES = (4, 32)
SURFACES = 2000
"""Above so many triangles the offset's effect is not predicted: it looks at all of them for every ray."""


def same_strategy(scene: Scene, estimator: Estimator) -> str | None:
    """Mitsuba's sampler for the same strategy; None where it has none.

    Nor has it strata like ours on every light, nor textures where it is not the file itself that is rendered.
    """
    if scene.spp > 1 or scene.is_textured or (estimator.stratified and not all(map(strata_alike, scene.lights))):
        return None
    return STRATEGIES.get((estimator.name, estimator.stratified))


def mitsuba_variance(scene: Scene, estimator: Estimator, seed: int, timeout: float) -> Floats | None:
    """Variance (h, w) of Mitsuba's image for the same strategy and samples; None where there is nothing to compare."""
    needs = prepare(scene).needs
    sampler = same_strategy(scene, estimator)
    if sampler is None or not estimator.is_random(needs):
        return None
    # Independent samples: N of them have 1/N of the variance of one, and fewer are cheaper.
    samples = estimator.samples if sampler == "stratified" else min(estimator.samples, 4)
    passes = PATHS // (scene.width * scene.height * samples)
    if passes < PASSES[0]:
        return None
    try:
        setting = Setting(sampler, samples, min(passes, PASSES[1]))
        found = measure_spread(scene, [setting], seed=seed, timeout=timeout)[0]
    except ReferenceUnavailable:
        return None  # the reference itself will say so
    return found.variance * samples / estimator.samples


def offset_of(scene: Scene) -> RayOffset | None:
    """The rule of Mitsuba's shadow rays; None where nothing can be shadowed, or the rule is not known."""
    _, geometry, needs = prepare(scene)
    if not needs.visibility or geometry.triangles > SURFACES:
        return None
    try:
        return mitsuba_offset(scene, normalise=own_file(scene) is None)
    except (ReferenceUnavailable, InputError):
        return None


def shadow_offset(scene: Scene, seed: int, executor: Executor | None = None) -> Floats | None:
    """The bias (h, w), radiance, that Mitsuba's rule brings: an image with it minus one without.

    Both images have the same random numbers, so that only the rays that the rule moves past an edge differ.
    """
    rule = offset_of(scene)
    if rule is None:
        return None
    rays = scene.width * scene.height * max(len(scene.lights), 1)
    side = math.isqrt(max(1, min(64, (1 << 24) // (rays * 4))))
    estimator = Area(samples=side * side, stratified=True)
    return np.asarray(moved_by(rule, scene, estimator, seed, executor).mean(axis=0))


def moved_by(rule: RayOffset, scene: Scene, estimator: Estimator, seed: int, executor: Executor | None) -> Floats:
    """An image of ours with a rule of shadow rays less one without it, the same random numbers in both; (3, h, w)."""
    plain = render(scene, estimator, seed=seed, executor=executor)
    moved = render(scene, estimator, seed=seed, executor=executor, offset=rule)
    return np.where(plain.shaded, moved.mean - plain.mean, 0.0)


Offsets = dict[tuple[str, int], Floats | None]


def expectations_of(
    scene: Scene,
    estimator: Estimator,
    seed: int,
    timeout: float,
    executor: Executor | None,
    kept: Offsets | None = None,
) -> Expectations:
    """All of it but the grains, with seeds of its own; the offsets of scenes already seen are ``kept``."""
    first, second = (int(state) for state in np.random.SeedSequence([seed, 0x9E3779B9]).generate_state(2))
    kept = {} if kept is None else kept
    key = (appearance(scene).digest(), second)
    if key not in kept:
        kept[key] = shadow_offset(scene, second, executor)
    variance = mitsuba_variance(scene, estimator, first, timeout)
    sampled = scene.spp > 1 or estimator.is_random(prepare(scene).needs)
    return Expectations(estimator.shares_points, variance, kept[key], np.full((scene.height, scene.width), sampled))


def with_grains(
    expectations: Expectations, scene: Scene, estimator: Estimator, passes: int, reference: Reference
) -> Expectations:
    """The same with what one sample can bring to either side, where our estimator is one of ours: see `Side`."""
    if not reference.pass_means.any():
        expectations = replace(expectations, dark="; ".join(unlit(scene)))
    if type(estimator) not in ESTIMATORS:
        return expectations
    ceilings = sample_ceilings(appearance(scene))
    own = sample_ceilings(appearance(scene), solid=True) if isinstance(estimator, SolidAngle) else ceilings
    ours = (scene.spp if scene.spp > 1 else estimator.samples) * passes
    return replace(
        expectations,
        # Points in common meet many pixels at once: how much their passes differ tells their noise.
        grain=None if estimator.shares_points else own.max(axis=0, initial=0.0) / ours,
        reference_grain=grain_of_reference(ceilings, reference),
    )
