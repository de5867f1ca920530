"""Folds: what one ray tells of a stretch of an edge is what two rays tell of each bit of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from area_truth import scenes
from builders import GREY, box, floor, lamp, scene, sphere_mesh

from nusselt.experiments.studies.race.scenes import bumpy_ball
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.lights import DiskLight, QuadLight
from nusselt.renderer.pixels import folds as folds_module
from nusselt.renderer.pixels import whole_pixels
from nusselt.renderer.pixels.faces import find_faces
from nusselt.renderer.pixels.folds import contacts, folds_of
from nusselt.renderer.pixels.shade import regions_of
from nusselt.renderer.pixels.whole_pixels import shown_by
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.vectors import alike, dot

RED = Material((0.7, 0.1, 0.1))
SIZE = (64, 48)


def ball(center, radius, rings=10, material=GREY, turn=0.3):
    mesh = sphere_mesh(rings, radius)
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array([[c, -s, 0.1], [s, c, 0.2], [-0.2, 0.1, 1.0]]) @ mesh.vertices
    return Mesh(turned + np.reshape(center, (3, 1)), mesh.triangles, material)


def inside_out(mesh):
    return Mesh(mesh.vertices, mesh.triangles[::-1], mesh.material)


def boxes():
    """Rows of boxes as high as each other, each a surface of its own; row touches row, edges run along edges."""
    return [
        box((x + 0.07 * k, 0, z), (x + 0.07 * k + 0.25, 0.5, z + 0.25))
        for k, z in enumerate(np.arange(-1, 1, 0.25))
        for x in np.arange(-1, 1, 0.3)
    ]


ON_AXIS = Camera((0.0, 0.25, 6.0), (0.0, 0.25, 0.0), (0.0, 1.0, 0.0), 25.0)
NEAR = Camera((0.0, 0.9, 1.15), (0.1, 0.5, 0.0), (0.0, 1.0, 0.0), 70.0)
HIGH, LOW, SMALL = ball((0, 0.8, 0), 0.8), ball((0, 0.5, 0), 0.8), ball((0.3, 0.7, 1.6), 0.4, 8)
SCENES = {
    "behind each other": scene(floor(), HIGH, SMALL, box((-1, 0, 1), (-0.6, 2, 1.2))),
    "through each other": scene(floor(), LOW, ball((0.5, 0.7, 0.2), 0.6), box((-1, 0.2, -1), (1, 0.6, 1))),
    "through round things": scene(
        LOW, ellipsoids=(Ellipsoid.sphere((0.4, 0.9, 0.5), 0.5, RED),),
        lights=(DiskLight((0.0, 0.9, 0.3), (0.3, -1.0, 0.4), 1.1, (3.0, 3.0, 3.0)),),
    ),
    "given twice": scene(floor(), HIGH, ball((0, 0.8, 0), 0.8, material=RED), SMALL),
    "face to face": scene(floor(), *boxes()),
    "behind each other exactly": scene(floor(), *boxes(), camera=ON_AXIS),
    "from inside": scene(ball((0, 3, 6.1), 1.5), ball((0.2, 2.7, 5.4), 0.2, 6)),
    "inside out": scene(floor(), inside_out(HIGH), ball((0.2, 1.2, 1.4), 0.3, 6)),
    "beside the eye": scene(floor(), LOW, ball((0.2, 0.8, 1.9), 0.8), camera=NEAR),
    "creased": scene(floor(), HIGH, lights=(lamp(0.9, 0.3),)),
    "smaller than pixels": scene(floor(), ball((0, 0.8, 0), 0.8, 24), ball((0, 1.2, 2), 0.05, 8)),
    "bumpy": scene(floor(), bumpy_ball(16)),
    **{view.name: view for view in scenes()},
}  # fmt: skip


def regions_in(name):
    made = SCENES[name].with_(width=SIZE[0], height=SIZE[1])
    return regions_of(made, made.digest())[-1]


def folds_in(regions):
    creased = regions.creased[:, : regions.faces.count]
    return folds_of(regions.geometry, regions.faces, regions.lens, creased, regions.far)


def lengths(edges):
    """Length of the edges between each two regions."""
    bits = edges.bits
    low, high = np.minimum(edges.left, edges.right) + 1, np.maximum(edges.left, edges.right) + 1
    pair, which = np.unique(low * 10**6 + high, return_inverse=True)
    return dict(zip(pair.tolist(), np.bincount(which, np.hypot(*(bits.end - bits.start))).tolist(), strict=True))


def areas(pieces):
    return dict(zip(zip(pieces.cell.tolist(), pieces.region.tolist(), strict=True), pieces.area.tolist(), strict=True))


def apart(one, other):
    return max(abs(one.get(key, 0) - other.get(key, 0)) for key in one | other)


@pytest.fixture(autouse=True)
def folds_are_looked_for_and_no_pixel_is_crowded(monkeypatch):
    monkeypatch.setattr(folds_module, "FEW", 1)
    monkeypatch.setattr("nusselt.renderer.pixels.edge_fragments.CROWD", 1 << 40)


def asked_bit_by_bit(monkeypatch, regions):
    """What is shown if no edge is a fold."""
    with monkeypatch.context() as patch:
        patch.setattr(folds_module, "FEW", 1 << 40)
        return shown_by(regions, 1e-2)


def assert_same(found, truth):
    assert apart(lengths(found.edges), lengths(truth.edges)) < 1e-4
    assert apart(areas(found.pieces), areas(truth.pieces)) < 1e-5
    np.testing.assert_array_equal(found.region, truth.region)
    np.testing.assert_array_equal(found.sampled.pixel, truth.sampled.pixel)


@pytest.mark.parametrize("name", SCENES)
def test_folds_show_what_two_rays_a_bit_do(name, monkeypatch):
    regions = regions_in(name)
    assert_same(shown_by(regions, 1e-2), asked_bit_by_bit(monkeypatch, regions))


def nothing_met(bits, others, i, j, slack=0.0):
    return i[:0], np.zeros(0)


@pytest.mark.parametrize("name", ["behind each other", "from inside", "inside out"])
def test_what_is_told_beyond_a_meeting_is_noticed(name, monkeypatch):
    """The planted defect: what one ray tells of a fold holds behind other edges, too. The books do not balance then."""
    regions = regions_in(name)
    truth = asked_bit_by_bit(monkeypatch, regions)
    edges, _, _ = whole_pixels._edges(regions, folds_in(regions))
    assert apart(lengths(edges), lengths(truth.edges)) < 1e-4
    monkeypatch.setattr("nusselt.renderer.pixels.visible_folds.meetings", nothing_met)
    edges, _, _ = whole_pixels._edges(regions, folds_in(regions))
    assert apart(lengths(edges), lengths(truth.edges)) > 0.1
    assert_same(shown_by(regions, 1e-2), truth)


def test_edges_that_something_touches_are_no_folds(monkeypatch):
    """The planted defect: nothing touches anything. What is seen then changes where no line was known to be met."""
    regions = regions_in("through each other")
    truth, some = asked_bit_by_bit(monkeypatch, regions), folds_in(regions).edge.size
    found = contacts(regions.geometry, regions.faces)
    free = replace(found, touched=np.zeros_like(found.touched))
    monkeypatch.setattr(folds_module, "contacts", lambda geometry, faces: free)
    assert folds_in(regions).edge.size > some
    edges, _, _ = whole_pixels._edges(regions, folds_in(regions))
    assert apart(lengths(edges), lengths(truth.edges)) > 0.1
    assert_same(shown_by(regions, 1e-2), truth)


ROOF = Mesh(
    np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.5, -1.0, 1.0), (0.5, -1.0, -1.0)]).T,
    np.array([(0, 2, 1), (0, 1, 3)]).T,
    GREY,
)
"""Its ridge runs from (0, 0, 0) to (1, 0, 0)."""
OTHERS = {
    "is far away": (((0.2, 1.0, 0.0), (0.8, 1.0, 0.0), (0.5, 2.0, 0.0)), False, False),
    "is close": (((0.5, 1e-9, -1.0), (0.5, 1e-9, 1.0), (0.5, 1.0, 0.0)), False, False),
    "stands at an end": (((0.0, 0.0, 0.0), (-0.4, 1.0, 0.2), (0.4, 1.0, 0.2)), False, False),
    "goes on from an end": (((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (1.5, 1.0, 0.0)), False, False),
    "goes on along it": (((0.5, 0.0, 0.0), (1.5, 0.0, 0.0), (1.0, 1.0, 0.0)), True, None),
    "stands on it": (((0.5, 0.0, 0.0), (0.4, 1.0, 0.2), (0.6, 1.0, -0.2)), True, None),
    "stands on it with an edge": (((0.5, 0.0, -1.0), (0.5, 0.0, 1.0), (0.5, 1.0, 0.0)), True, None),
    "lies on it": (((0.2, 0.0, -1.0), (0.8, 0.0, -1.0), (0.5, 0.0, 1.0)), True, None),
    "is passed through": (((0.5, 0.5, 0.0), (0.5, -0.5, 0.3), (0.5, -0.5, -0.3)), True, True),
}


@pytest.mark.parametrize("name", OTHERS)
def test_what_touches_an_edge_between_its_ends(name):
    corners, touched, crossed = OTHERS[name]
    geometry = build_geometry(scene(ROOF, Mesh(np.array(corners).T, np.array([[0], [1], [2]]), GREY)))
    faces = find_faces(geometry)
    ridge = np.flatnonzero(faces.beside[0] >= 0)
    assert ridge.size == 1
    found = contacts(geometry, faces)
    assert found.touched[ridge] == touched
    assert crossed is None or found.crossed == crossed


@pytest.mark.parametrize("name", ["behind each other", "through each other", "cornell-boxes/3"])
def test_what_is_not_bent_is_seen_at_its_centroid(name):
    regions = regions_in(name)
    shown = shown_by(regions, 1e-2)
    pieces = shown.pieces
    hidden = regions.seen(pieces.x, pieces.y) != pieces.region
    hidden &= ~np.isin(pieces.cell, shown.sampled.pixel)
    assert hidden.any()
    assert not (hidden & ~shown.bent).any()
    assert shown.bent.mean() < 0.8


def test_a_light_in_the_plane_of_a_face_creases_it_not():
    """Rounding puts the face's corners on either side of the plane: no edge is there, and no pixel is unsure."""
    doubted = 0
    for angle in np.linspace(0.1, 1.5, 12):
        c, s = math.cos(angle), math.sin(angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        corner, across, along = (tuple(turn @ at) for at in ((-0.3, 0.2, -0.1), (0.6, 0.0, 0.0), (0.0, 0.0, 0.5)))
        sheet = Mesh(turn @ floor(1.3, 0.2).vertices, floor().triangles, GREY)
        beyond = [ball(turn @ (0.2, y, 0.1), 0.2, 4) for y in (-0.6, 0.9)]
        made = scene(sheet, *beyond, lights=(QuadLight(corner, across, along, (1.0, 1.0, 1.0)),), size=SIZE)
        regions = regions_of(made, made.digest())[-1]
        normal, point = regions.planes[0]
        height = dot(normal, np.hstack((regions.geometry.a[:, :2], regions.geometry.b[:, :2])) - point)
        assert np.abs(height).max() < 1e-14
        doubted += (height < 0).any() and (height > 0).any()
        assert not regions.creased[:, :2].any()
        assert shown_by(regions, 1e-2).sampled.pixel.size == 0
    assert doubted > 3


@pytest.mark.parametrize("values", [[[2.0, 1.0, 2.0, -0.0, 0.0], [1.0, 5.0, 1.0, 3.0, 3.0]], [[3], [1]], [[], []]])
def test_columns_are_told_apart_as_numpy_does(values):
    rows = np.array(values)
    _, first, kind, count = np.unique(rows, axis=1, return_index=True, return_inverse=True, return_counts=True)
    for mine, theirs in zip(alike(rows), (first, kind.reshape(-1), count), strict=True):
        np.testing.assert_array_equal(mine, theirs)
