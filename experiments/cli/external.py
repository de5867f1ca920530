"""`nusselt check SCENE IMAGE...` and `nusselt check SCENE --renderer COMMAND`."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import click

from nusselt.experiments.check.check import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.external.comparison import Brought, Comparison, compare
from nusselt.experiments.external.convergence import convergence
from nusselt.experiments.external.pictures import write_comparison
from nusselt.experiments.external.program import Program, ProgramFailed, Renderer, Run
from nusselt.experiments.external.sides import stage
from nusselt.experiments.external.tell import tell
from nusselt.experiments.files import folder_name
from nusselt.experiments.images.read import is_image, quantiser_of, read_image
from nusselt.experiments.results.document import EXIT, document, exit_code, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.tables import console
from nusselt.experiments.scenes import catalogue
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.workers import worker_pool
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .rerun import shell_command

GROWTH = 4
"""Samples of one step of the convergence over those of the step before."""


def wants_bring(names: tuple[str, ...], options: dict[str, Any]) -> bool:
    """Whether somebody else's image is to be checked, rather than ours."""
    return bool(options.get("renderer")) or any(is_image(name) for name in names)


def run_bring(
    names: tuple[str, ...],
    options: dict[str, Any],
    question: Question,
    command: click.Command,
) -> int:
    """Check somebody's images or renderer; returns the exit status."""
    scenes = [name for name in names if not is_image(name)]
    files = [name for name in names if is_image(name)]
    if len(scenes) != 1:
        raise InputError("SCENE", ", ".join(scenes) or "none", "one scene with the images of it, or with a --renderer")
    if files and options["renderer"]:
        raise InputError("--renderer", options["renderer"], "images or a renderer, not both")
    scene = catalogue.load(scenes[0], options["lenient"]).with_(two_sided=options["two_sided"])
    question.of(scene)
    again = shlex.join([*shlex.split(shell_command(command, scenes[0], options)), *files])
    references = KeptReferences(options["reference"], options["cache"])
    references.given(scene)  # refused before anything is rendered
    shared: dict[str, Any] = {"command": again, "references": references}
    with worker_pool(options["cluster"]) as pool, progress_bar(scene.name) as report:
        shared |= {"executor": pool, "progress": report}
        if files:
            brought = _read(files, scene, options)
            told = compare(scene, brought, question, **shared)
        else:
            try:
                told = _run_program(scenes[0], scene, options, question, shared)
            except ProgramFailed as problem:
                console(stderr=True).print(f"nusselt: {problem}", markup=False, soft_wrap=True)
                return EXIT["not as claimed"]
    return _write(told, scene, options, question)


def _read(files: list[str], scene: Scene, options: dict[str, Any]) -> Brought:
    raws = [read_image(Path(name), scene) for name in files]
    quantiser = quantiser_of(raws, options["transfer"], options["quantisation"])
    return Brought(tuple(files), raws, quantiser, options["quantisation"] != "auto")


def _run_program(
    name: str, scene: Scene, options: dict[str, Any], question: Question, shared: dict[str, Any]
) -> Comparison:
    program = Program(options["renderer"], options["image_type"], options["run_timeout"])
    samples = question.of(scene).samples
    steps: list[list[Run]] = []
    total, report = options["runs"] * options["steps"], shared["progress"]
    with Renderer(program, scene, name) as renderer:
        for step in range(options["steps"]):
            steps.append([])
            for number in range(options["runs"]):
                report("renderer", step * options["runs"] + number, total)
                seed = question.seed + 1 + step * options["runs"] + number
                steps[-1].append(renderer.run(samples * GROWTH**step, seed))
    raws = [run.raw for run in steps[0]]
    quantiser = quantiser_of(raws, options["transfer"], options["quantisation"])
    names = tuple(f"seed {run.seed}" for run in steps[0])
    brought = Brought(names, raws, quantiser, options["quantisation"] != "auto", "renderer")
    told = compare(scene, brought, question, **shared)
    told.row["convergence"] = convergence(steps, quantiser, stage(scene), told.truth.reference)
    told.row["renderer_command"] = options["renderer"]
    return told


def _write(told: Comparison, scene: Scene, options: dict[str, Any], question: Question) -> int:
    out: Path | None = options["out"]
    target = options["target"] or (str(out / "results.json") if out else None)
    if out:
        told.row["images"] = write_comparison(told, out / folder_name(scene.name))
    results = document([told.row], alpha=question.level.alpha)
    if target:
        write_json(results, target)
    write_exports(results, options)
    tell(told.row, console(stderr=target == "-"))
    return exit_code([told.row])
