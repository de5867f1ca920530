"""The scene text format: whatever is wrong is one error that names file, line, argument, value and cure."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import parse_scene, read_scene, write_scene
from nusselt.renderer.scene_text import reader as scene_reader
from nusselt.renderer.scene_text.commands import COMMANDS, REFUSED

VIEW = "size 4 3\ncamera 0 0 4  0 0 0  0 1 0  45\nintegrator direct\n"
BASE = VIEW + "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
NEXT = BASE.count("\n") + 1


def parse(extra: str, **options: bool) -> Scene:
    return parse_scene(BASE + extra, where="a.test", **options)


def told(text: str, **options: bool) -> str:
    with pytest.raises(InputError) as caught:
        parse_scene(text, where="a.test", **options)
    return str(caught.value)


FINITE = "a finite decimal number"
REFUSALS = [
    ("vertex 0 nan 0", "vertex y = nan", FINITE),
    ("vertex 0 0 inf", "vertex z = inf", FINITE),
    ("vertex -Infinity 0 0", "vertex x = -Infinity", FINITE),
    ("vertex 1e999 0 0", "vertex x = 1e999", FINITE),
    ("vertex 1_000 0 0", "vertex x = 1_000", FINITE),
    ("vertex 0x10 0 0", "vertex x = 0x10", FINITE),
    ("vertex 1,5 0 0", "vertex x = 1,5", FINITE),
    ("vertex ++1 0 0", "vertex x = ++1", FINITE),
    ("vertex . 0 0", "vertex x = .", FINITE),
    ("vertex 1e 0 0", "vertex x = 1e", FINITE),
    ("vertex ٣ 0 0", r"vertex x = \u0663", FINITE),
    ("vertex 0 0", "vertex z = missing", "3 arguments: x y z"),
    ("vertex 0 0 0 0", "vertex spare argument = 0", "3 arguments: x y z"),
    ("vertex 0 0 0 // why", "comment = //", "# before a comment (--lenient takes // too)"),
    ("//vertex 0 0 0", "comment = //vertex", "# before a comment"),
    ("diffuse .5 .5 .5#why", "diffuse b = .5#why", FINITE),
    ("tri 0 1", "tri k = missing", "3 arguments: i j k"),
    ("tri 0 1 2 3", "tri spare argument = 3", "3 arguments: i j k"),
    ("tri 0 1 3", "tri k = 3", "an index of the 3 vertices so far, from 0"),
    ("tri -1 1 2", "tri i = -1", "an index of the 3 vertices so far, from 0"),
    ("tri 0 1 1.5", "tri k = 1.5", "a whole number of at most 18 digits"),
    ("tri 0 1 1234567890123456789", "tri k = 1234567890123456789", "a whole number of at most 18 digits"),
    ("tri 0 1 1", "tri = 0 1 1", "three corners that span an area"),
    ("scale 0 1 1\ntri 0 1 2", "tri = 0 1 2", "three corners that span an area"),
    ("vertex 0 0 1e308\nscale 9 9 9\ntri 0 1 3", "tri = 0 1 3", "corners finite in world space"),
    ("vertex -1e308 0 1e308\nvertex 1e308 0 0\ntri 3 4 0", "tri = 3 4 0", "three corners that span an area"),
    ("sphere 0 0 0 0", "sphere radius = 0.0", "a radius above 0"),
    ("sphere 0 0 0 -1", "sphere radius = -1.0", "a radius above 0"),
    ("scale 1 1 0\nsphere 0 0 0 1", "sphere axes = ((1.0", "three independent semi-axes"),
    ("diffuse .5 -.1 .5", "diffuse = (0.5, -0.1, 0.5)", "three numbers, none negative"),
    ("specular -1 0 0", "specular = (-1.0, 0.0, 0.0)", "three numbers, none negative"),
    ("emission 0 0 -1", "emission = (0.0, 0.0, -1.0)", "three numbers, none negative"),
    ("shininess -1", "shininess = -1.0", "an exponent of at least 0"),
    ("shininess", "shininess exponent = missing", "1 arguments: exponent"),
    ("quadLight 0 0 0 1 0 0 0 1 0 1 1", "quadLight radiance.b = missing", "12 arguments: corner.x"),
    ("quadLight 0 0 0 1 0 0 0 1 0 1 1 -1", "quadLight radiance = (1.0, 1.0, -1.0)", "three numbers, none"),
    ("quadLight 0 0 0 0 0 0 0 1 0 1 1 1", "quadLight ab = (0.0, 0.0, 0.0)", "an edge that is not zero"),
    ("quadLight 0 0 0 1 2 3 -2 -4 -6 1 1 1", "quadLight ac = (-2.0, -4.0, -6.0)", "an edge not parallel"),
    ("quadLight 0 0 0 1e-200 0 0 0 1e-200 0 1 1 1", "quadLight area = 0.0", "an area above 0"),
    ("point 0 0 0 1 1 -1", "point intensity = (1.0, 1.0, -1.0)", "three numbers, none negative"),
    ("directional 0 0 0 1 1 1", "directional direction = (0.0, 0.0, 0.0)", "a vector that is not zero"),
    ("directional 0 1 0 1 -1 1", "directional irradiance = (1.0, -1.0, 1.0)", "three numbers, none"),
    ("sun 0 0 0 1 1 1 1", "sun direction = (0.0, 0.0, 0.0)", "a vector that is not zero"),
    ("sun 0 1 0 1 1 1 0", "sun angle = 0.0", "an angular diameter in (0, 180) degrees"),
    ("sun 0 1 0 1 1 1 180", "sun angle = 180.0", "an angular diameter in (0, 180) degrees"),
    ("sun 0 1 0 1 1 1 1e-170", "sun angle = 1e-170", "an angle wide enough"),
    ("sun 0 1 0 1 1 1", "sun degrees = missing", "7 arguments: direction.x"),
    ("camera 0 0 4 0 0 0 0 1 0 0", "camera fov = 0.0", "an angle in (0, 180) degrees"),
    ("camera 0 0 4 0 0 0 0 1 0 180", "camera fov = 180.0", "an angle in (0, 180) degrees"),
    ("camera 0 0 4 0 0 0 0 1 0 -45", "camera fov = -45.0", "an angle in (0, 180) degrees"),
    ("camera 1 2 3 1 2 3 0 1 0 45", "camera target = (1.0, 2.0, 3.0)", "a point other than"),
    ("camera 0 0 4 0 0 0 0 0 -2 45", "camera up = (0.0, 0.0, -2.0)", "a direction not parallel"),
    ("camera 0 0 4 0 0 0 0 0 0 45", "camera up = (0.0, 0.0, 0.0)", "a direction not parallel"),
    ("camera 0 0 4 0 0 0 0 1 0", "camera fov = missing", "10 arguments: from.x from.y"),
    ("size 0 3", "size width = 0", "a whole number from 1 to 65536"),
    ("size 4 -3", "size height = -3", "a whole number from 1 to 65536"),
    ("size 4 65537", "size height = 65537", "a whole number from 1 to 65536"),
    ("size 4.5 3", "size width = 4.5", "a whole number of at most 18 digits"),
    ("size 4", "size height = missing", "2 arguments: width height"),
    ("spp 0", "spp = 0", "a whole number from 1 to 16777216"),
    ("lightsamples 0", "lightsamples = 0", "a whole number from 1 to 16777216"),
    ("lightstratify yes", "lightstratify = yes", "on or off"),
    ("integrator volpath", "integrator = volpath", "analyticdirect or direct or raytracer or pathtracer"),
    ("maxverts 1e9", "maxverts count = 1e9", "a whole number of at most 18 digits"),
    ("attenuation 1 0", "attenuation quadratic = missing", "3 arguments: constant linear quadratic"),
    ("popTransform", "popTransform = an empty stack", "an earlier pushTransform that is still open"),
    ("pushTransform 1", "pushTransform spare argument = 1", "no argument"),
    ("rotate 0 0 0 45", "rotate axis = (0.0, 0.0, 0.0)", "a direction that is not zero"),
    ("scale 1e200 1 1\nscale 1e200 1 1", "scale = overflow", "a current transform that stays finite"),
    ("output a/", "output =", "a bare file name"),
    ("output a/..", "output = ..", "a bare file name"),
    ("output C:x.png", "output = C:x.png", "a bare file name"),
    ("output ..", "output = ..", "a bare file name"),
    ("output a\x1b[31m.png", r"output = a\x1b[31m.png", "a bare file name"),
    ("output a b.png", "output spare argument = b.png", "1 arguments: file"),
    ("output " + "a" * 256, "output = aaa", "a bare file name"),
    ("vertexnormal 0 0 0 0 0 1", "vertexnormal = 0 0 0 0 0 1", "flat faces: shading normals are not supp"),
    ("trinormal 0 1 2", "trinormal = 0 1 2", "flat faces: shading normals are not supported"),
    ("mesh knot.ply", "mesh = knot.ply", "a scene that is a file: a text has no folder to look in"),
    ("computeVertexNormals on", "computeVertexNormals = on", "flat faces: shading normals are not supported"),
    ("area 0 3 0 0 -1 0 1 5 5 5", "area = 0 3 0 0 -1 0", "quadLight, point, directional, sun, diskLight"),
    ("cylinder 0 0 0 1 2", "cylinder = 0 0 0 1 2", "sphere, tri or mesh: no other shape is supported"),
    ("background 1 1 1", "background = 1 1 1", "sky r g b: without one the background is black"),
    ("brdf ggx", "brdf = ggx", "phong, with its diffuse, specular and shininess: no other is supported"),
    ("roughness", "roughness alpha = missing", "1 arguments: alpha"),
    ("nexteventestimation yes", "nexteventestimation switch = yes", "on or off or mis"),
    ("russianroulette 1", "russianroulette switch = 1", "on or off"),
    ("importancesampling light", "importancesampling method = light", "hemisphere or cosine or brdf"),
    ("gamma two", "gamma exponent = two", FINITE),
    ("TRI 0 1 3", "tri k = 3", "an index of the 3 vertices so far, from 0"),
    ("envmap sky.exr", "envmap = sky.exr", "quadLight, point, directional, sun, diskLight"),
    ("x" * 100_000, "text = a line of 100000 characters", "at most 65536 characters"),
    ("# a\0b", r"text = \x00", "text without NUL bytes"),
]


@pytest.mark.parametrize(("lines", "said", "accepted"), REFUSALS, ids=lambda text: text[:30])
def test_bad_input_is_one_line_with_place_argument_value_and_what_is_accepted(
    lines: str, said: str, accepted: str
) -> None:
    for extra in (lines, lines + "\ndiffuse 1 1 1\n"):
        message = told(BASE + extra)
        assert message.startswith(f"a.test:{NEXT + lines.count(chr(10))}: {said}")
        assert f": expected {accepted}" in message
        assert "\n" not in message
        assert len(message) < 300


def test_stratified_samples_must_be_a_square_whichever_is_set_last() -> None:
    said = re.escape(f"a.test:{NEXT}: lightsamples = 8: expected a square number")
    with pytest.raises(InputError, match=said):
        parse("lightsamples 8\nlightstratify on")
    assert parse("lightsamples 8").light_samples == 8


@pytest.mark.parametrize("line", ["reflect 0 0 0", "# x\n  reflect"])
def test_an_unknown_command_names_its_column_and_lenient_ignores_it(line: str) -> None:
    place = f"a.test:{NEXT + line.count(chr(10))}:{3 if line.startswith('#') else 1}"
    said = f"{place}: command = reflect: expected a command of this format; --lenient ignores it"
    assert told(BASE + line) == said
    (warning,) = parse(line, lenient=True).warnings
    assert warning == f"{place}: unknown command = reflect: expected a command of this format: ignored"


@pytest.mark.parametrize(
    ("word", "like"),
    [
        *[("vertx", "vertex"), ("tir", "tri"), ("triangle", "tri"), ("spehre", "sphere"), ("rotat", "rotate")],
        *[("push", "pushTransform"), ("pop", "popTransform"), ("transform", "pushTransform"), ("trans", "translate")],
        *[("pointlight", "point"), ("quad_light", "quadLight"), ("lightmap", "quadLight"), ("max_verts", "maxverts")],
        *[("difuse", "diffuse"), ("emissive", "emission"), ("cmaera", "camera"), ("spotlite", "spotLight")],
    ],
)
def test_what_is_likely_a_command_stays_an_error_when_lenient(word: str, like: str) -> None:
    for lenient in (False, True):
        message = told(f"{BASE}{word} 1 2 3\n", lenient=lenient)
        assert message == f"a.test:{NEXT}:1: command = {word}: expected a command of this format ({like}?)"


@pytest.mark.parametrize(
    "word", ["refraction", "reflect", "antialias", "debug", "depth", "jitter", "threads", "x", "\x07"]
)
def test_hints_do_not_lead_astray(word: str) -> None:
    assert "?" not in told(BASE + word)
    assert parse(word, lenient=True).warnings[0].isprintable()


def test_between_push_and_pop_nothing_is_left_out() -> None:
    known = "reflect 1 1 1\n"  # said before, ignored before, and not here
    message = told(f"{BASE}{known}pushTransform\nreflect 1 1 1\npopTransform\n", lenient=True)
    assert message.startswith(
        f"a.test:{NEXT + 2}:1: command = reflect: expected a command of this format: between push"
    )
    assert len(parse(f"{known}pushTransform\npopTransform\n{known}", lenient=True).warnings) == 1


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_what_is_out_of_scope_is_refused_even_when_lenient(name: str) -> None:
    with pytest.raises(InputError, match=f"a.test:{NEXT}: {name} = no argument: expected"):
        parse(name, lenient=True)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a.test:1: size = missing"),
        ("\n\n", "a.test:2: size = missing"),
        ("camera 0 0 4 0 0 0 0 1 0 45", "a.test:1: size = missing"),
        ("size 4 3\n# no camera", "a.test:2: camera = missing"),
    ],
)
def test_size_and_camera_must_be_there(text: str, said: str) -> None:
    assert told(text).startswith(said)


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_counts_its_arguments(name: str) -> None:
    spare = " ".join(["1"] * (len(COMMANDS[name].arguments) + 1))
    with pytest.raises(InputError, match=f"a.test:{NEXT}: {name} spare argument = 1: expected"):
        parse(f"{name} {spare}")


def test_runs_of_lines_and_single_lines_give_the_same_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    coordinates, corners = rng.normal(size=(9000, 3)).tolist(), rng.permuted(np.arange(9000)).reshape(-1, 3)
    text = VIEW + "rotate 1 2 3 4\n" + "".join(f"vertex {x!r} {y:.3e} +{z:.2f}\n" for x, y, z in coordinates)
    text = text.replace("+-", "-") + "".join(f"  tri\t{i} {j} {k} \n" for i, j, k in corners) + "tri 1 2 3\n"
    whole = parse_scene(text)
    faults = (text + "\ntri 0 1 2\ntri 7 7 8\n", text + "tri 0 1 9000\n", text + "vertex 1 1e999 0\n")
    said = [told(fault) for fault in faults]
    monkeypatch.setattr(scene_reader, "_RUN", re.compile("(?!)"))
    assert parse_scene(text) == whole
    assert said == [told(fault) for fault in faults]
    line = text.count("\n") + 1
    assert [message.split(" = ")[0] for message in said] == [
        f"a.test:{line + 2}: tri",
        f"a.test:{line}: tri k",
        f"a.test:{line}: vertex y",
    ]


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="missing: expected a regular file"):
        read_scene(tmp_path / "none.test")
    with pytest.raises(InputError, match="a folder: expected a regular file"):
        read_scene(tmp_path)
    with pytest.raises(InputError, match="a pipe or device: expected a regular file"):
        read_scene("/dev/zero")
    with pytest.raises(InputError):
        read_scene("a\0b")
    with pytest.raises(InputError, match=r"\\n"):
        read_scene("a\nb" * 999)


def test_text_that_is_none(tmp_path: Path) -> None:
    path = tmp_path / "größe 1.test"
    path.write_bytes(VIEW.replace("\n", "\r\n").encode() + b"# caf\xe9\noutput caf\xe9.png\n")
    with pytest.raises(InputError, match=r"größe 1\.test:5: text = b'caf.*xe9\.png': expected UTF-8"):
        read_scene(path)
    path.write_text(VIEW)
    assert read_scene(path).name == "größe 1"


def test_a_file_too_long_is_not_read_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "long.test"
    path.write_text(VIEW)
    monkeypatch.setattr(scene_reader, "MAX_BYTES", 20)
    with pytest.raises(InputError, match="over 20 bytes: expected at most 20 bytes"):
        read_scene(path)


def test_deep_stacks_end() -> None:
    assert parse("pushTransform\n" * 100_000)
    with pytest.raises(InputError, match=rf"a.test:{NEXT + 100_000}: pushTransform = 100001 deep"):
        parse("pushTransform\n" * 100_001)


def test_an_unknown_command_is_likened_to_the_known_ones_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Found by the long fuzz: a megabyte of one unknown command took seconds."""
    asked: list[str] = []
    monkeypatch.setattr(scene_reader, "likely", lambda name: asked.append(name) or "")
    names = "".join(f"odd{k}\n" for k in range(scene_reader.MAX_UNKNOWN - 1))
    scene = parse("odd 1 2 3\n" * 1000 + names, lenient=True)
    assert scene.warnings[0].endswith(": ignored (and 999 more)")
    assert len(asked) == len(scene.warnings) == scene_reader.MAX_UNKNOWN
    with pytest.raises(InputError, match=f"or at most {scene_reader.MAX_UNKNOWN} others"):
        parse("odd 1 2 3\n" * 1000 + names + "more\n", lenient=True)


