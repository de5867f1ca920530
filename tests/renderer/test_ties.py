"""Faces that lie on each other: which is seen depends on the scene alone."""

from __future__ import annotations

import numpy as np
import pytest
from builders import GREY, box, geometry, lamp, scene, sphere_mesh

import nusselt.renderer.camera.edge_functions as pencil
import nusselt.renderer.camera.nearest as nearest
import nusselt.renderer.camera.screen_boxes as image_boxes
from nusselt.experiments.search.motions import carried, turn
from nusselt.renderer.camera.first_hits import first_hits
from nusselt.renderer.camera.rays import pixel_centres, primary_directions
from nusselt.renderer.camera.screen_boxes import ImageBoxes
from nusselt.renderer.estimators import Area, Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.image import render
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid, Mesh
from nusselt.renderer.vectors import column, dot

OBLIQUE = Camera((1.3, 2.9, 4.7), (0.1, 0.0, -0.2), (0.1, 1.0, 0.05), 40.0)
SIZE = (48, 40)


def turned(mesh: Mesh, seed: int = 3) -> Mesh:
    """Off the axes: coplanar triangles then have planes that differ by rounding."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return Mesh(q @ mesh.vertices, mesh.triangles, mesh.material)


def square(half: float, pieces: int, shift: float = 0.0, flipped: bool = False, y: float = 0.0) -> Mesh:
    """A horizontal square of pieces^2 quads about ``shift``, its front up or, flipped, down."""
    line = np.linspace(-half, half, pieces + 1)
    x, z = np.meshgrid(line + shift, line + shift / 3)
    vertices = np.stack([x.ravel(), np.full(x.size, y), z.ravel()])
    k = (np.arange(pieces)[:, None] * (pieces + 1) + np.arange(pieces)).ravel()
    up = np.hstack([[k, k + pieces + 1, k + 1], [k + 1, k + pieces + 1, k + pieces + 2]])
    return Mesh(vertices, up[::-1] if flipped else up, GREY)


def seen(s, step: int = 1 << 16, corners: bool = True):
    """Surfaces (h, w), tiles of ``step`` pixels a side at a time."""
    g, origin = build_geometry(s), column(s.camera.position)
    pixel = primary_directions(s, np.array([0, 1.0, 0]), np.array([0, 0, 1.0])) if corners else None
    out = np.empty((s.height, s.width), dtype=int)
    for top in range(0, s.height, step):
        for left in range(0, s.width, step):
            rows, columns = range(top, min(top + step, s.height)), range(left, min(left + step, s.width))
            d = primary_directions(s, *pixel_centres(columns, rows))
            hits = first_hits(g, origin, d, pixel)
            out[np.ix_(rows, columns)] = hits.surface.reshape(len(rows), len(columns))
    return out


def every_way(s, monkeypatch):
    """What is seen by tiles of every size, by both paths, and in other blocks."""
    yield seen(s)
    yield seen(s, corners=False)
    for step in (1, 5, 16):
        yield seen(s, step)
    for many in (0, 1 << 20):  # all by bins, none
        monkeypatch.setattr(image_boxes, "DENSE", many)
        yield seen(s, 16)
        for block in (1, 300):
            monkeypatch.setattr(pencil, "BLOCK", block)
            monkeypatch.setattr("nusselt.renderer.geometry.ragged.BLOCK", block)
            monkeypatch.setattr(nearest, "MANY", 7)
            yield seen(s, 16)
        monkeypatch.undo()


@pytest.mark.parametrize("pieces", [1, 9])
def test_of_coincident_faces_the_first_is_seen_everywhere_and_in_every_way(pieces, monkeypatch):
    first, second = turned(square(1.0, pieces)), turned(square(1.0, 3, 0.37))
    s = scene(first, second, camera=OBLIQUE, size=SIZE)
    one = seen(s.with_(meshes=(first,)))
    assert (one == 0).sum() > 100
    for image in every_way(s, monkeypatch):
        assert (image[one == 0] == 0).all()
        assert (image == 1).sum() > 50  # the control: beside it the other


def test_the_nearest_alone_shows_both_by_turns():
    """The control: without a tie the distances' last bits decide."""
    s = scene(turned(square(1.0, 9)), turned(square(1.0, 3, 0.37)), camera=OBLIQUE, size=SIZE)
    g, origin = build_geometry(s), column(s.camera.position)
    d = primary_directions(s, *pixel_centres(range(SIZE[0]), range(SIZE[1])))
    height = dot(g.normal, g.a - origin)
    near = dot(g.normal[:, :, None], d[:, None]) / height[:, None]
    w = pencil.Pencil.about(g, origin)
    inside = np.stack([(w.weights(d, np.full(d.shape[1], k)) > 0).all(axis=0) for k in range(g.triangles)])
    both = inside[: 2 * 81].any(axis=0) & inside[2 * 81 :].any(axis=0)
    won = g.triangle_surface[np.where(inside, near, 0).argmax(axis=0)][both]
    assert 20 < won.sum() < won.size - 20


