"""Wavefront OBJ: its ``v`` and ``f`` lines (Wavefront, Object Files, version 3.0)."""

from __future__ import annotations

import re

import numpy as np

from nusselt.renderer.errors import InputError

from .surface import Surface, fans

IGNORED = {b"vn", b"vt", b"g", b"o", b"s", b"usemtl", b"mtllib", b"l", b"p", b"lod", b"usemap", b"maplib"}
_EXTRA = re.compile(rb"/[^\s/]*")


def read_obj(data: bytes) -> Surface:
    """The surface in an OBJ file's bytes; raises InputError with the number of the first bad line."""
    lines = data.split(b"\n")
    kinds = np.array([line.split(None, 1)[0] if line.strip() else b"#" for line in lines], dtype="S8")
    is_vertex, is_face = kinds == b"v", kinds == b"f"
    _refuse_others(kinds, is_vertex | is_face, lines)
    at = np.flatnonzero(is_vertex)
    vertices = _vertices([lines[i] for i in at.tolist()], at)
    at = np.flatnonzero(is_face)
    text = [lines[i] for i in at.tolist()]
    counts = np.array([len(line.split()) - 1 for line in text], dtype=np.int64)
    corners = _integers(text, at)
    seen = np.repeat(np.cumsum(is_vertex)[at], counts)  # negative numbers count back from here
    if not corners.all():
        raise InputError("face index", 0, "numbers from 1 on, or negative ones")
    return fans(vertices, counts, np.where(corners > 0, corners - 1, corners + seen))


def _refuse_others(kinds: np.ndarray, known: np.ndarray, lines: list[bytes]) -> None:
    for kind in np.unique(kinds[~known]).tolist():
        if not kind.startswith(b"#") and kind not in IGNORED:
            line = int(np.flatnonzero(kinds == kind)[0])
            shown = lines[line][:40].decode("ascii", "replace")
            raise InputError(f"line {line + 1}", shown, "polygons (v and f lines)")


def _vertices(text: list[bytes], at: np.ndarray) -> np.ndarray:
    counts = np.array([len(line.split()) - 1 for line in text], dtype=np.int64)
    odd = np.flatnonzero((counts < 3) | (counts > 7))
    if odd.size:
        raise InputError(f"line {int(at[odd[0]]) + 1}", text[odd[0]][:40].decode("ascii", "replace"), "v x y z")
    if (counts == 3).all():
        tokens = [token for line in text for token in line.split()[1:]]
    else:  # a weight or a colour after the position
        tokens = [token for line in text for token in line.split()[1:4]]
    try:
        values = np.array(tokens, dtype="S").astype(np.float64)
    except ValueError:
        raise InputError("v", _first_bad(text, at, float), "three numbers") from None
    return values.reshape(-1, 3).T.copy()


def _integers(text: list[bytes], at: np.ndarray) -> np.ndarray:
    plain = _EXTRA.sub(b"", b"\n".join(text)).replace(b"f", b"")
    try:
        return np.array(plain.split(), dtype="S").astype(np.int64)
    except (ValueError, OverflowError):
        raise InputError("f", _first_bad([_EXTRA.sub(b"", t) for t in text], at, int), "whole numbers") from None


def _first_bad(text: list[bytes], at: np.ndarray, kind: type) -> str:
    for line, number in zip(text, at.tolist(), strict=True):
        try:
            [kind(token) for token in line.split()[1:]]
        except ValueError:
            return f"line {number + 1}, {line[:40].decode('ascii', 'replace').strip()}"
    return "out of range"
