"""`nusselt check`: many rows, written as they finish."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from renderer.errors import InputError
from renderer.scene import Scene

from .bring.command import run_bring, wants_bring
from .bring.kept import KeptReferences
from .catalogue import load
from .check import Question, References, check, with_pixel_rule
from .exports import write_exports
from .files import folder_name
from .pictures import write_pictures
from .results import document, exit_code, write_json
from .statistics import Level
from .tables import console, left_out_table, verdict_table
from .until_decided import check_until
from .workers import worker_pool


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


def _read_all(names: tuple[str, ...], options: dict[str, Any], question: Question) -> list[Scene]:
    """Every scene, read and found askable before the first is rendered."""
    scenes = [load(name, options["lenient"]).with_(two_sided=options["two_sided"]) for name in names]
    scenes = [with_pixel_rule(scene, question.pixel_rule) for scene in scenes]
    taken: set[str] = set()
    for index, scene in enumerate(scenes):
        question.of(scene)
        name, number = scene.name, 2
        while name in taken:
            name, number = f"{scene.name}-{number}", number + 1
        taken.add(name)
        scenes[index] = dataclasses.replace(scene, name=name)
    return scenes


def run_check(
    names: tuple[str, ...],
    options: dict[str, Any],
    progress_bar: Callable[[str], Any],
    command_for: Callable[[str], str],
) -> int:
    """Check every scene; returns the exit status.

    Parameters
    ----------
    command_for : callable
        The command that makes one scene's row again.
    """
    question = _question(options, len(names))
    if wants_bring(names, options):
        return run_bring(names, options, _question(options, 1), progress_bar, command_for)
    scenes = _read_all(names, options, question)
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

    with worker_pool() as pool:
        for name, scene in zip(names, scenes, strict=True):
            with progress_bar(scene.name) as report:
                command = command_for(name)
                if out and options["until_decided"]:
                    # What is left of the time is shared by the scenes that are left.
                    share = (deadline - time.monotonic()) / (len(scenes) - len(rows))
                    answer = check_until(
                        scene, question, command=command, folder=out, budget=share, executor=pool, progress=report
                    )
                else:
                    answer = check(
                        scene, question, command=command, references=references, executor=pool, progress=report
                    )
            rows.append(answer.row)
            if out:
                answer.row["images"] = write_pictures(answer, out / folder_name(scene.name))
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
