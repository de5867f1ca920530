"""One set of light points for every pixel: noise that is no noise.

With shared points an image is a sum over few points on the lights, the same weights everywhere; with points of its own
for every pixel it is not. Weights of a grid of points on each light are fitted to half of the pixels and tried on the
other half: where they leave far less than independent noise must, the points are shared.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from nusselt.renderer.lights import Light
from nusselt.renderer.vectors import Floats

from .case import Case, Guess
from .probe import LOOK, Paths
from .rules import RIGHT, reflected

SIDE = 12
"""Points a side on each light."""
FIT = 1500
"""Pixels the weights are fitted to, and pixels they are tried on."""
LEAST = 0.25
"""Noise, in levels squared, below which whole levels hide it."""
FAR = 0.4
"""Share of the expected noise below which the rest must lie."""


def shared_points(case: Case, distance: float) -> tuple[Guess, Floats] | None:
    """The fitted image and its squares at the pixels it was tried on, where the points are shared; else None."""
    probe = case.probe
    noise = case.noise
    lights = [(p, p.light) for p in probe.paths if p.light.has_extent]
    if not lights or noise < LEAST or len(lights) * SIDE**2 > 2000:
        return None
    lit = np.flatnonzero(case.valid[probe.sight.lit])
    inside = ~np.asarray(case.quantiser.saturated(probe.truth, case.deviation)[:, probe.sight.lit].any(axis=0))
    lit = lit[inside[lit] & (probe.variance[:, probe.sight.lit[lit]].max(axis=0) > 0)]
    if lit.size < 500:
        return None
    rng = np.random.default_rng(0)
    chosen = rng.permutation(lit)[: 2 * FIT]
    fit, tried = chosen[::2], chosen[1::2]
    pixels = probe.sight.lit
    table = np.concatenate([_points_on(path, light, chosen) for path, light in lights], axis=2)  # (3, m, j)
    observed = np.mean([case.quantiser.decode(raw) for raw in case.raws], axis=0)[:, pixels]
    still = probe.truth[:, pixels] - _mean_of(case, [path for path, _ in lights])
    left = observed - still
    weights, _ = nnls(table[:, ::2].reshape(-1, table.shape[2]), left[:, fit].ravel(), maxiter=20 * table.shape[2])
    rest = left[:, tried] - table[:, 1::2] @ weights
    squares = ((255 * rest) ** 2).mean(axis=0)
    before = ((255 * (observed - probe.truth[:, pixels])[:, tried]) ** 2).mean()
    expected = (255**2 * probe.variance[:, pixels[tried]]).mean() / len(case.raws)
    if not squares.mean() < FAR * min(expected, before):
        return None
    detail = "the same light points serve every pixel: the noise is one pattern"
    share = float(squares.mean() / before)
    everywhere = np.full(int(case.valid.sum()), share * distance)
    return Guess(probe.truth, detail), everywhere


def _points_on(path: Paths, light: Light, chosen: np.ndarray) -> Floats:
    """Reflected radiance (3, m, SIDE^2) of each point of a grid on one light, were it the whole light."""
    points = path.sight.points.take(chosen)
    u, v = (part.ravel()[None] for part in np.meshgrid(*[(np.arange(SIDE) + 0.5) / SIDE] * 2, indexing="ij"))
    out = np.empty((3, points.count, u.size))
    for start in range(0, points.count, LOOK // 4):
        some = np.arange(start, min(start + LOOK // 4, points.count))
        few = points.take(some)
        d, _ = light.beams(few.position, u, v)
        seen = path.visible(chosen[some], d, light.at_infinity)
        out[:, some] = reflected(few, light, d, seen, RIGHT, u.size)
    return out


def _mean_of(case: Case, lights: list[Paths]) -> Floats:
    """What the lights with extent bring to the lit points on average, (3, m)."""
    probe = case.probe
    parts = [reflected(probe.sight.points, path.light, path.d, path.seen("right"), RIGHT, 1)[..., 0] for path in lights]
    return np.asarray(sum(parts))
