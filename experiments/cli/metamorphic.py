"""`nusselt metamorphic`: a renderer against itself, without a reference."""

from __future__ import annotations

import dataclasses
import shlex
import sys

import click

from nusselt.experiments.check.request import Reading
from nusselt.experiments.console import console, say
from nusselt.experiments.external.program import ProgramFailed
from nusselt.experiments.metamorphic.ask import Asking, ask
from nusselt.experiments.metamorphic.relation import Relation
from nusselt.experiments.metamorphic.table import relation_table, sentences
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.terminal.group import stop
from nusselt.experiments.terminal.options import (
    Exports,
    Output,
    exports_options,
    output_options,
    reading_options,
    seed_option,
)
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.mitsuba_bridge.process import ReferenceUnavailable
from nusselt.renderer.scene import Scene

from .made import Made, made_options
from .rerun import said_words

ELSEWHERE = ("scenes", "only", "out", "target", "csv", "junit", "summary")
"""What no row depends on, or each says for itself."""


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
    /,
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
    words = said_words(context, ELSEWHERE)

    def again(scene: Scene, relation: Relation) -> str:
        name = next(name for name, one in read.items() if one is scene)
        return shlex.join(["nusselt", "metamorphic", name, *words, "--relation", relation.name])

    with progress_bar("metamorphic") as report:
        try:
            rows = ask(list(read.values()), source, asking, again, report)
        except ProgramFailed as problem:
            stop(str(problem), EXIT["not as claimed"])
        except ReferenceUnavailable as problem:
            stop(str(problem), EXIT["no reference"])
    if made.renderer:
        rows = [row | {"renderer_command": made.renderer} for row in rows]
    results = document(rows, alpha=asking.alpha, seed=asking.seed)
    if output.results:
        write_json(results, output.results)
    write_exports(results, dataclasses.asdict(exports))
    told = console(stderr=output.target == "-")
    told.print(relation_table(rows, asking.alpha, told.width))
    for line in sentences(rows):
        say(told, line)
    sys.exit(exit_code([row for row in rows if "as_claimed" in row]))
