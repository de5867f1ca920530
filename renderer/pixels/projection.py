"""From space to the image plane and back, on a pixel grid moved by a hair.

Edges that run exactly along pixel boundaries are common (a symmetric room, a centred camera) and make every
side test a tie. So the grid is moved by 1e-7 pixels, by different amounts in x and y: ties become generic, and
areas are wrong by no more than 1e-7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nusselt.renderer.camera.rays import view_frame
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats, Ints, column, dot

HAIR = np.array([1.2345e-7, 0.8642e-7])
"""Pixels the grid is moved by, in x and y."""
NEAR = 1e-6
"""Edges are cut this close in front of the camera, relative to their own reach."""


@dataclass(frozen=True, eq=False)
class Lens:
    """A pinhole camera in pixels.

    Parameters
    ----------
    width, height : int
    origin, look, right, up : (3, 1) float64
        See `view_frame`.
    """

    width: int
    height: int
    origin: Floats
    look: Floats
    right: Floats
    up: Floats

    @classmethod
    def of(cls, scene: Scene) -> Lens:
        return cls(scene.width, scene.height, column(scene.camera.position), *view_frame(scene))

    def directions(self, x: Floats, y: Floats) -> Floats:
        """Directions (3, n), not normalised, through points of the moved grid."""
        x, y = x - HAIR[0], y - HAIR[1]
        return self.look + (2 * x / self.width - 1) * self.right + (1 - 2 * y / self.height) * self.up

    @property
    def steps(self) -> tuple[Floats, Floats]:
        """What a pixel across, and one down, adds to directions (3, 1)."""
        return 2 * self.right / self.width, -2 * self.up / self.height

    def project(self, start: Floats, end: Floats) -> tuple[Floats, Floats, Ints]:
        """Segments (3, s) in front of the camera as pixel positions (2, k) each, and which they were (k,)."""
        a, b = self._depths(start), self._depths(end)
        near = NEAR * np.maximum(np.abs(a[2]), np.abs(b[2]))
        a_in, b_in = a[2] > near, b[2] > near
        kept = np.flatnonzero(a_in | b_in)
        a, b, near, a_in, b_in = a[:, kept], b[:, kept], near[kept], a_in[kept], b_in[kept]
        rise = np.where(a_in == b_in, 1.0, b[2] - a[2])
        cut = a + (near - a[2]) / rise * (b - a)
        a, b = np.where(a_in, a, cut), np.where(b_in, b, cut)
        return self._flat(a), self._flat(b), kept

    def _depths(self, p: Floats) -> Floats:
        v = p - self.origin
        right, up = (axis / dot(axis, axis) for axis in (self.right, self.up))
        return np.stack((dot(v, right), dot(v, up), dot(v, self.look)))

    def _flat(self, p: Floats) -> Floats:
        x = (p[0] / p[2] + 1) / 2 * self.width + HAIR[0]
        y = (1 - p[1] / p[2]) / 2 * self.height + HAIR[1]
        return np.stack((x, y))
