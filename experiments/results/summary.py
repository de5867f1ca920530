"""The five answers people look for first, from the rows alone."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from statistics import median
from typing import Any, Literal

from nusselt.renderer.words import count

from .rows import Status, number, percent, status, title, whose
from .schema import Row
from .work_precision import TARGETS, races

Tone = Literal["good", "bad", "open", "plain"]


OWN = ("ours", "nusselt")
"""What the names of references of our own begin with."""
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
    if judged == 1:
        every, are, agree = "The one row", "is", "agrees"
    else:
        every, are, agree = f"All {judged} rows", "are", "agree"
    if by["failing"]:
        rest = f", {by['undecided']} undecided" if by["undecided"] else ""
        verb = "is" if by["failing"] == 1 else "are"
        which = every if judged == 1 else f"{by['failing']} of {judged} rows"
        return "bad", f"{which} {verb} not as claimed{rest}"
    if by["undecided"]:
        rest = f"{by['undecided']} of {judged} rows undecided, the rest as claimed"
        return "open", f"{every} {are} undecided" if by["undecided"] == judged else rest
    if all(row.get("verdict") == "agrees" for row in rows if status(row) == "as claimed"):
        return "good", f"{every} {agree} with {references(rows)}"
    return "good", f"{every} {are} as claimed"


def facts(document: dict[str, Any]) -> list[Fact]:
    """The five answers, in the order in which they are asked."""
    rows: list[Row] = document["rows"]
    return [_right(rows), _sure(rows, document.get("alpha")), _fast(rows), _left_out(rows), _where(rows)]


def references(rows: list[Row], otherwise: str = "a reference") -> str:
    """What rows were compared with."""
    names = [row["reference"] for row in rows if isinstance(row.get("reference"), dict)]
    every = [(str(r["renderer"]), r.get("version") or "") for r in names if r.get("renderer")]
    found = {f"{name.capitalize()} {version}".strip() for name, version in every if not name.startswith(OWN)}
    own = ["the exact image"] if any(name.startswith(OWN) for name, _ in every) else []
    return " and ".join(sorted(found) + own) or otherwise


def kicker(rows: list[Row]) -> str:
    """Whose images were set against what."""
    sides = sorted({whose(row) for row in rows}) or ["ours"]
    return f"{' and '.join(sides)} against {references(rows, 'Mitsuba’s direct integrator')}"


def against(row: Row) -> str:
    """What one row was compared with, and how it was made; empty where nothing is known of that."""
    told = row.get("reference")
    if not isinstance(told, dict):
        return ""
    if "brought" in row and told.get("notes"):
        return str(told["notes"][0])
    made = f"{told.get('renderer') or 'none'} {told.get('version') or ''}".strip()
    samples = f"{count(told['samples'], 'sample')} per light" if told.get("samples") else ""
    return ", ".join(filter(None, (made, told.get("variant"), samples)))


def _right(rows: list[Row]) -> Fact:
    tone, said = headline(rows)
    compared = [row for row in rows if row.get("verdict")]
    if tone == "open" and compared:  # a row that was not run says nothing of those that were
        tone, _ = headline(compared)
    by = Counter(str(row["verdict"]) for row in rows if row.get("verdict") and not row.get("defect"))
    words = ", ".join(f"{n} {word if n == 1 else several}" for word, several in VERDICTS.items() if (n := by[word]))
    answer = {"good": "Yes", "bad": "No", "open": "Not known yet"}.get(tone, "")
    judged = sum(by.values())
    detail = f"Of {count(judged, 'image')} set against {references(rows)}: {words}." if judged else f"{said}."
    if not judged and tone != "bad":
        answer, detail = "Not judged", f"{detail} None of them is a verdict on an image."
    if not counted(rows).keys() - {"shown"}:
        answer = "Not measured"
    return Fact("Is the renderer right?", answer, detail, tone if judged else "bad" if tone == "bad" else "plain")


def _sure(rows: list[Row], alpha: Any) -> Fact:
    whole = [row for row in rows if not row.get("defect")]  # planted ones say nothing of the renderer
    found = [v for row in whole if (v := number(row.get("minimum_detectable_bias"))) is not None]
    level = number(alpha)
    chance = f" A right renderer fails this report at most once in {1 / level:,.0f} times." if level else ""
    if not found:
        return Fact("How sure?", "Not measured", f"No row says which bias it would have found.{chance}")
    spread = f" ({percent(min(found), 2)} to {percent(max(found), 2)} over all rows)" if len(found) > 1 else ""
    if median(found) >= 1:
        return Fact("How sure?", "Not at all", f"The typical row would have found no bias below 100 %.{chance}", "open")
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
    ours = [row for row in rows if "brought" not in row]
    entries = [entry for row in ours for entry in row.get("left_out") or () if isinstance(entry, dict)]
    unjudged = sum((row.get("pixels") or {}).get("unjudged") or 0 for row in rows)
    shaded = sum((row.get("pixels") or {}).get("shaded") or 0 for row in rows)
    why = Counter(str(entry.get("why")) for entry in entries)
    often = f" Most often because {why.most_common(1)[0][0]}." if why else ""
    lie = "lies" if unjudged == 1 else "lie"
    share = f"{unjudged} of {count(shaded, 'pixel')} {lie} too close to an edge to be judged." if shaded else ""
    if not entries and shaded:
        return Fact("What was left out?", count(unjudged, "pixel"), share)
    detail = f"Work that the scenes do not need; no pixel changes.{often} {share}".rstrip()
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
    agreeing = [row for row in seen if row.get("verdict") == "agrees"]
    worst = max(agreeing or seen, key=lambda row: abs(row["bias_relative"]))
    told = f"The largest bias is {percent(worst['bias_relative'], 3, sign=True)}, in {title(worst)}"
    if agreeing:
        return Fact(question, "Nowhere beyond noise", f"{told}.", "good")
    if any(row.get("verdict") for row in seen):
        return Fact(question, "Not known yet", f"{told}, and no row agrees.", "open")
    claim = f", which claims to be {worst['claim']}" if worst.get("claim") else ""
    return Fact(question, "Not judged", f"No row has a verdict. {told}{claim}.")
