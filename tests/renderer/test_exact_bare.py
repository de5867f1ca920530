"""Strips and arcs where nothing is in the way, against the closed forms: each value within both bounds."""

from __future__ import annotations

import numpy as np
import pytest
from builders import scene

from nusselt.renderer.estimators import Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.lobes import Lambert, Phong, lambert
from nusselt.renderer.needs import Source
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.visibility.segments import Blockers

EXPONENTS = np.array([0, 0.1, 0.3, 0.5, 1, 1.5, 2, 7.3, 20, 100, 1e3, 1e4, 1e6])


def units(rng, n):
    v = rng.normal(size=(3, n))
    return v / np.linalg.norm(v, axis=0)


def before(rng, light, n):
    """Points before a light, near it and far, any way turned; half of the lobes towards it; a third diffuse alone."""
    ab, ac = (np.array(v)[:, None] for v in (light.ab, light.ac))
    face = -np.cross(ab, ac, axis=0)
    face /= np.linalg.norm(face)
    u, v = rng.uniform(-0.3, 1.3, (2, n))
    x = ab * u + ac * v + units(rng, n) * rng.uniform(0.01, 1, n)
    x = x + face * (np.abs(face.T @ x) - face.T @ x)
    toward = ab * rng.random(n) + ac * rng.random(n) - x
    toward /= np.linalg.norm(toward, axis=0)
    normal = units(rng, n)
    normal = np.where(rng.random(n) < 0.5, normal, toward + 0.8 * normal)
    normal /= np.linalg.norm(normal, axis=0)
    mirror = np.where(rng.random(n) < 0.5, toward, units(rng, n))
    below = np.minimum((normal * mirror).sum(axis=0), 0)
    flat = np.zeros((3, n))
    share = rng.choice([0.0, 0.5, 1.0])
    columns = {"diffuse": flat + 1 - share, "specular": flat + share, "shininess": rng.choice(EXPONENTS, n)}
    flags = np.full(n, -1), np.zeros(n, dtype=bool)
    return ShadingPoints(x, normal, mirror, mirror - 2 * below * normal, (Lambert, Phong), columns, *flags)


def held(seed, lights, count):
    """Largest error over what both bounds allow, and how many errors above 1e-9 of the value no bound tells."""
    rng, worst, untold, told = np.random.default_rng(seed), 0.0, 0, 0
    for _ in range(lights):
        ab, ac = rng.normal(size=(2, 3)) * 10 ** rng.uniform(-3, 1.5)
        light = QuadLight((0, 0, 0), tuple(ab), tuple(ac * 10 ** rng.uniform(-1, 0)), (1, 1, 1))
        points = before(rng, light, count)
        source = Source(0, light, Blockers.everything(build_geometry(scene(lights=(light,)))), True)
        value, bound, _ = Exact(shortcuts=False).with_bounds(points, source, rng)
        right, other = light.unshadowed(points, True)
        k = np.flatnonzero(right[0] > 1e-280)
        error = np.abs(value[0] - right[0])[k] / right[0, k]
        allowed = (bound + other)[k]
        worst = max(worst, float((error / np.maximum(allowed, 1e-300)).max(initial=0)))
        untold += int(((error > 1e-9) & (allowed < 1e-9)).sum())
        told += k.size
    return worst, untold, told


def test_what_is_left_of_a_whole_light_is_the_whole_light():
    worst, untold, told = held(1, 60, 50)
    assert told > 1500
    assert worst <= 1
    assert untold == 0


@pytest.mark.parametrize("share", [1e-7, 1e-9])
def test_a_kernel_that_loses_a_little_is_caught(share, monkeypatch):
    right = lambert.lambert_arcs
    monkeypatch.setattr(lambert, "lambert_arcs", lambda *arcs: (right(*arcs)[0] * (1 - share), right(*arcs)[1]))
    worst, _, _ = held(1, 20, 50)
    assert worst > 1
