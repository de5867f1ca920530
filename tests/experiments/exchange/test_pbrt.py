"""pbrt-v4: what is read means what its sources say, the rest is refused by line; what is written is read again."""

import math

import numpy as np
import pytest
from builders import box, floor, scene, sphere_mesh
from click.testing import CliRunner
from test_lights import EXAMPLES
from test_usd import BALLS

from nusselt.experiments.cli.export import command
from nusselt.experiments.exchange.pbrt import pbrt_text, read_pbrt
from nusselt.experiments.scenes.catalogue import load
from nusselt.mitsuba_bridge.ply import write_ply
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.lights import LIGHTS, CosineLight, MeshLight, QuadLight, SpotLight, SunLight
from nusselt.renderer.surfaces import Ellipsoid, Material

NONE = (SpotLight, CosineLight, SunLight)
"""Kinds that pbrt has no equal of."""


def room(light, **options):
    block = box((-0.5, 0, -0.5), (0, 0.5, 0))
    bodies = tuple(Ellipsoid(b.center, b.axes, Material(b.material.diffuse)) for b in BALLS)
    return scene(floor(), block, ellipsoids=bodies, lights=(light,), two_sided=True, **options)


@pytest.mark.parametrize("kind", [kind for kind in LIGHTS if kind not in NONE], ids=lambda kind: kind.kind)
@pytest.mark.parametrize("size", [(20, 15), (15, 20)], ids=["wide", "high"])
def test_what_is_written_is_read_again(kind, size, tmp_path):
    made = room(EXAMPLES[kind], size=size)
    (tmp_path / "scene.pbrt").write_text(pbrt_text(made))
    again = load(str(tmp_path / "scene.pbrt"))
    assert (type(again.lights[0]), again.two_sided) == (kind, True)
    assert all("pbrt multiplies spectra" in note for note in again.warnings)  # of BALLS, one of which is coloured
    first, second = (render(each, Area(samples=16, stratified=True), seed=3).mean for each in (made, again))
    np.testing.assert_allclose(second, first, rtol=1e-9, atol=1e-12)


def test_what_pbrt_has_no_equal_of_is_not_written():
    for kind in NONE:
        with pytest.raises(InputError, match=f"a {kind.kind}"):
            pbrt_text(room(EXAMPLES[kind]))
    for material, words in (
        (Material((0.1,) * 3, (0.2,) * 3, 5.0), "glossy"),
        (Material(emission=(1.0, 0, 0)), "would light"),
        (Material((1.5,) * 3), "at most 1"),
    ):
        with pytest.raises(InputError, match=words):
            pbrt_text(scene(floor(material=material)))


@pytest.mark.parametrize("ending", ["pbrt", "usda", "obj"])
def test_the_command_writes_by_the_ending(ending, tmp_path):
    target = tmp_path / f"quad.{ending}"
    result = CliRunner().invoke(command, ["quad", "-o", str(target)])
    if ending == "obj":
        assert isinstance(result.exception, InputError)
        assert ".xml, .pbrt, .usda" in str(result.exception)
        return
    assert result.exit_code == 0, result.output
    assert "not in the file" in result.stderr
    assert target.read_text().startswith("Film" if ending == "pbrt" else "#usda")


HEAD = 'Film "rgb" "integer xresolution" 40 "integer yresolution" 30\nLookAt 0 0 5  0 0 0  0 1 0\n'
CAMERA = 'Camera "perspective" "float fov" [40]\n'
TRI = 'Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0]\n'


def read(tmp_path, body, head=HEAD + CAMERA + "WorldBegin\n", **options):
    (tmp_path / "a.pbrt").write_text(head + body)
    return read_pbrt(tmp_path / "a.pbrt", **options)


def test_the_camera_is_left_handed_and_its_angle_that_of_the_shorter_side(tmp_path):
    """Without a mirror, +x is on the right of a camera that looks along +z: our world is mirrored, and said."""
    sun = 'LightSource "distant" "rgb L" [1 2 3] "point3 from" [1 2 0]\n'
    plain = read(tmp_path, sun + TRI)
    mirrored = read(tmp_path, sun + TRI, "Scale -1 1 1\n" + HEAD + CAMERA + "WorldBegin\n")
    assert "left-handed" in plain.warnings[-1]
    assert mirrored.warnings == ()
    assert plain.meshes[0].vertices[0].min() == -1
    assert mirrored.meshes[0].vertices[0].max() == 1
    assert (plain.lights[0].direction[0] < 0, mirrored.lights[0].direction[0] > 0) == (True, True)
    for made in (plain, mirrored):
        assert made.camera.position == pytest.approx((0, 0, 5))
        assert made.camera.target == pytest.approx((0, 0, 4))
        assert made.camera.fov_y == pytest.approx(40)
    high = read(tmp_path, TRI, HEAD.replace("40", "15") + CAMERA + "WorldBegin\n")
    assert math.tan(math.radians(high.camera.fov_y) / 2) == pytest.approx(2 * math.tan(math.radians(20)))


