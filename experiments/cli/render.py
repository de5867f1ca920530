"""`nusselt render`: our image alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nusselt.experiments.check.adaptive import render_until
from nusselt.experiments.check.bounds import bound_note
from nusselt.experiments.check.check import chosen_estimator, draw_area, with_pixel_rule
from nusselt.experiments.check.negative import negative_note
from nusselt.experiments.check.rows import notes
from nusselt.experiments.images.write import check_image_name, write_image
from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.terminal.options import cluster_option, sampling_options
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.workers import worker_pool
from nusselt.renderer.image import render
from nusselt.renderer.pixels import AreaImage, CentreImage, render_centre
from nusselt.renderer.prepared import prepare


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="IMAGE.png, .exr or .npy")
@sampling_options
@cluster_option
@click.option("--error", type=float, help="Sample until the relative RMS error is at most this; see common-points.")
def command(scene: str, output: Path, error: float | None, **options: Any) -> None:
    """Our image of SCENE alone; needs no Mitsuba.

    \b
    nusselt render cornell --samples 25 --stratify -o cornell.png
    nusselt render mesh --error 1e-3 -o mesh.png
    """

    run_render(scene, output, error, options)


def run_render(scene: str, output: Path, error: float | None, options: dict[str, Any]) -> None:
    """Render a scene, at a requested ``error`` if one is named, and write it."""
    check_image_name(output)
    read = load(scene, options["lenient"]).with_(two_sided=options["two_sided"])
    rule, tolerance = options["pixel_rule"], 1e-3 if options["tolerance"] is None else options["tolerance"]
    read = with_pixel_rule(read, rule)
    name = options["estimator"] or (None if error is None else "common-points")
    estimator = chosen_estimator(read, name, options["samples"], options["stratified"])
    for warning in read.warnings:
        click.echo(f"warning: {warning}", err=True)
    for note in notes(read, estimator):
        click.echo(f"warning: {note}", err=True)
    offset = None
    if options["shadow_origin"] == "mitsuba":
        from nusselt.mitsuba_bridge.ray_offset import mitsuba_offset

        offset = mitsuba_offset(read)
    with worker_pool(options["cluster"]) as pool, progress_bar(read.name) as report:

        def told(done: int, total: int) -> None:
            report("tiles", done, total)

        between = rule == "centre" and options["tolerance"] is not None and offset is None
        area: AreaImage | CentreImage | None = None
        if error is None and between and not estimator.is_random(prepare(read).needs):
            area = render_centre(read, estimator, tolerance=tolerance, executor=pool)
        elif error is None:
            area = draw_area(read, estimator, rule, tolerance, pool)
        if area is not None:
            image = area.image
            if area.error > tolerance:
                click.echo(f"warning: the error may be {area.error:.1e}, above the tolerance {tolerance:g}", err=True)
        elif error is None:
            image = render(read, estimator, seed=options["seed"], executor=pool, offset=offset, progress=told)
        else:
            reached = render_until(
                read, estimator, error, seed=options["seed"], executor=pool, progress=told, offset=offset
            )
            image = reached.image
            said = f"relative RMS error {reached.error:.2g}, from 8 independent passes of {reached.samples} samples"
            click.echo(said if reached.error else "no sampling error", err=True)
    if image.back_faces:
        click.echo(f"warning: {image.back_faces} pixels show the black back of a one-sided surface", err=True)
    if image.bound is not None:
        click.echo(bound_note(image), err=True)
    if note := negative_note(image, estimator, estimator.claim(prepare(read).needs)):
        click.echo(f"warning: {note}", err=True)
    write_image(output, image.mean)
