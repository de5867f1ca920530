"""Which triangles make up one body: those joined by sides that two of them share, run through in both directions."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.vectors import Ints


def shared_sides(vertex: Ints) -> tuple[Ints, Ints, Ints]:
    """Of triangles' corners (3, t): pairs that share a side, run through in both directions; and those left over."""
    a, b, c = vertex
    start, end, owner = np.concatenate((a, b, c)), np.concatenate((b, c, a)), np.tile(np.arange(a.size), 3)
    side = np.minimum(start, end) * (int(vertex.max(initial=0)) + 1) + np.maximum(start, end)
    order = np.argsort(side, kind="stable")
    side, up, owner = side[order], (start < end)[order], owner[order]
    at = np.flatnonzero(np.diff(side, prepend=-1))
    count = np.diff(np.append(at, side.size))
    paired = (count == 2) & (up[at] != up[np.minimum(at + 1, up.size - 1)])
    odd = owner[~np.repeat(paired, count)]
    return owner[at[paired]], owner[at[paired] + 1], odd


def bodies(first: Ints, second: Ints, triangles: int) -> Ints:
    """The least triangle that each is joined to by pairs (m,)."""
    body = np.arange(triangles)
    while True:
        least = np.minimum(body[first], body[second])
        before = body.copy()
        for end in (first, second):
            np.minimum.at(body, before[end], least)
        while not np.array_equal(body, body[body]):
            body = body[body]
        if np.array_equal(body, before):
            return body
