"""Mitsuba's own files as scenes: read right, or refused by name and line; the file itself is the reference."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nusselt.experiments.check.check import References, check
from nusselt.experiments.check.question import Question
from nusselt.experiments.scenes.catalogue import load
from nusselt.mitsuba_bridge.export import export_scene
from nusselt.mitsuba_bridge.limits import close_blockers
from nusselt.mitsuba_bridge.origin import content, own_file
from nusselt.mitsuba_bridge.own.nodes import read_nodes
from nusselt.mitsuba_bridge.own.read import scene_of
from nusselt.mitsuba_bridge.own.source import Source
from nusselt.mitsuba_bridge.reference import render_reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Exact
from nusselt.renderer.image import render
from nusselt.renderer.lights import DiskLight, QuadLight
from nusselt.renderer.scene import Origin

pytestmark = pytest.mark.mitsuba

FILM = '<film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="30"/>{more}</film>'
LOOK = '<lookat origin="0.5,2,6" target="0,0.5,0" up="0,1,0"/>'


def sensor(
    lens: str = '<float name="fov" value="40"/>', look: str = LOOK, kind: str = "perspective", more: str = "", film=FILM
):
    film = film.format(more=more)
    return f'<sensor type="{kind}">{lens}<transform name="to_world">{look}</transform>{film}</sensor>'


GREY = '<bsdf type="diffuse" id="grey"><rgb name="reflectance" value="0.5,0.4,0.3"/></bsdf>'
TWO = '<bsdf type="twosided" id="two"><bsdf type="diffuse"><spectrum name="reflectance" value="0.7"/></bsdf></bsdf>'
FLAT = '<rotate x="1" angle="-90"/>'
FLOOR = (
    f'<shape type="rectangle" id="floor"><transform name="to_world"><scale value="3"/>{FLAT}</transform>{{}}</shape>'
)
REF, REF_TWO = '<ref id="grey"/>', '<ref id="two"/>'
DOWN = '<rotate x="1" angle="90"/><translate y="2.5"/>'
GLOW = '<emitter type="area"><rgb name="radiance" value="9,8,7"/></emitter>'


def lamp(before: str = '<scale x="0.5" y="0.25"/>', kind: str = "rectangle", more: str = "", after: str = DOWN):
    return f'<shape type="{kind}" id="lamp">{more}<transform name="to_world">{before}{after}</transform>{GLOW}</shape>'


def cube(surface: str = REF, place: str = '<scale value="0.4"/><rotate y="1" angle="30"/><translate y="0.6"/>'):
    return f'<shape type="cube" id="block"><transform name="to_world">{place}</transform>{surface}</shape>'


def back(x: str, surface: str):
    place = f'<rotate y="1" angle="180"/><scale value="0.5"/><translate x="{x}" y="1"/>'
    return f'<shape type="rectangle"><transform name="to_world">{place}</transform>{surface}</shape>'


def ball(place: str):
    return f'<shape type="sphere"><transform name="to_world">{place}</transform>{REF}</shape>'


def fov(axis: str):
    return f'<float name="fov" value="40"/><string name="fov_axis" value="{axis}"/>'


def instance(place: str):
    return f'<shape type="instance"><transform name="to_world">{place}</transform><ref id="pair"/></shape>'


def file(*parts: str, version: str = "3.0.0") -> str:
    return "\n".join([f'<scene version="{version}">', *parts, "</scene>"])


PLAIN = (GREY, TWO, FLOOR.format(REF))
GROUP = (
    '<shape type="shapegroup" id="pair"><shape type="cube"><transform name="to_world"><scale value="0.2"/></transform>'
    f'{REF}</shape><shape type="sphere"><float name="radius" value="0.3"/><point name="center" x="0" y="0.5" z="0"/>'
    f"{REF}</shape></shape>"
)
SMOOTH_OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nvn 0 0 1\nvn 0 1 1\nf 1//1 2//2 3//1\nf 1//1 3//2 4//1\n"
OBJ = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"
BENT = OBJ + "v 1 1 0\nv 0 1 0\nv 0 1 1\nv 1 1 1\nf 6 5 8\nf 6 8 7\n"
MESH = f'<shape type="obj"><string name="filename" value="leaf.obj"/>{REF_TWO}</shape>'
FACETED = MESH.replace("leaf", "smooth").replace("/><ref", '/><boolean name="face_normals" value="true"/><ref')
AWAY = '<translate x="1e6"/>'
FAR = FLOOR.replace("</transform>", f"{AWAY}</transform>").format(REF)
SUN = (
    '<emitter type="directional"><transform name="to_world"><lookat origin="0,0,0" target="1,-2,0" up="0,0,1"/>'
    '</transform><rgb name="irradiance" value="1,1,1"/></emitter>'
)
LEAF = '<string name="filename" value="leaf.obj"/>'
SPOT = (
    '<emitter type="spot"><transform name="to_world"><lookat origin="1,3,1" target="0,0.5,0" up="0,1,0"/></transform>'
    '<float name="cutoff_angle" value="25"/><rgb name="intensity" value="9,9,9"/></emitter>'
)
OLD = (
    '<sensor type="perspective"><float name="fov" value="40"/><transform name="toWorld"><lookat origin="0,2,6" '
    'target="0,0,0" up="0,1,0"/></transform><film type="hdrfilm"><integer name="width" value="40"/>'
    '<integer name="height" value="30"/></film></sensor>'
)
POINT = (
    '<emitter type="point"><point name="position" x="1" y="3" z="1"/><rgb name="intensity" value="1,2,3"/></emitter>'
)
UNSAMPLED = POINT.replace("<point", '<float name="sampling_weight" value="0"/><point')
PATH = '<integrator type="path"><integer name="max_depth" value="5"/></integrator>'
SKY = '<emitter type="envmap"><string name="filename" value="a.exr"/></emitter>'

READ = {
    "plain": file(sensor(), *PLAIN, lamp()),
    "y": file(sensor(fov("y")), *PLAIN, lamp()),
    "diagonal": file(
        sensor('<float name="fov" value="40"/><string name="fov_axis" value="diagonal"/>'), *PLAIN, lamp()
    ),
    "smaller": file(sensor(fov("smaller")), *PLAIN, lamp()),
    "larger": file(sensor(fov("larger")), *PLAIN, lamp()),
    "focal": file(sensor('<string name="focal_length" value="35mm"/>'), *PLAIN, lamp()),
    "old": file(OLD, GREY, FLOOR.replace("to_world", "toWorld").format(REF), POINT, version="0.5.0"),
    "default": file('<default name="w" value="0.5"/>', sensor(), *PLAIN, lamp('<scale x="$w" y="0.25"/>')),
    "cube": file(sensor(), *PLAIN, cube(), lamp()),
    "mesh": file(sensor(), *PLAIN, MESH, lamp()),
    "faceted": file(sensor(), *PLAIN, FACETED, lamp()),
    "instance": file(
        sensor(),
        *PLAIN,
        GROUP,
        instance('<translate x="-1" y="0.3"/>'),
        instance('<scale value="2"/><translate x="1" y="0.5"/>'),
        lamp(),
    ),
    "two-sided": file(sensor(), TWO, FLOOR.format(REF_TWO), cube(REF_TWO), lamp()),
    "mixed": file(sensor(), *PLAIN, MESH, cube(), lamp()),
    "disk": file(sensor(), *PLAIN, lamp('<scale value="0.4"/>', "disk")),
    "sheared": file(sensor(), *PLAIN, lamp('<matrix value="0.5 0.3 0 0  0 0.4 0 0  0 0 1 0  0 0 0 1"/>')),
    "mirrored": file(sensor(), *PLAIN, lamp('<scale x="-0.5" y="0.25"/>')),
    "turned": file(sensor(), *PLAIN, lamp('<scale x="0.5" y="0.25" z="-1"/>')),
    "flipped": file(sensor(), *PLAIN, lamp(more='<boolean name="flip_normals" value="true"/>')),
    "delta": file(
        sensor(),
        *PLAIN,
        POINT,
        SUN,
    ),
    "ball": file(sensor(), *PLAIN, cube(), lamp('<scale value="0.3"/>', "sphere")),
    "spot": file(sensor(), *PLAIN, cube(), SPOT),
    "sky": file(sensor(), *PLAIN, cube(), '<emitter type="constant"><rgb name="radiance" value=".4,.5,.6"/></emitter>'),
    "leaf lamp": file(sensor(), *PLAIN, cube(), lamp(kind="obj", more=LEAF)),
    "triangle lamp": file(sensor(), *PLAIN, cube(), lamp(kind="obj", more=LEAF.replace("leaf", "one"))),
    "cube lamp": file(sensor(), *PLAIN, cube(), lamp('<scale x="-0.3" y="0.2" z="0.3"/>', "cube")),
    "bent lamp": file(sensor(), *PLAIN, cube(), lamp(kind="obj", more=LEAF.replace("leaf", "bent"))),
    "path": file(
        '<integrator type="path"><integer name="max_depth" value="5"/></integrator>', sensor(), *PLAIN, lamp()
    ),
}
REFUSED = {
    "cylinder": (file(sensor(), *PLAIN, f'<shape type="cylinder">{REF}</shape>'), "--as-mesh", 6),
    "environment": (
        file(sensor(), '<emitter type="envmap"><string name="filename" value="a.exr"/></emitter>'),
        "envmap",
        3,
    ),
    "metal": (file(sensor(), '<shape type="cube"><bsdf type="roughconductor"/></shape>'), "--as-diffuse", 3),
    "orthographic": (file(sensor("", kind="orthographic"), *PLAIN), "perspective", 2),
    "crop": (file(sensor(more='<integer name="crop_width" value="9"/>'), *PLAIN), "whole film", 2),
    "mirror": (file(sensor(look=f'<scale x="-1"/>{LOOK}'), *PLAIN), "mirrored", 2),
    "no sensor": (file(*PLAIN), "sensor", 1),
    "ellipse": (file(sensor(), *PLAIN, lamp('<scale x="0.4" y="0.2"/>', "disk")), "round", 6),
    "seen from behind": (file(sensor(), *PLAIN, back("-1", REF), back("1", REF_TWO), lamp()), "seen from behind", 0),
    "smooth": (file(sensor(), *PLAIN, MESH.replace("leaf", "smooth"), lamp()), "shading normals", 6),
    "ellipsoid": (file(sensor(), *PLAIN, ball('<scale x="1" y="0.5" z="1"/>')), "stretches", 6),
    "mirrored ball": (file(sensor(), *PLAIN, ball('<scale x="1" y="-1" z="1"/>')), "mirrors", 6),
    "inside out": (file(sensor(), *PLAIN, MESH.replace("leaf", "against"), lamp()), "shading normals", 6),
    "doubled sun": (file(sensor(), *PLAIN, SUN.replace("<lookat", '<scale value="2"/><lookat')), "scales", 6),
    "white light": (file(sensor(), *PLAIN, lamp().replace("rgb", "spectrum").replace("9,8,7", "1")), "rgb", 6),
    "no film": (file(sensor(film=FILM.replace("40", "0")), *PLAIN), "1 to 65536", 2),
    "luminance": (file(sensor(more='<string name="pixel_format" value="luminance"/>'), *PLAIN), "hdrfilm, rgb", 2),
    "never sampled": (
        file(sensor(), UNSAMPLED),
        "weight",
        3,
    ),
    "fog": (file(sensor(), *PLAIN, cube(REF + '<medium name="interior" type="homogeneous"/>')), "medium", 6),
    "far away": (file(sensor(), GREY, FAR, lamp(after=DOWN + AWAY)), "single precision", 0),
    "flat block": (file(sensor(), *PLAIN, cube(place='<scale x="0"/>')), "area", 6),
    "no XML": ("<scene version='3.0.0'><shape type='sphere'><foo/></shape></scene>", "foo", 1),
    "property": (file(sensor(), '<shape type="rectangle"><float name="bulge" value="2"/></shape>'), "bulge", 3),
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Every file, parsed by one process: what each says, or why it cannot be read."""
    folder = tmp_path_factory.mktemp("own")
    (folder / "leaf.obj").write_text(OBJ)
    (folder / "bent.obj").write_text(BENT)
    (folder / "one.obj").write_text(OBJ[: OBJ.rindex("f")])
    turned = (
        OBJ.replace("f ", "vn 0 0 -1\nf ", 1).replace("f 1 2 3", "f 1//1 2//1 3//1").replace("1 3 4", "1//1 3//1 4//1")
    )
    (folder / "against.obj").write_text(turned)
    (folder / "smooth.obj").write_text(SMOOTH_OBJ)
    texts = READ | {name: text for name, (text, _, _) in REFUSED.items()}
    paths = {name: folder / f"{name}.xml" for name in texts}
    for name, path in paths.items():
        path.write_text(texts[name])
    nodes = dict(zip(texts, read_nodes(*map(Source.of_file, paths.values())), strict=True))
    return {name: (node, paths[name]) for name, node in nodes.items()}


