"""The scene text format: what each command means, and what is warned of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nusselt.renderer.lights import DirectionalLight, PointLight, QuadLight, SunLight
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import parse_scene, read_scene
from nusselt.renderer.surfaces import Ellipsoid, Material

VIEW = "size 4 3\ncamera 0 0 4  0 0 0  0 1 0  45\nintegrator direct\n"
BASE = VIEW + "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
NEXT = BASE.count("\n") + 1


def parse(extra: str, **options: bool) -> Scene:
    return parse_scene(BASE + extra, where="a.test", **options)


def test_defaults() -> None:
    scene = parse_scene("size 4 3\ncamera 0 0 4 0 0 0 0 1 0 45")
    assert (scene.integrator, scene.light_samples, scene.stratify, scene.spp) == ("direct", 1, False, 1)
    assert (scene.output, scene.meshes, scene.ellipsoids, scene.lights) == ("raytrace.png", (), (), ())
    assert parse("tri 0 1 2").meshes[0].material == Material((0, 0, 0), (0, 0, 0), 1, (0, 0, 0))


def test_comments_blanks_plus_signs_and_odd_line_ends() -> None:
    text = "\ufeff# size 9 9\r\n\r\n  #camera\n\t size +4  3 \t\rcamera 0 0 +4e0 0 0 0 0 1. 0 +45  \n" + (
        "point +1.5 -.5 5.e-1 1 2 3   \n   \npushTransform\npushTransform"
    )
    scene = parse_scene(text)
    assert (scene.width, scene.height, scene.camera.fov_y) == (4, 3, 45)
    assert scene.lights == (PointLight((1.5, -0.5, 0.5), (1, 2, 3)),)


def test_the_last_setting_wins() -> None:
    scene = parse("size 7 8\nspp 2\nspp 3\nlightsamples 2\nlightstratify on\nlightsamples 4\nintegrator analyticdirect")
    assert (scene.width, scene.spp, scene.light_samples, scene.integrator) == (7, 3, 4, "analyticdirect")


def test_every_light_is_read_untransformed_and_in_order() -> None:
    scene = parse(
        "translate 9 9 9\nscale 2 2 2\nquadLight 1 2 3 0 0 2 2 0 0 4 5 6\npoint 1 2 3 4 5 6\n"
        "directional 0 2 0 1 2 3\nsun 0 0 3 1 2 3 .53"
    )
    assert scene.lights == (
        QuadLight((1, 2, 3), (0, 0, 2), (2, 0, 0), (4, 5, 6)),
        PointLight((1, 2, 3), (4, 5, 6)),
        DirectionalLight((0, 1, 0), (1, 2, 3)),
        SunLight((0, 0, 1), (1, 2, 3), 0.53),
    )


def test_material_and_transform_are_those_at_the_geometrys_line() -> None:
    scene = parse(
        "diffuse .1 .2 .3\ntri 0 1 2\nspecular .4 .4 .4\nshininess 9\ntranslate 0 0 5\n"
        "sphere 0 0 0 1\ndiffuse 0 0 0\ntranslate 1 0 0"
    )
    assert scene.meshes[0].material == Material((0.1, 0.2, 0.3))
    assert scene.ellipsoids == (Ellipsoid.sphere((0, 0, 5), 1, Material((0.1, 0.2, 0.3), (0.4, 0.4, 0.4), 9)),)
    assert scene.meshes[0].vertices[2].tolist() == [0, 0, 0]


def test_triangles_of_one_material_are_one_mesh_with_the_used_vertices_only() -> None:
    scene = parse("vertex 5 5 5\nvertex 1 1 0\ntri 0 1 2\nsphere 0 0 9 1\nvertex 8 8 8\ntri 1 4 2\n")
    (mesh,) = scene.meshes
    assert mesh.vertices.T.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    assert mesh.triangles.T.tolist() == [[0, 1, 2], [1, 3, 2]]


def test_the_command_nearest_the_geometry_acts_first() -> None:
    # (1, 0, 0) scaled by (2, 3, 4), turned 90 degrees about +z, moved by (10, 20, 30).
    (mesh,) = parse("translate 10 20 30\nrotate 0 0 2 90\nscale 2 3 4\ntri 0 1 2").meshes
    assert mesh.vertices.T.tolist() == [[10, 20, 30], [10, 22, 30], [7, 20, 30]]


def test_a_turn_about_any_axis_is_right_handed() -> None:
    (mesh,) = parse("rotate 1 1 1 120\ntri 0 1 2").meshes  # takes x to y, y to z
    np.testing.assert_allclose(mesh.vertices.T, [[0, 0, 0], [0, 1, 0], [0, 0, 1]], atol=1e-15)


def test_push_and_pop_nest_and_may_stay_open() -> None:
    (mesh,) = parse(
        "translate 1 0 0\npushTransform\ntranslate 1 0 0\npushTransform\nscale 9 9 9\npopTransform\ntri 0 1 2"
    ).meshes
    assert mesh.vertices.T.tolist() == [[2, 0, 0], [3, 0, 0], [2, 1, 0]]


def test_a_mirrored_transform_keeps_the_winding() -> None:
    (mesh,) = parse("scale -1 1 1\ntri 0 1 2").meshes
    a, b, c = mesh.corners
    assert mesh.triangles.T.tolist() == [[0, 1, 2]]
    assert np.cross(b - a, c - a, axis=0).T.tolist() == [[0, 0, -1]]


def test_spheres_and_ellipsoids_under_transforms() -> None:
    text = "translate 1 2 3\nrotate 1 2 3 40\nscale -2 2 2\nsphere 0 0 0 .5\nscale 1 1 3\nsphere 0 0 0 1"
    sphere, ellipsoid = parse(text).ellipsoids
    assert sphere.radius == pytest.approx(1, abs=1e-15)
    assert sphere == Ellipsoid.sphere((1, 2, 3), sphere.radius or 0)
    assert ellipsoid.radius is None
    assert np.linalg.svd(np.array(ellipsoid.axes), compute_uv=False) == pytest.approx([6, 2, 2])


def test_a_vertex_under_one_transform_is_the_same_to_the_bit() -> None:
    """In whichever mesh, beside whichever others: neighbours must not part at their common edge."""
    rng = np.random.default_rng(2)
    cloud = "".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in rng.normal(size=(1000, 3)).tolist())
    turn = "translate .1 .2 .3\nrotate .3 .5 .7 33\nscale 1.1 1.2 1.3\n"
    fan = "".join(f"tri 0 {i} {i + 1}\n" for i in range(1, 998))
    first, second, third = parse_scene(
        VIEW + cloud + turn + fan + "diffuse 1 1 1\ntri 0 1 2\ndiffuse 0 0 0\ntri 0 500 999\n"
    ).meshes
    assert first.vertices[:, :3].tobytes() == second.vertices.tobytes()
    assert first.vertices[:, [0, 500]].tobytes() == third.vertices[:, :2].tobytes()
    assert first.vertices.shape == (3, 999)


def test_one_vertex_under_two_transforms_is_two_vertices() -> None:
    (mesh,) = parse("tri 0 1 2\ntranslate 0 0 1\ntri 0 1 2\n").meshes
    assert mesh.vertices.T.tolist()[3:] == [[0, 0, 1], [1, 0, 1], [0, 1, 1]]


@pytest.mark.parametrize(
    ("line", "warning"),
    [
        ("integrator raytracer", "integrator raytracer: direct is used"),
        ("integrator pathtracer", "integrator pathtracer: direct is used"),
        ("attenuation 1 0 0", "attenuation ignored: light falls off as 1/R^2"),
        ("ambient .2 .2 .2", "ambient ignored: it is not direct lighting"),
        (
            "nexteventestimation on",
            "nexteventestimation ignored: it says how paths find the lights, not how bright they are",
        ),
        (
            "nexteventestimation mis",
            "nexteventestimation ignored: it says how paths find the lights, not how bright they are",
        ),
        ("russianroulette on", "russianroulette ignored: it ends paths, and direct light has none to end"),
        ("importancesampling brdf", "importancesampling ignored: it changes a path's noise, not its mean"),
        ("gamma 2.2", "gamma ignored: images are linear; only how a PNG is written would change"),
        ("roughness .3", "roughness ignored: brdf ggx alone has one"),
        ("output a/b/c.png", "output: its folder is ignored"),
        ("output ..\\c.png", "output: its folder is ignored"),
        ("emission 1 0 0\ntri 0 1 2", "emission on an ordinary object is seen but lights nothing"),
        ("emission 1 0 0\nsphere 0 0 0 1", "emission on an ordinary object is seen but lights nothing"),
    ],
)
def test_warnings_name_file_and_line(line: str, warning: str) -> None:
    scene = parse(line)
    assert scene.warnings == (f"a.test:{NEXT}: {warning}",)
    assert scene.integrator == "direct"


@pytest.mark.parametrize(
    ("lines", "warned"),
    [
        ("", False),
        ("point 0 1 0 1 1 1", False),
        ("quadLight 0 1 0 0 0 1 1 0 0 1 1 1", True),
        ("lightsamples 4\nquadLight 0 1 0 0 0 1 1 0 0 1 1 1", False),
        ("integrator direct\nquadLight 0 1 0 0 0 1 1 0 0 1 1 1", False),
    ],
)
def test_a_missing_integrator_is_warned_of_where_it_matters(lines: str, warned: bool) -> None:
    """Where a light has an extent, and nothing says how it is sampled."""
    scene = parse_scene(f"size 4 3\ncamera 0 0 4 0 0 0 0 1 0 45\n{lines}\n", where="a.test")
    assert any("no integrator and no lightsamples" in warning for warning in scene.warnings) == warned


def test_warnings_do_not_pile_up() -> None:
    scene = parse("attenuation 1 0 0\n" * 9 + "nonsense\n" * 999, lenient=True)
    assert scene.warnings[0].endswith("1/R^2 (and 8 more)")
    assert scene.warnings[1].endswith(": ignored (and 998 more)")
    assert len(scene.warnings) == 2
    said = "".join(
        f"gamma {k}\nroughness {k}\noutput a{k}/b.png\nattenuation {k} 0 0\nambient {k} 0 0\n" for k in range(2, 99)
    )
    assert len(parse(said).warnings) == 5


@pytest.mark.parametrize("name", ["maxdepth", "maxverts", "maxvertnorms"])
def test_commands_of_other_homeworks_are_accepted(name: str) -> None:
    assert parse(f"{name} 1000000000").warnings == ()


@pytest.mark.parametrize("line", ["gamma 1", "gamma 1.0", "brdf phong", "attenuation 0 0 1"])
def test_what_asks_for_what_is_done_is_no_news(line: str) -> None:
    assert parse(line).warnings == ()


def test_output_is_a_file_name() -> None:
    assert parse("output a/b/c.png").output == parse("output ..\\c.png").output == "c.png"


@pytest.mark.parametrize(
    "text",
    [
        "diffuse .1 .2 .3   # brown\ntri 0 1 2 #one\n# tri 0 0 0\n   #",
        "DIFFUSE .1 .2 .3\nTri 0 1 2",
        "diffuse\t.1  +.2\t3e-1 \ntri 0 1 2\r\n",
        "diffuse .1 .2 .3\npushtransform\ntranslate 9 9 9\nPopTransform\ntri 0 1 2\nmaxVerts 3\nmaxDepth 5",
        "diffuse .1 .2 .3\nbrdf phong\ngamma 1\ntri 0 1 2",
    ],
)
def test_the_same_scene_in_other_hands(text: str) -> None:
    scene = parse(text)
    assert scene == parse("diffuse .1 .2 .3\ntri 0 1 2")
    assert scene.warnings == ()


def test_slashes_begin_a_comment_on_request() -> None:
    scene = parse("// floor\ntri 0 1 2 // the first\n", lenient=True)
    assert scene == parse("tri 0 1 2")
    assert scene.warnings == (f"a.test:{NEXT}: // taken for a comment (and 1 more)",)


def test_comments_may_be_in_any_encoding(tmp_path: Path) -> None:
    path = tmp_path / "a.test"
    path.write_bytes(BASE.encode() + b"# sch\xf6n\ntri 0 1 2  # sch\xf6n\n")
    assert read_scene(path).meshes == parse("tri 0 1 2").meshes


LAMP = "point 0 3 0 1 1 1\n"


@pytest.mark.parametrize(
    ("lines", "line"),
    [
        (LAMP, 3),
        ("integrator raytracer\n" + LAMP + LAMP, 4),
        (LAMP + "attenuation 1 0 0\n" + LAMP, 3),
        ("attenuation 1 0 0\n" + LAMP, None),
        ("attenuation 0 0 1\n" + LAMP, None),
        ("integrator direct\n" + LAMP, None),
        (LAMP + "quadLight 0 1 0 0 0 1 1 0 0 1 1 1\n", None),
        ("directional 0 1 0 1 1 1\n", None),
    ],
)
def test_points_of_cse_167_do_not_fall_off_and_it_is_said(lines: str, line: int | None) -> None:
    scene = parse_scene(f"size 4 3\ncamera 0 0 4 0 0 0 0 1 0 45\n{lines}", where="a.test")
    said = [warning for warning in scene.warnings if "CSE 167" in warning]
    message = "point without attenuation: in CSE 167 it does not fall off, here light falls off as 1/R^2"
    assert said == ([f"a.test:{line}: {message}"] if line else [])
