"""Wavefront OBJ (Object Files, version 3.0): its ``v`` and ``f`` lines."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError

from .surface import Surface, from_polygons
from .words import NUMBER, floats

MAX_LINES = 1 << 24
LEFT_OUT = {
    b"vn": "normals",
    b"vt": "texture coordinates",
    b"usemtl": "materials",
    b"usemap": "texture maps",
    b"s": "smoothing",
    b"l": "lines",
    b"p": "points",
    b"curv": "curves",
    b"t": "subdivision tags",
    b"vw": "skin weights",
}
"""Keywords of what a file has besides flat faces, and what notes call it."""
SILENT = (
    *(b"g", b"o", b"mtllib", b"maplib"),  # names
    *(b"mg", b"bevel", b"c_interp", b"d_interp", b"lod", b"shadow_obj", b"trace_obj", b"ctech", b"stech"),  # display
    *(b"cstype", b"deg", b"bmat", b"step", b"vp", b"curv2", b"parm", b"trim", b"hole", b"scrv", b"sp", b"end", b"con"),
)
"""Keywords that change no flat face; the last line of them belongs to curves and free-form surfaces."""
REFUSED = {
    **dict.fromkeys(
        (b"surf", b"bzp", b"bsp", b"res", b"cdc", b"cdp"), "polygons: free-form surfaces are not supported"
    ),
    **dict.fromkeys((b"call", b"csh"), "one file: commands that bring in others are not supported"),
    **dict.fromkeys((b"V", b"F"), "lower-case v and f lines"),
}
_COMMENT = re.compile(rb"#(?<=[ \t\n]#)[^\n]*")  # not the # of 1.#QNAN; looked back from a # it is found fast
_CONTINUED = re.compile(rb"\\[ \t]*\n")
_CORNER = re.compile(rb"([+-]?\d{1,18})(?:/\S*)?")
_AFTER_SLASH = re.compile(rb"/\S*")
_NOT_A_NUMBER = re.compile(rb"[+-]?(nan|ind|inf|1\.#)\S*", re.IGNORECASE)


def read_obj(data: bytes) -> Surface:
    """The surface in an OBJ file's bytes; raises InputError with the number of the first bad line."""
    lines, numbers = _lines(data)
    kinds = np.array([(line.split(None, 1) or (b"",))[0] for line in lines], dtype="S16")
    is_vertex, is_face = kinds == b"v", (kinds == b"f") | (kinds == b"fo")  # fo: an older name
    notes = _others(kinds, is_vertex | is_face, lines, numbers)
    vertex_lines, face_lines = numbers[is_vertex], numbers[is_face]
    vertices, has_more = _vertices([lines[i] for i in np.flatnonzero(is_vertex).tolist()], vertex_lines)
    counts, corners = _corners([lines[i] for i in np.flatnonzero(is_face).tolist()], face_lines)
    seen = np.repeat(np.cumsum(is_vertex)[is_face], counts)  # negative numbers count back from here
    return from_polygons(
        vertices,
        counts,
        np.where(corners > 0, corners - 1, corners + seen),
        corners,
        lambda vertex: f"line {vertex_lines[vertex]}, v",
        lambda face: f"line {face_lines[face]}, f",
        _left_out([*["colours or weights of vertices"] * has_more, *notes]),
    )


def _left_out(names: list[str]) -> tuple[str, ...]:
    return (f"flat faces alone are read, without its {', '.join(names)}",) if names else ()


def _lines(data: bytes) -> tuple[list[bytes], NDArray[np.int64]]:
    """Logical lines without comments, and the number of each one's first line in the file."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputError("text", "UTF-16", "ASCII or UTF-8")
    data = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if (count := data.count(b"\n")) >= MAX_LINES:
        raise InputError("lines", count, f"fewer than {MAX_LINES}")
    # A carriage return, white space that no longer occurs, stands for a line that goes on: lines keep their numbers.
    data = _CONTINUED.sub(b"\r", _COMMENT.sub(b"", b"\n" + data)[1:])
    lines = data.split(b"\n")
    lengths = np.ones(len(lines), dtype=np.int64)
    if b"\r" in data:
        lengths += [line.count(b"\r") for line in lines]
    return lines, np.cumsum(lengths) - lengths + 1


def _others(
    kinds: NDArray[np.bytes_], known: NDArray[np.bool_], lines: list[bytes], numbers: NDArray[np.int64]
) -> list[str]:
    """What the file has besides, in words; an error for what cannot be left out."""
    others = set(np.unique(kinds[~known]).tolist()) - {b""}
    for kind in sorted(others - LEFT_OUT.keys() - set(SILENT)):
        at = int(np.flatnonzero(kinds == kind)[0])
        accepted = REFUSED.get(kind, "a keyword of the format, and polygons (v and f lines)")
        raise InputError(f"line {numbers[at]}", _shown(lines[at]), accepted)
    return [name for kind, name in LEFT_OUT.items() if kind in others]


def _shown(line: bytes) -> str:
    return line[:40].decode("ascii", "replace").strip()


def _vertices(lines: list[bytes], numbers: NDArray[np.int64]) -> tuple[NDArray[np.float64], bool]:
    """Positions (3, v), and whether something follows them: a weight or a colour."""
    words = [line.split() for line in lines]
    counts = np.array([len(line) - 1 for line in words], dtype=np.int64)
    odd = np.flatnonzero((counts < 3) | (counts > 7))
    if odd.size:
        raise InputError(f"line {numbers[odd[0]]}", _shown(lines[odd[0]]), "v x y z")
    values = floats([word for line in words for word in line[1:4]]).reshape(-1, 3)
    for at in np.flatnonzero(np.isnan(values).any(axis=1)).tolist():
        if not all(NUMBER.fullmatch(word) or _NOT_A_NUMBER.fullmatch(word) for word in words[at][1:4]):
            raise InputError(f"line {numbers[at]}", _shown(lines[at]), "three numbers")
    return values.T.copy(), bool((counts > 3).any())


def _corners(lines: list[bytes], numbers: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """How many corners each face has (f,), and their numbers as the file gives them, face after face."""
    words = [line.split()[1:] for line in lines]
    counts = np.array([len(line) for line in words], dtype=np.int64)
    values = floats(_AFTER_SLASH.sub(b"", b" ".join(word for line in words for word in line)).split())
    good = values.size == counts.sum() and bool(((np.abs(values) < 2**53) & (values % 1 == 0) & (values != 0)).all())
    if not good:
        for line, number, given in zip(words, numbers.tolist(), lines, strict=True):
            if not all((corner := _CORNER.fullmatch(word)) and int(corner[1]) for word in line):
                raise InputError(f"line {number}", _shown(given), "whole numbers from 1 on, or negative ones")
    return counts, values.astype(np.int64)
