#!/usr/bin/env bash
# Raysect: a flat mesh seen from fifty units away shadows itself, and loses a good part of its light.
#
# Guess: a ray tracer whose coordinates are double precision shows a floor as bright from afar as from close by.
# Seen: the distance at which a mesh is met is a number of single precision, and new rays start 1e-6 off the surface: from
# some ten units away the hit point often lies behind the mesh, and rays to the light meet the floor they start from. A
# box of Raysect's own, which is met in double precision, is lit alike from everywhere.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "raysect==0.9.1" "numpy==2.4.6" "scipy==1.17.1" \
    "matplotlib==3.11.2"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
from raysect.core import AffineMatrix3D, Point3D
from raysect.core.math.random import seed
from raysect.core.workflow import SerialEngine
from raysect.optical import ConstantSF, World
from raysect.optical.material import Lambert, UniformSurfaceEmitter
from raysect.optical.observer import PinholeCamera, SpectralRadiancePipeline2D
from raysect.primitive import Box, Mesh

print("raysect", version("raysect"))


def radiance(away, of_mesh):
    """Mean of a floor seen from so far away, beneath a glowing ceiling that covers all it sees."""
    world, white, slope = World(), Lambert(ConstantSF(1.0)), 0.317
    if of_mesh:
        corners = np.array([[x, slope * x, z] for x, z in ((-9, -9), (-9, 9), (9, 9), (9, -9))], dtype=float)
        Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), smoothing=False, closed=False, parent=world, material=white)
    else:
        Box(Point3D(-9, -1, -9), Point3D(9, 0, 9), parent=world, material=white)
    glow = UniformSurfaceEmitter(ConstantSF(1.0))
    Box(Point3D(-9e3, 2e3, -9e3), Point3D(9e3, 2.1e3, 9e3), parent=world, material=glow)
    pipeline = SpectralRadiancePipeline2D()
    axes = np.array([[1.0, 0, 0, 0.3], [0, 0, -1, away], [0, 1, 0, 0.2], [0, 0, 0, 1]])
    camera = PinholeCamera((24, 24), fov=np.degrees(4 / away), parent=world, pipelines=[pipeline], transform=AffineMatrix3D(axes.tolist()))
    camera.pixel_samples, camera.spectral_bins, camera.min_wavelength, camera.max_wavelength = 32, 1, 500, 501
    camera.ray_extinction_min_depth, camera.ray_extinction_prob = 1, 0.0
    camera.ray_max_depth, camera.quiet = 2, True
    camera.render_engine = SerialEngine()
    seed(1)
    camera.observe()
    return float(pipeline.frame.mean.mean())


seen = {(away, of_mesh): radiance(away, of_mesh) for away in (4.0, 50.0, 500.0) for of_mesh in (True, False)}
for (away, of_mesh), value in seen.items():
    print(f"{'mesh' if of_mesh else 'box '} from {away:3g} away: {value / seen[4.0, of_mesh]:.3f} of that from 4")
if min(seen[away, False] / seen[4.0, False] for away in (50.0, 500.0)) < 0.9:
    raise SystemExit("changed: the box")
if seen[500.0, True] > 0.8 * seen[4.0, True]:
    raise SystemExit("changed: the mesh")
PY
