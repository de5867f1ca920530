"""The body of a light: what cameras see and shadow rays meet."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from nusselt.renderer.surfaces import Ellipsoid, FlatDisk
from nusselt.renderer.vectors import Floats

Corners: TypeAlias = tuple[Floats, Floats, Floats]
"""Of triangles, each (3, t), counter-clockwise from the front."""
Plane: TypeAlias = tuple[Floats, Floats]
"""Unit normal and a point, each (3, 1)."""


def _no_triangles() -> Corners:
    return np.empty((3, 0)), np.empty((3, 0)), np.empty((3, 0))


@dataclass(frozen=True)
class Body:
    """Triangles, flat disks and balls, black, their front the emitting side."""

    corners: Corners = field(default_factory=_no_triangles)
    disks: tuple[FlatDisk, ...] = ()
    balls: tuple[Ellipsoid, ...] = ()
