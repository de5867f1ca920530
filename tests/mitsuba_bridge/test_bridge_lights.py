"""Each light of Mitsuba's, over an empty floor, against its closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import floor, scene
from scipy import stats

from nusselt.mitsuba_bridge.reference import Reference, render_reference
from nusselt.renderer.lights import DirectionalLight, Light, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Material

pytestmark = pytest.mark.mitsuba

CAMERA = Camera((0.3, 1.2, 2.0), (0.1, 0.0, 0.0), (0.0, 1.0, 0.0), 25.0)
"""From under the lights: sees nothing but the floor."""
KD = np.array([0.6, 0.3, 0.9])
LEVEL = 1e-6
ROUNDING = 2e-6


def hit_points(made: Scene) -> np.ndarray:
    """Where the rays through the pixels' centres meet y = 0, (3, h, w): the course's camera, written again."""
    eye, at = np.array(made.camera.position), np.array(made.camera.target)
    look = (at - eye) / np.linalg.norm(at - eye)
    right = np.cross(look, made.camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, look)
    t = math.tan(math.radians(made.camera.fov_y) / 2)
    x = ((np.arange(made.width) + 0.5) / made.width * 2 - 1) * t * made.width / made.height
    y = (1 - (np.arange(made.height) + 0.5) / made.height * 2) * t
    d = look[:, None, None] + right[:, None, None] * x + up[:, None, None] * y[:, None]
    return eye[:, None, None] - d * eye[1] / d[1]


def quad_irradiance(light: QuadLight, points: np.ndarray) -> np.ndarray:
    """Of a unit radiance on a floor that faces +y: Gauss-Legendre over the parallelogram, (h, w)."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    nodes, weights = (nodes + 1) / 2, weights / 2
    corner, ab, ac = (np.array(v) for v in (light.corner, light.ab, light.ac))
    normal = -np.cross(ab, ac)  # as long as the area
    total = np.zeros(points.shape[1:])
    for u, wu in zip(nodes, weights, strict=True):
        for v, wv in zip(nodes, weights, strict=True):
            d = (corner + u * ab + v * ac)[:, None, None] - points
            cosines = np.maximum(d[1], 0) * np.maximum(-np.tensordot(normal, d, 1), 0)
            total += wu * wv * cosines / (d**2).sum(axis=0) ** 2
    return total


def image_of(*lights: Light, **options) -> tuple[Scene, Reference]:
    made = scene(floor(6.0, material=Material(tuple(KD))), lights=lights, camera=CAMERA, **options)
    return made, render_reference(made, seed=11, target_relative_se=5e-4, max_samples=1 << 14, timeout=120)


def assert_unbiased(reference: Reference, irradiance: np.ndarray, colour: tuple[float, float, float]) -> None:
    """Every pixel, and their mean, within what chance gives once in a million times."""
    truth = irradiance * (KD * colour)[:, None, None] / math.pi
    assert (reference.emitter == 0).all()
    assert (reference.background == 0).all()
    off = (reference.mean - truth).mean(axis=0)
    floor_error = ROUNDING * truth.mean(axis=0)
    worst = np.abs(off) / np.hypot(reference.pixel_standard_error, floor_error)
    assert worst.max() < stats.t(31).isf(LEVEL / 2 / off.size)
    error = math.hypot(np.sqrt((reference.pixel_standard_error**2).sum()) / off.size, floor_error.mean())
    assert abs(off.mean()) < stats.norm.isf(LEVEL / 2) * error
    assert error < 1e-3 * truth.mean()


SHEARED = QuadLight((-1.0, 1.5, -0.8), (0.3, 0.2, 1.4), (1.2, -0.1, 0.5), (4.0, 2.0, 1.0))


def test_a_sheared_parallelogram():
    made, reference = image_of(SHEARED)
    assert_unbiased(reference, quad_irradiance(SHEARED, hit_points(made)), SHEARED.radiance)


