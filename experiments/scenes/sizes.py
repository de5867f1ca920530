"""Scenes in other numbers of pixels."""

from __future__ import annotations

from nusselt.renderer.scene import Scene
from nusselt.renderer.words import count


def at_width(scene: Scene, width: int | None) -> Scene:
    """In so many pixels across, of the same shape; None: in its own.

    Single pixels that are expected to show something are those of the scene's own size: left out of another, and said.
    """
    if width is None or width == scene.width:
        return scene
    lost = (f"{count(len(scene.pixels), 'expectPixel')} left out: of another size",) if scene.pixels else ()
    height = max(1, round(scene.height * width / scene.width))
    return scene.with_(width=width, height=height, pixels=(), warnings=(*scene.warnings, *lost))


def small(scene: Scene, width: int) -> Scene:
    """In fewer pixels of the same shape, if it has more."""
    return scene if scene.width <= width else at_width(scene, width)
