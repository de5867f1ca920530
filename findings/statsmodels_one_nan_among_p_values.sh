#!/usr/bin/env bash
# statsmodels: one NaN among the p-values, as of a pixel without noise, and multipletests finds nothing, or no corrected p.
#
# Guess: multipletests refuses NaN, as scipy.stats.false_discovery_control does, or leaves it NaN and treats the others as it
# does without it.
# Seen: of a thousand p-values of which ten are 1e-9, bonferroni, sidak and holm find the ten with or without a NaN beside
# them; hommel and fdr_gbs find none. simes-hochberg, fdr_bh, fdr_by and fdr_tsbh still find them, but all their thousand
# corrected p-values are NaN, and none of those is below alpha. No warning is given.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "statsmodels==0.15.0" "scipy==1.17.1" "numpy==2.4.6" "pandas==3.1.1"
"$place/venv/bin/python" - <<'PY'
import numpy as np
import scipy
import statsmodels
from scipy import stats
from statsmodels.stats.multitest import multipletests

print("statsmodels", statsmodels.__version__, "SciPy", scipy.__version__)
p = np.random.default_rng(0).random(1000)
p[::100] = 1e-9
with_nan = np.append(p, np.nan)
# Of ten that differ: how many are found, and how many corrected p-values are below alpha, with a NaN beside them.
expected = {
    "bonferroni": (10, 10),
    "sidak": (10, 10),
    "holm": (10, 10),
    "holm-sidak": (10, 10),
    "simes-hochberg": (10, 0),
    "hommel": (0, 0),
    "fdr_bh": (10, 0),
    "fdr_by": (10, 0),
    "fdr_tsbh": (10, 0),
    "fdr_gbs": (0, 0),
}
seen = {}
for method in expected:
    found, corrected = {}, {}
    for what, values in (("without", p), ("with", with_nan)):
        found[what], corrected[what] = multipletests(values, alpha=0.01, method=method)[:2]
    seen[method] = int(found["with"].sum()), int((corrected["with"] < 0.01).sum())
    print(
        f"{method:14} without NaN: {found['without'].sum()} found, {(corrected['without'] < 0.01).sum()} corrected p < alpha; "
        f"with one: {seen[method][0]} found, {seen[method][1]} corrected p < alpha"
    )
    if found["without"].sum() < 10 or (corrected["without"] < 0.01).sum() < 10:
        raise SystemExit(f"changed: without NaN, {method}")
try:
    stats.false_discovery_control(with_nan)
    refused = False
except ValueError as error:
    refused = True
    print("scipy.stats.false_discovery_control:", error)
if seen != expected or not refused:
    raise SystemExit(f"changed: {seen}")
PY
