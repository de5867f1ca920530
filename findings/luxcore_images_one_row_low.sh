#!/usr/bin/env bash
# LuxCore: what a camera sees at a row's middle lies in the next row below: images are one row low.
#
# Guess: a sheet whose upper edge lies on the optical axis fills the lower half of an image of an even number of rows.
# Seen: the row beneath the middle, which is to show the sheet alone, shows nothing of it, at every size: images are one
# row low. Columns are where they should be.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "pyluxcore==2.11.2" "numpy==2.4.6"
cat > "$place/render.py" <<'PY'
import os
import sys
import time

import numpy as np
import pyluxcore

pyluxcore.Init()
pyluxcore.SetLogHandler(lambda line: None)
print("LuxCore", pyluxcore.Version())


def properties(values):
    found = pyluxcore.Properties()
    for name, value in values.items():
        found.Set(pyluxcore.Property(name, value))
    return found


def image(side, corners):
    """Of a glowing sheet in the plane z = 0, seen along -z from z = 1; fifteen degrees to either side."""
    scene = pyluxcore.Scene()
    scene.Parse(properties({
        "scene.camera.type": ["perspective"],
        "scene.camera.lookat.orig": [0.0, 0.0, 1.0],
        "scene.camera.lookat.target": [0.0, 0.0, 0.0],
        "scene.camera.up": [0.0, 1.0, 0.0],
        "scene.camera.fieldofview": [30.0],
        "scene.camera.autofocus.enable": [False],
        "scene.materials.glow.type": ["matte"],
        "scene.materials.glow.kd": [0.0, 0.0, 0.0],
        "scene.materials.glow.emission": [1.0, 1.0, 1.0],
        "scene.materials.glow.emission.power": [0.0],
        "scene.materials.glow.emission.efficency": [0.0],
        "scene.shapes.sheet.type": ["inlinedmesh"],
        "scene.shapes.sheet.vertices": [float(x) for corner in corners for x in (*corner, 0)],
        "scene.shapes.sheet.faces": [0, 1, 2, 0, 2, 3],
        "scene.objects.sheet.shape": ["sheet"],
        "scene.objects.sheet.material": ["glow"],
    }))
    film = {
        "renderengine.type": ["PATHCPU"], "renderengine.seed": [1], "film.width": [side], "film.height": [side],
        "film.filter.type": ["NONE"], "sampler.type": ["SOBOL"], "batch.haltspp": [16],
        "film.outputs.0.type": ["RGB"], "film.outputs.0.filename": ["unused.exr"],
    }
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties(film), scene))
    session.Start()
    while not session.HasDone():
        time.sleep(0.02)
        session.UpdateStats()
    session.Stop()
    found = np.zeros((side, side, 3), dtype=np.float32)
    session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, found)
    return found[::-1].mean(axis=2)  # rows come from the bottom up


changed = False
for side in (16, 64, 256):
    low = image(side, [(-2, -2), (2, -2), (2, 0), (-2, 0)]).mean(axis=1)  # what is below the axis
    right = image(side, [(0, -2), (2, -2), (2, 2), (0, 2)]).mean(axis=0)  # what is right of it
    half = side // 2
    print(f"{side:3} rows: below the axis {low[half - 1:half + 2].round(3)}, right of it {right[half - 1:half + 2].round(3)}")
    changed |= low[half] > 0.1 or low[half + 1] < 0.9 or right[half] < 0.9 or right[half - 1] > 0.1
sys.stdout.flush()
os._exit(1 if changed else 0)  # a thread of its log aborts the interpreter's usual end
PY
"$place/venv/bin/python" "$place/render.py" 2> "$place/log" || { tail -5 "$place/log"; exit 1; }
