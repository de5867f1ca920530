"""What `nusselt.check` gives: rows and the images behind them, which a notebook, a terminal and a folder can show."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from nusselt.experiments.check.check import Answer
from nusselt.experiments.external.comparison import Comparison
from nusselt.experiments.external.pictures import write_comparison
from nusselt.experiments.files import folder_name
from nusselt.experiments.results.document import document, write_json
from nusselt.experiments.results.exports import write_exports
from nusselt.experiments.results.notebook import answer_html, results_html
from nusselt.experiments.results.pictures import write_pictures
from nusselt.renderer.scene import Scene
from nusselt.renderer.words import count

WORST_FIRST = ("differs", "undecided", "agrees")


def sentences(row: dict[str, Any]) -> list[str]:
    """What a row says, for people: verdict and reason, what mistake it looks like, warnings, what makes it again."""
    told = [f"{row['scene']}, {row['estimator']}: {row['verdict']}: {row['reason']}"]
    for mistake in row.get("likely_mistakes", ()):
        told.append(
            f"it looks like {mistake['name']} ({mistake['explained']:.0%} of the difference): {mistake['detail']}"
        )
    told += [f"look: {mistake['hint']}" for mistake in row.get("likely_mistakes", ())[:1] if "hint" in mistake]
    told += [f"where: {place}" for place in row.get("where", ())]
    told += [f"note: {warning}" for warning in row["warnings"]]
    return [*told, f"again: {row['command']}"]


@dataclass(frozen=True, repr=False)
class Results:
    """Answers to one question, a row each; ``verdict``, ``row`` and ``agrees`` are those of the worst.

    Parameters
    ----------
    answers : tuple
        Of `Answer` where our image was judged, of `Comparison` where somebody's were.
    alpha : float
        False-alarm rate of all of them together.
    scenes : tuple of Scene
        Of each answer.
    """

    answers: tuple[Answer | Comparison, ...]
    alpha: float
    scenes: tuple[Scene, ...]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """Every row, as in `results.json`."""
        return [answer.row for answer in self.answers]

    @property
    def row(self) -> dict[str, Any]:
        """The row that decides: the first that differs, else that is undecided, else the first."""
        return min(self.rows, key=lambda row: WORST_FIRST.index(row["verdict"]))

    @property
    def verdict(self) -> str:
        """``agrees`` where every row does, ``differs`` where any does, else ``undecided``."""
        return str(self.row["verdict"])

    @property
    def agrees(self) -> bool:
        """Whether every row agrees."""
        return self.verdict == "agrees"

    @property
    def document(self) -> dict[str, Any]:
        """What `results.json` holds."""
        return document(self.rows, alpha=self.alpha)

    def write(self, folder: str | PathLike[str], **exports: str | PathLike[str]) -> None:
        """Write `results.json` and the images, and what ``csv``, ``junit`` and ``summary`` name files for."""
        out = Path(folder)
        rows = [{**row, "images": images} for row, images in self.write_pictures(out)]
        whole = document(rows, alpha=self.alpha)
        write_json(whole, str(out / "results.json"))
        write_exports(whole, dict(exports))

    def write_pictures(self, folder: Path, prefix: str = "") -> Iterator[tuple[dict[str, Any], dict[str, str]]]:
        """Write each row's images into a folder of its own below ``folder``; rows, and what is where by name."""
        for answer, scene, name in zip(self.answers, self.scenes, folders(self.rows), strict=True):
            place = folder / "-".join(filter(None, (prefix, name)))
            if isinstance(answer, Comparison):
                yield answer.row, write_comparison(answer, place, scene)
            else:
                yield answer.row, write_pictures(answer.row, answer.ours, answer.reference, place, scene)

    def __bool__(self) -> bool:
        raise TypeError("results are neither true nor false: ask for .agrees or .verdict")

    def __repr__(self) -> str:
        return f"<nusselt results: {self.verdict}, {count(len(self.rows), 'row')}>"

    def __str__(self) -> str:
        return "\n".join(line for row in self.rows for line in sentences(row))

    def _repr_html_(self) -> str:
        if len(self.answers) > 1:
            return results_html(self.document)
        (answer,) = self.answers
        if isinstance(answer, Comparison):
            return answer_html(answer.row, answer.sides.image, answer.sides.reference)
        return answer_html(answer.row, answer.ours, answer.reference)


def folders(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    """A folder for each row: the scene's name, with the estimator's where a scene has several rows."""
    scenes = Counter(row["scene"] for row in rows)
    taken: Counter[str] = Counter()
    for row in rows:
        name = row["scene"] if scenes[row["scene"]] == 1 else f"{row['scene']}-{row['estimator']}"
        taken[name] += 1
        yield folder_name(name if taken[name] == 1 else f"{name}-{taken[name]}")
