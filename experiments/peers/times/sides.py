"""What takes turns: each side makes an image of some size, and says how far it is off and what it took."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from nusselt.experiments.check.question import PixelRule, with_pixel_rule
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.peers.peer import Peer
from nusselt.experiments.peers.renderer import PeerRenderer
from nusselt.experiments.scenes.sizes import at_width
from nusselt.experiments.workers import SturdyPool
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.mitsuba_bridge.race import Way, run_race
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.image import render
from nusselt.renderer.pixels import render_area
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Bools, Floats

SIZES = (4, 16, 64, 256, 1024, 4096)
"""Samples: points on each light where pixels are centres, camera rays where they are areas."""
TOLERANCES = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
"""Asked of ours by area."""
SMALL = 8
"""Pixels across of the image that brings ours to life."""
WAY = Way("multijitter", 0)
"""Mitsuba's light sampling alone, as all light here comes from lights, with its best sampler in most scenes."""


@dataclass(frozen=True)
class Truth:
    """The exact image (3, h, w) of one rule, and which pixels (h, w) count."""

    image: Floats
    judged: Bools

    def error(self, image: Floats) -> float:
        """Root mean square over the judged pixels, relative to that of the exact image there."""
        exact = self.image[:, self.judged]
        off = image[:, self.judged] - exact
        return float(np.sqrt((off * off).sum() / (exact * exact).sum()))


@dataclass(frozen=True)
class Lap:
    """One image.

    Parameters
    ----------
    size : float
        Samples, or the tolerance asked of ours.
    round : int
    error : float
        As `Truth.error`.
    processor, wall : float
        Seconds of rendering alone: of all processors, and by the clock.
    start : float
        Of all processors, for everything else; NaN where it is not known.
    """

    size: float
    round: int
    error: float
    processor: float
    wall: float
    start: float


class Side(Protocol):
    """One that takes turns."""

    @property
    def peer(self) -> Peer: ...

    @property
    def rule(self) -> PixelRule: ...

    @property
    def sizes(self) -> tuple[float, ...]:
        """What it is asked for, the fastest first."""
        ...

    def lap(self, size: float, round: int, seed: int) -> Lap:
        """One image.

        Raises
        ------
        ProgramFailed
        """
        ...


@dataclass(frozen=True)
class PeerSide:
    """A peer by its adapter."""

    renderer: PeerRenderer
    truth: Truth
    sizes: tuple[float, ...] = SIZES

    @property
    def peer(self) -> Peer:
        return self.renderer.peer

    @property
    def rule(self) -> PixelRule:
        return self.peer.rule

    def lap(self, size: float, round: int, seed: int) -> Lap:
        image = self.renderer.run(int(size), seed).raw.values
        spent = self.renderer.spent
        if not math.isfinite(spent.processor):
            raise ProgramFailed(f"{self.peer.title} does not say what rendering took")
        return Lap(size, round, self.truth.error(np.asarray(image, float)), spent.processor, spent.wall, spent.start)


@dataclass(frozen=True)
class MitsubaSide:
    """Mitsuba in a new child for each image, its kernels compiled in another before that one."""

    peer: Peer
    rule: PixelRule
    scene: Scene
    truth: Truth
    threads: int
    timeout: float = 600.0
    sizes: tuple[float, ...] = SIZES

    def lap(self, size: float, round: int, seed: int) -> Lap:
        view, judged = with_pixel_rule(self.scene, self.rule), self.truth.judged
        how = {"sizes": (int(size),), "ways": (WAY,), "longest": self.timeout, "timeout": self.timeout}
        try:
            race = run_race(view, self.truth.image, judged, seed=seed, threads=self.threads, **how)  # type: ignore[arg-type]
        except ReferenceUnavailable as problem:
            raise ProgramFailed(f"{self.peer.title}: {problem}") from problem
        (lap,) = race.laps
        return Lap(size, round, lap.error, lap.processor, lap.seconds, race.once["used"] - lap.processor)


@dataclass(frozen=True)
class OwnSide:
    """Ours without noise, in a new process for each image: pixels' centres at once, their areas to a tolerance."""

    peer: Peer
    rule: PixelRule
    scene: Scene
    truth: Truth
    estimator: Estimator

    @property
    def sizes(self) -> tuple[float, ...]:
        return TOLERANCES if self.rule == "area" else (0.0,)

    def lap(self, size: float, round: int, seed: int) -> Lap:
        with SturdyPool(1) as pool:
            image, spent = pool.submit(_own, self.scene, self.rule, self.estimator, size).result()
        return Lap(size, round, self.truth.error(image), *spent)


def _own(scene: Scene, rule: PixelRule, estimator: Estimator, tolerance: float) -> tuple[Floats, tuple[float, ...]]:
    """An image, and its `Lap`'s seconds; a small image before it is start-up, as kernels are elsewhere."""
    view = with_pixel_rule(scene, rule)

    def draw(view: Scene) -> Floats:
        if rule == "centre":
            return render(view, estimator).mean
        return render_area(view, estimator, tolerance=tolerance).image.mean

    draw(at_width(view, SMALL))
    wall, start = time.perf_counter(), time.process_time()
    image = draw(view)
    return image, (time.process_time() - start, time.perf_counter() - wall, start)
