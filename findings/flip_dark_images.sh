#!/usr/bin/env bash
# FLIP: of an image that is black in more than half of its pixels, HDR-FLIP sees what nobody does.
#
# Guess: the mean HDR-FLIP of two images that differ by a millionth, where they are black, is next to nothing.
# Seen: the highest of its exposures is the one at which the median of the reference is bright. Once more than half of the
# pixels are black, as backgrounds are, that is 2^24, and a millionth more in the background makes 0.0002 into 0.53.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "flip-evaluator==1.7" "numpy==2.3.5"
"$place/venv/bin/python" - <<'PY'
import numpy as np
from flip_evaluator import evaluate

bright = (0.2 + 0.8 * np.random.default_rng(1).random((48, 64, 3))).astype(np.float32)
found = {}
for lit in (32, 31):
    reference = bright.copy()
    reference[:, lit:] = 0
    test = reference.copy()
    test[:, lit:] = 1e-6
    _, found[lit], told = evaluate(reference, test, "HDR", applyMagma=False)
    print(f"{lit} of 64 columns lit: mean {found[lit]:.4f}, exposures up to 2^{told['stopExposure']:.1f}")
if not (found[32] < 1e-3 and found[31] > 0.1):
    raise SystemExit("changed")
PY
