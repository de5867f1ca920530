"""All that is asked of one scene: its own sanity, its twins, the referees; what is found wrong."""

from __future__ import annotations

import time
import traceback
import warnings
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Exact
from nusselt.renderer.scene import Scene

from .casters import unanimous
from .compare import compare
from .judge import Seen, Values, seen, values
from .referees import REFEREES, ask
from .twins import TWINS, Twin

ITSELF = "itself"
EXACT = Exact()
POINTS = 2
"""Random points of every scene that each referee is asked about, beside the brightest and a dark one."""
SUSPECTS = 2
"""Points on which a twin disagrees that they are asked about."""
FIRST, MOST = 4096, 1 << 16
"""Samples for those, and up to how many for suspects."""
SECONDS = 20.0
"""Processor time that one image may take."""


@dataclass(frozen=True)
class Fault:
    """Something wrong.

    Parameters
    ----------
    check : str
        The twin's or referee's name, or "itself".
    what : str
        In words.
    pixel : int
        Number of the worst point's pixel, row by row; -1 if it is none's.
    difference, ratio : float
        At it, relative to the unoccluded value, and to what is allowed.
    points : int
        How many disagree.
    """

    check: str
    what: str
    pixel: int = -1
    difference: float = 0.0
    ratio: float = np.inf
    points: int = 1


@dataclass
class Found:
    """Of one check in one scene: how many points were compared, how many disagree, and the worst of them."""

    points: int = 0
    wrong: int = 0
    unmatched: int = 0
    ratio: float = 0.0
    faults: list[Fault] = field(default_factory=list)


@dataclass
class Examined:
    """Of one scene."""

    checks: dict[str, Found] = field(default_factory=dict)
    seconds: float = 0.0
    means: int = 0
    sampled: bool = False

    @property
    def faults(self) -> list[Fault]:
        return [fault for found in self.checks.values() for fault in found.faults]


def stream(scene_seed: int, name: str) -> np.random.Generator:
    """Chance of its own for each check."""
    return np.random.default_rng(np.random.SeedSequence([scene_seed, zlib.crc32(name.encode())]))


def examine(
    scene: Scene,
    seed: int,
    twins: Sequence[Twin] = TWINS,
    referees: Sequence[str] = tuple(REFEREES),
    estimator: Any = EXACT,
    points: int = POINTS,
) -> Examined:
    """Everything about one scene; nothing is raised, whatever the renderer does."""
    result = Examined()
    suspects: list[int] = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one, mine = _itself(scene, estimator, result)
        if one is None or mine is None or not one.points.count:
            return result
        for twin in twins:
            result.checks[twin.name] = found = Found()
            suspects += _twin(twin, scene, one, mine, seed, estimator, found)
    for name in referees:
        result.checks[name] = found = Found()
        result.means += _referee(name, one, mine, stream(seed, name), points, suspects, found)
    return result


def _fail(check: str, error: Exception) -> Fault:
    place = traceback.extract_tb(error.__traceback__)[-1]
    file = "/".join(place.filename.split("/")[-2:])
    return Fault(check, f"{type(error).__name__}: {error} ({file}:{place.lineno})")


def _itself(scene: Scene, estimator: Any, result: Examined) -> tuple[Seen | None, Values | None]:
    """Its values: no exception, no warning, finite, not negative, not more than without blockers."""
    found, started = Found(), time.process_time()
    result.checks[ITSELF] = found
    try:
        one = seen(scene)
        mine = values(one, one.points, estimator)
    except Exception as error:  # whatever it is, it is a finding
        found.faults.append(_fail(ITSELF, error))
        return None, None
    result.seconds = time.process_time() - started
    if result.seconds > SECONDS:
        found.faults.append(Fault(ITSELF, f"takes {result.seconds:.0f} s"))
    found.points = one.points.count
    result.sampled = bool(np.isinf(mine.allowed).any())
    size = mine.size
    over = (mine.radiance - mine.unoccluded).max(axis=0, initial=-np.inf)
    allowed = mine.allowed.max(axis=0, initial=0)
    for what, excess in (
        ("negative", -mine.radiance.min(axis=0, initial=0)),
        ("more than nothing in the way would leave", over),
        ("not finite", np.where(np.isfinite(mine.radiance).all(axis=0), 0.0, np.inf)),
    ):
        wrong = np.flatnonzero(~(excess <= allowed))
        if wrong.size:
            worst = wrong[np.argmax(excess[wrong])]
            ratio = float(excess[worst] / max(allowed[worst], 1e-300))
            pixel = int(one.view.lit[worst])
            found.faults.append(Fault(ITSELF, what, pixel, float(excess[worst] / size[worst]), ratio, wrong.size))
            found.wrong += wrong.size
    return one, mine


