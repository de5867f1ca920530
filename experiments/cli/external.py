"""`nusselt check SCENE IMAGE...` and `nusselt check SCENE... --renderer COMMAND`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import click

from nusselt.experiments.check.question import Question
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.check.request import SizedReading
from nusselt.experiments.console import console, say
from nusselt.experiments.external.comparison import Comparison
from nusselt.experiments.external.judge import External, Judging, judge_images, judge_renderer
from nusselt.experiments.external.pictures import write_comparison
from nusselt.experiments.external.program import Program, ProgramFailed, ProgramRenderer
from nusselt.experiments.external.tell import tell
from nusselt.experiments.files import folder_name
from nusselt.experiments.images.read import is_image
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.results.tables import closing
from nusselt.experiments.terminal.options import Exports, Output
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.workers import PATIENCE, worker_pool
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .rerun import shell_command


@dataclass(frozen=True)
class ExternalCheck:
    """A scene with somebody's images of it, or scenes with a renderer; and where results go."""

    words: tuple[str, ...]
    estimators: tuple[str, ...]
    question: Question
    external: External
    reading: SizedReading
    references: KeptReferences
    output: Output
    exports: Exports
    cluster: str | None

    def __post_init__(self) -> None:
        if not self.scenes or (self.images and len(self.scenes) > 1):
            told = "one scene with the images of it, or scenes with a --renderer"
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

    def read(self) -> list[tuple[str, Scene]]:
        """Every scene, read and found askable before the first is rendered; equal names are told apart."""
        question, found = self.own_question, list[tuple[str, Scene]]()
        for word in self.scenes:
            scene = self.reading.scene(word, question.pixel_rule)
            question.of(scene)
            self.references.given(scene)
            turn = sum(other.name == scene.name for _, other in found)
            found.append((word, scene.with_(name=f"{scene.name}-{turn + 1}") if turn else scene))
        return found

    @property
    def own_question(self) -> Question:
        """With the estimator that tells the noise, and each scene's share of the false-alarm rate."""
        level = dataclasses.replace(self.question.level, rows=len(self.scenes))
        return dataclasses.replace(self.question, estimator=next(iter(self.estimators), None), level=level)

    def save(self, rows: list[Row]) -> None:
        """What there is so far, into files."""
        results = document(rows, alpha=self.question.level.alpha)
        if self.output.results and self.output.target != "-":
            write_json(results, self.output.results)
        write_exports(results, vars(self.exports))


def run_external(task: ExternalCheck, said: Mapping[str, object], command: click.Command) -> int:
    """Check somebody's images or renderer; returns the exit status."""
    scenes, rows, failed = task.read(), list[Row](), list[str]()
    table = console(stderr=task.output.target == "-")
    with worker_pool(task.cluster, PATIENCE) as pool:
        for word, scene in scenes:
            again = shell_command(command, word, said, task.images)
            with progress_bar(scene.name) as report:
                judging = Judging(task.own_question, task.external, again, task.references, pool, report)
                try:
                    told = _judged(scene, word, task, judging)
                except ProgramFailed as problem:
                    say(console(stderr=True), f"nusselt: {scene.name}: {problem}")
                    failed.append(scene.name)
                    continue
            if task.output.out:
                told.row["images"] = write_comparison(told, task.output.out / folder_name(scene.name), scene)
            rows.append(told.row)
            task.save(rows)
            tell(told.row, table)
    if task.output.target == "-" and rows:
        write_json(document(rows, alpha=task.question.level.alpha), "-")
    if len(scenes) > 1:
        lost = f"; {', '.join(failed)} could not be drawn" if failed else ""
        say(table, f"{closing(rows)}{lost}")
    return EXIT["not as claimed"] if failed else exit_code(rows)


def _judged(scene: Scene, word: str, task: ExternalCheck, judging: Judging) -> Comparison:
    if task.images:
        return judge_images(scene, task.images, judging)
    program = Program(task.external.renderer, task.external.image_type, task.external.run_timeout)
    with ProgramRenderer(program, scene, word if task.reading.width is None else None) as renderer:
        told = judge_renderer(scene, renderer, judging)
    told.row["renderer_command"] = task.external.renderer
    return told
