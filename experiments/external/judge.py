"""Somebody's images or renderer in, a verdict out: what the command line and Python have in common."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np

from nusselt.experiments.check.check import Progress
from nusselt.experiments.check.question import Question, number_within, one_of, whole_within
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.images.formats import Raw
from nusselt.experiments.images.read import READERS, quantiser_of, raw_of, read_image
from nusselt.experiments.images.transfer import RULES, Transfer
from nusselt.renderer.errors import InputError
from nusselt.renderer.scene import Scene

from .against import Brought
from .comparison import Comparison, compare
from .convergence import convergence
from .program import Renderer, Run
from .sides import stage

GROWTH = 4
"""Samples of one step of the convergence over those of the step before."""

ImageLike = str | PathLike[str] | np.ndarray[Any, Any]


@dataclass(frozen=True)
class External:
    """What is said of images and renderers from elsewhere.

    Parameters
    ----------
    transfer : str
        Curve of levels: linear, srgb, gamma:G.
    quantisation : {"auto", "truncate", "round", "floor256"}
    noise : {"any", "expected"}
        Whether images may have other noise than our estimator's at their samples, or are then not as claimed.
    renderer : str or callable, optional
        A command, or ``f(scene, samples, seed)`` to an array (h, w, 3).
    image_type : str
        Ending of the image that a command writes.
    runs : int
        Seeds at each number of samples, 1 to 256.
    steps : int
        Numbers of samples, each four times the one before, 1 to 8; judged are the images of most.
    run_timeout : float
        Seconds of one run of a command.

    Raises
    ------
    InputError
    """

    transfer: str = "linear"
    quantisation: str = "auto"
    renderer: Any = None
    image_type: str = ".exr"
    runs: int = 4
    steps: int = 3
    run_timeout: float = 600.0
    noise: str = "any"

    def __post_init__(self) -> None:
        Transfer(self.transfer)
        one_of("noise", self.noise, ("any", "expected"))
        one_of("quantisation", self.quantisation, ("auto", *RULES))
        if not (self.renderer is None or isinstance(self.renderer, str) or callable(self.renderer)):
            raise InputError("renderer", self.renderer, "a command or a function of (scene, samples, seed)")
        one_of("image_type", self.image_type, tuple(READERS))
        whole_within("runs", self.runs, 1, 256)
        whole_within("steps", self.steps, 1, 8)
        number_within("run_timeout", self.run_timeout, 0, math.inf)

    @property
    def rule_given(self) -> bool:
        """Whether the user said how levels were made."""
        return self.quantisation != "auto"


@dataclass(frozen=True)
class Judging:
    """What every comparison is made with.

    Parameters
    ----------
    question : Question
    external : External
    command : str
        What makes the row again.
    references : KeptReferences
    executor, progress : optional
    diagnose : bool
        Whether to look for likely mistakes, which takes most of the time.
    """

    question: Question
    external: External
    command: str
    references: KeptReferences
    executor: Executor | None = None
    progress: Progress | None = None
    diagnose: bool = True

    def compare(self, scene: Scene, names: Sequence[str], raws: list[Raw], made_by: str) -> Comparison:
        """Judge images of a scene."""
        quantiser = quantiser_of(raws, self.external.transfer, self.external.quantisation)
        brought = Brought(tuple(names), raws, quantiser, self.external.rule_given, made_by)
        found = compare(
            scene,
            brought,
            self.question,
            command=self.command,
            references=self.references,
            executor=self.executor,
            progress=self.progress,
            looks_for_mistakes=self.diagnose,
        )
        word = found.row["noise_word"]
        if self.external.noise == "expected" and found.row["as_claimed"] and word not in (None, "as expected"):
            found.row["as_claimed"] = False
            found.row["reason"] += f"; its noise is not the expected: {word}"
        return found


def judge_images(scene: Scene, images: Sequence[ImageLike], judging: Judging) -> Comparison:
    """Judge images: arrays (h, w, 3) or files."""
    named = [image if isinstance(image, str | PathLike) else f"images[{k}]" for k, image in enumerate(images)]
    raws = [
        read_image(image, scene) if isinstance(image, str | PathLike) else raw_of(image, scene, str(name))
        for name, image in zip(named, images, strict=True)
    ]
    return judging.compare(scene, [str(name) for name in named], raws, "image")


def judge_renderer(scene: Scene, renderer: Renderer, judging: Judging) -> Comparison:
    """Judge a renderer by its images of most samples, of some seeds; and how its error falls with samples and time."""
    external, samples = judging.external, judging.question.of(scene).samples
    growths = [GROWTH**step for step in range(external.steps if renderer.takes_samples else 1)]
    if len(growths) > 1:
        judging = replace(judging, question=replace(judging.question, samples=samples * growths[-1]))
    done, seed, steps = 0, judging.question.seed, list[list[Run]]()
    for growth in growths:
        steps.append([])
        for _ in range(external.runs):
            if judging.progress:
                judging.progress("renderer", done, external.runs * sum(growths))
            done, seed = done + growth, seed + 1
            steps[-1].append(renderer.run(samples * growth, seed))
            quantiser = quantiser_of([steps[0][0].raw], external.transfer, external.quantisation)
    told = judging.compare(scene, [f"seed {run.seed}" for run in steps[-1]], [run.raw for run in steps[-1]], "renderer")
    told.row["convergence"] = convergence(steps, quantiser, stage(scene, told.truth), told.truth.reference)
    return told
