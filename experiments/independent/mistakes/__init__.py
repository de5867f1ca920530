"""Mistakes by name, a kind a file."""

from __future__ import annotations

from .camera import CAMERA
from .geometry import GEOMETRY
from .lights import LIGHTS, SUNS
from .mistake import Mistake
from .pictures import PICTURES
from .radiometry import RADIOMETRY
from .sampling import NOISE, SAMPLING
from .surfaces import SURFACES
from .traps import TRAPS
from .visibility import VISIBILITY

KINDS: dict[str, tuple[Mistake, ...]] = {
    "radiometry": RADIOMETRY,
    "lights": LIGHTS,
    "suns": SUNS,
    "visibility": VISIBILITY,
    "geometry": GEOMETRY,
    "surfaces": SURFACES,
    "camera": CAMERA,
    "pictures": PICTURES,
    "traps": TRAPS,
    "sampling": SAMPLING,
    "noise": NOISE,
}
MISTAKES = tuple(mistake for kind in KINDS.values() for mistake in kind)

__all__ = ["KINDS", "MISTAKES", "Mistake"]
