#!/usr/bin/env bash
# imageio: with PyAV or OpenCV beside it, an EXR, HDR or PFM file is read as bytes, and what is bright is 255.
#
# Guess: imageio alone has no reader for these files, and says so; with a package beside it that has one, imread gives
# the floating-point values of the file.
# Seen: alone it raises an error. With PyAV installed, imread gives uint8 for all three, with OpenCV for HDR and PFM, and
# no warning: every value from 1 up is 255; of a PFM file OpenCV's are rounded to whole numbers, .25 to 0 and 7 to 7. PyAV
# itself decodes the EXR file into floating-point numbers.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
pip=("$place/venv/bin/pip" install -q --disable-pip-version-check)
"${pip[@]}" "imageio==2.38.1" "numpy==2.4.6" "pillow==13.0.0" "OpenImageIO==3.2.2.0"
cat > "$place/read.py" <<'PY'
import sys
from pathlib import Path

import imageio
import imageio.v3 as iio
import numpy as np
import OpenImageIO as oiio

place, beside, expected = Path(sys.argv[1]), sys.argv[2], sys.argv[3:]
print("imageio", imageio.__version__, "with", beside)
image = np.full((8, 16, 3), 0.25, np.float32)
image[:, 4:8], image[:, 8:12], image[:, 12:] = 1, 7, 1000
seen = []
for kind in ("exr", "hdr", "pfm"):
    name = str(place / f"a.{kind}")
    out = oiio.ImageOutput.create(name)
    out.open(name, oiio.ImageSpec(16, 8, 3, oiio.FLOAT))
    out.write_image(image)
    out.close()
    try:
        pixels = iio.imread(name)
        seen.append(f"{pixels.dtype}: " + " ".join(map(str, pixels.reshape(-1, 16, 3)[0, ::4, 0])))
    except OSError:
        seen.append("error")
    print(f"{kind}, .25 1 7 1000: {seen[-1]}")
if seen != expected:
    raise SystemExit(f"changed: {seen}")
PY
python=("$place/venv/bin/python" "$place/read.py" "$place")
"${python[@]}" "neither" error error error
"${pip[@]}" "opencv-python-headless==5.0.0.93"
"${python[@]}" "OpenCV" error "uint8: 64 255 255 255" "uint8: 0 1 7 255"
"$place/venv/bin/pip" uninstall -q -y opencv-python-headless
"${pip[@]}" "av==18.1.0"
"${python[@]}" "PyAV" "uint8: 64 255 255 255" "uint8: 64 255 255 255" "uint8: 64 255 255 255"
"$place/venv/bin/python" - "$place" <<'PY'
import sys

import av

frame = next(av.open(f"{sys.argv[1]}/a.exr").decode(video=0))
pixels = frame.to_ndarray()
print("PyAV itself:", frame.format.name, pixels.dtype, *pixels[0, ::4, 0])
if pixels[0, -1, 0] != 1000:
    raise SystemExit("changed: PyAV")
PY
