"""Where things lie."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SUPPORT = ROOT / "tests" / "support"
TEST_SCENES = ROOT / "tests" / "scenes" / "exact"
"""Small scenes that failed once."""
CLASSIC_SCENES = ROOT / "experiments" / "scenes"
