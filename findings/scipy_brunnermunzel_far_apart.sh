#!/usr/bin/env bash
# SciPy: brunnermunzel finds no p at all, NaN, where every pixel of one image is brighter than every one of the other.
#
# Guess: the further two samples are apart, the smaller p is; of samples that do not overlap it is next to 0, as it is by
# mannwhitneyu, and a test of p < alpha finds the plainest of differences.
# Seen: of 64 values with noise .1 that are .2 apart, p is 4e-33; from .5 on, where they do not overlap, NaN, and NaN < alpha is
# False; so with 4 values that are .2 apart. A warning speaks of undefined degrees of freedom and says to try
# distribution="normal", which gives p = 0, also with 4 values a side, where one pair in 35 of the
# same kind is without overlap.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "scipy==1.17.1" "numpy==2.4.6"
"$place/venv/bin/python" - <<'PY'
import warnings

import numpy as np
import scipy
from scipy import stats

print("SciPy", scipy.__version__, "NumPy", np.__version__)
warnings.simplefilter("ignore")
rng = np.random.default_rng(0)
changed = False
for count in (4, 16, 64, 256):
    one = rng.normal(0, 0.1, count)
    for apart in (0.05, 0.2, 0.5, 1, 10):
        other = rng.normal(apart, 0.1, count)
        p, normal = (stats.brunnermunzel(one, other, distribution=name).pvalue for name in ("t", "normal"))
        rank, overlap = stats.mannwhitneyu(one, other).pvalue, one.max() > other.min()
        print(
            f"{count:3} values, {apart:4} apart, {'overlap   ' if overlap else 'no overlap'}: brunnermunzel p {p:<7.1g} "
            f"normal {normal:<7.1g} mannwhitneyu p {rank:.1g}"
        )
        changed |= np.isnan(p) == overlap or np.isnan(rank) or (not overlap and normal != 0)
if changed:
    raise SystemExit("changed")
PY
