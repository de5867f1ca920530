"""Somebody's Mitsuba scene as ours: Mitsuba parses its file or dict; what that says is of our kinds, or refused."""

from __future__ import annotations

from .read import read_mitsuba, read_mitsuba_dict

__all__ = ["read_mitsuba", "read_mitsuba_dict"]