def made(files, name: str, as_diffuse: bool = False):
    node, path = files[name]
    if isinstance(node, InputError):
        raise node
    return scene_of(node, Source.of_file(path), as_diffuse)


@pytest.mark.parametrize("name", READ)
def test_files_of_every_kind_are_read(files, name):
    scene = made(files, name)
    assert (scene.width, scene.height) == (40, 30)
    assert scene.lights
    assert scene.meshes
    assert own_file(scene)["file"] == str(files[name][1])
    assert own_file(scene.with_(two_sided=not scene.two_sided)) is None


@pytest.mark.parametrize("name", REFUSED)
def test_others_are_refused_by_name_and_line(files, name):
    _, words, line = REFUSED[name]
    with pytest.raises(InputError, match=words) as told:
        made(files, name)
    assert str(told.value).startswith(f"{files[name][1]}:{line}: " if line else str(files[name][1]))


def test_surfaces_of_other_kinds_are_diffuse_where_that_is_asked_for(files):
    node, path = files["metal"]
    scene = scene_of(node, Source.of_file(path), as_diffuse=True)
    assert scene.meshes[0].material.diffuse == (0.5, 0.5, 0.5)
    assert "taken for diffuse" in scene.warnings[0]
    assert own_file(scene) is None  # which has a metal


