"""The harness's own test: every planted defect must `differ`, every control must `agree`.

A defect is looked at again with twice the samples until it is found, at a level that shares the report's
false-alarm rate over the looks. Beside the verdict stand two usual gates, at the same samples.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from concurrent.futures import Executor
from functools import lru_cache
from typing import Any

from rich.console import Group

from nusselt.experiments.check.check import MAX_SAMPLES, our_image, reference_target, seeds
from nusselt.experiments.check.expectations import appearance, expectations_of
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.rows import as_claimed, judged
from nusselt.experiments.defects.catalogue import CONTROLS, DEFECTS, Control, Planted
from nusselt.experiments.defects.gates import pictures_differ, pixels_differ, structure_differs
from nusselt.experiments.results.figures import GOLD, GREEN, RED, canvas
from nusselt.experiments.results.schema import PICTURES, Row
from nusselt.experiments.results.study_tables import table
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.verdict.evidence import NO_EXPECTATIONS, Expectations
from nusselt.experiments.verdict.judge import Verdict, judge
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.verdict.pooling import combine_images
from nusselt.experiments.verdict.rules.normality import PASSES
from nusselt.mitsuba_bridge.reference import Reference, render_reference
from nusselt.mitsuba_bridge.tolerance import ray_tolerance
from nusselt.renderer.image import Image, render
from nusselt.renderer.scene import Scene

FIRST = 4
"""Passes of the first look."""
FEW = 4
"""Samples of a pass of a defect: so few that what is easy to see is found by few."""
LOOKS = 10
TIMEOUT = 300.0
"""Seconds for one reference."""


class Truths:
    """References and expectations, made once for each scene."""

    def __init__(self, seed: int, timeout: float) -> None:
        self.seed, self.timeout = seed, timeout
        self._references: dict[tuple[str, float, str], Reference] = {}
        self._expectations: dict[str, Expectations] = {}

    def reference(self, scene: Scene, margin: float, run: str = "") -> Reference:
        """Of a scene, precise enough for a margin; ``run`` names another, independent one."""
        key = (scene.digest(), margin, run)
        if key not in self._references:
            question = Question(margin=margin)
            self._references[key] = render_reference(
                appearance(scene),
                seed=seeds(self.seed, *key[::2])[2],
                target_relative_se=reference_target(question, 2),
                max_samples=MAX_SAMPLES,
                timeout=self.timeout,
            )
        return self._references[key]

    def expectations(self, scene: Scene, estimator: Any) -> Expectations:
        """What the variance of area sampling must be, and where Mitsuba's own offset shows."""
        key = f"{scene.digest()} {estimator.name} {estimator.samples} {estimator.stratified}"
        if key not in self._expectations:
            first = seeds(self.seed, key)[0]
            self._expectations[key] = expectations_of(scene, estimator, first, self.timeout, None)
        return self._expectations[key]


def find(planted: Planted, truths: Truths, level: Level, seed: int, executor: Executor | None = None) -> Row:
    """One row: looks at a defect until it is found."""
    started = time.perf_counter()
    scene = planted.scene()
    estimator = dataclasses.replace(planted.estimator, samples=FEW)
    reference = truths.reference(planted.convert(scene), planted.margin)
    expectations = truths.expectations(scene, estimator)
    parts: list[Image] = []
    for look in range(1, LOOKS + 1):
        passes = FIRST if look == 1 else FIRST * 2 ** (look - 2)
        root = seeds(seed, planted.name, str(look))[1]
        options: dict[str, Any] = {"seed": root, "passes": passes, "tolerance": ray_tolerance(scene)}
        parts.append(planted.render(scene, estimator, executor=executor, **options))
        ours = combine_images(parts)
        total = ours.pass_means.size
        share = level.at_time(total / FIRST)
        verdict = judge(ours, reference, passes=total, margin=planted.margin, level=share, expectations=expectations)
        if verdict.word == "differs" or total == look == 1:
            break
    return _row(scene, estimator, planted.margin, verdict, ours, reference) | {
        "defect": planted.name,
        "samples_to_detection": estimator.samples * total if verdict.word == "differs" else None,
        "as_claimed": verdict.word == "differs",
        "seconds": time.perf_counter() - started,
    }


def hold(control: Control, truths: Truths, level: Level, seed: int, executor: Executor | None = None) -> Row:
    """One row: a right renderer against another."""
    started = time.perf_counter()
    scene = control.scene()
    question = Question(margin=control.margin, seed=seed)
    expectations = NO_EXPECTATIONS
    if control.estimator is None:
        ours = truths.reference(scene, control.margin, "again").as_image()
    else:
        ours, _, _ = our_image(scene, control.estimator, question, executor, None)
        expectations = truths.expectations(scene, control.estimator)
    if control.against is None:
        reference = truths.reference(scene, control.margin)
    else:
        other = dataclasses.replace(question, seed=seed + 1)
        truth = _truth(scene, control.against, other, executor)
        reference = Reference.of_image(truth, f"ours, {control.against.name}", 1)
    passes = ours.pass_means.size
    verdict = judge(ours, reference, passes=passes, margin=control.margin, level=level, expectations=expectations)
    return _row(scene, control.estimator, control.margin, verdict, ours, reference) | {
        "defect": None,
        "samples_to_detection": None,
        "as_claimed": as_claimed("unbiased", verdict.word, broken=False),
        "seconds": time.perf_counter() - started,
    }


