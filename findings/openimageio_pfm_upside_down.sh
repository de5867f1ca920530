#!/usr/bin/env bash
# OpenImageIO: the PFM file that it writes it reads upside down, unless an empty configuration is given.
#
# Guess: what ImageBuf or ImageInput reads from a PFM file is what ImageOutput wrote into it, top row first.
# Seen: the file is right (rows from the bottom up, as Debevec's and netpbm's descriptions have it). ImageBuf(name) and
# ImageInput.open(name) give its bottom row first. ImageInput.open(name, ImageSpec()), whose configuration is empty, and
# "pnm:pfmflip" = 1, which is said to be the default, give the top row first.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "OpenImageIO==3.2.2.0" "numpy==2.3.5"
"$place/venv/bin/python" - "$place/a.pfm" <<'PY'
import sys

import numpy as np
import OpenImageIO as oiio

print("OpenImageIO", oiio.VERSION_STRING)
name, (height, width) = sys.argv[1], (3, 4)
image = np.arange(height * width * 3, dtype=np.float32).reshape(height, width, 3)
out = oiio.ImageOutput.create(name)
out.open(name, oiio.ImageSpec(width, height, 3, oiio.FLOAT))
out.write_image(image)
out.close()
stored = np.frombuffer(open(name, "rb").read()[-image.nbytes :], dtype="<f4").reshape(image.shape)


def order(pixels):
    pixels = np.asarray(pixels)
    return "top row first" if (pixels == image).all() else "bottom row first" if (pixels == image[::-1]).all() else "?"


empty, asked = oiio.ImageSpec(), oiio.ImageSpec()
asked.attribute("pnm:pfmflip", 1)
seen = {
    "stored in the file": order(stored),
    "ImageBuf(name)": order(oiio.ImageBuf(name).get_pixels(oiio.FLOAT)),
    "ImageInput.open(name)": order(oiio.ImageInput.open(name).read_image(format=oiio.FLOAT)),
    "ImageInput.open(name, ImageSpec())": order(oiio.ImageInput.open(name, empty).read_image(format=oiio.FLOAT)),
    "the same with pnm:pfmflip = 1": order(oiio.ImageInput.open(name, asked).read_image(format=oiio.FLOAT)),
}
for what, found in seen.items():
    print(f"{what:36} {found}")
if list(seen.values()) != ["bottom row first"] * 3 + ["top row first"] * 2:
    raise SystemExit("changed")
PY
