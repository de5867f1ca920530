"""From a scene on which a renderer fails to the smallest on which it fails in the same way."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from nusselt.experiments.check.check import Progress
from nusselt.experiments.files import replacing
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import write_scene

from .ddmin import ddmin
from .failure import STEPS, Failure
from .parts import Part, plainer, things, triangles, with_things, with_triangles


@dataclass
class Trials:
    """What was tried of scenes, by their content: a run that was cut short finds its answers again.

    Parameters
    ----------
    failure : Failure
    until : float
        Of `time.monotonic`: then nothing fails any more, and what is left is the answer.
    kept : Path, optional
        A file of answers.
    files : tuple of Path
        That the renderer is made of: where one has changed since, its answers are not those that were kept.
    """

    failure: Failure
    until: float
    kept: Path | None = None
    progress: Progress | None = None
    known: dict[str, bool] = field(default_factory=dict)
    asked: int = 0
    files: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        if self.kept is not None and self.kept.exists():
            try:
                content = json.loads(self.kept.read_text(encoding="utf-8"))
                question, answers = content["question"], dict(content["answers"])
            except (OSError, ValueError, TypeError, KeyError):
                accepted = "what an earlier reduction kept: another file there would be lost"
                raise InputError("--output, beside it", str(self.kept), accepted) from None
            self.known = answers if question == self.question else {}

    @property
    def question(self) -> str:
        """What answers are to."""
        stamps = [(str(file), file.stat().st_size, file.stat().st_mtime_ns) for file in self.files]
        return repr((self.failure.manner, self.failure.source, self.failure.asking, stamps))

    @property
    def out_of_time(self) -> bool:
        return time.monotonic() > self.until or self.asked >= STEPS

    def fails(self, scene: Scene) -> bool:
        """Whether a scene fails in the same way."""
        key = scene.digest()
        if key not in self.known:
            if self.out_of_time:
                return False
            self.asked += 1
            if self.progress:
                left = len(scene.meshes) + len(scene.ellipsoids) + len(scene.lights)
                self.progress(f"{left} things left", self.asked, STEPS)
            self.known[key] = self.failure.there(scene)
            self._keep()
        return self.known[key]

    def _keep(self) -> None:
        if self.kept is not None:
            with replacing(self.kept) as beside:
                content = {"question": self.question, "answers": self.known}
                beside.write_text(json.dumps(content), encoding="utf-8")


def reduced(scene: Scene, trials: Trials) -> Scene:
    """The smallest scene that is found; each step of the way there fails, proven."""

    def fewer(found: Scene, parts: list[Part], kept: Callable[[Scene, tuple[Part, ...]], Scene]) -> Scene:
        return kept(found, ddmin(parts, lambda some: trials.fails(kept(found, some))))

    while True:
        before = scene
        scene = fewer(scene, things(scene), with_things)
        scene = fewer(scene, triangles(scene), with_triangles)
        scene = _plain(scene, trials)
        if scene == before or trials.out_of_time:
            return scene


def _plain(scene: Scene, trials: Trials) -> Scene:
    """Every simplification that still fails, in turn."""
    done = False
    while not done:
        done = True
        for candidate in plainer(scene):
            if candidate != scene and trials.fails(candidate):
                scene, done = candidate, False
                break
    return scene


def told(scene: Scene, failure: Failure, command: str) -> str:
    """A short scene file that says what is wrong with it, and the command that shows it.

    Raises
    ------
    InputError
        If the scene does not fail when it is read again.
    """
    judged = failure.judged(scene)
    if judged is None or judged.word != "differs":
        raise InputError("scene", scene.name, "one that fails")
    lines = [f"# {failure.source.name}: {failure.manner}: {judged.reason}".replace("\n", " "), f"# {command}"]
    return "\n".join([*lines, "", write_scene(scene)])
