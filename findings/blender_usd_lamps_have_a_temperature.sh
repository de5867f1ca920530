#!/usr/bin/env bash
# Blender: every lamp that it writes to USD has a colour temperature, also where the lamp uses none.
#
# Guess: a lamp whose "use temperature" is off is written without `enableColorTemperature`, or with it off.
# Seen: it is on, with the temperature that stands unused beside the switch; where that is 6500 K, the default, it is not
# written, and USD takes 6500 K, whose colour in UsdLux is (1.043, 0.984, 1.035): the light is pink by a few per cent.
# Needs Python 3.11, which bpy 5.0.1 is made for.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3.11 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "bpy==5.0.1" "usd-core==26.11"
cd "$place"
cat > "$place/write.py" <<'PY'
import bpy

print("Blender", bpy.app.version_string)
for name, temperature in (("default", 6500.0), ("warm", 3000.0)):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.object.light_add(type="AREA")
    lamp = bpy.context.object.data
    lamp.use_temperature, lamp.temperature = False, temperature
    bpy.ops.wm.usd_export(filepath=f"{name}.usda")
PY
"$place/venv/bin/python" "$place/write.py"
"$place/venv/bin/python" - <<'PY'
from pxr import Usd, UsdLux

seen = {}
for name in ("default", "warm"):
    stage = Usd.Stage.Open(f"{name}.usda")
    (lamp,) = (UsdLux.RectLight(prim) for prim in stage.Traverse() if prim.IsA(UsdLux.RectLight))
    on, kelvin = lamp.GetEnableColorTemperatureAttr().Get(), lamp.GetColorTemperatureAttr().Get()
    seen[name] = bool(on), kelvin
    print(f"{name}: enableColorTemperature {on}, {kelvin:g} K, colour {UsdLux.BlackbodyTemperatureAsRgb(kelvin)}")
if seen != {"default": (True, 6500.0), "warm": (True, 3000.0)}:
    raise SystemExit("changed")
PY
