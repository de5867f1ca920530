"""Reader and writer: a written scene comes back equal, and runs of lines equal single lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from places import CLASSIC_SCENES

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.scene_text import parse_scene, read_scene, write_scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh, has_area

SCENES = sorted(CLASSIC_SCENES.glob("*.test"))
TRIANGLE = """
size 4 3
camera 0 0 4  0 0 0  0 1 0  45
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
tri 0 1 2
"""

numbers = st.floats(-1e3, 1e3)
points = st.tuples(numbers, numbers, numbers)
colours = st.tuples(*[st.floats(0, 1e3)] * 3)
lengths = st.floats(1e-3, 1e3)
directions = points.filter(lambda v: max(map(abs, v)) > 1e-3)
materials = st.builds(Material, colours, colours, st.floats(0, 1e4), colours)


def axis_aligned(center, scales, material):  # type: ignore[no-untyped-def]
    return Ellipsoid(center, tuple(map(tuple, np.diag(scales).tolist())), material)


def accepted(build):  # type: ignore[no-untyped-def]
    """``build``, or None where the arguments are refused."""

    def attempt(*arguments):  # type: ignore[no-untyped-def]
        try:
            return build(*arguments)
        except InputError:
            return None

    return attempt


@st.composite
def meshes(draw: st.DrawFn) -> Mesh | None:
    vertices = np.array(draw(st.lists(points, min_size=3, max_size=8))).T
    index = st.integers(0, vertices.shape[1] - 1)
    triangles = np.array(draw(st.lists(st.tuples(index, index, index), min_size=1, max_size=6))).T
    triangles = triangles[:, has_area(*(vertices[:, corner] for corner in triangles))]
    if not triangles.size:
        return None
    used, inverse = np.unique(triangles, return_inverse=True)
    return Mesh(vertices[:, used], inverse.reshape(triangles.shape), draw(materials))


def some(strategy):  # type: ignore[no-untyped-def]
    return st.lists(strategy, max_size=3).map(lambda things: tuple(t for t in things if t is not None))


lights = st.one_of(
    st.builds(accepted(QuadLight), points, directions, directions, colours),
    st.builds(PointLight, points, colours),
    st.builds(DirectionalLight, directions, colours),
    st.builds(SunLight, directions, colours, st.floats(0.01, 179)),
)
ellipsoids = st.one_of(
    st.builds(Ellipsoid.sphere, points, lengths, materials),
    st.builds(axis_aligned, points, st.permutations([0.5, -2.0, 3.7]), materials),
)
cameras = st.builds(accepted(Camera), points, points, directions, st.floats(0.1, 179)).filter(bool)
scenes = st.builds(
    Scene,
    width=st.integers(1, 65_536),
    height=st.integers(1, 65_536),
    camera=cameras,
    meshes=some(meshes()),
    ellipsoids=some(ellipsoids),
    lights=some(lights),
    integrator=st.sampled_from(["direct", "analyticdirect"]),
    light_samples=st.sampled_from([1, 4, 25]),
    stratify=st.booleans(),
    spp=st.integers(1, 64),
    output=st.sampled_from(["a.png", "raytrace.png", "größe.png"]),
)


@settings(max_examples=100, deadline=None)
@given(scenes)
def test_a_written_scene_comes_back_equal(scene: Scene) -> None:
    back = parse_scene(write_scene(scene), name=scene.name)
    assert back == scene
    assert back.digest() == scene.digest()
    assert all(a == b and hash(a) == hash(b) for a, b in zip(back.meshes, scene.meshes, strict=True))


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_the_classic_scenes_read_without_a_warning_and_come_back_equal(path: Path) -> None:
    scene = read_scene(path)
    assert scene.warnings == ()
    assert scene.name == path.stem
    assert scene.output == f"{path.stem}.png"
    assert parse_scene(write_scene(scene), name=scene.name).digest() == scene.digest()


def test_the_classic_scenes_are_all_there() -> None:
    named = "quad quad-random quad-stratified three-lights cornell cornell-boxes glossy unshadowed horizon"
    assert {path.stem for path in SCENES} >= {*named.split(), "near-light", "lonely"}


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-2, 2), min_size=9, max_size=9), points, st.integers(-60, 60))
def test_any_ellipsoid_comes_back_as_the_same_surface(entries, center, exponent) -> None:  # type: ignore[no-untyped-def]
    # The size comes from the exponent alone: of subnormal entries the singular values themselves are noise.
    assume(max(map(abs, entries)) > 1e-3)
    axes = np.array(entries).reshape(3, 3) * 10.0**exponent
    singular = np.linalg.svd(axes, compute_uv=False)
    assume(singular[2] >= 1e-3 * singular[0])
    scene = parse_scene(TRIANGLE).with_(ellipsoids=(Ellipsoid(center, tuple(map(tuple, axes.tolist()))),))
    (back,) = parse_scene(write_scene(scene)).ellipsoids
    assert back.center == scene.ellipsoids[0].center
    got = np.array(back.axes)
    # A point p of the surface satisfies p^T (A A^T)^-1 p = 1, so A A^T alone is the surface.
    np.testing.assert_allclose(got @ got.T, axes @ axes.T, rtol=0, atol=1e-13 * singular[0] ** 2)


def test_neighbours_of_one_material_stay_two_meshes() -> None:
    scene = parse_scene(TRIANGLE)
    twice = scene.with_(meshes=scene.meshes * 2)
    assert parse_scene(write_scene(twice)) == twice


def test_the_writer_refuses_an_output_that_the_reader_would_refuse() -> None:
    with pytest.raises(InputError, match=r"output = \.\./x\.png: expected a bare file name"):
        write_scene(parse_scene(TRIANGLE).with_(output="../x.png"))
