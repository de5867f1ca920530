"""The course's scene text format (CSE 168 `.test` files): read, and written."""

from __future__ import annotations

from .reader import parse_scene, read_scene
from .writer import write_scene

__all__ = ["parse_scene", "read_scene", "write_scene"]
