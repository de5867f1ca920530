"""The Polygon File Format (Turk 1994): ASCII, little- and big-endian.

Lists make records of unequal length. In a file of triangles alone all records are equal, and the whole
element is one array; otherwise the start of every record is found by pointer doubling: from the map "next
record, were one to start here" to the set of all starts in log2(n) array steps.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError

from .surface import Surface, fans

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
LISTS = ("vertex_indices", "vertex_index")
MAX_UNEVEN = 1 << 26
"""Bytes or words of an element with records of unequal length."""


@dataclass
class _Element:
    name: str
    count: int
    scalars: list[tuple[str, str]] = field(default_factory=list)
    list_types: tuple[str, str] | None = None  # of the count, of the entries
    list_name: str = ""
    before: int = 0  # scalars before the list


def read_ply(data: bytes) -> Surface:
    """The surface in a PLY file's bytes; raises InputError naming what is wrong."""
    order, elements, start = _header(data)
    words = np.array(data[start:].split(), dtype="S") if order == "" else None
    body: Any = np.frombuffer(data, dtype=np.uint8)[start:] if words is None else words
    vertices = faces = None
    for element in elements:
        if element.name == "vertex":
            columns, body = _table(element, order, body)
            vertices = np.stack([np.asarray(columns[axis], dtype=np.float64) for axis in "xyz"])
        elif element.name == "face":
            *faces, body = _lists(element, order, body)
        elif element.list_types is None:
            _, body = _table(element, order, body)
        else:
            *_, body = _lists(element, order, body)
    if vertices is None or faces is None:
        raise InputError("elements", " ".join(e.name for e in elements) or "none", "vertex (x, y, z) and face")
    return fans(vertices, *faces)


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    if not data.startswith(b"ply") or (end := data.find(b"end_header")) < 0 or (stop := data.find(b"\n", end)) < 0:
        raise InputError("header", data[:20].decode("ascii", "replace"), "ply ... end_header")
    order: str | None = None
    elements: list[_Element] = []
    for line in data[:end].decode("ascii", "replace").splitlines()[1:]:
        words = line.split()
        try:
            if not words or words[0] in ("comment", "obj_info"):
                continue
            if words[0] == "format":
                order = FORMATS[words[1]]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2])))
                if elements[-1].count < 0 or elements[-1].count > len(data):
                    raise ValueError
            elif words[0] == "property":
                _property(elements[-1], words[1:])
            else:
                raise ValueError
        except (KeyError, IndexError, ValueError):
            raise InputError("header line", line, "a PLY format, element or property") from None
    if order is None:
        raise InputError("header", "no format", "format ascii, binary_little_endian or binary_big_endian")
    for element in elements:
        names = [name for name, _ in element.scalars]
        if element.name == "vertex" and (element.list_types or not {"x", "y", "z"} <= set(names)):
            raise InputError("vertex properties", " ".join(names), "numbers, with x, y and z among them")
        if element.name == "face" and element.list_name not in LISTS:
            raise InputError("face properties", element.list_name or "no list", " or ".join(LISTS))
    return order, elements, stop + 1


def _property(element: _Element, words: list[str]) -> None:
    if words[0] != "list":
        name = f"{len(element.scalars)}" if words[1] in dict(element.scalars) else words[1]
        element.scalars.append((name, TYPES[words[0]]))
        return
    if element.list_types:
        raise ValueError  # two lists in one record
    element.list_types, element.list_name = (TYPES[words[1]], TYPES[words[2]]), words[3]
    if any("f" in kind for kind in element.list_types):
        raise ValueError
    element.before = len(element.scalars)


def _short(element: _Element) -> InputError:
    return InputError("file", f"ends inside its {element.count} {element.name} records", "as many as its header says")


def _numbers(words: NDArray[Any], kind: type, element: _Element) -> NDArray[Any]:
    try:
        return words.astype(kind)
    except (ValueError, OverflowError):
        raise InputError(element.name, "a word that is no number", "numbers alone") from None


def _table(element: _Element, order: str, body: Any) -> tuple[Any, Any]:
    """Columns by name of an element without lists, and what follows it."""
    if order == "":
        width = len(element.scalars)
        if body.size < element.count * width:
            raise _short(element)
        grid = _numbers(body[: element.count * width], float, element).reshape(element.count, width)
        return dict(zip([n for n, _ in element.scalars], grid.T, strict=True)), body[element.count * width :]
    record = np.dtype([(name, order + kind) for name, kind in element.scalars])
    size = element.count * record.itemsize
    if body.size < size:
        raise _short(element)
    return body[:size].view(record), body[size:]


def _lists(element: _Element, order: str, body: Any) -> tuple[NDArray[np.int64], NDArray[np.int64], Any]:
    """Counts (f,) and entries of the one list of every record, and what follows the element.

    Units are bytes in a binary file and words in an ASCII one.
    """
    if element.list_types is None:
        raise InputError(f"{element.name} properties", "no list", " or ".join(LISTS))
    kinds = [kind for _, kind in element.scalars]
    sizes = [1 if order == "" else np.dtype(kind).itemsize for kind in (*kinds, *element.list_types)]
    lead, tail = sum(sizes[: element.before]), sum(sizes[element.before : len(kinds)])
    count_size, entry_size = sizes[-2:]
    if element.count == 0:
        empty = np.empty(0, dtype=np.int64)
        return empty, empty, body
    counts_at = _reader(element, element.list_types[0], order, body)
    fixed = lead + count_size + tail
    if body.size < fixed:
        raise _short(element)
    first = int(counts_at(np.array([lead]))[0])
    stride = fixed + first * entry_size
    starts = np.arange(element.count) * stride
    if first < 0 or body.size < element.count * stride or (counts_at(starts + lead) != first).any():
        starts = _record_starts(element, counts_at, body.size, lead, fixed, entry_size)
    counts = counts_at(starts + lead)
    if counts.min() < 0:
        raise InputError(f"{element.name} {int(counts.argmin())}", "a negative count", "lists of 0 or more entries")
    end = int(starts[-1] + fixed + counts[-1] * entry_size)
    if end > body.size:
        raise _short(element)
    within = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
    at = np.repeat(starts + lead + count_size, counts) + within * entry_size
    return counts, _reader(element, element.list_types[1], order, body)(at), body[end:]


def _reader(element: _Element, kind: str, order: str, body: Any) -> Any:
    """A function that reads integers at offsets (n,) into the body."""
    if order == "":
        return lambda at: np.nan_to_num(_numbers(body[at], float, element), nan=-1).clip(-1, 2**53).astype(np.int64)
    size = np.dtype(kind).itemsize
    return lambda at: body[at[:, None] + np.arange(size)].view(order + kind).ravel().astype(np.int64)


def _record_starts(
    element: _Element, counts_at: Any, size: int, lead: int, fixed: int, entry_size: int
) -> NDArray[np.int64]:
    """Where each record starts, by pointer doubling."""
    if size > MAX_UNEVEN:
        raise InputError("faces", "of unequal numbers of corners", f"at most {MAX_UNEVEN} bytes of such records")
    reach = size - fixed + 1
    step = np.full(size + 1, size)  # the end is its own successor
    counts = np.maximum(counts_at(np.arange(reach) + lead), 0)
    step[:reach] = np.minimum(np.arange(reach) + fixed + counts * entry_size, size)
    starts = np.zeros(1, dtype=np.int64)
    while starts.size < element.count:
        starts = np.concatenate((starts, step[starts]))
        step = step[step]
    starts = starts[: element.count]
    if starts[-1] >= reach:
        raise _short(element)
    return starts
