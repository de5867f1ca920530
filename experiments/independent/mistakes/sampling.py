"""Mistakes of random numbers, of sums of samples, and of the noise alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nusselt.experiments.independent.steps import Batch, Rng, places
from nusselt.experiments.independent.world import Bools, Floats

from .mistake import Mistake, Step

TILE = 32
"""Pixels a side of the largest, which may be larger than an image."""


def _by(number: Step) -> Step:
    """The step `places` that gives pixels of the same number(batch) the same points."""

    def step(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
        numbers = np.asarray(number(batch)) + 0 * batch.x
        rng = np.random.default_rng([batch.seed, 3, batch.light])
        every = replace(batch, x=np.arange(max(batch.shape[0] * batch.shape[1], TILE * TILE)), rng=rng)
        u, v = places(every, samples, strata)
        return u[numbers], v[numbers]

    return step


def _rounded(bits: int) -> Step:
    """The step `places` with random numbers of so few bits."""

    def step(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
        u, v = places(batch, samples, strata)
        return np.floor(2**bits * u) / 2**bits, np.floor(2**bits * v) / 2**bits

    return step


def _one_offset(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
    """All cells of a pixel are sampled at the same place."""
    side = math.isqrt(samples)
    i, j = np.divmod(np.arange(samples), side)
    x, y = batch.rng.random((2, batch.x.size, 1))
    return (i + x) / side, (j + y) / side


def _one_sample(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
    u, v = places(batch, 1, False)
    return np.repeat(u, samples, axis=1), np.repeat(v, samples, axis=1)


def _poor(batch: Batch, samples: int, strata: bool) -> tuple[Floats, Floats]:
    """Consecutive numbers of a congruential generator of 8 bits of state."""
    state = batch.rng.integers(0, 256, (batch.x.size, 1))
    steps = np.arange(samples)
    factor, sums = (
        np.array([pow(5, int(k), 256) for k in steps]),
        np.array([sum(5**j for j in range(k)) % 256 for k in steps]),
    )
    u = (state * factor + 3 * sums) % 256
    return u / 256, (5 * u + 3) % 256 / 256


def _among(values: Floats, count: int) -> Floats:
    """The mean of the first samples."""
    return np.asarray(values[:, :, :count].mean(axis=2))


def _lost(share: float) -> Step:
    """The step `gather` that loses a share of the samples."""
    return lambda values, rng: (values * (rng.random(values.shape[1:]) >= share)).mean(axis=2)


def _over(count: Step) -> Step:
    """The step `gather` with another divisor: count(samples)."""
    return lambda values, rng: values.sum(axis=2) / count(values.shape[2])


def _in_levels(values: Floats, rng: Rng) -> Floats:
    return np.asarray((np.floor(255 * values) / 255).mean(axis=2))


SAMPLING = (
    Mistake("same numbers in all pixels", "one set of random numbers an image", "ball", "places", _by(lambda batch: 0)),
    Mistake(
        "same numbers in pairs",
        "neighbours share theirs",
        "ball",
        "places",
        _by(lambda batch: batch.y * batch.shape[1] + batch.x // 2),
    ),
    Mistake("same numbers in a row", "pixels of a row share theirs", "ball", "places", _by(lambda batch: batch.y)),
    Mistake(
        "same numbers in blocks",
        "2 x 2 pixels share theirs",
        "ball",
        "places",
        _by(lambda batch: batch.y // 2 * batch.shape[1] + batch.x // 2),
    ),
    Mistake(
        "numbers repeated by tiles",
        "every tile of 16 x 16 pixels has the same",
        "ball",
        "places",
        _by(lambda batch: batch.y % 16 * 16 + batch.x % 16),
    ),
    Mistake(
        "numbers repeated by tiles of 32",
        "every tile of 32 x 32 pixels has the same",
        "ball",
        "places",
        _by(lambda batch: batch.y % TILE * TILE + batch.x % TILE),
    ),
    Mistake("seed ignored", "every image has the same random numbers", "ball", "seed", lambda seed: 0),
    Mistake("same number for all samples", "one point on the light a pixel", "ball", "places", _one_sample),
    Mistake("one offset for all cells", "a shifted lattice for jitter", "ball", "places", _one_offset),
    Mistake("random numbers of 8 bits", "and truncated", "ball", "places", _rounded(8), False),
    Mistake("random numbers of 4 bits", "and truncated", "ball", "places", _rounded(4), False),
    Mistake("a poor generator", "256 states", "ball", "places", _poor, False),
    Mistake("a sample in 1000 lost", "it counts as nothing", "ball", "gather", _lost(1e-3)),
    Mistake("a sample in 100 lost", "it counts as nothing", "ball", "gather", _lost(1e-2)),
    Mistake("roulette without its weight", "half of the samples are left out", "ball", "gather", _lost(0.5)),
    Mistake(
        "one sample too few",
        "the last cell counts as nothing",
        "ball",
        "gather",
        lambda values, rng: values[:, :, :-1].sum(axis=2) / values.shape[2],
    ),
    Mistake(
        "a cell left out",
        "the mean of the others",
        "ball",
        "gather",
        lambda values, rng: _among(values, values.shape[2] - 1),
    ),
    Mistake(
        "a quarter of the cells left out",
        "the mean of the others",
        "ball",
        "gather",
        lambda values, rng: _among(values, 3 * values.shape[2] // 4),
    ),
    Mistake("over n - 1", "the mean's divisor", "ball", "gather", _over(lambda n: n - 1)),
    Mistake("over n + 1", "the mean's divisor", "ball", "gather", _over(lambda n: n + 1)),
    Mistake(
        "samples cut off",
        "none is brighter than 0.1",
        "ball",
        "gather",
        lambda values, rng: np.minimum(values, 0.1).mean(axis=2),
    ),
    Mistake("median of samples", "for their mean", "ball", "gather", lambda values, rng: np.median(values, axis=2)),
    Mistake(
        "brightest and darkest left out",
        "a trimmed mean",
        "ball",
        "gather",
        lambda values, rng: np.sort(values, axis=2)[:, :, 1:-1].mean(axis=2),
    ),
    Mistake("samples in eight bits", "each is truncated", "ball", "gather", _in_levels),
)


def _few(values: Floats, share: float) -> Floats:
    return _among(values, max(1, round(share * values.shape[2])))


def _scattered(share: float, value: Step, fixed: bool = False) -> Step:
    """The step `finished` that changes a share of the shaded pixels by value(pixels, rng): others in each image."""

    def step(image: Floats, shaded: Bools, rng: Rng) -> Floats:
        chance = np.where(shaded, (np.random.default_rng(5) if fixed else rng).random(shaded.shape), 2)
        count = max(1, round(share * shaded.sum()))
        return np.where(chance <= np.sort(chance, axis=None)[count - 1], value(image, rng), image)

    return step


def _by_noise(size: float, shape: Step) -> Step:
    """The step `finished` times 1 + size N(0, 1), drawn in the shape given of (h, w)."""
    return lambda image, shaded, rng: np.where(
        shaded, image * (1 + size * rng.standard_normal(shape(*image.shape[1:]))), image
    )


NOISE = (
    Mistake(
        "half of the samples",
        "the variance is twice what is said",
        "ball",
        "gather",
        lambda values, rng: _few(values, 0.5),
        False,
    ),
    Mistake(
        "a sixth of the samples missing",
        "the variance is 1.2 times what is said",
        "ball",
        "gather",
        lambda values, rng: _few(values, 5 / 6),
        False,
    ),
    Mistake(
        "random for stratified",
        "strata are asked for, and not made",
        "ball",
        "places",
        lambda batch, samples, strata: places(batch, samples, False),
    ),
    Mistake("10 % noise added", "in every pixel", "ball", "finished", _by_noise(0.1, lambda h, w: (h, w))),
    Mistake(
        "3 % noise added", "in every pixel and channel", "ball", "finished", _by_noise(0.03, lambda h, w: (3, h, w))
    ),
    Mistake("1 % noise of rows", "common to a row", "ball", "finished", _by_noise(0.01, lambda h, w: (h, 1))),
    Mistake("1 % noise of columns", "common to a column", "ball", "finished", _by_noise(0.01, lambda h, w: (1, w))),
    Mistake("1 % noise of the image", "common to all of it", "ball", "finished", _by_noise(0.01, lambda h, w: (1, 1))),
    Mistake(
        "one pixel in 2000 black", "others in each image", "ball", "finished", _scattered(5e-4, lambda x, rng: 0 * x)
    ),
    Mistake(
        "one pixel in 2000 five times as bright",
        "others in each image",
        "ball",
        "finished",
        _scattered(5e-4, lambda x, rng: 5 * x),
    ),
    Mistake(
        "the same pixels in 2000 black",
        "in all images",
        "ball",
        "finished",
        _scattered(5e-4, lambda x, rng: 0 * x, True),
    ),
    Mistake(
        "the same pixels in 2000 five times as bright",
        "in all images",
        "ball",
        "finished",
        _scattered(5e-4, lambda x, rng: 5 * x, True),
    ),
    Mistake(
        "one pixel in 100 black", "others in each image", "ball", "finished", _scattered(1e-2, lambda x, rng: 0 * x)
    ),
    Mistake(
        "one pixel in 50 speckled",
        "by a fifth, up or down",
        "ball",
        "finished",
        _scattered(0.02, lambda x, rng: x * (1 + 0.2 * rng.choice([-1, 1], x.shape[1:]))),
    ),
)
