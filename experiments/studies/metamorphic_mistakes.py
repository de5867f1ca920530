"""Mistakes of the independent renderer, found without a reference; and right renderers, of which no relation breaks."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Group

from nusselt.experiments.independent.mistakes import KINDS, MISTAKES
from nusselt.experiments.independent.plain_scenes import PLAIN
from nusselt.experiments.independent.render import Options, render
from nusselt.experiments.independent.steps import RIGHT, Steps
from nusselt.experiments.metamorphic.ask import Asking, ask
from nusselt.experiments.metamorphic.judge import judge_relation
from nusselt.experiments.metamorphic.relation import Related, Shot
from nusselt.experiments.metamorphic.sources import EstimatorSource, Source
from nusselt.experiments.results import study_tables
from nusselt.experiments.results.figures import BLUE, canvas
from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import write_scene
from nusselt.renderer.vectors import Floats

from .brought_images import scene_named
from .planted_images import rule_of

WIDTH = 24
BESIDE = "beside a right image"
"""The same images judged against a right renderer's: whether the mistake is there to be found."""


@dataclass(frozen=True)
class IndependentSource:
    """The independent renderer, by these steps; it knows no triangle lights."""

    steps: Steps = RIGHT
    name: str = "independent"
    rounding: float = 2e-6
    knows: tuple[str, ...] = ("quad", "seed")

    def claim(self, scene: Scene) -> str:
        return "unbiased"

    def image(self, shot: Shot, seed: int) -> Floats:
        scene = shot.scene
        options = Options(scene.light_samples * shot.more, scene.stratify, scene.spp > 1, seed=seed + shot.step)
        return render(write_scene(scene), scene.width, options, self.steps).transpose(2, 0, 1)


def _scene(name: str, strata: bool, width: int, rule: str | None) -> Scene:
    scene = scene_named(name, width, rule)
    return scene.with_(stratify=strata, light_samples=16)


def plant(number: int, width: int, seed: int) -> Outcome:
    """One mistake, by its place: which relations it breaks."""
    mistake, started = MISTAKES[number], time.process_time()
    scene = _scene(mistake.scene, mistake.strata, width, "area" if mistake.pixels != "centres" else rule_of(mistake))
    source, asking = IndependentSource(mistake.steps), Asking(seed=seed)
    with np.errstate(all="ignore"):  # mistakes divide by what they like
        rows = ask([scene], source, asking)
        beside = _beside_right(scene, source, asking)
    verdicts = {row["method"]: row["verdict"] for row in rows if "verdict" in row}
    broken = "differs" in verdicts.values()
    row: Row = {
        "planted": mistake.name,
        "kind": next(kind for kind, every in KINDS.items() if mistake in every),
        "what": mistake.says,
        "scene": mistake.scene,
        "hook": mistake.hook,
        "checks": verdicts | {BESIDE: beside},
        "verdict": "differs" if broken else "agrees",
        "as_claimed": True,  # nobody claims that all are found: the table counts them
        "seconds": time.process_time() - started,
    }
    return Outcome([row])


def _beside_right(scene: Scene, source: Source, asking: Asking) -> str:
    related = Related(scene, (Shot(scene),), lambda images: (images[0], images[1]))
    seeds = range(asking.seed + 1, asking.seed + 1 + asking.runs)
    images = [[one.image(Shot(scene), seed) for one in (source, IndependentSource())] for seed in seeds]
    return judge_relation(related, images, Level(asking.alpha), asking.margin, source.rounding).word


def null(name: str, estimator: str | None, width: int, seed: int) -> Outcome:
    """A right renderer on one scene: ours by an estimator, or the independent one. None of its relations may break."""
    started = time.process_time()
    source: Source = EstimatorSource(estimator) if estimator else IndependentSource()
    rows = ask([_scene(name, True, width, None)], source, Asking(seed=seed))
    verdicts = {row["method"]: row["verdict"] for row in rows if "verdict" in row}
    wrong = [name for name, word in verdicts.items() if word == "differs"]
    row: Row = {
        "case": f"right: {source.name}",
        "scene": name,
        "checks": verdicts,
        "hits": len(wrong),
        "reason": ", ".join(wrong),
        "as_claimed": not wrong,
        "seconds": time.process_time() - started,
    }
    return Outcome([row])


def jobs(settings: Settings) -> list[Job]:
    """Every mistake, and every plain scene by two right renderers; every eighth where it must be quick."""
    step, width = settings.pick((1, WIDTH), (8, WIDTH), (300, 8))
    seed = settings.seed_of("metamorphic-mistakes") % 2**31
    scenes = list(PLAIN)[::step]
    rights = [
        Job(null, {"name": name, "estimator": kind, "width": width, "seed": seed})
        for kind in (None, "area")
        for name in scenes
    ]
    return [*rights, *(Job(plant, {"number": k, "width": width, "seed": seed}) for k in range(0, len(MISTAKES), step))]


def _counts(rows: Sequence[Row]) -> Counter[str]:
    """How many mistakes each relation finds, of those that change the image."""
    there = [row for row in rows if row.get("planted") and row["checks"][BESIDE] == "differs"]
    return Counter(
        name for row in there for name, word in row["checks"].items() if word == "differs" and name != BESIDE
    )


def table(rows: Sequence[Row], width: int) -> Group:
    """How many each relation finds; in the caption, how many all of them do, and of right renderers how many break."""
    planted = [row for row in rows if row.get("planted")]
    there = [row for row in planted if row["checks"][BESIDE] == "differs"]
    found = sum(row["verdict"] == "differs" for row in there)
    rights = [row for row in rows if row.get("case")]
    tried, broken = sum(len(row["checks"]) for row in rights), sum(row["hits"] for row in rights)
    missed = ", ".join(row["planted"] for row in there if row["verdict"] != "differs")
    more = sum(row["verdict"] == "differs" for row in planted) - found
    title = f"{found} of {len(there)} mistakes that change an image are found without a reference"
    caption = (
        f"{more} more are found that images of the same size beside right ones do not show. Of right renderers "
        f"{broken} of {tried} relations break. Not found: {missed}."
    )
    alone = Counter(
        names[0]
        for row in there
        if len(names := [n for n, word in row["checks"].items() if word == "differs" and n != BESIDE]) == 1
    )
    lines = [{"relation": n, "finds": k, "alone": alone[n] or None} for n, k in _counts(rows).most_common()]
    return study_tables.table(lines, title, width, caption=caption)


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """How many each relation finds."""
    counts = _counts([row for outcome in outcomes for row in outcome.rows]).most_common()
    figure = canvas(8, 0.25 * len(counts) + 1.2)
    axis = figure.subplots()
    axis.barh([name for name, _ in counts], [number for _, number in counts], color=BLUE)
    axis.set_title("Mistakes found by each relation", fontsize=10)
    axis.tick_params(labelsize=7)
    return {"relations": figure}


METAMORPHIC_MISTAKES = Experiment(
    "metamorphic-mistakes",
    "mistakes of an independent renderer, found by what right images keep, without a reference",
    jobs,
    figures,
    table=table,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(METAMORPHIC_MISTAKES)
