"""A bounding volume hierarchy for many triangles, walked by all rays at once, a level at a time.

Triangles in Morton order (Lauterbach et al. 2009), four boxes under each box. The walk keeps a list of (ray,
box) pairs: no loop over rays or boxes, only over levels (about ten).

The boxes only choose which triangles are tested, in double precision, elsewhere: they may be too large, never
too small. Every ray is first cut to the root box, and the root box moved to [-1, 1]^3: then single precision
is wrong by a few times 1e-7 whatever the scene's size or place, and the boxes are that much larger.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.geometry.ragged import take
from nusselt.renderer.vectors import Floats, Ints

Single = NDArray[np.float32]
WIDTH = 4
PAD = np.float32(4e-6)
"""Rounding of a point of a ray in single precision, in half sides of the root box: an origin and a direction
to 6e-8 each, a product and a sum, twice over."""
NOWHERE = np.float32(1e30)
RAYS = 1 << 13
"""Rays that walk together: their data fit the cache, their pairs the memory."""


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Boxes over triangles.

    Parameters
    ----------
    triangles : (t,) int64
        In the order of the lowest level's boxes.
    centre, half : (3, 1) float64
        Root box.
    levels : tuple of (6, m) float32
        Low and high corners, relative to the root box; box i lies over boxes 4i to 4i + 3 of the next level.
    """

    triangles: Ints
    centre: Floats
    half: Floats
    levels: tuple[Single, ...]

    @classmethod
    def over(cls, geometry: Geometry, triangles: Ints) -> Hierarchy:
        """The hierarchy of some triangles (at least one) of a scene."""
        a, b, c = (take(v, triangles) for v in (geometry.a, geometry.b, geometry.c))
        low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        least, most = low.min(axis=1, keepdims=True), high.max(axis=1, keepdims=True)
        centre, half = (least + most) / 2, (most - least) / 2
        half = np.maximum(half * (1 + 1e-9), 1e-12 * (half.max() + np.abs(centre).max()))  # flat piles have a box too
        order = np.argsort(morton(((low + high) / 2 - centre) / half), kind="stable")
        low, high = (low[:, order] - centre) / half, (high[:, order] - centre) / half
        boxes = np.vstack((low - PAD, high + PAD)).astype(np.float32)
        levels = [boxes]
        while levels[0].shape[1] > WIDTH:
            levels.insert(0, _parents(levels[0]))
        return cls(triangles[order], centre, half, tuple(_filled(level) for level in levels))

    def any_hit(
        self, p: Floats, d: Floats, at_infinity: bool, hits: Callable[[Ints, Ints], NDArray[np.bool_]]
    ) -> NDArray[np.bool_]:
        """Which of n segments p to p + d, or rays along d, some triangle blocks.

        Parameters
        ----------
        p, d : (3, n) float64
        hits : callable
            Given rays (m,) and triangles (m,), which of those pairs block: the test that decides.
        """
        blocked = np.zeros(p.shape[1], dtype=bool)
        for start in range(0, p.shape[1], RAYS):
            some = slice(start, start + RAYS)
            inside, o, inverse = self._enter(p[:, some], d[:, some], at_infinity)
            if inside.size:
                ray, box = self._walk(o, inverse)
                self._test(inside + start, ray, box, hits, blocked)
        return blocked

    def count_hits(
        self, p: Floats, d: Floats, at_infinity: bool, hits: Callable[[Ints, Ints], NDArray[np.bool_]]
    ) -> Ints:
        """How many triangles block each; see `any_hit`."""
        count = np.zeros(p.shape[1], dtype=np.int64)
        for begin in range(0, p.shape[1], RAYS):
            some = slice(begin, begin + RAYS)
            inside, o, inverse = self._enter(p[:, some], d[:, some], at_infinity)
            if inside.size:
                ray, box = self._walk(o, inverse)
                who = take(inside + begin, ray)
                count += np.bincount(who[hits(who, take(self.triangles, box))], minlength=count.size)
        return count

    def _enter(self, p: Floats, d: Floats, at_infinity: bool) -> tuple[Ints, Single, Single]:
        """Rays that meet the root box; where they do (3, m), and one over what is left of them, in its frame."""
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            q, r = (p - self.centre) / self.half, d / self.half
            first, second = (-1 - q) / r, (1 - q) / r
            # A ray along a face gives 0/0: fmin and fmax let the other bound decide, which only adds rays.
            near = np.fmin(first, second).max(axis=0, initial=0)
            far = np.fmax(first, second).min(axis=0, initial=np.inf if at_infinity else 1.0)
        slack = 1e-9 * (np.abs(near) + np.abs(far))
        inside = np.flatnonzero((near <= far + slack) & (np.abs(near) < np.inf))
        near, far = near[inside], far[inside] + slack[inside]
        q, r = q[:, inside], r[:, inside]
        o = (q + near * r).astype(np.float32)
        e = (np.minimum(far - near, 1e30) * r).astype(np.float32)
        small = np.float32(1e-7)
        e = np.where(np.abs(e) < small, np.copysign(small, e), e)
        return inside, o, 1 / e

    def _walk(self, o: Single, inverse: Single) -> tuple[Ints, Ints]:
        """Pairs (ray, box of the lowest level), ray by ray."""
        ray = np.repeat(np.arange(o.shape[1]), self.levels[0].shape[1])
        box = np.tile(np.arange(self.levels[0].shape[1]), o.shape[1])
        last = len(self.levels) - 1
        for depth, level in enumerate(self.levels):
            kept = np.flatnonzero(_meets(level, o, inverse, ray, box))
            ray, box = take(ray, kept), take(box, kept)
            if depth < last:
                ray = np.repeat(ray, WIDTH)
                box = (WIDTH * box[:, None] + np.arange(WIDTH)).ravel()
        return ray, box

    def _test(
        self, name: Ints, ray: Ints, box: Ints, hits: Callable[[Ints, Ints], NDArray[np.bool_]], blocked: Floats
    ) -> None:
        """One triangle a ray, then two, then four: most blocked rays are done after a few."""
        many = 1
        while ray.size:
            place = np.arange(ray.size) - np.repeat(_starts(ray), np.diff(np.append(_starts(ray), ray.size)))
            now = np.flatnonzero(place < many)
            who = take(name, take(ray, now))
            found = hits(who, take(self.triangles, take(box, now)))
            blocked[who[found]] = True
            later = np.flatnonzero((place >= many) & ~take(blocked, take(name, ray)))
            ray, box = take(ray, later), take(box, later)
            many *= 2


