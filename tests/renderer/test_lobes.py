"""Every kind of lobe is held to its interface: `LOBES` is all that these tests know of kinds, but for EXAMPLES."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from builders import box, floor, lamp, scene

from nusselt.mitsuba_bridge import lobes as bridge
from nusselt.mitsuba_bridge.description import describe
from nusselt.mitsuba_bridge.xml import to_xml
from nusselt.renderer import lobes
from nusselt.renderer.camera.view import look
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import ESTIMATORS, Analytic, Area, ControlVariate, Exact
from nusselt.renderer.image import render
from nusselt.renderer.lights import DirectionalLight, DiskLight, PointLight
from nusselt.renderer.lobes import LOBES, Lambert, Phong, SampledLobe, ShadingPoints
from nusselt.renderer.lobes.protocol import ANSWERS, Parameter, check_kind, from_values, joined, values_of
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene_text import commands, parse_scene, write_scene
from nusselt.renderer.shading import reflect
from nusselt.renderer.surfaces import Ellipsoid, Material
from nusselt.renderer.vectors import column, dot, unit

EXAMPLES = {Lambert: Lambert((0.5, 0.25, 0.125)), Phong: Phong((0.125, 0.25, 0.5), 9.5)}
ONE_WAY: set[type] = set()
"""Kinds that are not reciprocal."""
KINDS = pytest.mark.parametrize("kind", LOBES, ids=lambda kind: kind.kind)


def made_of(lobe) -> Material:
    return Material.of(values_of(lobe))


def points_of(lobe, normal, outgoing, position=None) -> ShadingPoints:
    """Points of unit normals and viewing directions (3, n) with one lobe."""
    n = normal.shape[1]
    position = np.zeros((3, n)) if position is None else position
    mirror = 2 * dot(normal, outgoing) * normal - outgoing
    columns = {name: np.tile(np.reshape(value, (-1, 1)), (1, n)) for name, value in values_of(lobe).items()}
    columns = {name: value if value.shape[0] == 3 else value[0] for name, value in columns.items()}
    flags = np.full(n, -1), np.zeros(n, dtype=bool)
    return ShadingPoints(position, normal, outgoing, mirror, (type(lobe),), columns, *flags)


def above(n, seed):
    """Unit directions (3, n) over y = 0."""
    v = unit(np.random.default_rng(seed).standard_normal((3, n)))
    v[1] = np.abs(v[1])
    return v


def up(n):
    return np.tile(column((0.0, 1.0, 0.0)), (1, n))


@KINDS
def test_every_kind_has_an_example_here_and_answers_the_interface(kind):
    lobe = EXAMPLES[kind]
    for name in ANSWERS:
        assert hasattr(lobe, name)
    assert kind().albedo == (0.0, 0.0, 0.0)
    assert kind.PARAMETERS[0].is_colour
    assert next(iter(values_of(lobe).values())) == lobe.albedo
    assert from_values(kind, values_of(lobe)) == lobe
    with pytest.raises(InputError, match=kind.PARAMETERS[0].name):
        replace(lobe, albedo=(0.5, -0.5, 0.5))


def test_no_two_kinds_share_a_name_or_a_parameter():
    assert len({kind.kind for kind in LOBES}) == len({kind.title for kind in LOBES}) == len(LOBES)
    names = [parameter.name for kind in LOBES for parameter in kind.PARAMETERS]
    assert len(set(names)) == len(names)


def unequal(lobe, function) -> float:
    """How far a function of points, ways and lengths is from reciprocal, relative to its largest value."""
    one, other = above(500, 1), above(500, 2)
    there = function(points_of(lobe, up(500), one), other[:, :, None], np.ones((500, 1)))
    back = function(points_of(lobe, up(500), other), one[:, :, None], np.ones((500, 1)))
    return np.abs(there - back).max() / there.max()


@KINDS
def test_reciprocity(kind):
    assert (unequal(EXAMPLES[kind], kind.evaluate) < 1e-12) == (kind not in ONE_WAY)
    # The cosine at one end taken into the function:
    assert unequal(EXAMPLES[kind], lambda p, d, length: kind.evaluate(p, d, length) * d[1]) > 0.01


@KINDS
def test_no_kind_reflects_more_than_its_albedo_and_its_length_does_not_matter(kind):
    side = 300
    u, v = ((part.ravel() + 0.5) / side for part in np.meshgrid(np.arange(side), np.arange(side)))
    sine = np.sqrt(u)  # the density is that of the cosine: the mean is the integral over pi
    d = np.stack((sine * np.cos(2 * np.pi * v), np.sqrt(1 - u), sine * np.sin(2 * np.pi * v)))[:, None]
    outgoing = np.hstack((above(20, 3), column((0.0, 1.0, 0.0)), unit(column((1.0, 1e-3, 0.0)))))
    ways, count = np.broadcast_to(d, (3, 22, side**2)), outgoing.shape[1]
    points = points_of(EXAMPLES[kind], up(count), outgoing)
    value = kind.evaluate(points, ways, np.ones((count, side**2)))
    reflected = np.pi * value.mean(axis=1)
    assert value.min() >= 0
    assert 0.5 < reflected.max() < 1 + 1e-3
    twice = kind.evaluate(points, 2 * ways, np.full((count, side**2), 2.0))
    np.testing.assert_allclose(twice, value, rtol=1e-12, atol=1e-12)


@KINDS
def test_sums_over_beams_are_sums_of_the_function(kind):
    points, d = points_of(EXAMPLES[kind], up(30), above(30, 4)), above(30 * 7, 5).reshape(3, 30, 7)
    weight = np.random.default_rng(6).random((30, 7))
    value = kind.evaluate(points, d, np.ones((30, 7)))
    right = column(EXAMPLES[kind].albedo) * (weight * d[1] * value).sum(axis=1)
    np.testing.assert_allclose(reflect(points, d, weight, True), right, rtol=1e-12)


CORNER, AB, AC = (column(v) for v in ((-0.5, 1.0, -0.25), (0.125, 0.25, 0.5), (0.75, 0.0, 0.25)))


def patch_error(lobe, gain=1.0) -> float:
    """Largest relative error of a kind's closed form against quadrature, where its integrand is smooth."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    u, v = (part.ravel()[None] for part in np.meshgrid((nodes + 1) / 2, (nodes + 1) / 2, indexing="ij"))
    w = np.outer(weights, weights).ravel() / 4
    n, rng = 60, np.random.default_rng(7)
    position = np.stack((rng.uniform(-1, 1, n), rng.uniform(-2, -0.5, n), rng.uniform(-1, 1, n)))
    toward = unit(CORNER + (AB + AC) / 2 - position)
    normal = unit(toward + 0.3 * unit(rng.standard_normal((3, n))))
    outgoing = 2 * dot(normal, toward) * normal - toward
    points = points_of(lobe, normal, unit(outgoing + 0.2 * unit(rng.standard_normal((3, n)))), position)
    value, bound = type(lobe).patch(points, np.arange(n), CORNER, AB, AC)
    d = (CORNER - position)[:, :, None] + AB[:, :, None] * u[:, None] + AC[:, :, None] * v[:, None]
    length = np.sqrt(dot(d, d))
    area = np.cross(AB, AC, axis=0)[:, :, None]
    solid = np.abs(dot(area, d)) / length**3 * w
    cosine = dot(normal[:, :, None], d) / length
    assert (cosine > 0.1).all()
    right = (type(lobe).evaluate(points, d, length) * cosine * solid).sum(axis=1)
    assert (bound < 1e-9).all()
    return np.abs(value * gain / right - 1).max()


