"""Pixels by area where each shows many small faces: sampled together with the light, until their spread allows it.

A frame is one place in every pixel and one point of each light: what a light point sees of a closed mesh is found for
all pixels at once. Place and light point run along one sequence in four dimensions (`sobol`), in REPLICAS copies
scrambled at random: the spread of their means is the error's estimate. It is pooled over neighbouring pixels, and
pixels whose share matters get as many frames again. At pixel centres, light points alone are the frames.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from nusselt.renderer.camera.rays import pixel_corners
from nusselt.renderer.camera.screen_boxes import kept_boxes
from nusselt.renderer.camera.view import View, look
from nusselt.renderer.chunks import each
from nusselt.renderer.estimators.analytic import without_shadows
from nusselt.renderer.estimators.common_points import hidden_from
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.radiance import reflected
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Bools, Floats, Ints, column, distinct
from nusselt.renderer.visibility.segments import small_triangles

from .sobol import scrambled

MANY = 40_000
"""Small triangles beyond which pixels are sampled. A ball of 36,000 takes 1.0 s cut exactly to 1e-2 and 3.1 s to 1e-3,
sampled 1.2 and 14 s; one of 101,000 takes 5.9 and 7.4 s cut; the scene `mesh`, 100,000 rough facets, 20 and 86 s cut,
1.5 and 26 s sampled."""
REPLICAS = 4
FRAMES = 4
"""Of each copy, in the first round."""
BITS = 11
MOST = 1 << BITS
"""Of each copy, after which a pixel stays as it is and the error says so."""
RATE = 1.5
"""Of frames, with a power of which variances fall: a half-plane's, see `sobol`."""
RAYS = 1 << 16
"""In a piece of work."""
STEPS = np.array([[0.7548776662466927], [0.5698402909980532]])
"""Of one source's light points from the one's before it, in the unit square."""


def is_crowded(geometry: Geometry) -> bool:
    """Whether a scene has so many small triangles that pixels are to be sampled."""
    tree = small_triangles(geometry)
    return tree is not None and tree.triangles.size > MANY


def touched(scene: Scene, geometry: Geometry) -> Bools:
    """Which pixels (h, w) the boxes of the scene's small triangles touch; (h, w) False if it has none."""
    height, width = scene.height, scene.width
    tree = small_triangles(geometry)
    if tree is None:
        return np.zeros((height, width), dtype=bool)
    corners = pixel_corners(scene)
    seen = kept_boxes(geometry, column(scene.camera.position).tobytes(), corners.tobytes())
    mine = tree.triangles[seen.live[tree.triangles]]
    most = np.array([[width], [width], [height], [height]])
    x0, x1, y0, y1 = np.clip(np.floor(seen.boxes[:, mine]), -1, most).astype(np.int64)
    k = np.flatnonzero((x1 >= 0) & (x0 < width) & (y1 >= 0) & (y0 < height))
    x0, x1, y0, y1 = (np.maximum(bound[k], 0) for bound in (x0, x1, y0, y1))
    count = np.zeros((height + 2, width + 2))
    for sign, y, x in ((1, y0, x0), (-1, y1 + 1, x0), (-1, y0, x1 + 1), (1, y1 + 1, x1 + 1)):
        place = np.minimum(y, height + 1) * (width + 2) + np.minimum(x, width + 1)
        count += sign * np.bincount(place, minlength=count.size).reshape(count.shape)
    return np.asarray(count.cumsum(axis=0).cumsum(axis=1)[:height, :width] > 0.5)


def around_agrees(label: Ints) -> Bools:
    """Which pixels (h, w) have the label of all eight around them."""
    padded = np.pad(label, 1, mode="edge")
    same = np.ones(label.shape, dtype=bool)
    for dy in range(3):
        for dx in range(3):
            same &= padded[dy : dy + label.shape[0], dx : dx + label.shape[1]] == label
    return same


