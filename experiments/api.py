"""What the commands do, as calls, for a notebook: each result shows itself.

``check("cornell", samples=16)`` is ``nusselt check cornell --samples 16``, ``write_report`` is ``nusselt report``,
``compare`` is ``nusselt compare``, `nusselt.renderer.image.render` is ``nusselt render``.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nusselt.renderer.scene import Scene

from .check.check import Answer, Question, References
from .check.check import check as check_one
from .cli.check import command as check_command
from .cli.rerun import shell_command
from .files import folder_name
from .results.compare import Comparison, compare
from .results.document import document, write_json
from .results.exports import write_exports
from .results.notebook import results_html
from .results.pictures import write_pictures
from .results.report import write_report
from .scenes.catalogue import load
from .verdict.level import Level
from .workers import worker_pool

__all__ = ["Comparison", "Results", "check", "compare", "write_report"]


@dataclass(frozen=True)
class Results:
    """Answers to one question asked of several scenes; a notebook shows them as a table."""

    answers: tuple[Answer, ...]
    alpha: float

    @property
    def document(self) -> dict[str, Any]:
        """What `results.json` holds."""
        return document([answer.row for answer in self.answers], alpha=self.alpha)

    def write(self, folder: str | Path, **exports: str | Path) -> None:
        """Write `results.json` and the images, and what ``csv``, ``junit`` and ``summary`` name files for."""
        out = Path(folder)
        for answer in self.answers:
            answer.row["images"] = write_pictures(
                answer.row, answer.ours, answer.reference, out / folder_name(answer.row["scene"])
            )
        write_json(self.document, str(out / "results.json"))
        write_exports(self.document, dict(exports))

    def _repr_html_(self) -> str:
        return results_html(self.document)


def check(*scenes: str | Path | Scene, alpha: float = 1e-3, **question: Any) -> Results:
    """Compare our image of each scene with Mitsuba's.

    Parameters
    ----------
    *scenes : str, Path or Scene
        Scene files, names of classic scenes, or scenes; their names must differ.
    alpha : float
        False-alarm rate of all of them together.
    **question
        Fields of `nusselt.experiments.check.check.Question`, such as ``samples``, ``margin`` and ``seed``.

    Raises
    ------
    InputError
        If a scene cannot be read.
    """
    asked = Question(**question, level=Level(alpha, max(len(scenes), 1)))
    read = [scene if isinstance(scene, Scene) else load(str(scene)) for scene in scenes]
    options = {field.name: getattr(asked, field.name) for field in dataclasses.fields(asked)}
    references = References()
    with worker_pool() as pool:
        answers = [
            check_one(scene, asked, command=_command(scene.name, options), references=references, executor=pool)
            for scene in read
        ]
    return Results(tuple(answers), alpha)


def _command(name: str, options: dict[str, Any]) -> str:
    return shell_command(check_command, name, options)