AREA = 'AttributeBegin\nAreaLightSource "diffuse" "rgb L" [1 2 4] "float scale" 2{}\n{}{}AttributeEnd\n'


def lamp(tmp_path, shape, before="", more=""):
    (light,) = read(
        tmp_path, AREA.format(more, before, shape), "Scale -1 1 1\n" + HEAD + CAMERA + "WorldBegin\n"
    ).lights
    return light


def test_area_lights_shine_where_pbrts_fronts_are(tmp_path):
    """(p1 - p0) x (p2 - p0) before the transform; a mirror keeps what is outside there, ReverseOrientation turns it."""
    patch = 'Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 0]\n'
    disk = 'Shape "disk" "float radius" 2 "float height" 1\n'
    for shape, kind in ((TRI, "triangle"), (patch, "quad"), (disk, "disk")):
        for before, front in (("", 1), ("ReverseOrientation\n", -1), ("Scale 1 -1 1\n", 1)):
            if kind == "disk" and "Scale" in before:
                continue
            light = lamp(tmp_path, shape, before)
            assert (light.kind, light.radiance) == (kind, (2, 4, 8))
            assert light.normal == pytest.approx((0, 0, front)), (kind, before)
    assert lamp(tmp_path, disk).center == pytest.approx((0, 0, 1))
    ball = lamp(tmp_path, 'Shape "sphere" "float radius" 0.5\n', "Translate 1 2 3\nScale 2 2 2\n")
    assert (ball.center, ball.radius) == ((1, 2, 3), pytest.approx(1.0))
    power = lamp(tmp_path, patch, "", ' "float power" 10')
    assert power.radiance == pytest.approx(np.array([2, 4, 8]) * 10 / math.pi)
    two = 'Shape "trianglemesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 0] "integer indices" [0 1 2  1 3 2]\n'
    with pytest.raises(InputError, match="power on several triangles"):
        lamp(tmp_path, two, "", ' "float power" 10')


def test_meshes_from_files_instances_and_included_files(tmp_path):
    ball = sphere_mesh(4, 0.5)
    write_ply(tmp_path / "ball.ply", ball.vertices, ball.triangles)
    (tmp_path / "more.pbrt").write_text('ObjectBegin "b"\nShape "plymesh" "string filename" "ball.ply"\nObjectEnd\n')
    body = 'Include "more.pbrt"\nTranslate 3 0 0 ObjectInstance "b" Translate 1 0 0 ObjectInstance "b"\n' + AREA.format(
        "", "", 'Shape "plymesh" "string filename" "ball.ply"\n'
    )
    made = read(tmp_path, body, "Scale -1 1 1\n" + HEAD + CAMERA + "WorldBegin\n")
    assert [mesh.vertices[0].mean() for mesh in made.meshes] == pytest.approx([3, 4], abs=1e-6)
    assert made.meshes[0].material.diffuse == (0.5, 0.5, 0.5)
    assert isinstance(made.lights[0], MeshLight)


def test_light_sources(tmp_path):
    made = read(
        tmp_path,
        'LightSource "point" "rgb I" [1 1 1] "float power" 10 "float scale" 2 "point3 from" [1 2 3]\n'
        'LightSource "infinite" "rgb L" [1 2 3] "float illuminance" 2\n'
        'LightSource "distant" "float scale" 3\n',
    )
    point, sky, distant = made.lights
    assert point.intensity == pytest.approx((5 / math.pi,) * 3)
    assert point.position == (-1, 2, 3)
    assert sky.radiance == pytest.approx(np.array([1, 2, 3]) * 2 / math.pi)
    assert (distant.irradiance, distant.direction) == ((3, 3, 3), (0, 0, -1))


def test_attributes_named_materials_and_comments(tmp_path):
    body = (
        'MakeNamedMaterial "red" "string type" "diffuse" "rgb reflectance" [0.5 0.25 0.125] # [ "\n'
        f'AttributeBegin NamedMaterial "red" {TRI} AttributeEnd {TRI}'
    )
    made = read(tmp_path, body)
    assert [mesh.material.diffuse for mesh in made.meshes] == [(0.5, 0.25, 0.125), (0.5, 0.5, 0.5)]
    (tmp_path / "moves.pbrt").write_text("Translate 1 0 0\n")
    for word, right in (("Include", -1), ("Import", 0)):
        assert read(tmp_path, f'{word} "moves.pbrt"\n{TRI}').meshes[0].vertices[0].max() == right
    both = read(tmp_path, body + 'LightSource "point" "rgb I" [1 2 3]\n')
    assert any("pbrt multiplies spectra" in note for note in both.warnings)
    metal = read(tmp_path, 'Material "conductor"\n' + TRI, as_diffuse=True)
    assert "conductor is taken for diffuse" in metal.warnings[0]


