"""Laws of noise by which reports are simulated: what both sides' passes may look like when both are right."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.side import Seen, Side
from nusselt.mitsuba_bridge.variance import Setting, measure_spread
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.vectors import Floats

OURS, THEIRS, OTHERS = 4, 32, 8
"""Passes of ours (the fewest of a check), of the reference, and of Mitsuba's own variance."""
SIDE = 20
"""Pixels a side."""
COLOUR = np.array([0.8, 0.5, 0.2], dtype=np.float32)[:, None]
NOTHING = 1e-9
"""A margin next to nothing."""

Draw = Callable[[np.random.Generator, int, int], Floats]
"""(generator, rows, passes) to values (rows, passes, channels, pixels) whose mean is the same for all passes."""


@dataclass(frozen=True)
class World:
    """A law of noise.

    Parameters
    ----------
    name : str
    draw : callable
    shares_points : bool
        Whether the pixels of a pass do; then ours gets as many passes as the reference.
    grain : float, optional
        The most that one sample brings to a pixel in one pass; None where values have no bound.
    """

    name: str
    draw: Draw
    shares_points: bool = False
    grain: float | None = None

    @property
    def passes(self) -> tuple[int, int, int]:
        return (THEIRS, THEIRS, 0) if self.shares_points else (OURS, THEIRS, OTHERS)

    def rows(self, rng: np.random.Generator, count: int, margin: float = NOTHING, bias: float = 0.0) -> Evidence:
        """Rows whose bias, relative to the reference's mean, is the one given."""
        n, r, k = self.passes
        ours, theirs, others = np.split(self.draw(rng, count, n + r + k), [n, n + r], axis=1)
        ours = ours + bias * theirs.mean() if bias else ours
        return simulated(ours, theirs, others if k else None, margin, self.shares_points, self.grain)


def simulated(
    ours: Floats,
    theirs: Floats,
    others: Floats | None,
    margin: float,
    shares_points: bool,
    grain: float | None = None,
) -> Evidence:
    """Evidence of square images all of whose pixels are shaded, from the passes (b, r, c, p) of both sides.

    Parameters
    ----------
    others : (b, k, c, p) float, optional
        Passes of Mitsuba's image for the same strategy.
    grain : float, optional
        See `World`.
    """
    mine, their = (
        replace(
            Side.of_passes(name, passes, by_passes),
            freedom=max(passes.shape[1] - 1.0, 1.0),
            grain=None if grain is None else np.full(passes.shape[3], grain / passes.shape[1]),
            shares_points=by_passes and shares_points and name == "ours",
        )
        for name, passes, by_passes in (("ours", ours, shares_points), ("the reference", theirs, True))
    )
    nothing = np.zeros(mine.grey_variance.shape)
    side = math.isqrt(mine.mean.shape[2])
    return Evidence(
        mine,
        their,
        (side, side),
        np.arange(side * side),
        (Seen(mine.mean, nothing, nothing), Seen(their.mean, nothing, nothing)),
        unjudged=np.zeros(side * side, dtype=bool),
        margin=margin,
        shares_points=shares_points,
        variance=None if others is None else others.mean(axis=2).var(axis=1, ddof=1, dtype=np.float64) / ours.shape[1],
    )


def _levels(pixels: int) -> Floats:
    """Standard deviations that differ from pixel to pixel as in a picture."""
    return np.asarray(0.0125 * np.random.default_rng(1).gamma(4.0, size=pixels), dtype=np.float32)


def _normal(side: int, share: float = 1.0) -> Draw:
    sigma = np.float32(share) * _levels(side * side)

    def draw(rng: np.random.Generator, rows: int, passes: int) -> Floats:
        return 1 + sigma * rng.standard_normal((rows, passes, 1, side * side), dtype=np.float32)

    return draw


