"""What mesh files hold: triangles, made of the polygons that they list."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.surfaces import Floats, has_area
from nusselt.renderer.words import count

from .polygons import cut

MAX_TRIANGLES = 1 << 23


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles as a file has them.

    Parameters
    ----------
    vertices : (3, v) float64
        Those that some triangle uses, in file order.
    triangles : (3, t) int64
    notes : tuple of str
        What the file holds besides, or that had to be cut: a phrase each.
    """

    vertices: Floats
    triangles: NDArray[np.int64]
    notes: tuple[str, ...] = ()

    def with_area(self) -> tuple[Surface, int]:
        """Without the triangles that span no area, and how many those were."""
        corners = (self.vertices[:, corner] for corner in self.triangles)
        good = has_area(*corners)
        if good.all():
            return self, 0
        return compact(self.vertices, self.triangles[:, good], self.notes), int((~good).sum())


def compact(vertices: Floats, triangles: NDArray[np.int64], notes: tuple[str, ...]) -> Surface:
    """Only the vertices that are used, in their order."""
    used = np.zeros(vertices.shape[1], dtype=bool)
    used[triangles] = True
    if used.all():
        return Surface(vertices, triangles, notes)
    number = np.cumsum(used) - 1
    return Surface(vertices[:, used], number[triangles], notes)


def from_polygons(
    vertices: Floats,
    counts: NDArray[np.int64],
    corners: NDArray[np.int64],
    given: NDArray[np.int64],
    vertex_name: Callable[[int], str],
    face_name: Callable[[int], str],
    notes: tuple[str, ...] = (),
) -> Surface:
    """Triangles of polygons; faces of fewer than three corners are left out, and noted.

    Parameters
    ----------
    vertices : (3, v) float64
    counts : (f,) int64
        Corners of each face.
    corners : (sum of counts,) int64
        Indices into ``vertices``, face after face.
    given : (sum of counts,) int64
        The same as the file has them.
    vertex_name, face_name : call of a number
        What errors call it: its line, or its number.
    notes : tuple of str
        What the file holds besides.

    Raises
    ------
    InputError
        For an index out of range, a coordinate of a face that is not finite, no face at all.
    """
    bad = np.flatnonzero((corners < 0) | (corners >= vertices.shape[1]))
    if bad.size:
        face = int(np.searchsorted(np.cumsum(counts), bad[0], side="right"))
        known = f"a vertex of the {vertices.shape[1]} in the file"
        raise InputError(f"{face_name(face)} index", int(given[bad[0]]), known)
    bad = corners[~np.isfinite(vertices[:, corners]).all(axis=0)]
    if bad.size:
        raise InputError(vertex_name(int(bad.min())), tuple(vertices[:, bad.min()].tolist()), "finite coordinates")
    is_face = counts >= 3
    if not is_face.any():
        raise InputError("faces", 0, "at least one face of three corners or more")
    if few := int((~is_face).sum()):
        notes += (f"{count(few, 'face')} of fewer than three corners: dropped",)
        corners, counts = corners[np.repeat(is_face, counts)], counts[is_face]
    if (counts - 2).sum() > MAX_TRIANGLES:
        raise InputError("triangles", int((counts - 2).sum()), f"at most {MAX_TRIANGLES}")
    triangles, said = cut(vertices, counts, corners)
    return compact(vertices, triangles, (*notes, *said))
