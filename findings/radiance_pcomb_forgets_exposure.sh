#!/usr/bin/env bash
# Radiance: pcomb and pcompos drop a picture's EXPOSURE, and a difference of pictures is not one of radiances.
#
# Guess: what a picture's values are to be divided by, EXPOSURE, is heeded or handed on by Radiance's own programs: a picture
# that goes through one of them shows the same radiance after it.
# Seen: pcomb takes the values as they are stored and writes no EXPOSURE (its line is indented, as history): a picture with
# EXPOSURE=2, of radiance 1, comes out as 2; less one of radiance 2, as 0. pcompos keeps a single picture's, and drops
# it beside another picture. pcomb -o, pfilt, pflip, rcomb and rmtxop show 1. pfilt writes an EXPOSURE unless told -1.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "pyradiance==1.3.1"
"$place/venv/bin/python" - "$place" <<'PY'
import os
import subprocess
import sys
from pathlib import Path

import pyradiance

place, programs = Path(sys.argv[1]), Path(pyradiance.__file__).parent / "bin"
os.chdir(place)
os.environ["RAYPATH"] = str(programs.parent / "lib")
os.environ["PATH"] = f"{programs}{os.pathsep}{os.environ['PATH']}"


def run(words, data=b""):
    return subprocess.run(words.split(), input=data, capture_output=True, check=True).stdout


print(run("rtrace -version").decode().strip())
for name, head in (("plain", b""), ("exposed", b"EXPOSURE=2\n")):
    pixel = bytes((128, 128, 128, 130))
    Path(f"{name}.hdr").write_bytes(b"#?RADIANCE\n" + head + b"FORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 4\n" + 16 * pixel)


def radiance(words):
    """Of the first pixel, EXPOSURE undone, half a step of the mantissa taken off."""
    shown = float(run("pvalue -o -d -h -H", run(words)).split()[0])
    print(f"{words:34} radiance {shown:.3f}")
    return round(shown * 128 / 128.5, 2)


seen = {
    words: radiance(words)
    for words in (
        "pfilt -1 plain.hdr",
        "pfilt -1 exposed.hdr",
        "pflip -h exposed.hdr",
        "rcomb -fc exposed.hdr",
        "rmtxop -fc exposed.hdr",
        "pcomb -o exposed.hdr",
        "pcompos exposed.hdr 0 0",
        "pcomb exposed.hdr",
        "pcompos exposed.hdr 0 0 plain.hdr 4 0",
        "pcomb -s 1 plain.hdr -s -1 exposed.hdr",
    )
}
print("EXPOSURE" in run("pfilt plain.hdr").decode("latin-1"), "is whether pfilt without -1 writes an EXPOSURE")
if list(seen.values()) != [2, 1, 1, 1, 1, 1, 1, 2, 2, 0]:
    raise SystemExit("changed")
PY
