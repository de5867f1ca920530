"""Any scale and place: the scene is moved into Mitsuba's valid range, and what does not fit is said."""

from __future__ import annotations

import numpy as np
import pytest
from builders import box, floor, lamp, scene

from nusselt.mitsuba_bridge.description import describe
from nusselt.mitsuba_bridge.distance import distance_to_triangles
from nusselt.mitsuba_bridge.reference import render_reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.surfaces import Mesh

pytestmark = pytest.mark.mitsuba

CAMERA = Camera((0.5, 1.5, 4.0), (0.0, 0.3, 0.0), (0.0, 1.0, 0.0), 35.0)


def placed(scale: float, offset: float, lights: str) -> Scene:
    """A box on a floor, under lights, all of it scaled and moved."""

    def at(point) -> tuple[float, float, float]:
        return tuple(np.multiply(point, scale) + offset * np.array([1.0, -0.5, 0.25]))

    meshes = [Mesh((m.vertices.T * scale + at((0, 0, 0))).T, m.triangles, m.material) for m in BODIES]
    area = lamp(1.8, 0.3)
    every = {
        "area": QuadLight(at(area.corner), *(tuple(np.multiply(v, scale)) for v in (area.ab, area.ac)), area.radiance),
        "point": PointLight(at((0.8, 1.5, 0.9)), tuple(c * scale**2 for c in (3.0, 4.0, 5.0))),
        "parallel": DirectionalLight((0.4, 1.0, 0.6), (1.0, 2.0, 3.0)),
    }
    camera = Camera(at(CAMERA.position), at(CAMERA.target), CAMERA.up, CAMERA.fov_y)
    return scene(*meshes, lights=tuple(every[name] for name in lights.split()), camera=camera, size=(32, 24))


BODIES = (floor(2.0), box((-0.4, 0.05, -0.4), (0.3, 0.6, 0.2)))


def image(made: Scene, **options) -> np.ndarray:
    return render_reference(made, seed=4, target_relative_se=5e-3, max_samples=512, timeout=60, **options).mean


@pytest.fixture(scope="module")
def plain() -> dict[str, np.ndarray]:
    return {lights: image(placed(1.0, 0.0, lights)) for lights in ("point parallel", "area")}


@pytest.mark.parametrize(
    ("scale", "offset"), [(1e-6, 0.0), (1e4, 0.0), (1.0, 1e4), (1e-3, 10.0)], ids=["micro", "mega", "far", "both"]
)
def test_the_image_does_not_depend_on_scale_or_place(plain, scale, offset):
    for lights, before in plain.items():
        after = image(placed(scale, offset, lights))
        # Same seeds, same samples: but for pixels that rounding moves over an edge.
        moved = np.abs(after - before).max(axis=0) > 2e-4 * before.max()
        assert moved.mean() < 0.01
        assert after[:, ~moved].mean() == pytest.approx(before[:, ~moved].mean(), rel=1e-5)


def test_without_the_normalisation_small_scenes_lose_their_shadows(plain):
    """The trap itself, so that the test above is known to see it."""
    raw = image(placed(1e-4, 0.0, "point parallel"), normalise=False)
    assert np.abs(raw / 1.0 - plain["point parallel"]).max() > 0.1 * plain["point parallel"].max()


def test_what_float32_cannot_hold_is_refused_by_name():
    with pytest.raises(InputError, match="irradiance"):
        image(scene(floor(), lights=(DirectionalLight((0, 1, 0), (1e35, 0, 0)),)))


def notes_of(*bodies: Mesh, light, tmp_path) -> list[str]:
    return [n for n in describe(scene(floor(2.0), *bodies, lights=(light,)), tmp_path).limits if "looks past" in n]


@pytest.mark.parametrize("light", [lamp(2.0), PointLight((0.1, 2.0, 0.1), (1, 1, 1))], ids=["area", "point"])
def test_a_blocker_that_mitsuba_looks_past_is_said(light, tmp_path):
    """A box under the light by 1/10, 1/10,000 and above it by 1/10,000 (behind the parallelogram)."""
    far, near = (box((-0.3, 1.0, -0.3), (0.3, 2.0 - gap, 0.3)) for gap in (0.1, 1e-4))
    assert not notes_of(light=light, tmp_path=tmp_path)
    assert not notes_of(far, light=light, tmp_path=tmp_path)
    assert len(notes_of(near, light=light, tmp_path=tmp_path)) == 1
    above = notes_of(box((-0.3, 2.0001, -0.3), (0.3, 2.5, 0.3)), light=light, tmp_path=tmp_path)
    assert bool(above) == isinstance(light, PointLight)


def test_small_blockers_before_the_middle_of_a_light_are_found_too(tmp_path):
    chip = box((0.11, 1.99, 0.12), (0.12, 1.9999, 0.13))
    assert len(notes_of(chip, light=lamp(2.0), tmp_path=tmp_path)) == 1


def test_distances_to_triangles():
    """Above the face, beside an edge, off a corner: by the closest of many points."""
    rng = np.random.default_rng(3)
    a, b, c = rng.normal(size=(3, 3, 200))
    p = rng.normal(size=(3, 1))
    u, v = np.meshgrid(np.linspace(0, 1, 161), np.linspace(0, 1, 161))
    u, v = (w[u + v <= 1 + 1e-12][:, None] for w in (u, v))
    points = a[:, None] + u * (b - a)[:, None] + v * (c - a)[:, None]
    brute = np.sqrt(((points - p[:, :, None]) ** 2).sum(axis=0)).min(axis=0)
    exact = distance_to_triangles(p, a, b, c)
    assert (exact <= brute + 1e-12).all()
    np.testing.assert_allclose(exact, brute, atol=3e-2)
    assert np.median(brute - exact) < 1e-4