@KINDS
def test_the_closed_form_over_a_parallelogram_is_the_integral(kind):
    if kind.patch is None:
        assert not lamp().has_form(kind)
        return
    assert patch_error(EXAMPLES[kind]) < 1e-11
    assert patch_error(EXAMPLES[kind], gain=1 + 1e-9) > 1e-10


def room(lobe, light, blocked=True):
    """A floor of that lobe, and a box of it over its middle."""
    material = made_of(lobe)
    over = (box((-0.25, 0.5, -0.25), (0.25, 0.75, 0.25), material),) if blocked else ()
    return scene(floor(material=material), *over, lights=(light,), size=(16, 12))


@KINDS
def test_the_exact_contour_carries_it_or_says_that_it_does_not(kind):
    made = room(EXAMPLES[kind], lamp())
    image = render(made, Exact(samples=64), seed=1, passes=2)
    if kind.contour is None:
        assert set(image.routes) == {"sampled"}
        assert any(kind.title in line for line in Exact().sampled(prepare(made).needs))
        return
    assert not image.routes.get("sampled")
    assert not Exact().sampled(prepare(made).needs)
    bare = room(EXAMPLES[kind], lamp(), blocked=False)
    np.testing.assert_allclose(
        render(bare, Exact(shortcuts=False)).mean, render(bare, Analytic()).mean, rtol=1e-9, atol=1e-12
    )


