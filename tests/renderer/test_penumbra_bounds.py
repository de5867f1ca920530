"""What silhouettes tell of soft shadows carries a bound of its error: twins agree within it, defects break it."""

from __future__ import annotations

import numpy as np
import pytest
from builders import lamp
from test_penumbra import plate, rectangle, shadow_on_lamp, source_of

from nusselt.experiments.scenes.meshes import displaced_sphere, many_small
from nusselt.renderer.closed_forms.irradiance import irradiance
from nusselt.renderer.lights import QuadLight
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.soft_shadows.meshes import mesh_radiance
from nusselt.renderer.soft_shadows.meshes import overlap as overlap_module
from nusselt.renderer.soft_shadows.meshes.order import change, swaps_in_bands
from nusselt.renderer.soft_shadows.meshes.overlap import Lines
from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.vectors import column, unit


def torus(triangles: int):
    """Twice as many points around as across its tube: closed, and with layers over layers from nearly everywhere."""
    across = round((triangles / 4) ** 0.5)
    u, v = (2 * np.pi * np.arange(k) / k for k in (2 * across, across))
    out = 1 + 0.4 * np.cos(v)
    vertices = np.stack((np.cos(u)[:, None] * out, 0 * u[:, None] + 0.4 * np.sin(v), np.sin(u)[:, None] * out))
    a = np.arange(2 * across * across).reshape(2 * across, across)
    b, d = np.roll(a, -1, axis=0), np.roll(a, -1, axis=1)
    c = np.roll(b, -1, axis=1)
    corners = [np.stack([v.ravel() for v in some]) for some in ((a, c, b), (a, d, c))]
    return vertices.reshape(3, -1), np.hstack(corners)


def white(x, n) -> ShadingPoints:
    count = x.shape[1]
    columns = {"diffuse": np.full((3, count), np.pi)}
    return ShadingPoints(x, n, n, n, (Lambert,), columns, np.full(count, -1), np.zeros(count, bool))


def value(light: QuadLight, vertices, triangles, x, n):
    """Irradiance (m,), its bound, and that without blockers."""
    radiance, bound = mesh_radiance(white(x, n), source_of(light, Mesh(vertices, triangles)))
    whole = irradiance(x, n, light.corner, light.ab, light.ac)[0]
    return radiance[0], bound * whole, whole


def receivers(vertices, triangles, rng, count: int):
    """On a floor, some with oblique normals; on the mesh; and near it."""
    floor = np.stack((rng.uniform(-1.5, 1.5, count), np.zeros(count), rng.uniform(-1.5, 1.5, count)))
    up = unit(column((0, 1, 0)) + rng.uniform(-2, 2, (3, count)) * (rng.random(count) < 0.3))
    a, b, c = (vertices[:, corner] for corner in triangles[:, rng.integers(0, triangles.shape[1], count)])
    w = rng.dirichlet((1, 1, 1), count).T
    on, normal = w[0] * a + w[1] * b + w[2] * c, unit(np.cross(b - a, c - a, axis=0))
    off = on + normal * 10 ** rng.uniform(-6, -1, count)
    return np.hstack((floor, on, off)), np.hstack((up, normal, unit(rng.normal(size=(3, count)))))


def turn(rng):
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


def one(corner, ab, ac) -> QuadLight:
    return QuadLight(*(tuple(float(c) for c in v) for v in (corner, ab, ac)), (1.0, 1.0, 1.0))


LIGHTS = {
    "square": one((-0.5, 2.3, -0.5), (0, 0, 1), (1, 0, 0)),
    "sheared": one((-0.5, 2.2, -0.6), (0.3, 0.1, 1.0), (1.1, -0.1, 0.2)),
    "small": one((0.2, 2.4, 0.1), (0, 0, 1e-3), (1e-3, 0, 0)),
    "wide": one((-2, 3, -2), (0, 0, 4), (4, 0, 0)),
    "low": one((-2.2, 0.3, -1), (0, 0, 2), (0, 2, 0)),
}
SHAPES = {"torus": torus, "ball": displaced_sphere, "crowd": many_small}


