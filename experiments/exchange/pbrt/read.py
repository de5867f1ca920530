"""A pbrt-v4 file as a scene of ours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.mesh_files import find_inside
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Material, Mesh
from nusselt.renderer.vectors import Floats

from .camera import View, film_of, lens_of
from .lights import light_of
from .shapes import shape_of
from .state import DEFAULT, MOVES, State, move
from .tokens import Directive, directives, read_text, tokens

Made = TypeVar("Made")
NO_PART = ("Sampler", "PixelFilter", "Accelerator")
"""Directives that change no pixel's mean: pixels are centres, or areas with `--pixel-rule area`."""
OPTIONS = ("Camera", "Film", "Integrator", "WorldBegin", *NO_PART)
"""Directives that pbrt has before WorldBegin alone, as VERIFY_OPTIONS in its scene.cpp says."""
WORLD = (
    *("AttributeBegin", "AttributeEnd", "ObjectBegin", "ObjectEnd", "ObjectInstance", "ReverseOrientation", "Shape"),
    *("Material", "MakeNamedMaterial", "NamedMaterial", "AreaLightSource", "LightSource"),
)
"""Those that it has after it alone (VERIFY_WORLD)."""
DEEPEST = 16
"""Of files that include files."""
SPECTRAL = (
    "pbrt multiplies spectra, and we red, green and blue: where light and surface are coloured both, colours differ"
)


@dataclass
class _Reader:
    """What the directives have said so far."""

    file: str
    folder: Path
    as_diffuse: bool
    state: State = field(default_factory=State)
    stack: list[tuple[Directive, State]] = field(default_factory=list)
    named: dict[str, Material] = field(default_factory=dict)
    objects: dict[str, list[tuple[Directive, State]]] = field(default_factory=dict)
    current: str = ""
    shapes: list[tuple[Directive, State]] = field(default_factory=list)
    sources: list[tuple[Directive, State]] = field(default_factory=list)
    camera: tuple[Directive, Floats] | None = None
    film: Directive | None = None
    notes: list[str] = field(default_factory=list)
    in_world: bool = False

    def include(self, path: Path, depth: int = 0) -> None:
        """Read a file into the state."""
        name = str(path)
        for directive in directives(list(tokens(read_text(path, name), name))):
            if directive.name in ("Include", "Import"):
                if depth == DEEPEST:
                    raise directive.refused(directive.kind, f"files that include files at most {DEEPEST} deep")
                kept = self.state
                try:
                    inner = find_inside(self.folder, directive.kind)
                except InputError as error:
                    raise InputError(directive.name, error.value, error.accepted, directive.where) from None
                self.include(inner, depth + 1)
                if directive.name == "Import":  # what an imported file sets ends with it
                    self.state = kept
            else:
                self.take(directive)

    def take(self, directive: Directive) -> None:
        """One directive."""
        name = directive.name
        if name in (OPTIONS if self.in_world else WORLD):
            found, right = ("after", "before") if self.in_world else ("before", "after")
            raise InputError(name, f"{found} WorldBegin", f"one {right} it, as pbrt has it", directive.where)
        if name in MOVES:
            self.state = move(self.state, directive)
        elif name in NO_PART:
            pass
        elif name in ACTS:
            ACTS[name](self, directive)
        else:
            raise InputError("directive", name, ", ".join((*MOVES, *ACTS)), directive.where)

    def lens(self, directive: Directive) -> None:
        self.camera = directive, self.state.transform

    def take_film(self, directive: Directive) -> None:
        self.film = directive

    def world(self, directive: Directive) -> None:
        self.state, self.in_world = replace(self.state, transform=np.eye(4)), True

    def integrator(self, directive: Directive) -> None:
        if directive.kind != "path" or directive.number("maxdepth", 5) != 1:
            self.notes.append(f"{directive.where}: Integrator {directive.kind}: direct light alone is judged")

    def space(self, directive: Directive) -> None:
        if directive.kind != "srgb":
            raise directive.refused(directive.kind, "srgb")

    def push(self, directive: Directive) -> None:
        self.stack.append((directive, self.state))

    def pop(self, directive: Directive) -> None:
        kind = directive.name.removesuffix("End")
        if not self.stack or self.stack[-1][0].name != f"{kind}Begin":
            raise InputError(directive.name, "nothing to end", f"an open {kind}Begin", directive.where)
        _, saved = self.stack.pop()
        self.state = replace(self.state, transform=saved.transform) if kind == "Transform" else saved

    def begin_object(self, directive: Directive) -> None:
        if self.current:
            raise directive.refused("an object in an object", "ObjectEnd before it")
        self.push(directive)
        self.current = directive.kind
        self.objects[self.current] = []

    def end_object(self, directive: Directive) -> None:
        self.pop(directive)
        self.current = ""

    def instance(self, directive: Directive) -> None:
        if directive.kind not in self.objects or self.current:
            raise directive.refused(directive.kind, "an object that was begun and ended before")
        here = self.state.transform
        self.shapes += [(shape, replace(s, transform=here @ s.transform)) for shape, s in self.objects[directive.kind]]

    def reverse(self, directive: Directive) -> None:
        self.state = replace(self.state, inside_out=not self.state.inside_out)

    def area(self, directive: Directive) -> None:
        self.state = replace(self.state, area=directive)

    def light(self, directive: Directive) -> None:
        self.sources.append((directive, self.state))

    def shape(self, directive: Directive) -> None:
        if self.current and self.state.area is not None:
            raise directive.refused("a light in an object", "a light that stands alone")
        (self.objects[self.current] if self.current else self.shapes).append((directive, self.state))

    def material(self, directive: Directive) -> None:
        self.state = replace(self.state, material=self._surface(directive, directive.kind))

    def make_named(self, directive: Directive) -> None:
        self.named[directive.kind] = self._surface(directive, directive.word("type", ""))

    def use_named(self, directive: Directive) -> None:
        if directive.kind not in self.named:
            raise directive.refused(directive.kind, "a material of MakeNamedMaterial before it")
        self.state = replace(self.state, material=self.named[directive.kind])

    def _surface(self, directive: Directive, kind: str) -> Material:
        if kind != "diffuse":
            if not self.as_diffuse:
                raise directive.refused(kind, "diffuse; --as-diffuse puts it in the place of others")
            self.notes.append(f"{directive.where}: {kind} is taken for diffuse")
            found = directive.parameters.get("reflectance")
            has_colour = found is not None and found.kind == "rgb"
            return Material(diffuse=directive.colour("reflectance", DEFAULT) if has_colour else (DEFAULT,) * 3)
        directive.only("reflectance", "type")
        diffuse = directive.colour("reflectance", DEFAULT)
        if max(diffuse) > 1:
            raise directive.refused(f"reflectance {max(diffuse):g}", "at most 1, as pbrt has it", "reflectance")
        return Material(diffuse=diffuse)


