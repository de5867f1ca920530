#!/usr/bin/env bash
# usd-core: a mesh is smooth, a mesh light dark and a distant light 50,000 times as strong as any other, unless said.
#
# Guess: a Mesh of polygons without subdivisionScheme is its polygons; a Mesh with MeshLightAPI and a colour shines with it;
# every light has intensity 1; treatAsPoint is an input as radius is.
# Seen: subdivisionScheme is catmullClark; materialSyncMode is materialGlowTintsLight, so that the light is its material's
# glow times the colour, and nothing without glow; a DistantLight's intensity is 50000; treatAsPoint has no "inputs:".
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "usd-core==26.11"
"$place/venv/bin/python" - <<'PY'
from pxr import Usd, UsdGeom, UsdLux

print("usd-core", ".".join(map(str, Usd.GetVersion())))
stage = Usd.Stage.CreateInMemory()
mesh = UsdGeom.Mesh.Define(stage, "/Mesh")
UsdLux.MeshLightAPI.Apply(mesh.GetPrim())
distant, ball = UsdLux.DistantLight.Define(stage, "/Distant"), UsdLux.SphereLight.Define(stage, "/Ball")
seen = {
    "Mesh subdivisionScheme": mesh.GetSubdivisionSchemeAttr().Get(),
    "MeshLightAPI light:materialSyncMode": mesh.GetPrim().GetAttribute("light:materialSyncMode").Get(),
    "MeshLightAPI inputs:intensity": mesh.GetPrim().GetAttribute("inputs:intensity").Get(),
    "SphereLight inputs:intensity": ball.GetIntensityAttr().Get(),
    "DistantLight inputs:intensity": distant.GetIntensityAttr().Get(),
    "SphereLight treatAsPoint": ball.GetTreatAsPointAttr().GetName(),
}
expected = {
    "Mesh subdivisionScheme": "catmullClark",
    "MeshLightAPI light:materialSyncMode": "materialGlowTintsLight",
    "MeshLightAPI inputs:intensity": 1.0,
    "SphereLight inputs:intensity": 1.0,
    "DistantLight inputs:intensity": 50000.0,
    "SphereLight treatAsPoint": "treatAsPoint",
}
for name, value in seen.items():
    print(f"{name}: {value}")
if seen != expected:
    raise SystemExit("changed")
PY
