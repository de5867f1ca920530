"""Means over pixels of many small faces, by their shares: against places drawn in each pixel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nusselt.experiments.studies.race.scenes import bumpy_ball_scene
from nusselt.renderer.camera import view
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.pixels import face_means
from nusselt.renderer.pixels import supersampling as crowded
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected
from nusselt.renderer.surfaces import Material

SIDE, PLACES = 40, 16


@pytest.fixture(scope="module")
def ball():
    return bumpy_ball_scene().with_(width=SIDE, height=SIDE)


def drawn(scene, pixel, side=PLACES, seed=3):
    """Radiance if nothing blocks, and the share that shows the ball's outside: places in side^2 strata a pixel."""
    near, geometry, needs = prepare(scene)
    row, across = np.divmod(pixel, SIDE)
    strata = np.stack(np.meshgrid(np.arange(side), np.arange(side))).reshape(2, -1, 1)
    x, y = (strata + np.random.default_rng(seed).random((2, side * side, pixel.size))) / side
    seen = view.look(near, geometry, (across + x).ravel(), (row + y).ravel())
    light, outside = np.zeros((3, x.size)), np.zeros(x.size)
    light[:, seen.lit] = reflected(seen.points, needs, without_shadows)
    outside[seen.lit] = seen.points.outside
    each = light.reshape(3, -1, pixel.size)
    return each.mean(axis=1), each.std(axis=1), outside.reshape(-1, pixel.size).mean(axis=0)


def means(scene, pixel):
    near, geometry, needs = prepare(scene)
    return face_means.unshadowed_means(near, geometry, needs, pixel, 1e-3)


def test_triangles_in_a_square_have_the_area_and_moments_that_points_tell():
    x, y = np.random.default_rng(1).normal(0.5, 0.8, (2, 3, 50))
    point = (np.stack(np.meshgrid(np.arange(400), np.arange(400))).reshape(2, -1, 1) + 0.5) / 400
    side = [(x[j] - x[i]) * (point[1] - y[i]) - (y[j] - y[i]) * (point[0] - x[i]) for i, j in ((0, 1), (1, 2), (2, 0))]
    inside = (np.sign(side[0]) == np.sign(side[1])) & (np.sign(side[1]) == np.sign(side[2]))
    told = np.stack([(inside * weight).mean(axis=0) for weight in (1.0, point[0], point[1])])
    # A grid of 400 x 400 misses at most a strip a cell wide along the edges, here of 3 sides at most.
    assert np.abs(np.abs(face_means._below(x, y)) - told).max() < 3 * np.sqrt(2) / 400
    assert np.ptp(told[0]) > 0.5


def test_upright_and_level_edges_are_no_exception():
    x = np.array([[0.0, 0.25, -1.0], [1.0, 0.25, 2.0], [1.0, 0.75, 2.0]])
    y = np.array([[0.0, 0.0, 0.5], [0.0, 1.0, 0.5], [1.0, 1.0, 0.5]])
    assert np.allclose(np.abs(face_means._below(x, y))[0], [0.5, 0.25, 0.0], atol=1e-15)


def test_pixels_that_faces_fill_have_the_mean_that_places_in_them_tell(ball):
    pixel = np.arange(SIDE * SIDE)
    known = means(ball, pixel)
    k = np.flatnonzero(~np.isnan(known[0]))
    mean, spread, outside = drawn(ball, k)
    assert 100 < k.size < np.count_nonzero(drawn(ball, pixel, 4)[2] > 0)
    assert (outside == 1).all()
    # One place a stratum: less spread than independent ones have. Six of their standard errors, over 10^3 numbers;
    # and lit slivers that no place may meet.
    error = spread / PLACES
    assert (np.abs(known[:, k] - mean) <= 6 * error + 1e-4 * mean + 1e-5 * mean.max()).all()
    assert (spread > 1e-3 * mean).mean() > 0.5


def test_a_face_left_out_or_told_twice_fills_no_pixel(ball, monkeypatch):
    """The planted defect: every fifth part is lost."""
    pixel = np.arange(SIDE * SIDE)
    before = np.count_nonzero(~np.isnan(means(ball, pixel)[0]))
    of = face_means.parts_of

    def fewer(*given):
        parts = of(*given)
        return parts.take(np.flatnonzero(np.arange(parts.pixel.size) % 5 > 0))

    monkeypatch.setattr(face_means, "parts_of", fewer)
    assert np.count_nonzero(~np.isnan(means(ball, pixel)[0])) < before / 2


def test_shiny_faces_are_left_to_sampling(ball):
    floor, mesh = ball.meshes
    shiny = replace(mesh, material=Material((0.3, 0.3, 0.3), (0.3, 0.3, 0.3), 20.0))
    assert np.isnan(means(ball.with_(meshes=(floor, shiny)), np.arange(SIDE * SIDE))).all()


def test_what_places_contradict_is_not_believed(ball):
    near, geometry, _ = prepare(ball)
    crowd = crowded.Crowd.begun(crowded.Frames(ball, 1e-3), np.flatnonzero(crowded.touched(near, geometry)), None)
    crowd.know(np.ones((3, crowd.pixel.size)))
    assert 0 < np.count_nonzero(crowd.known) < crowd.pixel.size
    assert (drawn(ball, crowd.pixel[crowd.known], 4)[2] > 0.5).all()
    assert (crowd.share[:, crowd.known] == 0).all()


def test_a_pixel_beside_a_silhouette_is_doubted_unless_faces_fill_it(ball):
    """Three pixels side by side; the copies differ in the middle one alone."""
    total = np.zeros((crowded.REPLICAS, 9, 3))
    total[:, :3, 1] = np.arange(crowded.REPLICAS)[:, None]
    total[:, 8, 2] = 4
    crowd = crowded.Crowd(
        crowded.Frames(ball, 1e-3), (SIDE, SIDE), None, np.arange(3), total, np.full(3, 4), np.full((3, 3), np.nan)
    )
    assert (crowd.variance() > 0).all()
    crowd.know(np.ones((3, 3)))
    assert (crowd.variance() > 0).tolist() == [True, True, False]
