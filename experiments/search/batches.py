"""Batches of random scenes as jobs: what each found, counted by check, and the first failure of each shrunk."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import Job, Outcome, Settings
from nusselt.experiments.scenes.catalogue import load
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .examine import Examined, Fault, examine, stream
from .generator import KINDS, random_scene
from .shrink import shrunk, told
from .twins import TWINS, Twin

SCENES, QUICK, TINY = "1000", "45", "boxes-1"
BATCH = 20
FEW = 4
"""Twins of most scenes; all of them for every tenth."""
TOLD = 3
"""Failures of a scene that are told, each of another check."""


def twins_of(seed: int, number: int) -> list[Twin]:
    """A few by chance, or all."""
    if number % 10 == 0:
        return list(TWINS)
    chosen = stream(seed, f"twins {number}").permutation(len(TWINS))[:FEW]
    return [TWINS[k] for k in sorted(chosen)]


def batch(kind: str, first: int, count: int, seed: int) -> Outcome:
    """Scenes ``first`` and on of a kind."""
    made = [random_scene(kind, number, seed) for number in range(first, first + count)]
    found = [(one.scene, one.number, twins_of(seed, one.number)) for one in made]
    return Outcome([_row(kind, first, seed, found)])


def one_scene(scene: Scene, kind: str, number: int, seed: int) -> Outcome:
    """A single one, with all twins."""
    return Outcome([_row(kind, number, seed, [(scene, number, list(TWINS))])])


def _row(kind: str, first: int, seed: int, scenes: list[tuple[Scene, int, list[Twin]]]) -> Row:
    """What a batch found; its first failure is shrunk."""
    started, checks, failures, small = time.process_time(), {}, [], []  # type: ignore[var-annotated]
    slowest, means, sampled = 0.0, 0, 0
    for scene, number, twins in scenes:
        result = examine(scene, number, twins)
        _count(checks, result)
        slowest, means, sampled = max(slowest, result.seconds), means + result.means, sampled + result.sampled
        faults = _worst(result)
        failures += [{"scene": scene.name, "number": number} | vars(fault) for fault in faults[:TOLD]]
        if faults and not small:
            small.append(_small(scene, number, faults[0], seed))
    points = sum(entry["points"] for entry in checks.values())
    wrong = sum(entry["disagree"] for entry in checks.values())
    return {
        "kind": kind,
        "first": first,
        "scenes": len(scenes),
        "failing_scenes": len({failure["scene"] for failure in failures}),
        "compared_points": points,
        "disagree": wrong,
        "means": means,
        "sampled_scenes": sampled,
        "slowest_seconds": slowest,
        "seconds": time.process_time() - started,
        "checks": checks,
        "failures": failures,
        "small": small,
        "as_claimed": not failures,
    }


def _count(checks: dict[str, Any], result: Examined) -> None:
    for name, found in result.checks.items():
        nothing = {"scenes": 0, "failing_scenes": 0, "points": 0, "disagree": 0, "unmatched": 0, "largest_ratio": 0.0}
        entry = checks.setdefault(name, nothing)
        entry["scenes"] += 1
        entry["failing_scenes"] += bool(found.faults)
        entry["points"] += found.points
        entry["disagree"] += found.wrong
        entry["unmatched"] += found.unmatched
        entry["largest_ratio"] = max(entry["largest_ratio"], found.ratio)


def _worst(result: Examined) -> list[Fault]:
    """The worst of each check, those without a place first."""
    order = sorted(result.faults, key=lambda fault: (fault.pixel >= 0, -fault.difference))
    return list({fault.check: fault for fault in reversed(order)}.values())[::-1]


def _small(scene: Scene, number: int, fault: Fault, seed: int) -> Row:
    """The file of a failing scene, shrunk."""
    less, left = shrunk(scene, fault, number)
    words = f"from: nusselt run random-scenes --scenes {scene.name} --seed {seed}"
    name = f"{scene.name}-{fault.check.replace(' ', '-')}-seed-{seed}.test"
    return {"name": name, "text": told(less, [left], words)}


def asked(words: Iterable[str], seed: int) -> tuple[int, list[Job]]:
    """How many scenes are to be made, and jobs for those that are named: KIND-NUMBER, or a file."""
    count, jobs = 0, []
    for word in words:
        kind, _, number = word.rpartition("-")
        if word.isdigit():
            count += int(word)
        elif kind in KINDS and number.isdigit():
            scene = random_scene(kind, int(number), seed).scene
            jobs.append(Job(one_scene, {"scene": scene, "kind": kind, "number": int(number), "seed": seed}))
        else:
            scene = load(word)
            if Path(word).exists() and "two-sided" in Path(word).read_text(encoding="utf-8"):
                scene = scene.with_(two_sided=True)
            jobs.append(Job(one_scene, {"scene": scene, "kind": "file", "number": 0, "seed": seed}))
    return count, jobs


def search_jobs(settings: Settings) -> list[Job]:
    """So many scenes, of every kind alike; or those that are named."""
    count, jobs = asked(settings.scenes or (settings.pick(SCENES, QUICK, TINY),), settings.seed)
    if not count and not jobs:
        raise InputError("scenes", "0", "how many, KIND-NUMBER or a scene file")
    each = -(-count // len(KINDS))
    for first in range(0, each, BATCH):
        size = min(BATCH, each - first)
        jobs += [Job(batch, {"kind": kind, "first": first, "count": size, "seed": settings.seed}) for kind in KINDS]
    return jobs
