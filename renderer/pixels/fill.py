"""Radiance at pixel centres and in pieces of pixels, evaluated where it must be and interpolated where it is smooth.

Centres are taken far apart, then half as far, down to 2. A square of pixels between four of them that shows one region
throughout, and whose fourth differences are small (see `interpolation`), is filled by cubic interpolation. Of a square
that an edge or the image's border crosses every region stands for itself: what it shows there, pieces of pixels
included, is filled from the nearest 4 x 4 nodes of that region, from one side if it must be, once the point where
that is worst is evaluated and found where it was expected. Any other square is divided.

Nothing follows from nodes farther apart than radiance's Taylor series converges (see `convergence`): they tell nothing
of such pixels, whatever their differences are.

What is evaluated goes in few large calls: the nodes of a step together with what is tried there, since where both are
is known before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nusselt.renderer.vectors import Bools, Floats, Ints

from .error_budget import SQUARES, Budget
from .filling import Evaluate, Filled, Filling, Parts, Reach, first_step
from .moments import Pieces


@dataclass(frozen=True)
class Price:
    """What values cost, beside what it costs to tell which of them follow from others.

    Parameters
    ----------
    few : int
        So many are evaluated sooner than it is told.
    nodes : int
        Centres at least across the image, at first.
    share : float
        Of the tolerance, that interpolated values may spend.
    squares : int
        Squares, of those that err most, that may spend what all may.
    """

    few: int
    nodes: int
    share: float = 0.5
    squares: int = SQUARES


BARE, SHADOWED, DEAR, CENTRE = Price(2048, 64), Price(256, 64), Price(0, 32, 0.7, 256), Price(0, 32)


def fill_centres(
    region: Ints, evaluate: Callable[[Ints], Floats], allowed: Callable[[Floats], float]
) -> tuple[Floats, Floats, Bools]:
    """Radiance (3, h, w) at all centres whose region is at least 0, a bound (h, w) of its error, and which pixels were
    interpolated; see `fill`.
    """
    nothing = np.zeros(0, dtype=bool)
    parts = Parts(Pieces.none(), nothing, nothing)
    found = fill(region, parts, lambda pixel, piece: evaluate(pixel), allowed, np.zeros(region.shape, dtype=bool))
    return found.value, found.bound, found.bound > 0


def fill(
    region: Ints,
    parts: Parts,
    evaluate: Evaluate,
    allowed: Callable[[Floats], float],
    alone: Bools,
    price: Price = CENTRE,
    channels: int = 3,
    reach: Reach | None = None,
) -> Filled:
    """Radiance at all centres whose region is at least 0, and of all pieces.

    Parameters
    ----------
    region : (h, w) int64
        Below 0 for pixels that are not to be filled.
    parts : Parts
    evaluate : callable
    allowed : callable
        From the first values (3, n) to the RMS error that interpolated values may have (norm over the channels).
    alone : (h, w) bool
        Pixels that others tell nothing of: no square that shows one is filled with its region.
    price : Price
        Of values.
    channels : int
        Of radiance.
    reach : Reach, optional
        Boundless where it is not given.
    """
    work = Filling(region, parts, evaluate, alone, channels, first_step(region, price.nodes), reach)
    budget, step = None, work.step
    while step >= 2 and (budget is None or work.left > price.few):
        plan = work.planned(step)
        values = work.ask(step, plan.trials)
        if budget is None:
            count = int(np.count_nonzero(~work.known)) + parts.pieces.cell.size
            budget = Budget.of(allowed(values), count, price.squares)
        kept = budget.left * (0.5 if step > 2 else 0)
        budget.left -= kept
        work.fill(plan, budget)
        budget.left += kept
        step //= 2
    work.ask(1)
    return work.finished()