PIPES = file(
    sensor(),
    *PLAIN,
    '<shape type="cylinder" id="pipe"><point name="p0" x="-1" y="0" z="0"/><point name="p1" x="-0.6" y="2" z="0.3"/>'
    f'<float name="radius" value="0.9"/><transform name="to_world"><scale value="0.8"/>{AWAY.replace("1e6", "0.4")}'
    f"</transform>{REF}</shape>",
    '<shape type="cylinder"><point name="p0" x="1" y="0.5" z="0"/><point name="p1" x="2" y="0.5" z="0.5"/>'
    f'<float name="radius" value="0.5"/><boolean name="flip_normals" value="true"/>{REF}</shape>',
    POINT,
)


def test_cylinders_are_meshes_where_that_is_asked_for_and_as_far_off_as_is_said(tmp_path):
    """Against Mitsuba's own cylinder, with either side out; judged is the mesh, on both sides."""
    (tmp_path / "pipes.xml").write_text(PIPES)
    source = Source.of_file(tmp_path / "pipes.xml")
    (root,) = read_nodes(source)
    scene = scene_of(root, source, as_mesh=True)
    assert own_file(scene) is None
    assert "'pipe' is a mesh of 1024 facets, up to 2.4e-06 of its radius off" in scene.warnings[0]
    (lamp,) = root.of_kind("Emitter")
    itself = scene.with_(origin=Origin(source.file, (lamp.index,), content(scene)))
    true = render_reference(itself, seed=0, target_relative_se=0.1, max_samples=4, timeout=60, passes=2).mean
    off = np.abs(render(scene, Exact()).mean - true).max(axis=0) / true.mean()
    assert np.quantile(off, 0.99) < 0.01  # a tilt of 0.18 degrees; the rest are silhouettes
    assert off.mean() < 2e-3
    assert off.max() > 1e-4  # it is no cylinder


