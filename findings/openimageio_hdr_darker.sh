#!/usr/bin/env bash
# OpenImageIO: an image written as Radiance HDR and read again is darker, by 0.28 % of each pixel's largest channel.
#
# Guess: eight bits of mantissa round up as often as down, so that a mean over many pixels survives them.
# Seen: writing cuts mantissas off, and reading gives their lower ends (Radiance's own reader adds half a step): every
# value comes back lower or the same. EXPOSURE, by which a Radiance file says what its values are to be divided by, is
# read into "hdr:exposure", and the values are left as they are.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "OpenImageIO==3.2.2.0" "numpy==2.3.5"
"$place/venv/bin/python" - "$place/a.hdr" <<'PY'
import sys

import numpy as np
import OpenImageIO as oiio

print("OpenImageIO", oiio.VERSION_STRING)
name = sys.argv[1]
image = np.exp(np.random.default_rng(0).uniform(-3, 3, (256, 256, 3))).astype(np.float32)


def read():
    return oiio.ImageBuf(name).get_pixels(oiio.FLOAT)


out = oiio.ImageOutput.create(name)
out.open(name, oiio.ImageSpec(256, 256, 3, oiio.FLOAT))
out.write_image(image)
out.close()
plain = read()
error = (plain - image) / image.max(axis=2, keepdims=True)
print(f"of the largest channel: mean {error.mean():+.4%}, from {error.min():+.4%} to {error.max():+.4%}")
data = open(name, "rb").read()
open(name, "wb").write(data.replace(b"FORMAT", b"EXPOSURE=2.0\nFORMAT", 1))
exposure = oiio.ImageBuf(name).spec().get_float_attribute("hdr:exposure")
same = np.array_equal(read(), plain)
print("with EXPOSURE=2.0: hdr:exposure", exposure, "- the same values:", same)
if not (-0.004 < error.mean() < -0.002 and error.max() <= 1e-6 and exposure == 2 and same):
    raise SystemExit("changed")
PY
