"""The accuracy asked decides the work: errors stay below it, memory is bounded, and nothing asked changes nothing."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
import pytest
from builders import floor, lamp, scene

from nusselt.experiments.scenes.cameras import turned, views
from nusselt.experiments.studies.race.measure import racer
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.closed_forms.irradiance import facing, irradiance
from nusselt.renderer.closed_forms.phong_lobe import phong_lobe
from nusselt.renderer.image import render
from nusselt.renderer.pixels import render_area, render_centre
from nusselt.renderer.pixels.error_budget import allowed
from nusselt.renderer.pixels.fill import fill_centres
from nusselt.renderer.prepared import prepare

SIDE = 32
CHILD = """
import sys

from nusselt.experiments.studies.race.measure import racer
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.renderer.pixels import render_area

scene = race_scene(sys.argv[1], int(sys.argv[2]))
render_area(scene, racer(scene), tolerance=1e-2)
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
print(int(status["VmHWM"].split()[0]) // 1024)
"""


@lru_cache
def truth(name, view):
    shown = views(race_scene(name, SIDE))[view]
    return render_area(shown, racer(shown), tolerance=3e-5)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@pytest.mark.parametrize("view", [1, 2])
@pytest.mark.parametrize("name", ["quad", "cornell-boxes"])
def test_an_image_is_as_right_as_was_asked(name, view, tolerance):
    shown = views(race_scene(name, SIDE))[view]
    right = truth(name, view).image
    judged = (right.emitter == 0) & (right.background < 1)
    image = render_area(shown, racer(shown), tolerance=tolerance).image
    error = math.sqrt(((image.mean - right.mean)[:, judged] ** 2).sum() / (right.mean[:, judged] ** 2).sum())
    assert error < tolerance


def test_sides_that_no_square_divides_lose_nothing():
    """341 pixels across, and pieces along the horizon that are interpolated: once they were added to a copy."""
    shown = race_scene("quad", 256)
    right = render_area(shown, racer(shown), tolerance=1e-6).image
    found = render_area(shown, racer(shown), tolerance=1e-4)
    judged = (right.emitter == 0) & (right.background < 1)
    error = np.sqrt(((found.image.mean - right.mean)[:, judged] ** 2).sum() / (right.mean[:, judged] ** 2).sum())
    assert error < found.error < 1e-4


def test_a_strip_of_two_rows_whose_neighbours_all_err_alike_is_not_believed():
    """A penumbra in front of a box: what is beside a pixel agreed with it, what is below it was not asked."""
    room = race_scene("cornell-boxes", 64)
    shown = room.with_(camera=turned(room.camera, -14.27343428751146, -5.96459040558982, 1.0389348161915413))
    right = render_area(shown, racer(shown), tolerance=3e-5).image
    found = render_area(shown, racer(shown), tolerance=1e-3)
    judged = (right.emitter == 0) & (right.background < 1)
    error = np.sqrt(((found.image.mean - right.mean)[:, judged] ** 2).sum() / (right.mean[:, judged] ** 2).sum())
    assert error < 1e-3


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_centres_on_small_faces_are_as_right_as_was_asked(tolerance):
    shown = race_scene("bumpy-ball", SIDE)
    right = render(shown, racer(shown))
    image = render_centre(shown, racer(shown), tolerance=tolerance).image
    error = (image.mean - right.mean)[:, right.shaded]
    assert math.sqrt((error**2).sum() / (right.mean[:, right.shaded] ** 2).sum()) < tolerance


@pytest.mark.parametrize("enough", [1e-4, 1e-6, 1e-9])
def test_small_lights_err_by_what_is_enough(enough):
    """From needles to squares, grazing ones too: few nodes, and a bound that says so."""
    rng = np.random.default_rng(3)
    n = 20_000
    ab, ac, away, normals = rng.normal(size=(4, 3, n))
    ac *= 10 ** rng.uniform(-3, 0, n)
    middle = away / np.sqrt((away**2).sum(axis=0))
    size = rng.uniform(0.01, 0.36, n) / np.sqrt(np.maximum((ab**2).sum(axis=0), (ac**2).sum(axis=0)))
    light = middle - size * (ab + ac) / 2, size * ab, size * ac
    points = np.zeros((3, n))
    quick, bound = irradiance(points, normals, *light, enough=enough)
    best, _ = irradiance(points, normals, *light)
    error, most = np.abs(quick - best), facing(points, *light)
    assert (error <= bound * quick + 1e-12 * best).all()
    assert (error <= enough * most).all()
    assert (error > 1e-3 * enough * most).any()  # the work is less where less is asked


def test_closed_forms_err_by_what_is_enough_and_by_nothing_if_nothing_is_said():
    """Grazing points, where working precision is not enough for the last digits."""
    rng = np.random.default_rng(3)
    points = np.vstack((rng.uniform(-2, 2, 400), 1 - 10.0 ** rng.uniform(-9, 0, 400), rng.uniform(-2, 2, 400)))
    normals = rng.normal(size=(3, 400))
    light = np.array([[-1.0], [1.0], [-1.0]]), np.array([[0.0], [0.0], [2.0]]), np.array([[2.0], [0.0], [0.0]])
    best, bound = irradiance(points, normals, *light)
    assert np.array_equal(best, irradiance(points, normals, *light, enough=0.0)[0])
    quick, more = irradiance(points, normals, *light, enough=1e-7)
    assert (more > bound).any()  # dearer forms were left out
    assert (np.abs(quick - best) <= 1e-7 * np.maximum(best, facing(points, *light))).all()
    mirror = rng.normal(size=(3, 400))
    best, bound = phong_lobe(points, normals, mirror, 20.0, *light)
    quick, more = phong_lobe(points, normals, mirror, 20.0, *light, enough=1e-7)
    assert (more > bound).any()
    assert (np.abs(quick - best) <= 1e-7 * np.maximum(best, facing(points, *light))).all()


def test_points_of_an_image_without_a_tolerance_are_as_exact_as_can_be():
    near, geometry, _ = prepare(scene(floor(), lights=(lamp(),)))
    points = look(near, geometry, *pixel_centres(range(32), range(24))).points
    assert points.enough == 0
    coarse = points.as_exact_as(1e-2)
    assert 0 < coarse.enough < 1e-4
    assert coarse.take(np.array([0])).enough == coarse.enough == replace(coarse).enough


@pytest.mark.parametrize(("name", "side", "megabytes"), [("bumpy-ball", 256, 300), ("cornell-boxes", 1024, 220)])
def test_memory_is_bounded_by_the_pieces_of_work(name, side, megabytes):
    call = [sys.executable, "-c", CHILD, name, str(side)]
    done = subprocess.run(call, capture_output=True, text=True, timeout=120, check=True)
    assert int(done.stdout) < megabytes


def bent(x, y):
    """Smooth, and steeper beyond a line that runs close to the edge of the region."""
    value = 1 + 0.3 * np.sin(x / 25) * np.cos(y / 20) + 0.05 * np.maximum(x + 0.3 * y - 62, 0)
    return np.stack((value, 0.5 * value, 0.2 * value))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_what_lies_along_an_edge_is_filled_from_one_side_unless_the_point_tried_is_missed(tolerance):
    """On the two sides of x + y / 3 = 68 a dark region, and one that is kinked a few pixels before its end."""
    y, x = np.mgrid[:128, :128] + 0.5
    side = x + y / 3 - 68
    region = np.where(np.abs(side) < 1, -2, (side > 0).astype(np.int64))
    right, asked = np.where(region == 0, bent(x, y), 0.0), []

    def evaluate(index):
        asked.append(index)
        return right.reshape(3, -1)[:, index]

    value, bound, filled = fill_centres(region, evaluate, partial(allowed, tolerance, 0.0, 1))
    error = np.sqrt(((value - right)[:, region >= 0] ** 2).sum() / (right**2).sum())
    assert 0 < error < np.sqrt((bound**2).sum() / (right**2).sum()) < 1.1 * tolerance
    asked = np.concatenate(asked)
    assert np.unique(asked).size == asked.size < 0.2 * (region >= 0).sum()
    assert filled[(side > -4) & (region == 0)].any()
