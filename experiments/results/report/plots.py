"""Small vector figures that take their ink from the page: they work in dark and in light."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullFormatter

from nusselt.experiments.results.work_precision import TARGETS, Curve

INK = "#010203"
"""Stands for the page's colour of text until the figure is written."""
SERIES = ("#2f7ed8", "#e0642e", "#2a9d63", "#a25bd0", "#c9971c", "#d1447f", "#4aa3a3", "#8a7a6a")
"""Colours that read on white and on near-black."""
BINS = 10
LEAST = 3.5
"""Factor to either side that an axis shows at least: more than a decade, and so a number."""
SIZE = (7.4, 2.9)
"""Inches of an error figure."""
_MARK = 1e-4
"""Added to a curve's width for each curve before it: tells whose stroke an element of the file is."""
_STYLE: dict[str, Any] = {
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "legend.frameon": False,
    "legend.fontsize": 8,
    **dict.fromkeys(("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color"), INK),
}


def _svg(figure: Figure, name: str, label: str) -> str:
    """The figure as an element for a page: names made its own, ink the page's, a label for who cannot see it."""
    from markupsafe import escape

    stream = io.StringIO()
    with rc_context(_STYLE | {"svg.hashsalt": name}):
        figure.savefig(stream, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :].replace(INK, "currentColor")
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'href="#', f'href="#{name}-', text)
    text = text.replace("url(#", f"url(#{name}-")
    return text.replace("<svg ", f'<svg role="img" aria-label="{escape(label)}" ', 1)


def p_histogram(tile_p: Any, name: str) -> str | None:
    """How often each tile p-value occurs: flat where only noise differs. None where no tile has noise."""
    p = np.array(tile_p, dtype=float).ravel()
    p = p[np.isfinite(p)]
    if p.size == 0:
        return None
    with rc_context(_STYLE):
        figure = Figure(figsize=(3.6, 1.9))
        figure.subplots_adjust(left=0.13, right=0.97, bottom=0.25, top=0.95)  # a layout engine takes twice the time
        axis = figure.subplots()
        axis.hist(p, [k / BINS for k in range(BINS + 1)], color=SERIES[0], alpha=0.85, rwidth=0.92)
        axis.axhline(p.size / BINS, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
        axis.set(xlabel="p-value of a tile", ylabel="tiles", xlim=(0, 1))
        axis.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    low = int((p < 1 / BINS).sum())
    label = f"Histogram of {p.size} tile p-values: {low} below {1 / BINS:g}, {p.size / BINS:.1f} expected by chance"
    return _svg(figure, name, label)


@dataclass(frozen=True)
class ErrorFigure:
    """Relative RMS error against samples and against seconds: written into the page once, shown by many rows.

    Parameters
    ----------
    name : str
        Its element's id.
    svg : str
        The element; the width of curve k is the CSS variable ``--k``.
    curves : tuple of str
        Labels, in order.
    """

    name: str
    svg: str
    curves: tuple[str, ...]

    def shown(self, here: str) -> str:
        """An element that shows it, the curve named ``here`` drawn thicker."""
        from markupsafe import escape

        width, height = SIZE[0] * 72, SIZE[1] * 72
        thicker = f' style="--{self.curves.index(here)}: 2.4"' if here in self.curves else ""
        return (
            f'<svg role="img" aria-label="{escape(self.label)}" width="{width:g}pt" height="{height:g}pt" '
            f'viewBox="0 0 {width:g} {height:g}"{thicker}>'
            f'<use href="#{self.name}" width="{width:g}" height="{height:g}"/></svg>'
        )

    @property
    def label(self) -> str:
        return "Relative RMS error against samples and against seconds: " + ", ".join(self.curves)


def error_figure(found: Sequence[Curve], name: str) -> ErrorFigure | None:
    """The first curves of at least two numbers of samples; None where there is none."""
    shown = [curve for curve in found if len({p.samples or p.seconds for p in curve.points}) > 1][: len(SERIES)]
    if not shown:
        return None
    with rc_context(_STYLE):
        figure = Figure(figsize=SIZE)
        figure.subplots_adjust(left=0.085, right=0.985, bottom=0.16, top=0.97, wspace=0.06)
        axes = figure.subplots(1, 2, sharey=True)
        for axis, of, words in zip(axes, ("samples", "seconds"), ("samples per light", "seconds"), strict=True):
            for k, curve in enumerate(shown):
                points = [(getattr(p, of), p.error) for p in curve.points if getattr(p, of)]
                if points:
                    style = "--s" if curve.mitsuba else "-o"
                    x, y = zip(*points, strict=True)
                    width = 1.3 + _MARK * (k + 1)
                    axis.plot(x, y, style, color=SERIES[k], linewidth=width, markersize=3.5, label=curve.label)
            axis.set(xscale="log", yscale="log", xlabel=words)
            axis.axhline(TARGETS[1], color=INK, linewidth=0.6, linestyle=":")
            low, high = axis.get_xlim()
            middle, reach = math.sqrt(low * high), max(math.sqrt(high / low), LEAST)
            axis.set_xlim(middle / reach, middle * reach)
            axis.xaxis.set_minor_formatter(NullFormatter())  # numbers within a decade run into each other
        axes[0].set_ylabel("relative RMS error")
        axes[0].legend()
    made = ErrorFigure(name, "", tuple(curve.label for curve in shown))
    svg = _svg(figure, name, made.label).replace("<svg ", f'<svg id="{name}" ', 1)
    for k in range(len(shown)):
        svg = svg.replace(f"stroke-width: {1.3 + _MARK * (k + 1):g}", f"stroke-width: var(--{k}, 1.3)")
    return replace(made, svg=svg)
