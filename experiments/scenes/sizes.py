"""Scenes in other numbers of pixels."""

from __future__ import annotations

from nusselt.renderer.scene import Scene


def at_width(scene: Scene, width: int | None) -> Scene:
    """In so many pixels across, of the same shape; None: in its own."""
    if width is None:
        return scene
    return scene.with_(width=width, height=max(1, round(scene.height * width / scene.width)))


def small(scene: Scene, width: int) -> Scene:
    """In fewer pixels of the same shape, if it has more."""
    return scene if scene.width <= width else at_width(scene, width)
