"""Does a verdict mean what it says? False-alarm rates on null data, and power on planted biases.

Thousands of reports are simulated and put through the verdict's own rules, many rows at once. Null data: both sides
draw their passes from the same law, which is normal, heavy-tailed, nearly without noise, of a tiny image, in colour,
with light points shared by all pixels, or real: passes of ours, or of Mitsuba's, rendered once. The margin is next to
nothing, so that every alarm the noise can give is given. Right images are diagnosed too, although they agree.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from scipy import stats

from nusselt.experiments.external.diagnosis.diagnose import NAMED_WRONGLY
from nusselt.experiments.results.figures import BLUE, GREY, RED, canvas
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.intervals import average, freedom_of
from nusselt.experiments.verdict.level import Level, findings
from nusselt.experiments.verdict.rules import MEAN
from nusselt.experiments.verdict.rules.mean import POWER
from nusselt.experiments.verdict.rules.normality import is_doubtful

from .right_names import WIDTH, names_of_right
from .stopping import stopping_rows
from .worlds import NOTHING, SIDE, SIMULATED, STILL, World, real_worlds

ROWS = 2
"""Rows of a simulated report."""
CHUNK = 1 << 24
"""Values simulated at once."""
MARGIN = 1e-4
"""Where a bias is planted."""
SURE = 0.99
"""Of every interval of a rate (Clopper & Pearson 1934)."""
LIMITS = ((1e-3, 30_000, 2e-3), (0.05, 2_000, 0.07))
"""False-alarm rates declared, reports to simulate, and what the upper limit of the rate found may be."""
NAMES = 800
"""Right images that are diagnosed."""
SLACK = 0.02
"""A prediction's own error: its degrees of freedom are approximate, and rows not taken for normal are not in it."""
BIASES = (5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2)
"""Planted, relative."""


