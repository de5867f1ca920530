"""`nusselt check`: many rows, written as they finish."""

from __future__ import annotations

import dataclasses
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from nusselt.experiments.check.check import Question, References, check, with_pixel_rule
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.check.sequential import check_until
from nusselt.experiments.files import folder_name
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.pictures import write_pictures
from nusselt.experiments.results.tables import console, left_out_table, verdict_table
from nusselt.experiments.scenes import catalogue
from nusselt.experiments.scenes.catalogue import Asked, load
from nusselt.experiments.terminal.options import cluster_option, export_options, sampling_options
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.workers import worker_pool
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .external import run_bring, wants_bring
from .external_options import bring_options
from .rerun import shell_command


def _question(options: dict[str, Any], rows: int) -> Question:
    for name, low, high in (
        ("margin", 0.0, 1.0),
        ("alpha", 0.0, 0.5),
        ("timeout", 0.0, math.inf),
        ("budget", 0.0, math.inf),
    ):
        if not low < options[name] <= high:
            raise InputError(f"--{name}", options[name], f"a number above {low:g}, at most {high:g}")
    if options["tolerance"] is not None and not 0 < options["tolerance"] < 1:
        raise InputError("--tolerance", options["tolerance"], "a number above 0 and below 1")
    if options["pixel_rule"] == "area" and options["shadow_origin"] == "mitsuba":
        raise InputError("--shadow-origin", "mitsuba", "surface, where pixels are drawn by area")
    return Question(
        estimator=options["estimator"],
        samples=options["samples"],
        stratified=options["stratified"],
        margin=options["margin"],
        seed=options["seed"],
        level=Level(options["alpha"], rows),
        timeout=options["timeout"],
        shadow_origin=options["shadow_origin"],
        pixel_rule=options["pixel_rule"],
        tolerance=options["tolerance"],
    )


@dataclass(frozen=True)
class _Row:
    """One row to be made: its scene, what is asked of it, the command for it alone, a folder's name."""

    scene: Scene
    question: Question
    command: str
    folder: str


def _read_all(asked: Sequence[Asked], options: dict[str, Any], question: Question) -> list[_Row]:
    """Every scene, read and found askable before the first is rendered."""
    rows: list[_Row] = []
    scenes: dict[tuple[str, str | None], int] = {}
    for one in asked:
        scene = load(one.scene, options["lenient"]).with_(two_sided=options["two_sided"])
        scene = with_pixel_rule(scene, question.pixel_rule)
        mine = dataclasses.replace(question, estimator=one.estimator)
        mine.of(scene)
        number = scenes[scene.name, one.estimator] = scenes.get((scene.name, one.estimator), 0) + 1
        if number > 1:
            scene = dataclasses.replace(scene, name=f"{scene.name}-{number}")
        apart = one.estimator if one.estimator != options["estimator"] else None
        folder = folder_name("-".join(filter(None, (scene.name, apart))))
        rows.append(
            _Row(scene, mine, shell_command(command, one.scene, options | {"estimator": one.estimator}), folder)
        )
    return rows


@click.command()
@click.argument("scenes", metavar="SCENE... [IMAGE...]", nargs=-1)
@click.option("--classic", is_flag=True, help="All classic scenes.")
@sampling_options
@bring_options
@click.option("--margin", type=float, default=1e-3, show_default=True, help="Relative bias that does not matter.")
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="False-alarm rate of the whole report.")
@click.option("--timeout", type=float, default=600.0, show_default=True, help="Seconds for one reference.")
@click.option("--until-decided", is_flag=True, help="Add passes to undecided scenes; they are kept under --out.")
@click.option("--budget", type=float, default=600.0, show_default=True, help="Seconds for --until-decided.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the pictures and results.json.")
@click.option("--json", "target", metavar="FILE|-", help="Write the results there ('-': standard output).")
@cluster_option
@export_options
def command(scenes: tuple[str, ...], classic: bool, **options: Any) -> None:
    """Compare our image of each SCENE with Mitsuba's: bias, RMS, their intervals, a verdict.

    \b
    nusselt check quad cornell --out out
    nusselt check my.test --samples 64 --margin 0.0005 --json -
    nusselt check quad-stratified mine-1.png mine-2.png
    nusselt check my.test --renderer "./mine {scene} {samples} {seed} {output}"

    With IMAGEs (.png, .exr, .pfm, .hdr, .npy) or a --renderer those are judged in place of ours.
    """

    asked = catalogue.classic(options["estimator"]) if classic else []
    asked += [catalogue.Asked(name, options["estimator"]) for name in scenes]
    if options["until_decided"] and options["out"] is None:
        raise click.UsageError("--until-decided keeps its passes on disk: name a folder with --out")
    if not asked:
        raise click.UsageError("name a scene file, a classic scene (see: nusselt list), or --classic")
    sys.exit(run_check(asked, options))


def run_check(asked: Sequence[Asked], options: dict[str, Any]) -> int:
    """Check every scene; returns the exit status."""
    question = _question(options, len(asked))
    names = tuple(one.scene for one in asked)
    if wants_bring(names, options):
        return run_bring(names, options, _question(options, 1), command)
    wanted = _read_all(asked, options, question)
    out: Path | None = options["out"]
    target = options["target"] or (str(out / "results.json") if out else None)
    rows: list[dict[str, Any]] = []
    references: References = KeptReferences(options.get("reference"), options.get("cache"))
    deadline = time.monotonic() + options["budget"]
    table = console(stderr=target == "-")

    def save() -> None:
        if target and target != "-":
            write_json(document(rows, alpha=question.level.alpha), target)
        write_exports(document(rows, alpha=question.level.alpha), options)

    with worker_pool(options["cluster"]) as pool:
        for one in wanted:
            told: dict[str, Any] = {"command": one.command, "executor": pool}
            with progress_bar(one.folder) as report:
                if out and options["until_decided"]:
                    # What is left of the time is shared by the scenes that are left.
                    share = (deadline - time.monotonic()) / (len(wanted) - len(rows))
                    answer = check_until(one.scene, one.question, folder=out, budget=share, progress=report, **told)
                else:
                    answer = check(one.scene, one.question, references=references, progress=report, **told)
            rows.append(answer.row)
            if out:
                answer.row["images"] = write_pictures(answer.row, answer.ours, answer.reference, out / one.folder)
            save()
    if target == "-":
        write_json(document(rows, alpha=question.level.alpha), target)
    table.print(verdict_table(rows, question.level.alpha, table.width))
    table.print(left_out_table(rows))
    for row in rows:
        if row["verdict"] != "agrees":
            table.print(f"{row['scene']}: {row['verdict']}: {row['reason']}\n  again: {row['command']}", markup=False)
        for warning in row["warnings"]:
            table.print(f"{row['scene']}: warning: {warning}", markup=False)
    return exit_code(rows)
