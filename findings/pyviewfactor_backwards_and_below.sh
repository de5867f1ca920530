#!/usr/bin/env bash
# pyviewfactor: compute_viewfactor(a, b) goes from b to a, and what of a facet is beneath the other's plane counts negative.
#
# Guess: compute_viewfactor(a, b) is the share of what leaves a that reaches b, F[i, j] that from i to j; of a facet that
# reaches below the horizon of the other only what is above counts, as a renderer or a closed form has it.
# Seen: it is from b to a, and F[i, j] from j to i: for a sensor of .1 and a ceiling of 2, exchanged names are a factor
# of 400. A floor's element sees .1116 of a wall 1 high at distance 1; if the wall goes on .5 below the floor,
# .0692, and if it goes on 1 below, 0. No warning is given.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "pyviewfactor==1.1.0" "pyvista==0.49.1" "numpy==2.4.6"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
import pyvista as pv
from pyviewfactor import compute_viewfactor, compute_viewfactor_matrix

print("pyviewfactor", version("pyviewfactor"))


def facet(*corners):
    return pv.PolyData(np.array(corners, dtype=float), faces=[4, 0, 1, 2, 3])


def wall(low, high):
    return facet((1, -1, low), (1, -1, high), (1, 1, high), (1, 1, low))


sensor = facet((-0.05, -0.05, 0), (0.05, -0.05, 0), (0.05, 0.05, 0), (-0.05, 0.05, 0))
ceiling = facet((-1, -1, 1), (-1, 1, 1), (1, 1, 1), (1, -1, 1))
area = 0.1**2 / 2.0**2
seen = {
    "compute_viewfactor(sensor, ceiling)": (compute_viewfactor(sensor, ceiling), 0.5538 * area),
    "compute_viewfactor(ceiling, sensor)": (compute_viewfactor(ceiling, sensor), 0.5538),
    "compute_viewfactor_matrix([sensor, ceiling])[0, 1]": (compute_viewfactor_matrix(sensor + ceiling)[0, 1], 0.5538 * area),
    "sensor to a wall from 0 to 1": (compute_viewfactor(wall(0, 1), sensor), 0.1116),
    "sensor to a wall from -.5 to 1": (compute_viewfactor(wall(-0.5, 1), sensor), 0.0692),
    "sensor to a wall from -1 to 1": (compute_viewfactor(wall(-1, 1), sensor), 0.0),
    "the same by compute_viewfactor_matrix": (compute_viewfactor_matrix(sensor + wall(-0.5, 1))[1, 0], 0.0692),
}
for what, (value, _) in seen.items():
    print(f"{what:51} {value:.6f}")
if any(abs(value - expected) > max(2e-3 * expected, 1e-9) for value, expected in seen.values()):
    raise SystemExit("changed")
PY
