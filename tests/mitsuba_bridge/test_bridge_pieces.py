"""Camera rays and surfaces of Mitsuba's, one by one, against the formulas."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from builders import box, floor, lamp, scene

from nusselt.mitsuba_bridge.description import describe
from nusselt.mitsuba_bridge.images import mitsuba_images
from nusselt.mitsuba_bridge.llvm import backend
from nusselt.mitsuba_bridge.reference import ask
from nusselt.renderer.scene import Camera, Scene

pytestmark = pytest.mark.mitsuba


@pytest.fixture
def llvm() -> None:
    if backend().variant == "scalar_rgb":
        pytest.skip("the Phong surface is too slow in scalar_rgb")


def rays_of(made: Scene, folder: Path) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """Mitsuba's origins and directions (3, n), and the scale and centre of the description."""
    description = describe(made, folder)
    arrays, _ = ask({"task": "camera_rays", "description": description.as_json()}, folder, backend(), 60)
    return arrays["origin"], arrays["direction"], description.scale, np.array(description.centre)[:, None]


def course_directions(made: Scene) -> np.ndarray:
    """The course's camera, written again, unit directions (3, h w)."""
    camera = made.camera
    look = np.subtract(camera.target, camera.position)
    look /= np.linalg.norm(look)
    right = np.cross(look, camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, look)
    t, aspect = math.tan(math.radians(camera.fov_y) / 2), made.width / made.height
    y, x = np.mgrid[0 : made.height, 0 : made.width] + 0.5
    d = (
        look[:, None, None]
        + t * aspect * (x / made.width * 2 - 1) * right[:, None, None]
        + t * (1 - y / made.height * 2) * up[:, None, None]
    )
    return (d / np.linalg.norm(d, axis=0)).reshape(3, -1)


@pytest.mark.parametrize("seed", range(4))
def test_camera_rays_are_the_courses(seed, tmp_path):
    """Random cameras: far and near, wide and narrow, images of any shape."""
    rng = np.random.default_rng([seed, 2026])
    away = 10 ** rng.uniform(-1, 3)
    eye, at, up = rng.normal(size=3) * away, rng.normal(size=3), rng.normal(size=3)
    size = (int(rng.integers(1, 60)), int(rng.integers(1, 60)))
    camera = Camera(tuple(eye), tuple(at), tuple(up), float(rng.uniform(2, 150)))
    made = scene(floor(10 ** rng.uniform(-3, 3)), camera=camera, size=size)
    origin, direction, scale, centre = rays_of(made, tmp_path)
    truth = course_directions(made)
    # A position on the film is a float32: its rounding counts for more in images over 90 degrees wide.
    t = math.tan(math.radians(camera.fov_y) / 2) * max(1, made.width / made.height)
    assert np.abs(np.cross(direction, truth, axis=0)).max() < 1e-6 * max(1, t)
    assert (direction * truth).sum(axis=0).min() > 0.99
    # Rays start on the near plane: off the eye, but on the same line.
    start = origin / scale + centre - eye[:, None]
    beside = np.linalg.norm(np.cross(start, truth, axis=0), axis=0)
    assert beside.max() < 1e-6 * (np.linalg.norm(eye - centre[:, 0]) + 50 / scale)


def test_a_camera_that_is_off_by_half_a_pixel_is_seen(tmp_path):
    made = scene(floor())
    _, direction, _, _ = rays_of(made, tmp_path)
    shifted = course_directions(made).reshape(3, made.height, made.width)[:, :, 1:]
    ours = direction.reshape(3, made.height, made.width)[:, :, :-1]
    assert np.abs(np.cross(ours, shifted, axis=0)).max() > 1e-3


