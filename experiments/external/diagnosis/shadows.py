"""Mistakes of what blocks, and of where shadow rays begin and end."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from nusselt.renderer.vectors import Bools, Floats
from nusselt.renderer.visibility.segments import Blockers

from .beams import RIGHT, Beams, seen_as
from .case import Case, Guess
from .objects import bodies
from .probe import Paths
from .transport import ALONE, changed, groups, said

SHORT = (0.999, 0.99, 0.97, 0.95, 0.9, 0.5)
"""Shares of the way that shadow rays go."""
BEYOND = (0.001, 0.01)
"""Shares of the way that they go on behind the light."""
GAPS = (0.003, 0.01, 0.02, 0.05, 0.1, 0.2)
"""Lengths after which they begin."""
LATE = (0.01, 0.05, 0.1)
"""Shares of the way after which they begin."""
CULLED = 4000
"""Triangles of a scene in which they are tried with one side, at most."""
PATTERNS = 64
"""Sets of triangles that points see from their front, at most."""


def no_shadows(case: Case) -> Iterator[Guess]:
    """No shadow rays; a share of what is blocked that arrives."""
    for words, paths in groups(case.probe.paths, len(case.probe.paths)):
        bare = [(path, RIGHT.radiance(path.unshadowed)) for path in paths]
        guess = changed(case, "no-shadows", "nothing casts a shadow" + words, bare)
        yield guess
        step = guess.prediction - case.truth
        if len(paths) == len(case.probe.paths) and step.any():
            (share,) = case.combined(step[None], case.truth, case.shaded)
            if 0.003 < share < 0.97:
                told = f"{share:.1%} of what is blocked arrives"
                yield Guess("shadows-leak", case.truth + share * step, told, 1, share**2 * np.asarray(guess.error))


LIKE = 0.25
"""Relative difference of the noise that lost samples should leave from what there is."""
MORE = 1.1
"""Times the noise of the samples that are kept, at least."""
KEPT = 0.99
NOISIER, ALIKE = 5.0, 0.4
"""Times the usual noise that rays lost together leave, at least; and the correlation of neighbours, at most."""


def lost_samples(case: Case) -> Iterator[Guess]:
    """Samples lost by rounding where shadow rays begin or end, or by roulette.

    Which are lost hangs on a program's order of operations, and is as good as chance. What tells their share from a
    plain factor is noise: each sample x is there with probability p, and varies by p (1 - p) x^2 more.
    """
    seen = case.probe.sight.emission
    lit = case.truth - seen
    wide = [path for path in case.probe.paths if path.light.has_extent]
    if not wide or not case.shaded.any():
        return
    (kept,) = case.combined(lit[None], seen, case.shaded)
    if not 0.01 < kept < KEPT:
        return
    squares = np.zeros_like(case.truth)
    for path in wide:
        mean = [(value**2).mean(axis=1) for value in RIGHT.samples(path.beams)]
        squares[:, case.probe.sight.lit] += np.stack(mean) / case.probe.samples
    shaded = case.shaded
    usual = float(case.probe.variance[:, shaded].mean()) * kept**2
    expected = usual + kept * (1 - kept) * float(squares[:, shaded].mean())
    if len(case.images) > 1:
        noise = float(case.variance[shaded].mean()) * len(case.images)
    else:
        noise = float(((case.observed - seen - kept * lit)[:, shaded] ** 2).mean())
    by_chance = noise > MORE * usual and abs(noise / expected - 1) < LIKE
    by_itself = len(case.images) > 1 or _uneven(case, case.observed - seen - kept * lit)  # one image's may be a shape
    if (by_chance or noise > NOISIER * usual) and by_itself:
        told = f"{1 - kept:.1%} of the samples are lost, as by chance: rays without a gap, roulette without weight"
        more = (noise - usual) / (expected - usual) * kept * (1 - kept) * squares.mean(axis=0)
        yield Guess("lost-samples", seen + kept * lit, told, 1, noise=more)


def _uneven(case: Case, left: Floats) -> bool:
    """Whether a difference is alike at no neighbours."""
    grid = case.probe.grid(np.where(case.shaded, left.mean(axis=0), 0.0))
    along = float((grid[1:] * grid[:-1]).sum() + (grid[:, 1:] * grid[:, :-1]).sum()) / 2
    return along < ALIKE * float((grid * grid).sum())


def hard_shadows(case: Case) -> Iterator[Guess]:
    """Shadow rays to the centre; one ray's answer for all; the mean of what is seen times the mean of the light."""
    wide = [path for path in case.probe.paths if path.light.has_extent]
    if not wide:
        return
    ways: dict[str, tuple[str, Callable[[Paths], Beams]]] = {
        "shadow rays go to the light's centre": ("hard-shadows", _centre),
        "the first sample's shadow ray serves all samples": ("hard-shadows", _first),
        "mean visibility times mean light": ("visibility-apart", _mean),
    }
    for told, (name, way) in ways.items():
        yield changed(case, name, told, [(path, RIGHT.radiance(way(path))) for path in wide])


def _centre(path: Paths) -> Beams:
    middle = np.full((1, 1), 0.5) if path.light.parallelogram() is not None else np.zeros((1, 1))
    return seen_as(path.beams, path.through(middle, middle).seen)


def _first(path: Paths) -> Beams:
    each = path.u.shape[1] // path.passes
    seen = path.beams.seen.reshape(-1, path.passes, each)[:, :, :1]
    return seen_as(path.beams, np.broadcast_to(seen, (seen.shape[0], path.passes, each)).reshape(path.u.shape))


