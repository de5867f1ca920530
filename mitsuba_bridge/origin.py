"""A scene that was read from a Mitsuba file, or dict, is that file's as long as nothing of it is changed."""

from __future__ import annotations

from typing import Any

from nusselt.renderer.scene import Scene


def content(scene: Scene) -> str:
    """What stays the same where only the image's size and sampling change."""
    return scene.with_(width=1, height=1, spp=1, light_samples=1, stratify=False, integrator="direct").digest()


def own_file(scene: Scene) -> dict[str, Any] | None:
    """The file that a scene still is, and its numbers of the lights; None for scenes of ours, and changed ones."""
    origin = scene.origin
    if origin is None or origin.content != content(scene):
        return None
    return {"file": origin.file, "words": origin.words, "lights": list(origin.lights)}
