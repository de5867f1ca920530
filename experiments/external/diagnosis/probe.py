"""A scene at some of its pixels, under any rules and any camera: what every hypothesis is rendered with.

The light points and what each sees of them are found once; a change of rules then costs no shadow ray.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from nusselt.renderer.camera.view import look
from nusselt.renderer.geometry.arrays import Geometry
from nusselt.renderer.lights import Light
from nusselt.renderer.lights.sampling import random_beams
from nusselt.renderer.lobes.protocol import joined
from nusselt.renderer.needs import Source
from nusselt.renderer.prepared import prepare
from nusselt.renderer.scene import Scene
from nusselt.renderer.shading import ShadingPoints
from nusselt.renderer.vectors import Floats, dot
from nusselt.renderer.visibility.segments import Blockers

from .rules import RIGHT, Rules, reflected

PIXELS = 1 << 15
PAIRS = 3 << 20
"""Pixel-sample pairs of all lights together, at most."""
SAMPLES = 64
"""Per light and pixel, at least: beyond the noise of the image that is looked at."""
LOOK = 1 << 11
"""Rays traced at once; neighbours, so that far triangles drop out."""
TESTS = 1 << 30
"""Tests of a sample against a triangle, at most."""
FEWEST = 400
"""Pixels, at least."""
SHORT = 0.99


@dataclass(frozen=True)
class Sight:
    """What n camera rays see; ``glow`` is the radiance of lights from either side, ``emission`` what is right."""

    points: ShadingPoints
    lit: np.ndarray
    emission: Floats
    glow: Floats
    light: np.ndarray


@dataclass
class Paths:
    """Beams of one light: d (3, m, k), and what arrives of them by kind of visibility, found when asked for."""

    source: Source
    d: Floats
    at_infinity: bool
    geometry: Geometry
    sight: Sight
    known: dict[str, Floats] = field(default_factory=dict)

    @property
    def light(self) -> Light:
        return self.source.light

    def seen(self, kind: str) -> Floats:
        """(m, k): 1 where a beam arrives."""
        if kind not in self.known:
            self.known[kind] = self._find(kind)
        return self.known[kind]

    def _find(self, kind: str) -> Floats:
        if kind == "none":
            return np.ones(self.d.shape[1:])
        if kind == "behind":
            return self._behind()
        endless = self.at_infinity or kind == "beyond"
        d = self.d * SHORT if kind == "short" and not endless else self.d
        return self.visible(np.arange(self.sight.points.count), d, endless, all_blockers=kind == "beyond")

    def _behind(self) -> Floats:
        """With everything that may stand behind the light."""
        found = self.seen("right").copy()
        plane = self.light.plane()
        if plane is not None:
            back = np.flatnonzero(dot(plane[0], self.sight.points.position - plane[1]) < 0)
            found[back] = self.visible(back, self.d[:, back], False, all_blockers=True)
        return found

    def visible(self, chosen: np.ndarray, d: Floats, endless: bool, all_blockers: bool = False) -> Floats:
        """(c, k): 1 where nothing but the light itself stands along d (3, c, k) from the chosen points."""
        points = self.sight.points
        found = np.empty(d.shape[1:])
        for start in range(0, chosen.size, LOOK):
            some = slice(start, start + LOOK)
            position, own = points.position[:, chosen[some]], points.ellipsoid[chosen[some]]
            blockers = self._everything if all_blockers else self.source.seen_from(position).blockers
            found[some] = blockers.visible(position, own, d[:, some], endless)
        return found

    @property
    def _everything(self) -> Blockers:
        g = self.geometry
        others = (
            np.flatnonzero(g.light[surfaces] != self.source.index) for surfaces in (g.triangle_surface, g.disk_surface)
        )
        triangles, disks = others
        return Blockers(g, triangles, np.arange(g.ellipsoids), disks)


class Probe:
    """A scene at n of its pixels.

    Parameters
    ----------
    scene : Scene
    samples : int
        Of one pass, per light.
    stratified : bool
    seed : int
    """

    def __init__(self, scene: Scene, samples: int, stratified: bool, seed: int = 0) -> None:
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
        self.stride = self._stride()
        # A random pixel in each cell: the edges of an image like to run along its rows.
        place = np.random.default_rng(seed).integers(0, self.stride, (2, *self._cells))
        rows, columns = (np.arange(count) * self.stride for count in self._cells)
        self.rows = np.minimum(rows[:, None] + place[0], scene.height - 1)
        self.columns = np.minimum(columns[None] + place[1], scene.width - 1)
        self.x, self.y = self.columns.ravel() + 0.5, self.rows.ravel() + 0.5
        self.sight = self.look(self.x, self.y)
        self.paths = self._paths(self.sight, self.samples, self.passes)
        self.all_passes = self.radiance_passes(RIGHT)
        self.truth = self.all_passes.mean(axis=2)
        self.variance = self.all_passes.var(axis=2, ddof=1)

    def _stride(self) -> int:
        """Pixels from one to the next, so that samples and their tests against triangles stay within bounds."""
        pairs = self.samples * self.passes * max(1, len(self.scene.lights))
        most = min(PIXELS, PAIRS // pairs, TESTS // (pairs * max(1, self.geometry.triangles)))
        return max(1, math.ceil(math.sqrt(self.scene.width * self.scene.height / max(most, FEWEST))))

    @property
    def _cells(self) -> tuple[int, int]:
        return -(-self.scene.height // self.stride), -(-self.scene.width // self.stride)

    def pick(self, image: np.ndarray) -> np.ndarray:
        """The probe's pixels (..., n) of an image (..., h, w)."""
        return np.asarray(image[..., self.rows.ravel(), self.columns.ravel()])

    def spread_out(self, values: Floats) -> Floats:
        """Values (..., n) as an image (..., h, w): every pixel takes its cell's."""
        grid = values.reshape(*values.shape[:-1], *self._cells)
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
            parts.append((view.points, view.lit + start, view.emission, glow, light))
        points = joined([part[0] for part in parts])
        lit, emission, glow, light = (np.concatenate([p[k] for p in parts], axis=-1) for k in range(1, 5))
        return Sight(points, lit, emission, glow, light)

    def _paths(self, sight: Sight, samples: int, passes: int) -> list[Paths]:
        found = []
        for source in self.sources:
            rng = np.random.default_rng([self.seed, source.index, samples])
            light, at = source.light, sight.points.position
            drawn = [random_beams(light, at, rng, samples, self.stratified) for _ in range(passes)]
            d = np.concatenate([one[0] for one in drawn], axis=2)
            found.append(Paths(source, d, light.at_infinity, self.geometry, sight))
        return found

    def radiance_passes(self, rules: Rules, sight: Sight | None = None, paths: list[Paths] | None = None) -> Floats:
        """Radiance (3, n, passes) under rules."""
        sight = self.sight if sight is None else sight
        paths = self.paths if paths is None else paths
        passes = self.passes if paths is self.paths else 1
        seen = sight.glow if rules.facing == "both" else sight.emission
        kind = "behind" if rules.facing in ("both", "back") and rules.visibility == "right" else rules.visibility
        out = np.repeat(seen[:, :, None], passes, axis=2)
        for path in paths:
            if path.source.index not in rules.without:
                out[:, sight.lit] += reflected(sight.points, path.light, path.d, path.seen(kind), rules, passes)
        return out

    def radiance(self, rules: Rules) -> Floats:
        """Radiance (3, n) under rules, of all passes."""
        return self.radiance_passes(rules).mean(axis=2)

    def moved(self, x: Floats, y: Floats, samples: int = 0) -> Floats:
        """Radiance (3, k) through other image points, with few samples or (0) as many as the truth."""
        sight = self.look(x, y)
        paths = self._paths(sight, samples or self.samples, 1 if samples else self.passes)
        return self.radiance_passes(RIGHT, sight, paths).mean(axis=2)

    def alike(self, values: Floats, some: np.ndarray) -> float:
        """Correlation of neighbouring cells' values (n,), over the pixels ``some`` (n,) bool."""
        grid = np.where(some, values - values[some].mean(), 0.0).reshape(self._cells)
        mask = some.reshape(self._cells)
        products = [grid[1:] * grid[:-1], grid[:, 1:] * grid[:, :-1]]
        pairs = int((mask[1:] & mask[:-1]).sum() + (mask[:, 1:] & mask[:, :-1]).sum())
        size = float((grid * grid).sum()) / max(int(some.sum()), 1)
        return float(sum(float(p.sum()) for p in products)) / max(pairs, 1) / size if size > 0 else 0.0

    @property
    def one_sided(self) -> list[Paths]:
        """Paths of the lights that shine to one side of a plane."""
        return [path for path in self.paths if path.light.plane() is not None]
