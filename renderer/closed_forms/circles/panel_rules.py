"""Two rules over a panel from one set of values, each with an error: Gauss-Legendre, and its like for y^s G(y).

The second takes the Legendre series of G, sum of a_k P_k(2y - 1), and its moments in closed form:
the integral of y^s P_k(2y - 1) over [0, 1] is s (s - 1) .. (s - k + 1) / ((s + 1) (s + 2) .. (s + k + 1)).
"""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Bools, Floats

COUNT = 24
LAST = 4
"""Coefficients that tell how far a series has fallen."""
SERIES, MOMENTS = 1e-8, 1e-16
"""Last coefficients at which a panel is let stand: what is left of Gauss-Legendre goes with their square."""

NOISE = 16.0
"""How much more a coefficient may be off than the values it is made of."""

_x, _w = np.polynomial.legendre.leggauss(COUNT)
NODES, WEIGHTS = ((_x + 1) / 2)[:, None], (_w / 2)[:, None]
_TO_SERIES = (2 * np.arange(COUNT) + 1)[:, None] * np.polynomial.legendre.legvander(_x, COUNT - 1).T * (_w / 2)


def gauss(values: Floats, noise: Floats) -> tuple[Floats, Floats, Bools]:
    """Integral (k,) over [0, 1] from values (COUNT, k) at NODES, its error, and whether that may stand.

    ``noise`` (k,) is the rounding of the values, which no halving lessens and no error here holds.
    """
    last = np.abs(_TO_SERIES[-LAST:] @ values).max(axis=0)
    size = np.abs(values).max(axis=0) + 1e-300
    stands = last <= SERIES * size + NOISE * noise
    return (WEIGHTS * values).sum(axis=0), 10 * last * np.minimum(last / size, 1.0), stands


def root(values: Floats, noise: Floats, s: Floats) -> tuple[Floats, Floats, Bools]:
    """The same for y^s times values."""
    series = _TO_SERIES @ values
    moment, total, left = 1 / (s + 1), np.zeros(s.shape), np.zeros(s.shape)
    for k in range(COUNT):
        total += series[k] * moment
        if k >= COUNT - LAST:
            left = np.maximum(left, np.abs(series[k] * moment))
        moment = moment * (s - k) / (s + k + 2)
    last = np.abs(series[-LAST:]).max(axis=0)
    size = np.abs(values).max(axis=0) + 1e-300
    stands = (last <= SERIES * size + NOISE * noise) & (left <= MOMENTS * size + NOISE * noise)
    return total, 8 * left + 10 * last * np.minimum(last / size, 1.0), stands
