#!/usr/bin/env bash
# hdrify (npm): the Radiance HDR files that it writes hold nothing between 0 and 1/256, and shadows come out dark or black.
#
# Guess: an image written as HDR keeps every value to a 256th of its pixel's largest channel, whatever its size, as its
# exponents of -128 to 127 are for; what the package writes it reads as bright.
# Seen: exponents below 0 are not used: everything below 1 is stored in steps of 1/256. A grey of .01 is read by OpenImageIO as
# .0078, one of .003 or .001 as 0, where those above 1 are within 1 %. hdrify itself reads the same .001 as .00196: black bytes
# are half a step to it.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
npm install --silent --no-audit --no-fund --prefix "$place" "hdrify@1.2.1" > /dev/null
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "OpenImageIO==3.2.2.0" "numpy==2.4.6"
cat > "$place/run.mjs" <<'JS'
import fs from "fs";
import { readHdr, writeHdr } from "hdrify";

const greys = JSON.parse(process.argv[2]);
const image = { width: 4, height: 4, linearColorSpace: "linear-rec709", metadata: {} };
const own = greys.map((grey, k) => {
  image.data = Float32Array.from({ length: 4 * 4 * 4 }, (_, i) => (i % 4 < 3 ? grey : 1));
  fs.writeFileSync(`${k}.hdr`, writeHdr(image));
  return readHdr(new Uint8Array(fs.readFileSync(`${k}.hdr`))).data[0];
});
console.log(JSON.stringify(own));
JS
cd "$place"
venv/bin/python - <<'PY'
import json
import subprocess

import OpenImageIO as oiio

package = json.load(open("node_modules/hdrify/package.json"))
print("hdrify", package["version"], "OpenImageIO", oiio.VERSION_STRING)
greys = [100.0, 3.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001]
own = json.loads(subprocess.run(["node", "run.mjs", json.dumps(greys)], stdout=subprocess.PIPE, check=True).stdout)
seen = {}
for k, (grey, back) in enumerate(zip(greys, own, strict=True)):
    seen[grey] = float(oiio.ImageBuf(f"{k}.hdr").get_pixels(oiio.FLOAT)[0, 0, 0])
    print(f"{grey:7g} written, read by OpenImageIO {seen[grey]:.5g} ({seen[grey] / grey - 1:+.1%}), by hdrify {back:.5g}")
if any(abs(seen[grey] / grey - 1) > 0.01 for grey in (100.0, 3.0)):
    raise SystemExit("changed: above 1")
if seen[0.001] != 0 or any(value * 256 % 1 for grey, value in seen.items() if grey < 1):
    raise SystemExit("changed: below 1")
if own[-1] < 0.0015:
    raise SystemExit("changed: as hdrify reads it")
PY
