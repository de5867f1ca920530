"""Exact visibility: against polygons in 40 digits, our own Monte Carlo, and itself with nothing left out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders import GREY, box, floor, lamp, quad, scene
from places import SUPPORT
from scipy import stats

from nusselt.experiments.scenes import catalogue
from nusselt.renderer.estimators import Area, Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.lobes import Lambert
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.soft_shadows.convex import sections
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.visibility.segments import Blockers

FALSE_ALARM = 1e-6
TILTED = Ellipsoid((0.3, 0.8, 0.2), ((0.5, 0.1, 0), (0, 0.2, 0.1), (0.2, 0, 0.35)), GREY)
NEEDLE = Ellipsoid((-0.6, 0.6, 0.3), ((0.05, 0.3, 0), (0.1, -0.15, 0), (0, 0, 0.5)), GREY)
SIDE = QuadLight((1.5, 1.0, -1.0), (0.1, 0.9, 0.2), (0.2, 0.1, 1.1), (3, 2, 1))
BLOCK = box((-0.6, 0.3, -0.5), (0.1, 0.8, 0.4))


def ball(center, radius, material=GREY):
    return Ellipsoid.sphere(center, radius, material)


def irradiance(made, position, normal, *, light: int = 0, own: int = -1, **options):
    """E / L at points (3, n) with everything in the scene as occluders."""
    geometry = build_geometry(made)
    position = np.asarray(position, dtype=float).reshape(3, -1)
    n = position.shape[1]
    normal = np.broadcast_to(np.asarray(normal, dtype=float).reshape(3, -1), (3, n))
    white, own_body = {"diffuse": np.ones((3, n))}, np.full(n, own)
    points = ShadingPoints(position, normal, normal, normal, (Lambert,), white, own_body, np.zeros(n, bool))
    source = Source(light, made.lights[light], Blockers.everything(geometry), False)
    out = Exact(**options)(points, source, np.random.default_rng(0))
    return out[0] * math.pi / made.lights[light].radiance[0]


def bare(made):
    """The same lights, nothing in their way."""
    return made.with_(meshes=(), ellipsoids=())


@pytest.fixture(scope="module")
def oracle():
    with np.load(SUPPORT / "visibility_oracles.npz") as kept:
        return dict(kept)


@pytest.mark.parametrize("shortcuts", [True, False])
def test_cornell_boxes_against_forty_digits(oracle, shortcuts):
    """2,000 random points of the surfaces, and 1,000 more in penumbra."""
    made = catalogue.load("cornell-boxes")
    error = irradiance(made, oracle["position"], oracle["normal"], shortcuts=shortcuts) - oracle["irradiance"]
    lit = oracle["unoccluded"] > 0
    assert lit.sum() > 1000
    assert (error[~lit] == 0).all()
    assert np.abs(error[lit] / oracle["unoccluded"][lit]).max() < 1e-9
    penumbra = lit & (oracle["irradiance"] < oracle["unoccluded"] * (1 - 1e-12)) & (oracle["irradiance"] > 0)
    assert penumbra.sum() > 1000
    assert np.abs(error[lit & ~penumbra]).max() < 1e-12


def test_the_oracle_sees_an_edge_moved_by_a_millionth(oracle):
    made = catalogue.load("cornell-boxes")
    meshes = tuple(
        Mesh(m.vertices * (1 + 1e-6 * (m.vertices[1:2] < 1.5)), m.triangles, m.material) for m in made.meshes
    )
    error = irradiance(made.with_(meshes=meshes), oracle["position"], oracle["normal"]) - oracle["irradiance"]
    assert np.abs(error).max() > 1e-8


# Against our own Monte Carlo, pixel by pixel.


def shiny(exponent):
    return Material((0.4, 0.4, 0.4), (0.5, 0.5, 0.5), exponent)


def glossy(exponent):
    m = shiny(exponent)
    bodies = (Ellipsoid(TILTED.center, TILTED.axes, m), ball((0.1, 1.3, 0), 0.3, m))
    return scene(floor(material=m), Mesh(BLOCK.vertices, BLOCK.triangles, m), lights=(lamp(), SIDE), ellipsoids=bodies)


SOUP = Mesh(
    np.random.default_rng(5).uniform([[-0.8], [0.3], [-0.8]], [[0.8], [1.4], [0.8]], (3, 30)),
    np.arange(30).reshape(10, 3).T,
    GREY,
)
SCENES = {
    "boxes": scene(floor(), BLOCK, box((-0.1, 0.9, -0.2), (0.5, 1.2, 0.5)), lights=(lamp(), SIDE)),
    "triangles": scene(floor(), SOUP, lights=(lamp(),)),
    "spheres": scene(floor(), lights=(lamp(),), ellipsoids=(ball((0, 0.6, 0), 0.35), ball((0.3, 1.1, 0.2), 0.3))),
    "ellipsoids": scene(floor(), lights=(lamp(), SIDE), ellipsoids=(TILTED, NEEDLE)),
    "mixed": scene(floor(), BLOCK, SOUP, lights=(lamp(),), ellipsoids=(TILTED, ball((0.1, 1.3, 0), 0.3))),
    "glossy 30": glossy(30.0),
    "glossy 1000": glossy(1000.0),
}


def alarms(exact, sampled, passes):
    """Pixels judged; the smallest p of any by Student's t of its noise, times their number; p of the pooled difference.

    Pixels whose samples see nothing but light, or nothing but shadow, have no noise to be judged by.
    """
    s = exact.shaded
    error = np.sqrt(sampled.pixel_variance / passes)
    difference = (exact.mean - sampled.mean).mean(axis=0)
    noisy = s & (error > 1e-4 * exact.mean[:, s].mean())
    p = 2 * stats.t.sf(np.abs(difference[noisy] / error[noisy]), passes - 1)
    pooled = difference[noisy].sum() / math.sqrt((error[noisy] ** 2).sum())
    return noisy.sum(), p.min() * noisy.sum(), 2 * stats.norm.sf(abs(pooled))


@pytest.mark.parametrize("name", SCENES)
def test_images_lie_within_the_noise_of_sampling_at_every_pixel(name):
    made = SCENES[name].with_(width=24, height=18)
    needs = prepare(made).needs
    assert Exact().claim(needs) == "exact"
    passes = 40
    sampled = render(made, Area(samples=144, stratified=True), seed=11, passes=passes)
    count, pixel, pooled = alarms(render(made, Exact()), sampled, passes)
    assert count > 60
    assert pixel > FALSE_ALARM
    assert pooled > FALSE_ALARM


@pytest.mark.parametrize("name", ["boxes", "glossy 30"])
def test_a_lost_outline_edge_is_caught(name, monkeypatch):
    """The planted defect: every outline loses its first edge."""
    right = sections.Square.edges

    def wrong(square, vertices, points, point):
        lines = right(square, vertices, points, point)
        for v in (lines.a, lines.b, lines.c):
            v[0] = 0
        return lines

    monkeypatch.setattr(sections.Square, "edges", wrong)
    made = SCENES[name].with_(width=24, height=18)
    sampled = render(made, Area(samples=144, stratified=True), seed=11, passes=40)
    _, pixel, pooled = alarms(render(made, Exact()), sampled, 40)
    assert min(pixel, pooled) < FALSE_ALARM


# Leaving out, place and size.


@pytest.mark.parametrize("name", catalogue.CLASSIC)
def test_leaving_out_changes_nothing(name):
    """No shafts, no closed forms for lit points, no umbra, every occluder against every point; and all needs met."""
    made = catalogue.load(name).with_(width=20, height=15, spp=1)
    made = made.with_(lights=tuple(light for light in made.lights if not isinstance(light, SunLight)))
    few, whole = render(made, Exact()), render(made, Exact(shortcuts=False), everything=True)
    bound = render(made.with_(meshes=made.meshes), Area(samples=4, stratified=True)).mean.max()
    np.testing.assert_allclose(few.mean, whole.mean, rtol=1e-10, atol=1e-12 * max(bound, 1e-300))


@pytest.mark.parametrize(("scale", "shift"), [(1e-6, 0.0), (1e9, 0.0), (1.0, 1e3)])
def test_size_and_place_do_not_matter(scale, shift):
    def moved(v):
        return tuple(scale * (c + shift) for c in v)

    def grown(v):
        return tuple(scale * c for c in v)

    made = SCENES["mixed"]
    meshes = tuple(Mesh(scale * (m.vertices + shift), m.triangles, m.material) for m in made.meshes)
    bodies = tuple(Ellipsoid(moved(e.center), tuple(map(grown, e.axes)), e.material) for e in made.ellipsoids)
    light = made.lights[0]
    lights = (QuadLight(moved(light.corner), grown(light.ab), grown(light.ac), light.radiance),)
    x = np.random.default_rng(3).uniform(-1.5, 1.5, (3, 300)) * [[1], [0], [1]]
    here = irradiance(made, x, (0, 1, 0))
    there = irradiance(made.with_(meshes=meshes, ellipsoids=bodies, lights=lights), scale * (x + shift), (0, 1, 0))
    np.testing.assert_allclose(here, there, atol=1e-11 * max(1.0, shift) ** 1)


# Structural coincidences.


X = np.array([[0.0, 0.3, -0.7, 1.1], [0, 0, 0, 0], [0.0, -0.2, 0.5, 0.9]])
UP = (0, 1, 0)


def plate(half, y, x=0.0):
    return quad((x - half, y, half), (x + half, y, half), (x + half, y, -half), (x - half, y, -half))


def test_identical_occluders_hide_what_one_hides():
    one = irradiance(scene(BLOCK, lights=(lamp(),)), X, UP)
    copies = irradiance(scene(*([BLOCK] * 5), lights=(lamp(),)), X, UP)
    np.testing.assert_allclose(copies, one, atol=1e-10)
    sphere = ball((0, 0.8, 0), 0.3)
    one = irradiance(scene(lights=(lamp(),), ellipsoids=(sphere,)), X, UP)
    np.testing.assert_allclose(irradiance(scene(lights=(lamp(),), ellipsoids=(sphere,) * 4), X, UP), one, atol=1e-10)
    one = irradiance(scene(lights=(lamp(),), ellipsoids=(TILTED,)), X, UP)
    np.testing.assert_allclose(irradiance(scene(lights=(lamp(),), ellipsoids=(TILTED,) * 3), X, UP), one, atol=1e-10)


def test_triangles_hide_what_the_quadrilateral_hides():
    whole = irradiance(scene(plate(0.4, 1.0), lights=(lamp(),)), X, UP)
    rng = np.random.default_rng(1)
    for _ in range(5):
        u, v = rng.uniform(-0.3, 0.3, 2)
        corners = [(-0.4, 1, 0.4), (0.4, 1, 0.4), (0.4, 1, -0.4), (-0.4, 1, -0.4)]
        for flip in (1, -1):  # a fan about an inner point, of separate triangles, from both sides
            fan = [np.array([corners[k], corners[(k + 1) % 4], (u, 1, v)][::flip]).T for k in range(4)]
            made = scene(*(Mesh(t, np.array([[0, 1, 2]]).T, GREY) for t in fan), lights=(lamp(),))
            np.testing.assert_allclose(irradiance(made, X, UP), whole, atol=1e-10)


def test_an_open_or_inverted_box_casts_the_same_shadow():
    whole = irradiance(scene(BLOCK, lights=(lamp(),)), X, UP)
    inverted = Mesh(BLOCK.vertices, BLOCK.triangles[::-1], GREY)
    np.testing.assert_allclose(irradiance(scene(inverted, lights=(lamp(),)), X, UP), whole, atol=1e-10)
    open_below = Mesh(BLOCK.vertices, BLOCK.triangles[:, [0, 1, 2, 3, 6, 7, 8, 9, 10, 11]], GREY)
    np.testing.assert_allclose(irradiance(scene(open_below, lights=(lamp(),)), X, UP), whole, atol=1e-10)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 1 - 1e-6, 1 - 1e-12])
def test_a_plate_that_projects_onto_the_light_hides_it(share):
    """From the centre its edges project exactly onto the light's."""
    made = scene(plate(0.5 * share, 2 * share), lights=(lamp(),))
    assert irradiance(made, (0, 0, 0), UP)[0] == pytest.approx(0, abs=1e-10)
    half = scene(quad((-0.25, 1, 0.25), (0, 1, 0.25), (0, 1, -0.25), (-0.25, 1, -0.25)), lights=(lamp(),))
    whole = irradiance(bare(half), (0, 0, 0), UP)
    np.testing.assert_allclose(irradiance(half, (0, 0, 0), UP), whole / 2, rtol=1e-9)