@dataclass(frozen=True, eq=False)
class Frames:
    """A piece of work: frames ``first`` to ``last`` of all copies, in some pixels; ``tolerance`` is the image's.

    ``bare``: of so many pixels, the first, what is hidden alone; ``sums``: how many numbers a pixel has.
    """

    scene: Scene
    tolerance: float
    first: int = 0
    last: int = 0
    bare: int = 0
    sums: ClassVar[int] = 9

    @property
    def places(self) -> Floats:
        """Of each frame, copy by copy, (4, m): pixel across, pixel down, light across, light down."""
        return scrambled(REPLICAS, BITS)[:, :, self.first : self.last].reshape(4, -1)

    def __call__(self, pixel: Ints) -> Floats:
        """Sums (REPLICAS, 9, n) over the frames: radiance if nothing blocks, what is hidden of it, hits of emitters,
        misses, hits of small triangles' outside.
        """
        scene, geometry, needs = prepare(self.scene)
        x, y, *light = self.places
        row, across = np.divmod(pixel, scene.width)
        view: View = look(scene, geometry, (across + x[:, None]).ravel(), (row + y[:, None]).ravel(), x.size)
        found: Floats = np.zeros((9, view.emitter.size))
        found[6:8] = view.emitter, view.background
        points, (of, who) = view.points.as_exact_as(self.tolerance), np.divmod(view.lit, pixel.size)
        found[:3], full = view.emission, np.flatnonzero(who >= self.bare)
        found[:3, view.lit[full]] += reflected(points.take(full), needs, without_shadows)
        found[3:6, view.lit] = reflected(points, needs, partial(_lost, light=np.array(light), of=of))
        found[8, view.lit] = points.outside
        return np.asarray(found.reshape(9, REPLICAS, -1, pixel.size).sum(axis=2).swapaxes(0, 1))


def _lost(points: ShadingPoints, source: Source, light: Floats, of: Ints) -> Floats:
    """What is hidden of a source; each point's shadow is that of place ``of`` (n,) of the ``light``, (2, m)."""
    if source.blockers.none:
        return np.zeros((3, points.count))
    return hidden_from(points, source, _turned(light, source), of)


def _turned(light: Floats, source: Source) -> Floats:
    """Another sequence for each source."""
    return (light + source.index * STEPS) % 1.0


class CentreFrames(Frames):
    """The same of light points alone, for pixels that reflect at their centres."""

    sums: ClassVar[int] = 6

    def __call__(self, pixel: Ints) -> Floats:
        """Sums (REPLICAS, 6, n) over the frames: radiance if nothing blocks, what is hidden of it."""
        scene, geometry, needs = prepare(self.scene)
        light = self.places[:2]
        row, across = np.divmod(pixel, scene.width)
        points = look(scene, geometry, across + 0.5, row + 0.5).points.as_exact_as(self.tolerance)
        found = np.zeros((6, light.shape[1], pixel.size))
        for each_source in needs.sources:
            source = each_source.seen_from(points.position)
            free = without_shadows(points, source)
            found[:3] += free[:, None]
            k = np.flatnonzero(free.any(axis=0))
            if not source.blockers.none:
                of, who = np.divmod(np.arange(light.shape[1] * k.size), max(k.size, 1))
                lost = hidden_from(points.take(k[who]), source, _turned(light, source), of)
                found[3:, :, k] += lost.reshape(3, -1, k.size)
        return np.asarray(found.reshape(6, REPLICAS, -1, pixel.size).sum(axis=2).swapaxes(0, 1))


def _sums(frames: Frames, pixel: Ints) -> Floats:
    return frames(pixel)


