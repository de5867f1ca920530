"""Delta debugging: the fewest parts that still fail.

A. Zeller and R. Hildebrandt, "Simplifying and isolating failure-inducing input", IEEE Trans. Software Eng. 28(2), 2002.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

Part = TypeVar("Part")


def ddmin(parts: Sequence[Part], fails: Callable[[tuple[Part, ...]], bool]) -> tuple[Part, ...]:
    """Parts of which none can be left out, found by leaving out halves, quarters and so on.

    Parameters
    ----------
    parts : sequence
        All of them fail.
    fails : callable
        Whether some of them do, in their order.
    """
    left, chunks = tuple(parts), 2
    while left:
        size = -(-len(left) // chunks)
        pieces = [left[start : start + size] for start in range(0, len(left), size)]
        rests = [left[: k * size] + left[(k + 1) * size :] for k in range(len(pieces))]
        smaller = next((piece for piece in (*pieces, *rests) if len(piece) < len(left) and fails(piece)), None)
        if smaller is not None:
            chunks = 2 if smaller in pieces else max(chunks - 1, 2)
            left = smaller
        elif size == 1:
            return left
        else:
            chunks = min(2 * chunks, len(left))
    return left
