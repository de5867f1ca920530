"""Mistakes planted in 8-bit images, and what they are told as."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from rich.console import Group

from nusselt.experiments.defects.mistakes import PLANTS, Levels, planted_scene
from nusselt.experiments.external.diagnosis import Inputs, diagnose
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.transfer import Quantiser, Transfer
from nusselt.experiments.results import study_tables
from nusselt.experiments.results.figures import BLUE, RED, canvas
from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.renderer.scene import Scene

from .brought_images import truth_of

COURSE = Quantiser(255, Transfer("linear"), "truncate")


def inputs(scene: Scene, levels: Levels) -> Inputs:
    """One image, and the truth that it is compared with."""
    return Inputs.against([Raw(levels)], COURSE, truth_of(scene))


def tell(number: int, width: int | None, seed: int) -> Outcome:
    """Plant one mistake, by its place, and see what it is told as; ``width`` in place of its scene's own."""
    plant = PLANTS[number]
    scene = planted_scene(plant, width)
    levels = plant.levels(scene, seed)
    started = time.perf_counter()
    told = diagnose(scene, inputs(scene, levels), scene.light_samples, scene.stratify)
    first = bool(told.mistakes) and told.mistakes[0].name == plant.name
    row: Row = {"planted": plant.name, "scene": plant.scene, "resolution": [scene.width, scene.height]}
    row |= {"samples": scene.light_samples, "told_first": first, "likely_mistakes": told.rows()}
    row |= {"where": [place.said for place in told.where], "seconds": time.perf_counter() - started}
    return Outcome([row | {"as_claimed": first}])


def jobs(settings: Settings) -> list[Job]:
    """Every mistake at the course's sizes; smaller where it must be quick."""
    width = settings.pick(None, 160, 48)
    numbers = settings.pick(range(len(PLANTS)), range(len(PLANTS)), range(1))
    return [Job(tell, {"number": number, "width": width, "seed": settings.seed + 1}) for number in numbers]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """How much of the difference the planted hypothesis explains, and the best other one."""
    rows = [outcome.rows[0] for outcome in outcomes]
    figure = canvas(8, 0.3 * len(rows) + 1.2)
    axis = figure.subplots()
    for place, row in enumerate(rows):
        for mistake in row["likely_mistakes"]:
            right = mistake["name"] == row["planted"]
            axis.plot(mistake["explained"], place, "o", color=BLUE if right else RED, ms=7 if right else 4)
    axis.set(xlim=(0, 1), xlabel="share of the difference beyond noise; blue: the planted mistake, red: others")
    axis.set_yticks(range(len(rows)), [f"{row['planted']} ({row['scene']})" for row in rows], fontsize=7)
    axis.set_title("Mistakes planted in 8-bit images, and what explains them", fontsize=10)
    return {"mistakes": figure}


def table(rows: Sequence[Row], width: int) -> Group:
    """The first two that each is told as."""
    first = sum(row["told_first"] for row in rows)
    lines = []
    for row in rows:
        told = [f"{m['name']} {m['explained']:.1%}" for m in row["likely_mistakes"]] + ["", ""]
        lines.append({"planted": row["planted"], "scene": row["scene"], "first": told[0], "second": told[1]})
    caption = f"{first} of {len(rows)} are told first"
    return study_tables.table(lines, "Planted in 8-bit images, and what they are told as", width, caption=caption)


PLANTED_MISTAKES = Experiment(
    "planted-mistakes", "fourteen mistakes in 8-bit images that must be told by their names", jobs, figures, table=table
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(PLANTED_MISTAKES)
