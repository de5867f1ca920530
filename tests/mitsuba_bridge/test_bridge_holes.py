"""Rays that pass between the triangles of one surface: none at edges; those at vertices are found, and not judged."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from builders import box, floor, quad, scene
from test_calibration import image_of, reference_of

from nusselt.experiments.verdict.judge import judge
from nusselt.experiments.verdict.level import Level
from nusselt.mitsuba_bridge.export import export_scene
from nusselt.mitsuba_bridge.llvm import backend
from nusselt.mitsuba_bridge.process import environment
from nusselt.mitsuba_bridge.reference import Reference, render_reference
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.camera.rays import pixel_size, primary_directions
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, PointLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Material, Mesh
from nusselt.renderer.vectors import column

pytestmark = pytest.mark.mitsuba

DOWN = Camera((0.0, 4.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 50.0)
NOON = DirectionalLight((0.0, 1.0, 0.0), (2.0, 3.0, 4.0))
LEVEL = Level(1e-3, 1)
LIT = 0.5 * np.array(NOON.irradiance) / np.pi


def reference(made: Scene, seed: int = 1) -> Reference:
    return render_reference(made, seed=seed, target_relative_se=1e-2, max_samples=4096, timeout=120)


WINDINGS = ([2, 1, 0], [3, 2, 0]), ([1, 2, 0], [2, 3, 0])
"""Of a floor's two triangles. Without the robust mode 7 and 10 rays pass between them with AVX2, more with AVX-512."""


def floor_wound(triangles) -> Scene:
    """Seen from straight above, its diagonal from corner to corner of the image."""
    ground = Mesh(floor(4.0).vertices, np.array(triangles).T, Material((0.5, 0.5, 0.5)))
    return scene(ground, lights=(NOON,), camera=DOWN, two_sided=True, size=(256, 192))


@pytest.mark.parametrize("triangles", WINDINGS)
def test_no_ray_passes_along_a_diagonal(triangles):
    seen = reference(floor_wound(triangles))
    assert not seen.background.any()
    assert not seen.holes.any()
    np.testing.assert_allclose(seen.mean, np.broadcast_to(LIT[:, None, None], seen.mean.shape), rtol=2e-6)


def test_nor_in_an_exported_scene(tmp_path):
    export_scene(floor_wound(WINDINGS[0]), tmp_path / "floor.xml")
    command = [
        sys.executable,
        "-m",
        "nusselt.mitsuba_bridge",
        "render",
        tmp_path / "floor.xml",
        "-o",
        tmp_path / "floor.npy",
    ]
    subprocess.run(
        [*command, "--centres", "--samples", "1"], check=True, env=environment(backend().llvm), capture_output=True
    )
    assert (np.load(tmp_path / "floor.npy") > 0).all()


def test_a_closed_room_has_no_black_pixel():
    """Seen from inside, its faces wound anyhow."""
    room = box((-3, -1, -3), (3, 2.5, 3))
    turns = np.random.default_rng(3).integers(3, size=room.triangles.shape[1])
    triangles = np.stack([np.roll(t[::-1], turn) for t, turn in zip(room.triangles.T, turns, strict=True)]).T
    made = scene(
        Mesh(room.vertices, triangles, room.material),
        lights=(PointLight((0.1, 0.7, 0.3), (3.0, 4.0, 5.0)),),
        camera=Camera((0.2, 0.1, 2.7), (0.0, -0.2, 0.0), (0.0, 1.0, 0.0), 70.0),
        size=(256, 192),
    )
    seen = reference(made)
    assert not seen.background.any()
    assert not seen.holes.any()
    assert (seen.mean > 0).all()


def grid(made: Scene, rough: float, seed: int) -> Mesh:
    """A surface with a vertex at every pixel's centre, and one row more all around."""
    x, y = (v.ravel() for v in np.meshgrid(np.arange(-1, made.width + 1) + 0.5, np.arange(-1, made.height + 1) + 0.5))
    d = primary_directions(made, x, y)
    depth = 1 + rough * np.random.default_rng(seed).uniform(-1, 1, x.size)
    across = made.width + 2
    corner = (np.arange(made.height + 1)[:, None] * across + np.arange(across - 1)).ravel()
    a, b, c, e = corner, corner + 1, corner + across + 1, corner + across
    triangles = np.hstack([[a, c, b], [a, e, c]])
    return Mesh(column(made.camera.position) + 4 * d / -d[1] * depth, triangles, Material((0.5, 0.5, 0.5)))


