"""Errors of the closed forms against what makes a case stiff, the textbook's beside them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nusselt.experiments.results.figures import BLUE, GREY, RED, canvas, name_lines
from nusselt.experiments.runs.experiment import Outcome
from nusselt.renderer.vectors import Floats

FLOOR = 1e-17
"""No error at all is drawn here."""
STYLES = (
    ("relative_error", "float64", BLUE, "o", "ours, double"),
    ("relative_error", "float32", GREY, "o", "ours, single"),
    ("textbook_error", "float64", RED, "x", "textbook, double"),
    ("mitsuba", "float64", "#b7791f", "^", "Mitsuba (single)"),
)


def _panel(axis: Any, rows: Sequence[dict[str, Any]], x: Floats, keep: Any) -> None:
    for entry, dtype, colour, mark, label in STYLES:
        if entry == "textbook_error" and all(rows[k]["kind"] == "I" for k in keep):
            continue
        chosen = [k for k in keep if rows[k]["dtype"] == dtype and rows[k][entry] is not None]
        if chosen:
            y = np.maximum(np.abs([rows[k][entry] for k in chosen]), FLOOR)
            axis.loglog(x[chosen], y, mark, color=colour, label=label, ms=4, alpha=0.8)
    axis.axhline(2.2e-16, color="k", lw=0.6, ls=":")
    axis.grid(alpha=0.25)
    axis.set_ylim(FLOOR / 3, 1e3)


def error_figures(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """One figure of three panels: solid angle, height over the horizon, exponent."""
    found = [outcome for outcome in outcomes if "solid_angle" in outcome.arrays]
    if not found:
        return {}
    rows = [row for outcome in found for row in outcome.rows]
    angle, height, s = (np.concatenate([o.arrays[name] for o in found]) for name in ("solid_angle", "height", "s"))
    irradiance = [k for k, row in enumerate(rows) if row["kind"] == "E"]
    lobes = [k for k, row in enumerate(rows) if row["kind"] == "I"]
    figure = canvas(15, 4.8)
    axes = figure.subplots(1, 3, sharey=True)
    _panel(axes[0], rows, np.maximum(angle, 1e-18), irradiance)
    axes[0].set(xlabel="solid angle of the light, sr", ylabel="relative error", title="irradiance")
    _panel(axes[1], rows, np.maximum(height, 1e-14), [k for k in irradiance if height[k] > 0])
    axes[1].set(xlabel="height of its lowest corner over the horizon, relative", title="irradiance")
    _panel(axes[2], rows, s + 0.1, lobes)
    axes[2].set(xlabel="Phong exponent + 0.1", title="modified Phong lobe")
    name_lines(axes[0])
    figure.suptitle(
        f"Closed forms on {len(rows) // 2} stiff cases against oracles of 25 digits; dotted: rounding of double; "
        "a textbook value that is no number is not drawn",
        fontsize=10,
    )
    return {"errors": figure}
