"""Vertices and triangles as a scene file lists them, closed into world-space meshes."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.errors import InputError
from nusselt.renderer.surfaces import Floats, Material, Mesh, has_area

from .transforms import Affine, apply_each


class TrianglePile:
    """The vertices of a file, and the triangles since the last mesh was closed.

    Parameters
    ----------
    where : str
        The file's name, for errors.
    """

    def __init__(self, where: str) -> None:
        self._where = where
        self._vertices = array("d")
        self._corners = array("q")
        self._lines = array("q")
        self._runs: list[tuple[Affine, int]] = []  # a transform, and how many triangles it was current for

    @property
    def vertex_count(self) -> int:
        return len(self._vertices) // 3

    @property
    def first_line(self) -> int:
        """Of the triangles since the last mesh; 0 where there are none."""
        return self._lines[0] if self._lines else 0

    def add_vertices(self, values: Sequence[float]) -> None:
        """Append x, y, z of each vertex, not yet transformed."""
        self._vertices.extend(values)

    def add_triangles(self, corners: Sequence[int], first_line: int, transform: Affine) -> None:
        """Append i, j, k of each triangle, one a line from ``first_line`` on."""
        count = len(corners) // 3
        self._corners.extend(corners)
        self._lines.extend(range(first_line, first_line + count))
        self._runs.append((transform, count))

    def close(self, material: Material) -> Mesh | None:
        """The mesh of the triangles so far, if there are any; the vertices stay for the next one."""
        if not self._corners:
            return None
        with np.errstate(over="ignore", invalid="ignore"):  # reported below, as an error with its line
            vertices, triangles = self._bake()
            try:
                mesh = Mesh(vertices, triangles, material)
            except InputError:
                raise self._fault(vertices, triangles) from None
        self._corners, self._lines, self._runs = array("q"), array("q"), []
        return mesh

    def _bake(self) -> tuple[Floats, NDArray[np.int64]]:
        """World-space vertices (3, v), those used only and in file order, and triangles (3, t)."""
        slots: dict[Affine, int] = {}
        slot_of_run = [slots.setdefault(transform, len(slots)) for transform, _ in self._runs]
        slot = np.repeat(slot_of_run, [count for _, count in self._runs])
        corners = np.array(self._corners).reshape(-1, 3)
        # One number names a vertex under a transform, so equal numbers are one vertex of the mesh.
        keys = slot[:, None] * self.vertex_count + corners
        used, inverse = np.unique(keys, return_inverse=True)
        which, index = np.divmod(used, self.vertex_count)
        points = np.frombuffer(self._vertices).reshape(-1, 3)[index].T
        vertices = apply_each(np.array(list(slots)), which, points)
        return vertices, inverse.reshape(-1, 3).T.astype(np.int64)

    def _fault(self, vertices: Floats, triangles: NDArray[np.int64]) -> InputError:
        """What is wrong with the first triangle that is not one, and where it stands."""
        a, b, c = (vertices[:, corner] for corner in triangles)
        finite = np.isfinite(np.stack([a, b, c])).all(axis=(0, 1))
        bad = int(np.flatnonzero(~(finite & has_area(a, b, c)))[0])
        accepted = (
            "three corners that span an area"
            if np.isfinite(vertices[:, triangles[:, bad]]).all()
            else "corners finite in world space"
        )
        corners = " ".join(str(corner) for corner in self._corners[3 * bad : 3 * bad + 3])
        return InputError("tri", corners, accepted, f"{self._where}:{self._lines[bad]}")
