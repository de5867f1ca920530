#!/usr/bin/env bash
# Babylon.js: an environment's diffuse light leaves out what is brighter than 4096, and its polynomial is blurred twice.
#
# Guess: irradiance that ConvertCubeMapToSphericalPolynomial makes of an environment is proportional to a sun in it; the
# polynomial says the same as the harmonics that are made of it, and of a white upper half sky both give 1 upwards (over pi),
# 0 downwards and 1/2 sideways, which harmonics of second order hold exactly.
# Seen: pixels are cut off at MAX_HDRI_VALUE, 4096: a sun of 100,000 gives 4 % of its light, without a word. The harmonics give
# 1.00, .00, .51; the polynomial, which materials with useSphericalHarmonics = false take, .84, .18, .51: the cosine's factor
# is in it twice.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
npm install --silent --no-audit --no-fund --prefix "$place" "@babylonjs/core@9.31.0" > /dev/null
cat > "$place/run.mjs" <<'JS'
import { AbstractEngine } from "@babylonjs/core/Engines/abstractEngine.js";
import { CubeMapToSphericalPolynomialTools } from "@babylonjs/core/Misc/HighDynamicRange/cubemapToSphericalPolynomial.js";
import { PanoramaToCubeMapTools } from "@babylonjs/core/Misc/HighDynamicRange/panoramaToCubemap.js";

console.log("Babylon.js", AbstractEngine.Version);
const height = 128, width = 256, size = 64;

// Irradiance over pi by the polynomial and by the harmonics, as the shader harmonicsFunctions evaluates them.
function irradiance(radianceOfRow, [x, y, z]) {
  const pixels = Float32Array.from({ length: height * width * 3 }, (_, k) => radianceOfRow(Math.floor(k / (3 * width))));
  const cube = PanoramaToCubeMapTools.ConvertPanoramaToCubemap(pixels, width, height, size);
  const p = CubeMapToSphericalPolynomialTools.ConvertCubeMapToSphericalPolynomial({ ...cube, size, format: 4, type: 1, gammaSpace: false });
  const h = p.preScaledHarmonics;
  const polynomial = p.x.x * x + p.y.x * y + p.z.x * z + p.xx.x * x * x + p.yy.x * y * y + p.zz.x * z * z
    + p.yz.x * y * z + p.zx.x * z * x + p.xy.x * x * y;
  const harmonics = h.l00.x + h.l1_1.x * y + h.l10.x * z + h.l11.x * x + h.l2_2.x * y * x + h.l2_1.x * y * z
    + h.l20.x * (3 * z * z - 1) + h.l21.x * z * x + h.l22.x * (x * x - y * y);
  return [polynomial, harmonics];
}

let changed = false;
const near = (value, expected) => { if (Math.abs(value - expected) > 0.02) changed = true; };
const upper = (row) => (row < height / 2 ? 1 : 0);
for (const [name, normal, blurred, right] of [["up", [0, 1, 0], 5 / 6, 1], ["down", [0, -1, 0], 1 / 6, 0], ["sideways", [1, 0, 0], 0.5, 0.5]]) {
  const [polynomial, harmonics] = irradiance(upper, normal);
  console.log(`upper half white, ${name}: polynomial ${polynomial.toFixed(3)}, harmonics ${harmonics.toFixed(3)}`);
  near(polynomial, blurred);
  near(harmonics, right);
}
const of = (sun) => irradiance((row) => (row < 4 ? sun : 0), [0, 1, 0])[1] / sun;
for (const sun of [1, 1000, 4000, 10000, 100000]) {
  const share = of(sun) / of(1);
  console.log(`a sun of ${sun}: ${share.toFixed(3)} of the light that one of 1 gives, for its radiance`);
  near(share, Math.min(1, 4096 / sun));
}
if (changed) {
  console.log("changed");
  process.exit(1);
}
JS
cd "$place"
node run.mjs
