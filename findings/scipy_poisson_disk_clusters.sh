#!/usr/bin/env bash
# SciPy: the n points of PoissonDisk.random(n) stand close together somewhere in the square, unless they fill it.
#
# Guess: random(n) gives n points spread over the unit square, no two nearer than the radius, as Sobol.random(n) spreads
# them; and points that fill the square are uniform, so that they average a function without bias.
# Seen: the points grow from one, and 64 of radius .02 stay within 8 % of the square: their standard deviation along an
# axis is below .1, where uniform points have .289. fill_space() covers the square, but has half as many points again
# within .02 of its border as uniform points have: x^2 averages to .3365, not to .3333.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install -q --disable-pip-version-check "scipy==1.17.1" "numpy==2.4.6"
"$place/venv/bin/python" - <<'PY'
import numpy as np
import scipy
from scipy.stats import qmc

print("SciPy", scipy.__version__, "NumPy", np.__version__)
spread = {"PoissonDisk": [], "Sobol": []}
patch = []
for seed in range(20):
    some = qmc.PoissonDisk(2, radius=0.02, rng=seed).random(64)
    spread["PoissonDisk"].append(some.std(axis=0).max())
    patch.append(np.ptp(some, axis=0).prod())
    spread["Sobol"].append(qmc.Sobol(2, rng=seed).random(64).std(axis=0).max())
for engine, values in spread.items():
    print(f"64 points of {engine:11}: standard deviation along an axis {min(values):.3f} to {max(values):.3f}; uniform: .289")
print(f"64 points of PoissonDisk: their box is {min(patch):.1%} to {max(patch):.1%} of the square")
full = [qmc.PoissonDisk(2, radius=0.05, rng=seed).fill_space() for seed in range(60)]
edge = np.array([(np.abs(points - 0.5) > 0.48).any(axis=1).mean() for points in full]) / (1 - 0.96**2)
square = np.array([(points**2).mean() for points in full])
for what, values, truth in (("share within .02 of the border", edge, 1.0), ("mean of x^2", square, 1 / 3)):
    print(f"fill_space, {what}: {values.mean():.4f} +- {values.std(ddof=1) / len(values) ** 0.5:.4f}; uniform: {truth:.4f}")
if max(spread["PoissonDisk"]) > 0.2 or min(spread["Sobol"]) < 0.25:
    raise SystemExit("changed: random")
if edge.mean() < 1.2 or square.mean() < 1 / 3 + 0.001:
    raise SystemExit("changed: fill_space")
PY
