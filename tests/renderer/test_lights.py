"""Every kind of light is held to its interface: `LIGHTS` is all that these tests know of kinds, but for EXAMPLES."""

import numpy as np
import pytest
from builders import box, floor, scene
from scipy.optimize import nnls

from nusselt.mitsuba_bridge.description import describe
from nusselt.mitsuba_bridge.lights import approximations, cover, described, strata_alike
from nusselt.mitsuba_bridge.limits import clearance
from nusselt.mitsuba_bridge.xml import to_xml
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Analytic, Area, Exact
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.image import render
from nusselt.renderer.lights import (
    LIGHTS,
    CosineLight,
    DirectionalLight,
    DiskLight,
    MeshLight,
    PointLight,
    QuadLight,
    SkyLight,
    SphereLight,
    SpotLight,
    SunLight,
    TriangleLight,
)
from nusselt.renderer.lights.protocol import ANSWERS, check_kind
from nusselt.renderer.lights.sampling import one_place, random_beams
from nusselt.renderer.lobes import Lambert, Phong
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Camera
from nusselt.renderer.scene_text import parse_scene, write_scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.surfaces import Mesh
from nusselt.renderer.vectors import column, dot, unit

TETRAHEDRON = Mesh(
    0.5 * np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]).T + column((0.0, 2.0, 0.0)),
    np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]).T,
)
"""Regular, outwards: a grid of lines falls evenly on its faces."""
EXAMPLES = {
    QuadLight: QuadLight((-0.5, 2.0, -0.25), (0.125, 0.5, 1.0), (1.5, 0.0, 0.25), (5.0, 4.0, 3.0)),
    PointLight: PointLight((0.25, 1.5, -0.5), (3.0, 2.0, 1.0)),
    DirectionalLight: DirectionalLight((1.0, 2.0, -0.5), (0.5, 1.0, 2.0)),
    SunLight: SunLight((1.0, 2.0, -0.5), (0.5, 1.0, 2.0), 40.0),
    DiskLight: DiskLight((0.25, 2.0, -0.5), (0.25, -2.0, 0.5), 0.75, (5.0, 4.0, 3.0)),
    SpotLight: SpotLight((0.25, 1.5, -0.5), (-0.25, -2.0, 0.5), 60.0, 15.0, (3.0, 2.0, 1.0)),
    SphereLight: SphereLight((0.25, 2.0, -0.5), 0.75, (5.0, 4.0, 3.0)),
    TriangleLight: TriangleLight((-0.5, 2.0, -0.25), (1.0, 2.25, 0.0), (0.0, 2.5, 1.0), (5.0, 4.0, 3.0)),
    MeshLight: MeshLight(TETRAHEDRON, (5.0, 4.0, 3.0)),
    SkyLight: SkyLight((0.5, 1.0, 2.0)),
    CosineLight: CosineLight((0.25, 1.5, -0.5), (0.25, -2.0, 0.5), (3.0, 2.0, 1.0)),
}
KINDS = pytest.mark.parametrize("kind", LIGHTS, ids=lambda kind: kind.kind)


@KINDS
def test_every_kind_has_an_example_here_and_answers_the_interface(kind):
    light = EXAMPLES[kind]
    for name in ANSWERS:
        assert hasattr(light, name)
    assert light.with_colour((1.0, 2.0, 4.0)).colour == (1.0, 2.0, 4.0)
    assert hash(light) == hash(light.with_colour(light.colour))


def test_no_two_kinds_share_a_name_or_a_command():
    assert len({kind.kind for kind in LIGHTS}) == len({kind.TEXT.command for kind in LIGHTS}) == len(LIGHTS)


def points_below(count=40):
    """Points under the examples with normals that see them, some of them across the horizon."""
    rng = np.random.default_rng(3)
    at = np.stack((rng.uniform(-1, 1, count), rng.uniform(-1, 0.5, count), rng.uniform(-1, 1, count)))
    return at, unit(column((0.0, 1.0, 0.0)) + 0.6 * rng.standard_normal((3, count)))


