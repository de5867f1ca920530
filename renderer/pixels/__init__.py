"""Pixels without sampling, shaded only where the tolerance asks for it: by area with exact coverage, or centres."""

from __future__ import annotations

import numpy as np

from .render_area import AreaImage, render_area
from .render_centre import CentreImage, render_centre

__all__ = ["AreaImage", "CentreImage", "render_area", "render_centre"]

np.empty(1 << 21)
"""16 MiB, freed at once: an allocator that has freed so large a block (glibc's) keeps smaller ones for the next image
instead of giving them back. To map and clear them anew took a fifth of a small image's time."""