def test_what_touches_the_light_or_lies_behind_it():
    free = irradiance(scene(lights=(lamp(),)), X, UP)
    behind = scene(box((-3, 2, -3), (3, 4, 3)), ball_light(), lights=(lamp(),))
    np.testing.assert_allclose(irradiance(behind, X, UP), free, atol=1e-10)
    cover = scene(plate(0.5, 2 - 1e-9), lights=(lamp(),))
    np.testing.assert_allclose(irradiance(cover, X, UP), 0, atol=1e-7)
    below = scene(box((-9, -3, -9), (9, 0, 9)), lights=(lamp(),))
    np.testing.assert_allclose(irradiance(below, X, UP), free, atol=1e-12)
    # A box through the light's plane blocks like the part of it before the plane.
    through = scene(box((-0.2, 1.5, -0.2), (0.3, 2.5, 0.1)), lights=(lamp(),))
    cut = scene(box((-0.2, 1.5, -0.2), (0.3, 2.0, 0.1)), lights=(lamp(),))
    np.testing.assert_allclose(irradiance(through, X, UP), irradiance(cut, X, UP), atol=1e-10)
    assert (irradiance(cut, X, UP) < free - 0.01).all()


def ball_light():
    """A plate beside the light, in its plane."""
    return quad((0.5, 2, 0.5), (1.5, 2, 0.5), (1.5, 2, -0.5), (0.5, 2, -0.5))


