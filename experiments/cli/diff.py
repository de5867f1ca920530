"""`nusselt diff`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
import numpy as np

from nusselt.experiments.files import replacing
from nusselt.experiments.images.distance import Pair
from nusselt.experiments.images.formats import Raw, Wanted
from nusselt.experiments.images.read import quantiser_of, read_image, size_of
from nusselt.experiments.results.report.pair import pair_html
from nusselt.experiments.terminal.places import Place
from nusselt.renderer.errors import InputError
from nusselt.renderer.vectors import Floats

from .check_options import quantisation_option, transfer_option


@click.command()
@click.argument("a", metavar="A")
@click.argument("b", metavar="B")
@click.option("-o", "--output", type=Place(), required=True, help="DIFF.html")
@click.option("--seeds", nargs=2, multiple=True, metavar="A2 B2", help="Another seed of each; may be repeated.")
@transfer_option
@quantisation_option
def command(
    *, a: str, b: str, output: Path, seeds: tuple[tuple[str, str], ...], transfer: str, quantisation: str
) -> None:
    """One offline HTML page of two images alone: flip, signed difference, relative MSE, SSIM, FLIP.

    Nothing is judged. With --seeds, the difference in standard errors too.

    \b
    nusselt diff mine.exr theirs.exr -o diff.html
    nusselt diff a1.exr b1.exr --seeds a2.exr b2.exr -o diff.html
    """
    names = [name for both in ((a, b), *seeds) for name in both]
    raws = _read(names)
    images = _decoded(raws, transfer, quantisation)
    pair = Pair(np.stack(images[::2]), np.stack(images[1::2]), levels=any(raw.levels for raw in raws))
    notes = [f"{name}: {note}" for name, raw in zip(names, raws, strict=True) for note in _said(raw, transfer)]
    page, figures = pair_html(pair, (a, b), notes)
    with replacing(output) as beside:
        beside.write_text(page, encoding="utf-8")
    for note in notes:
        click.echo(note, err=True)
    click.echo(f"{output}: " + ", ".join(f"{figure['question']} {figure['answer']}" for figure in figures))


def _read(names: Sequence[str]) -> list[Raw]:
    """Every image, all of the first one's size."""
    sizes = [size_of(name) for name in names]
    for name, size in zip(names, sizes, strict=True):
        if size != sizes[0]:
            raise InputError(
                "image", f"{size[0]} x {size[1]} pixels", f"{sizes[0][0]} x {sizes[0][1]}, as {names[0]}", name
            )
    return [read_image(name, Wanted(*sizes[0])) for name in names]


def _decoded(raws: Sequence[Raw], transfer: str, quantisation: str) -> list[Floats]:
    """Radiance of each; a curve is for those that hold levels, and refused where none does."""
    if not any(raw.levels for raw in raws):
        quantiser_of([raws[0]], transfer, quantisation)
    said = {True: (transfer, quantisation), False: ("linear", "auto")}
    return [quantiser_of([raw], *said[raw.levels > 0]).decode(raw) for raw in raws]


def _said(raw: Raw, transfer: str) -> list[str]:
    return [*raw.notes, *([raw.encoding] if raw.encoding and transfer == "linear" else [])]
