"""`nusselt metamorphic`: a renderer against itself, without a reference."""

from __future__ import annotations

import dataclasses
import shlex
import sys
from dataclasses import dataclass

import click

from nusselt.experiments.check.request import Reading
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.images.read import READERS
from nusselt.experiments.metamorphic.ask import Asking, ask
from nusselt.experiments.metamorphic.relation import Relation
from nusselt.experiments.metamorphic.sources import EstimatorSource, Source, renderer_source
from nusselt.experiments.metamorphic.table import relation_table, sentences
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.results.tables import console
from nusselt.experiments.terminal.group import stop
from nusselt.experiments.terminal.options import (
    Exports,
    Output,
    exports_options,
    output_options,
    reading_options,
    said_in,
    seed_option,
    together,
)
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene


@dataclass(frozen=True)
class Made:
    """Who makes the images, and of what size."""

    renderer: str | None
    estimator: str | None
    image_type: str
    run_timeout: float
    new_kinds: bool
    exact: bool
    width: int | None
    samples: int | None

    @property
    def source(self) -> Source:
        if self.renderer is None:
            return EstimatorSource(self.estimator)
        if self.estimator is not None:
            raise InputError("estimator", self.estimator, "an estimator of ours or a renderer, not both")
        return renderer_source(self.renderer, self.image_type, self.run_timeout, self.new_kinds, self.exact)

    def scene(self, scene: Scene) -> Scene:
        """With this width and these samples."""
        count = self.samples or scene.light_samples
        if self.width is None:
            return scene.with_(light_samples=count)
        height = max(1, round(scene.height * self.width / scene.width))
        return scene.with_(light_samples=count, width=self.width, height=height)


made_options = together(
    Made,
    "made",
    click.option("--renderer", metavar="COMMAND", help="A program with {scene} or {xml}, {output} …; or: mitsuba."),
    click.option("--estimator", metavar="NAME", help="Instead of the scene's. See: list."),
    click.option("--image-type", type=click.Choice(list(READERS)), default=".exr", show_default=True),
    click.option("--run-timeout", type=click.FloatRange(0, min_open=True), default=600.0, show_default=True),
    click.option("--new-kinds", is_flag=True, help="The renderer knows quad and triangle lights."),
    click.option("--exact", is_flag=True, help="The renderer claims images without noise."),
    click.option("--width", type=click.IntRange(1, 65_536), help="Pixels across, instead of the scene's."),
    click.option("--samples", type=click.IntRange(1, 1 << 24), help="Per light, instead of the scene's."),
)


@click.command(name="metamorphic")
@click.argument("scenes", metavar="SCENE...", nargs=-1, required=True)
@made_options
@click.option("--relation", "only", metavar="NAME", multiple=True, help="These alone.")
@click.option("--margin", type=float, default=0.02, show_default=True, help="Relative difference that does not matter.")
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="Chance that a right renderer fails.")
@click.option("--runs", type=click.IntRange(2, 256), default=4, show_default=True, help="Seeds of every image.")
@click.option("--budget", type=float, default=0.0, help="Seconds for more seeds of a relation that is undecided.")
@seed_option
@reading_options
@output_options
@exports_options
@click.pass_context
def command(
    context: click.Context,
    *,
    scenes: tuple[str, ...],
    made: Made,
    reading: Reading,
    output: Output,
    exports: Exports,
    **asked: object,
) -> None:
    """Prove a renderer without a reference: what right images of changed scenes keep.

    \b
    nusselt metamorphic cornell --width 48 --renderer mitsuba
    """
    asking = Asking(**asked)  # type: ignore[arg-type]
    source = made.source
    read = {name: made.scene(reading.scene(name)) for name in scenes}
    words = _words(context)

    def again(scene: Scene, relation: Relation) -> str:
        name = next(name for name, one in read.items() if one is scene)
        return shlex.join(["nusselt", "metamorphic", name, *words, "--relation", relation.name])

    with progress_bar("metamorphic") as report:
        try:
            rows = ask(list(read.values()), source, asking, again, report)
        except ProgramFailed as problem:
            stop(str(problem), EXIT["not as claimed"])
    if made.renderer:
        rows = [row | {"renderer_command": made.renderer} for row in rows]
    results = document(rows, alpha=asking.alpha, seed=asking.seed)
    if output.results:
        write_json(results, output.results)
    write_exports(results, dataclasses.asdict(exports))
    told = console(stderr=output.target == "-")
    told.print(relation_table(rows, asking.alpha))
    for line in sentences(rows):
        told.print(line, markup=False, soft_wrap=True)
    sys.exit(exit_code([row for row in rows if "as_claimed" in row]))


ELSEWHERE = ("scenes", "only", "out", "target", "csv", "junit", "summary")


def _words(context: click.Context) -> list[str]:
    """The options that were said, but for where results go."""
    words: list[str] = []
    named = {param.name: param.opts[0] for param in context.command.params}
    for name, value in said_in(context).items():
        if name not in ELSEWHERE:
            words += [named[name]] if value is True else [named[name], str(value)]
    return words
