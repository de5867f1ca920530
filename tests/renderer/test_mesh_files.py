"""PLY and OBJ files read, placed in scenes, and refused with one line."""

from __future__ import annotations

import re

import numpy as np
import pytest
from click.testing import CliRunner

from nusselt.experiments.cli.main import main
from nusselt.experiments.scenes.meshes import displaced_sphere
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import CommonPointsFixed
from nusselt.renderer.geometry.closed_surfaces import closed_surface
from nusselt.renderer.image import render
from nusselt.renderer.mesh_files import read_mesh_file
from nusselt.renderer.scene_text import parse_scene, read_scene, write_scene

HEAD = "size 8 8\ncamera 0 -3 1  0 0 0  0 0 1  40\n"
POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5], [9, 9, 9]])


def ply(order: str, faces: list[list[int]], extra: bool = False) -> bytes:
    """A PLY file of POINTS; with ``extra``, an element and properties that nobody asked for."""
    kind = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = f"ply\nformat {kind} 1.0\ncomment made here\n"
    if extra:
        head += "element other 2\nproperty list uchar short ids\n"
    head += f"element vertex {len(POINTS)}\nproperty float x\nproperty float y\nproperty double z\n"
    head += "property uchar red\n" * extra + f"element face {len(faces)}\n"
    head += "property float weight\n" * extra + "property list uchar int vertex_indices\nend_header\n"
    if order == "":
        rows = ["1 7", "2 8 9"] * extra
        rows += [" ".join(map(str, p)) + " 255" * extra for p in POINTS.tolist()]
        rows += ["0.5 " * extra + " ".join(map(str, [len(f), *f])) for f in faces]
        return (head + "\n".join(rows) + "\n").encode()
    body = b""
    if extra:
        for ids in ([7], [8, 9]):
            body += np.array([len(ids)], "u1").tobytes() + np.array(ids, order + "i2").tobytes()
    for p in POINTS:
        body += np.array(p[:2], order + "f4").tobytes() + np.array(p[2:], order + "f8").tobytes() + b"\xff" * extra
    for f in faces:
        body += np.array([0.5], order + "f4").tobytes() * extra
        body += np.array([len(f)], "u1").tobytes() + np.array(f, order + "i4").tobytes()
    return head.encode() + body


@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize("extra", [False, True])
@pytest.mark.parametrize(
    ("faces", "triangles"),
    [
        ([[0, 1, 2], [0, 2, 3]], [[0, 1, 2], [0, 2, 3]]),
        ([[0, 1, 2, 3]], [[0, 1, 2], [0, 2, 3]]),
        ([[0, 1, 2, 3], [2, 1, 0], [3, 2, 1, 0]], [[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 1], [3, 1, 0]]),
    ],
)
def test_ply_gives_its_faces_and_the_vertices_they_use(tmp_path, order, extra, faces, triangles):
    path = tmp_path / "a.ply"
    path.write_bytes(ply(order, faces, extra))
    surface = read_mesh_file(path)
    np.testing.assert_array_equal(surface.vertices.T, POINTS[:4])
    np.testing.assert_array_equal(surface.triangles.T, triangles)


