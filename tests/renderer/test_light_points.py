"""Light sampling: the right measure, tested by chi-squared and by the inverse of the mapping."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.lights.sampling import lattice, random_beams, unit_square
from nusselt.renderer.vectors import column, cross, dot, frame, unit

FALSE_ALARM = 1e-6
SHEARED = QuadLight((1.0, 2.0, -1.0), (0.3, 0.1, 1.4), (1.2, -0.4, 0.9), (1, 1, 1))


def chi_squared_p(cells: np.ndarray, expected: np.ndarray) -> float:
    return float(stats.chisquare(cells.ravel(), expected.ravel()).pvalue)


def test_area_samples_are_uniform_over_a_sheared_parallelogram():
    """Equal areas hold equal numbers; the area coordinates are found by solving, not by the sampler's own."""
    rng = np.random.default_rng(1)
    u, v = unit_square(rng, 1, 200_000, False)
    d, _ = SHEARED.beams(np.zeros((3, 1)), u, v)
    basis = np.stack([SHEARED.ab, SHEARED.ac, SHEARED.normal], axis=1)
    s, t, off = np.linalg.solve(basis, d[:, 0] - column(SHEARED.corner))
    assert np.abs(off).max() < 1e-14
    cells, *_ = np.histogram2d(s, t, bins=(11, 13), range=((0, 1), (0, 1)))
    assert cells.sum() == 200_000
    assert chi_squared_p(cells, np.full(cells.shape, 200_000 / cells.size)) > FALSE_ALARM


@pytest.mark.parametrize("samples", [1, 2, 7, 16, 34, 55])
def test_a_shifted_lattice_has_one_point_in_each_slice_and_each_point_is_uniform(samples):
    u, v = lattice(np.random.default_rng(2), 20_000, samples)
    assert u.shape == v.shape == (20_000, samples)
    assert min(u.min(), v.min()) >= 0
    assert max(u.max(), v.max()) < 1
    for w in (u, v):
        steps = np.diff(np.sort(w, axis=1), axis=1)
        np.testing.assert_allclose(steps, 1 / samples, rtol=1e-9)
    cells, *_ = np.histogram2d(u[:, samples // 2], v[:, samples // 2], bins=7, range=((0, 1), (0, 1)))
    assert chi_squared_p(cells, np.full(cells.shape, 20_000 / 49)) > FALSE_ALARM
    if samples == 34:  # Fibonacci's: no two points closer than about 1/sqrt(N)
        du, dv = (np.abs(w[0, :, None] - w[0, None]) for w in (u, v))
        near = np.hypot(np.minimum(du, 1 - du), np.minimum(dv, 1 - dv)) + np.eye(samples)
        assert near.min() > 0.8 / math.sqrt(samples)


def test_the_chi_squared_test_catches_a_density_that_is_a_tenth_off():
    rng = np.random.default_rng(1)
    u, v = rng.random((2, 200_000))
    wrong_u = u**1.1
    cells, *_ = np.histogram2d(wrong_u, v, bins=(11, 13), range=((0, 1), (0, 1)))
    assert chi_squared_p(cells, np.full(cells.shape, 200_000 / cells.size)) < FALSE_ALARM


def test_solid_angle_weights_are_the_jacobian_of_the_direction():
    """d(omega)/d(u, v) by finite differences of the direction itself."""
    p = column((0.2, -0.5, 0.1))
    u, v = np.random.default_rng(2).random((2, 1, 50))
    h = 1e-5

    def direction(du, dv):
        d, _ = SHEARED.beams(p, u + du, v + dv)
        return unit(d[:, 0])

    across = cross((direction(h, 0) - direction(-h, 0)) / (2 * h), (direction(0, h) - direction(0, -h)) / (2 * h))
    _, weight = SHEARED.beams(p, u, v)
    facing = dot(cross(column(SHEARED.ab), column(SHEARED.ac)), column(SHEARED.corner) - p) > 0
    assert facing.all()
    np.testing.assert_allclose(weight[0] * 50, np.sqrt(dot(across, across)), rtol=1e-8)


def test_quad_light_gives_nothing_behind_itself():
    behind = column(SHEARED.corner) + 2 * column([-c for c in SHEARED.normal])
    before = column(SHEARED.corner) + 2 * column(SHEARED.normal)
    u, v = np.random.default_rng(0).random((2, 1, 100))
    assert (SHEARED.beams(behind, u, v)[1] == 0).all()
    assert (SHEARED.beams(before, u, v)[1] > 0).all()


@pytest.mark.parametrize("degrees", [0.5, 10.0, 120.0])
def test_sun_samples_are_uniform_in_projected_solid_angle(degrees):
    """In the plane across the axis the points fill a disk uniformly: rings and sectors of equal area."""
    sun = SunLight((0.3, 0.8, -0.5), (1, 1, 1), degrees)
    rng = np.random.default_rng(4)
    u, v = unit_square(rng, 1, 100_000, False)
    d = sun.directions(u, v)[:, 0]
    np.testing.assert_allclose(dot(d, d), 1, rtol=1e-14)
    x, y = frame(column(sun.direction))
    a, b = dot(x, d) / math.sin(sun.half_angle), dot(y, d) / math.sin(sun.half_angle)
    cells, *_ = np.histogram2d(a * a + b * b, np.arctan2(b, a), bins=(9, 11), range=((0, 1), (-math.pi, math.pi)))
    assert cells.sum() == 100_000
    assert chi_squared_p(cells, np.full(cells.shape, 100_000 / cells.size)) > FALSE_ALARM


def test_strata_hold_one_sample_each():
    u, v = unit_square(np.random.default_rng(0), 7, 25, True)
    cell = np.floor(u * 5) * 5 + np.floor(v * 5)
    np.testing.assert_array_equal(np.sort(cell, axis=1), np.broadcast_to(np.arange(25), (7, 25)))
    inside_u, inside_v = u * 5 % 1, v * 5 % 1
    assert inside_u.std() == pytest.approx(1 / math.sqrt(12), rel=0.15)
    assert inside_v.std() == pytest.approx(1 / math.sqrt(12), rel=0.15)


def test_lights_without_extent_take_one_sample():
    p = np.array([[0.0, 1.0], [0.0, 0.0], [0.0, 2.0]])
    rng = np.random.default_rng(0)
    d, weight = random_beams(PointLight((0, 3, 0), (1, 1, 1)), p, rng, 64, False)
    assert d.shape == (3, 2, 1)
    np.testing.assert_allclose(weight[:, 0], [1 / 9, 1 / 14], rtol=1e-15)
    d, weight = random_beams(DirectionalLight((0, 2, 0), (1, 1, 1)), p, rng, 64, False)
    assert d.shape == (3, 2, 1)
    assert (weight == 1).all()
