#!/usr/bin/env bash
# ladybug: the solid angles of Tregenza's and of Reinhart's sky are those of whichever was asked for first.
#
# Guess: view_sphere.tregenza_solid_angles has 145 values, in the order of tregenza_dome_vectors, and reinhart_solid_angles 577,
# whatever was asked before; weights and cosines of a white sky of radiance 1 add up to pi.
# Seen: both share one place: after reinhart_solid_angles, tregenza_solid_angles are its 577, and the other way round 145.
# zip() takes them without a word: the irradiance of the white sky is then .81 by Tregenza's patches, .86 by Reinhart's.
# The module's view_sphere is shared by all that import it; a new ViewSphere starts anew.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "ladybug-core==0.44.62"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version
from math import pi

from ladybug.viewsphere import ViewSphere

print("ladybug-core", version("ladybug-core"))
patches = {"tregenza": 145, "reinhart": 577}
expected = {("tregenza", "reinhart"): (3.14, 0.857), ("reinhart", "tregenza"): (3.14, 0.806)}
for order, sums in expected.items():
    sky = ViewSphere()
    for name, expected_sum in zip(order, sums):
        weights, vectors = getattr(sky, f"{name}_solid_angles"), getattr(sky, f"{name}_dome_vectors")
        irradiance = sum(weight * vector.z for weight, vector in zip(weights, vectors))
        print(
            f"first {order[0]}: {name} has {len(vectors)} vectors, {len(weights)} solid angles of sum {sum(weights) / pi:.3f} pi; "
            f"irradiance of a white sky {irradiance:.3f}"
        )
        if len(vectors) != patches[name] or len(weights) != patches[order[0]] or abs(irradiance - expected_sum) > 0.02:
            raise SystemExit("changed")
PY