def test_the_field_of_view_is_along_the_axis_that_is_said(files):
    half = math.tan(math.radians(20))
    tangents = {"plain": 0.75 * half, "y": half, "diagonal": 0.6 * half, "smaller": half, "larger": 0.75 * half}
    tangents["focal"] = 0.6 * math.hypot(36, 24) / 2 / 35
    for name, tangent in tangents.items():
        assert math.tan(math.radians(made(files, name).camera.fov_y) / 2) == pytest.approx(tangent, rel=1e-12), name


def test_lights_are_where_they_are_and_face_where_they_do(files):
    down = {"plain": True, "default": True, "sheared": True, "mirrored": True, "turned": False, "flipped": False}
    for name, faces_down in down.items():
        light = made(files, name).lights[0]
        assert isinstance(light, QuadLight)
        assert light.normal[1] == pytest.approx(-1 if faces_down else 1), name
        assert light.area == pytest.approx(0.8 if name == "sheared" else 0.5), name
        assert light.radiance == (9, 8, 7)
    ball, spot = made(files, "ball").lights[0], made(files, "spot").lights[0]
    assert (ball.center, ball.radius) == (pytest.approx((0, 2.5, 0)), pytest.approx(0.3))
    assert (spot.cutoff, spot.begin) == (25, 18.75)
    assert made(files, "sky").lights[0].radiance == (0.4, 0.5, 0.6)
    leaf, one = made(files, "leaf lamp").lights[0], made(files, "triangle lamp").lights[0]
    assert (leaf.area, one.area) == (pytest.approx(0.125), pytest.approx(0.0625))
    assert leaf.normal[1] == pytest.approx(-1)
    assert one.normal[1] == pytest.approx(-1)
    cube_lamp, bent = made(files, "cube lamp").lights[0], made(files, "bent lamp").lights[0]
    assert (cube_lamp.area, bent.area) == (pytest.approx(8 * (2 * 0.06 + 0.09)), pytest.approx(0.625))
    assert (cube_lamp.hides_itself, bent.hides_itself) == (False, True)  # mirrored, it shines outwards still
    disk = made(files, "disk").lights[0]
    assert isinstance(disk, DiskLight)
    assert disk.radius == pytest.approx(0.4)
    point, directional = made(files, "delta").lights
    assert (point.position, point.intensity) == ((1, 3, 1), (1, 2, 3))
    assert directional.direction == pytest.approx(np.array((-1, 2, 0)) / math.sqrt(5))


