"""Soft shadows of closed meshes: against closed forms where the hidden part is a rectangle, and against sampling."""

from __future__ import annotations

import numpy as np
import pytest
from builders import floor, geometry, lamp, scene
from test_many_triangles import made

from nusselt.experiments.scenes.meshes import displaced_sphere, many_small, torus_knot
from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.estimators import CommonPointsFixed, Exact
from nusselt.renderer.estimators.common_points import hidden, lattice
from nusselt.renderer.image import render
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.soft_shadows.meshes import hidden_irradiance
from nusselt.renderer.surfaces import Material, Mesh
from nusselt.renderer.vectors import column, unit
from nusselt.renderer.visibility.segments import Blockers


def source_of(light: QuadLight, *meshes: Mesh) -> Source:
    return Source(0, light, Blockers.everything(geometry(*meshes, lights=(light,))).gathered(), False)


def plate(x0, x1, z0, z1, y, thick=0.01, cells=6) -> Mesh:
    """A box, its faces cut into cells: closed, and of many triangles."""
    faces = []
    low, high = np.array([x0, y, z0]), np.array([x1, y + thick, z1])
    grid = np.linspace(0, 1, cells + 1)
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, 1):
            for i in range(cells):
                for j in range(cells):
                    square = np.zeros((4, 3))
                    square[:, axis] = end
                    square[:, u] = grid[[i, i + 1, i + 1, i]]
                    square[:, v] = grid[[j, j, j + 1, j + 1]]
                    faces.append((low + square * (high - low))[:: 1 if end else -1])
    corners = np.concatenate(faces)
    first = 4 * np.arange(len(faces))
    triangles = np.hstack([first + np.array([[0], [1], [2]]), first + np.array([[0], [2], [3]])])
    return Mesh(corners.T, triangles)


def rectangle(x, n, x0, x1, z0, z1, y):
    value, _ = irradiance(x, n, column((x0, y, z0)), column((0, 0, z1 - z0)), column((x1 - x0, 0, 0)))
    return value


def shadow_on_lamp(x, bounds, y, height, half):
    """What a rectangle at height y hides of a lamp, seen from x: a rectangle on the lamp."""
    scale = (height - x[1]) / (y - x[1])
    x0, x1, z0, z1 = bounds
    low = [np.clip(x[k] + scale * (v - x[k]), -half, half) for k, v in ((0, x0), (0, x1), (2, z0), (2, z1))]
    return [float(v) for v in low]


LAMP = lamp(2.0, 0.5)
BELOW = np.array([[0.0, 0, 0], [0.05, 0, 0.02], [-0.03, 0.1, 0.04], [0.02, 0.3, -0.06]]).T


def test_one_layer_is_lamberts_formula_to_rounding():
    bounds = (-0.21, 0.24, -0.17, 0.29)
    source = source_of(LAMP, plate(*bounds, 1.0))
    # The last two see the horizon cut the lamp, and what hides it.
    n = unit(np.array([[0, 1, 0], [0.1, 1, 0], [0.03, 0.002, 1], [-1, 0.04, 0.1]]).T)
    value, _ = hidden_irradiance(source, BELOW, n)
    for k in range(4):
        part = shadow_on_lamp(BELOW[:, k], bounds, 1.0, 2.0, 0.5)
        exact = rectangle(BELOW[:, [k]], n[:, [k]], *part, 2.0)[0]
        assert value[k] == pytest.approx(exact, rel=1e-13)


@pytest.mark.parametrize("extra", [0.0, 0.3])
def test_two_layers_are_counted_once(extra):
    """Union of two rectangles on the lamp, by inclusion and exclusion; with ``extra`` one reaches past the rim."""
    first, second = (-0.2, 0.1, -0.1, 0.2), (-0.08 - extra, 0.3 + extra, -0.17, 0.06)
    source = source_of(LAMP, plate(*first, 0.9), plate(*second, 1.2))
    n = np.tile(column((0, 1, 0)), (1, 4))
    value, _ = hidden_irradiance(source, BELOW, n)
    for k in range(4):
        a, b = (shadow_on_lamp(BELOW[:, k], m, y, 2.0, 0.5) for m, y in ((first, 0.9), (second, 1.2)))
        both = [max(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), min(a[3], b[3])]
        at, up = BELOW[:, [k]], n[:, [k]]
        exact = [rectangle(at, up, *m, 2.0)[0] for m in (a, b, both)]
        union = exact[0] + exact[1] - exact[2]
        assert value[k] == pytest.approx(union, rel=1e-12)  # the grid that strips are kept to
        assert exact[2] > 0.05 * union  # the control: without the correction it would be that far off


