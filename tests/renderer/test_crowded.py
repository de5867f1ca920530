"""Pixels by area in scenes of big meshes: sampled with the light where small triangles are seen."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from builders import scene
from test_coverage import relative

from nusselt.experiments.studies.race.scenes import bumpy_ball_scene
from nusselt.renderer.camera import rays as camera
from nusselt.renderer.camera import view
from nusselt.renderer.estimators import Analytic, Exact
from nusselt.renderer.image import render
from nusselt.renderer.pixels import render_area, render_centre
from nusselt.renderer.pixels import supersampling as crowded
from nusselt.renderer.prepared import prepare
from nusselt.renderer.visibility.segments import small_triangles


@pytest.fixture(scope="module")
def ball():
    return bumpy_ball_scene().with_(width=40, height=40)


@pytest.fixture
def sampled(monkeypatch):
    """As if two thousand triangles were many."""
    monkeypatch.setattr(crowded, "MANY", 1000)


def test_all_pixels_that_see_a_small_triangle_are_touched(ball):
    geometry = prepare(ball).geometry
    tree = small_triangles(geometry)
    found = crowded.touched(ball, geometry)
    x, y = camera.pixel_centres(range(40), range(40))
    for u, v in np.random.default_rng(1).random((16, 2)) - 0.5:
        seen = np.isin(view.look(ball, geometry, x + u, y + v).hits.triangle, tree.triangles)
        assert seen.sum() > 100
        assert found.ravel()[seen].all()
    assert found.mean() < 0.5
    assert not crowded.touched(scene(), prepare(scene()).geometry).any()


def test_the_error_estimated_holds_against_pixels_that_were_cut(ball, sampled):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(crowded, "MANY", 20_000)
        truth = render_area(ball, Exact(), tolerance=1e-3)
        assert truth.pieces > 1000
    judged = (truth.image.emitter == 0) & (truth.image.background < 1)
    errors = []
    for tolerance in (2e-2, 5e-3):
        found = render_area(ball, Exact(), tolerance=tolerance)
        assert found.pieces == 0  # the fixture
        assert found.error <= tolerance
        error = relative(found.image.mean, truth.image.mean, judged)
        # The estimate is of hundreds of pixels: a quarter of it is many standard errors; the truth's own error beside.
        assert error <= 1.25 * found.error + 1e-3
        assert np.allclose(found.image.background, truth.image.background, atol=0.2)
        errors.append(error)
    assert errors[1] < errors[0] / 2


def test_a_wrong_light_is_seen(ball, sampled, monkeypatch):
    """The planted defect: nothing is hidden in what is sampled."""
    right = render_area(ball, Exact(), tolerance=2e-2).image.mean
    monkeypatch.setattr(crowded, "hidden_from", lambda points, source, at, of: np.zeros((3, points.count)))
    wrong = render_area(ball, Exact(), tolerance=2e-2).image.mean
    assert relative(wrong, right, np.ones(right.shape[1:], dtype=bool)) > 5e-2


@pytest.mark.parametrize("tolerance", [3e-2, 5e-3])
def test_sampled_shadows_of_centres_are_within_what_is_said(ball, sampled, tolerance):
    every = render(ball, Exact())
    some = render_centre(ball, Exact(), tolerance=tolerance)
    error = relative(some.image.mean, every.mean, every.shaded)
    assert 0 < error <= some.error <= tolerance


def test_no_centre_is_sampled_where_little_may_be_lost_or_shadows_are_left_out(ball, sampled, monkeypatch):
    monkeypatch.setattr(crowded, "hidden_from", lambda points, source, at, of: np.full((3, points.count), 1e3))
    assert render_centre(ball, Exact(), tolerance=1e-2).image.mean.min() < 0  # the control
    for estimator, tolerance in ((Exact(), 1e-3), (Analytic(), 1e-2)):
        assert render_centre(ball, estimator, tolerance=tolerance).image.mean.min() >= 0


def test_a_pixel_whose_shadow_light_points_cannot_tell_is_evaluated(ball, sampled, monkeypatch):
    """The planted defect: what light points say has nothing to do with the shadow."""
    noise = np.random.default_rng(3)
    monkeypatch.setattr(
        crowded, "hidden_from", lambda p, source, at, of: noise.uniform(-2, 2, (1, p.count)) * np.ones((3, 1))
    )
    every = render(ball, Exact())
    some = render_centre(ball, Exact(), tolerance=5e-3)
    assert relative(some.image.mean, every.mean, every.shaded) <= 5e-3


def test_the_executor_changes_no_bit(ball, sampled):
    here = render_area(ball, Exact(), tolerance=1e-2)
    with ThreadPoolExecutor(3) as pool:
        there = render_area(ball, Exact(), tolerance=1e-2, executor=pool)
    assert np.array_equal(here.image.mean, there.image.mean)
    assert here.evaluations == there.evaluations
    with ThreadPoolExecutor(3) as pool:
        centres = [render_centre(ball, Exact(), tolerance=1e-2, executor=one).image.mean for one in (None, pool)]
    assert np.array_equal(*centres)


def test_rays_that_come_in_frames_meet_what_they_meet_one_by_one(ball):
    geometry = prepare(ball).geometry
    row, across = np.divmod(np.flatnonzero(crowded.touched(ball, geometry)), ball.width)
    x, y = np.random.default_rng(2).random((2, 5, 1))
    together = view.look(ball, geometry, (across + x).ravel(), (row + y).ravel(), 5).hits
    apart = [view.look(ball, geometry, across + u, row + v).hits for u, v in zip(x, y, strict=True)]
    assert np.unique(together.triangle).size > 500
    for name in ("triangle", "distance", "position"):
        assert np.array_equal(getattr(together, name), np.concatenate([getattr(h, name) for h in apart], axis=-1))


def test_those_go_on_that_lower_an_error_most_for_their_frames():
    variance, frames = np.array([1.0, 1.0, 1e-6, 4.0]), np.array([8, 64, 8, 8])
    assert crowded.next_ones(variance, frames, 5.9).tolist() == [3]
    assert sorted(crowded.next_ones(variance, frames, 0.5).tolist()) == [0, 1, 3]
    assert sorted(crowded.next_ones(variance, frames, 1.2).tolist()) == [0, 3]
