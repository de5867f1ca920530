"""`nusselt.check`: `nusselt check` as a call."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np

from nusselt.experiments.check.check import Answer
from nusselt.experiments.check.check import check as check_one
from nusselt.experiments.check.question import PixelRule, Question, ShadowOrigin
from nusselt.experiments.check.references import KeptReferences
from nusselt.experiments.check.request import SceneLike, SizedReading, mode_of
from nusselt.experiments.external.comparison import Comparison
from nusselt.experiments.external.function import FunctionRenderer, RenderFunction
from nusselt.experiments.external.judge import External, ImageLike, Judging, judge_images, judge_renderer
from nusselt.experiments.external.program import Program, ProgramRenderer
from nusselt.experiments.verdict.level import Level
from nusselt.experiments.workers import PATIENCE, worker_pool
from nusselt.renderer.errors import InputError
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.scene import Scene

from .again import again
from .answers import Results
from .arguments import known_arguments

EstimatorLike = str | type[Estimator]


@known_arguments
def check(
    *scenes: SceneLike,
    images: ImageLike | Sequence[ImageLike] | None = None,
    renderer: str | RenderFunction | None = None,
    estimator: EstimatorLike | Sequence[EstimatorLike] | None = None,
    samples: int | None = None,
    stratified: bool | None = None,
    margin: float = 1e-3,
    alpha: float = 1e-3,
    seed: int = 0,
    shadow_origin: ShadowOrigin = "surface",
    pixel_rule: PixelRule | None = None,
    tolerance: float | None = None,
    timeout: float = 600.0,
    lenient: bool = False,
    two_sided: bool = False,
    as_diffuse: bool = False,
    as_mesh: bool = False,
    width: int | None = None,
    reference: str | PathLike[str] | None = None,
    cache: str | PathLike[str] | None = None,
    transfer: str = "linear",
    quantisation: Literal["auto", "truncate", "round", "floor256"] = "auto",
    runs: int = 4,
    steps: int = 3,
    image_type: str = ".exr",
    run_timeout: float = 600.0,
    noise: Literal["any", "expected"] = "any",
) -> Results:
    """Judge our image of each scene, or somebody's renderer of each or images of one, against the truth.

    Parameters
    ----------
    *scenes : str, path, dict or Scene
        Scene files, names of classic scenes, what `mi.load_dict` takes, or scenes.
    images : array, path, or a sequence of them, optional
        Somebody's images: arrays (h, w, 3) or files; of different seeds.
    renderer : callable or str, optional
        ``f(scene, samples, seed)`` to an array (h, w, 3), or a command with {output}.
    estimator : str, class, or a sequence of them, optional
        Name, ``package.module:Name`` or class; a row for each.
    samples, stratified, margin, seed, shadow_origin, pixel_rule, tolerance, timeout
        As in `nusselt.experiments.check.question.Question`.
    alpha : float
        False-alarm rate of all rows together.
    lenient, two_sided, as_diffuse, as_mesh : bool
        How a scene is read.
    width : int, optional
        Pixels across, instead of the scene's.
    reference, cache : path, optional
        A kept reference; a folder to keep references in, by content.
    transfer, quantisation, runs, steps, image_type, run_timeout, noise
        As in `nusselt.experiments.external.judge.External`.

    Raises
    ------
    InputError
        As the command line has it; also for what a way of checking would not use.
    ProgramFailed
        If a command as ``renderer`` gives no image.
    """
    said = _said(locals())
    mode_of(images is not None, renderer).refuse_others(said)
    if not scenes:
        raise InputError("scenes", "none", "a scene file, the name of a classic scene, or a Scene")
    estimators = estimator if isinstance(estimator, list | tuple) else (estimator,)
    question = Question(
        samples=samples,
        stratified=stratified,
        margin=margin,
        seed=seed,
        level=Level(alpha, len(scenes) * len(estimators)),
        timeout=timeout,
        shadow_origin=shadow_origin,
        pixel_rule=pixel_rule,
        tolerance=tolerance,
    )
    external = External(transfer, quantisation, renderer, image_type, runs, steps, run_timeout, noise)
    reading = SizedReading(lenient, two_sided, as_diffuse, as_mesh, width)
    rows = [
        _Row(given, reading.scene(given, pixel_rule), replace(question, estimator=kind), {**said, "estimator": kind})
        for given in scenes
        for kind in estimators
    ]
    references = KeptReferences(_path(reference), _path(cache))
    for row in rows:  # refused before anything is rendered
        row.question.of(row.scene)
        references.given(row.scene)
    if images is None and renderer is None:
        with worker_pool(None, PATIENCE) as pool:
            return Results(tuple(_ours(row, references, pool) for row in rows), alpha, tuple(row.scene for row in rows))
    if len(estimators) > 1 or (images is not None and len(scenes) > 1):
        given = f"{len(scenes)} with {len(estimators)} estimators"
        raise InputError("scenes", given, "one scene with images of it, or scenes with a renderer; one estimator")
    with worker_pool(None, PATIENCE) as pool:
        judgings = [Judging(row.question, external, again(row.given, row.said), references, pool) for row in rows]
        theirs = tuple(_theirs(row, images, judging) for row, judging in zip(rows, judgings, strict=True))
        return Results(theirs, alpha, tuple(row.scene for row in rows))


@dataclass(frozen=True)
class _Row:
    """One row to be made: its scene as it was named and as it was read, what is asked, and what the caller said."""

    given: SceneLike
    scene: Scene
    question: Question
    said: Mapping[str, Any]


def _ours(row: _Row, references: KeptReferences, pool: Executor | None) -> Answer:
    command = again(row.given, row.said)
    return check_one(row.scene, row.question, command=command, references=references, executor=pool)


def _theirs(row: _Row, images: Any, judging: Judging) -> Comparison:
    renderer = judging.external.renderer
    if images is not None:
        several = isinstance(images, list | tuple)
        if several and not images:
            raise InputError("images", images, "one image or several")
        return judge_images(row.scene, images if several else [images], judging)
    if not isinstance(renderer, str):
        return judge_renderer(row.scene, FunctionRenderer(renderer, row.scene), judging)
    program = Program(renderer, judging.external.image_type, judging.external.run_timeout)
    own_file = isinstance(row.given, str | PathLike) and "width" not in row.said
    name = str(row.given) if own_file else None
    with ProgramRenderer(program, row.scene, name) as ready:
        return judge_renderer(row.scene, ready, judging)


def _path(given: str | PathLike[str] | None) -> Path | None:
    return None if given is None else Path(given)


def _said(values: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments that are not what they are by default."""
    return {
        name: values[name]
        for name, parameter in inspect.signature(check).parameters.items()
        if parameter.kind is parameter.KEYWORD_ONLY and not _same(values[name], parameter.default)
    }


def _same(value: Any, default: Any) -> bool:
    return value is default or (not isinstance(value, np.ndarray) and type(value) is type(default) and value == default)
