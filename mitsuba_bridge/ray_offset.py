"""The ray offset of the Mitsuba that is installed, in a scene's own units.

Up to version 3.9 visibility is traced from p + n (1 + max|p|) math::RayEpsilon to 1 - math::ShadowEpsilon of
the way; everything else is computed from p. Version 3.10 replaces the rule by error bounds of each shape: there
this model says that it does not hold.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.visibility.ray_offset import RayOffset

from .llvm import Backend, backend
from .placement import place
from .reference import ask
from .temporary import temporary_folder


@lru_cache(maxsize=4)
def _epsilons(running: Backend) -> tuple[float, float, str]:
    with temporary_folder() as name:
        arrays, told = ask({"task": "epsilons"}, Path(name), running, 60.0)
    lift, short = arrays["epsilons"]
    return float(lift), float(short), str(told["version"])


def mitsuba_offset(scene: Scene, normalise: bool = True, running: Backend | None = None) -> RayOffset:
    """How Mitsuba moves the shadow rays of a scene.

    Parameters
    ----------
    normalise : bool
        Whether the bridge moves and scales the scene (see `describe`).

    Raises
    ------
    InputError
        If the installed version has another rule.
    ReferenceUnavailable
        If Mitsuba cannot run here.
    """
    lift, short, version = _epsilons(running or backend())
    if not (0 < lift < 1 and 0 < short < 1):
        raise InputError("shadow origin", f"mitsuba {version}", "a Mitsuba up to 3.9, whose ray offset is known")
    if not normalise:
        return RayOffset(lift, short)
    placement = place(scene)
    return RayOffset(lift, short, unit=placement.unit, centre=placement.centre)
