"""`results.json`: the truth from which every table and page is made."""

from __future__ import annotations

import datetime
import json
import math
import os
import platform
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from nusselt.experiments.files import replacing
from nusselt.renderer.errors import InputError

from .schema import SCHEMA, Row, check
from .status import EXIT

PACKAGES = ("nusselt", "numpy", "scipy", "mitsuba", "drjit", "scikit-image", "karellen-llvm-core")


def package_versions() -> dict[str, str | None]:
    """Installed version of each package that can change a figure, None where it is missing."""
    found: dict[str, str | None] = {}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = None
    return found


WIDEST = {"avx512f": "AVX-512", "avx2": "AVX2", "asimd": "NEON"}
"""Vectors of numbers, the widest first, by the flag that tells of them."""


def _of_processor(name: str) -> str:
    """An entry of the system's description of the first processor; empty where it has none."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.partition(":")[2].strip() for line in lines if line.startswith(name)), "")


def _instructions() -> str | None:
    flags = (_of_processor("flags") or _of_processor("Features")).split()
    return next((words for flag, words in WIDEST.items() if flag in flags), None)


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    return {
        "system": platform.system(),
        "processor": _of_processor("model name") or platform.processor() or platform.machine(),
        "instructions": _instructions(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "python": platform.python_version(),
    }


def plain(value: Any) -> Any:
    """The same as JSON types; numbers that are not finite become null, which every reader knows."""
    if isinstance(value, dict):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def document(rows: list[Row], **head: Any) -> dict[str, Any]:
    """A whole results file.

    Parameters
    ----------
    rows : list of dict
        One object a row.
    **head
        Further entries of the head, such as the false-alarm rate.
    """
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    return {
        "schema": SCHEMA,
        "machine": machine(),
        "versions": package_versions(),
        **head,
        "seconds": {"written": now},
        "rows": rows,
    }


def write_json(content: dict[str, Any], target: str) -> None:
    """Write to a file, or to standard output for "-".

    Raises
    ------
    InputError
        If it cannot be written there, or is not what `schema` says.
    """
    content = plain(content)
    check(content, target)
    text = json.dumps(content, indent=1, allow_nan=False, ensure_ascii=True) + "\n"
    if target == "-":
        sys.stdout.write(text)
        return
    with replacing(Path(target)) as beside:
        beside.write_text(text, encoding="utf-8")


def read_json(path: Path) -> dict[str, Any]:
    """A results file, or a folder's results.json.

    Raises
    ------
    InputError
        If there is none, or it is not what `schema` says: names the row, the entry and its value.
    """
    path = path / "results.json" if path.is_dir() else path
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError("results", str(path), f"a results.json ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise InputError("results", str(path), f"a results.json ({error})") from error
    check(content, str(path))
    checked: dict[str, Any] = content
    return checked


def exit_code(rows: list[Row]) -> int:
    """One not as claimed outweighs a reference that could not run, which outweighs undecided.

    No rows are a failure: nothing measured is nothing shown.
    """
    if not rows or any(row["as_claimed"] is False for row in rows):
        return EXIT["not as claimed"]
    if any("reference" in row and row["reference"]["renderer"] is None for row in rows):
        return EXIT["no reference"]
    if any(row["as_claimed"] is None for row in rows):
        return EXIT["undecided"]
    return EXIT["as claimed"]
