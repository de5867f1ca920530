#!/usr/bin/env bash
# Pyrr: a matrix made of a quaternion, or of the same angle about the same axis, turns the other way than the quaternion does.
#
# Guess: quaternion * vector, quaternion.matrix44 * vector and Matrix44.from_x_rotation(angle) * vector are the same vector,
# where translations and look_at matrices are applied by the same *.
# Seen: the quaternion turns +y towards +z by 30 degrees, the matrices towards -z: those of rotations are transposed. A camera
# or a light that is placed by a matrix looks 60 degrees elsewhere than the one that is placed by the quaternion.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "pyrr==0.10.3" "numpy==2.4.6"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
from pyrr import Matrix33, Matrix44, Quaternion, Vector3, Vector4

print("pyrr", version("pyrr"))
angle, eye = np.pi / 6, [1.0, 2.0, 3.0]
moved = np.array(Matrix44.from_translation(eye) * Vector4([0.0, 0.0, 0.0, 1.0]))
back = np.array(Matrix44.look_at(eye, [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]) * Vector4([*eye, 1.0]))
print("from_translation(eye) * origin:", moved, " look_at(eye, ...) * eye:", np.round(back, 12))
if not (np.allclose(moved, [*eye, 1]) and np.allclose(back, [0, 0, 0, 1])):
    raise SystemExit("changed: translation, or look_at")
for axis in "xyz":
    turn = getattr(Quaternion, f"from_{axis}_rotation")(angle)
    start = Vector3(np.roll([0.0, 1.0, 0.0], "xyz".index(axis)))
    end = np.roll([0.0, np.cos(angle), np.sin(angle)], "xyz".index(axis))
    found = {
        "quaternion * v": turn * start,
        "quaternion.matrix33 * v": turn.matrix33 * start,
        "quaternion.matrix44 * v": (turn.matrix44 * Vector4([*start, 0.0]))[:3],
        f"Matrix33.from_{axis}_rotation * v": getattr(Matrix33, f"from_{axis}_rotation")(angle) * start,
        f"Matrix44.from_{axis}_rotation * v": (getattr(Matrix44, f"from_{axis}_rotation")(angle) * Vector4([*start, 0.0]))[:3],
    }
    for what, vector in found.items():
        vector = np.array(vector)
        print(f"{what:30} {np.round(vector, 3)}, right-handed: {np.round(end, 3)}")
        expected = end if what == "quaternion * v" else 2 * np.cos(angle) * np.array(start) - end
        if not np.allclose(vector, expected):
            raise SystemExit(f"changed: {what}")
PY
