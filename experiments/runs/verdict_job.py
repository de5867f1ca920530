"""A comparison with Mitsuba as the job of an experiment."""

from __future__ import annotations

from typing import Any

from nusselt.experiments.check.check import References, check
from nusselt.experiments.check.question import Question
from nusselt.experiments.verdict.level import Level
from nusselt.renderer.estimators import Estimator
from nusselt.renderer.scene import Scene

from .experiment import Outcome


def verdict(scene: Scene, estimator: Estimator, margin: float, seed: int, rows: int, timeout: float) -> Outcome:
    """The row of `nusselt check`, and both images.

    Parameters
    ----------
    rows : int
        Rows among which the report's false-alarm rate is divided.
    """
    question = Question(
        estimator=estimator.name,
        samples=estimator.samples,
        stratified=estimator.stratified,
        margin=margin,
        seed=seed,
        level=Level(rows=rows),
        timeout=timeout,
    )
    answer = check(scene, question, command="", references=References())
    row: dict[str, Any] = {name: value for name, value in answer.row.items() if name not in ("command", "tile_p")}
    arrays = {"ours": answer.ours.mean}
    if answer.reference is not None:
        arrays["reference"] = answer.reference.mean
    return Outcome([row], arrays)
