"""Mistakes of single lights, by what each brings; of their points; of suns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from nusselt.renderer.lights import Light, QuadLight
from nusselt.renderer.vectors import Floats

from .beams import RIGHT, seen_as
from .case import Case, Guess
from .probe import Paths
from .transport import changed, groups, said

PLAIN_FACTORS = {
    "pi times": math.pi,
    "1/pi of": 1 / math.pi,
    "2 pi times": 2 * math.pi,
    "1/(2 pi) of": 0.5 / math.pi,
    "4 pi times": 4 * math.pi,
    "1/(4 pi) of": 0.25 / math.pi,
    "4/pi times": 4 / math.pi,
    "pi/4 of": math.pi / 4,
    "1/pi^2 of": math.pi**-2,
    "half": 0.5,
    "double": 2.0,
    "a quarter": 0.25,
    "four times": 4.0,
    "a third of": 1 / 3,
    "three times": 3.0,
}
"""Factors with a usual cause: area, pi, channels."""
WHOLE = 0.01
"""Relative difference within which a factor is a plain one."""


def in_words(value: float, case: Case, lights: list[Light] | None = None) -> str:
    """A factor, and what has it."""
    causes = dict(PLAIN_FACTORS)
    for light in case.probe.scene.lights if lights is None else lights:
        if light.area > 0:
            causes |= {
                "the light's area times": light.area,
                "1/area of": 1 / light.area,
                "area/pi of": light.area / math.pi,
            }
    n = case.probe.samples
    if n > 1:
        causes |= {"(N-1)/N of": (n - 1) / n, "N/(N-1) times": n / (n - 1), "N/(N+1) of": n / (n + 1)}
    count = len(case.probe.scene.lights)
    if count > 1:
        causes |= {"the number of lights times": float(count), "1/(number of lights) of": 1 / count}
    near = [words for words, plain in causes.items() if abs(value / plain - 1) < WHOLE]
    return f"{value:.4g}" + (f" ({' or '.join(near)} what is right)" if near else "")


def light_scale(case: Case) -> Iterator[Guess]:
    """What is lit times a constant; lights seen directly are right."""
    seen = case.probe.sight.emission
    lit = case.truth - seen
    (factor,) = case.combined(lit[None], seen, case.shaded)
    if factor > 0:
        told = f"what is lit times {in_words(float(factor), case)}, lights seen directly right"
        yield Guess("light-scale", seen + factor * lit, told, 1)
    yield Guess("no-light", seen, "no light arrives: every surface is black")
    if seen[:, case.plain].any():
        yield Guess("lights-not-seen", lit, "no light is seen directly")
        (shown,) = case.combined(seen[None], lit, case.plain)
        yield Guess("lights-seen", lit + shown * seen, f"lights are seen {in_words(float(shown), case)} as bright", 1)


def each_light(case: Case) -> Iterator[Guess]:
    """One light times a factor; every light times its own; colours of lights."""
    probe = case.probe
    if not 1 < len(probe.paths) <= 12:
        return
    for path in probe.paths:
        part = _share(path, case)
        if not part.any():
            continue
        error = _noise_of(path, case)
        gone = np.where(probe.sight.light == path.source.index, 0.0, case.truth)
        told = f"{said(path)} lights nothing"
        yield Guess("forgotten-light", case.truth - part, told, 0, error)
        if (gone != case.truth).any():
            yield Guess("forgotten-light", gone - part, told + ", and is not seen", 0, error)
        (factor,) = case.combined(part[None], case.truth - part, case.shaded)
        if factor > 0.01:
            told = f"{said(path)} is {in_words(float(factor), case, [path.light])} as bright"
            yield Guess("light-factor", case.truth + (factor - 1) * part, told, 1, (factor - 1) ** 2 * error)
    if len(probe.paths) > 2:
        for path in probe.paths:
            told = f"{said(path)} alone lights"
            prediction = _share(path, case) + probe.sight.emission
            yield Guess("forgotten-light", prediction, told, 0, _noise_of(path, case))


def _share(path: Paths, case: Case) -> Floats:
    """What one light brings, (3, n)."""
    part = np.zeros_like(case.truth)
    part[:, case.probe.sight.lit] = path.right.mean(axis=2)
    return part


def _noise_of(path: Paths, case: Case) -> Floats:
    error = np.zeros(case.truth.shape[1])
    passes = path.right.shape[2]
    if passes > 1:
        error[case.probe.sight.lit] = (path.right.var(axis=2, ddof=1) / passes).mean(axis=0)
    return error


def grey_lights(case: Case) -> Iterator[Guess]:
    """Lights without colour."""
    tints = [np.array(path.light.colour) for path in case.probe.paths]
    if not any(np.ptp(tint) > 0 for tint in tints):
        return
    for words, of in (
        ("mean", np.ones(3) / 3),
        ("luminance", np.array([0.2126, 0.7152, 0.0722])),
        ("red", np.eye(3)[0]),
    ):
        parts = []
        for path, tint in zip(case.probe.paths, tints, strict=True):
            scale = np.divide(of @ tint, tint, out=np.zeros(3), where=tint > 0)
            parts.append((path, path.right * scale[:, None, None]))
        yield changed(case, "light-colour", f"lights are grey: the {words} of their channels in each", parts)


Places = Callable[[Floats, Floats, int], tuple[Floats, Floats]]
"""(u, v) and the strata's number a side, to other (u, v)."""


