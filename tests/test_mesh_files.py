"""PLY and OBJ files read, placed in scenes, and refused with one line."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.meshes import displaced_sphere
from renderer.errors import InputError
from renderer.mesh_files import read_mesh_file
from renderer.scene_text import parse_scene, read_scene, write_scene

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
    assert any("1 triangles" in warning and "dropped" in warning for warning in scene.warnings)
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


def test_a_text_without_a_file_has_no_meshes():
    with pytest.raises(InputError, match="scene that is a file"):
        parse_scene(HEAD + "mesh a.ply\n")
