"""`nusselt test-estimator`: every trial, a verdict against the reference, and error against time."""

from __future__ import annotations

import sys
from typing import Any

import click
from rich import box
from rich.table import Table

from nusselt.experiments.check.check import check
from nusselt.experiments.check.estimators import imported_estimator
from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.conformance.scenes import DULL, shadow_scene
from nusselt.experiments.conformance.trials import PASSES, SAMPLES, TRIALS, Outcome, error_against_time, run_trial
from nusselt.experiments.console import console
from nusselt.experiments.results.document import document, write_json
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.terminal.options import json_option, seed_option
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render

MARGIN = 5e-3


@click.command(name="test-estimator")
@click.argument("estimator", metavar="PACKAGE.MODULE:NAME")
@json_option
@seed_option
def command(estimator: str, target: str | None, seed: int) -> None:
    """Put an estimator of yours through every test ours go through.

    \b
    nusselt test-estimator my_package.my_module:MyEstimator
    """
    sys.exit(run_trials(estimator, seed, target))


def run_trials(path: str, seed: int, target: str | None) -> int:
    """Put the estimator at ``package.module:Name`` through everything; returns the exit status."""
    kind = imported_estimator(path)
    outcomes: list[Outcome] = []
    with progress_bar(path) as report:
        for number, trial in enumerate(TRIALS):
            report(trial.__name__.replace("_", " "), number, len(TRIALS) + 1)
            outcomes.append(run_trial(trial, kind))
        report("verdict", len(TRIALS), len(TRIALS) + 1)
        row = None
        if outcomes[0].passed:
            row = _verdict(path, seed)
            found = f"{row['verdict']}: {row['reason']}"
            outcomes.append(Outcome("verdict against Mitsuba", row["as_claimed"] is not False, found))
    scene = shadow_scene(DULL).with_(width=24, height=18)
    truth = render(scene, Area(samples=64, stratified=True), seed=99, passes=PASSES)
    curve = error_against_time(kind, scene, truth, PASSES) if all(one.passed for one in outcomes) else []
    if target:
        told = [vars(one) for one in outcomes]
        rows = [] if row is None else [row]
        write_json(document(rows, estimator=path, trials=told, error_against_time=curve), target)
    _tell(path, outcomes, curve, console(stderr=target == "-"))
    if not all(one.passed for one in outcomes):
        return EXIT["not as claimed"]
    if row is not None and row["as_claimed"] is None:
        return EXIT["no reference"] if row["reference"]["renderer"] is None else EXIT["undecided"]
    return EXIT["as claimed"]


def _verdict(path: str, seed: int) -> dict[str, Any]:
    question = Question(
        estimator=path, samples=SAMPLES, stratified=True, margin=MARGIN, seed=seed, level=Level(1e-3, 1)
    )
    scene = shadow_scene(DULL).with_(width=96, height=72, name="shadows")
    command = f"nusselt test-estimator {path} --seed {seed}"
    return check(scene, question, command=command, references=KeptReferences(None, None)).row


def _tell(path: str, outcomes: list[Outcome], curve: list[dict[str, Any]], out: Any) -> None:
    table = Table(box=box.SIMPLE, title=path)
    for name in ("trial", "", "found"):
        table.add_column(name)
    for one in outcomes:
        table.add_row(one.trial, "[green]passed[/]" if one.passed else "[red]failed[/]", one.found)
    out.print(table)
    for row in curve:
        fastest = min(row["seconds"])
        out.print(f"{row['samples']:4} samples: RMS {row['rms']:.3e} in {fastest * 1e3:.0f} ms", markup=False)
