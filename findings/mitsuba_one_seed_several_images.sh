#!/usr/bin/env bash
# Mitsuba 3: a scene with several mesh lights is another image each time it is loaded, of the same seed.
#
# Guess: one scene, one seed, one variant, and on one machine the image is the same bit by bit, in every process.
# Seen: load_dict merges meshes, and they stand in another order in each process, their lights
# with them: which light a random number picks changes, and so does the image's noise. Its mean does not. With
# optimize=False all processes have one image.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "mitsuba==3.9.1" "numpy==2.4.6"
cat > "$place/render.py" <<'PY'
import hashlib
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
at = mi.ScalarTransform4f
film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
scene = {
    "type": "scene",
    "integrator": {"type": "direct"},
    "sensor": {
        "type": "perspective",
        "fov": 50,
        "to_world": at().look_at(origin=[0, 3, 6], target=[0, 0, 0], up=[0, 1, 0]),
        "film": film,
        "sampler": {"type": "independent", "sample_count": 16},
    },
    "floor": {"type": "rectangle", "to_world": at().rotate([1, 0, 0], -90).scale(3)},
}
for k in range(6):
    shines = {"type": "area", "radiance": {"type": "rgb", "value": 1.0 + k}}
    scene[f"lamp{k}"] = {"type": "cube", "to_world": at().translate([k - 2.5, 2, 0]).scale(0.1), "emitter": shines}
loaded = mi.load_dict(scene, optimize=sys.argv[1] == "merged")
image = np.array(mi.render(loaded, seed=1))
print("mitsuba", mi.__version__, hashlib.sha256(image.tobytes()).hexdigest()[:12])
PY
for how in merged apart; do
    for run in 1 2 3 4 5 6 7 8; do "$place/venv/bin/python" "$place/render.py" "$how"; done | sort | uniq -c > "$place/$how"
    echo "$how: images of one seed, and how often"
    cat "$place/$how"
done
[ "$(wc -l < "$place/merged")" -gt 1 ] || { echo "changed: merged meshes give one image" >&2; exit 1; }
[ "$(wc -l < "$place/apart")" -eq 1 ] || { echo "changed: meshes apart give several images" >&2; exit 1; }
