"""Transfer and tone curves: known ones, and whatever rises as the right values rise."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from scipy.optimize import nnls

from nusselt.experiments.images.transfer import Transfer
from nusselt.renderer.vectors import Floats

from .case import Case, Guess

CURVES: dict[tuple[str, str], Callable[[Floats], Floats]] = {
    ("gamma", "encoded as sRGB"): Transfer("srgb").encode,
    ("gamma", "decoded from sRGB once too often"): lambda x: np.asarray(Transfer("srgb").decode(x)),
    ("gamma", "encoded with gamma 2.2"): lambda x: np.maximum(x, 0) ** (1 / 2.2),
    ("gamma", "decoded with gamma 2.2 once too often"): lambda x: np.maximum(x, 0) ** 2.2,
    ("tone-curve", "Reinhard's curve, x / (1 + x)"): lambda x: x / (1 + x),
    ("tone-curve", "Reinhard's curve, encoded with gamma 2.2"): lambda x: (x / (1 + x)) ** (1 / 2.2),
    ("tone-curve", "1 - exp(-x)"): lambda x: 1 - np.exp(-x),
    ("tone-curve", "the ACES curve as Narkowicz fits it"): lambda x: np.clip(
        x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0, 1
    ),
    ("tone-curve", "sRGB after the ACES curve"): lambda x: Transfer("srgb").encode(
        np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0, 1)
    ),
    ("tone-curve", "logarithm, log(1 + x)"): np.log1p,
}


def curves(case: Case) -> Iterator[Guess]:
    """A transfer or tone curve too many, or too few."""
    truth = np.maximum(case.truth, 0)
    for (name, told), curve in CURVES.items():
        yield Guess(name, curve(truth), told)
    power = case.nearest(lambda g: truth ** (1 / g), np.geomspace(0.3, 3.3, 25))
    yield Guess("gamma", truth ** (1 / power), f"encoded with gamma {power:.3g}: v^(1/{power:.3g})", 1)


KNOTS = 14
"""Between which an unknown curve is straight: each holds as many pixels."""
MIXED = (0.1, 0.2)
"""Shares of grey in each channel before a curve that takes colour out of what is bright."""
NEARLY = 0.5
"""Share of the squares that the curve alone must explain for that to be tried."""
CHANGED = 0.05
"""Relative change, of some value that is told, from which it is a curve."""
SHOWN = (0.1, 0.5, 0.9)
"""Quantiles of the right values at which a curve is told."""


def followed(case: Case) -> Iterator[Guess]:
    """Any curve that never falls, of each channel; of channels that are mixed a little first, as AgX's are."""
    at = np.quantile(case.truth[:, case.shaded if case.shaded.any() else case.valid], SHOWN)
    curve, there = _fitted(case, case.truth, at)
    if (np.abs(there - at) <= CHANGED * at).all():
        return
    yield curve
    if case.distance(curve.prediction) < (1 - NEARLY) * case.distance(case.truth):
        grey = case.truth.mean(axis=0)
        mixes = [_fitted(case, case.truth + share * (grey - case.truth), at, 1)[0] for share in MIXED]
        yield min(mixes, key=lambda guess: case.distance(guess.prediction))


def _fitted(case: Case, values: Floats, at: Floats, more: int = 0) -> tuple[Guess, Floats]:
    """Straight pieces that rise, by non-negative least squares of ramps from 0 to 1; and what they make of ``at``."""
    shares = np.linspace(0, 1, KNOTS)
    kinds = ((case.shaded, shares), (case.plain, shares[::4]))  # lights have few values, far from all others
    quantiles = [np.quantile(values[:, some], q) for some, q in kinds if some.any()]
    knots = np.unique(np.concatenate(([0.0, 1e-6 * case.truth.max()], *quantiles)))  # what is black may stay so
    weight = np.sqrt(case.weight)
    if case.quantiser.top:  # what is cut off tells of no curve
        weight = weight * (case.observed < case.quantiser.edges[-1]).all(axis=0)
    q, r = np.linalg.qr((_ramps(values, knots) * weight).reshape(knots.size, -1).T)
    rises, _ = nnls(r, q.T @ (case.observed * weight).ravel())
    there = np.tensordot(rises, _ramps(at, knots), 1)
    told = "values follow a curve of the right ones: "
    told += ", ".join(f"{x:.3g} is {y:.3g}" for x, y in zip(at, there, strict=True))
    curve = np.tensordot(rises, _ramps(values, knots), 1)
    return Guess("tone-curve", curve, told + (", and lose colour" if more else ""), knots.size + more), there


def _ramps(values: Floats, knots: Floats) -> Floats:
    """1, and from 0 to 1 between each two knots: (j, ...)."""
    ends = knots[:, None].reshape(-1, *[1] * values.ndim)
    rising = (values - ends[:-1]) / (ends[1:] - ends[:-1])
    return np.concatenate((np.ones_like(values)[None], np.clip(rising, 0, 1)))
