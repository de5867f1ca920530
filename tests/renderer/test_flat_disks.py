"""Flat disks as cameras and shadow rays meet them, against fans of triangles and against brute force."""

from dataclasses import dataclass

import numpy as np
import pytest
from builders import GREY, box, floor, scene

from nusselt.renderer.camera.first_hits import first_hits
from nusselt.renderer.estimators import Area, Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.geometry.flat_disks import disk_hull, disk_rim
from nusselt.renderer.image import render
from nusselt.renderer.lights import PointLight, QuadLight
from nusselt.renderer.lights.body import Body
from nusselt.renderer.pixels import render_area
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.surfaces import FlatDisk, Mesh
from nusselt.renderer.vectors import column, dot, unit
from nusselt.renderer.visibility.segments import Blockers

TILTED = FlatDisk((0.2, 1.0, -0.3), tuple(unit(column((0.3, -0.8, 0.4)))[:, 0].tolist()), 0.7)
LEVEL = FlatDisk((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), 0.7)


@dataclass(frozen=True)
class Lamp(PointLight):
    """A point light with a disk for a body."""

    disk: FlatDisk = TILTED

    def body(self):
        return Body(disks=(self.disk,))


def lamp(disk=TILTED, intensity=(0.0, 0.0, 0.0)):
    return Lamp((0.0, 9.0, 0.0), intensity, disk)


def fan(disk, sides=720):
    """The disk as triangles, on its inner polygon."""
    g = build_geometry(scene(lights=(lamp(disk),)))
    rim = disk_rim(g, 0, 2 * np.pi * np.arange(sides) / sides)
    k = np.arange(sides)
    return Mesh(np.hstack((column(disk.center), rim)), np.stack((0 * k, k + 1, (k + 1) % sides + 1)), GREY)


def clear_of_the_rim(disk, p, d):
    """Which lines from p (3, n) along d (3, n) pass the rim by more than the fan's and the disk's difference."""
    n, v = column(disk.normal), column(disk.center) - p
    at = d * (dot(n, v) / dot(n, d)) - v
    return np.abs(np.sqrt(dot(at, at)) / disk.radius - 1) > 1e-4


def test_a_camera_sees_the_disk_where_it_sees_a_fan_of_triangles():
    rng = np.random.default_rng(1)
    d = rng.standard_normal((3, 20_000)) * 0.4 + column((0.2, -1.0, -2.3))
    origin = column((0.0, 2.0, 2.0))
    disk = first_hits(build_geometry(scene(floor(), lights=(lamp(),))), origin, d)
    triangles = first_hits(build_geometry(scene(floor(), fan(TILTED))), origin, d)
    clear = clear_of_the_rim(TILTED, origin, d)
    assert 400 < (disk.surface == 1).sum() < 18_000
    np.testing.assert_array_equal(disk.surface[clear], triangles.surface[clear])
    np.testing.assert_allclose(disk.position[:, clear], triangles.position[:, clear], atol=1e-12)
    np.testing.assert_allclose(disk.distance[clear], triangles.distance[clear], rtol=1e-12)
    assert (disk.triangle[disk.surface == 1] == -1).all()


@pytest.mark.parametrize("at_infinity", [False, True])
def test_shadow_rays_meet_the_disk_where_they_meet_the_fan(at_infinity):
    rng = np.random.default_rng(2)
    p, d = rng.uniform(-1.5, 1.5, (3, 400)), rng.standard_normal((3, 400, 30))
    own = np.full(400, -1)
    seen = []
    for made in (scene(lights=(lamp(),)), scene(fan(TILTED))):
        seen.append(Blockers.everything(build_geometry(made)).visible(p, own, d, at_infinity))
    clear = clear_of_the_rim(TILTED, np.repeat(p, 30, axis=1), d.reshape(3, -1)).reshape(400, 30)
    assert 300 < (~seen[0]).sum() < 8000
    np.testing.assert_array_equal(seen[0][clear], seen[1][clear])


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e9])
def test_what_lies_in_the_plane_is_not_hidden_and_what_lies_beyond_is(size):
    n = np.array(TILTED.normal)
    disk = FlatDisk(tuple((size * np.array(TILTED.center)).tolist()), TILTED.normal, size * TILTED.radius)
    g = build_geometry(scene(lights=(lamp(disk),)))
    rng = np.random.default_rng(3)
    on = disk_rim(g, 0, rng.uniform(0, 2 * np.pi, 500), 0.9)  # on the disk, to rounding
    p = column(disk.center) + size * (column(n) + 0.5 * rng.standard_normal((3, 500)) * (1 - np.abs(column(n))))
    p += column(n) * (0.1 * size - np.minimum(dot(column(n), p - column(disk.center)), 0))
    blockers, own = Blockers.everything(g), np.full(500, -1)

    def seen(start, end):
        return blockers.visible(start, own, (end - start)[:, :, None], False)[:, 0]

    assert seen(p, on).all()
    assert seen(on, p).all()
    assert not seen(p, on - 1e-9 * size * column(n)).any()
    assert not seen(on - 1e-9 * size * column(n), p).any()
    assert Blockers.everything(g).between(p, on, False).none
    assert not Blockers.everything(g).between(p, on - 0.1 * size * column(n), False).none


