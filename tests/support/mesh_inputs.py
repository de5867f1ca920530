"""OBJ and PLY files for the fuzz: right ones of many kinds, changed, cut, and made up from the grammar."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.mesh_files import obj
from nusselt.renderer.mesh_files.ply_header import TYPES

NUMBERS = (
    *(
        "0",
        "1",
        "2",
        "3",
        "4",
        "-1",
        "-2",
        "+.5",
        "1e308",
        "-1e308",
        "1e-200",
        "5e-324",
        "nan",
        "-nan(ind)",
        "inf",
        "1e999",
    ),
    *(
        "1.#QNAN",
        "999999999",
        "1_0",
        "9" * 80,
        "1" + "0" * 20,
        "-0",
        ".",
        "1,5",
        "x",
        "é",
        "\x00",
        "255",
        "0.25",
        "2147483647",
    ),
)
CORNERS = (
    "1",
    "2",
    "3",
    "4",
    "5",
    "6",
    "7",
    "-1",
    "-3",
    "1/1",
    "2//2",
    "3/1/2",
    "0",
    "9",
    "1.5",
    "2/",
    "/2",
    "-99",
    "1e9",
)
OBJ_SEEDS = (
    b"v 0 0 1\nv 4 0 1\nv 4 0 -2\nv 0 0 -2\nf 1 2 3 4\n",
    b"\xef\xbb\xbf# made here\r\nmtllib a.mtl\r\nvn 0 1 0\r\nv 0 0 1 .1 .2 .3\r\n"
    b"v 4 0 1 1 1 1\r\nv 4 0 -2 0 0 0\r\nf 1//1 2//1 3//1\r\n",
    b"v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 3 4 5 6 1 2 # an L\nf 1 2 3\nf 1 2\nl 1 2\np 1\n",
    b"v 0 0 0\nv 2 1 0\nv 2 0 0\nv 0 2 1\nf 1 2 3 4\nf -1 \\\n-2 -3\nfo 1 2 3\ns off\ng a b\nusemtl c\nt x\nvw 1 2 3\n",
    b"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\nv nan 1 1\n"
    b"f 1 2 3 4 1 5 6 7 8 5\nbevel on\n",
)
PLY_HEADS = (
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
    "property list uchar int vertex_indices\n",
    "comment a\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\n"
    "property list uchar short near\nelement face 3\nproperty list ushort uint vertex_index\nproperty float q\n"
    "property list uchar float texcoord\n",
    "element tristrips 2\nproperty list int int vertex_indices\nelement vertex 5\nproperty float x\nproperty float y\n"
    "property float z\nproperty float nx\nelement edge 1\nproperty int a\nproperty int b\n",
    "obj_info b\nelement none 3\nelement other 2\nproperty list char ushort ids\nelement face 2\nproperty int k\n"
    "property list uchar uchar vertex_index\nelement vertex 6\nproperty short x\nproperty int8 y\nproperty float64 z\n",
)
WORDS = (
    *(
        "element",
        "property",
        "list",
        "vertex",
        "face",
        "tristrips",
        "x",
        "y",
        "z",
        "vertex_indices",
        "end_header",
        "ply",
        "format",
    ),
    *(
        "ascii",
        "binary_little_endian",
        "binary_big_endian",
        "0",
        "1",
        "7",
        "-1",
        "99999999",
        "1e3",
        "comment",
        "int64",
        *TYPES,
    ),
)


def _record(lines: list[str], order: str, rng: np.random.Generator) -> bytes | list[str]:
    """One record of an element's property lines, right or nearly so; words in ASCII, bytes in binary."""
    values: list[tuple[str, float]] = []
    for line in lines:
        words = line.split()
        if words[1] != "list":
            values.append((words[1], rng.integers(-3, 4) if rng.random() < 0.9 else 100))
            continue
        count = int(rng.integers(0, 8)) if rng.random() < 0.5 else 3
        values.append((words[2], count))
        values += [(words[3], -1 if rng.random() < 0.03 else rng.integers(0, 4)) for _ in range(count)]
    if not order:
        return [str(rng.choice(NUMBERS)) if rng.random() < 0.01 else f"{value:g}" for _, value in values]
    return b"".join(np.array(value % 256).astype(order + TYPES[kind]).tobytes() for kind, value in values)