def _truth(scene: Scene, estimator: Any, question: Question, executor: Executor | None) -> Image:
    """Our image with as many passes as a reference has."""
    image, passes, _ = our_image(scene, estimator, question, executor, None)
    if not 1 < passes < PASSES:
        return image
    root = seeds(question.seed, scene.name, estimator.name)[2]
    return render(scene, estimator, seed=root, passes=PASSES, executor=executor, tolerance=ray_tolerance(scene))


GATES = {"picture_differs": "PNG", "structure_differs": "SSIM", "pixels_differ": "z-test"}
"""What the usual gates say, in a row, and what they are called."""


def _row(scene: Scene, estimator: Any, margin: float, verdict: Verdict, ours: Image, reference: Reference) -> Row:
    passes = ours.pass_means.size
    samples = estimator.samples if estimator else reference.samples
    return {
        "scene": scene.name,
        "estimator": estimator.name if estimator else "Mitsuba",
        "method": f"{estimator.name if estimator else 'Mitsuba'} against {reference.renderer}",
        "samples": samples,
        "passes": passes,
        "margin": margin,
        "verdict": verdict.word,
        **{name: value for name, value in judged(verdict).items() if name not in PICTURES},
        "picture_differs": pictures_differ(ours, reference),
        "structure_differs": structure_differs(ours, reference),
        "pixels_differ": pixels_differ(ours, reference, samples, passes),
        "reference": {"renderer": reference.renderer, "version": reference.version, "samples": reference.samples},
    }


@lru_cache(maxsize=2)
def _truths(seed: int) -> Truths:
    """Shared by the jobs that one process does."""
    return Truths(seed, TIMEOUT)


def find_job(number: int, rows: int, seed: int) -> Outcome:
    """One defect, by its place in the catalogue, among so many rows."""
    return Outcome([find(DEFECTS[number], _truths(seed), Level(rows=rows), seed)])


def hold_job(number: int, rows: int, seed: int) -> Outcome:
    """One control, by its place in the catalogue, among so many rows."""
    return Outcome([hold(CONTROLS[number], _truths(seed), Level(rows=rows), seed)])


def jobs(settings: Settings) -> list[Job]:
    """Every defect, and every control; two of them where it must be quick."""
    defects, controls = settings.pick((len(DEFECTS), len(CONTROLS)), (len(DEFECTS), 2), (1, 1))
    told = {"rows": defects + controls, "seed": settings.seed}
    wrong = [Job(find_job, {"number": number, **told}, alone=True) for number in range(defects)]
    return wrong + [Job(hold_job, {"number": number, **told}, alone=True) for number in range(controls)]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """How large each defect's bias is, and which gates see it."""
    rows = [outcome.rows[0] for outcome in outcomes if outcome.rows[0]["defect"] is not None]
    rows = sorted(rows, key=lambda row: abs(row["bias_relative"]))
    figure = canvas(8, 0.26 * len(rows) + 1.2)
    axis = figure.subplots()
    for place, row in enumerate(rows):
        seen = [row[name] for name in GATES]
        colour = GREEN if all(seen) else GOLD if any(seen) else RED
        axis.barh(place, max(abs(row["bias_relative"]), 1e-6), left=0, color=colour)
    axis.set_yticks(range(len(rows)), [f"{row['defect']} ({row['scene']})" for row in rows], fontsize=7)
    axis.set_xscale("log")
    axis.set_xlabel("relative bias of the mean; red: no usual gate sees it, gold: some do, green: all do")
    axis.set_title("Planted defects: area 4 stratified, in passes until found", fontsize=10)
    return {"defects": figure}


def hardness_table(rows: Sequence[dict[str, Any]], width: int) -> Group:
    """Defects, the hardest to see first, and what the usual gates say of them."""
    controls = [row for row in rows if row["defect"] is None]
    right = sum(row["verdict"] == "agrees" for row in controls)
    caption = (
        f"{right} of {len(controls)} right renderers agree. "
        "samples: a pixel and light, until it is found. PNG: 8-bit pictures that differ by more than a level "
        "on average. SSIM: below 0.95, which right images are too at few samples. "
        "z-test: pixel by pixel, forgiving 0.25 %, at the same samples."
    )
    planted = [row for row in rows if row["defect"] is not None]
    planted.sort(key=lambda row: (-(row["samples_to_detection"] or 1 << 40), abs(row["bias_relative"] or 0)))
    lines: list[Row] = [
        {
            **{name: row[name] for name in ("defect", "scene", "verdict")},
            "samples": row["samples_to_detection"] or "not found",
            "bias %": f"{100 * row['bias_relative']:+.3f}",
            "margin %": f"{100 * row['margin']:g}",
            **{head: "sees it" if row[name] else "misses it" for name, head in GATES.items()},
        }
        for row in planted
    ]
    return table(lines, "Planted defects, the hardest to see first", width, caption=caption)


PLANTED_DEFECTS = Experiment(
    "planted-defects",
    "thirty wrong renderers that must differ, and right ones that must agree",
    jobs,
    figures,
    table=hardness_table,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(PLANTED_DEFECTS)
