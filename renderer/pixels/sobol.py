"""Sobol's sequence in four dimensions, in copies scrambled at random: places in a pixel together with light points.

Of 2^k numbers from the first on, each copy has one in every box of area 2^-k with sides of powers of two, across the
first two dimensions: half-planes are told to N^-3/4, and so are shadows (Owen 1997; numbers of Joe & Kuo 2008).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from nusselt.renderer.vectors import Floats, Ints

FIRST = ((), (1,), (1, 3), (1, 3, 1))
"""Initial direction numbers of each dimension after van der Corput's."""
TAPS = ((), (1,), (1, 1), (0, 1, 1))
"""Its primitive polynomial's coefficients, that of x^(s - 1) first."""
SEED = 7


@lru_cache(maxsize=4)
def scrambled(copies: int, bits: int) -> Floats:
    """The first 2^bits points of each copy, (4, copies, 2^bits) in [0, 1)."""
    rng = np.random.default_rng(SEED)
    return np.stack([[_owen(_sequence(axis, bits), bits, rng) for _ in range(copies)] for axis in range(len(FIRST))])


def _sequence(axis: int, bits: int) -> Ints:
    """The first 2^bits numbers of a dimension, times 2^bits."""
    numbers, taps = list(FIRST[axis]) if axis else [1] * bits, TAPS[axis]
    for k in range(len(numbers), bits):
        number = numbers[k - len(taps)]
        for back, tap in enumerate(taps, start=1):
            number ^= (numbers[k - back] << back) * tap
        numbers.append(number)
    found, index = np.zeros(1 << bits, dtype=np.int64), np.arange(1 << bits)
    for k, number in enumerate(numbers[:bits]):
        found ^= np.where(index >> k & 1, number << (bits - 1 - k), 0)
    return found


def _owen(numbers: Ints, bits: int, rng: np.random.Generator) -> Floats:
    """Each digit of numbers (n,) is flipped or not by chance, once for all numbers with the same digits before it."""
    flips, node, found = rng.integers(0, 2, 1 << bits), np.ones_like(numbers), np.zeros_like(numbers)
    for k in reversed(range(bits)):
        digit = numbers >> k & 1
        found, node = 2 * found + (digit ^ flips[node]), 2 * node + digit
    return np.asarray((found + rng.random(numbers.size)) / (1 << bits))
