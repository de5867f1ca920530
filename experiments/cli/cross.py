"""`nusselt cross`: every renderer on one scene, the exact image as the arbiter."""

from __future__ import annotations

import dataclasses
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import click

from nusselt.experiments.check.question import PixelRule
from nusselt.experiments.check.request import Reading
from nusselt.experiments.console import console, say
from nusselt.experiments.external.program import Program, ProgramFailed
from nusselt.experiments.images.read import is_image
from nusselt.experiments.peers.clusters import headline
from nusselt.experiments.peers.cross import Cross, CrossQuestion
from nusselt.experiments.peers.entrant import Effort
from nusselt.experiments.peers.page import write_cross
from nusselt.experiments.peers.peer import Peer
from nusselt.experiments.peers.renderers import PEERS, peer_of
from nusselt.experiments.peers.tables import departures_table, matrix_table, times_table, without
from nusselt.experiments.peers.task import Brought, Task, run_cross
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.store import Store
from nusselt.experiments.scenes.sizes import at_width
from nusselt.experiments.terminal.group import stop
from nusselt.experiments.terminal.options import Output, output_options, reading_options, seed_option, together
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.workers import PATIENCE, worker_pool
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .peers import environments_in, environments_option


@dataclasses.dataclass(frozen=True)
class Yours:
    """A renderer of the user's beside the peers."""

    renderer: str | None = None
    image_type: str = ".exr"
    pixel_rule: PixelRule = "centre"


yours_options = together(
    Yours,
    "yours",
    click.option("--renderer", metavar="COMMAND", help="Yours beside them; see: nusselt check --help."),
    click.option("--image-type", default=".exr", show_default=True, help="Ending of the image it writes."),
    click.option(
        "--pixel-rule",
        type=click.Choice(["centre", "area"]),
        default="centre",
        show_default=True,
        help="What pixels of your images are.",
    ),
)


@click.command()
@click.argument("words", metavar="SCENE... [IMAGE...]", nargs=-1, required=True)
@click.option("--peers", metavar="NAME,...", help="Of these alone; see: nusselt peers. [default: all that are there]")
@environments_option
@yours_options
@click.option("--samples", type=click.IntRange(1), help="Of every renderer, instead of each one's own.")
@click.option("--seeds", type=click.IntRange(2, 256), default=4, show_default=True, help="Images of a noisy renderer.")
@seed_option
@click.option("--width", type=click.IntRange(8), help="Pixels across, of the same shape, instead of the scene's.")
@click.option("--margin", type=float, default=2e-4, show_default=True, help="Relative bias that does not matter.")
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="Chance that any right renderer fails.")
@click.option("--departures", is_flag=True, help="Measure what each setting costs that is left at its default.")
@click.option(
    "--times", is_flag=True, help="Measure error against time, one thread each, in as many rounds as --seeds."
)
@click.option("--timeout", type=float, default=600.0, show_default=True, help="Seconds of one image.")
@reading_options
@output_options
def command(
    *,
    words: tuple[str, ...],
    peers: str | None,
    environments: Path | None,
    yours: Yours,
    samples: int | None,
    seeds: int,
    seed: int,
    width: int | None,
    margin: float,
    alpha: float,
    departures: bool,
    times: bool,
    timeout: float,
    reading: Reading,
    output: Output,
) -> None:
    """Compare renderers with each other and with the exact image: who agrees, who is right, and how sure that is.

    \b
    nusselt cross cornell-boxes three-lights quad --out out
    nusselt cross my.test --peers cycles
    nusselt cross my.test mine-1.exr mine-2.exr --pixel-rule area
    nusselt cross quad --departures
    nusselt cross quad --times --out out

    --out writes cross.html, results.json and the images; --times goes on there where it was cut short.
    """
    names = [word for word in words if not is_image(word)]
    images = tuple(word for word in words if is_image(word))
    if not names or (images and len(names) != 1):
        raise InputError("SCENE", ", ".join(names) or "none", "scenes, or one scene with the images of it")
    program = None if yours.renderer is None else Program(yours.renderer, yours.image_type, timeout)
    task = Task(
        _peers(peers),
        environments_in(environments),
        Effort(samples, seeds, seed),
        Brought(images, program, yours.pixel_rule, samples or Brought.samples),
        CrossQuestion(margin, alpha, len(names)),
        departures,
        times,
        Store(output.out / "laps" if output.out else None),
        timeout,
    )
    scenes = [at_width(reading.scene(name), width) for name in names]
    sys.exit(_run(scenes, names if width is None else [None] * len(names), task, output))


def _save(crosses: list[Cross], task: Task, output: Output, again: str, last: bool) -> list[Row]:
    """Write what is there of the scenes that are done; returns their rows."""
    rows = [row for cross in crosses for row in cross.rows(task.question, again)]
    results = document(rows, alpha=task.question.alpha, seed=task.effort.seed)
    if output.results and (last or output.target != "-"):
        write_json(results, output.results)
    if output.out:
        write_cross(output.out, crosses, results, again)
    return rows


def _peers(asked: str | None) -> tuple[Peer, ...]:
    return PEERS if asked is None else tuple(peer_of(name.strip()) for name in asked.split(",") if name.strip())


def _run(scenes: list[Scene], files: Sequence[str | None], task: Task, output: Output) -> int:
    """Cross-check every scene; returns the exit status. A program is given a scene's own file where there is one."""
    crosses: list[Cross] = []
    told, again = console(stderr=output.target == "-"), shlex.join(["nusselt", *sys.argv[1:]])
    with worker_pool(None, PATIENCE) as pool:
        for scene, file in zip(scenes, files, strict=True):
            with progress_bar(scene.name) as report:
                try:
                    crosses.append(run_cross(scene, file, task, pool, report))
                except ProgramFailed as problem:
                    stop(str(problem), 1)
            rows = _save(crosses, task, output, again, last=len(crosses) == len(scenes))
    for cross in crosses:
        told.print(matrix_table(cross, told.width))
        for sentence in cross.findings.said:
            say(told, f"{cross.scene.name}: {sentence}")
    for sentence in without(crosses):
        say(told, sentence)
    if task.measure_departures:
        told.print(departures_table(crosses, told.width))
    for cross in crosses:
        if cross.times:
            told.print(times_table(cross.scene.name, cross.times, told.width))
            for (name, rule), why in cross.times.failed.items():
                say(told, f"{cross.scene.name}: times of {name}, {rule}, end: {why}")
    say(told, headline([cross.findings for cross in crosses]))
    return exit_code([row for row in rows if "as_claimed" in row])
