"""`nusselt check`: many rows, written as they finish."""

from __future__ import annotations

import dataclasses
import math
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import click
from rich.console import Console

from nusselt.experiments.check.check import Answer, References, check
from nusselt.experiments.check.question import Question, number_within
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.check.request import SizedReading, mode_of
from nusselt.experiments.check.sequential import check_until
from nusselt.experiments.console import console, say, say_command
from nusselt.experiments.external.judge import External
from nusselt.experiments.files import folder_name
from nusselt.experiments.images.read import is_image
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.pictures import write_pictures
from nusselt.experiments.results.rows import title
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.tables import closing, left_out_table, verdict_table
from nusselt.experiments.scenes import catalogue
from nusselt.experiments.scenes.catalogue import Asked
from nusselt.experiments.terminal.options import (
    Exports,
    Output,
    Sampling,
    cluster_option,
    exports_options,
    output_options,
    said_in,
    sampling_options,
    sized_reading_options,
    verbose_option,
)
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.terminal.tev import Tev
from nusselt.experiments.verdict.judge import standard_errors
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.workers import PATIENCE, worker_pool
from nusselt.renderer.scene import Scene
from nusselt.renderer.words import count

from .check_options import (
    Judging,
    Kept,
    UntilDecided,
    external_options,
    judging_options,
    kept_options,
    until_decided_options,
)
from .external import ExternalCheck, run_external
from .rerun import shell_command


@dataclass(frozen=True)
class _Row:
    """One row to be made: its scene, what is asked of it, the command for it alone, a folder's name."""

    scene: Scene
    question: Question
    command: str
    folder: str


@dataclass(frozen=True)
class Checks:
    """Rows to be made, and how."""

    rows: Sequence[_Row]
    references: References
    until: UntilDecided
    output: Output
    exports: Exports
    cluster: str | None


def _read_all(asked: Sequence[Asked], said: Mapping[str, Any], reading: SizedReading, question: Question) -> list[_Row]:
    """Every scene, read and found askable before the first is rendered."""
    rows: list[_Row] = []
    estimators = Counter(one.scene for one in asked)
    names: Counter[tuple[str, object]] = Counter()
    for one in asked:
        scene = reading.scene(one.scene, question.pixel_rule)
        own_question = dataclasses.replace(question, estimator=one.estimator)
        own_question.of(scene)
        names[scene.name, one.estimator] += 1
        if names[scene.name, one.estimator] > 1:
            scene = dataclasses.replace(scene, name=f"{scene.name}-{names[scene.name, one.estimator]}")
        apart = one.estimator if estimators[one.scene] > 1 else None
        folder = folder_name("-".join(filter(None, (scene.name, apart))))
        again = shell_command(command, one.scene, {**said, "estimator": one.estimator})
        rows.append(_Row(scene, own_question, again, folder))
    return rows


@click.command()
@click.argument("scenes", metavar="SCENE... [IMAGE...]", nargs=-1)
@click.option("--classic", is_flag=True, help="All classic scenes.")
@click.option("--estimator", metavar="NAME", multiple=True, help="Instead of the scene's; a row for each. See: list.")
@sampling_options
@sized_reading_options
@external_options
@kept_options
@judging_options
@until_decided_options
@output_options
@verbose_option
@cluster_option
@exports_options
@click.pass_context
def command(
    context: click.Context,
    *,
    scenes: tuple[str, ...],
    classic: bool,
    estimator: tuple[str, ...],
    sampling: Sampling,
    reading: SizedReading,
    external: External,
    kept: Kept,
    judging: Judging,
    until: UntilDecided,
    output: Output,
    verbose: bool,
    exports: Exports,
    cluster: str | None,
) -> None:
    """Compare our image of each SCENE with Mitsuba's: bias, RMS, their intervals, a verdict.

    \b
    nusselt check quad cornell --out out
    nusselt check my.test --estimator area --estimator my_module:Mine --json -
    nusselt check quad-stratified mine-1.png mine-2.png
    nusselt check my.test --renderer "./mine {scene} {samples} {seed} {output}"

    With IMAGEs (.png, .exr, .pfm, .hdr, .npy; FILE.exr:LAYER) or a --renderer those are judged in place of ours.
    """
    said = said_in(context)
    mode_of(any(map(is_image, scenes)), external.renderer, until.until_decided).refuse_others(said)
    said.pop("tev", None)  # no part of what makes a row again
    asked = [*_classic(classic, estimator), *(Asked(name, kind) for name in scenes for kind in estimator or (None,))]
    question = Question(
        **vars(sampling), margin=judging.margin, timeout=judging.timeout, level=Level(judging.alpha, max(len(asked), 1))
    )
    references = KeptReferences(kept.reference, kept.cache)
    if until.until_decided and output.out is None:
        raise click.UsageError("--until-decided keeps its passes on disk: name a folder with --out")
    if not asked:
        raise click.UsageError("name a scene file, a classic scene (see: nusselt list), or --classic")
    if external.renderer is not None or any(map(is_image, scenes)):
        task = ExternalCheck(scenes, estimator, question, external, reading, references, output, exports, cluster)
        sys.exit(run_external(task, said, command))
    rows = _read_all(asked, said, reading, question)
    for one in rows:
        references.given(one.scene)  # refused before anything is rendered
    sys.exit(run_checks(Checks(rows, references, until, output, exports, cluster), question.level.alpha, verbose))


