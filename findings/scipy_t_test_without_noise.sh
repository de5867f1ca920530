#!/usr/bin/env bash
# SciPy: a pixel without noise that equals its reference in all of 256 images differs from it with p = 3e-40.
#
# Guess: a t test of equal numbers, whose variance is 0, gives NaN or p = 1; different constants give p = 0.
# Seen: ttest_1samp of 256 images that are all the reference gives p below 1e-39 for 97 % of the pixels, and NaN for
# the rest. The mean of equal numbers is rounded; each number then differs from it by the same last digit, and t is the
# square root of n - 1 whatever that digit is. ttest_ind of the same constant, 256 times and 129 times, gives p down to
# 1e-59 for two thirds of the pixels; as many times on both sides, p = 1 or NaN. A warning of "precision loss" is raised.
# ttest_rel, which subtracts first, gives NaN.
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
reference = np.random.default_rng(0).random((50, 40))


def images(count):
    return np.repeat(reference[None], count, axis=0)


def told(what, p):
    known = p[~np.isnan(p)]
    smallest = f"{known.min():.1g}" if known.size else "none"
    print(f"{what:30} p < 1e-6: {(known < 1e-6).sum() / p.size:5.1%}  NaN: {1 - known.size / p.size:6.1%}  smallest p: {smallest}")
    return p


with warnings.catch_warnings(record=True) as raised:
    warnings.simplefilter("always")
    one = {n: told(f"ttest_1samp, {n} images", stats.ttest_1samp(images(n), reference).pvalue) for n in (16, 64, 256)}
    unlike = told("ttest_ind, 256 images and 129", stats.ttest_ind(images(256), images(129)).pvalue)
    like = told("ttest_ind, 256 images and 256", stats.ttest_ind(images(256), images(256)).pvalue)
    pairs = told("ttest_rel, 256 images", stats.ttest_rel(images(256), images(256)).pvalue)
print("warnings:", sorted({str(warning.message).split(".")[0] for warning in raised}))
if (one[64] < 1e-6).mean() < 0.5 or not np.nanmin(one[256]) < 1e-39 or not (unlike < 1e-6).mean() > 0.3:
    raise SystemExit("changed: no difference is found any more")
if np.nanmin(like) < 1 or not np.isnan(pairs).all():
    raise SystemExit("changed: groups of one size, or pairs")
PY
