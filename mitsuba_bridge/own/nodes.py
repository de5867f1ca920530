"""What a Mitsuba file says: plugins, their properties and what they hold, each with its place in the file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.mitsuba_bridge.llvm import backend
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.reference import ask
from nusselt.mitsuba_bridge.temporary import temporary_folder
from nusselt.renderer.errors import InputError
from nusselt.renderer.validation import Vec3
from nusselt.renderer.vectors import Floats, Ints

from .source import Source

SECONDS = 120.0
"""That Mitsuba may take to parse a file and load its meshes."""


@dataclass(frozen=True)
class Node:
    """A plugin in a Mitsuba file.

    Parameters
    ----------
    index : int
        Among the file's nodes.
    kind, plugin, name : str
        As Mitsuba has them: Shape, rectangle; its id, or an empty string.
    place : str
        FILE:LINE.
    properties : mapping
        Kind and value of each, by name.
    children : tuple of (str, Node)
        What it holds, by the names of its properties.
    mesh : (vertices, faces, normals, uv), optional
        (3, n) float64, (3, m) int64, (3, n) and (2, n) float64 of a shape that Mitsuba has loaded; no normals if it is
        faceted.
    texels : (3, h, w) float64, optional
        Of a picture that Mitsuba has read, linear.
    unbuilt : InputError, optional
        Of a whole file: why Mitsuba parses it but does not make a scene of it.
    """

    index: int
    kind: str
    plugin: str
    name: str
    place: str
    properties: Mapping[str, tuple[str, Any]]
    children: tuple[tuple[str, Node], ...] = ()
    mesh: tuple[Floats, Ints, Floats, Floats] | None = field(default=None, repr=False)
    texels: Floats | None = field(default=None, repr=False)
    unbuilt: InputError | None = field(default=None, repr=False)

    @property
    def title(self) -> str:
        """What messages call it."""
        return f"{self.plugin} {self.name!r}" if self.name and not self.name.startswith("_") else self.plugin

    def refused(self, value: object, accepted: str) -> InputError:
        """The error that refuses it."""
        return InputError(self.title, value, accepted, self.place)

    def only(self, *names: str) -> None:
        """Refuse properties of other names: none is left out without a word."""
        for name in self.properties:
            if name not in names:
                raise self.refused(name, "its " + ", ".join(names) if names else "no property")

    def of_kind(self, kind: str) -> Iterator[Node]:
        """Its children of a kind."""
        return (child for _, child in self.children if child.kind == kind)

    def holds(self, *kinds: str) -> None:
        """Refuse children of other kinds: media, textures where none is read."""
        for _, child in self.children:
            if child.kind not in kinds:
                raise child.refused(child.plugin, f"no {child.kind.lower()} in {self.title}")

    def plain(self, *names: str) -> None:
        """Refuse children of these names: textures where none is read."""
        for held, child in self.children:
            if held in names:
                raise child.refused(child.plugin, f"no {held} of {self.title}")

    def _get(self, name: str, kinds: tuple[str, ...], accepted: str, default: Any) -> Any:
        kind, value = self.properties.get(name, ("", None))
        if not kind:
            if default is None:
                raise self.refused(f"no {name}", f"{name}, {accepted}")
            return default
        if kind not in kinds or value is None:
            raise self.refused(f"{name}: a {kind.lower()}", f"{name}, {accepted}")
        return value

    def number(self, name: str, default: float | None = None) -> float:
        """A number."""
        return float(self._get(name, ("Float", "Integer"), "a number", default))

    def word(self, name: str, default: str) -> str:
        """A string."""
        return str(self._get(name, ("String",), "a string", default))

    def flag(self, name: str) -> bool:
        """A boolean, false unless said."""
        return bool(self._get(name, ("Bool",), "true or false", False))

    def point(self, name: str, default: Vec3 | None = None) -> Vec3:
        """A point or direction."""
        x, y, z = self._get(name, ("Vector",), "three numbers", default)
        return float(x), float(y), float(z)

    def matrix(self, name: str = "to_world") -> Floats:
        """An affine transform (4, 4)."""
        found = np.array(self._get(name, ("Transform",), "a transform", np.eye(4).tolist()))
        if not np.isfinite(found).all() or (found[3] != (0, 0, 0, 1)).any():
            raise self.refused(f"{name} that is not affine", "an affine transform")
        return found

    def colour(self, name: str, default: Vec3 | None = None, emits: bool = False) -> Vec3:
        """An RGB colour, or a number for all channels; textures and spectra over wavelengths are refused.

        A constant spectrum is that number of a reflectance; one that ``emits`` is refused, since white is no 1 1 1.
        """
        for held, child in self.children:
            if held == name:
                raise child.refused(child.plugin, f"a colour, one for all of {self.title}")
        kinds = ("Color", "Float") if emits else ("Color", "Spectrum", "Float")
        value = self._get(name, kinds, "a colour (rgb), or one number for all channels", default)
        r, g, b = (value,) * 3 if isinstance(value, int | float) else value
        return float(r), float(g), float(b)


def read_nodes(*sources: Source) -> list[Node | InputError]:
    """The scene node of each source, with all that it holds, or the error that Mitsuba has with it.

    Raises
    ------
    InputError
        If Mitsuba cannot run here, or ends on one of them.
    """
    job = {"task": "parse_own", "sources": [asdict(source) for source in sources]}
    try:
        with temporary_folder() as folder:
            arrays, _ = ask(job, Path(folder), backend(), SECONDS)
    except ReferenceUnavailable as problem:
        raise InputError("scene", _line(problem), "a scene that Mitsuba loads", sources[0].file) from None
    told = json.loads(arrays["told"].astype(np.uint8).tobytes())
    return [
        _tree(entry, number, arrays, source.file)
        for number, (entry, source) in enumerate(zip(told, sources, strict=True))
    ]


def _line(problem: object) -> str:
    return " ".join(str(problem).split())


def _not_loaded(said: str, path: str) -> InputError:
    """Mitsuba's own words, at the line that it names."""
    found = re.search(r"\(line (\d+), col \d+\): (.*)", said)
    where, words = (f"{path}:{found[1]}", found[2]) if found else (path, said)
    return InputError("scene", "not loaded", f"what Mitsuba loads: {words}", where)


def _tree(told: dict[str, Any], number: int, arrays: dict[str, Floats], path: str) -> Node | InputError:
    if "error" in told:
        return _not_loaded(_line(told["error"]), path)

    def made(index: int) -> Node:
        entry = told["nodes"][index]
        properties = {name: tuple(value) for name, value in entry["properties"].items()}
        held = {name: value for name, (kind, value) in properties.items() if kind == "ResolvedReference"}
        mesh = None
        key = f"{number}-{index}"
        if f"vertices{key}" in arrays:
            vertices, faces, normals, uv = (arrays[f"{what}{key}"] for what in ("vertices", "faces", "normals", "uv"))
            mesh = vertices, faces.astype(np.int64), normals, uv
        return Node(
            index,
            entry["type"],
            entry["plugin"],
            entry["id"],
            entry["place"],
            {name: value for name, value in properties.items() if name not in held},
            tuple((name, made(k)) for name, k in held.items()),
            mesh,
            arrays.get(f"texels{key}"),
        )

    why = told.get("unbuilt")
    return replace(made(0), unbuilt=_not_loaded(_line(why), path)) if why else made(0)
