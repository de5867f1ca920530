"""Polygons, as files list them, made into triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.surfaces import Floats, has_area

MAX_TRIANGLES = 1 << 23


@dataclass(frozen=True)
class Surface:
    """Triangles as a file has them.

    Parameters
    ----------
    vertices : (3, v) float64
        Those that some triangle uses, in file order.
    triangles : (3, t) int64
    """

    vertices: Floats
    triangles: NDArray[np.int64]

    def with_area(self) -> tuple[Surface, int]:
        """Without the triangles that span no area, and how many those were."""
        corners = (self.vertices[:, corner] for corner in self.triangles)
        good = has_area(*corners)
        if good.all():
            return self, 0
        return compact(self.vertices, self.triangles[:, good]), int((~good).sum())


def compact(vertices: Floats, triangles: NDArray[np.int64]) -> Surface:
    """Only the vertices that are used, in their order."""
    used = np.zeros(vertices.shape[1], dtype=bool)
    used[triangles] = True
    if used.all():
        return Surface(vertices, triangles)
    number = np.cumsum(used) - 1
    return Surface(vertices[:, used], number[triangles])


def fans(vertices: Floats, counts: NDArray[np.int64], corners: NDArray[np.int64]) -> Surface:
    """Triangles of polygons.

    Parameters
    ----------
    vertices : (3, v) float64
    counts : (f,) int64
        Corners of each face.
    corners : (sum of counts,) int64
        Indices into ``vertices``, face after face.

    Raises
    ------
    InputError
        For a face of fewer than three corners, an index out of range, a coordinate that is not finite.
    """
    bad = np.flatnonzero(counts < 3)
    if bad.size:
        raise InputError(f"face {int(bad[0])}", f"{int(counts[bad[0]])} corners", "at least 3 corners")
    bad = np.flatnonzero((corners < 0) | (corners >= vertices.shape[1]))
    if bad.size:
        face = int(np.searchsorted(np.cumsum(counts), bad[0], side="right"))
        raise InputError(f"face {face} index", int(corners[bad[0]]), f"a vertex of the {vertices.shape[1]} in the file")
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=0))
    if bad.size:
        raise InputError(f"vertex {int(bad[0])}", tuple(vertices[:, bad[0]].tolist()), "finite coordinates")
    if counts.size == 0:
        raise InputError("faces", 0, "at least one face")
    wings = counts - 2
    if wings.sum() > MAX_TRIANGLES:
        raise InputError("triangles", int(wings.sum()), f"at most {MAX_TRIANGLES}")
    first = np.repeat(np.cumsum(counts) - counts, wings)
    wing = np.arange(first.size) - np.repeat(np.cumsum(wings) - wings, wings)
    return compact(vertices, np.stack((corners[first], corners[first + wing + 1], corners[first + wing + 2])))
