"""Textures of Mitsuba files are what Mitsuba makes of them; half a texel, or v the other way round, is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import nusselt
from nusselt.mitsuba_bridge.own.nodes import read_nodes
from nusselt.mitsuba_bridge.own.read import scene_of
from nusselt.mitsuba_bridge.own.source import Source
from nusselt.renderer.errors import InputError

pytestmark = pytest.mark.mitsuba

SENSOR = """<sensor type="perspective"><float name="fov" value="50"/>
<transform name="to_world"><lookat origin="0.5,2,6" target="0,0.7,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="36"/></film></sensor>
<emitter type="point"><point name="position" x="1" y="3" z="3"/><rgb name="intensity" value="20,20,20"/></emitter>"""
WALL = (
    "v -1 0 0\nv 1 0 0\nv 1 2 0.4\nv -1 2 0\nvt 0 0\nvt 1.7 0\nvt 1.7 2.3\nvt -0.6 2.1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
)
BARE = "v -1 0 0\nv 1 0 0\nv 1 2 0.4\nf 1 2 3\n"
COLOUR = '<rgb name="color0" value="0.8,0.1,0.3"/>'


def surface(plugin, more="", to_uv=""):
    place = f'<transform name="to_uv">{to_uv}</transform>' * bool(to_uv)
    inner = f'<bsdf type="diffuse"><texture type="{plugin}" name="reflectance">{more}{place}</texture></bsdf>'
    return f'<bsdf type="twosided">{inner}</bsdf>'


def picture(file, **words):
    said = "".join(f'<string name="{name}" value="{value}"/>' for name, value in words.items())
    return f'<string name="filename" value="{file}"/>{said}'


def shape(kind, place, material, more=""):
    return f'<shape type="{kind}">{more}<transform name="to_world">{place}</transform>{material}</shape>'


def mesh(file, place, material):
    more = f'<string name="filename" value="{file}.obj"/><boolean name="face_normals" value="true"/>'
    return shape("obj", place, material, more)


def file(*shapes):
    return "\n".join(['<scene version="3.0.0">', *shapes, SENSOR, "</scene>"])


MOVED = '<scale x="2.5" y="3.5"/><rotate z="1" angle="20"/><translate x="0.1" y="0.3"/>'
RAW = '<boolean name="raw" value="true"/>'
EVERY = file(
    shape("rectangle", '<scale value="3"/><rotate x="1" angle="-90"/>', surface("checkerboard", COLOUR, MOVED)),
    mesh("wall", '<translate x="-1" z="-1"/>', surface("bitmap", picture("colour.png"))),
    mesh(
        "wall",
        '<translate x="1.4" z="-1"/>',
        surface("bitmap", picture("colour.png", filter_type="nearest", wrap_mode="mirror"), '<scale x="1.5"/>'),
    ),
    shape(
        "rectangle",
        '<scale value="0.7"/><rotate y="1" angle="40"/><translate x="-2.5" y="0.8" z="0.5"/>',
        surface("bitmap", picture("grey.png", wrap_mode="clamp") + RAW, '<scale value="1.6"/><translate y="-0.3"/>'),
    ),
)
FLAT = surface("bitmap", picture("colour.png"))
REFUSED = {
    "ball": (file(shape("sphere", "", FLAT)), "a sphere: rectangles and meshes"),
    "cube": (file(shape("cube", "", FLAT)), "a cube: rectangles and meshes"),
    "no uv": (file(mesh("bare", "", FLAT)), "a mesh with texture coordinates"),
    "vertices": (file(mesh("wall", "", surface("mesh_attribute", picture("a")))), "checkerboard or bitmap"),
    "half": (file(shape("rectangle", "", surface("bitmap", picture("grey.png", format="fp16")))), "variant or auto"),
    "no file": (file(shape("rectangle", "", surface("bitmap", picture("none.png")))), "none.png"),
    "glossy": (file(shape("rectangle", "", FLAT.replace("diffuse", "roughplastic"))), "--as-diffuse"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("textures")
    levels = np.random.default_rng(1).integers(20, 255, (5, 7, 3), dtype=np.uint8)
    Image.fromarray(levels).save(folder / "colour.png")
    Image.fromarray(levels[:4, :6, 0].copy()).save(folder / "grey.png")
    (folder / "wall.obj").write_text(WALL)
    (folder / "bare.obj").write_text(BARE)
    for name, text in {"every": EVERY, **{name: text for name, (text, _) in REFUSED.items()}}.items():
        (folder / f"{name}.xml").write_text(text)
    return folder


@pytest.fixture(scope="module")
def scene(folder):
    return nusselt.read_scene(folder / "every.xml")


def test_they_agree_with_mitsuba_to_a_thousandth(scene):
    answer = nusselt.check(scene, estimator="exact", margin=1e-3).answers[0]
    assert answer.row["verdict"] == "agrees", answer.row["reason"]
    off = np.abs(answer.ours.mean - answer.reference.mean).max(axis=0) / answer.reference.mean.mean()
    assert off[~answer.ours.unjudged].max() < 1e-4


def shifted(texture):
    """By half a texel."""
    (a, b, c), below = texture.to_uv
    return replace(texture, to_uv=((a, b, c + 0.5 / texture.texels.shape[2]), below))


@pytest.mark.parametrize("plant", [shifted, lambda texture: replace(texture, texels=texture.texels[:, ::-1])])
def test_a_planted_mistake_in_one_of_them_is_found(scene, plant):
    wall = scene.meshes[1]
    wrong = replace(wall, material=replace(wall.material, texture=plant(wall.material.texture)))
    planted = scene.with_(meshes=(scene.meshes[0], wrong, *scene.meshes[2:]))
    image = nusselt.render(planted, estimator="exact").array
    assert nusselt.check(scene, images=[image], estimator="exact", margin=1e-3).verdict == "differs"


def made(root, source):
    if isinstance(root, InputError):
        raise root
    return scene_of(root, source, as_diffuse=False)


def test_what_has_no_texture_of_ours_is_refused_by_name_and_line(folder):
    paths = [folder / f"{name}.xml" for name in REFUSED]
    sources = [Source.of_file(path) for path in paths]
    for (_, words), path, source, root in zip(REFUSED.values(), paths, sources, read_nodes(*sources), strict=True):
        with pytest.raises(InputError, match=words) as told:
            made(root, source)
        assert str(told.value).startswith(str(path)), path