def test_occluders_cut_by_the_receivers_horizon():
    """A box sunk into the floor hides what the part above it hides; light that straddles the horizon, too."""
    low = QuadLight((1.5, -0.5, -1.0), (0, 1.5, 0), (0, 0, 2.0), (3, 2, 1))
    x = X[:, :3]
    for light in (lamp(), low):
        sunk = scene(box((0.5, -0.5, -0.3), (0.8, 0.7, 0.6)), lights=(light,))
        standing = scene(box((0.5, 0, -0.3), (0.8, 0.7, 0.6)), lights=(light,))
        np.testing.assert_allclose(irradiance(sunk, x, UP), irradiance(standing, x, UP), atol=1e-10)
        free = irradiance(bare(sunk), x, UP)
        assert (irradiance(sunk, x, UP) < free + 1e-12).all()


def test_inside_a_closed_box_with_the_light_nothing_blocks_and_without_it_all_does():
    room = box((-2, -1e-3, -2), (2, 3, 2))
    free = irradiance(scene(lights=(lamp(),)), X, UP)
    np.testing.assert_allclose(irradiance(scene(room, lights=(lamp(),)), X, UP), free, atol=1e-10)
    ceiling = box((-2, -1e-3, -2), (2, 2, 2))  # the light lies in its ceiling
    np.testing.assert_allclose(irradiance(scene(ceiling, lights=(lamp(),)), X, UP), free, atol=1e-10)
    low = box((-2, -1e-3, -2), (2, 1, 2))
    assert (irradiance(scene(low, lights=(lamp(),)), X, UP) == 0).all()


