"""What an image's values say of their own errors."""

from __future__ import annotations

import numpy as np

from nusselt.renderer.image import Image

COARSE = 1e-6
"""A bound that is worth a word."""


def bound_note(image: Image) -> str:
    """The largest bound, and how many pixels are known worse than COARSE or have noise; for images with bounds."""
    if image.bound is None:
        raise ValueError("an image without bounds")
    known = np.isfinite(image.bound)
    worst, coarse, noisy = image.bound[known].max(initial=0.0), (image.bound[known] > COARSE).sum(), (~known).sum()
    told = f"every value is within {worst:.1e} of what its light would give if nothing were in the way"
    if coarse:
        told += f"; {coarse} pixels are known worse than {COARSE:g}"
    return told + (f"; {noisy} pixels are partly sampled and have noise" if noisy else "")
