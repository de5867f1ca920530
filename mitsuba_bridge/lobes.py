"""A surface as Mitsuba is to see it: the half of every kind of lobe that the renderer knows nothing of.

Mitsuba has no sum of surfaces: one plugin says all lobes of a material. `SURFACES` lists the plugins, the first that
can say a material is taken, and a material that none can say is refused: a lobe that is new is never left out. A
plugin that is not Mitsuba's own is a module of ``child/`` with a NAME and a `register`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from nusselt.renderer.errors import InputError
from nusselt.renderer.lobes import Lambert, Lobe, Phong
from nusselt.renderer.surfaces import Material

from .lights import rgb

Lobes = Mapping[type[Lobe], Lobe]
"""The lobes of a material that have an albedo."""


@dataclass(frozen=True)
class Surface:
    """A Mitsuba surface.

    Parameters
    ----------
    plugin : str
        Its type in Mitsuba.
    module : str
        The module of ``child/`` that registers it; empty for Mitsuba's own.
    says : callable
        Its parameters for a material, colours as lists; None if it cannot say the material.
    """

    plugin: str
    module: str
    says: Callable[[Material, Lobes], dict[str, Any] | None]


def _diffuse(material: Material, lobes: Lobes) -> dict[str, Any] | None:
    """No albedo above one."""
    if not set(lobes) <= {Lambert} or max(material.diffuse) > 1:
        return None
    return {"reflectance": rgb(material.diffuse)}


def _modified_phong(material: Material, lobes: Lobes) -> dict[str, Any] | None:
    if not set(lobes) <= {Lambert, Phong}:
        return None
    return {"kd": rgb(material.diffuse), "ks": rgb(material.specular), "exponent": float(material.shininess)}


SURFACES: tuple[Surface, ...] = (
    Surface("diffuse", "", _diffuse),
    Surface("modified_phong", "phong", _modified_phong),
)
"""Every surface, once; the dearer later."""


def surface(material: Material) -> dict[str, Any]:
    """A material's entry in a `Description`: its ``kind``, Mitsuba's type, and that type's parameters.

    Raises
    ------
    InputError
        If no surface can say it.
    """
    lobes = {type(lobe): lobe for lobe in material.lobes if max(lobe.albedo) > 0}
    for candidate in SURFACES:
        parameters = candidate.says(material, lobes)
        if parameters is not None:
            return {"kind": candidate.plugin, **parameters}
    names = " and ".join(kind.kind for kind in lobes)
    raise InputError("material lobes", names, "lobes that one surface in mitsuba_bridge/lobes.py can say")


def is_stock(plugin: str) -> bool:
    """Whether Mitsuba itself knows a surface."""
    return any(candidate.plugin == plugin and not candidate.module for candidate in SURFACES)
