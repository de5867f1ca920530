"""Jobs for Mitsuba's child: one that has done its job waits for another.

To start one costs a second of processor, and to compile its kernels again more. It ends with this process, however
that ends, when its pipe closes.
"""

from __future__ import annotations

import json
import os
import threading
import time
from pathlib import Path
from typing import Any

from .process import IDLE, Child, Progress

SLACK = 10.0
"""Seconds before a child would end by itself in which it is given no more work."""
LARGEST = 1 << 30
"""Bytes of memory that a child holds without work: one that holds more is not kept."""

Key = tuple[int, str, Path | None]
"""Of this process (not one it was forked from), a variant, and a library of LLVM."""

_waiting: dict[Key, tuple[Child, float]] = {}
_lock = threading.Lock()


def run_job(
    job: dict[str, Any],
    folder: Path,
    variant: str,
    llvm: Path | None,
    timeout: float,
    progress: Progress | None = None,
    fresh: bool = False,
) -> tuple[dict[str, Any], Path]:
    """Have a child do a job of `nusselt.mitsuba_bridge.child.tasks`.

    Parameters
    ----------
    job : dict
    folder : Path
        Where the job's files are, and its arrays will be.
    variant : str
        Of Mitsuba.
    llvm : Path or None
        The library that Dr.Jit is to use.
    timeout : float
        Seconds, for all of it.
    progress : callable, optional
    fresh : bool
        Whether the child must not have done anything before: times of first images.

    Returns
    -------
    dict
        What it ran with.
    Path
        The file of arrays.

    Raises
    ------
    ReferenceUnavailable
        If no child can be started, it aborts, takes too long, or prints no result.
    """
    job_file, out_file = folder / "job.json", folder / "out.npz"
    job_file.write_text(json.dumps({**job, "variant": variant}), encoding="utf-8")
    key = (os.getpid(), variant, llvm)
    asked = json.dumps([str(job_file), str(out_file)])
    child = None if fresh else _take(key)
    if child is None or not child.tell(asked):
        child = Child(["-m", "nusselt.mitsuba_bridge.child.worker"], llvm)
        child.tell(asked)
    try:
        told = child.answer(timeout, progress)
    except BaseException:
        child.end()
        raise
    if fresh or told.get("resident", 0) > LARGEST:
        child.end()
    else:
        _keep(key, child)
    return told, out_file


def _take(key: Key) -> Child | None:
    with _lock:
        child, since = _waiting.pop(key, (None, 0.0))
    if child is not None and time.monotonic() - since > IDLE - SLACK:
        child.end()
        return None
    return child


def _keep(key: Key, child: Child) -> None:
    """One of a kind is kept: work that is asked for in turn needs no more."""
    with _lock:
        surplus = _waiting.setdefault(key, (child, time.monotonic()))[0] is not child
    if surplus:
        child.end()
