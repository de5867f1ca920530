"""`verdict.judge` for thousands of simulated rows at once: the same rules over arrays, tested equal to it.

Only what noise can trip is here: pooled mean, tiles, variance, spread of passes, and the objections. The standard
error of the variance ratio is the delta method's, which the pixel bootstrap of `spreads` agrees with.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from nusselt.renderer.vectors import Floats

from .earned import FEWEST, PASSES, SURE
from .inference import TILES, Bools, Level, tile_numbers
from .plain_pixels import ROUNDING
from .spreads import MARGIN
from .verdict import POWER, TILE_MARGIN


@dataclass(frozen=True)
class Rows:
    """Simulated rows, b of them, of images of p pixels in a square.

    Parameters
    ----------
    ours, theirs : (b, n, p), (b, r, p) float
        Channel averages, pass by pass.
    others : (b, k, p) float, optional
        Passes of Mitsuba's image for the same strategy.
    independent : bool
        See `verdict.Prior`.
    """

    ours: Floats
    theirs: Floats
    others: Floats | None = None
    independent: bool = True


@dataclass(frozen=True)
class Verdicts:
    """What is said of each row, all (b,).

    Parameters
    ----------
    differs, objected : bool
        The word is `differs`; the normal approximation was not earned.
    bias, error, reach : float64
        Relative; ``reach`` is half the interval.
    smallest : float64
        Smallest detectable bias, relative.
    place, noise : bool
        A tile failed; the variance or the spread of passes did.
    """

    differs: Bools
    objected: Bools
    bias: Floats
    error: Floats
    reach: Floats
    smallest: Floats
    place: Bools
    noise: Bools


def _resting_on(noise: Floats) -> Floats:
    scale = noise.max(axis=1, keepdims=True)
    shares = noise / np.where(scale > 0, scale, 1.0)
    square = (shares * shares).sum(axis=1)
    return np.where(square > 0, shares.sum(axis=1) ** 2 / np.where(square > 0, square, 1.0), noise.shape[1])


def _variance(values: Floats) -> Floats:
    return np.asarray(np.var(values, axis=1, ddof=1, dtype=np.float64))


def _heavy(passes: Floats) -> Bools:
    if passes.shape[1] < 20:
        return np.zeros(passes.shape[0], dtype=bool)
    flat = np.ptp(passes, axis=1) == 0
    spread = np.where(flat[:, None], np.random.default_rng(0).normal(size=passes.shape[1]), passes)
    tail = stats.kurtosistest(spread, axis=1, alternative="greater").pvalue
    return np.asarray((np.minimum(tail, stats.skewtest(spread, axis=1).pvalue) < SURE / 2) & ~flat)


def judge_many(rows: Rows, margin: float, level: Level) -> Verdicts:
    """Judge every row; see `verdict.judge`."""
    b, n, p = rows.ours.shape
    r = rows.theirs.shape[1]
    mine, theirs = rows.ours.mean(axis=1, dtype=np.float64), rows.theirs.mean(axis=1, dtype=np.float64)
    difference, scale = mine - theirs, np.abs(theirs).mean(axis=1)
    variance, their_variance = _variance(rows.ours), _variance(rows.theirs) / r
    noise = variance / n
    our_passes = rows.ours.mean(axis=2, dtype=np.float64)
    their_passes = rows.theirs.mean(axis=2, dtype=np.float64)
    if rows.independent:
        a, freedom_a = noise.sum(axis=1) / p**2, 2 * _resting_on(noise)
    else:
        a, freedom_a = _variance(our_passes) / n, np.full(b, n - 1.0)
    c = _variance(their_passes) / r
    weight = a**2 / freedom_a + c**2 / (r - 1)
    freedom = np.maximum(np.divide((a + c) ** 2, weight, out=np.full(b, 1e9), where=weight > 0), 1.0)
    error = np.sqrt(a + c)
    objected = _objected(variance, our_passes, not rows.independent) | _objected(their_variance, their_passes, True)
    sigmas = np.where(objected, math.sqrt(1 / level.pooled), stats.t.isf(level.pooled / 2, freedom))
    reach = sigmas * error / scale + ROUNDING
    bias = difference.mean(axis=1) / scale
    place = _places(difference, noise + their_variance, scale, margin, level, rows.independent)
    spread = _noises(rows, variance, our_passes, level)
    return Verdicts(
        differs=(np.abs(bias) - reach > margin) | place | spread,
        objected=objected,
        bias=bias,
        error=error / scale,
        reach=reach,
        smallest=margin + reach + stats.t.isf(1 - POWER, freedom) * error / scale,
        place=place,
        noise=spread,
    )


def _objected(noise: Floats, passes: Floats, by_passes: bool) -> Bools:
    found = (_resting_on(noise) < FEWEST) | _heavy(passes)
    if by_passes and passes.shape[1] < PASSES:
        found[:] = True
    return found & (noise.max(axis=1) > 0)


def _places(difference: Floats, noise: Floats, scale: Floats, margin: float, level: Level, independent: bool) -> Bools:
    b, p = difference.shape
    if not independent:
        return np.zeros(b, dtype=bool)
    side = math.isqrt(p)
    member = np.eye(TILES**2)[tile_numbers(side, side).ravel()]  # (p, tiles)
    count = member.sum(axis=0)
    some = count > 0
    size = np.where(some, count, 1.0)
    total, square = noise @ member, noise**2 @ member
    bias, error = np.abs(difference @ member) / size, np.sqrt(total) / size
    freedom = np.maximum(np.divide(total**2, square, out=np.full(total.shape, 1e9), where=square > 0), 1.0)
    # A t quantile is never below the normal one: most tiles need no t.
    allowed = ((TILE_MARGIN * margin + ROUNDING) * scale)[:, None]
    worth = some & (bias > stats.norm.isf(level.tile / 2) * error + allowed)
    failing = np.zeros(total.shape, dtype=bool)
    reach = stats.t.isf(level.tile / 2, freedom[worth]) * error[worth]
    failing[worth] = bias[worth] > reach + np.broadcast_to(allowed, bias.shape)[worth]
    return np.asarray(failing.any(axis=1))


def _noises(rows: Rows, variance: Floats, passes: Floats, level: Level) -> Bools:
    """Whether the variance ratio, or the spread of passes, fails."""
    b, n, p = rows.ours.shape
    found = np.zeros(b, dtype=bool)
    if rows.others is not None and p > 1:
        other = _variance(rows.others)
        both = (variance.mean(axis=1) > 0) & (other.mean(axis=1) > 0)
        x, y = (v[both] / v[both].mean(axis=1, keepdims=True) for v in (variance, other))
        freedom = np.maximum(np.minimum(_resting_on(x), _resting_on(y)) - 1, 1.0)
        reach = stats.t.isf(level.rest / 2, freedom) * (x - y).std(axis=1, ddof=1) / math.sqrt(p)
        ratio = np.log(variance[both].mean(axis=1) / other[both].mean(axis=1))
        found[both] = np.abs(ratio) - reach > math.log(1 + MARGIN)
        found |= (variance.mean(axis=1) > 0) != (other.mean(axis=1) > 0)
    if rows.independent and n >= 4:
        pooled = variance.sum(axis=1) / p**2
        some = pooled > 0
        value = _variance(passes)[some] / pooled[some]
        freedom = (n - 1) * _resting_on(variance[some])
        high: NDArray[np.float64] = stats.f.isf(level.rest / 2, n - 1, freedom)
        low: NDArray[np.float64] = stats.f.ppf(level.rest / 2, n - 1, freedom)
        found[some] |= (value / high > 1 + MARGIN) | (value / low < 1 / (1 + MARGIN))
    return found