def test_obj_gives_its_faces_whatever_else_it_holds(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(
        "# made here\nmtllib x.mtl\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nvn 0 0 1\nvt 0 0\n"
        "f 1/1/1 2//1 3\nv 0 1 .5\ns off\nf 1 -2 -1\r\nf 1 2 3 4\n"
    )
    surface = read_mesh_file(path)
    np.testing.assert_array_equal(surface.vertices.T, POINTS[:4])
    np.testing.assert_array_equal(surface.triangles.T, [[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3]])


def test_a_faces_front_is_as_its_corners_run_whatever_its_normals_say(tmp_path):
    """Where a mesh was mirrored, exporters write the one without the other."""
    corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\n"
    for order, up in (("1//1 2//1 3//1", 1), ("3//1 2//1 1//1", -1)):
        (tmp_path / "a.obj").write_text(f"{corners}f {order}\n")
        surface = read_mesh_file(tmp_path / "a.obj")
        a, b, c = surface.vertices.T[surface.triangles[:, 0]]
        np.testing.assert_array_equal(np.cross(b - a, c - a), [0, 0, up])


def test_a_mesh_takes_the_current_material_and_transform_and_loses_its_flat_triangles(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a.ply").write_bytes(ply("<", [[0, 1, 2], [0, 1, 1], [0, 2, 3]]))
    scene_file = tmp_path / "a.test"
    scene_file.write_text(HEAD + "diffuse .1 .2 .3\ntranslate 0 0 5\nscale 2 2 2\nmesh parts/a.ply\n")
    scene = read_scene(scene_file)
    (mesh,) = scene.meshes
    np.testing.assert_array_equal(mesh.vertices.T, POINTS[:4] * 2 + [0, 0, 5])
    assert mesh.material.diffuse == (0.1, 0.2, 0.3)
    assert mesh.triangles.shape == (3, 2)
    assert any("1 triangle " in warning and "dropped" in warning for warning in scene.warnings)
    assert parse_scene(write_scene(scene), name=scene.name) == scene.with_(warnings=())


def test_a_big_mesh_comes_back_from_its_text(tmp_path):
    vertices, triangles = displaced_sphere(20_000)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.T.tolist()]
    lines += [f"f {i} {j} {k}" for i, j, k in (triangles.T + 1).tolist()]
    (tmp_path / "s.obj").write_text("\n".join(lines))
    (tmp_path / "s.test").write_text(HEAD + "mesh s.obj\n")
    scene = read_scene(tmp_path / "s.test")
    np.testing.assert_array_equal(scene.meshes[0].vertices, vertices)
    np.testing.assert_array_equal(scene.meshes[0].triangles, triangles)
    assert parse_scene(write_scene(scene), name=scene.name) == scene.with_(warnings=())


BAD_PLY = {
    "no header": b"solid thing\n",
    "no format": b"ply\nelement vertex 0\nend_header\n",
    "unknown format": ply("<", [[0, 1, 2]]).replace(b"little", b"middle"),
    "unknown type": ply("<", [[0, 1, 2]]).replace(b"property float x", b"property half x"),
    "no z": ply("<", [[0, 1, 2]]).replace(b"double z", b"double w"),
    "cut short": ply("<", [[0, 1, 2], [0, 1, 2]])[:-3],
    "cut short, uneven": ply(">", [[0, 1, 2], [0, 1, 2, 3]])[:-3],
    "cut short, ascii": ply("", [[0, 1, 2], [0, 1, 2]])[:-4],
    "index out of range": ply("<", [[0, 1, 7]]),
    "negative index": ply("", [[0, 1, -2]]),
    "two corners": ply("", [[0, 1]]),
    "not a number": ply("", [[0, 1, 2]]).replace(b"1.0 1.0 0.0", b"1.0 one 0.0"),
    "not finite": ply("", [[0, 1, 2]]).replace(b"1.0 1.0 0.0", b"1.0 nan 0.0"),
    "no faces": ply("<", []),
    "absurd count": ply("<", [[0, 1, 2]]).replace(b"face 1", b"face 99999999999"),
    "no area": ply("<", [[0, 0, 1]]),
    "list count negative": ply("", [[0, 1, 2]]).replace(b"\n3 0 1 2", b"\n-3 0 1 2"),
}


@pytest.mark.parametrize("what", BAD_PLY)
def test_a_bad_ply_is_refused_in_one_line(tmp_path, what):
    (tmp_path / "bad.ply").write_bytes(BAD_PLY[what])
    (tmp_path / "s.test").write_text(HEAD + "mesh bad.ply\n")
    with pytest.raises(InputError) as caught:
        read_scene(tmp_path / "s.test")
    assert "s.test:3: " in str(caught.value)
    assert "bad.ply" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "v 0 0\nf 1 1 1",
        "v 0 0 x\nf 1 1 1",
        "v 0 0 0\nf 1 2 3",
        "v 0 0 0\nf 0 0 0",
        "v 0 0 0\nf 1 1",
        "curv 0 1 2",
        "v 0 0 0\nf 1 1 a",
        "",
        "v 0 0 0\nf 1 1 -2",
        "v 0 0 0\nf 1 1 99999999999999999999",
    ],
)
def test_a_bad_obj_is_refused_in_one_line(tmp_path, text):
    (tmp_path / "bad.obj").write_text(text)
    with pytest.raises(InputError) as caught:
        read_mesh_file(tmp_path / "bad.obj")
    assert "bad.obj" in str(caught.value)


@pytest.mark.parametrize(
    "name", ["../a.ply", "/etc/passwd.ply", "link.ply", "linked/a.ply", "none.ply", "a.stl", "sub"]
)
def test_a_mesh_file_lies_below_its_scene_and_behind_no_link(tmp_path, name):
    outside = tmp_path / "a.ply"
    outside.write_bytes(ply("<", [[0, 1, 2]]))
    folder = tmp_path / "scenes"
    (folder / "sub").mkdir(parents=True)
    (folder / "a.stl").write_bytes(b"")
    (folder / "link.ply").symlink_to(outside)
    (folder / "linked").symlink_to(tmp_path)
    (folder / "s.test").write_text(HEAD + f"mesh {name}\n")
    with pytest.raises(InputError) as caught:
        read_scene(folder / "s.test")
    assert "s.test:3: " in str(caught.value)


@pytest.mark.parametrize("name", ["9" * 400, "9" * 40_000, "/".join(["ab"] * 5000)])
def test_a_mesh_whose_name_no_file_can_have_is_one_clear_error(tmp_path, name):
    (tmp_path / "a.test").write_text(f"size 8 8\ncamera 0 0 3 0 0 0 0 1 0 45\nmesh {name}\n")
    with pytest.raises(InputError, match=r"mesh = .*expected a file"):
        read_scene(tmp_path / "a.test")


