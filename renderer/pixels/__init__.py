"""Pixels without sampling, shaded only where the tolerance asks for it: by area with exact coverage, or centres."""

from __future__ import annotations

from .render_area import AreaImage, render_area
from .render_centre import CentreImage, render_centre

__all__ = ["AreaImage", "CentreImage", "render_area", "render_centre"]
