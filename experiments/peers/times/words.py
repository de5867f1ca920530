"""What tables say of times, in a terminal, on the page and in documents."""

from __future__ import annotations

from nusselt.experiments.results.schema import Row
from nusselt.experiments.results.work_precision import TARGETS

from .rows import UNTIL

TIME_COLUMNS = (
    "renderer",
    "pixels",
    "start-up",
    *(f"to {target:g}" for target in TARGETS),
    "stops at",
    "what is timed; beware",
)
CAPTION = (
    "Processor seconds of one thread, rendering alone; in brackets over Mitsuba's with the same pixels, the median of "
    "interleaved rounds and their range. Error: root mean square over surfaces, relative. > and ≤: a bound, as no "
    "image had that error, or the quickest already had. Stops: four times the samples leave 70 % of the error or more. "
    "Settings are those that make an image right, not those that make it quick."
)


def time_cells(row: Row) -> tuple[str, ...]:
    """A side's line."""
    stops = "" if row["stops_at"] is None else f"{row['stops_at']:.1e}"
    beware = "; ".join(filter(None, (row["timed"], row["beware"], row.get("reason"))))
    return (
        row["renderer"],
        {"centre": "centres", "area": "areas"}[row["pixel_rule"]],
        _seconds(row["start"]),
        *(_reached(one) for one in row["reached"]),
        stops,
        beware,
    )


def _reached(one: Row) -> str:
    told = " ".join(filter(None, (UNTIL[one["known"]], _seconds(one["processor"]))))
    if one["over_mitsuba"] is None:
        return told
    spread = one["over_mitsuba_range"]
    return f"{told} ({one['over_mitsuba']:.2g}{f' [{spread[0]:.2g}, {spread[1]:.2g}]' if spread else ''})"


def _seconds(value: float | None) -> str:
    return "–" if value is None else f"{value:.2g}"
