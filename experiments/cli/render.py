"""`nusselt render`: our image alone."""

from __future__ import annotations

from pathlib import Path

import click

from nusselt.experiments.check.draw import Drawing, draw
from nusselt.experiments.check.layers import drawn_layers
from nusselt.experiments.check.request import SizedReading
from nusselt.experiments.images.write import check_image_name, write_image
from nusselt.experiments.results.layers import check_layered_name, write_layers
from nusselt.experiments.terminal.options import Sampling, cluster_option, sampling_options, sized_reading_options
from nusselt.experiments.terminal.places import Place
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.workers import PATIENCE, worker_pool


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=Place(), required=True, help="IMAGE.png, .exr or .npy")
@click.option("--estimator", metavar="NAME", help="Instead of the one the scene asks for; see: nusselt list.")
@sampling_options
@sized_reading_options
@cluster_option
@click.option("--bits", type=click.Choice(["8", "16"]), help="Of a .png's levels; 8 unless said.")
@click.option("--aovs", is_flag=True, help="Into an .exr, in layers: lights, visibility, depth, normal, albedo, noise.")
@click.option("--error", type=float, help="Sample until the relative RMS error is at most this; see common-points.")
def command(
    *,
    scene: str,
    output: Path,
    estimator: str | None,
    sampling: Sampling,
    reading: SizedReading,
    cluster: str | None,
    bits: str | None,
    aovs: bool,
    error: float | None,
) -> None:
    """Our image of SCENE alone; needs no Mitsuba.

    \b
    nusselt render cornell --samples 25 --stratify -o cornell.png
    nusselt render mesh --error 1e-3 -o mesh.png
    nusselt render three-lights --estimator exact --aovs -o three-lights.exr
    """
    levels = int(bits) if bits else None
    check_image_name(output, levels)
    check_layered_name(output, aovs)
    drawing = Drawing(estimator=estimator, **vars(sampling), error=error)
    read = reading.scene(scene, drawing.pixel_rule)
    with worker_pool(cluster, PATIENCE) as pool, progress_bar(read.name) as report:
        drawn = draw(read, drawing, pool, lambda done, total: report("tiles", done, total))
        layers, left_out = drawn_layers(read, drawn.image, drawing, pool) if aovs else ({}, ())
    for warning in drawn.warnings:
        click.echo(f"warning: {warning}", err=True)
    for sentence in (*drawn.told, *(f"left out: {what}" for what in left_out)):
        click.echo(sentence, err=True)
    if layers:
        write_layers(output, layers, left_out)
    else:
        write_image(output, drawn.image.mean, levels)
