#!/usr/bin/env bash
# three.js: EXRLoader makes half floats of a 32-bit file, cut off and not rounded, with the bottom row first.
#
# Guess: parse() of a 32-bit EXR file gives its 32-bit numbers, top row first, as parse() of an HDR file does; where half
# floats are made, they are rounded.
# Seen: it gives half floats unless told setDataType(FloatType): 0.035 % darker on the average, up to .098 %, and 65504 for
# 100,000 with a warning. The first row is the image's bottom row; HDRLoader's is the top row.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "OpenImageIO==3.2.2.0" "numpy==2.4.6"
npm install --silent --no-audit --no-fund --prefix "$place" "three@0.187.0" > /dev/null
"$place/venv/bin/python" - "$place" <<'PY'
import sys

import numpy as np
import OpenImageIO as oiio

image = np.exp(np.random.default_rng(0).uniform(-3, 3, (64, 64, 3))).astype(np.float32)
image[0], image[-1] = 100_000, 2
for kind in ("exr", "hdr"):
    out = oiio.ImageOutput.create(f"{sys.argv[1]}/a.{kind}")
    out.open(f"{sys.argv[1]}/a.{kind}", oiio.ImageSpec(64, 64, 3, oiio.FLOAT))
    out.write_image(image)
    out.close()
PY
cat > "$place/run.mjs" <<'JS'
import fs from "fs";
import * as THREE from "three";
import { EXRLoader } from "three/examples/jsm/loaders/EXRLoader.js";
import { HDRLoader } from "three/examples/jsm/loaders/HDRLoader.js";

console.log("three.js", THREE.REVISION);
const file = (name) => new Uint8Array(fs.readFileSync(name)).buffer;
console.warn = () => {};
const asked = new EXRLoader();
asked.setDataType(THREE.FloatType);
const exact = asked.parse(file("a.exr")).data;
const half = Array.from(new EXRLoader().parse(file("a.exr")).data, THREE.DataUtils.fromHalfFloat);
const errors = [];
for (let k = 0; k < half.length; k++) if (k % 4 < 3 && exact[k] < 60000) errors.push(half[k] / exact[k] - 1);
const mean = errors.reduce((sum, error) => sum + error, 0) / errors.length;
const worst = [errors.reduce((a, b) => Math.min(a, b)), errors.reduce((a, b) => Math.max(a, b))];
const brightest = half.reduce((a, b) => Math.max(a, b));
const askedHdr = new HDRLoader();
askedHdr.setDataType(THREE.FloatType);
const first = (data) => (data[0] > 60000 ? "top" : "bottom");
const rows = [first(exact), first(askedHdr.parse(file("a.hdr")).data)];
const percent = (value) => `${(100 * value).toFixed(4)} %`;
console.log(`EXRLoader: mean error ${percent(mean)}, from ${percent(worst[0])} to ${percent(worst[1])}`);
console.log(`EXRLoader: 100,000 read as ${brightest}, where floats are asked for as ${exact.reduce((a, b) => Math.max(a, b))}`);
console.log(`EXRLoader: ${rows[0]} row first, HDRLoader: ${rows[1]} row first`);
const same = mean < -1e-4 && mean > -1e-3 && worst[1] <= 1e-7 && brightest === 65504 && rows.join() === "bottom,top";
if (!same) {
  console.log("changed");
  process.exit(1);
}
JS
cd "$place"
node run.mjs
