"""Normals of needles, and the shadows that wrong ones cast."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from builders import GREY, scene

from nusselt.renderer.camera.rays import pixel_centres
from nusselt.renderer.camera.view import look
from nusselt.renderer.estimators import Exact
from nusselt.renderer.geometry.triangle_normals import triangle_normals
from nusselt.renderer.image import render
from nusselt.renderer.lights import PointLight
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.vectors import cross

EPS = 2.0**-53


def errors(normal, a, b, c):
    """Of each normal's worst component, in units of its length times EPS."""
    out = []
    for k in range(a.shape[1]):
        start, one, other = ([Fraction(float(v)) for v in corner[:, k]] for corner in (a, b, c))
        e, f = ([end[i] - start[i] for i in range(3)] for end in (one, other))
        right = [e[i] * f[j] - e[j] * f[i] for i, j in ((1, 2), (2, 0), (0, 1))]
        length = float(sum(v * v for v in right)) ** 0.5
        worst = max(abs(float(Fraction(float(normal[i, k])) - right[i])) for i in range(3))
        out.append(worst / (length * EPS))
    return np.array(out)


@pytest.mark.parametrize("aspect", [1.0, 1e4, 1e9])
def test_they_err_by_a_rounding_however_thin_the_triangle(aspect):
    rng = np.random.default_rng(4)
    a, e = rng.normal(size=(2, 3, 100)) * 10.0 ** rng.uniform(-2, 2, 100)
    b, c = a + e, a + e * rng.uniform(0.2, 1.8, 100) + rng.normal(size=(3, 100)) / aspect
    normal = triangle_normals(a, b, c)
    assert errors(normal, a, b, c).max() < 2
    assert aspect == 1 or np.median(errors(cross(b - a, c - a), a, b, c)) > 10  # as a plain product does
    assert np.array_equal(normal, -triangle_normals(a, c, b))
    assert np.isfinite(triangle_normals(a * 1e152, b * 1e152, c * 1e152)).all()


def test_facets_of_a_tube_do_not_shade_themselves():
    """A thousand facets, two hundred times as long as they are wide: one lit place in ten was behind its own facet."""
    around = np.linspace(0, 2 * np.pi, 1025)[:-1]
    axis, x, y = np.linalg.qr(np.array([[0.5, 1.1, -0.9], [0.3, 1.0, 0.1], [0.2, 0.1, 1.0]]).T)[0].T
    ring = 0.5 * (x[:, None] * np.cos(around) + y[:, None] * np.sin(around))
    points = np.hstack((ring - axis[:, None], ring + axis[:, None]))
    k, after = np.arange(1024), (np.arange(1024) + 1) % 1024
    faces = np.hstack(([k, after, after + 1024], [k, after + 1024, k + 1024]))
    first, second, third = points[:, faces[:, 0]].T
    if np.cross(second - first, third - first) @ ring[:, 0] < 0:
        faces = faces[::-1]  # fronts outside
    camera = Camera((0.5, 2.0, 6.0), (0, 0, 0), (0, 1, 0), 25.0)
    light = PointLight((1.0, 3.0, 3.0), (20.0, 20.0, 20.0))
    shown = scene(Mesh(points, faces, GREY), lights=(light,), camera=camera, size=(48, 36))
    near, geometry, _ = prepare(shown)
    view = look(near, geometry, *pixel_centres(range(48), range(36)))
    faces_light = (view.points.normal * (np.array([[1.0], [3.0], [3.0]]) - view.points.position)).sum(axis=0) > 0
    assert faces_light.sum() > 150
    assert (render(shown, Exact()).mean.reshape(3, -1)[0, view.lit][faces_light] > 0).all()