def test_the_assertion_above_can_fail():
    made, reference = image_of(SHEARED)
    with pytest.raises(AssertionError):
        assert_unbiased(reference, 1.005 * quad_irradiance(SHEARED, hit_points(made)), SHEARED.radiance)


@pytest.mark.parametrize("angle", [0.5, 4.0])
def test_a_sun_above_the_horizon(angle):
    sun = SunLight((1.0, 1.5, -0.5), (3.0, 2.0, 1.0), angle)
    _, reference = image_of(sun)
    assert_unbiased(reference, np.full(reference.emitter.shape, sun.direction[1]), sun.irradiance)


def assert_exact(reference: Reference, truth: np.ndarray) -> None:
    assert (reference.standard_error <= 1e-7 * truth).all()
    np.testing.assert_allclose(reference.mean, truth, rtol=1e-5)
    assert abs((reference.mean / truth).mean() - 1) < 1e-6
    assert reference.samples <= 2


def test_a_point_light_falls_with_the_square_of_the_distance():
    light = PointLight((0.5, 1.2, -0.4), (3.0, 50.0, 7.0))
    made, reference = image_of(light)
    d = np.array(light.position)[:, None, None] - hit_points(made)
    irradiance = d[1] / (d**2).sum(axis=0) ** 1.5
    assert_exact(reference, irradiance * (KD * light.intensity)[:, None, None] / math.pi)


def test_a_directional_light_shines_from_where_the_file_points():
    light = DirectionalLight((1.0, 2.0, -1.0), (3.0, 50.0, 7.0))
    _, reference = image_of(light)
    truth = light.direction[1] * (KD * light.irradiance) / math.pi
    assert_exact(reference, np.broadcast_to(truth[:, None, None], reference.mean.shape))


def test_light_from_below_the_floor_is_none():
    _, reference = image_of(DirectionalLight((1.0, -2.0, -1.0), (1.0, 1.0, 1.0)), PointLight((0, -1, 0), (1, 1, 1)))
    assert not reference.mean.any()


def test_several_lights_add_up_and_pool_their_noise():
    # The point stands below the parallelogram, so that neither shadows the other.
    point, other = (
        PointLight((1.8, 0.9, 0.5), (3.0, 5.0, 7.0)),
        QuadLight((2, 1, -1), (0, 1, 0.5), (0.3, 0, 1), (2, 2, 9)),
    )
    made, both = image_of(SHEARED, point, other)
    points = hit_points(made)
    d = np.array(point.position)[:, None, None] - points
    shares = [(d[1] / (d**2).sum(axis=0) ** 1.5, point.intensity)]
    shares += [(quad_irradiance(light, points), light.radiance) for light in (SHEARED, other)]
    total = sum(irradiance * np.array(colour)[:, None, None] for irradiance, colour in shares)
    assert_unbiased(both, total, (1.0, 1.0, 1.0))


def test_pass_means_average_to_the_image_and_carry_its_noise():
    _, reference = image_of(SHEARED)
    passes = reference.pass_means
    assert passes.size >= 32
    assert passes.mean() == pytest.approx(reference.mean.mean(), rel=1e-9)
    pooled = np.sqrt((reference.pixel_standard_error**2).sum()) / reference.emitter.size
    ratio = passes.var(ddof=1) / passes.size / pooled**2
    low, high = (stats.chi2(passes.size - 1).ppf(q) / (passes.size - 1) for q in (LEVEL / 2, 1 - LEVEL / 2))
    assert low < ratio < high
    assert pooled < 1.5 * 5e-4 * reference.mean.mean()


def test_the_same_seed_gives_the_same_bits_and_another_does_not():
    (_, a), (made, b) = image_of(SHEARED), image_of(SHEARED)
    np.testing.assert_array_equal(a.mean, b.mean)
    np.testing.assert_array_equal(a.pass_means, b.pass_means)
    other = render_reference(made, seed=12, target_relative_se=5e-4, max_samples=1 << 14, timeout=120)
    assert (other.mean != a.mean).any()
