"""The accuracy asked decides the work: errors stay below it, memory is bounded, and nothing asked changes nothing."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from builders import floor, lamp, scene

from nusselt.experiments.scenes.cameras import views
from nusselt.experiments.studies.race.measure import racer
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.closed_forms.irradiance import facing, irradiance
from nusselt.renderer.closed_forms.phong_lobe import phong_lobe
from nusselt.renderer.image import render
from nusselt.renderer.pixels import render_area, render_centre
from nusselt.renderer.prepared import prepare

SIDE = 32
MEGABYTES = 300
CHILD = """
from nusselt.experiments.studies.race.measure import racer
from nusselt.experiments.studies.race.scenes import race_scene
from nusselt.renderer.pixels import render_area

scene = race_scene("bumpy-ball", 256)
render_area(scene, racer(scene), tolerance=1e-2)
status = dict(line.split(":", 1) for line in open("/proc/self/status"))
print(int(status["VmHWM"].split()[0]) // 1024)
"""


@lru_cache
def truth(name, view):
    shown = views(race_scene(name, SIDE))[view]
    return render_area(shown, racer(shown), tolerance=3e-5)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
@pytest.mark.parametrize("view", [1])
@pytest.mark.parametrize("name", ["quad", "cornell-boxes"])
def test_an_image_is_as_right_as_was_asked(name, view, tolerance):
    shown = views(race_scene(name, SIDE))[view]
    right = truth(name, view).image
    judged = (right.emitter == 0) & (right.background < 1)
    image = render_area(shown, racer(shown), tolerance=tolerance).image
    error = math.sqrt(((image.mean - right.mean)[:, judged] ** 2).sum() / (right.mean[:, judged] ** 2).sum())
    assert error < tolerance


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_centres_on_small_faces_are_as_right_as_was_asked(tolerance):
    shown = race_scene("bumpy-ball", SIDE)
    right = render(shown, racer(shown))
    image = render_centre(shown, racer(shown), tolerance=tolerance).image
    error = (image.mean - right.mean)[:, right.shaded]
    assert math.sqrt((error**2).sum() / (right.mean[:, right.shaded] ** 2).sum()) < tolerance


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


def test_memory_is_bounded_by_the_pieces_of_work():
    done = subprocess.run([sys.executable, "-c", CHILD], capture_output=True, text=True, timeout=120, check=True)
    assert int(done.stdout) < MEGABYTES
