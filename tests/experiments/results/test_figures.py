"""Figures: every line is told from every other, and words cover neither lines nor other words."""

from __future__ import annotations

import numpy as np
import pytest

from nusselt.experiments.results.figures import curves, footnote

SERIES = 13


@pytest.fixture(scope="module")
def drawn():
    """As an experiment draws it: many series all over the axes, long names, and what made it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    rng = np.random.default_rng(0)
    lines = {f"a method with a long name, {k}": ([1, 10, 100], rng.uniform(0.1, 10, 3)) for k in range(SERIES)}
    figure = curves(lines, "samples per light", "relative RMS", "a title")
    footnote(figure, "seed 0: nusselt run an-experiment --scenes a --scenes b --scenes c " * 2)
    FigureCanvasAgg(figure).draw()
    return figure


def test_no_two_series_look_alike(drawn):
    looks = {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in drawn.axes[0].lines}
    assert len(looks) == SERIES


def test_the_legend_lies_beside_the_lines(drawn):
    (legend,) = drawn.legends
    assert not legend.get_window_extent().overlaps(drawn.axes[0].get_window_extent())
    assert legend.get_window_extent().x1 <= drawn.bbox.x1


def test_the_footnote_lies_below_the_label_of_the_axis(drawn):
    foot = drawn.texts[-1].get_window_extent()
    assert foot.y1 <= drawn.axes[0].xaxis.label.get_window_extent().y0
    assert foot.y0 >= 0
