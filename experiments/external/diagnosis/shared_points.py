"""One set of light points for every pixel: noise that is no noise.

With shared points an image is a sum over few points on the lights, the same weights everywhere; with points of its own
for every pixel it is not. Weights of a grid of points on each light are fitted to half of the pixels and tried on the
other half: where they leave far less than independent noise must, the points are shared.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from nusselt.renderer.vectors import Floats

from .beams import RIGHT, Beams
from .case import Case
from .probe import LOOK, Paths

SIDE = 12
"""Points a side on each light."""
FIT = 1500
"""Pixels the weights are fitted to, and pixels they are tried on."""
LEAST = 0.25
"""Noise, in levels squared, below which whole levels hide it."""
FAR = 0.4
"""Share of the expected noise below which the rest must lie."""


def shared_points(case: Case) -> float | None:
    """The share of the noise that one set of points explains, tried on other pixels; None if they are not shared."""
    probe = case.probe
    paths = [path for path in probe.paths if path.light.has_extent]
    if not paths or len(paths) * SIDE**2 > 2000:
        return None
    lit = probe.sight.lit
    noisy = np.flatnonzero(case.valid[lit] & (probe.variance[:, lit].max(axis=0) > 0))
    if noisy.size < 500 or 255**2 * probe.variance[:, lit[noisy]].mean() / len(case.images) < LEAST:
        return None
    chosen = np.random.default_rng(0).permutation(noisy)[: 2 * FIT]
    fit, tried = chosen[::2], chosen[1::2]
    table = np.concatenate([_points_on(path, chosen) for path in paths], axis=2)  # (3, m, j)
    still = case.truth[:, lit] - sum(path.right.mean(axis=2) for path in paths)
    left = case.observed[:, lit] - still
    weights, _ = nnls(table[:, ::2].reshape(-1, table.shape[2]), left[:, fit].ravel(), maxiter=20 * table.shape[2])
    rest = left[:, tried] - table[:, 1::2] @ weights
    before = float(((case.observed - case.truth)[:, lit[tried]] ** 2).mean())
    expected = float(probe.variance[:, lit[tried]].mean()) / len(case.images)
    if not float((rest**2).mean()) < FAR * min(expected, before):
        return None
    return 1 - float((rest**2).mean()) / before


def _points_on(path: Paths, chosen: np.ndarray) -> Floats:
    """Reflected radiance (3, m, SIDE^2) of each point of a grid on one light, were it the whole light."""
    points = path.sight.points.take(chosen)
    u, v = (part.ravel()[None] for part in np.meshgrid(*[(np.arange(SIDE) + 0.5) / SIDE] * 2, indexing="ij"))
    out = np.empty((3, points.count, u.size))
    for start in range(0, points.count, LOOK // 4):
        some = np.arange(start, min(start + LOOK // 4, points.count))
        at = points.take(some)
        d, _ = path.light.beams(at.position, u, v)
        seen = path.visible(chosen[some], d, path.light.at_infinity)
        out[:, some] = RIGHT.radiance(Beams(path.light, at, u, v, d, seen, u.size))
    return out
