"""Numbers as unevaluated sums of two float64: 106 bits, for the few points whose differences cancel.

Error-free sums and products after Knuth, Dekker and Veltkamp; their composition after Hida, Li & Bailey (2001). A
number is a pair (high, low) with |low| at most half an ulp of high; a vector is a pair of (3, n) arrays. Each
operation has a relative error of 2^-103 or better. Products overflow above 1e292 and lose their low part below
1e-276: callers scale by powers of two first.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.vectors import Floats

Pair: TypeAlias = tuple[Floats, Floats]

UNIT = 2.0**-103
"""Relative error of one operation."""
_SPLITTER = 2.0**27 + 1


def two_sum(a: Floats, b: Floats) -> Pair:
    """a + b exactly (Knuth)."""
    s = a + b
    other = s - a
    return s, (a - (s - other)) + (b - other)


def _quick_two_sum(a: Floats, b: Floats) -> Pair:
    """a + b exactly, for |a| >= |b| or a = 0 (Dekker)."""
    s = a + b
    return s, b - (s - a)


def two_product(a: Floats, b: Floats) -> Pair:
    """a b exactly (Dekker; halves by Veltkamp)."""
    p = a * b
    ca, cb = _SPLITTER * a, _SPLITTER * b
    ah, bh = ca - (ca - a), cb - (cb - b)
    al, bl = a - ah, b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


def add(a: Pair, b: Pair) -> Pair:
    """a + b; relative error 2^-104, also where they cancel (the accurate sum of Hida, Li & Bailey)."""
    s, e = two_sum(a[0], b[0])
    t, f = two_sum(a[1], b[1])
    s, e = _quick_two_sum(s, e + t)
    return _quick_two_sum(s, e + f)


def subtract(a: Pair, b: Pair) -> Pair:
    """a - b."""
    return add(a, (-b[0], -b[1]))


def multiply(a: Pair, b: Pair) -> Pair:
    """a b; relative error 2^-103."""
    p, e = two_product(a[0], b[0])
    return _quick_two_sum(p, e + (a[0] * b[1] + a[1] * b[0]))


def exact(a: Floats) -> Pair:
    """A float64 array as a pair."""
    return a, np.zeros_like(a)


def value(a: Pair) -> Floats:
    """The nearest float64."""
    return a[0] + a[1]


def where(mask: NDArray[np.bool_], a: Pair, b: Pair) -> Pair:
    """a where the mask holds, b elsewhere."""
    return np.where(mask, a[0], b[0]), np.where(mask, a[1], b[1])


def _row(a: Pair, i: int) -> Pair:
    return a[0][i], a[1][i]


def dot(a: Pair, b: Pair) -> Pair:
    """Dot product of vectors; absolute error 2^-101 of the sum of the terms' sizes."""
    c = multiply(a, b)
    return add(add(_row(c, 0), _row(c, 1)), _row(c, 2))


def cross(a: Pair, b: Pair) -> Pair:
    """Cross product of vectors; absolute error of each component 2^-102 of its terms' sizes."""
    ahead, behind = [1, 2, 0], [2, 0, 1]
    return subtract(
        multiply((a[0][ahead], a[1][ahead]), (b[0][behind], b[1][behind])),
        multiply((a[0][behind], a[1][behind]), (b[0][ahead], b[1][ahead])),
    )