# Spheres.


def test_a_cap_inside_the_light_hides_its_own_irradiance():
    for radius in (0.1, 1e-3, 1e-5):
        made = scene(lights=(lamp(),), ellipsoids=(ball((0, 1, 0), radius),))
        hidden = irradiance(bare(made), (0, 0, 0), UP) - irradiance(made, (0, 0, 0), UP)
        assert hidden[0] == pytest.approx(math.pi * radius**2, abs=1e-11)


def test_a_cap_that_covers_the_light_leaves_exactly_nothing():
    made = scene(lights=(lamp(),), ellipsoids=(ball((0, 1, 0), 0.6),))
    assert irradiance(made, (0, 0, 0), UP)[0] == 0.0


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12, 0.0, -1e-12, -1e-9, -1e-6, -1e-3])
def test_tangency_to_a_light_edge_is_continuous(gap):
    """The cap touches the light's edge from within: what it hides is its own irradiance but for a sliver."""
    sine = 0.2
    centre = math.atan(0.25) - math.asin(sine) - gap
    where = (math.sin(centre), math.cos(centre), 0.0)
    made = scene(lights=(lamp(),), ellipsoids=(ball(where, sine),))
    hidden = irradiance(bare(made), (0, 0, 0), UP) - irradiance(made, (0, 0, 0), UP)
    full = math.pi * sine**2 * math.cos(centre)
    assert hidden[0] == pytest.approx(full, abs=1e-10 + 4 * max(-gap, 0) ** 1.5)


def test_spheres_within_others_and_touching_change_nothing():
    outer = ball((0, 0.8, 0), 0.3)
    one = irradiance(scene(lights=(lamp(),), ellipsoids=(outer,)), X, UP)
    for inner in (ball((0, 0.8, 0), 0.2), ball((0.1, 0.8, 0), 0.2), ball((0, 0.9, 0.05), 0.01)):
        for bodies in ((outer, inner), (inner, outer)):
            made = scene(lights=(lamp(),), ellipsoids=bodies)
            np.testing.assert_allclose(irradiance(made, X, UP), one, atol=1e-10)
    shell = box((-0.31, 0.49, -0.31), (0.31, 1.11, 0.31))
    boxed = irradiance(scene(shell, lights=(lamp(),)), X, UP)
    np.testing.assert_allclose(
        irradiance(scene(shell, lights=(lamp(),), ellipsoids=(outer,)), X, UP), boxed, atol=1e-10
    )