def chunks(
    world: World, reports: int, rng: np.random.Generator, margin: float = NOTHING, bias: float = 0.0
) -> Iterator[Evidence]:
    """Rows of so many reports, some at a time."""
    step = max(1, CHUNK // (ROWS * sum(world.passes) * SIDE * SIDE))
    for start in range(0, reports, step):
        yield world.rows(rng, ROWS * min(step, reports - start), margin, bias)


def interval(hits: int, count: int) -> tuple[float, float]:
    """Clopper-Pearson interval of a rate."""
    found = stats.binomtest(hits, count).proportion_ci(SURE, method="exact")
    return float(found.low), float(found.high)


def rate_row(case: str, alpha: float, hits: int, count: int) -> dict[str, Any]:
    """How often something happened in so many reports at a level, with its interval."""
    rate = {"rate": hits / count, "rate_interval": list(interval(hits, count))}
    return {"case": case, "level": alpha, "reports": count, "hits": hits, **rate}


def false_alarms(world: World, alpha: float, reports: int, limit: float, seed: int) -> dict[str, Any]:
    """One row: how often a null report has a row that `differs`."""
    rng = np.random.default_rng(seed)
    enough = 6.7 * alpha / (limit - alpha) ** 2
    alarms = objected = 0
    for rows in chunks(world, reports, rng):
        said = findings(rows, Level(alpha, ROWS))
        differs = np.any([finding.fails for finding in said.values()], axis=0)
        alarms += int(differs.reshape(-1, ROWS).any(axis=1).sum())
        objected += int(is_doubtful(rows).sum())
    row = rate_row(f"false alarms: {world.name}", alpha, alarms, reports)
    low, high = row["rate_interval"]
    return row | {
        "allowed": limit,
        "undecided_share": objected / reports / ROWS,
        # With few reports the limit is high whatever the rate: then only too many alarms speak.
        "as_claimed": high <= limit if reports >= enough else low <= alpha,
    }


def power_at_smallest(world: World, alpha: float, reports: int, seed: int) -> dict[str, Any]:
    """One row: each simulated row is given the bias that it prints as the smallest it detects."""
    rng = np.random.default_rng(seed)
    level = Level(alpha, 1).of(MEAN)
    found_in = count = 0
    for rows in chunks(world, reports, rng, MARGIN):
        null = MEAN(rows, level).figures
        planted = null["bias_interval"][:, 0] + null["minimum_detectable_bias"]
        found_in += int((planted > MARGIN).sum())
        count += planted.size
    row = rate_row(f"power at the printed smallest detectable bias: {world.name}", alpha, found_in, count)
    low, high = row["rate_interval"]
    return row | {"expected": POWER, "as_claimed": low <= POWER <= high}


def power(world: World, bias: float, alpha: float, reports: int, seed: int) -> dict[str, Any]:
    """One row: how often a planted relative bias is found, and how often it should be."""
    rng = np.random.default_rng(seed)
    level = Level(alpha, 1).of(MEAN)
    hits = count = 0
    errors = []
    for rows in chunks(world, reports, rng, MARGIN, bias):
        finding = MEAN(rows, level)
        hits += int(finding.fails.sum())
        count += finding.fails.size
        errors.append(finding.figures["bias_relative_standard_error"] ** 2)
    error = float(np.sqrt(np.concatenate(errors).mean()))
    n, r, _ = world.passes
    freedom = (1 / n + 1 / r) ** 2 / ((1 / n) ** 2 / freedom_of_ours(world) + (1 / r) ** 2 / (r - 1))
    expected = float(stats.nct.sf(stats.t.isf(level / 2, freedom), freedom, (bias - MARGIN) / error))
    row = rate_row(f"power at {bias:.2%}: {world.name}", alpha, hits, count)
    low, high = row["rate_interval"]
    return row | {"expected": expected, "as_claimed": bool(low - SLACK <= expected <= high + SLACK)}


def freedom_of_ours(world: World) -> float:
    """What the pooled noise of ours is taken to have, on average."""
    return float(average(freedom_of(world.rows(np.random.default_rng(2), 400).ours.grey_variance)))


def world_named(name: str, passes: int, seed: int) -> World:
    """A simulated world, or a real one of so many passes."""
    known = {world.name: world for world in (*SIMULATED, STILL)}
    if name in known:
        return known[name]
    return {world.name: world for world in real_worlds(passes, seed)}[name]


def alarm_job(name: str, passes: int, reports: tuple[int, ...], seed: int) -> Outcome:
    """False alarms of a world at each level."""
    world = world_named(name, passes, seed)
    levels = zip(LIMITS, reports, strict=True)
    return Outcome([false_alarms(world, alpha, count, limit, seed) for (alpha, _, limit), count in levels])


def power_job(name: str, reports: int, seed: int) -> Outcome:
    """Power at the printed smallest detectable bias, and at planted ones."""
    world = world_named(name, 0, seed)
    rows = [power_at_smallest(world, 1e-3, reports, seed)]
    return Outcome(rows + [power(world, bias, 1e-3, reports // 2, seed) for bias in BIASES])


def stopping_job(rows: int, seed: int) -> Outcome:
    """Samples to a decision, looked for at any time and with doublings."""
    return Outcome(stopping_rows(rows, seed))


def names_job(start: int, count: int, seed: int) -> Outcome:
    """How often right images are given the name of a mistake, were they diagnosed."""
    named = names_of_right(range(start, start + count), WIDTH, seed)
    row = rate_row(f"names of right images, from {start}", NAMED_WRONGLY, len(named), count)
    low, _ = row["rate_interval"]
    return Outcome([row | {"allowed": NAMED_WRONGLY, "reason": ", ".join(named), "as_claimed": low <= NAMED_WRONGLY}])


REAL = ("ours against ours", "Mitsuba against Mitsuba")


def jobs(settings: Settings) -> list[Job]:
    """Every world at both levels, then power; fewer reports where it must be quick."""
    share, passes = settings.pick((1, 2048), (10, 204), (400, 48))
    reports = [count // share for _, count, _ in LIMITS]
    asked = {"passes": passes, "reports": reports, "seed": settings.seed}
    names = [*(world.name for world in SIMULATED), *REAL]
    alarms = [Job(alarm_job, {"name": name, **asked}, alone=name in REAL) for name in names]
    worlds = (SIMULATED[0].name, STILL.name)
    stopping = Job(stopping_job, {"rows": 4000 // share, "seed": settings.seed})
    power_jobs = [Job(power_job, {"name": n, "reports": 4000 // share, "seed": settings.seed}) for n in worlds]
    count = NAMES // share
    step = min(100, count)
    told = [Job(names_job, {"start": k, "count": step, "seed": settings.seed}) for k in range(0, count, step)]
    return [*alarms, *power_jobs, stopping, *told]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Rates with their intervals beside what is allowed or expected, and samples to a decision."""
    rows = [row for outcome in outcomes for row in outcome.rows]
    rates, stops = ([row for row in rows if ("rate" in row) == rated] for rated in (True, False))
    figure = canvas(8, 0.24 * len(rows) + 1.8)
    axis, below = figure.subplots(2, 1, height_ratios=(len(rates) + 1, len(stops) + 2))
    for place, row in enumerate(rates):
        low, high = row["rate_interval"]
        axis.plot([max(low, 1e-5), high], [place, place], color=BLUE, lw=2)
        axis.plot(row.get("allowed", row.get("expected")), place, "|", color=RED, ms=9)
    axis.set_xscale("log")
    axis.set_yticks(range(len(rates)), [f"{row['case']} ({row['level']:g})" for row in rates], fontsize=7)
    axis.invert_yaxis()
    axis.set_xlabel("rate, 99 % interval; red: allowed, or predicted")
    axis.set_title(f"Verdicts calibrated: {sum(row['reports'] for row in rows):,} simulated reports", fontsize=10)
    for place, row in enumerate(stops):
        below.plot([row["times"], row["times_doubling"]], [place, place], color=GREY, lw=1)
        below.plot(row["times"], place, "o", color=BLUE, ms=5)
        below.plot(row["times_doubling"], place, "|", color=RED, ms=9)
    below.set_xscale("log")
    below.set_yticks(range(len(stops)), [row["case"].partition(": ")[2] for row in stops], fontsize=7)
    below.invert_yaxis()
    below.set_xlabel("samples to a decision over the first look's; red: with doublings")
    return {"rates": figure}


CALIBRATION = Experiment(
    "calibration", "false-alarm rates on null data and power on planted biases, with intervals", jobs, figures
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(CALIBRATION)
