"""Figures of one look: drawn without a display, written as PNG and SVG, each saying what it shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.files import replacing
from nusselt.experiments.images.formats.png import to_levels
from nusselt.renderer.vectors import Floats

BLUE, RED, GREY, GREEN, GOLD = "#2b6cb0", "#c53030", "#718096", "#2f855a", "#b7791f"
COLOURS = (BLUE, RED, GREEN, GOLD, "#6b46c1", GREY)
STROKES = ("o-", "s--", "^:", "D-.", "v-", "P--", "X:", "*-.")
"""Marks and dashes: another one each time the colours begin anew."""
FOOT = 0.16
"""Inches below a figure for what made it."""


def canvas(width: float, height: float) -> Any:
    """An empty figure, in inches."""
    from matplotlib.figure import Figure  # slow to import, and drawn by Agg without a display

    return Figure(figsize=(width, height), layout="constrained")


def save(figure: Any, folder: Path, name: str) -> list[str]:
    """Write NAME.png and NAME.svg; returns their names."""
    from matplotlib import rc_context

    for suffix in (".png", ".svg"):
        with rc_context({"svg.hashsalt": "nusselt"}), replacing(folder / f"{name}{suffix}") as beside:
            figure.savefig(beside, dpi=140, metadata={"Date": None} if suffix == ".svg" else None)
    return [f"{name}.png", f"{name}.svg"]


def footnote(figure: Any, words: str) -> None:
    """Words in a strip of their own below a figure."""
    share = FOOT / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0, share, 1, 1 - share))
    figure.text(0.995, 0.2 * share, words, ha="right", va="bottom", fontsize=6, color=GREY)


def name_lines(axis: Any, size: int = 8) -> None:
    """Name the lines of a figure's axis beside it, where that covers none of them."""
    axis.figure.legend(*axis.get_legend_handles_labels(), loc="outside right upper", fontsize=size)


def curves(lines: Mapping[str, Sequence[Sequence[float]]], x: str, y: str, title: str) -> Any:
    """Log-log curves by name, points that are zero or missing left out."""
    figure = canvas(9, 5)
    axis = figure.subplots()
    looks = [(stroke, colour) for stroke in STROKES for colour in COLOURS]
    for (name, (xs, ys)), (stroke, colour) in zip(lines.items(), looks, strict=False):
        a, b = np.array(xs, dtype=float), np.array(ys, dtype=float)
        some = (a > 0) & (b > 0)
        axis.loglog(a[some], b[some], stroke, color=colour, label=name, ms=4, lw=1.4)
    axis.set(xlabel=x, ylabel=y)
    axis.set_title(title, fontsize=10, wrap=True)
    axis.grid(which="major", alpha=0.3)
    name_lines(axis)
    return figure


def strip(rows: Sequence[tuple[str, Sequence[tuple[str, Floats]]]], title: str) -> Any:
    """Images (3, h, w) in rows, each with its caption: what people compare at a glance."""
    across = max(len(images) for _, images in rows)
    height, width = rows[0][1][0][1].shape[1:]
    wide = 2.6
    figure = canvas(wide * across, (wide * height / width + 0.35) * len(rows) + 0.5)
    axes = figure.subplots(len(rows), across, squeeze=False)
    for axis in axes.flat:
        axis.set_axis_off()
    for line, (label, images) in zip(axes, rows, strict=True):
        for axis, (caption, image) in zip(line, images, strict=False):
            axis.imshow(to_levels(image).transpose(1, 2, 0), interpolation="nearest")
            axis.set_title(caption if not label else f"{label}, {caption}", fontsize=8)
    figure.suptitle(title, fontsize=10)
    return figure
