"""The sun's irradiance, cut by the horizon, against quadrature."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mpmath import mp

from nusselt.renderer.lights import SunLight
from nusselt.renderer.vectors import column


def by_quadrature(alpha: float, theta: float) -> float:
    """Integral of max(n.w, 0) over the cap of half angle alpha about zenith angle theta, over pi sin^2 alpha."""
    with mp.workdps(30):

        def ring(t: mp.mpf) -> mp.mpf:
            # max(cos theta cos t + sin theta sin t cos phi, 0) over phi, cut where it is zero
            a, b = mp.cos(theta) * mp.cos(t), mp.sin(theta) * mp.sin(t)
            cut = 0 if a <= -b else mp.pi if a >= b else mp.acos(-a / b)
            return 2 * (a * cut + b * mp.sin(cut)) * mp.sin(t)

        kink = abs(mp.pi / 2 - theta)
        ends = [0, kink, alpha] if 0 < kink < alpha else [0, alpha]
        return float(mp.quad(ring, ends) / (mp.pi * mp.sin(alpha) ** 2))


@pytest.mark.parametrize("degrees", [0.05, 0.5, 5.0, 60.0, 170.0])
def test_irradiance_is_that_of_quadrature_above_across_and_below_the_horizon(degrees):
    alpha = math.radians(degrees) / 2
    sun = SunLight((0.0, 0.0, 1.0), (1, 1, 1), degrees)
    theta = np.concatenate([np.linspace(0, math.pi, 13)[1:-1], math.pi / 2 + alpha * np.linspace(-1.2, 1.2, 13)])
    theta = theta[(theta > 0) & (theta < math.pi)]
    normals = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)])
    expected = np.array([by_quadrature(alpha, t) for t in theta])
    got = sun.irradiance_on(normals)
    # Across the horizon terms of order alpha leave a value of order alpha^3, here over alpha^2: the promise.
    promise = 4 * np.finfo(float).eps * (1 + 1 / alpha)
    assert (np.abs(got - expected)).max() < promise
    assert (got[theta > math.pi / 2 + alpha] == 0).all()


def test_facing_the_sun_gives_the_irradiance_named():
    sun = SunLight((1, 2, 3), (2, 3, 4), 0.53)
    assert sun.irradiance_on(column(sun.direction))[0] == pytest.approx(1, rel=1e-15)
    r, *_ = sun.radiance
    assert r * math.pi * math.sin(sun.half_angle) ** 2 == pytest.approx(2, rel=1e-15)