def _folded(u: Floats, v: Floats, n: int) -> tuple[Floats, Floats]:
    over = u + v > 1
    return np.where(over, 1 - u, u), np.where(over, 1 - v, v)


def _other_fold(u: Floats, v: Floats, n: int) -> tuple[Floats, Floats]:
    over = u + v < 1
    return np.where(over, 1 - u, u), np.where(over, 1 - v, v)


def _disk(u: Floats, v: Floats, n: int) -> tuple[Floats, Floats]:
    r, phi = 0.5 * np.sqrt(u), 2 * math.pi * v
    return 0.5 + r * np.cos(phi), 0.5 + r * np.sin(phi)


def _cells(offset: float, size: float) -> Places:
    """(offset + size random) of each cell."""
    return lambda u, v, n: (_cell(u, n, offset, size), _cell(v, n, offset, size))


def _cell(u: Floats, n: int, offset: float, size: float) -> Floats:
    k = np.floor(u * n)
    return np.asarray((k + offset + size * (u * n - k)) / n)


def _without_cell(u: Floats, v: Floats, n: int) -> tuple[Floats, Floats]:
    """The first cell's points in the next."""
    first = (u * n < 1) & (v * n < 1)
    return u, np.where(first, v + 1 / n, v)


PLACES: dict[str, Places] = {
    "every point is the light's centre": lambda u, v, n: (0 * u[:, :1] + 0.5, 0 * v[:, :1] + 0.5),
    "every point is the light's first corner": lambda u, v, n: (0 * u[:, :1], 0 * v[:, :1]),
    "every point is the light's far corner": lambda u, v, n: (0 * u[:, :1] + 1, 0 * v[:, :1] + 1),
    "points lie half an edge off along both: the corner is taken for the centre": lambda u, v, n: (u - 0.5, v - 0.5),
    "points lie half an edge off: the centre is taken for the corner": lambda u, v, n: (u + 0.5, v + 0.5),
    "points lie on a light of twice the edges": lambda u, v, n: (2 * u - 0.5, 2 * v - 0.5),
    "points lie on a light of twice the edges, from its corner": lambda u, v, n: (2 * u, 2 * v),
    "points lie in the middle half of each edge": lambda u, v, n: (0.25 + u / 2, 0.25 + v / 2),
    "points lie in the first quarter: half of each edge": lambda u, v, n: (u / 2, v / 2),
    "points fill the first half along ab": lambda u, v, n: (u / 2, v),
    "points fill the second half along ab": lambda u, v, n: (0.5 + u / 2, v),
    "points fill the first half along ac": lambda u, v, n: (u, v / 2),
    "points fill the second half along ac": lambda u, v, n: (u, 0.5 + v / 2),
    "points lie on the middle line along ab": lambda u, v, n: (u, 0 * v + 0.5),
    "points lie on the middle line along ac": lambda u, v, n: (0 * u + 0.5, v),
    "points lie on the edge ab": lambda u, v, n: (u, 0 * v),
    "points lie on the edge ac": lambda u, v, n: (0 * u, v),
    "points lie on the diagonal: u = v": lambda u, v, n: (u, u),
    "points lie on the other diagonal: u = 1 - v": lambda u, v, n: (u, 1 - u),
    "only the cells of the diagonal are sampled": lambda u, v, n: (u, (np.floor(u * n) + v * n % 1) / n),
    "points fill the triangle at the first corner": _folded,
    "points fill the triangle at the far corner": _other_fold,
    "points fill the inscribed disk": _disk,
    "u is squared: points crowd at one edge": lambda u, v, n: (u * u, v),
    "v is squared: points crowd at one edge": lambda u, v, n: (u, v * v),
    "u is a square root: points crowd at one edge": lambda u, v, n: (np.sqrt(u), v),
    "v is a square root: points crowd at one edge": lambda u, v, n: (u, np.sqrt(v)),
    "random numbers of 4 bits": lambda u, v, n: (np.floor(16 * u) / 16, np.floor(16 * v) / 16),
}
"""Of any light with (u, v), in words."""
CELLS: dict[str, Places] = {
    "each cell's corner is sampled": _cells(0, 0),
    "each cell's far corner is sampled": _cells(1, 0),
    "points lie half a cell too far": _cells(0.5, 1),
    "points lie half a cell too near": _cells(-0.5, 1),
    "points fill the first half of each cell": _cells(0, 0.5),
    "points fill the second half of each cell": _cells(0.5, 0.5),
    "a cell is sampled in another's place": _without_cell,
    "the last cell along each edge is left out": lambda u, v, n: (u * (n - 1) / n, v * (n - 1) / n),
}
"""Of strata."""