def placed(shape, count: int, rng):
    vertices, triangles = shape(count)
    return turn(rng) @ vertices * 0.45 + column((0, 1.1, 0)), triangles


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("shape", SHAPES)
def test_twins_agree_within_their_bounds(shape, light):
    """Turned, moved and shuffled; and lit by four parts of the light."""
    rng = np.random.default_rng([3, *map(ord, shape + light)])
    vertices, triangles = placed(SHAPES[shape], 1024 if shape != "crowd" else 512, rng)
    x, n = lit(LIGHTS[light], *receivers(vertices, triangles, rng, 100))
    first, bound, whole = value(LIGHTS[light], vertices, triangles, x, n)
    assert np.median(bound / whole) < (1e-7 if light == "small" else 1e-8)
    assert light == "small" or ((first > 0.01 * whole) & (first < 0.99 * whole)).sum() > 10
    agree_turned(LIGHTS[light], vertices, triangles, x, n, rng)

    corner, ab, ac = (np.array(v) for v in (LIGHTS[light].corner, LIGHTS[light].ab, LIGHTS[light].ac))
    u, v = rng.uniform(0.2, 0.8, 2)
    total, error = np.zeros_like(first), bound.copy()
    for u0, u1 in ((0, u), (u, 1)):
        for v0, v1 in ((0, v), (v, 1)):
            part = one(corner + u0 * ab + v0 * ac, (u1 - u0) * ab, (v1 - v0) * ac)
            some, more, _ = value(part, vertices, triangles, x, n)
            total += some
            error += more
    assert (np.abs(total - first) <= error).all()


def lit(light: QuadLight, x, n):
    """Those points before the light whose horizon it is above."""
    beyond = -np.cross(light.ab, light.ac) @ (x - column(light.corner))
    k = np.flatnonzero((irradiance(x, n, light.corner, light.ab, light.ac)[0] > 1e-12) & (beyond > 0))
    return x[:, k], n[:, k]


def agree_turned(light: QuadLight, vertices, triangles, x, n, rng) -> None:
    """Each relative to its unoccluded value: rounded inputs move that too, where it is nearly nothing."""
    first, bound, whole = value(light, vertices, triangles, x, n)
    q, by = turn(rng), rng.uniform(-1, 1, (3, 1))
    turned = one((q @ column(light.corner) + by).ravel(), q @ light.ab, q @ light.ac)
    shuffled = triangles[:, rng.permutation(triangles.shape[1])]
    second, other, again = value(turned, q @ vertices + by, shuffled, q @ x + by, q @ n)
    assert (np.abs(first / whole - second / again) <= bound / whole + other / again).all()


def _scaled(monkeypatch) -> None:
    right = Lines.sums

    def sums(self, x, n, frame):
        found, doubt, lengths = right(self, x, n, frame)
        return found * (1 + 1e-4), doubt, lengths

    monkeypatch.setattr(Lines, "sums", sums)


def _uncrossed(monkeypatch) -> None:
    monkeypatch.setattr(overlap_module, "_crossings", lambda order, strips, weights: [])


@pytest.mark.parametrize("defect", [_scaled, _uncrossed])
def test_planted_defects_break_the_bound(defect, monkeypatch):
    rng = np.random.default_rng(5)
    vertices, triangles = placed(torus, 1024, rng)
    x, n = receivers(vertices, triangles, rng, 60)
    right, bound, _ = value(LIGHTS["square"], vertices, triangles, x, n)
    defect(monkeypatch)
    wrong, too, _ = value(LIGHTS["square"], vertices, triangles, x, n)
    assert (np.abs(wrong - right) > bound + too).sum() >= 10


