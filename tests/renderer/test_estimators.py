"""Every estimator is held to what it claims: exact, unbiased, consistent or biased."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from builders import box, floor, lamp, scene
from scipy import stats

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import (
    ESTIMATORS,
    Analytic,
    Area,
    ControlVariate,
    Exact,
    VisibilityAnalytic,
    VisibilityCentre,
)
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.lights.sampling import random_beams
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid, Material

FALSE_ALARM = 1e-6
SHINY = Material((0.4, 0.3, 0.2), (0.3, 0.3, 0.3), 20.0)
LIGHTS = (
    lamp(2.0, 0.4),
    QuadLight((1.5, 1.0, -1.0), (0.1, 0.9, 0.2), (0.2, 0.1, 1.1), (3, 2, 1)),
    SunLight((1, 2, 1), (0.5, 0.5, 0.5), 5.0),
    PointLight((-1.5, 2, 1), (2, 2, 2)),
    DirectionalLight((-1, 3, -1), (0.2, 0.3, 0.4)),
)


def open_scene(material: Material = SHINY):
    """Lights over a floor, and nothing between: the point hangs lower than the lamp."""
    return scene(floor(material=material), lights=(lamp(), PointLight((-0.9, 1, 0.8), (2, 2, 2))), size=(24, 18))


def blocked_scene(material: Material = SHINY):
    ball = Ellipsoid.sphere((0.7, 0.4, 0.5), 0.4, material)
    things = (floor(material=material), box((-0.7, 0.3, -0.4), (0, 0.8, 0.3), material))
    return scene(*things, ellipsoids=(ball,), lights=LIGHTS, size=(24, 18))


def z_of_mean(image, passes: int, truth, truth_passes: int) -> float:
    """Pooled difference in standard errors of both; pixels are independent but for the image's clumping."""
    s = image.shaded
    noise = image.pixel_variance * image.clumping / passes + truth.pixel_variance / truth_passes
    return float((image.mean - truth.mean).mean(axis=0)[s].sum() / math.sqrt(noise[s].sum()))


@pytest.fixture(scope="module")
def truth():
    """Blocked, by many plain samples: what every unbiased estimator must average to."""
    return render(blocked_scene(), Area(samples=64, stratified=True), seed=99, passes=80)


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_where_nothing_blocks_exact_claims_have_no_noise_and_one_value(kind):
    made = open_scene(Material((0.5, 0.4, 0.3)))
    estimator = kind(samples=16, stratified=True)
    needs = prepare(made).needs
    assert not needs.visibility
    image = render(made, estimator, seed=3, passes=8)
    exact = render(made, Analytic())
    if estimator.claim(needs) == "exact":
        assert not estimator.is_random(needs)
        np.testing.assert_allclose(image.mean, exact.mean, rtol=1e-12)
    elif estimator.claim(needs) == "unbiased":
        assert 2 * stats.norm.sf(abs(z_of_mean(image, 8, exact, 1))) > FALSE_ALARM
    else:
        assert np.abs(image.mean / np.where(exact.mean > 0, exact.mean, 1) - (exact.mean > 0)).max() < 0.05


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_unbiased_claims_hold_behind_blockers(kind, truth):
    made = blocked_scene()
    estimator = kind(samples=16, stratified=True)
    needs = prepare(made).needs
    passes = 20 if estimator.is_random(needs) else 1
    image = render(made, estimator, seed=1, passes=passes)
    # A clumping is known from the passes alone.
    law = stats.norm if image.clumping == 1 else stats.t(passes - 1)
    p = 2 * law.sf(abs(z_of_mean(image, passes, truth, 80)))
    claim = estimator.claim(needs)
    assert claim in ("unbiased", "consistent", "biased")
    if claim == "unbiased":
        assert p > FALSE_ALARM
    if claim == "biased":
        assert p < FALSE_ALARM  # light through walls is seen


@dataclass(frozen=True, kw_only=True)
class MeanVisibility(VisibilityAnalytic):
    """What never to do: the whole light's closed form times the mean of V."""

    name: ClassVar[str] = "mean-visibility"

    def __call__(self, points, source, rng):
        d, _ = random_beams(source.light, points.position, rng, self.samples, True)
        seen = source.blockers.visible(points.position, points.ellipsoid, d, source.light.at_infinity)
        return without_shadows(points, source) * seen.mean(axis=1)


def half_hidden():
    """A wide light close over a floor, half of it behind a slab's edge: what is hidden differs from what is near."""
    light = QuadLight((-1.5, 0.8, -1.5), (0, 0, 3), (3, 0, 0), (1, 1, 1))
    slab = box((0, 0.3, -4), (4, 0.35, 4))
    view = Camera((-1.5, 0.25, 0), (0, 0.1, 0), (0, 1, 0), 40)
    return scene(floor(1.5), slab, lights=(light,), size=(12, 9), camera=view)


@pytest.fixture(scope="module")
def errors():
    """Root mean square error of the mean image, relative to the mean, by estimator and samples."""
    made = half_hidden()
    exact = render(made, Exact())
    s = exact.shaded

    def error(kind, samples: int) -> float:
        passes = 2_000 // samples
        image = render(made, kind(samples=samples), seed=6, passes=passes)
        off = (image.mean - exact.mean).mean(axis=0)[s] ** 2 - image.pixel_variance[s] / passes
        return math.sqrt(max(float(off.mean()), 0.0)) / float(exact.mean.mean(axis=0)[s].mean())

    kinds = (VisibilityCentre, VisibilityAnalytic, MeanVisibility)
    return {(kind.name, n): error(kind, n) for kind in kinds for n in (4, 16, 256)}


@pytest.mark.parametrize("kind", [VisibilityCentre, VisibilityAnalytic])
def test_consistent_claims_converge(kind, errors):
    """The error that no pass removes falls as the strata shrink."""
    assert errors[kind.name, 16] < errors[kind.name, 4] / 1.5
    assert errors[kind.name, 256] < errors[kind.name, 4] / 10


def test_the_mean_of_visibility_leaves_an_error_that_no_sample_removes(errors):
    assert errors[MeanVisibility.name, 256] > 0.03
    assert errors[MeanVisibility.name, 256] > errors[MeanVisibility.name, 4] / 2
    assert errors[VisibilityAnalytic.name, 256] < errors[MeanVisibility.name, 256] / 10


def test_control_variate_has_no_noise_where_lit_and_no_more_than_plain_sampling_elsewhere():
    made = blocked_scene(Material((0.5, 0.5, 0.5)))
    plain = render(made, Area(samples=16, stratified=True), seed=1, passes=30)
    control = render(made, ControlVariate(samples=16, stratified=True), seed=1, passes=30)
    lit = control.pixel_variance[control.shaded] < 1e-24
    assert 0.3 < lit.mean() < 0.95
    assert control.pixel_variance.sum() < plain.pixel_variance.sum()


def test_leaving_out_changes_no_estimator():
    made = blocked_scene()
    for kind in ESTIMATORS:
        few = render(made, kind(samples=4, stratified=True), seed=8)
        everything = render(made, kind(samples=4, stratified=True), seed=8, everything=True)
        np.testing.assert_allclose(few.mean, everything.mean, rtol=1e-12, atol=1e-15, err_msg=kind.name)


@pytest.mark.parametrize("kind", [VisibilityCentre, VisibilityAnalytic])
def test_strata_must_fill_a_square(kind):
    with pytest.raises(InputError, match="square"):
        kind(samples=5)
