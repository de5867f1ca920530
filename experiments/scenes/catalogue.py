"""The classic scenes, by name."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import read_scene

from .procedural import GENERATED, generated

FOLDER = Path(__file__).parent
OTHERS = {
    ".xml": ("nusselt.mitsuba_bridge.own", "read_mitsuba"),
    ".pbrt": ("nusselt.experiments.exchange.pbrt", "read_pbrt"),
    **dict.fromkeys((".usda", ".usdc", ".usd", ".usdz"), ("nusselt.experiments.exchange.usd", "read_usd")),
}
"""Readers of other programs' scenes, by the ending of their names: imported when there is something to read."""

CLASSIC = (
    "quad",
    "quad-random",
    "quad-stratified",
    "three-lights",
    "cornell",
    "cornell-boxes",
    "cornell-glossy",
    "glossy",
    "unshadowed",
    "horizon",
    "near-light",
    "lonely",
)
"""In the order in which the README tells of them."""
ALSO_EXACT = ("three-lights", "cornell", "cornell-boxes", "cornell-glossy")
"""Those whose soft shadows have no noise with the estimator `exact`: checked a second time with it."""


DARK = ("lonely",)
"""Those without light, where nothing can be judged."""


@dataclass(frozen=True)
class Asked:
    """A scene by name, and the estimator to check it with; None: its own."""

    scene: str
    estimator: str | None = None


def classic(estimator: str | None) -> list[Asked]:
    """What is checked when all classic scenes with a light are: with the estimator asked for, or all that suit them."""
    lit = [name for name in CLASSIC if name not in DARK]
    if estimator is not None:
        return [Asked(name, estimator) for name in lit]
    return [Asked(name, kind) for name in lit for kind in (None, "exact") if not kind or name in ALSO_EXACT]


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


def file_of(name: str) -> Path | None:
    """The file of a scene, or of a classic one by its name; None where there is none."""
    path = Path(name)
    if name in CLASSIC and (path.is_dir() or not path.exists()):
        return FOLDER / f"{name}.test"
    return path if path.is_file() else None


def load(name: str, lenient: bool = False, as_diffuse: bool = False, as_mesh: bool = False) -> Scene:
    """A scene by file name (our text, or what `OTHERS` lists), or a classic or generated one by its name.

    Raises
    ------
    InputError
        If there is no such file, or its content is not a scene.
    """
    path = Path(name)
    taken = path.exists() and not path.is_dir()  # a folder of that name, as of results, is none
    if name in GENERATED and not taken:
        return generated(name)
    if name in CLASSIC and not taken:
        return read_scene(FOLDER / f"{name}.test", lenient=lenient).with_(name=name)
    if not path.exists():
        raise InputError("scene", name, "a scene file, or one of " + ", ".join((*CLASSIC, *GENERATED)))
    if path.suffix.lower() in OTHERS:
        module, reader = OTHERS[path.suffix.lower()]
        meshes = {"as_mesh": as_mesh} if path.suffix.lower() == ".xml" else {}
        found: Scene = getattr(import_module(module), reader)(path, as_diffuse=as_diffuse, **meshes)
        return found
    if kind := import_module("nusselt.experiments.images.kinds").kind_of(path):
        raise InputError("scene", f"a {kind.lstrip('.')} image", "a scene file, which is text", name)
    return read_scene(path, lenient=lenient).with_(name=path.stem)
