"""Pixels by area where each shows many small faces: sampled together with the light, until their spread allows it.

A frame is one place in every pixel and one point of each light: what a light point sees of a closed mesh is found for
all pixels at once. Place and light point run along one sequence in four dimensions (Kronecker's, with the powers of
the root of x^5 = x + 1), in REPLICAS copies shifted at random: the spread of their means is the error's estimate
(Cranley & Patterson 1976). It is pooled over neighbouring pixels, and pixels whose share matters get as many frames
again.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

import numpy as np

from nusselt.renderer.camera.rays import primary_directions
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

MANY = 20_000
"""Small triangles beyond which pixels are sampled: cutting each face out of its pixels takes minutes there."""
REPLICAS = 4
FRAMES = 8
"""Of each copy, in the first round."""
MOST = 2048
"""Of each copy, after which a pixel stays as it is and the error says so."""
RAYS = 1 << 16
"""In a piece of work."""
STEPS = 1.1673039782614187 ** -np.arange(1.0, 5.0)
"""Of the sequence: pixel across, pixel down, light across, light down."""


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
    corners = primary_directions(scene, np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
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
    """A piece of work: frames ``first`` to ``last`` of all copies, in some pixels; ``tolerance`` is the image's."""

    scene: Scene
    first: int
    last: int
    tolerance: float

    def __call__(self, pixel: Ints) -> Floats:
        """Sums (REPLICAS, 5, n) over the frames: radiance, hits of emitters, misses."""
        scene, geometry, needs = prepare(self.scene)
        shifts = np.random.default_rng(7).random((REPLICAS, 1, 4))
        place = ((shifts + np.arange(self.first, self.last)[:, None] * STEPS) % 1.0).reshape(-1, 4).T
        row, across = np.divmod(pixel, scene.width)
        view: View = look(scene, geometry, (across + place[0][:, None]).ravel(), (row + place[1][:, None]).ravel())
        found = np.vstack((view.emission, view.emitter, view.background))
        points = view.points.as_exact_as(self.tolerance)
        found[:3, view.lit] += reflected(points, needs, partial(_share, light=place[2:], of=view.lit // pixel.size))
        return np.asarray(found.reshape(5, REPLICAS, -1, pixel.size).sum(axis=2).swapaxes(0, 1))


def _share(points: ShadingPoints, source: Source, light: Floats, of: Ints) -> Floats:
    """What a source sends to the eye; each point's shadow is that of place ``of`` (n,) of the ``light``, (2, m)."""
    free = without_shadows(points, source)
    if source.blockers.none:
        return free
    at = (light + source.index * STEPS[:2, None]) % 1.0
    return free - hidden_from(points, source, at, of)


def _sums(frames: Frames, pixel: Ints) -> Floats:
    return frames(pixel)


@dataclass
class Crowd:
    """Pixels and what is known of them.

    Parameters
    ----------
    pixel : (n,) int64
    total : (REPLICAS, 5, n) float64
        Sums over each copy's frames: radiance, hits of emitters, misses.
    frames : (n,) int64
        Of each copy.
    """

    pixel: Ints
    total: Floats
    frames: Ints
    evaluations: int = 0

    @property
    def mean(self) -> Floats:
        """(5, n)."""
        return np.asarray(self.total.mean(axis=0) / self.frames)

    def variance(self, shape: tuple[int, int]) -> Floats:
        """Of the means' radiance, summed over the channels, (n,): pooled over the pixels of 3 x 3."""
        each = self.total[:, :3] / self.frames
        own = each.var(axis=0, ddof=1).sum(axis=0) / REPLICAS
        # Pooled per frame: neighbours may have had another number of them.
        sums = np.zeros((2, shape[0] + 2, shape[1] + 2))
        row, across = np.divmod(self.pixel, shape[1])
        for dy in range(3):
            for dx in range(3):
                sums[0, row + dy, across + dx] += own * self.frames
                sums[1, row + dy, across + dx] += 1
        pooled = (sums[0] / np.maximum(sums[1], 1))[row + 1, across + 1]
        return np.asarray(pooled / self.frames)


def sample_crowd(
    scene: Scene, pixel: Ints, budget: float, tolerance: float, executor: Executor | None
) -> tuple[Crowd, float]:
    """Means of pixels (n,), and the sum of their squared errors, if possible at most ``budget``.

    Only pixels that take part in the excess go on; a copy's frames are doubled each time.
    """
    crowd = Crowd(pixel, np.zeros((REPLICAS, 5, pixel.size)), np.zeros(pixel.size, dtype=np.int64))
    some, count = np.arange(pixel.size), FRAMES
    while True:
        _more(crowd, partial(Frames, scene, tolerance=tolerance), some, count, executor)
        variance = crowd.variance((scene.height, scene.width))
        left = float(variance.sum())
        if left <= budget or pixel.size == 0 or int(crowd.frames.max()) >= MOST:
            return crowd, left
        # The worst go on: until what they would shed, their error halved, is enough.
        order = np.argsort(-variance, kind="stable")
        order = order[crowd.frames[order] < MOST]
        shed = np.cumsum(0.75 * variance[order])
        stop = int(np.searchsorted(shed, left - budget)) + 1
        some = np.sort(order[: max(stop, order.size // 16)])
        count = 0


def _more(crowd: Crowd, make: Callable[..., Frames], some: Ints, count: int, executor: Executor | None) -> None:
    """As many frames again for some pixels, or the first ``count``."""
    work: list[tuple[Ints, Frames]] = []
    for frames in distinct(crowd.frames[some]).tolist():
        mine = some[crowd.frames[some] == frames]
        for part in np.array_split(mine, -(-REPLICAS * mine.size // RAYS)):
            step = max(1, RAYS // (REPLICAS * part.size))
            for first in range(frames, 2 * frames or count, step):
                work.append((part, make(first=first, last=min(first + step, 2 * frames or count))))
    pixels = [crowd.pixel[part] for part, _ in work]
    sums_of_all = each(_sums, executor, [one for _, one in work], pixels)
    for (part, _), sums in zip(work, sums_of_all, strict=True):
        crowd.total[:, :, part] += sums
    crowd.evaluations += sum(REPLICAS * part.size * (one.last - one.first) for part, one in work)
    crowd.frames[some] = np.maximum(2 * crowd.frames[some], count)
