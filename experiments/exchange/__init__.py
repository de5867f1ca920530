"""Scenes of other programs, read as ours and written from ours: pbrt-v4 text, and USD."""
