#!/usr/bin/env bash
# OBJ: where faces count their corners from the end, meshio takes the corner before each, and Mitsuba reads nothing.
#
# Guess: -1 is the last vertex so far, as the format has it, for everybody; a reader that does not know it refuses the file.
# Seen: of two squares that are written one after the other, each with f -4 -3 -2 -1, meshio makes twice the same face, of the
# vertices -5 to -2 as NumPy counts them from the file's end: areas 2.5 and 2.5 for 1 and 1, without a word. Mitsuba refuses
# the file: "reference to invalid vertex 4294967292". trimesh and assimp have both squares.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "meshio==5.3.5" "mitsuba==3.9.1" "trimesh==5.2.0" "assimp-py==1.1.0" \
    "numpy==2.4.6"
"$place/venv/bin/python" - "$place/squares.obj" <<'PY'
import sys
from importlib.metadata import version

import assimp_py
import meshio
import mitsuba as mi
import numpy as np
import trimesh

mi.set_variant("scalar_rgb")
name = sys.argv[1]
with open(name, "w") as file:
    for x in (0, 3):
        file.writelines(f"v {x + i} {j} 0\n" for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
        file.write("f -4 -3 -2 -1\n")


def areas(corners):
    """Of triangles or quadrilaterals (n, k, 3)."""
    doubled = np.cross(corners, np.roll(corners, -1, axis=1)).sum(axis=1)
    return np.linalg.norm(doubled, axis=1) / 2


def by_meshio():
    mesh = meshio.read(name)
    print("meshio's faces:", *(block.data.tolist() for block in mesh.cells))
    return areas(mesh.points[mesh.cells[0].data])


def by_assimp():
    made = assimp_py.import_file(name, assimp_py.Process_Triangulate).meshes
    return sum((list(areas(np.reshape(m.vertices, (-1, 3))[np.reshape(m.indices, (-1, 3))])) for m in made), [])


def by_mitsuba():
    try:
        return [mi.load_dict({"type": "obj", "filename": name}).surface_area()]
    except RuntimeError as error:
        print("Mitsuba:", str(error).split(": ")[-1])
        return []


readers = {"meshio": by_meshio, "mitsuba": by_mitsuba, "trimesh": lambda: trimesh.load(name, force="mesh").area_faces, "assimp-py": by_assimp}
seen = {}
for reader, read in readers.items():
    seen[reader] = sorted(round(float(area), 5) for area in read())
    print(f"{reader:9} {version(reader):7} areas of faces: {seen[reader]}")
halves = [0.5] * 4
if seen != {"meshio": [2.5, 2.5], "mitsuba": [], "trimesh": halves, "assimp-py": halves}:
    raise SystemExit("changed")
PY
