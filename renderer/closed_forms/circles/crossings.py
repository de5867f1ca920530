"""Where a circle crosses another circle cone: the roots of a trigonometric polynomial of degree two."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Floats, Ints, dot

from .cones import TINY, Rounds, wrapped


def crossings(circles: Rounds, others: Rounds) -> tuple[Ints, Floats]:
    """Numbers (k,) of the pairs, and angles (k,) on their circles; not all need be crossings.

    |flattened v(phi)|^2 = 0 in the other's axes, written as sum of z_k e^(i k phi), k = -2 .. 2, solved as a quartic by
    the eigenvalues of its companion matrix, then by two Newton steps.
    """
    rows = []
    for axis in (others.e1, others.e2, others.e3):
        r1, r2, r3 = dot(axis, circles.e1), dot(axis, circles.e2), dot(axis, circles.e3)
        rows.append((circles.rho * r1, circles.rho * r2, circles.k1 * r1 + circles.k3 * r3))
    flattened = [
        tuple(others.k3 * a - others.k1 * c for a, c in zip(rows[0], rows[2], strict=True)),
        tuple(others.k3 * a for a in rows[1]),
        tuple(others.rho * a for a in rows[2]),
    ]
    q = circles.point.size
    z2, z1, z0 = np.zeros(q, complex), np.zeros(q, complex), np.zeros(q)
    for (a, b, m), sign in zip(flattened, (1.0, 1.0, -1.0), strict=True):
        h = (a - 1j * b) / 2
        z2 += sign * h * h
        z1 += sign * 2 * h * m
        z0 += sign * (2 * np.abs(h) ** 2 + m * m)
    size = np.abs(z0) + np.abs(z1) + np.abs(z2)
    lead = np.where(np.abs(z2) < 1e-14 * size, 1e-14 * size + TINY, z2)
    companion = np.zeros((q, 4, 4), complex)
    companion[:, 1, 0] = companion[:, 2, 1] = companion[:, 3, 2] = 1
    for row, z in enumerate((np.conj(z2), np.conj(z1), z0, z1)):
        companion[:, row, 3] = -z / lead
    phi = np.angle(np.linalg.eigvals(companion)).T
    for _ in range(2):
        e = np.exp(1j * phi)
        value = 2 * ((z2 * e + z1) * e).real + z0
        slope = -2 * ((2 * z2 * e + z1) * e).imag
        phi -= np.where(np.abs(value) < 1e-6 * np.abs(slope), value / np.where(slope == 0, 1, slope), 0)
    return np.tile(np.arange(q), 4), wrapped(phi.ravel())
