#!/usr/bin/env bash
# sewar: visual information fidelity is nearly 1 for an image full of noise, if its numbers are small, and 0 if they are large.
#
# Guess: VIF is a ratio of information, 1 for the reference itself, and does not depend on the unit of the images; what
# functions beside it need of a unit, as psnr does, they take as MAX.
# Seen: vifp has a visual noise of variance 2 built in, of steps of 255, and no argument for the range. An image in 0 to 1 with
# noise of standard deviation .3 is .99, the same in 0 to 255 .10, and with numbers up to 10,000 .05; with noise of 1, and
# numbers up to .01, it is 1.13, more than the reference's. uqi does not depend on the unit.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "sewar==0.4.10" "numpy==1.26.4" "scipy==1.17.1"
"$place/venv/bin/python" - <<'PY'
from importlib.metadata import version

import numpy as np
from sewar.full_ref import uqi, vifp

print("sewar", version("sewar"))
rng = np.random.default_rng(0)
reference = rng.random((128, 128, 3))
expected = {0.02: (1.0, 1.0, 0.70, 0.38), 0.3: (1.033, 0.989, 0.099, 0.049), 1.0: (1.133, 0.764, 0.016, 0.008)}
for noise, values in expected.items():
    image = reference + rng.normal(0, noise, reference.shape)
    for unit, value in zip((0.01, 1, 255, 10000), values, strict=True):
        seen = vifp(reference * unit, image * unit)
        print(f"noise {noise:4} of the range, numbers up to {unit:5}: vifp {seen:.3f}, uqi {uqi(reference * unit, image * unit):.3f}")
        if abs(seen - value) > 0.03:
            raise SystemExit("changed")
PY
