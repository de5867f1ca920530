"""Box-filtered pixels without sampling: exact coverage, and shading only where the tolerance asks for it."""

from __future__ import annotations

from .render_area import AreaImage, render_area

__all__ = ["AreaImage", "render_area"]
