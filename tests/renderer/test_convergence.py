"""Pixels beside a light: what values farther apart than radiance's Taylor series converges tell is not believed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import box, floor, scene

from nusselt.experiments.scenes.cameras import turned
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.renderer.estimators import Analytic, Exact
from nusselt.renderer.lights import PointLight, QuadLight
from nusselt.renderer.pixels import render_area
from nusselt.renderer.pixels.convergence import Convergence
from nusselt.renderer.pixels.fill import fill
from nusselt.renderer.pixels.filling import Parts, Reach
from nusselt.renderer.pixels.moments import Pieces
from nusselt.renderer.pixels.refine import _rule
from nusselt.renderer.pixels.shade import Work, palette_of, regions_of, shade_chunk, surface_of
from nusselt.renderer.scene import Camera
from nusselt.renderer.vectors import dot

DOWN = Camera((0.013, 1.0, 0.3), (0.05, 0.0, 0.02), (0.0, 0.0, -1.0), 45.0)
GRAZING = {
    "a highlight a hundredth of a pixel high": (-7.834852827228623, -6.985680398615527, 1.3007225646000746, (35,)),
    "a highlight in pieces of pixels": (10.654641990042265, -6.832735401262197, 1.202912241407673, (35, 36)),
    "a highlight between nodes": (-5.128551431865187, -2.529522182702846, 0.6970568625288982, (36, 37)),
}
"""Views of near-light, and the rows of pixels that hold nearly all that was wrong there."""


def centres(view):
    """Sources, regions, and pixel centres that show something: their places, and regions there."""
    _, needs, regions = regions_of(view, view.digest())
    y, x = (place.ravel() for place in np.mgrid[: view.height, : view.width] + 0.5)
    seen = regions.seen(x, y)
    k = np.flatnonzero(seen >= 0)
    return needs.sources, regions, x[k], y[k], seen[k]


def by_midpoints(view, row, across, down):
    """Reflected radiance (3, w) of a row of pixels, from a plain grid of points in each."""
    _, needs, regions = regions_of(view, view.digest())
    y, x = np.meshgrid(row + (np.arange(down) + 0.5) / down, (np.arange(view.width * across) + 0.5) / across)
    region = regions.seen(x.ravel(), y.ravel())
    lit = np.flatnonzero(palette_of(view, regions, needs).reflects[surface_of(region, regions.surfaces)])
    value = np.zeros((3, x.size))
    work = Work(view, view.digest(), Analytic(), False, 1e-6)
    value[:, lit] = shade_chunk(work, x.ravel()[lit], y.ravel()[lit], region[lit])
    return value.reshape(3, view.width, across * down).mean(axis=2)


@pytest.mark.parametrize("name", GRAZING)
def test_what_lies_within_a_pixel_beside_a_light_is_not_missed(name):
    """By 19, 3 and 2 tolerances it was, of 1e-2, and by 189 and 16 of 1e-3."""
    *turn, rows = GRAZING[name]
    view = race_scene("near-light", 64)
    view = view.with_(camera=turned(view.camera, *turn))
    truth = np.stack([by_midpoints(view, row, 2, 512) for row in rows], axis=1)
    for tolerance in (1e-2, 1e-3):
        made = render_area(view, Analytic(), tolerance=tolerance)
        judged = (made.image.emitter == 0) & (made.image.background < 1)
        missed = (made.image.mean[:, rows] - truth)[:, judged[list(rows)]]
        assert math.sqrt((missed**2).sum() / (made.image.mean[:, judged] ** 2).sum()) < tolerance
        assert made.error < tolerance


def test_a_peak_of_all_directions_within_a_pixel_is_not_missed():
    """Pixels are fifteen times as wide as the light is high: the error was 4 tolerances."""
    light = PointLight((0.07, 1e-3, 0.03), (1.0, 1.0, 1.0))
    view = scene(floor(), lights=(light,), camera=DOWN, size=(64, 64))
    truth = np.stack([by_midpoints(view, row, 32, 32) for row in (32, 33)], axis=1)
    made = render_area(view, Analytic(), tolerance=1e-3)
    missed = made.image.mean[:, 32:34] - truth
    assert math.sqrt((missed**2).sum() / (made.image.mean**2).sum()) < 1e-3
    assert made.error < 1e-3


def test_where_shadows_fit_beside_a_light_pixels_are_divided_as_finely_as_elsewhere():
    """A light stands on the floor behind a box: the error was said to be 2 tolerances, and nothing could mend it."""
    light = QuadLight((-2.0, 0.0, -2.0), (0.0, 3.0, 0.0), (4.0, 0.0, 0.0), (3.0, 3.0, 3.0))
    camera = Camera((0.3, 1.0, 4.0), (0.0, 0.5, -0.5), (0.0, 1.0, 0.0), 38.0)
    view = scene(floor(), box((-0.6, 0.0, -0.6), (0.6, 0.8, 0.6)), lights=(light,), camera=camera, size=(24, 24))
    assert render_area(view, Exact(), tolerance=1e-3).error < 1e-3


def test_the_radius_is_the_distance_to_the_light_in_pixels():
    """Seen from above, all over the image."""
    camera = Camera((0.0, 2.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 45.0)
    light = PointLight((0.3, 0.2, -0.1), (1.0, 1.0, 1.0))
    view = scene(floor(), lights=(light,), camera=camera, size=(48, 32))
    sources, regions, x, y, seen = centres(view)
    pixel = 2 * 2.0 * math.tan(math.radians(22.5)) / 32
    # From a plane that is not seen aslant the way changes by a pixel of it in each pixel, whatever the light's height.
    position = regions.points(x, y, seen).position
    away = position - np.array(light.position)[:, None]
    radius = Convergence.of(regions, sources, 1000.0).radius(x, y, seen)
    np.testing.assert_allclose(radius, np.sqrt(dot(away, away)) / pixel, rtol=1e-6)


def test_the_radius_ends_where_the_way_to_the_light_has_no_length():
    """Its square, by that of the depth, is a quadratic polynomial along any line of the image."""
    light = PointLight((0.3, 0.2, -0.1), (1.0, 1.0, 1.0))
    view = scene(floor(), lights=(light,), size=(48, 32))
    sources, regions, x, y, seen = centres(view)
    radius, lens = Convergence.of(regions, sources, 1000.0).radius(x, y, seen), regions.lens
    step, angle = 0.05 * np.arange(-1, 2), np.pi * np.arange(360) / 360
    for k in range(0, x.size, 97):
        u = x[k] + step * np.cos(angle)[:, None], y[k] + step * np.sin(angle)[:, None]
        place = regions.points(u[0].ravel(), u[1].ravel(), np.full(u[0].size, seen[k])).position
        way = place - np.array(light.position)[:, None]
        square = dot(way, way) / dot(lens.look, place - lens.origin) ** 2
        roots = [np.abs(np.roots(np.polyfit(step, values, 2))).min() for values in square.reshape(u[0].shape)]
        assert abs(min(roots) / radius[k] - 1) < 1e-4


@pytest.mark.parametrize("turn", [view[:3] for view in GRAZING.values()])
def test_radii_in_blocks_and_of_faces_lose_no_small_one(turn):
    view = race_scene("near-light", 128)
    view = view.with_(camera=turned(view.camera, *turn))
    sources, regions, x, y, seen = centres(view)
    every = Convergence.of(regions, sources, 1e6)
    k = np.arange(0, x.size, 7)
    pieces = [every.radius(x[some], y[some], seen[some]) for some in np.array_split(k, 20)]
    exact, widest = np.concatenate(pieces), 4.0
    assert (exact < widest).any()
    fast = Convergence.of(regions, sources, widest).radius(x, y, seen)[k]
    np.testing.assert_array_equal(fast[exact < widest], exact[exact < widest])
    assert (fast[exact >= widest] >= widest).all()


def test_nothing_is_filled_from_nodes_farther_apart_than_it_converges():
    region, nothing = np.zeros((64, 64), dtype=np.int64), np.zeros(0)
    parts = Parts(Pieces.none(), nothing.astype(bool), nothing.astype(bool))
    asked = np.zeros(region.size, dtype=bool)

    def evaluate(pixel, piece):
        asked[pixel] = True
        return np.ones((3, pixel.size))

    reach = np.full(region.shape, np.inf)
    reach[20:23, 30], reach[40, 40] = 1.5, 3.0
    alone = np.zeros(region.shape, dtype=bool)
    filled = fill(region, parts, evaluate, lambda values: 1e-3, alone, reach=Reach(reach, nothing))
    assert asked.reshape(region.shape)[reach < 2].all()
    assert np.count_nonzero(asked) < asked.size / 2
    np.testing.assert_allclose(filled.value, 1.0, rtol=1e-12)


@pytest.mark.parametrize("count", [2, 8, 16, 64, 1024])
def test_many_nodes_are_several_rules_side_by_side(count):
    node, weight = _rule(count)
    assert node.size == count
    for power in range(4):
        assert abs(weight @ node**power - (0.5 ** (power + 1) - (-0.5) ** (power + 1)) / (power + 1)) < 1e-14
