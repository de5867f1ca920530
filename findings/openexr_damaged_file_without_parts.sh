#!/usr/bin/env bash
# OpenEXR's Python package: opening a file that is cut off raises nothing; the reason is printed, on standard output.
#
# Guess: OpenEXR.File(name) raises where it cannot decode the pixels, as OpenEXR.InputFile and a missing file do.
# Seen: it returns a file whose ``parts`` is empty, though header_only=True finds its part; "Warning: Exception raised
# reading pixel data" goes to standard output, between whatever the program prints there. Only .header() and .channels()
# raise then, "Invalid part index '0': file has 0 parts", without the reason.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "OpenEXR==3.5.3" "numpy==2.3.5"
cat > "$place/read.py" <<'PY'
import sys

import OpenEXR

for header_only in (True, False):
    with OpenEXR.File(sys.argv[1], header_only=header_only) as file:
        print("opened,", "header_only" if header_only else "with pixels", len(file.parts), "parts")
try:
    OpenEXR.InputFile(sys.argv[1]).channels("RGB")
except Exception as error:
    print("InputFile raises", type(error).__name__)
PY
"$place/venv/bin/python" - "$place" <<'PY'
import subprocess
import sys

import numpy as np
import OpenEXR

print("OpenEXR", OpenEXR.__version__)
whole, cut = f"{sys.argv[1]}/whole.exr", f"{sys.argv[1]}/cut.exr"
pixels = np.random.default_rng(0).random((64, 96, 3)).astype(np.float32)
with OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, {"RGB": pixels}) as file:
    file.write(whole)
data = open(whole, "rb").read()
open(cut, "wb").write(data[: len(data) // 2])
found = {}
for name in (whole, cut):
    done = subprocess.run([sys.executable, f"{sys.argv[1]}/read.py", name], capture_output=True, text=True)
    found[name] = done.stdout.splitlines()
    print(f"{name.rpartition('/')[2]}: status {done.returncode}, standard output:", *found[name], sep="\n  ")
lines = found[cut]
if found[whole] != ["opened, header_only 1 parts", "opened, with pixels 1 parts"]:
    raise SystemExit("changed: the whole file")
if "opened, with pixels 0 parts" not in lines or not any(line.startswith("Warning: Exception") for line in lines):
    raise SystemExit("changed: the cut file")
if "opened, header_only 1 parts" not in lines or not lines[-1].startswith("InputFile raises"):
    raise SystemExit("changed: the header, or InputFile")
PY