tokens = st.one_of(
    st.sampled_from(["0", "1", "2", "-1", "+1.5", "1e308", "-1e-308", "nan", "on", "direct", "#", "1e9", "180"]),
    st.floats().map(repr),
    st.integers().map(str),
    st.text(max_size=8),
)
lines = st.builds(
    lambda name, given: " ".join([name, *given]),
    st.sampled_from([*COMMANDS, *REFUSED, "vertx", "#"]),
    st.lists(tokens, max_size=13),
)
right_count = st.sampled_from([*COMMANDS]).flatmap(
    lambda name: st.lists(
        st.sampled_from(["0", "1", "2", "-1", ".5", "1e308", "-1e300", "1e-200", "5e-324", "3"]),
        min_size=len(COMMANDS[name].arguments),
        max_size=len(COMMANDS[name].arguments),
    ).map(lambda given: " ".join([name, *given]))
)
texts = st.one_of(
    st.text(),
    st.lists(lines, max_size=12).map("\n".join),
    st.lists(right_count, max_size=30).map(lambda said: BASE + "\n".join(said)),
)


@settings(max_examples=300, deadline=5000)
@given(texts, st.booleans())
def test_any_text_is_a_scene_or_one_clear_error(text: str, lenient: bool) -> None:
    try:
        scene = parse_scene(text, where="a.test", lenient=lenient)
    except InputError as caught:
        message = str(caught)
    else:
        assert all(warning.isprintable() for warning in scene.warnings)
        assert parse_scene(write_scene(scene)).lights == scene.lights
        return
    assert re.match(r"a\.test:\d+: |a\.test:\d+:\d+: command", message)
    assert message.isprintable()
