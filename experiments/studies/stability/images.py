"""Rows of twins: both images, their largest difference, and what Mitsuba makes of the extreme one as it stands."""

from __future__ import annotations

import math

import numpy as np

from nusselt.experiments.runs.experiment import Outcome
from nusselt.experiments.studies.stability.twins import Twin
from nusselt.mitsuba_bridge.reference import ReferenceUnavailable, render_reference
from nusselt.renderer.errors import InputError
from nusselt.renderer.image import Image, render
from nusselt.renderer.vectors import Floats

BLACK = 1e-20
"""Seen edge-on, a light leaves rounding of this size."""
TARGET = 1e-3
"""Relative standard error of Mitsuba's mean."""


def largest_difference(one: Floats, other: Floats) -> float:
    """Over pixels and channels, relative to the larger of the two; what is 1e-20 of the brightest is black."""
    size = np.maximum(np.abs(one), np.abs(other))
    size = np.maximum(size, BLACK * size.max())
    with np.errstate(invalid="ignore"):
        found = np.divide(np.abs(one - other), size, out=np.zeros_like(size), where=size != 0)
    return float(found.max()) if np.isfinite(one).all() and np.isfinite(other).all() else math.nan


def mitsuba_error(twin: Twin, ours: Image, seed: int) -> float | None:
    """Relative difference of Mitsuba's mean over shaded pixels, from the twin's; None where it has no answer."""
    try:
        theirs = render_reference(
            twin.one, seed=seed, target_relative_se=TARGET, max_samples=4096, timeout=120.0, normalise=False
        )
    except (ReferenceUnavailable, InputError):
        return None
    right = ours.mean[:, ours.shaded].mean() * twin.factor
    found = theirs.mean[:, ours.shaded].mean() / right - 1 if right > 0 else math.nan
    return float(found) if math.isfinite(found) else None


def twin_row(twin: Twin, seed: int, ask: bool) -> Outcome:
    """One row, in the columns of the stiff cases: value and oracle are the images' means."""
    one, image = render(twin.one, twin.estimator, seed=seed), render(twin.other, twin.estimator, seed=seed)
    other = twin.factor * image.mean
    if twin.centre:
        other = other[:, 1:2, 1:2]
    error = largest_difference(one.mean, other)
    row = {
        "name": twin.name,
        "kind": "image",
        "dtype": "float64",
        "form": twin.estimator.name,
        "value": float(one.mean.mean()),
        "error_bound": twin.bound,
        "oracle": f"{other.mean():.17g}",
        "relative_error": error,
        "bound_held": error <= twin.bound,
        "condition": None,
        "textbook_error": None,
        "mitsuba": mitsuba_error(twin, image, seed) if ask and twin.ask else None,
    }
    return Outcome([row])