def _heavy(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """Lognormal with a standard deviation of 2.9 means: excess kurtosis 10^4."""
    values = np.exp(1.5 * rng.standard_normal((rows, passes, 1, SIDE * SIDE), dtype=np.float32) - 1.125)
    return np.asarray(values)


def _pareto(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """Pareto with exponent 2.5: a variance, and no third moment."""
    return np.asarray(rng.random((rows, passes, 1, SIDE * SIDE), dtype=np.float32).clip(1e-7) ** (-1 / 2.5) * 0.6)


def _quiet(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """One pixel in fifty has noise."""
    values = np.ones((rows, passes, 1, SIDE * SIDE))
    noisy = slice(0, SIDE * SIDE, 50)
    values[..., noisy] += 0.3 * rng.standard_normal(values[..., noisy].shape)
    return values


def _coloured(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """Three channels, each with noise in common with the others and as much of its own."""
    noise = rng.standard_normal((2, rows, passes, 3, SIDE * SIDE), dtype=np.float32)
    return COLOUR * (1 + _levels(SIDE * SIDE) * (noise[0] + noise[1, :, :, :1]))


def _shared(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """Every pixel of a pass has the same light points."""
    own = 0.01 * rng.standard_normal((rows, passes, 1, SIDE * SIDE), dtype=np.float32)
    return np.asarray(1 + own + 0.1 * rng.standard_normal((rows, passes, 1, 1), dtype=np.float32))


def _shared_in_colour(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """The same in three channels: some of what the light points bring has a colour of its own."""
    return COLOUR * (_shared(rng, rows, passes) + 0.1 * rng.standard_normal((rows, passes, 3, 1), dtype=np.float32))


def from_pool(pool: Floats) -> Draw:
    """Whole passes out of a pool (passes, channels, pixels), dealt like cards: none twice in a row."""

    def draw(rng: np.random.Generator, rows: int, passes: int) -> Floats:
        hands = len(pool) // passes
        deals = [rng.permutation(len(pool))[: hands * passes].reshape(hands, passes) for _ in range(-(-rows // hands))]
        return pool[np.concatenate(deals)[:rows]]

    return draw


HITS, TRIES = 4.0, 16
"""What a hit brings, and samples of a pass, where samples are hits or misses."""


def _hits(chances: Floats) -> Draw:
    """Pixels whose samples are hits or misses, with chances of their own."""
    return lambda rng, rows, passes: np.asarray(
        HITS / TRIES * rng.binomial(TRIES, chances, (rows, passes, 1, chances.size)), dtype=np.float64
    )


def _chances(low: float, share: float) -> Floats:
    """Chances (p,) of hits, evenly in logarithm from ``low`` to a half, in a share of the pixels; others always hit."""
    drawn = np.random.default_rng(5).random((2, SIDE * SIDE))
    return np.where(drawn[0] < share, 0.5 * (2 * low) ** drawn[1], 1.0)


SIMULATED = (
    World("normal", _normal(SIDE)),
    World("tiny image", _normal(10)),
    World("one pixel", _normal(1)),
    World("heavy-tailed (lognormal)", _heavy),
    World("heavy-tailed (Pareto 2.5)", _pareto),
    World("nearly without noise", _quiet),
    World("rare hits", _hits(_chances(1e-4, 1.0)), grain=HITS / TRIES),
    World("hits in few pixels", _hits(_chances(1e-3, 0.02)), grain=HITS / TRIES),
    World("three channels", _coloured),
    World("shared light points", _shared, shares_points=True),
    World("shared light points, three channels", _shared_in_colour, shares_points=True),
)


STILL = World("normal, a tenth of the noise", _normal(SIDE, 0.1))


def real_worlds(passes: int, seed: int, timeout: float = 300.0) -> tuple[World, ...]:
    """Pools of passes of ours, and of Mitsuba's, of one small scene with a penumbra.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba cannot run here.
    """
    scene = load("cornell-boxes").with_(width=SIDE, height=SIDE)
    estimator = Area(samples=4, stratified=True)
    images = [render(scene, estimator, seed=seed + number) for number in range(passes)]
    ours = np.array([np.where(image.shaded, image.mean, 0).reshape(3, -1) for image in images])
    (found,) = measure_spread(scene, [Setting("stratified", 4, passes)], seed=seed, timeout=timeout, images=True)
    theirs = np.asarray(found.images).reshape(passes, 1, -1)
    return World("ours against ours", from_pool(ours)), World("Mitsuba against Mitsuba", from_pool(theirs))
