"""Somebody's Mitsuba scene as ours: Mitsuba parses the file, and what it says is put into our kinds, or refused."""

from __future__ import annotations

from .read import read_mitsuba

__all__ = ["read_mitsuba"]
