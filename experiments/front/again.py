"""What makes a row of `nusselt.check` again: the command where words can say it, else the call."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Any

from nusselt.experiments.check.estimators import path_of
from nusselt.experiments.check.request import SceneLike
from nusselt.renderer.scene import Scene


def again(scene: SceneLike, said: Mapping[str, Any]) -> str:
    """A shell command, or a call of Python for scenes, images and renderers that have no name outside it."""
    from nusselt.experiments.cli.rerun import ELSEWHERE, shell_command

    options = {name: value for name, value in said.items() if value is not None and name not in ELSEWHERE}
    images = options.get("images", ())
    files = images if isinstance(images, list | tuple) else (images,)
    words = (scene, *files, options.get("renderer", ""), options.get("estimator", ""))
    if all(isinstance(word, str | PathLike) or _importable(word) for word in words):
        from nusselt.experiments.cli.check import command

        if "estimator" in options:
            options["estimator"] = (_word(options["estimator"]),)
        options.pop("images", None)
        return shell_command(command, str(scene), options, [str(name) for name in files])
    told = ", ".join([_shown(scene), *(f"{name}={_shown(value)}" for name, value in options.items())])
    return f"nusselt.check({told})"


def _importable(word: object) -> bool:
    return isinstance(word, type) and word.__module__ != "__main__" and "." not in word.__qualname__


def _word(estimator: object) -> str:
    return path_of(estimator) if isinstance(estimator, type) else str(estimator)


def _shown(value: object) -> str:
    if isinstance(value, str | PathLike):
        return repr(str(value))
    if isinstance(value, Scene):
        return f"<scene {value.name}>"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_shown, value))}]"
    if isinstance(value, bool | int | float):
        return repr(value)
    name = getattr(value, "__qualname__", "<>")
    if "<" not in name:
        return str(name)
    return f"<{getattr(value, '__name__', type(value).__name__).strip('<>')}>"  # no name that could be typed
