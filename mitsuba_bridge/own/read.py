"""A Mitsuba file as a scene of ours."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from nusselt.mitsuba_bridge.limits import farthest
from nusselt.mitsuba_bridge.origin import content
from nusselt.renderer.errors import InputError
from nusselt.renderer.geometry.arrays import build_geometry
from nusselt.renderer.lights import Light
from nusselt.renderer.scene import Origin, Scene
from nusselt.renderer.surfaces import Ellipsoid, Mesh
from nusselt.renderer.vectors import Floats

from .backs import two_sided
from .camera import camera_of
from .cylinder import cylinder_note, cylinder_of
from .emitters import area_light, light_of
from .nodes import Node, read_nodes
from .shapes import shape_of
from .source import Source
from .surfaces import OwnSurface, surface_of

Made = TypeVar("Made")
HELD = ("Integrator", "Sensor", "Shape", "Emitter", "BSDF", "Texture", "Sampler", "Film")
SINGLE = 2.0**-24
"""Relative rounding of single precision."""
DIRECT = 2
"""max_depth of a path that ends at the first surface."""


def read_mitsuba(path: Path, *, as_diffuse: bool = False, as_mesh: bool = False) -> Scene:
    """Read a Mitsuba scene file, in any version that the installed Mitsuba reads.

    Parameters
    ----------
    path : Path
    as_diffuse : bool
        Put diffuse surfaces in the place of those that are none, with a warning each.
    as_mesh : bool
        Put meshes in the place of cylinders, likewise.

    Returns
    -------
    Scene
        With its `Origin`, unless something stands in another's place: Mitsuba's own reading of the file is then the
        reference.

    Raises
    ------
    InputError
        If Mitsuba cannot load it, or for what is no direct lighting of our kinds, by name and line.
    """
    return _read(Source.of_file(path), as_diffuse, as_mesh)


def read_mitsuba_dict(given: Mapping[str, Any], *, as_diffuse: bool = False, as_mesh: bool = False) -> Scene:
    """Read what `mi.load_dict` takes: as `read_mitsuba` reads a file, its places those in the dict.

    Raises
    ------
    InputError
        As for a file; also for objects that cannot leave the process that made them.
    """
    return _read(Source.of_dict(given), as_diffuse, as_mesh)


def _read(source: Source, as_diffuse: bool, as_mesh: bool) -> Scene:
    (root,) = read_nodes(source)
    if isinstance(root, InputError):
        raise root
    scene = scene_of(root, source, as_diffuse, as_mesh)
    if root.unbuilt is not None:
        raise root.unbuilt
    return scene


def scene_of(root: Node, source: Source, as_diffuse: bool = False, as_mesh: bool = False) -> Scene:
    """The scene of a source's nodes."""
    sensors = list(root.of_kind("Sensor"))
    if not sensors:
        raise root.refused("no sensor", "one perspective sensor")
    camera, width, height = camera_of(sensors[0])
    notes = [f"{sensor.place}: {sensor.title} is left out: the first sensor is used" for sensor in sensors[1:]]
    if {"near_clip", "far_clip"} & set(sensors[0].properties):
        notes.append(f"{sensors[0].place}: near_clip and far_clip are left out, on both sides")
    for _, child in root.children:
        if child.kind not in HELD:
            raise child.refused(child.kind.lower(), "surfaces, lights and a camera in empty space")
    notes += _integrator(root)
    lights: list[tuple[Node, Light]] = [(node, _at(node, light_of, node)) for node in root.of_kind("Emitter")]
    bodies: list[tuple[Mesh | Ellipsoid, OwnSurface]] = []
    replaced: list[str] = []
    for shape, matrix in _placed(root):
        surface = surface_of(shape, as_diffuse)
        replaced += surface.notes
        emitters = list(shape.of_kind("Emitter"))
        if emitters:
            lights.append((shape, _at(shape, area_light, shape, emitters[0], matrix @ shape.matrix())))
            if max(surface.material.diffuse) > 0:
                notes.append(f"{shape.place}: {shape.title} emits; what it reflects is left out")
        elif shape.plugin == "cylinder" and as_mesh:
            replaced.append(cylinder_note(shape))
            bodies.append((_at(shape, cylinder_of, shape, matrix, surface.material), surface))
        else:
            bodies.append((_at(shape, shape_of, shape, matrix, surface.material), surface))
    lights.sort(key=lambda entry: entry[0].index)
    scene = Scene(
        width=width,
        height=height,
        camera=camera,
        meshes=tuple(body for body, _ in bodies if isinstance(body, Mesh)),
        ellipsoids=tuple(body for body, _ in bodies if isinstance(body, Ellipsoid)),
        lights=tuple(light for _, light in lights),
        light_samples=16,
        stratify=True,
        name=Path(source.file).stem,
        warnings=tuple(dict.fromkeys((*replaced, *notes))),
    )
    _refuse_far(scene, source.file)
    sides = [s.two_sided for b, s in bodies if isinstance(b, Mesh)] + [
        s.two_sided for b, s in bodies if isinstance(b, Ellipsoid)
    ]
    scene = scene.with_(two_sided=two_sided(scene, sides, "twosided", source.file))
    if replaced:
        return scene  # Mitsuba's rendering of what was read is the reference: the file holds something else
    numbers = tuple(node.index for node, _ in lights)
    return scene.with_(origin=Origin(source.file, numbers, content(scene), source.words))


def _at(node: Node, make: Callable[..., Made], *given: Any) -> Made:
    """What is made of a node; an error in its numbers names its place."""
    try:
        return make(*given)
    except InputError as error:
        raise (error if error.where else error.at(node.place)) from None


def _integrator(root: Node) -> Iterator[str]:
    for node in root.of_kind("Integrator"):
        depth = node.properties.get("max_depth", ("", -1))[1]
        if node.plugin not in ("direct", "path") or (node.plugin == "path" and depth != DIRECT):
            yield f"{node.place}: {node.title}: direct light alone is judged"
        if node.flag("hide_emitters"):
            yield f"{node.place}: hide_emitters is left out, on both sides: lights are seen"


def _placed(root: Node) -> Iterator[tuple[Node, Floats]]:
    """Every shape with the transform of the instance that it stands in."""
    for shape in root.of_kind("Shape"):
        if shape.plugin == "shapegroup":
            continue
        if shape.plugin != "instance":
            yield shape, np.eye(4)
            continue
        shape.only("to_world")
        for group in shape.of_kind("Shape"):
            for member in group.of_kind("Shape"):
                if any(True for _ in member.of_kind("Emitter")):
                    raise member.refused("an emitter in an instance", "a light that stands alone")
                yield member, shape.matrix()


def _refuse_far(scene: Scene, where: str) -> None:
    """A scene so far from the origin that Mitsuba's numbers do not hold it."""
    geometry = build_geometry(scene)
    places = np.hstack((geometry.a, geometry.center))
    if not places.size:
        return
    away, size = farthest(geometry), float(np.ptp(places, axis=1).max())
    if away * SINGLE > 1e-5 * size > 0:
        held = f"{size:.3g} units at {away:.3g} from the origin"
        raise InputError("scene", held, "one near the origin: single precision does not hold this one", where)
