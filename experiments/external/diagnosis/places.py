"""Mistakes of the camera: what is seen through another point of the image."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from nusselt.renderer.vectors import Floats

from .case import Case, Guess

QUICK = 4
"""Samples per light while searching."""
COARSE = 4
"""Of so many pixels one is looked at first."""
ENOUGH = 6000
"""Pixels looked at while searching."""
ZOOMS, FINER = 4, 9
"""Finer grids around the best, and their values."""
WHOLE = 0.25
"""Degrees from a whole angle within which the whole one is tried: people's mistakes are round."""

Place = Callable[[Floats, Floats], tuple[Floats, Floats]]
"""Where in the image a pixel's ray passes instead."""


def _distance(case: Case, place: Place, step: int = 1) -> float:
    """Mean squared difference in levels with few samples, at every ``step``-th pixel."""
    some = np.flatnonzero(case.valid)
    some = some[:: step * max(1, some.size // ENOUGH)]
    probe = case.probe
    moved = probe.moved(*place(probe.x[some], probe.y[some]), QUICK)
    return case.distance_at(moved, some)


def _whole(case: Case, place: Place) -> Floats:
    return case.probe.moved(*place(case.probe.x, case.probe.y))


def _best(case: Case, places: dict[str, Place]) -> Iterator[Guess]:
    """The nearest of several places at few samples, rendered with as many as the truth."""
    told = min(places, key=lambda name: _distance(case, places[name], 2))
    yield Guess(_whole(case, places[told]), told)


def half_pixel(case: Case) -> Iterator[Guess]:
    """Rays through a pixel's corner or edge."""
    w, h = case.probe.scene.width, case.probe.scene.height
    steps = [(dx, dy) for dx in (-0.5, 0.0, 0.5) for dy in (-0.5, 0.0, 0.5) if dx or dy]

    def by(dx: float, dy: float) -> Place:
        return lambda x, y: (x + dx, y + dy)

    places = {f"rays pass {dx:+g}, {dy:+g} pixels (x right, y down) from the centre": by(dx, dy) for dx, dy in steps}
    places["the image's edges are at the centres of its outermost pixels"] = lambda x, y: (
        (x - 0.5) * w / max(w - 1, 1),
        (y - 0.5) * h / max(h - 1, 1),
    )
    yield from _best(case, places)


def mirrored(case: Case) -> Iterator[Guess]:
    """Left and right or top and bottom exchanged."""
    w, h = case.probe.scene.width, case.probe.scene.height
    places: dict[str, Place] = {
        "mirrored in x: left and right exchanged": lambda x, y: (w - x, y),
        "mirrored in y: top and bottom exchanged": lambda x, y: (x, h - y),
        "mirrored in x and y: turned by 180 degrees": lambda x, y: (w - x, h - y),
    }
    if w == h:
        places["rows and columns exchanged"] = lambda x, y: (y, x)
    yield from _best(case, places)


def _stretched(case: Case, sx: float, sy: float) -> Place:
    cx, cy = case.probe.scene.width / 2, case.probe.scene.height / 2
    return lambda x, y: (cx + (x - cx) * sx, cy + (y - cy) * sy)


def _nearest_stretch(case: Case, both: Callable[[float], tuple[float, float]], grid: Floats) -> float:
    """The stretch whose image is nearest: edges make the distance jagged, so that only grids are trusted."""
    values, step = grid, COARSE
    for _ in range(1 + ZOOMS):
        found = [_distance(case, _stretched(case, *both(float(value))), step) for value in values]
        best = int(np.argmin(found))
        chosen, low, high = float(values[best]), values[max(best - 1, 0)], values[min(best + 1, values.size - 1)]
        values, step = np.union1d(np.linspace(low, high, FINER), chosen), 1
    return chosen


def fov(case: Case) -> Iterator[Guess]:
    """Another field of view: the same rays, spread more or less about the axis."""
    right = case.probe.scene.camera.fov_y
    half = math.tan(math.radians(right) / 2)
    grid = np.geomspace(0.4, min(2.5, math.tan(math.radians(89)) / half), 49)
    found = _nearest_stretch(case, lambda s: (s, s), grid)
    seen = math.degrees(2 * math.atan(half * found))
    guess = Guess(_whole(case, _stretched(case, found, found)), "", 1)
    if 0 < abs(seen - round(seen)) < WHOLE and round(seen) != right:
        found_whole = math.tan(math.radians(round(seen)) / 2) / half
        whole = Guess(_whole(case, _stretched(case, found_whole, found_whole)), "", 1)
        if not case.better(guess, whole):
            guess, seen, found = whole, float(round(seen)), found_whole
    detail = f"a vertical field of view of {seen:.4g} instead of {right:g} degrees: an error of {seen - right:+.3g}"
    wide = case.probe.scene.width / case.probe.scene.height
    if abs(wide - 1) > 0.01 and abs(found * wide - 1) < 0.01:
        detail += " (the field of view was taken for the horizontal one)"
    yield Guess(guess.prediction, detail, 1)


def aspect(case: Case) -> Iterator[Guess]:
    """Stretched in one direction."""
    found = _nearest_stretch(case, lambda s: (s, 1.0), np.geomspace(0.4, 2.5, 25))
    told = f"the width of the view is {found:.4g} times what is right"
    yield Guess(_whole(case, _stretched(case, found, 1.0)), told, 1)
