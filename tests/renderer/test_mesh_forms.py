"""The forms in which programs write OBJ and PLY: the same shape from each, or one sentence that says why not."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from nusselt.renderer.errors import InputError
from nusselt.renderer.mesh_files import Surface, read_mesh_file
from nusselt.renderer.mesh_files import ply as ply_reader
from nusselt.renderer.scene_text import read_scene, state

POINTS = [(0, 0, 1), (4, 0, 1), (4, 0, -2), (0, 0, -2)]
V = "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS)
LEFT = "flat faces alone are read, without its "


def read(folder: Path, name: str, data: bytes | str) -> Surface:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_mesh_file(path)


def area(surface: Surface) -> float:
    a, b, c = (surface.vertices[:, corner] for corner in surface.triangles)
    return float(np.linalg.norm(np.cross(b - a, c - a, axis=0), axis=0).sum() / 2)


OBJ = {
    "plain": (V + "f 1 2 3 4", ()),
    "a line that goes on": ("v 0 \\\n0 \\  \n1\nv 4 0 1\nv 4 0 -2\nv 0 0 -2\nf 1 2 \\\n3 4", ()),
    "comments at line ends": (
        V.replace("\n", " # a corner, and long words after it\n") + "f 1 2 3 4 # the floor\n",
        (),
    ),
    "a comment that ends in a backslash": ("# C:\\models\\\n" + V + "f 1 2 3 4", ()),
    "carriage returns alone": ((V + "f 1 2 3 4\n").replace("\n", "\r"), ()),
    "carriage returns too": ((V + "f 1 2 3 4\n").replace("\n", "\r\n"), ()),
    "goes on, with carriage returns too": ((V + "f 1 2 \\\n3 4\n").replace("\n", "\r\n"), ()),
    "byte order mark": ("\ufeff" + V + "f 1 2 3 4", ()),
    "tabs and blanks": (V.replace(" ", " \t ") + "  f  1   2 3\t4  \n", ()),
    "slashes": (V + "vt 0 0\nf 1/1/ 2/1 3//1 4/", (f"{LEFT}texture coordinates",)),
    "negative numbers": ("v 9 9 9\n" + V + "f -4 -3 -2 -1", ()),
    "negative numbers count from where they stand": (V + "f -4 -3 -2 -1\nv 9 9 9", ()),
    "faces before vertices": ("f 1 2 3 4\n" + V, ()),
    "the older fo": (V + "fo 1 2 3 4", ()),
    "faces of two corners": (V + "f 1 2\nf 1 2 3 4\nf 3\nf\n", ("3 faces of fewer than three corners: dropped",)),
    "a NaN of another spelling": ("v 1.#QNAN 0 -1.#IND\n" + V + "f 2 3 4 5", ()),
    "a NaN that no face uses": ("v nan -nan(ind) inf\n" + V + "f 2 3 4 5", ()),
    "normals": ("vn nan nan nan\nvn 1.#QNAN 0 0\n" + V + "f 1//1 2//1 3//2 4//2", (f"{LEFT}normals",)),
    "colours": (V.replace("\n", " .1 .2 .3\n") + "f 1 2 3 4", (f"{LEFT}colours or weights of vertices",)),
    "weights": (V.replace("\n", " 1.0\n") + "f 1 2 3 4", (f"{LEFT}colours or weights of vertices",)),
    "names and materials": (
        "mtllib my file.mtl\no a#b\ng floor  slab\ns off\nusemtl Mat 1\n" + V + "f 1 2 3 4",
        (f"{LEFT}materials, smoothing",),
    ),
    "lines and points": (V + "l 1 2 3\np 1\nf 1 2 3 4", (f"{LEFT}lines, points",)),
    "curves": (
        "vp 0 0\ncstype bezier\ndeg 3\n" + V + "curv 0 1 1 2 3 4\nparm u 0 1\nend\nf 1 2 3 4",
        (f"{LEFT}curves",),
    ),
    "display": (
        "bevel off\nc_interp off\nd_interp off\nlod 2\nmg 1 2\nshadow_obj a.obj\ntrace_obj b.obj\n"
        "maplib a b\nusemap m\nctech cspace 1\nstech curv 1 2\n" + V + "f 1 2 3 4",
        (f"{LEFT}texture maps",),
    ),
    "skins and creases": (
        V + "vw 1 2 .5\nt crease 2/1/0 1 2 3.0\nf 1 2 3 4",
        (f"{LEFT}subdivision tags, skin weights",),
    ),
    "latin-1 names": ("g pi\xe8ce\n" + V + "f 1 2 3 4", ()),
}


@pytest.mark.parametrize("what", OBJ)
def test_an_obj_gives_its_rectangle(tmp_path: Path, what: str) -> None:
    text, notes = OBJ[what]
    surface = read(tmp_path, "a.OBJ", text.encode("latin-1" if "latin-1" in what else "utf-8"))
    np.testing.assert_array_equal(surface.vertices.T, POINTS)
    np.testing.assert_array_equal(surface.triangles.T, [[0, 1, 2], [0, 2, 3]])
    assert surface.notes == notes


BAD_OBJ = {
    "a word for a corner": (V + "\nf 1 2 x", "line 6 = f 1 2 x: expected whole numbers from 1 on"),
    "after lines that go on": ("# a\\\nv 0 \\\n0 1\n" + V + "f 1 2 3.5", "line 8 = f 1 2 3.5: expected whole"),
    "corner 0": (V + "f 1 2 3\nf 0 1 2", "line 6 = f 0 1 2: expected whole numbers from 1 on, or negative ones"),
    "underscores": (V + "f 1 2 0_3", "line 5 = f 1 2 0_3: expected whole numbers"),
    "a slash alone": (V + "f 1 /2 3", "line 5 = f 1 /2 3: expected whole numbers"),
    "out of range": (V + "f 1 2 3\nf 1 2 5", "line 6, f index = 5: expected a vertex of the 4 in the file"),
    "far out of range": (V + "f 1 2 1234567890123456", "line 5, f index = 1234567890123456: expected a vertex"),
    "too far back": (V + "f 1 2 -5", "line 5, f index = -5: expected a vertex of the 4 in the file"),
    "a NaN that a face uses": ("v nan 0 0\n" + V + "f 1 2 3", "line 1, v = (nan, 0.0, 0.0): expected finite"),
    "decimal commas": ("v 0,5 0 1\n" + V, "line 1 = v 0,5 0 1: expected three numbers"),
    "UTF-16": ("\ufeff" + V, "text = UTF-16: expected ASCII or UTF-8"),
    "two coordinates": (V + "v 1 2\n", "line 5 = v 1 2: expected v x y z"),
    "free-form surfaces": (V + "f 1 2 3\nsurf 0 1 0 1 1 2 3 4", "polygons: free-form surfaces are not supported"),
    "other files": ("call other.obj\n" + V, "line 1 = call other.obj: expected one file"),
    "upper case": ((V + "f 1 2 3").upper(), "line 5 = F 1 2 3: expected lower-case v and f lines"),
    "no keyword": ("solid thing\n", "line 1 = solid thing: expected a keyword of the format"),
    "points alone": (V + "p 1 2 3 4", "faces = 0: expected at least one face of three corners or more"),
    "lines of two corners alone": (V + "f 1 2", "faces = 0: expected at least one face of three corners or more"),
}


@pytest.mark.parametrize("what", BAD_OBJ)
def test_a_bad_obj_is_one_line_with_its_line(tmp_path: Path, what: str) -> None:
    text, said = BAD_OBJ[what]
    with pytest.raises(InputError) as caught:
        read(tmp_path, "a.obj", text.encode("utf-16-le" if what == "UTF-16" else "utf-8"))
    assert str(caught.value).startswith("a.obj: ")
    assert said in str(caught.value)
    assert str(caught.value).isprintable()


VERTEX = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
FACE = "element face 1\nproperty list uchar int vertex_indices\n"
ROWS = [f"{x} {y} {z}" for x, y, z in POINTS]


def ascii_ply(head: str, *rows: str, order: str = "ascii") -> str:
    return f"ply\nformat {order} 1.0\n{head}end_header\n" + "\n".join(rows) + "\n"


def packed(order: str, *values: tuple[str, float]) -> bytes:
    return b"".join(struct.pack(order + kind, value) for kind, value in values)


def binary_ply(order: str, end: str = "\n") -> bytes:
    name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    corners = [("B", 4), *(("i", k) for k in range(4))]
    body = packed(order, *(("f", x) for point in POINTS for x in point), *corners)
    return ascii_ply(VERTEX + FACE, order=name)[:-1].replace("\n", end).encode() + body


STRIPS = "element tristrips 1\nproperty list int int vertex_indices\n"
UV = FACE + "property list uchar float texcoord\n"
PLY = {
    "ascii": (ascii_ply(VERTEX + FACE, *ROWS, "4 0 1 2 3"), ()),
    "little-endian": (binary_ply("<"), ()),
    "big-endian": (binary_ply(">"), ()),
    "a header that ends its lines with CR": (binary_ply("<", "\r"), ()),
    "CR and LF": (binary_ply(">", "\r\n"), ()),
    "text after its end": (ascii_ply(VERTEX + FACE, *ROWS, "4 0 1 2 3", "# end"), ()),
    "blanks in its header": (ascii_ply(VERTEX + FACE, *ROWS, "4 0 1 2 3").replace("\nprop", "  \nprop"), ()),
    "faces first": (ascii_ply(FACE + VERTEX, "4 0 1 2 3", *ROWS), ()),
    "texture coordinates of faces": (
        ascii_ply(VERTEX + UV.replace("face 1", "face 2"), *ROWS, "3 0 1 2 6 0 0 1 0 1 1", "3 0 2 3 6 0 0 1 1 0 1"),
        ("shapes alone are read, without face texcoord",),
    ),
    "some faces without texture": (
        ascii_ply(VERTEX + UV.replace("face 1", "face 2"), *ROWS, "3 0 1 2 6 0 0 1 0 1 1", "3 0 2 3 0"),
        ("shapes alone are read, without face texcoord",),
    ),
    "texture first": (
        ascii_ply(
            VERTEX + "element face 1\nproperty list uchar float t\nproperty int k\n" + FACE.split("\n", 1)[1],
            *ROWS,
            "2 .5 .5 7 4 0 1 2 3",
        ),
        ("shapes alone are read, without face t k",),
    ),
    "lists of vertices": (
        ascii_ply(
            VERTEX + "property list uchar int near\n" + FACE,
            *[f"{r} {k} {'1 ' * k}" for k, r in enumerate(ROWS)],
            "4 0 1 2 3",
        ),
        ("shapes alone are read, without vertex near",),
    ),
    "NaN of other spellings in normals": (
        ascii_ply(
            VERTEX + "property float nx\nproperty float ny\n" + FACE,
            *[r + " -nan(ind) 1.#QNAN" for r in ROWS],
            "4 0 1 2 3",
        ),
        ("shapes alone are read, without vertex nx ny",),
    ),
    "one strip": (ascii_ply(VERTEX + STRIPS, *ROWS, "4 1 2 0 3"), ()),
    "strips that begin again": (ascii_ply(VERTEX + STRIPS, *ROWS, "8 0 1 2 -1 2 3 0 -1"), ()),
    "strips joined by repeated corners": (ascii_ply(VERTEX + STRIPS, *ROWS, "9 0 1 2 2 2 0 0 2 3"), ()),
    "more words on lines than its header says": (
        ascii_ply(VERTEX + UV.replace("face 1", "face 2"), *ROWS, "3 0 1 2 0 3 1 1 1", "3 0 2 3 0 3 1 1 1", "the end"),
        (
            "2 lines with more words than the header says: their ends left out",
            "shapes alone are read, without face texcoord",
        ),
    ),
    "records over lines": (ascii_ply(VERTEX + FACE, " ".join(ROWS).replace(" ", "\n"), "4 0", "1 2", "3"), ()),
    "edges and other elements": (
        ascii_ply(
            VERTEX + FACE + "element edge 1\nproperty int a\nproperty int b\nelement empty 9\n",
            *ROWS,
            "4 0 1 2 3",
            "0 1",
        ),
        ("shapes alone are read, without edge a b",),
    ),
}


@pytest.mark.parametrize("what", PLY)
def test_a_ply_gives_its_rectangle(tmp_path: Path, what: str) -> None:
    data, notes = PLY[what]
    surface = read(tmp_path, "a.ply", data)
    np.testing.assert_array_equal(surface.vertices.T, POINTS)
    assert area(surface) == 12
    a, b, c = (surface.vertices[:, corner] for corner in surface.triangles)
    assert (np.cross(b - a, c - a, axis=0)[1] > 0).all()  # every front looks up, in strips too
    assert surface.triangles.shape == (3, 2)
    assert surface.notes == notes


BAD_PLY = {
    "points alone": (ascii_ply(VERTEX, *ROWS), "elements = vertex: expected vertex (x, y, z), and face or tristrips"),
    "no face": (ascii_ply(VERTEX + FACE.replace("1", "0", 1), *ROWS), "faces = 0: expected at least one face"),
    "two vertex elements": (ascii_ply(VERTEX + VERTEX + FACE), "elements = vertex vertex face: expected vertex (x"),
    "upper-case axes": (
        ascii_ply(VERTEX.upper().lower().replace("float x", "float X") + FACE),
        "vertex properties = X y z",
    ),
    "indices that are floats": (
        ascii_ply(VERTEX + FACE.replace("int v", "float v"), *ROWS, "4 0 1 2 3"),
        "face properties = vertex_indices: expected a list vertex_indices or vertex_index of whole numbers",
    ),
    "counts that are floats": (ascii_ply(VERTEX + FACE.replace("uchar", "float")), "header line = property list float"),
    "64-bit indices": (ascii_ply(VERTEX + FACE.replace("int v", "int64 v")), "header line = property list uchar int64"),
    "half an index": (ascii_ply(VERTEX + FACE, *ROWS, "4 0 1 2.5 3"), "face 0 = 2.5: expected whole numbers"),
    "a line too short, others too long": (
        ascii_ply(VERTEX + FACE, *ROWS[:3], "0 0", "4 0 1 2 3 7 7"),
        "vertex 3 = 2 words on its line: expected the 3 that its header and lists ask for",
    ),
    "half a count": (ascii_ply(VERTEX + FACE, *ROWS, "3.5 0 1 2 3"), "face 0 = 3.5: expected whole numbers"),
    "a word among indices": (ascii_ply(VERTEX + FACE, *ROWS, "4 0 1 two 3"), "face 0 = nan: expected whole numbers"),
    "an element whose name cannot be printed": (
        ascii_ply(VERTEX + "element \x01ids 1\nproperty list uchar int k\n" + FACE, *ROWS, "x 0 1", "3 0 1 2"),
        "\\x01ids 0 = nan: expected whole numbers",
    ),
    "a negative count": (ascii_ply(VERTEX + FACE, *ROWS, "-4 0 1 2 3"), "face 0 = a negative count"),
    "a word in a position": (
        ascii_ply(VERTEX + FACE, *ROWS[:3], "0 zero -2", "4 0 1 2 3"),
        "vertex 3 = (0.0, nan, -2.0): expected finite coordinates",
    ),
    "out of range": (ascii_ply(VERTEX + FACE, *ROWS, "4 0 1 2 4"), "face 0 index = 4: expected a vertex of the 4"),
    "cut short": (binary_ply("<")[:-1], "file = ends inside its 1 face records: expected as many as its header says"),
    "cut before its last number": (
        ascii_ply(VERTEX + FACE + "property uchar flags\n", order="binary_little_endian")[:-1].encode()
        + binary_ply("<").split(b"end_header\n")[1],
        "file = ends inside its 1 face records: expected as many as its header says",
    ),
    "cut in a list nobody reads": (
        ascii_ply(VERTEX + UV, *ROWS, "4 0 1 2 3 6 0 0 1"),
        "face 0 = 9 words on its line: expected the 12 that its header and lists ask for",
    ),
    "another format": (ascii_ply(VERTEX + FACE).replace("ascii", "utf8"), "header line = format utf8 1.0"),
    "a header without an end": ("ply\nformat ascii 1.0\n" + VERTEX, "header = ply"),
}


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_nan_that_signals_is_told_like_any_other(tmp_path: Path, order: str) -> None:
    data = binary_ply(order)
    start = data.index(b"end_header\n") + len(b"end_header\n")
    data = data[:start] + struct.pack(order + "I", 0x7F800001) + data[start + 4 :]
    with pytest.raises(InputError, match=r"vertex 0 = \(nan, .*expected finite coordinates"):
        read(tmp_path, "a.ply", data)


@pytest.mark.parametrize("what", BAD_PLY)
def test_a_bad_ply_is_one_line(tmp_path: Path, what: str) -> None:
    data, said = BAD_PLY[what]
    with pytest.raises(InputError) as caught:
        read(tmp_path, "a.ply", data)
    assert said in str(caught.value)
    assert str(caught.value).isprintable()


def test_records_of_every_length_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three lists a record, of random lengths, in three encodings: the same faces."""
    rng = np.random.default_rng(4)
    head = f"element vertex 9\n{VERTEX.split(chr(10), 1)[1]}element face 300\nproperty list uchar float t\n"
    head += "property list ushort int vertex_index\nproperty double w\nproperty list uint uchar c\n"
    points = rng.integers(-9, 9, (9, 3)).tolist()
    faces = [rng.integers(0, 9, rng.integers(3, 7)).tolist() for _ in range(300)]
    extra = [(rng.integers(0, 4), rng.integers(0, 3)) for _ in faces]
    rows = [" ".join(map(str, p)) for p in points]
    rows += [
        " ".join(map(str, [t, *[0.5] * t, len(face), *face, 1.5, c, *[7] * c]))
        for face, (t, c) in zip(faces, extra, strict=True)
    ]
    surfaces = [read(tmp_path, "a.ply", ascii_ply(head, *rows))]
    for order, name in (("<", "binary_little_endian"), (">", "binary_big_endian")):
        body = packed(order, *(("f", x) for p in points for x in p))
        for face, (t, c) in zip(faces, extra, strict=True):
            body += packed(order, ("B", t), *[("f", 0.5)] * t, ("H", len(face)), *(("i", k) for k in face))
            body += packed(order, ("d", 1.5), ("I", c), *[("B", 7)] * c)
        surfaces.append(read(tmp_path, "a.ply", ascii_ply(head, order=name)[:-1].encode() + body))
    assert surfaces[0].triangles.shape[1] == sum(len(face) - 2 for face in faces)
    for surface in surfaces[1:]:
        np.testing.assert_array_equal(surface.triangles, surfaces[0].triangles)
        np.testing.assert_array_equal(surface.vertices, surfaces[0].vertices)
    monkeypatch.setattr(ply_reader, "MAX_UNEVEN", 100)
    with pytest.raises(InputError, match="records of unequal length"):
        read(tmp_path, "a.ply", ascii_ply(head, *rows))


