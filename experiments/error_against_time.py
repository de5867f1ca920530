"""Error against run time: our noise-free images and Mitsuba at its best, turn by turn on the same cores.

`python -m experiments.error_against_time [--scenes NAME ...] [--quick] [--seed S] [--out DIR] [--json FILE|-]`.
Ours is a method for direct light from polygons; Mitsuba is a general renderer. Every page says so.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

from mitsuba_bridge.child import ReferenceUnavailable
from renderer.errors import InputError

from .race.measure import Measured, Plan, Rule, measure, noise_free
from .race.rows import SENTENCE, TARGETS, raw, row
from .race.scenes import NAMES, race_scene
from .results import EXIT, document, write_json
from .views import views

QUICK = Plan(rounds=1, sizes=(4, 16, 64), truth=1e-4, longest=3.0)
RULES: tuple[Rule, ...] = ("area", "centre")
Row = dict[str, Any]


def run(
    scenes: Iterable[str] = NAMES,
    *,
    quick: bool = False,
    seed: int = 0,
    plan: Plan | None = None,
    side: int | None = None,
    count: int | None = None,
    progress: Callable[[str], None] | None = None,
) -> tuple[list[Row], dict[str, list[Measured]]]:
    """Race scenes; rows, and everything measured by ``scene/rule``.

    Parameters
    ----------
    side, count : int, optional
        Pixels high, and cameras a scene, instead of 256 (64 if quick) and 5 (2).

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba's LLVM variant does not run.
    """
    plan = plan or (QUICK if quick else Plan())
    rows: list[Row] = []
    measured: dict[str, list[Measured]] = {}
    for name in scenes:
        scene = race_scene(name, side or (64 if quick else 256))
        estimator = noise_free(scene)
        for rule in RULES:
            if estimator is None:
                rows += [_without(name, rule, target) for target in TARGETS]
                continue
            found = measured[f"{name}/{rule}"] = []
            for number, view in enumerate(views(scene, count or (2 if quick else 5))):
                if progress:
                    progress(f"{view.name}, {rule}")
                found.append(measure(view, estimator, rule, plan, seed + 100 * number, None))
            rows += [row(name, rule, target, estimator.name, found) for target in TARGETS]
    return rows, measured


def _without(scene: str, rule: Rule, target: float) -> Row:
    """The row of a scene for which nothing of ours is free of noise: nothing measured is never passed."""
    empty = dict.fromkeys(("mitsuba", "mitsuba_default", "ratio", "ratio_interval", "lower_bound_only"))
    ours = {"estimator": None, "seconds": None}
    note = "no estimator of ours is exact and without noise in this scene"
    return {
        "scene": scene,
        "pixel_rule": rule,
        "target": target,
        "ours": ours,
        **empty,
        "note": note,
        "as_claimed": None,
    }


def figure(name: str, found: list[Measured]) -> Any:
    """Error against seconds, both sides, all views and rounds."""
    from matplotlib.figure import Figure

    drawn = Figure(figsize=(8, 5.5), layout="constrained")
    axis = drawn.subplots()
    named: set[str] = set()

    def line(label: str, laps: list[tuple[float, float]], **style: Any) -> None:
        some = sorted(lap for lap in laps if lap[1] > 0)
        if some:
            axis.loglog(*zip(*some, strict=True), label=None if label in named else label, **style)
            named.add(label)

    for one in found:
        for laps, race in zip(one.ours, one.mitsuba, strict=True):
            line("ours", [(s, e) for _, s, e in laps], color="#2b6cb0", marker="o", ms=4, lw=1.5, zorder=3)
            ways = sorted({lap.way for lap in race.laps}, key=lambda way: way.name)
            for index, way in enumerate(ways):
                mine = [(lap.seconds, lap.error) for lap in race.laps if lap.way == way]
                line(f"Mitsuba: {way.name}", mine, color=f"C{index + 1}", marker=".", lw=0.8, alpha=0.7)
    axis.set(xlabel="seconds, both cores, first images apart", ylabel="RMS error over shaded pixels, relative")
    axis.set_title(f"{name}: {len(found)} cameras. {SENTENCE}", fontsize=9, wrap=True)
    axis.grid(which="major", alpha=0.3)
    axis.legend(fontsize=7)
    return drawn


@click.command()
@click.option("--scenes", multiple=True, type=click.Choice(NAMES), help="Instead of all; may be repeated.")
@click.option("--quick", is_flag=True, help="Small images, two cameras, one round.")
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=0, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for figures and results.json.")
@click.option("--json", "target", metavar="FILE|-", help="Write the results there ('-': standard output).")
def main(scenes: tuple[str, ...], quick: bool, seed: int, out: Path | None, target: str | None) -> None:
    """Race our noise-free images against Mitsuba at its best."""
    try:
        rows, measured = run(scenes or NAMES, quick=quick, seed=seed, progress=lambda view: click.echo(view, err=True))
        content = document(
            rows, seed=seed, quick=quick, raw={key: [raw(one) for one in v] for key, v in measured.items()}
        )
        for place in filter(None, (target, str(out / "results.json") if out else None)):
            write_json(content, place)
        if out:
            for key, found in measured.items():
                save(figure(key, found), out / f"{key.replace('/', '-')}.png")
    except InputError as error:
        click.echo(f"nusselt: {error}", err=True)
        sys.exit(EXIT["bad input"])
    except ReferenceUnavailable as problem:
        click.echo(f"nusselt: {problem}", err=True)
        sys.exit(EXIT["no reference"])
    for one in rows:
        if target != "-":
            click.echo(_line(one))
    claims = [one["as_claimed"] for one in rows]
    sys.exit(EXIT["not as claimed" if False in claims else "undecided" if None in claims else "as claimed"])


def save(drawn: Any, path: Path) -> None:
    """Write a figure whole, or not at all."""
    from .files import replacing

    with replacing(path) as beside:
        drawn.savefig(beside, dpi=140)


def _line(one: Row) -> str:
    told = f"{one['scene']:14} {one['pixel_rule']:7} {one['target']:7g}  "
    if one["ratio"] is None:
        return told + str(one["note"])
    low, high = one["ratio_interval"]
    bound = " or more" if one["lower_bound_only"] else ""
    seconds = f"ours {one['ours']['seconds']:.3g} s, Mitsuba {one['mitsuba']['seconds']:.3g} s"
    return (
        told + f"{seconds} ({one['mitsuba']['configuration']}), ratio {one['ratio']:.3g}{bound} [{low:.3g}, {high:.3g}]"
    )


if __name__ == "__main__":
    main()
