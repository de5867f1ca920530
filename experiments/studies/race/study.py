"""Error against run time: our noise-free images and Mitsuba at its best, turn by turn on the same cores.

Ours is a method for direct light from polygons; Mitsuba is a general renderer. Every page says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

from nusselt.experiments.results.figures import canvas, name_lines
from nusselt.experiments.results.schema import Row
from nusselt.experiments.runs.experiment import NONE_OWN, Experiment, Job, Outcome, Settings
from nusselt.experiments.runs.own import Own
from nusselt.experiments.scenes.cameras import views
from nusselt.experiments.studies.race.measure import Measured, Plan, Rule, by_silhouettes, measure, racer
from nusselt.experiments.studies.race.page import text
from nusselt.experiments.studies.race.rows import (
    EVERY,
    SENTENCE,
    TARGETS,
    finalists,
    own_rows,
    raw,
    row,
    without_interpolation,
)
from nusselt.experiments.studies.race.scenes import NAMES, race_scene
from nusselt.mitsuba_bridge.race import DEFAULT, Way
from nusselt.renderer.errors import InputError
from nusselt.renderer.words import count

FEW = (Way("multijitter", 0), Way("multijitter", 1), DEFAULT)
QUICK = Plan(rounds=1, sizes=(4, 16, 64), truth=1e-4, longest=3.0, ways=FEW)
TINY = Plan(rounds=1, sizes=(4, 16), truth=1e-3, longest=1.0, ways=FEW[1:])
QUICK_SCENES = ("quad", "cornell-boxes")
RULES: tuple[Rule, ...] = ("area", "centre")
PLAN_BIG = Plan(
    sizes=(16, 64, 256, 1024, 4096),
    longest=20.0,
    ways=(Way("multijitter", 0), Way("ldsampler", 0), Way("orthogonal", 0), Way("multijitter", 1), DEFAULT),
)
LONGEST = Plan(
    sizes=(16, 64, 256, 1024, 4096, 16384, 65536, 262144, 1048576, 4194304),
    truth=1e-5,
    longest=7200.0,
    ways=(Way("multijitter", 0), Way("ldsampler", 0), Way("orthogonal", 0), DEFAULT),
    enough=min(TARGETS),
    timeout=24 * 3600.0,
)
"""Until Mitsuba's error is the smallest that is asked for."""
LONG_SCENES = ("quad", "cornell-boxes", "cornell")
CAMERAS = {"quad": 3, "near-light": 3, "cornell-boxes": 3}
"""Of a scene, for pixels by area; elsewhere one: more take too long to be run with everything else."""
BIG = 20_000
"""Triangles beyond which Mitsuba takes more samples, and pixels by area are left out: to 1e-4 they take us minutes."""
NONE = "no estimator of ours is exact and without noise in this scene"
DEAR = "not run: where pixels show several small faces each, ours by area takes minutes to 1e-4"
OWN_MARKS = "sD^v*P"


def run(
    scenes: Iterable[str] = NAMES,
    *,
    quick: bool = False,
    seed: int = 0,
    plan: Plan | None = None,
    side: int | None = None,
    count: int | None = None,
    own: Own = NONE_OWN,
    rules: Sequence[Rule] = RULES,
    progress: Callable[[str], None] | None = None,
) -> tuple[list[Row], dict[str, list[Measured]]]:
    """Race scenes; rows, and everything measured by ``scene/rule``.

    All of Mitsuba's ways run on a scene's first view, those that came to a target among the first three, and its
    default, on the others.

    Parameters
    ----------
    side, count : int, optional
        Pixels high, and cameras a scene, instead of 256 (64 if quick) and `CAMERAS` (1).
    own : Own
        The user's estimators and renderers, against the same truth.
    rules : sequence of {"area", "centre"}

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba's LLVM variant does not run.
    """
    rows: list[Row] = []
    measured: dict[str, list[Measured]] = {}
    for name in scenes:
        scene = race_scene(name, side or (64 if quick else 256))
        estimator = racer(scene)
        big = sum(mesh.triangles.shape[1] for mesh in scene.meshes) > BIG
        plans = plan or (QUICK if quick else PLAN_BIG if big else Plan())
        for rule in rules:
            if estimator is None:
                rows += [_without(name, rule, target, NONE) for target in TARGETS]
                continue
            if big and rule == "area":
                rows += [_without(name, rule, target, DEAR) for target in TARGETS]
                continue
            found = measured[f"{name}/{rule}"] = []
            cameras = count or (CAMERAS.get(name, 1) if rule == "area" and not quick else 1)
            for number, view in enumerate(views(scene, cameras)):
                if progress:
                    progress(f"{view.name}, {rule}")
                workers = found[0].workers if found else None
                mine = replace(plans, ways=finalists(found[0])) if found else plans
                found.append(measure(view, estimator, rule, mine, seed + 100 * number, workers=workers, own=own))
            rows += [row(name, rule, target, estimator.name, found) for target in TARGETS]
            rows += [line for target in TARGETS for line in own_rows(name, rule, target, found)]
            if rule == "centre" and by_silhouettes(scene, estimator):
                every = [without_interpolation(one) for one in found]
                rows += [row(name, EVERY, target, estimator.name, every) for target in TARGETS]
    return rows, measured


