"""Images of the independent renderer before the judge of brought images: what both studies of them share."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import Question, with_pixel_rule
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.external.comparison import Comparison
from nusselt.experiments.external.ground_truth import ground_truth
from nusselt.experiments.external.judge import External, Judging, judge_images
from nusselt.experiments.independent.plain_scenes import PLAIN
from nusselt.experiments.scenes import catalogue
from nusselt.experiments.scenes.sizes import small
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.scene import Scene
from nusselt.renderer.scene_text import parse_scene
from nusselt.renderer.vectors import Floats

from .written_images import Written

TIMEOUT = 300.0
"""Seconds for one reference."""


def text_of(name: str) -> str:
    """The text of a plain or a classic scene, or of a file."""
    path = catalogue.file_of(name)
    return PLAIN[name] if name in PLAIN or path is None else path.read_text(encoding="utf-8")


@lru_cache(maxsize=256)
def scene_named(name: str, width: int, rule: str | None = None) -> Scene:
    """The same scene as our reader has it, by a pixel rule."""
    scene = small(parse_scene(text_of(name)).with_(name=name), width)  # the size that the independent renderer takes
    return with_pixel_rule(scene, rule)  # type: ignore[arg-type]


class Remembered(KeptReferences):
    """References made once in this process: a scene's verdicts, of any seed, share them.

    Exact images through pixels' centres take no time, and are the judge's own to make.
    """

    def __init__(self) -> None:
        super().__init__(None, None)
        self._known: dict[str, Reference] = {}

    def given(self, scene: Scene) -> Reference | None:
        """What pixels by their areas are compared with."""
        return truth_of(scene) if scene.spp > 1 else None

    def get(self, scene: Scene, question: Question, target: float, progress: Progress | None) -> Reference:
        """Mitsuba's."""
        key = f"{scene.digest()} {target:g}"
        if key not in self._known:
            self._known[key] = super().get(scene, replace(question, timeout=TIMEOUT), target, progress)
        return self._known[key]


@lru_cache(maxsize=64)
def truth_of(scene: Scene) -> Reference:
    """What images of a scene are compared with."""
    question = Question(timeout=TIMEOUT, pixel_rule="area" if scene.spp > 1 else None)
    return ground_truth(scene, question, KeptReferences(None, None)).reference


REFERENCES = Remembered()


def brought(
    scene: Scene, images: Sequence[Floats], question: Question, written: Written, mistakes: bool = True
) -> Comparison:
    """The judge's comparison of images (h, w, 3), which are written to files of a format first.

    To look for ``mistakes`` takes most of the time.
    """
    judging = Judging(question, External(transfer=written.transfer), "", REFERENCES, diagnose=mistakes)
    with tempfile.TemporaryDirectory(prefix="nusselt-") as folder:
        paths = [Path(folder) / f"{number}{written.suffix}" for number in range(len(images))]
        for path, image in zip(paths, images, strict=True):
            written.write(path, image)
        return judge_images(scene, paths, judging)
