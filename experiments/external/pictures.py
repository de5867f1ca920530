"""What was brought, the truth, the difference in standard errors, and the truth with the mistake that was named."""

from __future__ import annotations

from pathlib import Path

from nusselt.experiments.images.write import write_image
from nusselt.experiments.results.pictures import write_sides
from nusselt.experiments.verdict.judge import standard_errors
from nusselt.renderer.scene import Scene

from .comparison import Comparison


def write_comparison(told: Comparison, folder: Path, scene: Scene | None = None) -> dict[str, str]:
    """Write the pictures of one comparison; returns what is where, by name."""
    sides = told.sides
    z = standard_errors(sides.image, sides.reference, sides.images)
    where = write_sides(folder, "brought", sides.image, told.truth.reference, z, scene)
    if told.mistaken is not None:
        for ending in ("png", "exr"):
            write_image(folder / f"mistaken.{ending}", told.mistaken)
            where[f"mistaken_{ending}"] = f"{folder.name}/mistaken.{ending}"
    return where
