"""Images: the same on any executor, honest statistics over passes, nothing lost by leaving out."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from builders import CAMERA, GREY, box, floor, lamp, scene

from nusselt.experiments.scenes import catalogue
from nusselt.experiments.workers import worker_pool
from nusselt.renderer.ambiguous_pixels import Tolerance
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import Image, render
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.tile import tiles

ARRAYS = (
    "first",
    "mean",
    "variance",
    "pixel_variance",
    "level_mean",
    "level_variance",
    "emitter",
    "pass_means",
)


def small(name: str):
    """A classic scene at a size that a test can afford."""
    s = catalogue.load(name)
    return s.with_(width=max(24, s.width // 10), height=max(18, s.height // 10))


def test_the_executor_changes_no_bit():
    s = small("cornell").with_(width=150, height=140)
    here = render(s, Area(samples=4), seed=7, passes=3)
    with ThreadPoolExecutor(3) as pool:
        threads = render(s, Area(samples=4), seed=7, passes=3, executor=pool)
    with worker_pool() as pool:
        processes = render(s, Area(samples=4), seed=7, passes=3, executor=pool)
    for other in (threads, processes):
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(here, name), getattr(other, name), err_msg=name)


def test_tiles_cover_every_pixel_once():
    s = small("quad").with_(width=301, height=77)
    for samples in (1, 100, 10_000):
        seen = np.zeros((77, 301), dtype=int)
        for tile in tiles(s, samples):
            seen[tile.rows.start : tile.rows.stop, tile.columns.start : tile.columns.stop] += 1
        assert (seen == 1).all()


def test_variance_is_that_of_the_passes():
    s = scene(floor(), lights=(lamp(),))
    both = render(s, Area(samples=4), seed=1, passes=2)
    other = 2 * both.mean - both.first
    np.testing.assert_allclose(both.variance, (both.first - other) ** 2 / 2, rtol=1e-9, atol=1e-18)
    gap = (both.first - other).mean(axis=0)
    np.testing.assert_allclose(both.pixel_variance, gap**2 / 2, rtol=1e-9, atol=1e-18)
    many = render(s, Area(samples=1), seed=1, passes=7)
    assert set(np.unique(many.background)) <= {0.0, 1.0}
    means = [both.first.mean(axis=0)[both.shaded].mean(), other.mean(axis=0)[both.shaded].mean()]
    np.testing.assert_allclose(both.pass_means, means, rtol=1e-12)


def test_seeds_differ_and_repeat():
    s = scene(floor(), lights=(lamp(),))
    one, again, other = (render(s, Area(), seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.mean, again.mean)
    assert (one.mean != other.mean).any()


def test_nothing_random_takes_one_pass():
    s = scene(floor(), lights=(PointLight((0, 2, 0), (1, 1, 1)),))
    image = render(s, Area(samples=16), passes=8)
    assert image.pass_means.size == 1
    assert (image.variance == 0).all()
    assert image.first is image.mean
    assert not any(
        part.any() or any(part.strides) for part in (image.variance, image.pixel_variance, image.level_variance)
    )


@pytest.mark.parametrize("name", catalogue.CLASSIC)
def test_leaving_out_changes_no_pixel_beyond_rounding(name):
    s = small(name)
    few = render(s, Area(samples=4, stratified=True), seed=3)
    everything = render(s, Area(samples=4, stratified=True), seed=3, everything=True)
    np.testing.assert_allclose(few.mean, everything.mean, rtol=1e-13, atol=0)
    assert few.left_out
    assert not everything.left_out


def test_the_proof_above_would_notice_a_lost_blocker():
    s = small("cornell")
    without = s.with_(meshes=s.meshes[:-1])
    assert not np.allclose(
        render(s, Area(samples=4), seed=3).mean, render(without, Area(samples=4), seed=3).mean, rtol=1e-13
    )


def test_what_is_left_out_is_said():
    up = QuadLight((-0.5, -1, -0.5), (0, 0, 1), (1, 0, 0), (5, 5, 5))  # below the floor, shining down
    s = scene(floor(), lights=(lamp(), up, lamp(3.0, radiance=(0, 0, 0)), DirectionalLight((0, 1, 0), (1, 1, 1))))
    told = {entry.what: entry.why for entry in render(s, Area()).left_out}
    assert told["light 2 (quad)"] == "every surface lies behind it"
    assert told["light 3 (quad)"] == "it is black"
    assert "further samples of light 4 (directional)" in told
    assert "the glossy lobe" in told
    assert "sphere intersections" in told
    # light 3 hangs above light 1's front: it is black, but it blocks the sky
    assert any("blockers of light 4" in what for what in told)


def test_kinds_of_pixels():
    s = scene(floor(), lights=(lamp(1.0),), size=(48, 36))
    image = render(s, Area())
    assert image.shaded.sum() + image.emitter.sum() + image.background.sum() == 48 * 36
    assert image.emitter.sum() > 5
    seen_from_above = image.mean[:, image.emitter == 1]
    assert (seen_from_above == 0).all()  # the back of the lamp is black
    below = render(s.with_(camera=Camera((0, 0.1, 2), (0, 1, 0), (0, 1, 0), 40)), Area())
    assert (below.mean[:, below.emitter == 1] == 5).all()


def test_emission_of_a_surface_is_seen_and_lights_nothing():
    glowing = Material((0.5, 0.5, 0.5), emission=(0.25, 0.5, 1.0))
    s = scene(floor(material=glowing), box((-0.5, 0.5, -0.5), (0.5, 1.0, 0.5)))
    image = render(s, Area())
    on_floor = image.shaded & (image.mean[2] > 0)
    assert on_floor.sum() > 50
    np.testing.assert_array_equal(image.mean[:, on_floor].T, np.broadcast_to((0.25, 0.5, 1.0), (on_floor.sum(), 3)))


def test_backs_are_black_and_counted_unless_two_sided():
    s = scene(floor(), lights=(DirectionalLight((0, -1, 0), (1, 1, 1)),))
    below = s.with_(camera=Camera((0, -3, 2), (0, 0, 0), (0, 1, 0), 40))
    one = render(below, Area())
    assert one.back_faces == one.shaded.sum() > 50
    assert (one.mean == 0).all()
    two = render(below.with_(two_sided=True), Area())
    assert two.back_faces == 0
    np.testing.assert_allclose(two.mean[:, two.shaded], 0.5 / np.pi, rtol=1e-13)
    assert (render(s.with_(two_sided=True), Area()).mean == 0).all()  # lit from the side not seen


def test_boxed_pixels_average_the_box():
    """A slanted edge of background through a pixel gives its share; the centre rule gives all or nothing."""
    glowing = Material(emission=(1.0, 1.0, 1.0))
    s = scene(floor(1.0, material=glowing), size=(16, 12), camera=CAMERA)
    centre = render(s, Area()).mean[0]
    assert set(np.unique(centre)) == {0.0, 1.0}
    boxed = render(s.with_(spp=64), Area(), seed=1, passes=16).mean[0]
    fine = render(s.with_(width=16 * 16, height=12 * 16), Area()).mean[0].reshape(12, 16, 16, 16).mean(axis=(1, 3))
    assert np.abs(boxed - fine).max() < 0.08
    assert np.abs(boxed - centre).max() > 0.2


def test_pixels_near_an_edge_are_marked_and_few():
    ball = Ellipsoid.sphere((0.4, 0.5, 0.3), 0.5, GREY)
    s = scene(floor(), box((-1, 0, -1), (-0.2, 0.8, 0)), ellipsoids=(ball,), size=(96, 72),
              lights=(PointLight((1, 3, 1), (9, 9, 9)),))  # fmt: skip
    image = render(s, Area(), tolerance=Tolerance(1e-6, 1e-4, 1e-6))
    wide = render(s, Area(), tolerance=Tolerance(3e-3, 1e-4, 1e-6))
    assert image.unjudged.sum() < 10
    assert 100 < wide.unjudged.sum() < 2000
    ids = wide.emitter + 2 * wide.background + 4 * (wide.mean[0] == 0)
    flips = np.zeros(ids.shape, dtype=bool)
    flips[:, 1:] |= ids[:, 1:] != ids[:, :-1]
    assert wide.unjudged[flips].mean() > 0.2  # the marked pixels lie on edges, many of those flips


def test_a_scene_without_light_or_surface_is_black():
    assert (render(scene(), Area()).mean == 0).all()
    assert (render(scene(floor()), Area()).mean == 0).all()


def test_what_is_not_shaded_has_no_say_in_the_mean():
    mean, emitter = np.full((3, 200, 2), 2.0), np.zeros((200, 2))
    mean[:, 150, 1], emitter[150, 1] = np.nan, 1.0
    assert Image.without_noise(mean, emitter, np.zeros((200, 2))).pass_means == [2.0]
