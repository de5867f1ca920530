#!/usr/bin/env bash
# embreex: query="OCCLUDED" gives 0 for what is hidden and -1 for what is seen: as truth values, light and shadow exchanged.
#
# Guess: run(origins, directions, query="OCCLUDED") tells for each ray whether something is in the way, true or 1 if so.
# Seen: 32-bit integers, 0 where the ray is stopped and -1 where it is free: numpy.where(occluded, 0, light) lights what
# is in shadow alone. "INTERSECT" gives -1 for a free ray too, and the number of the triangle, which may be 0, for others;
# "DISTANCE" gives 1e37 for a free ray, not infinity.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "embreex==4.4.0.post1" "numpy==2.4.6"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

print("embreex", version("embreex"))
scene = EmbreeScene()
square = np.array([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], dtype=np.float32)
mesh = TriangleMesh(scene, square, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.int32))
origins = np.array([(0.5, -0.5, 0), (-0.5, 0.5, 0), (2, 0, 0)], dtype=np.float32)
upwards = np.tile(np.array([0, 0, 1], dtype=np.float32), (3, 1))
seen = {query: scene.run(origins, upwards, query=query) for query in ("OCCLUDED", "INTERSECT", "DISTANCE")}
print("two floor points beneath a square, and one beside it:")
for query, values in seen.items():
    print(f"{query:9} {values.dtype}: {values.tolist()}")
lit = np.where(seen["OCCLUDED"], 0, 1)
print("numpy.where(occluded, 0, 1) lights:", lit.tolist())
if seen["OCCLUDED"].tolist() != [0, 0, -1] or lit.tolist() != [1, 1, 0] or seen["INTERSECT"].tolist() != [0, 1, -1]:
    raise SystemExit("changed: OCCLUDED, or INTERSECT")
if not np.isclose(seen["DISTANCE"][2], 1e37):
    raise SystemExit("changed: DISTANCE")
PY