def test_all_and_nothing_hidden():
    source = source_of(LAMP, plate(-3, 3, -3, 3, 1.0))
    n = np.tile(column((0, 1, 0)), (1, 4))
    value, _ = hidden_irradiance(source, BELOW, n)
    np.testing.assert_allclose(value, rectangle(BELOW, n, -0.5, 0.5, -0.5, 0.5, 2.0), rtol=1e-13)
    value, _ = hidden_irradiance(source, BELOW + column((20, 0, 0)), n)
    assert (value == 0).all()


SHEARED = QuadLight((-0.5, 2.2, -0.6), (0.3, 0.1, 1.0), (1.1, -0.1, 0.2), (1, 1, 1))


@pytest.mark.parametrize("shape", [displaced_sphere, torus_knot, many_small])
@pytest.mark.parametrize("light", [LAMP, SHEARED], ids=["square", "sheared"])
def test_contours_and_light_points_tell_the_same_of_floors_and_of_the_mesh_itself(shape, light):
    """The difference falls as the light points grow: it is theirs."""
    mesh = made(shape, 1200 if shape is not many_small else 400, 0.45, (0, 1.1, 0))
    source = source_of(light, mesh)
    rng = np.random.default_rng(1)
    flat = np.stack((rng.uniform(-1, 1, 120), np.zeros(120), rng.uniform(-1, 1, 120)))
    pick = rng.integers(0, mesh.triangles.shape[1], 120)
    w = rng.dirichlet((1, 1, 1), 120).T
    a, b, c = (corner[:, pick] for corner in mesh.corners)
    x = np.hstack((flat, w[0] * a + w[1] * b + w[2] * c))
    n = np.hstack((np.tile(column((0, 1, 0)), (1, 120)), unit(np.cross(b - a, c - a, axis=0))))
    value, _ = hidden_irradiance(source, x, n)
    k = np.flatnonzero(value > 0)
    assert (k >= 120).sum() > 20
    k = np.arange(x.shape[1])
    white = np.full((3, k.size), np.pi)
    points = ShadingPoints(
        x[:, k],
        n[:, k],
        n[:, k],
        n[:, k],
        (Lambert,),
        {"diffuse": white},
        np.full(k.size, -1),
        np.zeros(k.size, bool),
    )

    def off(samples):
        at = lattice(samples)
        sampled = hidden(points, source, at + 0.5 / at.shape[1])[0] / light.radiance[0]
        return np.sqrt(((sampled - value[k]) ** 2).mean()), sampled.mean() - value[k].mean()

    coarse, _ = off(21)
    fine, mean = off(377)
    scale = value[k].mean()
    assert scale > 0.01
    assert fine < 0.25 * coarse
    assert abs(mean) < 2e-3 * scale


def test_a_mesh_over_a_floor_is_rendered_without_noise_and_as_light_points_find_it():
    s = scene(made(torus_knot, 800, 0.7, (0, 1, 0)), floor(), lights=(lamp(2.5),), size=(20, 15))
    needs = prepare(s).needs
    assert not Exact().is_random(needs)
    image = render(s, Exact(), passes=2)
    assert not image.variance.any()
    sampled = render(s, CommonPointsFixed(samples=377))
    size = np.sqrt((image.mean**2).mean())
    assert np.abs(image.mean - sampled.mean).max() < 0.05 * size
    assert np.sqrt(((image.mean - sampled.mean) ** 2).mean()) < 4e-3 * size
    large = s.with_(meshes=(made(torus_knot, 1600, 0.7, (0, 1, 0)), *s.meshes[1:]))
    shiny = Material((0.5,) * 3, (0.2,) * 3, 9)
    glossy = large.with_(meshes=tuple(Mesh(m.vertices, m.triangles, shiny) for m in large.meshes))
    assert Exact().is_random(prepare(glossy).needs)


def test_what_it_cannot_do_is_refused():
    n, x = column((0, 1, 0)), column((0, 0, 0))
    closed = plate(-0.2, 0.2, -0.2, 0.2, 1.0)
    torn = Mesh(closed.vertices, closed.triangles[:, 1:])
    with pytest.raises(ValueError, match="closed surface"):
        hidden_irradiance(source_of(LAMP, torn), x, n)
    with pytest.raises(ValueError, match=r"closed surface|behind the light"):
        hidden_irradiance(source_of(LAMP, plate(-0.2, 0.2, -0.2, 0.2, 2.5)), x, n)
