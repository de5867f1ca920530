"""Mitsuba's surfaces as our materials."""

from __future__ import annotations

from dataclasses import dataclass

from nusselt.mitsuba_bridge.lobes import SURFACES
from nusselt.renderer.surfaces import Material
from nusselt.renderer.validation import Vec3

from .nodes import Node
from .textures import texture_of

DEFAULT = 0.5
"""Reflectance where none is said."""
PHONG = next(surface.plugin for surface in SURFACES if surface.module == "phong")
TINTS = ("reflectance", "diffuse_reflectance", "base_color")
"""Properties that a surface's diffuse stand-in takes its colour from, the first that is a colour."""


@dataclass(frozen=True)
class OwnSurface:
    """A material, whether its back reflects, and what was replaced."""

    material: Material
    two_sided: bool
    notes: tuple[str, ...] = ()


def surface_of(shape: Node, as_diffuse: bool) -> OwnSurface:
    """The surface of a shape; a diffuse one of Mitsuba's own default where it names none.

    Parameters
    ----------
    as_diffuse : bool
        Put a diffuse surface in the place of one that is none, and say so.
    """
    held = list(shape.of_kind("BSDF"))
    if len(held) > 1:
        raise shape.refused(f"{len(held)} surfaces", "one")
    if not held:
        lit = any(True for _ in shape.of_kind("Emitter"))
        grey = 0.0 if lit else DEFAULT
        return OwnSurface(Material(diffuse=(grey, grey, grey)), False)
    return _surface(held[0], as_diffuse)


def _surface(node: Node, as_diffuse: bool) -> OwnSurface:
    if node.plugin == "twosided":
        inside = list(node.of_kind("BSDF"))
        if len(inside) != 1:
            raise node.refused(f"{len(inside)} surfaces", "one for both sides")
        found = _surface(inside[0], as_diffuse)
        return OwnSurface(found.material, True, found.notes)
    if node.plugin == "diffuse":
        node.only("reflectance")
        texture = texture_of(node, "reflectance")
        if texture is not None:
            return OwnSurface(Material(texture=texture), False)
        return OwnSurface(Material(diffuse=node.colour("reflectance", (DEFAULT,) * 3)), False)
    if node.plugin == PHONG:
        node.only("kd", "ks", "exponent")
        return OwnSurface(Material(node.colour("kd"), node.colour("ks"), node.number("exponent")), False)
    if not as_diffuse:
        raise node.refused(node.plugin, "diffuse, or twosided diffuse; --as-diffuse puts one in its place")
    note = f"{node.place}: {node.title} is taken for diffuse"
    return OwnSurface(Material(diffuse=_tint(node)), False, (note,))


def _tint(node: Node) -> Vec3:
    for name in TINTS:
        if name in node.properties:
            return node.colour(name)
    return DEFAULT, DEFAULT, DEFAULT
