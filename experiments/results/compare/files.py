"""Results files compared, and what was found written for other programs."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from nusselt.experiments.files import replacing
from nusselt.experiments.results.document import plain, read_json
from nusselt.experiments.results.exports.junit import junit_of
from nusselt.experiments.results.exports.markdown import MARKS, code, text
from nusselt.experiments.results.status import EXIT
from nusselt.renderer.errors import InputError

from .change import Change
from .comparison import Comparison, compare_rows
from .history import History, history


def compare(baseline: str | Path, *results: str | Path, alpha: float = 1e-3) -> Comparison | History:
    """Compare two results files, or the history of several.

    Parameters
    ----------
    baseline, *results : path
        The oldest first.
    alpha : float
        The chance that anything noisy is named although nothing changed.

    Returns
    -------
    Comparison or History
        Of two files; of more.

    Raises
    ------
    InputError
        If one cannot be read, or has no rows.
    """
    if not 0 < alpha <= 0.5:
        raise InputError("alpha", alpha, "a number above 0, at most 0.5")
    paths = [baseline, *results]
    if len(paths) < 2 or len(set(map(str, paths))) < len(paths) > 2:
        raise InputError("results", ", ".join(map(str, paths)), "two results files, or several that are not the same")
    runs = {number: read_json(Path(path)) for number, path in enumerate(paths)}
    for number, document in runs.items():
        if not document["rows"]:
            raise InputError("results", str(paths[number]), "a file with rows: nothing was measured here")
    if len(paths) == 2:
        return compare_rows(runs[0]["rows"], runs[1]["rows"], alpha)
    return history({str(paths[number]): document["rows"] for number, document in runs.items()}, alpha)


def _changes(found: Comparison | History) -> dict[str, list[Change]]:
    if isinstance(found, Comparison):
        return found.by_row()
    told: dict[str, list[Change]] = {}
    for run, change in found.steps:
        told.setdefault(f"{change.row} in {run}", []).append(change)
    return told


def markdown(found: Comparison | History) -> str:
    """For a forge's page: what is worse first."""
    tone = {EXIT["as claimed"]: "good", EXIT["undecided"]: "open"}.get(found.status, "bad")
    parts = [f"## {MARKS[tone]} {text(found.headline())}\n\n"]
    for row, changes in _changes(found).items():
        parts.append(f"- **{text(row)}** {text('; '.join(map(str, changes)))}")
        parts.append(f"<br>{code(changes[0].command)}\n" if changes[0].command else "\n")
    parts += [f"- **{text(name)}** is no longer there\n" for name in getattr(found, "missing", ())]
    return "".join([*parts, "\n", *(f"{text(note)}  \n" for note in found.notes())])


def junit(found: Comparison | History) -> str:
    """A case a row: what is worse or gone is a failure, what could not be tested is skipped."""
    changes = _changes(found)
    cases: dict[str, tuple[str, str, str]] = {}
    for name in getattr(found, "names", ()) or {one.row for one in getattr(found, "series", ())}:
        cases[name] = (
            ("skipped", "no figure with its noise", "") if name in getattr(found, "untested", ()) else ("", "", "")
        )
    for row, some in changes.items():
        if any(change.worse for change in some):
            cases[row] = ("failure", "; ".join(map(str, some)), some[0].command)
    cases |= dict.fromkeys(getattr(found, "missing", ()), ("failure", "no longer there", ""))
    return junit_of("nusselt.compare", cases)


def as_json(found: Comparison | History) -> str:
    """All that was found."""
    content: dict[str, Any] = {"status": found.status, "headline": found.headline(), "notes": found.notes()}
    content["alpha"] = found.alpha
    if isinstance(found, Comparison):
        content |= {"changes": [asdict(change) for change in found.changes], "times": dict(found.times)}
        content |= {"missing": found.missing, "new": found.new, "untested": found.untested}
    else:
        content |= {"runs": found.runs, "changes": [{"run": run, **asdict(change)} for run, change in found.steps]}
    return json.dumps(plain(content), indent=1, allow_nan=False) + "\n"


WRITERS = {"json": as_json, "junit": junit, "summary": markdown}
"""By the option that asks for it."""


def write(found: Comparison | History, options: dict[str, Path | str | None]) -> None:
    """Write those that ``options`` names a file for; "-" is standard output."""
    for name, path in options.items():
        if path == "-":
            print(WRITERS[name](found), end="")
        elif path is not None:
            with replacing(Path(path)) as beside:
                beside.write_text(WRITERS[name](found), encoding="utf-8", newline="")
