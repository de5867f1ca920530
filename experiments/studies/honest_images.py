"""Right images before the judge of brought images: none may be called `differs` more often than is declared.

Two renderers that share no code with ours make them: an independent one, by several ways of sampling, and Mitsuba
with a sampler of its own. They are written in many formats, one, two or four at a time, through pixels' centres or all
over pixels, and compared with our exact images, and where there are none with Mitsuba's reference.
"""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from rich.console import Group
from scipy import stats

from nusselt.experiments.check.question import Question
from nusselt.experiments.external.comparison import Comparison
from nusselt.experiments.independent.plain_scenes import PLAIN
from nusselt.experiments.independent.render import Options, render
from nusselt.experiments.results import study_tables
from nusselt.experiments.results.figures import BLUE, GREEN, GREY, RED, canvas
from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.scenes.catalogue import CLASSIC
from nusselt.mitsuba_bridge.images import mitsuba_images
from nusselt.renderer.vectors import Floats

from .brought_images import TIMEOUT, brought, scene_named, text_of
from .written_images import FORMAT, FORMATS

ALPHA, ALLOWED, SURE = 1e-3, 2e-3, 0.99
"""False-alarm rate declared; what the upper end of the measured one's interval may be; that interval's level."""
WIDTH = 64
PAIRS = ((16, 1e-3), (16, 1e-2), (64, 1e-2), (4, 1e-2))
"""Samples and margins that a case's verdicts take turns with."""


@dataclass(frozen=True)
class Case:
    """A way of making and bringing right images.

    Parameters
    ----------
    way : str
        One of the independent renderer's `WAYS`, or "mitsuba".
    strata : bool
        What is done, and said to the judge.
    written : str
        Name of a format.
    images : int
    jittered : bool
        Whether samples lie all over a pixel.
    rule : str or None
        The pixel rule that the judge is told; None where it is not told that pixels are jittered.
    """

    way: str = "area"
    strata: bool = True
    written: str = "EXR"
    images: int = 2
    jittered: bool = False
    rule: str | None = None

    @property
    def name(self) -> str:
        how = "" if self.way == "mitsuba" else ", stratified" if self.strata else ", random"
        return f"{self.way}{how}{', jittered' if self.jittered else ''}"


CASES = (
    *(Case("area", strata, images=n) for strata, n in product((True, False), (1, 2, 4))),
    *(Case(way, False, images=n) for way, n in product(("mis", "one-light", "roulette", "lattice"), (1, 2))),
    *(Case(written=written.name, images=n) for written, n in product(FORMATS[1:], (1, 2))),
    *(Case(images=n, jittered=True, rule=rule) for n, rule in product((1, 2, 4), (None, "area"))),
    Case(written="PNG truncated", images=2, jittered=True, rule="area"),
    *(Case("mitsuba", False, images=n) for n in (1, 2, 4)),
    *(Case("mitsuba", False, written, 2) for written in ("half EXR", "PNG rounded")),
)


def made(name: str, case: Case, samples: int, seeds: Sequence[int], width: int) -> list[Floats]:
    """Right images (h, w, 3) of a scene."""
    if case.way == "mitsuba":
        scene = scene_named(name, width)
        found = mitsuba_images(scene, samples, seeds, sampler="independent", timeout=TIMEOUT)
        return [image.transpose(1, 2, 0) for image in found]
    options = [Options(samples, case.strata, case.jittered, case.way, seed) for seed in seeds]
    return [render(text_of(name), width, option) for option in options]


def verdicts(name: str, number: int, count: int, width: int, seed: int) -> Outcome:
    """One case, by its place, of one scene: so many verdicts, each of new images."""
    case, started = CASES[number], time.process_time()
    found = []
    for turn in range(count):
        samples, margin = PAIRS[turn % len(PAIRS)]
        question = Question(
            estimator="area",
            samples=samples,
            stratified=case.strata,
            margin=margin,
            pixel_rule=case.rule,  # type: ignore[arg-type]
        )
        first = seed + turn * case.images
        images = made(name, case, samples, range(first, first + case.images), width)
        found.append(brought(scene_named(name, width, case.rule), images, question, FORMAT[case.written]))
    return Outcome([_row(name, case, found) | {"seconds": time.process_time() - started}])


def _row(name: str, case: Case, found: Sequence[Comparison]) -> Row:
    words = Counter(one.row["verdict"] for one in found)
    reasons: dict[str, Counter[str]] = {
        word: Counter(kind_of(one.row["reason"]) for one in found if one.row["verdict"] == word)
        for word in ("differs", "undecided")
    }
    told = Counter(one.row["verdict"] for one in found if one.row["likely_mistakes"])
    low, high = rate(words["differs"], len(found))
    return {
        "scene": name,
        "method": case.name,
        "written": case.written,
        "brought_images": case.images,
        "pixel_rule": case.rule or ("not told" if case.jittered else "centre"),
        "verdicts": len(found),
        "differs": words["differs"],
        "undecided": words["undecided"],
        "agrees": words["agrees"],
        "rate_interval": [low, high],
        "reasons": {word: dict(counts) for word, counts in reasons.items()},
        "told_of_right": told["agrees"],
        "told_undecided": told["undecided"],
        "as_claimed": low <= ALPHA and not told["agrees"],
    }


