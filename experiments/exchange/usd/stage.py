"""A USD stage as a scene of ours."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nusselt.mitsuba_bridge.own.backs import two_sided
from nusselt.renderer.errors import InputError
from nusselt.renderer.lights import Light
from nusselt.renderer.scene import Scene
from nusselt.renderer.surfaces import Ellipsoid, Mesh

from .camera import camera_of
from .library import Tf, Usd, UsdGeom, UsdLux, UsdUtils
from .lights import light_of, mesh_light
from .prims import Notes, Prim
from .shapes import SHAPES, ellipsoid_of, triangles_of
from .surfaces import material_of

_WITHIN = re.compile(r"Error in '[^']*' at line \d+ in file \S+ : '(.+?) ?'(?= Error in|$)")
"""An error, without where in usd-core's own sources it was raised; what follows from it comes after."""
SHADING = ("Material", "Shader", "NodeGraph", "GeomSubset")
PASSED = ("", "Xform", "Scope", "Camera", "RenderSettings", "RenderProduct", "RenderVar", *SHADING)
"""Prims that are no surface and no light."""


@dataclass
class _Read:
    """What a stage has given so far."""

    file: str
    as_diffuse: bool
    notes: Notes = field(default_factory=Notes)
    meshes: list[tuple[Mesh, bool]] = field(default_factory=list)
    balls: list[tuple[Ellipsoid, bool]] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    cameras: list[Prim] = field(default_factory=list)
    settings: list[Prim] = field(default_factory=list)

    def take(self, prim: Prim) -> None:
        """One prim."""
        if prim.kind == "Camera":
            self.cameras.append(prim)
        elif prim.kind == "RenderSettings":
            self.settings.append(prim)
        elif prim.kind in SHAPES:
            self._shape(prim)
        elif prim.usd.HasAPI(UsdLux.LightAPI):
            self.lights.append(light_of(prim, self.notes))
        elif prim.kind not in PASSED:
            raise prim.refused(prim.kind, f"{', '.join(SHAPES)}, lights and cameras")

    def _shape(self, prim: Prim) -> None:
        lit = prim.usd.HasAPI(UsdLux.MeshLightAPI) or prim.usd.HasAPI(UsdLux.LightAPI)
        for child in prim.usd.GetChildren():
            if child.GetTypeName() == "GeomSubset":
                raise Prim(child, self.file).refused("a part of a mesh", "one material for each mesh")
        if lit and prim.kind == "Mesh":
            self.lights.append(mesh_light(prim, *triangles_of(prim, self.notes), self.notes))
            return
        if lit:
            raise prim.refused("a shape that shines", "RectLight, DiskLight, SphereLight, or MeshLightAPI on a Mesh")
        material, both = material_of(prim, self.as_diffuse, self.notes), bool(prim.get("doubleSided", False))
        if prim.kind == "Sphere":
            self.balls.append((ellipsoid_of(prim, material), both))
            return
        vertices, faces = triangles_of(prim, self.notes)
        if faces.size:
            self.meshes.append((Mesh(vertices, faces, material), both))

    def _settings(self) -> Prim | None:
        """Those that the stage names, else the first."""
        named = self.settings[0].usd.GetStage().GetMetadata("renderSettingsPrimPath") if self.settings else ""
        for settings in self.settings:
            if str(settings.usd.GetPath()) == named:
                return settings
        return next(iter(self.settings), None)

    def _camera(self, settings: Prim | None) -> Prim:
        """The one that the settings name, else the first."""
        names = list(settings.usd.GetRelationship("camera").GetForwardedTargets()) if settings else []
        for camera in self.cameras:
            if not names or camera.usd.GetPath() in names:
                return camera
        raise (settings or self.cameras[0]).refused(f"camera {names[0]}", "the path of a Camera that is shown")

    def scene(self, name: str) -> Scene:
        """All of it."""
        if not self.cameras:
            raise InputError("camera", "none", "one UsdGeomCamera", self.file)
        settings = self._settings()
        chosen = self._camera(settings)
        camera, width, height = camera_of(chosen, settings, self.notes)
        for other in self.cameras:
            if other is not chosen:
                self.notes.say(other, f"is left out: {chosen.usd.GetPath()} is the camera")
        scene = Scene(
            width=width,
            height=height,
            camera=camera,
            meshes=tuple(mesh for mesh, _ in self.meshes),
            ellipsoids=tuple(body for body, _ in self.balls),
            lights=tuple(self.lights),
            light_samples=16,
            stratify=True,
            name=name,
            warnings=tuple(self.notes.lines.values()),
        )
        sides = [both for _, both in (*self.meshes, *self.balls)]
        return scene.with_(two_sided=two_sided(scene, sides, "doubleSided", self.file))


def scene_of(path: Path, as_diffuse: bool) -> Scene:
    """The scene of a file's stage, at the earliest time that its attributes have; what usd-core warns of is said."""
    listener = UsdUtils.CoalescingDiagnosticDelegate()  # while there is one, nothing goes to the standard error
    try:
        scene = _scene_of(Usd.Stage.Open(str(path)), path, as_diffuse)
        warned = [f"{path}: usd-core: {_warning(problem)}" for problem in listener.TakeUncoalescedDiagnostics()]
        return scene.with_(warnings=(*scene.warnings, *dict.fromkeys(warned)))
    except (Tf.ErrorException, UnicodeDecodeError) as error:  # values of a damaged file are unpacked late
        raise InputError("scene", "not opened", f"what usd-core opens: {_line(error)}", str(path)) from None


def _scene_of(stage: Any, path: Path, as_diffuse: bool) -> Scene:
    for problem in stage.GetCompositionErrors():
        raise InputError("scene", "not composed", f"what usd-core composes: {_line(problem)}", str(path))
    read = _Read(str(path), as_diffuse)
    for prim in _seen(stage, read):
        try:
            read.take(prim)
        except InputError as error:
            raise (error if error.where else error.at(prim.place)) from None
    return read.scene(path.stem)


def _line(problem: object) -> str:
    """usd-core's words, which may quote a damaged file."""
    try:
        words = " ".join(str(problem).split())
        first = _WITHIN.search(words)
        return (first[1] if first else words)[:200]
    except UnicodeDecodeError:
        return "UTF-8"


def _warning(problem: Any) -> str:
    """Without addresses in memory."""
    return re.sub(r" ?<0x[0-9a-f]+>", "", " ".join(problem.commentary.split()))[:200]


def _seen(stage: Any, read: _Read) -> Iterator[Prim]:
    """Every prim that is shown, those of instances too."""
    walk = iter(Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()))
    for usd in walk:
        prim = Prim(usd, read.file)
        imageable = UsdGeom.Imageable(usd)
        if imageable and imageable.ComputeVisibility(Usd.TimeCode.EarliestTime()) == UsdGeom.Tokens.invisible:
            read.notes.say(prim, "is invisible: left out")
            walk.PruneChildren()
        elif imageable and imageable.ComputePurpose() in (UsdGeom.Tokens.proxy, UsdGeom.Tokens.guide):
            walk.PruneChildren()
        else:
            yield prim
