"""What an image's values say of their own errors."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.image import Image
from nusselt.renderer.words import count

COARSE = 1e-6
"""A bound that is worth a word."""


def bound_note(image: Image) -> str:
    """The largest bound, and how many pixels are known worse than COARSE or have noise; for images with bounds."""
    if image.bound is None:
        raise ValueError("an image without bounds")
    known = np.isfinite(image.bound)
    worst, coarse, noisy = image.bound[known].max(initial=0.0), (image.bound[known] > COARSE).sum(), (~known).sum()
    told = [f"{count(noisy, 'pixel', 'is')} partly sampled, with noise"] if noisy else []
    if coarse:
        told.insert(0, f"{count(coarse, 'pixel', 'is')} known worse than {COARSE:g}")
    every = "every other value" if noisy else "every value"
    if worst:
        told.insert(0, f"{every} is within {worst:.1e} of what its light would give if nothing were in the way")
    return "; ".join(told) or f"{every} is exact to rounding"
