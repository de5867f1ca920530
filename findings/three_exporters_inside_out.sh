#!/usr/bin/env bash
# three.js: a mirrored mesh is written inside out to OBJ, PLY and STL; in OBJ and PLY its normals say the contrary.
#
# Guess: what three.js draws from outside is exported facing outwards: where the matrix of an object mirrors, as with
# scale.x = -1, the exporters turn the order of each triangle's corners, as its renderer and its Raycaster do.
# Seen: the corners keep their order, so that the faces of a mirrored box look inwards (its signed volume is -8): a light
# that shines to its front side shines into itself. The vertex normals of the OBJ and the PLY still look outwards; those of
# the STL, inwards.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
cd "$place"
npm install --silent --no-audit --no-fund --prefix "$place" "three@0.187.0" > /dev/null
cat > "$place/run.mjs" <<'JS'
import * as THREE from "three";
import { OBJExporter } from "three/examples/jsm/exporters/OBJExporter.js";
import { PLYExporter } from "three/examples/jsm/exporters/PLYExporter.js";
import { STLExporter } from "three/examples/jsm/exporters/STLExporter.js";
import { OBJLoader } from "three/examples/jsm/loaders/OBJLoader.js";
import { PLYLoader } from "three/examples/jsm/loaders/PLYLoader.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";

console.log("three.js", THREE.REVISION);

// The signed volume, and the share of the vertex normals that look away from the box's middle.
function facing(geometry) {
  const flat = geometry.index ? geometry.toNonIndexed() : geometry;
  const place = flat.attributes.position, normal = flat.attributes.normal;
  const at = (array, k) => new THREE.Vector3().fromBufferAttribute(array, k);
  let volume = 0, outwards = 0;
  for (let k = 0; k < place.count; k += 3)
    volume += at(place, k).dot(at(place, k + 1).cross(at(place, k + 2))) / 6;
  for (let k = 0; k < place.count; k++) outwards += at(place, k).dot(at(normal, k)) > 0;
  return [volume, outwards / place.count];
}

let changed = false;
for (const mirror of [1, -1]) {
  const box = new THREE.Mesh(new THREE.BoxGeometry(2, 2, 2));
  box.scale.x = mirror;
  box.updateMatrixWorld(true);
  const seen = {
    OBJ: facing(new OBJLoader().parse(new OBJExporter().parse(box)).children[0].geometry),
    PLY: facing(new PLYLoader().parse(new PLYExporter().parse(box, null, {}))),
    STL: facing(new STLLoader().parse(new STLExporter().parse(box))),
  };
  for (const [kind, [volume, outwards]] of Object.entries(seen)) {
    console.log(`scale.x ${mirror} ${kind}: volume ${volume.toFixed(3)}, normals outwards ${outwards}`);
    const expected = kind === "STL" && mirror < 0 ? 0 : 1;
    if (Math.abs(volume - 8 * mirror) > 1e-4 || outwards !== expected) changed = true;
  }
  const ray = new THREE.Raycaster(new THREE.Vector3(0.1, 0.2, 5), new THREE.Vector3(0, 0, -1));
  const hits = ray.intersectObject(box).map((hit) => hit.distance);
  console.log(`scale.x ${mirror} Raycaster, front sides only: met at ${hits}`);
  if (hits.length !== 1 || Math.abs(hits[0] - 4) > 1e-6) changed = true;
}
if (changed) {
  console.log("changed");
  process.exit(1);
}
JS
node "$place/run.mjs"
