"""OBJ and PLY files for the fuzz: right ones of many kinds, changed, cut, and made up from the grammar."""

from __future__ import annotations

import struct
from random import Random

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
CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
"""Of `struct`: capitals have no sign."""
KEYWORDS = [*obj.LEFT_OUT, *obj.SILENT, *obj.REFUSED, b"x", b"#", b"\\"]


def _record(lines: list[str], order: str, rng: Random) -> bytes | list[str]:
    """One record of an element's property lines, right or nearly so; words in ASCII, bytes in binary."""
    values: list[tuple[str, int]] = []
    for line in lines:
        words = line.split()
        if words[1] != "list":
            values.append((words[1], rng.randrange(-3, 4) if rng.random() < 0.9 else 100))
            continue
        count = rng.randrange(8) if rng.random() < 0.3 else 3
        values.append((words[2], count))
        values += [(words[3], -1 if rng.random() < 0.02 else rng.randrange(4)) for _ in range(count)]
    if not order:
        return [rng.choice(NUMBERS) if rng.random() < 0.01 else str(value) for _, value in values]
    codes = [CODES[TYPES[kind]] for kind, _ in values]
    return struct.pack(
        order + "".join(codes), *(v % 256 if code.isupper() else v for code, (_, v) in zip(codes, values, strict=True))
    )


def _ply(rng: Random) -> bytes:
    order = rng.choice(("", "<", ">"))
    name = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = rng.choice(PLY_HEADS)
    body = []
    for element in head.split("element ")[1:]:
        first, *lines = [line for line in element.split("\n") if line]
        body += [_record(lines, order, rng) for _ in range(int(first.split()[1]))]
    end = rng.choices(("\n", "\r\n", "\r"), (0.7, 0.15, 0.15))[0]
    text = f"ply\nformat {name} 1.0\n{head}end_header\n"
    tail = b"".join(body) if order else "\n".join(" ".join(row) for row in body).encode()
    return _with_words(text, rng).replace("\n", end).encode() + tail


def _with_words(text: str, rng: Random) -> str:
    """A header with a word changed, or a line dropped or doubled, now and then."""
    lines = text.split("\n")
    while rng.random() < 0.35:
        at = rng.randrange(len(lines))
        words = lines[at].split(" ")
        kind = rng.randrange(4)
        if kind < 2:
            words[rng.randrange(len(words))] = rng.choice(WORDS)
            lines[at] = " ".join(words)
        elif kind == 2:
            lines.insert(at, rng.choice(lines))
        elif len(lines) > 2:
            del lines[at]
    return "\n".join(lines)


def _obj_line(rng: Random) -> bytes:
    kind = rng.random()
    if kind < 0.3:
        words = ["v", *rng.choices(NUMBERS, k=rng.randrange(2, 6))]
    elif kind < 0.8:
        words = ["f", *rng.choices(CORNERS, k=rng.randrange(1, 9))]
    else:
        words = [rng.choice(KEYWORDS).decode(), *rng.choices(NUMBERS, k=rng.randrange(4))]
    return " ".join(words).encode()


def _outlines(rng: Random) -> bytes:
    """Random polygons over the same corners: concave, crossing, touching, not flat. Each size is cut by itself."""
    digits, height = rng.randrange(3), rng.randrange(2)
    points = [[round(rng.gauss(0, 1), digits) * axis for axis in (1, 1, height)] for _ in range(12)]
    sizes = [rng.randrange(3, 9)] * rng.randrange(1, 7) + [rng.randrange(3, 12)]
    lines = [f"v {x} {y} {z}" for x, y, z in points]
    lines += [f"f {' '.join(map(str, rng.choices(range(1, 13), k=size)))}" for size in sizes]
    return "\n".join(lines).encode()


def _obj(rng: Random) -> bytes:
    if rng.random() < 0.1:
        return _outlines(rng)
    lines = rng.choices(OBJ_SEEDS, (3, 3, 1, 3, 1))[0].split(b"\n")
    while rng.random() < 0.6:
        at = rng.randrange(len(lines))
        words = lines[at].split(b" ")
        kind = rng.randrange(5)
        if kind < 2:
            lines.insert(at, _obj_line(rng))
        elif kind == 2 and len(lines) > 1:
            del lines[at]
        elif kind == 3:
            words[rng.randrange(len(words))] = rng.choice(NUMBERS).encode()
            lines[at] = b" ".join(words)
        else:
            lines[at:at] = [lines[at]] * rng.randrange(1, 300 if rng.random() < 0.1 else 8)
    return b"\n".join(lines)


def mesh_bytes(kind: str, rng: Random) -> bytes:
    """One input: ``obj`` or ``ply``."""
    if rng.random() < 0.02:
        head = b"ply\nformat ascii 1.0\n" if kind == "ply" and rng.random() < 0.5 else b""
        return head + rng.randbytes(rng.randrange(2000))
    data = bytearray(_ply(rng) if kind == "ply" else _obj(rng))
    if data and rng.random() < 0.2:
        for _ in range(rng.randrange(1, 4)):
            data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data[: rng.randrange(len(data) + 1)] if rng.random() < 0.1 else data)
