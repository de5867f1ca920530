"""What people look at: ours, the reference, and the signed difference in standard errors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.files import replacing
from nusselt.experiments.images.formats.png import to_levels
from nusselt.experiments.images.write import write_image
from nusselt.experiments.verdict.judge import standard_errors
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.image import Image
from nusselt.renderer.scene import Scene
from nusselt.renderer.vectors import Floats

from .layers import all_layers, image_layers, reference_layers, write_layers
from .schema import Row

RANGE = 4.0
"""The difference is shown from -4 to +4 standard errors in every picture, so that
pictures can be compared."""


def colour_difference(z: np.ndarray[Any, Any]) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Signed standard errors (h, w) as (h, w, 3): blue below, white at zero, red above, fixed at +-4."""
    from matplotlib import colormaps

    shade = colormaps["RdBu_r"](np.clip((z + RANGE) / (2 * RANGE), 0, 1))
    return (255 * shade[..., :3]).round().astype(np.uint8)


def write_difference(path: Path, z: np.ndarray[Any, Any]) -> None:
    """Write signed standard errors (h, w): EXR as numbers of one channel, PNG in colours."""
    if path.suffix == ".exr":
        write_image(path, z[None])
        return
    from PIL import Image

    with replacing(path) as beside:
        Image.fromarray(colour_difference(z)).save(beside)


def write_sides(
    folder: Path,
    name: str,
    image: Image,
    reference: Reference | None,
    z: Floats | None = None,
    scene: Scene | None = None,
) -> dict[str, str]:
    """Write an image called ``name``, the reference and their difference; returns what is where, by name.

    One EXR file beside the folder, called as it is, holds all of it in layers, and what the scene's pixels show.
    """
    found = {f"{name}.png": image.first, f"{name}.exr": image.mean}
    layers, left_out = (image_layers(image), ()) if scene is None else all_layers(image, scene)
    if reference is not None:
        found |= {"reference.png": reference.mean, "reference.exr": reference.mean}
    for file, radiance in found.items():
        write_image(folder / file, radiance)
    names = list(found)
    if reference is not None and z is not None:
        layers |= reference_layers(reference, z)
        for file in ("difference.exr", "difference.png"):
            write_difference(folder / file, z)
            names.append(file)
    write_layers(folder.with_name(f"{folder.name}.exr"), layers, left_out)
    where = {file.replace(".", "_"): f"{folder.name}/{file}" for file in names}
    return where | {"layers_exr": f"{folder.name}.exr"}


def write_pictures(
    row: Row, ours: Image, reference: Reference | None, folder: Path, scene: Scene | None = None
) -> dict[str, str]:
    """Write a row's images into ``folder``; returns what is where, by name."""
    if reference is None:
        return write_sides(folder, "ours", ours, None, scene=scene)
    z = standard_errors(ours, reference, row["passes"])
    _overview(row, ours, reference, z, folder / "overview.png")
    sides = write_sides(folder, "ours", ours, reference, z, scene)
    return sides | {"overview_png": f"{folder.name}/overview.png"}


def _overview(row: Row, ours: Image, reference: Reference, z: np.ndarray[Any, Any], path: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 4.4), layout="constrained")
    axes = figure.subplots(1, 3)
    stratified = " stratified" if row["stratified"] else ""
    axes[0].imshow(to_levels(ours.first).transpose(1, 2, 0))
    axes[0].set_title(f"ours: {row['estimator']}, {row['samples']}{stratified} per light, one pass")
    axes[1].imshow(to_levels(reference.mean).transpose(1, 2, 0))
    axes[1].set_title(f"Mitsuba {reference.version}: {reference.samples} samples per light")
    shown = axes[2].imshow(z, cmap="RdBu_r", vmin=-RANGE, vmax=RANGE)
    axes[2].set_title(f"mean of {row['passes']} passes - reference, in standard errors")
    figure.colorbar(shown, ax=axes[2], shrink=0.8)
    for axis in axes:
        axis.set_axis_off()
    figure.suptitle(f"{row['scene']}: {row['verdict']}. {row['reason']} (seed {row['seed']})", wrap=True)
    with replacing(path) as beside:
        figure.savefig(beside, dpi=100)