SPECTRUM = 'LightSource "point" "blackbody I" [6500]\n'
SMOOTH = TRI.replace('"\n', '"\n').rstrip() + ' "normal N" [0 0 1  0 0 1  1 0 1]\n'
BENT = 'Shape "bilinearmesh" "point3 P" [0 0 0  1 0 0  0 1 0  1 1 1]\n'
REFUSED = {
    "spectra": (SPECTRUM, "blackbody", 5),
    "spot": ('LightSource "spot"\n', "smooth step", 5),
    "texture": ('Texture "a" "spectrum" "imagemap"\n', "Texture", 5),
    "material": (TRI + 'Material "conductor"\n', "--as-diffuse", 6),
    "shape": ('Shape "cylinder"\n', "trianglemesh", 5),
    "disk": ('Shape "disk"\n', "AreaLightSource before it", 5),
    "partial": ('Shape "sphere"\n "float phimax" 90\n', "phimax", 6),
    "bent": (BENT, "flat patches", 5),
    "smooth": (SMOOTH, "shading normals", 5),
    "alpha": (TRI.rstrip() + ' "float alpha" 0.5\n', "alpha", 5),
    "indices": (TRI.rstrip() + ' "integer indices" [0 1 3]\n', "indices of the 3 points", 5),
    "flat": ("Scale 1 1 0\n" + TRI, "not flat", 5),
    "twosided": (AREA.format(' "bool twosided" true', "", TRI), "one side", 6),
    "stretched": (AREA.format("", "Scale 1 2 1\n", 'Shape "sphere"\n'), "stretches", 8),
    "outside": ('Include "../a.pbrt"\n', "without ..", 5),
    "itself": ('Include "a.pbrt"\n', "WorldBegin|16 deep", 0),
    "unclosed": ("AttributeBegin\n", "AttributeBegin = never ended", 5),
    "gone": ('Include "gone.pbrt"\n', "Include = gone.pbrt, missing", 5),
    "twice": ('LightSource "point" "rgb I" [1 1 1] "rgb I" [2 2 2]\n', "I = a second time", 5),
    "white": ('Material "diffuse" "rgb reflectance" [2 0 0]\n', "at most 1", 5),
    "string": ('Shape "sphere\n', "a string that ends", 5),
    "list": ('Shape "sphere" "float radius" [1\n', "a list that ends", 5),
    "number": ("Translate 1 2 0x3\n", "3 numbers", 5),
    "infinity": ("Translate 1 2 1e999\n", "finite decimal", 5),
    "camera in the world": (CAMERA, "Camera = after WorldBegin", 5),
    "film in the world": (HEAD, "Film = after WorldBegin", 5),
    "world in the world": ("WorldBegin\n", "WorldBegin = after WorldBegin", 5),
    "medium": ('MediumInterface "a" ""\n', "MediumInterface", 5),
}


@pytest.mark.parametrize("name", REFUSED)
def test_others_are_refused_by_line(tmp_path, name):
    text, words, line = REFUSED[name]
    with pytest.raises(InputError, match=words) as told:
        read(tmp_path, text)
    assert str(told.value).startswith(f"{tmp_path}/a.pbrt:{line}: " if line else f"{tmp_path}/a.pbrt")


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (HEAD + "WorldBegin\n", "Camera = missing"),
        (HEAD + CAMERA, "Shape = before WorldBegin"),
        (HEAD.replace("40", "40.5") + CAMERA + "WorldBegin\n", "xresolution 40.5: expected a whole number"),
        (HEAD.replace("integer x", "float x") + CAMERA + "WorldBegin\n", "integer xresolution"),
        (HEAD + CAMERA.replace("perspective", "realistic") + "WorldBegin\n", "perspective"),
        (HEAD.replace("rgb", "spectral") + CAMERA + "WorldBegin\n", "spectral"),
        (HEAD.replace("30\n", '30 "float iso" 50\n') + CAMERA + "WorldBegin\n", "iso 50"),
        (HEAD + 'ColorSpace "aces2065-1"\n' + CAMERA + "WorldBegin\n", "srgb"),
        (HEAD + CAMERA.rstrip() + ' "float screenwindow" [-1 1 -1 1]\nWorldBegin\n', "another shape"),
        (HEAD + CAMERA.rstrip() + ' "float screenwindow" [-1 2 -1 1]\nWorldBegin\n', "off the middle"),
    ],
)
def test_cameras_and_films_of_other_kinds_are_refused(tmp_path, head, words):
    with pytest.raises(InputError, match=words):
        read(tmp_path, TRI, head)


def test_quads_keep_their_corner(tmp_path):
    made = room(EXAMPLES[QuadLight], size=(8, 6))
    (tmp_path / "a.pbrt").write_text(pbrt_text(made))
    np.testing.assert_allclose(read_pbrt(tmp_path / "a.pbrt").lights[0].corner, made.lights[0].corner)