ACTS: dict[str, Callable[[_Reader, Directive], None]] = {
    "Camera": _Reader.lens,
    "Film": _Reader.take_film,
    "Integrator": _Reader.integrator,
    "ColorSpace": _Reader.space,
    "WorldBegin": _Reader.world,
    "AttributeBegin": _Reader.push,
    "AttributeEnd": _Reader.pop,
    "TransformBegin": _Reader.push,
    "TransformEnd": _Reader.pop,
    "ObjectBegin": _Reader.begin_object,
    "ObjectEnd": _Reader.end_object,
    "ObjectInstance": _Reader.instance,
    "ReverseOrientation": _Reader.reverse,
    "Material": _Reader.material,
    "MakeNamedMaterial": _Reader.make_named,
    "NamedMaterial": _Reader.use_named,
    "AreaLightSource": _Reader.area,
    "LightSource": _Reader.light,
    "Shape": _Reader.shape,
}


def read_pbrt(path: Path, *, as_diffuse: bool = False) -> Scene:
    """Read a pbrt-v4 scene file, and those that it includes from its folder.

    Surfaces are two-sided, as pbrt's are. pbrt's space is left-handed: a file whose camera does not mirror it gives an
    image that ours would give mirrored, so that its world is mirrored in x here.

    Parameters
    ----------
    path : Path
    as_diffuse : bool
        Put diffuse surfaces in the place of those that are none, with a warning each.

    Raises
    ------
    InputError
        For what is no direct lighting of our kinds, by its line.
    """
    reader = _Reader(str(path), path.parent, as_diffuse)
    reader.include(path)
    if reader.camera is None or not reader.in_world:
        missing = "Camera" if reader.camera is None else "WorldBegin"
        raise InputError(missing, "missing", "a pbrt scene: Camera, WorldBegin and shapes", str(path))
    if reader.stack:
        begun = reader.stack[-1][0]
        raise InputError(begun.name, "never ended", "an end for each beginning", begun.where)
    width, height = film_of(reader.film)
    directive, transform = reader.camera
    view = _at(directive, lens_of, directive, transform, width, height)
    return _scene(reader, view, (width, height), path.stem)


def _at(directive: Directive, make: Callable[..., Made], *given: object) -> Made:
    """What is made of a directive; an error in its numbers names its line."""
    try:
        return make(*given)
    except InputError as error:
        raise (error if error.where else error.at(directive.where)) from None


def _scene(reader: _Reader, view: View, size: tuple[int, int], name: str) -> Scene:
    made = [_at(d, shape_of, d, state, view.world, reader.folder) for d, state in reader.shapes]
    lamps = [_at(d, light_of, d, view.world @ state.transform) for d, state in reader.sources]
    notes = [*reader.notes, *view.notes]
    coloured = any(
        len(set(material.diffuse)) > 1 for material in (m.material for m in made if isinstance(m, Mesh | Ellipsoid))
    )
    lights = (*lamps, *(m for m in made if not isinstance(m, Mesh | Ellipsoid)))
    if coloured and any(len(set(light.colour)) > 1 for light in lights):
        notes.append(f"{reader.file}: {SPECTRAL}")
    return Scene(
        width=size[0],
        height=size[1],
        camera=view.camera,
        meshes=tuple(m for m in made if isinstance(m, Mesh)),
        ellipsoids=tuple(m for m in made if isinstance(m, Ellipsoid)),
        lights=lights,
        light_samples=16,
        stratify=True,
        two_sided=True,
        name=name,
        warnings=tuple(dict.fromkeys(notes)),
    )
