#!/usr/bin/env bash
# three.js: a downlight's IES file, measured from 0 to 90 degrees, shines upwards with negative light, or with light.
#
# Guess: IESLoader's profile of a luminaire whose file ends at 90 degrees is 0 above, as LM-63 has it; no value is negative.
# Seen: the last interval is drawn on as a straight line to 180 degrees. A lamp of 1000, 500 and 0 cd at 0, 45 and 90 degrees has
# -1 times its peak straight up; where the last step falls from 800 to 500 cd, .3 of the peak at 120 degrees. Candelas
# are divided by the largest, so that two files of which one is twice as bright are the same texture.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
npm install --silent --no-audit --no-fund --prefix "$place" "three@0.187.0" > /dev/null
cat > "$place/run.mjs" <<'JS'
import * as THREE from "three";
import { IESLoader } from "three/examples/jsm/loaders/IESLoader.js";

console.log("three.js", THREE.REVISION);
const loader = new IESLoader();
loader.type = THREE.FloatType;

// The profile at each of 180 polar angles.
function profile(candelas, multiplier) {
  const head = ["IESNA:LM-63-2002", "[TEST] none", "[MANUFAC] none", "TILT=NONE"];
  const lines = [...head, `1 -1 ${multiplier} 3 1 1 2 0 0 0`, "1 1 100", "0 45 90", "0", candelas.join(" ")];
  const texture = loader.parse(lines.join("\n") + "\n");
  return (texture.image ?? texture).data;
}

const seen = {
  "1000 500 0": profile([1000, 500, 0], 1),
  "1000 800 500": profile([1000, 800, 500], 1),
  "1000 800 500, multiplier 2": profile([1000, 800, 500], 2),
};
for (const [name, data] of Object.entries(seen))
  console.log(`${name} cd: ` + [0, 45, 89, 100, 120, 150, 179].map((k) => `${k}: ${data[k].toFixed(3)}`).join("  "));
const [fading, ending, brighter] = Object.values(seen);
const same = ending.every((value, k) => value === brighter[k]);
if (!(Math.abs(fading[179] + 1) < 0.02 && Math.abs(ending[120] - 0.3) < 0.01 && same)) {
  console.log("changed");
  process.exit(1);
}
JS
cd "$place"
node run.mjs
