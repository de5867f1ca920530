"""Work in pieces, on any executor: the same bits whoever does it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from .vectors import Floats, Ints

Result = TypeVar("Result")
STRIP = 16
"""Rows of pixels that are sorted as one: what is near shares its blockers."""
LARGEST = 8192
"""Points in a piece, at most."""


def pieces(order: Ints, smallest: int) -> list[Ints]:
    """A sorted index (n,) in pieces: a quarter of all, within bounds; the number of workers has no say."""
    size = min(max(-(-order.size // 4), smallest), LARGEST)
    return [order[start : start + size] for start in range(0, order.size, size)]


def each(work: Callable[..., Result], executor: Executor | None, *parts: Sequence[Any]) -> Iterable[Result]:
    """Results of ``work`` over the parts, in their order; here, where there is no executor or but one part.

    What has not begun is cancelled when whoever iterates stops.
    """
    return map(work, *parts) if executor is None or len(parts[0]) < 2 else executor.map(work, *parts)


def gathered(
    work: Callable[..., Floats], executor: Executor | None, index: Sequence[Ints], *arrays: NDArray[Any]
) -> Floats:
    """(3, n) of a work's values (3, k) over pieces (k,) of arrays (n,); the pieces' ``index`` holds each place once."""
    out = np.empty((3, arrays[0].size))
    values = each(work, executor, *([array[part] for part in index] for array in arrays))
    for part, piece in zip(index, values, strict=True):
        out[:, part] = piece
    return out