def light_points(case: Case) -> Iterator[Guess]:
    """Points elsewhere on the lights, or beside them."""
    probe = case.probe
    wide = [path for path in probe.paths if path.light.parallelogram() is not None]
    side = math.isqrt(probe.samples) if probe.stratified else 0
    if not wide:
        return
    words, _ = next(groups(wide, len(probe.paths)))
    for told, places in (PLACES | (CELLS if side > 1 else {})).items():
        parts = [(p, RIGHT.radiance(p.through(*places(p.u, p.v, side)))) for p in wide]
        yield changed(case, "light-points", told + words, parts)
    for told, shape in EDGES.items():
        beams = [(p, p.through(p.u, p.v, shape(quad))) for p in wide if (quad := p.light.parallelogram())]
        yield changed(case, "light-shape", told, [(p, RIGHT.radiance(replace(b, light=p.light))) for p, b in beams])


def _square(quad: QuadLight) -> QuadLight:
    ab, ac = np.array(quad.ab), np.array(quad.ac)
    return replace(quad, ac=tuple(ac - ab * (ab @ ac) / (ab @ ab)))


def _from_corners(first: bool, second: bool) -> Callable[[QuadLight], QuadLight]:
    """Edges taken for corners, and the first corner taken off them."""

    def change(quad: QuadLight) -> QuadLight:
        corner = np.array(quad.corner)
        ab, ac = np.array(quad.ab) - first * corner, np.array(quad.ac) - second * corner
        area = np.linalg.norm(np.cross(ab, ac))
        return replace(quad, ab=tuple(ab), ac=tuple(ac)) if area > 0 and ab.any() and ac.any() else quad

    return change


EDGES: dict[str, Callable[[QuadLight], QuadLight]] = {
    "the second edge is made square to the first": _square,
    "the first edge is taken for a corner": _from_corners(True, False),
    "the second edge is taken for a corner": _from_corners(False, True),
    "both edges are taken for corners": _from_corners(True, True),
}


def round_lights(case: Case) -> Iterator[Guess]:
    """Suns and disks, whose u is the squared distance from the middle and v the angle: other sizes, other points."""
    for path in case.probe.paths:
        light = path.light
        if not light.has_extent or light.parallelogram() is not None:
            continue
        far = light.at_infinity
        sizes, points = ("sun-angle", "sun-points") if far else ("light-shape", "light-points")
        _, reach = light.middle()
        for times, told in ((0.5, "half"), (2.0, "twice")):
            wider = _wider(math.atan(reach), times) if far else times**2
            if not wider:
                continue
            made = RIGHT.radiance(path.through(wider * path.u, path.v, light))
            told = f"{said(path)} has {told} the {'angle' if far else 'radius'}"
            yield changed(case, sizes, told, [(path, made)])
            yield changed(case, sizes, f"{told}, and its radiance is that of the right one", [(path, made * wider)])
        for told, u, v in (
            ("its points crowd in the middle: a square root is missing", path.u**2, path.v),
            ("its points lie on its rim", 0 * path.u + 1, path.v),
            ("it is a direction" if far else "it is a point", 0 * path.u[:, :1], 0 * path.v[:, :1]),
        ):
            made = RIGHT.radiance(path.through(u, v))
            yield changed(case, points, f"{said(path)}: {told}", [(path, made)])
        halves = [
            changed(case, points, f"{said(path)}: its points lie on half of it", [part], 1) for part in _halves(path)
        ]
        yield min(halves, key=lambda guess: case.distance(guess.prediction))


def _halves(path: Paths) -> Iterator[tuple[Paths, Floats]]:
    """Light of half of a round light, cut at some angle: of those samples that lie there, twice."""
    for start in np.arange(HALVES) / HALVES:
        there = 2.0 * ((path.v - start) % 1 < 0.5)
        yield path, RIGHT.radiance(seen_as(path.beams, path.beams.seen * there))


def _wider(half: float, times: float) -> float:
    """How many times as large the projected disk of another angle is; 0 where that is beyond the horizon."""
    return (math.sin(half * times) / math.sin(half)) ** 2 if half * times < math.pi / 2 else 0.0


HALVES = 16
"""Angles at which a round light is cut in half."""
LAMPS = (light_scale, each_light, grey_lights)
POINTS = (light_points, round_lights)
"""They need shadow rays of their own."""
