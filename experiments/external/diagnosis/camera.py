"""Mistakes of the camera: what is seen through another point of the image.

They move edges. Where every pixel without noise is right, and there are some beside a surface, nothing has moved.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from scipy import ndimage

from nusselt.renderer.vectors import Floats

from .case import Case, Guess, least
from .probe import Probe

ENOUGH = 4000
"""Pixels looked at while searching, half of them beside another thing: chosen by how far off they are, their noise
would be taken for a move."""
ZOOMS = 4
"""Finer grids around the best."""
WHOLE = 0.25
"""Degrees from a whole angle within which the whole one is tried: people's mistakes are round."""
SAME = 1.1
"""Times the least distance that a whole angle may have."""
ROUND = 0.04
"""Pixels from a half or whole step within which that is tried."""
CROWD = 2.0
"""Times their share of the pixels, from which errors crowd at edges."""
ANGLES = np.array([-5.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 5.0])

Place = Callable[[Floats, Floats], tuple[Floats, Floats]]
"""Where in the image a pixel's ray passes instead."""


def edges_moved(case: Case) -> bool:
    """Whether a pixel without noise is off, or errors crowd at edges."""
    return case.right.plain_off > 0 or case.crowded > CROWD


class Search:
    """Distances at the pixels that tell most, with few samples."""

    def __init__(self, case: Case) -> None:
        self.case = case
        edges, others = np.flatnonzero(case.valid & case.beside), np.flatnonzero(case.valid)
        kept = (some[:: 1 + 2 * some.size // ENOUGH] for some in (edges, others))
        self.some = np.union1d(*kept)
        shaded = case.given.shaded.astype(float)
        self.layers = np.concatenate((case.given.mean * shaded, shaded[None]))

    def distance(self, place: Place) -> float:
        """Weighted squares of a prediction's errors: what is lit is the truth's, between its pixels."""
        case, probe = self.case, self.case.probe
        x, y = place(probe.x[self.some], probe.y[self.some])
        sight = probe.look(x, y)
        seen = sight.emission.copy()
        at = np.stack((y - 0.5, x - 0.5))[:, sight.lit]
        *colour, share = (ndimage.map_coordinates(layer, at, order=1, mode="nearest") for layer in self.layers)
        seen[:, sight.lit] += np.where(share > 0.01, np.stack(colour) / np.maximum(share, 0.01), 0.0)
        step = case.observed[:, self.some] - case.quantiser.expected(seen, case.deviation[:, self.some])
        return float((case.weight[self.some] * (step * step).mean(axis=0)).sum())

    def nearest(self, family: Callable[[float], Place], grid: Floats) -> float:
        """The parameter whose image is nearest."""
        return least(lambda value: self.distance(family(value)), grid, 1 + ZOOMS)


def _seen(case: Case, name: str, place: Place, detail: str, fitted: int = 0) -> Guess:
    """Through other image points."""
    return seen_through(case, case.probe, name, place(case.probe.x, case.probe.y), detail, fitted)


def seen_through(case: Case, probe: Probe, name: str, at: tuple[Floats, Floats], detail: str, fitted: int = 0) -> Guess:
    """What a probe sees through image points, with as many samples as the truth."""
    passes = probe.passes_through(*at)
    noise = passes.var(axis=2, ddof=1).mean(axis=0) if passes.shape[2] > 1 else np.zeros(case.truth.shape[1])
    more = np.maximum(noise - case.probe.variance.mean(axis=0), 0.0)
    return Guess(name, passes.mean(axis=2), detail, fitted, noise / passes.shape[2], noise=more)


def camera(case: Case) -> Iterator[Guess]:
    """All of them; none where nothing has moved."""
    if edges_moved(case):
        search = Search(case)
        for family in (mirrored, shifted, fov, aspect, rolled, others):
            yield from family(case, search)


def mirrored(case: Case, search: Search) -> Iterator[Guess]:
    """Left and right or top and bottom exchanged."""
    w, h = case.probe.scene.width, case.probe.scene.height
    places: dict[str, Place] = {
        "mirrored in x: left and right exchanged": lambda x, y: (w - x, y),
        "mirrored in y: top and bottom exchanged": lambda x, y: (x, h - y),
        "mirrored in x and y: turned by 180 degrees": lambda x, y: (w - x, h - y),
    }
    if w == h:
        places["rows and columns exchanged"] = lambda x, y: (y, x)
    told = min(places, key=lambda name: search.distance(places[name]))
    yield _seen(case, "mirrored", places[told], told)


def shifted(case: Case, search: Search) -> Iterator[Guess]:
    """Rays through a pixel's corner or edge, or another pixel."""
    steps = [(dx, dy) for dx in (-1, -0.5, 0, 0.5, 1) for dy in (-1, -0.5, 0, 0.5, 1) if dx or dy]

    def by(dx: float, dy: float) -> Place:
        return lambda x, y: (x + dx, y + dy)

    dx, dy = min(steps, key=lambda step: search.distance(by(*step)))
    yield _shift(case, dx, dy)
    for _ in range(2):  # and what is no half
        dx = search.nearest(lambda value, dy=dy: by(value, dy), np.linspace(dx - 0.5, dx + 0.5, 9))  # type: ignore[misc]
        dy = search.nearest(lambda value, dx=dx: by(dx, value), np.linspace(dy - 0.5, dy + 0.5, 9))  # type: ignore[misc]
    if max(abs(2 * dx - round(2 * dx)), abs(2 * dy - round(2 * dy))) > ROUND or abs(dx) + abs(dy) > 1.6:
        yield _shift(case, round(dx, 3), round(dy, 3), 2)


def _shift(case: Case, dx: float, dy: float, fitted: int = 0) -> Guess:
    whole = max(abs(dx), abs(dy)) >= 0.75
    words = "pixels (x right, y down)"
    told = (
        f"the image lies {-dx:+g}, {-dy:+g} {words} off"
        if whole
        else f"rays pass {dx:+g}, {dy:+g} {words} from the centre"
    )
    return _seen(case, "shifted" if whole else "half-pixel", lambda x, y: (x + dx, y + dy), told, fitted)


def _stretched(case: Case, sx: float, sy: float) -> Place:
    cx, cy = case.probe.scene.width / 2, case.probe.scene.height / 2
    return lambda x, y: (cx + (x - cx) * sx, cy + (y - cy) * sy)


def fov(case: Case, search: Search) -> Iterator[Guess]:
    """Another field of view: the same rays, spread more or less about the axis."""
    right = case.probe.scene.camera.fov_y
    half = math.tan(math.radians(right) / 2)
    grid = np.geomspace(0.5, min(2.0, math.tan(math.radians(89)) / half), 37)
    best = search.nearest(lambda s: _stretched(case, s, s), grid)
    seen = math.degrees(2 * math.atan(half * best))
    wide = case.probe.scene.width / case.probe.scene.height
    if 0 < abs(seen - round(seen)) < WHOLE and round(seen) != right:
        whole = math.tan(math.radians(round(seen)) / 2) / half
        if search.distance(_stretched(case, whole, whole)) < SAME * search.distance(_stretched(case, best, best)):
            seen, best = float(round(seen)), whole
    detail = f"a vertical field of view of {seen:.4g} instead of {right:g} degrees: an error of {seen - right:+.3g}"
    if abs(wide - 1) > 0.01 and abs(best * wide - 1) < 0.01:
        detail += " (the field of view was taken for the horizontal one)"
    yield _seen(case, "fov", _stretched(case, best, best), detail, 1)
    if abs(wide - 1) > 0.01:
        told = "the field of view was taken for the horizontal one"
        yield _seen(case, "fov", _stretched(case, 1 / wide, 1 / wide), told)


def aspect(case: Case, search: Search) -> Iterator[Guess]:
    """Stretched in one direction."""
    scene = case.probe.scene
    best = search.nearest(lambda s: _stretched(case, s, 1.0), np.geomspace(0.5, 2.0, 25))
    told = f"the width of the view is {best:.4g} times what is right"
    yield _seen(case, "aspect", _stretched(case, best, 1.0), told, 1)
    if scene.width != scene.height:
        square = scene.height / scene.width
        yield _seen(case, "aspect", _stretched(case, square, 1.0), "the view is square: no aspect ratio")


def rolled(case: Case, search: Search) -> Iterator[Guess]:
    """Turned about the line of sight."""
    cx, cy = case.probe.scene.width / 2, case.probe.scene.height / 2

    def by(degrees: float) -> Place:
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        return lambda x, y: (cx + (x - cx) * c - (y - cy) * s, cy + (x - cx) * s + (y - cy) * c)

    best = search.nearest(by, ANGLES)
    yield _seen(case, "rolled", by(best), f"the camera is turned by {best:.3g} degrees about its line of sight", 1)


def others(case: Case, search: Search) -> Iterator[Guess]:
    """Pixels' numbers over one less than their count; equal angles."""
    w, h = case.probe.scene.width, case.probe.scene.height
    half = math.radians(case.probe.scene.camera.fov_y) / 2
    across = math.atan(math.tan(half) * w / h)

    def bent(p: Floats, size: int, angle: float) -> Floats:
        return np.asarray((np.tan((2 * p / size - 1) * angle) / math.tan(angle) + 1) * size / 2)

    places: dict[str, Place] = {
        "the image's edges are at the centres of its outermost pixels: over width - 1": lambda x, y: (
            (x - 0.5) * w / max(w - 1, 1),
            (y - 0.5) * h / max(h - 1, 1),
        ),
        "pixels' numbers are over width - 1": lambda x, y: (x * w / max(w - 1, 1), y * h / max(h - 1, 1)),
        "pixels lie at equal angles across the image, not at equal steps": lambda x, y: (bent(x, w, across), y),
        "pixels lie at equal angles, not at equal steps": lambda x, y: (bent(x, w, across), bent(y, h, half)),
    }
    for told, place in places.items():
        yield _seen(case, "pixel-grid", place, told)