def test_what_is_not_judged_is_said(files):
    assert any("direct light alone" in warning for warning in made(files, "path").warnings)
    assert made(files, "plain").warnings == ()


@pytest.mark.parametrize("name", ["instance", "sheared", "delta", "turned", "sky"])
def test_the_file_itself_is_the_reference_and_agrees(files, name):
    """One lamp shines up: where nothing is lit, nothing is judged."""
    scene = made(files, name)
    answer = check(scene, Question(estimator="exact", margin=0.02), command="", references=References())
    assert any("the file itself" in note for note in answer.reference.notes)
    assert answer.row["verdict"] == ("undecided" if name == "turned" else "agrees"), answer.row["reason"]
    if name == "instance":
        brighter = scene.with_(lights=tuple(light.with_colour((10, 9, 8)) for light in scene.lights))
        ours = render(brighter, Exact())
        assert abs(ours.mean.mean() / answer.reference.mean.mean() - 1) > 0.05


def test_lamps_that_are_meshes_agree_and_what_hides_itself_is_said(files):
    """Mitsuba 3.9 looks past what is right before a light: along a hollow edge it is brighter, here by 0.26 %."""
    question = Question(estimator="area", samples=64, stratified=True, margin=0.02)
    answer = check(made(files, "bent lamp"), question, command="", references=References())
    assert answer.row["verdict"] == "agrees", answer.row["reason"]
    assert "light 1 may hide parts of itself" in answer.reference.limits[0]
    assert not close_blockers(made(files, "cube lamp"), np.zeros((3, 1)), 1.0)


@pytest.mark.parametrize("name", ["cornell-boxes", "glossy"])
def test_what_is_written_is_read_again(name, tmp_path):
    """In Mitsuba's units: lengths scaled and moved, meshes in single precision; the image is the same."""
    scene = load(name).with_(width=24, height=18)
    export_scene(scene, tmp_path / "scene.xml")
    again = load(str(tmp_path / "scene.xml"))
    assert len(again.lights) == len(scene.lights)
    first, second = render(scene, Exact(samples=64)).mean, render(again, Exact(samples=64)).mean
    off = np.abs(first - second).max(axis=0) > 1e-3 * first.max()
    assert off.mean() < 0.01  # single pixels at edges


def test_what_mitsuba_parses_and_does_not_build_is_refused(tmp_path):
    (tmp_path / "bright.xml").write_text(file(sensor(), FLOOR.format(GREY.replace("0.5,", "1.5,")), lamp()))
    with pytest.raises(InputError, match="what Mitsuba loads"):
        load(str(tmp_path / "bright.xml"))


def test_a_camera_that_cuts_off_is_said_and_cuts_nothing(tmp_path):
    lens = '<float name="fov" value="40"/><float name="near_clip" value="5.5"/>'
    (tmp_path / "near.xml").write_text(file(sensor(lens), *PLAIN, cube(), lamp()))
    scene = load(str(tmp_path / "near.xml"))
    assert any("near_clip" in warning for warning in scene.warnings)
    answer = check(scene, Question(estimator="exact", margin=0.02), command="", references=References())
    assert answer.row["verdict"] == "agrees", answer.row["reason"]


def test_a_scene_of_lights_alone_is_read(tmp_path):
    (tmp_path / "empty.xml").write_text(file(sensor(), POINT))
    assert load(str(tmp_path / "empty.xml")).meshes == ()