def next_ones(variance: Floats, frames: Ints, budget: float) -> Ints:
    """Which pixels (n,) should have as many frames again for least work in all; one at least.

    In the end variances add up to the budget, and no pixel's would fall by more for a frame than another's. Those go
    on that then have half as many again, or more, but no more of them than it takes. Variances are taken to fall with
    frames^-RATE.
    """
    worth = variance / frames
    order = np.argsort(-worth, kind="stable")
    left, mass = np.cumsum(variance[order]), np.cumsum((variance * frames**RATE)[order] ** (1 / (RATE + 1)))
    level = (np.maximum(budget - variance.sum() + left, 0) / np.maximum(mass, 1e-300)) ** (1 / RATE)
    goal = worth[order] ** (1 / (RATE + 1))  # over the level, in units of the frames
    some = level[np.flatnonzero(goal > level).max(initial=0)]
    enough = max(int(np.searchsorted(left / 2, variance.sum() - budget)), order.size // 64) + 1
    return order[: min(enough, max(int(np.count_nonzero(goal > 1.5 * some)), order.size // 4))]


@dataclass
class Crowd:
    """Pixels and what is known of them.

    Parameters
    ----------
    work : Frames
    shape : tuple of int
        Of the image.
    executor : Executor or None
    pixel : (n,) int64
    total : (REPLICAS, 9 or 6, n) float64
        Sums over each copy's frames: see `Frames`.
    frames : (n,) int64
        Of each copy.
    free : (3, n) float64
        Radiance if nothing blocks, where it is known; elsewhere NaN.
    """

    work: Frames
    shape: tuple[int, int]
    executor: Executor | None
    pixel: Ints
    total: Floats
    frames: Ints
    free: Floats
    evaluations: int = 0

    @classmethod
    def begun(cls, work: Frames, pixel: Ints, executor: Executor | None) -> Crowd:
        """After the first round."""
        shape = work.scene.height, work.scene.width
        total, frames = np.zeros((REPLICAS, work.sums, pixel.size)), np.zeros(pixel.size, dtype=np.int64)
        crowd = cls(work, shape, executor, pixel, total, frames, np.full((3, pixel.size), np.nan))
        crowd._more(np.arange(pixel.size), FRAMES)
        return crowd

    def know(self, free: Floats) -> None:
        """Radiance (3, n) of pixels if nothing blocks, else NaN: believed where all saw small triangles' outside."""
        seen = self.total[:, 8].sum(axis=0) > REPLICAS * self.frames - 0.5
        self.free = np.where(seen, free, np.nan)

    @property
    def known(self) -> Bools:
        """Where ``free`` is, (n,)."""
        return ~np.isnan(self.free[0])

    @property
    def share(self) -> Floats:
        """Of places in each pixel: those that met emitters, those that met nothing, (2, n)."""
        return np.asarray(self.total[:, 6:8].sum(axis=0) / (REPLICAS * self.frames))

    def radiance(self) -> Floats:
        """Of each copy, (REPLICAS, 3, n)."""
        free = np.where(self.known, self.free, self.total[:, :3] / self.frames)
        return np.asarray(free - self.total[:, 3:6] / self.frames)

    @property
    def mean(self) -> Floats:
        """(3, n)."""
        return np.asarray(self.radiance().mean(axis=0))

    @property
    def square(self) -> float:
        """Sum of squared radiance."""
        return float((self.mean**2).sum())

    def variance(self) -> Floats:
        """Of the means' radiance, summed over the channels, (n,): pooled over the pixels of 3 x 3.

        Those of which all but the shadow is known apart from others, which may show a silhouette that no place met.
        """
        own = self.radiance().var(axis=0, ddof=1).sum(axis=0) / REPLICAS
        row, across = np.divmod(self.pixel, self.shape[1])
        kind = self.known.astype(np.int64)
        # Pooled per frame: neighbours may have had another number of them.
        sums = np.zeros((2, 2, self.shape[0] + 2, self.shape[1] + 2))
        for dy in range(3):
            for dx in range(3):
                sums[0, kind, row + dy, across + dx] += own * self.frames
                sums[1, kind, row + dy, across + dx] += 1
        pooled = sums[0, kind, row + 1, across + 1] / sums[1, kind, row + 1, across + 1]
        return np.asarray(pooled / self.frames)

    def refine(self, budget: float, most: int = MOST) -> Floats:
        """Sample on until the sum of squared errors (n,) is at most ``budget``, or a pixel has the ``most`` frames.

        A copy's frames are doubled each time, in the pixels that `next_ones` names.
        """
        while True:
            variance = self.variance()
            left = float(variance.sum())
            if left <= budget or self.pixel.size == 0 or int(self.frames.max()) >= most:
                return variance
            self._more(np.sort(next_ones(variance, self.frames, budget)), 0)

    def _more(self, some: Ints, count: int) -> None:
        """As many frames again for some pixels, or the first ``count``."""
        work: list[tuple[Ints, Frames]] = []
        some = some[np.argsort(~self.known[some], kind="stable")]
        for frames in distinct(self.frames[some]).tolist():
            mine = some[self.frames[some] == frames]
            for part in np.array_split(mine, -(-REPLICAS * mine.size // RAYS)):
                bare = int(np.count_nonzero(self.known[part]))
                step = max(1, RAYS // (REPLICAS * part.size))
                for first in range(frames, 2 * frames or count, step):
                    last = min(first + step, 2 * frames or count)
                    work.append((part, replace(self.work, first=first, last=last, bare=bare)))
        pixels = [self.pixel[part] for part, _ in work]
        for (part, one), sums in zip(work, each(_sums, self.executor, [w for _, w in work], pixels), strict=True):
            self.total[:, :, part] += sums
            self.evaluations += REPLICAS * part.size * (one.last - one.first)
        self.frames[some] = np.maximum(2 * self.frames[some], count)
