"""`nusselt sensors`: irradiance at points."""

from __future__ import annotations

import shlex
import sys
from collections import Counter

import click

from nusselt.experiments.check.question import MOST_SAMPLES
from nusselt.experiments.check.request import Reading
from nusselt.experiments.console import console, say
from nusselt.experiments.results.document import document, exit_code, write_json
from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.summary import VERDICTS
from nusselt.experiments.sensors.question import SensorQuestion
from nusselt.experiments.sensors.rows import read
from nusselt.experiments.sensors.table import sensor_table
from nusselt.experiments.terminal.options import json_option, reading_options, seed_option
from nusselt.experiments.terminal.progress import progress_bar
from nusselt.experiments.workers import PATIENCE, worker_pool
from nusselt.renderer.words import count


@click.command()
@click.argument("scenes", metavar="SCENE...", nargs=-1, required=True)
@click.option("--estimator", metavar="NAME", default="exact", show_default=True, help="See: nusselt list.")
@click.option("--samples", type=click.IntRange(1, MOST_SAMPLES), help="Per light, instead of the scene's.")
@click.option("--stratify/--no-stratify", "stratified", default=None, help="Instead of the scene's.")
@click.option("--margin", type=float, default=1e-3, show_default=True, help="Relative difference that does not matter.")
@click.option("--alpha", type=float, default=1e-3, show_default=True, help="Chance that any right sensor fails.")
@seed_option
@click.option("--timeout", type=float, default=600.0, show_default=True, help="Seconds for each side.")
@click.option("--mitsuba/--no-mitsuba", default=True, help="Ask Mitsuba too, or only what the scene expects.")
@reading_options
@json_option
def command(*, scenes: tuple[str, ...], reading: Reading, target: str | None, alpha: float, **asked: object) -> None:
    """What the sensors of each SCENE read: by ours, by Mitsuba, and as the scene expects.

    \b
    sensor x y z  nx ny nz                       a point, and its lit side
    sensorGrid corner ab ac  nx ny nz  nab nac   middles of a plate's cells
    expect r g b percent                         what the last one should read
    """
    question = SensorQuestion(alpha=alpha / len(scenes), **asked)  # type: ignore[arg-type]
    rows: list[Row] = []
    with worker_pool(None, PATIENCE) as pool:
        for name in scenes:
            scene = reading.scene(name)
            again = shlex.join(["nusselt", "sensors", name, "--estimator", str(question.estimator)])
            with progress_bar(scene.name) as report:
                rows += read(scene, question, command=again, executor=pool, progress=report)
    if target:
        write_json(document(rows, seed=question.seed, alpha=alpha), target)
    told = console(stderr=target == "-")
    told.print(sensor_table(rows, told.width))
    for row in rows:
        if row.get("verdict", "agrees") != "agrees":
            say(told, f"{row['scene']}, sensor {row['sensor']} {row['verdict']}: {row['reason']}")
    for warning in dict.fromkeys(warning for row in rows for warning in row["warnings"]):
        say(told, f"warning: {warning}")
    for problem in sorted({note for row in rows for note in row.get("reference", {}).get("notes", ())}):
        say(told, f"Mitsuba: {problem}")
    words = Counter(row.get("verdict", "not judged") for row in rows)
    each = ", ".join(f"{number} {word if number == 1 else VERDICTS.get(word, word)}" for word, number in words.items())
    say(told, f"{count(len(rows), 'sensor')}: {each}")
    sys.exit(exit_code([row for row in rows if "as_claimed" in row]) if any("as_claimed" in row for row in rows) else 0)
