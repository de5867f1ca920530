"""The Polygon File Format (Turk 1994): ASCII, little- and big-endian.

Lists make records of unequal length. Where all records are as long as the first their starts are known at once;
otherwise they are found by pointer doubling: from the map "next record, were one to start here" to the set of all
starts in log2(n) array steps. Places are bytes in a binary file and words in an ASCII one.

An ASCII file has a record a line. Some programs write more words on a line than their header says (MeshLab, colours of
faces): the words to spare are left out, and said. Where records go over lines the file is one stream of words.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.words import count

from .ply_header import FACES, Element, Property, read_header
from .surface import Surface, from_polygons
from .words import floats

MAX_UNEVEN = 1 << 26
"""Bytes or words of an element with records of unequal length."""
_END = Property("", "")

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class _Body:
    """What follows the header, as numbers at places."""

    def __init__(self, data: bytes, start: int, order: str, words: Floats | None = None) -> None:
        self._order, self._data, self.place = order, data, start if order else 0
        self.words = floats([] if order else data[start:].split()) if words is None else words
        self.end = len(data) if order else self.words.size

    def size(self, kind: str) -> int:
        return np.dtype(kind).itemsize if self._order else 1

    def at(self, places: Integers, kind: str) -> Floats:
        """Numbers of a type; a place past the end gives the last one."""
        if not self._order:
            return self.words[np.minimum(places, self.end - 1)]
        last = self.end - np.dtype(kind).itemsize
        numbers = np.ndarray((last + 1,), dtype=self._order + kind, buffer=self._data, strides=(1,))
        with np.errstate(invalid="ignore"):  # NaNs that signal: what reads them finds them
            return numbers[np.minimum(places, last)].astype(np.float64)


def read_ply(data: bytes) -> Surface:
    """The surface in a PLY file's bytes; raises InputError naming what is wrong."""
    order, elements, start = read_header(data)
    body = _Body(data, start, order)
    words, spare = (body.words, 0) if order else _record_a_line(elements, body, data[start:])
    note = f"{count(spare, 'line')} with more words than the header says: their ends left out"
    return _surface(elements, _Body(data, start, order, words), (note,) if spare else ())


def _surface(elements: list[Element], body: _Body, notes: tuple[str, ...]) -> Surface:
    faces, left_out = [], []
    for element in elements:
        read = _records(element, body)
        if element.name == "vertex":
            vertices = np.stack([read[axis][1] for axis in "xyz"])
        elif element.name in FACES:
            ((counts, values),) = read.values()
            corners = _whole(element, counts, values)
            faces.append(_strips(counts, corners) if element.name == "tristrips" else (counts, corners))
        shape = element.shape.values()
        spare = [p.name for p in element.properties if p not in shape]
        left_out += [f"{element.name} {' '.join(spare)}"] * bool(spare)
    if left_out:
        shown = ", ".join(left_out)[:200].encode("unicode_escape").decode("ascii")
        notes += (f"shapes alone are read, without {shown}",)
    counts, corners = (np.concatenate(parts) for parts in zip(*faces, strict=True))
    return from_polygons(vertices, counts, corners, corners, "vertex {}".format, "face {}".format, notes)


def _record_a_line(elements: list[Element], body: _Body, text: bytes) -> tuple[Floats, int]:
    """The words of an ASCII file that records take, and how many lines have more."""
    lengths = np.array([len(line.split()) for line in text.splitlines()], dtype=np.int64)
    lengths = lengths[lengths > 0]
    starts, spare, change = np.cumsum(lengths) - lengths, 0, np.zeros(body.end + 1, dtype=np.int64)
    listed = [element for element in elements if element.count and element.properties]
    has_as_many = lengths.size == sum(element.count for element in listed)
    for element in listed:
        begin, given = starts[: element.count], lengths[: element.count]
        ends = _ends(element, body, begin)
        if begin.size < element.count or (ends > begin + given).any():
            if has_as_many:
                k = int((ends > begin + given).argmax())
                accepted = f"the {ends[k] - begin[k]} that its header and lists ask for"
                raise InputError(f"{element.name} {k}", f"{given[k]} words on its line", accepted)
            return body.words, 0
        spare += int((ends < begin + given).sum())
        change[begin] += 1
        change[ends] -= 1
        starts, lengths = starts[element.count :], lengths[element.count :]
    return body.words[np.cumsum(change)[:-1] > 0], spare


