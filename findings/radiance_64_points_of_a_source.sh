#!/usr/bin/env bash
# Radiance: -ds finer than a tenth changes nothing: a source has 64 points at most; a triangle's lie outside it too.
#
# Guess: irradiance from a square source tends to the exact value as -ds falls, and two triangles are as good as a square.
# Seen: beneath a 2 x 2 square at height 2, -ds .1, .02 and .005 give the same number, 0.19 % too much. The square cut
# into 16 x 16 sources of one point each is 0.05 % off, as 1/n^2 has it. As two triangles it is 9 % off: each is sampled
# as the parallelogram about it.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "pyradiance==1.3.1" "numpy==2.4.6"
"$place/venv/bin/python" - "$place" <<'PY'
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyradiance

place, home = Path(sys.argv[1]), Path(pyradiance.__file__).parent
os.environ["RAYPATH"] = str(home / "lib")
print(subprocess.run([home / "bin" / "rtrace", "-version"], capture_output=True, text=True).stdout.strip())
SQUARE = np.array([(-1, -1, 2), (-1, 1, 2), (1, 1, 2), (1, -1, 2)], dtype=float)
AT = (0.9, -0.6)


def irradiance(outlines, ds):
    """On the floor, facing up."""
    lines = ["void light glow 0 0 3 1 1 1"]
    for k, corners in enumerate(outlines):
        lines.append(f"glow polygon p{k} 0 0 {corners.size} " + " ".join(f"{x:.12g}" for x in corners.ravel()))
    (place / "scene.rad").write_text("\n".join(lines) + "\n")
    tree = subprocess.run([home / "bin" / "oconv", place / "scene.rad"], capture_output=True, check=True)
    (place / "scene.oct").write_bytes(tree.stdout)
    words = ["-h", "-I", "-ab", "0", "-av", "0", "0", "0", "-dj", "0", "-dt", "0", "-dc", "1", "-ds", str(ds)]
    point = f"{AT[0]} {AT[1]} 0 0 0 1\n"
    traced = subprocess.run(
        [home / "bin" / "rtrace", *words, place / "scene.oct"], input=point, capture_output=True, text=True, check=True
    )
    return float(traced.stdout.split()[0])


def exact():
    """Lambert's boundary integral."""
    to = SQUARE - (*AT, 0)
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    turned = np.cross(to, np.roll(to, -1, axis=0))
    angle = np.arctan2(np.linalg.norm(turned, axis=1), (to * np.roll(to, -1, axis=0)).sum(axis=1))
    return abs(float((angle * turned[:, 2] / np.linalg.norm(turned, axis=1)).sum()) / 2)


cells = [SQUARE[0] + (SQUARE - SQUARE[0]) / 16 + (i / 8, j / 8, 0) for i in range(16) for j in range(16)]
triangles = [SQUARE[[0, 1, 2]], SQUARE[[0, 2, 3]]]
truth = exact()
seen = {f"one square, -ds {ds}": irradiance([SQUARE], ds) for ds in (0.1, 0.02, 0.005)}
seen["16 x 16 squares, -ds 0"] = irradiance(cells, 0)
seen["two triangles, -ds .02"] = irradiance(triangles, 0.02)
error = {what: value / truth - 1 for what, value in seen.items()}
for what, value in error.items():
    print(f"{what:24} {value:+.4%}")
one = [value for what, value in error.items() if what.startswith("one")]
if max(one) - min(one) > 1e-6 or abs(one[0]) < 3e-4 or abs(error["16 x 16 squares, -ds 0"]) > abs(one[0]) / 2:
    raise SystemExit("changed: the square")
if abs(error["two triangles, -ds .02"] - one[0]) < 1e-3:
    raise SystemExit("changed: the triangles")
PY