@pytest.mark.parametrize("place", [0.0, 1 / 3, 1e6 / 7])
def test_of_a_disk_and_the_face_it_lies_on_always_the_disk_is_seen(place):
    disk = FlatDisk((0.1, place, 0.2), (0.0, 1.0, 0.0), 0.9)
    g = build_geometry(scene(floor(2.0, place), lights=(lamp(disk),)))
    d = np.random.default_rng(4).uniform(-1.5, 1.5, (3, 5000)) + column((0.0, -2.0, 0.0))
    origin = column((0.03, place + 1.7, 0.21))
    hits = first_hits(g, origin, d)
    on = hits.surface == 1
    assert 500 < on.sum() < 4900
    inside = (hits.surface >= 0) & (np.hypot(hits.position[0] - 0.1, hits.position[2] - 0.2) < 0.9)
    np.testing.assert_array_equal(on, inside)
    # From below, the black back of the disk and of the floor: the light's is seen. Turned, the floor's front is.
    turned = build_geometry(scene(floor(2.0, place), lights=(lamp(FlatDisk(disk.center, (0.0, -1.0, 0.0), 0.9)),)))
    assert not (first_hits(turned, origin, d).surface == 1).any()


def test_the_body_holds_the_square_around_it():
    g = build_geometry(scene(lights=(lamp(),)))
    np.testing.assert_allclose(dot(column(TILTED.normal), disk_hull(g, 0) - column(TILTED.center)), 0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(disk_hull(g, 0) - column(TILTED.center), axis=0), 0.7 * 2**0.5)


def over_a_floor(*lights, meshes=()):
    view = Camera((0.3, 3.0, 4.0), (0.0, 0.4, 0.0), (0.0, 1.0, 0.0), 40.0)
    return scene(floor(2.0), *meshes, lights=lights, size=(32, 24), camera=view)


@pytest.mark.parametrize("meshes", [(), (box((0.0, 0.25, -0.5), (0.5, 1.5, 0.5)),)], ids=["free", "through a box"])
def test_pixels_by_area_cut_the_rim(meshes):
    made = over_a_floor(Lamp((1.0, 2.5, 1.0), (5.0, 5.0, 5.0), LEVEL), meshes=meshes).with_(width=16, height=12)
    cut = render_area(made, Exact(), tolerance=1e-3).image
    rays = render(made.with_(spp=1024), Area(), seed=1, passes=8)
    share = rays.emitter
    assert share.sum() > 5
    # 8192 independent rays a pixel: 6 standard deviations of the sum, and of any pixel.
    assert abs(cut.emitter.sum() - share.sum()) < 6 * np.sqrt((share * (1 - share)).sum() / 8192) + 1e-3
    assert np.abs(cut.emitter - share).max() < 6 * 0.5 / np.sqrt(8192)
    assert np.abs(cut.mean - rays.mean).max() < 0.05 * rays.mean.max()


def test_behind_a_disk_a_parallelogram_is_sampled_and_exact_says_so():
    quad = QuadLight((-0.5, 2.0, -0.5), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (5.0, 5.0, 5.0))
    made = over_a_floor(quad, lamp(LEVEL))
    needs = prepare(made).needs
    assert (Exact().is_random(needs), Exact().claim(needs)) == (True, "unbiased")
    image = render(made, Exact(samples=64), seed=1, passes=4)
    assert {name for name, count in image.routes.items() if count} == {"sampled"}
    right = render(made, Area(samples=1024, stratified=True), seed=2).mean
    assert image.mean[:, image.shaded].mean() == pytest.approx(right[:, image.shaded].mean(), rel=5e-3)
    # A disk that cannot stand between costs nothing.
    aside = over_a_floor(quad, lamp(FlatDisk((0.0, 3.0, 0.0), (0.0, -1.0, 0.0), 0.7)))
    assert not Exact().is_random(prepare(aside).needs)