def irradiance_error(light, side, weigh):
    """Largest error of the irradiance that a grid of side^2 beams gives, relative to the closed form's largest."""
    at, normal = points_below()
    if light.has_extent:
        grid = (np.arange(side) + 0.5) / side
        u, v = (part.ravel()[None] for part in np.meshgrid(grid, grid, indexing="ij"))
    else:
        u, v = one_place()
    d, weight = light.beams(at, u, v)
    cosine = np.maximum(dot(normal[:, :, None], d), 0) / np.sqrt(dot(d, d))
    mine = (weigh(weight, d) * cosine).sum(axis=1)
    made = shading_points_of(at, normal)
    right = (light.with_colour((1.0, 1.0, 1.0)).unshadowed(made, False)[0][0]) * np.pi
    return np.abs(mine - right).max() / right.max()


def shading_points_of(at, normal):
    n = at.shape[1]
    columns = {"diffuse": np.ones((3, n)), "specular": np.zeros((3, n)), "shininess": np.ones(n)}
    flags = np.full(n, -1), np.zeros(n, dtype=bool)
    return ShadingPoints(at, normal, normal, normal, (Lambert, Phong), columns, *flags)


@KINDS
def test_beams_integrate_to_the_closed_form(kind):
    light = EXAMPLES[kind]
    assert irradiance_error(light, 300, lambda weight, d: weight) < 2e-4
    # The length of the way or the cosine at the light forgotten:
    assert irradiance_error(light, 300, lambda weight, d: weight * 1.001) > 5e-4


@KINDS
def test_beams_places_and_worths_tell_the_same(kind):
    light, (at, _) = EXAMPLES[kind], points_below()
    rng = np.random.default_rng(5)
    d, weight = random_beams(light, at, rng, 16, True)
    assert d.shape[2] == weight.shape[1] == (16 if light.has_extent else 1)
    np.testing.assert_allclose(weight * d.shape[2], np.where(weight > 0, light.worth(at, d), 0.0), rtol=1e-12)
    for u, v in rng.random((5, 2)):
        d, _ = light.beams(at, np.array([[u]]), np.array([[v]]))
        place = light.at(u, v)
        if place is None:  # each point has its own
            continue
        place = place - (0 if light.at_infinity else at)
        np.testing.assert_allclose(d[:, :, 0], np.broadcast_to(place, at.shape), atol=1e-14)


@KINDS
def test_the_hull_and_the_middle_hold_the_light(kind):
    light = EXAMPLES[kind]
    hull, (middle, radius) = light.hull(), light.middle()
    rows = hull if light.at_infinity else np.vstack((hull, np.ones(hull.shape[1])))
    for u, v in [*np.random.default_rng(6).random((40, 2)), (0, 0), (1, 0), (0, 1), (1, 1)]:
        place = light.at(u, v)
        if place is None:
            place = np.zeros((3, 1)) + light.beams(np.zeros((3, 1)), np.array([[u]]), np.array([[v]]))[0][:, :, 0]
        target = place if light.at_infinity else np.vstack((place, 1.0))
        assert nnls(rows, target[:, 0])[1] < 1e-9
        if light.at_infinity:
            place = place / dot(place, middle)
        assert np.linalg.norm(place - middle) <= radius + 1e-12


def room(*lights):
    view = Camera((0.25, 3.0, 5.0), (0.0, 0.5, 0.0), (0.0, 1.0, 0.0), 40.0)
    return scene(floor(2.0), box((-0.5, 0.25, -0.5), (0.0, 0.75, 0.0)), lights=lights, size=(24, 18), camera=view)


@KINDS
def test_a_light_read_from_its_own_text_is_the_same(kind):
    made = room(EXAMPLES[kind])
    assert parse_scene(write_scene(made)).lights == made.lights


