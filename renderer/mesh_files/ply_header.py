"""The header of a PLY file: its format, and its elements with their properties."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

from nusselt.renderer.errors import InputError

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"},
}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
FACES = ("face", "tristrips")
LISTS = ("vertex_indices", "vertex_index")
MAX_HEADER = 1 << 20
_BEGIN = re.compile(rb"ply[ \t]*(\r?\n|\r)")


class Property(NamedTuple):
    """A number, or a list of numbers, of every record of an element."""

    name: str
    kind: str
    count_kind: str = ""  # of a list: the type of its count


@dataclass
class Element:
    """A table: its name, how many records it has, and what each holds."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def shape(self) -> dict[str, Property]:
        """The properties that make a shape, by name: a position's, or the one list of a face or strip."""
        if self.name == "vertex":
            return {p.name: p for p in self.properties if p.name in ("x", "y", "z") and not p.count_kind}
        is_face = self.name in FACES
        lists = [p for p in self.properties if is_face and p.name in LISTS and p.count_kind and "f" not in p.kind]
        return {p.name: p for p in lists[:1]}


def read_header(data: bytes) -> tuple[str, list[Element], int]:
    """Byte order (empty for ASCII), elements, and where the header ends; raises InputError for what cannot be read."""
    begin = _BEGIN.match(data)
    line_end = b"\r" if begin and begin[1] == b"\r" else b"\n"
    end = data.find(line_end + b"end_header", 0, MAX_HEADER)
    if not begin or end < 0 or (stop := data.find(line_end, end + 1)) < 0:
        raise InputError("header", data[:20].decode("ascii", "replace"), "ply ... end_header")
    order: str | None = None
    elements: list[Element] = []
    for line in data[:end].decode("ascii", "replace").splitlines()[1:]:
        words = line.split()
        try:
            if not words or words[0] in ("comment", "obj_info"):
                continue
            if words[0] == "format":
                order = FORMATS[words[1]]
            elif words[0] == "element":
                elements.append(Element(words[1], int(words[2])))
                if not 0 <= elements[-1].count <= len(data):
                    raise ValueError
            elif words[0] == "property" and words[1] == "list":
                elements[-1].properties.append(Property(words[4], TYPES[words[3]], TYPES[words[2]]))
                if "f" in TYPES[words[2]]:
                    raise ValueError
            elif words[0] == "property":
                elements[-1].properties.append(Property(words[2], TYPES[words[1]]))
            else:
                raise ValueError
        except (KeyError, IndexError, ValueError):
            raise InputError("header line", line, "a PLY format, element or property") from None
    if order is None:
        raise InputError("header", "no format", "format ascii, binary_little_endian or binary_big_endian")
    _check(elements)
    return order, elements, stop + 1


def _check(elements: list[Element]) -> None:
    names = [element.name for element in elements]
    if names.count("vertex") != 1 or names.count("face") > 1 or not set(FACES) & set(names):
        accepted = "vertex (x, y, z), and face or tristrips: triangles, not points alone"
        raise InputError("elements", " ".join(names) or "none", accepted)
    for element in elements:
        given = " ".join(p.name for p in element.properties) or "none"
        if element.name == "vertex" and len(element.shape) < 3:
            raise InputError("vertex properties", given, "numbers, with x, y and z among them")
        if element.name in FACES and not element.shape:
            raise InputError(f"{element.name} properties", given, f"a list {' or '.join(LISTS)} of whole numbers")