def _ply(rng: np.random.Generator) -> bytes:
    order = ("", "<", ">")[int(rng.integers(3))]
    name = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = PLY_HEADS[int(rng.integers(len(PLY_HEADS)))]
    body = []
    for element in head.split("element ")[1:]:
        first, *lines = [line for line in element.split("\n") if line]
        body += [_record(lines, order, rng) for _ in range(int(first.split()[1]))]
    end = ("\n", "\r\n", "\r")[int(rng.choice(3, p=(0.7, 0.15, 0.15)))]
    text = f"ply\nformat {name} 1.0\n{head}end_header\n"
    tail = b"".join(body) if order else "\n".join(" ".join(row) for row in body).encode()
    return _with_words(text, rng).replace("\n", end).encode() + tail


def _with_words(text: str, rng: np.random.Generator) -> str:
    """A header with a word changed, or a line dropped or doubled, now and then."""
    lines = text.split("\n")
    while rng.random() < 0.35:
        at = int(rng.integers(len(lines)))
        words = lines[at].split(" ")
        kind = int(rng.integers(4))
        if kind < 2:
            words[int(rng.integers(len(words)))] = str(rng.choice(WORDS))
            lines[at] = " ".join(words)
        elif kind == 2:
            lines.insert(at, lines[int(rng.integers(len(lines)))])
        elif len(lines) > 2:
            del lines[at]
    return "\n".join(lines)


def _obj_line(rng: np.random.Generator) -> bytes:
    keywords = [*obj.LEFT_OUT, *obj.SILENT, *obj.REFUSED, b"x", b"#", b"\\"]
    kind = rng.random()
    if kind < 0.3:
        words = ["v", *rng.choice(NUMBERS, int(rng.integers(2, 6)))]
    elif kind < 0.8:
        words = ["f", *rng.choice(CORNERS, int(rng.integers(1, 9)))]
    else:
        words = [keywords[int(rng.integers(len(keywords)))].decode(), *rng.choice(NUMBERS, int(rng.integers(0, 4)))]
    return " ".join(words).encode()


def _obj(rng: np.random.Generator) -> bytes:
    if rng.random() < 0.2:  # random outlines over many corners: concave, crossing, touching, not flat
        points = np.round(rng.normal(size=(30, 3)), int(rng.integers(0, 3))) * [1, 1, rng.integers(0, 2)]
        faces = [rng.integers(1, 31, rng.integers(3, 12)) for _ in range(int(rng.integers(1, 20)))]
        lines = [f"v {x} {y} {z}" for x, y, z in points.tolist()] + [f"f {' '.join(map(str, f))}" for f in faces]
        return "\n".join(lines).encode()
    lines = OBJ_SEEDS[int(rng.integers(len(OBJ_SEEDS)))].split(b"\n")
    for _ in range(int(rng.geometric(0.4)) - 1):
        at = int(rng.integers(len(lines)))
        words = lines[at].split(b" ")
        kind = int(rng.integers(5))
        if kind < 2:
            lines.insert(at, _obj_line(rng))
        elif kind == 2 and len(lines) > 1:
            del lines[at]
        elif kind == 3:
            words[int(rng.integers(len(words)))] = str(rng.choice(NUMBERS)).encode()
            lines[at] = b" ".join(words)
        else:
            lines[at:at] = [lines[at]] * int(rng.integers(1, 300))
    return b"\n".join(lines)


def mesh_bytes(kind: str, rng: np.random.Generator) -> bytes:
    """One input: ``obj`` or ``ply``."""
    if rng.random() < 0.02:
        head = b"ply\nformat ascii 1.0\n" if kind == "ply" and rng.random() < 0.5 else b""
        return head + rng.integers(0, 256, int(rng.integers(2000)), dtype=np.uint8).tobytes()
    data = bytearray(_ply(rng) if kind == "ply" else _obj(rng))
    if data and rng.random() < 0.2:
        for _ in range(int(rng.integers(1, 4))):
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
    return bytes(data[: int(rng.integers(len(data) + 1))] if rng.random() < 0.1 else data)