@KINDS
def test_a_scene_seen_from_another_origin_has_the_same_image(kind):
    made, shift = room(EXAMPLES[kind]), np.array([8.0, -4.0, 16.0])
    camera = made.camera
    there = made.with_(
        camera=Camera(tuple(camera.position - shift), tuple(camera.target - shift), camera.up, camera.fov_y),
        meshes=tuple(type(mesh)(mesh.vertices - shift[:, None], mesh.triangles, mesh.material) for mesh in made.meshes),
    )
    moved = there.with_(lights=tuple(light.moved(shift) for light in made.lights))
    images = [render(each, Area(samples=16), seed=2).mean for each in (made, moved, there)]
    np.testing.assert_allclose(images[1], images[0], rtol=1e-9, atol=1e-12)
    assert EXAMPLES[kind].at_infinity == np.allclose(images[2], images[0], rtol=1e-3)


@KINDS
def test_bodies_are_black_and_seen_and_what_is_behind_a_plane_gets_nothing(kind):
    light = EXAMPLES[kind]
    geometry = build_geometry(room(light))
    assert (geometry.light == 0).any() == (light.body() is not None) == (light.area > 0)
    own = geometry.light == 0
    assert not geometry.reflects[own].any()
    if light.plane() is not None:
        normal, place = light.plane()
        behind = place - normal * np.array([0.5, 1.0, 2.0])
        assert not random_beams(light, behind, np.random.default_rng(0), 16, True)[1].any()
        assert random_beams(light, 2 * place - behind, np.random.default_rng(0), 16, True)[1].all()
        above = scene(floor(1.0), lights=(light.with_colour((1.0, 1.0, 1.0)),))
        lifted = above.with_(lights=tuple(one.moved(np.array([0.0, 50.0, 0.0])) for one in above.lights))
        assert prepare(above).needs.sources
        assert next(out.why for out in prepare(lifted).needs.left_out) == "every surface lies behind it"
    dark = prepare(room(light.with_colour((0.0, 0.0, 0.0)))).needs
    assert (not dark.sources, dark.left_out[0].why) == (True, "it is black")


@KINDS
@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda estimator: estimator.name)
def test_every_estimator_takes_every_kind(kind, estimator):
    made = room(EXAMPLES[kind])
    # All directions of a sky in a few common strata are far apart.
    image = render(made, estimator(samples=256 if kind.surrounds else 64), seed=1, passes=2)
    if estimator is Analytic:
        made = made.with_(meshes=made.meshes[:1])
        image = render(made, estimator())
    right = render(made, Area(samples=4096, stratified=True), seed=9).mean
    assert image.mean[:, image.shaded].mean() == pytest.approx(right[:, image.shaded].mean(), rel=0.02)


@KINDS
def test_exact_says_which_kinds_it_samples(kind):
    light = EXAMPLES[kind]
    image = render(room(light), Exact(samples=64), passes=2)
    sampled = light.has_extent and light.parallelogram() is None and light.half_of() is None
    assert (image.routes.get("sampled", 0) > 0) == sampled
    assert Exact().is_random(prepare(room(light)).needs) == sampled


@KINDS
def test_the_bridge_knows_every_kind(kind, tmp_path):
    light = EXAMPLES[kind]
    entry = described(light, np.asarray, 1.0)
    assert {"kind"} < set(entry)
    assert all(isinstance(note, str) for note in approximations(light))
    assert strata_alike(light) in (True, False)
    geometry = build_geometry(room(light))
    assert clearance(light, geometry, np.arange(12))[0].min() > 0
    assert f'type="{entry["kind"]}"' in to_xml(describe(room(light), tmp_path))


class Stranger:
    """A kind that nobody has listed."""

    kind = "stranger"


def test_an_unknown_kind_is_taken_for_no_other():
    with pytest.raises(TypeError, match=r"lacks .*beams"):
        check_kind(Stranger)
    for ask in (
        lambda light: described(light, np.asarray, 1.0),
        approximations,
        strata_alike,
        cover,
    ):
        with pytest.raises(InputError, match="Stranger"):
            ask(Stranger())
    for ask in (build_geometry, write_scene, prepare):
        with pytest.raises((AttributeError, TypeError)):
            ask(room().with_(lights=(Stranger(),)))
    with pytest.raises(InputError, match="stranger"):
        parse_scene("size 4 4\ncamera 0 0 1 0 0 0 0 1 0 45\nstranger 1 2 3\n")
