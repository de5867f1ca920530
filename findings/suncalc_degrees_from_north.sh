#!/usr/bin/env bash
# suncalc (npm): from version 2 the sun's place is in degrees from the north, where it was in radians from the south.
#
# Guess: getPosition(date, latitude, longitude) gives altitude and azimuth in radians, the azimuth from the south westwards,
# as in version 1 and in its ports to other languages; a change of that would be a change of names.
# Seen: 2.0.2 gives degrees, the azimuth clockwise from the north, beneath the same names. A program of version 1, which takes
# sines and cosines, runs on with its sun elsewhere: at 50 N on a June morning 41 degrees away, 68 degrees high and not 46.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
npm install --silent --no-audit --no-fund --prefix "$place" "before@npm:suncalc@1.9.0" "now@npm:suncalc@2.0.2" > /dev/null
cat > "$place/run.mjs" <<'JS'
import fs from "fs";
import * as before from "before";
import * as now from "now";

const when = new Date("2026-06-21T09:00:00Z");
const seen = {};
for (const [name, made] of Object.entries({ before, now })) {
  const { altitude, azimuth } = (made.getPosition ? made : made.default).getPosition(when, 50, 0);
  const direction = [Math.cos(altitude) * Math.sin(azimuth), Math.cos(altitude) * Math.cos(azimuth), Math.sin(altitude)];
  const { version } = JSON.parse(fs.readFileSync(`node_modules/${name}/package.json`));
  console.log(`suncalc ${version}: altitude ${altitude.toFixed(3)}, azimuth ${azimuth.toFixed(3)}`);
  seen[name] = { altitude, azimuth, direction };
}
const degrees = 180 / Math.PI;
const near = (a, b) => Math.abs(a - b) < 0.2;
const same = near(seen.before.altitude * degrees, seen.now.altitude) && near(seen.before.azimuth * degrees + 180, seen.now.azimuth);
console.log("the same place, if the old is radians from the south and the new degrees from the north:", same);
const [one, other] = [seen.before.direction, seen.now.direction];
const away = Math.acos(one.reduce((sum, value, k) => sum + value * other[k], 0)) * degrees;
console.log(`where a program of version 1 has the sun now: ${(Math.asin(other[2]) * degrees).toFixed(1)} degrees high, ${away.toFixed(1)} away`);
if (!same || away < 10) {
  console.log("changed");
  process.exit(1);
}
JS
cd "$place"
node run.mjs
