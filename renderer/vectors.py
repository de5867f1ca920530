"""Arrays of vectors, component-first: every function takes and returns (3, ...) arrays.

Sums run over the three components one by one, in order, never through a matrix product: the same inputs
then give the same bits wherever they stand in an array, and a negated input gives the negated bits. The
watertight tests rest on that.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.floating[Any]]
Ints = NDArray[np.integer[Any]]
Bools = NDArray[np.bool_]


def column(v: ArrayLike) -> Floats:
    """A vector of three as a (3, 1) array."""
    return np.asarray(v, dtype=np.float64).reshape(3, 1)


def chosen(v: Floats, index: Ints) -> Floats:
    """The columns ``index`` (k,), ascending, of vectors (3, n), or the one (3, 1) that stands for all."""
    return v if v.shape[1] in (1, index.size) else v.take(index, axis=1)


def distinct(values: Ints) -> Ints:
    """Each of the whole numbers once, in order; `numpy.unique` loads all of masked arrays to say the same."""
    inorder = np.sort(values, axis=None)
    return inorder[np.flatnonzero(np.diff(inorder, prepend=inorder[:1] - 1))]


def alike(rows: NDArray[np.number[Any]]) -> tuple[Ints, Ints, Ints]:
    """Of the columns of rows (k, n): the first of each kind, in order, each column's kind, and how many are of each.

    What `numpy.unique` says of an axis, by sorting one row after the other.
    """
    order = np.lexsort(rows[::-1])
    inorder = rows[:, order]
    new = np.ones(order.size, dtype=bool)
    new[1:] = (inorder[:, 1:] != inorder[:, :-1]).any(axis=0)
    kind = np.empty(order.size, dtype=np.int64)
    kind[order] = np.cumsum(new) - 1
    at = np.flatnonzero(new)
    return order[at], kind, np.diff(np.append(at, order.size))


def dot(a: Floats, b: Floats) -> Floats:
    """Dot product over the first axis."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Floats, b: Floats) -> Floats:
    """Cross product over the first axis; cross(b, a) is exactly -cross(a, b)."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    return np.stack((x, y, z))


def unit(v: Floats) -> Floats:
    """v / |v|; scaled first, so that no square under- or overflows. Zero vectors stay zero."""
    scale = np.maximum(np.maximum(np.abs(v[0]), np.abs(v[1])), np.abs(v[2]))
    scaled = v / np.where(scale > 0, scale, 1.0)
    length = np.sqrt(dot(scaled, scaled))
    return np.asarray(scaled / np.where(length > 0, length, 1.0))


def transform(matrix: ArrayLike, v: Floats) -> Floats:
    """matrix @ v for a 3 x 3 matrix, summed in component order."""
    m = np.asarray(matrix, dtype=np.float64)
    return np.stack([m[i, 0] * v[0] + m[i, 1] * v[1] + m[i, 2] * v[2] for i in range(3)])


def frame(n: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors that complete the unit vector ``n`` to a right-handed frame (Duff et al. 2017)."""
    sign = np.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return (
        np.stack((1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0])),
        np.stack((b, sign + n[1] * n[1] * a, -n[1])),
    )
