"""Pixels by area: exact areas, errors below what was asked on many views, nothing lost without notice."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from area_truth import KEPT, scenes, solids
from builders import box, floor, lamp, quad, scene

from nusselt.experiments.scenes import catalogue
from nusselt.experiments.scenes.cameras import turned
from nusselt.experiments.studies.race.measure import racer
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Analytic, Area
from nusselt.renderer.lights import PointLight
from nusselt.renderer.pixels import render_area
from nusselt.renderer.pixels.first_estimates import Known, first_estimates
from nusselt.renderer.pixels.interpolation import BETWEEN, WITHIN, cubic, error_bound
from nusselt.renderer.pixels.moments import Pieces
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid, Material

GLOW = Material(emission=(1.0, 1.0, 1.0))
FRONT = Camera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)
VIEWS = {view.name: view for view in scenes()}


def relative(image, truth, judged):
    return math.sqrt(((image - truth)[:, judged] ** 2).sum() / (truth[:, judged] ** 2).sum())


@pytest.mark.parametrize("tolerance", [3e-3, 1e-2])
@pytest.mark.parametrize("name", VIEWS)
def test_error_against_brute_force_is_below_the_tolerance(name, tolerance):
    """The truth's own error, stated with it, is taken out in quadrature; it is known to a few per cent."""
    with np.load(KEPT, allow_pickle=False) as kept:
        truth, error = kept[name].astype(float), float(kept[f"{name}/error"])
    found = render_area(VIEWS[name], Analytic(), tolerance=tolerance)
    judged = found.image.emitter == 0
    measured = relative(found.image.mean, truth, judged)
    assert math.sqrt(max(measured**2 - error**2, 0)) < tolerance
    assert measured > error / 2  # the truth's noise is really there: the comparison is not of a thing with itself


@pytest.mark.parametrize("name", ["near-light/1", "cornell/2", "cornell-boxes/3", "solids/1"])
def test_finer_tolerances_converge(name):
    truth = render_area(VIEWS[name], Analytic(), tolerance=1e-4)
    judged = truth.image.emitter == 0
    for tolerance in (1e-2, 3e-3, 1e-3):
        found = render_area(VIEWS[name], Analytic(), tolerance=tolerance)
        measured = relative(found.image.mean, truth.image.mean, judged)
        assert measured < tolerance
        assert measured < found.error + truth.error


def test_a_highlight_that_passes_between_nodes_beside_a_light_is_not_missed():
    """With half of what differences allow it was: by nine tolerances."""
    view = race_scene("near-light", 64)
    view = view.with_(camera=turned(view.camera, -5.128551431865187, -2.529522182702846, 0.6970568625288982))
    truth, found = (render_area(view, racer(view), tolerance=tolerance) for tolerance in (1e-4, 1e-3))
    assert truth.error < 1e-3
    judged = (truth.image.emitter == 0) & (truth.image.background < 1)
    assert relative(found.image.mean, truth.image.mean, judged) < 1e-3


def clipped_area(polygon, low, high):
    """Area of a convex polygon (n, 2) inside a box, by cutting it at the box's sides in turn."""
    for axis, bound, sign in ((0, low[0], 1), (0, high[0], -1), (1, low[1], 1), (1, high[1], -1)):
        kept = []
        for p, q in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            a, b = sign * (p[axis] - bound), sign * (q[axis] - bound)
            if a >= 0:
                kept.append(p)
            if (a < 0) != (b < 0):
                kept.append(p + a / (a - b) * (q - p))
        if not kept:
            return 0.0
        polygon = np.array(kept)
    x, y = polygon.T
    return abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 4, 1.1])
def test_coverage_of_a_parallelogram_is_exact(turn):
    c, s = math.cos(turn), math.sin(turn)
    corners = np.array([(-1.0, -0.7), (1.1, -0.6), (0.9, 0.8), (-1.2, 0.7)]) @ np.array([[c, s], [-s, c]])
    one = scene(quad(*[(x, y, 0.0) for x, y in corners], material=GLOW), camera=FRONT, size=(20, 16))
    image = render_area(one, Analytic()).image
    scale = 16 / 2 / (5 * math.tan(math.radians(20)))
    polygon = np.stack((10 + scale * corners[:, 0], 8 - scale * corners[:, 1]), axis=1)
    exact = [[clipped_area(polygon, (j, i), (j + 1, i + 1)) for j in range(20)] for i in range(16)]
    np.testing.assert_allclose(image.mean[0], exact, atol=1e-6)
    np.testing.assert_allclose(image.background, 1 - image.mean[0], atol=2e-6)


