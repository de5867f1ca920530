"""pbrt-v4 scenes as ours, and ours as pbrt-v4: by its documentation and sources, never run against it."""

from __future__ import annotations

from .read import read_pbrt
from .write import pbrt_text

__all__ = ["pbrt_text", "read_pbrt"]
