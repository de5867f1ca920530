#!/usr/bin/env bash
# PFM: of six readers two multiply by a file's scale, two divide by it and two leave it out.
#
# Guess: what a PFM file's third line says beside the order of bytes is a factor that everybody multiplies by, or that
# everybody leaves out; nobody divides.
# Seen: of a file of ones with scale 2, Mitsuba and OpenImageIO make 2, OpenCV and FFmpeg (by PyAV) 0.5, Pillow and
# SimpleImageIO 1; little-endian (-2.0) and big-endian (2.0) alike.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "numpy==2.4.6" "mitsuba==3.9.1" "OpenImageIO==3.2.2.0" \
    "opencv-python-headless==5.0.0.93" "av==18.1.0" "pillow==13.0.0" "simpleimageio==1.13.0"
"$place/venv/bin/python" - "$place" <<'PY'
import sys
from importlib.metadata import version

import av
import cv2
import mitsuba as mi
import numpy as np
import OpenImageIO as oiio
import PIL.Image
import simpleimageio

mi.set_variant("scalar_rgb")
readers = {
    "mitsuba": lambda name: mi.Bitmap(name),
    "OpenImageIO": lambda name: oiio.ImageBuf(name).get_pixels(oiio.FLOAT),
    "opencv-python-headless": lambda name: cv2.imread(name, cv2.IMREAD_UNCHANGED),
    "av": lambda name: next(av.open(name).decode(video=0)).to_ndarray(),
    "pillow": lambda name: PIL.Image.open(name),
    "simpleimageio": simpleimageio.read,
}
expected = {"mitsuba": 2, "OpenImageIO": 2, "opencv-python-headless": 0.5, "av": 0.5, "pillow": 1, "simpleimageio": 1}
seen = {package: [] for package in readers}
for order, scale in (("<f4", b"-2.0"), (">f4", b"2.0")):
    name = f"{sys.argv[1]}/a.pfm"
    with open(name, "wb") as file:
        file.write(b"Pf\n4 3\n" + scale + b"\n" + np.ones((3, 4), order).tobytes())
    for package, read in readers.items():
        seen[package].append(float(np.asarray(read(name)).max()))
for package, values in seen.items():
    print(f"{package:22} {version(package):9} ones with scale -2.0 and 2.0 are read as", *values)
if seen != {package: [value, value] for package, value in expected.items()}:
    raise SystemExit("changed")
PY