def _starts(sorted_values: Ints) -> Ints:
    return np.flatnonzero(np.diff(sorted_values, prepend=-1))


def _meets(level: Single, o: Single, inverse: Single, ray: Ints, box: Ints) -> NDArray[np.bool_]:
    """Slab test (Kay & Kajiya 1986) of ray parameters in [0, 1]."""
    near, far = np.zeros(ray.size, dtype=np.float32), np.ones(ray.size, dtype=np.float32)
    for axis in range(3):
        start, scale = take(o[axis], ray), take(inverse[axis], ray)
        first = take(level[axis], box)
        first -= start
        first *= scale
        second = take(level[axis + 3], box)
        second -= start
        second *= scale
        np.maximum(near, np.minimum(first, second), out=near)
        np.minimum(far, np.maximum(first, second, out=second), out=far)
    return np.asarray(near <= far)


def _parents(boxes: Single) -> Single:
    padded = np.concatenate((boxes, np.repeat(boxes[:, -1:], -boxes.shape[1] % WIDTH, axis=1)), axis=1)
    fours = padded.reshape(6, -1, WIDTH)
    return np.vstack((fours[:3].min(axis=2), fours[3:].max(axis=2)))


def _filled(boxes: Single) -> Single:
    """With boxes that no ray meets up to a multiple of four."""
    spare = np.full((6, -boxes.shape[1] % WIDTH), NOWHERE)
    return np.ascontiguousarray(np.concatenate((boxes, spare), axis=1))


def morton(v: Floats) -> Ints:
    """Interleaved bits of points in [-1, 1]^3, 21 of each component."""
    code = np.zeros(v.shape[1], dtype=np.uint64)
    cell = np.clip((v + 1) * (1 << 20), 0, (1 << 21) - 1).astype(np.uint64)
    for axis in range(3):
        x = cell[axis]
        for shift, mask in _SPREAD:
            x = (x | (x << np.uint64(shift))) & np.uint64(mask)
        code |= x << np.uint64(axis)
    return code


_SPREAD = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)
