"""Binary PLY. Without normals, but for ellipsoids: with them Mitsuba shades by the interpolated normal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Floats


def write_ply(path: Path, vertices: Floats, triangles: NDArray[np.integer[Any]], normals: Floats | None = None) -> None:
    """Write triangles (3, t) over vertices (3, v) and their normals (3, v), if any; float32, as Mitsuba reads them."""
    names = "xyz" if normals is None else ("x", "y", "z", "nx", "ny", "nz")
    corners = vertices if normals is None else np.vstack((vertices, normals))
    properties = "".join(f"property float {name}\n" for name in names)
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {vertices.shape[1]}\n{properties}"
        f"element face {triangles.shape[1]}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(triangles.shape[1], dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, triangles.T
    with path.open("wb") as stream:
        stream.write(header.encode("ascii"))
        stream.write(np.ascontiguousarray(corners.T, dtype="<f4").tobytes())
        stream.write(faces.tobytes())