def test_a_text_without_a_file_has_no_meshes():
    with pytest.raises(InputError, match="scene that is a file"):
        parse_scene(HEAD + "mesh a.ply\n")


SHADE = """size 10 8
camera 0 -3 2.5  0 0 .5  0 0 1  40
integrator direct
quadLight -.5 -.5 2  1 0 0  0 1 0  10 10 10
diffuse .7 .7 .7
vertex -2 -2 0
vertex 2 -2 0
vertex 2 2 0
vertex -2 2 0
tri 0 1 2
tri 0 2 3
translate 0 0 .9
scale .4 .4 .4
mesh m.obj
"""


def obj(vertices, triangles) -> str:
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.T.tolist()]
    return "\n".join(lines + [f"f {i} {j} {k}" for i, j, k in (triangles.T + 1).tolist()])


def rendered(folder, vertices, triangles, estimator="exact"):
    """Exit status, what was said, and the image of a scene with that mesh."""
    (folder / "m.obj").write_text(obj(vertices, triangles))
    (folder / "s.test").write_text(SHADE)
    out = folder / "s.npy"
    done = CliRunner().invoke(main, ["render", str(folder / "s.test"), "--estimator", estimator, "-o", str(out)])
    return done.exit_code, done.stderr, np.load(out) if out.exists() else None


def test_bodies_are_shaded_without_noise_and_what_bounds_none_by_sampling_with_the_reason(tmp_path):
    vertices, triangles = displaced_sphere(800)
    shifted = np.hstack((vertices, 0.6 * vertices + [[0.7], [0.1], [0.2]]))
    pair = np.hstack((triangles, triangles + vertices.shape[1]))  # two bodies through each other
    bound_alone = r"every value is within \d\.\de-\d+ of what its light would give if nothing were in the way\n"
    status, said, whole = rendered(tmp_path, vertices, triangles)
    assert status == 0
    assert re.fullmatch(bound_alone, said)
    status, said, both = rendered(tmp_path, shifted, pair)
    assert status == 0
    assert re.fullmatch(bound_alone, said)
    assert np.abs(both - whole).max() > 0.05  # the control: the second body shows
    scene = read_scene(tmp_path / "s.test")
    sampled = render(scene, CommonPointsFixed(samples=987)).mean.transpose(1, 2, 0)
    assert np.sqrt(((sampled - both) ** 2).mean()) < 3e-3 * np.sqrt((both**2).mean())
    many, faces = displaced_sphere(6000)  # few pieces are cut exactly, open or not
    status, said, _ = rendered(tmp_path, many, faces[:, 1:])
    assert status == 0
    assert "light 1 are sampled: its big mesh does not bound a body: 3 edges belong to one triangle alone" in said
    turned = np.where(np.arange(faces.shape[1]) == 40, faces[::-1], faces)
    status, said, _ = rendered(tmp_path, many, turned)
    assert status == 0
    assert "3 edges are run along more often one way than the other: it is wound badly" in said
    status, said, inside_out = rendered(tmp_path, vertices, triangles[::-1])
    assert status == 0
    assert "sampled" not in said  # closed all the same; its back is black, its shadow is not
    floor = (whole > 0).all(axis=-1) & (inside_out > 0).all(axis=-1)
    np.testing.assert_allclose(inside_out[floor], whole[floor], rtol=1e-9)


def test_a_wing_on_a_body_is_open_and_bodies_that_share_an_edge_are_not():
    vertices, triangles = displaced_sphere(400)
    corners = [vertices[:, k] for k in triangles]
    a, b = corners[0][:, 0], corners[1][:, 0]
    tip = a + 2 * (a - vertices.mean(axis=1))
    wing = [np.column_stack((v, w)) for v, w in zip(corners, (a, b, tip), strict=True)]  # three on one edge
    surface, reason = closed_surface(*wing)
    assert surface is None
    assert "2 edges belong to one triangle alone" in reason
    assert "1 edges are run along more often" in reason
    mirrored = [2 * a[:, None] - v for v in (corners[0], corners[1], corners[2])]  # meets the first in a vertex
    assert closed_surface(*(np.hstack(pair) for pair in zip(corners, mirrored, strict=True)))[0] is not None


def test_a_bad_mesh_file_ends_the_command_in_one_line_and_writes_nothing(tmp_path):
    (tmp_path / "s.test").write_text(SHADE)
    for content in ("v 0 0 0\nf 1 2 3\n", "", None):
        if content is not None:
            (tmp_path / "m.obj").write_text(content)
        else:
            (tmp_path / "m.obj").unlink()
        done = CliRunner().invoke(main, ["render", str(tmp_path / "s.test"), "-o", str(tmp_path / "s.npy")])
        assert done.exit_code == 2
        assert "m.obj" in done.stderr
        assert done.stderr.strip().count("\n") == 0
        assert not (tmp_path / "s.npy").exists()