def test_a_ball_covers_its_conic():
    ball = scene(ellipsoids=(Ellipsoid.sphere((0, 0, 0), 1.2, GLOW),), camera=FRONT, size=(64, 64))
    covered = render_area(ball, Analytic()).image.mean[0]
    radius = math.tan(math.asin(1.2 / 5)) * 32 / math.tan(math.radians(20))
    assert abs(covered.sum() / (math.pi * radius**2) - 1) < 1e-6
    x, y = np.meshgrid(np.arange(64) - 31.5, np.arange(64) - 31.5)
    inside = np.hypot(x, y) + math.sqrt(0.5) < radius
    assert (covered[inside] == 1).all()
    fine = np.hypot(*np.meshgrid(*[(np.arange(64 * 32) + 0.5) / 32 - 32] * 2)) < radius
    assert np.abs(covered - fine.reshape(64, 32, 64, 32).mean(axis=(1, 3))).max() < 0.02


def test_solids_that_pass_through_each_other_are_cut_without_samples():
    two = scene(floor(), box((-1, -0.2, -1), (0.1, 0.7, 0.2)), box((-0.4, 0.1, -0.5), (0.8, 0.5, 0.9)),
                lights=(lamp(),), size=(64, 48))  # fmt: skip
    assert render_area(two, Analytic()).sampled == 0
    balls = tuple(Ellipsoid.sphere((x, 0.5, 0.0), 0.5, GLOW) for x in (-0.3, 0.3))
    found = render_area(scene(floor(), ellipsoids=balls, size=(64, 48)), Analytic())
    assert found.image.mean[0].max() == 1  # the curve in which two balls meet is not drawn, but nothing is lost


@pytest.mark.parametrize("lost", range(0, 40, 9))
def test_a_lost_edge_is_noticed(lost, monkeypatch):
    """Its pixels' books do not balance, or neighbours differ: they are taken by rays, and the image stays right."""
    module = __import__("nusselt.renderer.pixels.whole_pixels", fromlist=["find_lines"])
    view = VIEWS["cornell-boxes/1"]
    truth = render_area(view, Analytic(), tolerance=1e-3).image
    found = module.find_lines

    def without(*arguments):
        lines = found(*arguments)
        long = np.argsort(-np.abs(lines.end - lines.start).max(axis=0))
        kept = np.sort(np.delete(long, lost))
        return type(lines)(lines.start[:, kept], lines.end[:, kept], lines.reach[kept])

    monkeypatch.setattr(module, "find_lines", without)
    broken = render_area(view, Analytic(), tolerance=1e-3)
    judged = truth.emitter == 0
    seen = relative(broken.image.mean, truth.mean, judged)
    assert seen < 3e-2
    assert broken.sampled > 0 or seen < 1e-3  # an edge that nothing shows may be lost