def test_vertices_at_pixel_centres_are_held_against_nobody():
    """About one ray in 140 passes through a vertex: how many do, and which, is the machine's business."""
    empty = scene(lights=(NOON,), camera=DOWN, size=(80, 60), two_sided=True)
    made = empty.with_(meshes=(grid(empty, 5e-4, 1),))
    seen = reference(made)
    np.testing.assert_array_equal((seen.mean > 0).all(axis=0), seen.holes == 0)
    np.testing.assert_array_equal(seen.background, seen.holes)
    lost = int(seen.holes.sum())
    assert any(note.startswith(f"{lost} pixels are not judged") for note in seen.notes) == (lost > 0)
    ours = render(made, Area(samples=1), tolerance=ray_tolerance(made))
    assert not ours.background.any()
    verdict = judge(ours, seen, passes=1, margin=1e-3, level=LEVEL)
    assert verdict.word != "differs", verdict.reason
    assert verdict.pixels["unjudged"] == int((ours.unjudged | (seen.holes > 0)).sum())


def slit(angle: float) -> Scene:
    """A floor with a gap under the pixels' centres of one column, ``angle`` wide as the camera sees it."""
    half = angle / 2 * DOWN.position[1]
    left = quad((-4, 0, 4), (-half, 0, 4), (-half, 0, -4), (-4, 0, -4))
    right = quad((half, 0, 4), (4, 0, 4), (4, 0, -4), (half, 0, -4))
    return scene(left, right, lights=(NOON,), camera=DOWN, size=(15, 11))


def test_a_gap_within_rounding_is_a_hole_and_a_wider_one_is_not():
    narrow, wide = slit(2e-6), slit(1e-4)
    assert pixel_size(wide) > 100 * 1e-4
    middle = np.zeros((11, 15), dtype=bool)
    middle[:, 7] = True
    seen = reference(narrow)
    np.testing.assert_array_equal(seen.holes > 0, middle)
    np.testing.assert_array_equal(seen.background > 0, middle)
    seen = reference(wide)
    assert not seen.holes.any()
    np.testing.assert_array_equal(seen.background > 0, middle)


def test_silhouettes_are_no_holes():
    """A plate over a floor, a box and the background: much is seen past edges, and nothing through a surface."""
    plate, block = floor(0.7, y=0.8), box((-1.5, 0, -1.5), (-0.6, 0.9, -0.5))
    camera = Camera((1.0, 2.5, 4.0), (0.0, 0.3, 0.0), (0.0, 1.0, 0.0), 50.0)
    seen = reference(scene(floor(2.0), plate, block, lights=(NOON,), camera=camera, size=(64, 48)))
    assert seen.background.any()
    assert not seen.holes.any()


def noisy(offset: float = 0.0) -> np.ndarray:
    return 1 + offset + 1e-3 * np.random.default_rng(5).standard_normal((40, 48 * 48))


def with_background(at: int, holes: int):
    """A right image, and a reference that shows the background in the first ``at`` pixels, ``holes`` of them holes."""
    ours, seen = image_of(noisy()), reference_of(noisy())
    background, hole = np.zeros((2, 48 * 48))
    background[:at], hole[:holes] = 1, 1
    seen.mean.setflags(write=False)
    square = ours.background.shape
    mean = np.where(background.reshape(square) > 0, 0, seen.mean)
    return ours, Reference(
        **{**vars(seen), "mean": mean, "background": background.reshape(square), "holes": hole.reshape(square)}
    )


def judged(ours, seen):
    return judge(ours, seen, passes=40, margin=1e-2, level=LEVEL)


def test_only_holes_are_not_judged():
    verdict = judged(*with_background(2, 2))
    assert (verdict.word, verdict.pixels["unjudged"]) == ("agrees", 2)
    assert judged(*with_background(2, 1)).word == "differs"
    assert judged(*with_background(1, 0)).word == "differs"


def test_more_holes_than_one_in_a_hundred_leave_a_row_undecided():
    assert judged(*with_background(23, 23)).word == "agrees"
    verdict = judged(*with_background(24, 24))
    assert verdict.word == "undecided"
    assert "within rounding of an edge" in verdict.reason


def test_holes_hide_no_fault_elsewhere():
    ours, seen = with_background(2, 2)
    ours.mean.setflags(write=False)
    off = np.where(np.arange(48 * 48).reshape(48, 48) % 48 < 24, 1.1, 1.0) * ours.mean
    assert judged(type(ours)(**{**vars(ours), "mean": off}), seen).word == "differs"
