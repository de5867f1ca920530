#!/usr/bin/env bash
# OBJ: a concave face grows where trimesh, three.js and Mitsuba cut it into triangles: as a light it is a third brighter.
#
# Guess: readers that make triangles of an OBJ file's polygons cut a concave one as it is, since the format allows it: an L of
# three unit squares has the area 3, an arrowhead 1. Where they cannot, they say so.
# Seen: trimesh, three.js's OBJLoader and Mitsuba cut fans from the first corner, without a word: where that is not one that
# sees all, triangles lie outside the face and upside down, and the areas are 4 and 3. pymeshlab has the L right and the
# arrowhead wrong, assimp both right.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
npm install --silent --no-audit --no-fund --prefix "$place" "three@0.187.0" > /dev/null
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "trimesh==5.2.0" "mitsuba==3.9.1" "pymeshlab==2025.7.post1" \
    "assimp-py==1.1.0" "numpy==2.4.6"
cat > "$place/read.mjs" <<'JS'
import fs from "fs";
import * as THREE from "three";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";

const corners = new OBJLoader().parse(fs.readFileSync(process.argv[2], "utf8")).children[0].geometry.attributes.position;
const at = (k) => new THREE.Vector3().fromBufferAttribute(corners, k);
let area = 0;
for (let k = 0; k < corners.count; k += 3) area += new THREE.Triangle(at(k), at(k + 1), at(k + 2)).getArea();
console.log(area);
JS
cd "$place"
venv/bin/python - <<'PY'
import json
import subprocess
from importlib.metadata import version

import assimp_py
import mitsuba as mi
import numpy as np
import pymeshlab
import trimesh

mi.set_variant("scalar_rgb")
print(*(f"{name} {version(name)}" for name in ("trimesh", "mitsuba", "pymeshlab", "assimp-py")))
print("three.js", json.load(open("node_modules/three/package.json"))["version"])


def by_assimp(name):
    (mesh,) = assimp_py.import_file(name, assimp_py.Process_Triangulate).meshes
    a, b, c = np.reshape(mesh.vertices, (-1, 3))[np.reshape(mesh.indices, (-1, 3)).T]
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def by_pymeshlab(name):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(name)
    return meshes.get_geometric_measures()["surface_area"]


faces = {"L": [(1, 2), (0, 2), (0, 0), (2, 0), (2, 1), (1, 1)], "arrowhead": [(2, -1), (1, 0), (2, 1), (0, 0)]}
readers = {
    "trimesh": lambda name: trimesh.load(name, force="mesh").area,
    "three.js": lambda name: float(subprocess.run(["node", "read.mjs", name], stdout=subprocess.PIPE, check=True).stdout),
    "mitsuba": lambda name: mi.load_dict({"type": "obj", "filename": name}).surface_area(),
    "pymeshlab": by_pymeshlab,
    "assimp": by_assimp,
}
expected = {"trimesh": [4, 3], "three.js": [4, 3], "mitsuba": [4, 3], "pymeshlab": [3, 3], "assimp": [3, 1]}
seen = {}
for reader, area in readers.items():
    seen[reader] = []
    for shape, corners in faces.items():
        with open(f"{shape}.obj", "w") as file:
            file.writelines(f"v {x} {y} 0\n" for x, y in corners)
            file.write("f " + " ".join(str(k + 1) for k in range(len(corners))) + "\n")
        seen[reader].append(round(float(area(f"{shape}.obj")), 5))
    print(f"{reader:9} an L of 3 unit squares: area {seen[reader][0]:g}; an arrowhead of 1: area {seen[reader][1]:g}")
if seen != expected:
    raise SystemExit("changed")
PY
