"""Every mistake of the independent renderer before the judge of brought images: none of an effect may `agree`."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from rich.console import Group

from nusselt.experiments.check.question import Question
from nusselt.experiments.independent.mistakes import KINDS, MISTAKES, Mistake
from nusselt.experiments.independent.mistakes.told import names_of, places_of
from nusselt.experiments.independent.render import Options, render
from nusselt.experiments.independent.steps import RIGHT
from nusselt.experiments.results import study_tables
from nusselt.experiments.results.figures import GOLD, GREEN, RED, canvas
from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.mitsuba_bridge.reference import Reference
from nusselt.renderer.vectors import Floats

from .brought_images import brought, scene_named, text_of, truth_of
from .written_images import FORMAT

SAMPLES = 16
MARGIN = 1e-2
TURNS = 8
"""Images of a half of the limit."""
CLEAR = 5.0
"""Standard errors from which a mean square is more than noise."""
COLOURS = {"agrees": RED, "undecided": GOLD, "differs": GREEN}


def images_of(mistake: Mistake, steps: Any, width: int, seeds: Sequence[int], samples: int = SAMPLES) -> Floats:
    """Images (k, h, w, 3) of a mistake's scene by these steps."""
    text = text_of(mistake.scene)
    jittered = mistake.pixels != "centres"
    return np.array(
        [render(text, width, Options(samples, mistake.strata, jittered, seed=seed), steps) for seed in seeds]
    )


def rule_of(mistake: Mistake) -> Literal["area"] | None:
    """The pixel rule that a mistake's images are judged by."""
    return "area" if mistake.pixels == "areas" else None


def spread(images: Floats, shaded: Any) -> float:
    """Variance of one image's pixels, channels averaged, over the mean of those given."""
    return float(images.mean(axis=3).var(axis=0, ddof=1)[shaded].mean())


@lru_cache(maxsize=64)
def right_spread(scene: str, strata: bool, pixels: str, width: int, turns: int) -> float:
    """The same of right images."""
    told = (scene, strata, pixels)
    mistake = next(one for one in MISTAKES if (one.scene, one.strata, one.pixels) == told)
    shaded = _shaded(truth_of(scene_named(scene, width, rule_of(mistake))))
    return spread(images_of(mistake, RIGHT, width, range(1000, 1000 + turns)), shaded)


def _shaded(reference: Reference) -> Any:
    return (reference.emitter == 0) & (reference.background == 0)


def effect(mistake: Mistake, width: int, seed: int, turns: int) -> dict[str, float | None]:
    """What a mistake does, noise apart: relative to the truth's mean over shaded pixels.

    The square of the mean error is the product of two halves' errors, whose noise is independent.
    """
    reference = truth_of(scene_named(mistake.scene, width, rule_of(mistake)))
    shaded = _shaded(reference)
    truth = reference.mean.transpose(1, 2, 0)
    images = images_of(mistake, mistake.steps, width, range(seed, seed + 2 * turns))
    with np.errstate(invalid="ignore"):  # of images that are not finite
        one, other = (half.mean(axis=0) - truth for half in (images[:turns], images[turns:]))
        scale = float(truth.mean(axis=2)[shaded].mean()) or 1.0
        grey = [half.mean(axis=2)[shaded] for half in (one, other)]
        square = float((one * other).mean(axis=2)[shaded].mean())
        noise = images.var(axis=0, ddof=1).mean(axis=2)[shaded] / turns
        error = math.sqrt(float((noise**2).sum())) / noise.size
        noisy = spread(images, shaded)
    plain = np.abs(images[0] - truth).max(axis=2)[~shaded]
    variance = right_spread(mistake.scene, mistake.strata, mistake.pixels, width, 2 * turns)
    return {
        "effect_mean": (grey[0] + grey[1]).mean() / 2 / scale,
        "effect_rms": math.sqrt(square) / scale if not square <= CLEAR * error else 0.0,
        "effect_plain": float((~(plain < 1e-3)).mean()) if plain.size else 0.0,
        "effect_variance": noisy / variance if variance else None,
    }


def plant(number: int, width: int, turns: int, seed: int) -> Outcome:
    """One mistake, by its place: two images, and what they are called."""
    mistake, started = MISTAKES[number], time.process_time()
    kind = next(kind for kind, every in KINDS.items() if mistake in every)
    rule = rule_of(mistake)
    question = Question(estimator="area", samples=SAMPLES, stratified=mistake.strata, margin=MARGIN, pixel_rule=rule)
    scene = scene_named(mistake.scene, width, rule)
    images = images_of(mistake, mistake.steps, width, (seed, seed + 1))
    told = brought(scene, list(images), question, FORMAT["EXR"]).row
    size = effect(mistake, width, seed + 2, turns)
    finds = {"effect_mean": told["minimum_detectable_bias"], "effect_rms": told["finds"].get("rms")}
    large = any(least is None or not abs(size[name] or 0) <= least for name, least in finds.items())
    missed = told["verdict"] == "agrees" and (large or bool(size["effect_plain"]))
    row: Row = {
        "planted": mistake.name,
        "kind": kind,
        "what": mistake.says,
        "scene": mistake.scene,
        "hook": mistake.hook,
        "resolution": [scene.width, scene.height],
        "samples": SAMPLES,
        "stratified": mistake.strata,
        "margin": MARGIN,
        "verdict": told["verdict"],
        "reason": told["reason"],
        "minimum_detectable_bias": finds["effect_mean"],
        "finds": told["finds"],
        "bias_relative": told["bias_relative"],
        "rms_denoised_relative": told["rms_denoised_relative"],
        **size,
        "likely_mistakes": told["likely_mistakes"],
        "where": told["where"],
        "named": named(mistake, kind, told),
        "missed": missed,
        "as_claimed": not missed,
        "seconds": time.process_time() - started,
    }
    return Outcome([row])


