"""Polygons cut into triangles: the area they enclose, from whichever corner they begin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import render
from nusselt.renderer.mesh_files import polygons
from nusselt.renderer.mesh_files.polygons import cut
from nusselt.renderer.scene_text import read_scene

L_SHAPE = np.array([(-1, 1), (1, 1), (1, 0), (0, 0), (0, -1), (-1, -1)], dtype=float)[::-1]
Outline = NDArray[np.float64]


def doubled_area(outline: Outline) -> float:
    x, y = outline.T
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def areas(outlines: list[Outline], turn: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[str]]:
    """Sum of the triangles' areas of each outline, and of their area vectors' lengths along its normal; the notes."""
    flat = np.concatenate([np.column_stack((p, np.zeros(len(p)))) for p in outlines])
    vertices = turn @ flat.T + [[3.0], [-2.0], [7.0]]
    counts = np.array([len(p) for p in outlines])
    triangles, notes = cut(vertices, counts, np.arange(counts.sum()))
    a, b, c = (vertices[:, corner] for corner in triangles)
    vectors = np.cross(b - a, c - a, axis=0) / 2
    at = np.cumsum(counts - 2) - (counts - 2)
    along = np.add.reduceat((vectors * turn[:, 2:]).sum(axis=0), at)
    return np.stack((np.add.reduceat(np.linalg.norm(vectors, axis=0), at), along)), notes


def turned(rng: np.random.Generator) -> NDArray[np.float64]:
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.linalg.det(turn)


def star(rng: np.random.Generator) -> Outline:
    """Corners around the origin, none half a turn from the next: simple, and mostly concave."""
    while True:
        angle = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(4, 30)))
        if np.diff(angle, append=angle[0] + 2 * np.pi).max() < 3:
            return rng.uniform(0.05, 1, (angle.size, 1)) * np.column_stack((np.cos(angle), np.sin(angle)))


def keyhole(rng: np.random.Generator) -> Outline:
    """A ring: an outer outline, a cut to a hole, the hole the other way round, and back. It touches itself."""
    outer, inner = (2 * np.pi * np.arange(rng.integers(3, 20))[:, None] for _ in range(2))
    outer, inner = outer / len(outer), -inner / len(inner)
    outer = rng.uniform(1.7, 2, outer.shape) * np.hstack((np.cos(outer), np.sin(outer)))
    inner = rng.uniform(0.2, 0.7, inner.shape) * np.hstack((np.cos(inner), np.sin(inner)))
    ring = np.concatenate((outer, outer[:1], inner, inner[:1]))
    return np.roll(ring, rng.integers(len(ring)), axis=0)


def staircase(rng: np.random.Generator) -> Outline:
    """Steps of whole numbers, with corners in line and many ties."""
    heights = np.repeat(rng.integers(1, 5, rng.integers(2, 12)), 2).astype(float)
    x = np.arange(heights.size + 1) // 2
    outline = np.concatenate(([[x[-1], 0.0]], np.column_stack((x[1:], heights))[::-1], [[0.0, heights[0]], [0.0, 0.0]]))
    return np.roll(outline, rng.integers(len(outline)), axis=0)


@pytest.mark.parametrize("shape", [star, keyhole, staircase])
def test_triangles_cover_a_polygon_once(shape) -> None:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(5)
    outlines = [shape(rng) for _ in range(400)]
    (total, along), notes = areas(outlines, turned(rng))
    right = np.array([doubled_area(outline) / 2 for outline in outlines])
    assert (right > 0).all()
    np.testing.assert_allclose(total, right, rtol=1e-9)
    np.testing.assert_allclose(along, right, rtol=1e-9)
    (note,) = notes
    assert "inward corners" in note
    fans = [np.abs(np.cross(p[1:-1] - p[0], p[2:] - p[0])).sum() / 2 for p in (np.c_[q, 0 * q[:, 0]] for q in outlines)]
    assert (np.array(fans) > right * (1 + 1e-9)).sum() > 200  # the control: fans do not


@pytest.mark.parametrize("scale", [1e-160, 1e-30, 1.0, 1e150])
def test_every_first_corner_gives_the_same_area_at_every_scale(scale: float) -> None:
    outlines = [np.roll(L_SHAPE * scale, k, axis=0) for k in range(6)]
    for outline in outlines:
        triangles, _ = cut(np.column_stack((outline, np.zeros(6))).T, np.array([6]), np.arange(6))
        a, b, c = (outline.T[:, corner] / scale for corner in triangles)
        turns = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
        assert (turns > 0).all()
        assert turns.sum() == pytest.approx(6)


def test_corners_in_line_leave_no_gap() -> None:
    """Every side of the outline is a side of some triangle, so that a neighbour's corners meet corners."""
    outline = np.array([(0, 0), (1, 0), (2, 0), (4, 0), (4, 4), (2, 4), (0, 4), (0, 3)], dtype=float)
    for first in range(8):
        rolled = np.roll(outline, first, axis=0)
        triangles, notes = cut(np.column_stack((rolled, np.zeros(8))).T, np.array([8]), np.arange(8))
        a, b, c = (rolled.T[:, corner] for corner in triangles)
        turns = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
        assert (turns > 0).all()
        assert turns.sum() == 32
        sides = {(i, j) for t in triangles.T.tolist() for i, j in zip(t, t[1:] + t[:1], strict=True)}
        assert {(k, (k + 1) % 8) for k in range(8)} <= sides
        assert notes == []


