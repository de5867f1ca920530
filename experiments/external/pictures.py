"""What was brought, the truth, and the difference in standard errors, beside each other."""

from __future__ import annotations

from pathlib import Path

from nusselt.experiments.results.pictures import write_sides
from nusselt.experiments.verdict.judge import standard_errors
from nusselt.renderer.scene import Scene

from .comparison import Comparison


def write_comparison(told: Comparison, folder: Path, scene: Scene | None = None) -> dict[str, str]:
    """Write the pictures of one comparison; returns what is where, by name."""
    sides = told.sides
    z = standard_errors(sides.image, sides.reference, sides.images)
    return write_sides(folder, "brought", sides.image, told.truth.reference, z, scene)
