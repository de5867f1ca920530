"""The five answers people look for first, from the rows alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from statistics import median
from typing import Any, Literal

from .rows import Status, count, number, percent, status, title
from .schema import Row
from .work_precision import TARGETS, races

Tone = Literal["good", "bad", "open", "plain"]


VERDICTS = {"agrees": "agree", "differs": "differ", "undecided": "undecided"}
"""Each verdict, and how several of them say it."""


@dataclass(frozen=True)
class Fact:
    """A question, its answer in a few words, and what stands behind it."""

    question: str
    answer: str
    detail: str
    tone: Tone = "plain"


def counted(rows: list[Row]) -> Counter[Status]:
    """How many rows there are of each status."""
    return Counter(status(row) for row in rows)


def headline(rows: list[Row]) -> tuple[Tone, str]:
    """The verdict on a whole folder in one line."""
    by = counted(rows)
    judged = by["failing"] + by["undecided"] + by["as claimed"]
    if not judged:
        return "bad", "Nothing was measured: there is no row to judge"
    if by["failing"]:
        rest = f", {by['undecided']} undecided" if by["undecided"] else ""
        verb = "is" if by["failing"] == 1 else "are"
        return "bad", f"{by['failing']} of {count(judged, 'row')} {verb} not as claimed{rest}"
    if by["undecided"]:
        return "open", f"{by['undecided']} of {count(judged, 'row')} undecided, the rest as claimed"
    every = "The one row" if judged == 1 else f"All {judged} rows"
    if all(row.get("verdict") == "agrees" for row in rows if status(row) == "as claimed"):
        return "good", f"{every} agree{'s' if judged == 1 else ''} with {_reference(rows)}"
    return "good", f"{every} {'is' if judged == 1 else 'are'} as claimed"


def facts(document: dict[str, Any]) -> list[Fact]:
    """The five answers, in the order in which they are asked."""
    rows: list[Row] = document["rows"]
    return [_right(rows), _sure(rows, document.get("alpha")), _fast(rows), _left_out(rows), _where(rows)]


def _reference(rows: list[Row]) -> str:
    names = [row["reference"] for row in rows if isinstance(row.get("reference"), dict)]
    whole = [(str(r["renderer"]), r.get("version") or "") for r in names if r.get("renderer")]
    found = {f"{name.capitalize()} {version}".strip() for name, version in whole if not name.startswith("ours")}
    own = ["our own images"] if any(name.startswith("ours") for name, _ in whole) else []
    return " and ".join(sorted(found) + own) or "a reference"


def _right(rows: list[Row]) -> Fact:
    tone, said = headline(rows)
    compared = [row for row in rows if row.get("verdict")]
    if tone == "open" and compared:  # a row that was not run says nothing of those that were
        tone, _ = headline(compared)
    by = Counter(str(row["verdict"]) for row in rows if row.get("verdict") and not row.get("defect"))
    words = ", ".join(f"{by[word]} {plural}" for word, plural in VERDICTS.items() if by[word])
    answer = {"good": "Yes", "bad": "No", "open": "Not known yet"}.get(tone, "")
    if not counted(rows).keys() - {"shown"}:
        answer = "Not measured"
    judged = sum(by.values())
    detail = f"Of {count(judged, 'image')} set against {_reference(rows)}: {words}." if judged else f"{said}."
    return Fact("Is the renderer right?", answer, detail, tone)


def _sure(rows: list[Row], alpha: Any) -> Fact:
    whole = [row for row in rows if not row.get("defect")]  # planted ones say nothing of the renderer
    found = [v for row in whole if (v := number(row.get("minimum_detectable_bias"))) is not None]
    level = number(alpha)
    chance = f" A right renderer fails this report at most once in {1 / level:,.0f} times." if level else ""
    if not found:
        return Fact("How sure?", "Not measured", f"No row says which bias it would have found.{chance}")
    spread = f" ({percent(min(found), 2)} to {percent(max(found), 2)} over all rows)" if len(found) > 1 else ""
    typical = percent(median(found), 2)
    detail = f"A bias of {typical} would have been found with 99 % power in the typical row{spread}.{chance}"
    return Fact("How sure?", f"It finds {typical} bias", detail)


def _fast(rows: list[Row]) -> Fact:
    question = f"How fast to {TARGETS[1]:g} RMS, against Mitsuba?"
    run = races(rows, TARGETS[1])
    if not run:
        return Fact(question, "Not measured here", "The experiment error-against-time measures it.")
    ratios = [race.ratio for race in run]
    wins, typical = sum(ratio > 1 for ratio in ratios), median(ratios)
    answer = f"{typical:.2g} × as fast" if typical >= 1 else f"{1 / typical:.2g} × slower"
    marked = sum(race.ours[2] or race.mitsuba[2] for race in run)
    extra = f" Extrapolated on {count(marked, 'scene')}." if marked else ""
    detail = f"Ours is quicker on {wins} of {count(len(run), 'scene')}; the answer is the median.{extra}"
    return Fact(question, answer, detail)


def _left_out(rows: list[Row]) -> Fact:
    entries = [entry for row in rows for entry in row.get("left_out") or () if isinstance(entry, dict)]
    unjudged = sum((row.get("pixels") or {}).get("unjudged") or 0 for row in rows)
    shaded = sum((row.get("pixels") or {}).get("shaded") or 0 for row in rows)
    why = Counter(str(entry.get("why")) for entry in entries)
    often = f" Most often because {why.most_common(1)[0][0]}." if why else ""
    share = f" {unjudged} of {shaded} pixels lie too close to an edge to be judged." if shaded else ""
    detail = f"Work that the scenes do not need; no pixel changes.{often}{share}"
    return Fact("What was left out?", count(len(entries), "piece") + " of work", detail)


def _where(rows: list[Row]) -> Fact:
    question = "Where does it differ?"
    off = [row for row in rows if status(row) == "failing"]
    if off:
        names = ", ".join(title(row) for row in off[:4]) + (f" and {len(off) - 4} more" if len(off) > 4 else "")
        return Fact(question, f"In {count(len(off), 'row')}", names, "bad")
    rows = [row for row in rows if not row.get("defect")]
    claimed = sum(row.get("verdict") == "differs" for row in rows)
    if claimed:
        return Fact(question, "Only where it says so", f"{count(claimed, 'row')} with a bias that is claimed.")
    seen = [row for row in rows if number(row.get("bias_relative")) is not None]
    if not seen:
        return Fact(question, "Not measured", "No row has been compared.")
    seen = [row for row in seen if row.get("verdict") == "agrees"] or seen
    worst = max(seen, key=lambda row: abs(row["bias_relative"]))
    bias = percent(worst["bias_relative"], 3, sign=True)
    return Fact(question, "Nowhere beyond noise", f"The largest bias is {bias}, in {title(worst)}.", "good")