def phong(kd, ks, s: float, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f cos, (3, n), for directions (3, n) whose normal is z."""
    r = np.stack((-wi[0], -wi[1], wi[2]))
    a = (r * wo).sum(axis=0)
    lobe = np.where(a > 0, np.maximum(a, 0) ** s, 0.0)
    f = np.array(kd)[:, None] / math.pi + np.array(ks)[:, None] * (s + 2) / (2 * math.pi) * lobe
    return np.where((wi[2] > 0) & (wo[2] > 0), f * wo[2], 0.0)


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    """Unit float32 directions over the whole sphere, as float64 (3, n)."""
    d = rng.normal(size=(3, n))
    return (d / np.linalg.norm(d, axis=0)).astype(np.float32).astype(float)


def evaluate(bsdf: dict, wi: np.ndarray, wo: np.ndarray, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    job = {"task": "surface", "bsdf": bsdf, "wi": wi.tolist(), "wo": wo.tolist()}
    arrays, _ = ask(job, folder, backend(), 60)
    return arrays["value"], arrays["pdf"]


@pytest.mark.usefixtures("llvm")
@pytest.mark.parametrize("s", [0.0, 0.5, 1.0, 7.0, 100.0, 1000.0])
def test_phong_values_on_random_directions(s, tmp_path):
    rng = np.random.default_rng(5)
    kd, ks = (0.2, 1.7, 0.0), (0.9, 0.0, 0.3)
    wi, wo = directions(rng, 4000), directions(rng, 4000)
    # Half of them in the lobe, where large exponents have their values.
    near = np.stack((-wi[0], -wi[1], wi[2])) + rng.normal(size=wi.shape) / math.sqrt(s + 1)
    wo[:, ::2] = (near / np.linalg.norm(near, axis=0)).astype(np.float32)[:, ::2]
    value, _ = evaluate({"kind": "modified_phong", "kd": kd, "ks": ks, "exponent": s}, wi, wo, tmp_path)
    truth = phong(kd, ks, s, wi, wo)
    # At exponent 0 the lobe jumps where r.wo = 0: float32 may see it on the other side.
    jump = (s == 0) & (np.abs((np.stack((-wi[0], -wi[1], wi[2])) * wo).sum(axis=0)) < 1e-6)
    assert jump.mean() < 0.01
    tolerance = 2e-6 + 1e-7 * s
    np.testing.assert_allclose(value[:, ~jump], truth[:, ~jump], rtol=tolerance, atol=1e-7 * max(truth.max(), 1))
    assert (value[:, (wi[2] <= 0) | (wo[2] <= 0)] == 0).all()


def test_diffuse_values_on_random_directions(tmp_path):
    rng = np.random.default_rng(6)
    kd = (0.2, 0.75, 0.0)
    wi, wo = directions(rng, 2000), directions(rng, 2000)
    value, _ = evaluate({"kind": "diffuse", "reflectance": kd}, wi, wo, tmp_path)
    np.testing.assert_allclose(value, phong(kd, (0, 0, 0), 1.0, wi, wo), rtol=1e-6, atol=1e-8)


@pytest.mark.usefixtures("llvm")
@pytest.mark.parametrize(("s", "wi"), [(5, (0.6, 0.0, 0.8)), (50, (0.0, 0.28, 0.96)), (0, (0.0, 0.0, 1.0))])
def test_mitsubas_own_chi_squared_accepts_the_phong_sampler(s, wi, tmp_path):
    parameters = {"kd": 0.5, "ks": 0.4, "exponent": float(s)}
    job = {"task": "chi_squared", "parameters": parameters, "wi": wi, "seed": 3, "level": 1e-6}
    arrays, _ = ask(job, tmp_path, backend(), 120)
    assert arrays["passed"] == 1, arrays["p"]


@pytest.mark.usefixtures("llvm")
def test_the_density_of_the_sampler_integrates_to_one(tmp_path):
    """By quadrature, viewer upright: then no part of the lobe is below the surface."""
    s = 20.0
    z, weights = np.polynomial.legendre.leggauss(200)
    z, weights = (z + 1) / 2, weights / 2
    wo = np.stack((np.sqrt(1 - z * z), 0 * z, z))
    wi = np.broadcast_to(np.array([[0.0], [0.0], [1.0]]), wo.shape)
    bsdf = {"kind": "modified_phong", "kd": (0.5,) * 3, "ks": (0.4,) * 3, "exponent": s}
    value, pdf = evaluate(bsdf, wi, wo, tmp_path)
    assert 2 * math.pi * (weights * pdf).sum() == pytest.approx(1, abs=1e-5)
    # And the albedo at this view is k_d + k_s: with its cosine, (s+2)/(2 pi) a^s is a density.
    assert 2 * math.pi * (weights * value[0]).sum() == pytest.approx(0.9, abs=1e-5)


def test_one_seed_is_one_image_however_the_scene_is_loaded(llvm):
    """One of the lights is picked for each sample, by its number."""
    boxes = [box((x, 0.0, x), (x + 0.3, 0.3, x + 0.3)) for x in (-1.0, -0.4, 0.2, 0.8)]
    lamps = tuple(lamp(y, 0.4, (y, 1.0, 5.0 - y)) for y in (2.0, 2.5, 3.0, 3.5))
    made = scene(floor(), *boxes, lights=lamps, size=(16, 12))
    images = [mitsuba_images(made, 4, [1], sampler="independent", timeout=60) for _ in range(8)]
    assert all(np.array_equal(image, images[0]) for image in images)