def _mean(path: Paths) -> Beams:
    return seen_as(path.beams, path.beams.seen.mean(axis=1, keepdims=True))


def ends(case: Case) -> Iterator[Guess]:
    """Shadow rays that end before the light, or never; that begin late, or off the surface."""
    near = [path for path in case.probe.paths if not path.light.at_infinity]
    for share in SHORT:
        told = f"shadow rays end {1 - share:.2g} of the way before the light"
        yield changed(case, "short-shadow-rays", told, [(p, _again(p, p.beams.d * share)) for p in near])
    for more in BEYOND:
        told = f"shadow rays go on {more:g} of the way behind the light: what is there blocks"
        parts = [(p, _again(p, p.beams.d * (1 + more), False, p.everything)) for p in near]
        yield changed(case, "endless-shadow-rays", told, parts)
    told = "shadow rays do not end at the light: what is behind it blocks"
    yield changed(case, "endless-shadow-rays", told, [(p, _again(p, p.beams.d, True, p.everything)) for p in near])
    for gap in GAPS:
        yield _late(case, gap, f"shadow rays begin {gap:g} late", along=True)
        yield _late(case, gap, f"shadow rays begin {gap:g} above the surface", along=False)
    for share in LATE:
        for kept, words in ((1 - share, ""), (1 - 2 * share, " and end as early")):
            told = f"shadow rays begin {share:g} of the way late{words}"
            parts = [(p, _shifted(p, p.beams.d * share, kept)) for p in near]
            yield changed(case, "shadow-epsilon", told, parts)


def _again(path: Paths, d: Floats, endless: bool = False, blockers: Blockers | None = None) -> Floats:
    every = np.arange(path.sight.points.count)
    return RIGHT.radiance(seen_as(path.beams, path.visible(every, d, endless or path.light.at_infinity, blockers)))


def _late(case: Case, gap: float, told: str, along: bool) -> Guess:
    parts = []
    for path in case.probe.paths:
        b = path.beams
        if along:
            length = b.r if not path.light.at_infinity else np.full_like(b.r, np.inf)
            parts.append((path, _shifted(path, b.d / b.r * gap, np.maximum(1 - gap / length, 1e-9))))
        else:
            parts.append((path, _shifted(path, np.repeat(b.points.normal[:, :, None], b.r.shape[1], 2) * gap, 1.0)))
    return changed(case, "shadow-epsilon", told, parts)


def _shifted(path: Paths, step: Floats, share: Floats | float) -> Floats:
    """Rays that begin a step (3, n, k) on, and go this share of their way."""
    b = path.beams
    n, k = b.r.shape
    at = (b.points.position[:, :, None] + step).reshape(3, -1)
    d = (b.d * share).reshape(3, -1, 1)
    chosen = np.repeat(np.arange(n), k)
    seen = path.visible(chosen, d, path.light.at_infinity, path.everything, at)
    return RIGHT.radiance(seen_as(b, seen.reshape(n, k)))


def not_blocking(case: Case) -> Iterator[Guess]:
    """Things that are seen and cast no shadow."""
    geometry = case.probe.geometry
    every = Blockers.everything(geometry)
    light = geometry.light[geometry.triangle_surface] >= 0
    things: dict[str, tuple[Bools, Bools]] = {
        body.said + " casts no shadow": (~body.triangles, ~body.ellipsoids) for body in bodies(case.probe)
    }
    if geometry.ellipsoids and geometry.triangles > light.sum():
        things["spheres cast no shadows"] = (np.ones(geometry.triangles, bool), np.zeros(geometry.ellipsoids, bool))
        things["triangles cast no shadows"] = (light, np.ones(geometry.ellipsoids, bool))
    if light.any() and len(case.probe.paths) > 1:
        things["lights cast no shadows"] = (~light, np.ones(geometry.ellipsoids, bool))
    for told, (triangles, ellipsoids) in things.items():
        parts = []
        for path in case.probe.paths:
            own, mine = (
                geometry.light[of] == path.source.index
                for of in (geometry.triangle_surface, geometry.ellipsoid_surface)
            )
            bodies_left = every.ellipsoids[ellipsoids & ~mine]
            stand = Blockers(geometry, every.triangles[triangles & ~own], bodies_left, every.disks[:0])
            parts.append((path, _again(path, path.beams.d, False, stand)))
        yield changed(case, "not-blocking", told, parts)
    if 0 < len(case.probe.paths) <= ALONE and geometry.triangles <= CULLED:
        yield from _culled(case, case.probe.paths[0])


def _culled(case: Case, path: Paths) -> Iterator[Guess]:
    """Triangles block from one side alone: a ray from a point meets a plane from the side that the point is on."""
    b, g = path.beams, path.geometry
    things = np.flatnonzero(g.light[g.triangle_surface] < 0)
    height = g.normal[:, things].T @ b.points.position - (g.normal * g.a).sum(axis=0)[things, None]
    if not things.size:
        return
    sides, of_point = np.unique(height > 0, axis=1, return_inverse=True)
    if sides.shape[1] > PATTERNS:
        return
    seen = np.empty(b.r.shape)
    for number, front in enumerate(sides.T):
        chosen = np.flatnonzero(of_point == number)
        stand = Blockers(g, things[front], path.everything.ellipsoids, things[:0])
        seen[chosen] = path.visible(chosen, b.d[:, chosen], path.light.at_infinity, stand)
    told = f"triangles cast no shadow from their back ({said(path)})"
    yield changed(case, "not-blocking", told, [(path, RIGHT.radiance(seen_as(b, seen)))])


SHADOWS = (no_shadows, hard_shadows, not_blocking)
