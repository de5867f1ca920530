#!/usr/bin/env bash
# ladybug-geometry: the cells of a sensor grid are stretched to fill the floor, but their areas are those that were asked for.
#
# Guess: Face3D.mesh_grid(.6, .6) on a floor of 5 by 4 gives 8 by 6 cells of .6 by .6 and leaves a strip without sensors, or
# it makes the cells .625 by .667 and their areas .417; face_areas and area are those of the mesh's vertices.
# Seen: cells are .625 by .667 (its documentation speaks of a grid that does not fill the face), face_areas are .36 and area
# is 17.28 for 20: a flux that is summed as irradiance times area is 14 % too small, 56 % with cells of 2.1, and 1 %
# too large with one of 4.5. A mesh made of the same vertices and faces has area 20.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "ladybug-geometry==1.35.6"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version

from ladybug_geometry.geometry3d.face import Face3D
from ladybug_geometry.geometry3d.mesh import Mesh3D
from ladybug_geometry.geometry3d.pointvector import Point3D

print("ladybug-geometry", version("ladybug-geometry"))
floor = Face3D([Point3D(0, 0, 0), Point3D(5, 0, 0), Point3D(5, 4, 0), Point3D(0, 4, 0)])
expected = {0.5: 20.0, 0.6: 17.28, 1.0: 20.0, 2.1: 8.82, 4.5: 20.25}
for size, area in expected.items():
    grid = floor.mesh_grid(size, size)
    again = Mesh3D(grid.vertices, grid.faces)
    print(
        f"cells of {size}: {len(grid.faces)}, first sensor at {grid.face_centroids[0].x:.4f} {grid.face_centroids[0].y:.4f}, "
        f"face area {grid.face_areas[0]:.4f}, area {grid.area:.2f} of {floor.area:.2f}, from the vertices {again.area:.2f}"
    )
    if abs(grid.area - area) > 1e-6 or abs(again.area - floor.area) > 1e-6:
        raise SystemExit("changed")
PY