def _classic(classic: bool, estimators: tuple[str, ...]) -> list[Asked]:
    return [one for kind in estimators or (None,) for one in catalogue.classic(kind)] if classic else []


def run_checks(checks: Checks, alpha: float, verbose: bool = False) -> int:
    """Make every row; returns the exit status."""
    output, until = checks.output, checks.until
    number_within("budget", until.budget, 0, math.inf)
    rows: list[dict[str, Any]] = []
    deadline = time.monotonic() + until.budget
    table = console(stderr=output.target == "-")

    def save() -> None:
        if output.results and output.target != "-":
            write_json(document(rows, alpha=alpha), output.results)
        write_exports(document(rows, alpha=alpha), vars(checks.exports))

    with worker_pool(checks.cluster, PATIENCE) as pool:
        for one in checks.rows:
            told: dict[str, Any] = {"command": one.command, "executor": pool}
            with progress_bar(one.folder) as report:
                if output.out and until.until_decided:
                    # What is left of the time is shared by the scenes that are left.
                    share = (deadline - time.monotonic()) / (len(checks.rows) - len(rows))
                    told |= {"folder": output.out, "budget": share, "seen": _watched(until.tev, one.folder)}
                    answer = check_until(one.scene, one.question, progress=report, **told)
                else:
                    answer = check(one.scene, one.question, references=checks.references, progress=report, **told)
            rows.append(answer.row)
            if output.out:
                folder = output.out / one.folder
                answer.row["images"] = write_pictures(answer.row, answer.ours, answer.reference, folder, one.scene)
            save()
    if output.target == "-":
        write_json(document(rows, alpha=alpha), output.target)
    _tell(rows, alpha, verbose, table)
    return exit_code(rows)


def _watched(tev: Tev | None, name: str) -> Callable[[Answer], None] | None:
    """What shows each look's images where somebody watches."""
    if tev is None:
        return None

    def show(answer: Answer) -> None:
        if answer.reference is not None:
            z = standard_errors(answer.ours, answer.reference, answer.row["passes"])
            tev.show(name, {"ours": answer.ours.mean, "theirs": answer.reference.mean, "z": z[None]})

    return show


def _tell(rows: list[Row], alpha: float, verbose: bool, table: Console) -> None:
    table.print(verdict_table(rows, alpha, table.width))
    if verbose:
        table.print(left_out_table(rows))
    else:
        number = sum(len(row["left_out"]) for row in rows)
        say(table, f"{count(number, 'thing')} left out, which no scene here needs; -v lists what and why")
    for row in rows:
        if row["verdict"] != "agrees":
            say(table, f"{title(row)} {row['verdict']}: {row['reason']}")
            say_command(table, f"  again: {row['command']}")
    for said in dict.fromkeys(f"{row['scene']}: warning: {warning}" for row in rows for warning in row["warnings"]):
        say(table, said)
    say(table, closing(rows))
