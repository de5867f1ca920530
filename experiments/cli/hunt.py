"""`nusselt hunt`: random scenes for a renderer, and what is wrong with it, each cause once."""

from __future__ import annotations

import math
import shlex
import sys
import time
from dataclasses import replace
from pathlib import Path

import click

from nusselt.experiments.check.question import PixelRule
from nusselt.experiments.hunt.hunt import Hunt, Question
from nusselt.experiments.hunt.page import headline, lines, scene_file, write_page
from nusselt.experiments.hunt.scenes import EXTREMES, NAMES
from nusselt.experiments.hunt.trial import KNOWN
from nusselt.experiments.metamorphic.ask import Asking
from nusselt.experiments.metamorphic.peer_source import PeerSource
from nusselt.experiments.metamorphic.sources import MITSUBA
from nusselt.experiments.reduce.failure import BESIDE
from nusselt.experiments.results.status import EXIT
from nusselt.experiments.terminal.group import stop
from nusselt.experiments.terminal.options import seed_option, together
from nusselt.experiments.terminal.places import Place
from nusselt.experiments.terminal.progress import ERRORS, progress_bar
from nusselt.mitsuba_bridge.process import ReferenceUnavailable

from .made import OPTIONS, Made
from .reduce import again
from .rerun import said_words

ELSEWHERE = ("scenes", "out", "minutes", "cannot", "also", "blind", "estimator", "width", "samples", "margin", "rule")
"""Of which a cause's own command says nothing: its scene does."""


@click.command(name="hunt")
@together(Made, "made", *OPTIONS, click.option("--estimator", multiple=True, metavar="NAME", help="See: list."))
@click.option("--scenes", type=click.IntRange(1, 1_000_000), default=100, show_default=True, help="How many.")
@click.option("--minutes", type=click.FloatRange(0, min_open=True), default=math.inf, help="In all, at most.")
@click.option("--out", type=Place(folder=True), required=True, metavar="FOLDER", help="The page, and scenes as files.")
@click.option(
    "--pixel-rule", "rule", type=click.Choice(["centre", "area"]), help="What pixels show.  [default: centre, a peer's]"
)
@click.option("--cannot", type=click.Choice(NAMES), multiple=True, help="What the renderer does not know.")
@click.option("--also", type=click.Choice(EXTREMES), multiple=True, help="Scenes that single precision cannot show.")
@click.option("--blind", is_flag=True, help="All images first, and their number told; only then the exact ones.")
@click.option("--margin", type=float, default=0.01, show_default=True, help="Relative difference that does not matter.")
@click.option(
    "--alpha", type=float, default=1e-3, show_default=True, help="Chance that a right renderer fails, in all."
)
@click.option("--runs", type=click.IntRange(2, 256), default=4, show_default=True, help="Seeds of every image.")
@seed_option
@click.pass_context
def command(
    context: click.Context,
    /,
    *,
    made: Made,
    minutes: float,
    out: Path,
    scenes: int,
    rule: PixelRule | None,
    cannot: tuple[str, ...],
    also: tuple[str, ...],
    blind: bool,
    **asked: object,
) -> None:
    """Hunt for bugs: random scenes for a renderer, judged by exact images and by relations, each cause told once.

    The same command goes on where it was interrupted.

    \b
    nusselt hunt --renderer "./mine {scene} {samples} {seed} {output}" --scenes 200 --out hunt
    """
    makers = [replace(made, estimator=name) for name in made.estimator or (None,)]
    asking = Asking(**asked | {"alpha": float(str(asked["alpha"])) / len(makers)})  # type: ignore[arg-type]
    size, samples = made.width or Question.size, made.samples or Question.samples
    peer = source if isinstance(source := makers[0].source, PeerSource) else None
    if peer:
        samples, cannot = made.samples or peer.samples, tuple(dict.fromkeys((*cannot, *peer.cannot)))
        click.echo(f"{peer.peer.title}: surfaces of two sides, without {', '.join(cannot)}", err=True)
    rule = rule or (peer.peer.rule if peer else "centre")
    question = Question(asking, scenes, size, samples, cannot, also, blind, peer is not None, rule)
    said, share, verdicts = said_words(context, ELSEWHERE), 60 * minutes / len(makers), set[str]()
    for maker in makers:
        hunt = Hunt(question, maker.source, out / str(maker.estimator) if len(makers) > 1 else out)
        cut = _run(hunt, time.monotonic() + share)
        words = said + (["--estimator", maker.estimator] if maker.estimator else [])
        _tell(hunt, [_shows(maker, words, hunt, number) for number in range(len(hunt.causes.known))])
        verdicts |= {str(entry.get("verdict")) for entry in hunt.scenes.values()}
        if cut:
            stop("interrupted: what was finished is written, and the same command goes on", 130)
    sys.exit(EXIT["not as claimed" if "differs" in verdicts else "as claimed" if "agrees" in verdicts else "undecided"])


def _tell(hunt: Hunt, shows: list[str]) -> None:
    """The page, and in a few lines what it says."""
    write_page(hunt, shows, shlex.join(["nusselt", *sys.argv[1:]]))
    click.echo(f"{hunt.source.name}: {headline(hunt)}: {hunt.place / 'hunt.html'}")
    for line in lines(hunt):
        click.echo(f"  {line}")


def _shows(made: Made, words: list[str], hunt: Hunt, number: int) -> str:
    """The command that shows how a cause's smallest scene fails."""
    asking, name = hunt.question.asking, scene_file(number)
    margin, manner = ["--margin", f"{asking.margin:g}"], hunt.causes.known[number].failing.manner
    if manner not in (BESIDE, KNOWN):
        return again([*words, *margin, *(["--two-sided"] if hunt.question.two_sided else [])], manner, name)
    if isinstance(hunt.source, PeerSource):
        return shlex.join(["nusselt", "cross", name, "--peers", hunt.source.name, "--two-sided", *margin])
    margin += ["--pixel-rule", "area"] if hunt.question.rule == "area" else []
    who = ["--estimator", made.estimator or "exact"]
    if made.renderer not in (None, MITSUBA):
        who = ["--renderer", str(made.renderer), "--image-type", made.image_type, "--steps", "1"]
        who += ["--runs", str(asking.runs)]
    return shlex.join(["nusselt", "check", name, *who, *margin])


def _run(hunt: Hunt, until: float) -> bool:
    """Whether it was interrupted."""
    with progress_bar("hunt") as report:
        try:
            hunt.run(until, report, lambda line: ERRORS.print(line, soft_wrap=True))
        except ReferenceUnavailable as problem:
            stop(str(problem), EXIT["no reference"])
        except KeyboardInterrupt:
            return True
    return False
