"""The scene model: what its parts accept, and that copies are equal to the bit."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh, has_area

CAMERA = Camera((0, 0, 4), (0, 0, 0), (0, 1, 0), 45)
SQUARE = np.array([[0.0, 1, 1, 0], [0, 0, 1, 1], [0, 0, 0, 0]])
HALVES = np.array([[0, 0], [1, 2], [2, 3]])
EYE = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


@pytest.mark.parametrize(
    ("build", "told"),
    [
        (lambda: Material(diffuse=(1, 2)), r"diffuse = \(1, 2\): expected three finite numbers"),  # type: ignore[arg-type]
        (lambda: Material(diffuse=3), "diffuse = 3: expected three finite numbers"),  # type: ignore[arg-type]
        (lambda: Material(specular=(0, math.nan, 0)), "specular = nan: expected a finite number"),
        (lambda: Material(shininess=-1), "shininess = -1"),
        (lambda: Camera((0, 0, 1e308), (0, 0, -1e308), (0, 1, 0), 45), "camera view = -inf"),
        (lambda: Camera((0, 0, 1), (0, 0, 0), (0, 0, 1e-300), 45), "camera up ="),
        (lambda: Mesh(SQUARE.T, HALVES), r"mesh vertices shape = \(4, 3\): expected \(3, v\)"),
        (lambda: Mesh(SQUARE, HALVES.T), r"mesh triangles shape = \(2, 3\): expected \(3, t\)"),
        (lambda: Mesh(SQUARE, HALVES + 0.5), "mesh triangles dtype = dtype.'float64'.: expected whole"),
        (lambda: Mesh(SQUARE, HALVES + 1), "mesh index = 4: expected 0 <= index < 4"),
        (lambda: Mesh(SQUARE, HALVES - 1), "mesh index = -1: expected 0 <= index < 4"),
        (lambda: Mesh(SQUARE * math.nan, HALVES), r"mesh vertex = \(nan, nan, nan\)"),
        (lambda: Mesh(SQUARE[:, [0, 1, 1, 3]], HALVES), "mesh triangle = number 0"),
        (lambda: Mesh((SQUARE * 2 - 1) * 1.7e308, HALVES), "mesh triangle = number 0"),
        (lambda: Ellipsoid((0, 0, 0), EYE[:2]), "sphere axes = .*: expected a 3 x 3 matrix"),  # type: ignore[arg-type]
        (lambda: Ellipsoid((0, 0, 0), (EYE[0], EYE[0], EYE[2])), "expected three independent semi-axes"),
        (lambda: Ellipsoid.sphere((0, 0, 0), 0), "sphere radius = 0.0"),
        (lambda: QuadLight((0, 0, 0), (1, 1, 1), (2, 2, 2), (1, 1, 1)), "quadLight ac"),
        (lambda: QuadLight((0, 0, 0), (1e200, 0, 0), (0, 1e200, 0), (1, 1, 1)), "quadLight area = inf"),
        (lambda: SunLight((0, 1, 0), (1e300, 0, 0), 1e-5), "sun angle = 1e-05: expected an angle wide"),
        (lambda: Scene(4, 0, CAMERA), "size height = 0"),
        (lambda: Scene(4.0, 3, CAMERA), "size width = 4.0"),  # type: ignore[arg-type]
        (lambda: Scene(4, 3, CAMERA, integrator="raytracer"), "integrator = raytracer"),
        (lambda: Scene(4, 3, CAMERA, light_samples=5, stratify=True), "lightsamples = 5"),
        (lambda: Scene(4, 3, CAMERA, spp=0), "spp = 0"),
    ],
)
def test_bad_parts_are_refused_by_name_value_and_what_is_accepted(build, told) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match=told) as caught:
        build()
    assert ": expected " in str(caught.value)


def test_a_square_light_emits_downwards_and_knows_its_area() -> None:
    light = QuadLight((-1, 1, -1), (0, 0, 2), (2, 0, 0), (5, 5, 5))
    assert light.normal == (0, -1, 0)
    assert light.area == 4


@pytest.mark.parametrize("size", [1e-150, 1e-6, 1e9, 1e150])
def test_lights_and_triangles_of_any_size_are_accepted(size: float) -> None:
    light = QuadLight((0, 0, 0), (size, 0, 0), (size / 2, size, 0), (1, 1, 1))
    assert light.normal == (0, 0, -1)
    assert light.area == pytest.approx(size * size)
    assert Mesh(SQUARE * size, HALVES).triangles.shape == (3, 2)


def test_needles_span_no_area_and_thin_triangles_do() -> None:
    a, b = np.zeros((3, 1)), np.array([[1.0], [0], [0]])
    assert has_area(a, b, np.array([[0.5], [1e-12], [0]])).all()
    assert not has_area(a, b, np.array([[0.5], [0], [0]])).any()
    assert not has_area(a, b, b).any()


vectors = st.tuples(*[st.floats(-1e6, 1e6)] * 3).filter(lambda v: max(map(abs, v)) > 1e-100)


@settings(max_examples=200, deadline=None)
@given(vectors)
def test_directions_are_unit_and_a_copy_of_a_light_equals_it(direction) -> None:  # type: ignore[no-untyped-def]
    for light in (DirectionalLight(direction, (1, 2, 3)), SunLight(direction, (1, 2, 3), 0.5)):
        assert math.hypot(*light.direction) == pytest.approx(1, abs=1e-15)
        assert replace(light) == light


def test_the_suns_radiance_gives_its_irradiance() -> None:
    sun = SunLight((0, 1, 0), (1, 2, 4), 60)
    assert sun.radiance == pytest.approx([e / (math.pi / 4) for e in sun.irradiance])


@pytest.mark.parametrize("radius", [0.1, 0.3, 1e-6, 7e8])
def test_a_spheres_radius_is_exact_and_a_turned_ones_close(radius: float) -> None:
    assert Ellipsoid.sphere((1, 2, 3), radius).radius == radius
    turn = np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2 + np.eye(3))[0] * radius
    turned = Ellipsoid((0, 0, 0), tuple(map(tuple, turn.tolist())))
    assert turned.radius == pytest.approx(radius, rel=1e-14)
    assert Ellipsoid((0, 0, 0), ((1, 0, 0), (0, 1, 0), (0, 0, 1.1))).radius is None


def test_equal_scenes_have_equal_hashes_and_digests() -> None:
    def scene(zero: float) -> Scene:
        mesh = Mesh(SQUARE + np.where(SQUARE == 0, zero, 0), HALVES, Material((zero, 0.5, 0)))
        return Scene(4, 3, CAMERA, (mesh,), (), (PointLight((zero, 1, 0), (1, 1, 1)),))

    a, b = scene(0.0), scene(-0.0)
    assert a == b
    assert hash(a.meshes[0]) == hash(b.meshes[0])
    assert a.digest() == b.digest()
    assert a.with_(name="other", output="b.png", warnings=("w",)).digest() == a.digest()


@pytest.mark.parametrize(
    "change",
    [
        {"width": 5},
        {"camera": replace(CAMERA, fov_y=44)},
        {"meshes": (Mesh(SQUARE + 1e-15, HALVES, Material((0.5, 0.5, 0.5))),)},
        {"meshes": (Mesh(SQUARE, HALVES, Material((0.5, 0.5, 0.4))),)},
        {"ellipsoids": (Ellipsoid.sphere((0, 0, 0), 1),)},
        {"lights": ()},
        {"integrator": "analyticdirect"},
        {"light_samples": 4},
        {"spp": 2},
        {"two_sided": True},
    ],
    ids=lambda change: next(iter(change)),
)
def test_whatever_can_change_a_pixel_changes_the_digest(change) -> None:  # type: ignore[no-untyped-def]
    mesh = Mesh(SQUARE, HALVES, Material((0.5, 0.5, 0.5)))
    scene = Scene(4, 3, CAMERA, (mesh,), (), (PointLight((0, 1, 0), (1, 1, 1)),))
    assert scene.with_(**change) != scene
    assert scene.with_(**change).digest() != scene.digest()


def test_a_meshs_arrays_are_its_own_and_cannot_be_written() -> None:
    vertices = SQUARE.copy()
    mesh = Mesh(vertices, HALVES)
    vertices[:] = 9
    assert mesh.vertices.max() == 1
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        mesh.triangles[0, 0] = 1


def test_an_error_crosses_processes_and_stays_one_short_line() -> None:
    error = InputError("vertex x", "a\nb" * 99, "a number").at("a.test:3")
    assert str(pickle.loads(pickle.dumps(error))).startswith("a.test:3: vertex x = ")
    assert "\n" not in str(error)
    assert len(str(error)) < 200
