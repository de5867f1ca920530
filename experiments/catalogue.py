"""The classic scenes, by name."""

from __future__ import annotations

import re
from pathlib import Path

from renderer.errors import InputError
from renderer.scene import Scene
from renderer.scene_text import read_scene

from .generated import GENERATED, generated

FOLDER = Path(__file__).parent / "scenes"

CLASSIC = (
    "quad",
    "quad-random",
    "quad-stratified",
    "three-lights",
    "cornell",
    "cornell-boxes",
    "glossy",
    "unshadowed",
    "horizon",
    "near-light",
    "lonely",
)
"""In the order in which the README tells of them."""


def summary(name: str) -> str:
    """What a classic scene shows: the first sentence of its file's opening comment."""
    if name in GENERATED:
        return GENERATED[name].summary
    words = []
    for line in (FOLDER / f"{name}.test").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            break
        words.append(line.lstrip("# ").strip())
    return re.split(r"[.:](?:\s|$)", " ".join(words))[0]


def load(name: str, lenient: bool = False) -> Scene:
    """A scene by file name, or a classic or generated one by its name.

    Raises
    ------
    InputError
        If there is no such file, or its content is not a scene.
    """
    path = Path(name)
    if name in GENERATED and not path.exists():
        return generated(name)
    if name in CLASSIC and not path.exists():
        path = FOLDER / f"{name}.test"
    elif not path.exists():
        raise InputError("scene", name, "a scene file, or one of " + ", ".join((*CLASSIC, *GENERATED)))
    return read_scene(path, lenient=lenient).with_(name=path.stem)
