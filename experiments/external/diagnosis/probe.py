"""A scene at some of its pixels, under any rules and any camera: what every hypothesis is rendered with.

The light points and what each sees of them are found once; a change of rules then costs no shadow ray.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nusselt.renderer.camera.view import look
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import Light
from nusselt.renderer.lights.sampling import one_place, unit_square
from nusselt.renderer.lobes.protocol import joined
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats
from nusselt.renderer.visibility.segments import Blockers

from .beams import RIGHT, Beams, seen_as

PIXELS = 1 << 15
PAIRS = 3 << 20
"""Pixel-sample pairs of all lights together, at most."""
SAMPLES = 64
"""Per light and pixel, at least: beyond the noise of the image that is looked at."""
LOOK = 1 << 11
"""Rays traced at once; neighbours, so that far triangles drop out."""
BEAMS = 1 << 16
"""Or so many beams."""
TESTS = 1 << 30
"""Tests of a sample against a triangle, at most."""
FEWEST = 400
"""Pixels, at least."""


@dataclass(frozen=True)
class Sight:
    """What n camera rays see; ``glow`` is the radiance of lights from either side, ``emission`` what is right.

    ``surface`` is -1 where nothing is.
    """

    points: ShadingPoints
    lit: np.ndarray
    emission: Floats
    glow: Floats
    light: np.ndarray
    surface: np.ndarray


@dataclass(eq=False)
class Paths:
    """The ways to one light from what a sight shows: drawn once, and what blocks them found once."""

    source: Source
    geometry: Geometry
    sight: Sight
    u: Floats
    v: Floats
    passes: int
    line: int = 0

    @property
    def light(self) -> Light:
        return self.source.light

    @cached_property
    def beams(self) -> Beams:
        """The right ones."""
        return self.through(self.u, self.v)

    @cached_property
    def unshadowed(self) -> Beams:
        return seen_as(self.beams, np.ones(1))

    @cached_property
    def all_round(self) -> Beams:
        """With all that may block where no light comes from by the right rules."""
        every = np.arange(self.sight.points.count)
        return seen_as(self.beams, self.visible(every, self.beams.d, self.light.at_infinity, self.everything))

    @cached_property
    def right(self) -> Floats:
        """Right reflected radiance (3, n, passes)."""
        return RIGHT.radiance(self.beams)

    def through(self, u: Floats, v: Floats, light: Light | None = None) -> Beams:
        """Beams through other places (n, k) of the light, or of another in its place."""
        blockers = None if light is None else self.everything
        light = self.light if light is None else light
        d, _ = light.beams(self.sight.points.position, u, v)
        d = np.broadcast_to(d, (3, self.sight.points.count, d.shape[2]))
        passes = self.passes if d.shape[2] % self.passes == 0 else 1
        made = Beams(light, self.sight.points, u, v, d, np.ones(1), passes)
        return seen_as(made, self.visible(np.arange(self.sight.points.count), d, light.at_infinity, blockers))

    def visible(
        self,
        chosen: np.ndarray,
        d: Floats,
        endless: bool,
        blockers: Blockers | None = None,
        position: Floats | None = None,
    ) -> Floats:
        """(c, k): 1 where nothing but the light itself stands along d (3, c, k) from the chosen points.

        Parameters
        ----------
        blockers : Blockers, optional
            In place of those that the scene needs.
        position : (3, c) float64, optional
            In place of the chosen points', and on no body.
        """
        points = self.sight.points
        out = np.empty(d.shape[1:])
        step = max(LOOK, BEAMS // d.shape[2])
        for start in range(0, chosen.size, step):
            some = slice(start, start + step)
            at = points.position[:, chosen[some]] if position is None else position[:, some]
            own = points.ellipsoid[chosen[some]]
            stand = self.source.seen_from(at).blockers if blockers is None else blockers
            out[some] = stand.visible(at, own if position is None else own * 0 - 1, d[:, some], endless)
        return out

    @property
    def everything(self) -> Blockers:
        """All surfaces but the light's own."""
        g = self.geometry
        triangles, balls, disks = (
            np.flatnonzero(g.light[surfaces] != self.source.index)
            for surfaces in (g.triangle_surface, g.ellipsoid_surface, g.disk_surface)
        )
        return Blockers(g, triangles, balls, disks)