def kind_of(reason: str) -> str:
    """A reason without its numbers."""
    return re.sub(r"[-+]?\d[\d.,]*(e[-+]?\d+)?", "#", reason)


def rate(hits: int, count: int) -> tuple[float, float]:
    """Clopper and Pearson's interval of a rate."""
    found = stats.binomtest(hits, max(count, 1)).proportion_ci(SURE, method="exact")
    return float(found.low), float(found.high)


def jobs(settings: Settings) -> list[Job]:
    """Every case of every scene; a few where it must be quick."""
    every = range(len(CASES))
    names = settings.scenes or settings.pick((*CLASSIC, *PLAIN), ("three-lights", "ball", "point and lamp"), ("ball",))
    numbers = settings.pick(every, (0, 1, 6, 10, 12, 44, 45, 51), (0, 12))
    count, width = settings.pick((2, WIDTH), (1, WIDTH), (1, 24))
    return [
        Job(
            verdicts,
            {
                "name": name,
                "number": number,
                "count": count,
                "width": width,
                "seed": settings.seed_of("honest", name, number) % 2**31,
            },
            alone=CASES[number].way == "mitsuba",
        )
        for name, number in product(names, numbers)
    ]


COUNTS = ("verdicts", "differs", "undecided", "agrees", "told_of_right", "told_undecided")


def summed(rows: Sequence[Row], by: str) -> dict[str, Row]:
    """Counts of the rows by one entry, and of all."""
    found: dict[str, Row] = {}
    for row in rows:
        for key in (str(row[by]), "all"):
            entry = found.setdefault(key, dict.fromkeys(COUNTS, 0))
            for name in entry:
                entry[name] += row[name]
    found["all"] = found.pop("all")
    return found


GROUPS = ("method", "written", "brought_images", "pixel_rule", "scene")


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Shares of the three words, by what was brought."""
    rows = [outcome.rows[0] for outcome in outcomes]
    lines = [(f"{by}: {key}", entry) for by in GROUPS for key, entry in summed(rows, by).items() if key != "all"]
    figure = canvas(8, 0.2 * len(lines) + 1.4)
    axis = figure.subplots()
    for place, (_, entry) in enumerate(lines):
        left = 0.0
        for word, colour in (("agrees", GREEN), ("undecided", GREY), ("differs", RED)):
            share = entry[word] / entry["verdicts"]
            axis.barh(place, share, left=left, color=colour)
            left += share
    axis.set_yticks(range(len(lines)), [label for label, _ in lines], fontsize=6)
    axis.invert_yaxis()
    axis.set(xlim=(0, 1), xlabel="share of verdicts; green: agrees, grey: undecided, red: differs")
    total = summed(rows, "scene")["all"]
    _, high = rate(total["differs"], total["verdicts"])
    axis.axvline(1 - ALPHA, color=BLUE, lw=0.5)
    axis.set_title(
        f"{total['verdicts']:,} verdicts on right images: {total['differs']} differ (at most {high:.2%})", fontsize=10
    )
    return {"verdicts": figure}


def table(rows: Sequence[Row], width: int) -> Group:
    """Counts by what was brought, and every reason with how often it was given."""
    total = summed(rows, "scene")["all"]
    low, high = rate(total["differs"], total["verdicts"])
    reasons: Counter[str] = Counter()
    for row in rows:
        for word, counts in row["reasons"].items():
            reasons.update({f"{word}: {reason}": number for reason, number in counts.items()})
    told = "\n".join(f"{number} × {reason}" for reason, number in reasons.most_common())
    title = (
        f"Right images: {total['differs']} of {total['verdicts']} differ, a rate of {low:.2%} to {high:.2%} "
        f"({ALPHA:.1%} is declared, {ALLOWED:.1%} asked for)"
    )
    lines: list[Row] = []
    for by in GROUPS:
        for key, entry in summed(rows, by).items():
            if key != "all":
                most = f"{rate(entry['differs'], entry['verdicts'])[1]:.2%}"
                line = {"what": key, "verdicts": entry["verdicts"], "differs": entry["differs"], "at most": most}
                counts = dict(zip(("undecided", "agrees", "told a mistake", "and undecided"), COUNTS[2:], strict=True))
                line |= {head: entry[word] for head, word in counts.items()}
                lines.append(line | {"as_claimed": not entry["differs"]})
    return study_tables.table(lines, title, width, hidden=("as_claimed",), caption=told)


HONEST_IMAGES = Experiment(
    "honest-images",
    "right images of two renderers that share no code with ours, in every format: how often they are said to differ",
    jobs,
    figures,
    scenes=(*CLASSIC, *PLAIN),
    table=table,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(HONEST_IMAGES)
