"""Pairs of things that belong together, without a loop."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.geometry.arrays import Ints


def joined(key: Ints, start: Ints, count: Ints) -> tuple[Ints, Ints]:
    """All pairs (i, j) with j in start[key[i]] .. start + count: indices i and j, each (k,)."""
    many = count[key]
    i = np.repeat(np.arange(key.size), many)
    before = np.cumsum(many) - many
    return i, start[key][i] + np.arange(i.size) - before[i]