def named(mistake: Mistake, kind: str, told: Row) -> str | None:
    """How a mistake that differs was told: "name" or "place" where that is right, "wrong" name, or "none"."""
    if told["verdict"] != "differs":
        return None
    names, places = names_of(mistake.name, kind), places_of(mistake.name, kind)
    first = next((one["name"] for one in told["likely_mistakes"]), None)
    if first is not None:
        return "name" if first in names else "wrong"
    return "place" if any(word in place for word in places for place in told["where"]) else "none"


def jobs(settings: Settings) -> list[Job]:
    """Every mistake; every eighth where it must be quick."""
    every = range(len(MISTAKES))
    numbers = settings.pick(every, every[::8], (0, 49))
    width, turns = settings.pick((96, TURNS), (64, 4), (24, 2))
    told = {"width": width, "turns": turns, "seed": settings.seed_of("planted-images") % 2**31}
    if settings.scenes:
        numbers = [number for number in every if MISTAKES[number].scene in settings.scenes]
    return [Job(plant, {"number": number, **told}) for number in numbers]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Effect of each mistake over what its row says it finds, by the word it was called."""
    rows = [outcome.rows[0] for outcome in outcomes]
    figure = canvas(8, 6)
    axis = figure.subplots()
    for word, colour in COLOURS.items():
        some = [row for row in rows if row["verdict"] == word]
        finds = [row["minimum_detectable_bias"] or 1.0 for row in some]
        for name, mark in (("effect_mean", "o"), ("effect_rms", "x")):
            sizes = [max(abs(row[name] or 0), 1e-5) for row in some]
            axis.plot(finds, sizes, mark, color=colour, ms=4, label=f"{word}, {name.removeprefix('effect_')}")
    ends = axis.get_xlim()
    axis.plot(ends, ends, "-", color="0.7", lw=1)
    axis.set(xscale="log", yscale="log", xlabel="bias that the row says it finds", ylabel="effect, relative")
    axis.legend(fontsize=8)
    missed = sum(row["missed"] for row in rows)
    axis.set_title(f"{len(rows)} mistakes: {missed} above what is found agree", fontsize=10)
    return {"mistakes": figure}


def _share(value: float | None) -> str:
    return "" if value is None else f"{100 * value:+.2f}"


def table(rows: Sequence[Row], width: int) -> Group:
    """Those that do not differ, and how many of each kind do."""
    counts = []
    for kind in dict.fromkeys(row["kind"] for row in rows):
        verdicts = [row["verdict"] for row in rows if row["kind"] == kind]
        counts.append(f"{kind} {verdicts.count('differs')} of {len(verdicts)}")
    missed = sum(row["missed"] for row in rows)
    told = Counter(row["named"] for row in rows if row["named"])
    title = f"{len(rows)} mistakes: {missed} agree that are above what their rows say they find"
    caption = (
        "differ: " + ", ".join(counts) + f". Of the {told.total()} that differ the right name is told of "
        f"{told['name']}, the right place of {told['place']}, a wrong name of {told['wrong']}, nothing of "
        f"{told['none']}. Above, the others, and those that do not differ."
    )
    lines: list[Row] = []
    for row in sorted(rows, key=lambda row: (row["verdict"], not row["missed"])):
        if row["named"] not in ("name", "place"):
            first = ", ".join(mistake["name"] for mistake in row["likely_mistakes"][:1])
            words = f"wrong: {first}" if row["named"] == "wrong" else "; ".join(row["where"][:1])
            line = {"mistake": row["planted"], "scene": row["scene"], "verdict": row["verdict"]}
            line |= {f"{name} %": _share(row[f"effect_{name.lower()}"]) for name in ("mean", "RMS", "plain")}
            line["variance"] = "" if row["effect_variance"] is None else f"{row['effect_variance']:.2f}"
            line |= {"MDB %": _share(row["minimum_detectable_bias"]), "missed": "missed" if row["missed"] else ""}
            lines.append(line | {"told": words, "as_claimed": not (row["missed"] or row["named"] == "wrong")})
    return study_tables.table(lines, title, width, hidden=("as_claimed",), caption=caption)


PLANTED_IMAGES = Experiment(
    "planted-images",
    "mistakes of an independent renderer, two images each: verdicts beside the size of their effect",
    jobs,
    figures,
    scenes=tuple(dict.fromkeys(mistake.scene for mistake in MISTAKES)),
    table=table,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(PLANTED_IMAGES)