def test_a_sphere_said_as_an_ellipsoid_is_the_sphere():
    sphere = ball((0.1, 0.8, 0.2), 0.3)
    nearly = Ellipsoid(sphere.center, ((0.3 * (1 + 1e-9), 0, 0), (0, 0.3, 0), (0, 0, 0.3 * (1 - 1e-9))), GREY)
    with_ = [irradiance(scene(BLOCK, lights=(lamp(), SIDE), ellipsoids=(e, TILTED)), X, UP) for e in (sphere, nearly)]
    np.testing.assert_allclose(*with_, atol=2e-9)


def test_beside_the_contact_of_a_resting_sphere():
    """Darker without end towards the contact point, never negative, whichever way the light comes."""
    low = QuadLight((2, -0.5, -1.0), (0, 1.5, 0), (0, 0, 2.0), (3, 2, 1))
    made = scene(lights=(lamp(3.0), low), ellipsoids=(ball((0, 0.5, 0), 0.5),))
    steps = 10.0 ** -np.arange(1, 13)
    x = np.stack((steps, 0 * steps, 0 * steps))
    for light in (0, 1):
        value = irradiance(made, x, UP, light=light)
        free = irradiance(bare(made), x, UP, light=light)
        assert (value >= 0).all()
        assert (value <= free * (1 + 1e-12)).all()
    overhead = irradiance(made, x, UP)
    assert (np.diff(overhead) <= 1e-10).all()
    assert overhead[-1] < 1e-10


def test_points_on_round_bodies_see_past_themselves():
    """A point on top of a sphere sees the whole light, as from a plane there."""
    sphere = ball((0, 0.5, 0), 0.5)
    made = scene(lights=(lamp(),), ellipsoids=(sphere,))
    theta = np.linspace(0, np.pi, 50)
    normal = np.stack((np.sin(theta), np.cos(theta), 0 * theta))
    x = np.array(sphere.center)[:, None] + 0.5 * normal
    np.testing.assert_allclose(irradiance(made, x, normal, own=0), irradiance(bare(made), x, normal), atol=1e-14)


# What it says of itself.


def test_claims_and_routes():
    lights = (SIDE, PointLight((1, 2, 0), (1, 1, 1)), DirectionalLight((1, 2, 0), (1, 1, 1)))
    made = scene(floor(), BLOCK, lights=lights)
    image = render(made, Exact())
    needs = prepare(made).needs
    assert Exact().claim(needs) == "exact"
    assert not Exact().is_random(needs)
    assert sum(image.routes.values()) == 3 * image.shaded.sum()
    assert min(image.routes[name] for name in ("unlit", "lit", "exact", "hidden")) > 0
    assert image.routes.get("sampled", 0) == 0
    sunny = made.with_(lights=(*lights, SunLight((1, 2, 0), (1, 1, 1), 5.0)))
    assert Exact().claim(prepare(sunny).needs) == "unbiased"
    assert render(sunny, Exact()).routes["sampled"] > 0
    crossing = scene(floor(), lights=(lamp(),), ellipsoids=(ball((0.3, 2, 0), 0.3),))
    assert Exact().claim(prepare(crossing).needs) == "unbiased"
    assert render(crossing, Exact()).routes["sampled"] > 0


def test_no_point_is_too_much_at_once():
    """One point, no point, and more pairs than are handled at once give the same numbers."""
    rng = np.random.default_rng(9)
    boxes = [box(c, c + 0.05) for c in rng.uniform([-0.8, 0.3, -0.8], [0.8, 1.4, 0.8], (40, 3))]
    made = scene(*boxes, lights=(lamp(),))
    x = rng.uniform(-1, 1, (3, 700)) * [[1], [0], [1]]
    together = irradiance(made, x, UP)
    alone = [irradiance(made, x[:, [k]], UP)[0] for k in range(0, 700, 70)]
    np.testing.assert_allclose(together[::70], alone, atol=1e-14)
    assert irradiance(made, np.empty((3, 0)), UP).shape == (0,)
