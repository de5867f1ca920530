"""What was brought, the truth, and the difference in standard errors, beside each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nusselt.experiments.files import replacing
from nusselt.experiments.images.write import write_image
from nusselt.experiments.results.pictures import colour_difference
from nusselt.experiments.verdict.judge import standard_errors

from .comparison import Comparison


def write_comparison(told: Comparison, folder: Path) -> dict[str, str]:
    """Write the pictures of one comparison; returns what is where, by name."""
    from PIL import Image

    sides = told.sides
    found = {"brought.png": sides.image.first, "brought.exr": sides.image.mean}
    found |= {"reference.png": told.truth.reference.mean, "reference.exr": told.truth.reference.mean}
    for name, radiance in found.items():
        write_image(folder / name, radiance)
    z = standard_errors(sides.image, sides.reference, sides.images)
    with replacing(folder / "difference.png") as beside:
        Image.fromarray(colour_difference(np.nan_to_num(z))).save(beside)
    names = [*found, "difference.png"]
    return {name.replace(".", "_"): f"{folder.name}/{name}" for name in names}
