#!/usr/bin/env bash
# py360convert: the outermost pixels of a cube's face or a perspective view are centred on its border: all is too large.
#
# Guess: e2p with a field of view of 90 degrees gives what a renderer gives whose camera has it: n pixels share the view, and
# their centres are at (2 i + 1) / n - 1 of the half width; so in a face of e2c, which shows a quarter of the horizon.
# Seen: the centres are at 2 i / (n - 1) - 1: the first and the last row and column look along the border itself, so that
# neighbouring faces hold their shared edge twice, and everything is n / (n - 1) as far from the middle as asked for: half a
# pixel at the border, 3 % with 32 pixels.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "py360convert==1.0.4" "numpy==2.4.6"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
import py360convert

print("py360convert", version("py360convert"))
HEIGHT, SIZE = 512, 32
polar = (np.arange(HEIGHT) + 0.5)[:, None] * np.pi / HEIGHT
azimuth = (np.arange(2 * HEIGHT) + 0.5) * np.pi / HEIGHT - np.pi
# A picture whose pixels hold the direction that they show: right, up, ahead.
directions = np.stack(
    [np.sin(polar) * np.sin(azimuth), np.cos(polar) + 0 * azimuth, np.sin(polar) * np.cos(azimuth)], axis=-1
).astype(np.float32)


def view(places):
    """The directions of pixels that are at these places of the half width."""
    right, up = np.meshgrid(places, -places)
    ahead = np.stack([right, up, np.ones_like(right)], axis=-1)
    return ahead / np.linalg.norm(ahead, axis=-1, keepdims=True)


middle_of_pixels, border_to_border = (2 * np.arange(SIZE) + 1) / SIZE - 1, 2 * np.arange(SIZE) / (SIZE - 1) - 1
faces = py360convert.e2c(directions, face_w=SIZE, mode="bilinear", cube_format="dict")
seen = {
    "e2c": faces["F"],
    "e2p": py360convert.e2p(directions, (90, 90), 0, 0, (SIZE, SIZE), mode="bilinear"),
}
for what, pixels in seen.items():
    off = [np.abs(pixels - view(places)).max() for places in (middle_of_pixels, border_to_border)]
    print(f"{what}: off by {off[0]:.4f} if centres are in the pixels, by {off[1]:.1e} if they go from border to border")
    if not (off[0] > 0.01 and off[1] < 1e-3):
        raise SystemExit(f"changed: {what}")
twice = np.abs(faces["F"][:, -1] - faces["R"][:, 0]).max()
print(f"last column of the front face and first of the right one: {twice:.1e} apart")
if twice > 1e-3:
    raise SystemExit("changed: the shared edge")
PY
