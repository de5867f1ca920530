"""Scenes: the classic ones, procedural ones, cameras, and shapes to build from."""
