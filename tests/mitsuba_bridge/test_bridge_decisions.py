"""One test for each decision of the scene format that Mitsuba has to be told of.

Lights without extent have no noise, so that most of these are exact to float32.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import floor, quad, scene
from scipy import stats

from nusselt.mitsuba_bridge.llvm import backend
from nusselt.mitsuba_bridge.reference import Reference, render_reference
from nusselt.renderer.estimators import Exact, estimator_named
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Camera, Scene
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh

pytestmark = pytest.mark.mitsuba

DOWN = Camera((0.0, 4.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 50.0)
"""Looks straight down: image x is world x, image y is world z."""
NOON = DirectionalLight((0.0, 1.0, 0.0), (2.0, 3.0, 4.0))
KD = np.array([0.5, 0.25, 0.75])
GROUND = floor(4.0, material=Material(tuple(KD)))
SMALL = (16, 12)


@pytest.fixture
def llvm() -> None:
    if backend().variant == "scalar_rgb":
        pytest.skip("the Phong surface is too slow in scalar_rgb")


def reference(made: Scene, target: float = 1e-2, seed: int = 1) -> Reference:
    return render_reference(made, seed=seed, target_relative_se=target, max_samples=4096, timeout=120)


def centre(reference: Reference) -> np.ndarray:
    """Radiance at the pixel next to the image's middle, (3,)."""
    return reference.mean[:, reference.mean.shape[1] // 2, reference.mean.shape[2] // 2]


def lit_floor(*irradiances) -> np.ndarray:
    return sum(KD * np.array(e) / math.pi for e in irradiances)


def over(half: float, y: float, radiance, up: bool = False) -> QuadLight:
    """A square light above the floor's middle that shines down, or up."""
    ab, ac = ((0, 0, 2 * half), (2 * half, 0, 0)) if not up else ((2 * half, 0, 0), (0, 0, 2 * half))
    return QuadLight((-half, y, -half), ab, ac, radiance)


def test_a_light_shines_on_the_side_of_minus_ab_cross_ac():
    below = Camera((2.5, 1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 40.0)
    down = reference(scene(GROUND, lights=(over(0.5, 2.0, (5, 5, 5)),), camera=below, size=SMALL))
    up = reference(scene(GROUND, lights=(over(0.5, 2.0, (5, 5, 5), up=True),), camera=below, size=SMALL))
    shaded = down.emitter + down.background == 0
    assert shaded.any()
    assert (down.mean[:, shaded] > 0).all()
    assert not up.mean.any()


def test_an_emitter_is_seen_from_its_front_alone():
    light = over(0.5, 2.0, (1.5, 0.25, 300.0), up=True)
    front = reference(scene(GROUND, lights=(light,), camera=DOWN, size=SMALL))
    assert centre(front).tolist() == pytest.approx([1.5, 0.25, 300.0], rel=1e-6)
    back = reference(scene(GROUND, lights=(over(0.5, 2.0, (1.5, 0.25, 300.0)),), camera=DOWN, size=SMALL))
    assert not centre(back).any()
    for seen in (front, back):
        assert seen.emitter[6, 8] == 1
        assert seen.background[6, 8] == 0
        assert set(np.unique(seen.emitter)) == {0.0, 1.0}


def test_emitters_reflect_nothing_and_are_counted_once():
    light = over(0.5, 2.0, (1.5, 0.25, 300.0), up=True)
    other = over(0.1, 3.0, (7.0, 7.0, 7.0))
    seen = reference(
        scene(GROUND, lights=(NOON, light, PointLight((1, 3, 0), (9, 9, 9)), other), camera=DOWN, size=SMALL)
    )
    # The other one hides the light's middle: beside it lies the light's own front.
    x = (np.arange(16) + 0.5) / 16 * 2 - 1
    at = int(np.argmin(np.abs(x * math.tan(math.radians(25)) * 16 / 12 * 2.0 - 0.42)))
    assert not centre(seen).any()
    assert seen.mean[:, 6, at].tolist() == pytest.approx([1.5, 0.25, 300.0], rel=1e-6)


def test_the_back_of_an_emitter_is_black_and_blocks():
    light = over(0.5, 2.0, (0.0, 0.0, 6.0))
    side = Camera((0.0, 1.0, 3.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 4.0)
    lit = reference(scene(GROUND, lights=(NOON, light), camera=side, size=SMALL))
    shaded = lit.emitter + lit.background == 0
    assert shaded.all()
    # Under the light there is only its own blue; without it, noon.
    assert not lit.mean[:2].any()
    assert (lit.mean[2] > 0).all()
    above = reference(scene(GROUND, lights=(NOON, light), camera=DOWN, size=SMALL))
    assert not centre(above).any()


def test_backs_are_black_and_block_unless_two_sided():
    ceiling = Mesh(GROUND.vertices, GROUND.triangles[::-1], GROUND.material)  # faces down
    made = scene(ceiling, lights=(NOON,), camera=DOWN, size=SMALL)
    one = reference(made)
    assert not one.mean.any()
    assert (one.background == 0).all()
    two = reference(made.with_(two_sided=True))
    np.testing.assert_allclose(
        two.mean, np.broadcast_to(lit_floor(NOON.irradiance)[:, None, None], two.mean.shape), rtol=2e-6
    )
    # And a back face between the light and the floor.
    small = quad((-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1))  # faces down
    under = Camera((0.0, 0.5, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -1.0), 50.0)
    assert not reference(scene(GROUND, small, lights=(NOON,), camera=under, size=SMALL)).mean.any()


@pytest.mark.parametrize("irradiance", [(250.0, 0.003, 7.0), (1e6, 1e-6, 1.0)])
def test_colours_are_raw_rgb(irradiance):
    seen = reference(scene(GROUND, lights=(DirectionalLight((0, 1, 0), irradiance),), camera=DOWN, size=SMALL))
    np.testing.assert_allclose(centre(seen), lit_floor(irradiance), rtol=2e-6)


@pytest.mark.usefixtures("llvm")
def test_an_albedo_above_one_is_legal():
    kd = (1.5, 40.0, 0.3)
    seen = reference(scene(floor(4.0, material=Material(kd)), lights=(NOON,), camera=DOWN, size=SMALL))
    np.testing.assert_allclose(centre(seen), np.multiply(kd, NOON.irradiance) / math.pi, rtol=2e-6)


@pytest.mark.usefixtures("llvm")
@pytest.mark.parametrize("s", [0.0, 1.0, 40.0])
def test_the_phong_lobe_and_its_end(s):
    """Viewer and light on the same grazing side: r.w < 0, and the lobe is 0 there, at exponent 0 too."""
    material = Material(tuple(KD), (0.3, 0.2, 0.1), s)
    for azimuth, lobe in ((math.pi, True), (0.0, False)):
        angle = math.radians(65)
        toward = np.array([math.sin(angle) * math.cos(azimuth), math.cos(angle), 0.0])
        light = DirectionalLight(tuple(toward), (2.0, 3.0, 4.0))
        eye = 3 * np.array([math.sin(math.radians(60)), math.cos(math.radians(60)), 0.0])
        camera = Camera(tuple(eye), (0, 0, 0), (0, 1, 0), 1e-3)
        seen = reference(scene(floor(4.0, material=material), lights=(light,), camera=camera, size=(1, 1)))
        r = np.array([-eye[0], eye[1], 0.0]) / 3
        cosine = float(r @ toward)
        assert (cosine > 0) == lobe
        glossy = np.array(material.specular) * (s + 2) / (2 * math.pi) * (cosine**s if lobe else 0.0)
        truth = (KD / math.pi + glossy) * light.irradiance * toward[1]
        np.testing.assert_allclose(seen.mean[:, 0, 0], truth, rtol=2e-5)


def test_a_sun_is_not_seen():
    sun = SunLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0), 4.0)
    up = Camera((0.0, 1.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0), 20.0)
    seen = reference(scene(GROUND, lights=(sun,), camera=up, size=SMALL))
    assert not seen.mean.any()
    assert (seen.background == 1).all()
    assert (seen.emitter == 0).all()


def shaded_alike(made: Scene, tolerance: float) -> None:
    """Ours and Mitsuba's see the same things, and shade them alike but at a few edges; without random lights."""
    ours = render(made, estimator_named("area", 1, False))
    theirs = reference(made)
    same = (ours.emitter == theirs.emitter) & (ours.background == theirs.background)
    assert same.mean() > 0.99
    both = same & ours.shaded
    assert both.any()
    off = np.abs(ours.mean - theirs.mean)[:, both].max(axis=0)
    assert np.quantile(off, 0.98) < tolerance * ours.mean.max()


SIDE = Camera((1.5, 2.0, 5.0), (0.0, 0.5, 0.0), (0.0, 1.0, 0.0), 30.0)
SUNRISE = DirectionalLight((1.0, 1.0, 0.5), (2.0, 3.0, 4.0))


def test_spheres_are_spheres():
    ball = Ellipsoid.sphere((0.2, 0.6, 0.1), 0.6, Material((0.9, 0.5, 0.1)))
    shaded_alike(scene(GROUND, ellipsoids=(ball,), lights=(SUNRISE,), camera=SIDE, size=(80, 60)), 1e-6)


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_ellipsoids_are_fine_meshes_that_state_their_error(mirror):
    tilted = mirror * np.array([[0.8, 0.1, 0.0], [0.2, 0.4, 0.1], [-0.1, 0.0, 0.3]])
    ball = Ellipsoid((0.2, 0.6, 0.1), tuple(map(tuple, tilted)), Material((0.9, 0.5, 0.1)))
    made = scene(GROUND, ellipsoids=(ball,), lights=(SUNRISE,), camera=SIDE, size=(80, 60))
    shaded_alike(made, 1e-4)
    assert any("ellipsoid" in note for note in reference(made).notes)


def test_a_mirrored_transform_keeps_its_winding():
    text = """
    size 40 30
    camera 1.5 2 5  0 .5 0  0 1 0  30
    directional 1 1 .5  2 3 4
    vertex -1 0 1
    vertex 1 0 1
    vertex 1 0 -1
    vertex 0 1 0
    diffuse .5 .6 .7
    tri 0 1 2
    scale -1 1 1
    tri 0 1 2
    tri 0 1 3
    sphere .5 .5 .5 .25
    """
    made = parse_scene(text)
    shaded_alike(made, 1e-6)
    mirrored = render(made, estimator_named("area", 1, False)).mean
    plain = render(parse_scene(text.replace("scale -1 1 1", "")), estimator_named("area", 1, False)).mean
    assert (mirrored != plain).any()


def test_emission_of_a_surface_is_seen_and_lights_nothing():
    glow = (3.0, 0.5, 20.0)
    plate = floor(0.5, y=0.5, material=Material(tuple(KD), emission=glow))
    dark = reference(scene(GROUND, plate, camera=DOWN, size=SMALL))
    np.testing.assert_allclose(centre(dark), glow, rtol=1e-6)
    assert not dark.mean[:, 0, 0].any()
    assert dark.emitter.max() == 0
    lit = reference(scene(GROUND, plate, lights=(NOON,), camera=DOWN, size=SMALL))
    np.testing.assert_allclose(centre(lit), lit_floor(NOON.irradiance) + glow, rtol=2e-6)
    back = Mesh(plate.vertices, plate.triangles[::-1], plate.material)
    assert not centre(reference(scene(GROUND, back, lights=(NOON,), camera=DOWN, size=SMALL))).any()


def box_average(made: Scene, light: PointLight, n: int = 64) -> np.ndarray:
    """Of a floor under a point light seen from straight above, each pixel's box by midpoints, (3, h, w)."""
    t = math.tan(math.radians(made.camera.fov_y) / 2) * made.camera.position[1]
    y, x = np.mgrid[0 : made.height * n, 0 : made.width * n] + 0.5
    x = (x / (made.width * n) * 2 - 1) * t * made.width / made.height
    z = (y / (made.height * n) * 2 - 1) * t
    px, py, pz = light.position
    square = (x - px) ** 2 + py**2 + (z - pz) ** 2
    irradiance = (py / square**1.5).reshape(made.height, n, made.width, n).mean(axis=(1, 3))
    return irradiance * (KD * light.intensity)[:, None, None] / math.pi


def test_a_pixel_is_its_centre_or_its_box():
    light = PointLight((0.3, 0.6, -0.2), (4.0, 2.0, 1.0))
    made = scene(GROUND, lights=(light,), camera=DOWN, size=(4, 3), spp=16)
    box = reference(made, target=1e-3)
    truth = box_average(made, light)
    error = np.hypot(box.pixel_standard_error, 2e-6 * truth.mean(axis=0))
    z = np.abs((box.mean - truth).mean(axis=0)) / error
    assert z.max() < stats.t(31).isf(1e-6 / 2 / z.size)
    assert (box.pixel_standard_error > 0).all()
    middle = reference(made.with_(spp=1))
    np.testing.assert_allclose(middle.mean, box_average(made, light, 1), rtol=1e-5)
    assert np.abs(middle.mean / truth - 1).max() > 0.05  # they do differ


def test_a_box_that_is_part_emitter_and_part_background():
    light = QuadLight((-10.0, 1.0, -10.0), (20, 0, 0), (0, 0, 9.7), (2.0, 4.0, 6.0))  # faces up, z from -10 to -0.3
    made = scene(lights=(light,), camera=DOWN, size=(1, 1), spp=4)
    seen = reference(made, target=1e-3)
    half = 3.0 * math.tan(math.radians(25))
    share = (half - 0.3) / (2 * half)
    assert seen.emitter[0, 0] == pytest.approx(share, abs=5 / math.sqrt(1024))
    assert seen.background[0, 0] == pytest.approx(1 - seen.emitter[0, 0], abs=1e-9)
    off = np.abs(seen.mean[:, 0, 0] - share * np.array(light.radiance))
    assert (off <= 6 * seen.standard_error[:, 0, 0] + 1e-6).all()


def test_emission_in_a_box_carries_its_noise():
    plate = quad(
        (-0.31, 0.5, 0.4), (0.43, 0.5, 0.4), (0.43, 0.5, -0.2), (-0.31, 0.5, -0.2), Material(emission=(9, 9, 9))
    )
    seen = reference(scene(GROUND, plate, camera=DOWN, size=(2, 2), spp=4), target=1e-3)
    half = 3.5 * math.tan(math.radians(25))  # of the view, at the plate's height
    x, z = np.array([0.31, 0.43]), np.array([0.2, 0.4])
    truth = 9 * np.outer(z, x) / half**2
    assert (np.abs(seen.mean[0] - truth) < 8 * seen.pixel_standard_error).all()
    assert (seen.pixel_standard_error > 0).all()
    assert seen.pass_means.mean() == pytest.approx(seen.mean.mean(), rel=1e-9)


def test_a_light_that_a_pilot_may_miss_is_not_called_free_of_noise():
    """It comes through a slit a thousandth wide: no noise in a pilot is no proof of none."""
    left = quad((-5, 1, -5), (-5, 1, 5), (-0.0005, 1, 5), (-0.0005, 1, -5))
    right = quad((0.0005, 1, -5), (0.0005, 1, 5), (5, 1, 5), (5, 1, -5))
    camera = Camera((0.3, 0.5, 0.0), (0.3, 0.0, 0.0), (0.0, 0.0, -1.0), 2.0)
    seen = reference(scene(GROUND, left, right, lights=(over(1.0, 2.0, (5, 5, 5)),), camera=camera, size=(1, 1)))
    assert seen.passes == 32
    assert seen.samples >= 2048
    assert seen.mean.any()
    assert seen.standard_error.all()


def test_a_scene_without_lights_is_black_without_being_rendered():
    seen = reference(scene(GROUND, camera=DOWN, size=SMALL))
    assert not seen.mean.any()
    assert not seen.standard_error.any()
    assert (seen.background == 0).all()


def lamps(count: int) -> tuple[QuadLight, ...]:
    """In a row over the floor, each of its own colour; by turns one lights the floor and one is seen to shine."""
    width, found = 2.0 / count, []
    for k in range(count):
        edges = (0, 0, 0.5), (0.8 * width, 0, 0)
        ab, ac = edges if k % 2 == 0 else edges[::-1]
        found.append(QuadLight((k * width - 1.0, 1.0 + 0.05 * k, -0.3), ab, ac, (1.0 + k, 2.0, count - k)))
    return tuple(found)


def test_many_lights_in_groups_are_what_they_are_without_noise():
    made = scene(GROUND, lights=lamps(14), camera=DOWN, size=(12, 9))
    found, exact = reference(made, target=2e-3), render(made, Exact())
    assert (found.mean[:, found.emitter > 0].max(axis=0) > 1).any()
    allowed = 7 * found.standard_error + 1e-3 * exact.mean
    assert (np.abs(found.mean - exact.mean) <= allowed).all()
    one_missing = render(made.with_(lights=made.lights[1:]), Exact()).mean
    assert (np.abs(found.mean - one_missing) > allowed).any()


@pytest.mark.parametrize("spp", [1, 4], ids=["centres", "boxes"])
def test_lights_together_are_their_sum(spp):
    """The others' bodies stay in their way and in view: each alone has them black."""
    every = lamps(2)
    made = scene(GROUND, lights=every, camera=DOWN, size=(12, 9), spp=spp)
    together = reference(made, target=2e-3)
    black = [
        tuple(other if other is light else other.with_colour((0.0, 0.0, 0.0)) for other in every) for light in every
    ]
    alone = [reference(made.with_(lights=lights), target=2e-3, seed=9 + k) for k, lights in enumerate(black)]
    mean = sum(each.mean for each in alone)
    error = np.sqrt(together.standard_error**2 + sum(each.standard_error**2 for each in alone))
    assert (together.mean[:, together.emitter > 0].max(axis=0) > 1).any()
    assert (np.abs(together.mean - mean) <= 7 * error + 1e-4 * mean).all()
