#!/usr/bin/env bash
# scikit-image: the error that phase_cross_correlation returns beside the shift says nothing by default.
#
# Guess: an image against itself, or against itself moved by whole rows, has error 0, as its documentation's
# "translation invariant normalised RMS error" suggests; unlike images have more.
# Seen: with the default normalization="phase" the error is 1 (to 1e-5) for an image against itself, against itself
# moved, and against another image alike. Only normalization=None gives 0 for the same image, and tells them apart.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "scikit-image==0.26.0" "numpy==2.3.5" "scipy==1.16.3"
"$place/venv/bin/python" - <<'PY'
import numpy as np
import skimage
from skimage.registration import phase_cross_correlation

print("scikit-image", skimage.__version__)
rng = np.random.default_rng(0)
disk = (np.hypot(*np.mgrid[-32:32, -32:32]) < 12) * 1.0
errors = {}
for name, image in (("noise", rng.random((64, 64))), ("disk", disk)):
    for rule in ("phase", None):
        for what, other in (("itself", image), ("moved 3 rows", np.roll(image, 3, 0)), ("other", rng.random((64, 64)))):
            shift, error, _ = phase_cross_correlation(image, other, normalization=rule)
            errors[name, rule, what] = float(error)
            print(f"{name:6} normalization={rule!s:6} against {what:13} shift {shift}  error {error:.6f}")
for (name, rule, what), error in errors.items():
    expected = 1 if rule == "phase" else 0 if what != "other" else None
    if expected is not None and abs(error - expected) > 1e-4:
        raise SystemExit(f"changed: {name}, {rule}, {what}: {error}")
if min(errors[name, None, "other"] for name in ("noise", "disk")) < 0.1:
    raise SystemExit("changed: without normalisation unlike images are not told apart")
PY
