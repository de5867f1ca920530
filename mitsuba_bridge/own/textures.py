"""Mitsuba's textures of a diffuse reflectance as ours."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nusselt.renderer.texture import WRAPS, Texture
from nusselt.renderer.vectors import Floats

from .nodes import Node

FILTERS = {"bilinear": True, "nearest": False}
FORMATS = ("variant", "auto")
"""Of a bitmap in Mitsuba's memory: those that round no texel further."""


def _checkerboard(node: Node) -> Texture:
    """Two times two texels; its first colour where u and v are in the same halves."""
    node.only("color0", "color1", "to_uv")
    first, second = node.colour("color0", (0.4,) * 3), node.colour("color1", (0.2,) * 3)
    return Texture(np.array([[first, second], [second, first]]).transpose(2, 0, 1), False, "repeat", _to_uv(node))


def _bitmap(node: Node) -> Texture:
    node.only("filename", "filter_type", "wrap_mode", "to_uv", "raw", "format", "accel")
    smooth, wrap = node.word("filter_type", "bilinear"), node.word("wrap_mode", "repeat")
    for value, accepted in ((smooth, FILTERS), (wrap, WRAPS), (node.word("format", "variant"), FORMATS)):
        if value not in accepted:
            raise node.refused(value, " or ".join(accepted))
    if node.texels is None:
        raise node.refused("no texels", "a picture that Mitsuba reads")
    return Texture(_reflectance(node, node.texels), FILTERS[smooth], wrap, _to_uv(node))


def _reflectance(node: Node, texels: Floats) -> Floats:
    if not (texels >= 0).all() or texels.max() > 1:
        raise node.refused("a texel outside [0, 1]", "a reflectance")
    return texels


def _to_uv(node: Node) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Mitsuba leaves z out."""
    matrix = node.matrix("to_uv")
    (a, b, c), (d, e, f) = matrix[:2, [0, 1, 3]].tolist()
    return (a, b, c), (d, e, f)


TEXTURES: dict[str, Callable[[Node], Texture]] = {"checkerboard": _checkerboard, "bitmap": _bitmap}
"""By plugin."""


def texture_of(node: Node, name: str) -> Texture | None:
    """The texture that a node has of that name, if it is none of one colour."""
    for held, child in node.children:
        if held == name:
            if child.plugin not in TEXTURES:
                raise child.refused(child.plugin, f"a colour, or {' or '.join(TEXTURES)}")
            return TEXTURES[child.plugin](child)
    return None