def _twin(twin: Twin, scene: Scene, one: Seen, mine: Values, seed: int, estimator: Any, found: Found) -> list[int]:
    """Compare with one twin; the points on which they disagree, worst first."""
    try:
        copy = twin.make(scene, stream(seed, twin.name))
        compared = None if copy is None else compare(one, mine, copy, estimator)
        if compared is None:
            return []
    except InputError:  # no valid scene: rounded to nothing
        return []
    except Exception as error:  # whatever it is, it is a finding
        found.faults.append(_fail(twin.name, error))
        return []
    wrong = compared.wrong
    found.points, found.unmatched, found.wrong = compared.index.size, compared.unmatched, wrong.size
    found.ratio = float(compared.ratio.max(initial=0))
    if not wrong.size:
        return []
    wrong = wrong[np.argsort(-compared.difference[wrong], kind="stable")]
    point = compared.index[wrong[0]]
    ours, theirs = mine.radiance[:, point].max(), compared.theirs[:, wrong[0]].max()
    what = f"{ours:.9g} here, {theirs:.9g} there, {mine.unoccluded[:, point].max():.9g} unoccluded"
    difference, ratio = float(compared.difference[wrong[0]]), float(compared.ratio[wrong[0]])
    found.faults.append(Fault(twin.name, what, int(one.view.lit[point]), difference, ratio, wrong.size))
    return [int(k) for k in compared.index[wrong[:SUSPECTS]]]


def _asked(mine: Values, rng: np.random.Generator, count: int) -> Any:
    """Points for a referee: some by chance, the brightest, and one that gets nothing though the light faces it."""
    order = rng.permutation(mine.radiance.shape[1])
    bright = mine.radiance.max(axis=0)
    dark = order[(bright[order] == 0) & (mine.unoccluded[:, order].max(axis=0) > 0)]
    return np.unique(np.concatenate((order[:count], [np.argmax(bright)], dark[:1])))


def _referee(
    name: str, one: Seen, mine: Values, rng: np.random.Generator, count: int, suspects: list[int], found: Found
) -> int:
    """Ask a referee about some points; how many means that took."""
    some = _asked(mine, rng, count)
    worst = np.array(list(dict.fromkeys(suspects))[: 2 * SUSPECTS], dtype=np.int64)
    means = 0
    for index, samples in ((some, FIRST), (worst, MOST)):
        if not index.size:
            continue
        points = one.points.take(index)
        told = ask(name, one.scene, one.geometry, points, samples, rng)
        means += told.means
        with np.errstate(invalid="ignore"):
            off = np.abs(mine.radiance[:, index] - told.mean)
            allowed = told.width + mine.allowed[:, index]
        fair = unanimous(
            one.geometry, points, one.scene.lights, np.full(index.size, 1e-12 * np.abs(points.position).max())
        )
        wrong = np.flatnonzero((off > allowed).any(axis=0) & fair)
        found.points += index.size
        found.wrong += wrong.size
        found.ratio = max(found.ratio, float((off / np.maximum(allowed, 1e-300)).max(initial=0)))
        for k in wrong:
            c = int(np.argmax(off[:, k]))
            what = f"{mine.radiance[c, index[k]]:.9g}, right {told.mean[c, k]:.9g} +- {told.width[c, k]:.1e}"
            share = float(off[c, k] / mine.size[index[k]])
            ratio = float(off[c, k] / max(allowed[c, k], 1e-300))
            found.faults.append(Fault(name, what, int(one.view.lit[index[k]]), share, ratio, 1))
    return means