@pytest.mark.parametrize(("order", "careful"), [(1, 2), (2, 5)])
def test_estimates_at_kinks_of_all_places(order, careful):
    """Kinks of a function, or of its slope, of every place and direction: RMS above the RMS error, none far below."""
    rng = np.random.default_rng(0)
    size, fine = 13, 64
    y, x = np.meshgrid(np.arange(size) - 6.0, np.arange(size) - 6.0, indexing="ij")
    v, u = ((index.ravel() + 0.5) / fine - 0.5 for index in np.meshgrid(*[np.arange(fine)] * 2, indexing="ij"))
    region = np.zeros((size, size), dtype=np.int64)
    centre = np.array([6 * size + 6])
    pixels, squares = [], []
    for _ in range(600):
        angle, shift = rng.uniform(0, 2 * math.pi), rng.uniform(-2, 2)
        a, b = math.cos(angle), math.sin(angle)

        def f(x, y, a=a, b=b, shift=shift):
            return np.maximum(a * x + b * y - shift, 0) ** order + 1e-4 * np.cos(x / 3) * np.sin(y / 4)

        value = f(x, y)
        corrected = value[6, 6] + (value[6, 5] + value[6, 7] + value[5, 6] + value[7, 6] - 4 * value[6, 6]) / 24
        pixels.append((abs(f(u, v).mean() - corrected), error_bound(value, region, WITHIN, centre)[0]))
        nodes = np.array([6 * size + 6, 6 * size + 7, 7 * size + 6, 7 * size + 7])
        weights = cubic((np.arange(8) + 0.5) / 8 + 1)
        places = (np.arange(8) + 0.5) / 8
        off = weights @ value[5:9, 5:9] @ weights.T - f(places, places[:, None])
        squares.append((np.sqrt((off**2).mean()), error_bound(value, region, BETWEEN, nodes).max()))
    for each, least in ((pixels, careful), (squares, 2)):
        error, bound = np.array(each).T
        assert (error <= 2.5 * bound).all()
        assert least <= np.sqrt((bound**2).mean() / (error**2).mean()) <= 12


def test_smooth_places_are_not_shaded():
    found = render_area(VIEWS["quad"].with_(width=256, height=256), Analytic(), tolerance=1e-3)
    assert found.evaluations < 0.3 * (found.image.background < 1).sum()


def test_the_executor_changes_no_bit():
    view = VIEWS["solids"].with_(width=80, height=60)
    here = render_area(view, Analytic(), tolerance=1e-3)
    with ThreadPoolExecutor(3) as pool:
        there = render_area(view, Analytic(), tolerance=1e-3, executor=pool)
    np.testing.assert_array_equal(here.image.mean, there.image.mean)
    assert here.evaluations == there.evaluations > 4096


def test_hard_shadows_are_refined_and_what_is_left_is_said():
    light = PointLight((0.7, 3.0, 0.9), (9.0, 9.0, 9.0))
    one = scene(floor(), box((-0.5, 0.2, -0.4), (0.6, 0.9, 0.5)), lights=(light,), size=(48, 36))
    truth = render_area(one, Area(), tolerance=1e-3)
    found = render_area(one, Area(), tolerance=2e-2)
    judged = truth.image.background < 1
    assert relative(found.image.mean, truth.image.mean, judged) < 2e-2
    assert found.evaluations < truth.evaluations


def test_what_cannot_be_had_is_refused():
    with pytest.raises(InputError, match="without noise"):
        render_area(catalogue.load("cornell"), Area(samples=4))
    for tolerance in (0.0, 1.0, -1.0, math.nan):
        with pytest.raises(InputError, match="tolerance"):
            render_area(solids(), Analytic(), tolerance=tolerance)


def test_an_empty_scene_is_black():
    found = render_area(scene(), Analytic())
    assert (found.image.mean == 0).all()
    assert (found.image.background == 1).all()


def test_a_peak_beside_an_edge_is_seen_by_the_pixels_next_to_it():
    """Rows that darken away from an edge whose pieces are bright: what lies below tells nothing of what lies above."""
    height, width = 6, 9
    region = np.ones((height, width), dtype=np.int64)
    region[0] = -2
    centre = np.broadcast_to((0.02 * 0.5 ** np.arange(-1.0, height - 1))[:, None], (1, height, width)).copy()
    x, flat = np.arange(width) + 0.5, np.zeros((3, width))
    pieces = Pieces(
        np.arange(width), np.ones(width, dtype=np.int64), np.full(width, 0.5), x, np.full(width, 0.75), flat
    )
    pixel = width + np.arange(2, width - 2)

    def estimate(bright):
        known = Known.of(centre, region, pieces, np.full((1, width), bright))
        value = np.full(pixel.size, math.sqrt(3) * 0.02)
        return first_estimates(known, pixel, np.ones_like(pixel), pixel % width + 0.5, np.full(pixel.size, 1.5), value)[
            0
        ]

    assert (estimate(0.03) < 0.002).all()
    assert (estimate(0.5) > 0.08).all()
