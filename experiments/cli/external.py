"""`nusselt check SCENE IMAGE...` and `nusselt check SCENE --renderer COMMAND`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import click

from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.check.request import Reading
from nusselt.experiments.external.comparison import Comparison
from nusselt.experiments.external.judge import External, Judging, judge_images, judge_renderer
from nusselt.experiments.external.pictures import write_comparison
from nusselt.experiments.external.program import Program, ProgramFailed, ProgramRenderer
from nusselt.experiments.external.tell import tell
from nusselt.experiments.files import folder_name
from nusselt.experiments.images.read import is_image
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.results.tables import console
from nusselt.experiments.terminal.options import Exports, Output
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.workers import PATIENCE, worker_pool
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .rerun import shell_command


@dataclass(frozen=True)
class ExternalCheck:
    """One scene with somebody's images of it, or with a renderer; and where results go."""

    words: tuple[str, ...]
    estimators: tuple[str, ...]
    question: Question
    external: External
    reading: Reading
    references: KeptReferences
    output: Output
    exports: Exports
    cluster: str | None

    def __post_init__(self) -> None:
        if len(self.scenes) != 1:
            told = "one scene with the images of it, or with a --renderer"
            raise InputError("SCENE", ", ".join(self.scenes) or "none", told)
        if len(self.estimators) > 1:
            raise InputError("estimator", ", ".join(self.estimators), "one: images are not ours, it tells their noise")

    @property
    def scenes(self) -> list[str]:
        """Words that are no image's name."""
        return [word for word in self.words if not is_image(word)]

    @property
    def images(self) -> list[str]:
        """Words that are."""
        return [word for word in self.words if is_image(word)]


def run_external(task: ExternalCheck, said: Mapping[str, object], command: click.Command) -> int:
    """Check somebody's images or renderer; returns the exit status."""
    (name,) = task.scenes
    question = dataclasses.replace(task.question, estimator=next(iter(task.estimators), None))
    scene = task.reading.scene(name, question.pixel_rule)
    question.of(scene)
    task.references.given(scene)  # refused before anything is rendered
    again = shell_command(command, name, said, task.images)
    with worker_pool(task.cluster, PATIENCE) as pool, progress_bar(scene.name) as report:
        judging = Judging(question, task.external, again, task.references, pool, report)
        if task.images:
            return _write(judge_images(scene, task.images, judging), scene, task)
        program = Program(task.external.renderer, task.external.image_type, task.external.run_timeout)
        try:
            with ProgramRenderer(program, scene, name) as renderer:
                told = judge_renderer(scene, renderer, judging)
        except ProgramFailed as problem:
            console(stderr=True).print(f"nusselt: {problem}", markup=False, soft_wrap=True)
            return EXIT["not as claimed"]
    told.row["renderer_command"] = task.external.renderer
    return _write(told, scene, task)


def _write(told: Comparison, scene: Scene, task: ExternalCheck) -> int:
    output = task.output
    if output.out:
        told.row["images"] = write_comparison(told, output.out / folder_name(scene.name), scene)
    results = document([told.row], alpha=task.question.level.alpha)
    if output.results:
        write_json(results, output.results)
    write_exports(results, vars(task.exports))
    tell(told.row, console(stderr=output.target == "-"))
    return exit_code([told.row])