@KINDS
@pytest.mark.parametrize("light", [lamp(), DiskLight((0, 2, 0), (0, -1, 0), 0.5, (5, 5, 5))], ids=["quad", "disk"])
@pytest.mark.parametrize("estimator", ESTIMATORS, ids=lambda estimator: estimator.name)
def test_every_estimator_takes_every_kind_that_has_its_closed_form(kind, light, estimator):
    made = room(EXAMPLES[kind], light, blocked=estimator is not Analytic)
    right = render(made, Area(samples=4096, stratified=True), seed=9)
    image = render(made, estimator(samples=256), seed=1, passes=2)
    assert image.mean[:, right.shaded].mean() == pytest.approx(right.mean[:, right.shaded].mean(), rel=0.01)


@KINDS
def test_scenes_of_it_come_back_from_text(kind):
    with_it, without = made_of(EXAMPLES[kind]), Material((0.25, 0.5, 0.75))
    made = scene(
        floor(material=with_it),
        floor(y=-1.0, material=without),
        floor(y=-2.0, material=with_it),
        lights=(lamp(),),
        ellipsoids=(Ellipsoid.sphere((0.0, 0.5, 0.0), 0.25, without), Ellipsoid.sphere((1.0, 0.5, 0.0), 0.25, with_it)),
    )
    assert parse_scene(write_scene(made)) == made
    assert all(f"\n{parameter.name} " in write_scene(made) for parameter in kind.PARAMETERS)
    albedo = kind.PARAMETERS[0].name
    with pytest.raises(InputError, match=rf":3: {albedo} = \(-1"):
        parse_scene(f"size 4 4\ncamera 0 0 1 0 0 0 0 1 0 45\n{albedo} -1 0 0\n")


@KINDS
def test_the_bridge_knows_every_kind(kind, tmp_path):
    made = room(EXAMPLES[kind], lamp())
    entry = bridge.surface(made.meshes[0].material)
    assert len(entry) > 1
    assert f'<bsdf type="{entry["kind"]}"' in to_xml(describe(made, tmp_path))


@KINDS
def test_what_no_surface_has_is_left_out_and_said(kind):
    def told(lobe):
        return [entry.what for entry in prepare(room(lobe, lamp())).needs.left_out]

    assert kind.title not in told(EXAMPLES[kind])
    if kind.glossy:
        assert kind.title in told(Lambert((0.5, 0.5, 0.5)))


def test_parts_of_points_are_joined_as_they_were_taken():
    points = points_of(EXAMPLES[Phong], up(9), above(9, 8))
    again = joined([points.take(np.arange(4)), points.take(np.arange(4, 9))])
    np.testing.assert_array_equal(again.mirror, points.mirror)
    np.testing.assert_array_equal(again.specular, points.specular)
    np.testing.assert_array_equal(again.shininess, points.shininess)
    assert again.lobes == points.lobes


@dataclass(frozen=True)
class Blinn(SampledLobe):
    """Blinn's (n.h)^s, as a kind that somebody might add: nothing else in the project knows of it."""

    albedo: tuple[float, float, float] = (0.0, 0.0, 0.0)
    power: float = 4.0
    kind: ClassVar[str] = "blinn"
    title: ClassVar[str] = "the Blinn lobe"
    PARAMETERS: ClassVar[tuple[Parameter, ...]] = (Parameter("blinn", "r g b"), Parameter("blinnPower", "exponent"))

    @classmethod
    def evaluate(cls, points, d, length):
        half = unit(d / length + points.outgoing[:, :, None])
        s = points.columns["blinnPower"][:, None]
        return (s + 8) / (8 * math.pi) * np.maximum(dot(points.normal[:, :, None], half), 0) ** s


@pytest.fixture
def blinn(monkeypatch) -> Blinn:
    """A lobe of a third kind, listed."""
    check_kind(Blinn)
    monkeypatch.setattr(lobes, "LOBES", (*LOBES, Blinn))
    for name, command in commands.lobe_commands(Blinn).items():
        monkeypatch.setitem(commands.COMMANDS, name, command)
    return Blinn((0.25, 0.5, 0.125), 12.0)


def test_a_new_kind_is_rendered_by_its_function_alone(blinn):
    light = PointLight((0.25, 1.5, -0.5), (3.0, 2.0, 1.0))
    material = Material((0.5, 0.25, 0.125), further=(blinn,))
    made = scene(floor(material=material), lights=(light,), size=(32, 24))
    image = render(made, Area())
    x, y = (part.ravel() + 0.5 for part in np.meshgrid(np.arange(32), np.arange(24)))
    points = look(made, prepare(made).geometry, x, y).points
    way = column(light.position) - points.position
    length = np.sqrt(dot(way, way))
    half = unit(way / length + points.outgoing)
    lobe = (12 + 8) / (8 * math.pi) * half[1] ** 12
    brdf = column(material.diffuse) / math.pi + column(blinn.albedo) * lobe
    right = brdf * column(light.intensity) * way[1] / length**3
    assert points.count > 100
    np.testing.assert_allclose(image.mean[:, image.shaded], right, rtol=1e-12)


