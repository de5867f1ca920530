"""Options of the commands, in groups: each group reaches its command as one frozen object, not as loose words."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from nusselt.experiments.check.question import MOST_SAMPLES, MOST_SEED, PixelRule, ShadowOrigin
from nusselt.experiments.check.request import Reading, SizedReading
from nusselt.renderer.scene import MAX_SIDE

from .places import Place

Callback = Callable[..., Any]
Decorator = Callable[[Callback], Callback]

cluster_option = click.option(
    "--cluster", metavar="ADDRESS", help="Of a Dask scheduler, tcp://HOST:PORT: work goes there; same numbers."
)
seed_option = click.option("--seed", type=click.IntRange(0, MOST_SEED), default=0, show_default=True)


def together(kind: type, name: str, *options: Decorator) -> Decorator:
    """Options that reach the command as one object of a dataclass, its argument ``name``.

    Parameters
    ----------
    kind : type
        A dataclass with a field for each option, of the option's name.
    """
    names = [field.name for field in fields(kind)]

    def decorate(command: Callback) -> Callback:
        @functools.wraps(command)
        def gathered(**values: Any) -> Any:
            group = kind(**{field: values.pop(field) for field in names})
            return command(**values, **{name: group})

        for option in reversed(options):
            gathered = option(gathered)  # type: ignore[assignment]
        return gathered

    return decorate


def said_in(context: click.Context) -> dict[str, Any]:
    """The options that were written on the command line, by their names."""
    return {
        name: value
        for name, value in context.params.items()
        if context.get_parameter_source(name) is not ParameterSource.DEFAULT
    }


@dataclass(frozen=True)
class Sampling:
    """How light is sampled, and what a pixel is; fields as in `Question`."""

    samples: int | None
    stratified: bool | None
    seed: int
    shadow_origin: ShadowOrigin
    pixel_rule: PixelRule | None
    tolerance: float | None


@dataclass(frozen=True)
class Exports:
    """Files for other programs; None: not written."""

    csv: Path | None = None
    junit: Path | None = None
    summary: Path | None = None


@dataclass(frozen=True)
class OwnWords:
    """The user's estimators and renderers, as they were named."""

    with_estimator: tuple[str, ...] = ()
    with_renderer: tuple[str, ...] = ()


@dataclass(frozen=True)
class Output:
    """Where results go: a folder of pictures and results.json, a file or "-" for standard output."""

    out: Path | None = None
    target: str | None = None

    @property
    def results(self) -> str | None:
        """Where results.json goes."""
        return self.target or (str(self.out / "results.json") if self.out else None)


READING = (
    click.option("--lenient", is_flag=True, help="Warn of unknown commands in a scene instead of refusing it."),
    click.option("--two-sided", is_flag=True, help="Surfaces reflect at their back too, on both renderers."),
    click.option("--as-diffuse", is_flag=True, help="Of other programs' files: take other surfaces for diffuse."),
    click.option("--as-mesh", is_flag=True, help="Of Mitsuba's files: take cylinders for meshes."),
)
width_option = click.option("--width", type=click.IntRange(1, MAX_SIDE), help="Pixels across, instead of the scene's.")
reading_options = together(Reading, "reading", *READING)
sized_reading_options = together(SizedReading, "reading", *READING, width_option)

sampling_options = together(
    Sampling,
    "sampling",
    click.option("--samples", type=click.IntRange(1, MOST_SAMPLES), help="Per light, instead of the scene's."),
    click.option("--stratify/--no-stratify", "stratified", default=None, help="Instead of the scene's."),
    seed_option,
    click.option(
        "--shadow-origin",
        type=click.Choice(["surface", "mitsuba"]),
        default="surface",
        show_default=True,
        help="Where shadow rays start: ours, or Mitsuba 3.9's rule, to be wrong as it is.",
    ),
    click.option("--pixel-rule", type=click.Choice(["centre", "area"]), help="Instead of the scene's."),
    click.option(
        "--tolerance",
        type=float,
        help="Relative RMS error of noise-free pixels by area; render: or of interpolated centres.",
    ),
)

json_option = click.option(
    "--json",
    "target",
    type=Place(dash=True),
    metavar="FILE|-",
    help="Write the results there ('-': standard output).",
)

output_options = together(
    Output,
    "output",
    click.option("--out", type=Place(folder=True), metavar="FOLDER", help="For pictures, tables and results.json."),
    json_option,
)

verbose_option = click.option("-v", "--verbose", is_flag=True, help="List what each scene did not need, and why.")

exports_options = together(
    Exports,
    "exports",
    *(
        click.option(f"--{name}", metavar="FILE", type=Place(), help=f"The rows there as {words}.")
        for name, words in (("csv", "CSV"), ("junit", "JUnit XML"), ("summary", "Markdown under 1 MiB"))
    ),
)

own_options = together(
    OwnWords,
    "own",
    click.option(
        "--with", "with_estimator", metavar="MODULE:NAME", multiple=True, help="An estimator of yours; may be repeated."
    ),
    click.option("--with-renderer", metavar="COMMAND", multiple=True, help="A renderer of yours; may be repeated."),
)

quick_option = click.option("--quick", is_flag=True, help="Small images, few samples.")
