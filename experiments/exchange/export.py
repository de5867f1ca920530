"""A scene as a file of another program's text."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from nusselt.experiments.files import replacing
from nusselt.renderer.scene import Scene

from .pbrt import pbrt_text
from .usd import usd_text

WRITERS: dict[str, Callable[[Scene], str]] = {".pbrt": pbrt_text, ".usda": usd_text}
"""By the ending of their names."""


def write_text(scene: Scene, target: Path) -> list[str]:
    """Write a scene, whole or not at all; what is to be said of the file, in plain sentences.

    Raises
    ------
    InputError
        For what the format cannot say, or a place that cannot be written to.
    """
    suffix = target.suffix.lower()
    text = WRITERS[suffix](scene)
    with replacing(target) as beside:
        beside.write_text(text, encoding="utf-8")
    notes = ["how the scene samples its lights, and its pixels, is not in the file"]
    if scene.sensors:
        notes.append("sensors are not in the file")
    if suffix == ".pbrt" and not scene.two_sided:
        notes.append("the scene's surfaces are black at their backs; pbrt's reflect there too")
    return notes
