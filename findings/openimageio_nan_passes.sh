#!/usr/bin/env bash
# OpenImageIO: idiff passes an image of nothing but NaN, and ImageBufAlgo.compare() counts no failure in it.
#
# Guess: a pixel that is NaN in one image and a number in the other is a failure, as it is within no threshold; so is an
# infinite one.
# Seen: compare() says error False and nfail 0 where one channel or all three are NaN, in one pixel or everywhere, and
# where one channel is infinite; the command idiff prints PASS and returns 0 for the same. Only a pixel that is infinite in
# all its channels fails. Of the figures, maxerror is infinite for one channel, and meanerror NaN for three.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "OpenImageIO==3.2.2.0" "numpy==2.3.5"
"$place/venv/bin/python" - "$place" <<'PY'
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

print("OpenImageIO", oiio.VERSION_STRING)
place = Path(sys.argv[1])
idiff = Path(sys.executable).with_name("idiff")
image = np.random.default_rng(0).uniform(0.5, 1, (16, 16, 3)).astype(np.float32)


def one_pixel(value, channels=slice(None)):
    other = image.copy()
    other[3, 5, channels] = value
    return other


def write(name, pixels):
    out = oiio.ImageOutput.create(str(place / name))
    out.open(str(place / name), oiio.ImageSpec(16, 16, 3, oiio.FLOAT))
    out.write_image(pixels)
    out.close()


def judge(what, other):
    """Whether the Python function and the command find a failure."""
    write("a.exr", image)
    write("b.exr", other)
    found = oiio.ImageBufAlgo.compare(oiio.ImageBuf(image), oiio.ImageBuf(other), 1e-3, 1e-3)
    run = subprocess.run([idiff, "-fail", "1e-3", place / "a.exr", place / "b.exr"], capture_output=True, text=True)
    print(
        f"{what:33} error {found.error!s:5} nfail {found.nfail} maxerror {found.maxerror:<4.2g} "
        f"meanerror {found.meanerror:<7.2g} idiff: {run.stdout.split()[-1]}, status {run.returncode}"
    )
    return found.error, run.returncode != 0


seen = [
    judge("the same image", image),
    judge(".01 more in one channel", one_pixel(image[3, 5, 1] + 0.01, 1)),
    judge("one channel of one pixel NaN", one_pixel(np.nan, 1)),
    judge("one pixel NaN", one_pixel(np.nan)),
    judge("all NaN", np.full_like(image, np.nan)),
    judge("one channel of one pixel infinite", one_pixel(np.inf, 1)),
    judge("one pixel infinite", one_pixel(np.inf)),
]
if seen != [(wrong, wrong) for wrong in (False, True, False, False, False, False, True)]:
    raise SystemExit(f"changed: {seen}")
PY