class Probe:
    """A scene at n of its pixels.

    Parameters
    ----------
    scene : Scene
    samples : int
        Of one pass, per light.
    stratified : bool
    seed : int
    tests : int
        Of a sample against a triangle or an ellipsoid, at most.
    """

    def __init__(self, scene: Scene, samples: int, stratified: bool, seed: int = 0, tests: int = TESTS) -> None:
        scene, self.geometry, needs = prepare(scene)
        self.scene, self.seed = scene, seed
        self.stratified = stratified and math.isqrt(samples) ** 2 == samples
        self.samples = min(samples, 256)
        if self.stratified:
            self.samples = math.isqrt(self.samples) ** 2
        self.passes = max(2, -(-SAMPLES // self.samples))
        kept = {source.index: source for source in needs.sources}
        nothing = Blockers.nothing(self.geometry)
        self.sources = [kept.get(k, Source(k, one, nothing, scene.is_glossy)) for k, one in enumerate(scene.lights)]
        self.stride = self._stride(tests)
        # A random pixel in each cell: the edges of an image like to run along its rows.
        place = np.random.default_rng(seed).integers(0, self.stride, (2, *self._cells))
        rows, columns = (np.arange(count) * self.stride for count in self._cells)
        self.rows = np.minimum(rows[:, None] + place[0], scene.height - 1)
        self.columns = np.minimum(columns[None] + place[1], scene.width - 1)
        self.x, self.y = self.columns.ravel() + 0.5, self.rows.ravel() + 0.5

    @cached_property
    def sight(self) -> Sight:
        """What the pixels show."""
        return self.look(self.x, self.y)

    @cached_property
    def paths(self) -> list[Paths]:
        """The ways from what the pixels show to each light."""
        return self._paths(self.sight, self.samples, self.passes)

    @cached_property
    def variance(self) -> Floats:
        """Of one image of the estimator, (3, n)."""
        out = np.zeros((*self.sight.emission.shape, self.passes))
        out[:, self.sight.lit] += self.lit_by(self.paths)
        return np.asarray(out.var(axis=2, ddof=1))

    @cached_property
    def swing(self) -> Floats:
        """How far each pass of the right light is from their mean, (3, m, passes) at what is lit."""
        light = self.lit_by(self.paths)
        return np.asarray(light - light.mean(axis=2, keepdims=True))

    def _stride(self, tests: int) -> int:
        """Pixels from one to the next, so that samples and their tests against triangles stay within bounds."""
        pairs = self.samples * self.passes * max(1, len(self.scene.lights))
        bodies = max(1, self.geometry.triangles + self.geometry.ellipsoids)
        most = min(PIXELS, PAIRS // pairs, tests // (pairs * bodies))
        return max(1, math.ceil(math.sqrt(self.scene.width * self.scene.height / max(most, FEWEST))))

    @property
    def _cells(self) -> tuple[int, int]:
        return -(-self.scene.height // self.stride), -(-self.scene.width // self.stride)

    def pick(self, image: np.ndarray) -> np.ndarray:
        """The probe's pixels (..., n) of an image (..., h, w)."""
        return np.asarray(image[..., self.rows.ravel(), self.columns.ravel()])

    def spread_out(self, values: Floats) -> Floats:
        """Values (..., n) as an image (..., h, w): every pixel takes its cell's."""
        grid = self.grid(values)
        whole = grid.repeat(self.stride, axis=-2).repeat(self.stride, axis=-1)
        return np.asarray(whole[..., : self.scene.height, : self.scene.width])

    def look(self, x: Floats, y: Floats) -> Sight:
        """Trace the camera rays through (x, y)."""
        g = self.geometry
        parts = []
        for start in range(0, x.size, LOOK):
            some = slice(start, start + LOOK)
            view = look(self.scene, g, x[some], y[some])
            surface = view.hits.surface
            light = np.where(surface >= 0, g.light[np.maximum(surface, 0)], -1) if g.light.size else surface * 0 - 1
            glow = (
                np.where(light >= 0, g.emission[:, np.maximum(surface, 0)], view.emission)
                if g.light.size
                else view.emission
            )
            parts.append((view.points, view.lit + start, view.emission, glow, light, surface))
        points = joined([part[0] for part in parts])
        return Sight(points, *(np.concatenate([p[k] for p in parts], axis=-1) for k in range(1, 6)))

    def _paths(self, sight: Sight, samples: int, passes: int) -> list[Paths]:
        out = []
        for source in self.sources:
            u, v = one_place()
            if source.light.has_extent:
                rng = np.random.default_rng([self.seed, source.index, samples])
                drawn = [unit_square(rng, sight.points.count, samples, self.stratified) for _ in range(passes)]
                u, v = (np.concatenate([one[axis] for one in drawn], axis=1) for axis in (0, 1))
            lines = self.scene.lines[2] if self.scene.lines else ()
            line = lines[source.index] if len(lines) == len(self.sources) else 0
            out.append(Paths(source, self.geometry, sight, u, v, passes, line))
        return out

    def lit_by(self, paths: list[Paths]) -> Floats:
        """Right reflected radiance (3, n, passes) of lights at the points of their sight."""
        passes = paths[0].passes if paths else 1
        out = np.zeros((3, paths[0].sight.points.count if paths else self.sight.points.count, passes))
        for path in paths:
            out += path.right
        return out

    def passes_through(self, x: Floats, y: Floats) -> Floats:
        """Radiance (3, k, passes) through other image points, with as many samples as the truth."""
        sight = self.look(x, y)
        light = self.lit_by(self._paths(sight, self.samples, self.passes))
        out = np.repeat(sight.emission[:, :, None], light.shape[2], axis=2)
        out[:, sight.lit] += light
        return out

    def arriving_at(self, sight: Sight, samples: int) -> Floats:
        """Right reflected radiance (3, n) at any points, of so many samples of every light."""
        return np.asarray(self.lit_by(self._paths(sight, samples, 1)).mean(axis=2))

    def grid(self, values: Floats) -> Floats:
        """Values (..., n) by rows and columns of cells."""
        return values.reshape(*values.shape[:-1], *self._cells)
