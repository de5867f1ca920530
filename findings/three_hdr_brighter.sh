#!/usr/bin/env bash
# three.js: HDRLoader makes a Radiance HDR file 0.39 % brighter than its bytes say: it divides mantissas by 255.
#
# Guess: a mantissa m with the exponent e is m / 256 times 2^(e - 128), or m + .5 for m as in Radiance.
# Seen: it is m / 255 times 2^(e - 128): 256/255 of what OpenImageIO reads, in every pixel; on the average over many
# mantissas 0.1 % more than Radiance's own reader makes of them.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
npm install --silent --no-audit --no-fund --prefix "$place" "three@0.187.0" > /dev/null
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "OpenImageIO==3.2.2.0" "numpy==2.4.6"
cat > "$place/run.mjs" <<'JS'
import fs from "fs";
import * as THREE from "three";
import { HDRLoader } from "three/examples/jsm/loaders/HDRLoader.js";

const loader = new HDRLoader();
loader.setDataType(THREE.FloatType);
const pixels = loader.parse(new Uint8Array(fs.readFileSync("a.hdr")).buffer).data;
console.log(JSON.stringify([THREE.REVISION, Array.from(pixels)]));
JS
cd "$place"
venv/bin/python - <<'PY'
import json
import subprocess

import numpy as np
import OpenImageIO as oiio

image = np.exp(np.random.default_rng(0).uniform(-3, 3, (64, 64, 3))).astype(np.float32)
out = oiio.ImageOutput.create("a.hdr")
out.open("a.hdr", oiio.ImageSpec(64, 64, 3, oiio.FLOAT))
out.write_image(image)
out.close()
plain = oiio.ImageBuf("a.hdr").get_pixels(oiio.FLOAT)
revision, values = json.loads(subprocess.run(["node", "run.mjs"], capture_output=True, check=True).stdout)
print("three.js", revision, "OpenImageIO", oiio.VERSION_STRING)
seen = np.reshape(values, (64, 64, 4))[:, :, :3]
lit = plain > 0
ratio = seen[lit] / plain[lit]
_, exponent = np.frexp(plain.max(axis=2, keepdims=True))
radiance = plain + np.ldexp(0.5, exponent - 8)
print(f"over OpenImageIO's values: {ratio.min():.6f} to {ratio.max():.6f}; 256/255 is {256 / 255:.6f}")
print(f"sum of the largest channels over Radiance's m + .5: {seen.max(axis=2).sum() / radiance.max(axis=2).sum():.6f}")
if np.abs(ratio - 256 / 255).max() > 1e-6:
    raise SystemExit("changed")
PY
