"""Distances between faces, and from ellipsoids: against the closest of many points."""

from __future__ import annotations

import numpy as np
import pytest
from builders import floor, lamp, scene
from scipy.optimize import minimize

from nusselt.mitsuba_bridge.distance import between_triangles, from_ellipsoid
from nusselt.mitsuba_bridge.limits import clearance
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.surfaces import Ellipsoid

RNG = np.random.default_rng(7)


def closest(one, other) -> float:
    """By constrained least squares over both triangles' places."""
    sides = np.column_stack((one[1] - one[0], one[2] - one[0], other[0] - other[1], other[0] - other[2]))
    inside = [{"type": "ineq", "fun": lambda z, k=k: 1 - z[k] - z[k + 1]} for k in (0, 2)]
    apart = one[0] - other[0]
    found = minimize(
        lambda z: ((apart + sides @ z) ** 2).sum(),
        np.full(4, 0.25),
        jac=lambda z: 2 * sides.T @ (apart + sides @ z),
        bounds=[(0, 1)] * 4,
        constraints=inside,
        method="SLSQP",
        options={"ftol": 1e-15},
    )
    return float(np.sqrt(max(found.fun, 0.0)))


def test_triangles_of_all_kinds_of_nearness():
    one, others = RNG.normal(size=(3, 3)), RNG.normal(size=(3, 3, 150)) + RNG.normal(size=(1, 3, 150))
    found = between_triangles(tuple(one[:, :, None]), tuple(others))
    truth = np.array([closest(one, others[:, :, k]) for k in range(150)])
    np.testing.assert_allclose(found, truth, atol=1e-6)
    assert 0.03 < (found == 0).mean() < 0.6  # some pass through each other


@pytest.mark.parametrize("y", [0.0, -0.3, 0.3])
def test_a_floor_that_passes_through_an_upright_light_is_at_no_distance(y):
    """No corner of either is near the other, nor is any of 3 x 3 points of the light."""
    light = QuadLight((-0.13, -0.41, -0.7), (0.0, 0.0, 1.1), (0.0, 1.14, 0.0), (1, 1, 1))
    geometry = build_geometry(scene(floor(50.0, y)))
    assert clearance(light, geometry, np.arange(2))[0].min() == 0


def test_what_lies_behind_a_light_is_not_met():
    geometry = build_geometry(scene(floor(2.0, 2.0), floor(2.0, 2.0 + 1e-9), floor(2.0, 1.5)))
    np.testing.assert_allclose(clearance(lamp(2.0), geometry, np.arange(6))[0], [np.inf] * 4 + [0.5] * 2)


def test_an_ellipsoid_is_no_nearer_than_is_said_and_0_where_it_crosses():
    axes = np.array([[0.5, 0.1, 0.0], [0.0, 0.3, 0.05], [0.0, 0.0, 0.8]])
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 61), np.linspace(0, 2 * np.pi, 121))
    ball = np.stack((np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta))).reshape(3, -1)
    u, v = np.meshgrid(np.linspace(0, 1, 31), np.linspace(0, 1, 31))
    u, v = (w[u + v <= 1 + 1e-12] for w in (u, v))
    crossed = 0
    for _ in range(40):
        a, b, c = RNG.normal(size=(3, 3, 1))
        said = from_ellipsoid(np.zeros((3, 1)), axes, np.linalg.inv(axes), a, b, c)[0]
        places = a + (b - a) * u + (c - a) * v
        brute = np.sqrt((((axes @ ball)[:, :, None] - places[:, None]) ** 2).sum(axis=0)).min()
        inside = (np.linalg.inv(axes) @ places) ** 2
        crosses = inside.sum(axis=0).min() < 1 < inside.sum(axis=0).max()
        assert said <= brute + 1e-9
        assert (said == 0) or not crosses
        crossed += crosses
    assert crossed > 5


def test_a_ball_in_a_light_touches_it():
    geometry = build_geometry(scene(ellipsoids=(Ellipsoid.sphere((0.0, 2.0, 0.0), 0.1),)))
    assert clearance(lamp(2.0), geometry, np.arange(0))[1] == 0
