"""The page of two images alone: side by side, flipped, their difference and the field's figures."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nusselt.experiments.images.distance import Pair, flip, relative_mse, similarity, z_scores
from nusselt.experiments.results.pictures import RANGE
from nusselt.experiments.results.rows import percent
from nusselt.renderer.vectors import Floats
from nusselt.renderer.words import count

from .entries import colours
from .offline import scripted
from .pixels import PRECISE, pack_all, texts

SHARE = 99.0
"""Percentile of the signed difference at which its colours end."""
Figure = dict[str, str]


def pair_html(pair: Pair, names: tuple[str, str], notes: Sequence[str]) -> tuple[str, list[Figure]]:
    """The page as text, and its figures: question, answer, and what the answer is.

    Parameters
    ----------
    pair : Pair
    names : tuple of str
        What the two sides are called.
    notes : sequence of str
        What reading the files left out or supposed.
    """
    told = z_scores(pair)
    layers = _layers(pair, None if told is None else told[0])
    packed = pack_all([lambda: layers], PRECISE)
    finite = np.abs(layers["signed"][np.isfinite(layers["signed"])])
    figures = _figures(pair, None if told is None else told[1])
    content = {
        "names": names,
        "figures": figures,
        "notes": notes,
        "packed": packed[0].info if packed[0] else None,
        "seeds": (len(pair.a), len(pair.b)),
        "blobs": texts(packed),
        "viewer": {
            "images": [one.info for one in packed if one],
            "tiles": [None],
            "colours": colours(),
            "ranges": {"signed": float(np.percentile(finite, SHARE)) if finite.any() else 1.0, "difference": RANGE},
        },
    }
    return scripted("pair.html", ("viewer.js", "pair.js"), content), figures


def _layers(pair: Pair, z: Floats | None) -> dict[str, Floats]:
    a, b = pair.means
    layers = {"ours": a, "reference": b, "signed": 100 * pair.signed[None]}
    return layers if z is None else layers | {"difference": z[None]}


def _figures(pair: Pair, z: float | None) -> list[Figure]:
    like, flipped, finite = similarity(pair), flip(pair), int(pair.finite.sum())
    mean = float(pair.signed[pair.finite].mean()) if finite else math.nan
    figures = [
        ("Difference of the means", percent(mean, 3, sign=True), "Of A − B, relative to B’s mean"),
        ("Relative MSE", f"{relative_mse(pair):.3g}", "Mean of (A − B)² / (B² + 0.01), as Rousselle et al. and pbrt"),
        (
            "SSIM",
            "too small" if like is None else f"{like:.4f}",
            "Of the eight-bit pictures at exposure 0; noise lowers it",
        ),
    ]
    about_z = "Of the mean, from the spread of the seeds; pixels are taken to be independent"
    figures.append(
        ("z", "not known", "Another seed of each side tells it: --seeds A2 B2")
        if z is None
        else ("z", f"{z:+.2f}", about_z)
    )
    figures.append(
        ("FLIP", "not measured", "The package flip-evaluator is not installed here: pip install 'nusselt[flip]'")
        if flipped is None
        else (
            "FLIP",
            f"{flipped[0]:.4f}",
            f"Mean {flipped[1]} of A against B, 67 pixels a degree; 0 is alike",
        )
    )
    if wrong := pair.finite.size - finite:
        figures.append(("Not finite", count(wrong, "pixel"), "In one of the images at least: in no figure above"))
    return [dict(zip(("question", "answer", "detail"), figure, strict=True)) for figure in figures]