def test_convex_polygons_are_fans() -> None:
    angle = 2 * np.pi * np.arange(9) / 9
    triangles, notes = cut(np.stack((np.cos(angle), np.sin(angle), 0 * angle)), np.array([4, 3, 9]), np.r_[:4, :3, :9])
    assert notes == []
    assert triangles.T.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2], *[[0, k, k + 1] for k in range(1, 8)]]


def test_what_crosses_itself_or_is_not_flat_is_said() -> None:
    bow = np.array([(0, 0, 0), (2, 1, 0), (2, 0, 0), (0, 2, 0)], dtype=float)
    saddle = np.array([(0, 0, 0), (1, 0, 1), (1, 1, 0), (0, 1, 1)], dtype=float)
    rounded = np.array([(0, 0, 0), (1, 0, 1e-6), (1, 1, 0), (0, 1, 0)], dtype=float)
    for outline, said in ((bow, "1 polygon has sides that cross"), (saddle, "1 polygon is not flat"), (rounded, None)):
        triangles, notes = cut(outline.T, np.array([4]), np.arange(4))
        assert triangles.T.tolist() == [[0, 1, 2], [0, 2, 3]]
        assert [note[: len(said)] for note in notes] == [said] if said else not notes


def test_a_polygon_too_large_to_cut_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(polygons, "MAX_WORK", 35)
    with pytest.raises(InputError, match="concave polygons = up to 6 corners: expected fewer or smaller ones"):
        cut(np.column_stack((np.roll(L_SHAPE, -1, axis=0), np.zeros(6))).T, np.array([6]), np.arange(6))


def test_few_at_a_time_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(6)
    outlines = [star(rng) for _ in range(50)]
    vertices = np.concatenate([np.column_stack((p, np.zeros(len(p)))) for p in outlines]).T
    counts = np.array([len(p) for p in outlines])
    at_once, _ = cut(vertices, counts, np.arange(counts.sum()))
    monkeypatch.setattr(polygons, "CORNERS", 30)
    np.testing.assert_array_equal(cut(vertices, counts, np.arange(counts.sum()))[0], at_once)


ROOM = """size 16 12
camera 0 3 6  0 0 0  0 1 0  40
integrator direct
diffuse .5 .4 .3
quadLight -.5 3 -.5  0 0 1  1 0 0  20 20 20
vertex -3 0 3
vertex 3 0 3
vertex 3 0 -3
vertex -3 0 -3
tri 0 1 2
tri 0 2 3
translate 0 1 0
rotate 1 0 0 90
mesh roof.obj
"""


def test_every_first_corner_gives_the_same_picture(tmp_path: Path) -> None:
    images = []
    for first in range(6):
        outline = np.roll(L_SHAPE, first, axis=0)
        lines = [f"v {x} {y} 0" for x, y in outline.tolist()]
        (tmp_path / "roof.obj").write_text("\n".join([*lines, "f 1 2 3 4 5 6"]))
        (tmp_path / "room.test").write_text(ROOM)
        images.append(render(read_scene(tmp_path / "room.test"), Exact()).mean)
    for image in images[1:]:
        np.testing.assert_allclose(image, images[0], rtol=1e-9, atol=1e-12)
    assert images[0].min() == 0
    assert images[0].max() > 0.1
