"""Does a verdict mean what it says? False-alarm rates on null data, and power on planted biases.

Thousands of reports are simulated and put through the verdict's own rules, many rows at once. Null data: both sides
draw their passes from the same law, which is normal, heavy-tailed, nearly without noise, of a tiny image, in colour,
with light points shared by all pixels, or real: passes of ours, or of Mitsuba's, rendered once. The margin is next to
nothing, so that every alarm the noise can give is given.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from nusselt.experiments.results.figures import BLUE, RED, canvas
from nusselt.experiments.runs.experiment import Experiment, Job, Outcome, Settings
from nusselt.experiments.scenes.catalogue import load
from nusselt.experiments.verdict.evidence import Evidence
from nusselt.experiments.verdict.intervals import average, freedom_of
from nusselt.experiments.verdict.level import Level, findings
from nusselt.experiments.verdict.rules import MEAN
from nusselt.experiments.verdict.rules.mean import POWER
from nusselt.experiments.verdict.rules.normality import is_doubtful
from nusselt.experiments.verdict.side import Seen, Side
from nusselt.mitsuba_bridge.variance import Setting, measure_spread
from nusselt.renderer.estimators import Area
from nusselt.renderer.image import render
from nusselt.renderer.vectors import Floats

ROWS = 2
"""Rows of a simulated report."""
OURS, THEIRS, OTHERS = 4, 32, 8
"""Passes of ours (the fewest of a check), of the reference, and of Mitsuba's own variance."""
SIDE = 20
"""Pixels a side."""
COLOUR = np.array([0.8, 0.5, 0.2], dtype=np.float32)[:, None]
CHUNK = 1 << 24
"""Values simulated at once."""
NOTHING = 1e-9
"""A margin next to nothing."""
MARGIN = 1e-4
"""Where a bias is planted."""
SURE = 0.99
"""Of every interval of a rate (Clopper & Pearson 1934)."""
LIMITS = ((1e-3, 30_000, 2e-3), (0.05, 2_000, 0.07))
"""False-alarm rates declared, reports to simulate, and what the upper limit of the rate found may be."""
SLACK = 0.02
"""A prediction's own error: its degrees of freedom are approximate, and rows not taken for normal are not in it."""
BIASES = (5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2)
"""Planted, relative."""

Draw = Callable[[np.random.Generator, int, int], Floats]
"""(generator, rows, passes) to values (rows, passes, channels, pixels) whose mean is the same for all passes."""


@dataclass(frozen=True)
class World:
    """A law of noise.

    Parameters
    ----------
    name : str
    draw : callable
    shares_points : bool
        Whether the pixels of a pass do; then ours gets as many passes as the reference.
    """

    name: str
    draw: Draw
    shares_points: bool = False

    @property
    def passes(self) -> tuple[int, int, int]:
        return (THEIRS, THEIRS, 0) if self.shares_points else (OURS, THEIRS, OTHERS)

    def rows(self, rng: np.random.Generator, count: int, margin: float = NOTHING, bias: float = 0.0) -> Evidence:
        """Rows whose bias, relative to the reference's mean, is the one given."""
        n, r, k = self.passes
        ours, theirs, others = np.split(self.draw(rng, count, n + r + k), [n, n + r], axis=1)
        ours = ours + bias * theirs.mean() if bias else ours
        return simulated(ours, theirs, others if k else None, margin, self.shares_points)


def simulated(ours: Floats, theirs: Floats, others: Floats | None, margin: float, shares_points: bool) -> Evidence:
    """Evidence of square images all of whose pixels are shaded, from the passes (b, r, c, p) of both sides.

    Parameters
    ----------
    others : (b, k, c, p) float, optional
        Passes of Mitsuba's image for the same strategy.
    """
    mine, their = Side.of_passes("ours", ours, shares_points), Side.of_passes("the reference", theirs, True)
    nothing = np.zeros(mine.grey_variance.shape)
    side = math.isqrt(mine.mean.shape[2])
    return Evidence(
        mine,
        their,
        (side, side),
        np.arange(side * side),
        (Seen(mine.mean, nothing, nothing), Seen(their.mean, nothing, nothing)),
        unjudged=np.zeros(side * side, dtype=bool),
        margin=margin,
        shares_points=shares_points,
        variance=None if others is None else others.mean(axis=2).var(axis=1, ddof=1, dtype=np.float64) / ours.shape[1],
    )


def _levels(pixels: int) -> Floats:
    """Standard deviations that differ from pixel to pixel as in a picture."""
    return np.asarray(0.0125 * np.random.default_rng(1).gamma(4.0, size=pixels), dtype=np.float32)


def _normal(side: int, share: float = 1.0) -> Draw:
    sigma = np.float32(share) * _levels(side * side)

    def draw(rng: np.random.Generator, rows: int, passes: int) -> Floats:
        return 1 + sigma * rng.standard_normal((rows, passes, 1, side * side), dtype=np.float32)

    return draw


