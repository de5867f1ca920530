"""Figures from the folder, put into the page as pictures: a script in one of them would not run."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

MEDIA = {".svg": "image/svg+xml", ".png": "image/png"}
BUDGET = 2_400_000
"""Bytes of all figures before base64, besides what the images leave of theirs: 3.2 MB in the file."""


def fitting(paths: list[Path], budget: int) -> dict[Path, Path]:
    """Which file to show of each figure: itself, a PNG beside it where it is too large, or none.

    Each may take a third of what the ones before it left.
    """
    found = {}
    for path in paths:
        files = [p for p in (path, path.with_suffix(".png")) if p.is_file() and p.stat().st_size <= budget / 3]
        if files:
            found[path] = files[0]
            budget -= files[0].stat().st_size
    return found


def drawings(paths: list[Path], files: dict[Path, Path]) -> dict[str, list[dict[str, Any]]]:
    """Figures as data addresses, and the names of those too large for the page.

    Parameters
    ----------
    files : dict
        As `fitting` chose them.
    """
    shown = []
    for path in paths:
        if path in files:
            data = base64.b64encode(files[path].read_bytes()).decode()
            name = path.stem.replace("-", " ").replace("_", " ")
            shown.append({"name": name, "source": f"data:{MEDIA[files[path].suffix]};base64,{data}"})
    return {"shown": shown, "left_out": [{"name": path.name} for path in paths if path not in files]}
