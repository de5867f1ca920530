"""Edge functions of triangles about a point, and how wrong rounding can make them.

Along a direction d from the point p, the edge from B to C of a triangle is passed on the inside if
d . ((B - p) x (C - B)) is positive. Taken with the edge itself instead of C - p, its rounding is
eps |d| |B - p| |C - B|: the edge moves by eps times its distance, however small the triangle is.

A test that takes zero for inside on both neighbours is still not watertight: around a vertex the rounded
signs of all edges can agree, and then no triangle is hit (measured: a few rays in a thousand aimed at
vertices). So every edge is moved outwards by its own rounding bound. Whatever hits the closed triangle in
exact arithmetic then hits it here; neighbours overlap by a few ulps of the distance, which neither a shadow
nor a nearest hit can see. (Woop, Benthin & Wald 2013 reach the same end with sheared coordinates.)
"""

from __future__ import annotations

import numpy as np

from .vectors import Floats, cross

EDGE_ULPS = 16 * 2.0**-53
"""Rounding of d . ((B - p) x (C - B)) relative to |d|_1 max|B - p| max|C - B|: two differences (2), a cross
product (2 x 3) and a sum of three products (3), with room to spare."""

PLANE_ULPS = 16 * 2.0**-53
"""Rounding of n . (p - a), relative to |n|_1 times the coordinates: a cross product (3), a sum of three
products (3), and p itself (5, from its barycentric sum), with room to spare."""

SLOPE_ULPS = 8 * 2.0**-53
"""Rounding of n . d relative to |n|_1 max|d|: below it a direction runs along the plane."""


def edge_functions(a: Floats, b: Floats, c: Floats, p: Floats) -> tuple[tuple[Floats, Floats], ...]:
    """The edges opposite to a, b and c about points p; all (3, ...), broadcast against each other.

    Returns
    -------
    three pairs (normal (3, ...), slack (...))
        d is inside if d . normal >= -slack |d|_1, for triangles that p sees counter-clockwise from behind.
    """
    return tuple(_edge(start, end, p) for start, end in ((b, c), (c, a), (a, b)))


def _edge(start: Floats, end: Floats, p: Floats) -> tuple[Floats, Floats]:
    arm, edge = start - p, end - start
    return cross(arm, edge), EDGE_ULPS * largest(arm) * largest(edge)


def largest(v: Floats) -> Floats:
    """max|v| over the first axis."""
    return np.maximum(np.maximum(np.abs(v[0]), np.abs(v[1])), np.abs(v[2]))


def one_norm(d: Floats) -> Floats:
    """|d|_1 over the first axis."""
    return np.abs(d[0]) + np.abs(d[1]) + np.abs(d[2])
