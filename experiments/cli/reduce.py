"""`nusselt reduce`: the smallest scene on which a renderer still fails."""

from __future__ import annotations

import math
import shlex
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import click

from nusselt.experiments.check.request import Reading
from nusselt.experiments.files import replacing
from nusselt.experiments.images.read import READERS
from nusselt.experiments.metamorphic.ask import Asking
from nusselt.experiments.reduce.failure import BESIDE, CRASHES, NOT_FINITE, manner_of
from nusselt.experiments.reduce.reduce import Trials, reduced, told
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.scenes.catalogue import OTHERS
from nusselt.experiments.terminal.group import stop
from nusselt.experiments.terminal.options import reading_options, seed_option
from nusselt.experiments.terminal.places import Place
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.words import count

from .made import Made, made_options
from .rerun import said_words


@click.command(name="reduce")
@click.argument("scene")
@made_options
@click.option("--relation", "wanted", metavar="NAME", multiple=True, help="Fails by this relation.")
@click.option("-o", "--output", type=Place(), required=True, metavar="FILE", help="The small scene; .json beside it.")
@click.option("--margin", type=float, default=0.02, show_default=True, help="Relative difference that does not matter.")
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="Chance that noise leads astray, in all.")
@click.option("--runs", type=click.IntRange(2, 256), default=4, show_default=True, help="Seeds of every image.")
@click.option("--step-budget", type=float, default=0.0, help="Seconds for more seeds of a scene that is undecided.")
@click.option("--time", "seconds", type=click.FloatRange(0, min_open=True), default=math.inf, help="Seconds in all.")
@seed_option
@reading_options
@click.pass_context
def command(
    context: click.Context,
    /,
    *,
    scene: str,
    made: Made,
    wanted: tuple[str, ...],
    output: Path,
    seconds: float,
    step_budget: float,
    reading: Reading,
    **asked: object,
) -> None:
    """Shrink a SCENE on which a renderer fails: no image, another than ours, or a broken relation.

    What was tried is kept beside the output: the same command goes on where it was cut short, unless a file that it
    names has changed.

    \b
    nusselt reduce big.test --renderer "./mine {scene} {output}" -o small.test
    """
    if output.suffix in (*READERS, *OTHERS, ".json"):
        raise InputError("output", str(output), "a name for a scene file, such as small.test")
    asking = Asking(budget=step_budget, only=wanted, **asked)  # type: ignore[arg-type]
    whole, until = made.scene(reading.scene(scene)), time.monotonic() + seconds
    try:
        failure, unknown = manner_of(whole, made.source, asking, wanted, until)
    except KeyboardInterrupt as ended:
        status = 128 + getattr(ended, "number", signal.SIGINT)
        stop("interrupted before it was known whether anything fails: nothing is written", status)
    if failure is None:
        rest = f" that could be shown; undecided: {', '.join(unknown)}" if unknown else ""
        click.echo(f"{whole.name}: nothing fails{rest}", err=True)
        sys.exit(EXIT["undecided" if unknown else "as claimed"])
    with progress_bar(failure.manner) as report:
        trials = Trials(failure, until, output.with_suffix(".json"), report, files=made.files)
        small = reduced(whole, trials)
    with replacing(output) as beside:
        words = said_words(context, ("scene", "output", "seconds", "step_budget", "width", "samples", "wanted"))
        shows = again(words, failure.manner, output.name)
        beside.write_text(told(small, failure, shows), encoding="utf-8")
    late = ", and the time was up" if trials.out_of_time else ""
    click.echo(
        f"{failure.manner}: {_size(whole)} became {_size(small)} in {count(trials.asked, 'trial')}{late}: {output}"
    )
    sys.exit(EXIT["not as claimed"])


def again(words: Sequence[str], manner: str, name: str) -> str:
    """The command that shows how a small scene of a file's name fails; ``words`` are options of `reduce`."""
    if manner in (CRASHES, NOT_FINITE, BESIDE):
        return shlex.join(["nusselt", "reduce", name, *words, "-o", "again.test"])
    return shlex.join(["nusselt", "metamorphic", name, *words, "--relation", manner])


def _size(scene: Scene) -> str:
    things = len(scene.meshes) + len(scene.ellipsoids)
    triangles = sum(mesh.triangles.shape[1] for mesh in scene.meshes)
    parts = count(things, "object"), count(triangles, "triangle"), count(len(scene.lights), "light")
    return ", ".join(parts) + f" in {scene.width} x {scene.height} pixels"
