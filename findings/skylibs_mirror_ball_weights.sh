#!/usr/bin/env bash
# skylibs: the solid angles of a mirror ball's pixels add up to 1.77 spheres, and a white one gives four times its light.
#
# Guess: solidAngles() adds up to 4 pi for every format that shows the whole sphere, the better the finer the image, so that
# weighting an environment by it gives irradiance: pi everywhere in a white one of radiance 1.
# Seen: "latlong" and "angular" add up to 4 pi; "sphere", the mirror ball, to 1.77 times that at 256 and 1.76 at 512 pixels
# across: inside .995 of its radius they are right, the rim's are too many. Along one axis the white ball's irradiance is
# 12.6 for pi. Of the "cube" the columns beside the cross's arms are left out (NaN): .968 at 64 pixels, .996 at 512.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "skylibs==0.7.7" "numpy==2.4.6"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
from envmap import EnvironmentMap

print("skylibs", version("skylibs"))
total, irradiance = {}, {}
for kind in ("latlong", "angular", "cube", "sphere"):
    for size in (64, 512):
        environment = EnvironmentMap(size, kind)
        weight = np.nan_to_num(environment.solidAngles())
        axes = [np.nan_to_num(axis) for axis in environment.worldCoordinates()[:3]]
        facing = [(weight * np.clip(sign * axis, 0, None)).sum() / np.pi for axis in axes for sign in (-1, 1)]
        total[kind, size], irradiance[kind, size] = weight.sum() / (4 * np.pi), (min(facing), max(facing))
        print(
            f"{kind:8} {size:3}: solid angles over 4 pi {total[kind, size]:.4f}, "
            f"irradiance of a white environment over pi {min(facing):.3f} to {max(facing):.3f}"
        )
ball = EnvironmentMap(512, "sphere")
u, v = ball.imageCoordinates()
inside = np.nansum(ball.solidAngles()[np.hypot(2 * u - 1, 2 * v - 1) < 0.99]) / (4 * np.pi)
print(f"sphere   512: inside .99 of the radius {inside:.4f}; exactly {0.99**2:.4f}")
if any(abs(total[kind, size] - 1) > 1e-3 for kind in ("latlong", "angular") for size in (64, 512)):
    raise SystemExit("changed: the formats that were right")
if abs(inside - 0.99**2) > 1e-3 or total["sphere", 512] < 1.5 or irradiance["sphere", 512][1] < 3:
    raise SystemExit("changed: the mirror ball")
if not 0.95 < total["cube", 64] < 0.98:
    raise SystemExit("changed: the cube")
PY
