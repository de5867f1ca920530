"""The options of `nusselt check` alone, in their groups."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click

from nusselt.experiments.external.judge import External
from nusselt.experiments.images.read import READERS
from nusselt.experiments.terminal.options import together
from nusselt.experiments.terminal.tev import Tev, TevAddress


@dataclass(frozen=True)
class Kept:
    """References that are there already: a file, a folder of them by content."""

    reference: Path | None = None
    cache: Path | None = None


@dataclass(frozen=True)
class Judging:
    """What a verdict is held to; fields as in `Question` and `Level`."""

    margin: float
    alpha: float
    timeout: float


@dataclass(frozen=True)
class UntilDecided:
    """Whether passes are added until a row is decided, for how many seconds, and where that is watched."""

    until_decided: bool = False
    budget: float = 600.0
    tev: Tev | None = None


transfer_option = click.option(
    "--transfer", default="linear", show_default=True, help="Curve of levels: linear, srgb, gamma:2.2."
)
quantisation_option = click.option(
    "--quantisation", default="auto", show_default=True, help="Of levels: truncate, round, floor256 or auto."
)

external_options = together(
    External,
    "external",
    transfer_option,
    quantisation_option,
    click.option(
        "--noise",
        type=click.Choice(["any", "expected"]),
        default="any",
        show_default=True,
        help="expected: other noise than our estimator's is not as claimed (status 1).",
    ),
    click.option("--renderer", metavar="COMMAND", help="A program with {scene} {xml} {samples} {seed} {output}."),
    click.option(
        "--image-type",
        type=click.Choice(list(READERS)),
        default=".exr",
        show_default=True,
        help="What {output} ends in.",
    ),
    click.option("--runs", type=click.IntRange(1, 256), default=4, show_default=True, help="Seeds of --renderer."),
    click.option("--steps", type=click.IntRange(1, 8), default=3, show_default=True, help="Times 4 samples each."),
    click.option("--run-timeout", type=click.FloatRange(0, min_open=True), default=600.0, show_default=True),
)

kept_options = together(
    Kept,
    "kept",
    click.option("--reference", type=click.Path(path_type=Path), help="A kept one; see: nusselt reference."),
    click.option("--cache", type=click.Path(path_type=Path), help="Folder to keep references in, by content."),
)

judging_options = together(
    Judging,
    "judging",
    click.option("--margin", type=float, default=1e-3, show_default=True, help="Relative bias that does not matter."),
    click.option("--alpha", type=float, default=1e-3, show_default=True, help="False-alarm rate of the whole report."),
    click.option("--timeout", type=float, default=600.0, show_default=True, help="Seconds for one reference."),
)

until_decided_options = together(
    UntilDecided,
    "until",
    click.option("--until-decided", is_flag=True, help="Add passes to undecided scenes; they are kept under --out."),
    click.option("--budget", type=float, default=600.0, show_default=True, help="Seconds for --until-decided."),
    click.option("--tev", type=TevAddress(), help="Of a running tev: watch ours, theirs and z of --until-decided."),
)