def test_a_front_is_seen_before_a_back_and_a_light_before_the_ceiling_it_lies_in(monkeypatch):
    from_below = Camera((0.3, -2.0, 3.1), (0.0, 2.0, 0.0), (0, 1, 0), 45.0)
    ceiling = square(1.5, 4, flipped=True, y=2.0)
    lamps = scene(ceiling, square(1.0, 2, y=2.0), lights=(lamp(2.0, 0.5),), camera=from_below, size=SIZE)
    light = seen(lamps.with_(meshes=())) == 0
    assert light.sum() > 50
    for image in every_way(lamps, monkeypatch):
        assert (image[light] == 2).all()
        assert not (image == 1).any()  # a back on the ceiling, and smaller


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("gap", [1e-12, 1e-9, -1e-12])
def test_what_lies_on_top_by_more_than_rounding_is_seen(scale, gap):
    below, above = square(scale, 3), square(scale, 5, y=gap * scale)
    camera = Camera((0.5 * scale, 2 * scale, 3 * scale), (0, 0, 0), (0, 1, 0), 30.0)
    image = seen(scene(below, above, camera=camera, size=SIZE))
    hit = image >= 0
    assert hit.sum() > 300
    assert (image[hit] == (gap > 0)).mean() > 0.99  # from the edges of the upper one on


def test_equal_spheres_show_the_first():
    ball = Ellipsoid.sphere((0.3, 0.7, 0.1), 0.7)
    image = seen(scene(ellipsoids=(ball, ball)))
    assert set(np.unique(image)) == {-1, 0}


def test_the_image_is_the_same_for_tiles_of_any_size_where_meshes_share_faces(monkeypatch):
    low, high = box((-1, 0, -1), (0, 1, 1)), box((0, 0, -1), (1, 1, 1))
    things = [turned(mesh, 5) for mesh in (low, high, box((-1, 0, -1), (1, 1, 1)), sphere_mesh(8, 1.2))]
    s = scene(*things, camera=OBLIQUE, size=SIZE)
    whole = seen(s)
    assert np.unique(whole).size > 2
    for image in every_way(s, monkeypatch):
        np.testing.assert_array_equal(image, whole)


def test_three_that_tie_in_a_chain_are_judged_together():
    """The first ties with the second and the second with the third, the nearest: the first, which does not, is out."""
    d = np.array([[0.0], [0.0], [-1.0]])
    normal, order = np.tile([[0.0], [0.0], [1.0]], 3), np.arange(3)
    depth = 1 + 1.6e-15 * np.array([2.0, 1.0, 0.0]) * 2
    planes = nearest.Planes.about(normal, np.stack([0 * depth, 0 * depth, -depth]), np.zeros((3, 1)))
    ray = np.zeros(1, dtype=int)
    near, rounding = 1 / depth, planes.height / depth + planes.slope
    tied = near + rounding >= (near - rounding).max()
    assert tied.tolist() == [False, True, True]
    for sequence in ([0, 1, 2], [2, 1, 0], [1, 0, 2], [0, 2, 1]):
        found = nearest.Nearest(d)
        for k in sequence:
            found.meet(planes, np.array([k]), ray, np.arange(3))
        assert found.seen(order, lambda over, under, d: np.zeros(over.size, dtype=bool))[1] == [1]


@pytest.mark.parametrize("apart", [1e-14, 1e-13, 3e-13])
def test_of_sheets_that_a_far_eye_cannot_tell_apart_none_is_seen_in_the_shadow_of_the_other(apart):
    """From 1,000 away all distances tie; shadow rays know which sheet is the upper: the lower was seen, and black."""
    far = Camera((260.0, 580.0, 940.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.12)
    sheets = [square(1.0, 3), square(1.0, 3, y=apart)]
    for pair in (sheets, sheets[::-1]):
        made = carried(scene(*pair, lights=(lamp(),), camera=far, size=(24, 20)), turn(np.random.default_rng(3)))
        for estimator in (Exact(), Area(samples=1)):
            image = render(made, estimator)
            assert image.shaded.sum() > 100
            assert (image.mean[:, image.shaded] > 0).all()


def test_boxes_of_an_empty_scene_are_met_by_nothing():
    g = geometry()
    distance, triangle, weight = ImageBoxes.about(g, np.zeros((3, 1)), None).nearest(np.ones((3, 4)))
    assert np.isinf(distance).all()
    assert (triangle == -1).all()
    assert weight.shape == (3, 4)
