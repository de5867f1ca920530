"""Exit status, everywhere; a file of its own, since those who stop early wait for no library."""

from __future__ import annotations

EXIT = {"as claimed": 0, "not as claimed": 1, "bad input": 2, "undecided": 3, "no reference": 4}
"""Exit codes by what they say."""