def _heavy(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """Lognormal with a standard deviation of 2.9 means: excess kurtosis 10^4."""
    values = np.exp(1.5 * rng.standard_normal((rows, passes, 1, SIDE * SIDE), dtype=np.float32) - 1.125)
    return np.asarray(values)


def _pareto(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """Pareto with exponent 2.5: a variance, and no third moment."""
    return np.asarray(rng.random((rows, passes, 1, SIDE * SIDE), dtype=np.float32).clip(1e-7) ** (-1 / 2.5) * 0.6)


def _quiet(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """One pixel in fifty has noise."""
    values = np.ones((rows, passes, 1, SIDE * SIDE))
    noisy = slice(0, SIDE * SIDE, 50)
    values[..., noisy] += 0.3 * rng.standard_normal(values[..., noisy].shape)
    return values


def _coloured(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """Three channels, each with noise in common with the others and as much of its own."""
    noise = rng.standard_normal((2, rows, passes, 3, SIDE * SIDE), dtype=np.float32)
    return COLOUR * (1 + _levels(SIDE * SIDE) * (noise[0] + noise[1, :, :, :1]))


def _shared(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """Every pixel of a pass has the same light points."""
    own = 0.01 * rng.standard_normal((rows, passes, 1, SIDE * SIDE), dtype=np.float32)
    return np.asarray(1 + own + 0.1 * rng.standard_normal((rows, passes, 1, 1), dtype=np.float32))


def _shared_in_colour(rng: np.random.Generator, rows: int, passes: int) -> Floats:
    """The same in three channels: some of what the light points bring has a colour of its own."""
    return COLOUR * (_shared(rng, rows, passes) + 0.1 * rng.standard_normal((rows, passes, 3, 1), dtype=np.float32))


def from_pool(pool: Floats) -> Draw:
    """Whole passes out of a pool (passes, channels, pixels), dealt like cards: none twice in a row."""

    def draw(rng: np.random.Generator, rows: int, passes: int) -> Floats:
        hands = len(pool) // passes
        deals = [rng.permutation(len(pool))[: hands * passes].reshape(hands, passes) for _ in range(-(-rows // hands))]
        return pool[np.concatenate(deals)[:rows]]

    return draw


SIMULATED = (
    World("normal", _normal(SIDE)),
    World("tiny image", _normal(10)),
    World("one pixel", _normal(1)),
    World("heavy-tailed (lognormal)", _heavy),
    World("heavy-tailed (Pareto 2.5)", _pareto),
    World("nearly without noise", _quiet),
    World("three channels", _coloured),
    World("shared light points", _shared, shares_points=True),
    World("shared light points, three channels", _shared_in_colour, shares_points=True),
)


STILL = World("normal, a tenth of the noise", _normal(SIDE, 0.1))


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


def real_worlds(passes: int, seed: int, timeout: float = 300.0) -> tuple[World, ...]:
    """Pools of passes of ours, and of Mitsuba's, of one small scene with a penumbra.

    Raises
    ------
    ReferenceUnavailable
        If Mitsuba cannot run here.
    """
    scene = load("cornell-boxes").with_(width=SIDE, height=SIDE)
    estimator = Area(samples=4, stratified=True)
    images = [render(scene, estimator, seed=seed + number) for number in range(passes)]
    ours = np.array([np.where(image.shaded, image.mean, 0).reshape(3, -1) for image in images])
    (found,) = measure_spread(scene, [Setting("stratified", 4, passes)], seed=seed, timeout=timeout, images=True)
    theirs = np.asarray(found.images).reshape(passes, 1, -1)
    return World("ours against ours", from_pool(ours)), World("Mitsuba against Mitsuba", from_pool(theirs))


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


REAL = ("ours against ours", "Mitsuba against Mitsuba")


def jobs(settings: Settings) -> list[Job]:
    """Every world at both levels, then power; fewer reports where it must be quick."""
    share, passes = settings.pick((1, 2048), (10, 204), (400, 48))
    reports = [count // share for _, count, _ in LIMITS]
    told = {"passes": passes, "reports": reports, "seed": settings.seed}
    names = [*(world.name for world in SIMULATED), *REAL]
    alarms = [Job(alarm_job, {"name": name, **told}, alone=name in REAL) for name in names]
    worlds = (SIMULATED[0].name, STILL.name)
    return alarms + [Job(power_job, {"name": n, "reports": 4000 // share, "seed": settings.seed}) for n in worlds]


def figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Rates with their intervals beside what is allowed or expected."""
    rows = [row for outcome in outcomes for row in outcome.rows]
    figure = canvas(8, 0.24 * len(rows) + 1.2)
    axis = figure.subplots()
    for place, row in enumerate(rows):
        low, high = row["rate_interval"]
        axis.plot([max(low, 1e-5), high], [place, place], color=BLUE, lw=2)
        axis.plot(row.get("allowed", row.get("expected")), place, "|", color=RED, ms=9)
    axis.set_xscale("log")
    axis.set_yticks(range(len(rows)), [f"{row['case']} ({row['level']:g})" for row in rows], fontsize=7)
    axis.invert_yaxis()
    axis.set_xlabel("rate, 99 % interval; red: allowed, or predicted")
    axis.set_title(f"Verdicts calibrated: {sum(row['reports'] for row in rows):,} simulated reports", fontsize=10)
    return {"rates": figure}


CALIBRATION = Experiment(
    "calibration", "false-alarm rates on null data and power on planted biases, with intervals", jobs, figures
)

if __name__ == "__main__":
    from nusselt.experiments.runs.script import script

    script(CALIBRATION)