def test_a_new_kind_without_closed_forms_is_sampled_and_that_is_said(blinn):
    made = room(blinn, lamp())
    needs = prepare(made).needs
    plain = render(made, Area(samples=64), seed=3, passes=2).mean
    np.testing.assert_array_equal(render(made, ControlVariate(samples=64), seed=3, passes=2).mean, plain)
    assert ControlVariate().claim(needs) == Exact().claim(needs) == "unbiased"
    bare = prepare(room(blinn, lamp(), blocked=False)).needs
    assert not bare.visibility
    assert ControlVariate().is_random(bare)
    assert Exact().is_random(bare)
    assert Exact().sampled(bare) == ("light 1 is sampled: the Blinn lobe has no closed form over a quad light",)
    image = render(made, Exact(samples=64), seed=3, passes=2)
    assert set(image.routes) == {"sampled"}
    assert image.mean.mean() == pytest.approx(plain.mean(), rel=0.02)
    with pytest.raises(InputError, match="Blinn lobe"):
        render(made, Analytic())
    # Lights without extent need no integral.
    sharp = room(blinn, DirectionalLight((1.0, 2.0, -0.5), (0.5, 1.0, 2.0)))
    np.testing.assert_allclose(render(sharp, Exact()).mean, render(sharp, Area()).mean, rtol=1e-12, atol=1e-15)


def test_a_new_kind_is_written_and_read_and_known_by_its_absence(blinn):
    with_it, without = Material((0.5, 0.5, 0.5), further=(blinn,)), Material((0.5, 0.5, 0.5))
    made = scene(floor(material=with_it), floor(y=-1.0, material=without), lights=(lamp(),))
    assert parse_scene(write_scene(made)) == made
    plain = made.with_(meshes=made.meshes[1:])
    assert "blinn" not in write_scene(plain)
    assert made.digest() != plain.with_(meshes=(floor(material=without), *plain.meshes)).digest()
    assert "the Blinn lobe" in {entry.what for entry in prepare(plain).needs.left_out}
    assert {entry.what for entry in prepare(made).needs.left_out}.isdisjoint({"the Blinn lobe", "the glossy lobe"})


def test_the_bridge_takes_a_new_kind_for_no_other_until_it_has_a_surface(blinn, monkeypatch, tmp_path):
    made = scene(floor(material=Material((0.5, 0.5, 0.5), further=(blinn,))), lights=(lamp(),))
    with pytest.raises(InputError, match="lambert and blinn"):
        describe(made, tmp_path)

    def says(material, there):
        return {"albedo": list(there[Blinn].albedo), "power": there[Blinn].power} if Blinn in there else None

    monkeypatch.setattr(bridge, "SURFACES", (*bridge.SURFACES, bridge.Surface("blinn", "blinn", says)))
    description = describe(made, tmp_path)
    assert description.bsdfs == [{"kind": "blinn", "albedo": [0.25, 0.5, 0.125], "power": 12.0}]
    assert description.is_glossy
    assert '<float name="power" value="12.0"/>' in to_xml(description)


def test_materials_keep_one_lobe_of_a_kind_and_no_black_one(blinn):
    assert Material(further=(Blinn(),)) == Material()
    with pytest.raises(InputError, match="one of each kind"):
        Material(further=(blinn, replace(blinn, power=2.0)))
    with pytest.raises(InputError, match="other than Lambert"):
        Material(further=(Lambert((0.5, 0.5, 0.5)),))


def test_an_unknown_kind_is_taken_for_no_other():
    class Stranger:
        kind = "stranger"
        albedo = (0.5, 0.5, 0.5)

    class Silent(SampledLobe):
        """No function."""

    for kind in (Stranger, Silent):
        with pytest.raises(TypeError, match=r"lacks .*evaluate"):
            check_kind(kind)
    for lobe in (Stranger(), Blinn((0.5, 0.5, 0.5))):
        with pytest.raises(InputError, match=type(lobe).__name__):
            Material(further=(lobe,))
    with pytest.raises(InputError, match="blinn"):
        parse_scene("size 4 4\ncamera 0 0 1 0 0 0 0 1 0 45\nblinn .5 .5 .5\n")
    unlisted = Material()
    object.__setattr__(unlisted, "further", (Blinn((0.5, 0.5, 0.5)),))
    with pytest.raises(InputError, match="blinn"):
        bridge.surface(unlisted)
