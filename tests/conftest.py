"""Tests import what they share by name: builders in `support`, and helpers of one another."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
for folder in sorted({path.parent for path in HERE.rglob("*.py")}):
    sys.path.insert(0, str(folder))