def _without(scene: str, rule: Rule, target: float, note: str) -> Row:
    """The row of a scene for which nothing of ours can run: nothing measured is never passed."""
    empty = dict.fromkeys(("mitsuba", "mitsuba_default", "ratio", "ratio_interval", "lower_bound_only"))
    ours = {"estimator": None, "seconds": None}
    return {
        "scene": scene,
        "pixel_rule": rule,
        "target": target,
        "ours": ours,
        **empty,
        "note": note,
        "as_claimed": None,
    }


def figure(name: str, views_raw: Sequence[dict[str, Any]]) -> Any:
    """Error against seconds, both sides, all views and rounds, from the raw laps."""
    drawn = canvas(10.5, 5.5)
    axis = drawn.subplots()
    named: set[str] = set()

    def line(label: str, laps: list[dict[str, Any]], **style: Any) -> None:
        some = sorted((lap["seconds"], lap["error"]) for lap in laps if lap["error"] > 0)
        if some:
            axis.loglog(*zip(*some, strict=True), label=None if label in named else label, **style)
            named.add(label)

    for one in views_raw:
        for laps, race, own in zip(one["ours"], one["mitsuba"], one["own"], strict=True):
            line("ours", laps, color="#2b6cb0", marker="o", ms=4, lw=1.5, zorder=3)
            for index, name_of_own in enumerate(dict.fromkeys(lap["estimator"] for lap in own)):
                laps_of_own = [lap for lap in own if lap["estimator"] == name_of_own]
                line(name_of_own, laps_of_own, color="k", marker=OWN_MARKS[index % len(OWN_MARKS)], ms=5, lw=1.5)
            for index, way in enumerate(sorted({lap["configuration"] for lap in race})):
                mine = [lap for lap in race if lap["configuration"] == way]
                line(f"Mitsuba: {way}", mine, color=f"C{index + 1}", marker=".", lw=0.8, alpha=0.7)
    axis.set(xlabel="seconds, both cores, first images apart", ylabel="RMS error over shaded pixels, relative")
    axis.set_title(f"{name}: {count(len(views_raw), 'camera')}. {SENTENCE}", fontsize=9, wrap=True)
    axis.grid(which="major", alpha=0.3)
    name_lines(axis, 7)
    return drawn


def _race(scene: str, seed: int, own: Own, size: dict[str, Any]) -> Outcome:
    """One scene; the first row of each pixel rule keeps the raw times."""
    rows, measured = run((scene,), seed=seed, own=own, **size)
    for rule in RULES:
        if (found := measured.get(f"{scene}/{rule}")) is not None:
            first = next(one for one in rows if one["pixel_rule"] == rule)
            first["raw"] = [raw(one) for one in found]
    return Outcome(rows)


def jobs(settings: Settings) -> list[Job]:
    """One a scene, each with the machine to itself; two scenes where it must be quick."""
    for name in settings.scenes:
        if name not in NAMES:
            raise InputError("scenes", name, "one of " + ", ".join(NAMES))
    usual = LONG_SCENES if settings.long else NAMES
    chosen = settings.scenes or settings.pick(usual, QUICK_SCENES, QUICK_SCENES[:1])
    shared = {
        "seed": settings.seed_of("race"),
        "own": settings.own,
        "size": {"plan": LONGEST, "rules": ("area",)}
        if settings.long
        else settings.pick({"quick": False}, {"quick": True}, {"plan": TINY, "side": 12, "count": 1}),
    }
    return [Job(_race, {"scene": name, **shared}, alone=True) for name in chosen]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """One a scene and pixel rule."""
    rows = [one for outcome in outcomes for one in outcome.rows if "raw" in one]
    return {
        f"{one['scene']}-{one['pixel_rule']}": figure(f"{one['scene']}, {one['pixel_rule']}", one["raw"])
        for one in rows
    }


ERROR_AGAINST_TIME = Experiment(
    "error-against-time",
    "our noise-free images against Mitsuba at its best, turn by turn",
    jobs,
    figures,
    NAMES,
    text=text,
    takes_own=True,
    takes_long=True,
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(ERROR_AGAINST_TIME)