def _records(element: Element, body: _Body) -> dict[str, tuple[Integers, Floats]]:
    """For each property of the shape its counts (of a list) and its numbers, record after record."""
    shape = element.shape.values()
    read = {p.name: (np.empty(0, dtype=np.int64), np.empty(0)) for p in shape}
    if not element.count or not element.properties:
        return read
    least = sum(body.size(p.count_kind or p.kind) for p in element.properties)
    short = InputError("file", f"ends inside its {element.count} {element.name} records", "as many as its header says")
    if body.end - body.place < element.count * least:
        raise short
    for part, given, places in _walk(element, body, _starts(element, body, short)):
        counts = np.empty(0, dtype=np.int64)
        if part.count_kind:
            counts = _whole(element, np.ones(element.count, dtype=np.int64), given)
            if counts.min() < 0:
                raise InputError(f"{element.name} {int(counts.argmin())}", "a negative count", "0 or more entries")
            if places[-1] + counts[-1] * body.size(part.kind) > body.end:
                raise short
        if part in shape:
            if part.count_kind:
                within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
                places = np.repeat(places, counts) + within * body.size(part.kind)
            read[part.name] = counts, body.at(places, part.kind)
    body.place = int(places[-1])
    if body.place > body.end:
        raise short
    return read


def _walk(element: Element, body: _Body, starts: Integers) -> Iterator[tuple[Property, Floats, Integers]]:
    """Each property of records that start there: its counts if it is a list, its places; last, where they end."""
    at, none = starts, np.empty(0)
    for part in element.properties:
        if not part.count_kind:
            yield part, none, at
            at = at + body.size(part.kind)
            continue
        counts = body.at(at, part.count_kind)
        at = at + body.size(part.count_kind)
        yield part, counts, at
        at = at + np.nan_to_num(counts).clip(0, body.end).astype(np.int64) * body.size(part.kind)
    yield _END, none, at


def _ends(element: Element, body: _Body, starts: Integers) -> Integers:
    for _, _, places in _walk(element, body, starts):
        last = places
    return last


def _starts(element: Element, body: _Body, short: InputError) -> Integers:
    """Where each record starts; bounded by the body's end even where its counts are nonsense."""
    first = np.array([body.place])
    stride = int(_ends(element, body, first)[0]) - body.place
    if body.place + element.count * stride <= body.end:
        starts = body.place + np.arange(element.count) * stride
        if (_ends(element, body, starts) == starts + stride).all():
            return starts
    size = body.end - body.place
    if size > MAX_UNEVEN:
        raise InputError(element.name, "records of unequal length", f"at most {MAX_UNEVEN} bytes of such records")
    following = _ends(element, body, body.place + np.arange(size)) - body.place
    step = np.append(np.minimum(following, size), size)  # the end stays where it is
    starts = np.zeros(1, dtype=np.int64)
    while starts.size < element.count:
        starts = np.concatenate((starts, step[starts]))
        step = step[step]
    if starts[element.count - 1] >= size:
        raise short
    return body.place + starts[: element.count]


def _whole(element: Element, counts: Integers, values: Floats) -> Integers:
    """Numbers of lists as whole numbers."""
    bad = np.flatnonzero(values % 1 != 0)
    if bad.size:
        record = int(np.searchsorted(np.cumsum(counts), bad[0], side="right"))
        raise InputError(f"{element.name} {record}", float(values[bad[0]]), "whole numbers")
    return values.clip(-(2.0**53), 2.0**53).astype(np.int64)


def _strips(counts: Integers, corners: Integers) -> tuple[Integers, Integers]:
    """The triangles of strips: -1 begins a new strip, every second triangle of one is turned, repeated corners join."""
    at = np.arange(corners.size)
    start = np.maximum(
        np.repeat(np.cumsum(counts) - counts, counts), np.maximum.accumulate(np.where(corners == -1, at + 1, 0))
    )
    k = np.flatnonzero(start[2:] <= at[:-2])
    odd = (k - start[k]) % 2
    a, b, c = corners[k + odd], corners[k + 1 - odd], corners[k + 2]
    good = (a != b) & (b != c) & (c != a)
    return np.full(int(good.sum()), 3), np.stack((a, b, c))[:, good].T.ravel()