def test_what_is_in_line_with_the_light_is_hidden_as_what_is_beside_that():
    """A box's sides, seen from planes through the light's sides, pass its corners and rim to the last bit."""
    places = np.array([-0.5, -0.25, 0, 0.25, 0.5, 0.1, -0.3])
    x = np.stack([v.ravel() for v in np.meshgrid(places, [0.0], places)])
    n = np.tile(column((0, 1, 0)), (1, x.shape[1]))
    for bounds in ((-0.5, 0.5, -0.5, 0.5), (-0.5, 0.2, -0.5, 0.1), (-0.5, 0.5, -0.2, 0.2), (-0.25, 0.25, -0.25, 0.25)):
        box = plate(*bounds, 1.0)
        found, bound, _ = value(lamp(2.0, 0.5, (1.0,) * 3), box.vertices, box.triangles, x, n)
        thin = plate(*bounds, 1.0, thick=1e-9)
        exact = [
            full - rectangle(x[:, [k]], n[:, [k]], *shadow_on_lamp(x[:, k], bounds, 1.0, 2.0, 0.5), 2.0)[0]
            for k, full in enumerate(rectangle(x, n, -0.5, 0.5, -0.5, 0.5, 2.0))
        ]
        sheet, error, _ = value(lamp(2.0, 0.5, (1.0,) * 3), thin.vertices, thin.triangles, x, n)
        assert np.abs(sheet - exact).max() < 3e-9 + error.max()  # its upper side shows for 1e-9 of thickness
        assert (found <= sheet + bound + error).all()  # a thicker one hides more


def test_points_on_a_fold_are_told_to_be_unsure():
    """Rounding decides whether a point on an edge is before the other face: turned, it may be behind."""
    rng = np.random.default_rng(6)
    vertices, triangles = placed(torus, 1024, rng)
    a, b, c = (vertices[:, corner] for corner in triangles)
    n = unit(np.cross(b - a, c - a, axis=0))
    for x, unsure in (((a + b + c) / 3, False), ((a + b) / 2, True)):
        x, up = lit(LIGHTS["wide"], x, n)
        _, bound, whole = value(LIGHTS["wide"], vertices, triangles, x, up)
        assert ((bound >= whole).mean() > 0.2) if unsure else (bound < whole).all()
        agree_turned(LIGHTS["wide"], vertices, triangles, x, up, rng)


@pytest.mark.parametrize("bands", [1, 6, 24])
def test_swaps_end_in_the_order_of_the_ends_with_the_layers_there(bands):
    """And what lies under the stretches together is the area between, by many lines across."""
    rng = np.random.default_rng(8)
    for count in (2, 5, 12):
        begin, end = np.sort(rng.random(count)), rng.random(count)
        step = rng.permutation(np.repeat([1, -1], (count + 1) // 2)[:count])
        lowest = int(min(0, np.cumsum(step[np.argsort(-step)[::-1]]).min()))
        left = -lowest
        right = left + np.cumsum(step)
        found = swaps_in_bands(begin, end, step, right, np.zeros(count, dtype=np.int64), bands)
        order = np.argsort(end)
        expected = np.empty(count, dtype=np.int64)
        expected[order] = change(left + np.cumsum(step[order]), step[order])
        assert (found.last == expected).all()
        if found.late.any():
            continue
        share = (np.arange(20_000) + 0.5) / 20_000
        lines = begin + share[:, None] * (end - begin)
        sort = np.argsort(lines, axis=1)
        weight = change(left + np.cumsum(step[sort], axis=1), step[sort])
        area = ((1 - np.take_along_axis(lines, sort, axis=1)) * weight).sum(axis=1).mean()
        total = 0.0
        for part in range(count):
            at = [0.0, *found.share[found.part == part], 1.0]
            p = [begin[part], *found.p[found.part == part], end[part]]
            weights = [*found.before[found.part == part], found.last[part]]
            total += sum(
                w * (t1 - t0) * (1 - (p0 + p1) / 2)
                for w, t0, t1, p0, p1 in zip(weights, at, at[1:], p, p[1:], strict=False)
            )
        assert total == pytest.approx(area, abs=1e-4)
