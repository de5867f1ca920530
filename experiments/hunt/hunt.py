"""The hunt: scenes drawn, rendered, judged and explained, one after the other; kept, so that it goes on where it ended.

Its number is a hash (SHA-256) over the seed, every scene and every value of every image. In a blind hunt it is told
before the first exact image is made: who knew it then sees later that no seed, scene or image was exchanged once the
truth was known. It proves nothing of what was tried before; and it comes again only if the images do, bit by bit.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import PixelRule
from nusselt.experiments.files import replacing
from nusselt.experiments.metamorphic.ask import Asking
from nusselt.experiments.metamorphic.sources import Source
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import parse_scene, write_scene

from .causes import Cause, Causes
from .scenes import drawn
from .trial import RELATING, Failing, Shots, Trial


@dataclass(frozen=True)
class Question:
    """What is hunted for.

    ``asking.alpha`` is the chance that a right renderer is called wrong by any of the ``scenes``, of ``size`` pixels a
    side and ``samples`` a light; ``cannot``, ``also``, ``two_sided`` and ``rule`` as in `drawn`; ``blind``: all images
    first.
    """

    asking: Asking
    scenes: int = 100
    size: int = 32
    samples: int = 16
    cannot: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    blind: bool = False
    two_sided: bool = False
    rule: PixelRule = "centre"


@dataclass
class Hunt:
    """A hunt as far as it is; ``place`` is its folder."""

    question: Question
    source: Source
    place: Path
    scenes: dict[str, dict[str, Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.causes = Causes(self.trial, self.question.asking)
        if self._state.exists():
            self._read()

    def trial(self, scene: Scene) -> Trial:
        """A scene before the renderer."""
        return Trial(scene, self.source, self.question.asking, self.question.scenes * (1 + RELATING))

    @property
    def number(self) -> str:
        """Of the seed, the scenes and the images so far."""
        told = [f"{name} {entry['scene']} {entry['images']}" for name, entry in self.scenes.items()]
        return hashlib.sha256("\n".join([str(self.question.asking.seed), *told]).encode()).hexdigest()

    def run(self, until: float, progress: Progress, tell: Callable[[str], None]) -> None:
        """Go on until all scenes are done, or to a time of `time.monotonic`; a blind hunt collects for half of it."""
        asked, self.causes.until = self.question, until
        collect = (time.monotonic() + until) / 2 if asked.blind else until
        waiting: list[tuple[Trial, Shots]] = []
        size = asked.size, asked.size
        scenes = drawn(asked.asking.seed, size, asked.samples, asked.cannot, asked.also, asked.two_sided, asked.rule)
        for number, scene in enumerate(islice(scenes, asked.scenes)):
            if time.monotonic() > collect:
                break
            progress(scene.name, number, asked.scenes)
            if "verdict" not in self.scenes.get(scene.name, {}):
                trial = self.trial(scene)
                waiting.append((trial, self._shots(trial)))
                if not asked.blind:
                    self._judge(*waiting.pop())
        if waiting:
            tell(f"{len(self.scenes)} scenes are rendered, no exact image is made yet: number {self.number}")
        for number, (trial, shots) in enumerate(waiting):
            progress(f"judging {trial.scene.name}", number, len(waiting))
            if time.monotonic() < until:
                self._judge(trial, shots)

    def _shots(self, trial: Trial) -> Shots:
        """Its images, which are those whose number was told, if one was."""
        scene, shots = trial.scene, trial.shots()
        entry = {"scene": scene.digest(), "images": shots.digest}
        if self.scenes.setdefault(scene.name, entry) != entry:
            raise InputError("images", scene.name, "those of this hunt's number: the renderer gives others now")
        self._write()
        return shots

    def _judge(self, trial: Trial, shots: Shots) -> None:
        word, failing = trial.judged(shots)
        if failing is not None:
            self.causes.explain(trial.scene, failing)
        self.scenes[trial.scene.name]["verdict"] = word
        self._write()

    @property
    def _state(self) -> Path:
        return self.place / "hunt.json"

    @property
    def _asked(self) -> str:
        return repr((self.question, self.source))

    def _write(self) -> None:
        causes = [
            asdict(cause) | {"scene": write_scene(cause.scene.with_(output="scene.png"))} for cause in self.causes.known
        ]
        content = {"question": self._asked, "number": self.number, "scenes": self.scenes, "causes": causes}
        with replacing(self._state) as beside:
            beside.write_text(json.dumps(content, indent=1), encoding="utf-8")

    def _read(self) -> None:
        try:
            content = json.loads(self._state.read_text(encoding="utf-8"))
            if content["question"] != self._asked:
                raise ValueError("another seed, renderer or option")
            self.scenes, self.causes.known = content["scenes"], [self._cause(entry) for entry in content["causes"]]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError("--out", str(self.place), f"a folder without another hunt ({error})") from error

    def _cause(self, entry: dict[str, Any]) -> Cause:
        failing = Failing(**entry["failing"] | {"names": tuple(entry["failing"]["names"])})
        scene = parse_scene(entry["scene"]).with_(two_sided=self.question.two_sided)
        return Cause(failing, tuple(entry["needs"]), scene, entry["shown"], tuple(entry["seen"]))
