"""Public bugs, planted: what the usual gates say of their images, and what we say."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from rich.console import Group

from nusselt.experiments.check.question import Question
from nusselt.experiments.defects.gates import changed, perceived, pictures_differ, pixels_differ, structure_differs
from nusselt.experiments.defects.museum import MUSEUM, Exhibit
from nusselt.experiments.external.comparison import Comparison
from nusselt.experiments.independent.mistakes import Mistake
from nusselt.experiments.independent.steps import RIGHT
from nusselt.experiments.results import study_tables
from nusselt.experiments.results.exports.markdown import table_lines
from nusselt.experiments.results.figures import GREEN, RED, canvas
from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.verdict.level import Level

from .brought_images import brought, scene_named
from .planted_images import MARGIN, images_of, rule_of
from .written_images import FORMAT

GATES = {
    "picture_differs": "PNG",
    "pixels_differ": "z-test",
    "structure_differs": "SSIM",
    "perceived": "FLIP",
    "pixels_changed": "changed",
}
"""By their names in a row, and in the table."""
SAMPLES, PASSES = 64, 4


def show(number: int, width: int, seed: int) -> Outcome:
    """One exhibit, by its place."""
    exhibit, started = MUSEUM[number], time.process_time()
    wrong, right = (_judged(exhibit.mistake, steps, width, seed) for steps in (exhibit.mistake.steps, RIGHT))
    told = wrong.row
    row: Row = {
        "planted": exhibit.mistake.name,
        "thread": exhibit.source,
        "what": exhibit.mistake.says,
        "scene": exhibit.mistake.scene,
        "samples": SAMPLES,
        "margin": MARGIN,
        "verdict": told["verdict"],
        "reason": told["reason"],
        "noise_word": told["noise_word"],
        "bias_relative": told["bias_relative"],
        **_gates(wrong),
        "gates_of_right": _gates(right) | {"verdict": right.row["verdict"]},
        "likely_mistakes": told["likely_mistakes"],
        "where": told["where"],
        "named": _named(exhibit, told),
        "as_claimed": right.row["verdict"] != "differs",  # nobody claims that all are found: the table counts them
        "seconds": time.process_time() - started,
    }
    return Outcome([row])


def _judged(mistake: Mistake, steps: Any, width: int, seed: int) -> Comparison:
    """Images by these steps, of which mistakes are looked for where they are wrong."""
    rule = rule_of(mistake)
    level = Level(rows=2 * len(MUSEUM))
    question = Question(
        estimator="area", samples=SAMPLES, stratified=mistake.strata, margin=MARGIN, pixel_rule=rule, level=level
    )
    images = list(images_of(mistake, steps, width, range(seed, seed + PASSES), SAMPLES))
    return brought(scene_named(mistake.scene, width, rule), images, question, FORMAT["EXR"], steps is not RIGHT)


def _gates(found: Comparison) -> dict[str, bool | None]:
    """What they say; noise is known to them, as two images' own would not be."""
    ours, reference = replace(found.sides.image, variance=found.sides.deviation**2), found.sides.reference
    return {
        "picture_differs": pictures_differ(ours, reference),
        "pixels_differ": pixels_differ(ours, reference, SAMPLES, found.sides.images),
        "structure_differs": structure_differs(ours, reference),
        "perceived": perceived(ours, reference),
        "pixels_changed": changed(ours, reference),
    }


def _named(exhibit: Exhibit, told: Row) -> str:
    """Whether the first name is right, wrong, or none is told; where it is none, a place may be."""
    first = next((one["name"] for one in told["likely_mistakes"]), None)
    if first is None:
        return "place" if told["where"] else "none"
    return "name" if first in exhibit.names else "wrong"


def jobs(settings: Settings) -> list[Job]:
    """Every exhibit; every fifth where it must be quick."""
    every = range(len(MUSEUM))
    numbers, width = settings.pick((every, 48), (every[::5], 48), ((0, 8), 24))
    seed = settings.seed_of("museum") % 2**31
    return [Job(show, {"number": number, "width": width, "seed": seed}) for number in numbers]


def cells(row: Row) -> list[str]:
    """A row of the table, as words."""
    gates = [_gate(row, name) for name in GATES]
    names = " or ".join(one["name"] for one in row["likely_mistakes"]) or "; ".join(row["where"][:1])
    if row["named"] == "wrong":
        names = f"(wrong) {names}"
    noise = f", {row['noise_word']}" if row["noise_word"] in ("noisier", "quieter", "alike") else ""
    return [f"{row['planted']}: {row['what']}", row["thread"], *gates, row["verdict"] + noise, names]


def _gate(row: Row, name: str) -> str:
    if row[name] is None:
        return "not there"
    if row["gates_of_right"][name]:
        return "fails, a right image too" if row[name] else "fails a right image alone"
    return "fails" if row[name] else "passes"


def _tells(row: Row, name: str) -> bool:
    """Whether a gate tells the wrong image from the right one."""
    return bool(row[name] and not row["gates_of_right"][name])


HEADS = ("bug", "source", *GATES.values(), "verdict", "name or place")


def summary(rows: Sequence[Row]) -> str:
    """How many each gate tells from right images, and how many we do."""
    counts = [f"{head} {sum(_tells(row, name) for row in rows)}" for name, head in GATES.items()]
    ours = sum(row["verdict"] == "differs" and row["gates_of_right"]["verdict"] != "differs" for row in rows)
    told = [row["named"] for row in rows]
    return (
        f"Of {len(rows)} bugs these tell the wrong image from the right one of the same seeds: {', '.join(counts)}; "
        f"our verdict {ours}. The right name is told of {told.count('name')}, a place without a name of "
        f"{told.count('place')}, a wrong name of {told.count('wrong')}, nothing of {told.count('none')}. PNG: 8-bit "
        "pictures that differ by more than a level on average. z-test: pixel by pixel, forgiving 0.25 %. SSIM: below "
        "0.95. FLIP: a mean above 0.05, at 67 pixels a degree, if flip-evaluator is there. Changed: more than 1 % of "
        f"the pixels by more than 4 levels. Each against the exact image, with {SAMPLES} samples a light."
    )


def table(rows: Sequence[Row], width: int) -> Group:
    """For the terminal."""
    lines = [dict(zip(HEADS, cells(row), strict=True)) for row in rows]
    return study_tables.table(lines, "Public bugs, planted", width, caption=summary(rows))


def page(rows: Sequence[Row]) -> str:
    """As Markdown."""
    lines = table_lines(HEADS, ([word.replace("|", "/") for word in cells(row)] for row in rows))
    head = ["# Museum: public bugs, planted", "", "Made by `nusselt run museum`.", "", summary(rows), ""]
    return "\n".join([*head, *lines, ""])


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """How many bugs each gate tells from right images."""
    rows = [outcome.rows[0] for outcome in outcomes]
    names = [*GATES.values(), "verdict"]
    counts = [sum(_tells(row, name) for row in rows) for name in GATES]
    counts.append(sum(row["verdict"] == "differs" for row in rows))
    figure = canvas(6, 2.4)
    axis = figure.subplots()
    axis.barh(names, counts, color=[RED] * len(GATES) + [GREEN])
    axis.set_xlim(0, len(rows))
    axis.set_title(f"Of {len(rows)} public bugs, told from right images", fontsize=10)
    return {"museum": figure}


MUSEUM_STUDY = Experiment(
    "museum",
    "bugs that public renderers had, planted: what the usual gates say of them, and what we say",
    jobs,
    figures,
    table=table,
    text=page,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(MUSEUM_STUDY)
