"""The surface of a prim: UsdPreviewSurface's diffuse colour, or displayColor."""

from __future__ import annotations

from typing import Any

from nusselt.renderer.surfaces import Material
from nusselt.renderer.validation import Vec3

from .library import Usd, UsdGeom, UsdShade
from .prims import Notes, Prim

GREY = (0.18, 0.18, 0.18)
"""Of UsdPreviewSurface, and of what has no colour at all."""
PLAIN = {"metallic": 0.0, "opacity": 1.0, "clearcoat": 0.0}
"""Inputs that must be so for a surface to be diffuse, but for its gloss."""


def material_of(prim: Prim, as_diffuse: bool, notes: Notes) -> Material:
    """What a prim reflects, diffuse, and what it emits, seen alone."""
    _refuse_missing(prim)
    bound, _ = UsdShade.MaterialBindingAPI(prim.usd).ComputeBoundMaterial()
    if not bound:
        return Material(diffuse=_displayed(prim, notes))
    shader = bound.ComputeSurfaceSource()[0]
    place = Prim(bound.GetPrim(), prim.file)
    if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
        name = shader.GetIdAttr().Get() if shader else "no surface"
        if not as_diffuse:
            raise place.refused(str(name), "UsdPreviewSurface; --as-diffuse takes its diffuse colour")
        notes.say(place, f"{name} is taken for diffuse")
        return Material(diffuse=GREY)
    return _preview(Prim(shader.GetPrim(), prim.file), as_diffuse, notes)


def _refuse_missing(prim: Prim) -> None:
    """usd-core passes over a binding to no Material, and takes what is bound above, or nothing."""
    at = prim.usd
    while at and not at.IsPseudoRoot():
        for path in UsdShade.MaterialBindingAPI(at).GetDirectBindingRel().GetTargets():
            if not UsdShade.Material.Get(at.GetStage(), path):
                raise Prim(at, prim.file).refused(f"material:binding <{path}>", "the path of a Material that is there")
        at = at.GetParent()


def _preview(shader: Prim, as_diffuse: bool, notes: Notes) -> Material:
    connected = [name for name in ("diffuseColor", "emissiveColor", *PLAIN) if shader.connected(f"inputs:{name}")]
    unlike = [name for name, value in PLAIN.items() if shader.number(f"inputs:{name}", value) != value]
    for name in (*connected, *unlike):
        if not as_diffuse:
            what = f"{name} that is connected" if name in connected else f"{name} {shader.get(f'inputs:{name}')}"
            raise shader.refused(what, "one diffuse colour; --as-diffuse takes what there is of it")
        notes.say(shader, f"{name} is left out: the surface is taken for diffuse")
    if not _without_gloss(shader):
        notes.say(shader, "the gloss of UsdPreviewSurface is left out: its diffuse colour alone is taken")
    emitted = (0.0, 0.0, 0.0) if "emissiveColor" in connected else shader.colour("inputs:emissiveColor", (0, 0, 0))
    if max(emitted) > 0:
        notes.say(shader, "emissiveColor is seen but lights nothing: MeshLightAPI makes a light of a mesh")
    diffuse = GREY if "diffuseColor" in connected else shader.colour("inputs:diffuseColor", GREY)
    return Material(diffuse=diffuse, emission=emitted)


def _without_gloss(shader: Prim) -> bool:
    """Whether nothing is reflected but at grazing angles, where a black specular colour still is."""
    return bool(shader.get("inputs:useSpecularWorkflow", 0)) and shader.colour(
        "inputs:specularColor", (0.0, 0.0, 0.0)
    ) == (0.0, 0.0, 0.0)


def _displayed(prim: Prim, notes: Notes) -> Vec3:
    api = UsdGeom.PrimvarsAPI(prim.usd)
    opacity, colours = (_values(api, name) for name in ("displayOpacity", "displayColor"))
    if any(value != 1 for value in opacity):
        notes.say(prim, "displayOpacity is left out")
    if not colours:
        notes.say(prim, "without a material: 0.18 grey")
        return GREY
    if len({tuple(colour) for colour in colours}) > 1:
        raise prim.refused("displayColor that varies", "one colour")
    r, g, b = colours[0]
    return float(r), float(g), float(b)


def _values(api: Any, name: str) -> list[Any]:
    """Of a primvar, which what is above a prim may say, and which may go by indices."""
    return list(api.FindPrimvarWithInheritance(name).ComputeFlattened(Usd.TimeCode.EarliestTime()) or ())