def test_a_scene_says_what_its_mesh_holds_besides(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text("vn 0 1 0\n" + V + "f 1//1 2//1 3//1 4//1\nf 1 1 2\nf 1 2\n")
    (tmp_path / "s.test").write_text("size 8 8\ncamera 0 3 6 0 0 0 0 1 0 40\nintegrator direct\nmesh m.obj\n")
    scene = read_scene(tmp_path / "s.test")
    assert [warning.split("s.test:")[1] for warning in scene.warnings] == [
        "4: m.obj: flat faces alone are read, without its normals",
        "4: m.obj: 1 face of fewer than three corners: dropped",
        "4: m.obj: 1 triangle without area: dropped",
    ]


def test_one_long_word_widens_no_other(tmp_path: Path) -> None:
    """A table as wide as its longest word would take 40 GB here."""
    head, rows = VERTEX.replace("4", "10000"), ["1 2 3"] * 9996
    surface = read(tmp_path, "a.ply", ascii_ply(head + FACE, *ROWS, *rows, "4 0 1 2 3", "1" * 1_000_000))
    assert area(surface) == 12
    surface = read(tmp_path, "a.obj", V + "v 1 2 3\n" * 9996 + f"v 0.{'0' * 1_000_000}1 0 0\nf 1 2 3 4")
    assert area(surface) == 12


def test_a_file_that_stands_in_many_places_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr(state, "read_mesh_file", lambda path: asked.append(path.name) or read_mesh_file(path))
    (tmp_path / "m.obj").write_text(V + "f 1 2 3 4\n")
    places = "".join(f"translate 0 {k} 0\nmesh m.obj\n" for k in range(1, 4))
    (tmp_path / "s.test").write_text("size 8 8\ncamera 0 3 6 0 0 0 0 1 0 40\n" + places)
    meshes = read_scene(tmp_path / "s.test").meshes
    assert asked == ["m.obj"]
    assert [mesh.vertices[1].tolist() for mesh in meshes] == [[1.0] * 4, [3.0] * 4, [6.0] * 4]
