"""Shadows on many small faces: few places are asked, what is missed is measured, and doubt is asked."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nusselt.experiments.studies.race.measure import racer
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators import Exact
from nusselt.renderer.pixels import render_area, small_faces
from nusselt.renderer.pixels.shade import regions_of
from nusselt.renderer.pixels.shadow_edges import _turning
from nusselt.renderer.pixels.shadow_fits import Places, fit_shadows
from nusselt.renderer.pixels.small_faces import on_small_faces
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected, still
from nusselt.renderer.soft_shadows.meshes.hidden import hidden_irradiance
from nusselt.renderer.vectors import dot

SIDE = 32


def places(lost=0.0):
    """A hundred pixels a side of faces 4 pixels wide, each of a brightness of its own."""
    rng = np.random.default_rng(4)
    x, y = (v.ravel() + 0.5 for v in np.meshgrid(np.arange(100.0), np.arange(100.0)))
    face = (y // 4 * 25 + x // 4).astype(np.int64)
    free = np.broadcast_to(rng.uniform(0.2, 1.0, 625)[face], (3, x.size)).copy()
    return Places.of(x, y, np.ones(x.size), face, np.zeros(x.size, dtype=np.int64), free, np.full(x.size, lost))


def fitted(all_, share, tolerance):
    """Number of places asked, and true and estimated error, where ``share`` (n,) of the light is seen."""
    right, asked = all_.free * share, []

    def shade(k):
        asked.append(k.size)
        return right[:, k]

    fit_shadows(all_, shade, tolerance, 0.0)
    size = (right**2).sum()
    true = math.sqrt(((all_.value - right) ** 2).sum() / size)
    return sum(asked), true, math.sqrt((all_.error[~all_.known] ** 2).sum() / size)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_a_penumbra_over_facets_is_fitted_to_what_was_asked(tolerance):
    all_ = places()
    way = np.clip((all_.x + 0.4 * all_.y - 50) / 40, 0, 1)
    asked, true, estimate = fitted(all_, way * way * (3 - 2 * way), tolerance)
    assert true < 1.5 * tolerance
    assert true <= 1.5 * estimate
    assert asked < (4000 if tolerance == 1e-2 else all_.x.size)


def test_what_is_asked_in_any_case_is_asked_at_once():
    all_, calls = places(lost=0.05), []

    def shade(k):
        calls.append(k.size)
        return all_.free[:, k] * (0.5 + all_.x[k] / 300)

    fit_shadows(all_, shade, 3e-2, 0.0)
    assert len(calls) == 1
    assert calls[0] > 512  # doubt, and two levels of patches


def test_a_shadow_that_no_place_met_is_looked_for_where_it_may_be():
    one_face = places().face == 333
    blind, told = places(), places()
    told.lost[one_face] = 0.25 * np.sqrt((told.free[:, one_face] ** 2).sum(axis=0))
    share = np.where(one_face & (np.arange(10_000) % 2 == 1), 0.3, 1.0)
    assert fitted(blind, share, 1e-4)[0] < 6_000
    assert fitted(told, share, 1e-4)[1] < 1e-4


def test_small_faces_are_those_of_bodies_that_have_many():
    face, body = np.repeat(np.arange(200), 10), np.repeat([0, 1], 1000)
    assert on_small_faces(face, body).all()
    body[1000:] = np.repeat(np.arange(1, 11), 100)  # ten bodies of ten faces
    assert (on_small_faces(face, body) == (body == 0)).all()
    assert not on_small_faces(np.zeros(2000, dtype=np.int64), body).any()


def test_edges_that_throw_a_shadow_raise_doubt_and_most_of_a_ball_do_not():
    shown = race_scene("bumpy-ball", SIDE)
    geometry, needs, regions = regions_of(shown, shown.digest())
    light, faces = needs.sources[0].light, regions.faces
    kept = {(*a, *b) for a, b in zip(*(ends.T.tolist() for ends in _turning(regions, light)), strict=True)}
    assert 100 < len(kept) < faces.start.shape[1] / 3
    ab, ac = (np.array(v)[:, None] for v in (light.ab, light.ac))
    for u, v in np.random.default_rng(2).random((20, 2)):
        at = np.array(light.corner)[:, None] + u * ab + v * ac
        front = [dot(geometry.normal[:, k], at - geometry.a[:, k]) > 0 for k in faces.beside]
        for edge in np.flatnonzero((front[0] != front[1]) & (faces.beside[0] >= 0)).tolist():
            assert (*faces.start[:, edge].tolist(), *faces.end[:, edge].tolist()) in kept


def test_pixels_by_area_of_a_ball_are_those_whose_faces_are_looked_at_one_by_one(monkeypatch):
    shown = race_scene("bumpy-ball", SIDE)
    image = render_area(shown, racer(shown), tolerance=1e-2)
    monkeypatch.setattr(small_faces, "on_small_faces", lambda face, _: face < -9)
    right = render_area(shown, racer(shown), tolerance=5e-3)
    judged = (image.image.emitter == 0) & (image.image.background < 1)
    error = ((image.image.mean - right.image.mean)[:, judged] ** 2).sum() / (right.image.mean[:, judged] ** 2).sum()
    assert math.sqrt(error) < 1e-2
    assert image.error < 1e-2
    assert image.evaluations < right.evaluations / 2


@pytest.mark.parametrize(
    ("name", "rough", "exact"),
    [("bumpy-ball", 1e-2, 1e-3), ("mesh", 1e-2, 5e-5), ("mesh", 1e-3, 5e-5), ("mesh", 1e-4, 5e-5)],
)
def test_layers_that_are_merged_change_little_and_only_where_a_tolerance_is_asked(name, rough, exact):
    shown = race_scene(name, SIDE)
    near, geometry, needs = prepare(shown)
    points = look(near, geometry, *pixel_centres(range(SIDE), range(SIDE))).points
    source = needs.sources[0]
    (best, bound), (merged, none), (close, _) = (
        hidden_irradiance(source, points.position, points.normal, points.outside, tolerance)
        for tolerance in (0.0, rough, exact)
    )
    reached = best > 0
    assert np.isfinite(bound[reached]).mean() > 0.99
    assert np.isinf(none[reached]).all()
    assert np.abs(close - best).max() < 1e-12 * np.sqrt((best**2).mean())
    assert np.abs(merged - best).max() > 0
    best, merged = (reflected(part, needs, still(Exact())) for part in (points, points.as_exact_as(rough)))
    assert np.sqrt(((merged - best) ** 2).mean()) < rough / 5 * np.sqrt((best**2).mean())
